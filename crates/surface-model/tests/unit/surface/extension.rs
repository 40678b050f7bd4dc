use nalgebra::{Isometry3, Point3, Vector3};

use crate::mesh::tri_mesh::TriMesh;
use crate::surface::{Surface, SurfaceSettings};
use crate::test_kit::{Random, cuboid, grid, sphere, torus};

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

/// Triangles beyond the border, as corners.
fn beyond(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    let groups = mesh.groups().iter().filter(|g| g.name == "beyond");
    groups.flat_map(|g| g.triangles.clone()).map(|t| mesh.corners(t)).collect()
}

fn area(triangles: &[[Point3<f64>; 3]]) -> f64 {
    triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum()
}

fn rectangle() -> TriMesh {
    grid((20, 12), (false, false), |u, v| Point3::new(100.0 * u, 60.0 * v, 0.0))
}

#[test]
fn a_rectangle_gets_strips_and_round_corners() {
    let extended = surface(rectangle()).extended(|_| true, 10.0, "beyond").unwrap();
    let strips = 2.0 * 10.0 * (100.0 + 60.0);
    // Each corner is an arc of five steps of 18°.
    let arcs = 4.0 * 5.0 * 0.5 * 100.0 * 18f64.to_radians().sin();
    assert!((area(&beyond(&extended)) - strips - arcs).abs() < 1e-9);
    let (own, bounds) = (surface(extended.clone()), extended.aabb());
    assert!((bounds.min - Point3::new(-10.0, -10.0, 0.0)).norm() < 1e-12);
    assert!((bounds.max - Point3::new(110.0, 70.0, 0.0)).norm() < 1e-12);
    let up = |t: u32| (own.facet_normal(t).unwrap().into_inner() - Vector3::z()).norm() < 1e-12;
    assert!((0..extended.triangles().len() as u32).all(up));
    // One border around all of it, and every other edge between two triangles.
    assert_eq!(own.topology().components.len(), 1);
    let open = (0..own.edges().len() as u32).filter(|&e| own.edges().sides(e).len() == 1).count();
    assert!((0..own.edges().len() as u32).all(|e| own.edges().sides(e).len() <= 2));
    assert_eq!(open, 2 * (20 + 12) + 4 * 5);
}

#[test]
fn strips_of_a_cylinder_lie_in_its_tangent_planes() {
    let (radius, n) = (40.0, 64);
    let arc = move |u: f64, v: f64| {
        let angle = (60.0 * u - 30.0f64).to_radians();
        Point3::new(radius * angle.sin(), 80.0 * v, radius * angle.cos())
    };
    let extended = surface(grid((n, 8), (false, false), arc)).extended(|_| true, 12.0, "beyond").unwrap();
    let own = surface(extended.clone());
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let mut random = Random(5);
    for _ in 0..200 {
        let (y, s) = (80.0 * random.unit(), 12.0 * random.unit());
        let on_tangent = Point3::new(radius * sin + s * cos, y, radius * cos - s * sin);
        let foot = own.closest_point(&on_tangent, 1.0).unwrap();
        // The tangent at the border is that of the facet, half a facet's turn away.
        let turn = 0.5 * 60f64.to_radians() / n as f64;
        assert!(foot.distance <= s * turn + 1e-9, "{}", foot.distance);
        let normal = Vector3::new(sin, 0.0, cos);
        assert!(own.normal_at(&foot).angle(&nalgebra::Unit::new_normalize(normal)) <= 2.0 * turn);
    }
}

