//! Findings: faults of a program and their measures.

pub(crate) mod episodes;
pub(crate) mod merge;
pub(crate) mod reader_notes;

use std::fmt;

use facemill_nc_program::AxisLetter;
use schemars::JsonSchema;
use serde::Serialize;

/// Result of running a program.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Verification {
    /// One for each episode of contact or fault, sorted by first line, then kind.
    pub findings: Vec<Finding>,
    /// Deepest place of the cutter below the allowance of a part, check surface or fixture in a
    /// cutting move, also where it is within the limit; `None` where it was nowhere below.
    pub largest_gouge: Option<GougePlace>,
    /// The same for each section of the settings, in their order.
    pub sections: Vec<SectionGouge>,
    /// Nearest that a non-cutting body came to a part, check surface or fixture, or to a body of
    /// the machine that stands still against the workpiece or is the other head's, over all tested
    /// positions.
    pub smallest_clearance: Option<ClearancePlace>,
    /// Bounds between the tested positions; absent of an estimate, which has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between: Option<BetweenPositions>,
    /// That this is an estimate ([`Estimate`](crate::motion::setup::Estimate)), of so few positions
    /// and of the edges of bodies: that nothing is found proves nothing. Absent where it is none.
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
    /// Least value on the machine's scale, deg.
    pub least_deg: f64,
    /// Greatest value on it, deg.
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
    /// Deepest place in its cutting moves, also where it is within the limit; `None` where it was
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

/// One episode: the same thing on blocks that follow each other, told by its worst position.
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
    /// How often it begins between these lines: once, but where findings of one fault are told as
    /// one (`merge_findings`).
    #[serde(skip_serializing_if = "is_one")]
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
    /// How bad it is at its worst.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measure: Option<Measure>,
    /// Contact point, workpiece frame, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place_work_mm: Option<[f64; 3]>,
    /// Where tool and axes are; at the start of the block where the text alone is at fault, and
    /// only where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    /// When it happens, s since the start of the program: rapids at the axes' largest velocities
    /// and cuts at their programmed feeds, as [`Verification::cutting_time_s`] and
    /// [`Verification::rapid_time_s`] count. Of lines that are not run there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Further explanation.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
}

/// Whether nothing has to be said of how often something is.
fn is_one(n: &usize) -> bool {
    *n == 1
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FindingKind {
    /// The cutter below an obstacle's allowance in a cutting move.
    Gouge,
    /// A body of the machine within its clearance of an obstacle or the stock on it, or of another
    /// body of the machine; the cutter within that of a body of the machine.
    Collision,
    /// A non-cutting body of the tool assembly within its clearance of an obstacle, the stock on
    /// it, or a body of the machine.
    HolderCollision,
    /// The cutter in an obstacle, or in the stock on it, or within the clearance of a body of the
    /// machine, in a rapid.
    RapidCollision,
    /// A non-cutting body near its clearance, inside or outside.
    NearMiss,
    /// An axis beyond its limits.
    AxisLimit,
    /// The programmed feed needs an axis to be faster than it can be.
    AxisSpike,
    /// The axes cannot follow the programmed motion.
    ReachFailure,
    /// A rotary axis turns far in one cutting block while the tool axis is near the pole, where
    /// small turns of the tool need large ones of the axis.
    Singularity,
    /// A rotary axis turns by more than half a turn in one cutting block: it turns back, or goes
    /// the long way round, in the cut.
    Rewind,
    /// The same in a rapid between cuts.
    LinkRewind,
    /// The cutter takes more at a time than the job's removal rate allows.
    OverEngagement,
    /// The cutter goes down into stock more steeply than it may.
    RampTooSteep,
    /// The core of the cutter, which does not cut, in stock that has not been removed before,
    /// deeper than its recess.
    DeadCore,
    /// Length compensation or RTCP is cancelled where the control may move the axis by the tool's
    /// length.
    UnsafeCancel,
    /// A cutting move without a feed.
    NoFeed,
    /// The program does not say where an axis is, so the motion was not tested.
    UnknownPosition,
    /// The program says that it was computed for a tool of another length.
    OtherToolLength,
    /// The length of another register than the tool's, or of none, is taken.
    OtherLengthRegister,
    /// A feed move without a tool in the spindle.
    NoTool,
    /// A tool change while the axis along the spindle is not at its reference position.
    UnsafeToolChange,
    /// A feed move while the spindle stands still or has no speed.
    SpindleOff,
    /// A feed move while the spindle turns against the tool's sense.
    SpindleSense,
    /// A feed move with a faster tip than any that the job asks for, or one that cuts, than it asks
    /// for in cuts.
    FeedAboveJob,
    /// Cutting moves with the spindle at another speed than those that the job asks for.
    OtherSpindleSpeed,
    /// A length, angle or feed without a decimal point, which controls may count in their least
    /// increments.
    NoDecimalPoint,
    /// Macro text that may skip, repeat or stop what follows.
    Branch,
    /// A line that a switch on the control may skip (`/`), which moves axes or changes what later
    /// blocks depend on.
    SkippableBlock,
    /// Text behind the end of the program, which is not run.
    BehindEnd,
    /// A block whose effect on the axes is not known, or that is not simulated.
    UnknownBlock,
    /// A function (M, or H of Siemens) that the dialect file does not name as harmless: it may
    /// move, call or change anything.
    UnknownFunction,
    /// The text chooses another motion between positions, or more smoothing, than the machine file
    /// states and is simulated.
    OtherMotion,
    /// RTCP is on where other axes than the spindle's go to machine positions, or where the program
    /// ends.
    RtcpLeftOn,
    /// A tool or normal vector that is none of length 1, on a control that takes it as it stands.
    NotUnitVector,
    /// More material left on the surface that is asked for than the job allows.
    Excess,
    /// A cutting move whose normal vector (NX NY NZ of LN) points away from the tool, or is not
    /// that of the surface which the cutter is at.
    OtherNormal,
    /// The text stops without a word that ends the program.
    NoEnd,
}

/// Size of a fault, or of what is left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Measure {
    /// Depth of the cutter below allowance or stock, mm; of its core below the stock's surface
    /// where its recess ends.
    DepthMm(f64),
    /// Distance of the body as it is from the obstacle's mesh, mm; 0 where they overlap.
    DistanceMm(f64),
    /// Height of material that is left on the surface, mm.
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
        write!(f, ": {}", self.kind)?;
        for part in [&self.body, &self.axis].into_iter().flatten() {
            write!(f, ", {part}")?;
        }
        if let Some(obstacle) = &self.obstacle {
            write!(f, " at {obstacle}")?;
        }
        if let Some(measure) = &self.measure {
            write!(f, ", {measure}")?;
        }
        if !self.note.is_empty() {
            write!(f, ", {}", self.note)?;
        }
        write!(f, ": `{}`", self.block_text)
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
