//! Laws of motions that are proven to touch nothing.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, MeshTree, MotionInterval, SweepVerdict};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::kit::{Random, cube, frustum, sample_solids, sheet, square};

/// Turn about an axis through the solid's origin at constant rate, and constant velocity of the
/// origin: its pose at a time, and how far points of the solid leave their tangents.
struct Screw {
    middle: Isometry3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

impl Screw {
    fn at(&self, t: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(self.spin * t);
        let shift = self.middle.translation.vector + self.velocity * t;
        Isometry3::from_parts(Translation3::from(shift), turn * self.middle.rotation)
    }

    fn interval(&self, solid: &Solid, half: f64) -> MotionInterval {
        let bounds = solid.aabb();
        let reach = bounds.min.coords.abs().sup(&bounds.max.coords.abs()).norm();
        let deviation = 0.5 * self.spin.norm_squared() * reach * half * half;
        let Self { middle, velocity, spin } = *self;
        MotionInterval { mesh_from_solid: middle, velocity, spin, half, deviation }
    }
}

#[test]
fn what_is_clear_is_touched_at_no_sampled_time() {
    let mesh = sheet();
    let tree = MeshTree::new(&mesh);
    let mut lcg = Random(71);
    let (mut clear, mut near) = (0, 0);
    for solid in sample_solids() {
        for _ in 0..120 {
            let middle = lcg.pose(45.0);
            let screw = Screw {
                middle,
                velocity: lcg.direction().into_inner() * lcg.between(0.0, 6.0),
                spin: lcg.direction().into_inner() * lcg.between(0.0, 0.2),
            };
            let half = lcg.between(0.05, 1.0);
            if tree.sweep(&solid, &screw.interval(&solid, half), None) != SweepVerdict::Clear {
                continue;
            }
            clear += 1;
            let mut least = f64::INFINITY;
            for k in 0..=60 {
                let t = half * (f64::from(k) / 30.0 - 1.0);
                assert!(tree.verdict(&solid, &screw.at(t), None).is_free(), "{solid:?} at {t}");
                let near = tree.core_distance(&solid, &screw.at(t), solid.rounding() + 5.0, None);
                least = least.min(near.map_or(5.0, |s| s.distance - solid.rounding()));
            }
            near += usize::from(least < 1.0);
        }
    }
    assert!(clear > 200 && near > 15, "{clear} clear, {near} of them near");
}

#[test]
fn a_short_enough_interval_proves_what_is_free() {
    // By the square of the length: the lack of an interval is the motion that is not straight.
    let tree = MeshTree::new(&sheet());
    let mut lcg = Random(72);
    let mut proven = 0;
    for solid in sample_solids() {
        for _ in 0..60 {
            let middle = lcg.pose(45.0);
            let gap = tree.core_distance(&solid, &middle, 100.0, None).map_or(100.0, |s| s.distance) - solid.rounding();
            if !(1e-3..=20.0).contains(&gap) {
                continue;
            }
            let screw = Screw {
                middle,
                velocity: lcg.direction().into_inner() * 5.0,
                spin: lcg.direction().into_inner() * 0.3,
            };
            // No point of the samples is farther than 100 mm from its origin: 35 mm per unit of
            // time.
            let half = gap / 40.0;
            assert_eq!(tree.sweep(&solid, &screw.interval(&solid, half), None), SweepVerdict::Clear, "{solid:?} {gap}");
            proven += 1;
        }
    }
    assert!(proven > 60, "{proven}");
}

#[test]
fn a_disc_that_slides_along_a_plane_is_certified_over_its_whole_way() {
    let tree = MeshTree::new(&square(500.0));
    let mill = frustum([2.0, 48.0], [23.0, 23.0], 2.0);
    let slide = |gap: f64, toward: f64| MotionInterval {
        mesh_from_solid: Isometry3::translation(0.0, 0.0, gap),
        velocity: Vector3::new(100.0, 0.0, -toward),
        spin: Vector3::zeros(),
        half: 1.0,
        deviation: 0.0,
    };
    // A micrometre over the plane, 200 mm far: distance over speed would have to stop every
    // micrometre.
    assert_eq!(tree.sweep(&mill, &slide(1e-3, 0.0), None), SweepVerdict::Clear);
    assert_eq!(tree.sweep(&mill, &slide(1e-3, 0.9e-3), None), SweepVerdict::Clear);
    assert!(matches!(tree.sweep(&mill, &slide(1e-3, 1.1e-3), None), SweepVerdict::Unproven(Some(_))));
    assert!(matches!(tree.sweep(&mill, &slide(-1e-6, 0.0), None), SweepVerdict::Unproven(Some(_))));
    // Tilted about its lowest point, the rim stays where it is to first order.
    let (sin, cos) = 0.05f64.sin_cos();
    let lowest = |gap: f64| gap + 23.0 * sin + 2.0 - 2.0 * cos;
    let pose = Isometry3::from_parts(
        Translation3::new(0.0, 0.0, lowest(1e-3)),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05),
    );
    let rim = pose * Point3::new(23.0, 0.0, 2.0);
    let spin = Vector3::new(0.0, 0.02, 0.0);
    let velocity = -spin.cross(&(rim - pose * Point3::origin()));
    let half = 0.1;
    let deviation = 0.5 * (0.02f64 * half).powi(2) * 60.0;
    let motion = MotionInterval { mesh_from_solid: pose, velocity, spin, half, deviation };
    assert_eq!(tree.sweep(&mill, &motion, None), SweepVerdict::Clear, "{deviation}");
}

