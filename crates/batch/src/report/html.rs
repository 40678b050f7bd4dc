//! Report as one page: no script, and nothing from elsewhere but the linked results.

use std::fmt::Write;

use crate::format::report_file::{BatchReport, TaskRow};
use crate::report::table::{cells, headings, measure_text, state_text};

const STYLE: &str = "body{font:14px sans-serif;margin:2em}table{border-collapse:collapse}\
td,th{border:1px solid #bbb;padding:.2em .5em;text-align:right;vertical-align:top}\
th{background:#eee;position:sticky;top:0}td.text{text-align:left}\
tr.failed{background:#fdd}tr.not-met{background:#ffefcc}tr.best{font-weight:bold}";

/// Returns the page. Links are relative to the folder of the results.
pub fn html(report: &BatchReport, title: &str) -> String {
    let title = escaped(title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"><title>{title}</title>\n\
         <style>{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n"
    );
    let c = report.counts;
    let _ = writeln!(
        page,
        "<p>{} tasks: {} done, {} not met, {} with wrong input, {} failed otherwise, {} running, {} waiting.</p>",
        c.tasks, c.done, c.not_met, c.wrong_input, c.failed, c.running, c.waiting
    );
    best_table(&mut page, report);
    page.push_str("<h2>Tasks</h2>\n<table>\n");
    head(&mut page, headings(report).iter().map(String::as_str).chain(["files"]));
    for row in &report.tasks {
        task_row(&mut page, report, row);
    }
    page.push_str("</table>\n</body>\n</html>\n");
    page
}

fn best_table(page: &mut String, report: &BatchReport) {
    let open = report.best_of.as_ref().map_or_else(|| "task".to_owned(), |axis| escaped(axis));
    let _ = writeln!(page, "<h2>Best {open} of each group, by {}</h2>\n<table>", measure_text(report.measure));
    head(page, ["group", "tasks", &open, "task", measure_text(report.measure), "worst / best"]);
    for best in &report.best {
        let _ = writeln!(
            page,
            "<tr><td class=\"text\">{}</td><td>{}</td><td>{}</td><td><a href=\"#t{}\">{}</a></td><td>{:.3}</td>\
             <td>{:.3}</td></tr>",
            escaped(&best.group),
            best.tasks,
            escaped(&best.label),
            best.number,
            best.number,
            best.value,
            best.worst_over_best
        );
    }
    page.push_str("</table>\n");
}

fn head<'a>(page: &mut String, names: impl IntoIterator<Item = &'a str>) {
    let names: String = names.into_iter().map(|name| format!("<th>{}</th>", escaped(name))).collect();
    let _ = writeln!(page, "<tr>{names}</tr>");
}

fn task_row(page: &mut String, report: &BatchReport, row: &TaskRow) {
    let is_best = report.best.iter().any(|best| best.number == row.number);
    let state = state_text(row.state).replace(' ', "-");
    let best = if is_best { " best" } else { "" };
    let _ = write!(page, "<tr id=\"t{}\" class=\"{state}{best}\">", row.number);
    for cell in cells(report, row) {
        let class = if cell.parse::<f64>().is_ok() { "" } else { " class=\"text\"" };
        let _ = write!(page, "<td{class}>{}</td>", escaped(&cell));
    }
    let link = |path: &String| {
        let name = path.rsplit('/').next().unwrap_or(path);
        format!("<a href=\"{}\">{}</a>", escaped(path), escaped(name))
    };
    let links: Vec<String> = row.files.iter().map(link).collect();
    let _ = writeln!(page, "<td class=\"text\">{}</td></tr>", links.join(" "));
}

/// Returns text with the characters escaped that HTML gives a meaning.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
