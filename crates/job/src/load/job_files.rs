//! Files that a job names, on disk or in memory.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use facemill_file_format::to_json;
use facemill_inverse_kinematics::machine_file::MachineFile;
use facemill_tool_model::ToolFile;

use crate::failure::Failure;
use crate::files;

/// Files that a job names: those in memory, and the others in a folder, if it has one.
///
/// A name is relative to the job file, as in the job. Of a file in memory nothing is read from
/// disk, also if the folder has a file of its name.
#[derive(Clone, Debug, Default)]
pub struct JobFiles {
    folder: Option<PathBuf>,
    held: Arc<BTreeMap<PathBuf, Vec<u8>>>,
    /// Whether nothing is read from the folder.
    is_complete: bool,
}

impl JobFiles {
    /// Returns the files in a folder, none of them in memory. The default has no folder.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()), ..Self::default() }
    }

    /// Adds a file in memory, or replaces it: a mesh, a path file, a template; in the format that
    /// its ending names.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        let path = self.path(name);
        Arc::make_mut(&mut self.held).insert(path, bytes.into());
        self
    }

    /// Adds a tool file in memory.
    #[must_use]
    pub fn with_tool(self, name: &str, tool: &ToolFile) -> Self {
        self.with(name, to_json(tool))
    }

    /// Adds a machine file in memory.
    #[must_use]
    pub fn with_machine(self, name: &str, machine: &MachineFile) -> Self {
        self.with(name, to_json(machine))
    }

    /// Returns these files without those that are not in memory: another one is an error.
    pub(crate) fn only_held(self) -> Self {
        Self { is_complete: true, ..self }
    }

    /// Returns the path of a file of this name.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.as_deref().unwrap_or(Path::new("")).join(name)
    }

    /// Records the file of this path as an input, if it is on disk.
    pub(crate) fn note_input(&self, path: &Path) {
        if !self.held.contains_key(path) {
            files::note_input(path);
        }
    }

    /// Returns the content of a file that people write: a tool, a machine, a template.
    ///
    /// # Errors
    /// As [`files::read_named_text`], and if the file is not in memory and there is no folder.
    pub(crate) fn text(&self, path: &Path) -> Result<Cow<'_, [u8]>, Failure> {
        self.get(path, files::read_named_text)
    }

    /// Returns the content of a mesh or path file.
    ///
    /// # Errors
    /// As [`files::read_named`], and if the file is not in memory and there is no folder.
    pub(crate) fn bytes(&self, path: &Path) -> Result<Cow<'_, [u8]>, Failure> {
        self.get(path, files::read_named)
    }

    /// Returns the content of a file that a mesh names.
    pub(crate) fn beside(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        match (self.held.get(path), &self.folder) {
            (Some(bytes), _) => Ok(bytes.clone()),
            (None, Some(_)) if self.is_complete => Err(std::io::Error::other(NOT_LISTED)),
            (None, Some(_)) => files::read_beside(path),
            (None, None) => Err(std::io::Error::new(std::io::ErrorKind::NotFound, NOT_HELD)),
        }
    }

    fn get(&self, path: &Path, read: fn(&Path) -> Result<Vec<u8>, Failure>) -> Result<Cow<'_, [u8]>, Failure> {
        match (self.held.get(path), &self.folder) {
            (Some(bytes), _) => Ok(Cow::Borrowed(bytes)),
            (None, Some(_)) if self.is_complete => Err(Failure::Internal(format!("{}: {NOT_LISTED}", path.display()))),
            (None, Some(_)) => read(path).map(Cow::Owned),
            (None, None) => Err(Failure::input(path, NOT_HELD)),
        }
    }
}

const NOT_HELD: &str = "is not among the files of this job in memory; add it to its `JobFiles`, or give them a folder";

const NOT_LISTED: &str = "is not among the inputs of the job that were read at first; please report this";

#[cfg(test)]
#[path = "../../tests/unit/load/job_files.rs"]
mod tests;
