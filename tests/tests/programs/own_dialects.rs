//! The dialect files and templates of `assets/dialects`: plans on controls of a shop's own.

use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis, apt_feeds};
use facemill_tests::shared::workspace;
use facemill_tests::variants::{plan, variant};
use nalgebra::{Point3, Unit, Vector3};
use serde_json::{Value, json};

use crate::feed_modes::{axis_speeds, needed_seconds};

fn asset(name: &str) -> Vec<u8> {
    std::fs::read(workspace().join("assets/dialects").join(name)).expect("a file of assets/dialects")
}

/// The tiny patch with a dialect file of `assets/dialects`, and a template of the same name.
fn job_of(name: &str, dialect: &str, mode: &str, more: &[(&str, Value)]) -> JobFolder {
    let mut post = vec![
        ("/post/dialect", json!(dialect)),
        ("/post/dialect_file", json!(format!("{name}.json"))),
        ("/post/feed_mode", json!(mode)),
        facemill_tests::jobs::unfinished(),
    ];
    post.extend(more.iter().cloned());
    let job = variant(&post);
    job.write(&format!("{name}.json"), &asset(&format!("{name}.json")));
    job
}

fn with_template(name: &str) -> (&'static str, Value) {
    ("/post/template", json!(format!("{name}.j2")))
}

