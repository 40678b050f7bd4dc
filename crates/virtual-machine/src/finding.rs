//! Findings: faults of a program and their measures.

pub(crate) mod episodes;
pub(crate) mod merge;
pub(crate) mod reader_notes;

use std::fmt;

use facemill_nc_program::AxisLetter;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Result of running a program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Verification {
    /// One for each episode of contact or fault, sorted by first line, then kind.
    pub findings: Vec<Finding>,
    /// Deepest place of the cutter below the allowance of a part, check surface or fixture in a
    /// cutting move, also where it is within the limit; `null` where it was nowhere below.
    pub largest_gouge: Option<GougePlace>,
    /// Deepest place of the cutter in each section of the program that has a limit of its own (an
    /// operation), in program order.
    pub sections: Vec<SectionGouge>,
    /// Nearest that a non-cutting body came to a part, check surface or fixture, or to a body of
    /// the machine that stands still against the workpiece or is the other head's, over all tested
    /// positions.
    pub smallest_clearance: Option<ClearancePlace>,
    /// Bounds between the tested positions (docs/method.md#virtual-machine); absent of an estimate,
    /// which has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between: Option<BetweenPositions>,
    /// Distances of the positions of an estimate: that so few positions, and edges of bodies, show
    /// no finding proves nothing (docs/method.md#the-fast-mode). Absent of a full run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<EstimatedPositions>,
    /// How far each rotary axis without stops winds, over all that is run.
    pub wind_up: Vec<WindUp>,
    /// Number of tested positions.
    pub n_positions: usize,
    /// Number of blocks with a motion.
    pub n_blocks: usize,
    /// Time in cutting moves at the programmed feeds, s.
    pub cutting_time_s: f64,
    /// Time in rapids at the axes' largest velocities, s.
    pub rapid_time_s: f64,
    /// Way of the tip relative to the workpiece in cutting moves, mm.
    pub cutting_length_mm: f64,
}

impl Verification {
    /// The findings that make the program unfit ([`FindingKind::is_fault`]).
    pub fn faults(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|f| f.kind.is_fault())
    }
}

/// How far a rotary axis without stops winds.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WindUp {
    /// Its address.
    pub axis: String,
    /// Least value on the machine's scale, counted on over 360°.
    pub least_deg: f64,
    /// Greatest value on it.
    pub greatest_deg: f64,
    /// Turns between both.
    pub turns: f64,
}

impl fmt::Display for WindUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { axis, least_deg, greatest_deg, turns } = self;
        write!(f, "{axis} from {least_deg:.1} to {greatest_deg:.1} deg, {turns:.1} turns")
    }
}

/// How far apart the positions of an estimate are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct EstimatedPositions {
    /// Largest way of tip, rim and gauge line between two positions of a cutting move, mm.
    pub cut_step_mm: f64,
    /// The same of rapids: the radius of the cutter, mm.
    pub rapid_step_mm: f64,
}

/// Bounds on the motion between tested positions, under the machine's motion law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BetweenPositions {
    /// The cutter is nowhere deeper in part, check surfaces and fixtures than the limit and this
    /// together where there is no finding, mm; below the upper edge of its flute.
    pub cutter_mm: f64,
    /// A non-cutting body, and the cutter against bodies of the machine, comes nowhere nearer than
    /// what is a finding by more than this where there is none, mm.
    pub bodies_mm: f64,
    /// Blocks of which that is not known, because no bound on the axes' accelerations is.
    pub open_blocks: usize,
    /// Line of the first of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_open_line: Option<u32>,
}

/// How deep the cutter was in one section of the program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SectionGouge {
    /// Name of the section.
    pub name: String,
    /// Its first line, from 1.
    pub first_line: u32,
    /// Depth beyond which it is a finding, mm.
    pub gouge_limit_mm: f64,
    /// Deepest place in its cutting moves, also where it is within the limit; `null` where it was
    /// nowhere below.
    pub largest_gouge: Option<GougePlace>,
}

/// Where the cutter was deepest.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct GougePlace {
    /// Depth below the obstacle's allowance, mm.
    pub depth_mm: f64,
    /// The obstacle.
    pub obstacle: String,
    /// Line of the program, from 1.
    pub line: u32,
    /// A point of the obstacle in the cutter, workpiece frame, mm.
    pub place_work_mm: [f64; 3],
}

