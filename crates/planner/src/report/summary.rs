//! Summary that the command line prints at the end.

use facemill_job::duration_text::clock;
use facemill_job::format::report::cl_paths::ClPathReport;
use facemill_job::format::report::left_above::LeftAboveReport;
use facemill_job::format::report::links::{LinksReport, TurnsReport};
use facemill_job::format::report::pairs::PairReport;
use facemill_job::format::report::remaining::RemainingReport;
use facemill_job::format::report::stock::{OWN_STOCK, PlannedStockReport, StockReport};
use facemill_job::format::report::{
    CertifiedReport, ChipsReport, CuspsKeptReport, HeldBackReport, LostTimeReport, OperationReport, PosturesReport,
    Report, SpreadReport, VectorTimeReport, WidthRoundReport,
};
use facemill_tool_path::moves::order::PassOrderReport;
use facemill_virtual_machine::{Assumption, WindUp};

/// Returns a few lines for a person.
pub fn summary(report: &Report) -> String {
    let t = &report.totals;
    let w = &report.worst;
    let mut lines = vec![
        format!("{} - {}", report.job, report.setup),
        format!("  passes            {}", t.passes),
        format!(
            "  CC points         {}, planned {} ({:.2} %), trimmed {}",
            t.cc_points,
            t.planned_points,
            100.0 * t.planned_fraction,
            t.trimmed_points
        ),
        format!(
            "  blocks            {} with a motion, cutting length {:.1} m, {:.1} m of it in passes",
            t.blocks,
            t.cutting_length_mm / 1000.0,
            t.passes_length_mm / 1000.0
        ),
    ];
    lines.extend(short_stretches(t.dropped_pieces));
    lines.extend(times(report));
    lines.extend(report.operations.iter().map(OperationReport::summary_line));
    lines.extend(report.pairs.iter().map(pair));
    lines.extend(report.orders.iter().map(order));
    if report.verified {
        lines.push(format!(
            "  smallest clearance {}{}",
            or_none(w.clearance_mm, "mm"),
            w.clearance_between
                .as_ref()
                .map(|b| format!(" ({b}, line {})", w.clearance_line.unwrap_or(0)))
                .unwrap_or_default()
        ));
        for b in &report.budgets {
            let of = if report.budgets.len() > 1 { format!(", operation \"{}\"", b.operation) } else { String::new() };
            lines.push(format!(
                "  largest gouge     {} in the written program; allowed there {:.3} mm, error budget {:.3} mm{of}",
                or_none(b.largest_gouge_mm, "mm"),
                b.against_mesh_mm,
                b.total_mm
            ));
        }
        lines.extend(stock(&report.stock));
        lines.extend(links(&report.links));
    } else {
        lines.push("  NOT VERIFIED      the written program was not run; do not cut with it".to_owned());
    }
    if let Some(c) = &report.certified {
        lines.extend(certified(c));
    }
    lines.extend(report.remaining.iter().flat_map(RemainingReport::summary_lines));
    lines.extend(report.efficiency.iter().map(|e| e.summary_line(report.efficiency.len() > 1)));
    lines.extend(report.left_above.iter().flat_map(LeftAboveReport::summary_lines));
    lines.extend(report.cl_paths.iter().flat_map(ClPathReport::summary_lines));
    lines.extend(report.cusps.iter().flat_map(cusps_kept));
    let of_single = report.postures.iter().filter_map(|p| p.optimum.as_ref()).map(|o| o.jumps);
    let of_pairs = report.pairs.iter().flat_map(|p| p.posture_jumps);
    let jumps: usize = of_single.chain(of_pairs).sum();
    if jumps > 0 {
        lines.push(format!(
            "  quick turns       {jumps} steps of the search turn by more than max_turn_deg_per_mm, or slow the feed; all are tested, \
             run and timed as they are"
        ));
    }
    lines.extend(report.chips.iter().filter_map(removal_rate));
    lines.extend(report.postures.iter().filter_map(wider_search));
    lines.extend(rotary_reversals(report));
    lines.extend(wound(&report.wind_up));
    if w.linearisation_exceeded {
        let allowed = report.budgets.iter().map(|b| b.linearisation_mm).fold(f64::INFINITY, f64::min);
        let found = w.linearisation_mm;
        lines.push(format!("  linearisation     {found:.5} mm, more than the {allowed:.5} mm that the budget allows"));
    }
    for mesh in report.meshes.iter().filter(|m| m.is_open()) {
        lines.push(format!("  open mesh         {}: a body wholly inside it is not found", mesh.file));
    }
    lines.push(format!("  findings          {}", report.findings.len()));
    for finding in report.findings.iter().take(10) {
        lines.push(format!("    {finding}"));
    }
    lines.extend(assumptions(&report.assumptions));
    lines.extend(left_out(report));
    lines.join("\n")
}

