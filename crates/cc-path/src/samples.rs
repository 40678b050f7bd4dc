//! Points spread evenly over a region of the drive surface: where it is measured what a program
//! leaves.

pub(crate) mod lattice;
pub(crate) mod line_band;
pub(crate) mod region_lines;

use facemill_cl_data::Aabb;
use facemill_surface_model::{Surface, SurfacePoint};
use nalgebra::{Point3, Unit, Vector3};

use crate::error::PathError;
use crate::region::{Region, triangles_of};
use crate::samples::lattice::{Lattice, LatticePoint, side_of};
use crate::samples::line_band::LineBand;
use crate::sections::Sections;
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
    /// Area of the region that it counts for, mm²; 0 on a border, which is a line, and where an
    /// extreme is looked for.
    pub area: f64,
    /// Length of the region that it counts for, mm, where the region is a line: along an edge or
    /// root of width 0. Elsewhere 0.
    pub length: f64,
}

impl RegionSample {
    /// Area that it counts for, mm², or on a region that is a line, length, mm.
    pub fn weight(&self) -> f64 {
        self.area + self.length
    }
}

/// Strategy that passes are to be laid by, with what its extent depends on.
#[derive(Clone, Copy, Debug)]
pub struct RequestedStrategy<'a> {
    /// The strategy.
    pub strategy: &'a Strategy,
    /// Radius of the cutter's corner that rolls along a root between groups, mm.
    pub corner_radius: f64,
}

/// Region that an operation has to cut, before any pass is laid on it.
#[derive(Clone, Debug)]
pub struct RequestedRegion<'a> {
    surface: &'a Surface,
    region: &'a Region,
    /// Those of the strategy, and those of the region.
    ranges: [Option<Sections>; 2],
    band: Option<LineBand>,
    is_in: Vec<bool>,
    triangles: Vec<u32>,
}

impl<'a> RequestedRegion<'a> {
    /// The facets that the region holds, bounded by its box and, if the strategy has one, by the
    /// range of levels or the width along an edge or root.
    ///
    /// # Errors
    /// When the region holds no facet, names a group that the surface does not have, or has no line
    /// such as the strategy follows.
    pub fn new(
        surface: &'a Surface,
        region: &'a Region,
        strategy: Option<RequestedStrategy<'a>>,
    ) -> Result<Self, PathError> {
        let triangles = triangles_of(surface, region)?;
        let mut is_in = vec![false; surface.mesh().triangles().len()];
        triangles.iter().for_each(|&t| is_in[t as usize] = true);
        let ranges = [strategy.and_then(|s| s.strategy.sections()), region.between];
        let band = strategy.map(|s| LineBand::of(surface, region, s.strategy, s.corner_radius)).transpose()?.flatten();
        Ok(Self { surface, region, ranges, band, is_in, triangles })
    }

    /// Whether the region holds a point of a facet, borders included; of a region by what is left,
    /// without its overlap. One along an edge or root of width 0 is a line, and holds none.
    pub fn contains(&self, triangle: u32, point: &Point3<f64>) -> bool {
        self.is_bounding(triangle, point) && self.band.as_ref().is_none_or(|band| band.contains(triangle, point))
    }

    /// Whether groups, box, levels and what is left hold a point of a facet.
    fn is_bounding(&self, triangle: u32, point: &Point3<f64>) -> bool {
        let in_box = self.region.bounds.is_none_or(|b| (0..3).all(|k| (b.min[k]..=b.max[k]).contains(&point[k])));
        let is_left = || {
            self.region.left.as_ref().is_none_or(|left| {
                self.surface.facet_normal(triangle).is_some_and(|normal| left.contains(point, &normal))
            })
        };
        self.is_in[triangle as usize] && in_box && self.in_levels(point, 0.0) && is_left()
    }

    /// Whether the ranges of levels, widened by so much (mm), hold a point.
    fn in_levels(&self, point: &Point3<f64>, within: f64) -> bool {
        self.ranges.iter().flatten().all(|sections| {
            let (from, to) = sections.range();
            (from - within..=to + within).contains(&sections.level(point))
        })
    }

    /// Box around the region, if it has one that bounds it.
    fn bounds(&self) -> Option<Aabb> {
        let of_left = self.region.left.as_ref().map(|left| left.bounds());
        let both = |a: Aabb, b: Aabb| Aabb { min: a.min.sup(&b.min), max: a.max.inf(&b.max) };
        self.region.bounds.into_iter().chain(of_left).reduce(both)
    }

    /// Whether the region comes within a distance (mm) of a point; box and levels are widened by
    /// as much.
    pub fn is_near(&self, point: &Point3<f64>, within: f64) -> bool {
        let in_box = self.region.bounds.is_none_or(|b| b.dilated(within).contains(point));
        let is_on = || self.surface.closest_point_where(point, within, |t| self.is_in[t as usize]).is_some();
        in_box && self.in_levels(point, within) && is_on()
    }

