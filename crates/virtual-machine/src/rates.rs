//! Bounds on how fast the axes go over an interval of a motion and how that changes, and on accelerations of parts.

use facemill_cl_data::{ControlTolerance, CuttingLaw};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion};
use nalgebra::Matrix3;

use crate::stepping::{MAX_TURN, rotary_axis, ways};
use crate::turned_rotaries::TurnedRotaries;

/// Bounds over an interval of a motion, per unit of the interval's length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rates {
    /// Sum of the speeds of the rotary axes, rad.
    pub(crate) turn: f64,
    /// Sum of their accelerations, rad.
    pub(crate) turn_change: f64,
    /// Sum of the speeds of the linear axes, mm.
    pub(crate) linear: f64,
    /// Sum of their accelerations, mm.
    pub(crate) linear_change: f64,
    /// Largest distance of the tip from a rotary axis that turns, at the start of the interval, mm.
    lever: f64,
}

impl Rates {
    /// Largest acceleration of any point of tool and machine against any other part of the machine, mm; the point is
    /// at most `reach` from the tool tip at the start.
    ///
    /// The velocity of a point is a sum of one vector per axis between the two parts, which is turned by the others
    /// at a rate of at most D and whose lever, at most L, changes at a rate of at most S + D·L: together 2·D·(S +
    /// D·L) at most. To that comes what the axes' own speeds change: at most the sum of the linear accelerations and
    /// L times that of the rotary.
    pub(crate) fn acceleration(&self, reach: f64) -> f64 {
        let lever = (self.lever + reach + self.linear) / (1.0 - self.turn);
        2.0 * self.turn * (self.linear + self.turn * lever) + self.linear_change + self.turn_change * lever
    }
}

/// Tells the rates of one motion.
pub(crate) struct RateBounds<'a> {
    machine: &'a Machine,
    motion: Motion<'a>,
    law: BlockLaw,
    tool_length: f64,
    /// Whether no rotary axis turns the linear ones against each other.
    linears_are_rigid: bool,
    turned: Option<TurnedRotaries<'a>>,
}

impl<'a> RateBounds<'a> {
    /// `motion` is the machine's under `law` from `start` to `end` with this tool length.
    pub(crate) fn new(
        machine: &'a Machine,
        motion: Motion<'a>,
        law: BlockLaw,
        [start, end]: [&AxisValues; 2],
        tool_length: f64,
    ) -> Self {
        let cutting = |cutting| law == BlockLaw::Cutting(cutting);
        let is_turned = cutting(CuttingLaw::TipLinearVectorTurned);
        let follows = is_turned || cutting(CuttingLaw::TipAndRotariesLinear);
        Self {
            machine,
            motion,
            law,
            tool_length,
            linears_are_rigid: follows && linears_are_rigid(machine, start),
            turned: is_turned.then(|| TurnedRotaries::new(machine, motion, [start, end], tool_length)).flatten(),
        }
    }

