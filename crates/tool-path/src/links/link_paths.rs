//! Paths that a link could take: families of positions, each by how far out they go.

use facemill_cutter_location::links::link::ClearanceSurface;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

/// Strategy by which a link retracts, crosses and approaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RetractStrategy {
    /// As it was.
    Original,
    /// All axes together, in one block.
    Direct,
    /// Out with the axis along the spindle, across at that height, and back in; rotary axes turn on
    /// the way across.
    Lifted,
    /// The same with the rotary axes turning all along.
    LiftedSpread,
    /// Out with the axis along the spindle, and from there straight to the end.
    LiftedFirst,
    /// Straight to a place above the end, and in with the axis along the spindle.
    LiftedLast,
    /// Over one place half way, lifted.
    Peak,
    /// Back along the tool axis, across, and in along the tool axis of the end.
    AlongTool,
    /// The same with the rotary axes turning all along.
    AlongToolSpread,
    /// Straight away from the workpiece, around it at an even distance inside or outside of the
    /// job's clearance surface, and in.
    Around,
}

impl RetractStrategy {
    /// Candidates in place of the original.
    pub const TRIED: [Self; 9] = [
        Self::Direct,
        Self::Lifted,
        Self::LiftedSpread,
        Self::LiftedFirst,
        Self::LiftedLast,
        Self::Peak,
        Self::AlongTool,
        Self::AlongToolSpread,
        Self::Around,
    ];
}

/// Ends of a link on a machine, and the surroundings of the workpiece.
pub struct LinkEnds<'a> {
    /// Machine.
    pub machine: &'a Machine,
    /// Distance from the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Mounting of the workpiece.
    pub table_from_work: Isometry3<f64>,
    /// Clearance surface, workpiece frame.
    pub surface: &'a ClearanceSurface,
    /// Axis values at the start.
    pub start: AxisValues,
    /// Axis values at the end.
    pub end: AxisValues,
    /// Index of the linear axis along the spindle, and the sign of its motion away from the work.
    pub spindle: (usize, f64),
}

/// Largest turn about the workpiece between two places of a way around it, rad: chords come nearer
/// to its middle by at most 1 %.
const ARC_STEP: f64 = 0.28;

/// Difference of axis values below which two positions are one, mm or rad: less than a word can
/// express, more than rounding.
const SAME: f64 = 1e-8;

fn is_same(a: &AxisValues, b: &AxisValues) -> bool {
    (0..a.len()).all(|k| (a[k] - b[k]).abs() < SAME)
}

