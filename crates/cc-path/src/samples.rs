//! Points spread evenly over a region of the drive surface: where it is measured what a program leaves.

use facemill_surface_model::Surface;
use nalgebra::{Point3, Unit, Vector3};

use crate::region::triangles_of;
use crate::{PathError, Region, Strategy};

/// Point of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionSample {
    /// The point, on a facet, workpiece frame.
    pub position: Point3<f64>,
    /// Outward normal of its facet.
    pub normal: Unit<Vector3<f64>>,
    /// Facet, as an index into the surface's mesh.
    pub triangle: u32,
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

/// Plastic numbers of the plane: multiples of them, modulo 1, fill a square more evenly than random numbers (the R2 sequence of
/// M. Roberts, 2018).
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

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

    /// Points spread evenly over the region, one for each `area_each` (mm², above 0); the same ones for the same region.
    pub fn samples(&self, area_each: f64) -> Vec<RegionSample> {
        let mut samples = Vec::new();
        let (mut sum, mut index) = (0.5, 0_u64);
        for &triangle in &self.triangles {
            let Some(normal) = self.surface.facet_normal(triangle) else { continue };
            sum += self.area(triangle) / area_each;
            let [a, b, c] = self.surface.mesh().corners(triangle as usize);
            while sum >= 1.0 {
                sum -= 1.0;
                index += 1;
                let [u, v] = PLASTIC.map(|step| (index as f64 * step).fract());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let position = a + (b - a) * u + (c - a) * v;
                if self.contains(triangle, &position) {
                    samples.push(RegionSample { position, normal, triangle });
                }
            }
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_kit::{cylinder, plane, surface};
    use crate::{CylindricalSections, ParallelPlanes};

    #[test]
    fn samples_are_as_many_as_the_area_of_any_part_asks_for() {
        // Facets of very different sizes.
        let s = surface(plane(100.0, 60.0, 37, 3));
        let region = Region::default();
        let asked = AskedRegion::new(&s, &region, None).expect("a plane");
        let samples = asked.samples(0.5);
        assert!((samples.len() as f64 - 12_000.0).abs() <= 1.0, "{}", samples.len());
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
        assert!((samples.len() as f64 / 2100.0 - 1.0).abs() < 0.02, "{}", samples.len());
        let sections = CylindricalSections {
            axis_origin: Point3::from(middle),
            axis_direction: Vector3::z_axis(),
            from_radius: 10.0,
            to_radius: 20.0,
        };
        let strategy = Strategy::CylindricalSections(sections);
        let samples = AskedRegion::new(&s, &region, Some(&strategy)).expect("a plane").samples(1.0);
        let ring = std::f64::consts::PI * 300.0;
        assert!((samples.len() as f64 / ring - 1.0).abs() < 0.03, "{}", samples.len());
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
