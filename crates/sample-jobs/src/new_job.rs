//! Sample jobs by their descriptions.

use std::path::PathBuf;

use facemill_sample_parts::{PatchSpec, PropellerSeries, PropellerSpec, RotorResolution, patch, rotor37};
use facemill_surface_model::{NamedNode, TriMesh, write_obj};
use nalgebra::{Isometry3, Point3};
use serde_json::json;

use crate::job_parts::{
    JobFiles, ROTOR_SCALES, ReadFile, cutter_radius, job_file, job_folder, operation, round_to, stock_for,
};
use crate::new_blade::{blade_job, blade_text, groups_obj};
use crate::new_cast::cast_propeller_job;
use crate::new_dual::dual_propeller_job;
use crate::new_propeller::{propeller_job, table_job, table_text};
use crate::new_whole::whole_propeller_job;

/// A sample job.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum NewJob {
    /// A propeller on the B-head, C-table mill, suction side up.
    Propeller {
        /// Its series.
        series: Series,
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// A propeller of the user's own, suction side up.
    OwnPropeller {
        /// Its table.
        table: PathBuf,
        /// Its diameter, mm, if not that of the table; needed by a table without one.
        diameter_mm: Option<f64>,
    },
    /// DTMB 4119 on the mill with two heads, both sides at once.
    DualPropeller {
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// DTMB 4119 from its casting, each side of its blades in a setup of its own.
    CastPropeller {
        /// Its diameter, mm.
        diameter_mm: f64,
    },
    /// DTMB 4119 from its casting with three tools, hub, fillets and edges included.
    WholePropeller {
        /// Its diameter, mm.
        diameter_mm: f64,
        /// Number of blades that are machined, from the first on; all if `None`.
        blades: Option<usize>,
    },
    /// A wavy patch.
    Patch {
        /// Length of its sides, mm.
        size_mm: f64,
    },
    /// The blade of NASA Rotor 37, one side up.
    Rotor37 {
        /// Factor on the real size.
        scale: f64,
    },
    /// A blade from a BladeGen description, one side after the other up.
    Blade {
        /// Its `.inf` file.
        from: PathBuf,
        /// Factor on the size in the file.
        scale: f64,
        /// Whether the mesh has the sector of the hub around the blade.
        hub: bool,
    },
}

/// A propeller series.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Series {
    /// DTMB 4119.
    Dtmb4119,
    /// DTMB 4382.
    Dtmb4382,
    /// SVA Potsdam VP1304.
    Vp1304,
    /// Wageningen B.
    WageningenB {
        /// Number of blades.
        blades: u32,
        /// Expanded area ratio.
        area_ratio: f64,
        /// Pitch ratio.
        pitch_ratio: f64,
    },
}

/// Returns the files of an sample job, names relative to its folder. The same job always gives the
/// same bytes.
///
/// # Errors
/// If numbers or files describe no part, or `read` returns an error.
pub fn new_job(job: &NewJob, read: ReadFile<'_>) -> Result<Vec<(String, Vec<u8>)>, String> {
    match *job {
        NewJob::Propeller { series, diameter_mm } => series_job(series, diameter_mm),
        NewJob::OwnPropeller { ref table, diameter_mm } => table_job(table, diameter_mm, read),
        NewJob::DualPropeller { diameter_mm } => dual_propeller_job(diameter_mm),
        NewJob::CastPropeller { diameter_mm } => cast_propeller_job(diameter_mm),
        NewJob::WholePropeller { diameter_mm, blades } => whole_propeller_job(diameter_mm, blades),
        NewJob::Patch { size_mm } => patch_job(size_mm),
        NewJob::Rotor37 { scale } => rotor37_job(scale),
        NewJob::Blade { ref from, scale, hub } => blade_job(from, scale, hub, read),
    }
}

/// Returns how the files of others are understood, in words: of the table of a propeller blades,
/// hand, skew and rake; of a blade description the number of blades, where each ends at hub and
/// shroud, and with a hub the share of each side that has passes. `None` for other jobs.
///
/// # Errors
/// As [`new_job`].
pub fn as_read(job: &NewJob, read: ReadFile<'_>) -> Result<Option<String>, String> {
    match job {
        NewJob::OwnPropeller { table, diameter_mm } => table_text(table, *diameter_mm, read).map(Some),
        NewJob::Blade { from, scale, hub } => blade_text(from, *scale, *hub, read).map(Some),
        _ => Ok(None),
    }
}

