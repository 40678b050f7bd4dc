//! Laws of windings: blades and shells are recognised, sheets and dishes are not.

use std::f64::consts::{PI, TAU};

use Winding::{Inward, Outward, Undecided};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use super::*;
use crate::test_kit::{Random, cuboid, grid, sphere, torus};

/// Blade of lens section, chord 2, thickness `t`, span `h`, twisted, wound outward and open at both
/// ends.
fn blade(t: f64, h: f64) -> TriMesh {
    grid((40, 20), (true, false), |u, v| {
        let (s, c) = (u * TAU).sin_cos();
        let (ts, tc) = (0.6 * v).sin_cos();
        let (x, y) = (c, 0.5 * t * s);
        Point3::new(x * tc - y * ts, x * ts + y * tc, h * v)
    })
}

/// Part of a unit sphere about z down to the angle `to` from its pole, wound outward.
fn cap(to: f64) -> TriMesh {
    grid((40, 20), (true, false), |u, v| {
        let (s, c) = (u * TAU).sin_cos();
        let polar = PI - (PI - 0.05 - (PI - to)).max(0.0) * v - (PI - to);
        Point3::new(polar.sin() * c, polar.sin() * s, polar.cos())
    })
}

/// Half of a blade's round, from the angle `from` on; both halves meet without common vertices.
fn half(from: f64, t: f64) -> TriMesh {
    grid((20, 20), (false, false), |u, v| {
        let (s, c) = (from + u * PI).sin_cos();
        Point3::new(c, 0.5 * t * s, 3.0 * v)
    })
}

fn plate() -> TriMesh {
    grid((12, 12), (false, false), |u, v| Point3::new(u, v, 0.0))
}

fn windings(mesh: &TriMesh) -> Vec<Winding> {
    Orientation::of(mesh).pieces.iter().map(|p| p.winding).collect()
}

fn shuffled(mesh: &TriMesh, rng: &mut Random) -> TriMesh {
    let mut triangles = mesh.triangles().to_vec();
    for k in (1..triangles.len()).rev() {
        triangles.swap(k, (rng.unit() * (k + 1) as f64) as usize);
    }
    TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap()
}

#[test]
fn open_blades_and_shells_are_known_by_their_winding_wherever_they_lie() {
    let mut rng = Random(5);
    for (mesh, name) in [
        (blade(0.1, 3.0), "thin blade"),
        (blade(0.5, 2.0), "thick blade"),
        (blade(1.9, 8.0), "bar"),
        (cap(2.6), "shell with a hole"),
    ] {
        for turn in [false, true] {
            let wound = if turn { mesh.clone().reversed() } else { mesh.clone() };
            let expected = [if turn { Inward } else { Outward }];
            assert_eq!(windings(&wound), expected, "{name}");
            for _ in 0..3 {
                let rotation = UnitQuaternion::from_axis_angle(&rng.direction(), 6.0 * rng.unit());
                let motion = Isometry3::from_parts(Translation3::from(rng.vector(500.0)), rotation);
                let other = shuffled(&wound.transformed(&motion), &mut rng);
                assert_eq!(windings(&other), expected, "{name}, moved and in another order");
            }
        }
    }
}

#[test]
fn no_claim_is_made_of_sheets_dishes_and_hoods() {
    for (mesh, name) in [(plate(), "plate"), (cap(0.5), "dish"), (cap(0.5 * PI), "half-sphere")] {
        assert_eq!(windings(&mesh), [Undecided], "{name}");
        assert_eq!(windings(&mesh.reversed()), [Undecided], "{name}, the other way");
    }
    let doubled = plate().joined(&plate().reversed());
    assert!(windings(&doubled).iter().all(|w| *w == Undecided), "a plate without thickness");
}

fn n_wound(orientation: &Orientation, winding: Winding) -> usize {
    orientation.pieces.iter().filter(|p| p.winding == winding).map(|p| p.n_triangles).sum()
}

