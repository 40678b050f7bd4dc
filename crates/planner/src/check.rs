//! What `check` says of a setup.

use facemill_surface_model::{LengthUnit, UpAxis};

use crate::load::Setup;
use crate::mesh_winding::check_winding;
use crate::output::try_template;
use crate::path::lay;
use crate::program::word_map;
use crate::{Failure, Job};

fn units(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Metre => "metres",
        LengthUnit::Centimetre => "centimetres",
        LengthUnit::Millimetre => "millimetres",
        LengthUnit::Inch => "inches",
    }
}

fn up(axis: UpAxis) -> &'static str {
    match axis {
        UpAxis::X => "x",
        UpAxis::Y => "y",
        UpAxis::Z => "z",
    }
}

/// Reads a setup, lays its passes, and tells in lines what was found; nothing is planned.
///
/// # Errors
/// As planning would, as far as reading and laying go.
pub fn describe_setup(job: &Job, index: usize) -> Result<Vec<String>, Failure> {
    let setup = Setup::read(job, index)?;
    let words = word_map(job, &setup, index)?;
    try_template(job, &setup, &words)?;
    let undecided = check_winding(job, &setup, index)?;
    let mut lines = vec![format!("setup \"{}\"", setup.file.name)];
    for mesh in &setup.reports {
        let taken = format!("in {}, {} up", units(mesh.unit), up(mesh.up_axis));
        lines.push(format!("mesh {} {taken}: {}", mesh.file, mesh.told()));
    }
    lines.extend(undecided);
    let b = setup.aabb();
    lines.push(format!(
        "everything lies in ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm of the workpiece frame",
        b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
    ));
    for (k, operation) in job.operations_of(setup.file) {
        let laid = lay(job, &setup, k, operation)?;
        let points: usize = laid.tasks.iter().map(|t| t.pass.points.len()).sum();
        let copies = operation.pattern.as_ref().map_or(1, |p| p.copies);
        lines.push(format!(
            "operation \"{}\": {} passes with {points} CC points, in {copies} place(s); {} short pieces left out",
            operation.name,
            laid.tasks.len(),
            laid.dropped_pieces
        ));
    }
    Ok(lines)
}
