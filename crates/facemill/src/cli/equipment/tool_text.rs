//! Tools as text: rows of a table, and all measures of one.

use facemill::tool_library::{CutterKind, LibraryTool};
use facemill::tool_model::{SpindleRotation, Stack, ToolAssembly, ToolFile};

/// Returns a length or angle with at most four decimals, without zeros at its end.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Returns a name on one line.
fn one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Number of columns of the table of tools.
const COLUMNS: usize = 11;

/// Headings of the table of tools.
const HEADINGS: [&str; COLUMNS] =
    ["position", "T", "name", "kind", "D", "r", "flute", "stick-out", "gauge", "teeth", "file"];

/// Columns of the table that hold numbers.
const NUMBERS: [bool; COLUMNS] = [true, true, false, false, true, true, true, true, true, true, false];

/// Returns a row of the table of tools, with the tool's position in its library if it has one.
pub(crate) fn row(file: &ToolFile, kind: Option<CutterKind>, position: Option<usize>, from: &str) -> [String; COLUMNS] {
    [
        position.map(|position| position.to_string()).unwrap_or_default(),
        file.number.to_string(),
        one_line(&file.name),
        kind.map_or_else(|| shape_of(file), name_of).to_owned(),
        short(2.0 * file.radius_mm),
        short(file.corner_radius_mm),
        short(file.flute_length_mm),
        short(file.stick_out_mm),
        short(file.gauge_length_mm),
        file.n_inserts.to_string(),
        one_line(from),
    ]
}

/// Returns the name of a kind of cutter.
fn name_of(kind: CutterKind) -> &'static str {
    match kind {
        CutterKind::FaceMill => "face mill",
        CutterKind::BullNose => "bull nose",
        CutterKind::Ball => "ball",
        CutterKind::Flat => "flat",
        _ => "other",
    }
}

/// Returns the shape of a tool file's cutter, which does not say of which kind it is.
fn shape_of(file: &ToolFile) -> &'static str {
    if file.corner_radius_mm >= file.radius_mm {
        "ball"
    } else if file.corner_radius_mm > 0.0 {
        "round corner"
    } else {
        "flat"
    }
}

/// Returns a table of rows, lengths in mm.
pub(crate) fn table(rows: &[[String; COLUMNS]]) -> String {
    let widths: Vec<usize> = (0..COLUMNS)
        .map(|k| rows.iter().map(|row| row[k].chars().count()).fold(HEADINGS[k].chars().count(), usize::max))
        .collect();
    let line = |cells: &[String; COLUMNS]| {
        let cell = |k: usize| {
            let pad = " ".repeat(widths[k] - cells[k].chars().count());
            if NUMBERS[k] { format!("{pad}{}", cells[k]) } else { format!("{}{pad}", cells[k]) }
        };
        format!("{}\n", (0..COLUMNS).map(cell).collect::<Vec<_>>().join("  ").trim_end())
    };
    std::iter::once(&HEADINGS.map(str::to_owned)).chain(rows).map(line).collect()
}

/// Returns all measures of a tool and what is assumed of it, a line each.
pub(crate) fn measures(tool: &ToolAssembly, kind: Option<CutterKind>) -> String {
    let file = tool.to_file();
    let mut lines = vec![
        format!("tool {} \"{}\": {}", file.number, one_line(&file.name), kind.map_or_else(|| shape_of(&file), name_of)),
        format!("diameter {} mm, corner radius {} mm", short(2.0 * file.radius_mm), short(file.corner_radius_mm)),
        format!(
            "flute length {} mm, stick-out {} mm, gauge length {} mm",
            short(file.flute_length_mm),
            short(file.stick_out_mm),
            short(file.gauge_length_mm)
        ),
        format!(
            "{} teeth, {}",
            file.n_inserts,
            match file.spindle_rotation {
                SpindleRotation::Clockwise => "spindle clockwise (M3)",
                SpindleRotation::Counterclockwise => "spindle counterclockwise (M4)",
            }
        ),
        format!(
            "dead core of radius {} mm, ramps up to {} deg",
            short(file.dead_core_radius_mm),
            short(file.max_ramp_angle_deg)
        ),
        format!("length register {}", tool.length_register()),
    ];
    lines.extend(file.cutting_edge_angle_deg.map(|angle| format!("cutting edge angle {} deg", short(angle))));
    lines.extend(stack("body", &file.body, file.flute_length_mm));
    lines.extend(stack("holder", &file.holder, file.stick_out_mm));
    let mut text = format!("{}\n", lines.join("\n  "));
    for assumed in &file.assumed {
        text.push_str(&format!("  assumed {}: {}\n", one_line(&assumed.key), one_line(&assumed.reason)));
    }
    text
}

/// Returns the sections of a stack, with the heights above the tip that they reach.
fn stack(name: &str, stack: &Stack, from: f64) -> Vec<String> {
    let mut z = from;
    let mut lines = vec![format!("{name}, clearance {} mm", short(stack.clearance_mm))];
    for section in &stack.sections {
        let top = z + section.length_mm;
        lines.push(format!(
            "  {} to {} mm: diameter {} to {} mm",
            short(z),
            short(top),
            short(section.diameter_low_mm),
            short(section.diameter_high_mm)
        ));
        z = top;
    }
    lines
}

/// Returns what a library says of a tool that a tool file does not hold: notes, and cutting data as
/// fields of a job.
pub(crate) fn remarks(tool: &LibraryTool) -> String {
    let Ok(read) = &tool.import else { return String::new() };
    let notes = read.notes.iter().map(|note| format!("  note: {note}\n"));
    let presets = read.presets.iter().map(|preset| format!("  preset \"{}\": {}\n", preset.name, preset.job_feeds()));
    notes.chain(presets).collect()
}
