//! Distances of solids from the material of lines, against points of every line.

use std::sync::Arc;

use facemill_cl_data::{ConvexPolyhedron, RoundBox, RoundFrustum, RoundHull, Solid};
use facemill_z_map::{DexelMap, NearestMaterial};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::dexel_kit::{body, cut, direction, pose, upright};
use crate::kit::Random;

/// Largest amount by which a returned distance may be too small, mm.
const RESOLUTION: f64 = 1e-4;

/// Points of a line's material are so far apart.
const STEP: f64 = 0.25;

fn solids() -> [Solid; 5] {
    let frustum = |rounding| RoundFrustum { z_low: -2.0, z_high: 7.0, radius_low: 4.0, radius_high: 1.5, rounding };
    let tips = [[5.0, 0.0, 1.0], [-4.0, 2.0, 0.0], [0.0, 6.0, -3.0], [1.0, -5.0, 4.0], [0.5, 0.5, 8.0]];
    let core = Arc::new(ConvexPolyhedron::around(&tips.map(Point3::from), []).unwrap());
    [
        Solid::Frustum(frustum(0.0)),
        Solid::Frustum(frustum(1.5)),
        Solid::Frustum(RoundFrustum { radius_low: 0.0, radius_high: 0.0, ..frustum(2.0) }),
        Solid::Box(RoundBox { half_extents: Vector3::new(5.0, 2.0, 3.0), rounding: 0.5 }),
        Solid::Hull(RoundHull { core, rounding: 0.0 }),
    ]
}

/// Returns a block anywhere, of more than one tile, with lines of several intervals and of
/// none.
fn stock(frame: &Isometry3<f64>, random: &mut Random) -> DexelMap {
    let mut map = DexelMap::of_box(frame, [-18.0, -18.0, -6.0], [18.0, 18.0, 6.0], 1.0).unwrap();
    for _ in 0..4 {
        let from = pose((frame * Point3::from(random.vector(15.0))).coords.into(), direction(random));
        cut(&mut map, &body(4.0, 1.0, 9.0), from, from, 0.01);
    }
    let through = |x: f64| upright([x, 3.0, -7.0]);
    cut(&mut map, &body(3.0, 0.0, 40.0), through(-6.0), through(4.0), 0.01);
    map
}

/// Least distance from the dilated solid of points of all lines: no less than the truth, and no
/// more than half a step above it.
fn of_points(map: &DexelMap, solid: &Solid, work_from_solid: &Isometry3<f64>) -> f64 {
    let [nx, ny] = map.grid().n_lines();
    let solid_from_work = work_from_solid.inverse();
    let mut least = f64::INFINITY;
    for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
        for interval in map.intervals(i, j) {
            let n = ((interval.top - interval.bottom) / STEP).ceil();
            for k in 0..=n as u32 {
                let z = interval.bottom + (interval.top - interval.bottom) * f64::from(k) / n;
                least = least.min(solid.distance(&(solid_from_work * map.grid().in_work(i, j, z))));
            }
        }
    }
    least.max(0.0)
}

#[test]
fn the_nearest_material_is_as_near_as_the_nearest_point_of_all_lines() {
    let mut random = Random(77);
    let (mut n_met, mut n_near) = (0, 0);
    for (solid, turn) in solids().iter().zip([0.0, 0.0, 1.0, 0.7, 2.0]) {
        // Lines along z of the work, and turned ones.
        let frame = Isometry3::new(Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.3, 1.0, 0.1) * turn);
        let map = stock(&frame, &mut random);
        for k in 0..7 {
            // Inside, on the border and far away; square to the lines, too.
            let turned = if k % 3 == 0 { Vector3::zeros() } else { random.vector(3.0) };
            let at = frame * Isometry3::new(random.vector([12.0, 20.0, 60.0][k % 3]), turned);
            let expected = of_points(&map, solid, &at);
            let NearestMaterial { distance, place } = map.nearest(solid, &at, [0.0, f64::INFINITY]).unwrap();
            assert!(distance <= expected + 1e-9, "{distance} is reported, and {expected} is there: {solid:?} {at:?}");
            assert!(
                distance >= expected - 0.5 * STEP - RESOLUTION,
                "{distance} is reported for {expected}: {solid:?} {at:?}"
            );
            let of_place = solid.distance(&at.inverse_transform_point(&place)).max(0.0);
            assert!(
                of_place >= distance && of_place <= distance + RESOLUTION + 1e-9,
                "{of_place} at {place}: {distance}"
            );
            // A query up to a distance finds material that is nearer, and only that.
            for (at_most, is_nearer) in
                [(0.5 * distance, false), (distance - RESOLUTION, false), (distance + 2.0 * RESOLUTION, true)]
            {
                let within = map.nearest(solid, &at, [0.0, at_most]);
                assert_eq!(within.is_some(), is_nearer, "{distance} within {at_most}: {within:?}");
                assert!(within.is_none_or(|w| (w.distance - distance).abs() <= RESOLUTION + 1e-9));
            }
            // Any that is near enough will do.
            for enough in [0.5 * distance, distance + 2.0 * RESOLUTION, 2.0 * distance + 1.0] {
                let near = map.nearest(solid, &at, [enough, f64::INFINITY]).unwrap();
                let of_place = solid.distance(&at.inverse_transform_point(&near.place)).max(0.0);
                assert!(
                    of_place <= enough.max(distance + RESOLUTION) + 1e-9,
                    "{of_place} is reported for {enough}: {distance}"
                );
                assert!(near.distance <= of_place && near.distance >= of_place - RESOLUTION - 1e-9);
            }
            n_met += usize::from(distance == 0.0);
            n_near += usize::from(distance > 0.0 && distance < 5.0);
        }
    }
    assert!(n_met > 4 && n_near > 4, "{n_met} met, {n_near} near");
}

#[test]
fn nothing_is_near_where_there_is_no_material_and_what_is_nowhere_meets_all() {
    let mut map = DexelMap::of_box(&Isometry3::identity(), [0.0; 3], [4.0, 4.0, 3.0], 1.0).unwrap();
    let [solid, ..] = solids();
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert_eq!(map.nearest(&solid, &nowhere, [0.0, 1.0]).map(|n| n.distance), Some(0.0));
    let far = Isometry3::translation(2.5, 2.5, 105.0);
    assert!(map.nearest(&solid, &far, [0.0, 99.99]).is_none());
    let near = map.nearest(&solid, &far, [0.0, 100.01]).unwrap();
    assert!((near.distance - 100.0).abs() <= 2.0 * RESOLUTION && near.place.z == 3.0, "{near:?}");
    cut(&mut map, &body(9.0, 0.0, 40.0), upright([2.0, 2.0, -1.0]), upright([2.0, 2.0, -1.0]), 0.01);
    assert!(
        map.nearest(&solid, &far, [0.0, f64::INFINITY]).is_none()
            && map.nearest(&solid, &nowhere, [0.0, 1.0]).is_none()
    );
}