#[test]
fn it_moves_with_the_surface() {
    let motion = Isometry3::new(Vector3::new(3.0, -20.0, 7.0), Vector3::new(0.4, -1.1, 0.2));
    let ball = sphere(30.0, 48);
    let cap = |s: &Surface, up: Vector3<f64>| {
        s.extended(|t| s.facet_normal(t).is_some_and(|n| n.dot(&up) > 0.5), 6.0, "beyond").unwrap()
    };
    let (here, there) = (surface(ball.clone()), surface(ball.transformed(&motion)));
    let (a, b) = (cap(&here, Vector3::z()), cap(&there, motion * Vector3::z()));
    assert_eq!(a.triangles(), b.triangles());
    let apart = a.vertices().iter().zip(b.vertices()).map(|(p, q)| (motion * p - q).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{apart}");
    // Outside of the material, along the tangent cone.
    assert!(!beyond(&a).is_empty());
    for p in beyond(&a).into_iter().flatten() {
        assert!(p.coords.norm() > 30.0 * (std::f64::consts::PI / 48.0).cos() - 1e-9);
    }
}

#[test]
fn a_closed_surface_has_nothing_beyond() {
    let whole = torus(20.0, 6.0, 24);
    let extended = surface(whole.clone()).extended(|_| true, 5.0, "beyond").unwrap();
    assert_eq!(extended.triangles(), whole.triangles());
    assert!(beyond(&extended).is_empty());
}

#[test]
fn a_face_of_a_box_continues_over_all_its_edges() {
    let s = surface(cuboid(Point3::origin(), Point3::new(40.0, 30.0, 20.0)));
    let extended = s.extended(|t| s.facet_normal(t).unwrap().z > 0.5, 5.0, "beyond").unwrap();
    let arcs = 4.0 * 5.0 * 0.5 * 25.0 * 18f64.to_radians().sin();
    assert!((area(&beyond(&extended)) - 2.0 * 5.0 * 70.0 - arcs).abs() < 1e-9);
    assert!(beyond(&extended).iter().flatten().all(|p| (p.z - 20.0).abs() < 1e-12));
}

/// A floor along x that rises into a wall, by an arc of a radius or by a sharp corner.
fn floor_and_wall(radius: f64) -> Surface {
    let profile = move |u: f64| {
        if radius == 0.0 {
            return (u.min(0.5) / 0.5 * 50.0, (u - 0.5).max(0.0) / 0.5 * 40.0);
        }
        let angle = ((u - 0.4) / 0.2).clamp(0.0, 1.0) * 90f64.to_radians();
        let (x, z) = (u.min(0.4) / 0.4 * 50.0, (u - 0.6).max(0.0) / 0.4 * 40.0);
        (x + radius * angle.sin(), z + radius * (1.0 - angle.cos()))
    };
    let shape = move |u: f64, v: f64| {
        let (x, z) = profile(u);
        Point3::new(x, 60.0 * v, z)
    };
    surface(grid((50, 10), (false, false), shape))
}

#[test]
fn it_does_not_continue_into_a_fillet_or_a_wall() {
    for radius in [0.0, 8.0] {
        let s = floor_and_wall(radius);
        let is_floor = |t: u32| s.facet_normal(t).is_some_and(|n| n.z > 1.0 - 1e-9);
        let extended = s.extended(is_floor, 10.0, "beyond").unwrap();
        let far = beyond(&extended).into_iter().flatten().map(|p| p.x).fold(0.0, f64::max);
        // Round corners beside the ends of the fillet reach past its start.
        assert!(far <= 50.0 + radius + 1e-9, "radius {radius}: {far}");
        let beside = beyond(&extended).into_iter().filter(|c| c.iter().all(|p| p.y > 1.0 && p.y < 59.0));
        assert!(beside.flatten().all(|p| p.x < 1e-9), "only behind the free end");
    }
}

#[test]
fn it_ends_before_a_wall_beside_the_border() {
    // A wall 6 mm beyond the end of the floor, apart from it.
    let floor = grid((20, 10), (false, false), |u, v| Point3::new(50.0 * u, 60.0 * v, 0.0));
    let wall = cuboid(Point3::new(56.0, -20.0, -20.0), Point3::new(70.0, 80.0, 20.0));
    let s = surface(floor.joined(&wall));
    let extended = s.extended(|t| t < 400, 10.0, "beyond").unwrap();
    let far = beyond(&extended).into_iter().flatten().map(|p| p.x).fold(0.0, f64::max);
    assert!(far <= 56.0 && far > 56.0 - 10.0 / 16.0 - 1e-9, "{far}");
}

#[test]
fn it_ends_before_a_wall_beside_the_middle_of_a_long_side() {
    // Sides of two vertices each: a lug of 20 mm, and a wall thinner than a step.
    let floor = TriMesh::new(
        [[0.0, 0.0], [50.0, 0.0], [50.0, 100.0], [0.0, 100.0]].map(|[x, y]| Point3::new(x, y, 0.0)).to_vec(),
        vec![[0, 1, 2], [0, 2, 3]],
    );
    for (thickness, gap) in [(12.0, 6.0), (0.2, 7.0)] {
        let low = Point3::new(50.0 + gap, 40.0, -20.0);
        let lug = cuboid(low, Point3::new(low.x + thickness, 60.0, 20.0));
        let s = surface(floor.clone().unwrap().joined(&lug));
        let extended = s.extended(|t| t < 2, 16.0, "beyond").unwrap();
        let beside = beyond(&extended).into_iter().flatten().filter(|p| p.y > -1e-9 && p.y < 100.0 + 1e-9);
        let far = beside.map(|p| p.x).fold(0.0, f64::max);
        assert!(far <= 50.0 + gap && far > 50.0 + gap - 1.0 - 1e-9, "{far}");
    }
}

#[test]
fn it_does_not_continue_over_other_surface_in_its_plane() {
    // Two plates in one plane, 6 mm apart, of which one is kept, and one plate of two parts.
    let plate = |from: f64| grid((10, 10), (false, false), move |u, v| Point3::new(from + 40.0 * u, 60.0 * v, 0.0));
    let turned = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, 0.7, -0.2));
    for motion in [Isometry3::identity(), turned] {
        let apart = surface(plate(0.0).joined(&plate(46.0)).transformed(&motion));
        let extended = apart.extended(|t| t < 200, 18.0, "beyond").unwrap();
        let far = beyond(&extended).into_iter().flatten().map(|p| (motion.inverse() * p).x).fold(0.0, f64::max);
        assert!(far <= 46.0 && far > 44.0, "{far}");
        let joined = surface(plate(0.0).transformed(&motion));
        let first = |t: u32| (motion.inverse() * joined.mesh().corners(t as usize)[0]).x < 15.9;
        let both = joined.extended(first, 10.0, "beyond").unwrap();
        let inner = beyond(&both)
            .into_iter()
            .filter(|c| c.iter().all(|p| (motion.inverse() * p).y.clamp(1.0, 59.0) == (motion.inverse() * p).y));
        assert!(inner.flatten().all(|p| (motion.inverse() * p).x < 1e-9));
    }
}

