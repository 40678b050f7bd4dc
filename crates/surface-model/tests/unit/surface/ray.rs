use crate::mesh::tri_mesh::TriMesh;
use crate::surface::SurfaceSettings;
use crate::surface::ray::*;
use crate::test_kit::{Random, cuboid, sphere, torus};
use facemill_test_kit::crossing_of_line;

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

/// Crossings with all triangles: (distance, triangle).
fn plain_hits(s: &Surface, o: &Point3<f64>, d: &Vector3<f64>) -> Vec<(f64, u32)> {
    let crossing = |t: u32| Some((crossing_of_line(&s.mesh().corners(t as usize), o, d)?, t));
    let mut hits: Vec<_> = (0..s.mesh().triangles().len() as u32).filter_map(crossing).collect();
    hits.retain(|hit| hit.0 >= 0.0);
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

#[test]
fn rays_hit_what_a_plain_loop_hits() {
    let s = surface(torus(20.0, 6.0, 30));
    let mut rng = Random(7);
    let mut n_hits = 0;
    for _ in 0..1000 {
        let (o, d) = (rng.point(30.0), rng.direction());
        let plain = plain_hits(&s, &o, &d);
        let all = s.ray_all(&o, &d, f64::INFINITY);
        assert_eq!(
            all.iter().map(|h| h.point.triangle).collect::<Vec<_>>(),
            plain.iter().map(|h| h.1).collect::<Vec<_>>()
        );
        assert_eq!(s.ray(&o, &d, f64::INFINITY), all.first().copied());
        for hit in &all {
            n_hits += 1;
            let p = s.point(hit.point.triangle, hit.point.barycentric);
            assert!((p.position - hit.point.position).norm() < 1e-11);
            assert_eq!(hit.from_outside, s.facet_normal(hit.point.triangle).unwrap().dot(&d) < 0.0);
        }
        if let Some(h) = all.first() {
            assert_eq!(s.ray(&o, &d, h.point.distance), Some(*h));
            assert_eq!(s.ray(&o, &d, h.point.distance.next_down()), None);
        }
    }
    assert!(n_hits > 300);
}

#[test]
fn no_ray_slips_through_a_side_or_corner() {
    let s = surface(sphere(10.0, 24));
    let mut rng = Random(8);
    for k in 0..4000 {
        // Aims at corners and at points of sides, from everywhere, also along the axes.
        let t = s.mesh().corners((rng.unit() * s.mesh().triangles().len() as f64) as usize);
        let target = if k % 3 == 0 { t[0] } else { t[0] + (t[1] - t[0]) * rng.unit() };
        let d = match k % 4 {
            0 => Vector3::ith_axis(k / 4 % 3),
            1 => -Vector3::ith_axis(k / 4 % 3),
            _ => rng.direction(),
        };
        // Rays that graze the facets, which are turned by up to 20° from the sphere, may pass
        // beside it for good.
        if d.dot(&target.coords).abs() < 4.0 {
            continue;
        }
        let o = target - d.into_inner() * (30.0 + 1000.0 * rng.unit());
        let hit = s.ray(&o, &d, f64::INFINITY).unwrap_or_else(|| panic!("case {k}: ray slipped through"));
        assert!(hit.point.position.coords.norm() < 10.0 + 1e-9);
    }
}

#[test]
fn axis_parallel_rays_in_the_plane_of_a_face_end_at_its_border_without_nan() {
    let s = surface(cuboid(Point3::origin(), Point3::new(2.0, 2.0, 2.0)));
    // In the top face: meets the sides of the box that bound it.
    let hit = s.ray(&Point3::new(-5.0, 1.0, 2.0), &Vector3::x_axis(), 100.0).unwrap();
    assert_eq!(hit.point.position, Point3::new(0.0, 1.0, 2.0));
    assert!(hit.from_outside);
    assert!(s.ray(&Point3::new(-5.0, 1.0, 2.0f64.next_up()), &Vector3::x_axis(), 100.0).is_none());
}

#[test]
fn inside_is_what_the_shapes_say() {
    let s = surface(torus(20.0, 6.0, 60));
    let mut rng = Random(9);
    for _ in 0..2000 {
        let p = rng.point(27.0);
        let depth = 6.0 - (p.x.hypot(p.y) - 20.0).hypot(p.z);
        // The facets lie up to 0.04 mm inside the torus.
        if depth.abs() > 0.05 {
            assert_eq!(s.is_inside(&p), depth > 0.0, "{p} {depth}");
        }
    }
}

#[test]
fn overlapping_solids_cavities_and_open_sheets_wind_as_they_should() {
    let cube = |a: f64, b: f64| cuboid(Point3::new(a, a, a), Point3::new(b, b, b));
    let turned = |m: &TriMesh| {
        TriMesh::new(m.vertices().to_vec(), m.triangles().iter().map(|&[a, b, c]| [b, a, c]).collect()).unwrap()
    };
    let sheet = TriMesh::new(
        [(-9.0, -9.0), (9.0, -9.0), (0.0, 9.0)].iter().map(|&(x, y)| Point3::new(x, y, 5.0)).collect(),
        vec![[0, 1, 2]],
    );
    let s = surface(cube(0.0, 2.0).joined(&cube(1.0, 4.0)).joined(&turned(&cube(2.5, 3.5))).joined(&sheet.unwrap()));
    let at = |x: f64| Point3::new(x, x, x);
    assert_eq!([-1.0, 0.5, 1.5, 2.2, 3.0, 3.7, 4.5].map(|x| s.winding(&at(x)).unwrap()), [0, 1, 2, 1, 0, 1, 0]);
    // Exactly below corners, along diagonals and in planes of faces.
    assert_eq!(s.winding(&Point3::new(1.0, 1.0, 0.5)), Some(1));
    assert_eq!(s.winding(&Point3::new(2.0, 2.0, -1.0)), Some(0));
    assert_eq!(s.winding(&Point3::new(0.0, 1.0, 1.0)), None, "on a face");
    assert!(surface(turned(&cube(0.0, 2.0))).is_inside(&at(1.0)), "a part wound inside out is still a part");
}
