//! Flows between two borders of a region, and spirals over their levels.

use std::collections::BTreeSet;

use facemill_cc_path::files::{
    CylindricalSectionsFile, FlowCylinderFile, FlowEndFile, FlowFile, FlowPlaneFile, SectionsFile, SpiralFile,
    StrategyFile,
};
use facemill_cc_path::{PossibleFlow, possible_flows};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PathFromStrategy};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::pass_surface::{extended_region, pass_surface};
use nalgebra::Vector3;

use crate::directions::Extent;

/// Flows that can be laid on the region of an operation.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RegionFlows {
    /// Flow whose passes run along the longest extent.
    pub(crate) along: Option<FlowFile>,
    /// Flow whose passes run across it.
    pub(crate) across: Option<FlowFile>,
    /// Flow over whose closed levels a spiral rises.
    pub(crate) closed: Option<FlowFile>,
}

/// Returns the flows of a region between two mesh groups beside it, or the ends of its levels:
/// those with the longest ends of each kind.
///
/// Without an extent, a flow counts as along it. A region between two ranges of levels has none,
/// because a job cannot state it.
///
/// # Errors
/// If the region is wrong.
pub(crate) fn region_flows(
    (job, setup): (&Job, &Setup<'_>),
    (operation, strategy): (&OperationFile, &PathFromStrategy),
    extent: Option<&Extent>,
) -> Result<RegionFlows, Failure> {
    let wrong = |e: String| job.wrong(format!("operation \"{}\": {e}", operation.name));
    let mut file = strategy.region.clone();
    let range = range_of(&strategy.strategy);
    if file.between.is_some() && range.is_some() {
        return Ok(RegionFlows::default());
    }
    file.between = file.between.or(range);
    let mut ends: Vec<FlowEndFile> = file.between.iter().flat_map(ends_of_levels).collect();
    let mut region = file.to_region().map_err(|e| wrong(e.to_string()))?;
    let groups = region.groups.take().unwrap_or_else(|| setup.drive_groups.clone());
    region.groups = Some(groups.clone());
    let extended = extended_region(job, setup, operation)?;
    let (surface, region) = pass_surface(setup, extended.as_deref(), region);
    // Groups of the mesh, without that of an extended region beyond its border, which a job cannot
    // name.
    let all: BTreeSet<&String> = setup.around_drive.mesh().groups().iter().map(|group| &group.name).collect();
    ends.extend(all.into_iter().filter(|name| !groups.contains(name)).map(|name| FlowEndFile::Group(name.clone())));
    // Flows are candidates: a region that is too large for one has none.
    let Ok(found) = possible_flows(surface, &region, &ends) else { return Ok(RegionFlows::default()) };
    Ok(RegionFlows::of(&found, extent.map(|extent| extent.longest)))
}

impl RegionFlows {
    fn of(found: &[PossibleFlow], longest: Option<Vector3<f64>>) -> Self {
        let is_along = |f: &PossibleFlow| {
            longest.is_none_or(|longest| f.way.dot(&longest).abs() <= f.way.norm() * std::f64::consts::FRAC_1_SQRT_2)
        };
        let first = |keep: &dyn Fn(&PossibleFlow) -> bool| found.iter().find(|f| keep(f)).map(|f| f.flow.clone());
        Self { along: first(&is_along), across: first(&|f| !is_along(f)), closed: first(&|f| f.is_closed) }
    }
}

/// Returns the sections between whose first and last level the passes of a strategy lie; `None`
/// where the region alone bounds them.
pub(crate) fn range_of(strategy: &StrategyFile) -> Option<SectionsFile> {
    match strategy {
        StrategyFile::ParallelPlanes(planes) if planes.from_mm.is_some() || planes.to_mm.is_some() => {
            Some(SectionsFile::ParallelPlanes(planes.clone()))
        }
        StrategyFile::CylindricalSections(cylinders) => Some(SectionsFile::CylindricalSections(cylinders.clone())),
        StrategyFile::ConstantScallop(scallop) => scallop.within.clone(),
        _ => None,
    }
}

/// Returns the ends of a range of levels, where it has them.
fn ends_of_levels(sections: &SectionsFile) -> Vec<FlowEndFile> {
    match sections {
        SectionsFile::ParallelPlanes(planes) => {
            let normal = Vector3::from(planes.normal).normalize();
            let at = |level: f64| {
                let origin_mm = (Vector3::from(planes.origin_mm) + normal * level).into();
                FlowEndFile::Plane(FlowPlaneFile { origin_mm, normal: planes.normal })
            };
            [planes.from_mm, planes.to_mm].into_iter().flatten().map(at).collect()
        }
        SectionsFile::CylindricalSections(CylindricalSectionsFile {
            axis_origin_mm,
            axis_direction,
            from_radius_mm,
            to_radius_mm,
        }) => {
            let at = |radius_mm: f64| {
                let (axis_origin_mm, axis_direction) = (*axis_origin_mm, *axis_direction);
                FlowEndFile::Cylinder(FlowCylinderFile { axis_origin_mm, axis_direction, radius_mm })
            };
            [*from_radius_mm, *to_radius_mm].map(at).to_vec()
        }
        // Sections of other kinds have no end that a flow could name.
        _ => Vec::new(),
    }
}

/// Returns a spiral over the levels of a flow.
pub(crate) fn spiral_over(flow: FlowFile) -> StrategyFile {
    StrategyFile::Spiral(SpiralFile::Flow(flow))
}

#[cfg(test)]
#[path = "../tests/unit/flows.rs"]
mod tests;
