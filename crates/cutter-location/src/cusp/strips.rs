//! Widths of the strips that a cutter leaves within a cusp, and the floors of cutting length that
//! follow from them.

use facemill_cl_data::{Aabb, CcPoint, Posture};
use facemill_surface_model::{CurvatureTensor, Tree};
use facemill_tool_model::{Cusp, Cutter, FeedCurvature, Outline, cusp_height_between, envelope_curvature};
use nalgebra::{Point3, Unit, Vector3};

use crate::cusp::cut_point::{CutPoint, feed_curvature};

/// Widest strips at a place of a surface, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripWidths {
    /// Across the feed as cut, in the posture as cut.
    pub as_cut: f64,
    /// In the best direction: across the least normal curvature, at the tilt as cut, with the axis
    /// leaning along the feed.
    pub widest: f64,
}

impl StripWidths {
    /// Returns the widest strips that stay within `cusp` (mm), each at most `largest` (mm), where
    /// a surface with this curvature is cut.
    ///
    /// The outline of the tilted cutter is exact, the surface its osculating circle across the
    /// feed, along which it bends and twists, and both passes have the same posture. Without a
    /// curvature the surface is a plane. The second width is that of rotate 0 along a principal
    /// direction: to the second order, of all directions and rotates at this tilt none leaves a
    /// wider strip.
    ///
    /// Derived in docs/method.md#efficiency.
    pub fn at(
        cutter: &Cutter,
        at: &CutPoint,
        curvature: Option<&CurvatureTensor>,
        (cusp, largest): (f64, f64),
    ) -> Self {
        let principal = curvature.map(CurvatureTensor::principal);
        let best = principal.map_or_else(FeedCurvature::default, |p| FeedCurvature {
            along: p.max,
            twist: 0.0,
            across: p.min,
        });
        let leaning = Posture { tilt: at.posture.tilt, rotate: 0.0 };
        Self {
            as_cut: strip_width(cutter, at.posture, &feed_curvature(curvature, &at.cc), cusp, largest),
            widest: strip_width(cutter, leaning, &best, cusp, largest),
        }
    }
}

/// Returns the widest strip between two passes of the same posture that leaves at most `cusp`
/// (mm) on a surface of this curvature; at most `largest` (mm), to 1e-6 of it.
///
/// The exact counterpart of √(8·cusp / κ), with κ the curvature of the [envelope over the
/// surface](envelope_curvature): the ridge is that of [`cusp_height_between`], and grows with the
/// step.
pub fn strip_width(cutter: &Cutter, posture: Posture, surface: &FeedCurvature, cusp: f64, largest: f64) -> f64 {
    let outline = Outline::new(cutter, posture);
    let root_of = |step: f64| match cusp_height_between(&outline, &outline, step, surface) {
        Cusp::Height(height) => height.sqrt(),
        Cusp::Uncut => f64::INFINITY,
    };
    let wanted = cusp.max(0.0).sqrt();
    let at_largest = root_of(largest);
    if at_largest <= wanted {
        return largest;
    }
    let (mut low, mut high) = ((0.0, 0.0), (largest, at_largest));
    let mut step = osculating_width(cutter, posture, surface, cusp).clamp(0.0, largest);
    // The root of the height grows nearly in proportion to the step, so the secant converges at
    // once. Every third step halves the bracket, whatever the outline's shape.
    for k in 0..MOST_STEPS {
        let root = root_of(step);
        if (root - wanted).abs() <= CLOSE * wanted || high.0 - low.0 <= CLOSE * largest {
            return step;
        }
        if root < wanted {
            low = (step, root)
        } else {
            high = (step, root)
        }
        let secant = low.0 + (high.0 - low.0) * (wanted - low.1) / (high.1 - low.1);
        let is_inside = low.0 < secant && secant < high.0;
        step = if k % 3 < 2 && is_inside { secant } else { 0.5 * (low.0 + high.0) };
    }
    low.0
}

/// Relative error of a width.
const CLOSE: f64 = 1e-7;