/// Returns the positions of a path of this kind for all heads of a machine at once, without its
/// start. Each head that has to move goes `out` mm out; the others rest. `None` if there is no such
/// path, or if the paths of two heads differ in the number of positions.
///
/// Both heads pass the positions of their paths at the same times. A shared axis follows the path
/// of the first head that moves.
pub fn path_of_heads(heads: &[LinkEnds<'_>], kind: RetractStrategy, out: f64) -> Option<Vec<AxisValues>> {
    let first = heads.first()?;
    let moving: Vec<&LinkEnds<'_>> = heads.iter().filter(|head| heads.len() == 1 || head.moves_own_axes()).collect();
    let leader = *moving.first().unwrap_or(&first);
    let ways: Vec<Vec<AxisValues>> = moving.iter().map(|head| head.over(kind, out)).collect::<Option<_>>()?;
    let n = ways.first().map_or(0, Vec::len);
    if ways.iter().any(|way| way.len() != n) {
        return None;
    }
    let of_axis = |place: usize, axis: usize| {
        let owner = moving.iter().position(|head| head.is_own(axis));
        match owner.or_else(|| leader.machine.is_shared(axis).then_some(0)) {
            Some(head) if !ways.is_empty() => ways[head][place][axis],
            // Axis of a head at rest.
            _ => first.start[axis],
        }
    };
    let places = (0..n).map(|place| AxisValues::from_fn(first.start.len(), |axis| of_axis(place, axis)));
    Some(first.tidied(places.collect()))
}

impl LinkEnds<'_> {
    /// Returns whether an axis moves the tool of this head only.
    fn is_own(&self, axis: usize) -> bool {
        self.machine.moves_tool(axis) && !self.machine.is_shared(axis)
    }

    /// Returns whether the head itself has to move, and not only the table.
    fn moves_own_axes(&self) -> bool {
        (0..self.start.len()).any(|k| self.is_own(k) && self.start[k] != self.end[k])
    }

    /// Returns the positions of a path of this kind that goes `out` mm out, without its start, on a
    /// machine with this head alone; `None` if there is none.
    pub fn path(&self, kind: RetractStrategy, out: f64) -> Option<Vec<AxisValues>> {
        path_of_heads(std::slice::from_ref(self), kind, out)
    }

    /// Returns the positions between the ends of a path of this kind; some may be equal.
    fn over(&self, kind: RetractStrategy, out: f64) -> Option<Vec<AxisValues>> {
        let (start, end) = (&self.start, &self.end);
        let lifted = [self.lifted(start, out), self.lifted(end, out)];
        Some(match kind {
            RetractStrategy::Original => return None,
            RetractStrategy::Direct => Vec::new(),
            RetractStrategy::Lifted => lifted.to_vec(),
            RetractStrategy::LiftedSpread => self.turned_on(&lifted).to_vec(),
            RetractStrategy::LiftedFirst => vec![lifted[0]],
            RetractStrategy::LiftedLast => vec![lifted[1]],
            RetractStrategy::Peak => vec![self.lifted(&start.lerp(end, 0.5), out)],
            RetractStrategy::AlongTool => vec![self.backed(start, out)?, self.backed(end, out)?],
            RetractStrategy::AlongToolSpread => {
                let backed = [self.backed(start, out)?, self.backed(end, out)?];
                let turned = self.turned_on(&backed);
                vec![self.at_tip(&turned[0], &self.tip(&backed[0]))?, self.at_tip(&turned[1], &self.tip(&backed[1]))?]
            }
            RetractStrategy::Around => self.around(out)?,
        })
    }

    /// Returns a path over these positions to the end, without repetitions.
    fn tidied(&self, mut way: Vec<AxisValues>) -> Vec<AxisValues> {
        let (start, end) = (&self.start, &self.end);
        way.dedup_by(|next, at| is_same(at, next));
        way.retain(|at| !is_same(at, start) && !is_same(at, end));
        if !way.is_empty() || end != start {
            way.push(*end);
        }
        way
    }

    /// Returns the position with its spindle axis this far out of the outer one of both ends.
    fn lifted(&self, at: &AxisValues, out: f64) -> AxisValues {
        let (k, sign) = self.spindle;
        let mut lifted = *at;
        lifted[k] = sign * ((sign * self.start[k]).max(sign * self.end[k]) + out);
        lifted
    }

    /// Returns the position moved back along its tool axis.
    fn backed(&self, at: &AxisValues, out: f64) -> Option<AxisValues> {
        let cl = self.machine.cl_point(at, self.tool_length);
        self.at_tip(at, &(cl.tip + cl.axis.into_inner() * out))
    }

    /// Returns the tip, table frame.
    pub(crate) fn tip(&self, at: &AxisValues) -> Point3<f64> {
        self.machine.cl_point(at, self.tool_length).tip
    }

    /// Returns the rotary values of a position with the tip there (table frame).
    fn at_tip(&self, at: &AxisValues, tip: &Point3<f64>) -> Option<AxisValues> {
        self.machine.with_tip_at(at, tip, self.tool_length)
    }

    /// Returns two places on the way, with their rotary axes turned by the completed fraction of
    /// the tip's way.
    fn turned_on(&self, over: &[AxisValues; 2]) -> [AxisValues; 2] {
        let places = [self.start, over[0], over[1], self.end].map(|at| self.tip(&at));
        let lengths = [0, 1, 2].map(|k| (places[k + 1] - places[k]).norm());
        let all: f64 = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let shares = [lengths[0] / all, (lengths[0] + lengths[1]) / all];
        [0, 1].map(|k| {
            let turned = self.start.lerp(&self.end, shares[k]);
            let is_rotary = |axis: usize| self.machine.axes()[axis].kind == AxisKind::Rotary;
            AxisValues::from_fn(turned.len(), |axis| if is_rotary(axis) { turned[axis] } else { over[k][axis] })
        })
    }

    /// Returns the way straight away from the workpiece until both ends are as far out, then around
    /// it, and in.
    ///
    /// In the middle of the workpiece every direction leads away: the other end's is taken. `None`
    /// where both ends are there.
    fn around(&self, out: f64) -> Option<Vec<AxisValues>> {
        let tips = [self.start, self.end].map(|at| self.table_from_work.inverse_transform_point(&self.tip(&at)));
        let [from, to] = tips.map(|tip| Outward::of(self.surface, &tip));
        let directions = [from.direction.or(to.direction)?, to.direction.or(from.direction)?];
        let level = from.distance.max(to.distance) + out;
        let arc = Arc::between(directions, self.surface, || self.axis_half_way());
        let n = (arc.angle / ARC_STEP).ceil().max(1.0);
        let place = |k: usize| {
            let share = k as f64 / n;
            let tip = from.foot + (to.foot - from.foot) * share + arc.at(share) * level;
            self.at_tip(&self.start.lerp(&self.end, share), &(self.table_from_work * tip))
        };
        (0..=n as usize).map(place).collect()
    }

    /// Returns the tool axis where the rotary axes have turned half way, work frame.
    fn axis_half_way(&self) -> Vector3<f64> {
        let axis = self.machine.cl_point(&self.start.lerp(&self.end, 0.5), self.tool_length).axis;
        self.table_from_work.inverse_transform_vector(&axis)
    }
}

