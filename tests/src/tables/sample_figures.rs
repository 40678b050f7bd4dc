//! Figures of the sample job in the pages, from the summary that its plan prints.

use crate::shared::workspace;

/// Pages with figures of the sample.
pub const PAGES: [&str; 3] = ["README.md", "docs/benchmarks.md", "docs/quick-start.md"];

/// Stored summary of the sample's plan.
pub const RECORD: &str = "tests/sample-summary.txt";

const START: &str = "<!-- sample ";
const END: &str = "<!-- end of sample -->";

/// Summary of the sample's plan, line by line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleFigures {
    lines: Vec<String>,
}

impl SampleFigures {
    /// Returns the figures in the text that `facemill plan` prints. The names of written files do
    /// not belong to them.
    pub fn of_summary(text: &str) -> Self {
        let lines = text.lines().take_while(|line| !line.starts_with("  written to "));
        Self { lines: lines.map(str::to_owned).collect() }
    }

    /// Returns the stored figures.
    ///
    /// # Errors
    /// If the record cannot be read.
    pub fn stored() -> Result<Self, String> {
        let text = std::fs::read_to_string(workspace().join(RECORD)).map_err(|e| format!("{RECORD}: {e}"))?;
        Ok(Self::of_summary(&text))
    }

    /// Returns the text of the record.
    pub fn text(&self) -> String {
        self.lines.join("\n") + "\n"
    }

    /// Returns the first line that differs from another plan's, of both.
    pub fn first_difference<'a>(&'a self, other: &'a Self) -> Option<[&'a str; 2]> {
        let line = |of: &'a Self, k: usize| of.lines.get(k).map_or("", String::as_str);
        let most = self.lines.len().max(other.lines.len());
        (0..most).map(|k| [line(self, k), line(other, k)]).find(|[a, b]| a != b)
    }

    /// Returns a page with these figures between its marks, `<!-- sample KEY -->` and
    /// `<!-- end of sample -->`.
    ///
    /// # Errors
    /// If a mark has no end or an unknown key, or the summary lacks the figure.
    pub fn rewritten(&self, page: &str) -> Result<String, String> {
        let (mut out, mut rest) = (String::new(), page);
        while let Some((before, marked)) = rest.split_once(START) {
            let (key, marked) = marked.split_once(" -->").ok_or_else(|| format!("{START}: has no end"))?;
            let (_, behind) = marked.split_once(END).ok_or_else(|| format!("{START}{key} -->: has no {END}"))?;
            let value = self.value(key).ok_or_else(|| format!("{START}{key} -->: the summary has no such figure"))?;
            out += &format!("{before}{START}{key} -->{value}{END}");
            rest = behind;
        }
        Ok(out + rest)
    }

    /// Returns the text of a figure.
    fn value(&self, key: &str) -> Option<String> {
        Some(match key {
            "summary" => self.shown()?,
            "passes" => self.words("passes")?.first()?.clone(),
            "points" => in_thousands(self.words("CC points")?.first()?.trim_end_matches(',')),
            "blocks" => in_thousands(self.words("blocks")?.first()?),
            "all_m" => format!("{} m", self.behind("cutting length")?),
            "passes_m" => format!("{} m", self.words("blocks")?.iter().rev().nth(5)?),
            "cutting" => format!("{} h", self.words("cutting time")?.first()?),
            "approach" => format!("{} h", self.words("of it not passes")?.first()?),
            "rapid" => format!("{} h", self.words("rapid time")?.first()?),
            "machine" => format!("{} h", clock(self.machine_seconds()?)),
            "machine_minutes" => {
                let minutes = (self.machine_seconds()? + 30) / 60;
                format!("{}:{:02} h", minutes / 60, minutes % 60)
            }
            "links" => self.words("links")?.get(2)?.clone(),
            "links_time" => without_hours(&self.behind("clearance surface:")?),
            "links_before" => without_hours(&self.behind("in place of")?),
            "links_ratio" => self.words("links")?.iter().rev().nth(5)?.clone(),
            "left" => {
                let line = self.words("left on surface")?;
                let number = |k: usize| Some(line.get(k)?.trim_end_matches(',').to_owned());
                format!("{}, {}, {} mm", number(3)?, number(7)?, number(10)?)
            }
            "left_most" => {
                let line = self.words("left on surface")?;
                format!("{} mm", line.get(line.iter().position(|word| word == "largest")? + 1)?)
            }
            "quick_turns" => self.words("quick turns")?.first()?.clone(),
            _ => return None,
        })
    }

    /// Returns the words of the line with this name.
    fn words(&self, name: &str) -> Option<Vec<String>> {
        let line = self.lines.iter().find_map(|line| line.strip_prefix("  ")?.strip_prefix(name));
        Some(line?.split_whitespace().map(str::to_owned).collect())
    }

    /// Returns the number behind these words, in the last line that has them.
    fn behind(&self, words: &str) -> Option<String> {
        let behind = self.lines.iter().rev().find_map(|line| Some(line.split_once(words)?.1))?;
        Some(behind.split_whitespace().next()?.trim_end_matches(',').to_owned())
    }

    /// Returns the time of cuts and rapids, s.
    fn machine_seconds(&self) -> Option<u32> {
        let cutting = seconds(self.words("cutting time")?.first()?)?;
        Some(cutting + seconds(self.words("rapid time")?.first()?)?)
    }

    /// Returns the summary as a block of code, up to the first assumption.
    fn shown(&self) -> Option<String> {
        let last = self.lines.iter().position(|line| line.starts_with("  assumptions "))? + 1;
        let shown = self.lines.get(..=last)?.iter().map(|line| format!("    {line}\n"));
        Some(format!("\n{}        …\n", shown.collect::<String>()))
    }
}

/// Returns seconds of hours, minutes and seconds.
fn seconds(text: &str) -> Option<u32> {
    text.split(':').try_fold(0, |sum, part| Some(60 * sum + part.parse::<u32>().ok()?))
}

fn clock(seconds: u32) -> String {
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

/// Returns a time below an hour as minutes and seconds.
fn without_hours(text: &str) -> String {
    text.strip_prefix("0:").unwrap_or(text).trim_start_matches('0').to_owned()
}

/// Returns a whole number with commas.
fn in_thousands(digits: &str) -> String {
    let n = digits.len();
    let comma = |k: usize| k > 0 && (n - k).is_multiple_of(3);
    digits.chars().enumerate().map(|(k, c)| if comma(k) { format!(",{c}") } else { c.to_string() }).collect()
}
