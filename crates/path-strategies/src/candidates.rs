//! Values that the regions of a job's operations offer to strategies.

use facemill_cl_data::CcPoint;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::PathFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::path::lay_operation;
use facemill_job::validate::setup_chain::is_after_others;

use crate::directions::{DirectedPlanes, Extent, directed_planes};
use crate::flows::{RegionFlows, region_flows};

/// Planes and flows for the region of an operation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates {
    pub(crate) planes: Vec<DirectedPlanes>,
    pub(crate) flows: RegionFlows,
}

/// Returns the candidates of each operation of a job; none where it has a path file or waits for
/// programs before it, and no planes where its normals cancel.
///
/// # Errors
/// If an operation lays no passes.
pub(crate) fn candidates_of_operations(job: &Job) -> Result<Vec<Candidates>, Failure> {
    let mut found = vec![Candidates::default(); job.file.operations.len()];
    for index in 0..job.file.setups.len() {
        let job = job.for_setup(index);
        for (k, operation) in job.operations_of(&job.file.setups[index]) {
            let PathFile::Strategy(strategy) = &operation.path else { continue };
            // Where the programs before leave material is known once they are planned.
            if is_after_others(operation) {
                continue;
            }
            let seen = job.seen_by(operation.head.saturating_sub(1) as usize, 0.0);
            let setup = Setup::read(&seen, index)?;
            let tasks = lay_operation(&seen, &setup, k, operation)?.tasks;
            let points: Vec<CcPoint> = tasks.iter().flat_map(|t| t.pass.points.iter().copied()).collect();
            let extent = Extent::of(&points);
            if let Some(extent) = &extent {
                found[k].planes.extend(directed_planes((&seen, &setup), operation, (extent, &tasks)));
            }
            found[k].flows = region_flows((&seen, &setup), (operation, strategy), extent.as_ref())?;
        }
    }
    Ok(found)
}
