//! Words of a dialect and their form, as data: `"format": "facemill-dialect/1"`.
//!
//! Texts hold placeholders in braces, such as `T{number} M6`; each field says which.

use facemill_cl_data::CuttingLaw;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::dialect::beside_rule::{SubprogramRules, TableForm};
use crate::dialect::word_rule::{LengthRule, WordRule};
use crate::words::axis_words::AxisKind;

/// Value of the key `format` in a dialect file.
pub const DIALECT_FORMAT: &str = "facemill-dialect/1";

/// How programs of a control look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DialectFile {
    /// Always `"facemill-dialect/1"`.
    pub format: String,
    /// Name of the control in errors.
    pub name: String,
    /// Numbers and names of programs.
    pub program: ProgramRule,
    /// Lines and their numbers.
    pub lines: LineRule,
    /// Comments.
    pub comments: CommentRule,
    /// Numbers in words.
    pub numbers: NumberRule,
    /// Words that select the meaning of F, by feed mode; an absent mode is refused.
    pub feeds: FeedRule,
    /// Motion of the control between two positions.
    pub motion: MotionRule,
    /// How the control runs its queue of blocks in time
    /// (docs/dialects.md#how-a-control-runs-its-blocks): times go by it, and with them a plan's
    /// choice between two ways around a pole. Default: jerk limited, 1000 blocks in sight, an
    /// assumption.
    #[serde(default)]
    pub control_motion: ControlMotion,
    /// Whether one program can move several heads.
    #[serde(default)]
    pub several_heads: bool,
    /// Words of the body.
    pub words: WordRule,
    /// M functions, by their numbers, that neither move nor call nor change anything which
    /// positions, feeds or the tool depend on; every other one besides those that the reader
    /// follows is a finding of a program.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub harmless_functions: Vec<u32>,
    /// Form of the control's tool table and work offsets; absent where this program writes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<TableForm>,
    /// Words of subprograms.
    #[serde(default, skip_serializing_if = "SubprogramRules::is_empty")]
    pub subprograms: SubprogramRules,
}

impl DialectFile {
    /// Motion of rapids under RTCP; that of a setting without RTCP.
    #[must_use]
    pub fn rtcp_rapids(&self) -> RtcpRapids {
        self.motion.rtcp.as_ref().map_or_else(RtcpRapids::default, |rtcp| rtcp.rapids)
    }
}

/// Numbers and names of programs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProgramRule {
    /// Ending of the file's name, without the point.
    pub extension: String,
    /// Largest program number, up to 99999999.
    pub last_number: u32,
    /// Digits that a number is filled up to with zeros in `program.padded`.
    pub digits: u8,
    /// Most characters of a name in `program.id`: upper-case letters, digits and underscores.
    pub name_length: u8,
}

/// Lines and their numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineRule {
    /// Longest line that the control takes, characters; a job can ask for shorter ones.
    pub max_length: u16,
    /// How blocks are numbered.
    pub numbering: Numbering,
    /// Lines of the template that start with one of these are no blocks, and get no number.
    pub unnumbered: Vec<String>,
    /// A line that ends in this goes on in the next one, which gets no number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub continued: Option<String>,
}

/// How blocks are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Numbering {
    /// `N12`, where the job asks for numbers; comments have none.
    Optional,
    /// Every line has its number, from 0, without a letter; the job's `block_numbers` say nothing
    /// here.
    EveryLine,
}

/// Comments. Letters become upper case, parentheses brackets, what is not allowed `?` or nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommentRule {
    /// Text before a comment.
    pub open: String,
    /// Text behind a comment; empty where the end of the line ends it.
    pub close: String,
    /// Characters that they may hold besides letters, digits and blanks.
    pub characters: String,
    /// Comments that start with one of these do something on this control: a point is written in
    /// front.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub active: Vec<String>,
}

/// Numbers in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NumberRule {
    /// Whether axis words and vectors have a plus sign, too.
    pub plus_sign: bool,
    /// Whether `X100` is written `X100.`: some controls count in micrometres without a point.
    pub always_point: bool,
    /// Most decimals that the control takes.
    pub max_decimals: Decimals,
    /// Decimals of the components of unit vectors.
    pub vector_decimals: u8,
    /// Whether axes can have numbers (`X2=100.`).
    pub numbered_axes: bool,
}

