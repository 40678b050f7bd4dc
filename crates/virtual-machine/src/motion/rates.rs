//! Bounds on how fast the axes go over an interval of a motion and how that changes, and on
//! accelerations of parts.

use facemill_cl_data::{ControlTolerance, CuttingLaw};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion};
use nalgebra::{Matrix3, Point3};

use crate::motion::stepping::{MAX_TURN, rotary_axis, ways_of};
use crate::motion::turned_rotaries::TurnedRotaries;

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
    /// Largest acceleration of any point of tool and machine against any other part of the machine,
    /// mm; the point is at most `reach` from the tool tip at the start.
    ///
    /// The velocity of a point is a sum of one vector per axis between the two parts, which is
    /// turned by the others at a rate of at most D and whose lever, at most L, changes at a rate of
    /// at most S + D·L: together 2·D·(S + D·L) at most. To that comes what the axes' own speeds
    /// change: at most the sum of the linear accelerations and L times that of the rotary.
    pub(crate) fn acceleration(&self, reach: f64) -> f64 {
        let lever = (self.lever + reach + self.linear) / (1.0 - self.turn);
        2.0 * self.turn * (self.linear + self.turn * lever) + self.linear_change + self.turn_change * lever
    }
}

const AXES_LINEAR: BlockLaw = BlockLaw::Cutting(CuttingLaw::AxesLinear);

/// Which axes lie between two parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parts {
    /// Those that move this head's tool against the work.
    OneHead,
    /// Those of the other head, too: one of the parts is on it.
    BothHeads,
}

/// A head of the machine.
#[derive(Clone, Copy)]
struct Head<'a> {
    /// Its view.
    machine: &'a Machine,
    tool_length: f64,
}

