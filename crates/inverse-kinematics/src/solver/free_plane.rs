use nalgebra::Vector3;

use crate::solver::inverse_solution::Branch;
use crate::solver::rotary_triples::{RotaryTriple, Target, Triples};
use crate::solver::summed_rotaries::{RotaryLine, along};
use crate::solver::tip_condition::{functions, value_and_gradient};
use crate::solver::trig_roots::{SAMPLES, real_roots, sample_angle};

/// Steps of Newton's method from the edge of the reach, known to 1e-9 rad, or to 1e-6 where two
/// edges meet.
const MOST_STEPS: usize = 40;

/// Three rotary joints, two of them parallel, with the tool along the first axis: the first value
/// and one of the parallel ones are free, and the tip condition determines them.
///
/// Rotary values are `base + outer·by_outer + inner·by_inner`. The tip condition is of degree 1 in
/// the inner value, f = A + B·cos + C·sin with A, B and C of degree 1 or 2 in the outer one. So at
/// an outer value it has two roots where B² + C² − A² > 0, one where that is 0, and none elsewhere.
pub(crate) struct FreePlane {
    base: [f64; 3],
    branch: Branch,
    by_outer: [f64; 3],
    by_inner: [f64; 3],
    /// Indices of the joints of the outer and the inner value.
    outer: usize,
    inner: usize,
}

impl FreePlane {
    /// Starts from a position that meets the tool axis; `first_two` says which two are parallel,
    /// `sign` whether they turn opposite ways.
    pub(crate) fn new(base: [f64; 3], branch: Branch, first_two: bool, sign: f64) -> Self {
        if first_two {
            Self { base, branch, by_outer: [1.0, 0.0, 0.0], by_inner: [0.0, 1.0, 0.0], outer: 0, inner: 1 }
        } else {
            Self { base, branch, by_outer: [0.0, -sign, 1.0], by_inner: [1.0, 0.0, 0.0], outer: 2, inner: 0 }
        }
    }

    /// Adds the solutions at the reference value of the first joint and of the other free one. If
    /// there are none, it adds those at the ends of the intervals of outer values with solutions,
    /// nearest to the reference first. So some are added if there are any.
    pub(crate) fn solve(&self, target: &Target<'_>, reference: [f64; 3], all: &mut Triples) {
        for line in [self.first_at(reference), self.other_at(reference)] {
            along(target, &line, reference, 0.0, all);
        }
        if all.as_slice().is_empty() {
            self.at_edges(target, reference, all);
        }
    }

    /// Returns the line with the first joint at its reference value.
    pub(crate) fn first_at(&self, reference: [f64; 3]) -> RotaryLine {
        if self.inner == 0 { self.inner_at(reference) } else { self.outer_at(reference) }
    }

    fn other_at(&self, reference: [f64; 3]) -> RotaryLine {
        if self.inner == 0 { self.outer_at(reference) } else { self.inner_at(reference) }
    }

    fn outer_at(&self, reference: [f64; 3]) -> RotaryLine {
        let base = self.values(reference[self.outer], 0.0);
        RotaryLine { base, direction: self.by_inner, unknown: self.inner, branch: self.branch, free: Some(self.outer) }
    }

    fn inner_at(&self, reference: [f64; 3]) -> RotaryLine {
        let base = self.values(0.0, reference[self.inner]);
        RotaryLine { base, direction: self.by_outer, unknown: self.outer, branch: self.branch, free: Some(self.inner) }
    }

    fn values(&self, outer: f64, inner: f64) -> [f64; 3] {
        [0, 1, 2].map(|k| self.base[k] + outer * self.by_outer[k] + inner * self.by_inner[k])
    }

    /// Returns the tip condition and its derivatives by outer and inner value.
    fn condition(&self, target: &Target<'_>, [outer, inner]: [f64; 2]) -> (f64, [f64; 2]) {
        let (f, gradient) = value_and_gradient(&target.t, &self.values(outer, inner).map(functions));
        (f, [self.by_outer, self.by_inner].map(|by| gradient.dot(&Vector3::from(by))))
    }

    /// Returns A, and amplitude and phase of B·cos + C·sin, at an outer value.
    fn wave(&self, target: &Target<'_>, outer: f64) -> [f64; 3] {
        // B is the value of the wave at the start of its turn, C its slope there.
        let (at_zero, [_, c]) = self.condition(target, [outer, 0.0]);
        let (opposite, _) = self.condition(target, [outer, std::f64::consts::PI]);
        let (a, b) = (0.5 * (at_zero + opposite), 0.5 * (at_zero - opposite));
        [a, b.hypot(c), c.atan2(b)]
    }

    /// Returns the two inner values that meet the tip condition best at an outer one, as rotary
    /// values.
    pub(crate) fn best_at(&self, target: &Target<'_>, outer: f64) -> [[f64; 3]; 2] {
        let [a, amplitude, phase] = self.wave(target, outer);
        // NaN where the condition does not depend on the inner value.
        let off = (-a / amplitude).clamp(-1.0, 1.0).acos();
        let off = if off.is_nan() { 0.0 } else { off };
        [phase + off, phase - off].map(|inner| self.values(outer, inner))
    }

    fn at_edges(&self, target: &Target<'_>, reference: [f64; 3], all: &mut Triples) {
        let mut samples = [0.0; SAMPLES];
        for (k, sample) in samples.iter_mut().enumerate() {
            let [a, amplitude, _] = self.wave(target, sample_angle(k));
            *sample = (amplitude - a) * (amplitude + a);
        }
        let mut seeds = real_roots(&samples, 1e-14 * target.scale.powi(2));
        let apart = |outer: f64| (0.5 * (outer - reference[self.outer])).sin().abs();
        seeds.as_mut_slice().sort_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        for &outer in seeds.as_slice() {
            let [a, _, phase] = self.wave(target, outer);
            let inner = if a > 0.0 { phase + std::f64::consts::PI } else { phase };
            let ([outer, inner], error) = self.polished(target, [outer, inner]);
            if error < 1e-12 {
                all.push(RotaryTriple {
                    values: self.values(outer, inner),
                    branch: self.branch,
                    free: Some(self.outer),
                });
            }
        }
    }

    /// Returns the nearest values that meet the tip condition, by the shortest step to the zero of
    /// its tangent, and the residual over its scale. Where both derivatives are 0 every step halves
    /// the distance.
    fn polished(&self, target: &Target<'_>, start: [f64; 2]) -> ([f64; 2], f64) {
        let (mut best, (mut f, mut slope)) = (start, self.condition(target, start));
        for _ in 0..MOST_STEPS {
            let way = -f / (slope[0] * slope[0] + slope[1] * slope[1]);
            let next = [0, 1].map(|k| best[k] + (slope[k] * way).clamp(-0.1, 0.1));
            let (next_f, next_slope) = self.condition(target, next);
            // Also false for NaN.
            if next_f.abs() < f.abs() {
                (best, f, slope) = (next, next_f, next_slope);
            } else {
                break;
            }
        }
        (best, f.abs() / target.scale)
    }
}
