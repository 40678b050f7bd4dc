//! Page of a job with several programs: clampings, tools, operations and their times.

use std::collections::BTreeSet;

use facemill_job::duration_text::clock;
use facemill_job::format::job_report::{
    ClampingReport, CuspsAtEnd, JobReport, PlacementReport, PoseReport, ToolProgramReport,
};
use facemill_job::format::report::outcome::Outcome;

use crate::format::PAGE_FORMAT;
use crate::html::{STYLE, escaped};

/// Colours of tools, by the order in which they come.
const COLOURS: [&str; 8] = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#999999", "#f0e442"];

/// Returns the page of a job as a file that opens from disk, without scripts or any access to a
/// network, and prints on A4.
#[must_use]
pub fn job_html(report: &JobReport) -> Vec<u8> {
    let tools = tools(report);
    let (state, stamp, note) = stamp(report);
    let job = escaped(&report.job);
    let rejected = if state == "bad" { "REJECTED - " } else { "" };
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'\">\n<meta name=\"generator\" \
         content=\"{PAGE_FORMAT}\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{rejected}{job} - job</title>\n<style>{STYLE}</style>\n</head>\n<body class=\"sheet-page\">\n<div id=\"app\"><main class=\"sheet\">\n"
    );
    out += &format!(
        "<header><div><h1>Job</h1><p class=\"sheet-job\">{job}</p><p>{}</p></div><p class=\"stamp {state}\">{stamp}<small>{note}</small></p></header>\n",
        escaped(&report.machine)
    );
    out += "<h2>Time</h2>\n";
    out += &format!("<p>{}</p>\n", escaped(&time_text(report)));
    out += &time_picture(report, &tools);
    out += &tool_table(report, &tools);
    out += &left_section(report);
    for (k, clamping) in report.clampings.iter().enumerate() {
        out += &clamping_section(k + 1, clamping, &tools);
    }
    out += "</main></div>\n</body>\n</html>\n";
    out.into_bytes()
}

/// Returns numbers and names of all tools, by their first use.
fn tools(report: &JobReport) -> Vec<(u32, &str)> {
    let mut tools: Vec<(u32, &str)> = Vec::new();
    for program in report.clampings.iter().flat_map(|c| &c.programs) {
        let tool = (program.tool_number, program.tool.as_str());
        if !tools.contains(&tool) {
            tools.push(tool);
        }
    }
    tools
}

fn colour(tools: &[(u32, &str)], program: &ToolProgramReport) -> &'static str {
    let is_own = |tool: &(u32, &str)| *tool == (program.tool_number, program.tool.as_str());
    COLOURS[tools.iter().position(is_own).unwrap_or(0) % COLOURS.len()]
}

/// Returns class, words and note of the stamp.
fn stamp(report: &JobReport) -> (&'static str, &'static str, String) {
    let programs = || report.clampings.iter().flat_map(|c| &c.programs);
    let count = |is: &dyn Fn(&ToolProgramReport) -> bool| programs().filter(|p| is(p)).count();
    let n = programs().count();
    let without: usize = report.clampings.iter().map(|c| c.without_program.len()).sum();
    let not_joined = report.clampings.iter().filter(|c| c.not_joined_because.is_some()).count();
    let not_certified =
        |p: &ToolProgramReport| p.certified_blocks.is_some_and(|[blocks, certified]| certified < blocks);
    match report.outcome {
        Outcome::Faulty => {
            let faulty = count(&|p| p.faults > 0);
            ("bad", "REJECTED: DO NOT RUN", format!("{faulty} of {n} programs have faults"))
        }
        _ if count(&|p| !p.verified) > 0 => {
            ("warn", "NOT VERIFIED", format!("{} of {n} programs were not run", count(&|p| !p.verified)))
        }
        Outcome::Incomplete => {
            let less = count(&|p| !p.incomplete_because.is_empty());
            let note = match report.incomplete_because.len() {
                0 => format!("{less} of {n} programs leave more than the job permits"),
                reasons => format!("for {reasons} reason(s), below"),
            };
            ("warn", "NO FAULT, JOB NOT MET", note)
        }
        _ if count(&not_certified) > 0 => {
            let open = count(&not_certified);
            (
                "warn",
                "NO FAULT, NOT ALL IS PROVEN",
                format!("{open} of {n} programs have blocks that are not certified"),
            )
        }
        _ if without > 0 => ("warn", "NO FAULT", format!("{without} setups have nothing to cut")),
        _ if not_joined > 0 => {
            ("warn", "VERIFIED ONE BY ONE", format!("{not_joined} clamping(s) have no program of all tools"))
        }
        _ => ("ok", "VERIFIED", format!("{n} programs without a fault")),
    }
}

