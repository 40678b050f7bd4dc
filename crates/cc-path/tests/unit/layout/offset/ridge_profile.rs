use super::*;
use crate::region::Region;
use crate::strategy::patch::{Fineness, Patch};
use crate::test_kit::{Random, irregular_grid, surface};

/// Profiles of a wavy sheet with a crease along x = 3, at places near it and far from it.
fn for_profiles(check: impl Fn(RidgeProfile<'_>, RidgeProfile<'_>, f64)) {
    let sheet = irregular_grid(60, 30, 0.5, |u, v| {
        let (x, y) = (6.0 * u, 4.0 * v);
        Point3::new(x, y, 0.1 * (4.0 * x + y).sin() - 0.6 * (x - 3.0).abs())
    });
    let s = surface(sheet);
    let fineness = Fineness { max_edge: 10.0, max_bend: f64::INFINITY, cuts_range: false };
    let patch = Patch::new(&s, &Region::default(), None, &fineness).unwrap();
    let normals = CornerNormals::of(&patch);
    let mut rng = Random(9);
    for triangle in (0..patch.mesh.triangles().len() as u32).step_by(97) {
        let [a, b, c] = patch.mesh.corners(triangle as usize);
        let place = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let normal = patch.normal(triangle, &place);
        let aside = Vector3::y() + Vector3::x() * (rng.unit() - 0.5);
        let along = Unit::new_normalize(aside - normal.into_inner() * normal.dot(&aside));
        let profile = || RidgeProfile::at(&normals, triangle, place, &along).unwrap();
        check(profile(), profile(), 0.05 + 0.5 * rng.unit());
    }
}

#[test]
fn windows_of_one_sweep_turn_as_each_by_itself() {
    for_profiles(|mut profile, _, window| {
        profile.reach(5.0 * window);
        let swept = turns_of_windows(profile.nodes(), window);
        assert_eq!(swept.len(), 129);
        for (k, turn) in swept.into_iter().enumerate() {
            let middle = (k as f64 / 16.0 - 4.0) * window;
            // At the crease the turn jumps: on which side of it a window ends is up to rounding.
            let around = [-1e-9, 0.0, 1e-9].map(|off| profile.window_turn(middle + off, window));
            let [low, high] = [f64::min, f64::max].map(|f| around.into_iter().reduce(f).unwrap());
            assert!((low - 1e-9..=high + 1e-9).contains(&turn), "{turn} {around:?}");
        }
    });
}

#[test]
fn a_profile_that_grows_is_the_one_that_is_walked_at_once() {
    for_profiles(|mut grown, mut at_once, window| {
        for reach in [0.3, 1.0, 4.5, 6.75] {
            grown.reach(reach * window);
        }
        at_once.reach(6.75 * window);
        let nodes = |p: &RidgeProfile<'_>| -> Vec<(f64, f64, u32)> {
            p.nodes().iter().map(|n| (n.way, n.turn, n.triangle)).collect()
        };
        assert_eq!(nodes(&grown), nodes(&at_once));
        assert!(at_once.nodes().windows(2).all(|w| w[0].way <= w[1].way));
        // It reaches as far as requested, or to the border of the sheet.
        let far = at_once.nodes()[at_once.nodes().len() - 1];
        let at_border = [far.position.x, far.position.y]
            .iter()
            .zip([6.0, 4.0])
            .any(|(c, most)| c.abs() < 1e-9 || (c - most).abs() < 1e-9);
        assert!(far.way > 6.75 * window || at_border, "{far:?}");
    });
}
