//! Cut stock against the part it should have become: closed forms.

use facemill_cl_data::{Cancelled, Monitor, Silent};
use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use facemill_z_map::{Deviation, DeviationError, DeviationPoint, DexelMap};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::dexel_kit::{body, cut, upright};

/// A box between two corners.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> TriMesh {
    let (vertices, triangles) = facemill_test_kit::box_mesh(low, high);
    TriMesh::new(vertices, triangles).unwrap()
}

fn surface(mesh: TriMesh) -> Surface {
    Surface::new(mesh, SurfaceSettings::default())
}

/// Lines that lean against the plate's normal by this angle about y and a little about x.
fn leaning(angle: f64) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::new(0.1 * angle, angle, 0.0))
}

/// Places on the top of a plate with the top at z = 0, away from its edges.
fn on_top<'a>(deviation: &'a Deviation<'_>, half: f64) -> impl Iterator<Item = DeviationPoint> + 'a {
    deviation.places().filter(move |p| p.position.z.abs() < 1e-6 && p.position.x.abs().max(p.position.y.abs()) < half)
}

/// Coordinates are rounded to 1.5e-8 mm; slopes here are below 1.
const ROUNDED: f64 = 5e-8;

/// A plate of 40 × 40 × 6 mm with its top at z = 0.
fn plate() -> Surface {
    surface(cuboid([-20.0, -20.0, -6.0], [20.0, 20.0, 0.0]))
}

const BALL: f64 = 4.0;

/// The plate with an allowance of 0.5 mm, its top milled along x by a ball in passes 3 mm apart up
/// to y = 9.
fn milled(part: &Surface, frame: &Isometry3<f64>, cell: f64) -> [DexelMap; 2] {
    let before = DexelMap::of_mesh_with_allowance(part.mesh(), frame, cell, 0.5).unwrap();
    let (mut now, ball) = (before.clone(), body(BALL, BALL, 20.0));
    for k in -9..=3 {
        let y = 3.0 * f64::from(k);
        cut(&mut now, &ball, upright([-30.0, y, 0.0]), upright([30.0, y, 0.0]), 0.01);
    }
    [before, now]
}

/// Between passes the ball leaves r − √(r² − s²/4), less the fall of the ridge within half the
/// distance of the lines' places; along a pass nothing; where it was not, the allowance.
#[test]
fn cusps_islands_and_finished_surface_are_the_closed_forms() {
    let part = plate();
    let cusp = BALL - (BALL * BALL - 1.5 * 1.5_f64).sqrt();
    for (angle, cell) in [(0.0, 0.4), (0.6, 0.4), (0.6, 0.1)] {
        let frame = leaning(angle);
        let [before, now] = milled(&part, &frame, cell);
        let deviation = now.deviation(&before, &part, &Silent).unwrap();
        let (mut highest, mut lowest, mut n) = (0.0_f64, f64::INFINITY, 0);
        for place in on_top(&deviation, 15.0) {
            if place.position.y < 9.0 {
                assert!(place.is_cut, "{place:?}");
                (highest, lowest, n) = (highest.max(place.deviation), lowest.min(place.deviation), n + 1);
            } else if place.position.y > 9.0 + BALL {
                assert!(!place.is_cut && (place.deviation - 0.5).abs() < ROUNDED, "{place:?}");
            }
        }
        // One line for each cell, seen along the lines.
        let lines = 30.0 * 24.0 * (frame * Vector3::z()).z / (cell * cell);
        assert!((f64::from(n) / lines - 1.0).abs() < 0.05, "{n} {lines}");
        assert!(
            highest <= cusp + ROUNDED && lowest >= -ROUNDED && lowest < cell * cell / BALL,
            "{highest} {cusp} {lowest}"
        );
        // The ridge is a corner of slope tan(asin(s/2r)) at both sides: what is missed falls with
        // the cell.
        let slope = (1.5 / BALL).asin().tan();
        assert!(cusp - highest <= slope * cell, "{highest} {cusp}");
        assert_eq!(deviation.deepest_cavity(), None);
    }
}

