//! Runs and proofs of two heads, merged into one.

use std::collections::BTreeMap;

use facemill_virtual_machine::{
    BetweenPositions, Certificate, Certificates, ClearancePlace, EstimatedPositions, Finding, SectionGouge,
    Verification,
};

/// Merges two runs: the findings of both, each with its head, those of the same axis once; the
/// extremes of both.
pub fn merged_runs(runs: [Verification; 2], sections: Vec<SectionGouge>) -> Verification {
    let [first, second] = runs;
    let mut findings: Vec<Finding> = Vec::new();
    for (h, found) in [first.findings, second.findings].into_iter().enumerate() {
        for mut finding in found {
            // Findings of axes and text are the same in both runs; their notes name the head.
            let same = |f: &Finding| {
                let alone = f.body.is_none() && finding.body.is_none();
                alone
                    && (f.kind, f.first_line, f.last_line) == (finding.kind, finding.first_line, finding.last_line)
                    && f.axis == finding.axis
                    && without_head(&f.note) == without_head(&finding.note)
            };
            if h == 1 && findings.iter().any(same) {
                continue;
            }
            if let Some(body) = &mut finding.body {
                *body = format!("head {}: {body}", h + 1);
            }
            findings.push(finding);
        }
    }
    findings.sort_by_key(|f| (f.first_line, f.kind));
    let deeper = |g: &facemill_virtual_machine::GougePlace| g.depth_mm;
    let largest_gouge =
        first.largest_gouge.into_iter().chain(second.largest_gouge).max_by(|a, b| deeper(a).total_cmp(&deeper(b)));
    let nearer = |c: &ClearancePlace| c.distance_mm;
    let of_head = |h: usize, c: ClearancePlace| ClearancePlace { body: format!("head {h}: {}", c.body), ..c };
    let smallest_clearance = first
        .smallest_clearance
        .map(|c| of_head(1, c))
        .into_iter()
        .chain(second.smallest_clearance.map(|c| of_head(2, c)))
        .min_by(|a, b| nearer(a).total_cmp(&nearer(b)));
    Verification {
        findings,
        largest_gouge,
        sections,
        smallest_clearance,
        between: first.between.zip(second.between).map(between_of_both),
        estimate: first.estimate.zip(second.estimate).map(estimate_of_both),
        n_positions: first.n_positions + second.n_positions,
        cutting_length_mm: first.cutting_length_mm + second.cutting_length_mm,
        ..Verification {
            findings: Vec::new(),
            largest_gouge: None,
            sections: Vec::new(),
            smallest_clearance: None,
            ..first
        }
    }
}

/// Merges the bounds between positions of both heads.
pub fn between_of_both((a, b): (BetweenPositions, BetweenPositions)) -> BetweenPositions {
    BetweenPositions {
        cutter_mm: a.cutter_mm.max(b.cutter_mm),
        bodies_mm: a.bodies_mm.max(b.bodies_mm),
        open_blocks: a.open_blocks.max(b.open_blocks),
        first_open_line: [a, b].into_iter().filter_map(|b| b.first_open_line).min(),
    }
}

/// Returns the largest distance between positions in the estimates of both heads.
pub fn estimate_of_both((a, b): (EstimatedPositions, EstimatedPositions)) -> EstimatedPositions {
    EstimatedPositions {
        cut_step_mm: a.cut_step_mm.max(b.cut_step_mm),
        rapid_step_mm: a.rapid_step_mm.max(b.rapid_step_mm),
    }
}

/// Returns a finding's note without the head at its beginning.
pub fn without_head(note: &str) -> &str {
    let rest = note.strip_prefix("head 1").or_else(|| note.strip_prefix("head 2"));
    rest.map_or(note, |rest| rest.trim_start_matches(':').trim_start())
}

/// Merges the certificates of both heads into one for each block: proven only if proven for both.
pub fn proven_for_both([first, second]: &[Certificates; 2]) -> Certificates {
    let mut by_line: BTreeMap<u32, [Option<&Certificate>; 2]> = BTreeMap::new();
    for (h, certificates) in [first, second].into_iter().enumerate() {
        for c in &certificates.certificates {
            by_line.entry(c.line).or_default()[h] = Some(c);
        }
    }
    let both = by_line.into_values().filter_map(|both| match both {
        [Some(a), Some(b)] => Some(proven_block(a, b)),
        // A line that only one run doubts is proven for none.
        [Some(only), None] | [None, Some(only)] => Some(Certificate { certified: false, ..only.clone() }),
        [None, None] => None,
    });
    Certificates::new(both.collect())
}

/// Merges the certificates of a block of both heads.
pub fn proven_block(a: &Certificate, b: &Certificate) -> Certificate {
    let larger = |x: Option<f64>, y: Option<f64>| Some(f64::max(x?, y?));
    let between = |c: &Certificate, h: usize| {
        c.clearance_between.clone().map(|[body, obstacle]| [format!("head {h}: {body}"), obstacle])
    };
    let (clearance_mm, clearance_between) = match (a.clearance_mm, b.clearance_mm) {
        (Some(x), Some(y)) if y < x => (Some(y), between(b, 2)),
        (Some(x), _) => (Some(x), between(a, 1)),
        (None, y) => (y, between(b, 2)),
    };
    let reason = |c: &Certificate, h: usize| c.reason.as_ref().map(|r| format!("head {h}: {r}"));
    Certificate {
        line: a.line,
        block_number: a.block_number,
        depth_mm: larger(a.depth_mm, b.depth_mm),
        depth_with_control_mm: larger(a.depth_with_control_mm, b.depth_with_control_mm),
        clearance_mm,
        clearance_between,
        certified: a.certified && b.certified,
        reason: reason(a, 1).or_else(|| reason(b, 2)),
        uncertified_between: a.uncertified_between.clone().or_else(|| b.uncertified_between.clone()),
        doubted_since_line: a.doubted_since_line.or(b.doubted_since_line),
        intervals: a.intervals.saturating_add(b.intervals),
    }
}
