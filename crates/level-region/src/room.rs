//! Room of an upright cutter on a level, past what is there.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, MeshTree};
use facemill_surface_model::TriMesh;
use facemill_tool_model::Cutter;
use nalgebra::Point3;

use crate::plane::LevelPlane;

/// Body that the cutter must not touch, workpiece frame.
#[derive(Clone, Copy)]
pub struct Standing<'a> {
    /// Its mesh.
    pub mesh: &'a TriMesh,
    /// Hierarchy of the mesh.
    pub tree: &'a MeshTree,
    /// Distance that the cutter keeps from it, mm.
    pub allowance: f64,
}

/// Room of an upright cutter that comes to a level from above: all of the column over the cutter is
/// tested, so there is no room under an overhang, nor inside of a part that is open below.
pub struct LevelRoom<'a> {
    plane: LevelPlane,
    cutter: Cutter,
    /// Height of the column, mm: above everything there.
    height: f64,
    column: Vec<Solid>,
    standing: Vec<Standing<'a>>,
}

impl<'a> LevelRoom<'a> {
    /// Returns the room of a cutter on a level past these bodies.
    pub fn new(plane: LevelPlane, cutter: &Cutter, standing: Vec<Standing<'a>>) -> Self {
        let above = |s: &Standing<'_>| {
            let top = s.mesh.vertices().iter().map(|v| plane.seen_from(v).z).fold(0.0, f64::max);
            top + s.allowance
        };
        let height = standing.iter().map(above).fold(0.0, f64::max) + 2.0 * cutter.radius();
        let column = column(cutter, cutter.radius(), height);
        Self { plane, cutter: *cutter, height, column, standing }
    }

    /// Returns the plane of the level.
    pub fn plane(&self) -> &LevelPlane {
        &self.plane
    }

    /// Returns the radius of the cutter's flat bottom, mm.
    pub fn rim_radius(&self) -> f64 {
        self.cutter.rim_radius()
    }

    /// Returns whether the cutter touches nothing with its tip at a point of the level; exact.
    pub fn fits(&self, tip: &Point3<f64>) -> bool {
        self.is_free(&self.column, tip)
    }

    /// Returns whether the cutter fits at all points of the level within a distance (mm) of one;
    /// `None` where this does not decide.
    pub(crate) fn fits_around(&self, tip: &Point3<f64>, within: f64) -> Option<bool> {
        let radius = self.cutter.radius();
        if self.is_free(&column(&self.cutter, radius + within, self.height), tip) {
            return Some(true);
        }
        // The narrower column lies in all of these.
        let is_narrower = within < self.cutter.rim_radius();
        (is_narrower && !self.is_free(&column(&self.cutter, radius - within, self.height), tip)).then_some(false)
    }

    fn is_free(&self, column: &[Solid], tip: &Point3<f64>) -> bool {
        let pose = self.plane.upright_at(tip);
        self.standing.iter().all(|s| s.tree.verdict_of_all(column, s.allowance, &pose, None).is_free())
    }
}

/// Returns the bodies of a cutter with another radius and this height.
fn column(cutter: &Cutter, radius: f64, height: f64) -> Vec<Solid> {
    let of_radius = Cutter::new(radius, cutter.corner_radius(), height.max(2.0 * cutter.corner_radius()));
    of_radius.unwrap_or(*cutter).test_bodies(0.0)
}