/// A ball that goes in by g is found, g deep, where it went in; the lines miss its lowest point by
/// no more than half a diagonal.
#[test]
fn a_planted_gouge_is_found_at_its_place_with_its_depth() {
    let part = plate();
    for (angle, g) in [(0.0, 0.3), (0.5, 0.3), (0.5, 0.05)] {
        let frame = leaning(angle);
        let cell = 0.2;
        let [before, mut now] = milled(&part, &frame, cell);
        let at = [3.3, -4.7, -g];
        cut(&mut now, &body(BALL, BALL, 20.0), upright([3.3, -4.7, 5.0]), upright(at), 0.01);
        let deviation = now.deviation(&before, &part, &Silent).unwrap();
        let deepest = deviation.places().min_by(|a, b| a.deviation.total_cmp(&b.deviation)).unwrap();
        let apart = cell / (frame * Vector3::z()).z;
        let missed = BALL - (BALL * BALL - apart * apart).sqrt();
        assert!(-deepest.deviation <= g + ROUNDED && -deepest.deviation >= g - missed, "{deepest:?} {g}");
        // Along a leaning line the end is beside the place by its depth and the lean.
        let beside = (deepest.position - Point3::new(3.3, -4.7, 0.0)).norm();
        assert!(beside <= apart * 1.5 + g * angle.tan() * 1.1, "{beside}");
        let gouged = deviation.places().filter(|p| p.deviation < -1e-6).count() as f64 * cell * apart;
        let disc = std::f64::consts::PI * (2.0 * BALL * g - g * g);
        assert!((gouged / disc - 1.0).abs() < 0.2 || g < 0.1, "{gouged} {disc}");
    }
}

/// Through a plate the gouge is its thickness; of an open surface the stock below is not known to
/// end, and where there is none the gouge has no depth.
#[test]
fn cut_through_is_as_deep_as_the_part_is_thick() {
    let part = plate();
    let [before, mut now] = milled(&part, &leaning(0.3), 0.5);
    cut(&mut now, &body(6.0, 0.0, 30.0), upright([0.0, 0.0, 5.0]), upright([0.0, 0.0, -15.0]), 0.01);
    let deviation = now.deviation(&before, &part, &Silent).unwrap();
    let middle = |p: &DeviationPoint| p.position.x.hypot(p.position.y) < 2.0;
    let through: Vec<DeviationPoint> = deviation.places().filter(middle).collect();
    assert!(through.len() > 40 && through.iter().all(|p| (p.deviation + 6.0).abs() < ROUNDED), "{:?}", through[0]);

    let corners = [(-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)].map(|(x, y)| Point3::new(x, y, 0.0));
    let sheet = surface(TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap());
    let before = DexelMap::of_layer(sheet.mesh(), &Isometry3::identity(), 0.5, 1.0).unwrap();
    let mut now = before.clone();
    cut(&mut now, &body(6.0, 0.0, 30.0), upright([0.0, 0.0, 5.0]), upright([0.0, 0.0, -0.7]), 0.01);
    cut(&mut now, &body(6.0, 0.0, 30.0), upright([12.0, 0.0, 5.0]), upright([12.0, 0.0, -2.0]), 0.01);
    let deviation = now.deviation(&before, &sheet, &Silent).unwrap();
    for place in deviation.places() {
        let expected = match place.position.x {
            x if (x - 12.0).hypot(place.position.y) < 6.0 => f64::NEG_INFINITY,
            x if x.hypot(place.position.y) < 6.0 => -0.7,
            _ => 1.0,
        };
        assert!(place.deviation == expected || (place.deviation - expected).abs() < 1e-9, "{place:?} {expected}");
    }
}

