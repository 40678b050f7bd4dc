//! Scene of the tests inside the crate.

use facemill_inverse_kinematics::{BranchPreference, Machine};
use facemill_tool_model::{FormatTag, Section, SpindleRotation, Stack, ToolAssembly, ToolFile};
use nalgebra::Isometry3;

use crate::pose::workcell::Workcell;

/// Uniform numbers, always the same.
pub(crate) use facemill_test_kit::Random;

/// A mill with a thinner body and a holder; lengths in mm.
pub(crate) fn tool() -> ToolAssembly {
    let section =
        |length_mm, diameter_mm| Section { length_mm, diameter_low_mm: diameter_mm, diameter_high_mm: diameter_mm };
    ToolAssembly::new(ToolFile {
        format: FormatTag::V1,
        name: "mill".to_owned(),
        number: 1,
        length_register: None,
        radius_mm: 30.0,
        corner_radius_mm: 4.0,
        n_inserts: 4,
        flute_length_mm: 30.0,
        dead_core_radius_mm: 0.0,
        max_ramp_angle_deg: 3.0,
        spindle_rotation: SpindleRotation::Clockwise,
        cutting_edge_angle_deg: None,
        stick_out_mm: 70.0,
        gauge_length_mm: 170.0,
        body: Stack { clearance_mm: 1.0, sections: vec![section(40.0, 40.0)] },
        holder: Stack { clearance_mm: 2.0, sections: vec![section(100.0, 60.0)] },
        assumed: Vec::new(),
    })
    .unwrap()
}

/// A workcell with nothing in the way.
pub(crate) fn bare_cell<'a>(
    machine: &'a Machine,
    tool: &'a ToolAssembly,
    table_from_work: Isometry3<f64>,
) -> Workcell<'a> {
    Workcell {
        machine,
        table_from_work,
        tool,
        obstacles: Vec::new(),
        preferred_branch: BranchPreference::Positive,
        axis_cone: None,
        gouge_tolerance: 0.02,
        max_lift: 0.06,
        lift_resolution: 1e-3,
        z_map: None,
    }
}
