use facemill_cl_data::ClPoint;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::dexel::bodies::body::TurnedBody;

/// A body's motion from one pose to another, workpiece frame: the tip on a straight line, the axis
/// turning evenly in the plane of both.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// Moving body.
    pub body: &'a TurnedBody,
    /// Where it begins.
    pub from: ClPoint,
    /// Where it ends.
    pub to: ClPoint,
}

/// Why a motion cannot be swept.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A pose is not finite.
    #[error("sweep {index}: a pose is not finite")]
    NotFinite {
        /// Which of the sweeps, from 0.
        index: usize,
    },
    /// The axis turns by half a turn, in a plane that the poses do not tell.
    #[error("sweep {index}: the axis turns by {turn_deg:.3} degrees, which leaves its plane open; put a pose between")]
    HalfTurn {
        /// Which of the sweeps, from 0.
        index: usize,
        /// Angle between the axes.
        turn_deg: f64,
    },
    /// The tolerance is not a positive number, or too small for the turn.
    #[error("sweep {index}: a tolerance of {tolerance} mm for the turn of the axis is not a positive length, or needs \
        more than {max} pieces", max = MAX_PIECES)]
    Tolerance {
        /// Which of the sweeps, from 0.
        index: usize,
        /// Requested tolerance, mm.
        tolerance: f64,
    },
}

/// Most pieces of one sweep: more would be a tolerance mistaken for another unit.
pub const MAX_PIECES: usize = 1 << 16;

/// Turns below this are none: on a body that reaches 10 m it is 10⁻⁸ mm.
const NO_TURN: f64 = 1e-12;

/// Part of a sweep in a map's frame, and how far it must be divided to be straight pieces within
/// the tolerance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SweepPart<'a> {
    pub(crate) body: &'a TurnedBody,
    pub(crate) from: ClPoint,
    pub(crate) to: ClPoint,
    /// Angle between the axes at both ends, rad; 0 where they are the same.
    pub(crate) turn: f64,
    /// Pieces of equal turn whose swept solids are, together, within the tolerance of the part's.
    pub(crate) n_pieces: usize,
}

impl<'a> SweepPart<'a> {
    /// The part as straight motions: each has the axis of its middle, and its tip is set so that
    /// the middle of the body moves from where it is to where it will be.
    pub(crate) fn pieces(&self, n: usize) -> impl Iterator<Item = [ClPoint; 2]> + use<'a> {
        let Self { body, from, to, turn, .. } = *self;
        let (middle, _) = body.middle();
        (0..n).map(move |k| {
            let [start, end] = [k as f64 / n as f64, (k as f64 + 1.0) / n as f64];
            if turn == 0.0 {
                let tip = |share: f64| from.tip + (to.tip - from.tip) * share;
                return [start, end].map(|share| ClPoint { tip: tip(share), axis: from.axis });
            }
            let axis = |share: f64| slerp(&from.axis, &to.axis, turn, share);
            let centre = |share: f64| from.tip + (to.tip - from.tip) * share + axis(share).into_inner() * middle;
            let mean = axis(0.5 * (start + end));
            [start, end].map(|share| ClPoint { tip: centre(share) - mean.into_inner() * middle, axis: mean })
        })
    }
}

/// Purposes of the parts of a sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    /// To be cut: each at once with its turn, where that is less work than straight pieces.
    Cut,
    /// Query: each part straight within a multiple of the tolerance.
    Ask {
        /// The multiple.
        coarser: f64,
    },
}

impl<'a> Sweep<'a> {
    /// The parts that the motion is looked at in, of equal turn; poses in the map's frame.
    ///
    /// With a turn of θ and a body that reaches ρ from its middle, which is c from the tip, a point
    /// of a straight piece is off by at most ρθ/2 for the axis and cθ²/8 for the chord of the
    /// middle's path.
    pub(crate) fn parts(
        &self,
        index: usize,
        map_from_work: &Isometry3<f64>,
        tolerance: f64,
        purpose: Purpose,
    ) -> Result<Vec<SweepPart<'a>>, SweepError> {
        let [from, to] = [self.from, self.to].map(|pose| pose.transformed(map_from_work));
        let sum = from.tip.coords.sum() + to.tip.coords.sum() + from.axis.sum() + to.axis.sum();
        if !sum.is_finite() {
            return Err(SweepError::NotFinite { index });
        }
        let body = self.body;
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        if turn <= NO_TURN {
            let to = ClPoint { tip: to.tip, axis: from.axis };
            return Ok(vec![SweepPart { body, from, to, turn: 0.0, n_pieces: 1 }]);
        }
        if turn > std::f64::consts::PI - 1e-6 {
            return Err(SweepError::HalfTurn { index, turn_deg: turn.to_degrees() });
        }
        let (middle, reach) = body.middle();
        let n_straight = |tolerance: f64| {
            let n = turn * reach / (2.0 * tolerance) + turn * (middle.abs() / (8.0 * tolerance)).sqrt();
            n.ceil().max(1.0)
        };
        let n = n_straight(tolerance);
        if !(tolerance > 0.0 && n <= MAX_PIECES as f64) {
            return Err(SweepError::Tolerance { index, tolerance });
        }
        let n_parts = match purpose {
            Purpose::Cut => n.min(n_turning(body, turn, (to.tip - from.tip).norm(), tolerance)),
            Purpose::Ask { coarser } => n_straight(coarser * tolerance),
        };
        let pose = |share: f64| ClPoint {
            tip: from.tip + (to.tip - from.tip) * share,
            axis: slerp(&from.axis, &to.axis, turn, share),
        };
        let of_part = |k: usize| {
            let [start, end] = [k as f64 / n_parts, (k as f64 + 1.0) / n_parts];
            let n_pieces = (n / n_parts).ceil() as usize;
            SweepPart { body, from: pose(start), to: pose(end), turn: turn / n_parts, n_pieces }
        };
        Ok((0..n_parts as usize).map(of_part).collect())
    }

    /// The pose at a share of the motion.
    pub fn at(&self, share: f64) -> ClPoint {
        let (from, to) = (&self.from, &self.to);
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        let tip = Point3::from(from.tip.coords.lerp(&to.tip.coords, share));
        ClPoint { tip, axis: if turn <= NO_TURN { from.axis } else { slerp(&from.axis, &to.axis, turn, share) } }
    }
}

/// How far a fixed point's way in the tool's frame is from its chord, mm, while the tool turns by
/// `turn` and its tip moves straight by `way`: the point is accelerated by at most turn² times its
/// distance from the tip and twice turn times way.
pub(crate) fn bulge(body: &TurnedBody, turn: f64, way: f64) -> f64 {
    let (middle, reach) = body.middle();
    (turn * turn * (middle.abs() + reach + way) + 2.0 * turn * way) / 8.0
}

/// Least number of parts of which each is within half the tolerance for the bulge, and for the turn
/// along lines of the body's height.
fn n_turning(body: &TurnedBody, turn: f64, way: f64, tolerance: f64) -> f64 {
    let for_height = turn * body.height() / tolerance;
    let for_bulge = (2.0 * bulge(body, turn, way) / tolerance).sqrt();
    for_height.max(for_bulge).ceil().max(1.0)
}

pub(crate) fn slerp(from: &Unit<Vector3<f64>>, to: &Unit<Vector3<f64>>, turn: f64, share: f64) -> Unit<Vector3<f64>> {
    let (a, b) = (((1.0 - share) * turn).sin(), (share * turn).sin());
    Unit::new_normalize(from.into_inner() * a + to.into_inner() * b)
}
