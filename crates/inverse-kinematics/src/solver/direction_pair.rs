use std::f64::consts::{PI, TAU};

use nalgebra::{Unit, Vector3};

/// Solution of two rotary axes in general position that turn the spindle to a direction.
///
/// The tool axis is `Rot(first, q₁) · Rot(second, q₂) · spindle`; linear joints between them do not
/// matter. The three directions `first`, `second` and the tool axis seen from between the two
/// joints are corners of a triangle on the unit sphere with known sides, so its angles follow from
/// the half-angle formulas, which lose no digits near the poles. (The same two circles intersected
/// with vectors are Paden and Kahan's second subproblem.)
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DirectionPair {
    pub(crate) first: RotaryAxis,
    pub(crate) second: RotaryAxis,
    /// Angle between the axes.
    between: f64,
    /// Angle between the second axis and the spindle.
    spindle_to_second: f64,
    /// +1, or −1 where the first axis had to be reversed so that it is within 90° of the spindle at
    /// the zero pose.
    first_sign: f64,
    /// Constants of the sides for [`DirectionPair::solve_regular`].
    constants: SideConstants,
}

/// B is the side between the axes, C that from the spindle to the second axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SideConstants {
    cos_between: f64,
    sin_between: f64,
    cos_spindle: f64,
    sin_spindle: f64,
    /// cos(B − C) and cos(B + C).
    cos_near: f64,
    cos_far: f64,
    /// Cosine and sine of the spindle's azimuth about the second axis.
    spindle: [f64; 2],
}

/// A rotary value with its cosine and sine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turned {
    pub(crate) value: f64,
    pub(crate) direction: [f64; 2],
}

/// A rotary axis with an azimuth about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RotaryAxis {
    /// Index among the machine's axes.
    pub(crate) axis: usize,
    pub(crate) direction: Vector3<f64>,
    /// Directions of azimuth 0 and 90°.
    pub(crate) zero: Vector3<f64>,
    pub(crate) quarter: Vector3<f64>,
    /// Azimuth of the spindle at the zero pose; unused for the first axis.
    pub(crate) spindle_azimuth: f64,
}

/// The rotary values that reach a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PairSolution {
    /// Two pairs (first, second): the second axis on its positive and on its negative side.
    Two { positive: [f64; 2], negative: [f64; 2] },
    /// Edge of the reach: both sides coincide.
    One([f64; 2]),
    /// The direction lies on the first axis, which may have any value; holds the value of the
    /// second.
    FirstFree(f64),
    /// Out of reach by this angle.
    Beyond(f64),
}

/// Reason why two axes do not turn a tool to a range of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PairFault {
    Parallel,
    SpindleAlongSecond,
}

/// Angle below which two directions count as the same, rad. It has to stay below the guaranteed
/// accuracy of solutions (1e-12), because at the pole the azimuth of the direction is dropped, and
/// above rounding (1e-15), where the azimuth is noise.
pub(crate) const SAME_DIRECTION: f64 = 4e-13;

/// Sine of the angle below which axes of a machine count as parallel: the rounding of a file in
/// degrees with nine digits.
pub(crate) const PARALLEL_SINE: f64 = 1e-9;

impl DirectionPair {
    pub(crate) fn new(
        first: (usize, Unit<Vector3<f64>>),
        second: (usize, Unit<Vector3<f64>>),
        spindle: &Unit<Vector3<f64>>,
    ) -> Result<Self, PairFault> {
        let first_sign = if first.1.dot(spindle) < 0.0 { -1.0 } else { 1.0 };
        let (u, w) = (first.1.into_inner() * first_sign, second.1.into_inner());
        if u.cross(&w).norm() < PARALLEL_SINE {
            return Err(PairFault::Parallel);
        }
        if spindle.cross(&w).norm() < PARALLEL_SINE {
            return Err(PairFault::SpindleAlongSecond);
        }
        let second = RotaryAxis::new(second.0, w, &u, spindle);
        let (between, spindle_to_second) = (angle(&u, &w), angle(spindle, &w));
        let constants = SideConstants {
            cos_between: between.cos(),
            sin_between: between.sin(),
            cos_spindle: spindle_to_second.cos(),
            sin_spindle: spindle_to_second.sin(),
            cos_near: (between - spindle_to_second).cos(),
            cos_far: (between + spindle_to_second).cos(),
            spindle: [second.spindle_azimuth.cos(), second.spindle_azimuth.sin()],
        };
        let first = RotaryAxis::new(first.0, u, &w, spindle);
        Ok(Self { first, second, between, spindle_to_second, first_sign, constants })
    }

