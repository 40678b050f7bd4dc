//! Curve of a turn with the tool down: contact points with postures, between the ends of two
//! passes.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::{CcPoint, ClPoint, Posture};
use facemill_cutter_location::{Configuration, PoseTest};
use facemill_tool_model::{Cutter, cl_from_cc};
use nalgebra::{Point3, Vector3};

/// Fraction of the turn over which it rises to its height, and of that over which it sinks.
const RISE: f64 = 0.2;

/// Largest turn of the tool's lean about the normal that is tried, rad.
const MOST_SWUNG: f64 = 1.5 * PI;

/// Swing of the lean between two poses of a turn where it is fastest, rad, and their least and
/// largest number: so many that a control rounds one corner into the next within hundredths of a
/// degree, and need not slow down.
const SWING_STEP: f64 = 0.012;
const POSES: [f64; 2] = [64.0, 600.0];

/// Largest turn of the tip's direction from one block to the next, rad.
const MOST_CORNER: f64 = 0.4;

/// One end of the curve of a turn.
pub(crate) struct CurveEnd {
    pub(crate) cc: CcPoint,
    /// Posture relative to its feed.
    pub(crate) posture: Posture,
    /// The pose there, seated.
    pub(crate) cl: ClPoint,
    pub(crate) configuration: Configuration,
}

/// Returns the angle from one direction to another about a normal, −π..=π.
fn signed_angle(from: &Vector3<f64>, to: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    normal.dot(&from.cross(to)).atan2(from.dot(to))
}

/// Returns the turns of the lean about the normal, from one end to the other, that are tried, rad:
/// with the turn of the feed, and the other way round, the smaller one first unless both are near
/// half a turn.
pub(crate) fn swings([from, to]: &[CurveEnd; 2]) -> Vec<f64> {
    let way = to.cc.position - from.cc.position;
    let side = from.cc.left().dot(&way).signum();
    // In the tangent plane at the end, because the lean has to arrive there.
    let start = CcPoint::new(to.cc.position, to.cc.normal.into_inner(), from.cc.feed.into_inner());
    let Ok(start) = start else { return Vec::new() };
    let feed = signed_angle(&start.feed, &to.cc.feed, &to.cc.normal);
    let feed = if feed * side < 0.0 { feed + TAU * side } else { feed };
    let lean = to.posture.rotate - from.posture.rotate;
    // Beyond a full turn the lean is back where it was.
    let with_feed = (feed + lean) % TAU;
    let other = with_feed - TAU * with_feed.signum();
    let mut swings = vec![with_feed, other];
    swings.retain(|s| s.abs() <= MOST_SWUNG);
    if other.abs() + PREFERRED < with_feed.abs() {
        swings.reverse();
    }
    swings
}

/// Excess of the swing with the feed over that against it up to which it is tried first, rad.
const PREFERRED: f64 = 0.5;

/// Curve of a turn: contact points with postures.
pub(crate) struct TurnCurve<'e> {
    cutter: &'e Cutter,
    ends: &'e [CurveEnd; 2],
    swing: f64,
    /// Length of the tangents at both ends over the parameter 0..=1, mm.
    tangent: f64,
    lift: f64,
    /// Differences of the poses at the ends, which are seated, from their contact.
    seats: [Vector3<f64>; 2],
}

impl<'e> TurnCurve<'e> {
    pub(crate) fn new(test: &'e PoseTest<'_>, ends: &'e [CurveEnd; 2], swing: f64, size: f64, lift: f64) -> Self {
        let cutter = test.cell.tool.cutter();
        // A cubic with tangents of twice the distance is nearly a half circle. The tip swings about
        // the contact on the circle of the rim: it needs as much room to leave along the pass.
        let half = (ends[1].cc.position - ends[0].cc.position).norm();
        let room = cutter.rim_radius() * swing.abs() / PI;
        let tangent = 2.0 * half.max(room) * size;
        let mut curve = Self { cutter, ends, swing, tangent, lift, seats: [Vector3::zeros(); 2] };
        curve.seats = [0usize, 1].map(|k| ends[k].cl.tip - curve.on_surface(k as f64, AS_PLANNED).tip);
        curve
    }

