//! Clearance surface of a setup, from its file.

use facemill_cutter_location::links::link::ClearanceSurface;
use nalgebra::Point3;

use crate::format::job_file::ClearanceFile;
use crate::frames::direction;

/// Returns the clearance surface that a job names.
pub fn clearance_surface(file: &ClearanceFile) -> ClearanceSurface {
    match file {
        ClearanceFile::Plane(p) => {
            ClearanceSurface::Plane { origin: Point3::from(p.origin_mm), normal: direction(&p.normal) }
        }
        ClearanceFile::Cylinder(c) => ClearanceSurface::Cylinder {
            origin: Point3::from(c.origin_mm),
            axis: direction(&c.axis),
            radius: c.radius_mm,
        },
        ClearanceFile::Sphere(s) => ClearanceSurface::Sphere { center: Point3::from(s.center_mm), radius: s.radius_mm },
    }
}
