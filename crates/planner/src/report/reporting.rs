//! Report of a planned setup.

use std::collections::BTreeMap;

use facemill_cutter_location::cusp::Ridge;
use facemill_cutter_location::{Remedy, Widened};
use facemill_job::format::made_from::MadeFrom;
use facemill_job::format::program_times::{NoLawReason, ProgramTimes};
use facemill_job::format::report::links::LinksReport;
use facemill_job::format::report::stock::{PlannedStockReport, not_requested};
use facemill_job::format::report::{
    BudgetReport, CertifiedReport, ChipsReport, HelpReport, InfeasibleReport, OptimumReport, PassReport,
    PosturesReport, REPORT_FORMAT, Report, SearchProofReport, Totals, Worst,
};
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::budget;
use facemill_tool_model::Cusp;
use facemill_tool_path::moves::order::PassOrderReport;
use facemill_tool_path::moves::{MoveKind, PieceMoves};
use facemill_tool_path::segments::{Cut, LeftOut, PassSegment};
use facemill_virtual_machine::{Certificates, Verification};
use nalgebra::Point3;

use crate::passes::engagement::PointEngagement;
use crate::passes::operation::PlannedOperation;
use crate::program::timed::Timed;
use crate::report::chip_points::{chip_points, chips_report};
use crate::report::cl_paths::cl_path;
use crate::report::cusps_kept::cusps_kept;
use crate::report::rotary_motion::rotary_report;
use crate::report::rotary_reversals::RotaryReversals;

