//! How fast errors of removed volumes fall with the cell, against closed forms.
//!
//! A cut is at seeded places and headings in lattices of seeded cells, so that no error is one
//! of a lucky offset or of a lucky ratio of radius and cell. Where the length that lines lose jumps
//! along a curve, the some 1/h cells on it are wrong by up to h² each, with both signs: the root
//! mean square falls as h^1.5 (Kendall, Quart. J. Math. 19, 1948). Where it begins like a square
//! root, as at the silhouette of what is round, it falls as h². A volume that is too large or too
//! small on the whole has a mean that does not vanish in that.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::ClPoint;
use facemill_z_map::{DexelMap, Sweep, TurnedBody};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::dexel_kit::{block, body, cut_all, pose, upright};
use crate::kit::Random;

/// Cells in the mean, mm, each half of the one before.
const CELLS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Places and headings at every cell, of cuts of one sweep, whose straight sides may lie along a
/// row of cells, and of others.
const PLACES: [u32; 2] = [64, 16];

/// Largest lack of the order of so few places below the expected one: the root mean squares are
/// known to some 18 % or better.
const SCATTER: f64 = 0.2;

/// A turn about z and a shift across it to anywhere in a cell.
fn anywhere(random: &mut Random, cell: f64) -> Isometry3<f64> {
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.between(0.0, TAU));
    let shift = Translation3::new(cell * random.between(-0.5, 0.5), cell * random.between(-0.5, 0.5), 0.0);
    Isometry3::from_parts(shift, heading)
}

/// Returns the volume that poses one after the other remove from a block, moved, mm³.
fn removed(map: &mut DexelMap, body: &TurnedBody, way: &[ClPoint], place: &Isometry3<f64>, tolerance: f64) -> f64 {
    let moved: Vec<ClPoint> = way.iter().map(|p| p.transformed(place)).collect();
    let sweeps: Vec<Sweep> = moved.windows(2).map(|w| Sweep { body, from: w[0], to: w[1] }).collect();
    cut_all(map, &sweeps, tolerance).iter().map(|c| c.volume).sum()
}

/// Slope of the straight line through the logarithms of errors, each at half the cell of the one
/// before.
fn order(errors: &[f64; 4]) -> f64 {
    let at = |k: usize| 1.5 - k as f64;
    let both: f64 = errors.iter().enumerate().map(|(k, error)| at(k) * error.log2()).sum();
    both / (0..4).map(|k| at(k) * at(k)).sum::<f64>()
}

/// A cut whose volume is known.
struct Known<'a> {
    what: &'a str,
    exact: f64,
    body: &'a TurnedBody,
    way: &'a [ClPoint],
}

/// The volume that is taken out of new blocks is the exact one in the mean at every cell, and what
/// it is off by falls at least with this order.
fn assert_order(expected: f64, known: &Known<'_>, new: impl Fn(f64) -> DexelMap) {
    let &Known { what, exact, body, way } = known;
    let mut random = Random(81);
    let mut error = |mean: f64| {
        let cell = mean * random.between(0.85, 1.15);
        removed(&mut new(cell), body, way, &anywhere(&mut random, cell), TOLERANCE) - exact
    };
    let places = PLACES[usize::from(way.len() > 2)];
    let errors = CELLS.map(|cell| (0..places).map(|_| error(cell)).collect::<Vec<f64>>());
    let n = f64::from(places);
    let rms = [0, 1, 2, 3].map(|k: usize| (errors[k].iter().map(|e| e * e).sum::<f64>() / n).sqrt());
    let means = [0, 1, 2, 3].map(|k: usize| errors[k].iter().sum::<f64>() / n);
    let order = order(&rms);
    println!("{what}: {exact:.4} mm³, root mean squares {rms:.4?}, means {means:.4?}, order {order:.3}");
    assert!(order >= expected - SCATTER, "{what}: {rms:?} of {exact} fall with the order {order}, not {expected}");
    for (mean, rms) in means.iter().zip(rms) {
        assert!(mean.abs() <= 3.0 * rms / n.sqrt(), "{what}: {mean} is not 0 within the scatter of {rms}");
    }
}

