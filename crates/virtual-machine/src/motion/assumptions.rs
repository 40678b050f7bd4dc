//! Assumptions of a run where the program's text is silent.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use facemill_cl_data::{CuttingLaw, MotionLaw, RapidLaw};
use facemill_inverse_kinematics::{Machine, Rollover};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::read::{AxisAt, Compensation, MotionKind, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::words::{AxisKind, SaidWords, StateWord};
use facemill_nc_program::{AxisLetter, Dialect, FeedMode, ReadProgram};
use schemars::JsonSchema;
use serde::Serialize;

use crate::motion::smoothing::Smoothing;

/// Something that a program leaves to the control, and what the run took for it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Assumption {
    /// First line that rests on it, from 1; absent where none does by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
    /// Missing statement and the assumption made for it.
    pub text: String,
}

impl fmt::Display for Assumption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "from line {line}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

/// Returns the assumptions of [`verify`](crate::run::verify::verify) and
/// [`certify`](crate::proof::certificate::certify) on a program where its text is silent:
/// smoothing, motion laws, axes that F counts, offset, length, states that an earlier program may
/// have left on, the axes' positions at its start and behind a tool change, and reference positions
/// that the control's data hold.
///
/// Statements of the text are not listed. Sorted by line, each once, with the first line that rests
/// on it. Wrong statements are findings; data of the setup (lengths in registers, offsets, the
/// machine file) are the setup's.
#[must_use]
pub fn assumptions(program: &ReadProgram, machine: &Machine) -> Vec<Assumption> {
    let mut state = State::new(program, machine);
    for block in &program.blocks {
        state.block(block);
    }
    if !state.has_cut {
        let text = "no cutting move: only ways at rapid rate were tested against the part";
        state.all.insert(text.to_owned(), None);
    }
    let mut all: Vec<Assumption> = state.all.into_iter().map(|(text, line)| Assumption { line, text }).collect();
    all.sort();
    all
}

fn is_rtcp(block: &ReadBlock) -> bool {
    matches!(block.compensation, Compensation::Rtcp(_))
}

/// Axes that F counts on a Siemens control, as far as the text says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    /// Nothing, or no linear axis.
    Unsaid,
    /// `FGROUP()`: what machine data say.
    OfMachineData,
    /// Axes, a linear one among them.
    Axes,
}

impl Group {
    /// Of a word in upper case.
    fn of(text: &str) -> Self {
        let axes = text.trim_start_matches("FGROUP");
        if axes.contains(['X', 'Y', 'Z']) {
            return Self::Axes;
        }
        if axes.chars().any(char::is_alphanumeric) { Self::Unsaid } else { Self::OfMachineData }
    }
}

/// By how much words may be beyond half a turn from each other, deg: rounding of sums.
const ROUNDING: f64 = 1e-6;

/// State that the text has set so far.
struct State {
    dialect: Dialect,
    rtcp_rapids: RtcpRapids,
    law: MotionLaw,
    /// Axes of the machine that the text has not sent to a place of the machine.
    unplaced: Vec<AxisLetter>,
    /// Endless axes of which the machine file does not say how words are read, or says that they go
    /// the shorter way; and their last words, deg.
    winding: Vec<(AxisLetter, Option<Rollover>, Option<f64>)>,
    said: SaidWords,
    smoothing: Smoothing,
    /// A word chooses how the tool turns under RTCP.
    has_turn_law: bool,
    /// Whether rotary axes go linearly, by ORIMKS or ORIWKS, and by ORIAXES or ORIVECT.
    turns_axes: [Option<bool>; 2],
    /// RTLION or RTLIOF.
    has_rapid_law: bool,
    /// Axes of FGROUP.
    group: Group,
    /// PLANE RESET.
    has_plane_reset: bool,
    uses_rtcp: bool,
    is_rtcp: bool,
    /// A tool was changed, and nothing has moved since.
    has_new_tool: bool,
    /// Spindles that turn, 0 for the only one.
    spindles: BTreeSet<u32>,
    has_started: bool,
    has_cut: bool,
    all: BTreeMap<String, Option<u32>>,
}

