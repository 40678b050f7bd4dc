use super::s_curve::peak;

/// A motion over a straight way from one speed to another, both without acceleration: up to a
/// speed, along at it, and down to the other.
///
/// Lengths and speeds are those of r, as in [`super::s_curve::SCurve`], the same motion from rest
/// to rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ride {
    pub(crate) length: f64,
    /// Speeds at the start, at most, and at the end.
    pub(crate) speeds: [f64; 3],
    /// Largest acceleration and jerk.
    limits: [f64; 2],
}

/// A change of speed in up to three phases.
#[derive(Clone, Copy, Debug)]
struct Change {
    from: f64,
    to: f64,
    jerk: f64,
    /// Times of one phase of jerk, and of constant acceleration.
    ramp: f64,
    steady: f64,
}

impl Change {
    fn new(from: f64, to: f64, [a, j]: [f64; 2]) -> Self {
        let d = (to - from).abs();
        let (ramp, steady) = if d * j >= a * a { (a / j, d / a - a / j) } else { ((d / j).sqrt(), 0.0) };
        Self { from, to, jerk: if to < from { -j } else { j }, ramp, steady }
    }

    fn duration(&self) -> f64 {
        2.0 * self.ramp + self.steady
    }

    fn way(&self) -> f64 {
        0.5 * (self.from + self.to) * self.duration()
    }

    /// Returns way, speed, acceleration and jerk at a time in it.
    fn at(&self, t: f64) -> [f64; 4] {
        let (j, ramp) = (self.jerk, self.ramp);
        if t <= ramp {
            return [self.from * t + j * t * t * t / 6.0, self.from + 0.5 * j * t * t, j * t, j];
        }
        let back = self.duration() - t;
        if back <= ramp {
            let b = back.max(0.0);
            return [self.way() - (self.to * b - j * b * b * b / 6.0), self.to - 0.5 * j * b * b, j * b, -j];
        }
        let [r, v, a, _] = self.at(ramp);
        let s = t - ramp;
        [r + v * s + 0.5 * a * s * s, v + a * s, a, 0.0]
    }
}

/// Number of times that a bracket of speeds is narrowed at most. Missing the largest speed by
/// little costs equally little.
const NARROWED: u32 = 24;

/// Fraction of the way that may be left over at the largest speed, where a larger one is possible.
const LEFT: f64 = 1e-6;

/// Returns the largest speed within a bracket whose `way` is no more than `length`; the lower end
/// is known to be one.
fn largest(mut low: f64, mut high: f64, length: f64, way: impl Fn(f64) -> f64) -> f64 {
    let most = way(high) - length;
    if most <= 0.0 {
        return high;
    }
    let (mut below, mut above) = (way(low) - length, most);
    let mut before = 0.0;
    for _ in 0..NARROWED {
        if -below <= LEFT * length {
            break;
        }
        // Between the ends of the chord; an end that stays counts half (Illinois).
        let share = (below / (below - above)).clamp(0.01, 0.99);
        let mid = low + (high - low) * share;
        let found = way(mid) - length;
        if found <= 0.0 {
            (low, below) = (mid, found);
            above *= if before < 0.0 { 0.5 } else { 1.0 };
            before = -1.0;
        } else {
            (high, above) = (mid, found);
            below *= if before > 0.0 { 0.5 } else { 1.0 };
            before = 1.0;
        }
    }
    low
}

/// Returns the largest speed that is reached from `speed`, or left for it, on a way of this length.
pub(crate) fn reached(speed: f64, most: f64, length: f64, limits: [f64; 2]) -> f64 {
    // Half of a motion from rest over twice the way gains at least as much speed.
    let high = most.min(speed + peak(2.0 * length, limits));
    if high <= speed { high } else { largest(speed, high, length, |v| Change::new(speed, v, limits).way()) }
}

impl Ride {
    /// Creates the fastest such motion; the two speeds are within `most` and within reach of one
    /// another.
    pub(crate) fn new(length: f64, [from, to]: [f64; 2], [most, a, j]: [f64; 3]) -> Self {
        let limits = [a, j];
        let way = |v: f64| Change::new(from, v, limits).way() + Change::new(v, to, limits).way();
        let least = from.max(to);
        let high = most.max(least).min(least + peak(length, limits));
        Self { length, speeds: [from, largest(least, high, length, way), to], limits }
    }

    fn changes(&self) -> [Change; 2] {
        let [from, peak, to] = self.speeds;
        [Change::new(from, peak, self.limits), Change::new(peak, to, self.limits)]
    }

    pub(crate) fn duration(&self) -> f64 {
        let [up, down] = self.changes();
        up.duration() + self.cruise(&up, &down) + down.duration()
    }

    /// Returns the time at the largest speed; rounding must not make it negative.
    fn cruise(&self, up: &Change, down: &Change) -> f64 {
        let left = self.length - up.way() - down.way();
        if left > 0.0 { left / self.speeds[1] } else { 0.0 }
    }

    /// Returns way and its first three derivatives at time `t`, from 0 to the duration.
    pub(crate) fn at(&self, t: f64) -> [f64; 4] {
        let [up, down] = self.changes();
        let cruise = self.cruise(&up, &down);
        let t = t.max(0.0);
        if t < up.duration() {
            return up.at(t);
        }
        let s = t - up.duration();
        let peak = self.speeds[1];
        if s < cruise {
            return [up.way() + peak * s, peak, 0.0, 0.0];
        }
        let [r, v, a, j] = down.at((s - cruise).min(down.duration()));
        [up.way() + peak * cruise + r, v, a, j]
    }
}
