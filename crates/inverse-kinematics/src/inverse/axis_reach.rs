use std::f64::consts::{PI, TAU};

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::axes::axis::{AxisKind, AxisLetter};
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::machine::build::build_view;
use crate::machine_file::Joint;
use crate::machine_file::error::MachineError;
use crate::solver::Solver;
use crate::solver::inverse_solution::BranchPreference;

/// Directions of the tool axis that a machine reaches with its rotary axes inside their limits.
///
/// With two rotary axes this holds for every tip, if the linear axes are long enough. With three it
/// depends on the tip: it is given for one [`tip`](Self::tip), and the linear axes are inside their
/// limits too.
///
/// Angles are counted from the z axis of the table frame, rad. They come from a grid of directions
/// with bisection between its points: estimates, accurate to the change of the reach within 1.5° of
/// azimuth (6° with three rotary axes). The smallest and largest angle are reached.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisReach {
    /// Share of the sphere of directions, 0 to 1.
    pub share: f64,
    /// Smallest angle from z of a reached direction.
    pub smallest_tilt: f64,
    /// Largest one.
    pub largest_tilt: f64,
    /// Every direction up to this angle from z is reached; 0 where z itself is not, or nothing
    /// around it.
    pub full_cone: f64,
    /// Directions in which a rotary axis has no effect on the tool axis. Not given with three
    /// rotary axes, which are singular in poses, not in directions.
    pub singular: Vec<SingularDirection>,
    /// Tip for which all this holds, table frame, mm: that of the bare spindle nose with every axis
    /// in the middle of its travel, endless ones at home. `None` where it holds for every tip.
    pub tip: Option<Point3<f64>>,
}

/// A direction of the tool axis along the rotary axis nearest to the workpiece, which may then have
/// any value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularDirection {
    /// The rotary axis.
    pub axis: AxisLetter,
    /// The direction, table frame.
    pub direction: Unit<Vector3<f64>>,
    /// Whether the other rotary axes reach it within their limits.
    pub is_reached: bool,
}

/// Steps of the angle from z, and of the azimuth.
const STEPS: usize = 240;

/// The same with three rotary axes, whose solution takes a hundred times as long.
const STEPS_OF_THREE: usize = 60;

/// Values of a rotary axis, its limits among them.
const VALUES: usize = 25;

/// Halvings of an interval of the grid: to 1e-9 rad.
const HALVINGS: usize = 24;

/// Limits of linear axes that no pose about the origin exceeds, mm; small enough to keep solutions
/// exact.
const FAR: f64 = 1e6;

impl Machine {
    /// Returns the directions of the tool axis that the rotary axes reach.
    ///
    /// # Errors
    /// None for a machine that was built: with two rotary axes it is built again with longer linear
    /// axes.
    pub fn axis_reach(&self) -> Result<AxisReach, MachineError> {
        if let Solver::Numeric(_) = self.solver {
            let tip = self.middle_tip();
            return Ok(AxisReach { tip: Some(tip), ..self.reach_on_grid(STEPS_OF_THREE, &tip) });
        }
        let machine = self.with_long_linear_axes()?;
        let mut reach = machine.reach_on_grid(STEPS, &Point3::origin());
        // Corners of the reach lie between azimuths, where rotary axes are at their limits.
        for tilt in machine.tilts() {
            reach.smallest_tilt = reach.smallest_tilt.min(tilt);
            reach.largest_tilt = reach.largest_tilt.max(tilt);
        }
        reach.singular = machine.singular_directions();
        Ok(reach)
    }

