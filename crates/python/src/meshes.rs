//! Mesh files from and to arrays.

use std::path::{Path, PathBuf};

use facemill::job_file::{UnitFile, UpAxisFile};
use facemill::surface_model::{NamedNode, TriMesh, write_glb, write_obj, write_stl_binary};
use nalgebra::{Isometry3, Point3};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{array, rows};
use crate::failure::{raised, wrong};

/// Vertices and triangles.
type MeshArrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>);

/// Reads a mesh file.
///
/// # Errors
/// If it cannot be read or is no mesh, or unit or axis are unknown.
#[pyfunction]
#[pyo3(signature = (path, unit=None, up_axis=None))]
pub fn read_mesh<'py>(
    py: Python<'py>,
    path: PathBuf,
    unit: Option<&str>,
    up_axis: Option<&str>,
) -> PyResult<MeshArrays<'py>> {
    let unit = unit.map(|unit| match unit {
        "m" => Ok(UnitFile::Metre),
        "cm" => Ok(UnitFile::Centimetre),
        "mm" => Ok(UnitFile::Millimetre),
        "inch" => Ok(UnitFile::Inch),
        _ => Err(wrong(format!("unit: must be m, cm, mm or inch, is {unit}"))),
    });
    let up = up_axis.map(|axis| match axis {
        "x" => Ok(UpAxisFile::X),
        "y" => Ok(UpAxisFile::Y),
        "z" => Ok(UpAxisFile::Z),
        _ => Err(wrong(format!("up_axis: must be x, y or z, is {axis}"))),
    });
    let (unit, up) = (unit.transpose()?, up.transpose()?);
    let imported = py.detach(|| facemill::read_mesh(&path, unit, up)).map_err(|failure| raised(py, &failure))?;
    let vertices: Vec<[f64; 3]> = imported.mesh.vertices().iter().map(|p| [p.x, p.y, p.z]).collect();
    let triangles = imported.mesh.triangles();
    let triangles = Array2::from_shape_fn((triangles.len(), 3), |(i, k)| triangles[i][k]);
    Ok((array(py, &vertices), triangles.into_pyarray(py)))
}

/// Returns the bytes of a mesh file in the format that its name's ending says.
///
/// # Errors
/// If the arrays are no mesh, or the ending is unknown.
#[pyfunction]
pub fn mesh_bytes<'py>(
    py: Python<'py>,
    name: PathBuf,
    vertices: PyReadonlyArray2<'py, f64>,
    triangles: PyReadonlyArray2<'py, u32>,
) -> PyResult<Bound<'py, PyBytes>> {
    let vertices = rows::<3>("vertices", &vertices)?.into_iter().map(Point3::from).collect();
    let array = triangles.as_array();
    if array.ncols() != 3 {
        return Err(wrong(format!("triangles: must be an array of 3 columns, has {}", array.ncols())));
    }
    let triangles = array.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect();
    let mesh = TriMesh::new(vertices, triangles).map_err(wrong)?;
    let ending = Path::new(&name).extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let node = [NamedNode { name: "mesh", mesh: 0, transform: Isometry3::identity() }];
    let written = match ending.as_str() {
        "obj" => write_obj(&[&mesh], &node),
        "stl" => write_stl_binary(&[&mesh], &node),
        "glb" => write_glb(&[&mesh], &node),
        _ => return Err(wrong(format!("{}: the ending must be .obj, .stl or .glb", name.display()))),
    };
    Ok(PyBytes::new(py, &written.map_err(wrong)?))
}
