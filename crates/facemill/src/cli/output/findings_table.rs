//! Findings as a table for people.

use facemill::virtual_machine::Finding;

/// Headings of the columns; the text of the block follows without one.
const HEADS: [&str; 6] = ["line", "time", "what", "between", "size", "place, mm"];

/// Returns the lines of a table, one for each finding: line of the program, time, kind, bodies,
/// amount, place on the workpiece, and the text of its block with a note. Empty without findings.
pub(crate) fn findings_table(findings: &[Finding]) -> Vec<String> {
    if findings.is_empty() {
        return Vec::new();
    }
    let rows: Vec<[String; 6]> = findings.iter().map(cells).collect();
    let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).fold(HEADS[k].len(), usize::max);
    let widths: [usize; 6] = std::array::from_fn(width);
    let line = |cells: [&str; 6], behind: &str| {
        let padded: Vec<String> = cells.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        format!("{}  {behind}", padded.join("  ")).trim_end().to_owned()
    };
    let rows =
        rows.iter().zip(findings).map(|(row, finding)| line(row.each_ref().map(String::as_str), &block(finding)));
    std::iter::once(line(HEADS, "block")).chain(rows).collect()
}

fn cells(f: &Finding) -> [String; 6] {
    let lines = match (f.first_line, f.last_line) {
        (first, last) if first == last => f.worst_line.to_string(),
        (first, last) if f.episodes > 1 => format!("{} ({first}-{last}, {} times)", f.worst_line, f.episodes),
        (first, last) => format!("{} ({first}-{last})", f.worst_line),
    };
    let between = match (&f.body, &f.obstacle, &f.axis) {
        (Some(body), Some(obstacle), _) => format!("{body}, {obstacle}"),
        (Some(one), ..) | (_, Some(one), _) => one.clone(),
        (.., axis) => axis.as_ref().map_or_else(String::new, |axis| format!("axis {axis}")),
    };
    let time = f.time_s.map_or_else(String::new, minutes);
    let size = f.measure.map_or_else(String::new, |m| m.to_string());
    // A finding without a place of contact has the place of the tip.
    let place = f.place_work_mm.or(f.pose.as_ref().map(|p| p.tip_work_mm));
    let place = place.map_or_else(String::new, |p| p.map(|v| format!("{:.2}", v + 0.0)).join(" "));
    [lines, time, f.kind.to_string(), between, size, place]
}

/// Formats minutes and tenths of seconds.
fn minutes(seconds: f64) -> String {
    // The cast saturates.
    let tenths = (10.0 * seconds).round() as u64;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}

fn block(f: &Finding) -> String {
    if f.note.is_empty() { format!("`{}`", f.block_text) } else { format!("`{}` {}", f.block_text, f.note) }
}

#[cfg(test)]
#[path = "../../../tests/unit/cli/output/findings_table.rs"]
mod tests;
