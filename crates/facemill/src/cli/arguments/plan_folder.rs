//! Programs in the folder that a plan wrote.

use std::path::{Path, PathBuf};

use facemill::formats::{MadeFrom, ProgramStamp};
use facemill::{Failure, Job, JobSetting, files};
use serde_json::Value;

/// Returns the reports of a folder with the parts of their names behind `report`, in order.
pub(crate) fn reports_in(folder: &Path) -> Result<Vec<(String, Value)>, Failure> {
    let entries = std::fs::read_dir(folder).map_err(|source| Failure::Read { file: folder.to_owned(), source })?;
    let mut names: Vec<String> = entries.flatten().filter_map(|e| e.file_name().into_string().ok()).collect();
    names.sort();
    let mut reports = Vec::new();
    let mut others = Vec::new();
    for name in names.into_iter().filter(|name| !name.contains(".earlier")) {
        let Some(suffix) = name.strip_prefix("report").and_then(|n| n.strip_suffix(".json")) else { continue };
        let report = match serde_json::from_slice::<Value>(&files::read(&folder.join(&name))?) {
            Ok(report) => report,
            Err(why) => {
                others.push((name, format!("is no JSON: {why}: plan again")));
                continue;
            }
        };
        match report.get("format").and_then(Value::as_str) {
            Some(facemill::report::REPORT_FORMAT) => reports.push((suffix.to_owned(), report)),
            Some(other) if other.starts_with("facemill-report/") => {
                let ours = facemill::report::REPORT_FORMAT;
                others.push((name, format!("format is \"{other}\", and this version reads \"{ours}\": plan again")));
            }
            // A report of another program; but under this name it is missed.
            _ if suffix.is_empty() => others.push((name, "format is not that of a report of a plan".to_owned())),
            _ => {}
        }
    }
    let of_ours = |(name, _): &&(String, String)| name == "report.json" || reports.is_empty();
    if let Some((name, why)) = others.iter().find(of_ours) {
        return Err(Failure::input(&folder.join(name), why.clone()));
    }
    for (name, why) in others {
        eprintln!("facemill: {} is left out: {why}", folder.join(name).display());
    }
    if reports.is_empty() {
        return Err(Failure::input(folder, "has no report.json: give the folder that `facemill plan` wrote"));
    }
    Ok(reports)
}

/// Checks that the files of a job are those that a plan was made from: another part would show
/// what the program was not planned for.
pub(crate) fn check_inputs(job: &Job, result: &Value) -> Result<(), String> {
    let now = MadeFrom::of(job).inputs;
    let then: Vec<(&str, &str)> = result
        .pointer("/made_from/inputs")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .filter_map(|i| Some((i.get("file")?.as_str()?, i.get("blake3")?.as_str()?)))
        .collect();
    let other = now.iter().find(|n| !then.contains(&(n.file.as_str(), n.blake3.as_str())));
    match other {
        None => Ok(()),
        Some(file) => Err(format!(
            "the plan was not made from {} as it is now ({}): plan again, or name the plan's job with --job",
            file.file,
            job.path.display()
        )),
    }
}

/// Returns the name of the program of a report.
pub(crate) fn program_of(result: &Value) -> Option<&str> {
    result.pointer("/programs/0/file")?.as_str()
}

/// Checks that a program is the one that a report describes.
pub(crate) fn check_program(result: &Value, name: &str, text: &[u8]) -> Result<(), String> {
    let stamp = ProgramStamp::new(Path::new(name), text);
    let listed = result.pointer("/programs/0/blake3").and_then(Value::as_str);
    if listed == Some(stamp.blake3.as_str()) {
        return Ok(());
    }
    Err(format!("describes another {name} than the one in the folder: the program was changed; use `facemill view`"))
}

/// Returns the settings that replaced values of the job.
pub(crate) fn settings_of(result: &Value) -> Result<Vec<JobSetting>, String> {
    let listed = result.get("settings").and_then(Value::as_array).into_iter().flatten();
    let setting = |s: &Value| {
        let key = s.get("key").and_then(Value::as_str).ok_or("a setting has no key")?;
        format!("{key}={}", s.get("value").unwrap_or(&Value::Null)).parse::<JobSetting>().map_err(|e| e.to_string())
    };
    listed.map(setting).collect()
}

/// Program of a plan, as it is written.
pub(crate) struct PlanProgram {
    /// Index of its setup.
    pub(crate) setup: usize,
    pub(crate) path: PathBuf,
    pub(crate) text: Vec<u8>,
}

/// Reads the job of a plan's folder, with the settings of the plan, and the programs of its setups
/// by the index of the setup. Rejected programs are not among them.
///
/// # Errors
/// If the plan is of another job, its reports have different settings, a file cannot be read, or a
/// program was changed.
pub(crate) fn programs_of_plan(job: &Path, folder: &Path) -> Result<(Job, Vec<PlanProgram>), Failure> {
    let reports = reports_in(folder)?;
    let at = |suffix: &str| folder.join(format!("report{suffix}.json"));
    let (first, report) = &reports[0];
    let settings = settings_of(report).map_err(|why| Failure::input(&at(first), why))?;
    let job = Job::read_with(job, &settings)?;
    let mut programs = Vec::new();
    for (suffix, other) in &reports {
        let wrong = |why: String| Failure::input(&at(suffix), why);
        check_inputs(&job, other).map_err(wrong)?;
        if other.get("settings") != report.get("settings") {
            return Err(wrong(format!("has other settings than report{first}.json: plan all setups alike")));
        }
        let setup = other.get("setup").and_then(Value::as_str).unwrap_or_default();
        let index = job.file.setups.iter().position(|s| s.name == setup);
        let index = index.ok_or_else(|| wrong(format!("the job has no setup \"{setup}\"")))?;
        // Where nothing is to be cut, there is no program; a rejected one does not run.
        let Some(name) = program_of(other) else { continue };
        if name.contains(files::REJECTED) {
            eprintln!("facemill: {} is left out: the plan rejected it", folder.join(name).display());
            continue;
        }
        let path = folder.join(name);
        let text = files::read(&path)?;
        check_program(other, name, &text).map_err(wrong)?;
        programs.push(PlanProgram { setup: index, path, text });
    }
    programs.sort_by_key(|program| program.setup);
    Ok((job, programs))
}