/// Words of the feed modes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedRule {
    /// mm/min as the norm over all axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub g94: Option<String>,
    /// 1/min.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub g93: Option<String>,
    /// mm/min of the tip under RTCP.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rtcp: Option<String>,
    /// Why a mode is absent and what to take instead, for the error.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub absent: String,
}

/// Motion of the control between two positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionRule {
    /// Rapids with all axes on a line; absent where the control cannot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rapid_linear: Option<RapidRule>,
    /// Rapids with each axis at its own speed; absent where the control cannot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rapid_per_axis: Option<RapidRule>,
    /// RTCP; absent where the control has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rtcp: Option<RtcpRule>,
    /// Smoothing and corner blending; absent where the control's own settings decide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blending: Option<BlendingRule>,
    /// Look-ahead; absent where it is always on or cannot be switched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_ahead: Option<Switch>,
}

/// How a rapid law is said.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RapidRule {
    /// Words that select it; empty where a setting of the control does.
    pub code: String,
    /// Setting that the operator has to check, as a comment.
    pub note: String,
}

/// RTCP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RtcpRule {
    /// Switches it on.
    pub on: LengthRule,
    /// Lines that switch it off and let no length compensation stay.
    pub off: Vec<String>,
    /// Laws of the tool between two positions, each with the words that select it. The first is
    /// taken where no machine names one.
    pub cutting: Vec<CuttingRule>,
    /// Motion of rapids.
    pub rapids: RtcpRapids,
    /// Tool vectors in place of rotary words; absent where the control, or this program, has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vectors: Option<VectorRule>,
}

/// Motion of the control at rapid rate under RTCP.
// Exhaustive for callers: motion must not be taken for another law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RtcpRapids {
    /// The tip goes straight, as in cuts.
    TipLinear,
    /// A setting of the control says whether the tip goes straight or the axes go as without RTCP.
    #[default]
    BySetting,
}

/// How a cutting law is said.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CuttingRule {
    /// The law.
    pub law: RtcpLaw,
    /// Words that select it; empty where a setting of the control does.
    pub code: String,
}

/// Motion of the tool between two positions under RTCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RtcpLaw {
    /// The tip goes straight, the rotary axes linearly.
    TipAndRotariesLinear,
    /// The tip goes straight, the tool vector turns in the plane of its two ends.
    TipLinearVectorTurned,
}

impl From<RtcpLaw> for CuttingLaw {
    fn from(law: RtcpLaw) -> Self {
        match law {
            RtcpLaw::TipAndRotariesLinear => Self::TipAndRotariesLinear,
            RtcpLaw::TipLinearVectorTurned => Self::TipLinearVectorTurned,
        }
    }
}

/// Blocks with the tool's axis as a unit vector.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VectorRule {
    /// Motion word of such a block in place of that of a cut; empty for the same.
    pub code: String,
    /// Laws that can be had with vectors.
    pub laws: Vec<RtcpLaw>,
    /// Text before the components of the tool's axis.
    pub tool: [String; 3],
    /// Text before the components of the surface normal; absent where the control takes none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[String; 3]>,
    /// Whether every such block names all linear axes and vectors, changed or not.
    pub complete: bool,
    /// Whether cuts with rotary words may stand between such blocks.
    #[serde(default)]
    pub between_rotary_words: bool,
}

/// Blending within a tolerance. `{path}` is mm, `{orientation}` deg: what plan and verification
/// allow the control.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlendingRule {
    /// Lines that allow so much, and that undo it at the end.
    pub within: Switch,
    /// Lines that allow nothing; absent where the control always blends and needs a tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<Switch>,
}

/// Lines that switch something on and off.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// On.
    pub on: Vec<String>,
    /// Off.
    pub off: Vec<String>,
}