#[test]
fn of_pieces_of_one_body_the_one_that_is_wound_against_the_others_is_found() {
    for t in [0.1, 0.4, 1.0] {
        let [one, other] = [half(0.0, t), half(PI, t)];
        assert_eq!(windings(&one.clone().joined(&other)), [Outward, Outward], "{t}");
        assert_eq!(windings(&one.clone().joined(&other.clone().reversed())), [Outward, Inward], "{t}");
        assert_eq!(windings(&one.clone().reversed().joined(&other)), [Inward, Outward], "{t}");
        assert_eq!(windings(&one.reversed().joined(&other.reversed())), [Inward, Inward], "{t}");
    }
    let beside = blade(0.2, 3.0).transformed(&Isometry3::translation(5.0, 1.0, 0.0));
    let both = Orientation::of(&blade(0.2, 3.0).joined(&beside.reversed()));
    assert_eq!((both.pieces[0].winding, both.pieces[1].winding), (Outward, Inward));
    assert_eq!((n_wound(&both, Inward), both.pieces[1].first_triangle), (1600, 1600));
}

#[test]
fn a_band_of_turned_triangles_in_a_blade_is_counted() {
    let mesh = blade(0.3, 3.0);
    let mut triangles = mesh.triangles().to_vec();
    triangles[400..480].iter_mut().for_each(|t| t.swap(1, 2));
    let found = Orientation::of(&TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap());
    assert_eq!((n_wound(&found, Inward), n_wound(&found, Outward)), (80, 1520));
}

#[test]
fn closed_parts_are_known_by_their_volume_and_cavities_are_left_alone() {
    let [part, inner] = [torus(5.0, 2.0, 24), sphere(1.0, 16)];
    assert_eq!(windings(&part), [Outward]);
    assert_eq!(windings(&part.clone().reversed()), [Inward]);
    let cube = cuboid(Point3::new(-3.0, -3.0, -3.0), Point3::new(3.0, 3.0, 3.0));
    assert_eq!(windings(&cube.clone().joined(&inner.clone().reversed())), [Outward, Undecided], "a cavity");
    assert_eq!(windings(&cube.joined(&inner.clone())), [Outward, Outward], "a body within another");
    let apart = inner.transformed(&Isometry3::translation(20.0, 0.0, 0.0)).reversed();
    assert_eq!(windings(&part.joined(&apart)), [Outward, Inward]);
}

#[test]
fn the_wall_of_a_hollow_within_an_open_body_is_wound_as_it_should() {
    let casing = blade(1.9, 8.0);
    let bore = grid((40, 20), (true, false), |u, v| {
        let (s, c) = (u * TAU).sin_cos();
        Point3::new(0.5 * c, 0.5 * s, 8.0 * v)
    });
    assert_eq!(windings(&casing.clone().joined(&bore.clone().reversed())), [Outward, Undecided]);
    assert_eq!(windings(&bore.reversed()), [Inward], "the wall alone has the shape of a bar that is wound inward");
}

#[test]
fn what_a_solid_angle_adds_is_a_winding_number() {
    let mut rng = Random(11);
    let mesh = cuboid(Point3::origin(), Point3::from(Vector3::repeat(1.0)));
    for _ in 0..200 {
        let p = rng.point(2.0);
        let mut angles = HalfAngles::default();
        for t in 0..12 {
            let [a, b, c] = mesh.corners(t).map(|q| q - p);
            angles.add(&a, &b, &c);
        }
        let sum = angles.sum() / TAU;
        let inside = p.iter().all(|x| (0.0..1.0).contains(x));
        assert!((sum - f64::from(u8::from(inside))).abs() < 1e-9, "{p}: {sum}");
    }
}

/// Angles of many small triangles, most of them summed as factors, and of few large ones.
#[test]
fn solid_angles_of_small_triangles_add_up_to_the_same_winding_number() {
    let mut rng = Random(12);
    let mesh = sphere(1.0, 80);
    for _ in 0..50 {
        let p = rng.point(2.0);
        let mut angles = HalfAngles::default();
        for t in 0..mesh.triangles().len() {
            let [a, b, c] = mesh.corners(t).map(|q| q - p);
            angles.add(&a, &b, &c);
        }
        let (sum, radius) = (angles.sum() / TAU, p.coords.norm());
        // Facets lie inside the sphere by less than a hundredth.
        if !(0.99..1.0).contains(&radius) {
            assert!((sum - f64::from(u8::from(radius < 1.0))).abs() < 1e-9, "{p}: {sum}");
        }
    }
}
