//! A cutter that goes back along its axis from where it has cut.

use facemill_cl_data::ClPoint;
use nalgebra::Point3;

use crate::run::segments::Segment;

/// Where the last cut ended, and what its flute has been in there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutEnd {
    cl: ClPoint,
    /// Height of the flute, mm.
    flute: f64,
    /// How far ways may be off, mm.
    slack: f64,
}

/// Sine of the angle between two axes that are the same.
const SAME_AXIS: f64 = 1e-6;

impl CutEnd {
    /// `tolerance` is that of ways, mm.
    pub(crate) fn new(cl: ClPoint, flute: f64, tolerance: f64) -> Self {
        Self { cl, flute, slack: 2.0 * tolerance }
    }

    /// Whether a rapid goes along the axis of the end of the cut, out of it, and a place beside it
    /// is no higher than the flute was: there it comes no nearer to anything than the flute has
    /// been.
    pub(crate) fn has_been_beside(&self, rapid: &Segment, place: &Point3<f64>) -> bool {
        self.is_behind(&rapid.from) && self.is_behind(&rapid.to) && self.height_of(place) <= self.flute + self.slack
    }

    /// Whether the tool is behind the end of the cut, on its axis.
    fn is_behind(&self, cl: &ClPoint) -> bool {
        let axis = self.cl.axis.into_inner();
        let (way, height) = (cl.tip - self.cl.tip, self.height_of(&cl.tip));
        cl.axis.cross(&axis).norm() <= SAME_AXIS
            && cl.axis.dot(&axis) > 0.0
            && (way - axis * height).norm() <= self.slack
            && height >= -self.slack
    }

    fn height_of(&self, p: &Point3<f64>) -> f64 {
        (p - self.cl.tip).dot(&self.cl.axis)
    }
}
