//! Proofs that hold for every posture of a range at one CC point.
//!
//! Between the postures of a range the tool turns about the point r above the contact: by the
//! tilt's difference about the axis across the tilt direction, then by the rotate's difference
//! about the normal. [`Interference::turn`](facemill_interference::Interference::turn) proves that
//! bodies are free of the mesh in all of these poses. A point of the mesh that stays within a body
//! proves that the body is hit in all of them. Proofs are about [`PoseTest::try_posture`], seating
//! included.

use facemill_cl_data::{CcPoint, ClPoint, Posture, Solid};
use facemill_interference::{Interference, SweepVerdict, TurnRange, Verdict, penetration};
use facemill_inverse_kinematics::AxisValues;
use facemill_inverse_kinematics::inverse::PoseSet;
use facemill_tool_model::cl_from_cc;
use nalgebra::{Isometry3, Point3};

use crate::pose::pose_test::PoseTest;
use crate::pose::spun_bodies::SpunBody;
use crate::pose::workcell::{Configuration, Hints, Infeasible, angle_between, tool_frame};
use crate::search::machine_proof::OnMachine;

/// Proof over a range of postures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Proof {
    /// Every posture is feasible.
    Free,
    /// No posture is feasible, and this blocks all of them; places are those of the posture in the
    /// middle.
    Blocked(Infeasible),
    /// No proof; holds the verdict on the posture in the middle.
    None(Option<Infeasible>),
}

/// Safety margin of every proof, mm: the kinematic pose is within 1e-9 mm of the CL point's, and
/// verdicts have a band of 1e-9 mm.
pub(crate) const MARGIN: f64 = 1e-6;

/// The same for angles, rad.
const ANGLE_MARGIN: f64 = 1e-9;

/// The postures around one, at one CC point.
pub(crate) struct PostureCell<'t, 'a> {
    pub(crate) test: &'t PoseTest<'a>,
    cc: CcPoint,
    middle: Posture,
    /// Largest differences of tilt and rotate, rad.
    half: [f64; 2],
    pub(crate) cl: ClPoint,
    /// The fixed point of all turns, r above the contact.
    center: Point3<f64>,
    /// Values of the axes that do not move the tool.
    pub(crate) others: AxisValues,
}

impl<'t, 'a> PostureCell<'t, 'a> {
    /// Creates the cell of postures whose tilt and rotate differ by at most `half` from the middle.
    pub(crate) fn new(test: &'t PoseTest<'a>, cc: &CcPoint, middle: Posture, half: [f64; 2]) -> Self {
        let cutter = test.cell.tool.cutter();
        Self {
            test,
            cc: *cc,
            middle,
            half,
            cl: cl_from_cc(cutter, cc, middle),
            center: cc.position + cc.normal.into_inner() * cutter.corner_radius(),
            others: test.cell.machine.home(),
        }
    }

    /// Takes the values of axes that do not move the tool from `near`, or at home without it.
    pub(crate) fn near(self, near: Option<&Configuration>) -> Self {
        Self { others: near.map_or(self.others, |near| near.axes), ..self }
    }

    /// Returns the strongest proof found, starting from the verdict on the middle.
    pub(crate) fn judge(&self, hints: &mut Hints) -> Proof {
        match self.test.try_posture(&self.cc, self.middle, None, hints) {
            Ok(_) if self.is_free(hints) => Proof::Free,
            Ok(_) => Proof::None(None),
            Err(why) => self.blocked_by(&why).map_or(Proof::None(Some(why)), Proof::Blocked),
        }
    }

    /// Proves that all are blocked, where the middle is blocked by `why`: by that, else by another
    /// body.
    pub(crate) fn blocked_by(&self, why: &Infeasible) -> Option<Infeasible> {
        match why {
            Infeasible::OutsideCone { excess } => (*excess > self.axis_turn() + ANGLE_MARGIN).then_some(*why),
            Infeasible::Singular { within } => (*within > self.axis_turn() + ANGLE_MARGIN).then_some(*why),
            Infeasible::Unreachable(_) => OnMachine::new(self, self.max_lift()).beyond_limits(),
            Infeasible::Gouge { .. } => self.gouged().or_else(|| self.hit_by_tool()),
            Infeasible::Collision { .. } => self.hit_by_tool().or_else(|| OnMachine::new(self, self.max_lift()).hit()),
            Infeasible::FromBelow
            | Infeasible::OtherBranch(_)
            | Infeasible::TooLong
            | Infeasible::Rewind { .. }
            | Infeasible::Ramp { .. } => None,
        }
    }

