//! Meshes read from files and repaired.

mod accessor;
mod gltf_file;
mod obj;
mod raw_mesh;
pub(crate) mod repair;
pub(crate) mod settings;
mod stl_ascii;
mod stl_binary;
mod threemf;
mod uri;

use std::io;

use crate::import::repair::{RepairReport, repair};
use crate::import::settings::{ImportFault, ImportSettings, LengthUnit, MeshFormat};
use crate::mesh::tri_mesh::TriMesh;

pub(crate) use raw_mesh::RawMesh;

/// A mesh as read, with its faults and repairs.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The mesh, mm, +Z up.
    pub mesh: TriMesh,
    /// Repairs.
    pub report: RepairReport,
}

/// Reason why a mesh file cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{name}: {fault}")]
pub struct ImportError {
    /// The file, as the caller named it.
    pub name: String,
    /// Fault.
    pub fault: ImportFault,
}

/// Reads a mesh from the bytes of a file.
///
/// `name` is the name of the file in errors. `resolve` gets the names of other files that hold a
/// glTF's buffers and returns their bytes; it is not called for data inside the file, nor for
/// textures and materials. [`no_external_files`] refuses all.
///
/// Lengths become mm, the up axis becomes +Z, vertices are welded, triangles without area and exact
/// duplicates are dropped. Open and non-manifold edges, components and their winding are reported
/// and left as they are.
///
/// # Errors
/// Names the file and the line, byte, vertex, triangle, element or object: for coordinates that are
/// not finite, indices out of range, truncated or malformed files, compressed glTF, cyclic nodes
/// and components, 3MF that unpacks or repeats to far more than its size, and a file without
/// triangles.
pub fn import_mesh(
    name: &str,
    bytes: &[u8],
    format: MeshFormat,
    settings: &ImportSettings,
    resolve: &dyn Fn(&str) -> io::Result<Vec<u8>>,
) -> Result<Imported, ImportError> {
    let raw = match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Gltf => gltf_file::read(bytes, resolve),
        MeshFormat::Stl if stl_binary::is_binary(bytes) => stl_binary::read(bytes),
        MeshFormat::Stl => stl_ascii::read(bytes),
        MeshFormat::ThreeMf if settings.unit != LengthUnit::Millimetre => Err(ImportFault::Unsupported {
            feature: "a unit beside that of a 3MF file, which has its own and is turned into mm,".to_owned(),
            hint: "leave the unit out",
        }),
        MeshFormat::ThreeMf => threemf::read(bytes),
    };
    raw.and_then(|raw| repair(raw, settings))
        .map(|(mesh, report)| Imported { mesh, report })
        .map_err(|fault| ImportError { name: name.to_owned(), fault })
}

/// Returns the names of the files that hold buffers of a mesh, as [`import_mesh`] gives them to its
/// `resolve`, also of buffers that no triangle needs; none of a file that it cannot read.
pub fn external_files(bytes: &[u8], format: MeshFormat) -> Vec<String> {
    match format {
        MeshFormat::Gltf => gltf_file::external_files(bytes).unwrap_or_default(),
        MeshFormat::Obj | MeshFormat::Stl | MeshFormat::ThreeMf => Vec::new(),
    }
}

/// Refuses every file: a `resolve` for [`import_mesh`].
///
/// # Errors
/// Always.
pub fn no_external_files(_: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, "other files are not available here"))
}
