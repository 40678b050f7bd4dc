use facemill_virtual_machine::Assumption;

use crate::report::summary::{assumptions, short_stretches, wider_search};
use facemill_job::format::job_file::PostureModeFile;
use facemill_job::format::report::{PosturesReport, SearchProofReport};

#[test]
fn many_assumptions_are_counted_and_six_are_shown() {
    let all: Vec<Assumption> =
        (1..9).map(|line| Assumption { line: Some(line), text: format!("no word {line}") }).collect();
    let reported = assumptions(&all).join("\n");
    assert!(reported.starts_with("  assumptions       8\n    from line 1: no word 1\n"), "{reported}");
    assert!(reported.ends_with("    from line 6: no word 6\n    and 2 more, see the report"), "{reported}");
    assert_eq!(assumptions(&[]), ["  assumptions       0"]);
    assert_eq!(assumptions(&all[..6]).len(), 7);
}

#[test]
fn stretches_left_out_have_a_line_that_counts_them() {
    assert_eq!(short_stretches(0), None);
    assert!(short_stretches(1).unwrap().starts_with("  left out short    1 stretch shorter than min_pass_length_mm"));
    assert!(short_stretches(19).unwrap().contains("19 stretches"));
}

#[test]
fn only_searches_that_are_proven_less_finely_than_requested_have_a_line() {
    let line = |proof: Option<(f64, f64, usize)>| {
        let search_proof = proof.map(|(asked_u_width, largest_u_width, wider_points)| SearchProofReport {
            asked_u_width,
            largest_u_width,
            wider_points,
        });
        let (operation, mode) = ("suction".to_owned(), PostureModeFile::Smallest);
        wider_search(&PosturesReport { operation, mode: Some(mode), optimum: None, search_proof, rotary: Vec::new() })
    };
    assert_eq!(line(None), None);
    assert_eq!(line(Some((0.002, 0.002, 0))), None);
    let reported = line(Some((0.001, 0.004, 7))).unwrap();
    assert!(["7 points", "0.004", "0.001", "suction"].iter().all(|part| reported.contains(part)), "{reported}");
}
