//! A post on a level, of which all is known, and stock around it.

use facemill_cl_data::{CcPoint, RoundFrustum, Solid};
use facemill_interference::{MeshTree, solid_mesh};
use facemill_level_region::{Level, LevelPlane, Standing};
use facemill_surface_model::TriMesh;
use facemill_tool_model::Cutter;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Cutter: R, r and flute, mm.
pub(crate) const CUTTER: [f64; 3] = [8.0, 2.0, 5.0];

/// Material to be left on the post, mm.
pub(crate) const ALLOWANCE: f64 = 0.5;

/// Radius of the stock, mm.
pub(crate) const STOCK: f64 = 30.0;

/// Distance by which the sides of a prism may lie inside its circle, mm.
pub(crate) const PRISM: f64 = 0.06;

/// A post through a level, and a round stock.
pub(crate) struct Post {
    pub(crate) plane: LevelPlane,
    /// Radius of the post at the level, mm.
    pub(crate) radius: f64,
    pub(crate) post: (TriMesh, MeshTree),
    pub(crate) stock: (TriMesh, MeshTree),
}

impl Post {
    /// A round post along an axis, with a level across it.
    pub(crate) fn along(axis: Unit<Vector3<f64>>, radius: f64) -> Self {
        let plane = LevelPlane::new(axis, 10.0);
        let turn = UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &axis).expect("not turned over");
        let place = Isometry3::from_parts(Translation3::identity(), turn);
        let body = |radius: f64| {
            let body =
                RoundFrustum { z_low: 0.0, z_high: 20.0, radius_low: radius, radius_high: radius, rounding: 0.0 };
            let mesh = solid_mesh(&Solid::Frustum(body)).expect("a mesh").transformed(&place);
            let tree = MeshTree::new(&mesh);
            (mesh, tree)
        };
        Self { plane, radius, post: body(radius), stock: body(STOCK) }
    }

    pub(crate) fn standing(&self) -> Vec<Standing<'_>> {
        vec![Standing { mesh: &self.post.0, tree: &self.post.1, allowance: ALLOWANCE }]
    }

    pub(crate) fn stock(&self) -> Vec<Standing<'_>> {
        vec![Standing { mesh: &self.stock.0, tree: &self.stock.1, allowance: 0.0 }]
    }

    pub(crate) fn level(&self) -> Level {
        Level::new(self.plane, &cutter(), self.standing(), &self.stock.0)
    }

    /// Distance of a tip from the post's axis at which the cutter is free, mm.
    pub(crate) fn free_from(&self) -> f64 {
        CUTTER[0] + self.radius + ALLOWANCE
    }

    /// Distance of a point from the post's axis, mm.
    pub(crate) fn off_axis(&self, p: &Point3<f64>) -> f64 {
        let at = self.plane.seen_from(p);
        at.x.hypot(at.y)
    }

    /// CC points of a straight pass at y = `across` of the level's frame, along x from −40 to 40
    /// mm.
    pub(crate) fn pass(&self, across: f64) -> Vec<CcPoint> {
        let feed = self.plane.at(1.0, 0.0) - self.plane.at(0.0, 0.0);
        let at = |k: i32| {
            let position = self.plane.at(f64::from(k) * 5.0, across);
            CcPoint::new(position, self.plane.axis().into_inner(), feed).expect("a point")
        };
        (-8..=8).map(at).collect()
    }
}

pub(crate) fn cutter() -> Cutter {
    Cutter::new(CUTTER[0], CUTTER[1], CUTTER[2]).expect("a cutter")
}

/// Axes of levels: upright and tilted.
pub(crate) fn axes() -> [Unit<Vector3<f64>>; 2] {
    [Vector3::z_axis(), Unit::new_normalize(Vector3::new(0.3, -0.5, 0.8))]
}
