use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use crate::axes::axis_values::AxisValues;
use crate::solver::screw_chain::ScrewChain;

/// Coefficients of 1, cos and sin of each of three rotary values: entry 9·i + 3·j + k belongs to
/// the i-th function of the first, the j-th of the second, the k-th of the third.
pub(crate) type Coefficients = [f64; 27];

/// Condition that two linear joints cannot meet: the tip's distance from the plane of their motion,
/// as a function of three rotary values.
///
/// With d and e the directions of the linear joints, the distance times |d × e| is det(d, e, tip −
/// offset). Every rotary joint turns everything behind it alike, and a determinant does not change
/// when all its columns are turned. So each rotary value appears only in the first power of its
/// cosine and sine. It is linear in the tip and in the tool length too.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TipCondition {
    /// Coefficients for the constant, the tip's coordinates and the tool length.
    parts: [Coefficients; 5],
}

impl TipCondition {
    /// Sets up the condition for rotary values counted from `zero`.
    pub(crate) fn new(chain: &ScrewChain, rotaries: [usize; 3], zero: [f64; 3]) -> Self {
        let mut parts = [[0.0; 27]; 5];
        let angles = [0.0, TAU / 3.0, 2.0 * TAU / 3.0];
        // The weights of three equidistant samples in 1, cos and sin.
        let weight = |function: usize, angle: f64| match function {
            0 => 1.0 / 3.0,
            1 => 2.0 / 3.0 * angle.cos(),
            _ => 2.0 / 3.0 * angle.sin(),
        };
        for sample in 0..27 {
            let at = [sample / 9, sample / 3 % 3, sample % 3].map(|k| angles[k]);
            let mut q = AxisValues::zeros(crate::axes::axis_values::MAX_AXES);
            for k in 0..3 {
                q[rotaries[k]] = at[k] + zero[k];
            }
            let values = values_at(chain, &q);
            for entry in 0..27 {
                let w = weight(entry / 9, at[0]) * weight(entry / 3 % 3, at[1]) * weight(entry % 3, at[2]);
                for (part, value) in parts.iter_mut().zip(values) {
                    part[entry] += w * value;
                }
            }
        }
        Self { parts }
    }

    /// Returns the sine of the angle between the two linear joints: the condition over it is the
    /// tip's distance from their plane, mm.
    pub(crate) fn sine(&self, values: &[f64; 3]) -> f64 {
        let e = values.map(functions);
        let [_, x, y, z, _] = &self.parts;
        Vector3::from([x, y, z].map(|part| value_and_gradient(part, &e).0)).norm()
    }

    /// Returns the condition for one tip.
    pub(crate) fn at(&self, tip: &Point3<f64>, tool_length: f64) -> Coefficients {
        let [constant, x, y, z, length] = &self.parts;
        std::array::from_fn(|k| constant[k] + tip.x * x[k] + tip.y * y[k] + tip.z * z[k] + tool_length * length[k])
    }
}

/// Returns det(d, e, tip − offset) as factors of 1, the tip's coordinates and the tool length.
fn values_at(chain: &ScrewChain, q: &AxisValues) -> [f64; 5] {
    let map = chain.linear_map(q, 0.0);
    let normal: Vector3<f64> = map.directions.column(0).cross(&map.directions.column(1));
    [-normal.dot(&map.offset), normal.x, normal.y, normal.z, normal.dot(&map.tool_axis)]
}

/// Returns 1, cos and sin of a value.
pub(crate) fn functions(value: f64) -> [f64; 3] {
    let (sin, cos) = value.sin_cos();
    [1.0, cos, sin]
}

/// Returns the value of the condition and its derivatives by the three rotary values, from the
/// functions of each.
pub(crate) fn value_and_gradient(t: &Coefficients, e: &[[f64; 3]; 3]) -> (f64, Vector3<f64>) {
    let d = e.map(|[_, cos, sin]| [-sin, cos]);
    let (mut value, mut gradient) = (0.0, Vector3::zeros());
    let (mut by_first, mut values) = ([0.0; 3], [[0.0; 3]; 3]);
    for i in 0..3 {
        for j in 0..3 {
            let [a, b, c] = [t[9 * i + 3 * j], t[9 * i + 3 * j + 1], t[9 * i + 3 * j + 2]];
            values[i][j] = a + b * e[2][1] + c * e[2][2];
            gradient.z += e[0][i] * e[1][j] * (b * d[2][0] + c * d[2][1]);
        }
        let [a, b, c] = values[i];
        by_first[i] = a + b * e[1][1] + c * e[1][2];
        gradient.y += e[0][i] * (b * d[1][0] + c * d[1][1]);
        value += e[0][i] * by_first[i];
    }
    gradient.x = by_first[1] * d[0][0] + by_first[2] * d[0][1];
    (value, gradient)
}
