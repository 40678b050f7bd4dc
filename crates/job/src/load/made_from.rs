//! Input files of a job, read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use facemill_cc_path::files::ProgramWithToolFile;
use facemill_surface_model::{MeshFormat, external_files};
use serde_json::Value;

use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{JobFile, PathFile, StockFile};
use crate::format::made_from::{InputFile, MadeFrom};
use crate::load::job::Job;

impl MadeFrom {
    /// Reads all files that a job names, and those that they name. Leaves out unreadable files,
    /// since planning reports them.
    pub fn of(job: &Job) -> Self {
        let folder = job.path.parent().unwrap_or(Path::new(""));
        let read = |name: &str| {
            let path = folder.join(name);
            job.files.beside(&path).ok().map(|bytes| ReadInput::of(&path, &bytes))
        };
        Self {
            facemill: env!("CARGO_PKG_VERSION"),
            tool: job.tool.name().to_owned(),
            second_tool: job.second.as_ref().map(|second| second.tool.name().to_owned()),
            machine: job.machine.name().to_owned(),
            dialect: job.post.dialect().name().to_owned(),
            inputs: inputs_of(&job.path, &job.file, read),
        }
    }
}

/// Checksums of input files, each computed once: for many jobs with the same files. Files must not
/// change meanwhile.
#[derive(Debug, Default)]
pub struct InputChecksums {
    known: BTreeMap<PathBuf, ReadInput>,
}

impl InputChecksums {
    /// Returns the input files of a job as the report of its plan lists them, from disk.
    ///
    /// # Errors
    /// The failure of the first file in the order of their names that cannot be read, or that the
    /// job may not name: without it the list is not that of a plan.
    pub fn of(&mut self, path: &Path, file: &JobFile) -> Result<Vec<InputFile>, Failure> {
        files::enter_job(path);
        let folder = path.parent().unwrap_or(Path::new(""));
        all_inputs_of(path, file, |name| {
            let path = folder.join(name);
            if let Some(known) = self.known.get(&path) {
                return Ok(known.clone());
            }
            let read = ReadInput::of(&path, &files::read_named(&path)?);
            self.known.insert(path, read.clone());
            Ok(read)
        })
    }
}

/// Checksum of an input file, and the files beside it that it names: meshes of a machine, buffers
/// of a glTF file.
#[derive(Clone, Debug)]
pub(crate) struct ReadInput {
    blake3: String,
    names: Vec<String>,
}

impl ReadInput {
    pub(crate) fn of(path: &Path, bytes: &[u8]) -> Self {
        Self { blake3: blake3::hash(bytes).to_hex().to_string(), names: named_in(path, bytes) }
    }
}

/// Returns the input files of a job in the order of their names.
///
/// # Errors
/// The failure of the first file in this order that cannot be read.
pub(crate) fn all_inputs_of(
    path: &Path,
    file: &JobFile,
    mut read: impl FnMut(&str) -> Result<ReadInput, Failure>,
) -> Result<Vec<InputFile>, Failure> {
    let mut failures = BTreeMap::new();
    let inputs = inputs_of(path, file, |name| match read(name) {
        Ok(input) => Some(input),
        Err(failure) => {
            failures.insert(name.to_owned(), failure);
            None
        }
    });
    failures.into_values().next().map_or(Ok(inputs), Err)
}

/// Returns the input files of a job in the order of their names. `read` returns `None` for a file
/// that cannot be read.
pub(crate) fn inputs_of(
    path: &Path,
    file: &JobFile,
    mut read: impl FnMut(&str) -> Option<ReadInput>,
) -> Vec<InputFile> {
    let mut inputs = BTreeMap::new();
    let own = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let mut waiting: Vec<String> = own.into_iter().chain(named(file).map(str::to_owned)).collect();
    while let Some(name) = waiting.pop() {
        if inputs.contains_key(&name) {
            continue;
        }
        let Some(input) = read(&name) else { continue };
        let beside = Path::new(&name).parent().unwrap_or(Path::new("")).to_owned();
        waiting.extend(input.names.iter().map(|other| beside.join(other).to_string_lossy().into_owned()));
        inputs.insert(name, input.blake3);
    }
    inputs.into_iter().map(|(file, blake3)| InputFile { file, blake3 }).collect()
}

/// Returns the files that the job names.
pub(crate) fn named(file: &JobFile) -> impl Iterator<Item = &str> {
    let of_setups = file.setups.iter().flat_map(|setup| {
        let stock = if let StockFile::Mesh(mesh) = &setup.stock { Some(mesh.file.as_str()) } else { None };
        let before = setup.programs_before.iter().flat_map(ProgramWithToolFile::files);
        setup.meshes.iter().map(|mesh| mesh.file.as_str()).chain(stock).chain(before)
    });
    let of_operations = file.operations.iter().flat_map(|operation| {
        let (path, region) = match &operation.path {
            PathFile::File(path) => (Some(path.file.as_str()), &path.region),
            PathFile::Cl(path) => (Some(path.file.as_str()), &path.region),
            PathFile::Strategy(strategy) => (None, &strategy.region),
        };
        path.into_iter().chain(region.left_above.iter().flat_map(|left| left.of.files()))
    });
    let others = [&file.second_tool, &file.post.template, &file.post.dialect_file].into_iter().flatten();
    let tools = file.tool.iter().chain(file.tools.values());
    let own = tools.chain([&file.machine]).chain(others).map(String::as_str);
    own.chain(of_setups).chain(of_operations)
}

/// Returns the files beside a file that it names, as the readers of meshes and machines open them.
fn named_in(path: &Path, bytes: &[u8]) -> Vec<String> {
    let format = path.extension().and_then(|e| e.to_str()).and_then(MeshFormat::from_extension);
    if let Some(format) = format {
        return external_files(bytes, format);
    }
    // A machine file may have any name.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let is_object = text.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{');
    let json = is_object.then(|| serde_json::from_slice::<Value>(text).ok()).flatten();
    let Some(json) = json else { return Vec::new() };
    let mut names = Vec::new();
    if json["format"].as_str().is_some_and(|format| format.starts_with("facemill-machine/")) {
        meshes_in(&json, &mut names);
    }
    names.into_iter().map(str::to_owned).collect()
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

#[cfg(test)]
#[path = "../../tests/unit/load/made_from.rs"]
mod tests;
