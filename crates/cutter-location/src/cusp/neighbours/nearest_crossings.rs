//! The nearest passes so far.

use crate::cusp::cut_point::Strip;
use crate::cusp::neighbours::ends::BesideEnd;
use crate::cusp::neighbours::{Beside, Neighbour};

/// The nearest crossings so far, with their distances.
#[derive(Default)]
pub(super) struct NearestCrossings {
    nearest: [Option<(f64, Neighbour)>; 2],
    earlier: [Option<(f64, Neighbour)>; 2],
}

impl NearestCrossings {
    pub(super) fn take(&mut self, distance: f64, neighbour: Neighbour) {
        let side = usize::from(neighbour.is_left);
        put(&mut self.nearest[side], distance, neighbour);
        if neighbour.is_earlier {
            put(&mut self.earlier[side], distance, neighbour);
        }
    }

    /// Adds passes that end beside the point, where they are nearer than those that continue.
    pub(super) fn take_ends(&mut self, ends: &[BesideEnd]) {
        let crossings = NearestCrossings { nearest: self.nearest, earlier: self.earlier };
        for end in ends {
            let side = usize::from(end.neighbour.is_left);
            // Toward a pass that begins inside a strip, the ridge belongs to that pass if it is cut
            // later.
            if end.neighbour.is_earlier || end.is_of_border(crossings.nearest[side].is_some()) {
                end.put_into(&mut self.nearest[side], crossings.nearest[side].is_some());
            }
            if end.neighbour.is_earlier {
                end.put_into(&mut self.earlier[side], crossings.earlier[side].is_some());
            }
        }
    }

    /// Returns the distance beyond which no crossing is needed.
    pub(super) fn farthest(&self, reach: f64) -> f64 {
        let all = self.nearest.iter().chain(&self.earlier);
        all.map(|f| f.as_ref().map_or(reach, |(distance, _)| *distance)).fold(0.0, f64::max)
    }

    pub(super) fn beside(self) -> Beside {
        let only = |f: Option<(f64, Neighbour)>| f.map(|(_, neighbour)| neighbour);
        Beside { nearest: self.nearest.map(only), earlier: self.earlier.map(only) }
    }
}

impl BesideEnd {
    /// Returns whether the border of the cut area runs along here: nothing is cut beyond, or the
    /// point's own pass also ends here.
    fn is_of_border(&self, has_crossing: bool) -> bool {
        !has_crossing || self.is_at_own_end
    }

    fn put_into(&self, best: &mut Option<(f64, Neighbour)>, has_crossing: bool) {
        // Inside a strip the end acts as far as it is nearer to the places of the plane than the
        // point is.
        let longer = if self.is_of_border(has_crossing) { 1.0 } else { 1.0 + (self.gap / self.aside).powi(2) };
        let Neighbour { strip, arc, .. } = self.neighbour;
        let strip = Strip { step_over: strip.step_over * longer, ..strip };
        put(best, self.aside * longer, Neighbour { strip, arc: arc * longer, ..self.neighbour });
    }
}

/// Replaces the neighbour by a nearer one. Of equal distances, the same one stays whatever order
/// they come in.
fn put(best: &mut Option<(f64, Neighbour)>, distance: f64, neighbour: Neighbour) {
    let key = |n: &Neighbour| n.point.cc.position;
    let better = best
        .as_ref()
        .is_none_or(|(d, b)| (distance, key(&neighbour).coords.as_slice()) < (*d, key(b).coords.as_slice()));
    if better {
        *best = Some((distance, neighbour));
    }
}