/// A hole across the lines does not touch the part's surface on them. A shell within another is no
/// surface; a gap that is full of stock is an excess of its width.
#[test]
fn holes_inside_overlapping_shells_and_full_gaps_are_reported() {
    let part = surface(cuboid([-20.0, -20.0, -20.0], [20.0, 20.0, 20.0]));
    let before = DexelMap::of_mesh_with_allowance(part.mesh(), &Isometry3::identity(), 0.5, 0.2).unwrap();
    let mut now = before.clone();
    let along_x = |x: f64| crate::dexel_kit::pose([x, 0.0, 5.0], [1.0, 0.0, 0.0]);
    cut(&mut now, &body(3.0, 0.0, 20.0), along_x(30.0), along_x(5.0), 0.01);
    let deviation = now.deviation(&before, &part, &Silent).unwrap();
    let cavity = deviation.deepest_cavity().unwrap();
    // The deepest point of the hole is at its end, 15 mm from the end face and from the top; its
    // upper side nearer.
    let deepest = (0..=60).map(|k| 15.0_f64.min(20.0 - (5.0 - 3.0 + 0.1 * f64::from(k)))).fold(0.0, f64::max);
    assert!(cavity.depth >= deepest - 0.25 && cavity.depth <= deepest * 1.05 + 0.02, "{cavity:?} {deepest}");

    let [a, b] = [cuboid([0.0, 0.0, 0.0], [10.0, 10.0, 10.0]), cuboid([2.0, 2.0, 5.0], [8.0, 8.0, 20.0])];
    let upper = cuboid([0.0, 0.0, 25.0], [10.0, 10.0, 30.0]);
    // An open sheet far away changes nothing.
    let sheet = TriMesh::new(
        [[50.0, 0.0], [60.0, 0.0], [60.0, 10.0]].map(|[x, y]| Point3::new(x, y, 0.0)).to_vec(),
        vec![[0, 1, 2]],
    );
    let part = surface(a.joined(&b).joined(&upper).joined(&sheet.unwrap()));
    let stock = DexelMap::of_box(&Isometry3::identity(), [0.0; 3], [10.0, 10.0, 30.0], 0.5).unwrap();
    let deviation = stock.deviation(&stock, &part, &Silent).unwrap();
    for place in deviation.places() {
        let inside = place.position.x.min(place.position.y) > 2.0 && place.position.x.max(place.position.y) < 8.0;
        // From the gap's upper side the top of the upper shell below is nearer than that of the
        // lower one, also from beside.
        let beside = |c: f64| (2.0 - c).max(c - 8.0).max(0.0);
        let down = beside(place.position.x).hypot(beside(place.position.y)).hypot(5.0);
        let expected: &[(f64, f64)] = if inside {
            &[(0.0, 0.0), (20.0, 5.0), (25.0, 5.0), (30.0, 0.0)]
        } else {
            &[(0.0, 0.0), (10.0, down), (25.0, 15.0), (30.0, 0.0)]
        };
        assert!(
            expected.iter().any(|e| (e.0 - place.position.z).abs() < 1e-9 && (e.1 - place.deviation).abs() < 1e-9),
            "{place:?}"
        );
    }
    assert_eq!(deviation.places().count(), 4 * 400);
}

/// A deviation is no more than the way along the line to the stock's end, and no less than this
/// end's distance from the part.
#[test]
fn deviations_lie_between_distance_and_way_along_the_line() {
    let turn = Isometry3::rotation(Vector3::new(0.4, -0.3, 0.2));
    let part = surface(cuboid([-6.0, -5.0, -4.0], [6.0, 5.0, 4.0]).transformed(&turn));
    let before = DexelMap::of_mesh_with_allowance(part.mesh(), &Isometry3::identity(), 0.3, 1.0).unwrap();
    let (mut now, ball) = (before.clone(), body(3.0, 3.0, 20.0));
    for k in 0..6 {
        let [x, y] = [f64::from(k) * 2.0 - 5.0, f64::from(k * k % 5) - 2.0];
        cut(&mut now, &ball, upright([x, y, 9.0]), upright([x, y, 3.5]), 0.01);
    }
    let deviation = now.deviation(&before, &part, &Silent).unwrap();
    let (mut gouges, mut excesses) = (0, 0);
    for place in deviation.places() {
        let [i, j] = [0, 1].map(|k| ((place.position[k] - now.grid().origin()[k]) / 0.3).floor() as usize);
        let ends = now.intervals(i, j).flat_map(|s| [s.bottom, s.top]).filter(|z| {
            let end = now.grid().in_work(i, j, *z);
            let nearest = part.closest_point(&end, f64::INFINITY).unwrap().distance;
            (nearest - 1e-9..=(z - place.position.z).abs() + 1e-9).contains(&place.deviation.abs())
        });
        assert!(ends.count() > 0, "{place:?}");
        gouges += usize::from(place.deviation < -1e-6);
        excesses += usize::from(place.deviation > 1e-6);
    }
    assert!(gouges > 100 && excesses > 1000, "{gouges} {excesses}");
    let near = deviation.near(&(turn * Point3::new(1.0, 1.0, -4.0)), &(turn * -Vector3::z())).unwrap();
    assert!((near.position - turn * Point3::new(1.0, 1.0, -4.0)).norm() < 0.4 && (near.deviation - 1.0).abs() < 1e-9);
    assert_eq!(deviation.near(&(turn * Point3::new(1.0, 1.0, 0.0)), &Vector3::z()), None);
}

