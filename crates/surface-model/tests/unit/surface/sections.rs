use crate::surface::SurfaceSettings;
use crate::surface::sections::*;
use crate::test_kit::{cuboid, torus};

#[test]
fn a_plane_cuts_a_box_in_a_rectangle() {
    let s = Surface::new(cuboid(Point3::origin(), Point3::new(2.0, 3.0, 4.0)), SurfaceSettings::default());
    let sections = plane_section(&s, &Point3::new(0.0, 0.0, 1.5), &Vector3::z_axis(), |_| true);
    assert_eq!(sections.len(), 1);
    let p = &sections[0].points;
    assert!(sections[0].closed && p.len() == 8, "four sides, each crossed by one diagonal");
    let length: f64 = (0..p.len()).map(|k| (p[(k + 1) % p.len()].position - p[k].position).norm()).sum();
    assert!((length - 10.0).abs() < 1e-12);
    for q in p {
        assert!((q.position.z - 1.5).abs() < 1e-15);
        let on_triangle = s.point(q.triangle, q.barycentric).position;
        assert!((on_triangle - q.position).norm() < 1e-12 && (q.barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
    let front =
        plane_section(&s, &Point3::new(0.0, 0.0, 1.5), &Vector3::z_axis(), |t| s.facet_normal(t).unwrap().x > 0.5);
    assert!(front.len() == 1 && !front[0].closed && front[0].points.len() == 3);
    // Seen from outside, from +x, the upper side is on the left of a line along +y.
    assert!(front[0].points[0].position.y < front[0].points[2].position.y);
}

#[test]
fn cylinder_sections_lie_on_the_cylinder() {
    let s = Surface::new(torus(20.0, 6.0, 24), SurfaceSettings::default());
    let origin = Point3::new(1.0, 2.0, 50.0);
    for radius in [17.0, 20.0, 23.0] {
        let sections = implicit_section(&s, |p| (p - origin).xy().norm() - radius, |_| true);
        assert_eq!(sections.len(), 2, "above and below");
        for p in sections.iter().flat_map(|c| &c.points) {
            assert!(((p.position - origin).xy().norm() - radius).abs() < 1e-12);
            assert!((s.point(p.triangle, p.barycentric).position - p.position).norm() < 1e-11);
        }
    }
}

#[test]
fn zeros_are_found_to_rounding_for_bent_and_broken_functions() {
    for (f, zero) in [
        ((|s: f64| s.powi(9) - 1e-4) as fn(f64) -> f64, 1e-4f64.powf(1.0 / 9.0)),
        (|s| (s - 0.3).cbrt(), 0.3),
        (|s| if s < 0.7 { -1.0 } else { 1e-9 }, 0.7),
    ] {
        let guess = f(0.0) / (f(0.0) - f(1.0));
        let s = zero_between(f, f(0.0), f(1.0), guess);
        assert!((s - zero).abs() < 1e-9, "{s} {zero}");
    }
}