/// Upper bound of the steps to a width: 20 halvings among them alone give 1e-6 of the largest.
const MOST_STEPS: usize = 60;

/// Returns the width by the curvature at the contact: the second-order formula.
pub(crate) fn osculating_width(cutter: &Cutter, posture: Posture, surface: &FeedCurvature, cusp: f64) -> f64 {
    let bend = envelope_curvature(cutter, posture, surface);
    if bend > 0.0 { (8.0 * cusp / bend).sqrt() } else { f64::INFINITY }
}

/// Least cutting lengths of a region, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LengthFloors {
    /// Area of the region, mm².
    pub area: f64,
    /// ∫ dA / w with the width across the feed as cut.
    pub as_cut: f64,
    /// ∫ dA / w with the width in the best direction.
    pub least: f64,
}

impl LengthFloors {
    /// Adds an area (mm²) with these widths. An area without width adds an infinite length.
    pub fn add(&mut self, area: f64, widths: &StripWidths) {
        self.area += area;
        self.as_cut += area / widths.as_cut;
        self.least += area / widths.widest;
    }
}

/// Passes as they are cut, searchable for the cut nearest to a place.
#[derive(Clone, Debug)]
pub struct NearestCuts {
    passes: Vec<Vec<CutPoint>>,
    /// Pass of each segment, and the number of its first point.
    segments: Vec<[u32; 2]>,
    tree: Tree,
}

impl NearestCuts {
    /// Collects passes; those with fewer than two points are left out.
    pub fn new(passes: Vec<Vec<CutPoint>>) -> Self {
        let mut segments = Vec::new();
        let mut boxes = Vec::new();
        for (pass, points) in passes.iter().enumerate() {
            for (k, pair) in points.windows(2).enumerate() {
                segments.push([pass as u32, k as u32]);
                boxes.push(Aabb::of_points([&pair[0].cc.position, &pair[1].cc.position]));
            }
        }
        Self { tree: Tree::build(&boxes), passes, segments }
    }

    /// Returns the cut nearest to a place with this normal, on the straight way between two points
    /// of a pass: feed and normal blended, with the posture of the nearer point. Only walls that
    /// face the same half space count; of equally near ones the first. `None` without any.
    pub fn nearest(&self, place: &Point3<f64>, normal: &Unit<Vector3<f64>>) -> Option<CutPoint> {
        let distance_sq = |k: u32, _: f64| {
            let [a, b] = self.ends(k);
            let faces = a.cc.normal.dot(normal) > 0.0 || b.cc.normal.dot(normal) > 0.0;
            faces.then(|| (foot(place, [a, b]).1 - place).norm_squared())
        };
        let (segment, _) = self.tree.nearest(f64::INFINITY, |b| b.distance_sq(place), distance_sq)?;
        let [a, b] = self.ends(segment);
        let (t, position) = foot(place, [a, b]);
        let nearer = if t < 0.5 { a } else { b };
        let blend = |p: &Vector3<f64>, q: &Vector3<f64>| p * (1.0 - t) + q * t;
        let cc = CcPoint::new(position, blend(&a.cc.normal, &b.cc.normal), blend(&a.cc.feed, &b.cc.feed));
        Some(cc.map_or(*nearer, |cc| CutPoint { cc, posture: nearer.posture }))
    }

    fn ends(&self, segment: u32) -> [&CutPoint; 2] {
        let [pass, k] = self.segments[segment as usize].map(|n| n as usize);
        [&self.passes[pass][k], &self.passes[pass][k + 1]]
    }
}

/// Returns the share of the way and the point of it that is nearest to a place.
fn foot(place: &Point3<f64>, [a, b]: [&CutPoint; 2]) -> (f64, Point3<f64>) {
    let way = b.cc.position - a.cc.position;
    let length_sq = way.norm_squared();
    let t = if length_sq > 0.0 { ((place - a.cc.position).dot(&way) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (t, a.cc.position + way * t)
}

#[cfg(test)]
#[path = "../../tests/unit/cusp/strips.rs"]
mod tests;
