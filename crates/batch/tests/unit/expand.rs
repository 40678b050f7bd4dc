use super::*;
use serde_json::json;

/// A folder with a batch file, `a/job.json` of two setups, and `b/job.json` that is no JSON.
fn batch_folder(batch: &Value) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("a/job.json", r#"{ "setups": [{}, {}] }"#);
    write("b/job.json", "none");
    write("nc/1.nc", "");
    write("nc/2.nc", "");
    write("batch.json", &batch.to_string());
    folder
}

fn read(folder: &tempfile::TempDir, bounds: BatchBounds) -> Result<Batch, String> {
    Batch::read(&folder.path().join("batch.json"), bounds).map_err(|e| e.to_string())
}

fn tasks_of(batch: Value) -> Result<Vec<(String, usize, BTreeMapText)>, String> {
    let folder = batch_folder(&batch);
    let batch = read(&folder, BatchBounds::default())?;
    assert!(batch.task(0).is_none() && batch.task(batch.n_tasks() + 1).is_none());
    assert!(batch.tasks().enumerate().all(|(k, task)| task.number == k + 1));
    let text = |task: Task| (task.name, task.setup, task.axes.into_iter().map(|(a, l)| format!("{a}{l}")).collect());
    Ok(batch.tasks().map(text).collect())
}

type BTreeMapText = String;

#[test]
fn every_setup_of_a_job_is_a_task_and_a_job_that_cannot_be_read_is_one() {
    let tasks = tasks_of(json!({ "format": "facemill-batch/1", "jobs": { "list": ["a", "b/job.json", "c"] } }));
    let expected = [("a", 0), ("a", 1), ("b/job.json", 0), ("c", 0)].map(|(a, n)| (a.to_owned(), n, String::new()));
    assert_eq!(tasks.unwrap(), expected);
}

#[test]
fn a_pattern_finds_jobs_in_the_order_of_their_names() {
    let tasks = tasks_of(json!({ "format": "facemill-batch/1", "jobs": { "pattern": "*/job.json" } })).unwrap();
    let names: Vec<&str> = tasks.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names, ["a/job.json", "a/job.json", "b/job.json"]);
    let none = json!({ "format": "facemill-batch/1", "jobs": { "pattern": "x/*.json" } });
    assert!(tasks_of(none).unwrap_err().contains("jobs.pattern: no file matches"));
}

#[test]
fn variants_come_before_setups_and_setups_before_programs() {
    let axis = json!({ "name": "v", "values": { "each": { "key": "name", "values": ["x", "y"] } } });
    let jobs = json!({ "sweep": { "job": "a", "axes": [axis] } });
    let tasks = tasks_of(json!({ "format": "facemill-batch/1", "jobs": jobs })).unwrap();
    let places: Vec<(usize, &str)> = tasks.iter().map(|(_, setup, axes)| (*setup, axes.as_str())).collect();
    assert_eq!(places, [(0, "vx"), (1, "vx"), (0, "vy"), (1, "vy")]);
    let task = json!({ "verify": { "programs": "nc/*.nc" } });
    let folder = batch_folder(&json!({ "format": "facemill-batch/1", "jobs": jobs, "task": task }));
    let batch = read(&folder, BatchBounds::default()).unwrap();
    assert_eq!(batch.n_tasks(), 2 * 2 * 2);
    assert!(batch.task(2).unwrap().program.unwrap().ends_with("nc/2.nc"));
    assert!(batch.task(3).unwrap().program.unwrap().ends_with("nc/1.nc"));
}

