//! Passes as path files and pictures, their efficiency, and strategies compared by the command.

use std::path::Path;

use facemill::cc_path::files::read_path_file;
use facemill::job::setup::path::lay_operation;
use facemill::nc_program::Dialect;
use facemill::{Job, Planned, Setup, SilentStages, VerifyRequest, verify_program};
use facemill_tests::hood::Hood;
use facemill_tests::jobs::{JobFolder, text_of, unfinished};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{blink_patch, tiny_patch};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

/// Points of passes with their normals.
type Points = Vec<Vec<(Point3<f64>, Vector3<f64>)>>;

fn points_of_file(text: &str) -> Points {
    let file = read_path_file(text.as_bytes()).expect("a path file");
    let of = |pass: &facemill::cc_path::files::PassFile| {
        let normals = pass.normals.clone().expect("normals");
        pass.points_mm.iter().zip(normals).map(|(p, n)| (Point3::from(*p), Vector3::from(n))).collect()
    };
    file.passes.iter().map(of).collect()
}

fn laid(job: &JobFolder) -> Points {
    let job = Job::read(&job.job()).expect("a job");
    let setup = Setup::read(&job, 0).expect("a setup");
    let tasks = lay_operation(&job, &setup, 0, &job.file.operations[0]).expect("passes").tasks;
    tasks.iter().map(|t| t.pass.points.iter().map(|cc| (cc.position, cc.normal.into_inner())).collect()).collect()
}

fn assert_same(a: &Points, b: &Points, within: f64) {
    assert_eq!(a.iter().map(Vec::len).collect::<Vec<_>>(), b.iter().map(Vec::len).collect::<Vec<_>>());
    for ((p, n), (q, m)) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((p - q).norm() < within && (n - m).norm() < 1e-5, "{p} {q}, {n} {m}");
    }
}

/// Text of the program of a plan.
fn program(planned: &Planned) -> String {
    text_of(planned, "program.nc")
}

#[test]
fn a_job_reads_the_passes_of_a_plan_back_as_they_are_with_the_efficiency_of_its_text() {
    let job = tiny_patch();
    let allowance = ("/setups/0/meshes/0/allowance_mm", json!(0.3));
    job.set("job.json", &[allowance]);
    let planned = job.plan();
    let text = text_of(&planned, "passes.json");
    // All points of this job have a posture, in the order laid.
    let as_laid = laid(&job);
    let on_surface: Points = as_laid.iter().map(|pass| pass.iter().map(|(p, n)| (p - n * 0.3, *n)).collect()).collect();
    assert_same(&points_of_file(&text), &on_surface, 2e-6);
    job.write("passes.json", text.as_bytes());
    let path = json!({ "file": { "file": "passes.json", "max_distance_mm": 0.01 } });
    let again = JobFolder::of(&files(&job));
    again.set("job.json", &[("/operations/0/path", path)]);
    assert_same(&laid(&again), &as_laid, 2e-6);

    let svg = text_of(&planned, "passes.svg");
    assert!(svg.contains("times their floor of") && svg.contains("program.nc blake3"), "{svg}");

    let efficiency = &planned.report.efficiency[0];
    let length: f64 = planned.report.passes.iter().map(|p| p.length_mm).sum();
    assert!((efficiency.passes_length_mm - length).abs() < 1e-6 * length);
    assert!((efficiency.efficiency - length / efficiency.floor_mm).abs() < 1e-9);
    assert!(efficiency.least_floor_mm <= efficiency.floor_mm * (1.0 + 1e-6), "{efficiency:?}");
    assert!(efficiency.with_entries.expect("a plan") > efficiency.efficiency);
    let read = Job::read(&job.job()).expect("a job");
    let request = VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc);
    let verified = verify_program(&read, program(&planned).as_bytes(), &request, &SilentStages).expect("a run").file;
    let by_text = &verified.efficiency[0];
    assert!((by_text.floor_mm / efficiency.floor_mm - 1.0).abs() < 0.01, "{by_text:?} {efficiency:?}");
    // The ends of entries and exits that touch the surface count in the text.
    let ratio = by_text.passes_length_mm / efficiency.passes_length_mm;
    assert!((0.97..1.1).contains(&ratio), "{by_text:?} {efficiency:?}");
    let slopes = &planned.report.remaining.as_ref().expect("a plan").operations[0];
    let area: f64 = slopes.slopes.iter().map(|s| s.area_mm2).sum();
    assert!((area / slopes.area_mm2 - 1.0).abs() < 1e-9 && slopes.slopes.iter().all(|s| s.area_mm2 > 0.0));
    let largest = slopes.slopes.iter().map(|s| s.largest_mm).fold(0.0, f64::max);
    assert_eq!(Some(largest), slopes.largest.map(|p| p.height_mm));
}

/// Files of a job's folder.
fn files(job: &JobFolder) -> Vec<(String, Vec<u8>)> {
    let folder = job.job().parent().expect("a folder").to_owned();
    let entries = std::fs::read_dir(folder).expect("a folder").flatten().filter(|e| e.path().is_file());
    entries.map(|e| (e.file_name().into_string().expect("a name"), std::fs::read(e.path()).expect("a file"))).collect()
}

