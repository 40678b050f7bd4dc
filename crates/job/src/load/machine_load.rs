//! Machine files with the meshes that their bodies name.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use facemill_cl_data::ConvexPolyhedron;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::{BodyMesh, MachineFile, MeshUnitFile};
use facemill_surface_model::{Edges, Topology, TriMesh};

use crate::failure::Failure;
use crate::format::job_file::UnitFile;
use crate::load::job_files::JobFiles;
use crate::load::mesh_files::read_mesh_of;
use crate::load::obstacle_meshes::matches_pattern;

/// Machine as each of its heads sees it, and the hulls of its bodies that are meshes.
#[non_exhaustive]
pub struct ReadMachine {
    /// One view for each head.
    pub heads: Vec<Machine>,
    /// The bodies that are meshes.
    pub hulls: Vec<BodyHull>,
}

/// Body of a machine made from a mesh: its convex hull, or slightly more.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyHull {
    /// Name of the body.
    pub body: String,
    /// The mesh file, as the machine file names it.
    pub file: String,
    /// Vertices of the hull.
    pub n_vertices: usize,
    /// Volume of the hull, mm³.
    pub hull_mm3: f64,
    /// Volume of the mesh, mm³; `None` if it is not closed.
    pub mesh_mm3: Option<f64>,
}

/// Reads a machine file and the meshes beside it.
///
/// # Errors
/// If a file cannot be read or is wrong; the message names the machine file, its field and the mesh
/// file.
pub fn read_machine(path: &Path) -> Result<ReadMachine, Failure> {
    read_machine_of(&JobFiles::in_folder(""), path)
}

/// Reads a machine file of a job as [`read_machine`] does.
pub(crate) fn read_machine_of(files: &JobFiles, path: &Path) -> Result<ReadMachine, Failure> {
    let file: MachineFile = facemill_file_format::from_json(&files.text(path)?).map_err(|e| Failure::input(path, e))?;
    let mut hulls = Vec::new();
    let file = file.with_hulls(|wanted| {
        let mesh = mesh_of(files, path, wanted).map_err(|problem| Failure::input(path, problem))?;
        let hull = hull_of(&mesh).map_err(|problem| Failure::input(path, in_field(wanted, problem)))?;
        hulls.push(BodyHull {
            body: wanted.body.to_owned(),
            file: wanted.shape.file.clone(),
            n_vertices: hull.vertices().len(),
            hull_mm3: hull.volume(),
            mesh_mm3: volume(&mesh),
        });
        Ok::<_, Failure>(Arc::new(hull))
    })?;
    let heads = Machine::heads(file).map_err(|e| Failure::input(path, e))?;
    Ok(ReadMachine { heads, hulls })
}

impl BodyHull {
    /// Returns the excess of the hull's volume as a fraction of the mesh's; `None` if the mesh has
    /// none.
    pub fn excess(&self) -> Option<f64> {
        self.mesh_mm3.filter(|v| *v > 0.0).map(|v| (self.hull_mm3 / v - 1.0).max(0.0))
    }
}

fn in_field(wanted: &BodyMesh<'_>, problem: impl std::fmt::Display) -> String {
    format!("{} (body {:?}): mesh file {:?}: {problem}", wanted.field, wanted.body, wanted.shape.file)
}

/// Returns the groups of the mesh that a body names.
fn mesh_of(files: &JobFiles, machine: &Path, wanted: &BodyMesh<'_>) -> Result<TriMesh, String> {
    let path = machine.parent().unwrap_or(Path::new("")).join(&wanted.shape.file);
    let unit = wanted.shape.unit.map(|unit| match unit {
        MeshUnitFile::Metre => UnitFile::Metre,
        MeshUnitFile::Centimetre => UnitFile::Centimetre,
        MeshUnitFile::Millimetre => UnitFile::Millimetre,
        MeshUnitFile::Inch => UnitFile::Inch,
    });
    let mesh = match read_mesh_of(files, &path, unit, None) {
        Ok(imported) => imported.mesh,
        Err(Failure::Input { message, .. }) => return Err(in_field(wanted, message)),
        Err(failure) => {
            let hint = "its name is relative to the machine file; correct it or put the file there";
            return Err(in_field(wanted, format!("{failure}; {hint}")));
        }
    };
    let Some(patterns) = &wanted.shape.groups else { return Ok(mesh) };
    for pattern in patterns {
        if !mesh.groups().iter().any(|g| matches_pattern(pattern, &g.name)) {
            let names: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
            let problem = format!("groups: no group is called {pattern:?}; the file has: {}", names.join(", "));
            return Err(in_field(wanted, problem));
        }
    }
    Ok(mesh.select_groups(|name| patterns.iter().any(|p| matches_pattern(p, name))))
}

/// Returns a convex polyhedron around the triangles of a mesh.
fn hull_of(mesh: &TriMesh) -> Result<ConvexPolyhedron, String> {
    let used: BTreeSet<u32> = mesh.triangles().iter().flatten().copied().collect();
    let points: Vec<_> = used.into_iter().map(|k| mesh.vertices()[k as usize]).collect();
    let facets = (0..mesh.triangles().len()).map(|t| mesh.scaled_normal(t));
    ConvexPolyhedron::around(&points, facets)
        .map_err(|e| format!("{e}; give a mesh with a volume, or describe the body as a box, cylinder or frustum"))
}

/// Returns the volume of a mesh of closed components, mm³.
fn volume(mesh: &TriMesh) -> Option<f64> {
    let topology = Topology::of(mesh, &Edges::of(mesh));
    let all: Option<Vec<f64>> = topology.components.iter().map(|c| c.volume_mm3).collect();
    all.map(|volumes| volumes.iter().sum::<f64>().abs())
}
