use std::f64::consts::PI;

use nalgebra::{Rotation3, Unit, Vector3};

use crate::solver::direction_pair::{RotaryAxis, angle};
use crate::solver::inverse_solution::Branch;
use crate::solver::middle_rotary::MiddleRotary;
use crate::solver::rotary_triples::{RotaryTriple, Target, Triples};
use crate::solver::screw_chain::ScrewChain;
use crate::solver::tip_condition::{TipCondition, functions, value_and_gradient};
use crate::solver::trig_roots::{SAMPLES, real_roots, sample_directions};

/// Rotary values nearer to each other than this also count as one solution if those in the middle
/// between them are a solution.
const MAYBE_SAME: f64 = 1e-2;

/// Accuracy of that test: rad, and the fraction of the tip condition's scale.
const STILL_SOLUTION: f64 = 2e-13;

/// First and third values nearer than this to those of a curve of solutions at the pole are on it,
/// rad: a solution beside it is a double root there, known to the root of the rounding.
const STILL_ON_CURVE: f64 = 1e-7;

/// Rounding of the tip condition as a fraction of its scale.
const ROUNDING: f64 = 2e-16;

/// Difference from the target, rad and fraction of the tip condition's scale, that the forward
/// solution may still accept.
const MET: f64 = 1e-12;

/// Fraction of the largest coefficient of the tip condition below which its polynomial counts as
/// zero, so any value solves it.
const NO_CONDITION: f64 = 1e-11;

/// Angle from the pole of the middle rotary within which solutions are also searched at the pole,
/// rad. There two roots come nearer and nearer to each other, while their middle values stay apart;
/// larger costs only time.
const BESIDE_POLE: f64 = 0.02;

/// Fraction of the largest coefficient of the tip condition below which it hardly determines the
/// middle value at its pole.
const HARDLY_A_CONDITION: f64 = 1e-5;

/// Length from which on a stretch with a polynomial of 0 to rounding is examined as a curve of
/// solutions, rad. Eight roots that meet are a stretch of 0.02.
const CURVE: f64 = 0.1;

/// Steps of Newton's method. From a root of the polynomial two are enough; at a double root every
/// step halves the distance, from 0.01 rad to the rounding in some thirty.
const MOST_STEPS: usize = 40;

/// Three rotary joints, none parallel to the next, that turn the tool to a direction and bring the
/// tip into the plane of motion of two linear joints.
///
/// Values are counted from the pose in which all directions but the first lie in one plane; see
/// [`ThreeRotaries::zero`]. With b the tool axis seen behind the first joint and v the one seen in
/// front of the third, `Rot(w₂, q₂)·v = b`. So v and b have the same part along w₂, which makes cos
/// q₃ a linear function of cos φ, φ = azimuth of the tool axis about w₁ − q₁; and across w₂, D·(cos
/// q₂, sin q₂) is bilinear in b and v, D = 1 − (w₂·b)(w₂·v) being the square of the part across.
/// The tip condition f then is (g + h·sin q₃)/D with g and h polynomials in cos φ, sin φ, and
///
/// ```text
/// H(φ) = f₊·f₋·D = (g² − sin²q₃·h²)/D
/// ```
///
/// is a trigonometric polynomial of degree 6: g² has degree 8 (g has degree 2 in φ and 2 in cos
/// q₃), and D, of degree 2, divides it: where D = 0, b and v across w₂ are isotropic, v that of the
/// one or of the other sign like b, and there g ± h·sin q₃ is 0. Its real roots with |cos q₃| ≤ 1
/// are all solutions.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ThreeRotaries {
    first: RotaryAxis,
    w: [Vector3<f64>; 3],
    spindle: Vector3<f64>,
    /// Cosine and sine of the angles between first and second, second and third, third and spindle.
    sides: [[f64; 2]; 3],
    /// Least angle between second axis and tool axis in front of the third joint, and the
    /// difference of the largest from 180°.
    spindle_from_second: [f64; 2],
    between: f64,
    /// Values of the machine's axes where the values here are 0.
    pub(crate) zero: [f64; 3],
}

/// Quantities at one value of φ.
struct AtFirst {
    cos_third: f64,
    /// Square of the sine of the third value; negative where there is none.
    sin_third_sq: f64,
    /// Parts of b across w₂.
    b: [f64; 2],
    d: f64,
    g: f64,
    h: f64,
}