/// Tells the rates of one motion.
pub(crate) struct RateBounds<'a> {
    head: Head<'a>,
    other: Option<Head<'a>>,
    motion: Motion<'a>,
    law: BlockLaw,
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
            head: Head { machine, tool_length },
            other: None,
            motion,
            law,
            linears_are_rigid: follows && linears_are_rigid(machine, start),
            turned: is_turned.then(|| TurnedRotaries::new(machine, motion, [start, end], tool_length)).flatten(),
        }
    }

    /// The same on a machine of two heads, with the other one's view and the length of its tool.
    pub(crate) fn with_other(self, other: Option<(&'a Machine, f64)>) -> Self {
        Self { other: other.map(|(machine, tool_length)| Head { machine, tool_length }), ..self }
    }

    /// Over the interval from `from` to `to`, in which no axis of a rapid stops, for points of
    /// parts with these axes between them; `None` where no bound is known: the interval turns too
    /// far, or the motion is too near to where the axes cannot follow.
    pub(crate) fn over(&self, from: f64, to: f64, parts: Parts) -> Option<Rates> {
        let (start, end) = (self.motion.at(from).ok()?, self.motion.at(to).ok()?);
        let machine = self.head.machine;
        let [linear, turn] = ways_of(machine, &start, &end, |k| parts == Parts::BothHeads || machine.moves_tool(k));
        // Bounds for tips on straight lines exist for one head alone.
        if parts == Parts::BothHeads && !matches!(self.law, BlockLaw::Rapid(_) | AXES_LINEAR) {
            return None;
        }
        match self.law {
            BlockLaw::Rapid(_) | AXES_LINEAR => {
                // Written so that NaN is refused, too.
                if !(turn <= MAX_TURN && linear.is_finite()) {
                    return None;
                }
                let lever = self.lever(&start, parts, |k| end[k] != start[k])?;
                Some(Rates { turn, turn_change: 0.0, linear, linear_change: 0.0, lever })
            }
            BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) => {
                let lever = self.head.lever(&start, |k| end[k] != start[k]);
                self.following(&start, [turn, 0.0], lever, self.tip_way(from, to))
            }
            BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) => {
                let rotary = self.turned.as_ref()?.over(from, to)?;
                self.following(&start, rotary, self.head.lever(&start, |_| true), self.tip_way(from, to))
            }
        }
    }

    /// Whether the axes can follow a turned tool vector all over an interval, whatever they need to
    /// do for it.
    pub(crate) fn turned_is_reached(&self, from: f64, to: f64) -> bool {
        let reached = self.turned.as_ref().is_some_and(|t| t.is_reached(from, to));
        // Linear axes that cannot be turned against each other are as independent as they are
        // anywhere.
        let is_rigid = || {
            let q = self.motion.at(from).ok().filter(|_| self.linears_are_rigid);
            q.is_some_and(|q| largest_inverse(self.head.machine, &q).is_some())
        };
        reached && (is_rigid() || self.over(from, to, Parts::OneHead).is_some())
    }

    /// Number of rotary axes that move the tool.
    pub(crate) fn n_rotaries(&self) -> f64 {
        self.head.n_rotaries()
    }

    /// How far a point strays, as [`Head::strayed`]; of a part against one of the other head, what
    /// both stray by together.
    pub(crate) fn strayed(
        &self,
        tolerance: ControlTolerance,
        start: &AxisValues,
        rates: &Rates,
        reach: f64,
        parts: Parts,
    ) -> Option<f64> {
        let own = self.head.strayed(tolerance, start, rates, reach)?;
        if parts == Parts::OneHead {
            return Some(own);
        }
        let other = self.other?;
        let between = (other.tip(start) - self.head.tip(start)).norm();
        Some(own + other.strayed(tolerance, start, rates, reach + between)?)
    }

    fn tip_way(&self, from: f64, to: f64) -> f64 {
        (self.motion.ideal(to).tip - self.motion.ideal(from).tip).norm()
    }

    /// Largest distance of the tip from those rotary axes that lie between such parts, mm; `None`
    /// where the other head is not known.
    fn lever(&self, q: &AxisValues, parts: Parts, turns: impl Fn(usize) -> bool) -> Option<f64> {
        let own = self.head.lever(q, &turns);
        if parts == Parts::OneHead {
            return Some(own);
        }
        Some(own.max(self.other?.lever_of(q, &self.head.tip(q), turns)))
    }

    /// Rates of linear axes that carry the tip along a straight line at even speed, V = `tip_way`
    /// long, while the rotary ones turn at D and change that by α at most.
    ///
    /// With U the directions of the linear axes and N a bound on its inverse, U·l̇ is the tip's
    /// velocity less what the rotaries give it: S ≤ κ·(V + D·L), κ = √3·N. The tip is not
    /// accelerated, so that U·l̈ takes back what the others do: at most 2·D·(S + D·L) + α·L. L
    /// grows at a rate of at most S + D·L; with S put in, L ≤ (L at the start + κ·V) / (1 − D·(1 +
    /// κ)). A column of U turns by at most D, so that U changes by at most √3·D.
    fn following(&self, start: &AxisValues, [turn, turn_change]: [f64; 2], lever: f64, tip_way: f64) -> Option<Rates> {
        let machine = self.head.machine;
        let is_own_linear = |k: &usize| machine.axes()[*k].kind == AxisKind::Linear && machine.moves_tool(*k);
        if (0..machine.axes().len()).filter(is_own_linear).count() != 3 {
            return None;
        }
        let inverse = largest_inverse(machine, start)?;
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

impl Head<'_> {
    fn tip(&self, q: &AxisValues) -> Point3<f64> {
        self.machine.cl_point(q, self.tool_length).tip
    }

    /// Number of rotary axes that move its tool.
    fn n_rotaries(&self) -> f64 {
        let axes = self.machine.axes().iter().enumerate();
        axes.filter(|(k, a)| a.kind == AxisKind::Rotary && self.machine.moves_tool(*k)).count() as f64
    }

    /// Largest distance of its tip from those rotary axes, mm.
    fn lever(&self, q: &AxisValues, turns: impl Fn(usize) -> bool) -> f64 {
        self.lever_of(q, &self.tip(q), turns)
    }

    /// The same of any point of the table frame.
    fn lever_of(&self, q: &AxisValues, point: &Point3<f64>, turns: impl Fn(usize) -> bool) -> f64 {
        let axes = self.machine.axes();
        let table_from_tool = self.machine.forward(q, self.tool_length);
        let is_own = |k: &usize| axes[*k].kind == AxisKind::Rotary && self.machine.moves_tool(*k);
        let distances = (0..axes.len()).filter(is_own).filter(|k| turns(*k)).map(|k| {
            let (direction, on_axis) = rotary_axis(self.machine, q, k, &table_from_tool, self.tool_length);
            direction.cross(&(point.coords - on_axis)).norm()
        });
        distances.fold(0.0, f64::max)
    }

    /// How far any point of tool and machine, at most `reach` from the tip at the start, strays
    /// against any other part of the machine over an interval in which the axes go with `rates`,
    /// mm, while the tip strays by `tolerance.path` from its way on the work and every rotary axis
    /// by `tolerance.orientation`; `None` where no bound is known.
    ///
    /// The rotary axes stray by D together. The linear ones carry the tip back: as the axes of
    /// [`Self::following`] do on a way of the length of the path tolerance, S ≤ κ·(path + D·L). A
    /// point strays by S and by D times its largest distance from a rotary axis.
    fn strayed(&self, tolerance: ControlTolerance, start: &AxisValues, rates: &Rates, reach: f64) -> Option<f64> {
        let turn = self.n_rotaries() * tolerance.orientation;
        let inverse = largest_inverse(self.machine, start)?;
        // The linear axes turn against each other over the interval, and once more as the rotary
        // ones stray.
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
}

/// Largest way of the linear axes together (root of the squares) per way of the tip, up to which
/// the tip's way is followed.
const MAX_INVERSE: f64 = 100.0;

/// Largest share that the directions lack by the rounding of two tips whose difference they are.
const INVERSE_ROUNDING: f64 = 1e-6;

/// Bound on the norm of the inverse of the linear axes' directions; `None` where they all but lie
/// in a plane.
fn largest_inverse(machine: &Machine, q: &AxisValues) -> Option<f64> {
    let smallest = linear_directions(machine, q)?.singular_values().min();
    let inverse = (1.0 + INVERSE_ROUNDING) / smallest;
    (smallest > 0.0 && inverse <= MAX_INVERSE).then_some(inverse)
}

/// Directions in which the linear axes that move the tip move it, table frame.
fn linear_directions(machine: &Machine, q: &AxisValues) -> Option<Matrix3<f64>> {
    let axes = machine.axes();
    let is_own = |k: &usize| axes[*k].kind == AxisKind::Linear && machine.moves_tool(*k);
    let linears: Vec<usize> = (0..axes.len()).filter(is_own).collect();
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

/// Largest rounding of products of directions: of metres to 1e-12.
const RIGID: f64 = 1e-9;

/// Whether no rotary axis turns the linear ones against each other.
///
/// A product of two of their directions is a trigonometric polynomial of first degree in each
/// rotary value, which is constant where it is on three evenly spaced values of each.
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
