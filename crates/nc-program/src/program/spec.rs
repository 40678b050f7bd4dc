use facemill_cl_data::RapidLaw;

use crate::program::{Coolant, NcProgram, WorkOffset};
use crate::words::axis_words::{AxisLetter, AxisWords};

/// Everything a dialect's writer needs to know: the program and what the template's header says
/// about it.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSpec {
    /// Name for the operator, at the top.
    pub job_name: String,
    /// The tool the program was computed for.
    pub tool: ToolSpec,
    /// Spindle speed and sense.
    pub spindle: SpindleSpec,
    /// Coolant while cutting.
    pub coolant: Coolant,
    /// Work offset all words refer to.
    pub work_offset: WorkOffset,
    /// Axes of the machine, in the machine's order.
    pub axes: Vec<AxisSpec>,
    /// Smallest feed per minute that the control can be given, mm/min; 0 where every word is.
    pub smallest_feed: f64,
    /// The motions. The first must be a rapid and name every axis the program uses: the template
    /// brings the machine there axis by axis.
    pub program: NcProgram,
    /// Planned motion of rapids between two positions.
    pub rapid: RapidLaw,
    /// Where RTCP is switched on: rotary words of 0, and the words that the tip then has under RTCP
    /// with the linear axes at home. Needed under RTCP, which fixes the frame of X, Y and Z to the
    /// table as it stands there; not used otherwise, where the machine goes to the first position
    /// axis by axis.
    pub approach: Option<AxisWords>,
}

/// Tool of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSpec {
    /// Place in the magazine (T).
    pub number: u32,
    /// Name for the operator.
    pub name: String,
    /// Cutter radius R, mm.
    pub radius: f64,
    /// Corner radius r, mm.
    pub corner_radius: f64,
    /// From the spindle's gauge line to the tip, mm: the length the program was computed with.
    pub length: f64,
    /// Number of the control's length register (H).
    pub length_register: u32,
}

/// Spindle speed and sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpindleSpec {
    /// Revolutions per minute, positive.
    pub rpm: f64,
    /// Clockwise seen from the spindle toward the tool (M3).
    pub clockwise: bool,
}

/// Machine axis of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSpec {
    /// Its name in NC text.
    pub letter: AxisLetter,
    /// Smallest machine value, mm or deg; −∞ for an axis without a limit.
    pub min: f64,
    /// Largest machine value, mm or deg; ∞ for an axis without a limit.
    pub max: f64,
    /// Whether it is the linear axis parallel to the spindle at the zero pose: retracted first,
    /// approached last.
    pub along_spindle: bool,
    /// Machine value where the program's words are 0: what the work offset was planned to hold, mm
    /// or deg.
    pub work_offset: f64,
}
