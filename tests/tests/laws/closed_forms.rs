//! Where gouging begins, by closed forms, and needles that sampling misses.

use facemill::cl_data::{RoundFrustum, Solid};
use facemill::interference::{Interference, MeshTree, Verdict};
use facemill::sample_parts::{AnalyticPart, AnalyticShape, MaterialSide};
use facemill::surface_model::TriMesh;
use facemill::tool_model::Cutter;
use facemill::z_map::{ZMap, ZMapSettings};
use facemill_test_kit::Random;
use facemill_tests::oracles::onset::{RoundDisc, Touch, onset, saddle_distance, torus_distance};
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
            // The vertices are on the surface; facets are nearer to the axis or centre by at most
            // this.
            let centre_distance = |t: usize| {
                let c = mesh.corners(t).iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / 3.0;
                let size = mesh.corners(t).iter().map(|p| (p.coords - c).norm_squared()).fold(0.0, f64::max);
                hollow - (hollow * hollow - size).sqrt()
            };
            let chord = (0..mesh.triangles().len()).map(centre_distance).fold(0.0, f64::max);
            let tree = MeshTree::new(&lower_half(&mesh));
            // The corner touches a sphere that is smaller by the chord, at its lowest point; the
            // disc rises from there along +X by the tilt.
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
            // The circle of the corner's centres stays within the smaller sphere from sin = rim /
            // lever on, and its far end leaves the true one below the other bound.
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

// Lengths of the torus, whose hole has a radius of 60 mm, and of the saddle, mm.
const MAJOR: f64 = 100.0;
const MINOR: f64 = 40.0;
const CONCAVE: f64 = 60.0;
const CONVEX: f64 = 80.0;
const SIZE: f64 = 160.0;

const TORUS: AnalyticShape = AnalyticShape::Torus { major_radius: MAJOR, minor_radius: MINOR };
const SADDLE: AnalyticShape = AnalyticShape::Saddle { size: [SIZE; 2], concave_radius: CONCAVE, convex_radius: CONVEX };

/// A place where a surface is concave along the disc, which rises from there.
struct ConcavePlace {
    name: &'static str,
    touch: Touch,
    /// The onset for the rim's radius and r in closed form, where there is one. Elsewhere it is the
    /// exact equation solved in f64: the circle of the corner's centres is nowhere nearer to the
    /// surface than r.
    closed_form: fn(f64, f64) -> Option<f64>,
}

fn on_torus(name: &'static str, around: f64, tube: f64, closed_form: fn(f64, f64) -> Option<f64>) -> ConcavePlace {
    let ((sin, cos), (sin_v, cos_v)) = (around.sin_cos(), tube.sin_cos());
    let r = MAJOR + MINOR * cos_v;
    let at = Point3::new(r * cos, r * sin, MINOR * sin_v);
    let normal = Vector3::new(cos_v * cos, cos_v * sin, sin_v);
    ConcavePlace { name, touch: Touch { at, normal, across: Vector3::new(-sin, cos, 0.0) }, closed_form }
}

fn on_saddle(
    name: &'static str,
    [x, y]: [f64; 2],
    turn: f64,
    closed_form: fn(f64, f64) -> Option<f64>,
) -> ConcavePlace {
    let at = Point3::new(x, y, 0.5 * (x * x / CONCAVE - y * y / CONVEX));
    let normal = Vector3::new(-x / CONCAVE, y / CONVEX, 1.0).normalize();
    let across = Vector3::new(turn.cos(), turn.sin(), 0.0);
    ConcavePlace {
        name,
        touch: Touch { at, normal, across: (across - normal * across.dot(&normal)).normalize() },
        closed_form,
    }
}

/// In the hole's narrowest section, a circle, the rim's far end decides: off it the torus falls
/// away on both sides.
fn in_the_hole(rim: f64, corner: f64) -> Option<f64> {
    Some((rim / (MAJOR - MINOR - corner)).asin())
}