    /// Whether the region holds the foot of a point, at most `within` (mm) from it. At the foot the
    /// way to the point is across the facet: of a point beside the border of the surface, whose
    /// nearest place is on that border, it leans by more than `along` of its length.
    pub fn holds_foot(&self, point: &Point3<f64>, within: f64, along: f64) -> bool {
        let foot = self.surface.closest_point_where(point, within, |t| self.is_in[t as usize]);
        foot.is_some_and(|foot| {
            let way = point - foot.position;
            let is_across = self.surface.facet_normal(foot.triangle).is_some_and(|normal| {
                let beside = way - normal.into_inner() * way.dot(&normal);
                beside.norm() <= along * way.norm() + ON_FACET
            });
            is_across && self.contains(foot.triangle, &foot.position)
        })
    }

    /// Whether groups and cone hold a facet.
    pub fn holds_facet(&self, triangle: u32) -> bool {
        self.is_in[triangle as usize]
    }

    /// Area of its facets, mm², before box and levels bound them.
    pub fn facet_area(&self) -> f64 {
        self.triangles.iter().fold(0.0, |sum, &t| sum + self.area(t))
    }

    fn area(&self, triangle: u32) -> f64 {
        0.5 * self.surface.mesh().scaled_normal(triangle as usize).norm()
    }

    /// Points spread evenly over the region, about one for each `area_each` (mm², above 0) of its
    /// facets, each with the area that it counts for; behind them points on its border, without
    /// area, about as far apart.
    ///
    /// Facets are looked at along the axis of the workpiece frame that is nearest to their normal.
    /// The plane across that axis has square cells with one point each, at a place that depends on
    /// the cell alone: the points do not follow the facets, are the same for every order and
    /// fineness of the same facets, and never stand in rows. In thin facets without end there are
    /// fewer.
    ///
    /// A region that is a line has points along it, as far apart, each with the length that it
    /// counts for.
    pub fn samples(&self, area_each: f64) -> Vec<RegionSample> {
        if let Some(lines) = self.band.as_ref().and_then(LineBand::lines) {
            let points = lines.points(self.surface, |t| self.is_in[t as usize], area_each.sqrt());
            let sample = |(foot, length): (SurfacePoint, f64)| {
                let (position, triangle) = (foot.position, foot.triangle);
                let normal = self.surface.facet_normal(triangle).filter(|_| self.is_bounding(triangle, &position))?;
                Some(RegionSample { position, normal, triangle, area: 0.0, length })
            };
            return points.into_iter().filter_map(sample).collect();
        }
        let mesh = self.surface.mesh();
        let facets = || {
            let solid = self.triangles.iter().filter_map(|&t| Some((t, self.surface.facet_normal(t)?)));
            solid.map(|(t, normal)| (t, mesh.corners(t as usize), normal))
        };
        let bounds = self.bounds();
        let lattice = Lattice::new(side_of(facets(), area_each, bounds.as_ref()), bounds.as_ref());
        let mut points: Vec<LatticePoint> = facets().flat_map(|facet| lattice.on_facet(facet)).collect();
        points.sort_by(LatticePoint::order);
        let mut border = lattice.on_border(mesh, &self.triangles, |t| self.surface.facet_normal(t));
        border.sort_by(LatticePoint::order);
        points.extend(border);
        let samples = points.iter().map(|point| point.sample);
        samples.filter(|s| self.contains(s.triangle, &s.position)).collect()
    }

    /// Points of the region around a sample, `step` (mm, above 0) apart up to three steps to all
    /// sides, without area: to find an extreme between samples.
    pub fn around(&self, sample: &RegionSample, step: f64) -> Vec<RegionSample> {
        let across = if sample.normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let u = sample.normal.cross(&across).normalize();
        let v = sample.normal.cross(&u);
        let offsets = (-3..=3).flat_map(|i| (-3..=3).map(move |j| (f64::from(i), f64::from(j))));
        let beside = |(i, j): (f64, f64)| self.sample_at(&(sample.position + (u * i + v * j) * step), 3.0 * step);
        offsets.filter_map(beside).collect()
    }

    /// Returns the point of the surface that is nearest to `point`, without area; `None` if there
    /// is none within `reach` (mm), or it is outside the region.
    pub fn sample_at(&self, point: &Point3<f64>, reach: f64) -> Option<RegionSample> {
        let foot = self.surface.closest_point(point, reach)?;
        let normal = self.surface.facet_normal(foot.triangle)?;
        let is_in = self.contains(foot.triangle, &foot.position);
        is_in.then_some(RegionSample {
            position: foot.position,
            normal,
            triangle: foot.triangle,
            area: 0.0,
            length: 0.0,
        })
    }
}

/// Distance of a point from its facet that is rounding, mm.
const ON_FACET: f64 = 1e-6;

#[cfg(test)]
#[path = "../tests/unit/samples.rs"]
mod tests;
