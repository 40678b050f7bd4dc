//! Ways from points of a pass that are sought one after the other, until one is found.

use std::sync::atomic::{AtomicUsize, Ordering};

use facemill_cl_data::{CcPoint, Solid};
use facemill_cutter_location::links::approach::{ApproachSettings, ApproachShape, PassEnd, PassEndPose, approach};
use facemill_cutter_location::{Hints, Obstacle, PoseTest};
use facemill_interference::{Interference, MeshTree, Separation, Verdict};
use facemill_tool_model::cl_from_cc;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::kit::{Ball, Random, cc_on_plane, machine, obstacle, plane, posture_deg, stand, tool, workcell};

/// Largest number of verdicts at a point without a way, in the mean. Each of its ways takes some
/// hundred if it is walked to the end, and there are more than a hundred.
const MOST_TESTS: usize = 2_500;

/// A mesh that counts its verdicts.
struct Counted<'m> {
    mesh: &'m MeshTree,
    verdicts: AtomicUsize,
}

impl Interference for Counted<'_> {
    fn verdict(&self, solid: &Solid, pose: &Isometry3<f64>, hint: Option<u32>) -> Verdict {
        self.verdicts.fetch_add(1, Ordering::Relaxed);
        self.mesh.verdict(solid, pose, hint)
    }

    fn core_distance(
        &self,
        solid: &Solid,
        pose: &Isometry3<f64>,
        at_most: f64,
        hint: Option<u32>,
    ) -> Option<Separation> {
        self.mesh.core_distance(solid, pose, at_most, hint)
    }
}

/// Walls of balls across the way, ahead of passes and over them.
fn walls(random: &mut Random) -> Vec<Ball> {
    let ahead = random.between(20.0, 60.0);
    let over = random.between(10.0, 90.0);
    let of_row = |y: f64| {
        let wall = [0.0, 14.0, 28.0].map(|z| Ball { center: Point3::new(ahead, y, 4.0 + z), radius: 8.0 });
        let roof = Ball { center: Point3::new(ahead - 40.0, y, over), radius: 5.0 };
        [wall.as_slice(), &[roof]].concat()
    };
    (-4..=4).flat_map(|row| of_row(12.0 * f64::from(row))).collect()
}

/// Ways found do not depend on what was refused before. Points without one cost no more than a few
/// tests of each way: where walls are ahead, and where the tool would plunge into stock.
#[test]
fn what_was_refused_before_changes_no_way() {
    let machine = machine();
    let tool = tool(25.0, 2.0, 20.0);
    let (mut n_found, mut n_none, mut n_tests) = (0, 0, 0);
    for seed in 0..12 {
        let mut random = Random(seed);
        let mesh = walls(&mut random).iter().fold(plane(900.0), |mesh, ball| mesh.joined(&ball.mesh()));
        let tree = MeshTree::new(&mesh);
        let counted = Counted { mesh: &tree, verdicts: AtomicUsize::new(0) };
        let end = if seed % 2 == 0 { PassEnd::Entry } else { PassEnd::Exit };
        let stock = Obstacle { collision_allowance: random.between(0.0, 3.0), ..obstacle("part", &counted) };
        let cell = workcell(&machine, &tool, vec![stock]);
        let test = PoseTest::new(&cell);
        let settings = ApproachSettings {
            shape: ApproachShape::Shortest { radius: 250.0, angle: 0.14 },
            straight: random.between(0.0, 8.0),
            bend: 0.001,
            step: 3.0,
            line_step: 3.0,
            test_step: 0.5,
            rapid_clearance: 5.0,
            max_retract: 120.0,
            still_across: None,
        };
        let posture = posture_deg(random.between(1.0, 6.0), 0.0);
        let outward = if end == PassEnd::Entry { -1.0 } else { 1.0 };
        let mut kept = Hints::default();
        for k in 0..25 {
            let at = cc_on_plane(20.0 - 3.0 * f64::from(k), 0.0);
            // Toward the walls, whichever end it is.
            let cc = CcPoint::new(at.position, at.normal.into_inner(), Vector3::x() * outward).unwrap();
            let cl = cl_from_cc(tool.cutter(), &cc, posture);
            if test.gouge(&cl, &mut Hints::default()).is_some() {
                continue;
            }
            let configuration = stand(&cell, &cl).configuration;
            let at = PassEndPose { end, cc: &cc, cl: &cl, configuration: &configuration, uncut_left: true };
            let fresh = approach(&test, &settings, &at, &mut Hints::default());
            let before = counted.verdicts.load(Ordering::Relaxed);
            let again = approach(&test, &settings, &at, &mut kept);
            let tests = counted.verdicts.load(Ordering::Relaxed) - before;
            match (again, fresh) {
                (Ok(again), Ok(fresh)) => {
                    assert_eq!(again, fresh, "seed {seed}, point {k}");
                    n_found += 1;
                }
                (Err(again), Err(fresh)) => {
                    assert_eq!(test.describe(&again), test.describe(&fresh), "seed {seed}, point {k}");
                    n_none += 1;
                    n_tests += tests;
                }
                (again, fresh) => panic!("seed {seed}, point {k}: {again:?}, {fresh:?}"),
            }
        }
    }
    assert!(n_found > 20 && n_none > 20, "{n_found} found, {n_none} not");
    assert!(n_tests < MOST_TESTS * n_none, "{n_tests} tests at {n_none} points");
}