impl State {
    fn new(program: &ReadProgram, machine: &Machine) -> Self {
        Self {
            dialect: program.dialect,
            rtcp_rapids: program.rtcp_rapids,
            law: machine.motion_law(),
            unplaced: machine.axes().iter().filter_map(|a| a.letter.as_str().parse().ok()).collect(),
            winding: machine
                .axes()
                .iter()
                .filter(|a| a.has_no_stops() && matches!(a.rollover, None | Some(Rollover::Shortest)))
                .filter_map(|a| Some((a.letter.as_str().parse().ok()?, a.rollover, None)))
                .collect(),
            said: SaidWords::default(),
            smoothing: Smoothing::default(),
            has_turn_law: false,
            turns_axes: [None; 2],
            has_rapid_law: false,
            group: Group::Unsaid,
            has_plane_reset: false,
            uses_rtcp: program.blocks.iter().any(is_rtcp),
            is_rtcp: false,
            has_new_tool: false,
            spindles: BTreeSet::new(),
            has_started: false,
            has_cut: false,
            all: BTreeMap::new(),
        }
    }

    fn block(&mut self, block: &ReadBlock) {
        self.said = self.said.or(block.said);
        self.smoothing.read(self.dialect, block);
        let was_on = std::mem::replace(&mut self.is_rtcp, is_rtcp(block));
        if self.dialect == Dialect::Heidenhain && self.is_rtcp && !was_on {
            // M128 does not say it; FUNCTION TCPM of the same block does.
            self.has_turn_law = false;
        }
        let mut spindle = 0;
        self.has_new_tool |= block.commands.contains(&ReadCommand::ToolChange);
        for command in &block.commands {
            match command {
                ReadCommand::Mode(text) => self.mode(&text.to_uppercase()),
                ReadCommand::Call(call) => self.has_plane_reset |= call.name == "PLANE RESET",
                ReadCommand::Spindle(number) => spindle = *number,
                ReadCommand::SpindleOn { .. } => drop(self.spindles.insert(spindle)),
                ReadCommand::SpindleOff if spindle > 0 => drop(self.spindles.remove(&spindle)),
                ReadCommand::SpindleOff | ReadCommand::ToolChange => self.spindles.clear(),
                ReadCommand::End if !block.said.has(StateWord::Return) => self.end(block),
                _ => {}
            }
        }
        if let Some(motion) = &block.motion {
            self.motion(block, motion);
        }
    }

    fn mode(&mut self, text: &str) {
        let name: String = text.chars().take_while(char::is_ascii_alphanumeric).collect();
        match (self.dialect, name.as_str()) {
            (Dialect::Siemens840d, "ORIMKS" | "ORIWKS") => self.turns_axes[0] = Some(name == "ORIMKS"),
            (Dialect::Siemens840d, "ORIAXES" | "ORIVECT" | "ORIPLANE") => {
                self.has_turn_law = true;
                self.turns_axes[1] = Some(name == "ORIAXES");
            }
            (Dialect::Siemens840d, "ORICURVE" | "ORICONCW" | "ORICONCCW" | "ORICONTO" | "ORICONIO") => {
                self.has_turn_law = true;
            }
            (Dialect::Siemens840d, "RTLION" | "RTLIOF") => self.has_rapid_law = true,
            (Dialect::Siemens840d, "FGROUP") => self.group = Group::of(text),
            (Dialect::Heidenhain, "FUNCTION") => self.has_turn_law = text.contains("PATHCTRL"),
            _ => {}
        }
    }

    /// Spindles are stopped by M30 on most controls.
    fn end(&mut self, block: &ReadBlock) {
        if !self.spindles.is_empty() {
            self.rests(block, "the spindle is on where the program ends, which is taken to stop it".to_owned());
        }
        self.spindles.clear();
    }

    fn motion(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        let named = |at: fn(AxisAt) -> bool| {
            motion.position.iter().any(|(letter, place)| motion.position.is_programmed(letter) && at(place))
        };
        let in_words = named(|at| matches!(at, AxisAt::Word(_))) || motion.tool.is_some() || motion.via.is_some();
        let is_placed = |letter: &AxisLetter| {
            motion.position.is_programmed(*letter)
                && matches!(motion.position.get(*letter), Some(AxisAt::Machine(_) | AxisAt::Reference(_)))
        };
        self.unplaced.retain(|letter| !is_placed(letter));
        if std::mem::take(&mut self.has_new_tool) {
            self.tool_change(block);
        }
        if named(|at| at == AxisAt::Reference(1)) {
            self.reference(block);
        }
        if named(|at| matches!(at, AxisAt::Machine(_)))
            && self.dialect == Dialect::Heidenhain
            && motion.compensation != Compensation::Off
        {
            self.rests(block, "M91 is taken to count without the tool's length".to_owned());
        }
        if in_words {
            if !std::mem::replace(&mut self.has_started, true) {
                self.start(block);
            }
            self.offset(block, motion);
        }
        self.winding(block, motion);
        self.rtcp(block, motion);
        if motion.kind.is_rapid() {
            self.rapid(block, motion);
        } else {
            self.cut(block, motion);
        }
    }

