//! Solutions of three rotary joints by the value of the middle one.

use nalgebra::Vector3;

use crate::solver::rotary_triples::Target;
use crate::solver::tip_condition::functions;
use crate::solver::trig_roots::{SAMPLES, Seeds, real_roots, sample_angle};

/// The tip condition as a function of the value q₂ of the middle joint.
///
/// With b the tool axis seen behind the first joint and w₃′ the third axis at q₂, the parts of b
/// along w₁ and w₃′ are known:
///
/// ```text
/// b = x·w₁ + y·w₃′ ± z·w₁ × w₃′,  x = (α − βG)/N,  y = (β − αG)/N,  z² = (N − α² − β² + 2αβG)/N²
/// ```
///
/// with α = w₁·a, β = w₃·s, G = w₁·w₃′, N = 1 − G². Cosine and sine of q₁ and q₃ are linear in b,
/// so f = even ± odd·z, and f₊·f₋·N² is a trigonometric polynomial of degree 6 in q₂. Where b comes
/// near to w₂ its roots stay apart, while the values of the first joint come together.
pub(crate) struct MiddleRotary<'a> {
    pub(crate) w: &'a [Vector3<f64>; 3],
    pub(crate) spindle: &'a Vector3<f64>,
    pub(crate) target: &'a Target<'a>,
}

/// Quantities at one value of the middle joint: 1, cosine and sine of first and third value are the
/// first entry ± z times the second.
struct AtMiddle {
    first: [[f64; 3]; 2],
    third: [[f64; 3]; 2],
    z_sq: f64,
    n: f64,
    even: f64,
    odd: f64,
}

impl MiddleRotary<'_> {
    /// Returns values of the middle joint near every one that has a solution.
    pub(crate) fn roots(&self) -> Seeds {
        let mut samples = [0.0; SAMPLES];
        let mut size = 0.0_f64;
        for (k, sample) in samples.iter_mut().enumerate() {
            let at = self.at(sample_angle(k));
            let (even_sq, odd_sq, n_sq) = (at.even * at.even, at.odd * at.odd * at.z_sq, at.n * at.n);
            *sample = (even_sq - odd_sq) * n_sq;
            size = size.max((even_sq + odd_sq.abs()) * n_sq);
        }
        real_roots(&samples, 1e-14 * size)
    }

    /// Returns the two triples of rotary values at a value of the middle joint that meet the tool
    /// axis, or come near to it.
    pub(crate) fn triples(&self, second: f64) -> [[f64; 3]; 2] {
        let at = self.at(second);
        let z = at.z_sq.max(0.0).sqrt();
        [z, -z].map(|z| {
            let angle = |[even, odd]: [[f64; 3]; 2]| (even[2] + z * odd[2]).atan2(even[1] + z * odd[1]);
            [angle(at.first), second, angle(at.third)]
        })
    }

    /// Returns f₊·f₋·N² at a value of the middle joint.
    #[cfg(test)]
    pub(crate) fn polynomial(&self, second: f64) -> f64 {
        let at = self.at(second);
        (at.even * at.even - at.odd * at.odd * at.z_sq) * at.n * at.n
    }

    fn at(&self, second: f64) -> AtMiddle {
        let [w1, w2, w3] = self.w;
        let (a, s) = (&self.target.tool_axis, self.spindle);
        let e2 = functions(second);
        let turn = |v: &Vector3<f64>, sin: f64| v * e2[1] + w2.cross(v) * sin + w2 * (w2.dot(v) * (1.0 - e2[1]));
        let w3_there = turn(w3, e2[2]);
        let (alpha, beta, g) = (w1.dot(a), w3.dot(s), w1.dot(&w3_there));
        let normal = w1.cross(&w3_there);
        let n = normal.norm_squared();
        let z_sq = (n - alpha * alpha - beta * beta + 2.0 * alpha * beta * g) / (n * n);
        let b = [(w1 * (alpha - beta * g) + w3_there * (beta - alpha * g)) / n, normal];
        let v = b.map(|b| turn(&b, -e2[2]));
        // b = Rot(w₁, −q₁)·a and v = Rot(w₃, q₃)·s.
        let (across_first, across_third) = (a - w1 * alpha, s - w3 * beta);
        let (first_sq, third_sq) = (across_first.norm_squared(), across_third.norm_squared());
        let (quarter_first, quarter_third) = (a.cross(w1), w3.cross(s));
        let of = |one: f64, v: &Vector3<f64>, across: &Vector3<f64>, quarter: &Vector3<f64>, sq: f64| {
            [one, v.dot(across) / sq, v.dot(quarter) / sq]
        };
        let first = [0, 1].map(|k| of([1.0, 0.0][k], &b[k], &across_first, &quarter_first, first_sq));
        let third = [0, 1].map(|k| of([1.0, 0.0][k], &v[k], &across_third, &quarter_third, third_sq));
        let f = |i: usize, k: usize| self.trilinear(&first[i], &e2, &third[k]);
        let (even, odd) = (f(0, 0) + f(1, 1) * z_sq, f(0, 1) + f(1, 0));
        AtMiddle { first, third, z_sq, n, even, odd }
    }

    fn trilinear(&self, e1: &[f64; 3], e2: &[f64; 3], e3: &[f64; 3]) -> f64 {
        let t = &self.target.t;
        let row = |ij: usize| e3[0] * t[3 * ij] + e3[1] * t[3 * ij + 1] + e3[2] * t[3 * ij + 2];
        (0..3).map(|i| e1[i] * (0..3).map(|j| e2[j] * row(3 * i + j)).sum::<f64>()).sum()
    }
}