/// Tolerance of sweeps, mm: none of these turns, so that all are exact.
const TOLERANCE: f64 = 1e-4;

/// A block about the origin, its top at z = `top`.
fn around(half_width: f64, low: f64, top: f64) -> impl Fn(f64) -> DexelMap {
    move |cell| block([-half_width, -half_width, low], [half_width, half_width, top], cell)
}

/// ∫ R(h) dh and ∫ R(h)² dh of a cutter's radius R over its height h.
fn moments(radius: f64, corner: f64, flute: f64) -> [f64; 2] {
    let (rim, straight) = (radius - corner, flute - corner);
    [
        rim * corner + 0.25 * PI * corner * corner + radius * straight,
        rim * rim * corner + 0.5 * PI * rim * corner * corner + 2.0 / 3.0 * corner.powi(3) + radius * radius * straight,
    ]
}

/// Volume of a solid of revolution with these moments whose axis goes across itself along `n`
/// chords of this length, each turned by `turn` from the one before. On the outside of every corner
/// is a sector, on its inside chords overlap in a kite.
fn volume_of_chords(moments: [f64; 2], n: u32, chord: f64, turn: f64, is_closed: bool) -> f64 {
    let corners = if is_closed { n } else { n - 1 };
    let ends = if is_closed { 0.0 } else { PI };
    let corner = 0.5 * turn - (0.5 * turn).tan();
    2.0 * f64::from(n) * chord * moments[0] + (ends + f64::from(corners) * corner) * moments[1]
}

#[test]
fn slots_and_holes_have_the_order_of_a_jump() {
    let body = body(3.0, 0.0, 30.0);
    let way = [upright([-5.0, 0.0, -2.0]), upright([5.0, 0.0, -2.0])];
    let slot = Known { what: "slot", exact: 2.0 * (10.0 * 6.0 + PI * 9.0), body: &body, way: &way };
    assert_order(1.5, &slot, around(9.0, -4.0, 0.0));
    let way = [upright([0.0, 0.0, 5.0]), upright([0.0, 0.0, -5.0])];
    let hole = Known { what: "hole", exact: 4.0 * PI * 9.0, body: &body, way: &way };
    assert_order(1.5, &hole, around(4.0, -4.0, 0.0));
}

#[test]
fn a_tilted_plunge_has_at_least_the_order_of_a_jump() {
    let axis = Vector3::new(0.3, 0.2, 1.0);
    let at = |along: f64| pose([0.3 * along, 0.2 * along, along], axis.into());
    let (body, way) = (body(3.0, 1.0, 40.0), [at(12.0), at(-12.0)]);
    let plunge = Known { what: "tilted plunge", exact: 4.0 * PI * 9.0 * axis.norm(), body: &body, way: &way };
    assert_order(1.5, &plunge, around(7.0, -2.0, 2.0));
}

#[test]
fn what_is_round_has_the_order_of_a_square_root() {
    let body = TurnedBody::ball(3.0).expect("a radius");
    let way = [upright([0.0, 0.0, -3.0]); 2];
    let sphere = Known { what: "sphere", exact: 4.0 / 3.0 * PI * 27.0, body: &body, way: &way };
    assert_order(2.0, &sphere, around(4.0, -5.0, 5.0));
    let (n, radius) = (40, 5.0);
    let turn = TAU / f64::from(n);
    let at = |k: u32| {
        let (sin, cos) = (turn * f64::from(k)).sin_cos();
        upright([radius * cos, radius * sin, -2.0])
    };
    let (body, way) = (TurnedBody::ball(2.0).expect("a radius"), (0..=n).map(at).collect::<Vec<_>>());
    // A ball's radius over its height is a half circle.
    let moments = [0.5 * PI * 4.0, 4.0 / 3.0 * 8.0];
    let exact = volume_of_chords(moments, n, 2.0 * radius * (0.5 * turn).sin(), turn, true);
    assert_order(2.0, &Known { what: "ball along a circle", exact, body: &body, way: &way }, around(8.0, -3.0, 3.0));
}

