//! Settings of the control that a program relies on, for the setup sheet.

use facemill_cl_data::{ControlTolerance, RapidLaw};
use facemill_inverse_kinematics::AxisKind;
use facemill_job::format::verification_file::VERIFICATION_FORMAT;
use facemill_nc_program::dialect::{DialectFile, RtcpRapids};
use facemill_nc_program::read::{Compensation, LengthRelation, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::{Dialect, FeedMode, ReadProgram};
use facemill_tool_model::ToolFile;
use serde_json::Value;

use crate::document::named_lines::FileLines;
use crate::document::{PageScene, PageSource};
use crate::format::ControlSetting;
use crate::motion::ProgramMotion;

/// Difference of lengths that a program's check lets pass, mm: `LE 0.01`.
const SAME_LENGTH: f64 = 0.01;

/// Words of tip control of all controls.
const TIP_CONTROL: [&str; 7] = ["G43.4", "G43.5", "G234", "M128", "M428", "TRAORI", "FUNCTION TCPM"];

/// A program with what its text is read for.
pub(super) struct ReadText<'a> {
    pub(super) program: &'a ReadProgram,
    pub(super) lines: &'a FileLines<'a>,
    pub(super) rules: &'a DialectFile,
    /// Whether the text was written by a plan of the job.
    pub(super) is_own: bool,
}

/// Returns whether the program of a source was written by a plan of its job.
pub(super) fn is_own(source: &PageSource<'_>) -> bool {
    source.result.get("format").and_then(Value::as_str) != Some(VERIFICATION_FORMAT)
}

impl PageScene<'_> {
    /// Returns what the control must be set to, besides the work offset.
    pub(super) fn control_settings(&self, read: &ReadText<'_>, motion: &ProgramMotion) -> Vec<ControlSetting> {
        let tools = self.heads.iter().map(|(_, tool)| tool.to_file());
        let mut settings: Vec<ControlSetting> =
            tools.map(|tool| ControlSetting { name: "Tool length", value: tool_length(read, &tool) }).collect();
        let mut add = |name: &'static str, value: String| settings.push(ControlSetting { name, value });
        add("Tip control (RTCP, TCPM)", self.tip_control(read));
        add("Meaning of F", meaning_of_f(read));
        add("Rapids", self.rapids(read, motion.segments.iter().any(|s| s.is_rtcp)));
        let ControlTolerance { path, orientation } = self.scene.machine.motion_law().control_tolerance;
        let allowed = format!("a cut leaves the path by at most {path} mm and {:.4}°", orientation.to_degrees());
        add("Smoothing and corners", format!("{allowed}; {}", smoothing(read)));
        let home = self.scene.machine.axes().iter().map(|axis| match axis.kind {
            AxisKind::Rotary => format!("{} {:.4}°", axis.letter, axis.home.to_degrees()),
            AxisKind::Linear => format!("{} {:.3} mm", axis.letter, axis.home),
        });
        add("Reference position of the axes", home.collect::<Vec<_>>().join(", "));
        settings
    }

    fn tip_control(&self, read: &ReadText<'_>) -> String {
        let is_on = |b: &&ReadBlock| matches!(b.compensation, Compensation::Rtcp(_));
        let Some(on) = read.program.blocks.iter().find(is_on) else {
            if let Some(line) = read.lines.first_with(&TIP_CONTROL) {
                return format!(
                    "a word of tip control is not followed here ({}): check what it does",
                    read.lines.quoted(line)
                );
            }
            return "off: words are positions of the axes, for this place of the part and this length of the tool alone. With \
                    another offset, place or length plan again: entering new values does not correct the path"
                .to_owned();
        };
        let register = self.scene.tool().to_file();
        let register = register.length_register.unwrap_or(register.number);
        let own = if read.is_own { self.scene.job.post.rtcp_on_words(register) } else { Vec::new() };
        let with = if own.is_empty() { read.lines.quoted(on.line) } else { own.join(" ") };
        format!(
            "the program switches it on with {with}: the option must be there, and the control must have the machine's centres \
             of rotation as the machine file has them. For another place of the part verify again: collisions and limits are \
             those of this place"
        )
    }

    fn rapids(&self, read: &ReadText<'_>, rtcp: bool) -> String {
        let is_linear = self.scene.machine.motion_law().rapid == RapidLaw::Linear;
        let law = if is_linear { "all axes on a line" } else { "each axis at its own speed" };
        let under_rtcp = match read.rules.rtcp_rapids() {
            RtcpRapids::TipLinear if rtcp => "; under tip control the tip goes straight, too",
            _ => "",
        };
        format!("{law}: {}{under_rtcp}", rapids_set_by(read, is_linear))
    }
}

/// Returns who sees to it that rapids go by a law.
fn rapids_set_by(read: &ReadText<'_>, is_linear: bool) -> String {
    let motion = &read.rules.motion;
    let (rule, other) = (&motion.rapid_linear, &motion.rapid_per_axis);
    let (rule, other) = if is_linear { (rule, other) } else { (other, rule) };
    let Some(rule) = rule else { return "this control does not move so: the machine file disagrees".to_owned() };
    match (&rule.code[..], &rule.note[..]) {
        ("", _) if other.is_none() => "as this control always does".to_owned(),
        ("", "") => "a setting of the control decides: check it".to_owned(),
        ("", note) => format!("setting to check: {note}"),
        (code, _) => match first_mode(read, |word| word == code) {
            Some(line) => format!("selected by {code} ({})", read.lines.quoted(line)),
            None => format!("{code} selects it, and the program does not say it: check what the control starts with"),
        },
    }
}