/// The tip condition as a function of φ, and the frame of φ.
struct Harmonics {
    azimuth: f64,
    /// Part of the tool axis along w₁ and across.
    along: f64,
    across: f64,
    constant: [f64; 9],
    cos: [f64; 9],
    sin: [f64; 9],
}

impl ThreeRotaries {
    /// Takes directions of the rotary joints from the table to the tool, and the spindle, at the
    /// machine's zero pose.
    pub(crate) fn new(w: [Unit<Vector3<f64>>; 3], spindle: &Unit<Vector3<f64>>) -> Self {
        let [u, v, z] = w.map(Unit::into_inner);
        let first = RotaryAxis::new(0, u, &v, &u);
        let second = RotaryAxis::new(1, v, &u, &z);
        let third = RotaryAxis::new(2, z, &v, spindle);
        let zero = [0.0, -second.spindle_azimuth, -third.spindle_azimuth];
        let (back_second, back_third) =
            (Rotation3::from_axis_angle(&w[1], zero[1]), Rotation3::from_axis_angle(&w[2], zero[2]));
        let sides = [angle(&u, &v), angle(&v, &z), angle(&z, spindle)];
        let (near, far) = ((sides[1] - sides[2]).abs(), (PI - sides[1] - sides[2]).abs());
        Self {
            first,
            w: [u, v, back_second * z],
            spindle: back_second * (back_third * spindle.into_inner()),
            sides: sides.map(|side| [side.cos(), side.sin()]),
            spindle_from_second: [near, far],
            between: sides[0],
            zero,
        }
    }

    /// Returns the tip condition of the chain, in the values of this solver.
    pub(crate) fn condition(&self, chain: &ScrewChain, axes: [usize; 3]) -> TipCondition {
        TipCondition::new(chain, axes, self.zero)
    }

    /// Returns all solutions for a target; on a whole curve of them, those at the reference value
    /// of its free joint.
    pub(crate) fn solve(&self, target: &Target<'_>, reference: [f64; 3]) -> Triples {
        let harmonics = self.harmonics(target);
        let mut all = Triples::new();
        let mut samples = [0.0; SAMPLES];
        let mut size = 0.0_f64;
        for (sample, direction) in samples.iter_mut().zip(sample_directions()) {
            let at = self.at(&harmonics, *direction);
            let (g_sq, h_sq) = (at.g * at.g, at.sin_third_sq * at.h * at.h);
            *sample = (g_sq - h_sq) / at.d;
            size = size.max((g_sq + h_sq.abs()) / at.d);
        }
        let is_near_pole = self.beside_pole(target, &harmonics, reference, &mut all);
        if size < (NO_CONDITION * target.scale).powi(2) {
            self.on_curve(target, &harmonics, reference, &mut all);
            return all;
        }
        let seeds = real_roots(&samples, 1e-14 * size);
        if seeds.widest > CURVE {
            self.on_curve(target, &harmonics, reference, &mut all);
        }
        for &phi in seeds.as_slice() {
            self.at_root(target, &harmonics, phi, &mut all);
        }
        if is_near_pole || seeds.widest > CURVE {
            self.by_middle(target, &mut all);
        }
        if seeds.cut_off {
            self.on_curve(target, &harmonics, reference, &mut all);
        }
        all
    }

    /// Applies Newton's method from a reference position; `None` where it does not converge.
    pub(crate) fn near(&self, target: &Target<'_>, reference: [f64; 3]) -> Option<RotaryTriple> {
        let start = [0, 1, 2].map(|k| reference[k] - self.zero[k]);
        let (values, error) = self.polished(target, start);
        (error < 1e-12).then(|| self.triple(values, None))
    }

    /// Returns the side of the last rotary: the spindle is between 0 and 180° right-handed about it
    /// from its place nearest to the middle one.
    pub(crate) fn is_positive(&self, third_value: f64) -> bool {
        (third_value - self.zero[2]).rem_euclid(2.0 * PI) <= PI
    }

    /// Returns the angle by which a direction is out of reach, 0 within.
    pub(crate) fn out_of_reach(&self, tool_axis: &Vector3<f64>) -> f64 {
        let to_first = angle(tool_axis, &self.first.direction);
        let [near, far] = self.spindle_from_second;
        let (nearest, farthest) = ((to_first - self.between).abs(), PI - (PI - to_first - self.between).abs());
        (nearest - (PI - far)).max(near - farthest).max(0.0)
    }

