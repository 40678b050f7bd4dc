//! Points spread evenly over a region of the drive surface: where it is measured what a program leaves.

pub(crate) mod lattice;

use facemill_surface_model::Surface;
use nalgebra::{Point3, Unit, Vector3};

use crate::error::PathError;
use crate::region::{Region, triangles_of};
use crate::samples::lattice::{Lattice, LatticePoint, side_of};
use crate::strategy::Strategy;

/// Point of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionSample {
    /// The point, on a facet, workpiece frame.
    pub position: Point3<f64>,
    /// Outward normal of its facet.
    pub normal: Unit<Vector3<f64>>,
    /// Facet, as an index into the surface's mesh.
    pub triangle: u32,
    /// Area of the region that it counts for, mm²; 0 on a border, which is a line, and where an extreme is looked for.
    pub area: f64,
}

/// The region of an operation: what is asked to be cut, before any pass is laid on it.
#[derive(Clone, Debug)]
pub struct AskedRegion<'a> {
    surface: &'a Surface,
    region: &'a Region,
    strategy: Option<&'a Strategy>,
    is_in: Vec<bool>,
    triangles: Vec<u32>,
}

impl<'a> AskedRegion<'a> {
    /// The facets that the region holds, bounded by its box and by the levels that the strategy states.
    ///
    /// # Errors
    /// When the region holds no facet, or names a group that the surface does not have.
    pub fn new(surface: &'a Surface, region: &'a Region, strategy: Option<&'a Strategy>) -> Result<Self, PathError> {
        let triangles = triangles_of(surface, region)?;
        let mut is_in = vec![false; surface.mesh().triangles().len()];
        triangles.iter().for_each(|&t| is_in[t as usize] = true);
        Ok(Self { surface, region, strategy, is_in, triangles })
    }

    /// Whether the region holds a point of a facet, borders included.
    pub fn contains(&self, triangle: u32, point: &Point3<f64>) -> bool {
        let in_box = self.region.bounds.is_none_or(|b| (0..3).all(|k| (b.min[k]..=b.max[k]).contains(&point[k])));
        let in_levels = self.strategy.is_none_or(|strategy| {
            let (from, to) = strategy.range();
            (from..=to).contains(&strategy.level(point))
        });
        self.is_in[triangle as usize] && in_box && in_levels
    }

    /// Area of its facets, mm², before box and levels bound them.
    pub fn facet_area(&self) -> f64 {
        self.triangles.iter().fold(0.0, |sum, &t| sum + self.area(t))
    }

    fn area(&self, triangle: u32) -> f64 {
        0.5 * self.surface.mesh().scaled_normal(triangle as usize).norm()
    }

    /// Points spread evenly over the region, about one for each `area_each` (mm², above 0) of its facets, each with the area that it counts
    /// for; behind them points on its border, without area, about as far apart.
    ///
    /// Facets are looked at along the axis of the workpiece frame that is nearest to their normal. The plane across that axis has square
    /// cells with one point each, at a place that depends on the cell alone: the points do not follow the facets, are the same for
    /// every order and fineness of the same facets, and never stand in rows. In thin facets without end there are fewer.
    pub fn samples(&self, area_each: f64) -> Vec<RegionSample> {
        let mesh = self.surface.mesh();
        let facets = || {
            let solid = self.triangles.iter().filter_map(|&t| Some((t, self.surface.facet_normal(t)?)));
            solid.map(|(t, normal)| (t, mesh.corners(t as usize), normal))
        };
        let bounds = self.region.bounds.as_ref();
        let lattice = Lattice::new(side_of(facets(), area_each, bounds), bounds);
        let mut points: Vec<LatticePoint> = facets().flat_map(|facet| lattice.on_facet(facet)).collect();
        points.sort_by(LatticePoint::order);
        let mut border = lattice.on_border(mesh, &self.triangles, |t| self.surface.facet_normal(t));
        border.sort_by(LatticePoint::order);
        points.extend(border);
        let samples = points.iter().map(|point| point.sample);
        samples.filter(|s| self.contains(s.triangle, &s.position)).collect()
    }

