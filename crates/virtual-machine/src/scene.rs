use facemill_cl_data::Solid;
use facemill_inverse_kinematics::Carrier;
use nalgebra::Isometry3;

use crate::{
    FindingKind, ObstacleKind, VerifySettings, VirtualObstacle, VirtualSetup, cutter_depth::CutterDepth, track::Shape,
};

/// The setup with what does not change from position to position worked out.
pub(crate) struct Scene<'a> {
    pub(crate) setup: &'a VirtualSetup<'a>,
    pub(crate) settings: &'a VerifySettings,
    pub(crate) work_from_table: Isometry3<f64>,
    pub(crate) tool_length: f64,
    pub(crate) cutter: CutterDepth,
    /// Non-cutting bodies: of the tool assembly, then of the machine's head.
    pub(crate) bodies: Vec<SceneBody>,
}

/// A non-cutting body.
pub(crate) struct SceneBody {
    pub(crate) name: String,
    pub(crate) kind: FindingKind,
    pub(crate) shape: Shape,
    /// Rounding of the body as it is, without clearance, mm.
    pub(crate) rounding: f64,
    /// Distance it is to keep, mm.
    pub(crate) clearance: f64,
    pub(crate) mount: Mount,
}

/// What a body moves with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mount {
    /// The tool, at this pose in its frame.
    Tool(Isometry3<f64>),
    /// The machine: index among its bodies.
    Machine(usize),
}

impl<'a> Scene<'a> {
    pub(crate) fn new(setup: &'a VirtualSetup<'a>, settings: &'a VerifySettings) -> Self {
        let tool = setup.tool.collision_bodies().into_iter().map(|b| {
            // Sections of a tool are sharp frusta: all their rounding is clearance.
            let clearance = b.solid.rounding();
            let mount = Mount::Tool(b.frame_from_solid);
            SceneBody::new(b.name, FindingKind::HolderCollision, &b.solid, clearance, mount)
        });
        let head = setup.machine.bodies().iter().enumerate();
        let head = head.filter(|(_, b)| b.carrier() == Some(Carrier::Head)).map(|(k, b)| {
            let name = b.name().to_owned();
            SceneBody::new(name, FindingKind::Collision, &b.body.solid, b.clearance, Mount::Machine(k))
        });
        Self {
            setup,
            settings,
            work_from_table: setup.table_from_work.inverse(),
            tool_length: setup.tool.gauge_length(),
            cutter: CutterDepth::new(setup.tool.cutter()),
            bodies: tool.chain(head).collect(),
        }
    }

    /// Thickness of what the cutter may not enter, mm, and the finding when it does; `None` where it may.
    pub(crate) fn cutter_limit(&self, obstacle: &VirtualObstacle<'_>, is_rapid: bool) -> Option<(f64, FindingKind)> {
        match (is_rapid, obstacle.kind) {
            (true, _) => Some((obstacle.stock.max(obstacle.allowance), FindingKind::RapidCollision)),
            (false, ObstacleKind::Stock) => None,
            (false, _) => Some((obstacle.allowance, FindingKind::Gouge)),
        }
    }
}

impl SceneBody {
    fn new(name: String, kind: FindingKind, solid: &Solid, clearance: f64, mount: Mount) -> Self {
        let rounding = (solid.rounding() - clearance).max(0.0);
        Self { name, kind, shape: Shape::core_of(solid), rounding, clearance, mount }
    }
}