/// Where a non-cutting body was nearest.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ClearancePlace {
    /// Distance of the body as it is, without the clearance it is to keep, from the obstacle's mesh
    /// without stock, mm; 0 where they touch or overlap.
    pub distance_mm: f64,
    /// The body.
    pub body: String,
    /// The obstacle.
    pub obstacle: String,
    /// Line of the program, from 1.
    pub line: u32,
    /// Nearest point of the obstacle, workpiece frame, mm.
    pub place_work_mm: [f64; 3],
}

/// One episode: the same fault on consecutive blocks, with the values of its worst position.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Finding {
    /// Kind of the fault.
    pub kind: FindingKind,
    /// First line of the program it happens on, from 1.
    pub first_line: u32,
    /// Last line.
    pub last_line: u32,
    /// Line it is worst on.
    pub worst_line: u32,
    /// Number of times that it begins between these lines: 1, except for merged findings of one
    /// fault. Absent if 1.
    #[serde(skip_serializing_if = "is_one")]
    #[schemars(default = "one")]
    pub episodes: usize,
    /// Number (N) of that block.
    pub block_number: Option<u32>,
    /// Text of that block.
    pub block_text: String,
    /// The body of the tool or machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Obstacle that it meets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub obstacle: Option<String>,
    /// The axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Size of the fault at its worst, one number under its key, such as `{"depth_mm": 0.12}`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measure: Option<Measure>,
    /// Contact point, workpiece frame, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place_work_mm: Option<[f64; 3]>,
    /// Workpiece and machine coordinates where it is worst; of faults of the text at the start of
    /// the block, and absent where the text leaves open where an axis is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    /// Time when it happens, s since the start of the program: rapids at the axes' largest
    /// velocities and cuts at their programmed feeds, without acceleration. Absent for lines that
    /// are not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Further explanation.
    #[serde(skip_serializing_if = "String::is_empty")]
    #[schemars(default)]
    pub note: String,
}

/// Whether nothing has to be said of how often something is.
fn is_one(n: &usize) -> bool {
    *n == one()
}

fn one() -> usize {
    1
}

impl Finding {
    /// A finding that one line of the text shows by itself: the line, from 1, with the number (N)
    /// and the text of its block. Nothing is known of bodies, axes or places, and there is no
    /// measure.
    #[must_use]
    pub fn of_line(kind: FindingKind, line: u32, block_number: Option<u32>, text: &str, note: String) -> Self {
        Self {
            kind,
            first_line: line,
            last_line: line,
            worst_line: line,
            episodes: 1,
            block_number,
            block_text: text.to_owned(),
            body: None,
            obstacle: None,
            axis: None,
            measure: None,
            place_work_mm: None,
            pose: None,
            time_s: None,
            note,
        }
    }
}

/// Position of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Pose {
    /// Tool tip, workpiece frame, mm.
    pub tip_work_mm: [f64; 3],
    /// Tool axis, workpiece frame.
    pub axis_work: [f64; 3],
    /// Readings of the scales.
    pub axis_values: Vec<AxisReading>,
}

/// Value of one axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AxisReading {
    /// Its address.
    pub axis: String,
    /// mm, or deg for a rotary axis.
    pub value: f64,
}

