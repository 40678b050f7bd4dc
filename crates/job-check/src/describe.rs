//! Description of a setup, as `check` prints it.

use facemill_cl_data::CcPoint;
use facemill_surface_model::UpAxis;
use facemill_tool_model::ToolAssembly;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::post_probe::try_template;
use crate::reach::check_reach;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PathFile, SetupFile};
use facemill_job::format::report::MeshReport;
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

/// Setup in words.
struct SetupDescription {
    name: String,
    /// Number, and line, of each head's tool.
    tools: Vec<(u32, String)>,
    stock: String,
    /// Meshes, and the part in its own frame: the same for every setup that names them.
    part: Vec<String>,
    /// Notes on this setup alone.
    notes: Vec<String>,
    table: String,
    /// Head, from 1, name and content of each operation.
    operations: Vec<(u32, String, String)>,
}

/// Reads a setup, generates its passes and describes the result in lines; plans nothing.
///
/// # Errors
/// As planning, for reading the setup and generating its passes.
pub fn describe_setup(job: &Job, index: usize) -> Result<Vec<String>, Failure> {
    let SetupDescription { name, tools, stock, part, notes, table, operations } = described(job, index)?;
    let mut lines = vec![format!("setup \"{name}\"")];
    lines.extend(tools.into_iter().map(|(_, line)| line));
    lines.push(format!("stock: {stock}"));
    lines.extend(part.into_iter().chain(notes));
    lines.push(table);
    lines.extend(operations.into_iter().map(|(_, name, text)| format!("operation \"{name}\": {text}")));
    Ok(lines)
}

/// Reads all setups of a job, generates their passes and describes the result in lines, those of
/// one clamping together; plans nothing. Says once what holds for several setups.
///
/// # Errors
/// As [`describe_setup`].
pub fn describe_job(job: &Job) -> Result<Vec<String>, Failure> {
    let setups = &job.file.setups;
    if setups.len() == 1 {
        return describe_setup(job, 0);
    }
    // The first fault is that of the first setup, however many threads there are.
    let all: Vec<Result<SetupDescription, Failure>> =
        (0..setups.len()).into_par_iter().map(|k| described(job, k)).collect();
    let all = all.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut lines: Vec<String> = Vec::new();
    for line in all.iter().flat_map(|s| s.tools.iter().map(|(_, line)| line)).chain(all.iter().flat_map(|s| &s.part)) {
        if !lines.contains(line) {
            lines.push(line.clone());
        }
    }
    for (name, of) in job.clampings() {
        let (at, first) = (&setups[of.start], &all[of.start]);
        lines.push(format!("clamping \"{name}\" at {}{}", at.work_offset.register, turned(at)));
        lines.push(format!("  stock: {}", first.stock));
        lines.push(format!("  {}", first.table));
        for (k, setup) in of.clone().zip(&all[of.clone()]) {
            let is_next = k > of.start && follows(&setups[k - 1], &setups[k]).is_ok();
            // For those behind it, only the name of the program before differs.
            if k == of.start + 1 || k > of.start && !is_next {
                lines.push(format!("  then stock: {}", setup.stock));
            }
            lines.extend(setup.notes.iter().map(|note| format!("  {note}")));
            let on = if is_next { ", on what is left" } else { "" };
            lines.extend(setup.operations.iter().map(|(head, name, text)| {
                let tool = setup.tools.get(head.saturating_sub(1) as usize).or(setup.tools.first());
                format!("  T{}{on}: \"{name}\", {text}", tool.map_or(0, |(number, _)| *number))
            }));
        }
    }
    Ok(lines)
}

/// Returns the turn of the part on the table in a clamping, in words; empty for none.
fn turned(setup: &SetupFile) -> String {
    let turn = (pose(&setup.table_from_work) * pose(&setup.work_from_part)).rotation.axis_angle();
    turn.map_or_else(String::new, |(axis, angle)| {
        let [x, y, z] = axis.into_inner().into();
        format!(", the part turned by {:.3} deg about ({x:.6}, {y:.6}, {z:.6})", angle.to_degrees())
    })
}