/// Along x through the origin the far end of a sharp rim meets the parabola: 2·rim·sin =
/// (2·rim·cos)²/(2·concave). A round one has none that is short.
fn in_the_valley(rim: f64, corner: f64) -> Option<f64> {
    let root = CONCAVE.hypot(2.0 * rim);
    (corner == 0.0).then(|| ((root - CONCAVE) / (2.0 * rim)).asin())
}

/// How far the mesh of a part and its surface are apart at most, both ways: the bound of linear
/// interpolation from the second derivatives of the surface over the grid. Of the torus in its
/// inner half, where the body is.
fn chord(shape: AnalyticShape, resolution: usize) -> f64 {
    let n = resolution as f64;
    match shape {
        AnalyticShape::Torus { .. } => (std::f64::consts::TAU / n).powi(2) / 8.0 * (MAJOR + 2.0 * MINOR + MINOR),
        _ => (SIZE / n).powi(2) / 8.0 / CONCAVE.min(CONVEX),
    }
}

/// Checks a shape at its places, for meshes of growing resolution.
///
/// With a bound e on the distance between mesh and surface and the cutter lifted by e: the mesh is
/// free where the cutter dilated by e is free of the surface, and hit where the surface meets a
/// body whose points have balls of e inside the cutter. So the onset on the mesh lies between those
/// of two exact bodies, and so does the exact one.
fn check_onsets(
    shape: AnalyticShape,
    resolutions: [usize; 4],
    places: &[ConcavePlace],
    distance: &dyn Fn(&Point3<f64>) -> f64,
) {
    let radius = 25.0;
    let steepest = 0.8;
    let trees = resolutions.map(|n| MeshTree::new(&AnalyticPart::new(shape).unwrap().mesh(n).unwrap()));
    for (place, corner) in places.iter().flat_map(|p| [0.0, 2.0, 12.0].map(|corner| (p, corner))) {
        let what = format!("{} r {corner}", place.name);
        let cutter = RoundDisc::of_cutter(radius, corner);
        let body = Solid::Frustum(Cutter::new(radius, corner, 30.0).unwrap().lower_test_body(0.0));
        let onset_of = |disc: RoundDisc, lift: f64| {
            onset(0.02, steepest, &|tilt| disc.gap(&place.touch.pose(&cutter, tilt, lift), distance) >= 0.0)
        };
        // The contact itself is lifted out of rounding's reach.
        let exact = onset_of(cutter, 1e-10);
        if let Some(closed) = (place.closed_form)(cutter.rim, corner) {
            assert!((exact - closed).abs() < 1e-9, "{what}: {exact} for {closed}");
        }
        let mut errors = Vec::new();
        let mut widths = Vec::new();
        for (tree, resolution) in trees.iter().zip(resolutions) {
            let e = chord(shape, resolution);
            let lift = e + 1e-10;
            let is_free = |tilt: f64| tree.verdict(&body, &place.touch.pose(&cutter, tilt, lift), None).is_free();
            let found = onset(0.02, steepest, &is_free);
            let (lowest, highest) = (onset_of(cutter.eroded(e), lift), onset_of(cutter.dilated(e), lift));
            assert!(lowest < exact && exact < highest, "{what}: {exact} not in {lowest}..{highest}");
            assert!(lowest <= found && found <= highest, "{what}: {found} not in {lowest}..{highest}");
            // The onset is the only one.
            for k in 0..40 {
                let share = f64::from(k) / 40.0;
                assert!(!is_free(0.02 + share * (lowest - 0.02)), "{what}: free at {share} of {lowest}");
                assert!(is_free(steepest + share * (highest - steepest)), "{what}: hit at {share} over {highest}");
            }
            errors.push((found - exact).abs());
            widths.push(highest - lowest);
        }
        // The facets halve each time, and the bracket around the exact onset falls with their
        // square. So does the error, by 64 in all; where the rim meets a facet is chance, which may
        // take half of that.
        assert!(widths.windows(2).all(|w| w[1] < 0.26 * w[0]) && widths[3] < 1e-3, "{what}: {widths:?}");
        assert!(errors[3] < errors[0] / 32.0, "{what}: {errors:?}");
    }
    check_balls(&trees[3], chord(shape, resolutions[3]), places);
}