/// Returns the reasons why the job is not met, and the operations whose own programs leave more
/// than their limits, with what is left of that at the end; nothing where there are none.
fn left_section(report: &JobReport) -> String {
    let mut out = String::new();
    if !report.incomplete_because.is_empty() {
        out += "<h2>Job not met</h2>\n<ul>\n";
        for why in &report.incomplete_because {
            out += &format!("<li>{}</li>\n", escaped(why));
        }
        out += "</ul>\n";
    }
    if report.left_at_end.is_empty() {
        return out;
    }
    out += "<h2>Left at the end</h2>\n<p>Operations whose own programs leave more than their limits, measured again after all programs \
            of the job.</p>\n<table>";
    out += &head([
        "setup, operation",
        "limit, mm",
        "above it, own program",
        "at the end",
        "never cut",
        "highest, mm",
        "kept",
    ]);
    out += "<tbody>\n";
    for left in &report.left_at_end {
        let highest =
            left.highest_at_end.map_or_else(|| "none above".to_owned(), |place| format!("{:.3}", place.height_mm));
        let mut notes: Vec<String> = left.cusps.iter().map(CuspsAtEnd::in_words).collect();
        notes.push(match left.lowered_by.as_slice() {
            [] => "no later program cuts deeper on it".to_owned(),
            setups => format!("cut deeper by {}", setups.join(", ")),
        });
        out += &format!(
            "<tr class=\"sum\"><td>{}, {}</td>{}{}{}{}{}{}</tr>\n<tr><td colspan=\"7\" style=\"padding-left:20px\" class=\"note\">{}</td></tr>\n",
            escaped(&left.setup),
            escaped(&left.operation),
            number(&format!("{:.3}", left.limit_mm)),
            number(&format!("{:.2} %", 100.0 * left.above_fraction)),
            number(&format!("{:.2} %", 100.0 * left.above_at_end)),
            number(&format!("{:.2} %", 100.0 * left.never_cut_at_end)),
            number(&highest),
            number(if left.is_kept() { "yes" } else { "no" }),
            escaped(&notes.join("; "))
        );
    }
    out += "</tbody></table>\n";
    out
}

fn time_text(report: &JobReport) -> String {
    let changes = match report.tool_change_s {
        Some(time) => format!("with {} tool change(s) of {time} s", report.tool_changes),
        None => format!("without {} tool change(s), whose time the machine file does not say", report.tool_changes),
    };
    let n = report.clampings.len();
    format!("{} on the machine in {n} clamping(s), {changes}; setting up is not counted.", clock(report.total_time_s))
}

/// Width of the picture, and height of the bar of a clamping.
const PICTURE: [f64; 2] = [680.0, 20.0];

/// Returns a bar for each clamping, with a part for each operation in the colour of its tool.
fn time_picture(report: &JobReport, tools: &[(u32, &str)]) -> String {
    let longest = report.clampings.iter().map(|c| c.time_s).fold(0.0, f64::max).max(1.0);
    let [width, height] = PICTURE;
    let rows = report.clampings.len() as f64;
    let mut out = format!(
        "<svg viewBox=\"0 0 {width} {}\" width=\"100%\" role=\"img\" aria-label=\"time of each operation\">\n",
        rows * (height + 16.0)
    );
    for (k, clamping) in report.clampings.iter().enumerate() {
        let top = k as f64 * (height + 16.0);
        let mut at = 0.0;
        out += &format!(
            "<text x=\"0\" y=\"{:.1}\" font-size=\"10\">{}, {}</text>\n",
            top + 10.0,
            escaped(&clamping.name),
            clock(clamping.time_s)
        );
        for program in &clamping.programs {
            for operation in &program.operations {
                let long = operation.time_s() / longest * width;
                out += &format!(
                    "<rect x=\"{at:.2}\" y=\"{:.1}\" width=\"{long:.2}\" height=\"{height}\" fill=\"{}\" stroke=\"#fff\" stroke-width=\"0.6\">\
                     <title>T{} {}: {}</title></rect>\n",
                    top + 14.0,
                    colour(tools, program),
                    program.tool_number,
                    escaped(&operation.operation),
                    clock(operation.time_s())
                );
                at += long;
            }
        }
    }
    out += "</svg>\n";
    out
}

