//! A job file for another folder: the files that it names stay the same.

use std::path::{Component, Path, PathBuf};

use facemill_cc_path::files::ProgramWithToolFile;

use crate::files::output_place::folder_of;
use crate::format::job_file::{JobFile, PathFile, StockFile};

/// Returns the content of a job file for another place: relative names of files lead from there to
/// the files that they lead to from the job's own place.
///
/// A job in another folder names files outside its own, which a command reads with `--allow`.
pub fn moved_job(file: &JobFile, from: &Path, to: &Path) -> JobFile {
    let mut moved = file.clone();
    let [from, to] = [from, to].map(|file| known(folder_of(file)));
    if from != to {
        let way = way_between(&to, &from);
        let names = names_mut(&mut moved).into_iter().filter(|name| Path::new(name.as_str()).is_relative());
        names.for_each(|name| *name = format!("{way}/{name}"));
    }
    moved
}

/// Returns a folder as the system resolves it; of one that does not exist, the part that does.
fn known(folder: &Path) -> PathBuf {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let resolved = |part: &Path| Some(part.canonicalize().ok()?.join(whole.strip_prefix(part).ok()?));
    whole.ancestors().find_map(resolved).unwrap_or_else(|| whole.clone())
}

/// Returns the way from a folder to another, with `/` between names on every system; without a
/// common root the other's own path.
fn way_between(from: &Path, to: &Path) -> String {
    let [up, down]: [Vec<Component<'_>>; 2] = [from, to].map(|path| path.components().collect());
    let common = up.iter().zip(&down).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return to.to_string_lossy().into_owned();
    }
    let ups = std::iter::repeat_n("..".to_owned(), up.len() - common);
    let names = down[common..].iter().map(|name| name.as_os_str().to_string_lossy().into_owned());
    ups.chain(names).collect::<Vec<String>>().join("/")
}

/// Returns the names of files in a job file.
fn names_mut(file: &mut JobFile) -> Vec<&mut String> {
    let mut names = vec![&mut file.machine];
    names.extend(file.tools.values_mut());
    names.extend(
        [&mut file.tool, &mut file.second_tool, &mut file.post.template, &mut file.post.dialect_file]
            .into_iter()
            .flatten(),
    );
    for setup in &mut file.setups {
        names.extend(setup.meshes.iter_mut().map(|mesh| &mut mesh.file));
        if let StockFile::Mesh(mesh) = &mut setup.stock {
            names.push(&mut mesh.file);
        }
        names.extend(setup.programs_before.iter_mut().flat_map(ProgramWithToolFile::files_mut));
    }
    for operation in &mut file.operations {
        let region = match &mut operation.path {
            PathFile::File(path) => {
                names.push(&mut path.file);
                &mut path.region
            }
            PathFile::Cl(path) => {
                names.push(&mut path.file);
                &mut path.region
            }
            PathFile::Strategy(strategy) => &mut strategy.region,
        };
        names.extend(region.left_above.iter_mut().flat_map(|left| left.of.files_mut()));
    }
    names
}

#[cfg(test)]
#[path = "../../tests/unit/format/moved_job.rs"]
mod tests;