/// Returns the place of a tool's length in a control.
pub(super) fn length_place(dialect: Dialect, tool: &ToolFile) -> String {
    match dialect {
        Dialect::Siemens840d => format!("length 1 of cutting edge D1 of T{}", tool.number),
        Dialect::Heidenhain => format!("L of tool {} in the tool table, DL 0", tool.number),
        _ => format!("H{}, wear 0", tool.length_register.unwrap_or(tool.number)),
    }
}

fn tool_length(read: &ReadText<'_>, tool: &ToolFile) -> String {
    let length = tool.gauge_length_mm;
    let place = length_place(read.program.dialect, tool);
    format!("{place}: {length:.3} mm from the gauge line of the spindle to the tip; {}", length_check(read, tool))
}

/// Returns who compares the length of a tool: a check of the program before it moves, or a person.
fn length_check(read: &ReadText<'_>, tool: &ToolFile) -> String {
    let by_hand = "the program does not compare it before it moves with it: check it by hand".to_owned();
    // The way to the reference position does not count the length.
    let counts = |m: &ReadMotion| m.compensation != Compensation::Off || !m.kind.is_rapid();
    let first_motion = read.program.motions().find(|(_, m)| counts(m)).map_or(u32::MAX, |(block, _)| block.line);
    let register = tool.length_register.unwrap_or(tool.number);
    let checks = read.program.tool_lengths.iter().filter_map(|note| Some((note, note.check?)));
    let mut checks = checks
        .filter(|(_, check)| check.line < first_motion && check.register.is_none_or(|of_check| of_check == register));
    let is_same = |length: f64| (length - tool.gauge_length_mm).abs() <= SAME_LENGTH;
    let mut of_another = None;
    let equal = checks.find(|(note, check)| {
        let is_equal = note.relation == LengthRelation::Same;
        of_another = of_another.or((is_equal && !is_same(note.length)).then_some((note.length, check.line)));
        is_equal && is_same(note.length)
    });
    match (equal, of_another) {
        (Some((_, check)), _) => {
            format!("the program compares it before it moves with it ({})", read.lines.quoted(check.line))
        }
        (None, Some((length, line))) => {
            format!("the program compares it with {length:.3} mm, another length ({})", read.lines.quoted(line))
        }
        (None, None) => by_hand,
    }
}

/// Returns the meanings of F that occur in a program, with the unit of its text.
fn meaning_of_f(read: &ReadText<'_>) -> String {
    let mut meanings: Vec<String> = Vec::new();
    for (_, motion) in read.program.motions() {
        let Some(feed) = motion.feed.filter(|_| !motion.kind.is_rapid()) else { continue };
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        let meaning = match (feed.mode, is_rtcp) {
            (FeedMode::G93, _) => "inverse time (G93): the reciprocal of the time of each block in minutes".to_owned(),
            (_, true) => format!("under tip control the speed of the tip, {}", unit_of_f(motion)),
            (_, false) => {
                let rotary =
                    if read.is_own { " is in the header of the program" } else { ", the control's manual says" };
                format!("speed along the axes, {}; how rotary axes count{rotary}", unit_of_f(motion))
            }
        };
        if !meanings.contains(&meaning) {
            meanings.push(meaning);
        }
    }
    if meanings.is_empty() { "no block moves at a feed".to_owned() } else { meanings.join(". Also: ") }
}

/// Returns the unit of F in the text of a motion.
fn unit_of_f(motion: &ReadMotion) -> String {
    match motion.feed_unit {
        1.0 => "mm/min".to_owned(),
        unit if (unit - 25.4).abs() < 1e-9 => "inch/min".to_owned(),
        unit => format!("{unit} mm/min for each 1 of F"),
    }
}

/// Returns what words of the program say of smoothing.
fn smoothing(read: &ReadText<'_>) -> String {
    let dialect = read.program.dialect;
    let is_word = |word: &str| {
        let g_word = |names: &[&str]| names.contains(&word);
        match dialect {
            Dialect::Siemens840d => {
                g_word(&["G60", "G641", "G642", "G643", "G644", "G645"]) || word.starts_with("CTOL")
            }
            Dialect::LinuxCnc => g_word(&["G61", "G61.1"]) || word == "G64",
            Dialect::Haas => g_word(&["G61", "G187"]),
            Dialect::Heidenhain => false,
            _ => g_word(&["G61"]),
        }
    };
    let is_call = |command: &ReadCommand| match command {
        ReadCommand::Call(call) => match dialect {
            Dialect::Siemens840d => call.name == "CYCLE832" && !call.arguments.trim_start().starts_with("0,"),
            Dialect::Heidenhain => call.name == "32",
            _ => false,
        },
        _ => false,
    };
    let called = read.program.blocks.iter().find(|b| b.commands.iter().any(is_call)).map(|b| b.line);
    let said = [called, first_mode(read, is_word)].into_iter().flatten().min();
    match said {
        Some(line) => format!(
            "compare the word of the program ({}) with it; what words leave open is among the assumptions",
            read.lines.quoted(line)
        ),
        None => "no word of the program says how far: check the parameters of the control".to_owned(),
    }
}

/// Returns the first line that says one of a control's words of modes.
fn first_mode(read: &ReadText<'_>, is_meant: impl Fn(&str) -> bool) -> Option<u32> {
    let says = |command: &ReadCommand| match command {
        ReadCommand::Mode(text) => text.to_uppercase().split_whitespace().any(&is_meant),
        _ => false,
    };
    read.program.blocks.iter().find(|b| b.commands.iter().any(says)).map(|b| b.line)
}