/// Stock that moves with what is left of it has the same cuts: none where nothing was cut, and all
/// that was, on the lines in the new frame.
#[test]
fn stock_is_made_anew_on_the_lines_of_a_map_that_was_moved() {
    let part = plate();
    let [before, now] = milled(&part, &leaning(0.2), 0.7);
    let motion = Isometry3::new(Vector3::new(31.7, -4.1, 200.3), Vector3::new(3.0, 0.2, -0.4));
    let moved = surface(part.mesh().transformed(&motion));
    let again = |lines: &DexelMap| DexelMap::of_mesh_on(moved.mesh(), lines.grid(), (0.5, true)).unwrap();
    let (uncut, left) = (before.clone().moved(&motion), now.clone().moved(&motion));
    assert!((again(&uncut).volume() / before.volume() - 1.0).abs() < 1e-7);
    let nothing = uncut.deviation(&again(&uncut), &moved, &Silent).unwrap();
    assert!(nothing.places().count() > 1000 && nothing.places().all(|place| !place.is_cut));
    let here = now.deviation(&before, &part, &Silent).unwrap();
    let there = left.deviation(&again(&left), &moved, &Silent).unwrap();
    let cut = |of: &Deviation<'_>| of.places().map(|place| place.is_cut).collect::<Vec<_>>();
    assert!(cut(&here).contains(&true) && cut(&here).contains(&false));
    assert_eq!(cut(&here), cut(&there));
    // An open surface has a layer, and a solid needs a closed one.
    let open = TriMesh::new(part.mesh().vertices().to_vec(), part.mesh().triangles()[2..].to_vec()).unwrap();
    assert!(DexelMap::of_mesh_on(&open, before.grid(), (0.5, true)).is_err());
    assert!(DexelMap::of_mesh_on(&open, before.grid(), (0.5, false)).is_ok_and(|map| map.volume() > 0.0));
    assert!(DexelMap::of_mesh_on(&open, before.grid(), (-0.5, false)).is_err());
}

/// A wall along the lines is measured beside its rounded end alone, and a slope everywhere.
#[test]
fn a_wall_along_the_lines_is_not_measured_on_the_surface_at_its_end() {
    let (slope, half) = (0.1_f64, 10.0);
    for [foot, top] in [[0.0, 30.0], [0.0, 200.0]] {
        // A block with a wall at x = 10 and a slope beside x = −10, 0.1 from the lines.
        let run = (top - foot) * slope;
        let corner = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let profile = [[half, foot], [half, top], [half - 1.0, top + 1.0], [-half, top], [-half - run, foot]];
        let n = profile.len();
        let at = |y: f64| profile.map(|[x, z]| corner(x, y, z));
        let vertices: Vec<Point3<f64>> = at(-40.0).into_iter().chain(at(40.0)).collect();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for k in 0..n {
            let (a, b) = (k as u32, ((k + 1) % n) as u32);
            triangles.extend([[a, a + n as u32, b], [b, a + n as u32, b + n as u32]]);
        }
        for k in 1..n as u32 - 1 {
            triangles.extend([[0, k, k + 1], [n as u32, n as u32 + k + 1, n as u32 + k]]);
        }
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let part = surface(mesh);
        let stock = DexelMap::of_mesh_with_allowance(part.mesh(), &Isometry3::identity(), 1.0, 0.5).unwrap();
        let deviation = stock.deviation(&stock, &part, &Silent).unwrap();
        let wall = |z: f64| deviation.near(&corner(half, 0.3, z), &Vector3::x());
        assert!(wall(top - 1.0).is_some(), "beside the chamfer");
        assert!((1..20).all(|k| wall(f64::from(k) / 20.0 * (top - 10.0)).is_none()));
        let normal = Vector3::new(-1.0, 0.0, slope).normalize();
        for k in 1..20 {
            let z = foot + f64::from(k) / 20.0 * (top - foot - 15.0);
            let place = deviation.near(&corner(-half - run + slope * (z - foot), 0.3, z), &normal);
            assert!(place.is_some_and(|place| (place.deviation - 0.5).abs() < 1e-6), "{z} {place:?}");
        }
    }
}

/// Cancels at once.
struct CancelAtOnce;

impl Monitor for CancelAtOnce {
    fn advance(&self, _: usize) {}
    fn is_cancelled(&self) -> bool {
        true
    }
}

#[test]
fn maps_that_do_not_belong_together_and_cancelling_are_errors() {
    let part = plate();
    let [before, now] = milled(&part, &Isometry3::identity(), 1.0);
    let [other, _] = milled(&part, &Isometry3::identity(), 0.9);
    assert_eq!(now.deviation(&other, &part, &Silent).err(), Some(DeviationError::OtherLines));
    assert_eq!(now.deviation(&before, &part, &CancelAtOnce).err(), Some(DeviationError::Cancelled(Cancelled)));
    let far = surface(part.mesh().transformed(&Isometry3::translation(1e8, 0.0, 0.0)));
    assert!(matches!(now.deviation(&before, &far, &Silent), Err(DeviationError::TooFar { .. })));
}
