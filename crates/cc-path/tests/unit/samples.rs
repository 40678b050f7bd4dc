use super::*;
use crate::sections::{CylindricalSections, ParallelPlanes};
use crate::test_kit::{cylinder, grid, plane, surface};
use facemill_cl_data::Aabb;
use facemill_surface_model::TriMesh;

/// Rectangle with corners at ±x/2 and ±y/2, its facets numbered along x or along y.
fn plate(x: f64, y: f64, n: u32, m: u32, along_y: bool) -> Surface {
    let at = |u: f64, v: f64| Point3::new(x * (u - 0.5), y * (v - 0.5), 0.0);
    let mesh = if along_y { grid(m, n, |u, v| at(v, 1.0 - u)) } else { grid(n, m, at) };
    surface(mesh)
}

fn spread(samples: &[RegionSample]) -> impl Iterator<Item = &RegionSample> {
    samples.iter().filter(|s| s.area > 0.0)
}

#[test]
fn shares_and_extremes_do_not_depend_on_how_a_surface_is_divided_into_facets() {
    // Passes 6 mm apart leave the highest tenth of each strip.
    let height = |s: &RegionSample, k: usize| ((s.position[k] + 100.0) / 6.0).fract();
    let region = Region::default();
    let mut first: Option<Vec<Point3<f64>>> = None;
    for (n, m, along_y) in [(6, 4, false), (600, 80, true), (600, 80, false), (7, 240, true), (1, 53, false)] {
        let s = plate(60.0, 42.0, n, m, along_y);
        let samples = RequestedRegion::new(&s, &region, None).expect("a plate").samples(0.5);
        let case = format!("{n} x {m}, along y {along_y}");
        for k in [0, 1] {
            let high: f64 = spread(&samples).filter(|s| height(s, k) > 0.9).map(|s| s.area).sum();
            assert!((high / 252.0 - 1.0).abs() < 0.06, "{case}: {high} mm2 of 252");
            let largest = spread(&samples).map(|s| height(s, k)).fold(0.0, f64::max);
            assert!(largest > 0.99, "{case}: {largest}");
        }
        let positions: Vec<Point3<f64>> = spread(&samples).map(|s| s.position).collect();
        let of_first = first.get_or_insert_with(|| positions.clone());
        assert_eq!(positions.len(), of_first.len(), "{case}");
        assert!(positions.iter().zip(&*of_first).all(|(a, b)| (a - b).norm() < 1e-9), "{case}");
    }
}

#[test]
fn areas_of_samples_are_those_of_the_surface_at_every_inclination() {
    for (n, m) in [(4, 60), (300, 7)] {
        let s = surface(cylinder(50.0, 100.0, 1.5, n, m));
        let region = Region::default();
        let requested = RequestedRegion::new(&s, &region, None).expect("a cylinder");
        let samples = requested.samples(1.0);
        let sum: f64 = samples.iter().map(|s| s.area).sum();
        assert!((sum / requested.facet_area() - 1.0).abs() < 0.01, "{sum} of {}", requested.facet_area());
        let n = spread(&samples).count() as f64;
        assert!((n / requested.facet_area() - 1.0).abs() < 0.01, "{n} of {}", requested.facet_area());
    }
}

#[test]
fn the_border_of_a_region_has_samples_without_area() {
    let s = plate(60.0, 42.0, 30, 4, true);
    let region = Region::default();
    let samples = RequestedRegion::new(&s, &region, None).expect("a plate").samples(1.0);
    for (axis, half) in [(0, 30.0), (1, 21.0)] {
        for side in [-half, half] {
            let on = samples.iter().filter(|s| (s.position[axis] - side).abs() < 1e-9 && s.area == 0.0).count();
            assert!((on as f64 - 2.0 * (51.0 - half)).abs() <= 3.0, "{axis} {side}: {on}");
        }
    }
    let inside = |s: &&RegionSample| s.position.x.abs() < 29.999 && s.position.y.abs() < 20.999;
    assert!(samples.iter().filter(inside).all(|s| s.area > 0.0));
}

