//! Failures and names in the results of the virtual machine, as reports have them.

use facemill_cutter_location::Pieces;
use facemill_job::failure::Failure;
use facemill_job::load::job::Setup;
use facemill_virtual_machine::{Finding, Verification, VerifyError};

/// Returns the failure of a program that was not run.
pub fn not_verified(e: VerifyError) -> Failure {
    match e {
        VerifyError::Cancelled(_) => Failure::Interrupted,
        other => Failure::Internal(other.to_string()),
    }
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