    /// Returns the rotary values at an angle φ of the first on one side of the third; `None` where
    /// there is none.
    pub(crate) fn values_at(&self, target: &Target<'_>, phi: f64, positive: bool) -> Option<[f64; 3]> {
        let harmonics = self.harmonics(target);
        let (sin, cos) = phi.sin_cos();
        let at = self.at(&harmonics, [cos, sin]);
        (at.sin_third_sq >= 0.0).then(|| self.machine_values(self.values(&harmonics, &at, phi, positive)))
    }

    /// Returns H at an angle φ of the first rotary.
    #[cfg(test)]
    pub(crate) fn polynomial(&self, target: &Target<'_>, phi: f64) -> f64 {
        let at = self.at(&self.harmonics(target), [phi.cos(), phi.sin()]);
        (at.g * at.g - at.sin_third_sq * at.h * at.h) / at.d
    }

    fn harmonics(&self, target: &Target<'_>) -> Harmonics {
        let a = &target.tool_axis;
        let (x, y) = (a.dot(&self.first.zero), a.dot(&self.first.quarter));
        let azimuth = y.atan2(x);
        let (sin, cos) = azimuth.sin_cos();
        // q₁ = azimuth − φ.
        let t = &target.t;
        Harmonics {
            azimuth,
            along: a.dot(&self.first.direction),
            across: x.hypot(y),
            constant: std::array::from_fn(|k| t[k]),
            cos: std::array::from_fn(|k| cos * t[9 + k] + sin * t[18 + k]),
            sin: std::array::from_fn(|k| sin * t[9 + k] - cos * t[18 + k]),
        }
    }

    /// Returns g, h and D at φ, given its cosine and sine.
    fn at(&self, of: &Harmonics, [cos, sin]: [f64; 2]) -> AtFirst {
        let [[cos1, sin1], [cos2, sin2], [cos3, sin3]] = self.sides;
        let b_along = of.along * cos1 + of.across * sin1 * cos;
        let b = [of.along * sin1 - of.across * cos1 * cos, -of.across * sin];
        let c = (b_along - cos2 * cos3) / (sin2 * sin3);
        let s_sq = 1.0 - c * c;
        let d = b[0] * b[0] + b[1] * b[1];
        // v across w₂ is (vx, vy·sin q₃).
        let (vx, vy) = (sin2 * cos3 - cos2 * sin3 * c, -sin3);
        let m: [f64; 9] = std::array::from_fn(|k| of.constant[k] + cos * of.cos[k] + sin * of.sin[k]);
        let [p, r, t] = [0, 3, 6].map(|k| (m[k] + m[k + 1] * c, m[k + 2]));
        // f·D = D·(p + …) + (bx·vx + by·vy·s)(r + …) + (by·vx − bx·vy·s)(t + …), each bracket
        // (even, odd in s).
        let g = d * p.0 + b[0] * vx * r.0 + b[1] * vy * r.1 * s_sq + b[1] * vx * t.0 - b[0] * vy * t.1 * s_sq;
        let h = d * p.1 + b[0] * vx * r.1 + b[1] * vy * r.0 + b[1] * vx * t.1 - b[0] * vy * t.0;
        AtFirst { cos_third: c, sin_third_sq: s_sq, b, d, g, h }
    }

    fn values(&self, of: &Harmonics, at: &AtFirst, phi: f64, positive: bool) -> [f64; 3] {
        let [_, [cos2, sin2], [cos3, sin3]] = self.sides;
        let s = at.sin_third_sq.max(0.0).sqrt() * if positive { 1.0 } else { -1.0 };
        let (vx, vy) = (sin2 * cos3 - cos2 * sin3 * at.cos_third, -sin3 * s);
        let second = (at.b[1] * vx - at.b[0] * vy).atan2(at.b[0] * vx + at.b[1] * vy);
        [of.azimuth - phi, second, s.atan2(at.cos_third)]
    }

    /// Adds the solutions at a root of the polynomial.
    fn at_root(&self, target: &Target<'_>, of: &Harmonics, phi: f64, all: &mut Triples) {
        let (sin, cos) = phi.sin_cos();
        let at = self.at(of, [cos, sin]);
        // Roots near the edge of the third's reach are known only to the root of the rounding.
        if at.sin_third_sq < -1e-5 {
            return;
        }
        let odd = at.h * at.sin_third_sq.max(0.0).sqrt();
        let [plus, minus] = [(at.g + odd).abs(), (at.g - odd).abs()];
        for (positive, own, other) in [(true, plus, minus), (false, minus, plus)] {
            // The other side's condition is not met there, unless both nearly are. Beside the pole
            // the middle value, and with it the condition, changes so fast that the place of a root
            // does not decide.
            if own <= other || own < 1e-4 * at.d * target.scale || at.d < BESIDE_POLE * BESIDE_POLE {
                let (values, error) = self.polished(target, self.values(of, &at, phi, positive));
                self.add(target, values, error, all);
            }
        }
    }