/// Text and report of a plan without findings.
fn planned(job: &JobFolder, extension: &str) -> (String, Value) {
    plan(job);
    let text =
        |name: &str| std::fs::read_to_string(job.path("out").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let report: Value = serde_json::from_str(&text("report.json")).unwrap();
    assert_eq!((&report["verified"], &report["findings"]), (&json!(true), &json!([])));
    (text(&format!("program.{extension}")), report)
}

/// Tips and axes of the APT file, and whether each is a rapid.
fn goto(apt: &str) -> Vec<(TipAndAxis, bool)> {
    let (mut points, mut rapid) = (Vec::new(), false);
    // A statement goes on behind `$`.
    for line in apt.replace("$\n", "").lines() {
        rapid |= line == "RAPID";
        let Some(rest) = line.strip_prefix("GOTO/") else { continue };
        let n: Vec<f64> = rest.split(',').map(|v| v.trim().parse().expect("a number")).collect();
        let axis = if n.len() == 6 { Vector3::new(n[3], n[4], n[5]) } else { Vector3::z() };
        points.push(((Point3::new(n[0], n[1], n[2]), Unit::new_normalize(axis)), rapid));
        rapid = false;
    }
    points
}

/// Asserts that the words of a program lead to the poses of the plan, by the interpreter and the
/// kinematics of the tests.
fn assert_poses(job: &JobFolder, text: &str) {
    let points = goto(&std::fs::read_to_string(job.path("out/program.apt")).unwrap());
    let (motions, back) = (interpreter::run(text), ReadBack::of(job, 0));
    assert!(points.len() > 100);
    // Moves to the first position come before, where G43 has a line of its own: axis by axis.
    let before = motions.len() - points.len();
    assert!(before <= 3, "{} motions, {} points", motions.len(), points.len());
    for (motion, ((tip, axis), rapid)) in motions[before..].iter().zip(&points) {
        let (at, along) = back.end(motion);
        // Words of 0.001 mm and 0.001 deg on a lever of half a metre.
        assert!((at - tip).norm() < 0.01, "line {}: {at} for {tip}", motion.line);
        assert!((along.into_inner() - axis.into_inner()).norm() < 3e-5, "line {}", motion.line);
        assert_eq!(motion.rapid, *rapid, "line {}", motion.line);
    }
}

#[test]
fn a_plan_for_grblhal_has_the_poses_of_the_plan_and_no_word_that_it_lacks() {
    let job = job_of("grblhal", "linuxcnc", "g93", &[with_template("grblhal")]);
    job.write("grblhal.j2", &asset("grblhal.j2"));
    let (text, report) = planned(&job, "nc");
    assert_poses(&job, &text);
    let bare: String = text.lines().filter(|line| !line.starts_with('(')).collect::<Vec<_>>().join("\n");
    for word in ["G64", "M428", "M429", "#", "IF", "%"] {
        assert!(!bare.contains(word), "{word}");
    }
    assert!(text.contains(" G61\n") && text.ends_with("M2\n"), "{text}");
    assert!(report["assumptions"].to_string().contains("limiting acceleration and looking 35 blocks ahead"));
}

#[test]
fn a_plan_for_a_control_like_marlin_has_one_command_a_line_and_the_poses_of_the_plan() {
    let quick = ("/feeds_within", json!("velocity"));
    let more = [with_template("marlin"), ("/post/max_line_length", json!(90)), quick];
    let job = job_of("marlin", "fanuc", "g94", &more);
    let mut file = job.json("job.json");
    file["post"]["block_numbers"] = Value::Null;
    job.write("job.json", file.to_string().as_bytes());
    job.write("marlin.j2", &asset("marlin.j2"));
    let (text, _) = planned(&job, "gcode");
    assert_poses(&job, &text);
    for line in text.lines().filter(|line| !line.starts_with('(')) {
        let commands = line.split(' ').filter(|word| word.starts_with(['G', 'M', 'T'])).count();
        assert!(commands == 1 && line.len() <= 90, "{line}");
        assert!(!["N", "G93", "G94", "G40", "%", "O"].iter().any(|word| line.starts_with(word)), "{line}");
    }
    assert!(text.contains("\nG28 Z0.\nG49\n"), "{text}");
    // The operator changes the tool: M0 stops right behind T.
    let lines: Vec<&str> = text.lines().collect();
    let changes: Vec<&[&str]> = lines.windows(3).filter(|lines| lines[0].starts_with('T')).collect();
    assert!(changes.len() == 1 && changes[0][1..] == ["M0", "M6"], "{changes:?}");
    assert_norm_feeds(&job, &text);
}

/// Asserts that F of each cut is the way over all axes, 1 deg as 1 mm, by the time that the plan's
/// tip feed and the largest speeds of the axes leave it.
fn assert_norm_feeds(job: &JobFolder, text: &str) {
    let feeds = apt_feeds(&std::fs::read_to_string(job.path("out/program.apt")).unwrap());
    let (motions, back, speeds) = (interpreter::run(text), ReadBack::of(job, 0), axis_speeds(job));
    let mut cuts = 0;
    for (m, feed) in motions[motions.len() - feeds.len()..].iter().zip(&feeds) {
        let Some(tip_feed) = *feed else { continue };
        let norm = [m.to.x - m.from.x, m.to.y - m.from.y, m.to.z - m.from.z, m.to.b - m.from.b, m.to.c - m.from.c]
            .into_iter()
            .fold(0.0, f64::hypot);
        let f = m.feed.unwrap_or_else(|| panic!("line {}: no F", m.line));
        let needed = needed_seconds(&back, m, tip_feed, &speeds);
        // Words are rounded, F has two decimals.
        let slack = 2e-3 + 60.0 * 2e-3 / tip_feed / needed;
        assert!((f * needed / 60.0 / norm - 1.0).abs() < slack, "line {}: F{f} for {norm} in {needed} s", m.line);
        cuts += 1;
    }
    assert!(cuts > 100, "{cuts} cuts");
}

/// Another planner of a control is other values of its dialect file, and other times.
#[test]
fn motion_in_a_dialect_file_is_data_of_times() {
    let time = |report: &Value| report["times"]["cutting_s"].as_f64().expect("a time");
    let built_in = variant(&[
        ("/post/dialect", json!("linuxcnc")),
        ("/post/feed_mode", json!("g93")),
        facemill_tests::jobs::unfinished(),
    ]);
    let (_, by_trapezoid) = planned(&built_in, "ngc");
    let (_, by_s_curve) = planned(&job_of("linuxcnc-2.10", "linuxcnc", "g93", &[]), "ngc");
    assert!((time(&by_trapezoid) - time(&by_s_curve)).abs() > 1e-3, "{} s", time(&by_trapezoid));
    assert!(by_s_curve["assumptions"].to_string().contains("limiting jerk and looking 50 blocks ahead"));
    let deviation = |um: u32| {
        let job = job_of("grblhal", "linuxcnc", "g93", &[with_template("grblhal")]);
        let mut file: Value = serde_json::from_slice(&asset("grblhal.json")).unwrap();
        facemill_tests::jobs::set(&mut file, "/control_motion/junction_deviation_um", json!(um));
        job.write("grblhal.json", file.to_string().as_bytes());
        job.write("grblhal.j2", &asset("grblhal.j2"));
        planned(&job, "nc")
    };
    let ((_, by_one), (_, by_many)) = (deviation(1), deviation(1000));
    assert!(time(&by_one) > time(&by_many) + 1e-3, "{} and {} s", time(&by_one), time(&by_many));
}