/// Returns the tools, each with its length and the time that it works.
fn tool_table(report: &JobReport, tools: &[(u32, &str)]) -> String {
    let mut out =
        format!("<table style=\"margin-top:6px\">{}<tbody>\n", head(["tool", "length, mm", "programs", "time"]));
    for (k, tool) in tools.iter().enumerate() {
        let all = || report.clampings.iter().flat_map(|c| &c.programs);
        let own: Vec<&ToolProgramReport> = all().filter(|p| (p.tool_number, p.tool.as_str()) == *tool).collect();
        let lengths: BTreeSet<String> = own.iter().map(|p| format!("{:.1}", p.gauge_length_mm)).collect();
        let time: f64 = own.iter().map(|p| p.time_s).sum();
        out += &format!(
            "<tr><td>{} T{} {}</td>{}{}{}</tr>\n",
            mark(COLOURS[k % COLOURS.len()]),
            tool.0,
            escaped(tool.1),
            number(&lengths.into_iter().collect::<Vec<_>>().join(", ")),
            number(&own.len().to_string()),
            number(&clock(time))
        );
    }
    out += "</tbody></table>\n";
    out
}

/// Returns the head of a table with numbers in all columns but the first.
fn head<const N: usize>(names: [&str; N]) -> String {
    let (first, rest) = names.split_first().unwrap_or((&"", &[]));
    let rest: String = rest.iter().map(|name| format!("<th{RIGHT}>{name}</th>")).collect();
    format!("<thead><tr><th style=\"width:46%\">{first}</th>{rest}</tr></thead>")
}

/// Alignment of numbers.
const RIGHT: &str = " style=\"text-align:right;white-space:nowrap\"";

fn number(text: &str) -> String {
    format!("<td{RIGHT}>{text}</td>")
}

fn mark(colour: &str) -> String {
    format!("<span style=\"color:{colour}\">&#9632;</span>")
}

fn clamping_section(number: usize, clamping: &ClampingReport, tools: &[(u32, &str)]) -> String {
    let mut out = format!("<h2>Clamping {number}: {}, {}</h2>\n", escaped(&clamping.name), clock(clamping.time_s));
    out += "<table class=\"pairs\"><tbody>\n";
    let row = |what: &str, text: &str| format!("<tr><th>{what}</th><td>{}</td></tr>\n", escaped(text));
    out += &row("work offset", &clamping.placement.work_offset);
    out += &row("part in the workpiece frame", &pose_text(&clamping.placement.work_from_part));
    out += &row("workpiece frame on the table", &pose_text(&clamping.placement.table_from_work));
    out += &moved_text(&clamping.placement).map_or_else(String::new, |text| row("refers to", &text));
    out += &row("stock", &clamping.stock);
    for datum in &clamping.datums {
        let first = if datum.in_first { "" } else { "; the first clamping has another datum" };
        out += &row("located by", &format!("{}{first}", datum.in_words()));
    }
    let fixtures = if clamping.fixtures.is_empty() { "none stated".to_owned() } else { clamping.fixtures.join(", ") };
    out += &row("fixtures", &fixtures);
    out += &match (&clamping.joined_program, &clamping.not_joined_because) {
        (Some(file), _) => row("program of all tools", file),
        (None, Some(why)) => row("program of all tools", &format!("not written: {why}")),
        (None, None) => String::new(),
    };
    let without = clamping.without_program.join(", ");
    out += &if without.is_empty() { String::new() } else { row("nothing to cut", &without) };
    out += "</tbody></table>\n<table style=\"margin-top:6px\">";
    out += &head(["tool and program, operations", "line", "time", "in passes", "in air, about", "cm<sup>3</sup> cut"]);
    out += "<tbody>\n";
    for program in &clamping.programs {
        out += &program_rows(program, colour(tools, program));
    }
    out += "</tbody></table>\n";
    out
}

