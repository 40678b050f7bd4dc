use super::*;
use facemill_job::examples::new_job::{NewJob, new_job};
use serde_json::Value;

use crate::format::batch_file::{PlanTaskFile, VerifyTaskFile};
use crate::format::task_file::TaskSetting;

/// A folder with an example job and a program.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    std::fs::write(folder.path().join("1.nc"), "M30\n").unwrap();
    folder
}

fn task_in(folder: &tempfile::TempDir) -> Task {
    Task {
        number: 1,
        job: folder.path().join("job.json").to_string_lossy().into_owned(),
        name: "job.json".to_owned(),
        axes: Default::default(),
        settings: Vec::new(),
        setup: 0,
        kind: TaskKindFile::Plan(PlanTaskFile::default()),
        program: None,
    }
}

fn key(task: Task) -> String {
    let keyed = Keys::default().of(task);
    assert_eq!(keyed.unreadable, None);
    keyed.key
}

fn setting(key: &str, value: Value) -> TaskSetting {
    TaskSetting { key: key.to_owned(), value }
}

#[test]
fn the_key_does_not_depend_on_the_folder_number_labels_or_pattern() {
    let (one, other) = (folder(), folder());
    let task = task_in(&one);
    assert_eq!(key(task.clone()), key(task_in(&other)));
    let axes = [("a".to_owned(), "b".to_owned())].into();
    assert_eq!(key(task.clone()), key(Task { number: 7, axes, name: "x".to_owned(), ..task.clone() }));
    let verify = |pattern: &str| {
        let file = VerifyTaskFile { programs: pattern.to_owned(), certificates: false, stock_cell_mm: None };
        let program = Some(one.path().join("1.nc").to_string_lossy().into_owned());
        key(Task { kind: TaskKindFile::Verify(file), program, ..task.clone() })
    };
    assert_eq!(verify("*.nc"), verify("1.*"));
}

#[test]
fn the_key_changes_with_every_input_setting_and_option() {
    let folder = folder();
    let task = task_in(&folder);
    let mut keys = vec![key(task.clone())];
    for setting in [
        setting("operations[0].tolerances.cusp_mm", json!(0.05)),
        setting("operations[0].tolerances.cusp_mm", json!(0.06)),
        setting("name", json!("another")),
    ] {
        keys.push(key(Task { settings: vec![setting], ..task.clone() }));
    }
    keys.push(key(Task { setup: 1, ..task.clone() }));
    for plan in [
        PlanTaskFile { verify: false, ..PlanTaskFile::default() },
        PlanTaskFile { certificates: true, ..PlanTaskFile::default() },
        PlanTaskFile { chips: true, ..PlanTaskFile::default() },
        PlanTaskFile { stock_cell_mm: Some(2.0), ..PlanTaskFile::default() },
    ] {
        keys.push(key(Task { kind: TaskKindFile::Plan(plan), ..task.clone() }));
    }
    for name in ["job.json", "tool.json", "machine.json", "patch.obj"] {
        let path = folder.path().join(name);
        let before = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&before[..], b"\n"].concat()).unwrap();
        keys.push(key(task.clone()));
        std::fs::write(&path, before).unwrap();
    }
    assert_eq!(key(task), keys[0], "the files are as they were");
    let n = keys.len();
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), n);
}

#[test]
fn the_key_of_a_program_changes_with_its_bytes_and_its_name() {
    let folder = folder();
    let of = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let file = VerifyTaskFile { programs: String::new(), certificates: false, stock_cell_mm: None };
        let program = Some(path.to_string_lossy().into_owned());
        key(Task { kind: TaskKindFile::Verify(file), program, ..task_in(&folder) })
    };
    let keys = [of("1.nc", "M30\n"), of("1.nc", "M2\n"), of("2.nc", "M30\n")];
    assert!(keys[0] != keys[1] && keys[0] != keys[2]);
    assert_eq!(of("1.nc", "M30\n"), keys[0]);
}

/// The scheduler computes keys with checksums that it keeps, a worker from the bytes that it plans
/// with.
#[test]
fn the_key_of_the_scheduler_is_that_of_the_worker() {
    let folder = folder();
    let settings = vec![setting("/operations/0/tolerances/cusp_mm", json!(0.07)), setting("name", json!("a \"b\""))];
    let task = Task { settings, ..task_in(&folder) };
    let parsed = settings_of(&task).unwrap();
    let (job, inputs) = facemill_job::load::job::Job::read_whole(Path::new(&task.job), &parsed).unwrap();
    assert_eq!(job.file.name, "a \"b\"");
    assert_eq!(key_of(&task, &job.file, &parsed, &inputs, None), key(task.clone()));
    let names: Vec<&str> = inputs.iter().map(|input| input.file.as_str()).collect();
    assert_eq!(names, ["job.json", "machine.json", "patch.obj", "tool.json"]);
}

/// Results of another program of the same version must not be taken for this one's.
#[test]
fn the_key_has_the_golden_bytes_of_this_program() {
    let table = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden-bytes.txt");
    if let Ok(table) = std::fs::read(table) {
        assert!(table == GOLDEN_BYTES, "crates/batch/golden-bytes.txt is to be a link to tests/golden-bytes.txt");
    }
    assert!(behaviour().starts_with(blake3::hash(GOLDEN_BYTES).to_hex().as_str()));
}

#[test]
fn a_job_with_an_input_that_cannot_be_read_is_unreadable() {
    let folder = folder();
    std::fs::remove_file(folder.path().join("patch.obj")).unwrap();
    let why = Keys::default().of(task_in(&folder)).unreadable.unwrap();
    assert!(why.contains("cannot read") && why.contains("patch.obj"), "{why}");
}

#[test]
fn a_job_that_cannot_be_read_has_a_key_and_a_reason() {
    let folder = folder();
    let wrong = Task { settings: vec![setting("operations[0].tolerances.cusp_mm", json!(-1))], ..task_in(&folder) };
    let keyed = Keys::default().of(wrong);
    assert!(keyed.unreadable.unwrap().contains("cusp_mm"));
    assert_ne!(keyed.key, key(task_in(&folder)));
}
