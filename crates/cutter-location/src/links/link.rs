//! The way from the end of one pass to the start of the next, without cutting.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::BlockLaw;
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use crate::links::rewind::{Height, rewound_axis};
use crate::pose::placed_machine::PlacedMachine;
use crate::pose::pose_test::PoseTest;
use crate::pose::workcell::{Configuration, Hints, Infeasible, angle_between};

/// Surface that encloses the whole workpiece, its stock and its fixtures; workpiece frame, mm.
///
/// Exhaustive, so that a new one is handled everywhere: links must stay outside each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearanceSurface {
    /// Plane through `origin`; the side that `normal` points to is free.
    Plane {
        /// A point of the plane.
        origin: Point3<f64>,
        /// Direction toward the free side.
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
    /// Returns the height of a point above the surface, negative inside.
    pub fn height(&self, p: &Point3<f64>) -> f64 {
        self.outward(p).1
    }

    /// Returns the direction away from the workpiece at `p`, and the height of `p` above the
    /// surface.
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

    /// Returns the pose moved along the tool axis until its tip is `margin` above the surface,
    /// where that takes at most three times its depth, else straight out. A pose that is there
    /// already stays.
    pub fn retract(&self, cl: &ClPoint, margin: f64) -> ClPoint {
        self.along(cl, &cl.axis, margin).unwrap_or_else(|| self.straight_out(cl, margin))
    }

    /// Returns the pose moved out in the plane across a direction until its tip is `margin` above
    /// the surface, straight in that plane. A pose that is there already stays, as does one for
    /// which the plane leads nowhere.
    pub fn retract_within(&self, cl: &ClPoint, margin: f64, across: &Unit<Vector3<f64>>) -> ClPoint {
        let out = self.outward(&cl.tip).0.into_inner();
        let within = Unit::try_new(out - across.into_inner() * out.dot(across), 1e-3);
        within.and_then(|direction| self.along(cl, &direction, margin)).unwrap_or(*cl)
    }

    /// Returns the pose moved straight away from the workpiece until its tip is `margin` above the
    /// surface.
    fn straight_out(&self, cl: &ClPoint, margin: f64) -> ClPoint {
        let (out, level) = self.outward(&cl.tip);
        cl.translated(out.into_inner() * (margin - level).max(0.0))
    }

    /// Returns the first pose `margin` above the surface along `direction`, at most three times its
    /// depth away. Bisected: for a pose inside a convex surface, the height along a line grows from
    /// the first crossing on.
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
        for _ in 0..MAX_HALVINGS {
            if outside - inside <= 1e-3 {
                break;
            }
            let middle = 0.5 * (inside + outside);
            if self.height(&at(middle).tip) < margin { inside = middle } else { outside = middle }
        }
        Some(at(outside))
    }

    /// Returns ways from a pose to `margin` above the surface, without the pose itself, the
    /// likeliest first: along the tool axis, straight out, between the two, and a little along the
    /// axis before moving straight out.
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

    /// Returns `p`, moved straight out until it is `margin` above the surface where it is not yet.
    fn pushed_out(&self, p: &Point3<f64>, margin: f64) -> Point3<f64> {
        let (out, level) = self.outward(p);
        p + out.into_inner() * (margin - level).max(0.0)
    }
}

fn direction_or_any(v: Vector3<f64>, perpendicular_to: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    Unit::try_new(v, 1e-9).unwrap_or_else(|| any_perpendicular(perpendicular_to))
}

/// Returns some direction perpendicular to another.
fn any_perpendicular(a: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let least = if a.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    Unit::new_normalize(a.cross(&least))
}

/// Returns the pose at fraction `t` between two: tip on the straight line, axis turned uniformly in
/// the plane of both (through any perpendicular direction when they are opposed).
pub fn between(a: &ClPoint, b: &ClPoint, t: f64) -> ClPoint {
    let angle = angle_between(&a.axis, &b.axis);
    let turn_axis = Unit::try_new(a.axis.cross(&b.axis), 1e-12).unwrap_or_else(|| any_perpendicular(&a.axis));
    let axis = UnitQuaternion::from_axis_angle(&turn_axis, angle * t) * a.axis;
    ClPoint { tip: a.tip + (b.tip - a.tip) * t, axis: Unit::new_normalize(axis.into_inner()) }
}

/// Bisections of a way: enough to exhaust a double.
const MAX_HALVINGS: u32 = 200;

/// Requirements of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkSettings {
    /// The clearance surface.
    pub clearance: ClearanceSurface,
    /// Distance of the whole tool from stock, part and fixtures, mm.
    pub rapid_clearance: f64,
    /// Motion of the control in a rapid block: the machine's law of rapids, or the law of its cuts
    /// under RTCP, for controls that keep the tip straight at rapid rate, too.
    pub rapid_law: BlockLaw,
}

/// Distances by which a tool moves back along its axis before it moves straight out, mm.
const FIRST_BACK: [f64; 3] = [20.0, 60.0, 180.0];

/// Obstruction of the link between two poses.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkBlocked {
    /// Pose at which the way over the clearance surface is blocked.
    pub pose: ClPoint,
    /// The reason.
    pub why: Infeasible,
}

