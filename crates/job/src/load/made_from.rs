//! Input files of a job, read.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use crate::format::job_file::{PathFile, StockFile};
use crate::format::made_from::{InputFile, MadeFrom};
use crate::load::job::Job;
use crate::load::job_files::JobFiles;

impl MadeFrom {
    /// Reads all files that a job names, and those that they name. Leaves out unreadable files,
    /// since planning reports them.
    pub fn of(job: &Job) -> Self {
        let mut inputs = BTreeMap::new();
        let folder = job.path.parent().unwrap_or(Path::new(""));
        let own = job.path.file_name().map(|name| name.to_string_lossy().into_owned());
        own.iter().map(String::as_str).chain(named(job)).for_each(|name| add(&job.files, folder, name, &mut inputs));
        Self {
            facemill: env!("CARGO_PKG_VERSION"),
            tool: job.tool.name().to_owned(),
            second_tool: job.second.as_ref().map(|second| second.tool.name().to_owned()),
            machine: job.machine.name().to_owned(),
            dialect: job.post.dialect().name().to_owned(),
            inputs: inputs.into_iter().map(|(file, blake3)| InputFile { file, blake3 }).collect(),
        }
    }
}

/// Returns the files that the job names.
pub(crate) fn named(job: &Job) -> impl Iterator<Item = &str> {
    let file = &job.file;
    let of_setups = file.setups.iter().flat_map(|setup| {
        let stock = if let StockFile::Mesh(mesh) = &setup.stock { Some(mesh.file.as_str()) } else { None };
        setup.meshes.iter().map(|mesh| mesh.file.as_str()).chain(stock)
    });
    let of_operations = file.operations.iter().flat_map(|operation| {
        let (path, region) = match &operation.path {
            PathFile::File(path) => (Some(path.file.as_str()), &path.region),
            PathFile::Strategy(strategy) => (None, &strategy.region),
        };
        path.into_iter().chain(region.left_above.iter().flat_map(|left| left.of.files()))
    });
    let others = [&file.second_tool, &file.post.template, &file.post.dialect_file].into_iter().flatten();
    [&file.tool, &file.machine].into_iter().chain(others).map(String::as_str).chain(of_setups).chain(of_operations)
}

/// Adds a file, and those beside it that it names: meshes of a machine, buffers of a glTF file.
pub(crate) fn add(files: &JobFiles, folder: &Path, name: &str, inputs: &mut BTreeMap<String, String>) {
    if inputs.contains_key(name) {
        return;
    }
    let path = folder.join(name);
    let Ok(bytes) = files.beside(&path) else { return };
    inputs.insert(name.to_owned(), blake3::hash(&bytes).to_hex().to_string());
    let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json") || e.eq_ignore_ascii_case("gltf"));
    let Some(json) = is_json.then(|| serde_json::from_slice::<Value>(&bytes).ok()).flatten() else { return };
    let beside = Path::new(name).parent().unwrap_or(Path::new(""));
    let buffers = json["buffers"].as_array().into_iter().flatten().filter_map(|buffer| buffer["uri"].as_str());
    let mut others: Vec<&str> = buffers.filter(|uri| !uri.starts_with("data:")).collect();
    if json["format"].as_str().is_some_and(|format| format.starts_with("facemill-machine/")) {
        meshes_in(&json, &mut others);
    }
    others.into_iter().for_each(|other| add(files, folder, &beside.join(other).to_string_lossy(), inputs));
}

/// Collects the mesh files that bodies in a machine file name.
pub(crate) fn meshes_in<'j>(json: &'j Value, found: &mut Vec<&'j str>) {
    match json {
        Value::Object(map) => map.iter().for_each(|(key, value)| match value["file"].as_str() {
            Some(file) if key == "mesh" => found.push(file),
            _ => meshes_in(value, found),
        }),
        Value::Array(list) => list.iter().for_each(|value| meshes_in(value, found)),
        _ => {}
    }
}