    /// Adds a solution that is distinct from the present ones.
    fn add(&self, target: &Target<'_>, values: [f64; 3], error: f64, all: &mut Triples) {
        if error > 1e-11 {
            return;
        }
        let triple = self.triple(values, None);
        let one_with = |other: &RotaryTriple| {
            let way = [0, 1, 2].map(|k| {
                let d = other.values[k] - triple.values[k];
                d - 2.0 * PI * (0.5 * d / PI).round()
            });
            let middle = [0, 1, 2].map(|k| values[k] + 0.5 * way[k]);
            let is_near = way.iter().all(|d| d.abs() < MAYBE_SAME);
            // Another one of those that differ only in the free value.
            let on_its_curve = other.free == Some(1) && way[0].abs().max(way[2].abs()) < STILL_ON_CURVE;
            on_its_curve || is_near && self.is_met(target, middle)
        };
        if !all.as_slice().iter().any(one_with) {
            all.push(triple);
        }
    }

    /// Adds solutions at the pole of the middle joint, where b and v lie along it: its value
    /// follows from the tip condition alone. Returns whether the pole is near.
    fn beside_pole(&self, target: &Target<'_>, of: &Harmonics, reference: [f64; 3], all: &mut Triples) -> bool {
        let to_first = of.across.atan2(of.along);
        let from_second = [(to_first - self.between).abs(), (PI - to_first - self.between).abs()];
        let mut is_near = false;
        for (k, (phi, third)) in [(0.0, 0.0), (PI, PI)].into_iter().enumerate() {
            if from_second[k].max(self.spindle_from_second[k]) > BESIDE_POLE {
                continue;
            }
            is_near = true;
            let first = of.azimuth - phi;
            let [e1, e3] = [functions(first), functions(third)];
            let by_second = |j: usize| {
                (0..9).map(|ik| e1[ik / 3] * e3[ik % 3] * target.t[9 * (ik / 3) + 3 * j + ik % 3]).sum::<f64>()
            };
            let [p, c, s] = [0, 1, 2].map(by_second);
            let (amplitude, phase) = (c.hypot(s), s.atan2(c));
            let here = reference[1] - self.zero[1];
            if amplitude.max(p.abs()) < HARDLY_A_CONDITION * target.scale {
                let n_before = all.as_slice().len();
                for values in self.middle(target).triples(here) {
                    if self.error(target, values).0 < MET {
                        all.push(self.triple(values, Some(1)));
                    }
                }
                if all.as_slice().len() > n_before {
                    continue;
                }
            }
            let half = (-p / amplitude).clamp(-1.0, 1.0).acos();
            for second in [phase + half, phase - half] {
                self.add_from(target, [first, second, third], all);
            }
        }
        is_near
    }

    /// Adds the solutions by the value of the middle joint.
    fn by_middle(&self, target: &Target<'_>, all: &mut Triples) {
        let middle = self.middle(target);
        for start in middle.roots().as_slice().iter().flat_map(|&second| middle.triples(second)) {
            self.add_from(target, start, all);
        }
    }