    fn max_lift(&self) -> f64 {
        self.test.cell.max_lift
    }

    /// Returns a bound on the angle of any tool axis to that in the middle, rad: the length of the
    /// way there on the unit sphere.
    fn axis_turn(&self) -> f64 {
        let steepest = (self.middle.tilt + self.half[0]).min(std::f64::consts::FRAC_PI_2);
        self.half[0] + self.half[1] * steepest.sin()
    }

    /// Returns the tool poses of the cell, lifted by 0 up to `max_lift`, in the table frame.
    pub(crate) fn pose_set(&self, max_lift: f64) -> PoseSet {
        let from_center = (self.cl.tip - self.center).norm();
        PoseSet {
            cl: self.lifted(0.5 * max_lift).transformed(&self.test.cell.table_from_work),
            turn: self.axis_turn() + ANGLE_MARGIN,
            shift: (self.half[0] + self.half[1]) * from_center + 0.5 * max_lift + MARGIN,
        }
    }

    /// Returns the pose in the middle, lifted.
    fn lifted(&self, lift: f64) -> ClPoint {
        self.cl.translated(self.cc.normal.into_inner() * lift)
    }

    /// Returns the poses of a body of the tool in the range, lifted by `lifts[0]` to `lifts[1]`.
    fn turns(&self, frame_from_solid: &Isometry3<f64>, lifts: [f64; 2]) -> TurnRange {
        let lift = 0.5 * (lifts[0] + lifts[1]);
        let normal = self.cc.normal.into_inner();
        let across = normal.cross(&self.cc.tilt_direction(self.middle.rotate));
        TurnRange {
            mesh_from_solid: tool_frame(&self.lifted(lift)) * frame_from_solid,
            center: self.center + normal * lift,
            turns: [across * self.half[0], normal * self.half[1]],
            shift: 0.5 * (lifts[1] - lifts[0]),
        }
    }

    fn is_free(&self, hints: &mut Hints) -> bool {
        let within_cone = self.test.cell.axis_cone.is_none_or(|cone| {
            angle_between(&self.cl.axis, &cone.axis) + self.axis_turn() + ANGLE_MARGIN <= cone.half_angle
        });
        if !within_cone {
            return false;
        }
        // Where the cutter is free without lift, no posture is lifted; where it is free at the
        // largest lift, each is lifted by some amount up to that.
        let lift = [0.0, self.max_lift()].into_iter().find(|lift| self.cutter_is_free(*lift, hints));
        lift.is_some_and(|lift| self.tool_is_free(lift, hints) && OnMachine::new(self, lift).is_free())
    }

    /// Returns whether the cutter's test bodies are free in all postures at one lift.
    fn cutter_is_free(&self, lift: f64, hints: &mut Hints) -> bool {
        let range = self.turns(&Isometry3::identity(), [lift; 2]);
        hints.gouge.resize(self.test.cell.obstacles.len(), None);
        self.gouge_tests().all(|(k, mesh, body)| {
            let verdict = mesh.turn(&body.dilated(MARGIN), &range, hints.gouge[k]);
            if let SweepVerdict::Unproven(Some(triangle)) = verdict {
                hints.gouge[k] = Some(triangle);
            }
            verdict == SweepVerdict::Clear
        })
    }

    /// Returns the obstacles that the cutter must not gouge, with its test bodies dilated by the
    /// allowance.
    fn gouge_tests(&self) -> impl Iterator<Item = (usize, &'t dyn Interference, Solid)> {
        let test = self.test;
        test.cell.obstacles.iter().enumerate().filter(|(k, _)| test.meetings.cutter[*k]).flat_map(move |(k, o)| {
            let bodies = o.gouge_allowance.into_iter();
            bodies.flat_map(move |allowance| test.test_bodies.iter().map(move |b| (k, &*o.mesh, b.dilated(allowance))))
        })
    }