fn paths(job: &JobFolder, options: &[&str]) -> (i32, String, String) {
    let file = job.job();
    let mut arguments = vec!["paths", file.to_str().expect("a path")];
    arguments.extend(options);
    let output = run(&arguments);
    let (code, errors) = code_and_errors(&output);
    (code, String::from_utf8_lossy(&output.stdout).into_owned(), errors)
}

#[test]
fn passes_are_laid_without_a_plan_and_compared_by_plans_with_a_row_for_each_strategy() {
    let job = blink_patch();
    let out = job.path("laid");
    let (code, table, errors) = paths(&job, &["--out", out.to_str().expect("a path")]);
    assert_eq!(code, 0, "{errors}");
    assert!(table.contains("passes") && table.contains("times their floor"), "{table}");
    let written = std::fs::read_to_string(out.join("passes.json")).expect("a path file");
    assert_same(&points_of_file(&written), &laid(&job), 2e-6);
    assert!(std::fs::read_to_string(out.join("passes.svg")).expect("a picture").contains("as laid"));

    let planes = "operations[0].path.strategy.strategy.parallel_planes";
    let listed = json!({
        "format": "facemill-strategies/1",
        "strategies": [
            { "name": "as it is" },
            { "name": "finer", "settings": { "operations[0].tolerances.max_step_over_mm": 0.3 } },
            { "name": "beside the part", "settings": {
                format!("{planes}.from_mm"): 900, format!("{planes}.to_mm"): 910
            } },
            { "name": "wrong", "settings": { "operations[0].tolerances.cusp_mm": -1 } }
        ]
    });
    job.write("strategies.json", listed.to_string().as_bytes());
    let with = job.path("strategies.json");
    let with = with.to_str().expect("a path");
    let compared = job.path("compared");
    let options = ["--compare", "--with", with, "--no-verify", "--json", "--out", compared.to_str().expect("a path")];
    let (code, json, errors) = paths(&job, &options);
    assert_eq!(code, 0, "{errors}");
    assert!(errors.contains("plan 2 of 4: finer"), "{errors}");
    let file: Value = serde_json::from_str(&json).expect("JSON");
    let written = std::fs::read(compared.join("compared.json")).expect("a file");
    assert_eq!(serde_json::from_slice::<Value>(&written).expect("JSON"), file);
    let rows = file["compared"].as_array().expect("rows");
    assert_eq!(rows.len(), 4);
    let length = |k: usize| rows[k]["setups"][0]["passes_length_mm"].as_f64().expect("a length");
    assert!(length(1) > 1.2 * length(0), "{json}");
    // The figures are those of a plan of the same job.
    let out = job.path("plan");
    let plan =
        run(&["plan", job.job().to_str().expect("a path"), "--no-verify", "--out", out.to_str().expect("a path")]);
    assert_eq!(code_and_errors(&plan).0, 0);
    let report: Value =
        serde_json::from_slice(&std::fs::read(out.join("report.json")).expect("a report")).expect("JSON");
    let setup = &rows[0]["setups"][0];
    assert_eq!(setup["efficiency"], report["efficiency"][0]["efficiency"]);
    assert_eq!(setup["cusp_p99_mm"], report["remaining"]["operations"][0]["p99_mm"]);
    assert_eq!(setup["passes_time_s"], report["time_law"]["passes_time_s"]);
    for (row, why) in [(2, "none lies within box and levels"), (3, "cusp_mm")] {
        let reason = rows[row]["failed"].as_str().expect("a reason");
        assert!(reason.contains(why) && rows[row]["setups"] == json!([]), "{reason}");
    }
    assert!(compared.join("compared-1-passes.svg").exists() && !compared.join("compared-3-passes.svg").exists());
}

