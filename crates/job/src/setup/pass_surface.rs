//! Surface that the passes of an operation lie on.

use std::sync::{Arc, PoisonError};

use facemill_cc_path::RequestedRegion;
use facemill_cc_path::strategies::Region;
use facemill_surface_model::{Surface, SurfaceSettings};

use crate::failure::Failure;
use crate::format::job_file::OperationFile;
use crate::load::job::{ExtendedRegion, Job, Setup};

/// Name of the group of triangles beyond the border of a region.
const BEYOND: &str = "beyond the border";

/// Returns the region of an operation with the surface beyond its border, of a level the plane
/// around the stock; `None` if the job does not extend it. A region is extended once for each setup
/// that is read.
///
/// # Errors
/// If the region holds no facet, or names an unknown group.
pub fn extended_region(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
) -> Result<Option<Arc<ExtendedRegion>>, Failure> {
    if let Some(level) = &setup.level {
        return Ok(Some(level.passes.clone()));
    }
    let width = operation.region().extend_mm;
    if width <= 0.0 {
        return Ok(None);
    }
    let wrong = |e: String| job.wrong(format!("operation \"{}\": region.extend_mm: {e}", operation.name));
    let region = operation.region().to_region().map_err(|e| wrong(e.to_string()))?;
    let groups = region.groups.or_else(|| Some(setup.drive_groups.clone()));
    let region = Region { groups, normal_cone: region.normal_cone, ..Region::default() };
    let mut known = setup.extended_regions.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = known.iter().find(|found| found.width == width && found.region == region) {
        return Ok(Some(found.clone()));
    }
    let requested = RequestedRegion::new(&setup.around_drive, &region, None).map_err(|e| wrong(e.to_string()))?;
    let mesh = setup.around_drive.extended(|t| requested.holds_facet(t), width, BEYOND);
    let surface = Surface::new(mesh.map_err(|e| wrong(e.to_string()))?, SurfaceSettings::default());
    let found = Arc::new(ExtendedRegion { region, width, surface });
    known.push(found.clone());
    Ok(Some(found))
}

/// Returns the surface that the passes of an operation lie on.
pub fn surface_of<'s>(setup: &'s Setup<'_>, extended: Option<&'s ExtendedRegion>) -> &'s Surface {
    extended.map_or(&*setup.around_drive, |extended| &extended.surface)
}

/// Returns the surface that passes lie on, and their region there: groups and cone have chosen the
/// triangles of an extended one.
pub fn pass_surface<'s>(
    setup: &'s Setup<'_>,
    extended: Option<&'s ExtendedRegion>,
    region: Region,
) -> (&'s Surface, Region) {
    match extended {
        None => (&*setup.around_drive, region),
        Some(extended) => (&extended.surface, Region { groups: None, normal_cone: None, ..region }),
    }
}
