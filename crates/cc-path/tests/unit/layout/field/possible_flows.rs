use std::f64::consts::PI;

use facemill_cl_data::Aabb;
use facemill_surface_model::{Group, TriMesh};

use super::*;
use crate::strategy::field_file::FlowPlaneFile;
use crate::test_kit::{grid, surface};

/// A mesh of these parts, each a group; vertices at the same place are one.
fn grouped(parts: &[(&str, TriMesh)]) -> Surface {
    let (mut vertices, mut triangles, mut groups) = (Vec::<Point3<f64>>::new(), Vec::new(), Vec::new());
    for (name, mesh) in parts {
        let first = triangles.len();
        for t in mesh.triangles() {
            triangles.push(t.map(|v| {
                let p = mesh.vertices()[v as usize];
                vertices.iter().position(|q| (q - p).norm() < 1e-9).unwrap_or_else(|| {
                    vertices.push(p);
                    vertices.len() - 1
                }) as u32
            }));
        }
        groups.push(Group { name: (*name).to_owned(), triangles: first..triangles.len() });
    }
    surface(TriMesh::with_groups(vertices, triangles, groups).unwrap())
}

fn group(name: &str) -> FlowEndFile {
    FlowEndFile::Group(name.to_owned())
}

fn names(found: &[PossibleFlow]) -> Vec<[String; 2]> {
    let name = |end: &FlowEndFile| match end {
        FlowEndFile::Group(name) => name.clone(),
        _ => "section".to_owned(),
    };
    found.iter().map(|f| [name(&f.flow.from), name(&f.flow.to)]).collect()
}

/// A strip from `x` to `x + dx` and `y` to `y + dy`.
fn strip([x, y]: [f64; 2], [dx, dy]: [f64; 2], [n, m]: [u32; 2]) -> TriMesh {
    grid(n, m, |u, v| Point3::new(x + dx * u, y + dy * v, 0.0))
}

#[test]
fn opposite_sides_of_a_rectangle_bound_flows_and_neighbours_do_not() {
    let s = grouped(&[
        ("face", strip([0.0, 0.0], [80.0, 30.0], [8, 3])),
        ("left", strip([-10.0, 0.0], [10.0, 30.0], [1, 3])),
        ("right", strip([80.0, 0.0], [10.0, 30.0], [1, 3])),
        ("front", strip([0.0, -10.0], [80.0, 10.0], [8, 1])),
        ("back", strip([0.0, 30.0], [80.0, 10.0], [8, 1])),
        ("far", strip([200.0, 0.0], [10.0, 10.0], [1, 1])),
    ]);
    let region = Region { groups: Some(vec!["face".to_owned()]), ..Region::default() };
    let ends = ["left", "right", "front", "back", "far"].map(group);
    let found = possible_flows(&s, &region, &ends).unwrap();
    assert_eq!(names(&found), [["front", "back"], ["left", "right"]]);
    for (flow, (way, length)) in
        found.iter().zip([(Vector3::new(0.0, 30.0, 0.0), 160.0), (Vector3::new(80.0, 0.0, 0.0), 60.0)])
    {
        assert!((flow.way - way).norm() < 1e-9 && (flow.length - length).abs() < 1e-9 && !flow.is_closed, "{flow:?}");
    }
    assert!(possible_flows(&s, &region, &[group("none")]).is_err());
    // Half of the face has the section as a border, too.
    let plane = |x: f64| FlowPlaneFile { origin_mm: [x, 0.0, 0.0], normal: [1.0, 0.0, 0.0] };
    let half = Aabb { min: Point3::new(-1.0, -1.0, -1.0), max: Point3::new(44.0, 50.0, 1.0) };
    let region = Region { bounds: Some(half), ..region };
    let ends = [group("left"), group("right"), FlowEndFile::Plane(plane(44.0)), FlowEndFile::Plane(plane(60.0))];
    assert_eq!(names(&possible_flows(&s, &region, &ends).unwrap()), [["left", "section"]]);
}

