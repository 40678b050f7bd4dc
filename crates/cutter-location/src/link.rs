//! The way from the end of one pass to the start of the next, without cutting.

use facemill_cl_data::ClPoint;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::{Hints, Infeasible, PoseTest, angle_between};

/// Surface outside of which the whole workpiece, its stock and its fixtures lie inside; workpiece frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearanceSurface {
    /// Plane through `origin`; the free side is where `normal` points.
    Plane {
        /// A point of the plane.
        origin: Point3<f64>,
        /// Toward the free side.
        normal: Unit<Vector3<f64>>,
    },
    /// Cylinder about a line; outside is free.
    Cylinder {
        /// A point of the line.
        origin: Point3<f64>,
        /// Direction of the line.
        axis: Unit<Vector3<f64>>,
        /// Radius.
        radius: f64,
    },
    /// Sphere; outside is free.
    Sphere {
        /// Middle.
        center: Point3<f64>,
        /// Radius.
        radius: f64,
    },
}

impl ClearanceSurface {
    /// Height of a point above the surface, negative inside.
    pub fn height(&self, p: &Point3<f64>) -> f64 {
        self.outward(p).1
    }

    /// Direction away from the workpiece at `p`, and the height of `p` above the surface.
    fn outward(&self, p: &Point3<f64>) -> (Unit<Vector3<f64>>, f64) {
        match self {
            Self::Plane { origin, normal } => (*normal, (p - origin).dot(normal)),
            Self::Cylinder { origin, axis, radius } => {
                let d = p - origin;
                let radial = d - axis.into_inner() * d.dot(axis);
                (direction_or_any(radial, axis), radial.norm() - radius)
            }
            Self::Sphere { center, radius } => {
                (direction_or_any(p - center, &Vector3::z_axis()), (p - center).norm() - radius)
            }
        }
    }

    /// The pose moved along the tool axis until its tip is `margin` above the surface, where that takes at most three times
    /// its depth, else straight out. A pose that is there already stays.
    pub fn retract(&self, cl: &ClPoint, margin: f64) -> ClPoint {
        self.along(cl, &cl.axis, margin).unwrap_or_else(|| self.straight_out(cl, margin))
    }

    /// The pose moved straight away from the workpiece until its tip is `margin` above the surface.
    fn straight_out(&self, cl: &ClPoint, margin: f64) -> ClPoint {
        let (out, level) = self.outward(&cl.tip);
        cl.translated(out.into_inner() * (margin - level).max(0.0))
    }

    /// First pose `margin` above the surface on the way along `direction`, at most three times its depth away. Bisected: the
    /// height along a line grows from the first crossing on for a pose inside a convex surface.
    fn along(&self, cl: &ClPoint, direction: &Unit<Vector3<f64>>, margin: f64) -> Option<ClPoint> {
        let depth = margin - self.height(&cl.tip);
        if depth <= 0.0 {
            return Some(*cl);
        }
        let at = |t: f64| cl.translated(direction.into_inner() * t);
        let (mut inside, mut outside) = (0.0, 3.0 * depth);
        if self.height(&at(outside).tip) < margin {
            return None;
        }
        while outside - inside > 1e-3 {
            let middle = 0.5 * (inside + outside);
            if self.height(&at(middle).tip) < margin { inside = middle } else { outside = middle }
        }
        Some(at(outside))
    }

    /// Ways from a pose to `margin` above the surface, without the pose itself, the likeliest first: along the tool axis,
    /// straight out, between the two, and a little along the axis before going straight out.
    fn ways_out(&self, cl: &ClPoint, margin: f64) -> Vec<Vec<ClPoint>> {
        let out = self.outward(&cl.tip).0;
        let between = Unit::try_new(out.into_inner() + cl.axis.into_inner(), 1e-6);
        let mut ways: Vec<Vec<ClPoint>> = self.along(cl, &cl.axis, margin).into_iter().map(|p| vec![p]).collect();
        ways.push(vec![self.straight_out(cl, margin)]);
        ways.extend(between.and_then(|d| self.along(cl, &d, margin)).map(|p| vec![p]));
        for by in FIRST_BACK {
            let back = cl.translated(cl.axis.into_inner() * by);
            ways.push(vec![back, self.straight_out(&back, margin)]);
        }
        ways
    }

