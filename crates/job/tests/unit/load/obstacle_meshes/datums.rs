use std::f64::consts::TAU;

use nalgebra::{Translation3, UnitQuaternion};

use super::*;

/// Mesh of quads, each wound as its corners are given.
fn of_quads(quads: &[[Point3<f64>; 4]]) -> TriMesh {
    let vertices = quads.iter().flatten().copied().collect();
    let first = |k: usize| 4 * k as u32;
    let triangles =
        (0..quads.len()).flat_map(|k| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|v| first(k) + v))).collect();
    TriMesh::new(vertices, triangles).unwrap()
}

/// Wall of a bore about z, seen from its axis, from one angle to another.
fn wall(radius: f64, heights: [f64; 2], angles: [f64; 2]) -> TriMesh {
    let n = 24;
    let at = |k: usize, z: f64| {
        let (sin, cos) = (angles[0] + (angles[1] - angles[0]) * k as f64 / n as f64).sin_cos();
        Point3::new(radius * cos, radius * sin, z)
    };
    let [low, high] = heights;
    let quads: Vec<[Point3<f64>; 4]> =
        (0..n).map(|k| [at(k + 1, low), at(k, low), at(k, high), at(k + 1, high)]).collect();
    of_quads(&quads)
}

fn of_all(mesh: &TriMesh) -> Datum {
    datum("part.obj", "bore", mesh, &(0..mesh.triangles().len()).collect::<Vec<usize>>())
}

fn pose() -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(30.0, -20.0, 100.0),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.2)),
    )
}

#[test]
fn a_bore_is_a_cylinder_about_its_axis_wherever_it_lies() {
    // All of it, and a third: its corners are on it, however few.
    for angles in [[0.0, TAU], [0.4, 0.4 + TAU / 3.0]] {
        let found = of_all(&wall(45.0, [-70.0, 30.0], angles).transformed(&pose()));
        let axis = pose() * Vector3::z();
        let DatumShape::Cylinder { axis: found_axis, radius } = found.shape else { panic!("{found:?}") };
        assert!((radius - 45.0).abs() < 1e-9 && found.deviation < 1e-9, "{found:?}");
        assert!((found_axis.into_inner() - axis).norm() < 1e-9, "{found:?}");
        // In the middle of its length, on the axis.
        assert!((found.place - pose() * Point3::new(0.0, 0.0, -20.0)).norm() < 1e-6, "{found:?}");
    }
}

#[test]
fn a_face_is_a_plane_that_faces_out_and_moves_with_the_part() {
    let p = |x: f64, y: f64| Point3::new(x, y, 5.0);
    let face = of_quads(&[[p(0.0, 0.0), p(8.0, 0.0), p(8.0, 4.0), p(0.0, 4.0)]]);
    let found = of_all(&face).moved(&pose());
    let DatumShape::Plane(normal) = found.shape else { panic!("{found:?}") };
    assert!((normal.into_inner() - pose() * Vector3::z()).norm() < 1e-12);
    assert!((found.place - pose() * p(4.0, 2.0)).norm() < 1e-12 && found.deviation < 1e-12);
    // It is the same as of the mesh where it is.
    let there = of_all(&face.transformed(&pose()));
    assert!((there.place - found.place).norm() < 1e-12);
}

#[test]
fn a_group_of_two_faces_has_two_planes() {
    let face = |z: f64, up: bool| {
        let p = |x: f64, y: f64| Point3::new(x, y, z);
        let quad = [p(0.0, 0.0), p(8.0, 0.0), p(8.0, 4.0), p(0.0, 4.0)];
        of_quads(&[if up { quad } else { [quad[0], quad[3], quad[2], quad[1]] }])
    };
    let found = pieces("part.obj", "faces", &face(5.0, true).joined(&face(-3.0, false)));
    let sides: Vec<(f64, DatumShape)> = found.iter().map(|datum| (datum.place.z, datum.shape)).collect();
    let plane = |z: f64| DatumShape::Plane(Unit::new_normalize(Vector3::new(0.0, 0.0, z)));
    assert_eq!(sides, [(5.0, plane(1.0)), (-3.0, plane(-1.0))]);
}

#[test]
fn a_cone_and_an_oval_are_other_surfaces() {
    let bore = wall(45.0, [-70.0, 30.0], [0.0, TAU]);
    for form in [
        |p: &Point3<f64>| Point3::new(p.x * (1.0 + p.z / 500.0), p.y * (1.0 + p.z / 500.0), p.z),
        |p: &Point3<f64>| Point3::new(1.1 * p.x, p.y, p.z),
        // Six sides, whose corners are on a circle.
        |p: &Point3<f64>| {
            let side = std::f64::consts::TAU / 6.0;
            let (sin, cos) = ((p.y.atan2(p.x) / side).round() * side).sin_cos();
            Point3::new(45.0 * cos, 45.0 * sin, p.z)
        },
    ] {
        let mesh = TriMesh::new(bore.vertices().iter().map(form).collect(), bore.triangles().to_vec()).unwrap();
        let found = of_all(&mesh);
        assert_eq!((found.shape, found.deviation), (DatumShape::Other, 0.0), "{found:?}");
    }
}