/// Largest number of reasons for left-out points in the summary; the report has them all.
const TOLD_REASONS: usize = 5;

/// Returns lines on the left-out points, compared with the job's limit, and reasons.
fn left_out(report: &Report) -> Vec<String> {
    let t = &report.totals;
    if t.trimmed_points == 0 {
        return Vec::new();
    }
    let (percent, allowed) = (100.0 * (1.0 - t.planned_fraction), 100.0 * t.max_trimmed_fraction);
    let against = if t.trims_too_much { "more than" } else { "within" };
    let mut lines = vec![format!(
        "  left out          {} points, {percent:.2} %: {against} the {allowed:.2} % that the job allows",
        t.trimmed_points
    )];
    lines.extend(report.infeasible.iter().take(TOLD_REASONS).map(|reason| {
        let help: Vec<String> = reason.would_help.iter().map(|h| format!("{} {:.2}", h.field, h.value)).collect();
        let help = if help.is_empty() { String::new() } else { format!("; would help: {}", help.join(" or ")) };
        format!("    {} points, {}{help}", reason.points, reason.reason)
    }));
    lines
}

/// Returns lines on the axes that wind by more than a turn.
fn wound(all: &[WindUp]) -> impl Iterator<Item = String> + '_ {
    all.iter().filter(|w| w.turns > 1.0).map(|w| format!("  wind-up           {w}"))
}

/// Largest number of assumptions in the summary; the report has them all.
const SHOWN_ASSUMPTIONS: usize = 6;

/// Returns the line on the rounds of laying; `None` if passes were laid once.
fn width_rounds(cusps: &CuspsKeptReport) -> Option<String> {
    let number = cusps.width_rounds.iter().position(|r| r.is_cut)? + 1;
    let round = |r: &WidthRoundReport| {
        let (length, largest) = (r.length_mm / 1000.0, r.largest_mm);
        format!("{} + {} passes of {length:.1} m, largest {largest:.3} mm", r.passes, r.passes_added)
    };
    let all: Vec<String> = cusps.width_rounds.iter().map(round).collect();
    Some(format!("  rounds of widths  {}; round {number} is cut", all.join("; ")))
}

/// Returns lines on inserted passes, and reasons if the permitted cusp is exceeded.
fn cusps_kept(cusps: &CuspsKeptReport) -> Vec<String> {
    let mut lines: Vec<String> = width_rounds(cusps).into_iter().collect();
    let (between, moved) = (cusps.passes_between, cusps.moved_passes);
    if between + moved > 0 {
        lines.push(format!("  passes added      {between} for the cusp, {moved} beside trimmed ones"));
    }
    let kept = if cusps.kept_by_text { "cusp kept by the text" } else { "cusp not kept" };
    lines.extend(cusps.reasons.iter().take(3).map(|r| {
        let [x, y, z] = r.place_mm;
        let ridge = r.cusp_mm.map_or_else(|| "an uncut strip".to_owned(), |h| format!("predicted up to {h:.3} mm"));
        format!(
            "    {kept}: {} points, {ridge}, step-over {:.1} mm at ({x:.1}, {y:.1}, {z:.1}): {}",
            r.points, r.step_over_mm, r.reason
        )
    }));
    lines
}

/// Returns lines on the behaviour that the program leaves to the control.
fn assumptions(all: &[Assumption]) -> Vec<String> {
    let mut lines = vec![format!("  assumptions       {}", all.len())];
    lines.extend(all.iter().take(SHOWN_ASSUMPTIONS).map(|a| format!("    {a}")));
    if all.len() > SHOWN_ASSUMPTIONS {
        lines.push(format!("    and {} more, see the report", all.len() - SHOWN_ASSUMPTIONS));
    }
    lines
}

/// Returns the line on the part of the cutting time outside passes.
fn entries_and_exits(report: &Report) -> String {
    let constant = clock(report.totals.approach_time_s);
    let share = match &report.time_law {
        Some(law) => format!("{} (at constant speed {constant})", clock(law.approach_time_s)),
        None => format!("{constant} at constant speed"),
    };
    format!("  of it not passes  {share}: entries and exits")
}

