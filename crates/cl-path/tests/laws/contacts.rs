//! Distances and contacts of cutters, against samples and closed forms.

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_cl_path::*;
use facemill_test_kit::{Random, ball_mesh, least_over_triangle, soup_mesh};
use facemill_tool_model::{Cutter, cl_from_cc};
use nalgebra::{Point3, Unit, Vector3};

use crate::{plate, surface};

/// A face mill, a flat, a bull-nose or a ball cutter.
fn cutter(random: &mut Random) -> Cutter {
    let radius = random.between(2.0, 40.0);
    let corner = [0.0, 0.8, 0.3 * radius, radius][random.below(4)].min(radius);
    Cutter::new(radius, corner, corner + random.between(1.0, 20.0)).expect("a cutter")
}

/// Distance of a point from a cutter by samples of its border, and whether it is inside.
fn by_samples(cutter: &Cutter, height: f64, radius: f64) -> (f64, bool) {
    let (rim, corner, top) = (cutter.rim_radius(), cutter.corner_radius(), cutter.flute_length());
    let mut border = Vec::new();
    for k in 0..=4000 {
        let t = f64::from(k) / 4000.0;
        let (sin, cos) = (t * std::f64::consts::FRAC_PI_2).sin_cos();
        border.push((rim * t, 0.0));
        border.push((rim + corner * sin, corner * (1.0 - cos)));
        border.push((cutter.radius(), corner + (top - corner) * t));
        border.push((cutter.radius() * t, top));
    }
    let apart = border.iter().map(|(r, z)| (r - radius).hypot(z - height)).fold(f64::INFINITY, f64::min);
    let in_corner = radius <= rim || height >= corner || (radius - rim).hypot(height - corner) <= corner;
    (apart, (0.0..=top).contains(&height) && radius <= cutter.radius() && in_corner)
}

/// Below its top the distance is that of the border; above, the body is rounded by the corner.
#[test]
fn distances_from_a_cutter_are_those_of_its_sampled_border() {
    let mut random = Random(11);
    for _ in 0..300 {
        let cutter = cutter(&mut random);
        let cl = ClPoint { tip: random.point(50.0), axis: random.direction() };
        let low = cutter.flute_length() - cutter.corner_radius();
        let (radius, height) = (random.between(0.0, 1.5 * cutter.radius()), random.between(-10.0, 0.5 * low));
        let across = Unit::new_normalize(cl.axis.cross(&random.direction()));
        let p = cl.tip + cl.axis.into_inner() * height + across.into_inner() * radius;
        let found = cutter_distance(&cutter, &cl, &p);
        let (apart, inside) = by_samples(&cutter, height, radius);
        // A flute that is shorter than two corners ends in another curve.
        if low <= 2.0 * cutter.corner_radius() && (inside || height > cutter.corner_radius()) {
            continue;
        }
        let expected = if inside { -apart } else { apart };
        assert!((found - expected).abs() < 0.02, "{cutter:?} {height} {radius}: {found} {expected}");
    }
}

#[test]
fn the_place_nearest_to_a_cutter_is_that_of_a_search_through_all_facets() {
    let mut random = Random(12);
    for case in 0..12 {
        let soup = surface(soup_mesh(&mut random, 60, [40.0, 12.0]));
        let cutter = cutter(&mut random);
        let cl = ClPoint { tip: random.point(40.0), axis: random.direction() };
        let distance = |p: &Point3<f64>| cutter_distance(&cutter, &cl, p);
        let facets = 0..soup.mesh().triangles().len();
        let with_area = facets.filter(|t| soup.facet_normal(*t as u32).is_some());
        let least =
            with_area.map(|t| least_over_triangle(36, &soup.mesh().corners(t), distance)).fold(f64::INFINITY, f64::min);
        let found = nearest_to_cutter(&soup, &cutter, &cl, f64::INFINITY, |t| soup.facet_normal(t).is_some()).unwrap();
        assert!((found.distance - least).abs() < 1e-5, "case {case}: {} {least}", found.distance);
        assert!((distance(&found.at.position) - found.distance).abs() < 1e-9, "case {case}");
        // A limit below it finds nothing.
        assert!(nearest_to_cutter(&soup, &cutter, &cl, least - 1e-3, |t| soup.facet_normal(t).is_some()).is_none());
    }
}