    /// Axes behind a tool change: what the machine builder's program for it moves, no text says.
    fn tool_change(&mut self, block: &ReadBlock) {
        let word = if self.dialect == Dialect::Heidenhain { "TOOL CALL" } else { "M6" };
        self.rests(block, format!("{word} is taken to leave all axes where they are"));
    }

    /// Reference positions that data of the control hold.
    fn reference(&mut self, block: &ReadBlock) {
        let text = match self.dialect {
            Dialect::Siemens840d => {
                "G74 and G75 FP=1 are taken to end at home of the machine file; machine data say where they end"
            }
            Dialect::LinuxCnc => {
                "G28 is taken to end at home of the machine file; parameters of the control say where it ends"
            }
            _ => return,
        };
        self.rests(block, text.to_owned());
    }

    /// Adds the states that may still be on from before, at the first move in words.
    fn start(&mut self, block: &ReadBlock) {
        let (on_fanuc, on_linuxcnc) = match self.dialect {
            Dialect::Fanuc | Dialect::Haas | Dialect::Mazak => (true, false),
            Dialect::LinuxCnc => (true, true),
            _ => (false, false),
        };
        let is_heidenhain = self.dialect == Dialect::Heidenhain;
        let is_siemens = self.dialect == Dialect::Siemens840d;
        let off_word = match self.dialect {
            Dialect::Siemens840d => "TRAFOOF",
            Dialect::Heidenhain => "FUNCTION RESET TCPM or M129",
            _ => "M429",
        };
        let can_turn = is_siemens || is_heidenhain || on_linuxcnc && self.uses_rtcp;
        for (word, counts, text) in [
            (StateWord::Unit, true, "no unit is said: words are taken as mm".to_owned()),
            (
                StateWord::Distance,
                !is_heidenhain,
                "neither G90 nor G91 is said: words are taken as absolute".to_owned(),
            ),
            (StateWord::Motion, on_fanuc, "no G0 or G1 before the first motion: it is taken as a rapid".to_owned()),
            (StateWord::RadiusOff, !is_heidenhain, "no G40: radius compensation is taken to be off".to_owned()),
            (
                StateWord::LengthOff,
                on_fanuc,
                "no G49: tool length and RTCP are taken to be off at the start".to_owned(),
            ),
            (StateWord::RtcpOff, can_turn, format!("no {off_word}: RTCP is taken to be off at the start")),
        ] {
            if counts && !self.said.has(word) {
                self.rests(block, text);
            }
        }
        if is_heidenhain && !self.has_plane_reset {
            self.rests(block, "no PLANE RESET: the plane is taken not to be tilted at the start".to_owned());
        }
        if !self.unplaced.is_empty() {
            let letters: Vec<String> = self.unplaced.iter().map(ToString::to_string).collect();
            let axes = letters.join(" ");
            self.rests(block, format!("{axes} not sent home before: taken to be there where the program starts"));
        }
    }

    /// Words that lead elsewhere, or another way round, on a control that counts to 360 deg; and
    /// those half a turn on, to which both ways are the shorter. Where an axis is before its first
    /// word is taken to be 0.
    fn winding(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        let mut matters = Vec::new();
        for (letter, rollover, last) in &mut self.winding {
            let Some(AxisAt::Word(word)) = motion.position.get(*letter) else {
                *last = None;
                continue;
            };
            if motion.position.is_programmed(*letter) && !motion.position.is_way(*letter) {
                let is_open = match rollover {
                    Some(_) => ((word - last.unwrap_or(0.0)).rem_euclid(360.0) - 180.0).abs() <= ROUNDING,
                    None => last.map_or(!(0.0..=360.0).contains(&word), |last| (word - last).abs() > 180.0 + ROUNDING),
                };
                matters.extend(is_open.then_some((*letter, rollover.is_some())));
            }
            *last = Some(word);
        }
        for (letter, is_half_a_turn) in matters {
            let text = if is_half_a_turn {
                format!(
                    "{letter} goes half a turn, to which both ways are the shorter: taken as the positive one, which depends on \
                     the control"
                )
            } else {
                format!("no rollover of {letter} in the machine file: its words are taken to wind on")
            };
            self.rests(block, text);
        }
    }

