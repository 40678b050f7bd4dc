//! CL files: points, statements and their meaning.

use std::fmt;

use facemill_cl_data::ClPoint;
use facemill_nc_program::Coolant;
use facemill_nc_program::SpindleSpec;
use nalgebra::{Point3, Unit, Vector3};

/// Number of lines that are searched for words of a CL file.
const FIRST_LINES: usize = 500;

/// Returns whether a text is a CL file (APT) and not a program of a control: one of its first lines
/// begins with a major word that no control has.
#[must_use]
pub fn is_cl_file(text: &[u8]) -> bool {
    const WORDS: [&str; 9] =
        ["PARTNO", "GOTO/", "FROM/", "LOADTL/", "FEDRAT/", "CUTTER/", "MULTAX", "MACHIN/", "TOOLPATH/"];
    text.split(|byte| *byte == b'\n').take(FIRST_LINES).any(|line| {
        let plain: String = String::from_utf8_lossy(line).split_whitespace().collect::<String>().to_uppercase();
        WORDS.iter().any(|word| plain.starts_with(word))
    })
}

/// Content of an APT file. Workpiece frame, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct AptSpec {
    /// PARTNO.
    pub part_name: String,
    /// Place in the magazine (LOADTL).
    pub tool_number: u32,
    /// CUTTER.
    pub cutter: AptCutter,
    /// SPINDL.
    pub spindle: SpindleSpec,
    /// COOLNT.
    pub coolant: Coolant,
    /// In order.
    pub moves: Vec<AptMove>,
}

/// Cutter as the APT word CUTTER describes it, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AptCutter {
    /// Radius R.
    pub radius: f64,
    /// Corner radius r.
    pub corner_radius: f64,
    /// Height of the cutting part.
    pub height: f64,
}

/// A move or comment of an APT file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AptMove {
    /// PPRINT.
    Comment(String),
    /// SPINDL: another speed from here on.
    Spindle(SpindleSpec),
    /// COOLNT: another coolant from here on.
    Coolant(Coolant),
    /// RAPID, GOTO.
    Rapid(ClPoint),
    /// FEDRAT, GOTO.
    Linear {
        /// Tip and axis at the end.
        cl: ClPoint,
        /// Speed of the tip, mm/min, positive.
        feed: f64,
    },
}

/// An APT file as it was read. Lengths in mm, whatever unit the file has.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct AptFile {
    /// Every statement, in order, including unknown ones.
    pub statements: Vec<AptStatement>,
    /// Every point of the tool, in order.
    pub points: Vec<AptPoint>,
    /// Every arc, in order.
    pub arcs: Vec<AptArc>,
    /// Major words that were kept without evaluation, by first appearance.
    pub unknown: Vec<AptUnknownWord>,
    /// Remarks on how statements were taken, one of each kind, with its first line.
    pub remarks: Vec<(u32, &'static str)>,
    /// Unit that was given beside the file: that of one without UNITS.
    pub given_unit: Option<ClUnit>,
}

/// Unit of the lengths of a CL file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClUnit {
    /// mm.
    Millimetre,
    /// 10 mm.
    Centimetre,
    /// 25.4 mm.
    Inch,
}

impl ClUnit {
    /// Returns its length in mm.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Inch => 25.4,
        }
    }
}

impl fmt::Display for ClUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Millimetre => "mm",
            Self::Centimetre => "cm",
            Self::Inch => "inches",
        })
    }
}

/// A statement of an APT file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AptStatement {
    /// First line, from 1.
    pub line: u32,
    /// Original text, continuation lines joined.
    pub text: Box<str>,
    /// Meaning, as far as it affects the tool.
    pub meaning: AptMeaning,
}