    /// Points of the region around a sample, `step` (mm, above 0) apart up to three steps to all sides, without area: to find an extreme
    /// between samples.
    pub fn around(&self, sample: &RegionSample, step: f64) -> Vec<RegionSample> {
        let across = if sample.normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let u = sample.normal.cross(&across).normalize();
        let v = sample.normal.cross(&u);
        let offsets = (-3..=3).flat_map(|i| (-3..=3).map(move |j| (f64::from(i), f64::from(j))));
        let on_surface = |(i, j): (f64, f64)| {
            let foot = self.surface.closest_point(&(sample.position + (u * i + v * j) * step), 3.0 * step)?;
            let normal = self.surface.facet_normal(foot.triangle)?;
            let is_in = self.contains(foot.triangle, &foot.position);
            is_in.then_some(RegionSample { position: foot.position, normal, triangle: foot.triangle, area: 0.0 })
        };
        offsets.filter_map(on_surface).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strategy::{CylindricalSections, ParallelPlanes};
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
        // What passes 6 mm apart leave: of each strip the highest tenth.
        let height = |s: &RegionSample, k: usize| ((s.position[k] + 100.0) / 6.0).fract();
        let region = Region::default();
        let mut first: Option<Vec<Point3<f64>>> = None;
        for (n, m, along_y) in [(6, 4, false), (600, 80, true), (600, 80, false), (7, 240, true), (1, 53, false)] {
            let s = plate(60.0, 42.0, n, m, along_y);
            let samples = AskedRegion::new(&s, &region, None).expect("a plate").samples(0.5);
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
            let asked = AskedRegion::new(&s, &region, None).expect("a cylinder");
            let samples = asked.samples(1.0);
            let sum: f64 = samples.iter().map(|s| s.area).sum();
            assert!((sum / asked.facet_area() - 1.0).abs() < 0.01, "{sum} of {}", asked.facet_area());
            let n = spread(&samples).count() as f64;
            assert!((n / asked.facet_area() - 1.0).abs() < 0.01, "{n} of {}", asked.facet_area());
        }
    }

    #[test]
    fn the_border_of_a_region_has_samples_without_area() {
        let s = plate(60.0, 42.0, 30, 4, true);
        let region = Region::default();
        let samples = AskedRegion::new(&s, &region, None).expect("a plate").samples(1.0);
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
        let asked = AskedRegion::new(&s, &region, None).expect("a cylinder");
        let samples = asked.samples(20.0);
        let step = 20.0_f64.sqrt() / 4.0;
        for sample in &samples {
            let near = asked.around(sample, step);
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
        let Ok(asked) = AskedRegion::new(&s, &region, None) else { return };
        assert!(asked.samples(1e-3).len() < 3_000_000);
    }

    #[test]
    fn samples_are_as_many_as_the_area_of_any_part_asks_for() {
        // Facets of very different sizes.
        let s = surface(plane(100.0, 60.0, 37, 3));
        let region = Region::default();
        let asked = AskedRegion::new(&s, &region, None).expect("a plane");
        let samples = asked.samples(0.5);
        let samples: Vec<RegionSample> = spread(&samples).copied().collect();
        assert!((samples.len() as f64 - 12_000.0).abs() <= 100.0, "{}", samples.len());
        let low = samples.iter().map(|s| s.position.x).fold(f64::INFINITY, f64::min);
        for k in 0..10 {
            let part = samples.iter().filter(|s| ((s.position.x - low) / 10.0) as i32 == k).count();
            assert!((part as f64 / 1200.0 - 1.0).abs() < 0.03, "strip {k}: {part}");
        }
    }

    #[test]
    fn stated_levels_bound_the_region_and_nothing_else_does() {
        let s = surface(plane(100.0, 60.0, 10, 6));
        let (region, x) = (Region::default(), Vector3::x_axis());
        let middle = s.mesh().vertices().iter().fold(Vector3::zeros(), |sum, v| sum + v.coords)
            / s.mesh().vertices().len() as f64;
        let planes = ParallelPlanes { origin: Point3::from(middle), normal: x, from: Some(-10.0), to: Some(25.0) };
        let strategy = Strategy::ParallelPlanes(planes);
        let samples = AskedRegion::new(&s, &region, Some(&strategy)).expect("a plane").samples(1.0);
        let area = spread(&samples).map(|s| s.area).sum::<f64>();
        assert!((area / 2100.0 - 1.0).abs() < 0.02, "{area}");
        let sections = CylindricalSections {
            axis_origin: Point3::from(middle),
            axis_direction: Vector3::z_axis(),
            from_radius: 10.0,
            to_radius: 20.0,
        };
        let strategy = Strategy::CylindricalSections(sections);
        let samples = AskedRegion::new(&s, &region, Some(&strategy)).expect("a plane").samples(1.0);
        let ring = std::f64::consts::PI * 300.0;
        let area = spread(&samples).map(|s| s.area).sum::<f64>();
        assert!((area / ring - 1.0).abs() < 0.03, "{area}");
    }

    #[test]
    fn every_sample_is_on_its_facet() {
        let s = surface(cylinder(50.0, 100.0, 1.2, 4, 60));
        let region = Region::default();
        for sample in AskedRegion::new(&s, &region, None).expect("a cylinder").samples(20.0) {
            let [a, ..] = s.mesh().corners(sample.triangle as usize);
            assert!(sample.normal.dot(&(sample.position - a)).abs() < 1e-9);
            assert!(
                s.closest_point(&sample.position, 1.0).is_some_and(|p| (p.position - sample.position).norm() < 1e-9)
            );
        }
    }
}