    /// Returns the bodies that turn with the tool, paired with the obstacles of the workcell and
    /// dilated by their allowances.
    fn tool_tests(&self) -> impl Iterator<Item = (&'t SpunBody, usize, &'t dyn Interference, Solid)> {
        let test = self.test;
        test.spun_bodies.iter().flat_map(move |spun| {
            let meets = &test.meetings.bodies[spun.slot];
            let obstacles = test.cell.obstacles.iter().enumerate().filter(move |(k, _)| meets[*k]);
            obstacles.map(move |(k, o)| (spun, k, &*o.mesh, spun.solid.dilated(o.collision_allowance)))
        })
    }

    /// Returns whether these bodies are free in all postures and lifts up to `lift`.
    fn tool_is_free(&self, lift: f64, hints: &mut Hints) -> bool {
        let n = self.test.n_obstacles();
        self.tool_tests().all(|(spun, k, mesh, solid)| {
            let hint = hints.collision.get(spun.slot * n + k).copied().flatten();
            let range = self.turns(&spun.tool_from_solid, [0.0, lift]);
            mesh.turn(&solid.dilated(MARGIN), &range, hint) == SweepVerdict::Clear
        })
    }

    /// Finds a gouge of all postures, both without lift and at the largest one, so that none can be
    /// seated.
    fn gouged(&self) -> Option<Infeasible> {
        self.gouge_at(0.0)?;
        let (obstacle, place) = self.gouge_at(self.max_lift())?;
        Some(Infeasible::Gouge { obstacle, place })
    }

    /// Finds an obstacle with a point that stays in one of the test bodies in all postures at one
    /// lift.
    fn gouge_at(&self, lift: f64) -> Option<(usize, Point3<f64>)> {
        let range = self.turns(&Isometry3::identity(), [lift; 2]);
        self.gouge_tests().find_map(|(k, mesh, body)| Some((k, witness(mesh, &body, &range)?)))
    }

    /// Finds a body that turns with the tool, with a point of an obstacle that stays in it in all
    /// postures and lifts.
    fn hit_by_tool(&self) -> Option<Infeasible> {
        self.tool_tests().find_map(|(spun, obstacle, mesh, solid)| {
            let range = self.turns(&spun.tool_from_solid, [0.0, self.max_lift()]);
            let place = witness(mesh, &solid, &range)?;
            Some(Infeasible::Collision { body: spun.body, obstacle, place })
        })
    }
}

/// Returns a point of the mesh that is in the dilated solid in all poses of a range, or, for a
/// solid wholly inside a closed part in all of them, a point on its way out; `None` where none is
/// found.
fn witness(mesh: &dyn Interference, solid: &Solid, range: &TurnRange) -> Option<Point3<f64>> {
    let Verdict::Hit(hit) = mesh.verdict(solid, &range.mesh_from_solid, None) else { return None };
    if stays_within(solid, range, &hit.point) {
        return Some(hit.point);
    }
    if is_far_from_surface(mesh, solid, range) {
        return Some(hit.point);
    }
    // Where depth decides, the deepest point stays inside longest: everywhere except beside the
    // fixed point.
    let deepest = penetration(mesh, solid, &range.mesh_from_solid)?.point;
    stays_within(solid, range, &deepest).then_some(deepest)
}

/// Returns whether the surface is farther from the dilated solid than it moves within the range: a
/// solid inside stays inside.
fn is_far_from_surface(mesh: &dyn Interference, solid: &Solid, range: &TurnRange) -> bool {
    let bounds = solid.aabb();
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
    let corner = |k: usize| range.mesh_from_solid * Point3::new(pick(k, 0), pick(k, 1), pick(k, 2));
    let reach = (0..8).map(|k| (corner(k) - range.center).norm()).fold(0.0, f64::max);
    let beyond = solid.rounding() + range.farthest(reach) + MARGIN;
    mesh.core_distance(solid, &range.mesh_from_solid, beyond, None).is_none()
}

/// Returns whether a point is in the dilated solid in all poses of a range.
///
/// The depth is concave, so over first-order movements it is least at a corner of the range; the
/// rest of the movement reduces it by no more than its own length.
fn stays_within(solid: &Solid, range: &TurnRange, q: &Point3<f64>) -> bool {
    let depth = |p: Point3<f64>| solid.depth(&range.mesh_from_solid.inverse_transform_point(&p));
    let least = range.corner_moves(q).iter().map(|by| depth(q + by)).fold(f64::INFINITY, f64::min);
    least - range.remainder((q - range.center).norm()) > MARGIN
}
