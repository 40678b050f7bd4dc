//! Text of a job: its location, recognition of files that are no job, and the settings that change
//! it for one run.

use std::path::{Path, PathBuf};

use facemill_file_format::{from_json, from_value};
use facemill_surface_model::MeshFormat;
use serde_json::Value;

use crate::failure::Failure;
use crate::files;
use crate::format::job_file::{JOB_FORMAT, JobFile};
use crate::format::job_settings::JobSetting;
use crate::validate::validate;

/// Name of the job file in a job's folder.
pub(crate) const JOB_NAME: &str = "job.json";

/// Returns the job file that a path names: `job.json` of a folder, else the path itself.
pub fn job_path(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(JOB_NAME) } else { path.to_owned() }
}

/// Reads a job file, changes it by settings, and checks the result.
///
/// # Errors
/// If it cannot be read, is no job, or has impermissible values; a message about a value that was
/// set names the setting.
pub fn read_job_file(path: &Path, settings: &[JobSetting]) -> Result<JobFile, Failure> {
    job_of_text(path, &files::read_text(path)?, settings)
}

/// Returns the job that a text holds, changed by settings and checked.
///
/// # Errors
/// As [`read_job_file`], except those of reading.
pub fn job_of_text(path: &Path, text: &[u8], settings: &[JobSetting]) -> Result<JobFile, Failure> {
    if let Some(other) = other_format(path, text) {
        return Err(Failure::input(path, other));
    }
    let mut file: JobFile = from_json(text).map_err(|e| Failure::input(path, e))?;
    if !settings.is_empty() {
        file = changed(path, text, settings)?;
    }
    validate(&file).map_err(|e| Failure::input(path, e)).map_err(|e| blamed(settings, path, e))?;
    Ok(file)
}

fn changed(path: &Path, text: &[u8], settings: &[JobSetting]) -> Result<JobFile, Failure> {
    let mut job: Value = from_json(text).map_err(|e| Failure::input(path, e))?;
    for setting in settings {
        setting.put_in(&mut job).map_err(|why| Failure::input(path, format!("{setting}: {why}")))?;
    }
    from_value(job).map_err(|e| blamed(settings, path, Failure::input(path, e)))
}

/// Prefixes a failure about a value that was set with the setting's name.
pub fn blamed(settings: &[JobSetting], path: &Path, failure: Failure) -> Failure {
    match failure {
        Failure::Input { file, message } if file == path => {
            let setting = settings.iter().rev().find(|s| s.is_meant_by(&message));
            let message = setting.map_or(message.clone(), |setting| format!("{setting}: {message}"));
            Failure::Input { file, message }
        }
        other => other,
    }
}

/// Recognizes a file of another format given as an NC program, and says what to do; `None` if it
/// may be a program.
///
/// The start of a file is enough.
pub fn no_program(path: &Path, start: &[u8]) -> Option<String> {
    const INSTEAD: &str = "give the NC program, and the job with --job";
    if start.trim_ascii_start().starts_with(b"{") {
        let what = match format_key(start) {
            Some("job") => "a job file",
            Some(kind) => json_format(kind)?.0,
            None => "JSON",
        };
        return Some(format!("this is {what}, not an NC program; {INSTEAD}"));
    }
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    let is_mesh = MeshFormat::from_extension(&ending).is_some();
    is_mesh.then(|| format!("this is a mesh by its name, not an NC program; {INSTEAD}"))
}

/// Returns the kind in the first key `"format": "facemill-KIND/…"` of JSON that may end anywhere.
fn format_key(start: &[u8]) -> Option<&str> {
    const KEY: &[u8] = b"\"format\"";
    let key = start.windows(KEY.len()).position(|w| w == KEY)?;
    let value = start[key + KEY.len()..].trim_ascii_start().strip_prefix(b":")?.trim_ascii_start();
    let kind = value.strip_prefix(b"\"facemill-")?.split(|&byte| byte == b'/').next()?;
    std::str::from_utf8(kind).ok()
}

/// Recognizes a file of another format given as a job, and says what to do; `None` if it may be a
/// job.
fn other_format(path: &Path, text: &[u8]) -> Option<String> {
    let (what, instead) = match from_json::<Value>(text) {
        Ok(json) => {
            let format = json.get("format")?.as_str()?;
            let kind = format.strip_prefix("facemill-")?.split('/').next()?;
            if JOB_FORMAT.strip_prefix("facemill-")?.starts_with(kind) {
                return None;
            }
            json_format(kind)?
        }
        Err(_) => text_format(path)?,
    };
    Some(format!("this is {what}, not a job; {instead}"))
}

/// Returns one of our formats in words, and what to do with it if a job is required.
fn json_format(kind: &str) -> Option<(&'static str, &'static str)> {
    const NAMED: &str = "give the job that names it";
    const RESULT: &str = "give the job that it was made from";
    Some(match kind {
        "machine" => ("a machine file", "give the job that names it as `machine`, or see `facemill machine check`"),
        "tool" => ("a tool file", "give the job that names it as `tool`"),
        "path" => ("a path file", "give the job that names it as an operation's `path.file`"),
        "dialect" => ("a dialect file", "give the job that names it as `post.dialect_file`"),
        "holders" => ("a library of holders", "give a job, and this to `facemill lengths` as --holders"),
        "report" => ("the report of a plan", RESULT),
        "certificates" => ("a file of certificates", RESULT),
        "solution-space" => ("a solution space", RESULT),
        "verification" => ("the report of a verification", RESULT),
        "lengths" => ("a report on lengths", RESULT),
        "rapids" => ("a report on links", RESULT),
        "timings" => ("a file of timings", RESULT),
        "summary" => ("a summary of a plan", RESULT),
        "job-report" => ("the report on a planned job", RESULT),
        "batch" => ("a batch of jobs", "`facemill batch run` takes it"),
        _ => return Some(("a file of another format", NAMED)),
    })
}

/// Recognizes a file that is not JSON by its name.
fn text_format(path: &Path) -> Option<(&'static str, &'static str)> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    if MeshFormat::from_extension(&ending).is_some() {
        return Some((
            "a mesh",
            "give a job that names it in `setups[0].meshes`; `facemill new patch DIR` writes an example",
        ));
    }
    match ending.as_str() {
        "nc" | "mpf" | "spf" | "h" | "ngc" | "eia" | "tap" | "cnc" => {
            Some(("an NC program by its name", "`facemill verify` and `facemill feedrate` take programs"))
        }
        "apt" | "cls" | "ncl" | "cl" => Some(("a CL file by its name", "give the job that it was made from")),
        _ => None,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/load/job_source.rs"]
mod tests;
