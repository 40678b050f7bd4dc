//! Polynomials on [0, 1] by Bernstein coefficients: their values lie between the smallest and the
//! largest coefficient.

/// Highest degree that occurs: the square of a degree 6 times a degree 2.
pub(crate) const MAX_DEGREE: usize = 14;

/// A polynomial of a degree up to [`MAX_DEGREE`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bernstein {
    pub(crate) c: [f64; MAX_DEGREE + 1],
    pub(crate) degree: usize,
}

/// Binomial coefficients as floats.
const BINOMIAL: [[f64; MAX_DEGREE + 1]; MAX_DEGREE + 1] = {
    let mut b = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
    let mut n = 0;
    while n <= MAX_DEGREE {
        b[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            b[n][k] = b[n - 1][k - 1] + if k < n { b[n - 1][k] } else { 0.0 };
            k += 1;
        }
        n += 1;
    }
    b
};

/// Reciprocal of each of them, as divisions are expensive.
const RECIPROCAL: [[f64; MAX_DEGREE + 1]; MAX_DEGREE + 1] = {
    let mut out = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
    let mut n = 0;
    while n <= MAX_DEGREE {
        let mut k = 0;
        while k <= n {
            out[n][k] = 1.0 / BINOMIAL[n][k];
            k += 1;
        }
        n += 1;
    }
    out
};

impl Bernstein {
    pub(crate) fn zero(degree: usize) -> Self {
        Self { c: [0.0; MAX_DEGREE + 1], degree }
    }

    pub(crate) fn from_coefficients(coefficients: &[f64]) -> Self {
        let mut out = Self::zero(coefficients.len() - 1);
        out.c[..coefficients.len()].copy_from_slice(coefficients);
        out
    }

    /// From coefficients of powers, lowest first.
    pub(crate) fn from_powers(powers: &[f64]) -> Self {
        let n = powers.len() - 1;
        let mut out = Self::zero(n);
        for (k, row) in BINOMIAL.iter().enumerate().take(n + 1) {
            out.c[k] = (0..=k).map(|i| row[i] * RECIPROCAL[n][i] * powers[i]).sum();
        }
        out
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut out = Self::zero(self.degree + other.degree);
        for i in 0..=self.degree {
            for j in 0..=other.degree {
                let weight = BINOMIAL[self.degree][i] * BINOMIAL[other.degree][j] * RECIPROCAL[out.degree][i + j];
                out.c[i + j] += weight * self.c[i] * other.c[j];
            }
        }
        out
    }

    /// Returns the sum of two polynomials of the same degree.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut out = *self;
        for k in 0..=out.degree {
            out.c[k] += other.c[k];
        }
        out
    }

    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { c: self.c.map(|c| c * factor), degree: self.degree }
    }

    /// Returns a bound of its size on [0, 1].
    pub(crate) fn size(&self) -> f64 {
        self.c[..=self.degree].iter().fold(0.0, |most, c| c.abs().max(most))
    }

    fn largest(&self) -> f64 {
        self.c[..=self.degree].iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the halves [0, ½] and [½, 1], by de Casteljau.
    fn split(&self) -> (Self, Self) {
        let n = self.degree;
        let (mut low, mut high) = (*self, *self);
        for k in 1..=n {
            for i in 0..=n - k {
                high.c[i] = 0.5 * (high.c[i] + high.c[i + 1]);
            }
            low.c[k] = high.c[0];
        }
        (low, high)
    }

    /// Returns an upper bound of the polynomial on [0, 1]: either at most `floor`, or within the
    /// fraction `tolerance` of its maximum.
    pub(crate) fn upper_bound(&self, floor: f64, tolerance: f64) -> f64 {
        // Each split halves the interval, and the gap shrinks by four: 30 are beyond rounding.
        self.bound(floor, tolerance, 30)
    }

    fn bound(&self, floor: f64, tolerance: f64, depth: u32) -> f64 {
        let largest = self.largest();
        let reached = floor.max(self.c[0]).max(self.c[self.degree]);
        if depth == 0 || largest <= floor || largest <= reached + tolerance * reached.abs() {
            return largest;
        }
        let (low, high) = self.split();
        let first = low.bound(reached, tolerance, depth - 1);
        first.max(high.bound(reached.max(first), tolerance, depth - 1))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/time_law/bernstein.rs"]
mod tests;
