use facemill_cl_data::{ClPoint, MotionLaw};
use facemill_file_format::FormatError;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::{
    Axis, AxisKind, AxisLetter, AxisValues, MachineBody, MachineFile, Unreachable,
    build::build,
    heads::OtherChain,
    inverse::TIP_ACCURACY,
    screw_chain::{LinearMap, ScrewChain},
    solver::Solver,
};

/// A five-axis machine tool: forward and inverse solution, limits, bodies, motion laws.
///
/// Of a machine with two heads it is the view of one of them, see [`Machine::heads`].
///
/// Everything is told in the table frame, the end of the workpiece chain, in mm, rad and s. The tool frame has its origin
/// at the tip and its z axis toward the spindle; the tool length is the distance from the tip to the spindle nose.
/// Two machines are equal when their files are.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    pub(crate) file: MachineFile,
    pub(crate) axes: Vec<Axis>,
    pub(crate) chain: ScrewChain,
    pub(crate) solver: Solver,
    pub(crate) bodies: Vec<MachineBody>,
    /// Number of the tool chain that `chain` ends with.
    pub(crate) head: usize,
    /// The other tool chain of a machine with two.
    pub(crate) other: Option<OtherChain>,
}

/// Feeds the control can be given, in the unit of the F word: mm/min over all axes, 1 deg counted as 1 mm (G94).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedRange {
    /// Smallest F.
    pub min: f64,
    /// Largest F.
    pub max: f64,
    /// Feed of linear rapids; without it the axis speeds alone limit them.
    pub rapid: Option<f64>,
}

/// Why a machine file cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
        /// What is wrong with it.
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
    /// The file has two tool chains where the machine of one is asked for.
    #[error(
        "the machine has two heads (tool_chains has 2 chains), and one is asked for here: use the views of both, \
         `Machine::heads`"
    )]
    TwoHeads,
    /// Two heads without an axis that both have.
    #[error(
        "workpiece_chain has no joint, so the two heads share no axis: describe them as two machines, or put the axis \
         that turns the workpiece into workpiece_chain"
    )]
    NothingShared,
    /// All rotary joints turn the tool about the same direction; told are two of them.
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
    /// The linear joints do not add enough for the tip to be placed anywhere: three of them lie in one plane, or two do not
    /// add to what three rotary joints do.
    #[error("the linear axes {} leave a direction in which the tip cannot be placed", axes.iter().map(AxisLetter::as_str).collect::<Vec<_>>().join(", "))]
    DependentLinears {
        /// The linear axes.
        axes: Vec<AxisLetter>,
    },
    /// In every pose some axes can move together without moving the tool, so that the others do not place and turn it.
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

/// What is wrong with a field of a machine file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// No axis, control or chain has such a value.
    #[error("is {value:?}, but has to be from {least} to {most}: is the unit right?")]
    OutOfRange {
        /// The value in the file.
        value: f64,
        /// Least.
        least: f64,
        /// Largest.
        most: f64,
    },
    /// No machine is that large.
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
    /// A key of endless axes on one with stops.
    #[error("is for axes whose range is endless: leave it out, or the limits")]
    OnlyEndless,
    /// A limit of the wind-up of an axis that counts to 360 deg.
    #[error("is for axes whose words wind on: with rollover shortest or sign_directed nothing winds up")]
    RollsOver,
    /// The axis is not an address of NC text.
    #[error("is not an axis address: one of X Y Z A B C U V W, with a digit from 1 to 9 behind it for a second head")]
    NoAxisLetter,
    /// A list of axes names one that no joint has.
    #[error("is the address of no joint")]
    NoSuchAxis,
    /// An axis is named for a value that the machine has as a whole.
    #[error("names an axis, but the value belongs to the machine as a whole; leave `axes` out")]
    NotOfAnAxis,
    /// Two joints have the same address.
    #[error(
        "is the address of another joint already; axes of a second head take a number (X2), and an axis that two heads \
         share stands in workpiece_chain alone"
    )]
    DuplicateAxis,
    /// A name is empty.
    #[error("is empty")]
    Empty,
    /// A body is the hull of a mesh that nobody has read.
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

impl Machine {
    /// Reads a machine file.
    ///
    /// # Errors
    /// When the text is no machine file, a value makes no sense, or the joints have no inverse solution here. A file with two
    /// heads is for [`Machine::heads_from_json`].
    pub fn from_json(text: &[u8]) -> Result<Self, MachineError> {
        Self::from_file(facemill_file_format::from_json(text)?)
    }

    /// The machine that a file describes.
    ///
    /// # Errors
    /// As [`Machine::from_json`], the text aside.
    pub fn from_file(file: MachineFile) -> Result<Self, MachineError> {
        build(file)
    }

    /// The file the machine was built from.
    pub fn to_file(&self) -> MachineFile {
        self.file.clone()
    }