/// Kinds of findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FindingKind {
    /// The cutter below an obstacle's allowance in a cutting move, by more than the budget.
    /// Measure: `depth_mm`.
    Gouge,
    /// A body of the machine within its clearance of an obstacle or the stock on it, or of another
    /// body of the machine; the cutter within that of a body of the machine. Measure:
    /// `distance_mm`; `depth_mm` for the cutter.
    Collision,
    /// Cutter body or holder within its clearance of an obstacle, the stock on it, or a body of the
    /// machine. Measure: `distance_mm`.
    HolderCollision,
    /// The cutter in an obstacle, the stock on it, or the clearance of a body of the machine, in a
    /// rapid. Measure: `depth_mm`.
    RapidCollision,
    /// A non-cutting body inside its clearance by no more than 0.1 mm. No fault. Measure:
    /// `distance_mm`.
    NearMiss,
    /// An axis beyond its limits. A motion that starts or ends there is not run, from its block to
    /// the one that leads back: no machine goes there, and what follows is not known. Measure:
    /// `excess_mm` or `excess_deg`.
    AxisLimit,
    /// The programmed feed needs an axis to be faster than it can be, by more than 2 %. Measure:
    /// `velocity_ratio`.
    AxisSpike,
    /// The axes cannot follow the programmed motion: the tip, or a tool vector that is turned,
    /// leads them beyond their reach, or would have them jump to another branch or winding.
    ReachFailure,
    /// A rotary axis turns in one cutting block by more than 10° farther than the tool axis does,
    /// and the tool axis comes within 1° of the pole, where it is parallel to the first rotary axis
    /// and small turns of it need large ones of the axis. No fault: the motion is followed as every
    /// other is, and excessive speed or reach has findings of its own. On the pole itself, where
    /// the tool axis stands still, any turn is free. Measure: `turn_deg`.
    Singularity,
    /// A rotary axis turns by more than half a turn in one cutting block: it turns back in the cut,
    /// or goes the long way round, and a control that takes the nearest way turns it the other way.
    /// Where a long turn is meant, write it as blocks of less than half a turn. Measure:
    /// `turn_deg`.
    Rewind,
    /// The same in a rapid between two cuts. No fault: collisions on the way have findings of their
    /// own. Measure: `turn_deg`.
    LinkRewind,
    /// With `--stock-cell-mm`: the cutter takes more at a time than the largest `removal_rate` of
    /// the setup's operations (where each has one), by more than 10 %, over the last way of half
    /// its radius or ten cells. Blocks whose tip is no faster than the job's
    /// `removal_rate.min_mm_min` and `approach_mm_min` may take any amount; runs shorter than that
    /// way are not judged. Stock deeper than the flute is a `holder_collision`. Measure:
    /// `removal_ratio`.
    OverEngagement,
    /// The cutter goes down into stock more steeply than it may, by more than 0.1°. Measure:
    /// `angle_deg`.
    RampTooSteep,
    /// The middle of the cutter, which does not cut, in stock that the rest of it has not removed
    /// before, deeper than its recess: a plunge, a steep entry, or the low edge behind
    /// (docs/method.md#virtual-machine). Measure: `depth_mm`, of the recess' end in the stock.
    DeadCore,
    /// Length compensation or RTCP is cancelled (`G49`, `H0`) in a block that does not say where
    /// the axis goes, away from the spindle axis' reference position: some controls move it by the
    /// tool's length.
    UnsafeCancel,
    /// A cutting move without a feed, or one whose F counts axes in a way that is not known
    /// (FGROUP).
    NoFeed,
    /// The program does not say where an axis is, switches RTCP on over a turned table, or names a
    /// tool vector for which no one position is clear (docs/dialects.md#tool-vectors), so the
    /// motion is not known.
    UnknownPosition,
    /// The program says that it was computed for a tool of another length.
    OtherToolLength,
    /// Length compensation or RTCP with another register (`H`; on 840D `D`, in our programs 1; on
    /// Heidenhain the number of the tool) than the tool's, or with none; on 840D also a length in
    /// force without `D` behind the tool change; with two heads also one that does not say on which
    /// axis it acts.
    OtherLengthRegister,
    /// A feed move without a tool in the spindle: no `T` and `M6` before.
    NoTool,
    /// `M6` while the axis along the spindle is not at its reference position (`G91 G28` in a block
    /// before).
    UnsafeToolChange,
    /// A feed move without the spindle: no `M3` or `M4` in a block before it, none since `M5`,
    /// `M19` or `M6`, or no `S` above 0.
    SpindleOff,
    /// A feed move with the spindle against the tool's `spindle_rotation`.
    SpindleSense,
    /// `verify` of a job: a feed move in which the tip goes faster at the programmed F than any
    /// feed of the setup's operations, by more than 1 % and rounding of words; where the stock is
    /// cut, one that certainly cuts, faster than any of their cuts. Measure: `feed_ratio`.
    FeedAboveJob,
    /// `verify` of a job: cuts with `S` other than the spindle speeds of the setup's operations, at
    /// the line of the `S`.
    OtherSpindleSpeed,
    /// An axis word or a feed without a decimal point, such as `Z500`: without calculator-type
    /// input that is 0.5 mm.
    NoDecimalPoint,
    /// `IF`, `GOTO`, `WHILE` or an alarm that may skip, repeat or stop what follows; only a check
    /// that goes over its own alarm (`IF … GOTO n`, `#3000=…`, `N n`; `FN 12: IF … GOTO LBL 9`, `FN
    /// 14: …`, `LBL 9`) is followed, and a Heidenhain branch whose values say that it does not
    /// jump.
    Branch,
    /// A line with `/` that has more than stops, coolant, dwells and comments: a switch on the
    /// control decides whether it is run.
    SkippableBlock,
    /// Lines behind the end mark `%`, `M2` or `M30`: they are not run.
    BehindEnd,
    /// A block whose effect is not known or that is not simulated; one that turns an axis more than
    /// 200 times (50 in a cut) while others move, or 500 times together with such blocks before it.
    UnknownBlock,
    /// An M function (or H of 840D) that neither the reader follows nor `harmless_functions` of the
    /// dialect file (docs/dialects.md#functions) names, once for each: it may move, call or change
    /// anything, and nothing behind it is certified.
    UnknownFunction,
    /// The text chooses another motion between positions than the machine file states and the run
    /// takes: ORIAXES, ORIVECT, RTLIOF, compressors (Siemens), PATHCTRL (Heidenhain); or more
    /// smoothing than `motion.control_tolerance`: CYCLE832, ADIS, CTOL, OTOL, ATOL, STOLF above 1,
    /// cycle 32, G64 P and Q, G187 E.
    OtherMotion,
    /// RTCP is on where other axes than the spindle's go home, or where the program ends.
    RtcpLeftOn,
    /// A vector of LN that is not of length 1 within 0.001.
    NotUnitVector,
    /// `verify` of a job: more material left on the region of an operation than the job allows
    /// (docs/formats.md#material-left). Measure: `height_mm`.
    Excess,
    /// NX NY NZ of a cutting LN point away from the tool's axis (more than 91.1° from it), or are
    /// turned by more than 30° from the part's normal where the cutter is at the part
    /// (docs/method.md#virtual-machine). Measure: `angle_deg`.
    OtherNormal,
    /// The program says nowhere that it ends: no M30, M2, M17, M99, END PGM; `%` is no end.
    NoEnd,
}

