//! Rates on the scenes' patch, for a look at the order of magnitude:
//! `cargo test --release -p facemill-interference --test speed -- --ignored --nocapture`

use std::time::Instant;

use facemill_cl_data::{CcPoint, Posture, RoundBox, RoundFrustum, Solid};
use facemill_interference::{Interference, MeshTree, ParryMesh, lift_to_free};
use facemill_surface_model::TriMesh;
use facemill_tool_model::{Cutter, cl_from_cc};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Wavy patch of 200 × 200 mm, heights within ±20 mm.
fn height(x: f64, y: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    12.0 * (turn * x / 180.0 + 0.4).sin() * (turn * y / 210.0).cos() + 8.0 * (turn * (x + 0.6 * y) / 190.0 + 1.1).sin()
}

fn patch(n: u32) -> TriMesh {
    let at = |i: u32| -100.0 + 200.0 * f64::from(i) / f64::from(n - 1);
    let point = |i: u32, j: u32| Point3::new(at(i), at(j), height(at(i), at(j)));
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([n - 1; 2], point);
    TriMesh::new(vertices, triangles).unwrap()
}

/// Poses of a cutter lifted by 0.05 mm over seeded CC points, tilt 2 to 15°, rotate 0 to −85°.
fn poses(cutter: &Cutter, n: u32) -> Vec<(CcPoint, Isometry3<f64>)> {
    let mut state = facemill_test_kit::Random(1);
    let mut next = || state.unit();
    (0..n)
        .map(|_| {
            let (x, y) = (170.0 * next() - 85.0, 170.0 * next() - 85.0);
            let h = 1e-4;
            let (dx, dy) = (height(x + h, y) - height(x - h, y), height(x, y + h) - height(x, y - h));
            let normal = Vector3::new(-dx / (2.0 * h), -dy / (2.0 * h), 1.0);
            let cc = CcPoint::new(Point3::new(x, y, height(x, y)), normal, Vector3::x()).unwrap();
            let posture = Posture { tilt: (2.0 + 13.0 * next()).to_radians(), rotate: (-85.0 * next()).to_radians() };
            let cl = cl_from_cc(cutter, &cc, posture).translated(cc.normal.into_inner() * 0.05);
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &cl.axis).unwrap();
            (cc, Isometry3::from_parts(Translation3::from(cl.tip.coords), turn))
        })
        .collect()
}

fn rate(name: &str, n: usize, mut work: impl FnMut(usize)) {
    let runs = 5;
    let mut rates = Vec::new();
    for _ in 0..runs {
        let start = Instant::now();
        (0..n).for_each(&mut work);
        rates.push(n as f64 / start.elapsed().as_secs_f64());
    }
    rates.sort_by(f64::total_cmp);
    println!("  {name:<34} {:>9.0} /s  ({n} poses)", rates[runs / 2]);
}

#[test]
#[ignore = "measures, needs --release"]
fn rates_on_the_patch() {
    for n in [317, 1001] {
        let mesh = patch(n);
        let start = Instant::now();
        let tree = MeshTree::new(&mesh);
        println!("{} triangles, built in {:.3} s", mesh.triangles().len(), start.elapsed().as_secs_f64());
        for (radius, corner) in [(25.0, 2.0), (80.0, 6.0)] {
            let cutter = Cutter::new(radius, corner, 50.0).unwrap();
            measure(&tree, &mesh, &cutter);
        }
    }
}

fn measure(tree: &MeshTree, mesh: &TriMesh, cutter: &Cutter) {
    let body = Solid::Frustum(cutter.lower_test_body(0.0));
    let cylinder = |z_low, z_high, radius| {
        Solid::Frustum(RoundFrustum { z_low, z_high, radius_low: radius, radius_high: radius, rounding: 1.0 })
    };
    let holder = cylinder(50.0, 150.0, 31.5);
    let head = Solid::Box(RoundBox { half_extents: Vector3::new(100.0, 100.0, 150.0), rounding: 1.0 });
    let raised = Translation3::new(0.0, 0.0, 300.0);
    let all = poses(cutter, 40_000);
    type Poses<'a> = Vec<&'a (CcPoint, Isometry3<f64>)>;
    let (free, hit): (Poses, Poses) = all.iter().partition(|(_, p)| tree.verdict(&body, p, None).is_free());
    println!(" R {} r {}: {} free of {}", cutter.radius(), cutter.corner_radius(), free.len(), all.len());
    rate("cutter free", free.len(), |k| assert!(tree.verdict(&body, &free[k].1, None).is_free()));
    rate("cutter hit", hit.len(), |k| assert!(!tree.verdict(&body, &hit[k].1, None).is_free()));
    let full = |p: &Isometry3<f64>| {
        tree.verdict(&body, p, None).is_free()
            && tree.verdict(&holder, p, None).is_free()
            && tree.verdict(&head, &(p * raised), None).is_free()
    };
    let (all_free, some_hit): (Poses, Poses) = all.iter().partition(|(_, p)| full(p));
    rate("cutter, holder, box free", all_free.len(), |k| assert!(full(&all_free[k].1)));
    rate("cutter, holder, box hit", some_hit.len(), |k| assert!(!full(&some_hit[k].1)));
    let hints: Vec<_> =
        free.iter().map(|(_, p)| tree.core_distance(&body, p, 50.0, None).map(|s| s.triangle)).collect();
    rate("core distance, free, no hint", free.len(), |k| {
        assert!(tree.core_distance(&body, &free[k].1, 50.0, None).is_some());
    });
    rate("core distance, free, own hint", free.len(), |k| {
        assert!(tree.core_distance(&body, &free[k].1, 50.0, hints[k]).is_some());
    });
    let seat = |(cc, p): &(CcPoint, Isometry3<f64>)| {
        let sunk = Translation3::from(cc.normal.into_inner() * -0.051) * p;
        lift_to_free(tree, &body, &sunk, Unit::new_normalize(cc.normal.into_inner()), 0.1, 1e-6)
    };
    rate("seating to 1e-6 mm", free.len(), |k| assert!(seat(free[k]).is_some()));
    if mesh.triangles().len() > 1_000_000 {
        return;
    }
    let parry = ParryMesh::new(mesh);
    for (_, pose) in all.iter().take(200) {
        assert_eq!(tree.verdict(&body, pose, None).is_free(), parry.verdict(&body, pose, None).is_free());
    }
    rate("parry free", free.len().min(20), |k| assert!(parry.verdict(&body, &free[k].1, None).is_free()));
}
