//! Anti-singing trailing edges.

use crate::spec_error::{SpecError, in_range, is_not_above};

/// Anti-singing trailing edge: a plane chamfer of the suction side, whose edges fix where the flow
/// leaves the blade, so that no vortices drive it into vibration.
///
/// In each section between two radii the chamfer leads from the end of the section, in the middle
/// of the rounded trailing edge, straight to the suction side, at an angle to the chord. It meets
/// the suction side in an edge. At both ends of the range it runs out: its depth grows from nothing
/// over 0.05 R, or a third of a shorter range.
///
/// ```
/// use facemill_sample_parts::{AntiSingingEdge, PropellerSeries, PropellerSpec, SpecError};
///
/// let edge = AntiSingingEdge::new(0.4, 0.95, 25.0_f64.to_radians())?;
/// let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0)?.with_anti_singing_edge(edge)?;
/// # Ok::<(), SpecError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AntiSingingEdge {
    from: f64,
    to: f64,
    angle: f64,
}

/// Radii over R on which the chamfer runs out, and on which columns beside it come back to their
/// places.
pub(crate) const RUN_OUT: f64 = 0.05;

/// Least length of the chamfer along the radius over R.
const LEAST_RANGE: f64 = 0.1;

/// Largest radius ratio of a chamfer: columns must be back in their places at the tip.
const LARGEST_RATIO: f64 = 1.0 - RUN_OUT;

/// Largest length of the chamfer over the chord.
const LONGEST: f64 = 0.2;

impl AntiSingingEdge {
    /// Returns a chamfer between two radii r/R, at an angle to the chord in rad.
    ///
    /// # Errors
    /// When the range is not between 0.2 and 0.95 and at least 0.1 long, or the angle not between
    /// 0.1 and 1.2.
    pub fn new(from: f64, to: f64, angle: f64) -> Result<Self, SpecError> {
        in_range("radius r/R where the anti-singing edge begins", from, 0.2, LARGEST_RATIO - LEAST_RANGE)?;
        in_range("radius r/R where the anti-singing edge ends", to, from + LEAST_RANGE, LARGEST_RATIO)?;
        in_range("angle of the anti-singing edge (rad)", angle, 0.1, 1.2)?;
        Ok(Self { from, to, angle })
    }

    /// Returns the radii r/R between which it is.
    pub fn range(&self) -> [f64; 2] {
        [self.from, self.to]
    }

    /// Returns its angle to the chord, rad.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Returns the share of its full depth at a radius ratio.
    pub(crate) fn depth(&self, ratio: f64) -> f64 {
        let run_out = RUN_OUT.min((self.to - self.from) / 3.0);
        smooth_step((ratio - self.from) / run_out) * smooth_step((self.to - ratio) / run_out)
    }

    /// Returns the rise of the chamfer over a whole chord, mm.
    pub(crate) fn rise(&self, chord: f64) -> f64 {
        self.angle.tan() * chord
    }

    /// Returns the length of the chamfer over the chord where it meets the suction side at full
    /// depth, or `None` if it does not within a fifth of the chord; `above` is the height of the
    /// suction side above the chamfer at a length from the trailing edge over the chord.
    pub(crate) fn length(above: impl Fn(f64) -> f64) -> Option<f64> {
        // From the trailing edge, where a rounded suction side is steeper than any chamfer.
        let mut low = 1e-6;
        if is_not_above(above(low), 0.0) {
            return None;
        }
        let mut high = low;
        while above(high) > 0.0 {
            if high >= LONGEST {
                return None;
            }
            (low, high) = (high, (1.25 * high).min(LONGEST));
        }
        // Halving 60 times leaves the spacing of f64.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if above(middle) > 0.0 { low = middle } else { high = middle }
        }
        Some(high)
    }

    /// Returns the nearest radius ratio at which the chamfer is, and the share of the way that the
    /// columns of the mesh go toward its edge; `None` for those that stay in their places.
    pub(crate) fn nearest(&self, ratio: f64) -> Option<(f64, f64)> {
        let inside = ratio.clamp(self.from, self.to);
        let share = smooth_step(1.0 - (ratio - inside).abs() / RUN_OUT);
        (share > 0.0).then_some((inside, share))
    }
}

/// Angle β of (1 − cos β)/2 up to which the chord fractions of each edge's band in the mesh go: 3 %
/// of the chord, where the curvature of the nose has died away.
pub(crate) const EDGE_ANGLE: f64 = 0.35;

/// Chord fraction of the band of an edge.
fn band() -> f64 {
    let sine = (0.5 * EDGE_ANGLE).sin();
    sine * sine
}

/// Chamfer of a section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectionChamfer {
    /// Chord fraction, from the trailing edge, where it meets the suction side at full depth.
    pub(crate) length: f64,
    /// Rise over a whole chord, mm.
    pub(crate) rise: f64,
    /// Height of the trailing edge, mm.
    pub(crate) end: f64,
    /// Share of the full depth.
    pub(crate) depth: f64,
    /// Share of the way that columns of the mesh go toward the edge with the suction side.
    pub(crate) share: f64,
}

impl SectionChamfer {
    /// Returns the height of the suction side at a chord fraction, cut from a height, mm.
    pub(crate) fn cut(&self, chord_fraction: f64, height: f64) -> f64 {
        let from_end = 1.0 - chord_fraction;
        if from_end >= self.length {
            return height;
        }
        height - self.depth * (height - (self.end + self.rise * from_end)).max(0.0)
    }

    /// Returns the chord fraction of the suction side's column that is elsewhere at `fraction`: the
    /// first one of the trailing edge's band lies on the chamfer's edge, and those beside it make
    /// room.
    pub(crate) fn column(&self, fraction: f64) -> f64 {
        const ROOM: f64 = 0.5;
        let (band, from_end) = (band(), 1.0 - fraction);
        let border = band + (self.length - band) * self.share;
        if from_end <= band {
            1.0 - from_end * (border / band)
        } else if from_end < ROOM {
            1.0 - (border + (from_end - band) * (ROOM - border) / (ROOM - band))
        } else {
            fraction
        }
    }
}

/// Rise from 0 to 1 with level ends.
fn smooth_step(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
