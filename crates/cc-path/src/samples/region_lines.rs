use facemill_surface_model::{Surface, SurfacePoint};
use nalgebra::Point3;

use crate::layout::scallop::surface_path::SurfacePath;

/// Most points on all lines together.
const MOST_POINTS: f64 = 100_000.0;

/// Lines on a surface that are a region without width: that of a single pass.
#[derive(Clone, Debug)]
pub(crate) struct RegionLines {
    paths: Vec<SurfacePath>,
}

impl RegionLines {
    pub(crate) fn new(paths: Vec<SurfacePath>) -> Self {
        Self { paths }
    }

    /// Points on the surface along the lines, about `spacing` (mm, above 0) apart, each with the
    /// length that it counts for.
    pub(crate) fn points(
        &self,
        surface: &Surface,
        is_in: impl Fn(u32) -> bool,
        spacing: f64,
    ) -> Vec<(SurfacePoint, f64)> {
        let length: f64 = self.paths.iter().map(SurfacePath::length).sum();
        let spacing = spacing.max(length / MOST_POINTS);
        // Between its nodes a line is a chord.
        let on_surface = |(p, length): (Point3<f64>, f64)| {
            surface.closest_point_where(&p, f64::INFINITY, &is_in).map(|foot| (foot, length))
        };
        self.paths.iter().flat_map(|path| along(path, spacing)).filter_map(on_surface).collect()
    }
}

/// Middles of equal parts of a path, with their length.
fn along(path: &SurfacePath, spacing: f64) -> Vec<(Point3<f64>, f64)> {
    let length = path.length();
    let n = (length / spacing).ceil().max(1.0);
    let each = length / n;
    let way_back = path.closed.then(|| [path.nodes[path.nodes.len() - 1], path.nodes[0]]);
    let mut points = Vec::new();
    let (mut before, mut next) = (0.0, 0.5 * each);
    for [a, b] in path.nodes.windows(2).map(|w| [w[0], w[1]]).chain(way_back) {
        let step = (b - a).norm();
        while next < before + step {
            points.push((a + (b - a) * ((next - before) / step), each));
            next += each;
        }
        before += step;
    }
    points
}