/// Radius, corner radius and flute length of the cutter beside the sheet.
const BESIDE_SHEET: [f64; 3] = [1.5, 0.5, 4.0];

/// Poses of a cutter across the lines along an arc of two radians about an axis along it, in 20
/// chords.
fn along_sheet(radius: f64) -> Vec<ClPoint> {
    let at = |k: u32| {
        let (sin, cos) = (0.1 * f64::from(k) - 1.0).sin_cos();
        pose([radius * sin, -0.5 * BESIDE_SHEET[2], radius * cos - 6.0], [0.0, 1.0, 0.0])
    };
    (0..=20).map(at).collect()
}

/// A curved sheet, 2 mm thick, with stock below and above: the side of a cutter goes along both of
/// its sides.
#[test]
fn both_sides_of_a_curved_sheet_have_their_volumes() {
    let [radius, corner, flute] = BESIDE_SHEET;
    let body = body(radius, corner, flute);
    let new = around(9.5, -10.0, 8.0);
    for (what, rho) in [("inner side of a sheet", 3.0), ("outer side of a sheet", 8.0)] {
        let way = along_sheet(rho);
        let exact = volume_of_chords(moments(radius, corner, flute), 20, 2.0 * rho * 0.05_f64.sin(), 0.1, false);
        assert_order(1.5, &Known { what, exact, body: &body, way: &way }, &new);
    }
    let mut map = new(0.1);
    for rho in [3.0, 8.0] {
        removed(&mut map, &body, &along_sheet(rho), &Isometry3::identity(), TOLERANCE);
    }
    // On the line over the middle stock, sheet and stock, in the heights of both arcs' last chords.
    let [i, j] = [0, 1].map(|k| map.grid().n_lines()[k] / 2);
    let ends: Vec<f64> = map.intervals(i, j).flat_map(|i| [i.bottom, i.top]).collect();
    assert_eq!(ends.len(), 6, "{ends:?}");
    for (end, height) in ends.iter().zip([-10.0, -4.5, -1.5, 0.5, 3.5, 8.0]) {
        assert!((end - height).abs() < 0.01, "{ends:?}");
    }
}

/// A flat cutter whose axis turns about a core leaves a groove around it, whose floor its middle
/// touches. What is removed is within the tolerance of the surface of what is swept.
#[test]
fn a_groove_by_a_turning_axis_is_within_its_tolerance() {
    let (core, radius, flute, n) = (3.0, 2.0, 4.0, 90);
    let turn = TAU / f64::from(n);
    let at = |k: u32| {
        let (sin, cos) = (turn * f64::from(k)).sin_cos();
        pose([core * cos, core * sin, 0.0], [cos, sin, 0.0])
    };
    let way: Vec<ClPoint> = (0..=n).map(at).collect();
    // The tip goes along chords: it is lower by two thirds of their bulge in the mean.
    let lower = 2.0 / 3.0 * core * (1.0 - (0.5 * turn).cos());
    // The far end's edge is at the distance √(top² + R² − z²) from the core's axis.
    let (floor, top) = (core - lower, core + flute - lower);
    let exact = 2.0 * radius * PI * (top * top + radius * radius - floor * floor) - 2.0 / 3.0 * PI * radius.powi(3);
    let far = top.hypot(radius);
    let surface = 2.0 * PI * (far * far - floor * floor) + TAU * 2.0 * radius * (floor + far);
    for tolerance in [0.02, 0.005] {
        let mut random = Random(82);
        let mut volume = || {
            let place = anywhere(&mut random, 0.2);
            removed(&mut around(9.0, -3.0, 3.0)(0.2), &body(radius, 0.0, flute), &way, &place, tolerance)
        };
        let mean = (0..4).map(|_| volume()).sum::<f64>() / 4.0;
        println!("groove within {tolerance}: {mean} of {exact}, surface {surface}");
        assert!((mean - exact).abs() <= tolerance * surface, "{tolerance}: {mean} of {exact}");
    }
}
