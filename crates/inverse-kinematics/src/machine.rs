//! Machines: forward solution, limits, bodies.

pub(crate) mod bodies;
pub(crate) mod body_poses;
pub(crate) mod build;
pub(crate) mod check;
pub(crate) mod heads;
pub(crate) mod limits;
pub(crate) mod line_rows;
pub(crate) mod preset;
pub(crate) mod work_frame;

use facemill_cl_data::{ClPoint, MotionLaw};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::axes::axis::{Axis, AxisKind};
use crate::axes::axis_values::AxisValues;
use crate::machine::bodies::MachineBody;
use crate::machine::build::build;
use crate::machine::heads::OtherChain;
use crate::machine_file::MachineFile;
use crate::machine_file::error::MachineError;
use crate::solver::Solver;
use crate::solver::inverse_solution::{TIP_ACCURACY, Unreachable};
use crate::solver::screw_chain::{LinearMap, ScrewChain};

/// A five-axis machine tool: forward and inverse solution, limits, bodies, motion laws.
///
/// For a machine with two heads it is the view of one of them, see [`Machine::heads`].
///
/// Everything is given in the table frame, the end of the workpiece chain, in mm, rad and s. The
/// tool frame has its origin at the tip and its z axis toward the spindle; the tool length is the
/// distance from the tip to the spindle nose. Two machines are equal when their files are.
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

/// Feeds the control can be given, in the unit of the F word: mm/min over all axes, 1 deg counted
/// as 1 mm (G94).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedRange {
    /// Smallest F.
    pub min: f64,
    /// Largest F.
    pub max: f64,
    /// Feed of linear rapids; without it only the axis speeds limit them.
    pub rapid: Option<f64>,
}

impl Machine {
    /// Reads a machine file.
    ///
    /// # Errors
    /// When the text is not a machine file, a value makes no sense, or the joints have no inverse
    /// solution here. For a file with two heads use [`Machine::heads_from_json`].
    pub fn from_json(text: &[u8]) -> Result<Self, MachineError> {
        Self::from_file(facemill_file_format::from_json(text)?)
    }

    /// Builds the machine that a file describes.
    ///
    /// # Errors
    /// As [`Machine::from_json`], except for the text.
    pub fn from_file(file: MachineFile) -> Result<Self, MachineError> {
        build(file)
    }

    /// Returns the file that the machine was built from, with rows made from axis lines.
    pub fn to_file(&self) -> MachineFile {
        self.file.clone()
    }

    /// Returns the name of the machine in reports.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Returns the axes in the order of NC words: X Y Z A B C U V W, those with a number behind all
    /// without. Axis values have this order everywhere. For a machine with two heads they are all
    /// of its axes, see [`Machine::moves_tool`].
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Returns the index of the axis with this address.
    pub fn axis_index(&self, letter: &str) -> Option<usize> {
        self.axes.iter().position(|a| a.letter == letter)
    }

    /// Returns the home position of every axis.
    pub fn home(&self) -> AxisValues {
        AxisValues::from_fn(self.axes.len(), |k| self.axes[k].home)
    }

    /// Returns the first axis that is outside its limits, if any, including the other head's.
    pub fn first_beyond_limit(&self, q: &AxisValues) -> Option<usize> {
        (0..self.axes.len()).find(|&k| !self.axes[k].holds(q.get_or_zero(k)))
    }

    /// Returns the pose of the tool in the table frame: origin at the tip, z toward the spindle
    /// (forward kinematics).
    ///
    /// Valid for any values, without testing limits. Missing values count as 0.
    pub fn forward(&self, q: &AxisValues, tool_length: f64) -> Isometry3<f64> {
        self.chain.forward(q, tool_length)
    }

    /// Returns tip and tool axis in the table frame; as [`Machine::forward`] without the turn about
    /// the tool's own axis.
    pub fn cl_point(&self, q: &AxisValues, tool_length: f64) -> ClPoint {
        let map = self.linear_map(q, tool_length);
        ClPoint { tip: Point3::from(map.tip(&self.linears_of(q))), axis: Unit::new_normalize(map.tool_axis) }
    }

    /// Returns the linear values in chain order, 0 where there is no third.
    pub(crate) fn linears_of(&self, q: &AxisValues) -> Vector3<f64> {
        let mut linears = Vector3::zeros();
        for (k, &axis) in self.solver.linears().iter().enumerate() {
            linears[k] = q.get_or_zero(axis);
        }
        linears
    }

    /// Returns the motion of the control between two programmed positions.
    pub fn motion_law(&self) -> MotionLaw {
        self.file.motion.law()
    }

    /// Returns the feeds that the control accepts.
    pub fn feed_range(&self) -> FeedRange {
        let feed = &self.file.feed;
        FeedRange { min: feed.min_mm_min, max: feed.max_mm_min, rapid: feed.rapid_mm_min }
    }

    /// Returns the time of a tool change, s; `None` if the file does not say it.
    #[must_use]
    pub fn tool_change_time(&self) -> Option<f64> {
        self.file.tool_change_s
    }

    /// Returns the bodies of the machine.
    pub fn bodies(&self) -> &[MachineBody] {
        &self.bodies
    }

    /// Returns the travel of every axis per mm of tool length that keeps the tip in its place with
    /// all rotary axes at 0, which G43 adds to the programmed words. Rotary entries are 0; `None`
    /// when the linear axes are dependent there, or cannot move the tip along the spindle.
    pub fn length_compensation_travel(&self) -> Option<AxisValues> {
        let zero = AxisValues::zeros(self.axes.len());
        let tip = Point3::from(self.linear_map(&zero, 0.0).offset);
        self.with_linears(&zero, &tip, 1.0).ok()
    }

    /// Returns the rotary values of `q` with the linear values that bring the tip to `tip`.
    ///
    /// # Errors
    /// When they are dependent there, or, with two linear axes, when the tip is not in the plane of
    /// their motion.
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

    /// Returns the linear values that bring the tip to `tip`, or, with two linear axes, nearest to
    /// it; `None` when they are dependent.
    pub(crate) fn solve_linears(&self, map: &LinearMap, tip: &Point3<f64>) -> Option<Vector3<f64>> {
        match self.solver {
            Solver::Closed { .. } => map.solve(tip),
            Solver::Numeric(_) => map.solve_two(tip),
        }
    }

    pub(crate) fn linear_map(&self, q: &AxisValues, tool_length: f64) -> LinearMap {
        self.chain.linear_map(q, tool_length)
    }

    /// Returns whether an axis is a rotary one that moves the tool.
    pub(crate) fn is_rotary(&self, axis: usize) -> bool {
        self.axes[axis].kind == AxisKind::Rotary && self.moves_tool(axis)
    }
}