    /// Returns the reach at a tip, from a grid with so many steps of tilt and azimuth, without
    /// singular directions and tip.
    fn reach_on_grid(&self, steps: usize, tip: &Point3<f64>) -> AxisReach {
        let reaches = |tilt: f64, azimuth: f64| self.reaches_direction(tip, &direction(tilt, azimuth));
        let step = PI / steps as f64;
        let mut reach = AxisReach {
            share: 0.0,
            smallest_tilt: PI,
            largest_tilt: 0.0,
            full_cone: PI,
            singular: Vec::new(),
            tip: None,
        };
        for k in 0..steps {
            let azimuth = TAU * (k as f64 + 0.5) / steps as f64;
            // Middles of the bands, which represent their areas, and both poles.
            let tilt = |i: usize| if i > steps { PI } else { ((i as f64 - 0.5) * step).max(0.0) };
            let free: Vec<bool> = (0..=steps + 1).map(|i| reaches(tilt(i), azimuth)).collect();
            let border = |inside: usize, outside: usize| {
                let (mut a, mut b) = (tilt(inside), tilt(outside));
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (a + b);
                    if reaches(middle, azimuth) { a = middle } else { b = middle }
                }
                a
            };
            let bands = (1..=steps).filter(|&i| free[i]);
            reach.share += bands.map(|i| (tilt(i) - 0.5 * step).cos() - (tilt(i) + 0.5 * step).cos()).sum::<f64>();
            if let Some(first) = free.iter().position(|f| *f) {
                let tilt = if first == 0 { 0.0 } else { border(first, first - 1) };
                reach.smallest_tilt = reach.smallest_tilt.min(tilt);
            }
            if let Some(last) = free.iter().rposition(|f| *f) {
                let tilt = if last == steps + 1 { PI } else { border(last, last + 1) };
                reach.largest_tilt = reach.largest_tilt.max(tilt);
            }
            if let Some(first_not) = free.iter().position(|f| !*f) {
                let cone = if first_not == 0 { 0.0 } else { border(first_not - 1, first_not) };
                reach.full_cone = reach.full_cone.min(cone);
            }
        }
        reach.share /= 2.0 * steps as f64;
        reach
    }

    /// Returns the nose with every axis in the middle of its travel, endless ones at home.
    fn middle_tip(&self) -> Point3<f64> {
        let middle = |k: usize| {
            let axis = &self.axes()[k];
            if axis.endless { axis.home } else { 0.5 * (axis.min + axis.max) }
        };
        self.cl_point(&AxisValues::from_fn(self.axes().len(), middle), 0.0).tip
    }

    /// Returns the same machine with very long linear axes.
    fn with_long_linear_axes(&self) -> Result<Self, MachineError> {
        let mut file = self.to_file();
        let rows = file.workpiece_chain.rows.iter_mut().chain(file.tool_chains.iter_mut().flat_map(|c| &mut c.rows));
        for row in rows {
            if let Some(Joint::Prismatic(j)) = &mut row.joint {
                (j.min_mm, j.max_mm) = (j.min_mm.min(-FAR), j.max_mm.max(FAR));
            }
        }
        build_view(file, self.head)
    }

    /// Returns angles of the tool axis from z with the rotary axes on a grid of their values, both
    /// limits included.
    fn tilts(&self) -> impl Iterator<Item = f64> + '_ {
        let rotary: Vec<usize> = (0..self.axes().len()).filter(|&k| self.is_rotary(k)).collect();
        (0..VALUES.pow(rotary.len() as u32)).map(move |combination| {
            let mut q = AxisValues::zeros(self.axes().len());
            let mut rest = combination;
            for &k in &rotary {
                let axis = &self.axes()[k];
                let [min, max] = if axis.has_no_stops() { [-PI, PI] } else { [axis.min, axis.max] };
                q[k] = min + (max - min) * (rest % VALUES) as f64 / (VALUES - 1) as f64;
                rest /= VALUES;
            }
            let axis = self.cl_point(&q, 0.0).axis;
            axis.xy().norm().atan2(axis.z)
        })
    }

    /// Returns whether the tool axis takes this direction with the tip there.
    fn reaches_direction(&self, tip: &Point3<f64>, axis: &Unit<Vector3<f64>>) -> bool {
        let cl = ClPoint { tip: *tip, axis: *axis };
        self.nearest_inverse(&cl, 0.0, None, BranchPreference::Nearest).is_ok()
    }

    fn singular_directions(&self) -> Vec<SingularDirection> {
        let first = self.joint_lines().into_iter().find(|l| l.kind == AxisKind::Rotary);
        let both = first.into_iter().flat_map(|l| [(l.axis, l.direction), (l.axis, -l.direction)]);
        both.map(|(axis, direction)| SingularDirection {
            axis: self.axes()[axis].letter,
            direction,
            is_reached: self.reaches_direction(&Point3::origin(), &direction),
        })
        .collect()
    }
}

fn direction(tilt: f64, azimuth: f64) -> Unit<Vector3<f64>> {
    let (sin, cos) = tilt.sin_cos();
    Unit::new_normalize(Vector3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos))
}