#[test]
fn names_that_lead_out_of_the_folder_are_refused_unless_allowed() {
    let list = |name: &str| json!({ "format": "facemill-batch/1", "jobs": { "list": ["a", name] } });
    for name in ["../elsewhere/job.json", "/etc/hostname", "a/../../elsewhere"] {
        let folder = batch_folder(&list(name));
        let why = read(&folder, BatchBounds::default()).unwrap_err();
        assert!(why.contains(&format!("jobs.list[1]: {name} is outside the folder of the batch")), "{why}");
        assert!(read(&folder, BatchBounds { outside: true, ..BatchBounds::default() }).is_ok());
    }
    let inside = batch_folder(&list("a/../b"));
    assert!(read(&inside, BatchBounds::default()).is_ok(), "a name that leads back inside");
    let pattern = json!({ "format": "facemill-batch/1", "jobs": { "pattern": "../*/job.json" } });
    assert!(read(&batch_folder(&pattern), BatchBounds::default()).unwrap_err().contains("outside the folder"));
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_out_of_the_folder_is_refused() {
    let elsewhere = batch_folder(&json!({}));
    let folder = batch_folder(&json!({ "format": "facemill-batch/1", "jobs": { "list": ["linked/job.json"] } }));
    std::os::unix::fs::symlink(elsewhere.path().join("a"), folder.path().join("linked")).unwrap();
    assert!(read(&folder, BatchBounds::default()).unwrap_err().contains("linked/job.json is outside"));
    assert_eq!(read(&folder, BatchBounds { outside: true, ..BatchBounds::default() }).unwrap().n_tasks(), 2);
    // The job of a folder that is inside.
    let folder = batch_folder(&json!({ "format": "facemill-batch/1", "jobs": { "list": ["inside"] } }));
    std::fs::create_dir(folder.path().join("inside")).unwrap();
    std::os::unix::fs::symlink(elsewhere.path().join("a/job.json"), folder.path().join("inside/job.json")).unwrap();
    assert!(read(&folder, BatchBounds::default()).unwrap_err().contains("inside/job.json is outside"));
}

#[test]
fn more_tasks_than_permitted_are_refused_before_they_are_made() {
    let axis = |name: &str| {
        let range = json!({ "key": "name", "from": 0, "to": 1, "count": 1_000_000 });
        json!({ "name": name, "values": { "range": range } })
    };
    let jobs = json!({ "sweep": { "job": "a", "axes": [axis("p"), axis("q"), axis("r"), axis("s")] } });
    let folder = batch_folder(&json!({ "format": "facemill-batch/1", "jobs": jobs }));
    assert!(read(&folder, BatchBounds::default()).unwrap_err().contains("has more than 100000 tasks"));
    let list = batch_folder(&json!({ "format": "facemill-batch/1", "jobs": { "list": ["a"] } }));
    assert!(read(&list, BatchBounds { tasks: 1, outside: false }).is_err());
    assert!(read(&list, BatchBounds { tasks: 2, outside: false }).is_ok());
}

#[test]
fn faults_of_a_batch_name_file_and_field() {
    for (batch, words) in [
        (json!({ "format": "facemill-batch/2", "jobs": { "list": ["a"] } }), "format"),
        (json!({ "format": "facemill-batch/1", "jobs": { "list": [] } }), "jobs: there are none"),
        (json!({ "format": "facemill-batch/1", "jobs": { "lists": [] } }), "did you mean `list`?"),
        (
            json!({ "format": "facemill-batch/1", "jobs": { "list": ["a"] }, "task": { "plan": { "verfy": true } } }),
            "task.plan.verfy",
        ),
        (
            json!({ "format": "facemill-batch/1", "jobs": { "list": ["a"] }, "task": { "verify": { "programs": "nc/*", "stock_cell_mm": 0 } } }),
            "task.verify.stock_cell_mm: must be above 0, is 0",
        ),
        (
            json!({ "format": "facemill-batch/1", "jobs": { "list": ["a"] }, "task": { "lengths": { "programs": "nc/*", "margin_mm": -1 } } }),
            "task.lengths.margin_mm: must be at least 0, is -1",
        ),
    ] {
        let why = read(&batch_folder(&batch), BatchBounds::default()).unwrap_err();
        assert!(why.contains("batch.json") && why.contains(words), "{why}");
    }
}