    /// `p` moved straight out until it is `margin` above the surface, if it is not.
    fn pushed_out(&self, p: &Point3<f64>, margin: f64) -> Point3<f64> {
        let (out, level) = self.outward(p);
        p + out.into_inner() * (margin - level).max(0.0)
    }
}

fn direction_or_any(v: Vector3<f64>, perpendicular_to: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    Unit::try_new(v, 1e-9).unwrap_or_else(|| any_perpendicular(perpendicular_to))
}

/// Some direction perpendicular to another.
fn any_perpendicular(a: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let least = if a.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    Unit::new_normalize(a.cross(&least))
}

/// The pose at fraction `t` between two: tip on the straight line, axis turned uniformly in the plane of both (through any
/// perpendicular direction when they are opposed).
pub fn between(a: &ClPoint, b: &ClPoint, t: f64) -> ClPoint {
    let angle = angle_between(&a.axis, &b.axis);
    let turn_axis = Unit::try_new(a.axis.cross(&b.axis), 1e-12).unwrap_or_else(|| any_perpendicular(&a.axis));
    let axis = UnitQuaternion::from_axis_angle(&turn_axis, angle * t) * a.axis;
    ClPoint { tip: a.tip + (b.tip - a.tip) * t, axis: Unit::new_normalize(axis.into_inner()) }
}

/// What a link must fulfil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkSettings {
    /// The clearance surface.
    pub clearance: ClearanceSurface,
    /// Distance the whole tool keeps from stock, part and fixtures, mm.
    pub rapid_clearance: f64,
}

/// How far a tool goes back along its axis before it goes straight out, mm.
const FIRST_BACK: [f64; 3] = [20.0, 60.0, 180.0];

/// Why there is no link between two poses.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkBlocked {
    /// Where the way over the clearance surface is blocked.
    pub pose: ClPoint,
    /// By what.
    pub why: Infeasible,
}

/// Retracts along the tool axis that are tried before the way over the clearance surface, mm. Each about doubles: a link is
/// at most about twice as high as it needs to be.
const LIFTS: [f64; 6] = [0.0, 25.0, 60.0, 130.0, 280.0, 600.0];

/// Poses strictly between `from` and `to` over which the tool gets there without coming nearer than the rapid clearance to
/// anything; both ends are clear already. The lowest of a series of lifted ways is taken, else the way over the clearance
/// surface.
///
/// The ways are tested at poses close enough for the free distance there to cover the motion of tool and head to the next
/// one in tip-linear motion, near the clearance 1 mm apart, so that half a millimetre of it may lack between two; the motion
/// of the control differs from it by the linearisation tolerance. Where a leg leads through the pole of the rotary axes, the
/// head's turn about the tool at the pole itself is not tested.
///
/// # Errors
/// When even the way over the clearance surface is blocked.
pub fn link(
    test: &PoseTest<'_>,
    settings: &LinkSettings,
    from: &ClPoint,
    to: &ClPoint,
    hints: &mut Hints,
) -> Result<Vec<ClPoint>, LinkBlocked> {
    let raised = |p: &ClPoint, by: f64| p.translated(p.axis.into_inner() * by);
    for lift in LIFTS {
        let way = if lift == 0.0 { vec![] } else { vec![raised(from, lift), raised(to, lift)] };
        if way_blocked(test, settings, from, &way, to, hints).is_none() {
            return Ok(way);
        }
    }
    over_clearance(test, settings, from, to, hints)
}

/// From `from` out to the clearance surface, along it, and back to `to`, by the first free way out at each end.
fn over_clearance(
    test: &PoseTest<'_>,
    settings: &LinkSettings,
    from: &ClPoint,
    to: &ClPoint,
    hints: &mut Hints,
) -> Result<Vec<ClPoint>, LinkBlocked> {
    let out = way_out(test, settings, from, hints)?;
    let mut back = way_out(test, settings, to, hints)?;
    back.reverse();
    let across =
        along_clearance(&settings.clearance, test.clearance_margin(), end_of(&out, from), back.first().unwrap_or(to));
    let way: Vec<ClPoint> = out.into_iter().chain(across).chain(back).collect();
    match way_blocked(test, settings, from, &way, to, hints) {
        None => Ok(way),
        Some((pose, why)) => Err(LinkBlocked { pose, why }),
    }
}

fn end_of<'a>(way: &'a [ClPoint], start: &'a ClPoint) -> &'a ClPoint {
    way.last().unwrap_or(start)
}

