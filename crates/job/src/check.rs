//! Description of a setup, as `check` prints it.

pub mod machine_check;
pub(crate) mod mesh_summary;
#[cfg(test)]
#[path = "../tests/unit/check/placement_laws.rs"]
mod placement_laws;
pub(crate) mod post_block_words;
pub mod post_probe;
pub mod reach;

use facemill_surface_model::UpAxis;

use crate::check::post_probe::try_template;
use crate::check::reach::check_reach;
use crate::failure::Failure;
use crate::frames::pose;
use crate::load::job::{Job, Setup};
use crate::load::mesh_winding::check_winding;
use crate::load::part_size::{part_box, unit_advice, units};
use crate::setup::path::lay_operation;
use crate::setup::word_map::word_map;

fn up(axis: UpAxis) -> &'static str {
    match axis {
        UpAxis::X => "x",
        UpAxis::Y => "y",
        UpAxis::Z => "z",
    }
}

/// Reads a setup, generates its passes and describes the result in lines; plans nothing.
///
/// # Errors
/// As planning, for reading the setup and generating its passes.
pub fn describe_setup(job: &Job, index: usize) -> Result<Vec<String>, Failure> {
    let setup = Setup::read(job, index)?;
    let words = word_map(job, &setup, index)?;
    try_template(job, &setup, &words)?;
    let undecided = check_winding(job, &setup, index)?;
    let mut lines = vec![format!("setup \"{}\"", setup.file.name)];
    for mesh in &setup.reports {
        let taken = format!("in {}, {} up", units(mesh.unit), up(mesh.up_axis));
        lines.push(format!("mesh {} {taken}: {}", mesh.file, mesh.summary_line()));
    }
    lines.extend(undecided);
    lines.push(part_line(&setup));
    lines.extend(unit_advice(job, &setup));
    let b = setup.aabb();
    lines.push(format!(
        "everything on the table, its own bodies included, lies in ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm of the workpiece frame",
        b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
    ));
    for (k, operation) in job.operations_of(setup.file) {
        let path = lay_operation(job, &setup, k, operation)?;
        let head = job.seen_by(operation.head.saturating_sub(1) as usize, 0.0);
        check_reach(&head, &setup, operation, &path.tasks).map_err(|e| job.wrong(e))?;
        let points: usize = path.tasks.iter().map(|t| t.pass.points.len()).sum();
        let copies = operation.pattern.as_ref().map_or(1, |p| p.copies);
        lines.push(format!(
            "operation \"{}\": {} passes with {points} CC points, in {copies} place(s); {} short pieces left out",
            operation.name,
            path.tasks.len(),
            path.dropped_pieces
        ));
    }
    Ok(lines)
}

/// Returns the line with size and position of the part in its own frame.
fn part_line(setup: &Setup<'_>) -> String {
    let b = part_box(&setup.obstacles, &pose(&setup.file.work_from_part));
    let size = b.max - b.min;
    format!(
        "the part is {:.1} x {:.1} x {:.1} mm: it lies in ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm of its own frame",
        size.x, size.y, size.z, b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
    )
}
