use facemill_inverse_kinematics::AxisValues;

use super::corner::ProgramLine;
use super::polyline::Polyline;
use super::ride::{Ride, reached};
use crate::time_law::AxisBounds;

/// A line of a program between corners that are rounded one by one at constant speed.
///
/// Over ±w around a corner, in r, the axes are a cubic spline: their second derivative rises evenly
/// from 0 at −w to bend/w at the corner and falls back to 0 at w, where bend is the change of their
/// slopes. So the spline leaves the corner by bend·w/6, its slopes are means of those of the two
/// lines, and at the speed c the accelerations are at most bend/w·c² and the jerks bend/w²·c³.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedLine {
    pub(crate) block: usize,
    /// Largest ṙ allowed by the tip feed.
    pub(crate) cap: f64,
    /// Its middle, between the two corners.
    pub(crate) ride: Ride,
    /// Half lengths of the corners at its start and at its end.
    pub(crate) halves: [f64; 2],
}

/// Largest fraction of a line for a corner: between two corners there has to be a way for changes
/// of speed.
const SHARE: f64 = 0.4;

/// Margin on the tolerance and the speeds of corners for rounding.
const ROUNDING: f64 = 1e-9;

/// A corner between two lines: half its length, and its speed.
#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    half: f64,
    speed: f64,
}

impl Corner {
    /// Returns the widest corner within the tolerance and its highest speed; none where a stop is
    /// faster.
    fn between(before: &ProgramLine, after: &ProgramLine, axes: &[AxisBounds], tolerance: &AxisValues) -> Self {
        let bends = |k: usize| (after.slopes[k] - before.slopes[k]).abs();
        let within = |k: usize| 6.0 * tolerance[k] * (1.0 - ROUNDING) / bends(k);
        let widest = (0..axes.len()).map(within).fold(SHARE * before.length.min(after.length), f64::min);
        let quickest = |k: usize| {
            let (a, j) = (axes[k].acceleration / bends(k), axes[k].jerk / bends(k));
            (a * widest).sqrt().min((j * widest * widest).cbrt())
        };
        let most = before.limits[0].min(after.limits[0]);
        let speed = (0..axes.len()).map(quickest).fold(most, f64::min) * (1.0 - ROUNDING);
        let saved = before.saved_by_blend(widest, speed) + after.saved_by_blend(widest, speed);
        if saved < 0.0 { Self::default() } else { Self { half: widest, speed } }
    }

    /// Returns it only as long as its speed needs.
    fn shortened(&self, before: &ProgramLine, after: &ProgramLine, axes: &[AxisBounds]) -> Self {
        let c = self.speed / (1.0 - ROUNDING);
        let needed = |k: usize| {
            let bend = (after.slopes[k] - before.slopes[k]).abs();
            (bend * c * c / axes[k].acceleration).max((bend * c * c * c / axes[k].jerk).sqrt())
        };
        Self { half: (0..axes.len()).map(needed).fold(0.0, f64::max).min(self.half), ..*self }
    }
}

impl RoundedLine {
    /// Returns the lines of a polyline from rest to rest.
    pub(crate) fn along(polyline: &Polyline, axes: &[AxisBounds], tolerance: &AxisValues) -> Vec<Self> {
        // Lines are computed again where they are needed: a million of them take more memory than
        // time.
        let n = polyline.lines();
        let line = |k: usize| polyline.line(k, axes);
        // The corner before each line, and that behind the last one; in the first pass only as fast
        // as they are reached from the start.
        let mut corners = vec![Corner::default(); n + 1];
        let mut before = line(0);
        for k in 1..n {
            let after = line(k);
            corners[k] = Corner::between(&before, &after, axes, tolerance);
            corners[k].speed = within_reach(&before, &corners[k - 1], &corners[k]);
            before = after;
        }
        for k in (0..n).rev() {
            corners[k].speed = within_reach(&line(k), &corners[k + 1], &corners[k]);
        }
        let mut out = Vec::with_capacity(n);
        let mut at = line(0);
        for k in 0..n {
            let next = (k + 1 < n).then(|| line(k + 1));
            if let Some(next) = &next {
                corners[k + 1] = corners[k + 1].shortened(&at, next, axes);
            }
            let ends = [corners[k], corners[k + 1]];
            let ride = Ride::new(at.length - ends[0].half - ends[1].half, ends.map(|corner| corner.speed), at.limits);
            let halves = ends.map(|corner| corner.half);
            out.push(Self { block: polyline.blocks[k], cap: polyline.caps[k], ride, halves });
            at = next.unwrap_or(at);
        }
        out
    }

    pub(crate) fn length(&self) -> f64 {
        self.halves[0] + self.ride.length + self.halves[1]
    }

    pub(crate) fn duration(&self) -> f64 {
        let [first, last] = self.corner_times();
        first + self.ride.duration() + last
    }

    /// Returns the largest speed on it.
    pub(crate) fn peak(&self) -> f64 {
        self.ride.speeds[1]
    }

    /// Returns the times of the halves of its corners.
    fn corner_times(&self) -> [f64; 2] {
        let [from, _, to] = self.ride.speeds;
        let time = |half: f64, speed: f64| if half > 0.0 { half / speed } else { 0.0 };
        [time(self.halves[0], from), time(self.halves[1], to)]
    }

    /// Returns the way from its start and first three derivatives by time, at a time in it.
    pub(crate) fn at(&self, t: f64) -> [f64; 4] {
        let [first, last] = self.corner_times();
        let [from, _, to] = self.ride.speeds;
        let ride = self.ride.duration();
        if t < first {
            return [from * t, from, 0.0, 0.0];
        }
        if t > first + ride {
            let back = (first + ride + last - t).max(0.0);
            return [self.length() - to * back, to, 0.0, 0.0];
        }
        let [r, rates @ ..] = self.ride.at(t - first);
        let [v, a, j] = rates;
        [self.halves[0] + r, v, a, j]
    }

    /// Returns the addition of the corner at the place `r` to an axis of the line and to its first
    /// three derivatives by r, where the slope of the axis changes by `bends` at the start and at
    /// the end.
    pub(crate) fn rounding(&self, r: f64, bends: [f64; 2]) -> [f64; 4] {
        let [first, last] = self.halves;
        let back = self.length() - r;
        // At −u before a corner and at u behind it the deviation of the spline is the same; odd
        // derivatives change their sign.
        let (u, w, bend, sign) = if r < first {
            (first - r, first, bends[0], -1.0)
        } else if back < last {
            (last - back, last, bends[1], 1.0)
        } else {
            return [0.0; 4];
        };
        let j = bend / (w * w);
        [j * u * u * u / 6.0, sign * 0.5 * j * u * u, j * u, sign * j]
    }
}

/// Returns the speed of a corner at one end of a line that is reachable from that at the other.
fn within_reach(line: &ProgramLine, from: &Corner, to: &Corner) -> f64 {
    let length = line.length - from.half - to.half;
    to.speed.min(reached(from.speed, to.speed, length, [line.limits[1], line.limits[2]]))
}
