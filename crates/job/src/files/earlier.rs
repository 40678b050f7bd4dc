//! Files of an earlier plan in the folder that a plan writes to.

use std::path::{Path, PathBuf};

use facemill_nc_program::Dialect;

use crate::failure::Failure;
use crate::files::REJECTED;

/// Part of the names of files of an earlier plan, from the beginning of the next plan on.
const EARLIER: &str = ".earlier";

/// Extension of APT files, which a plan writes for every control.
const APT: &str = "apt";

/// Suffixes of program names behind the setup: none, or that of a head, a channel or a main program
/// with subprograms.
const PROGRAMS: [&str; 6] = ["", "-head-1", "-head-2", "-channel-1", "-channel-2", "-main"];

/// First parts of the names of tables for the control.
const TABLES: [&str; 2] = ["tool-table", "work-offset"];

/// Endings of such tables besides those of programs.
const TABLE_ENDINGS: [&str; 4] = ["tbl", "spf", "t", "pr"];

/// Mark at the begin of subprograms in files of their own.
const SUBPROGRAM: &[u8] = b" - SUBPROGRAM OF ";

/// Bytes at whose end the mark has come.
const SUBPROGRAM_BEGIN: usize = 400;

/// Renames the files that an earlier plan wrote to a folder with `.earlier`, so that no program
/// looks current while a plan runs, or after one that failed. Returns the old names, in order; none
/// if the folder does not exist.
///
/// # Errors
/// [`Failure::Write`], naming the file.
pub fn set_aside_earlier(folder: &Path) -> Result<Vec<String>, Failure> {
    let mut moved: Vec<String> = Vec::new();
    for name in of_plans(folder, &[]).into_iter().filter(|name| !name.contains(EARLIER)) {
        let from = folder.join(&name);
        let Some((stem, extension)) = name.rsplit_once('.') else { continue };
        std::fs::rename(&from, folder.join(format!("{stem}{EARLIER}.{extension}")))
            .map_err(|source| Failure::Write { file: from, source })?;
        moved.push(name);
    }
    Ok(moved)
}

/// Returns the files of earlier plans in a folder that the files now written replace.
pub(super) fn replaced_by(folder: &Path, written: &[(String, Vec<u8>)]) -> Vec<PathBuf> {
    let names = of_plans(folder, written).into_iter();
    names.filter(|name| written.iter().all(|(new, _)| new != name)).map(|name| folder.join(name)).collect()
}

/// Returns the names of the files in a folder that a plan writes: those of a job with one setup,
/// those that our reports in the folder list, and those now written. Names alone decide, so that a
/// program of another name is not touched; but of pages their content, too: `report.html` is also a
/// name that other programs give.
fn of_plans(folder: &Path, written: &[(String, Vec<u8>)]) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_file = |e: &std::fs::DirEntry| e.file_type().is_ok_and(|t| t.is_file() || t.is_symlink());
    let mut there: Vec<String> = entries.filter(is_file).filter_map(|e| e.file_name().into_string().ok()).collect();
    there.sort();
    let mut kin = Kin::default();
    written.iter().for_each(|(name, _)| kin.learn(name));
    for (name, report) in there.iter().filter_map(|name| Some((name, our_report(&folder.join(name))?))) {
        kin.learn(name);
        programs_of(&report).for_each(|program| kin.learn(program));
    }
    there.retain(|name| {
        let is_ours = kin.has(name) && (!name.ends_with(".html") || is_page(&folder.join(name)));
        is_ours || kin.is_subprogram(name) && is_subprogram(&folder.join(name))
    });
    there
}

/// Recognized parts of the names of a plan's files.
struct Kin {
    /// Suffixes of setups.
    suffixes: Vec<String>,
    /// Extensions of programs.
    endings: Vec<String>,
}

impl Default for Kin {
    fn default() -> Self {
        let endings = Dialect::ALL.map(|d| d.file().program.extension).into_iter().chain([APT.to_owned()]).collect();
        Self { suffixes: vec![String::new()], endings }
    }
}

impl Kin {
    /// Learns from the name of one of our files.
    fn learn(&mut self, name: &str) {
        let Some((stem, ending)) = name.rsplit_once('.') else { return };
        let stem = clean(stem);
        if let Some(suffix) = stem.strip_prefix("report").filter(|_| ending == "json") {
            self.suffixes.push(suffix.to_owned());
            self.suffixes.extend(before_tool(suffix).map(str::to_owned));
        }
        if stem.starts_with("program") && !["json", "svg", "csv", "html"].contains(&ending) {
            self.endings.push(ending.to_owned());
        }
    }

