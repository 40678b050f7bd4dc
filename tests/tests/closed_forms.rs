//! Where gouging begins, by closed forms, and needles that sampling misses.

use facemill::cl_data::{ClPoint, RoundFrustum, Solid};
use facemill::interference::{Interference, MeshTree, Verdict};
use facemill::sample_parts::{AnalyticPart, AnalyticShape, MaterialSide};
use facemill::surface_model::TriMesh;
use facemill::tool_model::Cutter;
use facemill::z_map::{ZMap, ZMapSettings, gouge_estimate};
use facemill_tests::random::Random;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// The lower half of a mesh: of a sphere the inside is then free.
fn lower_half(mesh: &TriMesh) -> TriMesh {
    let is_low = |t: &&[u32; 3]| t.iter().all(|&v| mesh.vertices()[v as usize].z < 1.0);
    TriMesh::new(mesh.vertices().to_vec(), mesh.triangles().iter().filter(is_low).copied().collect()).unwrap()
}

#[test]
fn rear_gouge_in_a_sphere_and_a_cylinder_begins_at_the_tilt_of_the_closed_form() {
    let hollow = 60.0;
    let (radius, corner) = (25.0, 2.0);
    let rim = radius - corner;
    let disc = Solid::Frustum(RoundFrustum {
        z_low: corner,
        z_high: corner,
        radius_low: rim,
        radius_high: rim,
        rounding: corner,
    });
    let shapes = [
        AnalyticShape::Sphere { radius: hollow, material: MaterialSide::Outside },
        AnalyticShape::Cylinder { radius: hollow, length: 200.0, material: MaterialSide::Outside },
    ];
    for shape in shapes {
        let mut widths = Vec::new();
        for resolution in [20usize, 40, 80, 160] {
            // The cylinder lies along Y.
            let lying = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
            let mesh = AnalyticPart::new(shape).unwrap().mesh(resolution).unwrap().transformed(&lying);
            // The vertices are on the surface; facets are nearer to the axis or centre by at most this.
            let centre_distance = |t: usize| {
                let c = mesh.corners(t).iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / 3.0;
                let size = mesh.corners(t).iter().map(|p| (p.coords - c).norm_squared()).fold(0.0, f64::max);
                hollow - (hollow * hollow - size).sqrt()
            };
            let chord = (0..mesh.triangles().len()).map(centre_distance).fold(0.0, f64::max);
            let tree = MeshTree::new(&lower_half(&mesh));
            // The corner touches a sphere that is smaller by the chord, at its lowest point; the disc rises from there
            // along +X by the tilt.
            let lever = hollow - corner - chord;
            let is_free = |tilt: f64| {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -tilt);
                let contact = turn * Point3::new(-rim, 0.0, corner);
                let pose = Isometry3::from_parts(Translation3::from(Point3::new(0.0, 0.0, -lever) - contact), turn);
                tree.verdict(&disc, &pose, None).is_free()
            };
            let (mut hit, mut free) = (0.05, 1.2);
            assert!(!is_free(hit) && is_free(free));
            while free - hit > 1e-10 {
                let middle = 0.5 * (hit + free);
                if is_free(middle) { free = middle } else { hit = middle }
            }
            // The circle of the corner's centres stays within the smaller sphere from sin = rim / lever on, and its far end
            // leaves the true one below the other bound.
            let highest = (rim / lever).asin();
            let sq = |x: f64| x * x;
            let lowest = ((4.0 * sq(rim) + sq(lever) - sq(hollow - corner)) / (4.0 * rim * lever)).asin();
            assert!(lowest - 1e-8 <= free && free <= highest + 1e-8, "{shape:?}: {free} not in {lowest}..{highest}");
            let exact = (rim / (hollow - corner)).asin();
            assert!((free - exact).abs() <= highest - lowest + 1e-8, "{free} for {exact}");
            widths.push(highest - lowest);
        }
        // The bracket around the closed form closes with the square of the refinement.
        assert!(widths.windows(2).all(|w| w[1] < 0.3 * w[0]) && widths[3] < 1e-3, "{widths:?}");
    }
}

#[test]
fn a_spike_under_the_disc_is_found_and_the_sampling_test_misses_it() {
    let mill = Cutter::new(25.0, 2.0, 40.0).unwrap();
    let mut random = Random::new(8);
    let n = 100;
    let mut n_missed = 0;
    for _ in 0..n {
        let [x, y] = [0; 2].map(|_| random.between(-12.0, 12.0));
        let corner = |x, y| Point3::new(x, y, 0.0);
        let mut vertices = vec![corner(-60.0, -60.0), corner(60.0, -60.0), corner(60.0, 60.0), corner(-60.0, 60.0)];
        vertices.extend([corner(x, y), corner(x + 0.01, y), corner(x, y + 0.01), Point3::new(x, y, 0.11)]);
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 7], [5, 6, 7], [6, 4, 7]];
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let cl = ClPoint { tip: Point3::new(0.0, 0.0, 0.1), axis: Vector3::z_axis() };
        let body = Solid::Frustum(mill.test_body(0.0));
        let verdict = MeshTree::new(&mesh).verdict(&body, &Isometry3::translation(0.0, 0.0, 0.1), None);
        assert!(matches!(verdict, Verdict::Hit(w) if w.triangle >= 2), "missed at {x} {y}: {verdict:?}");
        let map = ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell: 0.5, margin: 0.0 }).unwrap();
        let estimate = gouge_estimate(&map, &mill, &cl).unwrap();
        n_missed += usize::from(estimate.clearance > 0.099);
    }
    // The spike's 0.01 mm meet a node of the 0.5 mm grid once in thousands.
    assert!(n_missed >= n - 1, "{n_missed} of {n} missed by sampling");
}

#[test]
fn a_bump_between_two_cc_points_is_found_between_them() {
    // Ball of 3 mm over a bump 0.4 mm wide, midway between points 4 mm apart.
    let corner = |x, y| Point3::new(x, y, 0.0);
    let mut vertices = vec![corner(-60.0, -60.0), corner(60.0, -60.0), corner(60.0, 60.0), corner(-60.0, 60.0)];
    vertices.extend([corner(-0.2, -0.2), corner(0.2, -0.2), corner(0.0, 0.2), Point3::new(0.0, 0.0, 0.3)]);
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 7], [5, 6, 7], [6, 4, 7]];
    let tree = MeshTree::new(&TriMesh::new(vertices, triangles).unwrap());
    let ball = Solid::Frustum(Cutter::new(3.0, 3.0, 20.0).unwrap().test_body(0.0));
    let is_free = |x: f64| tree.verdict(&ball, &Isometry3::translation(x, 0.0, 0.001), None).is_free();
    assert!(is_free(-2.0) && is_free(2.0) && !is_free(0.0));
}
