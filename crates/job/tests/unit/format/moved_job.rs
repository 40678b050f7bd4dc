use crate::format::moved_job::*;
use crate::load::job::Job;
use crate::load::made_from::named;
use serde_json::{Value, json};

/// Returns a job that names a file at every key that can name one.
fn full_job() -> JobFile {
    let all = crate::examples::new_job::new_job(&crate::examples::new_job::NewJob::Patch { size_mm: 80.0 }).unwrap();
    let (_, bytes) = all.into_iter().find(|(name, _)| name == "job.json").unwrap();
    let mut job: Value = serde_json::from_slice(&bytes).unwrap();
    job["second_tool"] = json!("second.json");
    job["tools"] = json!({ "mill": "tools/mill.json" });
    job["post"]["template"] = json!("own.j2");
    job["post"]["dialect_file"] = json!("own/dialect.json");
    job["setups"][0]["stock"] = json!({ "mesh": { "file": "../castings/stock.stl" } });
    let programs = json!({ "programs": [{ "file": "rough.nc", "tool": "rough.json" }] });
    let left = |of: Value| json!({ "left_above": { "height_mm": 0.5, "overlap_mm": 2, "of": of } });
    job["operations"][0]["path"]["strategy"]["region"] = left(programs);
    let mut second = job["operations"][0].clone();
    let region = left(json!({ "rest": "rest.stock" }));
    second["path"] = json!({ "file": { "file": "passes.json", "max_distance_mm": 0.1, "region": region } });
    job["operations"].as_array_mut().unwrap().push(second);
    serde_json::from_value(job).unwrap()
}

#[test]
fn every_name_leads_to_the_same_file_from_another_folder() {
    let root = tempfile::tempdir().unwrap();
    let [own, beside] = ["jobs/hood", "best"].map(|name| root.path().join(name));
    std::fs::create_dir_all(&own).unwrap();
    let file = full_job();
    let all = |file: &JobFile| names_mut(&mut file.clone()).into_iter().map(|n| n.clone()).collect::<Vec<String>>();
    let given = all(&file);
    assert_eq!(given.len(), 12, "{given:?}");
    // The folder of the moved job need not exist.
    let moved = moved_job(&file, &own.join("job.json"), &beside.join("deep/best.json"));
    for (before, after) in given.iter().zip(all(&moved)) {
        assert_eq!(after, format!("../../jobs/hood/{before}"));
    }
    let same = moved_job(&file, &own.join("job.json"), &own.join("best.json"));
    assert_eq!(all(&same), given);
    let mut absolute = file;
    absolute.tool = Some(root.path().join("tool.json").to_string_lossy().into_owned());
    let moved = moved_job(&absolute, &own.join("job.json"), &beside.join("best.json"));
    assert_eq!(moved.tool, absolute.tool);
}

#[test]
fn a_name_that_the_inputs_of_a_job_have_is_renamed() {
    let folder = tempfile::tempdir().unwrap();
    let example = crate::examples::new_job::NewJob::Patch { size_mm: 80.0 };
    for (name, bytes) in crate::examples::new_job::new_job(&example).unwrap() {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let mut job = Job::read(&folder.path().join("job.json")).unwrap();
    job.file = full_job();
    let mut inputs: Vec<String> = named(&job.file).map(str::to_owned).collect();
    let mut renamed: Vec<String> = names_mut(&mut job.file).into_iter().map(|n| n.clone()).collect();
    inputs.sort();
    renamed.sort();
    assert_eq!(inputs, renamed);
}