    fn has(&self, name: &str) -> bool {
        let Some((stem, ending)) = name.rsplit_once('.') else { return false };
        let stem = clean(stem);
        let is_of = |what: &str| stem.strip_prefix(what).is_some_and(|s| self.suffixes.iter().any(|known| known == s));
        // Several operations have a number each.
        let is_passes = || {
            let without_number = stem.trim_end_matches(|c: char| c.is_ascii_digit());
            let of =
                |stem: &str| stem.strip_prefix("passes").is_some_and(|s| self.suffixes.iter().any(|known| known == s));
            of(stem) || (without_number != stem && without_number.strip_suffix('-').is_some_and(of))
        };
        let is_program = || {
            let of_setup = |known: &String| PROGRAMS.iter().any(|which| stem == format!("program{known}{which}"));
            self.endings.iter().any(|known| known == ending) && self.suffixes.iter().any(of_setup)
        };
        let is_table = || {
            let is_known = self.endings.iter().any(|known| known == ending) || TABLE_ENDINGS.contains(&ending);
            is_known && TABLES.iter().any(|table| is_of(table))
        };
        match ending {
            "json" => {
                is_of("report")
                    || is_of("certificates")
                    || is_of("postures")
                    || is_passes()
                    || ["timings", "job-report"].contains(&stem)
            }
            "csv" => is_of("chips"),
            "html" => is_of("report") || is_of("setup-sheet") || stem == "job-report",
            "svg" => is_of("chips") || is_of("solution-space") || is_passes(),
            _ => is_program() || is_table(),
        }
    }

    /// Returns whether a name may be that of a subprogram: `O2001.nc`, `PASS_1001_1.SPF`.
    fn is_subprogram(&self, name: &str) -> bool {
        let Some((stem, ending)) = name.rsplit_once('.') else { return false };
        let stem = clean(stem).to_uppercase();
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit() || b == b'_');
        let ending = ending.to_lowercase();
        let is_known = self.endings.contains(&ending) || TABLE_ENDINGS.contains(&ending.as_str());
        is_known && ["O", "PASS_", "OPERATION_"].iter().any(|first| stem.strip_prefix(first).is_some_and(digits))
    }
}

/// Returns the suffix of the program that changes tools from that of one of its tools: `-up` from
/// `-up-1-mill`.
fn before_tool(suffix: &str) -> Option<&str> {
    let parts: Vec<(usize, &str)> = suffix.match_indices('-').map(|(at, _)| (at, &suffix[at + 1..])).collect();
    let number =
        |rest: &str| rest.split('-').next().is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    parts.iter().rev().find(|(at, rest)| *at > 0 && number(rest)).map(|(at, _)| &suffix[..*at])
}

/// Returns a name without the marks of an earlier plan and of faults.
fn clean(stem: &str) -> &str {
    let stem = stem.strip_suffix(EARLIER).unwrap_or(stem);
    stem.strip_suffix(REJECTED).unwrap_or(stem)
}

/// Largest report that is read, bytes.
const LARGEST_REPORT: u64 = 1 << 28;

/// Mark in every page of this program, of any version.
const PAGE: &[u8] = b"facemill-page/";

/// Returns whether a file is a page of this program.
pub(super) fn is_page(file: &Path) -> bool {
    let bytes = super::input::read_at_most(file, LARGEST_REPORT);
    bytes.is_ok_and(|bytes| bytes.windows(PAGE.len()).any(|part| part == PAGE))
}

/// Returns whether a file is a subprogram that a plan wrote.
fn is_subprogram(file: &Path) -> bool {
    let bytes = super::input::read_at_most(file, LARGEST_REPORT).unwrap_or_default();
    let begin = &bytes[..bytes.len().min(SUBPROGRAM_BEGIN)];
    begin.windows(SUBPROGRAM.len()).any(|part| part == SUBPROGRAM)
}

/// Returns a report of a plan of this program, of any version.
fn our_report(file: &Path) -> Option<serde_json::Value> {
    let name = file.file_name()?.to_str()?;
    if !name.starts_with("report") || !name.ends_with(".json") {
        return None;
    }
    let report: serde_json::Value =
        serde_json::from_slice(&super::input::read_at_most(file, LARGEST_REPORT).ok()?).ok()?;
    let is_ours = report.get("format")?.as_str()?.starts_with("facemill-report/");
    is_ours.then_some(report)
}

/// Returns the names of the programs that a report lists; none for the report of an earlier
/// version.
fn programs_of(report: &serde_json::Value) -> impl Iterator<Item = &str> {
    let programs = report.get("programs").and_then(serde_json::Value::as_array).into_iter().flatten();
    programs.filter_map(|program| program.get("file")?.as_str())
}