#[test]
fn a_tube_between_two_rings_can_be_wound_and_one_with_a_slot_cannot() {
    let ring = |z: f64, dz: f64, around: f64| {
        grid(24, 2, move |u, v| {
            let (sin, cos) = (2.0 * PI * around * u).sin_cos();
            Point3::new(20.0 * cos, 20.0 * sin, z + dz * v)
        })
    };
    for (around, is_closed) in [(1.0, true), (0.75, false)] {
        let s = grouped(&[
            ("low", ring(-5.0, 5.0, around)),
            ("wall", ring(0.0, 40.0, around)),
            ("high", ring(40.0, 5.0, around)),
        ]);
        let region = Region { groups: Some(vec!["wall".to_owned()]), ..Region::default() };
        let found = possible_flows(&s, &region, &["low", "high"].map(group)).unwrap();
        assert_eq!(names(&found), [["low", "high"]]);
        assert_eq!(found[0].is_closed, is_closed);
        assert!((found[0].way - Vector3::new(0.0, 0.0, 40.0)).norm() < 1e-9);
    }
}

#[test]
fn a_region_with_a_part_beside_the_ends_has_no_flow() {
    let s = grouped(&[
        ("face", strip([0.0, 0.0], [80.0, 30.0], [8, 3])),
        ("left", strip([-10.0, 0.0], [10.0, 30.0], [1, 3])),
        ("right", strip([80.0, 0.0], [10.0, 30.0], [1, 3])),
        ("island", strip([0.0, 90.0], [80.0, 30.0], [8, 3])),
    ]);
    let ends = ["left", "right"].map(group);
    for (groups, n) in [(vec!["face"], 1), (vec!["face", "island"], 0)] {
        let groups = groups.into_iter().map(str::to_owned).collect();
        let region = Region { groups: Some(groups), ..Region::default() };
        assert_eq!(possible_flows(&s, &region, &ends).unwrap().len(), n);
    }
}

#[test]
fn an_end_of_two_lines_bounds_a_flow_that_cannot_be_wound() {
    // A plate with a round border outside and two holes, both beside one group.
    let hole = |x: f64, y: f64| [-12.0f64, 12.0].into_iter().any(|c| (x - c).abs() < 5.0 && y.abs() < 5.0);
    let plate = |keep: &dyn Fn(f64, f64) -> bool| {
        let whole = strip([-30.0, -20.0], [60.0, 40.0], [60, 40]);
        let middle =
            |t: &[u32; 3]| t.iter().fold(Vector3::zeros(), |s, &v| s + whole.vertices()[v as usize].coords) / 3.0;
        let kept = whole.triangles().iter().filter(|t| keep(middle(t).x, middle(t).y)).copied().collect();
        TriMesh::new(whole.vertices().to_vec(), kept).unwrap()
    };
    let around = [
        strip([-40.0, -30.0], [80.0, 10.0], [80, 1]),
        strip([-40.0, 20.0], [80.0, 10.0], [80, 1]),
        strip([-40.0, -20.0], [10.0, 40.0], [1, 40]),
        strip([30.0, -20.0], [10.0, 40.0], [1, 40]),
    ];
    for (holes, is_closed) in [(2, false), (1, true)] {
        let is_hole = |x: f64, y: f64| hole(x, y) && (holes == 2 || x < 0.0);
        let mut parts = vec![("face", plate(&|x, y| !is_hole(x, y))), ("holes", plate(&is_hole))];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for mesh in &around {
            let n = vertices.len() as u32;
            vertices.extend_from_slice(mesh.vertices());
            triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + n)));
        }
        parts.push(("around", TriMesh::new(vertices, triangles).unwrap()));
        let region = Region { groups: Some(vec!["face".to_owned()]), ..Region::default() };
        let found = possible_flows(&grouped(&parts), &region, &["around", "holes"].map(group)).unwrap();
        assert_eq!(names(&found), [["around", "holes"]]);
        assert_eq!(found[0].is_closed, is_closed, "{holes} holes");
    }
}