fn program_rows(program: &ToolProgramReport, colour: &str) -> String {
    let page = program.report.replace(".json", ".html");
    let line = program.line_in_joined.map_or_else(String::new, |line| line.to_string());
    let bad = if program.faults > 0 { " bad" } else { "" };
    let mut out = format!(
        "<tr class=\"sum{bad}\"><td>{} T{} {}{}, <a href=\"{}\">{}</a></td>{}{}<td></td><td></td>{}</tr>\n",
        mark(colour),
        program.tool_number,
        escaped(&program.tool),
        escaped(
            &program
                .second_tool
                .as_ref()
                .map_or_else(String::new, |second| format!(" and, on head 2, {}", second.in_words()))
        ),
        escaped(&page),
        escaped(&program.programs.join(", ")),
        number(&line),
        number(&clock(program.time_s)),
        number(&cm3(program.removed_mm3))
    );
    for operation in &program.operations {
        let air = operation.air_share.map_or_else(String::new, |share| format!("{:.1} %", 100.0 * share));
        out += &format!(
            "<tr><td style=\"padding-left:20px\">{}</td>{}{}{}{}{}</tr>\n",
            escaped(&operation.operation),
            number(""),
            number(&clock(operation.time_s())),
            number(&clock(operation.passes_time_s)),
            number(&air),
            number(&cm3(operation.removed_mm3))
        );
    }
    out += &format!(
        "<tr class=\"{}\"><td colspan=\"6\" style=\"padding-left:20px\" class=\"note\">{}</td></tr>\n",
        bad.trim(),
        escaped(&result_text(program))
    );
    out
}

fn cm3(volume: Option<f64>) -> String {
    volume.map_or_else(String::new, |mm3| format!("{:.1}", mm3 / 1000.0))
}

fn result_text(program: &ToolProgramReport) -> String {
    let mut parts = vec![match (program.verified, program.faults) {
        (false, _) => "not verified".to_owned(),
        (true, 0) => "no fault".to_owned(),
        (true, n) => format!("{n} fault(s)"),
    }];
    if program.other_findings > 0 {
        parts.push(format!("{} other finding(s)", program.other_findings));
    }
    parts.extend(
        program.certified_blocks.map(|[blocks, certified]| format!("{certified} of {blocks} blocks certified")),
    );
    parts.extend(program.incomplete_because.iter().cloned());
    parts.join("; ")
}

fn moved_text(placement: &PlacementReport) -> Option<String> {
    let moved = placement.moved_by.as_ref()?;
    let first = placement.compared_with.as_ref()?;
    let is_same = !turns(moved) && !shifts(moved);
    Some(if is_same {
        format!("on the table as in \"{first}\"")
    } else {
        format!("on the table, from its position in \"{first}\": {}", pose_text(moved))
    })
}

/// Returns whether a pose turns by an angle that is not 0 in its four written digits.
fn turns(pose: &PoseReport) -> bool {
    pose.rotation_deg.abs() >= 0.5e-4
}

/// Returns whether a pose moves by a length that is not 0 in its three written digits.
fn shifts(pose: &PoseReport) -> bool {
    pose.translation_mm.iter().any(|v| v.abs() >= 0.5e-3)
}

fn pose_text(pose: &PoseReport) -> String {
    let numbers = |values: [f64; 3], digits: usize| values.map(|v| format!("{v:.digits$}")).join(", ");
    let turn =
        turns(pose).then(|| format!("turned {:.4} deg about ({})", pose.rotation_deg, numbers(pose.rotation_axis, 6)));
    let shift = shifts(pose).then(|| format!("moved by ({}) mm", numbers(pose.translation_mm, 3)));
    match (turn, shift) {
        (None, None) => "the same frame".to_owned(),
        (turn, shift) => turn.into_iter().chain(shift).collect::<Vec<_>>().join(", then "),
    }
}

#[cfg(test)]
#[path = "../tests/unit/job_page.rs"]
mod tests;
