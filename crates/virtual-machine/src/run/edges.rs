//! Parts of tool and bodies that are checked against obstacles, and their positions: all of them
//! closely, or by the paper's rule.

use facemill_cl_data::{RoundFrustum, Solid};

use crate::motion::moves::Move;
use crate::motion::setup::Estimate;
use crate::motion::stepping::Spacing;
use crate::run::between::{CUTTER_BULGE, cutter_step};
use crate::run::cutter_depth::{CutterDepth, disc};
use crate::run::scene::RunScene;
use crate::run::track::Shape;

/// Queries of a run of positions.
pub(crate) struct RunQueries {
    /// Of each body of the scene, without its rounding.
    pub(crate) bodies: Vec<Vec<Shape>>,
    pub(crate) cutter: CutterDepth,
    pub(crate) cutter_in_rapid: CutterDepth,
}

impl RunQueries {
    /// All of every body; in an estimate the edges of all but the cutter in cuts.
    ///
    /// An edge is a disc: the circle at which a section of tool or holder begins or ends, and the
    /// flat face within it. Bodies with corners, boxes and hulls of the machine are tested whole:
    /// that costs no more.
    pub(crate) fn new(scene: &RunScene<'_>) -> Self {
        let cutter = scene.cutter.clone();
        let shapes = scene.bodies.iter().map(|b| &b.shape);
        if scene.settings.estimate.is_none() {
            return Self { bodies: shapes.map(|s| vec![s.clone()]).collect(), cutter_in_rapid: cutter.clone(), cutter };
        }
        let cutter_in_rapid = CutterDepth::at_edges(scene.setup.tool.cutter());
        Self { bodies: shapes.map(edges).collect(), cutter, cutter_in_rapid }
    }
}

/// The edges of a body.
fn edges(shape: &Shape) -> Vec<Shape> {
    let Solid::Frustum(RoundFrustum { z_low, z_high, radius_low, radius_high, .. }) = shape.core else {
        return vec![shape.clone()];
    };
    [(z_low, radius_low), (z_high, radius_high)].map(|(z, radius)| disc(z, radius)).to_vec()
}

/// How far apart the positions of a move are.
pub(crate) fn spacing(scene: &RunScene<'_>, m: &Move) -> Spacing {
    let RunScene { setup, settings, .. } = scene;
    let cutter = setup.tool.cutter();
    let reach = cutter.radius().hypot(cutter.flute_length());
    let Some(estimate) = settings.estimate else {
        let max_step = cutter_step(cutter, settings);
        return Spacing { max_step, max_turn: settings.max_turn, max_bulge: CUTTER_BULGE, reach };
    };
    let max_step = if m.is_rapid { rapid_step(scene) } else { estimate.cut_step };
    Spacing { max_step, max_turn: max_step / setup.tool.gauge_length(), max_bulge: f64::INFINITY, reach }
}

/// Way between two positions of a rapid in an estimate, mm: the radius of the cutter (VMT).
pub(crate) fn rapid_step(scene: &RunScene<'_>) -> f64 {
    scene.setup.tool.cutter().radius()
}

/// Returns the steps between an estimate's positions for the report.
pub(crate) fn estimated_steps(scene: &RunScene<'_>, estimate: Estimate) -> crate::finding::EstimatedPositions {
    crate::finding::EstimatedPositions { cut_step_mm: estimate.cut_step, rapid_step_mm: rapid_step(scene) }
}
