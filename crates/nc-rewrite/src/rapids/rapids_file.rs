//! Report on links before and after.

use facemill_job::duration_text::clock;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::verification_file::CalledFile;
use facemill_tool_path::links::link_paths::RetractStrategy;
use schemars::JsonSchema;
use serde::Serialize;

/// Value of the key `format` in the file.
pub const RAPIDS_FORMAT: &str = "facemill-rapids/1";

/// Links of a program before and after.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RapidsFile {
    /// Always "facemill-rapids/1".
    pub format: &'static str,
    /// Name of the job.
    pub job: String,
    /// Name of the setup.
    pub setup: String,
    /// The original program.
    pub program: ProgramStamp,
    /// Files of subprograms whose calls were expanded, in the order of their first calls; empty
    /// without. Lines count on from file to file, the program first: each says where it begins.
    pub called_files: Vec<CalledFile>,
    /// BLAKE3 checksum of the new program.
    pub new_program_blake3: String,
    /// Control that the program was read for.
    pub dialect: String,
    /// Distance kept from stock and fixtures, mm.
    pub clearance_mm: f64,
    /// Whether times are within acceleration and jerk of every axis; else within their velocities
    /// alone, because the machine file lacks other limits.
    pub by_acceleration_and_jerk: bool,
    /// Time of all original links, s.
    pub time_before_s: f64,
    /// Time of all new links, s.
    pub time_after_s: f64,
    /// Sum over all links of the time of the slowest axis by itself, without obstacles: no links
    /// are faster, s.
    pub lower_bound_s: f64,
    /// `time_after_s` by `lower_bound_s`; `null` without links.
    pub ratio_to_lower_bound: Option<f64>,
    /// Number of changed links.
    pub changed: usize,
    /// Number of findings of the original program and of the new one.
    pub findings: [usize; 2],
    /// All links, in program order.
    pub links: Vec<LinkReport>,
}

/// One link.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LinkReport {
    /// Its first and last line in the original program; lines of called files count on.
    pub lines: [u32; 2],
    /// Its first and last line in the new program.
    pub new_lines: [u32; 2],
    /// Original time, s.
    pub time_before_s: f64,
    /// New time, s.
    pub time_after_s: f64,
    /// Time of its slowest axis by itself, without obstacles: no link is faster, s.
    pub lower_bound_s: f64,
    /// Its new path.
    pub way: RetractStrategy,
    /// Line of the original program that `kept_because` is about, if it is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept_line: Option<u32>,
    /// Reason why it was not examined, or was restored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept_because: Option<String>,
}

impl LinkReport {
    /// Returns why it was not examined, or was restored, with the line that this is about.
    #[must_use]
    pub fn kept_text(&self) -> Option<String> {
        let why = self.kept_because.as_ref()?;
        Some(self.kept_line.map_or_else(|| why.clone(), |line| format!("line {line}: {why}")))
    }
}

/// Largest number of links in the table; the file has them all.
const TOLD: usize = 60;

impl RapidsFile {
    /// Replaces every line of the original program, for one that was run with its calls expanded.
    pub fn map_lines(&mut self, line_of: impl Fn(u32) -> u32) {
        let lines = self.links.iter_mut().flat_map(|link| link.lines.iter_mut().chain(&mut link.kept_line));
        lines.for_each(|line| *line = line_of(*line));
    }

    /// Returns the file as a table to read.
    #[must_use]
    pub fn table(&self) -> String {
        let within = if self.by_acceleration_and_jerk { "velocity, acceleration and jerk" } else { "velocity alone" };
        let ratio = self.ratio_to_lower_bound.map_or_else(String::new, |r| format!("; {r:.2} times the lower bound"));
        let mut out = format!(
            "{} - {}, read as {}\n  links             {}, {} with another way\n  time of links     {} before, {} after{ratio}\n  \
             timed within      {within}\n  findings          {} before, {} after\n",
            self.job,
            self.setup,
            self.dialect,
            self.links.len(),
            self.changed,
            clock(self.time_before_s),
            clock(self.time_after_s),
            self.findings[0],
            self.findings[1]
        );
        if !self.links.is_empty() {
            out.push_str("     lines           before s    after s    bound s  way\n");
        }
        for link in self.links.iter().take(TOLD) {
            let lines = format!("{}-{}", link.lines[0], link.lines[1]);
            let why = link.kept_text().map_or_else(String::new, |why| format!(": {why}"));
            out.push_str(&format!(
                "     {lines:<13} {:>10.3} {:>10.3} {:>10.3}  {}{why}\n",
                link.time_before_s, link.time_after_s, link.lower_bound_s, link.way
            ));
        }
        if self.links.len() > TOLD {
            out.push_str(&format!("     and {} more; --report writes them all\n", self.links.len() - TOLD));
        }
        out
    }
}