fn series_job(series: Series, diameter: f64) -> Result<JobFiles, String> {
    let (series, name) = match series {
        Series::Dtmb4119 => (PropellerSeries::Dtmb4119, "DTMB 4119".to_owned()),
        Series::Dtmb4382 => (PropellerSeries::Dtmb4382, "DTMB 4382".to_owned()),
        Series::Vp1304 => (PropellerSeries::Vp1304, "VP1304".to_owned()),
        Series::WageningenB { blades, area_ratio, pitch_ratio } => (
            PropellerSeries::WageningenB { n_blades: blades as usize, area_ratio, pitch_ratio },
            format!("Wageningen B{blades}-{:.0}", 100.0 * area_ratio),
        ),
    };
    // Blades of high area ratio overlap: a thin tool that reaches far comes between most of them,
    // and regions out of its reach in one setup are left out.
    let overlapping = match series {
        PropellerSeries::Dtmb4119 => false,
        PropellerSeries::WageningenB { n_blades, area_ratio, .. } => n_blades > 4 || area_ratio > 0.6,
        // The thin tool is free for every series.
        _ => true,
    };
    propeller_job(&PropellerSpec::new(series, diameter).map_err(|e| e.to_string())?, &name, overlapping)
}

fn patch_job(size: f64) -> Result<JobFiles, String> {
    let spec = PatchSpec::new([size, size], 0.02 * size, [1.2, 1.0]).map_err(|e| e.to_string())?;
    let mesh = patch(&spec, 120, 120).map_err(|e| e.to_string())?;
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    let obj = write_obj(&[&mesh], &nodes).map_err(|e| e.to_string())?;
    let radius = cutter_radius(0.05 * size);
    let setup = json!({
        "name": "top",
        "table_from_work": { "translation_mm": [0.0, 0.0, 300.0] },
        "meshes": [{ "file": "patch.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" }],
        "stock": { "offset": { "allowance_mm": stock_for(radius) } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, round_to(0.05 * size + 10.0, 0)] } },
    });
    let strategy = json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } });
    let operation = operation("patch", radius, &strategy, size / 1600.0);
    Ok(job_folder(
        ("patch.obj", obj),
        &job_file(&format!("wavy patch of {size} mm"), setup, operation),
        (radius, 4.0 * radius),
    ))
}

fn rotor37_job(scale: f64) -> Result<JobFiles, String> {
    if !ROTOR_SCALES.contains(&scale) {
        return Err(format!("scale must be from {} to {}, is {scale}", ROTOR_SCALES.start(), ROTOR_SCALES.end()));
    }
    let blade = rotor37(RotorResolution::default());
    let vertices: Vec<Point3<f64>> = blade.vertices().iter().map(|p| p * scale).collect();
    let mesh = TriMesh::with_groups(vertices, blade.triangles().to_vec(), blade.groups().to_vec())
        .map_err(|e| e.to_string())?;
    let (names, obj) = groups_obj(&mesh)?;
    let radius = cutter_radius(2.0 * scale);
    let suction = names.iter().find(|n| n.contains("suction")).or(names.first()).cloned().unwrap_or_default();
    // The blade points along +X at its radius; on the table it lies, its span toward the operator.
    let setup = json!({
        "name": "suction side",
        "work_from_part": { "rotation_axis": [1.0, 0.0, 0.0], "rotation_deg": 90.0 },
        "table_from_work": { "translation_mm": [round_to(-21.5 * scale * 10.0, 0), 0.0, round_to(40.0 * scale + 20.0, 0)] },
        "meshes": [
            { "file": "rotor37.obj", "groups": [suction], "role": "drive", "unit": "millimetre", "up_axis": "z" },
            { "file": "rotor37.obj", "role": "part", "unit": "millimetre", "up_axis": "z" },
        ],
        "stock": { "offset": { "allowance_mm": stock_for(radius) } },
        "clearance": { "plane": { "origin_mm": [0.0, 0.0, round_to(60.0 * scale, 0)] } },
    });
    let strategy = json!({ "parallel_planes": { "normal": [1.0, 0.0, 0.0] } });
    let operation = operation("suction side", radius, &strategy, scale / 40.0);
    Ok(job_folder(
        ("rotor37.obj", obj),
        &job_file(&format!("NASA Rotor 37 blade, scale {scale}"), setup, operation),
        (radius, 4.0 * radius),
    ))
}
