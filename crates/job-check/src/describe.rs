//! Description of a setup, as `check` prints it.

use facemill_cl_data::CcPoint;
use facemill_surface_model::UpAxis;
use facemill_tool_model::ToolAssembly;
use nalgebra::Point3;

use crate::post_probe::try_template;
use crate::reach::check_reach;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::frames::pose;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::load::part_size::{part_box, unit_advice, units};
use facemill_job::setup::path::lay_operation;
use facemill_job::setup::programs_before::each_program_before;
use facemill_job::setup::word_map::word_map;
use facemill_job::stock::setup_order::check_before;
use facemill_job::validate::setup_chain::{follows, is_after_others};

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
    let job = &job.for_setup(index);
    let setup = Setup::read(job, index)?;
    let words = word_map(job, &setup, index)?;
    try_template(job, &setup, &words)?;
    let undecided = check_winding(job, &setup, index)?;
    each_program_before(job, &setup, 0, |_| Ok(()))?;
    let mut lines = vec![format!("setup \"{}\"", setup.file.name)];
    lines.extend([Some(&job.tool), job.second.as_ref().map(|s| &s.tool)].into_iter().flatten().map(tool_line));
    lines.push(stock_line(job, index));
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
        lines.extend(level_line(&setup, operation));
        if is_after_others(operation) {
            check_before(job, index)?;
            lines.push(format!(
                "operation \"{}\": its passes go where the programs before it leave material, and are laid when these are planned",
                operation.name
            ));
            continue;
        }
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

/// Returns the line with number and cutter of a tool, and the keys of values that are assumed.
fn tool_line(tool: &ToolAssembly) -> String {
    let cutter = tool.cutter();
    let assumed: Vec<String> = tool.to_file().assumed.into_iter().map(|assumed| assumed.key).collect();
    let assumed = if assumed.is_empty() { String::new() } else { format!("; assumed: {}", assumed.join(", ")) };
    format!(
        "tool T{} \"{}\": R {} mm, r {} mm, {} insert(s), {:.1} mm from gauge line to tip{assumed}",
        tool.number(),
        tool.name(),
        cutter.radius(),
        cutter.corner_radius(),
        tool.n_inserts(),
        tool.gauge_length()
    )
}

/// Returns the line with the level that an operation cuts, on the stock as it is at first; `None`
/// of one without a level.
fn level_line(setup: &Setup<'_>, operation: &OperationFile) -> Option<String> {
    let (level, levels) = (&setup.level.as_ref()?.level, operation.levels?);
    let plane = level.plane();
    let (normal, feed) = (plane.axis(), plane.at(1.0, 0.0) - plane.at(0.0, 0.0));
    let is_stock = |(place, _): (Point3<f64>, bool)| {
        let cc = CcPoint::new(place, normal.into_inner(), feed);
        cc.is_ok_and(|cc| setup.stock_above(&cc) > operation.tolerances.cusp_mm)
    };
    let is_stock: Vec<bool> = level.reach().middles().map(is_stock).collect();
    let [room, _] = setup.level_rooms()?;
    let may_be_swept = level.reach().may_be_swept(&room);
    let [all, kept] = [false, true].map(|of_kept| level.reach().area(|k| is_stock[k] && !(of_kept && may_be_swept[k])));
    Some(format!(
        "operation \"{}\": level at {:.2} mm, {:.2} mm deep, on {:.1} cm2 of the stock; {:.1} cm2 of it stay because the part is in the \
         way of the tool",
        operation.name,
        levels.to_mm,
        levels.from_mm.map_or(levels.depth_mm, |from| from - levels.to_mm),
        all / 100.0,
        kept / 100.0
    ))
}

/// Returns the line with the stock that a setup's program meets.
fn stock_line(job: &Job, index: usize) -> String {
    let setups = &job.file.setups;
    let own = setups[index].stock.in_words();
    let by_others = &setups[index].programs_before;
    let own =
        if by_others.is_empty() { own } else { format!("{own}, cut by {} program(s) of other jobs", by_others.len()) };
    let is_counted = job.second.is_none() || job.file.verification.cut_stock;
    let before = index.checked_sub(1).filter(|_| is_counted).map(|k| &setups[k]);
    let planned = "postures, entries and links are planned on all that may be left of it";
    let what = match (job.second.is_none(), job.file.verification.cut_stock) {
        (true, true) => format!("{planned}, and the program is verified on it"),
        (true, false) => planned.to_owned(),
        (false, _) => "the program is verified on it, postures, entries and links are planned on all of it".to_owned(),
    };
    match before.map(|before| (before, follows(before, &setups[index]))) {
        None => format!("stock: {own}"),
        Some((before, Ok(()))) => format!("stock: what \"{}\" leaves of {own}; {what}", before.name),
        Some((_, Err(why))) => format!("stock: {own}; not what the setup before leaves: {why}"),
    }
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
