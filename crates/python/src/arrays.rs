//! Rows of numpy arrays.

use facemill::cl_data::ClPoint;
use nalgebra::{Point3, Unit, Vector3};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::failure::wrong;

/// Returns the rows of an array of N columns.
///
/// # Errors
/// If it has another number of columns.
pub fn rows<const N: usize>(name: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; N]>> {
    let array = array.as_array();
    let [n, columns] = [array.nrows(), array.ncols()];
    if columns != N {
        return Err(wrong(format!("{name}: must be an array of {N} columns, has the shape ({n}, {columns})")));
    }
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// Returns an array of rows.
pub fn array<'py, const N: usize>(py: Python<'py>, rows: &[[f64; N]]) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn((rows.len(), N), |(i, k)| rows[i][k]).into_pyarray(py)
}

/// Returns tool poses by positions and axes, which need not have length 1.
///
/// # Errors
/// If the arrays have no 3 columns or different lengths, or an axis has no direction.
pub fn poses(positions: &PyReadonlyArray2<'_, f64>, axes: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<ClPoint>> {
    let (positions, axes) = (rows::<3>("positions", positions)?, rows::<3>("axes", axes)?);
    if positions.len() != axes.len() {
        let [n, m] = [positions.len(), axes.len()];
        return Err(wrong(format!("positions and axes: must have the same number of rows, have {n} and {m}")));
    }
    let pose = |(k, (position, axis)): (usize, (&[f64; 3], &[f64; 3]))| {
        let axis = Unit::try_new(Vector3::from(*axis), 1e-9).filter(|axis| axis.iter().all(|v| v.is_finite()));
        let axis = axis.ok_or_else(|| wrong(format!("axes: row {k} has no direction")))?;
        let tip = Point3::from(*position);
        if !tip.iter().all(|v| v.is_finite()) {
            return Err(wrong(format!("positions: row {k} has a number that is not finite")));
        }
        Ok(ClPoint { tip, axis })
    };
    positions.iter().zip(&axes).enumerate().map(pose).collect()
}
