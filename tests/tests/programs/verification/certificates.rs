//! Certificates of a planned job, held to depths and distances by brute force over all triangles at
//! times close together.

mod certificates_laws;

use facemill_tests::jobs::JobFolder;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::workspace;
use facemill_tests::variants::{tiny_patch, written};
use serde_json::{Value, json};

/// Largest excess of sampling over a certificate by the rounding of coordinates of metres, mm.
const ROUNDING: f64 = 1e-6;

fn lines(certificates: &Value) -> Vec<(usize, Value)> {
    let all = certificates["certificates"].as_array().expect("a list");
    all.iter().map(|c| (c["line"].as_u64().unwrap() as usize, c.clone())).collect()
}

/// Path tolerance and orientation tolerance at the upper rim, mm.
fn control_at_the_farthest_point(job: &JobFolder) -> f64 {
    let (machine, tool) = (job.json("machine.json"), job.json("tool.json"));
    let of = |v: &Value| v.as_f64().expect("a number");
    let tolerance = &machine["motion"]["control_tolerance"];
    let farthest = of(&tool["radius_mm"]).hypot(of(&tool["flute_length_mm"]));
    let charge = of(&tolerance["path_mm"]) + of(&tolerance["orientation_deg"]).to_radians() * farthest;
    assert!(charge > 0.0, "the job's control has a tolerance");
    charge
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
    let control = control_at_the_farthest_point(&job);
    let (mut slacks, mut judged) = (Vec::new(), 0);
    // A block that stays where it is moves nothing.
    for m in w.motions.iter().filter(|m| m.from != m.to) {
        let Some((_, c)) = certificates.iter().find(|(line, _)| *line == m.line) else {
            panic!("line {} has no certificate", m.line);
        };
        let Some(depth) = c["depth_mm"].as_f64() else { continue };
        // In rapid the control's tolerance is part of the proof.
        let more = c["depth_with_control_mm"].as_f64().unwrap() - depth - if m.rapid { 0.0 } else { control };
        assert!(more.abs() < 1e-12, "line {}: {c}", m.line);
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
}

#[test]
fn certificates_are_the_same_bytes_on_one_and_two_threads_and_written_only_when_requested() {
    let job = tiny_patch();
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set("job.json", &[(&format!("{planes}/from_mm"), json!(-1.5)), (&format!("{planes}/to_mm"), json!(1.5))]);
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

#[test]
fn a_motion_that_a_template_adds_behind_the_body_is_reported_and_not_certified() {
    let job = tiny_patch();
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set("job.json", &[(&format!("{planes}/from_mm"), json!(-0.1)), (&format!("{planes}/to_mm"), json!(0.1))]);
    let template = std::fs::read_to_string(workspace().join("crates/nc-program/templates/fanuc.j2")).unwrap();
    let mutant = template.replacen("{{ body }}\n", "{{ body }}\nG65 P9000\nG1 X0. Y0. Z-300. F500.\n", 1);
    assert_ne!(template, mutant);
    std::fs::write(job.path("shop.j2"), mutant).unwrap();
    job.set("job.json", &[("/post/template", json!("shop.j2"))]);
    let [file, out] = [job.job(), job.path("out")].map(|p| p.display().to_string());
    let output = run(&["plan", &file, "--out", &out, "--certificates", "--no-verify"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let nc = std::fs::read_to_string(job.path("out/program.nc")).unwrap();
    let call = 1 + nc.lines().position(|l| l.contains("G65 P9000")).unwrap();
    let all = job.json("out/certificates.json");
    assert!(all["largest_depth_mm"].is_null() && all["certified"].as_u64() < all["blocks"].as_u64(), "{all}");
    for (line, c) in lines(&all) {
        assert_eq!(c["certified"] == true, line < call, "{c}");
    }
    let found = lines(&all).into_iter().find(|(line, _)| *line == call + 1).expect("the motion behind the call");
    assert!(found.1["reason"].as_str().is_some_and(|r| !r.is_empty()), "{found:?}");
    let report = job.json("out/report.json");
    let reported = &report["certified"]["uncertified"][0];
    assert_eq!(reported["first_line"].as_u64(), Some(call as u64), "{reported}");
    let summary = String::from_utf8(output.stdout).unwrap();
    assert!(summary.contains("not certified") && summary.contains(&format!("line {call}: ")), "{summary}");
}
