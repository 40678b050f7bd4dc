use nalgebra::{Point3, Vector3};

use crate::solver::inverse_solution::{Branch, MAX_SOLUTIONS};
use crate::solver::tip_condition::{Coefficients, TipCondition};

/// Rotary values nearer to each other than this are one solution, rad: two that are nearer miss the
/// pose in between by less than 1e-12 rad, so they cannot be distinguished.
const SAME_SOLUTION: f64 = 1e-6;

/// Rotary values of a solution, from the table to the tool.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotaryTriple {
    pub(crate) values: [f64; 3],
    pub(crate) branch: Branch,
    /// Index of the one that may take other values.
    pub(crate) free: Option<usize>,
}

/// Rotary values of all solutions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triples {
    items: [RotaryTriple; MAX_SOLUTIONS],
    n: usize,
}

impl Triples {
    pub(crate) fn new() -> Self {
        let none = RotaryTriple { values: [0.0; 3], branch: Branch::Positive, free: None };
        Self { items: [none; MAX_SOLUTIONS], n: 0 }
    }

    pub(crate) fn as_slice(&self) -> &[RotaryTriple] {
        &self.items[..self.n]
    }

    /// Adds a solution that is not among them yet.
    pub(crate) fn push(&mut self, triple: RotaryTriple) {
        let same = |other: &RotaryTriple| {
            (0..3).all(|k| (0.5 * (other.values[k] - triple.values[k])).sin().abs() < 0.5 * SAME_SOLUTION)
        };
        if self.n < MAX_SOLUTIONS && !self.as_slice().iter().any(same) {
            self.items[self.n] = triple;
            self.n += 1;
        }
    }
}

/// A pose to be reached.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    pub(crate) condition: &'a TipCondition,
    pub(crate) tool_axis: Vector3<f64>,
    /// Tip condition.
    pub(crate) t: Coefficients,
    /// Its largest coefficient: the scale of everything derived from it.
    pub(crate) scale: f64,
}

impl<'a> Target<'a> {
    pub(crate) fn new(
        condition: &'a TipCondition,
        tip: &Point3<f64>,
        tool_axis: &Vector3<f64>,
        tool_length: f64,
    ) -> Self {
        let t = condition.at(tip, tool_length);
        let scale = t.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        Self { condition, tool_axis: *tool_axis, t, scale }
    }
}