    pub(crate) fn middle<'a>(&'a self, target: &'a Target<'a>) -> MiddleRotary<'a> {
        MiddleRotary { w: &self.w, spindle: &self.spindle, target }
    }

    fn add_from(&self, target: &Target<'_>, start: [f64; 3], all: &mut Triples) {
        let (values, error) = self.polished(target, start);
        self.add(target, values, error, all);
    }

    /// Adds solutions where every value of the first joint gives some: those at its reference
    /// value, or, where the third has none there, at the nearest of a row of values.
    fn on_curve(&self, target: &Target<'_>, of: &Harmonics, reference: [f64; 3], all: &mut Triples) {
        let at_reference = of.azimuth - (reference[0] - self.zero[0]);
        let n = 180;
        let n_before = all.as_slice().len();
        for k in 0..=2 * n {
            // 0, 1, −1, 2, −2, … degrees.
            let off = f64::from((k + 1) / 2) * PI / f64::from(n) * if k % 2 == 1 { 1.0 } else { -1.0 };
            let (sin, cos) = (at_reference + off).sin_cos();
            let at = self.at(of, [cos, sin]);
            if at.sin_third_sq < 0.0 {
                continue;
            }
            for positive in [true, false] {
                let values = self.values(of, &at, at_reference + off, positive);
                if self.error(target, values).0 < 1e-11 {
                    all.push(self.triple(values, Some(0)));
                }
            }
            if all.as_slice().len() > n_before {
                return;
            }
        }
    }

    /// Returns whether the forward solution at these values cannot be distinguished from the
    /// target.
    fn is_met(&self, target: &Target<'_>, q: [f64; 3]) -> bool {
        let tip = value_and_gradient(&target.t, &q.map(functions)).0.abs();
        let sine = target.condition.sine(&q).min(1.0);
        // Where the linear joints are nearly parallel, a small value of the condition means a long
        // way for them.
        self.error(target, q).0 < STILL_SOLUTION && tip < (STILL_SOLUTION * sine + ROUNDING) * target.scale
    }

    fn triple(&self, values: [f64; 3], free: Option<usize>) -> RotaryTriple {
        let values = self.machine_values(values);
        let branch = if self.is_positive(values[2]) { Branch::Positive } else { Branch::Negative };
        RotaryTriple { values, branch, free }
    }

    fn machine_values(&self, values: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| values[k] + self.zero[k])
    }

    /// Returns the distance of values from the target, rad (the tip condition over its scale), and
    /// the Newton step from there.
    fn error(&self, target: &Target<'_>, q: [f64; 3]) -> (f64, Option<Vector3<f64>>) {
        let e = q.map(functions);
        let [w1, w2, w3] = &self.w;
        let b = turned(w1, [e[0][1], -e[0][2]], &target.tool_axis);
        let v = turned(w3, [e[2][1], e[2][2]], &self.spindle);
        let second = [e[1][1], e[1][2]];
        let u = turned(w2, second, &v);
        let by = [w1.cross(&b), w2.cross(&u), turned(w2, second, &w3.cross(&v))];
        let (f, gradient) = value_and_gradient(&target.t, &e);
        let off = u - b;
        // Two directions across b: the residual and all derivatives are across it.
        let t1 = b.cross(&Vector3::ith(b.iamin(), 1.0)).normalize();
        let t2 = b.cross(&t1);
        let row = |t: &Vector3<f64>| Vector3::new(t.dot(&by[0]), t.dot(&by[1]), t.dot(&by[2]));
        let (x, y, z) = (row(&t1), row(&t2), gradient / target.scale);
        let residual = Vector3::new(t1.dot(&off), t2.dot(&off), f / target.scale);
        let (yz, zx, xy) = (y.cross(&z), z.cross(&x), x.cross(&y));
        let determinant = x.dot(&yz);
        let step = -(yz * residual.x + zx * residual.y + xy * residual.z) / determinant;
        (off.norm() + residual.z.abs(), (determinant != 0.0 && step.iter().all(|s| s.is_finite())).then_some(step))
    }

    /// Applies Newton's method to all three values, which also converges where two roots of the
    /// polynomial meet. Returns the best values and their [error](Self::error).
    fn polished(&self, target: &Target<'_>, start: [f64; 3]) -> ([f64; 3], f64) {
        const LARGEST_STEP: f64 = 0.3;
        let mut best = start;
        let (mut error, mut step) = self.error(target, start);
        for _ in 0..MOST_STEPS {
            let Some(full) = step else { break };
            let size = full.amax();
            if size < 1e-15 || error < 3e-16 {
                break;
            }
            let full = full * (LARGEST_STEP / size).min(1.0);
            let next = [0, 1, 2].map(|k| best[k] + full[k]);
            let (next_error, next_step) = self.error(target, next);
            if next_error < error {
                (best, error, step) = (next, next_error, next_step);
            } else if error > 1e-14 {
                step = Some(full * 0.25);
            } else {
                break;
            }
        }
        (best, error)
    }
}

/// Returns `v` turned about the unit vector `w`, given cosine and sine.
fn turned(w: &Vector3<f64>, [cos, sin]: [f64; 2], v: &Vector3<f64>) -> Vector3<f64> {
    v * cos + w.cross(v) * sin + w * (w.dot(v) * (1.0 - cos))
}