/// A point relative to its foot in the middle of the workpiece: a point of the clearance plane, of
/// the line of the cylinder, or the middle of the sphere; work frame, mm.
struct Outward {
    foot: Point3<f64>,
    /// Direction away from the workpiece; `None` in its middle, which has none.
    direction: Option<Unit<Vector3<f64>>>,
    /// Distance from the foot in that direction; below a plane negative.
    distance: f64,
}

/// Distance from the middle of the workpiece within which there is no direction away, mm: rounding
/// would decide it.
const NO_DIRECTION: f64 = 1e-6;

impl Outward {
    fn of(surface: &ClearanceSurface, p: &Point3<f64>) -> Self {
        let foot = match surface {
            ClearanceSurface::Plane { origin, normal } => {
                let distance = (p - origin).dot(normal);
                return Self { foot: p - normal.into_inner() * distance, direction: Some(*normal), distance };
            }
            ClearanceSurface::Cylinder { origin, axis, .. } => origin + axis.into_inner() * (p - origin).dot(axis),
            ClearanceSurface::Sphere { center, .. } => *center,
        };
        let radial = p - foot;
        Self { foot, direction: Unit::try_new(radial, NO_DIRECTION), distance: radial.norm() }
    }
}

/// Directions from one to another, turned evenly.
struct Arc {
    from: Unit<Vector3<f64>>,
    /// Direction at right angles to the first one, in the plane of both.
    across: Vector3<f64>,
    /// Angle between both, rad.
    angle: f64,
}

/// Sine of the angle between two opposite directions below which any plane contains both.
const OPPOSITE: f64 = 1e-6;

impl Arc {
    /// Takes the shorter way; between opposite directions about a cylinder's line, and on the side
    /// to which this axis points.
    fn between(
        [from, to]: [Unit<Vector3<f64>>; 2],
        surface: &ClearanceSurface,
        side: impl Fn() -> Vector3<f64>,
    ) -> Self {
        let (turn, cosine) = (from.cross(&to), from.dot(&to));
        let across = to.into_inner() - from.into_inner() * cosine;
        let across = if cosine < 0.0 && turn.norm() < OPPOSITE {
            let line = if let ClearanceSurface::Cylinder { axis, .. } = surface { Some(*axis) } else { None };
            opposite(&from, line, &side())
        } else {
            across.try_normalize(0.0).unwrap_or_else(Vector3::zeros)
        };
        Self { from, across, angle: turn.norm().atan2(cosine) }
    }

    /// Returns the direction at a fraction of the angle.
    fn at(&self, share: f64) -> Vector3<f64> {
        let (sin, cos) = (share * self.angle).sin_cos();
        self.from.into_inner() * cos + self.across * sin
    }
}

/// Returns a direction at right angles to another one, and to this line, nearest to a side; any of
/// them where none is.
fn opposite(from: &Unit<Vector3<f64>>, line: Option<Unit<Vector3<f64>>>, side: &Vector3<f64>) -> Vector3<f64> {
    if let Some(line) = line {
        let across = line.cross(from);
        return if across.dot(side) < 0.0 { -across } else { across };
    }
    let without = |v: &Vector3<f64>| (v - from.into_inner() * v.dot(from)).try_normalize(1e-3);
    let candidates = [*side, Vector3::x(), Vector3::y()];
    candidates.iter().find_map(without).unwrap_or_else(Vector3::z)
}

impl std::fmt::Display for RetractStrategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Original => "original",
            Self::Direct => "direct",
            Self::Lifted => "lifted",
            Self::LiftedSpread => "lifted, rotary axes all along",
            Self::LiftedFirst => "lifted first",
            Self::LiftedLast => "lifted last",
            Self::Peak => "over a peak",
            Self::AlongTool => "along the tool axis",
            Self::AlongToolSpread => "along the tool axis, rotary axes all along",
            Self::Around => "around the part",
        })
    }
}
