//! Ways that a link could take: families of positions, each by how far out they go.

use facemill_cutter_location::link::ClearanceSurface;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use nalgebra::{Isometry3, Point3, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

/// How a link goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WayKind {
    /// As it was.
    Original,
    /// All axes together, in one block.
    Direct,
    /// Out with the axis along the spindle, across at that height, and back in; rotary axes turn on the way across.
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
    /// Straight away from the workpiece, around it at an even distance inside or outside of the job's clearance surface, and in.
    Around,
}

impl WayKind {
    /// What can be tried in place of the original.
    pub(crate) const TRIED: [Self; 9] = [
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

/// The ends of a link on a machine, and what is around the workpiece.
pub(crate) struct Ends<'a> {
    pub machine: &'a Machine,
    pub tool_length: f64,
    pub table_from_work: Isometry3<f64>,
    pub surface: &'a ClearanceSurface,
    pub start: AxisValues,
    pub end: AxisValues,
    /// Index of the linear axis along the spindle, and the sign of its motion away from the work.
    pub spindle: (usize, f64),
}

/// Turn about the workpiece between two places of a way around it, rad: chords of a clearance surface are by 1 % of its radius
/// inside of it.
const ARC_STEP: f64 = 0.28;

impl Ends<'_> {
    /// The positions of a way of this kind that goes so far out, mm, without its start; `None` where there is none.
    pub(crate) fn way(&self, kind: WayKind, out: f64) -> Option<Vec<AxisValues>> {
        let (start, end) = (&self.start, &self.end);
        let lifted = [self.lifted(start, out), self.lifted(end, out)];
        let mut way = match kind {
            WayKind::Original => return None,
            WayKind::Direct => Vec::new(),
            WayKind::Lifted => lifted.to_vec(),
            WayKind::LiftedSpread => self.turned_on(&lifted).to_vec(),
            WayKind::LiftedFirst => vec![lifted[0]],
            WayKind::LiftedLast => vec![lifted[1]],
            WayKind::Peak => vec![self.lifted(&start.lerp(end, 0.5), out)],
            WayKind::AlongTool => vec![self.backed(start, out)?, self.backed(end, out)?],
            WayKind::AlongToolSpread => {
                let backed = [self.backed(start, out)?, self.backed(end, out)?];
                let turned = self.turned_on(&backed);
                vec![self.at_tip(&turned[0], &self.tip(&backed[0]))?, self.at_tip(&turned[1], &self.tip(&backed[1]))?]
            }
            WayKind::Around => self.around(out)?,
        };
        way.push(*end);
        let mut at = *start;
        way.retain(|next| std::mem::replace(&mut at, *next) != *next);
        Some(way)
    }

    /// The position with its spindle axis so far out of the outer one of both ends.
    fn lifted(&self, at: &AxisValues, out: f64) -> AxisValues {
        let (k, sign) = self.spindle;
        let mut lifted = *at;
        lifted[k] = sign * ((sign * self.start[k]).max(sign * self.end[k]) + out);
        lifted
    }

    /// The position moved back along its tool axis.
    fn backed(&self, at: &AxisValues, out: f64) -> Option<AxisValues> {
        let cl = self.machine.cl_point(at, self.tool_length);
        self.at_tip(at, &(cl.tip + cl.axis.into_inner() * out))
    }

    /// Where the tip is, table frame.
    fn tip(&self, at: &AxisValues) -> Point3<f64> {
        self.machine.cl_point(at, self.tool_length).tip
    }

    /// The rotary values of a position, the tip there (table frame).
    fn at_tip(&self, at: &AxisValues, tip: &Point3<f64>) -> Option<AxisValues> {
        self.machine.with_tip_at(at, tip, self.tool_length)
    }

    /// Two places on the way with their rotary axes turned by the share of the tip's way that is done.
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

    /// Straight away from the workpiece until both ends are as far out, then around it.
    fn around(&self, out: f64) -> Option<Vec<AxisValues>> {
        let tips = [self.start, self.end].map(|at| self.table_from_work.inverse_transform_point(&self.tip(&at)));
        let [from, to] = tips.map(|tip| Outward::of(self.surface, &tip));
        let level = from.level.max(to.level) + out;
        let turn = from.direction.cross(&to.direction).norm().atan2(from.direction.dot(&to.direction));
        let n = (turn / ARC_STEP).ceil().max(1.0);
        let place = |k: usize| {
            let share = k as f64 / n;
            let straight = tips[0] + (tips[1] - tips[0]) * share;
            let here = Outward::of(self.surface, &straight);
            let tip = straight + here.direction * (level - here.level);
            self.at_tip(&self.start.lerp(&self.end, share), &(self.table_from_work * tip))
        };
        (0..=n as usize).map(place).collect()
    }
}

/// Where away from the workpiece is at a point, and how far out of the clearance surface that is, mm; work frame.
struct Outward {
    direction: Vector3<f64>,
    level: f64,
}

impl Outward {
    fn of(surface: &ClearanceSurface, p: &Point3<f64>) -> Self {
        let level = surface.height(p);
        let radial = match surface {
            ClearanceSurface::Plane { normal, .. } => return Self { direction: normal.into_inner(), level },
            ClearanceSurface::Cylinder { origin, axis, .. } => {
                let from_origin = p - origin;
                from_origin - axis.into_inner() * from_origin.dot(axis)
            }
            ClearanceSurface::Sphere { center, .. } => p - center,
        };
        // On the axis or in the middle no direction is away; the test of the way decides what it is worth.
        Self { direction: radial.try_normalize(1e-9).unwrap_or_else(Vector3::z), level }
    }
}

impl std::fmt::Display for WayKind {
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