#[test]
fn a_comparison_of_nothing_or_of_an_unknown_strategy_is_wrong_input() {
    let job = blink_patch();
    let wrong = |options: &[&str], says: &str| {
        let (code, _, errors) = paths(&job, options);
        assert!(code == 2 && errors.contains(says), "{options:?}: {code}, {errors}");
    };
    wrong(&["--compare", "--strategies", "spirals of gold"], "there are job, levels");
    wrong(&["--strategies", "levels"], "--compare");
    wrong(&["--compare", "--mounting-angles", "400"], "must be from -360 to 360");
    job.write("none.json", br#"{ "format": "facemill-strategies/1", "strategies": [] }"#);
    let none = job.path("none.json");
    wrong(&["--compare", "--with", none.to_str().expect("a path")], "at least one");
    let twice = json!({ "format": "facemill-strategies/1", "strategies": [{ "name": "a" }, { "name": "a" }] });
    job.write("twice.json", twice.to_string().as_bytes());
    let twice = job.path("twice.json");
    wrong(&["--compare", "--with", twice.to_str().expect("a path")], "twice");
}

/// Largest speed of axis B of the slow head, deg/min.
const SLOW_B: f64 = 60.0;

/// Returns a hood of 60 mm, curved 40 mm along y and 400 mm along x, that is mounted away from the
/// pole on a mill whose head is slow. Its passes lead over the round, along y.
fn hood_on_a_slow_head() -> JobFolder {
    let hood = Hood { size: 60.0, radii: [400.0, 40.0], quads: 60, feed: 1200.0 };
    let job = JobFolder::of(&hood.files());
    let region = json!({ "box": { "min_mm": [-25, -20, -90], "max_mm": [25, 20, 90] } });
    let mounting = json!({ "translation_mm": [0, 0, 500], "rotation_axis": [1, 0, 0], "rotation_deg": 40 });
    job.set(
        "job.json",
        &[
            ("/setups/0/table_from_work", mounting),
            ("/operations/0/path/strategy/region", region),
            ("/operations/0/tolerances/max_step_mm", json!(3.0)),
            ("/operations/0/tolerances/cusp_mm", json!(0.3)),
            ("/operations/0/tolerances/max_step_over_mm", json!(4.0)),
            unfinished(),
        ],
    );
    let mut machine = job.json("machine.json");
    assert!(slow_down(&mut machine), "no axis B");
    job.write("machine.json", machine.to_string().as_bytes());
    job
}

/// Limits the speed of axis B in a machine file; returns whether there is one.
fn slow_down(value: &mut Value) -> bool {
    match value {
        Value::Object(map) if map.get("axis") == Some(&json!("B")) => {
            map.insert("max_velocity_deg_min".to_owned(), json!(SLOW_B));
            true
        }
        Value::Object(map) => map.values_mut().map(slow_down).fold(false, |a, b| a | b),
        Value::Array(list) => list.iter_mut().map(slow_down).fold(false, |a, b| a | b),
        _ => false,
    }
}

#[test]
fn the_best_job_of_a_comparison_takes_the_direction_that_spares_a_slow_axis() {
    let job = hood_on_a_slow_head();
    let best = job.path("elsewhere/best.json");
    let best = best.to_str().expect("a path");
    let names = "job,levels along";
    let (code, json, errors) =
        paths(&job, &["--compare", "--no-verify", "--strategies", names, "--best-out", best, "--json"]);
    assert_eq!(code, 0, "{errors}");
    let file: Value = serde_json::from_str(&json).expect("JSON");
    let rows = file["compared"].as_array().expect("rows");
    let of = |row: usize, key: &str| rows[row]["setups"][0][key].as_f64().expect("a number");
    let fastest = &file["fastest"];
    let taken = fastest["index"].as_u64().expect("a row") as usize;
    assert_eq!(fastest["job_time_s"], rows[0]["setups"][0]["total_time_s"]);

    // The angle between the tool and the table's axis is B. Over the round the normal turns by
    // 2·atan(20/40) = 53.1 deg away from that axis; within tilt 15 deg of it, B turns by 23.1 deg
    // at least, at 1 deg/s. Steps of 4 mm over 50 mm are 13 passes and more, as long as the region.
    let as_given = of(0, "passes_time_s");
    assert!(as_given > 13.0 * 23.1, "{as_given} s");
    assert!(of(0, "time_over_feed") > 2.0, "{json}");
    // Along the ridge that angle changes by a degree.
    assert_eq!(rows[taken]["strategy"], "levels along", "{json}");
    let at_feed = of(taken, "passes_length_mm") / 20.0;
    let chosen = of(taken, "passes_time_s");
    assert!(chosen < at_feed + 2.0 * of(taken, "passes"), "{chosen} s, {at_feed} s at the feed");
    assert!(fastest["total_time_s"].as_f64() < fastest["job_time_s"].as_f64(), "{json}");

    // The job that is written is planned in its other folder as the row says.
    let out = job.path("out");
    let out = out.to_str().expect("a path");
    let own = job.job();
    let own = own.parent().expect("a folder").to_str().expect("a path");
    let plan = run(&["plan", best, "--allow", own, "--no-verify", "--out", out]);
    let (code, errors) = code_and_errors(&plan);
    assert_eq!(code, 0, "{errors}");
    let report: Value =
        serde_json::from_slice(&std::fs::read(format!("{out}/report.json")).expect("a report")).expect("JSON");
    assert_eq!(report["totals"]["time_over_feed"], rows[taken]["setups"][0]["time_over_feed"]);
    assert_eq!(report["time_law"]["total_time_s"], fastest["total_time_s"]);

    // The file may be written by hand: it stays as it is, and nothing is planned.
    let written = std::fs::read(best).expect("a job");
    let (code, _, errors) = paths(&job, &["--compare", "--no-verify", "--strategies", names, "--best-out", best]);
    assert!(code == 2 && errors.contains("name another file"), "{code}, {errors}");
    assert_eq!(std::fs::read(best).expect("a job"), written);

    // The job as given is no output.
    let own_job = job.job();
    let own_job = own_job.to_str().expect("a path");
    let (code, _, errors) = paths(&job, &["--compare", "--no-verify", "--best-out", own_job]);
    assert!(code == 2 && errors.contains("which is an input"), "{code}, {errors}");
}