/// Returns sums, extremes and details of planned operations and of the run of their program; `jobs`
/// are the job as each operation's head sees it.
pub(crate) fn report(
    jobs: &[&Job],
    setup: &Setup<'_>,
    operations: &[PlannedOperation<'_>],
    timed: &Timed,
    rotary_reversals: RotaryReversals,
    verification: Option<Verification>,
    certificates: Option<&Certificates>,
) -> Report {
    let (mut totals, mut worst) = (Totals::default(), Worst::default());
    let mut passes = Vec::new();
    let mut tip_feeds = timed.tip_feeds.iter().copied();
    for o in operations {
        totals.cc_points += o.cc_points;
        totals.dropped_pieces += o.dropped_pieces;
        worst.corner_rest_mm = worst.corner_rest_mm.into_iter().chain(o.corner_rest).reduce(f64::max);
        totals.trims_too_much |= o.trims_too_much();
        worst.linearisation_mm = worst.linearisation_mm.max(o.moves.linearisation);
        worst.linearisation_exceeded |= o.moves.linearisation > o.operation.tolerances.linearisation_mm;
        for (k, piece) in o.moves.pieces.iter().enumerate() {
            let along: Vec<PointEngagement> =
                o.along.get(k).into_iter().flatten().filter(|a| a.is_point).copied().collect();
            let feeds = feeds_at_cuts(piece, &mut tip_feeds);
            let pass = pass_report(&o.operation.name, &piece.piece, &along, &feeds);
            worst.lift_mm = worst.lift_mm.max(pass.lift_mm);
            worst.cusp_mm = larger(worst.cusp_mm, pass.cusp_mm);
            let allowed = o.operation.tolerances.cusp_mm;
            worst.cusp_exceeded |= pass.uncut_points > 0 || pass.cusp_mm.is_some_and(|h| h > allowed);
            worst.step_over_mm = larger(worst.step_over_mm, pass.step_over_mm);
            let area = pass.chip_area_mm2.map(|[_, max]| max);
            worst.chip_area_mm2 = larger(worst.chip_area_mm2, area);
            worst.removal_rate_mm3_min = larger(worst.removal_rate_mm3_min, removal_rate(&along, &feeds));
            totals.passes += 1;
            totals.uncut_points += pass.uncut_points;
            totals.planned_points += pass.points;
            passes.push(pass);
        }
    }
    totals.trimmed_points = totals.cc_points.saturating_sub(totals.planned_points);
    totals.max_trimmed_fraction = operations.iter().map(PlannedOperation::max_trimmed_fraction).fold(1.0, f64::min);
    totals.planned_fraction =
        if totals.cc_points > 0 { totals.planned_points as f64 / totals.cc_points as f64 } else { 0.0 };
    let run = verification.as_ref();
    totals.blocks = run.map_or(timed.n_blocks, |v| v.n_blocks);
    totals.cutting_length_mm = run.map_or(timed.passes_length + timed.approach_length, |v| v.cutting_length_mm);
    totals.passes_length_mm = timed.passes_length;
    totals.passes_time_s = timed.passes_time;
    totals.passes_feed_time_s = timed.passes_feed_time;
    let passes_time = timed.time_law.as_ref().map_or(timed.passes_time, |law| law.passes_time_s);
    totals.time_over_feed = (timed.passes_feed_time > 0.0).then(|| passes_time / timed.passes_feed_time);
    totals.approach_time_s = timed.approach_time;
    totals.rapid_time_s = timed.rapid_time;
    if let Some(v) = &verification {
        worst.gouge_mm = v.largest_gouge.as_ref().map(|g| g.depth_mm);
        worst.gouge_line = v.largest_gouge.as_ref().map(|g| g.line);
        if let Some(c) = &v.smallest_clearance {
            worst.clearance_mm = Some(c.distance_mm);
            worst.clearance_between = Some(format!("{} to {}", c.body, c.obstacle));
            worst.clearance_line = Some(c.line);
        }
    }
    let times = program_times(timed, verification.as_ref());
    let gouges = verification.iter().flat_map(|v| &v.sections).map(|s| s.largest_gouge.as_ref().map(|g| g.depth_mm));
    let budgets = operations
        .iter()
        .zip(jobs)
        .zip(gouges.chain(std::iter::repeat(None)))
        .map(|((o, job), gouge)| BudgetReport::new(&o.operation.name, &budget(job, o.operation), gouge))
        .collect();
    Report {
        format: REPORT_FORMAT,
        job: jobs.first().map_or_else(String::new, |job| job.file.name.clone()),
        setup: setup.file.name.clone(),
        // The files at the beginning of planning.
        made_from: MadeFrom::default(),
        settings: jobs.first().map_or_else(Vec::new, |job| job.settings.clone()),
        programs: Vec::new(),
        verified: verification.is_some(),
        stock: PlannedStockReport::not_requested(verification.is_some()),
        links: LinksReport::not_shortened(not_requested(verification.is_some())),
        orders: operations.iter().filter_map(order_report).collect(),
        certified: certificates.map(CertifiedReport::new),
        totals,
        times,
        operations: Vec::new(),
        time_law: timed.time_law.clone(),
        no_time_law: timed.no_time_law.clone(),
        worst,
        remaining: None,
        efficiency: Vec::new(),
        left_above: Vec::new(),
        cl_paths: operations.iter().filter_map(cl_path).collect(),
        postures: operations.iter().zip(jobs).map(|(o, job)| postures_report(job, o)).collect(),
        cusps: operations.iter().map(cusps_kept).collect(),
        chips: chip_reports(jobs, operations, timed),
        pairs: Vec::new(),
        wind_up: verification.as_ref().map(|v| v.wind_up.clone()).unwrap_or_default(),
        rewinds: rotary_reversals.rewinds,
        singular_blocks: rotary_reversals.singular_blocks,
        lost_times: rotary_reversals.lost_times,
        budgets,
        findings: verification.map(|v| v.findings).unwrap_or_default(),
        assumptions: Vec::new(),
        infeasible: infeasible_report(operations),
        meshes: setup.reports.clone(),
        passes,
    }
}

/// Returns the times of the text: at constant speed of its run, or without a run, of the blocks
/// that it was written from.
fn program_times(timed: &Timed, run: Option<&Verification>) -> ProgramTimes {
    let planned = [timed.passes_time + timed.approach_time, timed.rapid_time];
    let constant = run.map_or(planned, |v| [v.cutting_time_s, v.rapid_time_s]);
    match &timed.time_law {
        Some(law) => ProgramTimes::by_law(constant, [law.passes_time_s + law.approach_time_s, law.rapid_time_s]),
        None => ProgramTimes::constant(constant, timed.no_time_law.iter().cloned().map(NoLawReason::Text).collect()),
    }
}

fn order_report(o: &PlannedOperation<'_>) -> Option<PassOrderReport> {
    let order = o.moves.order.clone()?;
    Some(PassOrderReport { operation: o.operation.name.clone(), ..order })
}

fn chip_reports(jobs: &[&Job], operations: &[PlannedOperation<'_>], timed: &Timed) -> Vec<ChipsReport> {
    let points = chip_points(operations, timed, &[]);
    let of = operations.iter().zip(jobs).zip(&points);
    of.map(|((o, job), points)| chips_report(o.operation, job.tool.n_inserts(), points, timed.chips_by_law)).collect()
}

fn postures_report(job: &Job, o: &PlannedOperation<'_>) -> PosturesReport {
    let optimum = o.optimum.map(|found| OptimumReport {
        graph_s: found.graph,
        planned_s: found.smoothed,
        gap: found.gap(),
        jumps: found.jumps,
    });
    let passes: Vec<&[Cut]> = o.moves.pieces.iter().map(|p| p.piece.cuts.as_slice()).collect();
    let rotary = rotary_report(&job.machine, &passes, o.operation.feeds.cutting_mm_min / 60.0);
    let search_proof = o.operation.search.certified_u_width.map(|requested| search_proof(requested, o.widened));
    let operation = o.operation.name.clone();
    let mode = (!o.operation.keeps_axes()).then(|| o.operation.search.mode.clone());
    PosturesReport { operation, mode, optimum, search_proof, rotary }
}

/// Returns the width that a job requests, and the width achieved.
fn search_proof(requested: f64, widened: Option<Widened>) -> SearchProofReport {
    SearchProofReport {
        asked_u_width: requested,
        largest_u_width: widened.map_or(requested, |w| w.largest),
        wider_points: widened.map_or(0, |w| w.points),
    }
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

/// Returns the speed of the tool tip where it arrives at each cut of a piece, mm/min; `None` at the
/// first, which the entry reaches.
///
/// `tip_feeds` are those of all remaining cutting moves, in program order; consumes those of this
/// piece.
fn feeds_at_cuts(piece: &PieceMoves, tip_feeds: &mut impl Iterator<Item = f64>) -> Vec<Option<f64>> {
    let cuts: Vec<&Cut> = piece.piece.cuts.iter().filter(|c| !c.inserted).collect();
    let mut feeds = vec![None; cuts.len()];
    let mut next = 1;
    for m in piece.moves.iter().filter(|m| m.kind == MoveKind::Cut) {
        let feed = tip_feeds.next();
        if next < cuts.len() {
            // Poses inserted before a cut belong to it: the slowest of them counts.
            feeds[next] = smaller(feeds[next], feed);
            next += usize::from(m.cl == cuts[next].pose.cl);
        }
    }
    feeds
}

/// Returns the largest product of chip section and speed of the tip along a piece, mm³/min.
fn removal_rate(along: &[PointEngagement], feeds: &[Option<f64>]) -> Option<f64> {
    let rates = along.iter().zip(feeds).filter_map(|(a, f)| Some(a.chip.area * (*f)?));
    rates.fold(None, |worst, rate| larger(worst, Some(rate)))
}

fn smaller(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

fn pass_report(operation: &str, piece: &PassSegment, all: &[PointEngagement], feeds: &[Option<f64>]) -> PassReport {
    let range = |f: &dyn Fn(&Cut) -> f64| {
        piece.cuts.iter().map(f).fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
    };
    let ridge_max = |f: &dyn Fn(&Ridge) -> Option<f64>| {
        all.iter().filter_map(|a| a.ridge.as_ref()).filter_map(f).fold(None, |m, v| larger(m, Some(v)))
    };
    let height = |ridge: &Ridge| match ridge.cusp {
        Cusp::Height(h) => Some(h),
        Cusp::Uncut => None,
    };
    let areas: Vec<f64> = all.iter().map(|a| a.chip.area).collect();
    let slowest = feeds.iter().copied().fold(None, smaller);
    let fastest = feeds.iter().copied().fold(None, larger);
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    PassReport {
        operation: operation.to_owned(),
        copy: piece.copy,
        pass: piece.pass,
        points: piece.points(),
        length_mm: piece.cuts.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum(),
        tilt_deg: range(&|c| c.pose.posture.tilt.to_degrees()),
        // Adding 0 turns -0 into 0.
        rotate_deg: range(&|c| c.pose.posture.rotate.to_degrees() + 0.0),
        lift_mm: range(&|c| c.pose.lift)[1],
        cusp_mm: ridge_max(&height),
        uncut_points: all.iter().filter(|a| a.ridge.is_some_and(|r| r.cusp == Cusp::Uncut)).count(),
        step_over_mm: ridge_max(&|r| Some(r.step_over)),
        chip_area_mm2: (!areas.is_empty()).then(|| [mean, areas.iter().copied().fold(0.0, f64::max)]),
        tip_feed_mm_min: slowest.zip(fastest).map(<[f64; 2]>::from),
    }
}

fn help(relief: &Remedy) -> HelpReport {
    let (field, value) = match *relief {
        Remedy::Tilt(tilt) => ("search.tilt_deg[1]", tilt.to_degrees()),
        Remedy::Rotate(rotate) => ("search.rotate_deg[1]", rotate.to_degrees().abs()),
        Remedy::Radius(radius) => ("radius_mm", radius),
        Remedy::StickOut(length) => ("stick_out_mm", length),
        Remedy::CertifiedWidth(width) => ("search.certified_u_width", width),
    };
    HelpReport { field, value }
}

/// Returns the reasons by number of points, the most frequent first; equal ones in alphabetical
/// order.
fn infeasible_report(operations: &[PlannedOperation<'_>]) -> Vec<InfeasibleReport> {
    let mut reasons: BTreeMap<&str, (usize, Point3<f64>)> = BTreeMap::new();
    let all: Vec<&LeftOut> = operations.iter().flat_map(|o| &o.left_out).collect();
    for l in all {
        reasons.entry(&l.reason).or_insert((0, l.place)).0 += 1;
    }
    let mut all: Vec<InfeasibleReport> = reasons
        .into_iter()
        .map(|(reason, (points, p))| InfeasibleReport {
            reason: reason.to_owned(),
            points,
            first_place_mm: [p.x, p.y, p.z],
            would_help: operations.iter().find_map(|o| o.reliefs.get(reason)).into_iter().flatten().map(help).collect(),
        })
        .collect();
    all.sort_by_key(|r| std::cmp::Reverse(r.points));
    all
}

#[cfg(test)]
#[path = "../../tests/unit/report/reporting.rs"]
mod tests;
