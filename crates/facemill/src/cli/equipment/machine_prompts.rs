//! Questions of `facemill machine new` for what its options leave out.

use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};

use facemill::Failure;
use facemill::inverse_kinematics::measured::MeasuredFamily;

use crate::cli::equipment::machine_new::{
    NewMachineArguments, finite, lean, limits, machine_name, measured_machine, numbers, sense,
};

/// Output file that an empty answer stands for.
const DEFAULT_OUT: &str = "machine.json";

/// Values of a machine in the order of the questions: key, its meaning, and form and unit of its
/// answer. Senses come first, as limits and homes are readings of the axes.
const QUESTIONS: [(&str, &str, &str); 12] = [
    ("sense", "sense compared with ISO 841", "iso or reversed"),
    ("table_at", "readings of X, Y, Z with the spindle nose on the table's origin", "X,Y,Z in mm"),
    ("table_tilt", "a point on the tilting axis, seen from the table's origin", "X,Y,Z in mm"),
    ("pivot_length", "from the spindle nose up to the tilting axis", "mm, above 0"),
    ("pivot_offset", "tilting axis beside the spindle's centre line, toward +X (B) or +Y (A)", "mm"),
    ("c_offset", "C axis, seen from the spindle's centre line", "X,Y in mm"),
    ("lean", "direction toward which the tilting axis leans from z, upward", "+y or -y"),
    ("limits", "limits", "MIN:MAX or endless"),
    ("home", "home position", ""),
    ("rapid", "rapid velocity", "/min"),
    ("acceleration", "largest acceleration", "/s²"),
    ("jerk", "largest jerk", "/s³"),
];

/// A dialogue: questions go to `output`, answers are lines of `input`.
struct Dialogue<'d> {
    input: &'d mut dyn BufRead,
    output: &'d mut dyn Write,
}

impl Dialogue<'_> {
    fn say(&mut self, text: &str) -> Result<(), Failure> {
        let written = self.output.write_all(text.as_bytes()).and_then(|()| self.output.flush());
        written.map_err(|source| Failure::Write { file: PathBuf::from("standard error"), source })
    }

    /// Asks until an answer, without blanks around it, is accepted.
    fn ask<T>(&mut self, question: &str, mut accept: impl FnMut(&str) -> Result<T, String>) -> Result<T, Failure> {
        loop {
            self.say(&format!("{question}: "))?;
            let mut answer = String::new();
            let read = self.input.read_line(&mut answer);
            let n = read.map_err(|source| Failure::Read { file: PathBuf::from("standard input"), source })?;
            if n == 0 {
                let why = "ended before the last answer: nothing is written";
                return Err(Failure::input(Path::new("standard input"), why));
            }
            match accept(answer.trim()) {
                Ok(value) => return Ok(value),
                Err(why) => self.say(&format!("  {why}\n"))?,
            }
        }
    }
}

/// Asks for family, all values that no option gives, and the output file, one by one with unit and
/// default; an empty answer keeps the default. A bad answer is refused with its reason, and the
/// question comes again.
///
/// # Errors
/// If the answers end before the last question, or options contradict each other.
pub(crate) fn ask_missing(
    arguments: NewMachineArguments,
    input: &mut dyn BufRead,
    output: &mut dyn Write,
) -> Result<NewMachineArguments, Failure> {
    let mut dialogue = Dialogue { input, output };
    let mut arguments = arguments;
    let family = match arguments.family {
        Some(family) => family,
        None => ask_family(&mut dialogue)?,
    };
    arguments.family = Some(family);
    let mut made = measured_machine(&arguments, family)?;
    dialogue.say(&format!(
        "An empty answer keeps the value in brackets: that of the preset {}, which the file lists as assumed.\n",
        family.preset_name()
    ))?;
    for (key, meaning, form) in QUESTIONS {
        // Values keep their order, whatever is answered.
        let open: Vec<usize> =
            (0..made.values.len()).filter(|&k| made.values[k].key == key && !made.values[k].is_measured).collect();
        for k in open {
            let text = made.values[k].text.clone();
            let (axis, default) = match text.split_once('=') {
                Some((axis, default)) => (Some(axis), default),
                None => (None, text.as_str()),
            };
            let question = question(axis, (meaning, form), default);
            let answer = dialogue.ask(&question, |answer| {
                if answer.is_empty() {
                    return Ok(None);
                }
                let changed = with_answer(&arguments, (key, axis), answer)?;
                let made = measured_machine(&changed, family).map_err(|e| e.to_string())?;
                Ok(Some((changed, made)))
            })?;
            if let Some(answered) = answer {
                (arguments, made) = answered;
            }
        }
    }
    if arguments.name.is_none() {
        let question = format!("name of the machine [{}]", made.file.name);
        arguments.name = dialogue.ask(&question, |answer| match answer {
            "" => Ok(None),
            name => machine_name(name).map(Some),
        })?;
    }
    if arguments.out.is_none() {
        let is_forced = arguments.force;
        let out = dialogue.ask(&format!("output file [{DEFAULT_OUT}]"), |answer| {
            let out = PathBuf::from(if answer.is_empty() { DEFAULT_OUT } else { answer });
            let is_there = !is_forced && out.symlink_metadata().is_ok();
            if is_there { Err(format!("{} exists; name another file", out.display())) } else { Ok(out) }
        })?;
        arguments.out = Some(out);
    }
    Ok(arguments)
}