/// How a control runs its queue of blocks in time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlMotion {
    /// Highest derivative of position that the control limits.
    pub limited_by: LimitedBy,
    /// Blocks over which the control sees to it that it can stop; at most 10000 with `corners:
    /// junction_deviation`.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub look_ahead_blocks: u32,
    /// How the control runs blocks that turn a rotary axis.
    pub rotary_blocks: RotaryBlocks,
    /// How corners are taken: rounded within the tolerance, or not.
    pub corners: CornerRule,
    /// Distance by which an arc of the speed of a corner would leave it, with `corners:
    /// junction_deviation`.
    #[schemars(range(min = 0, max = 1_000_000))]
    #[serde(default, skip_serializing_if = "is_zero")]
    pub junction_deviation_um: u32,
    /// Length of a segment below which the control slows down at corners of less than 45° as on an
    /// arc, with `corners: junction_deviation`; 0: none, Marlin: 1.
    #[schemars(range(min = 0, max = 1000))]
    #[serde(default, skip_serializing_if = "is_zero")]
    pub small_segments_mm: u32,
    /// Least time of a block: a cycle of the control. None with `corners: junction_deviation`.
    #[schemars(range(min = 0, max = 1_000_000))]
    #[serde(default)]
    pub cycle_us: u32,
    /// Source of the values; where it is empty reports list them as an assumption.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub checked_against: String,
}

// serde calls it with a reference.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "the condition of a field that is left out")]
fn is_zero(value: &u32) -> bool {
    *value == 0
}

impl Default for ControlMotion {
    /// Jerk limited, within the tolerance everywhere, with a look-ahead of 1000 blocks.
    fn default() -> Self {
        Self {
            limited_by: LimitedBy::Jerk,
            look_ahead_blocks: 1000,
            rotary_blocks: RotaryBlocks::LookedAhead,
            corners: CornerRule::Spline,
            junction_deviation_um: 0,
            small_segments_mm: 0,
            cycle_us: 0,
            checked_against: String::new(),
        }
    }
}

impl ControlMotion {
    /// Returns the assumption of times whose values have not been checked against the control;
    /// `None` if they have.
    #[must_use]
    pub fn assumption(&self) -> Option<String> {
        let limited_by = match self.limited_by {
            LimitedBy::Acceleration => "acceleration",
            LimitedBy::Jerk => "jerk",
        };
        let rotary = match self.rotary_blocks {
            RotaryBlocks::LookedAhead => "also over blocks that turn rotary axes",
            RotaryBlocks::Overlapped => "not over blocks that turn rotary axes",
            RotaryBlocks::Stopped => "with stops at blocks that turn rotary axes",
        };
        let ahead = self.look_ahead_blocks;
        self.checked_against.is_empty().then(|| {
            format!(
                "times by acceleration and jerk take the control as limiting {limited_by} and looking {ahead} blocks ahead, {rotary}: \
                 not checked against the control (control_motion of the dialect file)"
            )
        })
    }
}

/// Highest derivative of position that a control limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LimitedBy {
    /// Speeds over time are trapezoids.
    Acceleration,
    /// Speeds over time are without corners.
    Jerk,
}

/// How a control runs blocks that turn a rotary axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RotaryBlocks {
    /// As all others.
    LookedAhead,
    /// Each from rest to rest, the next one starting while it stops.
    Overlapped,
    /// Each from rest to rest.
    Stopped,
}

/// How a control takes corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CornerRule {
    /// By a curve over several blocks.
    Spline,
    /// By an arc between two lines.
    Arcs,
    /// Not at all: the axes keep to the lines and slow down, all axes alike.
    JunctionDeviation,
}

/// Decimals of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Decimals {
    /// Decimals of mm.
    #[schemars(range(min = 0, max = 6))]
    pub linear: u8,
    /// Decimals of deg.
    #[schemars(range(min = 0, max = 6))]
    pub rotary: u8,
    /// Decimals of mm/min.
    #[schemars(range(min = 0, max = 6))]
    pub feed: u8,
    /// Decimals of 1/min in G93.
    #[schemars(range(min = 0, max = 6))]
    pub inverse_time: u8,
}

impl Default for Decimals {
    fn default() -> Self {
        Self { linear: 3, rotary: 3, feed: 1, inverse_time: 3 }
    }
}

impl Decimals {
    /// Decimals of an axis word.
    #[must_use]
    pub fn of(&self, kind: AxisKind) -> u8 {
        match kind {
            AxisKind::Linear => self.linear,
            AxisKind::Rotary => self.rotary,
        }
    }
}
