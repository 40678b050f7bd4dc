//! Reasons why a program without faults does less than its job requires.

use crate::format::report::Report;

/// Returns the reasons why a plan is incomplete, in words; empty if it meets the job.
pub fn incomplete_because(report: &Report) -> Vec<String> {
    let (totals, worst) = (&report.totals, &report.worst);
    let left = report.remaining.iter().flat_map(|r| &r.operations).filter(|o| o.exceeded);
    let mut reasons: Vec<String> = left.map(|o| o.why_exceeded()).collect();
    reasons.extend(totals.trims_too_much.then(|| {
        format!(
            "{} of {} CC points are left out, and an operation allows no more than {:.2} %",
            totals.trimmed_points,
            totals.cc_points,
            100.0 * totals.max_trimmed_fraction
        )
    }));
    reasons.extend(worst.cusp_exceeded.then(|| match (totals.uncut_points, worst.cusp_mm) {
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
