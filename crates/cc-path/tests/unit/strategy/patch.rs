use crate::left_region::{LeftRegion, StockHeight};
use crate::sections::{CylindricalSections, ParallelPlanes};
use crate::strategy::patch::*;
use crate::test_kit::{plane, sphere_patch, surface};

const COARSE: Fineness = Fineness { max_edge: f64::INFINITY, max_bend: f64::INFINITY, cuts_range: false };

fn along_x() -> Sections {
    let normal = Vector3::y_axis();
    Sections::ParallelPlanes(ParallelPlanes { origin: Point3::origin(), normal, from: None, to: None })
}

fn area(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles().len()).map(|t| 0.5 * mesh.scaled_normal(t).norm()).sum()
}

fn open_edges(patch: &Patch) -> usize {
    (0..patch.edges.len() as u32).filter(|&e| patch.edges.sides(e).len() == 1).count()
}

#[test]
fn a_box_cuts_a_plane_to_the_rectangle_inside() {
    let s = surface(plane(100.0, 80.0, 7, 5));
    let bounds = Aabb { min: Point3::new(12.3, 20.0, -1.0), max: Point3::new(60.1, 200.0, 1.0) };
    let region = Region { bounds: Some(bounds), ..Region::default() };
    let patch = Patch::new(&s, &region, Some(&along_x()), &COARSE).unwrap();
    assert!((area(&patch.mesh) - (60.1 - 12.3) * 60.0).abs() < 1e-9);
    let used = patch.mesh.aabb();
    assert!((used.min - Point3::new(12.3, 20.0, 0.0)).norm() < 1e-12);
    assert!((used.max - Point3::new(60.1, 80.0, 0.0)).norm() < 1e-12);
}

#[test]
fn cutting_up_keeps_area_and_border_and_leaves_no_long_edge() {
    let s = surface(sphere_patch(50.0, 0.7, 3));
    let whole = Patch::new(&s, &Region::default(), Some(&along_x()), &COARSE).unwrap();
    let fineness = Fineness { max_edge: 3.0, ..COARSE };
    let fine = Patch::new(&s, &Region::default(), Some(&along_x()), &fineness).unwrap();
    assert!((area(&whole.mesh) - area(&fine.mesh)).abs() < 1e-9);
    // Every edge inside still has two sides: the border alone is open, and only as long as before.
    let border = |p: &Patch| -> f64 {
        (0..p.edges.len() as u32)
            .filter(|&e| p.edges.sides(e).len() == 1)
            .map(|e| p.edges.vertices(e).map(|v| p.mesh.vertices()[v as usize]))
            .map(|[a, b]| (a - b).norm())
            .sum()
    };
    assert!(open_edges(&fine) > open_edges(&whole));
    assert!((border(&whole) - border(&fine)).abs() < 1e-9);
    for e in 0..fine.edges.len() as u32 {
        let [a, b] = fine.edges.vertices(e).map(|v| fine.mesh.vertices()[v as usize]);
        assert!((a - b).norm() <= 3.0);
    }
}

#[test]
fn levels_of_cylinders_are_linear_on_every_edge_of_a_cut_up_plane() {
    let s = surface(plane(100.0, 80.0, 1, 1));
    let axis_direction = Vector3::z_axis();
    let axis_origin = Point3::new(-30.0, 40.0, 0.0);
    let sections = CylindricalSections { axis_origin, axis_direction, from_radius: 35.0, to_radius: 100.0 };
    let strategy = Sections::CylindricalSections(sections);
    let fineness = Fineness { max_edge: f64::INFINITY, max_bend: 1e-3, cuts_range: false };
    let patch = Patch::new(&s, &Region::default(), Some(&strategy), &fineness).unwrap();
    for e in 0..patch.edges.len() as u32 {
        let [a, b] = patch.edges.vertices(e).map(|v| patch.mesh.vertices()[v as usize]);
        let mean = 0.5 * (strategy.level(&a) + strategy.level(&b));
        assert!((strategy.level(&nalgebra::center(&a, &b)) - mean).abs() <= 1e-3);
    }
}

#[test]
fn weights_give_the_point_back() {
    let mut rng = crate::test_kit::Random(5);
    for _ in 0..200 {
        let t = [rng.point(10.0), rng.point(10.0), rng.point(10.0)];
        let (u, v) = (rng.unit(), rng.unit());
        let [x, y, z] = [1.0 - u, u * (1.0 - v), u * v];
        let p = Point3::from(t[0].coords * x + t[1].coords * y + t[2].coords * z);
        let [a, b, c] = barycentric(&p, &t);
        assert!((a - x).abs() + (b - y).abs() + (c - z).abs() < 1e-9);
    }
}

#[test]
fn a_border_of_what_is_left_that_would_take_too_many_triangles_is_refused() {
    let s = surface(plane(100.0, 80.0, 1, 1));
    let place = |k: i32| {
        let position = Point3::new(f64::from(k % 25) * 4.0, f64::from(k / 25) * 4.0, 0.0);
        StockHeight { position, normal: Vector3::z_axis(), height: 1.0, reach: 0.1, area: 1.0 }
    };
    let left = LeftRegion::new(&(0..500).map(place).collect::<Vec<_>>(), 0.15, 0.4);
    let mut cut = Pieces::of(&s, &[0, 1]);
    let refused = cut.keep_left(&s, &left, 5_000).unwrap_err().to_string();
    assert!(refused.contains("left_above.overlap_mm is 0.4"), "{refused}");
    let mut cut = Pieces::of(&s, &[0, 1]);
    cut.keep_left(&s, &left, 500_000).unwrap();
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| cut.vertices[v as usize]);
        0.5 * (b - a).cross(&(c - a)).norm()
    };
    // Discs of 0.5 mm, those on the border of the plate in part.
    let area: f64 = cut.triangles.iter().map(area).sum();
    let discs = (24.0 * 19.0 + 0.5 * (2.0 * 19.0 + 24.0) + 0.25 * 2.0) * std::f64::consts::PI * 0.25;
    assert!((area / discs - 1.0).abs() < 0.03, "{area} of {discs}");
}
