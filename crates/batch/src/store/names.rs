//! Names in a folder of results: of tasks, and of files that are not whole yet.

use std::path::Path;

/// Returns whether a text is a key: 64 hexadecimal digits.
pub fn is_key(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
}

/// Process that works in the folder: on this machine or another that shares it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Name of its machine.
    pub host: String,
    /// Its number there.
    pub process: u32,
}

impl Holder {
    /// Returns this process.
    pub(crate) fn own() -> Self {
        Self { host: host(), process: std::process::id() }
    }

    /// Returns whether the process is known to be gone: it was one of this machine. Where the
    /// system does not list its processes, every one is.
    pub(crate) fn is_gone(&self) -> bool {
        let state = || {
            let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.process)).ok()?;
            stat.rsplit(')').next()?.trim_start().chars().next()
        };
        // A dead one whose parent has not taken note is listed, too.
        self.host == host() && matches!(state(), None | Some('Z' | 'X'))
    }
}

/// Name of a folder in `tmp`, `KEY.HOST-PROCESS-N`: no two processes write into the same one, also
/// of two machines that both lock the task because their locks do not reach each other.
pub(crate) fn temporary_name(key: &str, n: usize) -> String {
    let Holder { host, process } = Holder::own();
    format!("{key}.{host}-{process}-{n}")
}

/// Reads the name of a folder in `tmp`: key and process. `None` of a name that is not ours.
pub(crate) fn read_temporary_name(name: &str) -> Option<(&str, Holder)> {
    let (key, rest) = name.split_once('.').filter(|(key, _)| is_key(key))?;
    let mut parts = rest.rsplitn(3, '-');
    parts.next()?.parse::<usize>().ok()?;
    let process = parts.next()?.parse().ok()?;
    Some((key, Holder { host: parts.next()?.to_owned(), process }))
}

/// Returns the name of this machine, as part of a file's name.
fn host() -> String {
    let name = host_name();
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
    if plain.is_empty() { "unknown".to_owned() } else { plain }
}

#[cfg(unix)]
fn host_name() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

#[cfg(not(unix))]
fn host_name() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_default()
}

/// Returns the names in a folder, in their order; none if it cannot be read.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort_unstable();
    names
}