fn described(job: &Job, index: usize) -> Result<SetupDescription, Failure> {
    let job = &job.for_setup(index);
    let setup = Setup::read(job, index)?;
    let words = word_map(job, &setup, index)?;
    try_template(job, &setup, &words)?;
    let undecided = check_winding(job, &setup, index)?;
    each_program_before(job, &setup, 0, |_| Ok(()))?;
    let tools = [Some(&job.tool), job.second.as_ref().map(|s| &s.tool)].into_iter().flatten();
    let mesh = |mesh: &MeshReport| {
        let taken = format!("in {}, {} up", units(mesh.unit), up(mesh.up_axis));
        format!("mesh {} {taken}: {}", mesh.file, mesh.summary_line())
    };
    let mut part: Vec<String> = setup.reports.iter().map(mesh).collect();
    part.extend(undecided);
    part.push(part_line(&setup));
    let b = setup.aabb();
    let table = format!(
        "everything on the table, its own bodies included, lies in ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm of the workpiece frame",
        b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
    );
    let mut operations = Vec::new();
    for (k, operation) in job.operations_of(setup.file) {
        operations.extend(level_text(&setup, operation).map(|text| (operation.head, operation.name.clone(), text)));
        if is_after_others(operation) {
            check_before(job, index)?;
            let text = "passes where the programs before it leave material, laid when these are planned";
            operations.push((
                operation.head,
                operation.name.clone(),
                format!("{}: {text}", work_text(&setup, operation)),
            ));
            continue;
        }
        let path = lay_operation(job, &setup, k, operation)?;
        let head = job.seen_by(operation.head.saturating_sub(1) as usize, 0.0);
        check_reach(&head, &setup, operation, &path.tasks).map_err(|e| job.wrong(e))?;
        let points: usize = path.tasks.iter().map(|t| t.pass.points.len()).sum();
        let copies = operation.pattern.as_ref().map_or(1, |p| p.copies);
        let text = format!(
            "{}: {} passes with {points} CC points, in {copies} place(s); {} short pieces left out",
            work_text(&setup, operation),
            path.tasks.len(),
            path.dropped_pieces
        );
        operations.push((operation.head, operation.name.clone(), text));
    }
    Ok(SetupDescription {
        name: setup.file.name.clone(),
        tools: tools.map(|tool| (tool.number(), tool_line(tool))).collect(),
        stock: stock_text(job, index),
        part,
        notes: unit_advice(job, &setup).into_iter().collect(),
        table,
        operations,
    })
}

/// Returns how an operation lays its passes and what it leaves, in words.
fn work_text(setup: &Setup<'_>, operation: &OperationFile) -> String {
    let how = match &operation.path {
        PathFile::Strategy(file) => match serde_json::to_value(&file.strategy) {
            Ok(serde_json::Value::Object(map)) => map.keys().next().cloned().unwrap_or_default().replace('_', " "),
            Ok(serde_json::Value::String(name)) => name.replace('_', " "),
            _ => "a strategy".to_owned(),
        },
        PathFile::File(file) => format!("passes of {}", file.file),
        PathFile::Cl(cl) => format!("passes of {}", cl.file),
    };
    format!("{how}, {} mm left", round_to_micron(setup.drive_allowance))
}

/// Returns a length in mm without the last digits of sums.
fn round_to_micron(mm: f64) -> f64 {
    (1e3 * mm).round() / 1e3
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

/// Returns the level that an operation cuts in words, on the stock as it is at first; `None`
/// of one without a level.
fn level_text(setup: &Setup<'_>, operation: &OperationFile) -> Option<String> {
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
        "level at {:.2} mm, {:.2} mm deep, on {:.1} cm2 of the stock; {:.1} cm2 of it stay because the part is in the \
         way of the tool",
        levels.to_mm,
        levels.from_mm.map_or(levels.depth_mm, |from| from - levels.to_mm),
        all / 100.0,
        kept / 100.0
    ))
}

/// Returns the stock that a setup's program meets, in words.
fn stock_text(job: &Job, index: usize) -> String {
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
        None => own,
        Some((before, Ok(()))) => format!("what \"{}\" leaves of {own}; {what}", before.name),
        Some((_, Err(why))) => format!("{own}; not what the setup before leaves: {why}"),
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
