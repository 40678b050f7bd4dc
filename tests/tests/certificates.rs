//! Certificates of a planned job, held to depths and distances by brute force over all triangles at times close together.

use facemill_tests::jobs::small_patch;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{tiny_patch, written};
use serde_json::Value;

/// What sampling may find beyond a certificate by the rounding of coordinates of metres, mm.
const ROUNDING: f64 = 1e-6;

fn lines(certificates: &Value) -> Vec<(usize, Value)> {
    let all = certificates["certificates"].as_array().expect("a list");
    all.iter().map(|c| (c["line"].as_u64().unwrap() as usize, c.clone())).collect()
}

#[test]
fn no_block_is_deeper_or_nearer_at_any_sampled_time_than_its_certificate_says() {
    let job = tiny_patch();
    let [file, out] = [job.job(), job.path("out")].map(|p| p.display().to_string());
    let output = run(&["plan", &file, "--out", &out, "--certificates"]);
    assert_eq!(code_and_errors(&output), (0, String::new()));
    let summary = String::from_utf8(output.stdout).unwrap();
    let w = written(&job, 0, "");
    let file = job.json("out/certificates.json");
    assert_eq!(file["format"], "facemill-certificates/1");
    let certificates = lines(&file);
    assert_eq!(file["blocks"].as_u64().unwrap() as usize, certificates.len());
    assert!(summary.contains("certified blocks"), "{summary}");
    let n_certified = certificates.iter().filter(|(_, c)| c["certified"] == true).count();
    assert_eq!(file["certified"].as_u64().unwrap() as usize, n_certified);
    assert!(n_certified * 100 >= certificates.len() * 99, "{n_certified} of {}", certificates.len());
    let (mut slacks, mut judged) = (Vec::new(), 0);
    // A block that stays where it is moves nothing.
    for m in w.motions.iter().filter(|m| m.from != m.to) {
        let Some((_, c)) = certificates.iter().find(|(line, _)| *line == m.line) else {
            panic!("line {} has no certificate", m.line);
        };
        let Some(depth) = c["depth_mm"].as_f64() else { continue };
        let mut deepest = 0.0_f64;
        for place in w.back.places(m, 0.25) {
            deepest = deepest.max(w.back.depth(&place));
            let room = w.back.room(&place, 0.0);
            assert!(c["certified"] == false || room >= -0.1 - ROUNDING, "line {}: {room}", m.line);
        }
        if !m.rapid {
            assert!(deepest <= depth + ROUNDING, "line {}: {deepest} mm deep, certified {depth}", m.line);
            slacks.push(depth - deepest);
            judged += 1;
        }
    }
    slacks.sort_by(f64::total_cmp);
    let median = slacks[slacks.len() / 2];
    assert!(judged > 300 && median <= 5e-3, "{judged} judged, median slack {median} mm");
    let control = w.report["budgets"][0]["control_mm"].as_f64().unwrap();
    for (line, c) in &certificates {
        if let (Some(d), Some(with)) = (c["depth_mm"].as_f64(), c["depth_with_control_mm"].as_f64()) {
            assert!((with - d - control).abs() < 1e-12, "line {line}");
        }
    }
}

#[test]
fn certificates_are_the_same_bytes_on_one_and_two_threads_and_written_only_when_asked_for() {
    let job = small_patch();
    let plan = |out: &str, more: &[&str]| {
        let base =
            ["plan".to_owned(), job.job().display().to_string(), "--out".into(), job.path(out).display().to_string()];
        let all: Vec<String> = base.into_iter().chain(more.iter().map(|s| (*s).to_owned())).collect();
        assert_eq!(run(&all).status.code(), Some(0));
    };
    plan("one", &["--certificates", "--threads", "1", "--no-verify"]);
    plan("two", &["--certificates", "--threads", "2", "--no-verify"]);
    let bytes = |out: &str| std::fs::read(job.path(out).join("certificates.json")).unwrap();
    assert!(bytes("one") == bytes("two"));
    plan("none", &["--no-verify"]);
    assert!(!job.path("none").join("certificates.json").exists());
}