/// A place on a plane in any posture, lifted or lowered along the normal.
#[test]
fn on_a_plane_contact_posture_and_stand_off_are_those_of_the_pose() {
    let mut random = Random(13);
    let plate = plate([-500.0, -500.0], [500.0, 500.0]);
    for _ in 0..200 {
        let cutter = cutter(&mut random);
        let posture = Posture { tilt: random.between(0.002, 1.3), rotate: random.between(-3.1, 3.1) };
        let at = Point3::new(random.between(-100.0, 100.0), random.between(-100.0, 100.0), 0.0);
        let cc = CcPoint::new(at, Vector3::z(), Vector3::new(1.0, random.coordinate(), 0.0)).unwrap();
        let deep = -0.5 * cutter.corner_radius().min(0.1);
        let off = random.between(deep, 0.3);
        let cl = cl_from_cc(&cutter, &cc, posture).translated(Vector3::z() * off);
        let allowance = [0.0, 0.2][random.below(2)];
        let find = |kind| contact(&plate, &cutter, (&cl, &cc.feed), (allowance, 1.0), kind).expect("near");
        let of_surface = find(ContactKind::OfSurface);
        assert!((of_surface.position - at).norm() < 1e-6, "{cutter:?} {posture:?}: {of_surface:?}");
        assert!((of_surface.stand_off - (off - allowance)).abs() < 1e-6, "{off} {of_surface:?}");
        let of_tool = find(ContactKind::OfTool);
        let raised = of_tool.position + Vector3::z() * allowance;
        let again = CcPoint::new(raised, of_tool.normal.into_inner(), cc.feed.into_inner()).unwrap();
        let back = cl_from_cc(&cutter, &again, again.posture_of(&cl.axis));
        assert!((back.tip - cl.tip).norm() < 1e-9 && back.axis.angle(&cl.axis) < 1e-9);
    }
}

/// The contact on a ball, by closed form, is found with the smooth normals of its mesh: far nearer
/// than its facets, which the tangent cutter meets in corners, are large.
#[test]
fn on_a_ball_the_contact_is_not_that_of_the_facets() {
    let mut random = Random(14);
    let radius = 60.0;
    let ball = surface(ball_mesh(radius, [80, 160]));
    let facet = std::f64::consts::PI * radius / 80.0;
    for _ in 0..60 {
        let cutter = Cutter::new(20.0, [0.8, 4.0][random.below(2)], 8.0).unwrap();
        let normal = random.direction();
        let ahead = normal.cross(&random.direction());
        let cc = CcPoint::new(Point3::from(normal.into_inner() * radius), normal.into_inner(), ahead).unwrap();
        let posture = Posture { tilt: random.between(0.03, 0.4), rotate: random.between(-3.1, 3.1) };
        let cl = cl_from_cc(&cutter, &cc, posture);
        let found = contact(&ball, &cutter, (&cl, &cc.feed), (0.0, 0.1), ContactKind::OfSurface).expect("near");
        let off = (found.position - cc.position).norm();
        assert!(off < 0.2 * facet, "{posture:?}: {off} mm of facets of {facet} mm");
        // The mesh lies within the ball by at most its chord error, and the cutter touches the
        // ball.
        assert!((-1e-9..0.02).contains(&found.stand_off), "{}", found.stand_off);
    }
}

#[test]
fn contact_moves_with_part_and_tool() {
    let mut random = Random(15);
    let (vertices, triangles) = ball_mesh(50.0, [24, 40]);
    for _ in 0..20 {
        let motion = random.motion(200.0);
        let moved = surface((vertices.iter().map(|v| motion * v).collect(), triangles.clone()));
        let still = surface((vertices.clone(), triangles.clone()));
        let cutter = Cutter::new(16.0, 1.0, 6.0).unwrap();
        let normal = random.direction();
        let at = Point3::from(normal.into_inner() * 50.0);
        let cc = CcPoint::new(at, normal.into_inner(), normal.cross(&random.direction())).unwrap();
        let cl = cl_from_cc(&cutter, &cc, Posture { tilt: 0.2, rotate: random.between(-3.0, 3.0) });
        for kind in [ContactKind::OfTool, ContactKind::OfSurface] {
            let a = contact(&still, &cutter, (&cl, &cc.feed), (0.1, 0.5), kind).expect("near");
            let (there, feed) = (cl.transformed(&motion), motion.rotation * cc.feed.into_inner());
            let b = contact(&moved, &cutter, (&there, &feed), (0.1, 0.5), kind).expect("near");
            assert!((motion * a.position - b.position).norm() < 1e-5, "{kind:?}");
            assert!((a.stand_off - b.stand_off).abs() < 1e-6);
        }
    }
}
