//! `facemill machine new`.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use facemill::drawing::machine_svg::machine_svg;
use facemill::inverse_kinematics::measured::{
    AxisLimits, AxisMeasurement, MeasureError, MeasuredFamily, MeasuredLean, MeasuredMachine, MeasuredSense,
    Measurements, PlaceMeasurements, machine_from_measurements,
};
use facemill::inverse_kinematics::{Machine, MachineError};
use facemill::{Failure, files};

use crate::cli::equipment::machine_prompts::ask_missing;
use crate::cli::output::say;

#[derive(Args, Clone)]
pub(crate) struct NewMachineArguments {
    /// Family: where the rotary axes are. On a terminal, a run without --family or --out asks for
    /// them and for all values that no option gives
    #[arg(long, value_name = "NAME", value_parser = family())]
    pub(super) family: Option<MeasuredFamily>,
    /// Output file
    #[arg(short, long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Output file for the drawing of axes and pivots (SVG); default: the machine file's name with
    /// .svg
    #[arg(long, value_name = "FILE")]
    drawing: Option<PathBuf>,
    /// Replace output files that exist
    #[arg(long)]
    pub(super) force: bool,
    /// Name of the machine; default: its family
    #[arg(long, value_name = "TEXT", value_parser = machine_name)]
    pub(super) name: Option<String>,
    /// Readings of X, Y, Z with the centre of the spindle nose on the table's origin (on C of a
    /// turning table), a reversed axis as it counts, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub(super) table_at: Option<[f64; 3]>,
    /// Trunnion: point on the tilting axis, seen from the table's origin, mm
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true)]
    pub(super) table_tilt: Option<[f64; 3]>,
    /// Head: distance from the spindle nose (gauge line) up to the tilting axis, above 0, mm
    #[arg(long, value_name = "MM", value_parser = finite, allow_hyphen_values = true)]
    pub(super) pivot_length: Option<f64>,
    /// Head: tilting axis beside the spindle's centre line, toward +X (B) or +Y (A), mm
    #[arg(long, value_name = "MM", value_parser = finite, allow_hyphen_values = true)]
    pub(super) pivot_offset: Option<f64>,
    /// Fork: C axis, seen from the spindle's centre line, mm
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pub(super) c_offset: Option<[f64; 2]>,
    /// Nutating axis: direction toward which it leans from z, upward, with the axes at 0
    #[arg(long, value_name = "+y|-y", value_parser = lean, allow_hyphen_values = true)]
    pub(super) lean: Option<MeasuredLean>,
    /// Limits of an axis, mm or deg: X=-400:400, C=endless; for several axes several times
    #[arg(long, value_name = "AXIS=MIN:MAX", value_parser = limits)]
    pub(super) limits: Vec<(String, AxisLimits)>,
    /// Home position of an axis, mm or deg: Z=0
    #[arg(long, value_name = "AXIS=VALUE", value_parser = axis_value)]
    pub(super) home: Vec<(String, f64)>,
    /// Rapid velocity of an axis, mm/min or deg/min: X=30000
    #[arg(long, value_name = "AXIS=VALUE", value_parser = axis_value)]
    pub(super) rapid: Vec<(String, f64)>,
    /// Largest acceleration of an axis, mm/s² or deg/s²
    #[arg(long, value_name = "AXIS=VALUE", value_parser = axis_value)]
    pub(super) acceleration: Vec<(String, f64)>,
    /// Largest jerk of an axis, mm/s³ or deg/s³
    #[arg(long, value_name = "AXIS=VALUE", value_parser = axis_value)]
    pub(super) jerk: Vec<(String, f64)>,
    /// Sense in which an axis counts, compared with ISO 841: C=iso, C=reversed. B of either lean is
    /// iso if +B tilts the tool, as seen from the workpiece, from +z toward +x
    #[arg(long, value_name = "AXIS=SENSE", value_parser = sense)]
    pub(super) sense: Vec<(String, MeasuredSense)>,
    /// Axis that counts against ISO 841, such as rotary tables of LinuxCNC's old convention: short
    /// for --sense AXIS=reversed
    #[arg(long, value_name = "AXIS", value_parser = axis_name)]
    reversed: Vec<String>,
    /// Write the lines of the axes in place of rows
    #[arg(long)]
    lines: bool,
}

