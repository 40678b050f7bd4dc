//! Files in the folder of a program, by the names that calls may mean.

use std::collections::BTreeMap;
use std::path::Path;

/// Files in the folder of a program, by their names in lower case.
#[derive(Default)]
pub(crate) struct FilesBeside(BTreeMap<String, Vec<String>>);

impl FilesBeside {
    /// Lists the regular files of a folder. A link is none: it may lead out of the folder.
    pub(crate) fn of(folder: &Path) -> Self {
        let mut files = Self::default();
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let regular = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
        for name in regular.filter_map(|entry| entry.file_name().into_string().ok()) {
            files.add(name);
        }
        files
    }

    /// Returns files of these names.
    pub(crate) fn of_names<'a>(names: impl Iterator<Item = &'a String>) -> Self {
        let mut files = Self::default();
        names.for_each(|name| files.add(name.clone()));
        files
    }

    fn add(&mut self, name: String) {
        self.0.entry(name.to_ascii_lowercase()).or_default().push(name);
    }

    /// Returns the file that has the first of these names that exists: in this case, else, where
    /// the control does not tell cases apart, in any if it is the only one.
    pub(crate) fn named(&self, names: &[String], has_cases: bool) -> Option<&str> {
        names.iter().find_map(|name| {
            let alike = self.0.get(&name.to_ascii_lowercase())?;
            let exact = alike.iter().find(|file| *file == name);
            let only = if has_cases || alike.len() > 1 { None } else { alike.first() };
            exact.or(only).map(String::as_str)
        })
    }
}

#[cfg(test)]
#[path = "../tests/unit/files_beside.rs"]
mod tests;