/// Size of a fault, or of what is left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Measure {
    /// Depth of the cutter below allowance or stock; of its core below the stock's surface where
    /// its recess ends.
    DepthMm(f64),
    /// Distance of the body as it is from the obstacle's mesh; 0 where they overlap.
    DistanceMm(f64),
    /// Height of material that is left on the surface.
    HeightMm(f64),
    /// Way of a linear axis beyond its limit.
    ExcessMm(f64),
    /// Way of a rotary axis beyond its limit.
    ExcessDeg(f64),
    /// Angle of descent below the bottom plane; of a normal vector to the tool axis that it points
    /// away from, or to the normal of the surface.
    AngleDeg(f64),
    /// Needed velocity over the largest possible.
    VelocityRatio(f64),
    /// Speed of the tip over the largest that the job asks for.
    FeedRatio(f64),
    /// Turn of a rotary axis in one block.
    TurnDeg(f64),
    /// Removal rate over the largest that the job asks for.
    RemovalRatio(f64),
}

impl FindingKind {
    /// Whether it makes the program unfit: all but near misses; and axes that turn back between
    /// cuts, or turn far near the pole, whose motion is followed and tested as every other is.
    #[must_use]
    pub fn is_fault(self) -> bool {
        !matches!(self, Self::NearMiss | Self::Singularity | Self::LinkRewind)
    }
}

impl Measure {
    /// The number, in its unit.
    #[must_use]
    pub fn value(&self) -> f64 {
        match *self {
            Self::DepthMm(v)
            | Self::DistanceMm(v)
            | Self::HeightMm(v)
            | Self::ExcessMm(v)
            | Self::ExcessDeg(v)
            | Self::AngleDeg(v)
            | Self::VelocityRatio(v)
            | Self::FeedRatio(v)
            | Self::TurnDeg(v)
            | Self::RemovalRatio(v) => v,
        }
    }