    /// Returns the number of blocks, none longer than a step; more where the tip turns within a few
    /// of them, as it does between passes that are close to each other.
    pub(crate) fn poses(&self, step: f64) -> usize {
        let rough: Vec<Point3<f64>> = (0..=16).map(|k| self.at(f64::from(k) / 16.0).tip).collect();
        let length: f64 = rough.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let swung = FASTEST * self.swing.abs() / SWING_STEP;
        let mut n = (length / step).max(swung).ceil().clamp(POSES[0], POSES[1]);
        while n < POSES[1] && self.corner(n as usize) > MOST_CORNER {
            n = (2.0 * n).min(POSES[1]);
        }
        n as usize
    }

    /// Returns the largest turn of the tip's direction from one of so many blocks to the next, rad.
    fn corner(&self, n: usize) -> f64 {
        let tips: Vec<Point3<f64>> = (0..=n).map(|k| self.at(k as f64 / n as f64).tip).collect();
        tips.windows(3).map(|w| (w[1] - w[0]).angle(&(w[2] - w[1]))).fold(0.0, f64::max)
    }

    /// Returns the pose in contact with the surface at a parameter, with its posture moved.
    fn on_surface(&self, s: f64, moved: Posture) -> ClPoint {
        let [from, to] = self.ends;
        let (a, b) = (s * s * (3.0 - 2.0 * s), s * (1.0 - s));
        let position = from.cc.position
            + (to.cc.position - from.cc.position) * a
            + from.cc.feed.into_inner() * (self.tangent * b * (1.0 - s))
            - to.cc.feed.into_inner() * (self.tangent * b * s);
        let normal = from.cc.normal.into_inner() * (1.0 - s) + to.cc.normal.into_inner() * s;
        let tilt = from.posture.tilt + (to.posture.tilt - from.posture.tilt) * s;
        let rotate = from.posture.rotate + self.swing * a;
        let posture = Posture { tilt: tilt + moved.tilt, rotate: rotate + moved.rotate };
        match CcPoint::new(position, normal, from.cc.feed.into_inner()) {
            Ok(cc) => cl_from_cc(self.cutter, &cc, posture),
            Err(_) => from.cl,
        }
    }

    /// Returns the point of the bottom that is farthest from the contact at a parameter, with the
    /// axis there and the posture moved.
    pub(crate) fn heel(&self, s: f64, moved: Posture) -> ClPoint {
        let [from, to] = self.ends;
        let pose = self.moved(s, moved);
        let normal = from.cc.normal.into_inner() * (1.0 - s) + to.cc.normal.into_inner() * s;
        let axis = pose.axis.into_inner();
        let away = (normal - axis * normal.dot(&axis)).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        pose.translated(away * self.cutter.rim_radius())
    }

    /// Returns the pose at a parameter, seated as the ends are and lifted in between.
    pub(crate) fn at(&self, s: f64) -> ClPoint {
        self.moved(s, AS_PLANNED)
    }

    /// Returns the same pose with these changes of tilt and rotate.
    pub(crate) fn moved(&self, s: f64, moved: Posture) -> ClPoint {
        let [from, to] = self.ends;
        let normal = (from.cc.normal.into_inner() * (1.0 - s) + to.cc.normal.into_inner() * s).normalize();
        let rise = (s.min(1.0 - s) / RISE).clamp(0.0, 1.0);
        let lift = self.lift * rise * rise * (3.0 - 2.0 * rise);
        self.on_surface(s, moved).translated(self.seats[0] * (1.0 - s) + self.seats[1] * s + normal * lift)
    }
}

/// No change of a posture.
pub(crate) const AS_PLANNED: Posture = Posture { tilt: 0.0, rotate: 0.0 };

/// Largest slope of the eased swing.
const FASTEST: f64 = 1.5;
