//! Machine, tools and control of a posted program, and options of posting.

use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::{AxisValues, BlockLaw, BranchPreference, Machine};
use facemill_job::load::{home_words, letter};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::{FeedMode, MappedAxis, PostSettings, WordMap, WorkOffset};
use facemill_tool_model::ToolAssembly;
use nalgebra::Isometry3;

use crate::fault::PostFault;

/// Machine, mounting, tools and control of a program.
#[derive(Clone, Debug)]
pub struct PostScene<'a> {
    /// The machine, with one head.
    pub machine: &'a Machine,
    /// Table frame ← frame of the CL points.
    pub table_from_work: Isometry3<f64>,
    /// The tools that LOADTL may call, by their numbers. With one tool, it is also that of a file
    /// without LOADTL.
    pub tools: Vec<PostTool<'a>>,
    /// The dialect, for this machine ([`post_on`]).
    pub post: &'a PostSettings,
}

/// A tool with the words of its length.
#[derive(Clone, Debug)]
pub struct PostTool<'a> {
    /// The tool.
    pub tool: &'a ToolAssembly,
    /// Words of the axes with its length and the work offset ([`machine_words`]).
    pub words: WordMap,
}

/// Options of posting.
#[derive(Clone, Debug)]
pub struct PostOptions {
    /// Name of the program for the operator, if the file has no PARTNO.
    pub name: String,
    /// Largest deviation of tip and rim of the cutter from the path of the file in cuts, mm. On
    /// arcs half of it is for their chords.
    pub tolerance: f64,
    /// The same in rapids, mm; `None`: a rapid is one block, whatever the way of the axes.
    pub rapid_tolerance: Option<f64>,
    /// Distance along the tool axis, mm: by which the tool is lifted where rotary axes have to turn
    /// anew, from which it comes to a file that begins with a cut, and to which it leaves one that
    /// ends in a cut. `None`: refused, but for turns in a rapid that touches no cut.
    pub retract: Option<f64>,
    /// Branch of the rotary axes at the first point of each tool; which branch follows is chosen
    /// for the whole path.
    pub branch: BranchPreference,
    /// Whether feeds are lowered to those that the axes reach within acceleration and jerk; if not,
    /// their largest velocities alone lower them.
    pub law_feeds: bool,
    /// Numbers of tools that are meant to differ from the cutter of the file, such as reground
    /// ones: a difference is a note then, and not a fault.
    pub other_cutters: Vec<u32>,
    /// Largest number of positions of a tool, those inserted with them. Larger: more memory, some
    /// hundred bytes each.
    pub max_positions: usize,
}

/// Share of a tolerance for the motion of the control: the rest is for the rounding of words.
pub(crate) const MOTION_SHARE: f64 = 0.95;

/// Share of a tolerance for the chords of an arc.
pub(crate) const ARC_SHARE: f64 = 0.5;

/// Largest number of positions inserted between two points.
pub(crate) const MAX_BETWEEN: usize = 10_000;

/// Smallest and largest tolerance, mm: below, rounding of words decides; above, the part is lost.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-4..=1.0;

/// Longest retract, mm.
pub const MAX_RETRACT: f64 = 1000.0;

impl PostOptions {
    /// Returns 0.01 mm in cuts, 0.5 mm in rapids, no retract, the branch nearest to home, feeds
    /// within acceleration and jerk, another cutter as a fault, and 20 million positions.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            tolerance: 0.01,
            rapid_tolerance: Some(0.5),
            retract: None,
            branch: BranchPreference::Nearest,
            law_feeds: true,
            other_cutters: Vec::new(),
            max_positions: 20_000_000,
        }
    }

    pub(crate) fn check(&self) -> Result<(), PostFault> {
        let all = [("tolerance", Some(self.tolerance)), ("tolerance of rapids", self.rapid_tolerance)];
        for (name, value) in all.into_iter().filter_map(|(name, value)| Some((name, value?))) {
            if !TOLERANCES.contains(&value) {
                let (from, to) = (TOLERANCES.start(), TOLERANCES.end());
                return Err(PostFault::Whole(format!("the {name} is {value} mm: it must be from {from} to {to}")));
            }
        }
        match self.retract {
            Some(mm) if !(mm > 0.0 && mm <= MAX_RETRACT) => {
                Err(PostFault::Whole(format!("the retract is {mm} mm: it must be above 0, at most {MAX_RETRACT}")))
            }
            _ => Ok(()),
        }
    }
}

