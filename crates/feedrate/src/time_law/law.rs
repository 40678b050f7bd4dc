use facemill_inverse_kinematics::AxisValues;

use super::span::{Ramp, Septic, Span, eval};
use super::{MotionBounds, MotionLimit};

/// Positions of the axes and their motion at a moment: mm or rad, and these per s, s², s³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisMotion {
    /// Positions.
    pub position: AxisValues,
    /// Velocities.
    pub velocity: AxisValues,
    /// Accelerations.
    pub acceleration: AxisValues,
    /// Jerks. At a jump, those after it.
    pub jerk: AxisValues,
    /// Speed of the tip, mm/min, for a path with a tip.
    pub tip_feed: Option<f64>,
}

impl AxisMotion {
    /// Returns the used fraction of each limit, from 0 (not at all) to 1 (wholly): velocity,
    /// acceleration and jerk of every axis, and the tip feed where it is capped.
    pub fn shares<'a>(&'a self, bounds: &'a MotionBounds) -> impl Iterator<Item = (MotionLimit, f64)> + 'a {
        bounds
            .axes
            .iter()
            .enumerate()
            .flat_map(|(k, b)| {
                [
                    (MotionLimit::Velocity(k), self.velocity.get_or_zero(k).abs() / b.velocity),
                    (MotionLimit::Acceleration(k), self.acceleration.get_or_zero(k).abs() / b.acceleration),
                    (MotionLimit::Jerk(k), self.jerk.get_or_zero(k).abs() / b.jerk),
                ]
            })
            .chain(self.tip_feed.zip(bounds.tip_feed).map(|(feed, most)| (MotionLimit::TipFeed, feed / most)))
    }

    /// Returns the limit that is used most, and its used fraction.
    pub fn binding(&self, bounds: &MotionBounds) -> Option<(MotionLimit, f64)> {
        self.shares(bounds).reduce(|most, next| if next.1 > most.1 { next } else { most })
    }
}

/// ρ(s) = ṡ² over a span, s ∈ [0, 1]: a quadratic by its Bernstein coefficients, all above 0. Per
/// s².
///
/// Then s̈ = ρ'(s)/2 is linear in s, so s(t) has a closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SquaredSpeed(pub(crate) [f64; 3]);

impl SquaredSpeed {
    fn curve(&self) -> f64 {
        let [a, b, c] = self.0;
        (a - b) + (c - b)
    }

    /// Returns ρ and its first two derivatives by s.
    pub(crate) fn at(&self, s: f64) -> [f64; 3] {
        let ([a, b, c], t) = (self.0, 1.0 - s);
        [a * t * t + 2.0 * b * s * t + c * s * s, 2.0 * ((b - a) * t + (c - b) * s), 2.0 * self.curve()]
    }

    /// Returns the time from s = 0 to 1: ∫ ds/√ρ = 2/√k·artanh(√k/(√ρ(0) + √ρ(1))), k half of ρ''.
    pub(crate) fn duration(&self) -> f64 {
        let sum = self.0[0].sqrt() + self.0[2].sqrt();
        let z = self.curve() / (sum * sum);
        let factor = if z.abs() < 1e-3 {
            1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z / 11.0))))
        } else if z > 0.0 {
            z.sqrt().atanh() / z.sqrt()
        } else {
            (-z).sqrt().atan() / (-z).sqrt()
        };
        2.0 / sum * factor
    }

    /// Returns s at time `t` from the start of the span, in [0, 1].
    pub(crate) fn position(&self, t: f64) -> f64 {
        let k = self.curve();
        let x = k * t * t;
        let (first, second) = if x.abs() < 1e-3 {
            // Series of sinh and cosh, or sin and cos, of √x.
            (1.0 + x / 6.0 * (1.0 + x / 20.0 * (1.0 + x / 42.0)), 0.5 + x / 24.0 * (1.0 + x / 30.0 * (1.0 + x / 56.0)))
        } else if x > 0.0 {
            let w = x.sqrt();
            (w.sinh() / w, 2.0 * (0.5 * w).sinh().powi(2) / x)
        } else {
            let w = (-x).sqrt();
            (w.sin() / w, 2.0 * (0.5 * w).sin().powi(2) / -x)
        };
        (self.0[0].sqrt() * t * first + (self.0[1] - self.0[0]) * t * t * second).clamp(0.0, 1.0)
    }

    /// Returns the time from s = 0 to `s`: the duration of the part before it.
    pub(crate) fn time_to(&self, s: f64) -> f64 {
        if s <= 0.0 {
            return 0.0;
        }
        let [a, b, _] = self.0;
        SquaredSpeed([a, a * (1.0 - s) + b * s, self.at(s)[0]]).scaled(1.0 / (s * s)).duration()
    }

    /// Returns the first three derivatives of s by time.
    pub(crate) fn rates(&self, s: f64) -> [f64; 3] {
        let [rho, rho1, rho2] = self.at(s);
        let v = rho.max(0.0).sqrt();
        [v, 0.5 * rho1, 0.5 * rho2 * v]
    }

    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}

