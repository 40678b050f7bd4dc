//! Keys of tasks: checksums of everything that a result depends on.

use std::path::Path;
use std::str::FromStr;
use std::sync::OnceLock;

use facemill_called_program::CalledProgram;
use facemill_job::failure::Failure;
use facemill_job::files;
use facemill_job::format::job_file::JobFile;
use facemill_job::format::job_settings::JobSetting;
use facemill_job::format::made_from::InputFile;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::load::job_source::read_job_file;
use facemill_job::load::made_from::InputChecksums;
use facemill_nc_program::Dialect;
use serde_json::json;

use crate::format::batch_file::TaskKindFile;
use crate::format::task_file::Task;

/// Task with its key.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyedTask {
    /// The task.
    pub task: Task,
    /// Key of its result, 64 hexadecimal digits.
    pub key: String,
    /// Files that it reads, relative to the folder of its job, with their checksums.
    pub inputs: Vec<InputFile>,
    /// Reason why the job, a file that it names or the program cannot be read; the key is then that
    /// of no result.
    pub unreadable: Option<String>,
}

/// Keys of the tasks of a batch; each file that they share is read once.
#[derive(Debug, Default)]
pub struct Keys {
    checksums: InputChecksums,
}

impl Keys {
    /// Returns a task with its key, from the files as they are on disk. Equal keys mean equal
    /// results, byte for byte; the key depends on the version of the program and the bytes that it
    /// makes of the golden jobs, the job with its settings, the setup, the options of the task, and
    /// names and bytes of all input files, and not on the place of the folder, labels or numbers.
    pub fn of(&mut self, task: Task) -> KeyedTask {
        match self.read(&task) {
            Ok((key, inputs)) => KeyedTask { task, key, inputs, unreadable: None },
            Err(why) => {
                let text = json!({
                    "format": KEY_FORMAT,
                    "unreadable": task.name,
                    "settings": task.settings,
                    "setup": task.setup,
                    "program": task.program,
                });
                let key = blake3::hash(text.to_string().as_bytes()).to_hex().to_string();
                KeyedTask { task, key, inputs: Vec::new(), unreadable: Some(why.to_string()) }
            }
        }
    }

    fn read(&mut self, task: &Task) -> Result<(String, Vec<InputFile>), Failure> {
        let settings = settings_of(task)?;
        let path = Path::new(&task.job);
        let file = read_job_file(path, &settings)?;
        let inputs = self.checksums.of(path, &file)?;
        let program = task.program.as_ref().map(|program| TaskProgram::read(Path::new(program), file.post.dialect));
        Ok((key_of(task, &file, &settings, &inputs, program.transpose()?.as_ref()), inputs))
    }
}

/// Program of a task in memory.
pub(crate) struct TaskProgram {
    /// Text that runs.
    pub(crate) text: Vec<u8>,
    /// Its files, if calls of subprograms were expanded.
    pub(crate) called: Option<CalledProgram>,
    stamp: ProgramStamp,
}

impl TaskProgram {
    /// Reads a program, with the files of subprograms that it calls.
    ///
    /// # Errors
    /// If a file cannot be read, or calls are nested without end.
    pub(crate) fn read(path: &Path, dialect: Dialect) -> Result<Self, Failure> {
        let written = files::read(path)?;
        let stamp = ProgramStamp::new(path, &written);
        let (called, text) = CalledProgram::expanded(path, &written, dialect)?.unzip();
        Ok(Self { text: text.unwrap_or(written), called, stamp })
    }
}

/// Value of the key `format` in the text that a key is the checksum of.
const KEY_FORMAT: &str = "facemill-batch-key/1";

/// Table of the bytes that this program makes of the golden jobs: a link to that of the tests,
/// which changes when the bytes of results do.
const GOLDEN_BYTES: &[u8] = include_bytes!("../golden-bytes.txt");

/// Returns what tells programs of one version apart that make different results: the checksum of
/// the golden bytes, and `FACEMILL_BUILD` of the environment in which it was built.
fn behaviour() -> &'static str {
    static BEHAVIOUR: OnceLock<String> = OnceLock::new();
    BEHAVIOUR.get_or_init(|| {
        let golden = blake3::hash(GOLDEN_BYTES).to_hex();
        option_env!("FACEMILL_BUILD").map_or_else(|| golden.to_string(), |build| format!("{golden} {build}"))
    })
}

/// Returns the key of a task from what was read for it.
pub(crate) fn key_of(
    task: &Task,
    file: &JobFile,
    settings: &[JobSetting],
    inputs: &[InputFile],
    program: Option<&TaskProgram>,
) -> String {
    let mut kind = task.kind.clone();
    // The program itself is in the key; the pattern that found it changes nothing.
    match &mut kind {
        TaskKindFile::Plan(_) => {}
        TaskKindFile::Verify(verify) => verify.programs.clear(),
        TaskKindFile::Lengths(lengths) => lengths.programs.clear(),
    }
    let mut text = json!({
        "format": KEY_FORMAT,
        "facemill": env!("CARGO_PKG_VERSION"),
        "behaviour": behaviour(),
        "job": file,
        "settings": settings,
        "setup": task.setup,
        "kind": kind,
        "program": program.map(|program| &program.stamp),
        "inputs": inputs,
    });
    if let Some(called) = program.and_then(|program| program.called.as_ref()) {
        text["called_files"] = json!(called.called_files());
    }
    blake3::hash(text.to_string().as_bytes()).to_hex().to_string()
}

/// Returns the settings of a task.
///
/// # Errors
/// If a key is none.
pub(crate) fn settings_of(task: &Task) -> Result<Vec<JobSetting>, Failure> {
    let setting = |s: &crate::format::task_file::TaskSetting| JobSetting::from_str(&format!("{}={}", s.key, s.value));
    let settings: Result<Vec<JobSetting>, String> = task.settings.iter().map(setting).collect();
    settings.map_err(|why| Failure::input(Path::new(&task.job), why))
}

#[cfg(test)]
#[path = "../tests/unit/key.rs"]
mod tests;