/// Returns the words of a machine's axes for a tool with this gauge length (mm); `offset` are the
/// machine values where words are 0.
///
/// # Errors
/// If an axis has no NC address, or the tool's length acts on no axis.
pub fn machine_words(
    machine: &Machine,
    offset: &AxisValues,
    work_offset: WorkOffset,
    gauge_length: f64,
) -> Result<WordMap, PostFault> {
    let travel = machine.length_compensation_travel();
    let travel = travel.ok_or_else(|| PostFault::Whole("its linear axes are dependent at the zero pose".to_owned()))?;
    let axis = |(k, axis): (usize, &facemill_inverse_kinematics::Axis)| {
        let letter = letter(axis.letter.as_str())?;
        Ok(MappedAxis { letter, offset: offset.get_or_zero(k), along_spindle: travel.get_or_zero(k) })
    };
    let axes = machine.axes().iter().enumerate().map(axis).collect::<Result<Vec<_>, PostFault>>()?;
    WordMap::new(axes, work_offset, gauge_length).map_err(|e| PostFault::Whole(e.to_string()))
}

/// Returns the settings of a dialect for a machine.
///
/// # Errors
/// If the machine has several heads, the control does not move as its file says, or the settings
/// are for RTCP and its file says that axes move on lines in cuts.
pub fn post_on(machine: &Machine, post: &PostSettings) -> Result<PostSettings, PostFault> {
    if machine.head_count() > 1 {
        return Err(PostFault::Whole("it has several heads; CL files are posted for one".to_owned()));
    }
    if post.vector_rule().is_some() {
        return Err(PostFault::Whole("post.orientation is vectors; CL files are posted with rotary words".to_owned()));
    }
    if post.feed_mode() == FeedMode::Rtcp && machine.motion_law().cutting == CuttingLaw::AxesLinear {
        let why = "the feed mode rtcp needs a machine whose motion.cutting is tip_and_rotaries_linear or \
                   tip_linear_vector_turned: that is how its control moves under RTCP; its file says axes_linear";
        return Err(PostFault::Whole(why.to_owned()));
    }
    post.on_machine(machine.motion_law(), home_words(machine)?).map_err(|e| PostFault::Whole(e.to_string()))
}

impl PostScene<'_> {
    /// Law of motion in cuts.
    pub(crate) fn cutting_law(&self) -> CuttingLaw {
        self.post.cutting_law()
    }

    /// Law of motion in rapids.
    pub(crate) fn rapid_law(&self) -> BlockLaw {
        match self.post.rtcp_rapids() {
            Some(RtcpRapids::TipLinear) => self.cutting_law().into(),
            Some(RtcpRapids::BySetting) | None => self.machine.motion_law().rapid.into(),
        }
    }

    /// Whether each axis goes at its own speed in rapids.
    pub(crate) fn has_bent_rapids(&self) -> bool {
        self.rapid_law() == BlockLaw::Rapid(RapidLaw::PerAxis)
    }

    /// Tool of a number of LOADTL; of a file without, the only one.
    pub(crate) fn tool(&self, number: Option<u32>, line: u32) -> Result<&PostTool<'_>, PostFault> {
        let Some(number) = number else {
            return match self.tools.as_slice() {
                [only] => Ok(only),
                [] => Err(PostFault::Whole("no tool is given".to_owned())),
                _ => Err(PostFault::at(line, "no LOADTL says which of the tools is used from here on")),
            };
        };
        let found = self.tools.iter().find(|t| t.tool.number() == number);
        found.ok_or_else(|| {
            let known: Vec<String> = self.tools.iter().map(|t| format!("T{}", t.tool.number())).collect();
            PostFault::at(line, format!("LOADTL calls T{number}; the tools given are {}", known.join(", ")))
        })
    }
}
