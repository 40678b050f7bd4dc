//! Machines.

use std::path::PathBuf;

use facemill::inverse_kinematics::{self, AxisKind, AxisValues, InverseSolution, preset};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{array, poses};
use crate::failure::{raised, wrong};
use crate::interrupt::in_blocks;

/// Names of the machines that come with facemill.
#[pyfunction]
pub fn preset_names() -> Vec<&'static str> {
    inverse_kinematics::preset_names().to_vec()
}

/// Positions and axes.
type PoseArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Machine with one head.
#[pyclass(frozen, module = "facemill")]
pub struct Machine {
    machine: inverse_kinematics::Machine,
}

impl Machine {
    /// Returns the machine of the library.
    pub fn inner(&self) -> &inverse_kinematics::Machine {
        &self.machine
    }

    /// Returns axis values of numbers in mm and degrees.
    fn values(&self, numbers: impl Fn(usize) -> f64) -> AxisValues {
        let axes = self.machine.axes();
        AxisValues::from_fn(axes.len(), |k| match axes[k].kind {
            AxisKind::Rotary => numbers(k).to_radians(),
            AxisKind::Linear => numbers(k),
        })
    }

    /// Returns the solution that takes the least time from a position.
    fn nearest(&self, all: impl Iterator<Item = InverseSolution>, from: &AxisValues) -> Option<AxisValues> {
        let axes = self.machine.axes();
        let time = |q: &AxisValues| {
            let times = axes.iter().enumerate().map(|(k, axis)| (q[k] - from[k]).abs() / axis.max_velocity);
            times.fold(0.0, f64::max)
        };
        all.map(|solution| solution.values).min_by(|a, b| time(a).total_cmp(&time(b)))
    }
}

#[pymethods]
impl Machine {
    #[new]
    fn new(py: Python<'_>, path_or_name: PathBuf) -> PyResult<Self> {
        let known = path_or_name.to_str().and_then(preset);
        let mut heads = match known {
            Some(text) => inverse_kinematics::Machine::heads_from_json(text.as_bytes()).map_err(wrong)?,
            None if path_or_name.exists() => {
                facemill::machines::read_machine(&path_or_name).map_err(|failure| raised(py, &failure))?.heads
            }
            None => {
                let names = inverse_kinematics::preset_names().join(", ");
                let name = path_or_name.display();
                return Err(wrong(format!("{name}: is no file, and no preset; presets are {names}")));
            }
        };
        match (heads.pop(), heads.len()) {
            (Some(machine), 0) => Ok(Self { machine }),
            _ => {
                Err(wrong(format!("{}: has two heads; only machines with one are known here", path_or_name.display())))
            }
        }
    }

    #[getter]
    fn name(&self) -> &str {
        self.machine.name()
    }

    #[getter]
    fn axis_names(&self) -> Vec<String> {
        self.machine.axes().iter().map(|axis| axis.letter.to_string()).collect()
    }

    #[getter]
    fn home(&self) -> Vec<f64> {
        let home = self.machine.home();
        self.machine.axes().iter().enumerate().map(|(k, axis)| axis.in_word_unit(home[k])).collect()
    }

    #[getter]
    fn limits(&self) -> Vec<(f64, f64)> {
        self.machine.axes().iter().map(|axis| (axis.in_word_unit(axis.min), axis.in_word_unit(axis.max))).collect()
    }

    #[pyo3(signature = (joints, tool_length=0.0))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        joints: PyReadonlyArray2<'py, f64>,
        tool_length: f64,
    ) -> PyResult<PoseArrays<'py>> {
        let (joints, n) = (joints.as_array(), self.machine.axes().len());
        if joints.ncols() != n {
            let (rows, columns) = joints.dim();
            return Err(wrong(format!("joints: must be an array of {n} columns, has the shape ({rows}, {columns})")));
        }
        let (positions, axes): (Vec<_>, Vec<_>) = in_blocks(py, joints.nrows(), |i| {
            let pose = self.machine.cl_point(&self.values(|k| joints[(i, k)]), tool_length);
            (<[f64; 3]>::from(pose.tip.coords), <[f64; 3]>::from(pose.axis.into_inner()))
        })?
        .into_iter()
        .unzip();
        Ok((array(py, &positions), array(py, &axes)))
    }

    #[pyo3(signature = (positions, axes, tool_length=0.0, near=None))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
        axes: PyReadonlyArray2<'py, f64>,
        tool_length: f64,
        near: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (poses, n) = (poses(&positions, &axes)?, self.machine.axes().len());
        let near = match near {
            None => self.machine.home(),
            Some(near) if near.as_array().len() == n => self.values(|k| near.as_array()[k]),
            Some(near) => return Err(wrong(format!("near: must have {n} values, has {}", near.as_array().len()))),
        };
        let solved: Vec<Option<AxisValues>> = in_blocks(py, poses.len(), |i| {
            let all = self.machine.inverse_near(&poses[i], tool_length, &near).ok()?;
            self.nearest(all.iter(), &near)
        })?;
        let axes = self.machine.axes();
        let value = |(i, k): (usize, usize)| solved[i].map_or(f64::NAN, |q| axes[k].in_word_unit(q[k]));
        Ok(Array2::from_shape_fn((solved.len(), n), value).into_pyarray(py))
    }

    fn __repr__(&self) -> String {
        format!("Machine({:?}, axes {})", self.name(), self.axis_names().join(" "))
    }
}
