//! Places of a machine's links as products of matrices made from the rows of its file, read as
//! JSON.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Rotation3, Translation3, Vector3};
use serde_json::Value;

use crate::oracles::read_back::number;

/// Value of every axis, mm and deg, by its name.
pub type Words = BTreeMap<String, f64>;

/// The frame behind a chain of rows: Craig's RotX(alpha) · TransX(a) · RotZ(theta) · TransZ(d),
/// joints at their words.
///
/// # Panics
/// When a word is missing.
pub fn end_of(rows: &Value, words: &Words) -> Matrix4<f64> {
    let turn = |axis: Vector3<f64>, deg: f64| Rotation3::new(axis * deg.to_radians()).to_homogeneous();
    let shift = |v: Vector3<f64>| Translation3::from(v).to_homogeneous();
    rows.as_array().expect("rows").iter().fold(Matrix4::identity(), |frame, row| {
        let [a, alpha, mut d, mut theta] = ["a_mm", "alpha_deg", "d_mm", "theta_deg"].map(|key| number(&row[key]));
        for (kind, value) in [("prismatic", &mut d), ("revolute", &mut theta)] {
            if let Some(joint) = row.pointer(&format!("/joint/{kind}")) {
                let sign = if joint["sense"] == "positive" { 1.0 } else { -1.0 };
                *value += sign * words[joint["axis"].as_str().expect("a name")];
            }
        }
        frame
            * turn(Vector3::x(), alpha)
            * shift(Vector3::new(a, 0.0, 0.0))
            * turn(Vector3::z(), theta)
            * shift(Vector3::new(0.0, 0.0, d))
    })
}
