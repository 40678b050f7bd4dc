//! Faults of a machine file.

use facemill_file_format::FormatError;

use crate::axes::axis::AxisLetter;

/// Reason why a machine file cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// The text is not a machine file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A value makes no sense.
    #[error("{field}{}: {problem}", axis.as_ref().map(|a| format!(" (axis {a})")).unwrap_or_default())]
    Field {
        /// Path of the field, such as `tool_chains[0].rows[2].joint.prismatic.max_mm`.
        field: String,
        /// The axis the field belongs to, as the file calls it.
        axis: Option<String>,
        /// Fault.
        problem: FieldProblem,
    },
    /// There is no inverse solution for these joints.
    #[error(
        "tool_chains[{head}] and workpiece_chain together have {n_linear} linear and {n_rotary} rotary joints; only three \
         linear and two rotary or two linear and three rotary joints have an inverse solution here"
    )]
    UnsupportedStructure {
        /// Number of the tool chain, from 0.
        head: usize,
        /// Prismatic joints of it and the workpiece chain.
        n_linear: usize,
        /// Revolute joints of both.
        n_rotary: usize,
    },
    /// Neither one nor two tool chains.
    #[error("tool_chains has {n_heads} chains; machines have one head here, or two that share the workpiece's axes")]
    HeadCount {
        /// Number of tool chains.
        n_heads: usize,
    },
    /// The file has two tool chains where the machine of one is requested.
    #[error(
        "the machine has two heads (tool_chains has 2 chains), but one head is required here: use the views of both, \
         `Machine::heads`"
    )]
    TwoHeads,
    /// Two heads without an axis that both have.
    #[error(
        "workpiece_chain has no joint, so the two heads share no axis: describe them as two machines, or put the axis \
         that turns the workpiece into workpiece_chain"
    )]
    NothingShared,
    /// All rotary joints turn the tool about the same direction; holds two of them.
    #[error("the rotary axes {first} and {second} are parallel, so the tool axis has one degree of freedom only")]
    ParallelRotaries {
        /// The one nearer to the workpiece.
        first: AxisLetter,
        /// The one nearer to the tool.
        second: AxisLetter,
    },
    /// The rotary joint nearest to the tool turns it about its own axis.
    #[error("rotary axis {axis} is parallel to the spindle, so it does not turn the tool axis")]
    ToolAlongRotary {
        /// The rotary axis nearest to the tool.
        axis: AxisLetter,
    },
    /// The linear joints are too few for the tip to be placed anywhere: three of them lie in one
    /// plane, or two do not complement three rotary joints.
    #[error("the linear axes {} leave a direction in which the tip cannot be placed", axes.iter().map(AxisLetter::as_str).collect::<Vec<_>>().join(", "))]
    DependentLinears {
        /// The linear axes.
        axes: Vec<AxisLetter>,
    },
    /// In every pose some axes can move together without moving the tool, so the others do not
    /// suffice to place and turn it.
    #[error(
        "in every pose the axes {} can move together without moving the tool, so that the machine has four degrees of freedom or \
         less; check the directions of these axes",
        axes.iter().map(AxisLetter::as_str).collect::<Vec<_>>().join(", ")
    )]
    DependentAxes {
        /// The axes that move together.
        axes: Vec<AxisLetter>,
    },
}

/// Fault of a field of a machine file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FieldProblem {
    /// NaN or infinite.
    #[error("is not a finite number")]
    NotFinite,
    /// A size, speed or feed that must be above 0.
    #[error("is {value}, but has to be above 0")]
    NotPositive {
        /// The value in the file.
        value: f64,
    },
    /// A length or angle that must not be below 0.
    #[error("is {value}, but must not be below 0")]
    Negative {
        /// The value in the file.
        value: f64,
    },
    /// The value is impossible for any axis, control or chain.
    #[error("is {value:?}, but has to be from {least} to {most}: is the unit right?")]
    OutOfRange {
        /// The value in the file.
        value: f64,
        /// Least.
        least: f64,
        /// Largest.
        most: f64,
    },
    /// A length beyond that of any machine.
    #[error("is {value}, more than {largest} from 0: is the unit right?")]
    TooFar {
        /// As given, mm.
        value: f64,
        /// Largest length, mm.
        largest: f64,
    },
    /// The upper end of a range is below the lower one.
    #[error("is {max}, which is below the minimum {min}")]
    EmptyRange {
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// The home position is outside the limits.
    #[error("is {home}, which is outside the limits {min} to {max}")]
    HomeOutside {
        /// Home position.
        home: f64,
        /// Lower limit.
        min: f64,
        /// Upper limit.
        max: f64,
    },
    /// A key for endless axes on one with stops.
    #[error("is for axes whose range is endless: leave it out, or the limits")]
    OnlyEndless,
    /// A wind-up limit of an axis that counts to 360 deg.
    #[error("is for axes whose words wind on: with rollover shortest or sign_directed nothing winds up")]
    RollsOver,
    /// The axis is not an address of NC text.
    #[error("is not an axis address: one of X Y Z A B C U V W, with a digit from 1 to 9 behind it for a second head")]
    NoAxisLetter,
    /// A list of axes has one without a joint.
    #[error("is the address of no joint")]
    NoSuchAxis,
    /// A list of axes for a value that belongs to the machine as a whole.
    #[error("names an axis, but the value belongs to the machine as a whole; leave `axes` out")]
    NotOfAnAxis,
    /// Two joints have the same address.
    #[error(
        "is the address of another joint already; axes of a second head take a number (X2), and an axis that two heads \
         share belongs in workpiece_chain alone"
    )]
    DuplicateAxis,
    /// A chain has rows and lines.
    #[error("are given beside rows: leave one of both out")]
    BesideRows,
    /// A direction without length.
    #[error("is [0, 0, 0], but a direction needs a length above 0")]
    NoDirection,
    /// A rotary axis that is given by its direction alone.
    #[error("is missing: a rotary axis needs a point on its line")]
    NoPoint,
    /// A rotary axis on the line of its neighbour: both turn as one.
    #[error("is on the line of axis {other} ({field}), so that both turn as one: correct point and direction")]
    OnLineOf {
        /// The neighbour, nearer to the workpiece.
        other: String,
        /// Field of the neighbour.
        field: String,
    },
    /// A line whose row has a length beyond that of any machine.
    #[error(
        "makes a row with {value} mm, more than {largest}: the line is nearly parallel to a neighbour and far from it; \
         correct their directions and points"
    )]
    FarRow {
        /// Length in the row, mm.
        value: f64,
        /// Largest length, mm.
        largest: f64,
    },
    /// A name is empty.
    #[error("is empty")]
    Empty,
    /// A body is the hull of a mesh that was not read.
    #[error(
        "names the mesh file {file:?}, which is not read here: read the machine file with `MachineFile`, give the hulls of \
         its meshes by `MachineFile::with_hulls` and make the machine by `Machine::from_file` or `Machine::heads` (the \
         program facemill does so)"
    )]
    MeshNotRead {
        /// The mesh file.
        file: String,
    },
}
