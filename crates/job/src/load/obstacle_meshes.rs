//! Meshes that must not be cut or hit, from the groups to which a job gives a role.

pub mod datums;

use std::ops::Deref;
use std::sync::Arc;

use facemill_cl_data::{RoundBox, Solid};
use facemill_cutter_location::Pieces;
use facemill_interference::Interference;
use facemill_inverse_kinematics::Machine;
use facemill_mesh_store::TreeMesh;
use facemill_surface_model::{Group, TriMesh};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use crate::failure::Failure;
use crate::format::job_file::MeshFile;
use crate::load::job::Job;
use crate::load::mesh_files::{FileKey, MeshFiles};

/// Mesh that must not be cut or hit, workpiece frame.
pub struct ObstacleMesh {
    /// Role and file, for findings.
    pub name: String,
    /// Its role.
    pub role: ObstacleRole,
    /// The mesh with its hierarchy, which other setups may have, too.
    pub shape: Arc<TreeMesh>,
    /// Material that the cutter must leave on it, mm.
    pub allowance: f64,
    /// File and group of each group of the mesh, if it is from the job's files.
    pub labels: Vec<String>,
    /// Index among the machine's bodies, if it is one.
    pub machine_body: Option<usize>,
}

impl Deref for ObstacleMesh {
    type Target = TreeMesh;

    fn deref(&self) -> &TreeMesh {
        &self.shape
    }
}

impl Pieces for ObstacleMesh {
    /// Returns the obstacle's name with the file and group nearest to a place on it.
    fn name_at(&self, place: &Point3<f64>) -> String {
        let point = RoundBox { half_extents: Vector3::zeros(), rounding: 0.0 };
        let at = Isometry3::from(Translation3::from(place.coords));
        let nearest = self.tree().core_distance(&Solid::Box(point), &at, f64::INFINITY, None);
        let label = nearest.and_then(|s| self.labels.get(self.mesh.group_of(s.triangle as usize)?));
        label.map_or_else(|| self.name.clone(), |label| format!("{} ({label})", self.name))
    }
}

/// Role of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ObstacleRole {
    /// Drive and part surfaces.
    Part,
    /// Check surfaces.
    Check,
    /// Fixtures.
    Fixture,
    /// Bodies of the machine's table; the virtual machine takes them from the machine.
    Table,
    /// The stock, if it is a solid of its own.
    Stock,
}

/// Returns an obstacle that is no body of the machine.
pub fn obstacle(role: ObstacleRole, allowance: f64, name: String, mesh: TriMesh) -> ObstacleMesh {
    shared_obstacle(role, allowance, name, Arc::new(TreeMesh::new(mesh)))
}

/// Returns an obstacle of this shape that is no body of the machine.
pub(crate) fn shared_obstacle(role: ObstacleRole, allowance: f64, name: String, shape: Arc<TreeMesh>) -> ObstacleMesh {
    ObstacleMesh { name, role, shape, allowance, labels: Vec::new(), machine_body: None }
}

/// Returns the bodies of the machine's table that are still relative to the workpiece. The tests
/// take bodies that move relative to it from the machine themselves.
pub fn table_bodies(machine: &Machine, table_from_work: &Isometry3<f64>) -> Vec<ObstacleMesh> {
    let table = facemill_cutter_location::table_bodies(machine, table_from_work);
    table
        .map(|body| ObstacleMesh {
            machine_body: Some(body.index),
            ..obstacle(ObstacleRole::Table, body.clearance, body.name.to_owned(), body.mesh)
        })
        .collect()
}

/// Groups of a mesh file of the same meaning.
pub struct Selection {
    /// Role.
    pub role: ObstacleRole,
    /// Allowance on it, mm.
    pub allowance: f64,
    /// File of the groups.
    pub file: FileKey,
    /// One for each group of the file.
    pub groups: Vec<bool>,
}

