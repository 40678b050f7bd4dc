//! Machine of a setup with everything on it, for the virtual machine.

use facemill_cutter_location::Pieces;
use facemill_job::failure::Failure;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::obstacle_meshes::ObstacleRole;
use facemill_nc_program::{Dialect, WordMap};
use facemill_virtual_machine::{Finding, ObstacleKind, Verification, VerifyError, VirtualObstacle, VirtualSetup};
use nalgebra::Isometry3;

/// Returns the failure of a program that was not run.
pub fn not_verified(e: VerifyError) -> Failure {
    match e {
        VerifyError::Cancelled(_) => Failure::Interrupted,
        other => Failure::Internal(other.to_string()),
    }
}

/// Returns the bodies on the table, for the virtual machine.
pub fn virtual_obstacles<'a>(setup: &'a Setup<'_>) -> Vec<VirtualObstacle<'a>> {
    setup
        .obstacles
        .iter()
        .filter(|o| o.role != ObstacleRole::Table)
        .map(|o| VirtualObstacle {
            name: o.name.clone(),
            mesh: &o.tree,
            kind: match o.role {
                ObstacleRole::Part => ObstacleKind::Part,
                ObstacleRole::Check => ObstacleKind::Check,
                ObstacleRole::Fixture | ObstacleRole::Table => ObstacleKind::Fixture,
                ObstacleRole::Stock => ObstacleKind::Stock,
            },
            allowance: o.allowance,
            stock: match o.role {
                ObstacleRole::Part | ObstacleRole::Check => setup.stock_thickness.max(o.allowance),
                // All bodies keep the allowance from a fixture.
                ObstacleRole::Fixture | ObstacleRole::Table | ObstacleRole::Stock => o.allowance,
            },
        })
        .collect()
}

/// Adds the file or group at a place to the name of an obstacle that has several.
pub fn name_obstacle(name: &mut String, place: [f64; 3], setup: &Setup<'_>) {
    if let Some(o) = setup.obstacles.iter().find(|o| o.name == *name) {
        *name = o.name_at(&place.into());
    }
}

/// Does the same for every finding.
pub fn name_obstacles_of(findings: &mut [Finding], setup: &Setup<'_>) {
    for finding in findings {
        if let (Some(obstacle), Some(place)) = (&mut finding.obstacle, finding.place_work_mm) {
            name_obstacle(obstacle, place, setup);
        }
    }
}

/// Does the same for every name in the result of a run.
pub fn name_obstacles(verification: &mut Verification, setup: &Setup<'_>) {
    let name = |name: &mut String, place: [f64; 3]| name_obstacle(name, place, setup);
    name_obstacles_of(&mut verification.findings, setup);
    let in_sections = verification.sections.iter_mut().filter_map(|s| s.largest_gouge.as_mut());
    for g in verification.largest_gouge.iter_mut().chain(in_sections) {
        name(&mut g.obstacle, g.place_work_mm);
    }
    if let Some(c) = &mut verification.smallest_clearance {
        name(&mut c.obstacle, c.place_work_mm);
    }
}

/// Returns the machine of a setup with its tool and everything on it, for a program of this
/// dialect.
pub fn virtual_setup<'a>(
    dialect: Dialect,
    job: &'a Job,
    setup: &'a Setup<'_>,
    words: &'a WordMap,
    frame: Isometry3<f64>,
) -> VirtualSetup<'a> {
    VirtualSetup {
        machine: &job.machine,
        table_from_work: setup.table_from_work,
        words,
        table_from_rtcp_words: frame,
        tool: &job.tool,
        length_register: register_in(dialect, job),
        obstacles: virtual_obstacles(setup),
    }
}

/// Returns the register of the tool's length in a control's reader: edge 1 of Siemens, and the
/// number of the tool on Heidenhain, whose tools include their length.
pub fn register_in(dialect: Dialect, job: &Job) -> u32 {
    match dialect {
        Dialect::Siemens840d => 1,
        Dialect::Heidenhain => job.tool.number(),
        _ => job.tool.length_register(),
    }
}
