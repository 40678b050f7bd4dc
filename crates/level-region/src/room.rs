//! Room of an upright cutter on a level, past what is there.

use facemill_cl_data::Solid;
use facemill_interference::{Interference, MeshTree};
use facemill_surface_model::TriMesh;
use facemill_tool_model::Cutter;
use nalgebra::Point3;

use crate::kept_off::KeptOff;
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
    /// Bodies over the cutter; `None` if there are none of this size: then it fits nowhere.
    column: Option<Vec<Solid>>,
    standing: Vec<Standing<'a>>,
    kept_off: Option<KeptOff>,
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
        Self { plane, cutter: *cutter, height, column, standing, kept_off: None }
    }

    /// Returns the room without places that the cutter keeps off.
    pub fn keeping_off(self, places: KeptOff) -> Self {
        Self { kept_off: Some(places).filter(|places| !places.is_empty()), ..self }
    }

    /// Returns whether the cutter keeps off any place.
    pub(crate) fn keeps_off(&self) -> bool {
        self.kept_off.is_some()
    }

    /// Returns the plane of the level.
    pub fn plane(&self) -> &LevelPlane {
        &self.plane
    }

    /// Returns the radius of the cutter, mm.
    pub(crate) fn radius(&self) -> f64 {
        self.cutter.radius()
    }

    /// Returns the radius of the cutter's flat bottom, mm.
    pub fn rim_radius(&self) -> f64 {
        self.cutter.rim_radius()
    }

    /// Returns whether the cutter touches nothing with its tip at a point of the level, which is no
    /// place that it keeps off; exact.
    pub fn fits(&self, tip: &Point3<f64>) -> bool {
        !self.is_kept_off(tip) && self.is_free(self.column.as_deref(), tip)
    }

    /// Returns whether the cutter keeps off a place of the tip, regardless of bodies.
    pub(crate) fn is_kept_off(&self, tip: &Point3<f64>) -> bool {
        let contains = |places: &KeptOff| {
            let at = self.plane.seen_from(tip);
            places.contains(at.x, at.y)
        };
        self.kept_off.as_ref().is_some_and(contains)
    }

    /// Returns whether a cutter whose radius is less by `narrower` (mm) fits at all points of the
    /// level within a distance (mm) of one; `None` where this does not decide.
    pub(crate) fn fits_around(&self, tip: &Point3<f64>, within: f64, narrower: f64) -> Option<bool> {
        let of_radius = |more: f64| column(&self.cutter, self.cutter.radius() - narrower + more, self.height);
        if self.is_free(of_radius(within).as_deref(), tip) {
            return Some(true);
        }
        // The narrower column lies in all of these; without a flat bottom there is none.
        let is_met = of_radius(-within).is_some_and(|column| !self.is_free(Some(&column), tip));
        is_met.then_some(false)
    }

    fn is_free(&self, column: Option<&[Solid]>, tip: &Point3<f64>) -> bool {
        let pose = self.plane.upright_at(tip);
        column.is_some_and(|column| {
            self.standing.iter().all(|s| s.tree.verdict_of_all(column, s.allowance, &pose, None).is_free())
        })
    }
}

/// Returns the bodies of a cutter with another radius and this height; `None` if there is none with
/// this radius and the corner.
fn column(cutter: &Cutter, radius: f64, height: f64) -> Option<Vec<Solid>> {
    let of_radius = Cutter::new(radius, cutter.corner_radius(), height.max(2.0 * cutter.corner_radius()));
    of_radius.ok().map(|cutter| cutter.test_bodies(0.0))
}