/// Retracts along the tool axis that are tried before the way over the clearance surface, mm. Each
/// about doubles: a link is at most about twice as high as necessary.
const LIFTS: [f64; 6] = [0.0, 25.0, 60.0, 130.0, 280.0, 600.0];

/// A pose on the way of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Tool pose, workpiece frame.
    pub cl: ClPoint,
    /// Configuration of the machine there.
    pub configuration: Configuration,
}

/// Finds ways between passes and tests them as they are driven: tip straight, axis turned evenly,
/// on one branch.
///
/// The free distance at each tested pose covers the motion of tool and machine to the next one.
/// Near the clearance the poses are half of it or 1 mm apart, so half of that may lack between two.
/// The motion of the control differs from the tested one by the linearisation tolerance. Where a
/// leg passes through the pole of the rotary axes, the head's turn about the tool at the pole
/// itself is not tested.
/// at the pole itself is not tested.
pub struct Linker<'t, 'a> {
    pub(crate) test: &'t PoseTest<'a>,
    pub(crate) settings: &'t LinkSettings,
    pub(crate) hints: Hints,
}

impl<'t, 'a> Linker<'t, 'a> {
    /// Prepares links in a workcell.
    pub fn new(test: &'t PoseTest<'a>, settings: &'t LinkSettings) -> Self {
        Self { test, settings, hints: Hints::default() }
    }

    /// Returns poses strictly between `from` and `to` along which the tool stays at least the rapid
    /// clearance from everything; both ends are clear already. The lowest of a series of lifted
    /// ways is taken, else the way over the clearance surface.
    ///
    /// Where the two ends are on different branches, the way leads over the clearance surface and
    /// holds one pose there twice, on the first branch and on the second: all axes move together.
    /// [`Linker::rapid_block`] has to test that motion once the turns of the axes are known. The
    /// same holds where a limited rotary axis has to turn back: a pose appears twice, at two
    /// windings, outside the clearance surface, see [`rewound_axis`].
    ///
    /// # Errors
    /// When even the way over the clearance surface is blocked.
    pub fn link(&mut self, from: &Waypoint, to: &Waypoint) -> Result<Vec<Waypoint>, LinkBlocked> {
        if from.configuration.branch != to.configuration.branch {
            return self.over_clearance(from, to);
        }
        let raised = |p: &Waypoint, by: f64| p.cl.translated(p.cl.axis.into_inner() * by);
        for lift in LIFTS {
            let way = if lift == 0.0 { vec![] } else { vec![raised(from, lift), raised(to, lift)] };
            if let Ok(mut poses) = self.way(from, way.into_iter().chain([to.cl])) {
                let arrived = poses.pop();
                if arrived.is_some_and(|w| self.rewinds(&w, to)) {
                    // The axis is elsewhere at every height of the way.
                    break;
                }
                return Ok(poses);
            }
        }
        self.over_clearance(from, to)
    }

    /// Returns the way from `from` out to the clearance surface, along it, and back to `to`, by the
    /// first free way out at each end.
    fn over_clearance(&mut self, from: &Waypoint, to: &Waypoint) -> Result<Vec<Waypoint>, LinkBlocked> {
        let margin = self.test.clearance_margin();
        let mut first = None;
        for height in self.heights() {
            match self.over(from, to, margin, height) {
                Ok(way) => return Ok(way),
                Err(blocked) => first = first.or(Some(blocked)),
            }
        }
        Err(first.expect("at least one height is tried"))
    }

    /// Does the same at a height above the clearance surface in addition to the margin.
    fn over(
        &mut self,
        from: &Waypoint,
        to: &Waypoint,
        margin: f64,
        height: Height,
    ) -> Result<Vec<Waypoint>, LinkBlocked> {
        let mut way = self.way_out_to(from, margin + height.above)?;
        let mut back = self.way_out_to(to, margin + height.above)?;
        back.reverse();
        let out = *way.last().unwrap_or(from);
        let over = *back.first().unwrap_or(to);
        let across = along_clearance(&self.settings.clearance, margin + height.above, &out.cl, &over.cl);
        let poses: Vec<ClPoint> = across.into_iter().chain([over.cl]).collect();
        way.extend(self.across(&out, &over, &poses, height)?);
        if way
            .last()
            .is_some_and(|last| last.configuration.branch == to.configuration.branch && !self.rewinds(last, &over))
        {
            // The last pose across is the first one back.
            way.pop();
        }
        let start = if back.is_empty() { *to } else { over };
        way.extend(back.iter().copied());
        // Down again, tested as it will be driven: from above, not from below as it was found.
        let down: Vec<ClPoint> = back.iter().skip(1).map(|w| w.cl).chain([to.cl]).collect();
        self.way(&start, down)?;
        Ok(way)
    }

