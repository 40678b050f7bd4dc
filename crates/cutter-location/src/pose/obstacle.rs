//! Obstacles of tool and cutter: meshes in the workpiece frame, and bodies of the machine's table.

use std::ops::Deref;
use std::sync::Arc;

use facemill_interference::{Interference, MeshTree, solid_mesh};
use facemill_inverse_kinematics::{Carrier, Machine};
use facemill_surface_model::TriMesh;
use nalgebra::{Isometry3, Point3};

/// Something that must not be cut or hit, as a mesh in the workpiece frame.
#[derive(Clone)]
pub struct Obstacle<'a> {
    /// Name in findings.
    pub name: String,
    /// The mesh.
    pub mesh: MeshHandle<'a>,
    /// Distance that the cutter's test body keeps from the mesh, mm; `None` where the cutter may
    /// enter (stock).
    pub gouge_allowance: Option<f64>,
    /// Distance that every dilated non-cutting body keeps from the mesh, mm: the thickness of the
    /// stock on it.
    pub collision_allowance: f64,
    /// Index among the machine's bodies, where it is one that does not move against the workpiece.
    pub machine_body: Option<usize>,
    /// Names of its pieces, for messages, where it has several.
    pub pieces: Option<&'a dyn Pieces>,
}

impl<'a> Obstacle<'a> {
    /// Returns a part in its finished shape: the cutter may touch its mesh, and go no deeper than
    /// the gouge tolerance; other bodies keep their own clearance. Set the allowances for material
    /// to leave on it, or for stock around it.
    pub fn part(name: impl Into<String>, mesh: impl Into<MeshHandle<'a>>) -> Self {
        Self {
            name: name.into(),
            mesh: mesh.into(),
            gouge_allowance: Some(0.0),
            collision_allowance: 0.0,
            machine_body: None,
            pieces: None,
        }
    }

    /// Returns whether it is stock, or has stock on it.
    pub(crate) fn has_stock(&self) -> bool {
        self.gouge_allowance.is_none_or(|kept| self.collision_allowance > kept)
    }
}

/// Mesh of an obstacle, workpiece frame: borrowed or shared.
#[derive(Clone)]
#[non_exhaustive]
pub enum MeshHandle<'a> {
    /// A mesh of the caller.
    Borrowed(&'a dyn Interference),
    /// Shared, for meshes that a workcell makes itself.
    Shared(Arc<MeshTree>),
}

impl<'a> Deref for MeshHandle<'a> {
    type Target = dyn Interference + 'a;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Borrowed(mesh) => *mesh,
            Self::Shared(mesh) => &**mesh,
        }
    }
}

impl<'a, T: Interference> From<&'a T> for MeshHandle<'a> {
    fn from(mesh: &'a T) -> Self {
        Self::Borrowed(mesh)
    }
}

impl<'a> From<&'a dyn Interference> for MeshHandle<'a> {
    fn from(mesh: &'a dyn Interference) -> Self {
        Self::Borrowed(mesh)
    }
}

impl From<Arc<MeshTree>> for MeshHandle<'_> {
    fn from(mesh: Arc<MeshTree>) -> Self {
        Self::Shared(mesh)
    }
}

/// Named pieces of an obstacle.
pub trait Pieces: Sync {
    /// Returns the name of the piece at a place, workpiece frame.
    fn name_at(&self, place: &Point3<f64>) -> String;
}

/// Body of the machine's table that does not move against the workpiece.
pub struct TableBody<'a> {
    /// Index among the machine's bodies.
    pub index: usize,
    /// Its name in the machine file.
    pub name: &'a str,
    /// Its core, workpiece frame.
    pub mesh: TriMesh,
    /// Distance that others keep from it, mm.
    pub clearance: f64,
}

/// Returns the bodies of the machine's table that do not move against the workpiece, in the order
/// of the machine file.
pub fn table_bodies<'a>(
    machine: &'a Machine,
    table_from_work: &Isometry3<f64>,
) -> impl Iterator<Item = TableBody<'a>> + use<'a> {
    let work_from_table = table_from_work.inverse();
    let home = machine.home();
    let still: Vec<_> = machine
        .body_poses(&home)
        .enumerate()
        .filter(|(_, at)| at.body.carrier() != Some(Carrier::Head) && at.body.joints_from_table() == 0)
        .map(|(index, at)| (index, at.table_from_solid))
        .collect();
    still.into_iter().map(move |(index, table_from_solid)| {
        let body = &machine.bodies()[index];
        let mesh = solid_mesh(&body.body.solid).unwrap_or_default();
        let mesh = mesh.transformed(&(work_from_table * table_from_solid));
        TableBody { index, name: body.name(), mesh, clearance: body.clearance }
    })
}