/// A ball has no rim behind the contact: below the concave radius it is free at every tilt, far
/// above it at none.
fn check_balls(tree: &MeshTree, e: f64, places: &[ConcavePlace]) {
    for place in places {
        for (radius, expected) in [(25.0, true), (50.0, true), (90.0, false)] {
            let cutter = RoundDisc::of_cutter(radius, radius);
            let body = Solid::Frustum(Cutter::new(radius, radius, radius).unwrap().lower_test_body(0.0));
            for tilt in [0.0, 0.1, 0.3, 0.8] {
                let verdict = tree.verdict(&body, &place.touch.pose(&cutter, tilt, e + 1e-10), None);
                assert_eq!(verdict.is_free(), expected, "{}: ball of {radius} at {tilt}", place.name);
            }
        }
    }
}

#[test]
fn rear_gouge_in_the_hole_of_a_torus_begins_at_the_exact_tilt() {
    let pi = std::f64::consts::PI;
    let places = [on_torus("narrowest", 1.0, pi, in_the_hole), on_torus("flank", 2.3, 0.8 * pi, |_, _| None)];
    check_onsets(TORUS, [40, 80, 160, 320], &places, &|p| torus_distance(p, MAJOR, MINOR));
}

#[test]
fn rear_gouge_in_a_saddle_begins_at_the_exact_tilt() {
    let places = [on_saddle("origin", [0.0; 2], 0.0, in_the_valley), on_saddle("askew", [7.0, -5.0], 0.4, |_, _| None)];
    check_onsets(SADDLE, [25, 50, 100, 200], &places, &|p| saddle_distance(p, CONCAVE, CONVEX));
}

#[test]
fn a_spike_under_the_disc_is_found_and_the_nodes_of_a_grid_miss_it() {
    let mill = Cutter::new(25.0, 2.0, 40.0).unwrap();
    let mut random = Random(8);
    let n = 100;
    let mut n_missed = 0;
    for _ in 0..n {
        let [x, y] = [0; 2].map(|_| random.between(-12.0, 12.0));
        let corner = |x, y| Point3::new(x, y, 0.0);
        let mut vertices = vec![corner(-60.0, -60.0), corner(60.0, -60.0), corner(60.0, 60.0), corner(-60.0, 60.0)];
        vertices.extend([corner(x, y), corner(x + 0.01, y), corner(x, y + 0.01), Point3::new(x, y, 0.11)]);
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 7], [5, 6, 7], [6, 4, 7]];
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let body = Solid::Frustum(mill.lower_test_body(0.0));
        let verdict = MeshTree::new(&mesh).verdict(&body, &Isometry3::translation(0.0, 0.0, 0.1), None);
        assert!(matches!(verdict, Verdict::Hit(w) if w.triangle >= 2), "missed at {x} {y}: {verdict:?}");
        let map = ZMap::build(&mesh, &Isometry3::identity(), &ZMapSettings { cell: 0.5, margin: 0.0 }).unwrap();
        let [nx, ny] = map.n_cells();
        let nodes = (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i, j)));
        let highest = nodes.filter_map(|(i, j)| map.node_height(i, j)).fold(f64::NEG_INFINITY, f64::max);
        n_missed += usize::from(highest < 1e-3);
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
    let ball = Solid::Frustum(Cutter::new(3.0, 3.0, 20.0).unwrap().lower_test_body(0.0));
    let is_free = |x: f64| tree.verdict(&ball, &Isometry3::translation(x, 0.0, 0.001), None).is_free();
    assert!(is_free(-2.0) && is_free(2.0) && !is_free(0.0));
}