    fn offset(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        if !self.said.has(StateWord::WorkOffset) {
            let offset = motion.work_offset;
            let text = match self.dialect {
                Dialect::Heidenhain => "no preset is selected (cycle 247): preset 1 is taken to be active".to_owned(),
                _ => format!("no work offset is selected: {offset} is taken to be active"),
            };
            self.rests(block, text);
        }
    }

    fn rtcp(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        if !matches!(motion.compensation, Compensation::Rtcp(_)) {
            return;
        }
        if self.dialect == Dialect::LinuxCnc {
            let text = "M428 is taken to switch to kinematics of the tip, and M429 to those of the joints";
            return self.rests(block, text.to_owned());
        }
        let keeps_tip = !motion.kind.is_rapid() || self.rtcp_rapids == RtcpRapids::TipLinear;
        if let [Some(frame), Some(law)] = self.turns_axes
            && frame != law
        {
            let text =
                "ORIMKS or ORIWKS says another turn of the tool than ORIAXES or ORIVECT: taken as the latter say";
            self.rests(block, text.to_owned());
        }
        if self.has_turn_law || !keeps_tip || motion.kind == MotionKind::ReferenceReturn {
            return;
        }
        let word = match self.dialect {
            Dialect::Siemens840d => "no ORIAXES or ORIVECT",
            Dialect::Heidenhain => "no PATHCTRL",
            _ => "no word of this control",
        };
        let law = match self.law.cutting {
            CuttingLaw::TipLinearVectorTurned => "tip_linear_vector_turned",
            CuttingLaw::TipAndRotariesLinear | CuttingLaw::AxesLinear => "tip_and_rotaries_linear",
        };
        let text = format!("{word} says how the tool turns between two positions under RTCP: taken as {law}");
        self.rests(block, text);
    }

    fn rapid(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        let law = if self.law.rapid == RapidLaw::Linear { "linear" } else { "per_axis" };
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        match self.dialect {
            Dialect::Siemens840d if !self.has_rapid_law && is_rtcp => {
                self.rests(block, "no RTLION: rapids under TRAORI are taken with the tip on a line".to_owned());
            }
            Dialect::Siemens840d if !self.has_rapid_law => {
                self.rests(block, format!("neither RTLION nor RTLIOF: rapids are taken as motion.rapid, {law}"));
            }
            Dialect::Fanuc | Dialect::Haas | Dialect::Mazak => {
                self.rests(block, format!("a setting of the control says how rapids go: taken as motion.rapid, {law}"));
            }
            _ => {}
        }
    }

    fn cut(&mut self, block: &ReadBlock, motion: &ReadMotion) {
        self.has_cut = true;
        if self.dialect != Dialect::Heidenhain && !self.said.has(StateWord::FeedMode) {
            self.rests(block, "neither G93 nor G94 is said: F is taken as mm/min".to_owned());
        }
        if let Some(open) = self.smoothing.left_open(self.dialect) {
            let allowed = self.law.control_tolerance;
            let (path, turn) = (allowed.path, (allowed.orientation.to_degrees() * 1e6).round() / 1e6);
            let text = format!("{open}: taken as at most motion.control_tolerance, {path} mm and {turn} deg");
            self.rests(block, text);
        }
        let turns = motion.tool.is_some()
            || motion.position.iter().any(|(l, _)| l.kind() == AxisKind::Rotary && motion.position.is_programmed(l));
        let mode = motion.feed.map(|f| f.mode).filter(|mode| *mode != FeedMode::G93);
        if motion.feed_unit != 1.0 && turns && mode == Some(FeedMode::G94) && self.dialect != Dialect::Heidenhain {
            self.rests(block, "F in inch/min beside a rotary axis: 1 deg is taken to count as 1 inch".to_owned());
        }
        if self.dialect == Dialect::Siemens840d && turns {
            let taken = match mode {
                Some(FeedMode::Rtcp) => "F is taken as the speed of the tip",
                Some(_) => "F is taken as the speed along X, Y and Z",
                None => return,
            };
            match self.group {
                Group::Axes => {}
                Group::Unsaid => self.rests(block, format!("no FGROUP: {taken}")),
                Group::OfMachineData => {
                    self.rests(block, format!("FGROUP() leaves to machine data which axes F counts: {taken}"));
                }
            }
        }
    }

    fn rests(&mut self, block: &ReadBlock, text: String) {
        self.all.entry(text).or_insert(Some(block.line));
    }
}