/// A motion from rest to rest along a path.
#[derive(Clone, Debug)]
pub struct TimeLaw {
    spans: Vec<Span>,
    paces: Vec<SquaredSpeed>,
    ramp: Ramp,
    /// Time at the start of every span, and at the end of the last.
    starts: Vec<f64>,
}

impl TimeLaw {
    pub(crate) fn new(spans: Vec<Span>, paces: Vec<SquaredSpeed>, ramp: Ramp) -> Self {
        let mut starts = Vec::with_capacity(paces.len() + 1);
        let mut t = 0.0;
        starts.push(t);
        for pace in &paces {
            t += pace.duration();
            starts.push(t);
        }
        Self { spans, paces, ramp, starts }
    }

    /// Returns the time of the whole motion, s.
    pub fn total_time(&self) -> f64 {
        self.starts[self.paces.len()]
    }

    /// Returns the index of the span at time `t`, and s within it.
    fn place(&self, t: f64) -> (usize, f64) {
        let i = self.starts.partition_point(|&start| start <= t).clamp(1, self.paces.len()) - 1;
        (i, self.paces[i].position((t.min(self.total_time()) - self.starts[i]).max(0.0)))
    }

    /// Returns the axes at time `t`, s; before the start and after the end they are at rest.
    pub fn at(&self, t: f64) -> AxisMotion {
        let (i, s) = self.place(t);
        let span = &self.spans[i];
        let moving = (0.0..=self.total_time()).contains(&t);
        // ṡ, s̈ and the third derivative of s.
        let rates = if moving { self.paces[i].rates(s) } else { [0.0; 3] };
        let mut out = [AxisValues::zeros(span.axes.len()); 4];
        for (k, c) in span.axes.iter().enumerate() {
            for (values, value) in out.iter_mut().zip(in_time(eval(c, s), rates)) {
                values[k] = value;
            }
        }
        let speed = |tip: &[Septic; 3]| tip.iter().map(|c| eval(c, s)[1] * rates[0]).fold(0.0, f64::hypot);
        let [position, velocity, acceleration, jerk] = out;
        AxisMotion { position, velocity, acceleration, jerk, tip_feed: span.tip.as_ref().map(|tip| 60.0 * speed(tip)) }
    }

    /// Returns the parameter of the path that is passed at time `t`.
    pub fn parameter_at(&self, t: f64) -> f64 {
        let (i, s) = self.place(t);
        let span = &self.spans[i];
        self.ramp.at((span.start + span.h * s).min(1.0))[0].min(self.ramp.start + self.ramp.length)
    }

    /// Returns the times at which the pieces of the path end, s, in order; the last one is
    /// [`TimeLaw::total_time`].
    pub fn piece_ends(&self) -> Vec<f64> {
        let mut ends = vec![0.0; self.spans.last().map_or(0, |s| s.piece + 1)];
        for (span, &end) in self.spans.iter().zip(&self.starts[1..]) {
            ends[span.piece] = end;
        }
        ends
    }
}

/// Returns the derivatives by time of f(s(t)) from those by s and those of s.
pub(crate) fn in_time([q, q1, q2, q3]: [f64; 4], [v, a, j]: [f64; 3]) -> [f64; 4] {
    [q, q1 * v, q2 * v * v + q1 * a, q3 * v * v * v + 3.0 * q2 * v * a + q1 * j]
}

#[cfg(test)]
#[path = "../../tests/unit/time_law/law.rs"]
mod tests;
