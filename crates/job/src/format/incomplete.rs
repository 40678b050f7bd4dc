//! Reasons why a program without faults does less than its job requires.

use crate::format::job_report::LeftAtEnd;
use crate::format::report::Report;
use crate::format::report::cusps::CuspsKeptReport;

/// Returns the reasons why a plan is incomplete, in words; empty if it meets the job.
pub fn incomplete_because(report: &Report) -> Vec<String> {
    let left = report.remaining.iter().flat_map(|r| &r.operations).filter(|o| o.exceeded);
    let reasons = left.map(|o| o.why_exceeded()).collect();
    with_others(reasons, report, report.worst.cusp_exceeded)
}

/// Returns the reasons why a plan is incomplete after all programs of its job, in words; empty if
/// they keep what its own program does not. `left` is all that is left at the end of the job.
pub fn incomplete_at_end(report: &Report, left: &[LeftAtEnd]) -> Vec<String> {
    let of = |operation: &str| {
        left.iter().filter(move |left| left.setup == report.setup && left.operation == operation).collect::<Vec<_>>()
    };
    let exceeded = report.remaining.iter().flat_map(|r| &r.operations).filter(|o| o.exceeded);
    let is_left = |name: &str| of(name).is_empty() || of(name).iter().any(|left| left.exceeded_at_end);
    let reasons = exceeded.filter(|o| is_left(&o.operation)).map(|o| match of(&o.operation).as_slice() {
        [left] if !left.lowered_by.is_empty() => left.in_words(),
        _ => format!("{}, {}", report.setup, o.why_exceeded()),
    });
    let is_open = |cusps: &&CuspsKeptReport| cusps.points_beyond > 0 && !cusps.kept_by_text;
    let may_stay = |cusps: &CuspsKeptReport| {
        let known = of(&cusps.operation);
        // Which of two operations of one name was measured is not known.
        !matches!(known.as_slice(), [left] if left.cusps.is_some_and(|cusps| cusps.kept))
    };
    let open: Vec<&CuspsKeptReport> = report.cusps.iter().filter(is_open).collect();
    let cusps_stay = report.worst.cusp_exceeded && (open.is_empty() || open.into_iter().any(may_stay));
    let mut of_setup = with_others(Vec::new(), report, cusps_stay);
    of_setup.iter_mut().for_each(|reason| *reason = format!("{}: {reason}", report.setup));
    reasons.chain(of_setup).collect()
}

fn with_others(mut reasons: Vec<String>, report: &Report, is_cusp_exceeded: bool) -> Vec<String> {
    let (totals, worst) = (&report.totals, &report.worst);
    reasons.extend(totals.trims_too_much.then(|| {
        format!(
            "{} of {} CC points are left out, and an operation allows no more than {:.2} %",
            totals.trimmed_points,
            totals.cc_points,
            100.0 * totals.max_trimmed_fraction
        )
    }));
    reasons.extend(is_cusp_exceeded.then(|| match (totals.uncut_points, worst.cusp_mm) {
        (0, Some(cusp)) => format!("a predicted cusp of {cusp:.4} mm is more than an operation allows"),
        (uncut, _) => format!(
            "at {uncut} points a strip beside a pass is predicted to stay uncut, or a cusp is more than allowed"
        ),
    }));
    reasons.extend(worst.linearisation_exceeded.then(|| {
        format!(
            "blocks deviate from the straight path by up to {:.5} mm, more than an operation allows",
            worst.linearisation_mm
        )
    }));
    reasons
}

/// Returns the lines of a summary on a job that is not met.
pub fn not_met(reasons: impl IntoIterator<Item = String>) -> Vec<String> {
    let first = "  JOB NOT MET       exit code 1, because:".to_owned();
    std::iter::once(first).chain(reasons.into_iter().map(|why| format!("    {why}"))).collect()
}