    /// What reports call the machine.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// The axes in the order of NC words: X Y Z A B C U V W, those with a number behind all without. Axis values stand in
    /// this order everywhere. Of a machine with two heads they are all of them, see [`Machine::moves_tool`].
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Index of the axis with this address.
    pub fn axis_index(&self, letter: &str) -> Option<usize> {
        self.axes.iter().position(|a| a.letter == letter)
    }

    /// Home position of every axis.
    pub fn home(&self) -> AxisValues {
        AxisValues::from_fn(self.axes.len(), |k| self.axes[k].home)
    }

    /// First axis that is outside its limits, if any; the other head's are asked too.
    pub fn first_beyond_limit(&self, q: &AxisValues) -> Option<usize> {
        (0..self.axes.len()).find(|&k| !self.axes[k].holds(q.get_or_zero(k)))
    }

    /// Pose of the tool in the table frame: origin at the tip, z toward the spindle (forward kinematics).
    ///
    /// Holds for any values, limits are not asked. Missing values count as 0.
    pub fn forward(&self, q: &AxisValues, tool_length: f64) -> Isometry3<f64> {
        self.chain.forward(q, tool_length)
    }

    /// Tip and tool axis in the table frame; as [`Machine::forward`] without the turn about the tool's own axis.
    pub fn cl_point(&self, q: &AxisValues, tool_length: f64) -> ClPoint {
        let map = self.linear_map(q, tool_length);
        ClPoint { tip: Point3::from(map.tip(&self.linears_of(q))), axis: Unit::new_normalize(map.tool_axis) }
    }

    /// The linear values in chain order, 0 where there is no third.
    pub(crate) fn linears_of(&self, q: &AxisValues) -> Vector3<f64> {
        let mut linears = Vector3::zeros();
        for (k, &axis) in self.solver.linears().iter().enumerate() {
            linears[k] = q.get_or_zero(axis);
        }
        linears
    }

    /// What the control does between two programmed positions.
    pub fn motion_law(&self) -> MotionLaw {
        self.file.motion.law()
    }

    /// Feeds the control can be given.
    pub fn feed_range(&self) -> FeedRange {
        let feed = &self.file.feed;
        FeedRange { min: feed.min_mm_min, max: feed.max_mm_min, rapid: feed.rapid_mm_min }
    }

    /// The bodies of the machine.
    pub fn bodies(&self) -> &[MachineBody] {
        &self.bodies
    }

    /// Direction from the nose into the spindle with all rotary axes at 0, table frame: the direction in which tool
    /// length compensation (G43) moves the head.
    pub fn length_compensation_axis(&self) -> Unit<Vector3<f64>> {
        self.chain.spindle_at_zero()
    }

    /// Travel of every axis per mm of tool length that keeps the tip in its place with all rotary axes at 0: what G43
    /// adds to the programmed words. Rotary entries are 0; `None` when the linear axes are dependent there, or cannot move
    /// the tip along the spindle.
    pub fn length_compensation_travel(&self) -> Option<AxisValues> {
        let zero = AxisValues::zeros(self.axes.len());
        let tip = Point3::from(self.linear_map(&zero, 0.0).offset);
        self.with_linears(&zero, &tip, 1.0).ok()
    }

    /// The rotary values of `q` with the linear values that bring the tip to `tip`.
    ///
    /// # Errors
    /// When they are dependent there, or, of two linear axes, when the tip is not in the plane they move it in.
    pub(crate) fn with_linears(
        &self,
        q: &AxisValues,
        tip: &Point3<f64>,
        tool_length: f64,
    ) -> Result<AxisValues, Unreachable> {
        let map = self.linear_map(q, tool_length);
        let linears = self.solve_linears(&map, tip).ok_or(Unreachable::Singular)?;
        let by = (map.tip(&linears) - tip.coords).norm();
        if let [first, second] = self.solver.linears()[..]
            && by > TIP_ACCURACY
        {
            return Err(Unreachable::Tip { first: self.axes[first].letter, second: self.axes[second].letter, by });
        }
        let mut q = *q;
        for (k, &axis) in self.solver.linears().iter().enumerate() {
            q[axis] = linears[k];
        }
        Ok(q)
    }

    /// The linear values that bring the tip to `tip`, or, of two linear axes, nearest to it; `None` when they are dependent.
    pub(crate) fn solve_linears(&self, map: &LinearMap, tip: &Point3<f64>) -> Option<Vector3<f64>> {
        match self.solver {
            Solver::Closed { .. } => map.solve(tip),
            Solver::Numeric(_) => map.solve_two(tip),
        }
    }

    pub(crate) fn linear_map(&self, q: &AxisValues, tool_length: f64) -> LinearMap {
        self.chain.linear_map(q, tool_length)
    }

    /// Whether it is a rotary axis that moves the tool.
    pub(crate) fn is_rotary(&self, axis: usize) -> bool {
        self.axes[axis].kind == AxisKind::Rotary && self.moves_tool(axis)
    }
}