#[test]
fn a_needle_that_is_met_between_the_ends_is_never_cleared() {
    let spike = vec![Point3::new(10.0, 0.0, -5.0), Point3::new(10.01, 0.0, -5.0), Point3::new(10.005, 0.0, 0.3)];
    let tree = MeshTree::new(&TriMesh::new(spike, vec![[0, 1, 2]]).unwrap());
    let disc = frustum([0.0, 20.0], [3.0, 3.0], 0.0);
    let motion = |half: f64, x: f64| MotionInterval {
        mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
        velocity: Vector3::new(10.0, 0.0, 0.0),
        spin: Vector3::zeros(),
        half,
        deviation: 0.0,
    };
    // Free at both ends, through the spike between.
    for x in [0.0, 20.0] {
        assert!(tree.verdict(&disc, &Isometry3::translation(x, 0.0, 0.0), None).is_free());
    }
    assert!(matches!(tree.sweep(&disc, &motion(1.0, 10.0), None), SweepVerdict::Unproven(_)));
    assert_eq!(tree.sweep(&disc, &motion(0.6, 0.0), None), SweepVerdict::Clear);
    assert!(matches!(tree.sweep(&disc, &motion(0.72, 0.0), None), SweepVerdict::Unproven(_)));
}

#[test]
fn a_body_inside_a_closed_part_and_numbers_that_are_none_are_not_cleared() {
    let tree = MeshTree::new(&cube(20.0, 1));
    let ball = frustum([0.0, 0.0], [0.0, 0.0], 1.0);
    let still = |x: f64, deviation: f64| MotionInterval {
        mesh_from_solid: Isometry3::translation(x, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
        half: 1.0,
        deviation,
    };
    assert!(matches!(tree.sweep(&ball, &still(0.0, 0.0), None), SweepVerdict::Unproven(Some(_))));
    assert_eq!(tree.sweep(&ball, &still(30.0, 0.0), None), SweepVerdict::Clear);
    assert_eq!(tree.sweep(&ball, &still(30.0, f64::NAN), None), SweepVerdict::Unproven(None));
    assert_eq!(tree.sweep(&ball, &still(f64::INFINITY, 0.0), None), SweepVerdict::Unproven(None));
}
