//! A body that turns a little while it moves: each line sees it move straight.

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use crate::dexel::bodies::body::TurnedBody;
use crate::dexel::bodies::lanes::{Course, LANES, Lanes, Verdicts, Wide};
use crate::dexel::bodies::placed::Placed;
use crate::dexel::bodies::side::{Side, Warm};
use crate::dexel::bodies::sweep::{SweepPart, bulge, slerp};

/// Part of a sweep with a turning axis.
///
/// In the tool's frame a fixed point of the workpiece goes along a curve, which is beside its chord
/// by no more than [`bulge`]. Seen in the workpiece's frame with the axis at its mean, the body
/// goes straight, by a motion of the point's own. A line takes the motion of one of its points: for
/// another of its points, h away, it is off by as much as half the turn times h.
#[derive(Clone, Debug)]
pub(crate) struct Turning<'a> {
    body: &'a TurnedBody,
    ends: [Placed<'a>; 2],
    /// Mean axis.
    axis: Vector3<f64>,
    /// A point p sees the tip, at the start and at the end, at `tip` + `turned`·(p − `tip`).
    turned: [Matrix3<f64>; 2],
    /// How far from the point whose motion it takes a line is within the tolerance, mm.
    max_depth: f64,
    /// How far beyond the body at both ends bounds reach.
    slack: f64,
    /// The same motion in straight pieces.
    pieces: Vec<[Side<'a>; 2]>,
}

impl<'a> Turning<'a> {
    pub(crate) fn new(part: &SweepPart<'a>, tolerance: f64) -> Self {
        let SweepPart { body, from, to, turn, .. } = *part;
        let about = Unit::new_normalize(from.axis.cross(&to.axis));
        let turned = [0.5, -0.5].map(|share| {
            let turn = UnitQuaternion::from_axis_angle(&about, share * turn);
            Matrix3::identity() - turn.to_rotation_matrix().into_inner()
        });
        let bulge = bulge(body, turn, (to.tip - from.tip).norm());
        let sides = |[from, to]: [_; 2]| {
            let below = Side::new(Placed::new(body, &from), Placed::new(body, &to));
            let above = below.mirrored();
            [below, above]
        };
        Self {
            body,
            ends: [Placed::new(body, &from), Placed::new(body, &to)],
            axis: slerp(&from.axis, &to.axis, turn, 0.5).into_inner(),
            turned,
            max_depth: 2.0 * (tolerance - bulge) / turn,
            slack: tolerance + bulge,
            pieces: part.pieces(part.n_pieces).map(sides).collect(),
        }
    }

    /// A coordinate along a direction that no point of the swept solid, dilated by the tolerance,
    /// exceeds.
    pub(crate) fn height_in(&self, n: &Vector3<f64>) -> f64 {
        self.ends[0].height_in(n).max(self.ends[1].height_in(n)) + self.slack * n.norm()
    }

    /// Returns the losses of sixteen lines, as far as they are quickly found and within the
    /// tolerance. `floors` are heights that the swept solid is not below.
    #[inline(always)]
    pub(crate) fn verdicts(&self, x: &Wide, y: f64, tops: &Wide, floors: &Wide, warm: &mut Warm) -> Verdicts {
        let course = self.course(x, y, tops);
        let lanes = Lanes { body: self.body, axis: &self.axis, course, x: *x, y, tops: *tops, floors: *floors };
        let mut verdicts = warm.verdicts(&lanes);
        for l in 0..LANES {
            let is_near = tops[l] - floors[l] <= self.max_depth;
            verdicts.is_untouched[l] &= is_near;
            verdicts.cut_from[l] = if is_near { verdicts.cut_from[l] } else { f64::NAN };
        }
        verdicts
    }

    /// The motions that points see.
    #[inline(always)]
    fn course(&self, x: &Wide, y: f64, z: &Wide) -> Course {
        let mut course = Course { tip: [[0.0; LANES]; 3], motion: [[0.0; LANES]; 3] };
        let [a, b] = &self.turned;
        let [p, q] = [&self.ends[0].tip, &self.ends[1].tip];
        for k in 0..3 {
            for l in 0..LANES {
                let seen = |m: &Matrix3<f64>, tip: &Vector3<f64>| {
                    let (dx, dy, dz) = (x[l] - tip.x, y - tip.y, z[l] - tip.z);
                    tip[k] + m[(k, 0)] * dx + m[(k, 1)] * dy + m[(k, 2)] * dz
                };
                let (start, end) = (seen(a, p), seen(b, q));
                course.tip[k][l] = start;
                course.motion[k][l] = end - start;
            }
        }
        course
    }

    /// The motion in straight pieces, each seen from below and from above.
    pub(crate) fn pieces(&self) -> &[[Side<'a>; 2]] {
        &self.pieces
    }
}
