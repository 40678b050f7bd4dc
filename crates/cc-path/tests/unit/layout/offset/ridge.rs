use facemill_sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, blade};
use facemill_surface_model::Surface;
use nalgebra::Isometry3;

use super::*;
use crate::region::Region;
use crate::strategy::patch::Fineness;
use crate::test_kit::{Random, cylinder, surface};

/// A blade, whose edges are sharper and blunter than the round bar beside it.
fn blade_beside_a_bar() -> Surface {
    let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 500.0).unwrap();
    let one = blade(&spec, BladeResolution::new(10, 14).unwrap());
    surface(one.joined(&cylinder(2.0, 80.0, 1.3, 60, 40).transformed(&Isometry3::translation(0.0, 400.0, 0.0))))
}

fn patch_of(s: &Surface, max_edge: f64) -> Patch<'_> {
    let fineness = Fineness { max_edge, max_bend: f64::INFINITY, cuts_range: false };
    Patch::new(s, &Region::default(), None, &fineness).unwrap()
}

#[test]
fn batches_find_the_ridges_that_one_candidate_after_the_other_finds() {
    let s = blade_beside_a_bar();
    let patch = patch_of(&s, 5.0);
    let candidates = candidates(&patch, &PatchVertices::of(&patch));
    let found = |batches: [usize; 2]| {
        let mut search = RidgeSearch::on(&patch);
        search.search(&candidates, batches).unwrap();
        let ridges: Vec<_> = search.ridges.iter().map(|r| (r.path.nodes.clone(), r.path.closed)).collect();
        (ridges, search.failures.n, search.failures.apart.len())
    };
    let one_by_one = found([1, 1]);
    // Failures before, between and behind ridges.
    assert!(one_by_one.0.len() >= 2 && one_by_one.1 > 1_000, "{} {}", one_by_one.0.len(), one_by_one.1);
    for batches in [BATCHES, [3, 50], [candidates.len(), candidates.len()]] {
        assert_eq!(found(batches), one_by_one, "{batches:?}");
    }
}

#[test]
fn a_place_is_near_a_ridge_as_by_all_of_its_parts() {
    let mut rng = Random(3);
    let nodes: Vec<Point3<f64>> = (0..100).map(|k| rng.point(3.0) + Vector3::x() * f64::from(k)).collect();
    for closed in [false, true] {
        let ends = nodes.windows(2).map(|w| [w[0], w[1]]);
        let mut parts: Vec<[Point3<f64>; 2]> = ends.collect();
        parts.extend(closed.then_some([nodes[99], nodes[0]]));
        let ridge = FoundRidge::new(SurfacePath { nodes: nodes.clone(), triangles: vec![0; 100], closed });
        for _ in 0..500 {
            let p = rng.point(10.0) + Vector3::x() * (100.0 * rng.unit());
            let distance = |[a, b]: &[Point3<f64>; 2]| {
                let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                (p - (a + (b - a) * t)).norm()
            };
            let least = parts.iter().map(distance).fold(f64::INFINITY, f64::min);
            assert!(ridge.is_near(&p, least * 1.000_001) && !ridge.is_near(&p, least * 0.999_999), "{p} {least}");
        }
    }
}