    /// Over the interval from `from` to `to`, in which no axis of a rapid stops; `None` where no bound is known: the
    /// interval turns too far, or the motion is too near to where the axes cannot follow.
    pub(crate) fn over(&self, from: f64, to: f64) -> Option<Rates> {
        let (start, end) = (self.motion.at(from).ok()?, self.motion.at(to).ok()?);
        let [linear, turn] = ways(self.machine, &start, &end);
        match self.law {
            BlockLaw::Rapid(_) | BlockLaw::Cutting(CuttingLaw::AxesLinear) => {
                // Written so that NaN is refused, too.
                if !(turn <= MAX_TURN && linear.is_finite()) {
                    return None;
                }
                let lever = self.lever(&start, |k| end[k] != start[k]);
                Some(Rates { turn, turn_change: 0.0, linear, linear_change: 0.0, lever })
            }
            BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) => {
                let lever = self.lever(&start, |k| end[k] != start[k]);
                self.following(&start, [turn, 0.0], lever, self.tip_way(from, to))
            }
            BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) => {
                let rotary = self.turned.as_ref()?.over(from, to)?;
                self.following(&start, rotary, self.lever(&start, |_| true), self.tip_way(from, to))
            }
        }
    }

    /// Whether the axes can follow a turned tool vector all over an interval, whatever they need to do for it.
    pub(crate) fn turned_is_reached(&self, from: f64, to: f64) -> bool {
        let reached = self.turned.as_ref().is_some_and(|t| t.is_reached(from, to));
        // Linear axes that cannot be turned against each other are as independent as they are anywhere.
        let is_rigid = || {
            let q = self.motion.at(from).ok().filter(|_| self.linears_are_rigid);
            q.is_some_and(|q| largest_inverse(self.machine, &q).is_some())
        };
        reached && (is_rigid() || self.over(from, to).is_some())
    }

    /// Number of rotary axes.
    pub(crate) fn n_rotaries(&self) -> f64 {
        self.machine.axes().iter().filter(|a| a.kind == AxisKind::Rotary).count() as f64
    }

    /// How far any point of tool and machine, at most `reach` from the tip at the start, strays against any other
    /// part of the machine over an interval in which the axes go with `rates`, mm, while the tip strays by
    /// `tolerance.path` from its way on the work and every rotary axis by `tolerance.orientation`; `None` where no
    /// bound is known.
    ///
    /// The rotary axes stray by D together. The linear ones carry the tip back: as the axes of [`Self::following`] do
    /// on a way of the length of the path tolerance, S ≤ κ·(path + D·L). A point strays by S and by D times its
    /// largest distance from a rotary axis.
    pub(crate) fn strayed(
        &self,
        tolerance: ControlTolerance,
        start: &AxisValues,
        rates: &Rates,
        reach: f64,
    ) -> Option<f64> {
        let turn = self.n_rotaries() * tolerance.orientation;
        let inverse = largest_inverse(self.machine, start)?;
        // The linear axes turn against each other over the interval, and once more as the rotary ones stray.
        let turned_apart = 3.0_f64.sqrt() * (turn + rates.turn) * inverse;
        let kappa = 3.0_f64.sqrt() * inverse / (1.0 - turned_apart);
        let rest = 1.0 - turn * (1.0 + kappa);
        // Written so that NaN is refused, too.
        if !(turned_apart <= 0.5 && rest >= 0.5 && rates.turn < 1.0) {
            return None;
        }
        let at_end = |distance: f64| (distance + rates.linear) / (1.0 - rates.turn);
        let lever = self.lever(start, |_| true);
        let tip_lever = (at_end(lever) + kappa * tolerance.path) / rest;
        let linear = kappa * (tolerance.path + turn * tip_lever);
        let point_lever = (at_end(lever + reach) + linear) / (1.0 - turn);
        Some(linear + turn * point_lever)
    }

    fn tip_way(&self, from: f64, to: f64) -> f64 {
        (self.motion.ideal(to).tip - self.motion.ideal(from).tip).norm()
    }

    /// Largest distance of the tip from those rotary axes, mm.
    fn lever(&self, q: &AxisValues, turns: impl Fn(usize) -> bool) -> f64 {
        let axes = self.machine.axes();
        let tip = self.machine.cl_point(q, self.tool_length).tip;
        let table_from_tool = self.machine.forward(q, self.tool_length);
        let rotaries = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Rotary && turns(k));
        let distances = rotaries.map(|k| {
            let (direction, point) = rotary_axis(self.machine, q, k, &table_from_tool, self.tool_length);
            direction.cross(&(tip.coords - point)).norm()
        });
        distances.fold(0.0, f64::max)
    }

    /// Rates of linear axes that carry the tip along a straight line at even speed, V = `tip_way` long, while the
    /// rotary ones turn at D and change that by α at most.
    ///
    /// With U the directions of the linear axes and N a bound on its inverse, U·l̇ is the tip's velocity less what
    /// the rotaries give it: S ≤ κ·(V + D·L), κ = √3·N. The tip is not accelerated, so that U·l̈ takes back what the
    /// others do: at most 2·D·(S + D·L) + α·L. L grows at a rate of at most S + D·L; with S put in, L ≤ (L at the
    /// start + κ·V) / (1 − D·(1 + κ)). A column of U turns by at most D, so that U changes by at most √3·D.
    fn following(&self, start: &AxisValues, [turn, turn_change]: [f64; 2], lever: f64, tip_way: f64) -> Option<Rates> {
        if self.machine.axes().len() as f64 - self.n_rotaries() != 3.0 {
            return None;
        }
        let inverse = largest_inverse(self.machine, start)?;
        let turned_apart = if self.linears_are_rigid { 0.0 } else { 3.0_f64.sqrt() * turn * inverse };
        let kappa = 3.0_f64.sqrt() * inverse / (1.0 - turned_apart);
        let rest = 1.0 - turn * (1.0 + kappa);
        // Written so that NaN is refused, too.
        if !(turn <= MAX_TURN && turned_apart <= 0.5 && rest >= 0.5 && tip_way.is_finite()) {
            return None;
        }
        let tip_lever = (lever + kappa * tip_way) / rest;
        let linear = kappa * (tip_way + turn * tip_lever);
        let linear_change = kappa * (2.0 * turn * (linear + turn * tip_lever) + turn_change * tip_lever);
        Some(Rates { turn, turn_change, linear, linear_change, lever })
    }
}

