//! Floors of cutting length against closed forms, on meshes of plain shapes, with the samples and
//! the nearest cuts that reports use.

use std::f64::consts::{PI, TAU};

use facemill::cc_path::RequestedRegion;
use facemill::cc_path::strategies::Region;
use facemill::cl_data::{CcPoint, Posture};
use facemill::cutter_location::cusp::cut_point::CutPoint;
use facemill::cutter_location::cusp::strips::{LengthFloors, NearestCuts, StripWidths};
use facemill::surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill::tool_model::Cutter;
use facemill_test_kit::{Mesh, grid_around, grid_by_rows};
use nalgebra::{Point3, Vector3};

/// A shape as its normal and points of passes see it.
struct Shape {
    mesh: Mesh,
    /// Passes as points with normals.
    passes: Vec<Vec<(Point3<f64>, Vector3<f64>)>>,
}

fn cut(pass: &[(Point3<f64>, Vector3<f64>)], posture: Posture) -> Vec<CutPoint> {
    let last = pass.len() - 1;
    let feed = |k: usize| pass[(k + 1).min(last)].0 - pass[k.saturating_sub(1)].0;
    let point = |k: usize| CutPoint { cc: CcPoint::new(pass[k].0, pass[k].1, feed(k)).unwrap(), posture };
    (0..pass.len()).map(point).collect()
}

/// Floors by samples of the region, as a report has them.
fn floors(shape: &Shape, cutter: &Cutter, posture: Posture, limits: (f64, f64)) -> LengthFloors {
    let (vertices, triangles) = shape.mesh.clone();
    let surface = Surface::new(TriMesh::new(vertices, triangles).unwrap(), SurfaceSettings::default());
    let nearest = NearestCuts::new(shape.passes.iter().map(|pass| cut(pass, posture)).collect());
    let region = Region::default();
    let requested = RequestedRegion::new(&surface, &region, None).unwrap();
    let mut floors = LengthFloors::default();
    for sample in requested.samples(requested.facet_area() / 12_000.0) {
        let foot = surface.closest_point(&sample.position, 1e-3).unwrap();
        let (normal, curvature) = (surface.normal_at(&foot), surface.curvature_at(&foot));
        let beside = nearest.nearest(&sample.position, &normal).unwrap();
        let cc = CcPoint::new(sample.position, normal.into_inner(), beside.cc.feed.into_inner()).unwrap();
        let at = CutPoint { cc, posture: beside.posture };
        floors.add(sample.area, &StripWidths::at(cutter, &at, curvature.as_ref(), limits));
    }
    floors
}

/// The same by facets and the second-order formula, without samples, outlines or nearest cuts:
/// `widths` gives both widths at the middle of a facet with this normal.
fn by_facets(mesh: &Mesh, widths: impl Fn(&Point3<f64>, &Vector3<f64>) -> [f64; 2]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for t in &mesh.1 {
        let [a, b, c] = t.map(|v| mesh.0[v as usize]);
        let normal = (b - a).cross(&(c - a));
        if normal.norm() > 0.0 {
            let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let w = widths(&middle, &normal.normalize());
            (0..2).for_each(|k| sums[k] += 0.5 * normal.norm() / w[k]);
        }
    }
    sums
}

fn second_order(cusp: f64, bend: f64) -> f64 {
    (8.0 * cusp / bend).sqrt()
}

fn assert_near(found: f64, exact: f64, share: f64) {
    assert!((found / exact - 1.0).abs() < share, "{found} for {exact}");
}

fn cylinder(radius: f64, length: f64, along_axis: bool) -> Shape {
    let at = |turn: f64, z: f64| {
        let out = Vector3::new(turn.cos(), turn.sin(), 0.0);
        (Point3::new(radius * out.x, radius * out.y, z), out)
    };
    let mesh = grid_around([20, 120], |i, j| at(-TAU * f64::from(j) / 120.0, length * f64::from(i) / 20.0).0);
    let line = |k: u32| (0..=20).map(|i| at(TAU * f64::from(k) / 19.0, length * f64::from(i) / 20.0)).collect();
    let ring = |k: u32| (0..=120).map(|j| at(TAU * f64::from(j) / 120.0, length * f64::from(k) / 7.0)).collect();
    Shape { mesh, passes: if along_axis { (0..19).map(line).collect() } else { (0..8).map(ring).collect() } }
}

