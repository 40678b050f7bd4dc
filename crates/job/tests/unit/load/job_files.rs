use facemill_file_format::from_json;
use serde_json::{Value, json};

use super::*;
use crate::examples::new_job::{NewJob, new_job};
use crate::format::job_file::JobFile;
use crate::format::made_from::MadeFrom;
use crate::load::job::{Job, Setup};

/// The files of an example, and its job.
fn example() -> (Vec<(String, Vec<u8>)>, JobFile) {
    let mut files = new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap();
    let at = files.iter().position(|(name, _)| name == "job.json").unwrap();
    let (_, job) = files.remove(at);
    (files, from_json(&job).unwrap())
}

fn held(files: &[(String, Vec<u8>)]) -> JobFiles {
    files.iter().fold(JobFiles::default(), |held, (name, bytes)| held.with(name, bytes.clone()))
}

#[test]
fn a_job_in_memory_is_the_job_that_is_read() {
    let (files, file) = example();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("job.json"), to_json(&file)).unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
    let read = Job::read(folder.path()).unwrap();
    let in_memory = Job::of_values(&file, held(&files)).unwrap();
    let in_folder = Job::of_values(&file, JobFiles::in_folder(folder.path())).unwrap();
    for job in [&in_memory, &in_folder] {
        assert_eq!(to_json(&job.file), to_json(&read.file));
        assert_eq!((&job.tool, &job.machine), (&read.tool, &read.machine));
        let inputs = |job: &Job| MadeFrom::of(job).inputs.iter().map(|i| (i.file.clone(), i.blake3.clone())).collect();
        let (one, other): (Vec<(String, String)>, Vec<_>) = (inputs(job), inputs(&read));
        assert_eq!(one, other);
        let [own, other] = [job, &read].map(|job| Setup::read(job, 0).unwrap());
        assert_eq!(own.obstacles.len(), other.obstacles.len());
        assert!(own.obstacles.iter().zip(&other.obstacles).all(|(a, b)| a.mesh == b.mesh && a.name == b.name));
    }
}

#[test]
fn what_is_held_counts_before_the_folder() {
    let (files, file) = example();
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
    let tool: ToolFile = from_json(&files.iter().find(|(name, _)| name == "tool.json").unwrap().1).unwrap();
    let other = ToolFile { name: "another mill".to_owned(), ..tool };
    let job = Job::of_values(&file, JobFiles::in_folder(folder.path()).with_tool("tool.json", &other)).unwrap();
    assert_eq!(job.tool.name(), "another mill");
}

#[test]
fn a_job_in_memory_is_checked_as_one_that_is_read() {
    let (files, file) = example();
    let failure = |change: &dyn Fn(&mut Value), files: JobFiles| {
        let mut value = serde_json::to_value(&file).unwrap();
        change(&mut value);
        let file: JobFile = serde_json::from_value(value).unwrap();
        Job::of_values(&file, files).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let said = failure(&|job| job["operations"][0]["tolerances"]["gouge_mm"] = json!(-1.0), held(&files));
    assert!(said.starts_with("job.json: operations[0].tolerances.gouge_mm: "), "{said}");
    // A number that JSON has not.
    let mut endless = file.clone();
    endless.operations[0].tolerances.cusp_mm = f64::INFINITY;
    let said = Job::of_values(&endless, held(&files)).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(said.starts_with("job.json: operations[0].tolerances.cusp_mm, line "), "{said}");
    // A file that is not there.
    let said = failure(&|job| job["tool"] = json!("mill.json"), held(&files));
    assert_eq!(said, format!("mill.json: {NOT_HELD}"));
    let wrong = held(&files).with("machine.json", *b"{}");
    let said = failure(&|_| {}, wrong);
    assert!(said.starts_with("machine.json: ") && said.contains("missing field"), "{said}");
}

#[test]
fn a_tool_library_given_as_a_tool_names_the_command_that_imports_it() {
    let (files, file) = example();
    let message = |text: &str| {
        let files = held(&files).with("tool.json", text.as_bytes().to_vec());
        Job::of_values(&file, files).err().expect("no tool").to_string()
    };
    let of_library = message(r#"{ "data": [], "version": 36 }"#);
    assert!(of_library.contains("unknown field `data`") && of_library.contains("facemill tool import"), "{of_library}");
    let of_typo = message(r#"{ "datum": [] }"#);
    assert!(!of_typo.contains("tool import"), "{of_typo}");
}