#[test]
fn strips_beside_a_sawtooth_are_as_narrow_as_its_teeth() {
    // Diagonal cut through a grid: teeth of 2 mm.
    let s = surface(grid((20, 20), (false, false), |u, v| Point3::new(40.0 * u, 40.0 * v, 0.0)));
    let is_low = |t: u32| {
        let [a, b, c] = s.mesh().corners(t as usize);
        (a.x + b.x + c.x) + (a.y + b.y + c.y) < 3.0 * 40.0
    };
    let extended = s.extended(is_low, 18.0, "beyond").unwrap();
    for [a, b, c] in beyond(&extended) {
        assert!((b - a).cross(&(c - a)).z > -1e-9);
    }
    let along = |p: &Point3<f64>| (p.x - p.y).abs() < 30.0;
    let far = beyond(&extended).into_iter().flatten().filter(along).map(|p| (p.x + p.y - 40.0) / 2f64.sqrt());
    let far = far.fold(0.0, f64::max);
    assert!(far < 6.0, "{far}");
}

#[test]
fn strips_do_not_overlap_in_a_hollow_of_the_border() {
    // The border is a half circle of 8 mm that the patch lies around.
    let shape = |u: f64, v: f64| {
        let (sin, cos) = (std::f64::consts::PI * v).sin_cos();
        let r = 8.0 + 30.0 * u;
        Point3::new(r * cos, r * sin, 0.0)
    };
    let s = surface(grid((10, 40), (false, false), shape).reversed());
    let s = if s.facet_normal(0).is_some_and(|n| n.z > 0.0) { s } else { surface(s.mesh().clone().reversed()) };
    let extended = s.extended(|_| true, 12.0, "beyond").unwrap();
    for [a, b, c] in beyond(&extended) {
        assert!((b - a).cross(&(c - a)).z > -1e-9);
    }
}

#[test]
fn widths_that_are_not_finite_are_refused() {
    assert!(surface(rectangle()).extended(|_| true, f64::INFINITY, "beyond").is_err());
    assert!(surface(rectangle()).extended(|_| true, f64::NAN, "beyond").is_err());
}