/// The first free way from a pose to the clearance surface, without the pose itself.
///
/// # Errors
/// When none is free: where the first one, along the tool axis, is blocked.
pub fn way_out(
    test: &PoseTest<'_>,
    settings: &LinkSettings,
    from: &ClPoint,
    hints: &mut Hints,
) -> Result<Vec<ClPoint>, LinkBlocked> {
    let mut first = None;
    for mut way in settings.clearance.ways_out(from, test.clearance_margin()) {
        let Some(end) = way.pop() else { continue };
        match way_blocked(test, settings, from, &way, &end, hints) {
            None => {
                way.push(end);
                return Ok(way);
            }
            Some((pose, why)) => first = first.or(Some(LinkBlocked { pose, why })),
        }
    }
    Err(first.expect("there is always the way straight out"))
}

/// Poses between two that are on the clearance surface. A straight line between two points outside a convex surface may cut
/// through it: points in between are pushed out.
fn along_clearance(surface: &ClearanceSurface, margin: f64, a: &ClPoint, b: &ClPoint) -> Vec<ClPoint> {
    const N_BETWEEN: usize = 24;
    if matches!(surface, ClearanceSurface::Plane { .. }) {
        return vec![];
    }
    (1..N_BETWEEN)
        .map(|k| between(a, b, k as f64 / N_BETWEEN as f64))
        .map(|p| ClPoint { tip: surface.pushed_out(&p.tip, margin), ..p })
        .collect()
}

fn way_blocked(
    test: &PoseTest<'_>,
    settings: &LinkSettings,
    from: &ClPoint,
    way: &[ClPoint],
    to: &ClPoint,
    hints: &mut Hints,
) -> Option<(ClPoint, Infeasible)> {
    let mut a = *from;
    for b in way.iter().chain(std::iter::once(to)) {
        if let Some(blocked) = leg_blocked(test, settings, &a, b, hints) {
            return Some(blocked);
        }
        a = *b;
    }
    None
}

/// Walks a leg by the free distance at each pose; the first pose that is nearer than the rapid clearance, with the reason.
fn leg_blocked(
    test: &PoseTest<'_>,
    settings: &LinkSettings,
    a: &ClPoint,
    b: &ClPoint,
    hints: &mut Hints,
) -> Option<(ClPoint, Infeasible)> {
    let mut walk = Walk { t: 0.0, step: 1.0 };
    loop {
        let pose = between(a, b, walk.t);
        match test.rapid_distance(&pose, settings.rapid_clearance + FAR, hints) {
            Err(why) => return Some((pose, why)),
            Ok((distance, nearest)) if distance < settings.rapid_clearance => return Some((pose, nearest?)),
            Ok(_) if walk.t >= 1.0 => return None,
            Ok((distance, _)) => {
                let free = (distance - settings.rapid_clearance).max(MIN_ADVANCE);
                if let Err(why) = walk.advance(test, a, b, free) {
                    return Some((pose, why));
                }
            }
        }
    }
}

/// A place on a leg, as a fraction of it.
struct Walk {
    t: f64,
    /// The step to try next.
    step: f64,
}

impl Walk {
    /// Goes on as far as no point of tool and head moves by more than `free`, to the leg's end at most.
    fn advance(&mut self, test: &PoseTest<'_>, a: &ClPoint, b: &ClPoint, free: f64) -> Result<(), Infeasible> {
        let here = test.stance(&between(a, b, self.t))?;
        loop {
            let next = (self.t + self.step).min(1.0);
            let moved = here.motion_to(&test.stance(&between(a, b, next))?);
            if moved <= free || self.step <= MIN_STEP {
                self.step = 2.0 * (next - self.t).max(MIN_STEP);
                self.t = next;
                return Ok(());
            }
            self.step = ((next - self.t) * (0.9 * free / moved).max(0.1)).max(MIN_STEP);
        }
    }
}

/// Distances are not searched farther than this, mm: more would only save steps.
const FAR: f64 = 150.0;
/// Smallest step of the walk, mm: half of the smallest rapid clearance that makes sense.
const MIN_ADVANCE: f64 = 1.0;
/// Smallest step, as a fraction of the leg: at the pole of the rotary axes a body turns at once, however small the step.
const MIN_STEP: f64 = 1e-4;