/// Largest way of the linear axes together (root of the squares) per way of the tip, up to which the tip's way is
/// followed.
const MAX_INVERSE: f64 = 100.0;

/// What the directions lack by the rounding of two tips whose difference they are, as a share.
const INVERSE_ROUNDING: f64 = 1e-6;

/// Bound on the norm of the inverse of the linear axes' directions; `None` where they all but lie in a plane.
fn largest_inverse(machine: &Machine, q: &AxisValues) -> Option<f64> {
    let smallest = linear_directions(machine, q)?.singular_values().min();
    let inverse = (1.0 + INVERSE_ROUNDING) / smallest;
    (smallest > 0.0 && inverse <= MAX_INVERSE).then_some(inverse)
}

/// Directions in which the linear axes move the tip, table frame.
fn linear_directions(machine: &Machine, q: &AxisValues) -> Option<Matrix3<f64>> {
    let axes = machine.axes();
    let linears: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Linear).collect();
    let still = AxisValues::from_fn(axes.len(), |k| if axes[k].kind == AxisKind::Linear { 0.0 } else { q[k] });
    let origin = machine.cl_point(&still, 0.0).tip;
    let direction = |k: usize| {
        let mut moved = still;
        moved[k] = 1.0;
        machine.cl_point(&moved, 0.0).tip - origin
    };
    match *linears.as_slice() {
        [x, y, z] => Some(Matrix3::from_columns(&[direction(x), direction(y), direction(z)])),
        // One square to both makes the inverse no smaller.
        [x, y] => {
            let (x, y) = (direction(x), direction(y));
            Some(Matrix3::from_columns(&[x, y, x.cross(&y).try_normalize(0.0)?]))
        }
        _ => None,
    }
}

/// What products of directions may differ by from rounding: of metres to 1e-12.
const RIGID: f64 = 1e-9;

/// Whether no rotary axis turns the linear ones against each other.
///
/// A product of two of their directions is a trigonometric polynomial of first degree in each rotary value, which is
/// constant where it is on three evenly spaced values of each.
fn linears_are_rigid(machine: &Machine, q: &AxisValues) -> bool {
    let axes = machine.axes();
    let rotaries: Vec<usize> = (0..axes.len()).filter(|&k| axes[k].kind == AxisKind::Rotary).collect();
    let &[a, b] = rotaries.as_slice() else { return false };
    let products = |i: u32, j: u32| {
        let mut at = *q;
        at[a] = f64::from(i) * std::f64::consts::TAU / 3.0;
        at[b] = f64::from(j) * std::f64::consts::TAU / 3.0;
        linear_directions(machine, &at).map(|d| d.transpose() * d)
    };
    let Some(first) = products(0, 0) else { return false };
    (0..9).all(|n| products(n / 3, n % 3).is_some_and(|p| (p - first).abs().max() <= RIGID))
}
