use nalgebra::Vector3;

use crate::error::PathError;
use crate::layout::field::gradients::{facet_gradient, vertex_gradients};
use crate::layout::levels::Band;
use crate::layout::strip_width::{StripWidth, least, vertex_widths};
use crate::strategy::patch::Patch;
use crate::strategy::settings::LaySettings;
use crate::strategy::size::StepOverCause;

/// Steps of level that strip widths allow a field.
pub(crate) struct FieldBands {
    /// Gradient of the level at each vertex.
    pub(crate) gradients: Vec<Vector3<f64>>,
    /// Largest step of level at each vertex.
    pub(crate) limits: Vec<f64>,
    /// Of each triangle, the least of its corners.
    pub(crate) bands: Vec<Band>,
    pub(crate) cause: StepOverCause,
}

/// Share of the mean slope on its level that a place has to have. Flatter places count as wide
/// strips. Larger: strips that narrow toward one end of a pass would be too wide at the other.
/// Smaller: where the field flows around a hole or past a bay, it is flat, and multiplies the
/// passes.
const LEAST_SHARE: f64 = 0.2;

impl FieldBands {
    /// Of the levels of a patch.
    ///
    /// # Errors
    /// When a width is NaN.
    pub(crate) fn of(patch: &Patch, settings: &LaySettings, strip_width: StripWidth) -> Result<Self, PathError> {
        let gradients = vertex_gradients(patch, |t| patch.mesh.triangles()[t].map(|v| patch.levels[v as usize]));
        let widths = vertex_widths(patch, |v| Some(gradients[v]), settings, strip_width)?;
        let mean = MeanSlope::of(patch);
        let slopes: Vec<f64> = smooth_slopes(patch, &mean)
            .into_iter()
            .zip(&gradients)
            .map(|(smooth, gradient)| if gradient.norm() < FLAT * smooth { gradient.norm() } else { smooth })
            .collect();
        let floor = |v: usize| (LEAST_SHARE * mean.at(patch.levels[v])).max(f64::MIN_POSITIVE);
        let limit = |v: usize| widths[v].max(settings.min_step_over) * slopes[v].max(floor(v));
        let limits: Vec<f64> = (0..widths.len()).map(limit).collect();
        let band = |corners: &[u32; 3]| {
            let v = corners.map(|v| v as usize);
            Band {
                low: least(v.map(|v| patch.levels[v])),
                high: -least(v.map(|v| -patch.levels[v])),
                limit: least(v.map(|v| limits[v])),
                requested: least(v.map(|v| widths[v] * slopes[v])),
                slope: least(v.map(|v| slopes[v].max(floor(v)))),
            }
        };
        let bands = patch.mesh.triangles().iter().map(band).collect();
        let largest = settings.max_step_over;
        let cause = StepOverCause { largest, is_largest: widths.iter().all(|&w| w >= largest) };
        Ok(Self { gradients, limits, bands, cause })
    }

    /// Level and limit at both ends of each edge of the patch.
    pub(crate) fn edges<'a>(&'a self, patch: &'a Patch) -> impl Iterator<Item = [(f64, f64); 2]> + 'a {
        let end = |v: u32| (patch.levels[v as usize], self.limits[v as usize]);
        (0..patch.edges.len() as u32).map(move |e| patch.edges.vertices(e).map(end))
    }
}

/// Mean slope of the field by its level.
struct MeanSlope {
    /// Mean level and slope of the triangles of each range of levels, in rising order.
    knots: Vec<(f64, f64)>,
}

/// Ranges of level with a mean of their own, at most.
const MOST_RANGES: usize = 64;
/// Rows of triangles that make a range.
const ROWS: f64 = 4.0;

impl MeanSlope {
    fn of(patch: &Patch) -> Self {
        let n = ((patch.mesh.triangles().len() as f64).sqrt() / ROWS) as usize;
        let n = n.clamp(1, MOST_RANGES);
        let used = || patch.mesh.triangles().iter().flatten().map(|&v| patch.levels[v as usize]);
        let (lowest, highest) = used().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), l| (a.min(l), b.max(l)));
        let step = ((highest - lowest) / n as f64).max(f64::MIN_POSITIVE);
        let mut sums = vec![(0.0, 0.0, 0.0); n];
        for facet in facets(patch) {
            let sum = &mut sums[(((facet.level - lowest) / step) as usize).min(n - 1)];
            sum.0 += facet.level * facet.area;
            sum.1 += facet.slope * facet.area;
            sum.2 += facet.area;
        }
        let filled = sums.into_iter().filter(|sum| sum.2 > 0.0);
        Self { knots: filled.map(|(level, slope, area)| (level / area, slope / area)).collect() }
    }

    /// Linear between the knots, and up to one distance of them beyond the last ones.
    fn at(&self, level: f64) -> f64 {
        let k = self.knots.partition_point(|knot| knot.0 <= level).clamp(1, self.knots.len().max(2) - 1);
        match self.knots.get(k - 1..=k) {
            Some(&[(from, slope), (to, next)]) => {
                let share = ((level - from) / (to - from)).clamp(-1.0, 2.0);
                (slope + (next - slope) * share).max(0.5 * slope.min(next))
            }
            _ => self.knots.first().map_or(1.0, |knot| knot.1),
        }
    }
}

/// A triangle of a patch as far as the field goes.
struct FacetBand {
    triangle: usize,
    area: f64,
    level: f64,
    slope: f64,
}

fn facets<'a>(patch: &'a Patch) -> impl Iterator<Item = FacetBand> + 'a {
    patch.mesh.triangles().iter().enumerate().filter_map(|(triangle, corners)| {
        let levels = corners.map(|v| patch.levels[v as usize]);
        let slope = facet_gradient(&patch.mesh.corners(triangle), levels)?.norm();
        let area = 0.5 * patch.mesh.scaled_normal(triangle).norm();
        Some(FacetBand { triangle, area, level: levels.iter().sum::<f64>() / 3.0, slope })
    })
}

/// Times that slopes are averaged between vertices and triangles.
const ROUNDS: usize = 4;

/// A slope below this share of the smooth one is no noise: the field is flat there.
const FLAT: f64 = 0.8;

/// Slopes at the vertices: the mean by level, times a smooth share of it.
///
/// The slope of a linear field jumps from triangle to triangle by far more than the spacing of
/// its levels is off, which is a sum over a strip. The mean by level has no noise and no bias at
/// borders, and what is left differs little between neighbours, so it may be smoothed.
fn smooth_slopes(patch: &Patch, mean: &MeanSlope) -> Vec<f64> {
    let facets: Vec<FacetBand> = facets(patch).collect();
    let mut of_facets: Vec<f64> = facets.iter().map(|f| f.slope / mean.at(f.level)).collect();
    let n = patch.mesh.vertices().len();
    let mut shares = vec![0.0; n];
    for _ in 0..ROUNDS {
        let mut sums = vec![(0.0, 0.0); n];
        for (facet, share) in facets.iter().zip(&of_facets) {
            for &v in &patch.mesh.triangles()[facet.triangle] {
                sums[v as usize].0 += share * facet.area;
                sums[v as usize].1 += facet.area;
            }
        }
        shares = sums.into_iter().map(|(sum, area)| if area > 0.0 { sum / area } else { 0.0 }).collect();
        for (facet, share) in facets.iter().zip(&mut of_facets) {
            *share = patch.mesh.triangles()[facet.triangle].map(|v| shares[v as usize]).iter().sum::<f64>() / 3.0;
        }
    }
    shares.iter().zip(&patch.levels).map(|(share, &level)| share * mean.at(level)).collect()
}