/// Returns lines on the program's times: by the motion law if there is one, with those at constant
/// speeds beside them.
fn times(report: &Report) -> Vec<String> {
    let mut lines = report.times.summary_lines();
    // Behind the cuts, of which they are part.
    lines.insert(1, entries_and_exits(report));
    let Some(law) = &report.time_law else { return lines };
    let held = |h: &HeldBackReport| format!("{} {:.0} %", h.limit, 100.0 * h.share);
    let held: Vec<String> = law.held_back_by.iter().filter(|h| h.share >= TOLD_SHARE).map(held).collect();
    lines.push(format!("  limited by        {}", held.join(", ")));
    if law.stops_at_corners {
        lines.push("  stops             at every corner: motion.control_tolerance of the machine file is 0".to_owned());
    }
    let slow = |v: &&VectorTimeReport| v.added_time_s >= TOLD_SHARE * (law.passes_time_s + law.approach_time_s);
    lines.extend(law.tool_vectors.iter().filter(slow).map(|v| {
        format!(
            "  tool vectors      of {} decimals deviate by up to {:.1e} deg from the tool's direction, which costs the axes {:.1} s: \
             for more decimals set numbers.vector_decimals of the dialect file",
            v.decimals, v.turn_deg, v.added_time_s
        )
    }));
    if law.lowered_blocks > 0 {
        lines.push(format!("  lowered feeds     {} blocks, to speeds that the axes reach", law.lowered_blocks));
    }
    lines
}

/// Least share of the cutting time of a reported limit.
const TOLD_SHARE: f64 = 0.01;

/// Returns the line on the part of a pair that is cut at once, and the time saved.
fn pair(p: &PairReport) -> String {
    let worth = if p.time_ratio > 1.0 { ", so one after the other is faster: leave the pair out" } else { "" };
    format!(
        "  cut at once       {:.1} % of \"{}\" and \"{}\", in {:.2} of their time one after the other, links as laid{worth}",
        100.0 * p.paired_fraction,
        p.first,
        p.second,
        p.time_ratio
    )
}

fn or_none(v: Option<f64>, unit: &str) -> String {
    v.map_or_else(|| "none".to_owned(), |v| format!("{v:.3} {unit}"))
}

/// Returns lines on the cut stock, or the reason why none is cut.
fn stock(of: &PlannedStockReport) -> Vec<String> {
    let mut lines: Vec<String> = of.not_cut_because.iter().map(|why| format!("  stock not cut     {why}")).collect();
    lines.extend(of.cut.iter().flat_map(StockReport::summary_lines));
    // A single setup obviously begins with its own stock.
    lines.extend(of.began_as.iter().filter(|of| *of != OWN_STOCK).map(|of| format!("  stock before      {of}")));
    lines.extend(Some(&of.planned_on).filter(|of| *of != OWN_STOCK).map(|of| format!("  planned on        {of}")));
    lines
}

/// Returns the line on the saving by another order of passes.
fn order(of: &PassOrderReport) -> String {
    let bound = if of.is_exact {
        ", the least of all orders".to_owned()
    } else {
        format!(", at least {:.1} s in every order", of.lower_bound_s)
    };
    let without = if of.timed_links == 0 { " without obstacles" } else { "" };
    format!(
        "  order of passes   links of {:.1} s{without}, in place of {:.1} s as laid{bound}, operation \"{}\"",
        of.ordered_s, of.as_laid_s, of.operation
    )
}

/// Returns lines on the links between passes, or the reason why they are not shortened.
fn links(of: &LinksReport) -> Vec<String> {
    let why = of.not_shortened_because.iter();
    let mut lines: Vec<String> = why.map(|why| format!("  links             not shortened: {why}")).collect();
    lines.extend(of.shortened.iter().filter(|s| !s.links.is_empty()).map(|s| {
        let ratio =
            s.ratio_to_lower_bound.map_or_else(String::new, |r| format!(", {r:.2} times the least without obstacles"));
        format!(
            "  links             {} of {} faster than over the clearance surface: {} in place of {}{ratio}",
            s.changed,
            s.links.len(),
            clock(s.time_after_s),
            clock(s.time_before_s)
        )
    }));
    lines.extend(of.turns.iter().map(turns));
    lines
}

/// Returns the line on turns with the tool down.
fn turns(of: &TurnsReport) -> String {
    let why = of.reasons.first().map_or_else(String::new, |r| format!("; most often: {}", r.reason));
    format!(
        "  turns             {} of {} from pass to pass with the tool down, {}; {} by a link{}",
        of.turns_on_surface,
        of.turns_on_surface + of.links,
        clock(of.time_s),
        of.links,
        if of.links > 0 { why } else { String::new() }
    )
}

/// Largest number of ranges of uncertified lines in the summary; the file of the certificates has
/// them all.
const TOLD_RANGES: usize = 5;

