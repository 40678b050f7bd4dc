/// The least-time motion over one straight line from rest to rest: up to seven phases of constant
/// jerk, in closed form.
///
/// Jerk j, acceleration a and speed v are limits of r, the length along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SCurve {
    length: f64,
    jerk: f64,
    /// Times of one phase of jerk, of constant acceleration, and of constant speed.
    ramp: f64,
    steady: f64,
    cruise: f64,
}

/// Returns the speed that is reached between two stops, with or without reaching the largest
/// acceleration.
pub(crate) fn peak(length: f64, [a, j]: [f64; 2]) -> f64 {
    let both = 0.5 * a * ((a / j).hypot(2.0 * (length / a).sqrt()) - a / j);
    if both * j >= a * a { both } else { (0.25 * length * length * j).cbrt() }
}

impl SCurve {
    pub(crate) fn new(length: f64, [v, a, j]: [f64; 3]) -> Self {
        let peak = peak(length, [a, j]);
        let speed = v.min(peak);
        let (ramp, steady) = if speed * j >= a * a { (a / j, speed / a - a / j) } else { ((speed / j).sqrt(), 0.0) };
        let change = speed * (2.0 * ramp + steady);
        // Rounding must not make it negative where the speed is just reached.
        let cruise = if speed < peak { ((length - change) / speed).max(0.0) } else { 0.0 };
        Self { length, jerk: j, ramp, steady, cruise }
    }

    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    pub(crate) fn duration(&self) -> f64 {
        2.0 * self.change() + self.cruise
    }

    /// Returns the largest speed that is reached.
    pub(crate) fn speed(&self) -> f64 {
        self.jerk * self.ramp * (self.ramp + self.steady)
    }

    /// Returns the time from rest to the largest speed.
    fn change(&self) -> f64 {
        2.0 * self.ramp + self.steady
    }

    /// Returns r and its first three derivatives at time `t` from 0 to the duration.
    pub(crate) fn at(&self, t: f64) -> [f64; 4] {
        let back = self.duration() - t;
        if t <= back {
            return self.first_half(t.max(0.0));
        }
        // The same backward in time.
        let [r, v, a, j] = self.first_half(back.max(0.0));
        [self.length - r, v, -a, j]
    }

    fn first_half(&self, t: f64) -> [f64; 4] {
        let (j, ramp) = (self.jerk, self.ramp);
        let accel = j * ramp;
        let up = |t: f64| [j * t * t * t / 6.0, 0.5 * j * t * t, j * t, j];
        if t <= ramp {
            return up(t);
        }
        let [r1, v1, ..] = up(ramp);
        let s = (t - ramp).min(self.steady);
        let (r2, v2) = (r1 + v1 * s + 0.5 * accel * s * s, v1 + accel * s);
        if t <= ramp + self.steady {
            return [r2, v2, accel, 0.0];
        }
        let s = (t - ramp - self.steady).min(ramp);
        let (r3, v3) = (r2 + v2 * s + 0.5 * accel * s * s - j * s * s * s / 6.0, v2 + accel * s - 0.5 * j * s * s);
        if t <= self.change() {
            return [r3, v3, accel - j * s, -j];
        }
        [r3 + v3 * (t - self.change()), v3, 0.0, 0.0]
    }
}

#[cfg(test)]
#[path = "../../tests/unit/program_law/s_curve.rs"]
mod tests;
