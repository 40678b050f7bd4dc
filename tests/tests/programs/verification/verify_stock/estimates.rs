//! The fast mode of `verify`: the same job and program, estimated.

use std::path::Path;

use facemill::formats::VerificationFile;
use facemill::nc_program::Dialect;
use facemill::virtual_machine::FindingKind;
use facemill::{CutRequest, Job, SilentStages, VerifyRequest, verify_program};

use super::{RADIUS, plate, program};

fn run(fast: bool, certificates: bool) -> Result<VerificationFile, String> {
    let job = plate();
    let cut = CutRequest::on_lines(1.0, 0.01);
    let request = VerifyRequest {
        gouge_limit: Some(0.05),
        certificates,
        fast,
        cut: Some(cut),
        ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc)
    };
    let text = program(1, 0.15).replace("M30", "G0 X-30. Y0. Z-180.\nM30");
    let job = Job::read(&job.job()).map_err(|e| e.to_string())?;
    verify_program(&job, text.as_bytes(), &request, &SilentStages).map(|v| v.file).map_err(|e| e.to_string())
}

#[test]
fn an_estimate_finds_planted_faults_and_says_what_it_is() {
    let [fast, slow] = [true, false].map(|fast| run(fast, false).unwrap());
    let estimate = fast.verification.estimate.expect("it is one");
    assert_eq!((estimate.cut_step_mm, estimate.rapid_step_mm), (2.0, RADIUS));
    assert!(fast.verification.between.is_none());
    let says = |file: &VerificationFile, what: &str| file.assumptions.iter().filter(|a| a.text.contains(what)).count();
    assert_eq!((says(&fast, "estimate"), says(&slow, "estimate")), (1, 0));
    assert_eq!((says(&fast, "--fast"), says(&fast, "the fast mode does not search")), (1, 1));
    assert_eq!((says(&slow, "both sides"), says(&slow, "not closed")), (0, 0), "the plate is closed");
    // The gouge of a block, and the cutter that goes through the plate at rapid rate.
    for file in [&fast, &slow] {
        let kinds: Vec<FindingKind> = file.verification.findings.iter().map(|f| f.kind).collect();
        assert!([FindingKind::Gouge, FindingKind::RapidCollision].iter().all(|k| kinds.contains(k)), "{kinds:?}");
    }
    assert_eq!(fast.stock.unwrap().removed_mm3, slow.stock.unwrap().removed_mm3);
}

#[test]
fn no_certificates_come_of_an_estimate() {
    let why = run(true, true).expect_err("it proves nothing");
    assert!(why.contains("certificates") && why.contains("fast"), "{why}");
}