    /// Returns the values of both axes on the positive and on the negative side by the law of
    /// cosines, which needs fewer functions than the half-angle formulas and loses digits near the
    /// pole and the edges of the reach: `None` where cosines are nearer to those there than
    /// `apart`.
    pub(crate) fn solve_regular(&self, tool_axis: &Vector3<f64>, apart: f64) -> Option<[[Turned; 2]; 2]> {
        let of = &self.constants;
        let cos = tool_axis.dot(&self.first.direction);
        let [x, y] = [tool_axis.dot(&self.first.zero), tool_axis.dot(&self.first.quarter)];
        let across_sq = x * x + y * y;
        let (near, far) = (of.cos_near - cos, cos - of.cos_far);
        let is_regular = across_sq > apart && near > apart && far > apart;
        if !is_regular {
            return None;
        }
        // At the second axis: near + far = 2·sin B·sin C, tan(γ₂/2)² = near/far.
        let sides = 2.0 * of.sin_between * of.sin_spindle;
        let (cos_second, sin_second) = ((far - near) / sides, 2.0 * (near * far).sqrt() / sides);
        // At the first, times sin A: sin γ₁ = sin γ₂·sin C / sin A.
        let cos_first = (of.cos_spindle - cos * of.cos_between) / of.sin_between;
        let sin_first = sin_second * of.sin_spindle;
        let (at_first, at_second) = (sin_first.atan2(cos_first), sin_second.atan2(cos_second));
        let azimuth = y.atan2(x);
        let [c, s] = of.spindle;
        Some([1.0, -1.0].map(|side| {
            let sin_first = side * sin_first;
            let first = Turned {
                value: self.first_sign * (azimuth + side * at_first),
                direction: [
                    (x * cos_first - y * sin_first) / across_sq,
                    self.first_sign * (y * cos_first + x * sin_first) / across_sq,
                ],
            };
            let sin_second = side * sin_second;
            let second = Turned {
                value: side * at_second - self.second.spindle_azimuth,
                direction: [cos_second * c + sin_second * s, sin_second * c - cos_second * s],
            };
            [first, second]
        }))
    }

    /// Returns the values of both axes, each within ±2π, for a tool axis in the table frame.
    pub(crate) fn solve(&self, tool_axis: &Vector3<f64>) -> PairSolution {
        let to_first = angle(tool_axis, &self.first.direction);
        let half = 0.5 * (to_first + self.between + self.spindle_to_second);
        // Half the perimeter minus each side: all four sines are positive inside the reach.
        let margins = [half - to_first, half - self.between, half - self.spindle_to_second, PI - half];
        let beyond = margins.iter().fold(0.0_f64, |worst, m| worst.max(-2.0 * m));
        if beyond > SAME_DIRECTION {
            return PairSolution::Beyond(beyond);
        }
        let [s_first, s_between, s_spindle, s_half] = margins.map(|m| m.max(0.0).sin().max(0.0));
        let at_second = 2.0 * (s_between * s_spindle).sqrt().atan2((s_half * s_first).sqrt());
        let spindle = self.second.spindle_azimuth;
        if to_first < SAME_DIRECTION || PI - to_first < SAME_DIRECTION {
            return PairSolution::FirstFree(at_second - spindle);
        }
        let at_first = 2.0 * (s_between * s_first).sqrt().atan2((s_half * s_spindle).sqrt());
        let azimuth = self.first.azimuth(tool_axis);
        let positive = [self.first_sign * (azimuth + at_first), at_second - spindle];
        if at_second < SAME_DIRECTION || PI - at_second < SAME_DIRECTION {
            return PairSolution::One(positive);
        }
        PairSolution::Two { positive, negative: [self.first_sign * (azimuth - at_first), -at_second - spindle] }
    }

    /// Returns whether this value of the second axis belongs to the positive side: the spindle is
    /// between 0 and 180° right-handed about the second axis from its place nearest to the first.
    pub(crate) fn is_positive(&self, second_value: f64) -> bool {
        (second_value + self.second.spindle_azimuth).rem_euclid(TAU) <= PI
    }
}

impl RotaryAxis {
    pub(crate) fn new(axis: usize, direction: Vector3<f64>, toward: &Vector3<f64>, spindle: &Vector3<f64>) -> Self {
        let zero = (toward - direction * direction.dot(toward)).normalize();
        let mut rotary = Self { axis, direction, zero, quarter: direction.cross(&zero), spindle_azimuth: 0.0 };
        rotary.spindle_azimuth = rotary.azimuth(spindle);
        rotary
    }

    fn azimuth(&self, v: &Vector3<f64>) -> f64 {
        v.dot(&self.quarter).atan2(v.dot(&self.zero))
    }
}

/// Returns the angle between two unit vectors, accurate at 0 and π too.
pub(crate) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
