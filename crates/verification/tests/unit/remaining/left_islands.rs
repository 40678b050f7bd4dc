use facemill_z_map::{LeftHeight, SurfacePlace};
use nalgebra::{Point3, Unit, Vector3};

use super::*;

/// Samples 1 mm apart on a plate of 60 × 40 mm, with heights.
fn plate(height: impl Fn(f64, f64) -> f64) -> MaterialLeft {
    let mut measured = MaterialLeft::default();
    for (x, y) in (0..40).flat_map(|j| (0..60).map(move |i| (f64::from(i), f64::from(j)))) {
        let h = height(x, y);
        measured.weights.push(1.0);
        measured.on.push(SurfacePlace { position: Point3::new(x, y, 0.0), normal: Vector3::z_axis(), stock: 2.0 });
        measured.left.push(LeftHeight { height: h, cut_by: (h < 2.0).then_some(7) });
        measured.was_cut.push(false);
    }
    measured
}

#[test]
fn each_place_above_the_limit_is_in_one_island() {
    // Two discs that meet no other, and a place by itself.
    let discs = [(15.0, 12.0, 6.0, 2.0), (40.0, 25.0, 9.0, 0.5)];
    let measured = plate(|x, y| {
        let of = |&(a, b, r, h): &(f64, f64, f64, f64)| if (x - a).hypot(y - b) < r { h } else { 0.0 };
        if (x, y) == (2.0, 37.0) { 0.3 } else { discs.iter().map(of).fold(0.01, f64::max) }
    });
    let islands = left_islands(&measured, 0.1);
    let all = measured.left.iter().filter(|l| l.height > 0.1).count() as f64;
    assert_eq!((islands.n, islands.largest.len()), (3, 3));
    assert_eq!(islands.largest.iter().map(|i| i.area_mm2).sum::<f64>(), all);
    let [large, small, one] = [0, 1, 2].map(|k| islands.largest[k].clone());
    assert!((large.area_mm2 / (81.0 * std::f64::consts::PI) - 1.0).abs() < 0.05, "{large:?}");
    assert_eq!((large.never_cut_mm2, large.highest.height_mm, large.highest.line), (0.0, 0.5, Some(7)));
    assert_eq!((small.never_cut_mm2, small.highest.line), (small.area_mm2, None));
    assert_eq!((small.from_mm, small.to_mm), ([10.0, 7.0, 0.0], [20.0, 17.0, 0.0]));
    assert_eq!((one.area_mm2, one.highest.at_mm), (1.0, [2.0, 37.0, 0.0]));
}

#[test]
fn sides_of_a_sheet_are_islands_of_their_own_and_many_islands_are_counted() {
    let mut both = plate(|_, _| 0.5);
    let below = plate(|_, _| 0.5);
    both.weights.extend(below.weights);
    both.left.extend(below.left);
    both.was_cut.extend(below.was_cut);
    let down = Unit::new_normalize(-Vector3::z());
    both.on.extend(below.on.into_iter().map(|on| SurfacePlace { normal: down, ..on }));
    assert_eq!(left_islands(&both, 0.1).n, 2);
    // 5 × 4 places, 10 mm apart; nothing above a limit that none exceeds.
    let dots = plate(|x, y| if (x + y * 1e3) % 10.0 == 0.0 && y % 10.0 == 0.0 { 0.2 } else { 0.0 });
    let islands = left_islands(&dots, 0.1);
    assert_eq!((islands.n, islands.largest.len()), (24, MOST_ISLANDS));
    assert_eq!(left_islands(&dots, 0.2).n, 0);
}
