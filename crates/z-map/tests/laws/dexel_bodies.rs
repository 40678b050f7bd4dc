//! Bodies of revolution against distances of `cl-data`, and inputs that are refused.

use facemill_cl_data::{ClPoint, RoundFrustum, Solid};
use facemill_z_map::{BodyError, DexelGrid, DexelMap, GridError, RoundRing, StockError, Sweep, TurnedBody};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::dexel_kit::{block, cut, direction, lost, pose};
use crate::kit::Random;

/// A frustum about the axis as a solid of `cl-data`, whose distance is another formula.
fn solid(f: [f64; 5]) -> Solid {
    let [z_low, z_high, radius_low, radius_high, rounding] = f;
    Solid::Frustum(RoundFrustum { z_low, z_high, radius_low, radius_high, rounding })
}

fn in_tool(pose: &ClPoint, p: &Point3<f64>) -> Point3<f64> {
    let v = p - pose.tip;
    let z = v.dot(&pose.axis);
    Point3::new((v - pose.axis.into_inner() * z).norm(), 0.0, z)
}

#[test]
fn lines_end_on_shanks_and_holders() {
    let mut random = Random(31);
    let frusta = [
        [2.0, 9.0, 3.0, 3.0, 0.0],
        [0.0, 6.0, 2.0, 5.0, 0.5],
        [1.0, 5.0, 6.0, 1.0, 0.0],
        [-1.0, 1.5, 4.0, 4.0, 1.0],
        [0.0, 8.0, 0.0, 3.0, 0.0],
        [3.0, 3.0, 4.0, 4.0, 1.5],
    ];
    let mut n_ends = 0;
    for f in frusta {
        let (body, solid) = (TurnedBody::frustum([f[0], f[1]], [f[2], f[3]], f[4]).unwrap(), solid(f));
        for _ in 0..4 {
            let pose = pose(random.vector(3.0).into(), direction(&mut random));
            let mut map = block([-14.0, -14.0, -30.0], [14.0, 14.0, 30.0], 1.0);
            cut(&mut map, &body, pose, pose, 0.01);
            for (i, j) in (0..28).flat_map(|j| (0..28).map(move |i| (i, j))) {
                let distance = |z: f64| solid.distance(&in_tool(&pose, &map.grid().in_work(i, j, z)));
                let lost = lost(map.intervals(i, j), -30.0, 30.0);
                assert!(lost.len() <= 1);
                for [from, to] in &lost {
                    n_ends += 2;
                    // On the surface: not outside, and outside just beyond.
                    assert!(distance(*from) < 1e-8 && distance(*to) < 1e-8, "{f:?} {pose:?} {from} {to}");
                    assert!(distance(from - 1e-3) > 0.0 && distance(to + 1e-3) > 0.0, "{f:?} {pose:?} {from} {to}");
                }
                if lost.is_empty() {
                    assert!((-60..60).all(|k| distance(0.25 * f64::from(k)) > 0.0), "{f:?} {pose:?} ({i}, {j})");
                }
            }
        }
    }
    assert!(n_ends > 1000, "{n_ends}");
}

#[test]
fn a_holder_that_nearly_touches_is_not_met_and_one_that_does_is() {
    let mut random = Random(33);
    let map = block([-20.0, -20.0, -5.0], [20.0, 20.0, 0.0], 0.5);
    let body = TurnedBody::frustum([10.0, 30.0], [6.0, 9.0], 1.0).unwrap();
    let solid = solid([10.0, 30.0, 6.0, 9.0, 1.0]);
    let grid = *map.grid();
    for _ in 0..20 {
        let axis = Vector3::z() + random.vector(0.6);
        let at = |z: f64| pose([0.0, 0.0, z], axis.into());
        // The least lift that clears the lines, by the other formula.
        let least = |z: f64| {
            let lines = (0..80).flat_map(|j| (0..80).map(move |i| (i, j)));
            lines.map(|(i, j)| solid.distance(&in_tool(&at(z), &grid.in_work(i, j, 0.0)))).fold(f64::INFINITY, f64::min)
        };
        let (mut low, mut high) = (-20.0, 10.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if least(middle) > 0.0 { high = middle } else { low = middle }
        }
        let met = |z: f64| map.meets(&Sweep { body: &body, from: at(z), to: at(z) }, 0.01).unwrap();
        assert!(met(high + 1e-5).is_none(), "{axis:?}");
        let contact = met(high - 1e-3).expect("it is a micron in the material");
        assert!((9e-4..1.1e-3).contains(&contact.depth) && (contact.place.z + 5e-4).abs() < 1e-4, "{contact:?}");
    }
}

#[test]
fn bodies_that_are_none_are_refused() {
    let ring = |radius: f64, height: f64, rounding: f64| RoundRing { radius, height, rounding };
    assert_eq!(TurnedBody::new(&[]), Err(BodyError::NoRing));
    assert_eq!(TurnedBody::new(&[ring(1.0, 0.0, 0.1); 17]), Err(BodyError::TooManyRings(17)));
    for bad in [ring(-1.0, 0.0, 1.0), ring(1.0, f64::NAN, 1.0), ring(1.0, 0.0, -0.1), ring(f64::INFINITY, 0.0, 0.0)] {
        let refused = TurnedBody::new(&[ring(1.0, 1.0, 1.0), bad]);
        assert!(matches!(refused, Err(BodyError::BadRing { index: 1, .. })), "{bad:?}");
    }
    for flat in [[ring(1.0, 2.0, 0.0), ring(3.0, 2.0, 0.0)], [ring(0.0, 0.0, 0.0), ring(0.0, 5.0, 0.0)]] {
        assert_eq!(TurnedBody::new(&flat), Err(BodyError::Flat));
    }
    assert!(TurnedBody::ball(0.0).is_err() && TurnedBody::ball(f64::NAN).is_err());
}

#[test]
fn stock_that_is_none_is_refused() {
    let frame = Isometry3::identity();
    let of_box = |low, high, cell| DexelMap::of_box(&frame, low, high, cell).unwrap_err();
    for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(of_box([0.0; 3], [1.0; 3], cell), StockError::Grid(GridError::BadCell { .. })));
    }
    assert!(matches!(of_box([0.0; 3], [0.0, 1.0, 1.0], 0.1), StockError::Grid(GridError::BadExtent { .. })));
    assert!(matches!(of_box([f64::NAN; 3], [1.0; 3], 0.1), StockError::Grid(GridError::BadExtent { .. })));
    assert!(matches!(of_box([0.0; 3], [1.0, 1.0, 0.0], 0.1), StockError::BadHeight { .. }));
    let StockError::Grid(GridError::TooManyLines { coarser, .. }) = of_box([0.0; 3], [1e4, 1e4, 1.0], 0.1) else {
        panic!("10¹⁰ lines do not fit");
    };
    assert!(DexelGrid::over(&frame, [0.0; 2], [1e4; 2], coarser).is_ok());
    for radius in [0.0, f64::NAN] {
        let refused = DexelMap::of_cylinder(&frame, [0.0; 2], radius, [0.0, 1.0], 0.1);
        assert!(matches!(refused, Err(StockError::BadRadius { .. })));
    }
    let map = DexelMap::of_cylinder(&frame, [1.0, 2.0], 10.0, [-1.0, 4.0], 0.1).unwrap();
    map.check_invariants().unwrap();
    assert!((map.volume() / (500.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3);
}