#[test]
fn points_around_a_sample_reach_as_far_as_its_neighbours_and_no_farther_than_the_region() {
    let s = surface(cylinder(50.0, 100.0, 1.2, 4, 60));
    let bounds = Some(Aabb { min: Point3::new(20.0, -100.0, 0.0), max: Point3::new(30.0, 100.0, 100.0) });
    let region = Region { bounds, ..Region::default() };
    let requested = RequestedRegion::new(&s, &region, None).expect("a cylinder");
    let samples = requested.samples(20.0);
    let step = 20.0_f64.sqrt() / 4.0;
    for sample in &samples {
        let near = requested.around(sample, step);
        assert!(near.iter().all(|p| (20.0..=30.0).contains(&p.position.x) && p.area == 0.0));
        assert!(near.iter().all(|p| (p.position - sample.position).norm() < 4.3 * step));
        assert!(near.len() >= 12, "{}", near.len());
    }
}

#[test]
fn a_needle_without_end_takes_no_more_points_than_others() {
    let needle = TriMesh::new(
        vec![Point3::new(0.0, 0.0, 0.0), Point3::new(1e9, 1e9, 0.0), Point3::new(1e9, 1e9 + 1e-6, 0.0)],
        vec![[0, 1, 2]],
    );
    let s = surface(needle.expect("a triangle"));
    let region = Region::default();
    let Ok(requested) = RequestedRegion::new(&s, &region, None) else { return };
    assert!(requested.samples(1e-3).len() < 3_000_000);
}

#[test]
fn samples_are_as_many_as_the_area_of_any_part_asks_for() {
    // Facets of very different sizes.
    let s = surface(plane(100.0, 60.0, 37, 3));
    let region = Region::default();
    let requested = RequestedRegion::new(&s, &region, None).expect("a plane");
    let samples = requested.samples(0.5);
    let samples: Vec<RegionSample> = spread(&samples).copied().collect();
    assert!((samples.len() as f64 - 12_000.0).abs() <= 100.0, "{}", samples.len());
    let low = samples.iter().map(|s| s.position.x).fold(f64::INFINITY, f64::min);
    for k in 0..10 {
        let part = samples.iter().filter(|s| ((s.position.x - low) / 10.0) as i32 == k).count();
        assert!((part as f64 / 1200.0 - 1.0).abs() < 0.03, "strip {k}: {part}");
    }
}

fn requested(strategy: &Strategy) -> RequestedStrategy<'_> {
    RequestedStrategy { strategy, corner_radius: 0.0 }
}

#[test]
fn stated_levels_bound_the_region_and_nothing_else_does() {
    let s = surface(plane(100.0, 60.0, 10, 6));
    let (region, x) = (Region::default(), Vector3::x_axis());
    let middle =
        s.mesh().vertices().iter().fold(Vector3::zeros(), |sum, v| sum + v.coords) / s.mesh().vertices().len() as f64;
    let planes = ParallelPlanes { origin: Point3::from(middle), normal: x, from: Some(-10.0), to: Some(25.0) };
    let strategy = Strategy::ParallelPlanes(planes);
    let samples = RequestedRegion::new(&s, &region, Some(requested(&strategy))).expect("a plane").samples(1.0);
    let area = spread(&samples).map(|s| s.area).sum::<f64>();
    assert!((area / 2100.0 - 1.0).abs() < 0.02, "{area}");
    let sections = CylindricalSections {
        axis_origin: Point3::from(middle),
        axis_direction: Vector3::z_axis(),
        from_radius: 10.0,
        to_radius: 20.0,
    };
    let strategy = Strategy::CylindricalSections(sections);
    let samples = RequestedRegion::new(&s, &region, Some(requested(&strategy))).expect("a plane").samples(1.0);
    let ring = std::f64::consts::PI * 300.0;
    let area = spread(&samples).map(|s| s.area).sum::<f64>();
    assert!((area / ring - 1.0).abs() < 0.03, "{area}");
}

#[test]
fn every_sample_is_on_its_facet() {
    let s = surface(cylinder(50.0, 100.0, 1.2, 4, 60));
    let region = Region::default();
    for sample in RequestedRegion::new(&s, &region, None).expect("a cylinder").samples(20.0) {
        let [a, ..] = s.mesh().corners(sample.triangle as usize);
        assert!(sample.normal.dot(&(sample.position - a)).abs() < 1e-9);
        assert!(s.closest_point(&sample.position, 1.0).is_some_and(|p| (p.position - sample.position).norm() < 1e-9));
    }
}
