use std::f64::consts::TAU;

use nalgebra::Point3;

use crate::axes::axis_values::{AxisValues, MAX_AXES};
use crate::solver::screw_chain::{LinearMap, ScrewChain};

/// Values of three linear joints as quotients of functions of two rotary values.
///
/// By Cramer's rule they are quotients of determinants. Every rotary joint turns everything behind
/// it alike, and a determinant does not change when all its columns are turned. So each rotary
/// value appears only in the first power of its cosine and sine, and nine coefficients suffice. The
/// numerators are linear in the tip and in the tool length too.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LinearTables {
    /// Coefficients of each linear joint, for the constant, the tip's coordinates and the tool
    /// length.
    numerators: [[[f64; 9]; 5]; 3],
    determinant: [f64; 9],
}

/// The tables for one tip.
pub(crate) struct LinearTablesAt {
    numerators: [[f64; 9]; 3],
    determinant: [f64; 9],
}

impl LinearTables {
    /// Creates the tables for rotary axes with these indices, from the table to the tool.
    pub(crate) fn new(chain: &ScrewChain, rotaries: [usize; 2]) -> Self {
        let mut tables = Self { numerators: [[[0.0; 9]; 5]; 3], determinant: [0.0; 9] };
        // The weights of three equidistant samples in 1, cos and sin.
        let weight = |function: usize, angle: f64| match function {
            0 => 1.0 / 3.0,
            1 => 2.0 / 3.0 * angle.cos(),
            _ => 2.0 / 3.0 * angle.sin(),
        };
        for sample in 0..9 {
            let at = [sample / 3, sample % 3].map(|k| k as f64 * TAU / 3.0);
            let mut q = AxisValues::zeros(MAX_AXES);
            for (axis, value) in rotaries.into_iter().zip(at) {
                q[axis] = value;
            }
            let map = chain.linear_map(&q, 0.0);
            let (rows, determinant) = map.cofactors();
            for entry in 0..9 {
                let w = weight(entry / 3, at[0]) * weight(entry % 3, at[1]);
                tables.determinant[entry] += w * determinant;
                for (numerator, row) in tables.numerators.iter_mut().zip(&rows) {
                    let parts = [-row.dot(&map.offset), row.x, row.y, row.z, row.dot(&map.tool_axis)];
                    for (part, value) in numerator.iter_mut().zip(parts) {
                        part[entry] += w * value;
                    }
                }
            }
        }
        tables
    }

    pub(crate) fn at(&self, tip: &Point3<f64>, tool_length: f64) -> LinearTablesAt {
        let numerators = self.numerators.each_ref().map(|[constant, x, y, z, length]| {
            std::array::from_fn(|k| constant[k] + tip.x * x[k] + tip.y * y[k] + tip.z * z[k] + tool_length * length[k])
        });
        LinearTablesAt { numerators, determinant: self.determinant }
    }
}

impl LinearTablesAt {
    /// Returns the linear values for cosines and sines of the rotary ones; `None` where the linear
    /// joints are dependent.
    pub(crate) fn solve(&self, [[c, s], [d, t]]: [[f64; 2]; 2]) -> Option<[f64; 3]> {
        let products = [1.0, d, t, c, c * d, c * t, s, s * d, s * t];
        let sum = |table: &[f64; 9]| table.iter().zip(&products).map(|(a, b)| a * b).sum::<f64>();
        let determinant = sum(&self.determinant);
        let back = 1.0 / determinant;
        (determinant.abs() >= LinearMap::MIN_DETERMINANT).then(|| self.numerators.each_ref().map(|n| sum(n) * back))
    }
}