/// Merges a selection into the one of the same meaning, so that a group named twice is included
/// once: a closed part with one side doubled would not be closed.
pub fn select_also(selections: &mut Vec<Selection>, new: Selection) {
    let same = |s: &&mut Selection| s.role == new.role && s.allowance == new.allowance && s.file == new.file;
    match selections.iter_mut().find(same) {
        Some(known) => known.groups.iter_mut().zip(&new.groups).for_each(|(a, b)| *a |= b),
        None => selections.push(new),
    }
}

/// Returns one obstacle for each role and allowance.
pub(crate) fn joined_obstacles(
    job: &Job,
    selections: &[Selection],
    files: &MeshFiles<'_>,
    work_from_part: &Isometry3<f64>,
) -> Vec<ObstacleMesh> {
    let mut joined: Vec<Vec<&Selection>> = Vec::new();
    for s in selections {
        match joined.iter_mut().find(|of| of[0].role == s.role && of[0].allowance == s.allowance) {
            Some(of) => of.push(s),
            None => joined.push(vec![s]),
        }
    }
    let selected = |s: &Selection| only(&files.read[&s.file].mesh, &s.groups).transformed(work_from_part);
    joined
        .into_iter()
        .map(|of| {
            let (role, allowance) = (of[0].role, of[0].allowance);
            let made_from: Vec<_> = of.iter().map(|s| (&s.file, &s.groups)).collect();
            let mesh = || of.iter().map(|s| selected(s)).reduce(|all, mesh| all.joined(&mesh)).unwrap_or_default();
            let shape = job.meshes.obstacle(&(made_from, work_from_part), mesh);
            let labels = of.iter().flat_map(|s| labels(s, files)).collect();
            let name = match role {
                ObstacleRole::Part => "part",
                ObstacleRole::Check => "check surface",
                ObstacleRole::Fixture | ObstacleRole::Table => "fixture",
                ObstacleRole::Stock => "stock",
            };
            ObstacleMesh { labels, ..shared_obstacle(role, allowance, name.to_owned(), shape) }
        })
        .collect()
}

/// Returns file and group of each selected group.
fn labels(selection: &Selection, files: &MeshFiles<'_>) -> Vec<String> {
    let Selection { file, groups, .. } = selection;
    let of_group = |g: &Group| if g.name.is_empty() { file.name.clone() } else { format!("{}: {}", file.name, g.name) };
    let of_file = files.read[file].mesh.groups().iter().zip(groups);
    of_file.filter(|(_, selected)| **selected).map(|(g, _)| of_group(g)).collect()
}

/// Returns which groups of a mesh a job's entry selects.
pub fn selected_groups(job: &Job, at: &str, entry: &MeshFile, mesh: &TriMesh) -> Result<Vec<bool>, Failure> {
    let Some(patterns) = &entry.groups else { return Ok(vec![true; mesh.groups().len()]) };
    for pattern in patterns {
        if !mesh.groups().iter().any(|g| matches_pattern(pattern, &g.name)) {
            let known: Vec<&str> = mesh.groups().iter().map(|g| g.name.as_str()).collect();
            return Err(job.wrong(format!(
                "{at}.groups: no group of {} matches \"{pattern}\"; its groups are {}",
                entry.file,
                known.join(", ")
            )));
        }
    }
    Ok(mesh.groups().iter().map(|g| patterns.iter().any(|p| matches_pattern(p, &g.name))).collect())
}

/// Returns the mesh with these groups only.
pub fn only(mesh: &TriMesh, groups: &[bool]) -> TriMesh {
    let mut chosen = groups.iter();
    mesh.select_groups(|_| chosen.next().copied().unwrap_or(false))
}

/// Returns whether a name matches a pattern in which `*` matches any run of characters.
pub fn matches_pattern(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, tail)) => name.strip_prefix(head).is_some_and(|rest| {
            (0..=rest.len()).any(|k| rest.is_char_boundary(k) && matches_pattern(tail, &rest[k..]))
        }),
    }
}

#[cfg(test)]
#[path = "../../tests/unit/load/obstacle_meshes.rs"]
mod tests;