/// Returns lines on the proofs, and the lines without one.
fn certified(c: &CertifiedReport) -> Vec<String> {
    let open = c.blocks - c.certified;
    let depth = c.largest_depth_mm.map_or_else(
        || "no depth proven for all of them".to_owned(),
        |depth| format!("cutter never deeper than {depth:.3} mm"),
    );
    let mut lines = vec![format!("  certified blocks  {} of {}, {depth}", c.certified, c.blocks)];
    if open > 0 {
        lines.push(format!("  not certified     {open} blocks: the motion of the machine there is not proven"));
    }
    lines.extend(c.uncertified.iter().take(TOLD_RANGES).map(|u| {
        let of = if u.first_line == u.last_line {
            format!("line {}", u.first_line)
        } else {
            format!("lines {} to {} ({} blocks)", u.first_line, u.last_line, u.blocks)
        };
        format!("    {of}: {}", u.reason)
    }));
    let more = c.uncertified.len().saturating_sub(TOLD_RANGES);
    if more > 0 {
        lines.push(format!("    and {more} more places, see certificates.json"));
    }
    lines
}

/// Returns the line on stretches of passes that are too short to be cut, if there are any.
fn short_stretches(n: usize) -> Option<String> {
    let stretches = if n == 1 { "stretch" } else { "stretches" };
    (n > 0).then(|| {
        format!("  left out short    {n} {stretches} shorter than min_pass_length_mm with edge_margin_mm at both ends")
    })
}

/// Returns a line on searches of an operation that are not proven as finely as the job requests.
fn wider_search(postures: &PosturesReport) -> Option<String> {
    let p = postures.search_proof.as_ref().filter(|p| p.wider_points > 0)?;
    Some(format!(
        "  search proof      at {} points only to {} of the curve, not to certified_u_width {}, operation \"{}\"",
        p.wider_points, p.largest_u_width, p.asked_u_width, postures.operation
    ))
}

/// Returns a line on the effect of chip-dependent feeds on an operation's removal rate, if
/// requested.
fn removal_rate(chips: &ChipsReport) -> Option<String> {
    let (before, after) = (chips.removal_rate_before_cm3_min?, chips.removal_rate_after_cm3_min?);
    let how = if chips.by_law { "" } else { " at constant speed" };
    let percent = |spread: SpreadReport| 100.0 * spread.variation;
    chips.by_chips.then(|| {
        format!(
            "  removal rate      at most {:.1} cm3/min instead of {:.1}, mean {:.1} instead of {:.1}, spread {:.0} % instead of \
             {:.0} %; {} {}{how}, operation \"{}\"",
            after.max,
            before.max,
            after.mean,
            before.mean,
            percent(after),
            percent(before),
            clock(chips.added_time_s.abs()),
            if chips.added_time_s < 0.0 { "shorter" } else { "longer" },
            chips.operation
        )
    })
}

/// Returns lines on reversals, changes of branch and the pole, if there are any.
fn rotary_reversals(report: &Report) -> Vec<String> {
    let mut lines = Vec::new();
    let r = &report.rewinds;
    if r.count > 0 {
        let at: Vec<String> =
            r.rewinds.iter().take(TOLD_RANGES).map(|r| format!("{} line {}", r.axis, r.line)).collect();
        let more = if r.count > at.len() { ", ..." } else { "" };
        let places = at.join(", ");
        lines.push(format!("  rewinds           {}, {} of them end a pass ({places}{more})", r.count, r.inserted));
    }
    if r.branch_changes > 0 {
        lines.push(format!("  branch changes    {}", r.branch_changes));
    }
    let blocks: usize = report.singular_blocks.iter().map(|s| s.blocks).sum();
    if let Some(nearest) =
        report.singular_blocks.iter().min_by(|a, b| a.smallest_angle_deg.total_cmp(&b.smallest_angle_deg))
    {
        lines.push(format!(
            "  near the pole     {blocks} blocks, {:.2} deg at the nearest, axis {}, from line {}",
            nearest.smallest_angle_deg, nearest.axis, nearest.first_line
        ));
    }
    lines.extend(slower_than_feed(report));
    lines.extend(report.lost_times.iter().map(LostTimeReport::summary_line));
    lines
}

/// Least time of passes over that at their feeds of which the summary warns.
const SLOW: f64 = 1.1;

/// Returns the warning that axes slow the passes, with the command that finds faster ones.
fn slower_than_feed(report: &Report) -> Option<String> {
    let factor = report.totals.time_over_feed.filter(|factor| *factor > SLOW)?;
    Some(format!(
        "  slow axes         the passes take {factor:.2} times their time at the programmed feed; faster directions and \
         mountings: facemill paths JOB --compare --mounting-angles 0,30,60 --best-out FILE"
    ))
}

#[cfg(test)]
#[path = "../../tests/unit/report/summary.rs"]
mod tests;
