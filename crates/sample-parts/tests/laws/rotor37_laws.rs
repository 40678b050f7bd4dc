//! Laws of the blade of NASA Rotor 37.

use crate::kit;
use facemill_sample_parts::{RotorResolution, rotor37};
use nalgebra::{Point3, Vector3};

fn resolution(n_span: usize, n_between: usize) -> RotorResolution {
    RotorResolution::new(n_span, n_between).expect("in range")
}

/// Rows of the table: Z cm, R cm, θ of both sides.
const ROWS: [[f64; 4]; 4] = [
    [0.0281091, 17.7903728, -0.1165276, -0.1165276],
    [0.0964298, 17.8036613, -0.1094812, -0.1160503],
    [0.9130274, 18.0020809, -0.0410417, -0.0694808],
    [3.4154623, 24.4678631, 0.0951579, 0.0951579],
];

fn table_point([z, r, ..]: [f64; 4], theta: f64) -> Point3<f64> {
    Point3::new(10.0 * r * theta.cos(), 10.0 * r * theta.sin(), 10.0 * z)
}

#[test]
fn the_blade_is_closed_and_wound_outward() {
    for resolution in [resolution(2, 1), RotorResolution::default(), resolution(30, 3)] {
        let mesh = rotor37(resolution);
        assert!(kit::is_closed(&mesh));
        // The flat facets of the reference mesh enclose 7,916.0 mm³.
        let volume = kit::volume(&mesh);
        assert!((volume / 7_916.0 - 1.0).abs() < 0.01, "{resolution:?}: {volume} mm³");
        assert_eq!(mesh, rotor37(resolution), "the same each time");
    }
    assert_eq!(kit::self_intersections(&rotor37(resolution(12, 1))), []);
    assert!(RotorResolution::new(1, 1).is_err() && RotorResolution::new(10, 0).is_err());
}

#[test]
fn table_points_of_the_outer_surfaces_are_vertices() {
    for mesh in [rotor37(RotorResolution::default()), rotor37(resolution(5, 4))] {
        for row in ROWS {
            for theta in [row[2], row[3]] {
                let point = table_point(row, theta);
                assert!(mesh.vertices().iter().any(|v| (v - point).norm() < 1e-5), "{point}");
            }
        }
    }
}

#[test]
fn the_suction_side_is_convex_and_faces_the_angle() {
    let mesh = rotor37(RotorResolution::default());
    let around = |name| -> f64 {
        let facing = |t| {
            let [a, ..] = mesh.corners(t);
            Vector3::z().cross(&a.coords).normalize().dot(&mesh.scaled_normal(t))
        };
        kit::group(&mesh, name).map(facing).sum()
    };
    assert!(around("suction") > 0.0 && around("pressure") < 0.0);
    // Convex: the longer way from the leading to the trailing edge, on the section at the hub.
    let length = |side: usize| {
        let points: Vec<_> = hub_section(&mesh, side);
        points.windows(2).map(|p| (p[1] - p[0]).norm()).sum::<f64>()
    };
    assert!(length(0) > length(1));
}

/// The hub's section of a side: the first row of its vertices by the order of the mesh, from its
/// two sheets.
fn hub_section(mesh: &facemill_surface_model::TriMesh, side: usize) -> Vec<Point3<f64>> {
    // The first row holds 198 vertices: trailing edge, suction side, leading edge (99), pressure
    // side.
    let row = &mesh.vertices()[..198];
    if side == 0 { row[..=99].to_vec() } else { row[99..].iter().chain(&row[..1]).copied().collect() }
}

#[test]
fn sides_are_smooth_between_the_surfaces_of_the_table() {
    let bends = [20, 40, 80].map(|n| {
        let mesh = rotor37(resolution(n, n / 20));
        ["suction", "pressure"]
            .map(|name| kit::largest_bend(&mesh, kit::group(&mesh, name)))
            .into_iter()
            .fold(0.0, f64::max)
    });
    println!("largest bends {:?}", bends.map(f64::to_degrees));
    assert!(bends[1] < 0.75 * bends[0] && bends[2] < 0.75 * bends[1], "{bends:?}");
}

/// A blade that joins the same table points by flat facets, axis X: its vertices are table points,
/// so they are on ours to within the facets and the single precision of the file.
#[test]
fn the_reference_mesh_has_its_vertices_on_the_blade() {
    let Some(path) = kit::shared("data/meshes/nasa_rotor37_blade.stl") else { return };
    let mesh = rotor37(resolution(48, 2));
    let triangles = kit::read_stl(&path);
    let [their_volume, volume] = [&kit::welded(&triangles), &mesh].map(kit::volume);
    println!("volume {volume:.1} mm³, theirs {their_volume:.1} mm³");
    assert!((volume / their_volume - 1.0).abs() < 5e-3);
    let mut vertices: Vec<_> = triangles.into_iter().flatten().collect();
    vertices.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    vertices.dedup();
    // Their X is the axis in the direction of flow, and their angle runs from Y to Z.
    let triangles = kit::TriangleRuns::of(&mesh);
    let worst = vertices.iter().map(|p| triangles.distance(&Point3::new(p.y, p.z, p.x))).fold(0.0, f64::max);
    println!("{} vertices, largest deviation {worst:.4} mm", vertices.len());
    assert!(vertices.len() > 1000 && worst < 0.02, "{worst}");
}
