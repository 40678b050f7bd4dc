use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;

use crate::finding::Measure;
use crate::finding::merge::*;

/// Cuts with a rapid in every tenth line.
fn rapids(n: u32) -> Vec<u32> {
    let line = |k: u32| if k.is_multiple_of(10) { format!("G0 X{k}.\n") } else { format!("G1 X{k}. F100.\n") };
    rapid_lines(&read_program((1..=n).map(line).collect::<String>(), Dialect::Fanuc).unwrap())
}

fn gouge(line: u32, depth: f64, at: &str) -> Finding {
    let found = Finding::of_line(FindingKind::Gouge, line, None, "", String::new());
    Finding { obstacle: Some(at.to_owned()), measure: Some(Measure::DepthMm(depth)), ..found }
}

fn lines(findings: &[Finding]) -> Vec<[u32; 4]> {
    findings.iter().map(|f| [f.first_line, f.last_line, f.worst_line, u32::try_from(f.episodes).unwrap()]).collect()
}

#[test]
fn what_is_lost_and_found_again_in_one_pass_is_one_finding() {
    let found = [(2, 0.1, "a"), (4, 0.3, "a"), (4, 0.2, "b"), (6, 0.2, "a"), (9, 0.1, "b"), (11, 0.1, "a")];
    let found = found.map(|(line, depth, at)| gouge(line, depth, at)).to_vec();
    let reported = merge_findings(found, &rapids(20));
    assert_eq!(lines(&reported), [[2, 6, 4, 3], [4, 9, 4, 2], [11, 11, 11, 1]]);
    assert_eq!(reported[0].measure, Some(Measure::DepthMm(0.3)));
    assert!(reported[0].to_string().contains("3 times"), "{}", reported[0]);
    // As they are, where nothing is to be joined.
    assert_eq!(merge_findings(reported.clone(), &rapids(20)), reported);
}

#[test]
fn a_fault_of_every_pass_is_not_reported_a_thousand_times() {
    let found: Vec<Finding> = (0..2000).map(|k| gouge(10 * k + 5, 0.1 + f64::from(k) * 1e-4, "a")).collect();
    let reported = merge_findings(found, &rapids(20_010));
    assert_eq!(reported.len(), MOST_ALIKE);
    assert_eq!(lines(&reported)[0], [5, 5, 5, 1]);
    assert_eq!(lines(&reported)[MOST_ALIKE - 1], [195, 19_995, 19_995, 1981]);
}
