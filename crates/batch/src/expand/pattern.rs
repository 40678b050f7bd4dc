//! Names that match a pattern.

use std::path::Path;

use facemill_job::load::obstacle_meshes::matches_pattern;

/// Returns the files and folders below a folder that match a pattern with `*` within names, in the
/// order of their names, relative to the folder. Hidden ones match only a pattern that begins with
/// a dot.
///
/// # Errors
/// If a folder on the way cannot be read, or more than `most` match; none that does not exist.
pub(crate) fn matches(folder: &Path, pattern: &str, most: usize) -> Result<Vec<String>, String> {
    let mut found = vec![String::new()];
    for step in pattern.split('/').filter(|step| !step.is_empty() && *step != ".") {
        let mut next = Vec::new();
        for name in &found {
            let at = if name.is_empty() { folder.to_owned() } else { folder.join(name) };
            let joined = |entry: &str| if name.is_empty() { entry.to_owned() } else { format!("{name}/{entry}") };
            if !step.contains('*') {
                next.extend(at.join(step).exists().then(|| joined(step)));
                continue;
            }
            next.extend(entries(&at, step)?.iter().map(|entry| joined(entry)));
            if next.len() > most {
                return Err(format!("more than {most} files match; make several batches, or raise --max-tasks"));
            }
        }
        found = next;
    }
    found.retain(|name| !name.is_empty());
    Ok(found)
}

/// Returns the names in a folder that match one step of a pattern, in their order.
fn entries(folder: &Path, step: &str) -> Result<Vec<String>, String> {
    let at = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if !at.is_dir() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(at).map_err(|e| format!("cannot read {}: {e}", at.display()))?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> =
        names.filter(|name| matches_pattern(step, name) && (step.starts_with('.') || !name.starts_with('.'))).collect();
    names.sort_unstable();
    Ok(names)
}
