#[cfg(test)]
#[path = "../../tests/unit/time_law/jet.rs"]
mod tests;

use std::ops::{Add, Mul, Neg, Sub};

/// A value and its first three derivatives by one parameter, in this order.
///
/// Arithmetic on jets gives the derivatives of formulas exactly (to rounding), so a path through
/// the inverse kinematics of a machine needs no finite differences:
///
/// ```
/// use facemill_feedrate::Jet;
/// let u = Jet::parameter(0.5);
/// let f = (u * u).sin(); // sin u²
/// assert!((f.d1() - 2.0 * 0.5 * 0.25_f64.cos()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet(pub [f64; 4]);

impl Jet {
    /// Returns a value that does not depend on the parameter.
    pub fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0])
    }

    /// Returns the parameter itself.
    pub fn parameter(value: f64) -> Self {
        Self([value, 1.0, 0.0, 0.0])
    }

    /// Returns the value.
    pub fn value(&self) -> f64 {
        self.0[0]
    }

    /// Returns the first derivative.
    pub fn d1(&self) -> f64 {
        self.0[1]
    }

    /// Returns the second derivative.
    pub fn d2(&self) -> f64 {
        self.0[2]
    }

    /// Returns the third derivative.
    pub fn d3(&self) -> f64 {
        self.0[3]
    }

    /// Returns f(self) by the chain rule of Faà di Bruno; `outer` holds the value of f and its
    /// derivatives by its own argument.
    #[must_use]
    pub fn chain(&self, outer: [f64; 4]) -> Self {
        let [_, x1, x2, x3] = self.0;
        let [f, f1, f2, f3] = outer;
        Self([f, f1 * x1, f2 * x1 * x1 + f1 * x2, f3 * x1 * x1 * x1 + 3.0 * f2 * x1 * x2 + f1 * x3])
    }

    /// Returns the sine.
    #[must_use]
    pub fn sin(&self) -> Self {
        let (s, c) = self.value().sin_cos();
        self.chain([s, c, -s, -c])
    }

    /// Returns the cosine.
    #[must_use]
    pub fn cos(&self) -> Self {
        let (s, c) = self.value().sin_cos();
        self.chain([c, -s, -c, s])
    }

    /// Returns the square root; not finite at 0.
    #[must_use]
    pub fn sqrt(&self) -> Self {
        let r = self.value().sqrt();
        let x = self.value();
        self.chain([r, 0.5 / r, -0.25 / (r * x), 0.375 / (r * x * x)])
    }

    /// Returns 1/self; not finite at 0.
    #[must_use]
    pub fn recip(&self) -> Self {
        let i = 1.0 / self.value();
        self.chain([i, -i * i, 2.0 * i * i * i, -6.0 * i * i * i * i])
    }

    /// Returns the angle of the vector (`x`, `self`), rad, in (−π, π]; its derivatives have no
    /// jump. Not finite at the origin.
    #[must_use]
    pub fn atan2(&self, x: Self) -> Self {
        let (y, angle) = (*self, self.value().atan2(x.value()));
        // The derivative is (x y' − y x')/(x² + y²); jets of derivatives lose the highest one,
        // which is not needed.
        let shift = |j: Jet| Jet([j.0[1], j.0[2], j.0[3], 0.0]);
        let rate = (x * shift(y) - y * shift(x)) * (x * x + y * y).recip();
        Self([angle, rate.0[0], rate.0[1], rate.0[2]])
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let ([a, a1, a2, a3], [b, b1, b2, b3]) = (self.0, other.0);
        Self([a * b, a1 * b + a * b1, a2 * b + 2.0 * a1 * b1 + a * b2, a3 * b + 3.0 * (a2 * b1 + a1 * b2) + a * b3])
    }
}