    /// Returns the way from a pose straight to the clearance surface in the plane across a
    /// direction, without the pose itself.
    ///
    /// # Errors
    /// When it is blocked or does not reach the surface.
    pub fn straight_out(&mut self, from: &Waypoint, across: &Unit<Vector3<f64>>) -> Result<Vec<Waypoint>, LinkBlocked> {
        let margin = self.test.clearance_margin();
        let out = self.settings.clearance.retract_within(&from.cl, margin, across);
        if self.settings.clearance.height(&out.tip) < margin - 1e-2 {
            return Err(LinkBlocked { pose: out, why: Infeasible::TooLong });
        }
        self.way(from, [out])
    }

    /// Returns the first free way from a pose to the clearance surface, without the pose itself.
    ///
    /// # Errors
    /// When none is free: where the first one, along the tool axis, is blocked.
    pub fn way_out(&mut self, from: &Waypoint) -> Result<Vec<Waypoint>, LinkBlocked> {
        self.way_out_to(from, self.test.clearance_margin())
    }

    /// Does the same up to a margin above the surface.
    fn way_out_to(&mut self, from: &Waypoint, margin: f64) -> Result<Vec<Waypoint>, LinkBlocked> {
        let mut first = None;
        for way in self.settings.clearance.ways_out(&from.cl, margin) {
            match self.way(from, way) {
                Ok(poses) => return Ok(poses),
                Err(blocked) => first = first.or(Some(blocked)),
            }
        }
        Err(first.expect("there is always the way straight out"))
    }

    /// Walks a way through poses; returns the machine's configuration at each of them.
    pub(crate) fn way(
        &mut self,
        from: &Waypoint,
        poses: impl IntoIterator<Item = ClPoint>,
    ) -> Result<Vec<Waypoint>, LinkBlocked> {
        let mut at = *from;
        poses
            .into_iter()
            .map(|pose| {
                at = self.leg(&at, &pose)?;
                Ok(at)
            })
            .collect()
    }

    /// Walks a leg by the free distance at each pose, up to the first that is nearer than the rapid
    /// clearance to something.
    fn leg(&mut self, from: &Waypoint, to: &ClPoint) -> Result<Waypoint, LinkBlocked> {
        let (test, clearance) = (self.test, self.settings.rapid_clearance);
        let mut walk = LegWalk { t: 0.0, step: 1.0 };
        let mut configuration = from.configuration;
        for _ in 0..MAX_STEPS {
            let pose = between(&from.cl, to, walk.t);
            let blocked = |why: Infeasible| LinkBlocked { pose, why };
            let next = test.configuration_like(&pose, &configuration).map_err(blocked)?;
            if let Some(axis) = rewound_axis(test.cell.machine, &configuration.axes, &next.axes) {
                return Err(blocked(Infeasible::Rewind { axis }));
            }
            configuration = next;
            let (distance, nearest) = test.rapid_distance(&configuration.axes, clearance + FAR, &mut self.hints);
            if let Some(why) = nearest.filter(|_| distance < clearance) {
                return Err(blocked(why));
            }
            if walk.t >= 1.0 {
                return Ok(Waypoint { cl: *to, configuration });
            }
            let here = PlacedMachine::new(test, &configuration);
            let motion = |t: f64| {
                let there = test.configuration_like(&between(&from.cl, to, t), &configuration)?;
                Ok(here.motion_to(&PlacedMachine::new(test, &there)))
            };
            walk.advance((distance - clearance).max(least_advance(clearance)), motion).map_err(blocked)?;
        }
        Err(LinkBlocked { pose: *to, why: Infeasible::TooLong })
    }
}

/// Returns poses between two that are on the clearance surface. A straight line between two points
/// outside a convex surface may cut through it, so points in between are pushed out.
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

/// A place on a leg, as a fraction of the leg.
pub(crate) struct LegWalk {
    pub(crate) t: f64,
    /// The step to try next.
    pub(crate) step: f64,
}

impl LegWalk {
    /// Advances as far as no point of tool and machine moves by more than `free`, to the leg's end
    /// at most. `motion` bounds that motion up to a later place.
    pub(crate) fn advance(
        &mut self,
        free: f64,
        motion: impl Fn(f64) -> Result<f64, Infeasible>,
    ) -> Result<(), Infeasible> {
        loop {
            let next = (self.t + self.step).min(1.0);
            let moved = motion(next)?;
            if moved <= free || self.step <= MIN_STEP {
                self.step = 2.0 * (next - self.t).max(MIN_STEP);
                self.t = next;
                return Ok(());
            }
            self.step = ((next - self.t) * (0.9 * free / moved).max(0.1)).max(MIN_STEP);
        }
    }
}

/// Largest distance that is searched, mm: more would only save steps.
pub(crate) const FAR: f64 = 150.0;

/// Returns the smallest step of a walk next to something, mm: half of it may lack of the clearance
/// between two tested configurations.
pub(crate) fn least_advance(clearance: f64) -> f64 {
    (0.5 * clearance).clamp(0.05, 1.0)
}

/// Smallest step, as a fraction of the leg: at the pole of the rotary axes a body turns at once,
/// however small the step.
const MIN_STEP: f64 = 1e-4;

/// Largest number of steps of a leg, reached when all are the smallest.
pub(crate) const MAX_STEPS: usize = 10_001;