#[test]
fn floor_of_the_published_cylinder_is_that_of_rings_and_no_less_along_the_axis() {
    // Zou, Wang, Feng 2020: R 2.5, L 10, ball of radius 5, cusp 0.05: floor 111.07 mm.
    let (radius, length, r, cusp) = (2.5, 10.0, 5.0, 0.05);
    let ball = Cutter::new(r, r, 20.0).unwrap();
    let posture = Posture::default();
    let area = TAU * radius * length;
    let rings = floors(&cylinder(radius, length, false), &ball, posture, (cusp, 10.0));
    assert_near(rings.as_cut, 111.07, 0.01);
    assert_near(rings.least, 111.07, 0.01);
    let lines = floors(&cylinder(radius, length, true), &ball, posture, (cusp, 10.0));
    assert_near(lines.least, 111.07, 0.01);
    assert_near(lines.area, area, 0.005);
    // Along the axis: two balls around a circle, their ridge on R + h.
    let (far, near) = (radius + r, radius + cusp);
    let half = ((far * far + near * near - r * r) / (2.0 * far * near)).acos();
    assert_near(lines.as_cut, area / (2.0 * half * radius), 0.01);
    // The second integration: facets. Across the axis the cusp is a fiftieth of the radius, and the
    // second order alone is off by a hundredth.
    let widths = |_: &Point3<f64>, _: &Vector3<f64>| [2.0 * half * radius, second_order(cusp, 1.0 / r)];
    let [as_cut, least] = by_facets(&cylinder(radius, length, true).mesh, widths);
    assert_near(lines.as_cut, as_cut, 0.01);
    assert_near(lines.least, least, 0.01);
}

#[test]
fn floor_of_a_plane_is_area_over_the_width_of_the_ellipse() {
    let (width, height, cusp) = (120.0, 80.0, 0.1);
    let place = |x: f64, y: f64| (Point3::new(x, y, 0.0), Vector3::z());
    let mesh = grid_by_rows([12, 8], |i, j| place(10.0 * f64::from(i), 10.0 * f64::from(j)).0);
    let pass = |k: u32| (0..=12).map(|i| place(10.0 * f64::from(i), 20.0 * f64::from(k))).collect();
    let shape = Shape { mesh, passes: (0..5).map(pass).collect() };
    let disc = Cutter::new(40.0, 0.0, 10.0).unwrap();
    for (tilt, rotate) in [(3.0f64, 0.0f64), (5.0, 40.0)] {
        let posture = Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() };
        let found = floors(&shape, &disc, posture, (cusp, 80.0));
        // The rim is an ellipse across the feed, as wide as the disc where it leans along it.
        let cos = 1.0 - cusp / (40.0 * posture.tilt.sin());
        assert_near(found.least, width * height / (80.0 * (1.0 - cos * cos).sqrt()), 0.01);
        assert_near(found.area, width * height, 0.005);
        if rotate == 0.0 {
            assert_near(found.as_cut, found.least, 1e-6);
        } else {
            assert!(found.as_cut > 1.2 * found.least, "{found:?}");
        }
    }
    // At most the largest step.
    let capped = floors(&shape, &disc, Posture::default(), (cusp, 12.0));
    assert_near(capped.as_cut, width * height / 12.0, 0.005);
}

#[test]
fn floor_of_a_zone_of_a_sphere_is_the_closed_form_in_all_directions() {
    let (radius, r, cusp) = (30.0, 4.0, 0.02);
    let at = |turn: f64, up: f64| {
        let normal = Vector3::new(turn.cos() * up.cos(), turn.sin() * up.cos(), up.sin());
        (Point3::from(normal * radius), normal)
    };
    let up = |i: u32, n: u32| (-0.6) + 1.2 * f64::from(i) / f64::from(n);
    let mesh = grid_around([60, 160], |i, j| at(-TAU * f64::from(j) / 160.0, up(i, 60)).0);
    let ring = |k: u32| (0..=160).map(|j| at(TAU * f64::from(j) / 160.0, up(k, 30))).collect();
    let shape = Shape { mesh, passes: (0..=30).map(ring).collect() };
    let ball = Cutter::new(r, r, 20.0).unwrap();
    let found = floors(&shape, &ball, Posture { tilt: 0.3, rotate: 0.4 }, (cusp, 8.0));
    let (far, near) = (radius + r, radius + cusp);
    let strip = 2.0 * radius * ((far * far + near * near - r * r) / (2.0 * far * near)).acos();
    let area = 2.0 * PI * radius * radius * 2.0 * 0.6f64.sin();
    assert_near(found.area, area, 0.005);
    assert_near(found.as_cut, area / strip, 0.01);
    assert_near(found.least, area / strip, 0.01);
    let [second, _] = by_facets(&shape.mesh, |_, _| [second_order(cusp, 1.0 / r + 1.0 / radius); 2]);
    assert_near(found.as_cut, second, 0.01);
}