pub(crate) fn run(arguments: NewMachineArguments) -> Result<ExitCode, Failure> {
    let is_complete = arguments.family.is_some() && arguments.out.is_some();
    let arguments = if !is_complete && std::io::stdin().is_terminal() {
        &ask_missing(arguments, &mut std::io::stdin().lock(), &mut std::io::stderr())?
    } else {
        &arguments
    };
    let missing = |option: &str, what: &str| {
        Failure::input(Path::new(option), format!("is missing: {what}; on a terminal the command asks for it"))
    };
    let families = || MeasuredFamily::ALL.map(MeasuredFamily::name).join(", ");
    let family = arguments.family.ok_or_else(|| missing("--family", &format!("give one of {}", families())))?;
    let out = arguments.out.as_ref().ok_or_else(|| missing("--out", "give the machine file to write"))?;
    let mut made = measured_machine(arguments, family)?;
    if let Some(name) = &arguments.name {
        made.file.name.clone_from(name);
    }
    let machine = Machine::from_file(made.file.clone()).map_err(|e| Failure::Internal(e.to_string()))?;
    if arguments.lines {
        made.file = made.file.by_lines();
    }
    let drawing = arguments.drawing.clone().unwrap_or_else(|| out.with_extension("svg"));
    for file in [out, &drawing] {
        if !arguments.force && file.symlink_metadata().is_ok() {
            return Err(Failure::input(file, "exists; --force replaces it"));
        }
    }
    let picture = machine_svg(std::slice::from_ref(&machine));
    let json = facemill::file_format::to_json(&made.file);
    files::write_each(&[(out, json.into_bytes()), (&drawing, picture.into_bytes())])?;
    say(&format!("{}: {}\n{}", out.display(), machine.family(), summary(&made, family)))?;
    say(&format!("drawing of axes and pivots: {}\n", drawing.display()))?;
    say(&format!(
        "it has no bodies; add them, and compare it with the machine: facemill machine check {}\n",
        out.display()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the machine that the options describe.
pub(super) fn measured_machine(
    arguments: &NewMachineArguments,
    family: MeasuredFamily,
) -> Result<MeasuredMachine, Failure> {
    machine_from_measurements(family, &measurements(arguments)?).map_err(|e| failure(arguments, e))
}

/// Lists measured values and defaults as the options that give them.
fn summary(made: &MeasuredMachine, family: MeasuredFamily) -> String {
    let mut text = String::new();
    let heading = format!("defaults of the preset {}, not measured:", family.preset_name());
    for (is_measured, heading) in [(true, "measured:"), (false, heading.as_str())] {
        let mut values = made.values.iter().filter(|value| value.is_measured == is_measured).peekable();
        if values.peek().is_none() {
            continue;
        }
        text.push_str(heading);
        let mut last = "";
        for value in values {
            let starts = if value.key == last { "" } else { "\n " };
            text.push_str(&format!("{starts} {} {}", option(value.key), value.text));
            last = value.key;
        }
        text.push('\n');
    }
    text.push_str("assumed, not an option: motion, feed\n");
    text
}

/// Returns the option of a value.
fn option(key: &str) -> String {
    format!("--{}", key.replace('_', "-"))
}

/// Returns the failure of the option at fault.
fn failure(arguments: &NewMachineArguments, error: MeasureError) -> Failure {
    let (name, message) = match &error {
        MeasureError::NotOfFamily { key, family, known } => {
            let known = known.split(", ").map(option).collect::<Vec<_>>().join(", ");
            (option(key), format!("is no option of the family {family}, which has {known}"))
        }
        MeasureError::Length { key, value, most } => {
            (option(key), format!("{value} mm is beyond {most} mm: is the unit right?"))
        }
        MeasureError::PivotLength { value } => (
            option("pivot_length"),
            format!("{value} mm has to be above 0: it is measured from the nose up; turn its sign"),
        ),
        MeasureError::NoSuchAxis { axis, .. } => (option_about(arguments, axis), error.to_string()),
        MeasureError::Machine(MachineError::Field { field, axis, problem }) => {
            let axis = axis.as_deref().unwrap_or_default();
            (option_of_field(field), format!("the value of {axis} {problem}"))
        }
        other => (other.key().map_or("facemill machine new".to_owned(), option), error.to_string()),
    };
    Failure::input(Path::new(&name), message)
}

/// Returns the first option that names an axis.
fn option_about(arguments: &NewMachineArguments, axis: &str) -> String {
    let names = |given: &[(String, f64)]| given.iter().any(|(name, _)| name == axis);
    let rate = rates(arguments).into_iter().find(|(_, given, _)| names(given)).map(|(name, ..)| name);
    let limits = arguments.limits.iter().any(|(name, _)| name == axis).then_some("--limits");
    let sense = arguments.sense.iter().any(|(name, _)| name == axis).then_some("--sense");
    limits.or(rate).or(sense).unwrap_or("--reversed").to_owned()
}

/// Returns the option that gives a field of a joint.
fn option_of_field(field: &str) -> String {
    let key = field.rsplit('.').next().unwrap_or_default();
    let options = [
        ("max_velocity", "--rapid"),
        ("max_acceleration", "--acceleration"),
        ("max_jerk", "--jerk"),
        ("home", "--home"),
    ];
    options.iter().find(|(start, _)| key.starts_with(start)).map_or("--limits", |(_, option)| option).to_owned()
}

fn measurements(arguments: &NewMachineArguments) -> Result<Measurements, Failure> {
    let mut axes = Axes::default();
    for (axis, value) in &arguments.limits {
        axes.set("--limits", axis, *value, |entry| &mut entry.limits)?;
    }
    for (name, given, field) in rates(arguments) {
        for (axis, value) in given {
            axes.set(name, axis, *value, field)?;
        }
    }
    for (axis, sense) in &arguments.sense {
        axes.set("--sense", axis, *sense, |entry| &mut entry.sense)?;
    }
    for axis in &arguments.reversed {
        let is_given = arguments.sense.iter().any(|(name, _)| name == axis);
        let option = if is_given { "--sense, --reversed" } else { "--reversed" };
        axes.set(option, axis, MeasuredSense::Reversed, |entry| &mut entry.sense)?;
    }
    let places = PlaceMeasurements {
        table_at: arguments.table_at,
        table_tilt: arguments.table_tilt,
        pivot_length: arguments.pivot_length,
        pivot_offset: arguments.pivot_offset,
        c_offset: arguments.c_offset,
        lean: arguments.lean,
    };
    Ok(Measurements { places, axes: axes.0 })
}

/// An option with one number for an axis: name, values, and their field.
type Rate<'a> = (&'static str, &'a [(String, f64)], fn(&mut AxisMeasurement) -> &mut Option<f64>);

fn rates(arguments: &NewMachineArguments) -> [Rate<'_>; 4] {
    [
        ("--home", &arguments.home, |entry| &mut entry.home),
        ("--rapid", &arguments.rapid, |entry| &mut entry.max_velocity),
        ("--acceleration", &arguments.acceleration, |entry| &mut entry.max_acceleration),
        ("--jerk", &arguments.jerk, |entry| &mut entry.max_jerk),
    ]
}

/// Entries of axes in the order of their first options.
#[derive(Default)]
struct Axes(Vec<AxisMeasurement>);

impl Axes {
    fn entry(&mut self, axis: &str) -> &mut AxisMeasurement {
        let position = self.0.iter().position(|entry| entry.axis == axis).unwrap_or_else(|| {
            self.0.push(AxisMeasurement { axis: axis.to_owned(), ..Default::default() });
            self.0.len() - 1
        });
        &mut self.0[position]
    }

    fn set<T>(
        &mut self,
        option: &str,
        axis: &str,
        value: T,
        field: impl Fn(&mut AxisMeasurement) -> &mut Option<T>,
    ) -> Result<(), Failure> {
        match field(self.entry(axis)).replace(value) {
            None => Ok(()),
            Some(_) => Err(twice(option, axis)),
        }
    }
}

fn twice(option: &str, axis: &str) -> Failure {
    Failure::input(Path::new(option), format!("is given twice for {axis}; leave one out"))
}

fn family() -> impl TypedValueParser<Value = MeasuredFamily> {
    let names = PossibleValuesParser::new(MeasuredFamily::ALL.map(MeasuredFamily::name));
    names.try_map(|name| MeasuredFamily::ALL.into_iter().find(|family| family.name() == name).ok_or("is no family"))
}

/// Returns a name that machine files may have.
pub(super) fn machine_name(text: &str) -> Result<String, String> {
    let is_blank = text.trim().is_empty();
    if is_blank { Err("must not be blank".to_owned()) } else { Ok(text.to_owned()) }
}

pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("\"{text}\" is no number")),
    }
}

