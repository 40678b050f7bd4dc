//! Least distance of a body over a straight edge.

use nalgebra::{Point3, Vector3};

use crate::body::Body;

/// Goal at which a search for a least distance may stop, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal {
    /// A distance of at most this is as good as the least.
    pub(crate) enough: f64,
    /// A least distance above this is of no interest.
    pub(crate) beyond: f64,
}

/// A point, its distance from the body, and the gradient there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) point: Point3<f64>,
    pub(crate) distance: f64,
    pub(crate) gradient: Vector3<f64>,
}

impl Sample {
    #[inline(always)]
    pub(crate) fn at(body: &impl Body, point: Point3<f64>) -> Self {
        let (distance, gradient) = body.distance(&point);
        Self { point, distance, gradient }
    }
}

/// The certified gap between the value found and the least one, mm. Smaller costs steps at grazing
/// edges; larger widens the band in which a verdict errs toward a hit.
pub(crate) const GAP: f64 = 1e-10;

/// Bound on steps: every third one halves the bracket, so 200 exhaust a double.
const MAX_STEPS: usize = 200;

/// A point of the open edge from `a` to `b` whose distance is the least on the edge to within
/// [`GAP`], or at most `goal.enough`. `None` where the least is at an end, or is proven larger than
/// `goal.beyond`.
///
/// The distance is convex on the edge, so two slopes of opposite sign bracket its least value, and
/// the crossing of the two tangents bounds it from below.
#[inline(always)]
pub(crate) fn least_within_edge(body: &impl Body, a: &Sample, b: &Sample, goal: Goal) -> Option<Sample> {
    let along = b.point - a.point;
    let (mut low, mut high) = (Tangent::new(0.0, a, &along), Tangent::new(1.0, b, &along));
    if !(low.slope < 0.0 && high.slope > 0.0) {
        return None;
    }
    let mut best: Option<Sample> = None;
    for step in 0..MAX_STEPS {
        let (t_crossing, bound) = low.crossing(&high);
        if bound > goal.beyond {
            return None;
        }
        if best.is_some_and(|s| s.distance <= goal.enough || s.distance - bound <= GAP) {
            return best;
        }
        // The crossing finds a kink at once, the secant of the slopes a smooth least value, the
        // middle ends the rest.
        let t = match step % 3 {
            0 => t_crossing,
            1 => (low.t * high.slope - high.t * low.slope) / (high.slope - low.slope),
            _ => 0.5 * (low.t + high.t),
        };
        let t = if low.t < t && t < high.t { t } else { 0.5 * (low.t + high.t) };
        if !(low.t < t && t < high.t) {
            return best;
        }
        let sample = Sample::at(body, a.point + along * t);
        let tangent = Tangent::new(t, &sample, &along);
        if best.is_none_or(|s| sample.distance < s.distance) {
            best = Some(sample);
        }
        if tangent.slope < 0.0 {
            low = tangent;
        } else if tangent.slope > 0.0 {
            high = tangent;
        } else {
            // Level: the least value, or inside the body.
            return (sample.distance <= goal.beyond).then_some(sample);
        }
    }
    best
}

/// Value and slope of the distance at a parameter of the edge.
#[derive(Clone, Copy)]
struct Tangent {
    t: f64,
    distance: f64,
    slope: f64,
}

impl Tangent {
    #[inline(always)]
    fn new(t: f64, sample: &Sample, along: &Vector3<f64>) -> Self {
        Self { t, distance: sample.distance, slope: sample.gradient.dot(along) }
    }

    /// Where this falling tangent meets a rising one farther on, and the value there.
    #[inline(always)]
    fn crossing(&self, rising: &Self) -> (f64, f64) {
        let rise = rising.distance - self.distance - rising.slope * (rising.t - self.t);
        let step = rise / (self.slope - rising.slope);
        (self.t + step, self.distance + self.slope * step)
    }
}
