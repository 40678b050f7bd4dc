use facemill_cl_data::{PlacedSolid, RoundBox, RoundFrustum, RoundHull, Solid};
use nalgebra::{Isometry3, Vector3};

use crate::axes::axis::Carrier;
use crate::machine_file::error::MachineError;
use crate::machine_file::line_chain::pose;
use crate::machine_file::{BodyFile, ShapeFile};

/// A body of the machine that must not touch anything on the other side.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineBody {
    /// Name, shape and pose in its link's frame. The shape is dilated by the clearance already.
    pub body: PlacedSolid,
    /// Distance that everything keeps from the body, mm.
    pub clearance: f64,
    /// The link it is fixed to.
    pub link: LinkId,
    /// Joints between its link and the table, in the chain from the table to the tool of its head.
    pub(crate) n_joints: usize,
    /// Pose at the zero pose of the machine.
    pub(crate) table_from_solid_at_zero: Isometry3<f64>,
}

/// A link of the machine: the frame behind a row of one of the two chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkId {
    /// The bed.
    Bed,
    /// Behind row `row` (from 0) of this chain.
    Row {
        /// Head, table or the other head.
        carrier: Carrier,
        /// Row of the chain, from 0.
        row: usize,
    },
}

/// A placed body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose<'a> {
    /// The body.
    pub body: &'a MachineBody,
    /// Pose of the solid's own frame in the table frame; the body's pose in its link is included.
    pub table_from_solid: Isometry3<f64>,
}

impl MachineBody {
    /// Returns the name in findings.
    pub fn name(&self) -> &str {
        &self.body.name
    }

    /// Returns the side of the machine it moves with; `None` for a body of the bed. Bodies of the
    /// other head are not [`Carrier::Head`].
    pub fn carrier(&self) -> Option<Carrier> {
        match self.link {
            LinkId::Bed => None,
            LinkId::Row { carrier, .. } => Some(carrier),
        }
    }

    /// Returns the number of joints between the table and the body's link: 0 where it does not move
    /// against the table.
    ///
    /// For the joints between it and another body, or the tool, see
    /// [`Machine::joints_between`](crate::machine::Machine::joints_between) and
    /// [`Machine::joints_to_tool`](crate::machine::Machine::joints_to_tool): the chains to two
    /// heads part at the bed.
    pub fn joints_from_table(&self) -> usize {
        self.n_joints
    }
}

/// Returns the solid of a body's shape, dilated by its clearance.
///
/// # Errors
/// For a mesh without a given hull.
pub(crate) fn solid_of(body: &BodyFile) -> Result<Solid, MachineError> {
    let rounding = body.clearance_mm;
    let frustum = |radius_low, radius_high, z_high| {
        Solid::Frustum(RoundFrustum { z_low: 0.0, z_high, radius_low, radius_high, rounding })
    };
    Ok(match body.shape {
        ShapeFile::Box { size_mm } => Solid::Box(RoundBox { half_extents: Vector3::from(size_mm) * 0.5, rounding }),
        ShapeFile::Cylinder { radius_mm, height_mm } => frustum(radius_mm, radius_mm, height_mm),
        ShapeFile::Frustum { radius_low_mm, radius_high_mm, height_mm } => {
            frustum(radius_low_mm, radius_high_mm, height_mm)
        }
        ShapeFile::Mesh(ref mesh) => Solid::Hull(RoundHull { core: mesh.read(&body.name)?, rounding }),
    })
}

/// Returns the pose of a body in its link's frame.
pub(crate) fn pose_of(body: &BodyFile) -> Isometry3<f64> {
    pose(body.position_mm, body.rotation_xyz_deg)
}
