use facemill_cl_data::ClPoint;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::dexel::body::TurnedBody;

/// A body's motion from one pose to another, workpiece frame: the tip on a straight line, the axis turning evenly in
/// the plane of both.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// What moves.
    pub body: &'a TurnedBody,
    /// Where it begins.
    pub from: ClPoint,
    /// Where it ends.
    pub to: ClPoint,
}

/// Why a motion cannot be swept.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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
        /// What was asked for, mm.
        tolerance: f64,
    },
}

/// Most pieces of one sweep: more would be a tolerance mistaken for another unit.
pub const MAX_PIECES: usize = 1 << 16;

/// Turns below this are none: on a body that reaches 10 m it is 10⁻⁸ mm.
const NO_TURN: f64 = 1e-12;

impl Sweep<'_> {
    /// Straight motions whose swept solids are, together, within the tolerance of the swept solid: no point of either
    /// is farther than that from the other. Poses in the map's frame, both of a piece with the same axis.
    ///
    /// Each piece has the axis of its middle, and its tip is set so that the middle of the body moves from where it
    /// is to where it will be. With a turn of θ per piece and a body that reaches ρ from its middle, which is c from
    /// the tip, a point is off by at most ρθ/2 for the axis and cθ²/8 for the chord of the middle's path.
    pub(crate) fn pieces(
        &self,
        index: usize,
        map_from_work: &Isometry3<f64>,
        tolerance: f64,
    ) -> Result<Vec<[ClPoint; 2]>, SweepError> {
        let [from, to] = [self.from, self.to].map(|pose| pose.transformed(map_from_work));
        let sum = from.tip.coords.sum() + to.tip.coords.sum() + from.axis.sum() + to.axis.sum();
        if !sum.is_finite() {
            return Err(SweepError::NotFinite { index });
        }
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        if turn <= NO_TURN {
            return Ok(vec![[from, ClPoint { tip: to.tip, axis: from.axis }]]);
        }
        if turn > std::f64::consts::PI - 1e-6 {
            return Err(SweepError::HalfTurn { index, turn_deg: turn.to_degrees() });
        }
        let (middle, reach) = self.body.middle();
        let n = (turn * reach / (2.0 * tolerance) + turn * (middle.abs() / (8.0 * tolerance)).sqrt()).ceil();
        if !(tolerance > 0.0 && n <= MAX_PIECES as f64) {
            return Err(SweepError::Tolerance { index, tolerance });
        }
        let axis = |share: f64| slerp(&from.axis, &to.axis, turn, share);
        let centre = |share: f64| from.tip + (to.tip - from.tip) * share + axis(share).into_inner() * middle;
        let n = n.max(1.0);
        let of_piece = |k: usize| {
            let [start, end] = [k as f64 / n, (k as f64 + 1.0) / n];
            let axis = axis(0.5 * (start + end));
            let pose = |share: f64| ClPoint { tip: centre(share) - axis.into_inner() * middle, axis };
            [pose(start), pose(end)]
        };
        Ok((0..n as usize).map(of_piece).collect())
    }

    /// The pose at a share of the motion.
    pub fn at(&self, share: f64) -> ClPoint {
        let (from, to) = (&self.from, &self.to);
        let turn = from.axis.cross(&to.axis).norm().atan2(from.axis.dot(&to.axis));
        let tip = Point3::from(from.tip.coords.lerp(&to.tip.coords, share));
        ClPoint { tip, axis: if turn <= NO_TURN { from.axis } else { slerp(&from.axis, &to.axis, turn, share) } }
    }
}

fn slerp(from: &Unit<Vector3<f64>>, to: &Unit<Vector3<f64>>, turn: f64, share: f64) -> Unit<Vector3<f64>> {
    let (a, b) = (((1.0 - share) * turn).sin(), (share * turn).sin());
    Unit::new_normalize(from.into_inner() * a + to.into_inner() * b)
}
