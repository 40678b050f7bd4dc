//! Commands of a batch, and its results against those of the commands for one job.

use facemill_tests::batches::{batch, batch_command, blink_batch, keys_in, write_batch};
use facemill_tests::calls::with_a_call;
use facemill_tests::jobs::JobFolder;
use facemill_tests::program::{code_and_errors, run};
use serde_json::{Value, json};

fn json_of(output: &std::process::Output) -> Value {
    let (code, errors) = code_and_errors(output);
    assert_eq!(code, 0, "{errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn obeys(format: &str, file: &Value) {
    let schema: Value = json_of(&run(&["schema", format]));
    let validator = jsonschema::validator_for(&schema).unwrap();
    let faults: Vec<String> = validator.iter_errors(file).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(faults.is_empty(), "{format}: {faults:?}");
}

fn done(job: &JobFolder, what: &str, more: &[&str]) -> String {
    let output = batch(job, what, "out", more);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 0, "{what}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Files of plans of the same job, made by the command for one job.
#[test]
fn a_task_has_the_bytes_of_the_plan_with_its_settings() {
    let job = blink_batch(2);
    job.set("batch.json", &[("/task", Value::Null)]);
    done(&job, "run", &["--quiet"]);
    let tasks = json_of(&batch(&job, "expand", "out", &["--json"]));
    obeys("batch-tasks", &tasks);
    let second = &tasks["tasks"][1];
    let setting = format!("{}={}", second["settings"][0]["key"].as_str().unwrap(), second["settings"][0]["value"]);
    let (file, folder) = (job.job(), job.path("plan"));
    let plan = ["plan", file.to_str().unwrap(), "--out", folder.to_str().unwrap(), "--set", &setting, "--quiet"];
    assert_eq!(code_and_errors(&run(&plan)).0, 0);
    let result = job.json(&format!("out/tasks/{}/result.json", second["key"].as_str().unwrap()));
    let names: Vec<&str> = result["files"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert!(names.contains(&"program.nc") && names.contains(&"report.json"), "{names:?}");
    for name in names {
        let own = std::fs::read(job.path(&format!("out/tasks/{}/{name}", second["key"].as_str().unwrap()))).unwrap();
        assert!(own == std::fs::read(folder.join(name)).unwrap(), "{name} differs");
    }
}

/// The second setup begins with the rest of the first: its task cuts that, too, and is the second
/// half of the plan of the whole job.
#[test]
fn tasks_of_two_setups_have_the_bytes_of_the_plan_of_both() {
    let job = blink_batch(1);
    let mut file = job.json("job.json");
    let (mut setup, mut operation) = (file["setups"][0].clone(), file["operations"][0].clone());
    setup["name"] = json!("second");
    (operation["name"], operation["setup"]) = (json!("again"), json!("second"));
    file["operations"][0]["setup"] = file["setups"][0]["name"].clone();
    file["setups"].as_array_mut().unwrap().push(setup);
    file["operations"].as_array_mut().unwrap().push(operation);
    file["verification"] = json!({ "stock_cell_mm": 1.0 });
    job.write("job.json", file.to_string().as_bytes());
    let batch = json!({ "format": "facemill-batch/1", "jobs": { "list": ["job.json"] } });
    job.write("batch.json", batch.to_string().as_bytes());
    facemill_tests::batches::batch(&job, "run", "out", &["--quiet"]);
    let (place, folder) = (job.job(), job.path("plan"));
    let plan = ["plan", place.to_str().unwrap(), "--out", folder.to_str().unwrap(), "--quiet", "--no-html"];
    let (code, errors) = code_and_errors(&run(&plan));
    assert!(code == 0 || code == 1, "{errors}");
    let tasks = json_of(&facemill_tests::batches::batch(&job, "expand", "out", &["--json"]));
    let mut n = 0;
    for (k, name) in ["report-top.json", "report-second.json"].into_iter().enumerate() {
        let key = tasks["tasks"][k]["key"].as_str().unwrap();
        let result = job.json(&format!("out/tasks/{key}/result.json"));
        for file in result["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()) {
            let own = std::fs::read(job.path(&format!("out/tasks/{key}/{file}"))).unwrap();
            assert!(own == std::fs::read(folder.join(file)).unwrap(), "{file} differs");
            n += 1;
        }
        let report = job.json(&format!("out/tasks/{key}/{name}"));
        let began_as = &report["stock"]["began_as"];
        assert_eq!(began_as.as_str().is_some_and(|text| text.contains("rest of setup")), k == 1, "{began_as}");
    }
    // All but the times of the stages and the report on the whole job.
    assert_eq!(n + 2, std::fs::read_dir(folder).unwrap().count());
}

#[test]
fn programs_are_verified_and_given_lengths_as_by_the_commands_for_one() {
    let job = blink_batch(1);
    done(&job, "run", &["--quiet"]);
    let key = keys_in(&job.path("out")).remove(0);
    std::fs::copy(job.path(&format!("out/tasks/{key}/program.nc")), job.path("1.nc")).unwrap();
    for (kind, file) in [("verify", "verification.json"), ("lengths", "lengths.json")] {
        let task = json!({ kind: { "programs": "*.nc" } });
        let batch = json!({ "format": "facemill-batch/1", "jobs": { "list": ["job.json"] }, "task": task });
        obeys("batch", &batch);
        job.write("batch.json", batch.to_string().as_bytes());
        done(&job, "run", &["--quiet"]);
        let tasks = json_of(&facemill_tests::batches::batch(&job, "expand", "out", &["--json"]));
        let key = tasks["tasks"][0]["key"].as_str().unwrap();
        let own = job.path(&format!("{kind}.json"));
        let [program, of_job] = [job.path("1.nc"), job.job()];
        let words = [program.to_str().unwrap(), "--job", of_job.to_str().unwrap(), "--out", own.to_str().unwrap()];
        assert_eq!(code_and_errors(&run(&[&[kind][..], &words].concat())).0, 0);
        let result = std::fs::read(job.path(&format!("out/tasks/{key}/{file}"))).unwrap();
        assert!(result == std::fs::read(own).unwrap(), "{file} differs from that of facemill {kind}");
    }
}

/// Calls are expanded as by the commands for one program, with the lines of the written files; a
/// called file is an input of its task.
#[test]
fn programs_with_subprograms_are_run_as_by_the_commands_for_one() {
    let job = blink_batch(1);
    done(&job, "run", &["--quiet"]);
    let key = keys_in(&job.path("out")).remove(0);
    let flat = std::fs::read_to_string(job.path(&format!("out/tasks/{key}/program.nc"))).unwrap();
    let [main, sub] = with_a_call(&flat);
    job.write("main.nc", main.as_bytes());
    for (kind, file) in [("verify", "verification.json"), ("lengths", "lengths.json")] {
        job.write("O2999.nc", sub.as_bytes());
        let task = json!({ kind: { "programs": "main.nc" } });
        let batch = json!({ "format": "facemill-batch/1", "jobs": { "list": ["job.json"] }, "task": task });
        job.write("batch.json", batch.to_string().as_bytes());
        done(&job, "run", &["--quiet"]);
        let key = || {
            let tasks = json_of(&facemill_tests::batches::batch(&job, "expand", "out", &["--json"]));
            tasks["tasks"][0]["key"].as_str().unwrap().to_owned()
        };
        let key_before = key();
        let own = job.path(&format!("{kind}.json"));
        let [program, of_job] = [job.path("main.nc"), job.job()];
        let words = [program.to_str().unwrap(), "--job", of_job.to_str().unwrap(), "--out", own.to_str().unwrap()];
        assert_eq!(code_and_errors(&run(&[&[kind][..], &words].concat())).0, 0, "{kind}");
        let result = std::fs::read(job.path(&format!("out/tasks/{key_before}/{file}"))).unwrap();
        assert!(result == std::fs::read(own).unwrap(), "{file} differs from that of facemill {kind}");
        let result: Value = serde_json::from_slice(&result).unwrap();
        obeys(if kind == "verify" { "verification" } else { kind }, &result);
        assert_eq!(result["called_files"][0]["file"], "O2999.nc", "{kind}");
        assert_eq!(result["program"]["file"], "main.nc", "{kind}");
        job.write("O2999.nc", sub.replace("PART", "SOME").as_bytes());
        assert_ne!(key(), key_before, "{kind}: another subprogram");
    }
}

#[test]
fn a_report_has_all_tasks_the_best_of_each_group_and_links_that_lead_somewhere() {
    let job = blink_batch(2);
    done(&job, "run", &["--quiet"]);
    let printed = done(&job, "report", &["--best-of", "feed"]);
    assert!(printed.contains("2 tasks: 2 done") && printed.contains("job.json: 1200 (task 2, "), "{printed}");
    let report = job.json("out/report.json");
    obeys("batch-report", &report);
    assert_eq!(report["best"][0]["number"], json!(2), "the faster feed takes less time");
    let csv = std::fs::read_to_string(job.path("out/report.csv")).unwrap();
    assert_eq!((csv.lines().count(), csv.lines().next().unwrap().contains(",feed,")), (3, true));
    let page = std::fs::read_to_string(job.path("out/report.html")).unwrap();
    let links: Vec<&str> = page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(links.iter().any(|link| link.ends_with("program.nc")) && links.iter().any(|link| link.ends_with(".svg")));
    for link in links.iter().filter(|link| !link.starts_with('#')) {
        assert!(job.path("out").join(link).is_file(), "{link}");
    }
    let (code, errors) = code_and_errors(&batch(&job, "report", "out", &["--best-of", "fed"]));
    assert!(code == 2 && errors.contains("there is no axis \"fed\": feed"), "{errors}");
}

#[test]
fn the_sample_batch_is_24_variants_that_can_be_read() {
    let folder = facemill_tests::shared::workspace().join("assets/batch");
    let path = folder.join("sweep.json");
    obeys("batch", &serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap());
    let tasks = json_of(&run(&["batch", "expand", path.to_str().unwrap(), "--json"]));
    let tasks = tasks["tasks"].as_array().unwrap();
    assert_eq!(tasks.len(), 24);
    let keys: std::collections::BTreeSet<&str> = tasks.iter().map(|task| task["key"].as_str().unwrap()).collect();
    assert_eq!(keys.len(), 24);
    assert!(tasks.iter().all(|task| task.get("unreadable").is_none()));
    let tools: std::collections::BTreeSet<&str> =
        tasks.iter().flat_map(|task| task["inputs"].as_array().unwrap()).filter_map(|i| i["file"].as_str()).collect();
    assert!(tools.contains("tool.json") && tools.contains("tool-12.json"), "{tools:?}");
}

#[test]
fn a_task_of_another_key_is_not_run_and_one_that_is_there_is_not_run_again() {
    let job = blink_batch(1);
    let output = batch(&job, "task", "out", &["1", "--expect", &"0".repeat(64)]);
    assert_eq!(code_and_errors(&output).0, 3);
    assert_eq!(keys_in(&job.path("out")).len(), 0);
    let (code, errors) = code_and_errors(&batch(&job, "task", "out", &["2"]));
    assert!(code == 2 && errors.contains("has tasks 1 to 1, and no 2"), "{errors}");
    done(&job, "task", &["1", "--quiet"]);
    let key = keys_in(&job.path("out")).remove(0);
    let place = job.path(&format!("out/tasks/{key}/times.json"));
    let times = std::fs::read(&place).unwrap();
    done(&job, "task", &["1", "--quiet", "--expect", &key]);
    assert_eq!(std::fs::read(&place).unwrap(), times);
    assert_eq!(done(&job, "expand", &["--numbers"]), "1\n");
}

#[test]
fn a_batch_from_elsewhere_reads_no_files_outside_its_folder() {
    let (job, other) = (blink_batch(1), blink_batch(1));
    let outside = other.path("").to_string_lossy().into_owned();
    write_batch(&job, &json!({ "list": [outside] }));
    let refused = batch(&job, "run", "out", &[]);
    let (code, errors) = code_and_errors(&refused);
    assert!(code == 2 && errors.contains("jobs.list[0]") && errors.contains("--allow-outside"), "{errors}");
    assert!(!job.path("out").exists());
    done(&job, "run", &["--allow-outside", "--quiet"]);
    // Files of its jobs, too: by an axis that sets the tool.
    let tool = other.path("tool.json").to_string_lossy().into_owned();
    let axis = json!({ "name": "tool", "values": { "each": { "key": "tool", "values": [tool] } } });
    write_batch(&job, &json!({ "sweep": { "job": "job.json", "axes": [axis] } }));
    let output = batch(&job, "run", "out", &[]);
    let (code, errors) = code_and_errors(&output);
    assert!(code == 1 && errors.contains("is outside the job's folder"), "{errors}");
    done(&job, "run", &["--allow-outside", "--quiet"]);
    let (code, errors) = code_and_errors(&batch(&job, "expand", "out", &["--max-tasks", "0"]));
    assert!(code == 2 && errors.contains("has more than 0 tasks"), "{errors}");
}

/// Every line is an object, and begins and ends are in order.
#[test]
fn progress_as_json_names_every_task_of_a_batch_and_every_stage_of_a_plan() {
    let job = blink_batch(2);
    let output = batch_command(&job, "run", "out", &["--json-progress"]).output().unwrap();
    let lines = |errors: &[u8]| -> Vec<Value> {
        let text = std::str::from_utf8(errors).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
    };
    let events = lines(&output.stderr);
    assert_eq!((&events[0]["event"], &events[0]["tasks"]), (&json!("batch_began"), &json!(2)));
    for event in ["task_began", "task_ended"] {
        let mut of: Vec<u64> =
            events.iter().filter(|e| e["event"] == event).map(|e| e["task"].as_u64().unwrap()).collect();
        of.sort_unstable();
        assert_eq!(of, [1, 2], "{event}");
    }
    assert!(events.iter().filter(|e| e["event"] == "task_ended").all(|e| e["exit_code"] == 0));
    let last = json!({ "event": "batch_ended", "tasks": 2, "ended": 2, "failed": 0, "exit_code": 0 });
    assert_eq!(events.last(), Some(&last));
    let file = job.job();
    let folder = job.path("plan");
    let plan = ["plan", file.to_str().unwrap(), "--out", folder.to_str().unwrap(), "--json-progress", "--quiet"];
    let events = lines(&run(&plan).stderr);
    let of =
        |event: &str| events.iter().filter(|e| e["event"] == event).map(|e| e["stage"].clone()).collect::<Vec<_>>();
    assert_eq!(of("stage_began"), of("stage_ended"));
    assert!(of("stage_began").contains(&json!("verify program")), "{events:?}");
}
