//! Laws of passes on what is left, against heights that are known everywhere.

use std::sync::Arc;

use super::*;

const LIMIT: f64 = 0.15;
const OVERLAP: f64 = 3.0;
const STRIP: f64 = 2.0;

/// Two ridges that a coarse plan left, one along x and one across the corner, and a spot of 2 mm.
fn height(x: f64, y: f64) -> f64 {
    let ridge = |d: f64| 0.4 - 0.1 * d.abs();
    let along = ridge(y - 20.3);
    let across = if x > 55.0 { ridge((x - 60.0 + 0.5 * (y - 60.0)) / 1.118) } else { 0.0 };
    let spot = if (x - 20.2).hypot(y - 60.1) < 1.0 { 0.3 } else { 0.0 };
    along.max(across).max(spot).max(0.0)
}

/// Heights where lines along z, 1 mm apart, meet the surface.
fn measured(s: &Surface) -> Vec<StockHeight> {
    let at = |k: i32| f64::from(k) + 0.21;
    let lines = (0..80).flat_map(|j| (0..100).map(move |i| (at(i), at(j))));
    let places = lines.filter_map(|(x, y)| {
        let hit = s.ray_all(&Point3::new(x, y, -100.0), &Vector3::z_axis(), f64::INFINITY).first()?.point;
        let normal = s.facet_normal(hit.triangle)?;
        let reach = std::f64::consts::SQRT_2 / normal.z;
        Some(StockHeight { position: hit.position, normal, height: height(x, y), reach, area: 1.0 / normal.z })
    });
    places.collect()
}

fn region_of(s: &Surface) -> (Region, Arc<LeftRegion>) {
    let left = Arc::new(LeftRegion::new(&measured(s), LIMIT, OVERLAP));
    (Region { left: Some(left.clone()), ..Region::default() }, left)
}

fn normal_at(s: &Surface, p: &Point3<f64>) -> Unit<Vector3<f64>> {
    s.facet_normal(s.closest_point(p, 1.0).expect("on the surface").triangle).expect("a facet")
}

/// Points of the surface half the lines' distance apart.
fn fine(s: &Surface) -> Vec<(Point3<f64>, Unit<Vector3<f64>>)> {
    let samples = RequestedRegion::new(s, &Region::default(), None).expect("all of it").samples(0.2);
    samples.iter().map(|sample| (sample.position, sample.normal)).collect()
}

#[test]
fn what_is_left_is_found_to_the_distance_of_the_lines() {
    for s in [surface(waves(25)), surface(plane(100.0, 80.0, 1, 1))] {
        let (region, left) = region_of(&s);
        let requested = RequestedRegion::new(&s, &region, None).expect("some is left");
        let near_left = |p: &Point3<f64>| left.places().iter().any(|q| (q.position - p).norm() <= q.reach);
        for (p, normal) in fine(&s) {
            let triangle = s.closest_point(&p, 1.0).expect("on it").triangle;
            let is_in = requested.contains(triangle, &p);
            assert!(is_in || height(p.x, p.y) <= LIMIT + 1e-9, "{p} is left by {}", height(p.x, p.y));
            if is_in {
                assert!(near_left(&p) && left.contains(&p, &normal));
                let around =
                    (0..320).map(|k| (0.4 * f64::from(k / 64 + 1), f64::from(k % 64) * std::f64::consts::TAU / 64.0));
                let highest = around.map(|(r, a)| height(p.x + r * a.cos(), p.y + r * a.sin()));
                let highest = highest.fold(height(p.x, p.y), f64::max);
                assert!(highest > LIMIT - 0.1, "{p} is 2 mm from all that is left");
            }
        }
        // The ridges cross.
        assert_eq!(left.islands().len(), 2);
    }
}