/// Returns numbers with commas between.
pub(crate) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(finite).collect::<Result<Vec<f64>, _>>()?;
    numbers.try_into().map_err(|_| format!("must be {N} numbers in mm with commas between"))
}

fn axis_name(text: &str) -> Result<String, String> {
    let name = text.trim().to_uppercase();
    let is_known = ["X", "Y", "Z", "A", "B", "C"].contains(&name.as_str());
    is_known.then_some(name).ok_or_else(|| format!("\"{text}\" is no axis: X, Y, Z, A, B or C"))
}

fn split_axis(text: &str) -> Result<(String, &str), String> {
    let (axis, value) = text.split_once('=').ok_or("must be an axis and its value, such as X=100")?;
    Ok((axis_name(axis)?, value))
}

fn axis_value(text: &str) -> Result<(String, f64), String> {
    let (axis, value) = split_axis(text)?;
    Ok((axis, finite(value)?))
}

pub(super) fn lean(text: &str) -> Result<MeasuredLean, String> {
    let leans = [MeasuredLean::PlusY, MeasuredLean::MinusY];
    leans.into_iter().find(|lean| lean.name() == text.trim()).ok_or_else(|| format!("\"{text}\" is neither +y nor -y"))
}

pub(super) fn sense(text: &str) -> Result<(String, MeasuredSense), String> {
    let (axis, value) = text.split_once('=').ok_or("must be AXIS=iso or AXIS=reversed")?;
    let senses = [MeasuredSense::Iso, MeasuredSense::Reversed];
    let sense = senses.into_iter().find(|sense| sense.name() == value.trim());
    Ok((axis_name(axis)?, sense.ok_or("must be AXIS=iso or AXIS=reversed")?))
}

pub(super) fn limits(text: &str) -> Result<(String, AxisLimits), String> {
    let (axis, value) = split_axis(text)?;
    if value.trim() == "endless" {
        return Ok((axis, AxisLimits::Endless));
    }
    let (min, max) = value.split_once(':').ok_or("must be MIN:MAX, or endless")?;
    Ok((axis, AxisLimits::Between(finite(min)?, finite(max)?)))
}
