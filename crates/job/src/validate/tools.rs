//! Tools of a job by name: which operation has which, and a setup for each of them.

use std::collections::BTreeSet;

use crate::format::job_file::{JobFile, MeshFile, OperationFile, RoleFile, SetupFile};
use crate::validate::layers::{measure_behind_programs, with_layers};
use crate::validate::setup_names::{belongs, file_stem};

/// Returns the first fault of the names of a job's tools as `field: what it must be`.
///
/// # Errors
/// If there is one.
pub(crate) fn check_tool_names(job: &JobFile) -> Result<(), String> {
    let names = || job.tools.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    match (&job.tool, job.tools.is_empty()) {
        (None, true) => return Err("tool: is needed, a tool file, or several of them by name in `tools`".to_owned()),
        (Some(_), false) => {
            return Err(format!("tool: leave it out beside `tools` ({}): each operation names one of these", names()));
        }
        _ => {}
    }
    if job.tools.contains_key("") {
        return Err("tools: a tool has no name; give it one".to_owned());
    }
    for (k, operation) in job.operations.iter().enumerate() {
        match &operation.tool {
            Some(name) if job.tools.is_empty() => {
                return Err(format!(
                    "operations[{k}].tool: names \"{name}\", but the job has one tool file (`tool`); put it into `tools` \
                     under this name, or leave the name out"
                ));
            }
            Some(name) if !job.tools.contains_key(name) => {
                return Err(format!("operations[{k}].tool: there is no tool \"{name}\" in `tools`: {}", names()));
            }
            None if job.tools.len() > 1 => {
                return Err(format!("operations[{k}].tool: is needed because there are several tools: {}", names()));
            }
            _ => {}
        }
    }
    check_names_by_tool(job)
}

/// Refuses setups whose names and tools give one name twice.
fn check_names_by_tool(job: &JobFile) -> Result<(), String> {
    let by_tool = setups_by_tool(job.clone());
    // The program that changes tools has the name of its setup.
    let several = |k: &usize| by_tool.written.iter().filter(|written| *written == k).count() > 1;
    let joined = (0..job.setups.len()).filter(several).map(|k| &job.setups[k]);
    let mut known = BTreeSet::new();
    match by_tool.file.setups.iter().chain(joined).find(|setup| !known.insert(file_stem(&setup.name))) {
        None => Ok(()),
        Some(setup) => Err(format!(
            "setups: the programs of a setup with several tools are named by setup and tool, and \"{}\" is named twice; name \
             a setup or a tool otherwise",
            setup.name
        )),
    }
}

/// Returns the name of an operation's tool; `None` in a job with one tool file.
pub(crate) fn tool_of<'f>(job: &'f JobFile, operation: &'f OperationFile) -> Option<&'f str> {
    let only = job.tools.keys().next().filter(|_| job.tools.len() == 1);
    operation.tool.as_ref().or(only).map(String::as_str)
}

/// Returns the name of the tool of a setup's operations, which all have one after
/// [`setups_by_tool`].
pub(crate) fn tool_of_setup<'f>(job: &'f JobFile, setup: &SetupFile) -> Option<&'f str> {
    job.operations.iter().find(|o| belongs(o, setup, job)).and_then(|o| tool_of(job, o))
}

/// Name of the tool of a job with one tool file, in the names of programs.
pub(crate) const ONLY_TOOL: &str = "tool";

/// A job with one tool in each setup, and where its setups come from.
pub(crate) struct JobByTool {
    pub(crate) file: JobFile,
    /// Index of each setup in the job as it is written.
    pub(crate) written: Vec<usize>,
}

/// Returns a job in which each setup has operations of one tool that leave the same, so that each
/// has a program of one tool and one surface: layers become operations, and a setup becomes one for
/// each sequence of operations with the same tool and allowance, in their order, all with its
/// meshes, mounting, stock and offsets; the allowance becomes that of the drive surface. Its name
/// gets number and tool behind: `"up"` becomes `"up 1 mill"` and `"up 2 ball"`. A job that is so
/// already stays as it is.
pub(crate) fn setups_by_tool(job: JobFile) -> JobByTool {
    let (job, is_layer) = with_layers(job);
    let mut by_tool = partitioned(job);
    for setup in &mut by_tool.file.setups {
        let operations = &mut by_tool.file.operations;
        let n_setups = by_tool.written.len();
        let is_of = |o: &OperationFile| n_setups == 1 || o.setup.as_ref() == Some(&setup.name);
        let (mut allowance, mut is_level) = (0.0, false);
        for operation in operations.iter_mut().filter(|o| is_of(o)) {
            allowance = std::mem::take(&mut operation.allowance_mm);
            is_level = operation.levels.is_some();
        }
        // A level lies beside all of the part.
        let is_left_on = |mesh: &&mut MeshFile| mesh.role == RoleFile::Drive || is_level && mesh.role == RoleFile::Part;
        setup.meshes.iter_mut().filter(is_left_on).for_each(|mesh| mesh.allowance_mm += allowance);
    }
    measure_behind_programs(&mut by_tool.file, &is_layer);
    by_tool
}

fn partitioned(job: JobFile) -> JobByTool {
    let mut all = JobFile { setups: Vec::new(), ..job.clone() };
    let mut written = Vec::new();
    for (k, setup) in job.setups.iter().enumerate() {
        let of_setup: Vec<usize> =
            (0..job.operations.len()).filter(|&o| belongs(&job.operations[o], setup, &job)).collect();
        let tool = |o: &usize| tool_of(&job, &job.operations[*o]);
        let key = |o: &usize| (tool(o), job.operations[*o].allowance_mm.to_bits());
        // Each level has a surface of its own.
        let is_level = |o: &usize| job.operations[*o].levels.is_some();
        let is_one = |a: &usize, b: &usize| key(a) == key(b) && !is_level(a) && !is_level(b);
        let rows: Vec<&[usize]> = of_setup.chunk_by(is_one).collect();
        if rows.len() < 2 {
            all.setups.push(setup.clone());
            written.push(k);
            // With more setups than before, each operation says which it is of.
            of_setup.iter().for_each(|&o| all.operations[o].setup = Some(setup.name.clone()));
            continue;
        }
        for (number, row) in (1..).zip(rows) {
            let name = format!("{} {number} {}", setup.name, tool(&row[0]).unwrap_or(ONLY_TOOL));
            row.iter().for_each(|&o| all.operations[o].setup = Some(name.clone()));
            all.setups.push(SetupFile { name, ..setup.clone() });
            written.push(k);
        }
    }
    if all.setups.len() == job.setups.len() {
        return JobByTool { file: job, written };
    }
    JobByTool { file: all, written }
}

/// Returns the number of programs of a job: one for each tool of each setup, in the order of its
/// operations.
pub fn n_programs(job: JobFile) -> usize {
    setups_by_tool(job).file.setups.len()
}

#[cfg(test)]
#[path = "../../tests/unit/validate/tools.rs"]
mod tests;
