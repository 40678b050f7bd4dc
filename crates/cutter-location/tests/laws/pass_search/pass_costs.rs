//! Cost of a sequence of postures as docs/method.md defines it, in a second implementation.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::cut_point::Strip;
use facemill_cutter_location::{SmoothSettings, Workcell};
use facemill_inverse_kinematics::{Axis, AxisKind, AxisValues, Branch, BranchPreference};
use facemill_tool_model::{Cusp, Outline, cusp_height_between};
use nalgebra::Vector3;

pub(crate) const STRIP: Strip = Strip::on_plane(6.0);
pub(crate) const SMOOTH: SmoothSettings =
    SmoothSettings { feed: 20.0, cusp: 0.05, strip: STRIP, widest: STRIP.step_over };

/// Cost of starting on the branch that is not preferred, of changing branch, and of each limit
/// times the ratio, s.
const JUMP: f64 = 1e4;

/// Tool axis by its parts along feed, left and normal.
pub(crate) fn seen(cc: &CcPoint, p: Posture) -> Vector3<f64> {
    let axis = cc.tool_axis(p);
    Vector3::new(cc.feed.dot(&axis), cc.left().dot(&axis), cc.normal.dot(&axis))
}

/// A posture, and the axis values in it.
pub(crate) type Stood = (Posture, AxisValues);

/// Cost of sequences at all points of a pass.
pub(crate) struct Cost<'c> {
    pub(crate) cell: &'c Workcell<'c>,
    pub(crate) points: &'c [CcPoint],
    pub(crate) max_turn_per_mm: f64,
    pub(crate) feed: f64,
    /// Mean time between layers, s.
    pub(crate) layer_time: f64,
}

impl Cost<'_> {
    pub(crate) fn length(&self, k: usize) -> f64 {
        (self.points[k + 1].position - self.points[k].position).norm()
    }

    /// Time from point `k` to the next, s.
    fn time(&self, k: usize) -> f64 {
        self.length(k) / self.feed
    }

    pub(crate) fn of(&self, way: &[Stood]) -> f64 {
        let standing: f64 = (0..way.len()).map(|k| self.standing(k, way[k].0)).sum();
        let steps: f64 = (1..way.len()).map(|k| self.step(k - 1, &way[k - 1], &way[k])).sum();
        self.start(&way[0].1) + standing + steps
    }

    /// Returns the least cost of all sequences that take one of these at each point, by
    /// enumeration.
    pub(crate) fn least(&self, choices: &[Vec<Stood>]) -> f64 {
        let standing = |k: usize| choices[k].iter().map(|c| self.standing(k, c.0)).collect();
        let standing: Vec<Vec<f64>> = (0..choices.len()).map(standing).collect();
        let begun = choices[0].iter().zip(&standing[0]).map(|(c, own)| (c, self.start(&c.1) + own));
        begun.map(|(c, cost)| self.least_on(choices, &standing, 1, c, cost)).fold(f64::INFINITY, f64::min)
    }

    fn least_on(&self, choices: &[Vec<Stood>], standing: &[Vec<f64>], k: usize, from: &Stood, so_far: f64) -> f64 {
        if k == choices.len() {
            return so_far;
        }
        let onward = choices[k].iter().zip(&standing[k]).map(|(to, own)| {
            let cost = so_far + self.step(k - 1, from, to) + own;
            self.least_on(choices, standing, k + 1, to, cost)
        });
        onward.fold(f64::INFINITY, f64::min)
    }

    fn start(&self, axes: &AxisValues) -> f64 {
        let wanted = match self.cell.preferred_branch {
            BranchPreference::Nearest => return 0.0,
            BranchPreference::Positive => Branch::Positive,
            BranchPreference::Negative => Branch::Negative,
        };
        if self.cell.machine.branch_of(axes) == wanted { 0.0 } else { JUMP }
    }

    fn standing(&self, k: usize, posture: Posture) -> f64 {
        let before = if k > 0 { self.time(k - 1) } else { 0.0 };
        let after = if k + 1 < self.points.len() { self.time(k) } else { 0.0 };
        let outline = Outline::new(self.cell.tool.cutter(), posture);
        let height = match cusp_height_between(&outline, &outline, STRIP.step_over, &STRIP.curvature) {
            Cusp::Height(h) => (h / SMOOTH.cusp).min(4.0),
            Cusp::Uncut => 4.0,
        };
        0.5 * (before + after) * (height.powi(2) + (20.0 * (height - 0.9f64).max(0.0)).powi(2))
    }

    /// Returns the cost from point `k` to the next.
    fn step(&self, k: usize, from: &Stood, to: &Stood) -> f64 {
        let time = self.time(k);
        let mut sum = 0.0;
        for (index, axis) in self.cell.machine.axes().iter().enumerate() {
            let mut much = axis.max_velocity.min(axis.max_acceleration.map_or(f64::INFINITY, |a| a * self.layer_time));
            if axis.kind == AxisKind::Rotary {
                much = much.min(self.max_turn_per_mm * self.feed);
            }
            sum += (axis_step(axis, index, from.1, to.1) / time / much).powi(2) * time;
        }
        // An axis that cannot keep the programmed feed.
        let fastest = self.fastest(from.1, to.1, time);
        sum += if fastest > 1.0 + 1e-9 { JUMP * fastest } else { 0.0 };
        let machine = self.cell.machine;
        sum += if machine.branch_of(&from.1) == machine.branch_of(&to.1) { 0.0 } else { JUMP };
        let turn = (seen(&self.points[k + 1], to.0) - seen(&self.points[k], from.0)).norm();
        let limit = self.max_turn_per_mm * self.length(k);
        assert!(turn <= limit, "the scene is to stay below the limit: {turn} {limit}");
        sum
    }

    /// Returns the speed of the axis nearest to its largest velocity, or farthest beyond it, over
    /// that velocity.
    pub(crate) fn fastest(&self, from: AxisValues, to: AxisValues, time: f64) -> f64 {
        let axes = self.cell.machine.axes().iter().enumerate();
        axes.map(|(index, axis)| axis_step(axis, index, from, to).abs() / time / axis.max_velocity).fold(0.0, f64::max)
    }
}

/// Returns the distance of an axis between two positions, for an endless one the short way.
fn axis_step(axis: &Axis, index: usize, from: AxisValues, to: AxisValues) -> f64 {
    let step = to.get_or_zero(index) - from.get_or_zero(index);
    if axis.endless { (step + PI).rem_euclid(TAU) - PI } else { step }
}