    /// Whether this is worse than `other` of the same kind: less distance, or more of anything
    /// else.
    pub(crate) fn is_worse_than(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::DistanceMm(a), Self::DistanceMm(b)) => a < b,
            _ => self.value() > other.value(),
        }
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DepthMm(v) => write!(f, "{v:.3} mm deep"),
            Self::DistanceMm(v) => write!(f, "{v:.3} mm away"),
            Self::HeightMm(v) => write!(f, "{v:.3} mm high"),
            Self::ExcessMm(v) => write!(f, "{v:.3} mm beyond its limit"),
            Self::ExcessDeg(v) => write!(f, "{v:.3} deg beyond its limit"),
            Self::AngleDeg(v) => write!(f, "{v:.2} deg"),
            Self::VelocityRatio(v) => write!(f, "{v:.2} times its largest velocity"),
            Self::FeedRatio(v) => write!(f, "{v:.2} times the job's feed"),
            Self::TurnDeg(v) => write!(f, "turns by {v:.1} deg"),
            Self::RemovalRatio(v) => write!(f, "{v:.2} times the job's removal rate"),
        }
    }
}

impl fmt::Display for Finding {
    /// One sentence with line, kind, bodies and size.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.worst_line)?;
        if self.first_line != self.last_line {
            write!(f, " (from {} to {}", self.first_line, self.last_line)?;
            if self.episodes > 1 {
                write!(f, ", {} times", self.episodes)?;
            }
            f.write_str(")")?;
        }
        write!(f, ": {}", self.description())
    }
}

impl Finding {
    /// Describes kind, bodies, size and block, without lines.
    #[must_use]
    pub fn description(&self) -> String {
        let parts = [&self.body, &self.axis].into_iter().flatten().map(|part| format!(", {part}"));
        let obstacle = self.obstacle.iter().map(|obstacle| format!(" at {obstacle}"));
        let measure = self.measure.iter().map(|measure| format!(", {measure}"));
        let note = Some(format!(", {}", self.note)).filter(|_| !self.note.is_empty());
        let rest: String = parts.chain(obstacle).chain(measure).chain(note).collect();
        format!("{}{rest}: `{}`", self.kind, self.block_text)
    }
}

impl fmt::Display for FindingKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gouge => "gouge",
            Self::Collision => "collision of the machine",
            Self::HolderCollision => "collision of the tool assembly",
            Self::RapidCollision => "cutter collides in rapid",
            Self::NearMiss => "near miss",
            Self::AxisLimit => "axis beyond its limits",
            Self::AxisSpike => "axis cannot follow the feed",
            Self::ReachFailure => "axes cannot follow the motion",
            Self::Singularity => "rotary axis turns far near its pole",
            Self::Rewind => "rotary axis turns back in the cut",
            Self::LinkRewind => "rotary axis turns back between cuts",
            Self::OverEngagement => "cutter takes too much",
            Self::RampTooSteep => "ramp too steep",
            Self::DeadCore => "core of the cutter in stock",
            Self::UnsafeCancel => "length compensation cancelled away from the reference position",
            Self::NoFeed => "cutting move without feed",
            Self::UnknownPosition => "position not known",
            Self::OtherToolLength => "made for another tool length",
            Self::OtherLengthRegister => "another length register than the tool's",
            Self::NoTool => "feed move without a tool",
            Self::UnsafeToolChange => "tool change away from the reference position",
            Self::SpindleOff => "feed move without the spindle",
            Self::SpindleSense => "feed move with the spindle the wrong way round",
            Self::FeedAboveJob => "tip faster than the job asks for",
            Self::OtherSpindleSpeed => "another spindle speed than the job's",
            Self::NoDecimalPoint => "number without decimal point",
            Self::Branch => "branch that is not followed",
            Self::SkippableBlock => "block that may be skipped",
            Self::BehindEnd => "text behind the end of the program",
            Self::UnknownBlock => "block not simulated",
            Self::UnknownFunction => "function not simulated",
            Self::OtherMotion => "another motion than simulated",
            Self::RtcpLeftOn => "RTCP left on",
            Self::Excess => "material left",
            Self::NotUnitVector => "vector not of length 1",
            Self::OtherNormal => "normal not the surface's",
            Self::NoEnd => "no end of the program",
        })
    }
}

/// Something wrong that shows in the text alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextFault {
    pub(crate) kind: FindingKind,
    pub(crate) block: usize,
    /// The last block that it goes on in.
    pub(crate) last: usize,
    /// The block that it is worst in.
    pub(crate) worst: usize,
    pub(crate) axis: Option<AxisLetter>,
    /// Its size in that block, where it has one.
    pub(crate) measure: Option<Measure>,
    pub(crate) note: String,
}