#[test]
fn passes_lie_within_the_overlap_and_reach_all_that_is_left() {
    for s in [surface(waves(25)), surface(plane(100.0, 80.0, 1, 1))] {
        let (region, left) = region_of(&s);
        for (strategy, edge_fill) in [
            (planes(oblique()), false),
            (planes(Vector3::x_axis()), false),
            (planes(oblique()), true),
            (rings(Point3::new(50.0, -30.0, 0.0), 5.0, 200.0), false),
        ] {
            let settings = LaySettings { max_step_over: STRIP, edge_fill, ..LaySettings::default() };
            let laid = lay_passes(&s, &region, &strategy, &settings, &|_| STRIP, &Silent).unwrap();
            for (_, cc) in points(&laid) {
                let normal = normal_at(&s, &cc.position);
                let depth = left.depth(&cc.position, &normal, -1.0);
                // An eighth of the radius of the balls.
                assert!(depth >= -0.6, "{} is {} mm outside", cc.position, -depth);
            }
            for place in left.places() {
                let apart = distance_to_passes(&place.position, &laid);
                // Beyond the border of the surface there is no overlap: where a level is lowest or
                // highest there, the next pass may be a strip away.
                let inside =
                    [(0, 100.0), (1, 80.0)].iter().all(|&(k, end)| (1.0..=end - 1.0).contains(&place.position[k]));
                // Straight lines between points are off by the chord.
                let most = if inside { 0.5 * STRIP } else { STRIP } + 0.02;
                assert!(apart <= most, "{}: {apart} mm from the next pass", place.position);
            }
            let all = lay_on(
                &s,
                &Region::default(),
                &strategy,
                &LaySettings { max_step: 50.0, chord_tolerance: 1.0, ..settings },
            );
            let length = |l: &PassLayout| l.passes.iter().map(|p| p.length).sum::<f64>();
            assert!(length(&laid) < 0.4 * length(&all), "{} of {}", length(&laid), length(&all));
        }
    }
}

#[test]
fn what_short_passes_would_reach_is_listed() {
    let s = surface(waves(25));
    let (region, left) = region_of(&s);
    let settings = LaySettings { max_step_over: STRIP, min_pass_length: 12.0, ..LaySettings::default() };
    let laid = lay_passes(&s, &region, &planes(Vector3::x_axis()), &settings, &|_| STRIP, &Silent).unwrap();
    assert!(laid.n_dropped_pieces > 0);
    let strip = |cc: &CcPoint| StripPoint { position: cc.position, normal: cc.normal, half_width: 0.5 * STRIP + 0.02 };
    let passes: Vec<Vec<StripPoint>> = laid.passes.iter().map(|p| p.pass.points.iter().map(strip).collect()).collect();
    let parts = left.not_reached(&passes);
    let listed: std::collections::BTreeSet<usize> = parts.iter().flat_map(|part| part.places.clone()).collect();
    assert!(!listed.is_empty());
    for (k, place) in left.places().iter().enumerate() {
        let apart = distance_to_passes(&place.position, &laid);
        let half = 0.5 * STRIP + 0.02;
        assert!(listed.contains(&k) || apart <= 1.01 * half, "{}: {apart}", place.position);
        assert!(!listed.contains(&k) || apart >= 0.99 * half, "{}: {apart}", place.position);
    }
}

#[test]
fn nothing_left_is_an_empty_region() {
    let s = surface(plane(100.0, 80.0, 1, 1));
    let nothing = Arc::new(LeftRegion::new(&measured(&s), 1.0, OVERLAP));
    let region = Region { left: Some(nothing), ..Region::default() };
    let laid = lay_passes(&s, &region, &planes(oblique()), &LaySettings::default(), &|_| 1.0, &Silent);
    assert!(laid.unwrap_err().to_string().contains("left_above"));
}

#[test]
fn passes_on_what_is_left_are_the_same_on_one_and_two_threads() {
    let s = surface(waves(30));
    let (region, _) = region_of(&s);
    let on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        let settings = LaySettings { max_step_over: STRIP, ..LaySettings::default() };
        pool.install(|| lay_passes(&s, &region, &planes(oblique()), &settings, &|_| STRIP, &Silent)).unwrap()
    };
    assert_eq!(on(1), on(2));
}
