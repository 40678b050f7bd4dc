//! A job on a machine with two linear and three rotary axes: planned, written, run and certified;
//! and the program compared with the part by matrices made from the rows of the machine file.

use facemill::cl_file::read_apt;
use facemill::new_job::NewJob;
use facemill::{Job, PlanSettings, SilentStages, plan_setup};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::craig::{Words, end_of};
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis, number};
use facemill_tests::shared::workspace;
use nalgebra::{Point3, Unit, Vector3};
use serde_json::{Value, json};

/// Passes over the middle of a wavy patch, along y, which the machine has no axis for.
fn job() -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 80.0 });
    let machine = std::fs::read(workspace().join("assets/machines/head-b-a-table-c-two-linear.json")).unwrap();
    job.write("machine.json", &machine);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set(
        "job.json",
        &[
            ("/setups/0/table_from_work/translation_mm", json!([300.0, 0.0, 220.0])),
            (&format!("{planes}/normal"), json!([1.0, 0.0, 0.0])),
            (&format!("{planes}/from_mm"), json!(-2.0)),
            (&format!("{planes}/to_mm"), json!(2.0)),
            ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ],
    );
    job
}

/// Tip and axis of the tool in the workpiece frame. With the length compensated Z is higher than
/// its word by that.
fn place(machine: &Value, back: &ReadBack, gauge: f64, words: &Words) -> TipAndAxis {
    let words: &Words = &words.iter().map(|(k, v)| (k.clone(), if k == "Z" { v + gauge } else { *v })).collect();
    let table = end_of(&machine["workpiece_chain"]["rows"], words);
    let nose = end_of(&machine["tool_chains"][0]["rows"], words);
    let work_from_tool = back.table_from_work.inverse().to_homogeneous() * table.try_inverse().expect("a frame") * nose;
    let tip = work_from_tool.transform_point(&Point3::new(0.0, 0.0, -gauge));
    (tip, Unit::new_normalize(work_from_tool.transform_vector(&Vector3::z())))
}

/// The positions of a program from where the length is compensated on.
fn positions(nc: &str) -> Vec<Words> {
    let (mut words, mut all, mut is_compensated) = (Words::new(), Vec::new(), false);
    for line in nc.lines().filter(|line| line.starts_with('N')) {
        let codes = || line.split_whitespace();
        is_compensated |= codes().any(|w| w == "G43");
        if codes().any(|w| w == "G49") && is_compensated {
            break;
        }
        let mut moves = false;
        for word in codes().filter(|w| w.starts_with(['X', 'Z', 'A', 'B', 'C']) && !line.contains("G28")) {
            let value = word[1..].parse().unwrap_or_else(|_| panic!("{line}"));
            words.insert(word[..1].to_owned(), value);
            moves = true;
        }
        if moves && is_compensated {
            all.push(words.clone());
        }
    }
    all
}

#[test]
fn a_job_on_a_machine_with_three_rotaries_is_planned_run_and_certified() {
    let job = job();
    let settings = PlanSettings { verify: true, certificates: true };
    let planned = plan_setup(&Job::read(&job.job()).unwrap(), 0, settings, &SilentStages).unwrap();
    let report = &planned.report;
    assert!(planned.is_clean(), "{:?} {:?}", report.findings, report.infeasible);
    assert!(report.totals.passes >= 3 && report.totals.trimmed_points == 0, "{:?}", report.totals);
    let certificates: Value = serde_json::from_str(&text_of(&planned, "certificates.json")).unwrap();
    assert!(certificates["blocks"].as_u64().unwrap() > 100);
    assert_eq!(certificates["certified"], certificates["blocks"]);

    let back = ReadBack::of(&job, 0);
    let machine = job.json("machine.json");
    let gauge = number(&job.json("tool.json")["gauge_length_mm"]);
    let apt = read_apt(text_of(&planned, "program.apt")).unwrap();
    // The first block of the body is at the place of the one that compensates the length.
    let positions = positions(&text_of(&planned, "program.nc"));
    assert!(positions.len() == apt.points.len() + 1 && positions[0] == positions[1], "{} positions", positions.len());
    // Rounding of words: three decimals of a mm, four of a degree over less than a metre.
    let rounding = 2.0 * 5e-4 + 3.0 * 5e-5_f64.to_radians() * 1000.0;
    for (words, p) in positions[1..].iter().zip(&apt.points) {
        let (tip, axis) = place(&machine, &back, gauge, words);
        assert!((tip - p.cl.tip).norm() < rounding, "{words:?} is at {tip}, APT line {} {}", p.line, p.cl.tip);
        assert!((axis.into_inner() - p.cl.axis.into_inner()).norm() < 5e-6, "{words:?}, APT line {}", p.line);
    }

    let budget = report.budgets[0].against_mesh_mm;
    let mut deepest = 0.0_f64;
    for pair in positions.windows(2) {
        for t in [0.25, 0.5, 0.75, 1.0] {
            let at: Words =
                pair[0].iter().map(|(letter, from)| (letter.clone(), from + t * (pair[1][letter] - from))).collect();
            deepest = deepest.max(back.depth(&place(&machine, &back, gauge, &at)));
        }
    }
    let reported = report.worst.gouge_mm.unwrap_or(0.0);
    assert!(0.0 < deepest && deepest <= budget, "{deepest} mm deep, budget {budget}");
    assert!(reported >= deepest - 1e-3, "report {reported}, by brute force {deepest}");
    let certified = number(&certificates["largest_depth_mm"]);
    assert!(certified >= deepest - 1e-6 && certified <= budget, "certified {certified}, by brute force {deepest}");
    // All three rotary axes take part, C as the missing Y.
    for letter in ["A", "B", "C"] {
        let values = || positions.iter().map(|words| words[letter]);
        let travel = values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min);
        assert!(travel > 5.0, "{letter} turns by {travel} deg");
    }
}