/// Meaning of an APT statement.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum AptMeaning {
    /// PARTNO.
    PartName(String),
    /// PPRINT, INSERT, REMARK, `$$`.
    Comment,
    /// UNITS: mm per unit of the file.
    Unit(f64),
    /// CUTTER, TLDATA of NX, `$$-> CUTTER` of Creo: the cutter of the points behind it.
    Cutter(FileCutter),
    /// LOADTL, LOAD/TOOL.
    Tool {
        /// Its number.
        number: u32,
        /// Register of its length behind ADJUST or OSETNO, 0 of a file that calls none
        /// (ADJUST,NONE); `None` where the control or the tool decides.
        length_register: Option<u32>,
    },
    /// SPINDL with a speed.
    Spindle {
        /// Revolutions per minute.
        rpm: f64,
        /// True for CLW, and without a direction.
        clockwise: bool,
    },
    /// SPINDL/OFF, or a speed of 0.
    SpindleOff,
    /// SPINDL/ON: the last speed again.
    SpindleOn,
    /// COOLNT.
    Coolant(AptCoolant),
    /// FEDRAT, mm/min.
    Feed(f64),
    /// FEDRAT in mm per revolution.
    FeedPerRevolution(f64),
    /// DELAY: s; `None` for a number of revolutions, and without a number.
    Dwell(Option<f64>),
    /// STOP; OPSTOP is optional.
    Stop {
        /// Whether the operator's switch decides.
        optional: bool,
    },
    /// RAPID: the next point at rapid rate.
    Rapid,
    /// GOTO, FROM, GODLTA, TLON: index in [`AptFile::points`].
    Point(usize),
    /// TLAXIS: axis of the points behind it that give none.
    ToolAxis,
    /// MULTAX: whether points carry axes.
    MultiAxis(bool),
    /// CYCLE: whether a cycle is on.
    Cycle(bool),
    /// CIRCLE, MOVARC: the next point is the end of an arc.
    Circle,
    /// CSYS with twelve numbers: the frame of the following points in that of the part, a row for
    /// each of its axes: components of the axis, and a coordinate of the origin (mm). `None` for
    /// TRNTYP, which gives the purpose of such a frame.
    Frame(Option<Box<[f64; 12]>>),
    /// GOHOME: moves the tool home.
    Home,
    /// CUTCOM: whether the control is to offset the tool to one side. Points are as given.
    RadiusCompensation(bool),
    /// SETUP: whether a setup begins.
    Setup(bool),
    /// FINI.
    End,
    /// Known not to affect the position of the tool (SELECT, lengths of the tool that a system
    /// draws, …).
    Auxiliary,
    /// Kept without evaluation.
    Unknown,
}

/// Cutter that a file describes.
#[derive(Clone, Debug, PartialEq)]
pub enum FileCutter {
    /// A mill.
    Mill(FileMill),
    /// Another kind of TLDATA, such as DRILL.
    Other(String),
}

/// Mill that a file describes, lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileMill {
    /// Statement that describes it.
    pub word: CutterWord,
    /// Diameter.
    pub diameter: f64,
    /// Corner radius; `None` where it is not written.
    pub corner_radius: Option<f64>,
    /// Distance of the centre of the corner from the axis, and its height above the tip; 0 where
    /// they are not written.
    pub corner_center: [f64; 2],
    /// Angle of the bottom to a plane across the axis, deg; 0 where it is not written.
    pub bottom_deg: f64,
    /// Angle of the side to the axis, deg; 0 where it is not written.
    pub side_deg: f64,
}

/// Statement that describes a mill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutterWord {
    /// CUTTER.
    Cutter,
    /// TLDATA/MILL of NX.
    Tldata,
    /// `$$-> CUTTER` of Creo, which never has a corner radius.
    Creo,
}

impl CutterWord {
    /// Returns its name in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cutter => "CUTTER",
            Self::Tldata => "TLDATA/MILL",
            Self::Creo => "CUTTER of Creo",
        }
    }
}

/// Kind of coolant of COOLNT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AptCoolant {
    /// OFF.
    Off,
    /// ON, FLOOD.
    Flood,
    /// MIST, AIR.
    Mist,
    /// Any other kind, such as THRU.
    Other,
}

/// An arc of CIRCLE, MOVARC or CATIA's TLON with a circle: from the point before to that of the
/// statement, about an axis. Lengths in mm, in the frame of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AptArc {
    /// Any point of the axis.
    pub center: Point3<f64>,
    /// The tool turns about it counter-clockwise (right-hand rule).
    pub axis: Unit<Vector3<f64>>,
    /// Radius as given, mm.
    pub radius: Option<f64>,
    /// Angle of the turn as given (ANGLE), rad.
    pub angle: Option<f64>,
}

/// A point of the tool's path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AptPoint {
    /// Line of the statement, from 1.
    pub line: u32,
    /// Kind of the move to it.
    pub kind: AptPointKind,
    /// Tip and axis as given, in the file's own frame, mm.
    pub cl: ClPoint,
    /// Feed, mm/min; `None` for rapids and before the first FEDRAT.
    pub feed: Option<f64>,
    /// Index in [`AptFile::statements`] of the frame in which the point is given; `None` before the
    /// first.
    pub frame: Option<u32>,
    /// Index in [`AptFile::arcs`] of the arc that ends here; `None` for other points, and for arcs
    /// whose statement gives no centre and axis.
    pub arc: Option<u32>,
}

/// Kind of the move to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AptPointKind {
    /// FROM: the tool is there.
    Start,
    /// Behind RAPID.
    Rapid,
    /// Straight, cutting.
    Linear,
    /// End of a CIRCLE.
    Arc,
    /// A place of a cycle.
    Cycle,
}

/// A major word that was kept without evaluation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AptUnknownWord {
    /// The word, in upper case.
    pub word: String,
    /// First line, from 1.
    pub line: u32,
    /// Number of statements.
    pub count: usize,
}