fn ask_family(dialogue: &mut Dialogue<'_>) -> Result<MeasuredFamily, Failure> {
    dialogue.say("Families of machines:\n")?;
    for (k, family) in MeasuredFamily::ALL.into_iter().enumerate() {
        dialogue.say(&format!("  {}  {family}\n", k + 1))?;
    }
    dialogue.ask("family, by name or number", |answer| {
        let of_number = answer.parse::<usize>().ok().and_then(|n| MeasuredFamily::ALL.get(n.checked_sub(1)?).copied());
        let of_name = MeasuredFamily::ALL.into_iter().find(|family| family.name() == answer);
        of_name.or(of_number).ok_or_else(|| format!("\"{answer}\" is none of them"))
    })
}

/// Returns the question for a value, of an axis or of the machine, with unit and default.
fn question(axis: Option<&str>, (meaning, form): (&str, &str), default: &str) -> String {
    let Some(axis) = axis else { return format!("{meaning}, {form} [{default}]") };
    let unit = if ["X", "Y", "Z"].contains(&axis) { "mm" } else { "deg" };
    let form = match form {
        "" | "/min" | "/s²" | "/s³" => format!("{unit}{form}"),
        "iso or reversed" => form.to_owned(),
        _ => format!("{form} in {unit}"),
    };
    format!("{axis}: {meaning}, {form} [{default}]")
}

/// Returns the arguments with an answer as the option that it stands for.
fn with_answer(
    arguments: &NewMachineArguments,
    (key, axis): (&str, Option<&str>),
    answer: &str,
) -> Result<NewMachineArguments, String> {
    let mut changed = arguments.clone();
    let of_axis = || format!("{}={answer}", axis.unwrap_or_default());
    let rate = |list: &mut Vec<(String, f64)>| -> Result<(), String> {
        list.push((axis.unwrap_or_default().to_owned(), finite(answer)?));
        Ok(())
    };
    match key {
        "sense" => changed.sense.push(sense(&of_axis()).map_err(|_| "must be iso or reversed")?),
        "table_at" => changed.table_at = Some(numbers(answer)?),
        "table_tilt" => changed.table_tilt = Some(numbers(answer)?),
        "pivot_length" => changed.pivot_length = Some(finite(answer)?),
        "pivot_offset" => changed.pivot_offset = Some(finite(answer)?),
        "c_offset" => changed.c_offset = Some(numbers(answer)?),
        "lean" => changed.lean = Some(lean(answer)?),
        "limits" => changed.limits.push(limits(&of_axis())?),
        "home" => rate(&mut changed.home)?,
        "rapid" => rate(&mut changed.rapid)?,
        "acceleration" => rate(&mut changed.acceleration)?,
        "jerk" => rate(&mut changed.jerk)?,
        _ => return Err("is no value of the machine".to_owned()),
    }
    Ok(changed)
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/equipment/machine_prompts.rs"]
mod tests;
