//! The dialects that come with the crate, and what makes a dialect file one that can be written
//! with.

pub(crate) mod beside_rule;
pub(crate) mod file;
pub(crate) mod post_file;
pub(crate) mod post_law;
pub(crate) mod post_vectors;
pub(crate) mod word_rule;

pub use crate::dialect::beside_rule::{
    SubprogramPart, SubprogramPlace, SubprogramRule, SubprogramRules, SubprogramsFile, TableForm,
};
pub use crate::dialect::file::{
    BlendingRule, CommentRule, ControlMotion, CornerRule, CuttingRule, DIALECT_FORMAT, Decimals, DialectFile, FeedRule,
    LimitedBy, LineRule, MotionRule, NumberRule, Numbering, ProgramRule, RapidRule, RotaryBlocks, RtcpLaw, RtcpRapids,
    RtcpRule, Switch, VectorRule,
};
pub use crate::dialect::post_file::{
    BlockNumbers, LAST_PROGRAM_NUMBER, Orientation, PostError, PostFile, RoundingBound, Template,
};
pub use crate::dialect::word_rule::{CoolantRule, HomeRule, HomeWords, LengthRule, OffsetRule, WordRule};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::program::{FeedMode, WorkOffset};

/// Control a program is written for or was written for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Dialect {
    /// FANUC 15M and later: G94 norm over all axes, G93, G43.4.
    #[default]
    Fanuc,
    /// Haas NGC: as FANUC, with G234.
    Haas,
    /// Mazak, EIA programs: as FANUC.
    Mazak,
    /// LinuxCNC: G93, G64 with a tolerance, RTCP by switched kinematics.
    #[serde(rename = "linuxcnc")]
    LinuxCnc,
    /// Siemens 840D and 840D sl, one channel: TRAORI with rotary words or tool vectors, CYCLE832.
    #[serde(rename = "siemens_840d")]
    Siemens840d,
    /// Heidenhain TNC, Klartext: FUNCTION TCPM, LN blocks with tool and normal vectors, cycle 32.
    Heidenhain,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Fanuc, Self::Haas, Self::Mazak, Self::LinuxCnc, Self::Siemens840d, Self::Heidenhain];

    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fanuc => "fanuc",
            Self::Haas => "haas",
            Self::Mazak => "mazak",
            Self::LinuxCnc => "linuxcnc",
            Self::Siemens840d => "siemens_840d",
            Self::Heidenhain => "heidenhain",
        }
    }

    /// The text of its dialect file: a start for one's own.
    #[must_use]
    pub fn source(self) -> &'static str {
        match self {
            Self::Fanuc => include_str!("../dialects/fanuc.json"),
            Self::Haas => include_str!("../dialects/haas.json"),
            Self::Mazak => include_str!("../dialects/mazak.json"),
            Self::LinuxCnc => include_str!("../dialects/linuxcnc.json"),
            Self::Siemens840d => include_str!("../dialects/siemens_840d.json"),
            Self::Heidenhain => include_str!("../dialects/heidenhain.json"),
        }
    }

    /// How its programs look.
    ///
    /// # Panics
    /// Never: the files that come with the crate are read by its tests.
    #[must_use]
    pub fn file(self) -> DialectFile {
        facemill_file_format::from_json(self.source().as_bytes()).expect("a dialect file of this crate")
    }

    /// The template that comes with it: a start for one's own.
    #[must_use]
    pub fn template(self) -> Template {
        let text = match self {
            Self::Fanuc => include_str!("../templates/fanuc.j2"),
            Self::Haas => include_str!("../templates/haas.j2"),
            Self::Mazak => include_str!("../templates/mazak.j2"),
            Self::LinuxCnc => include_str!("../templates/linuxcnc.j2"),
            Self::Siemens840d => include_str!("../templates/siemens_840d.j2"),
            Self::Heidenhain => include_str!("../templates/heidenhain.j2"),
        };
        Template { name: format!("{}.j2", self.name()), text: text.to_owned() }
    }
}

impl ControlMotion {
    /// The field that is not modelled, or cannot be meant, and why.
    fn fault(&self) -> Option<(&'static str, String)> {
        if !(1..=1_000_000).contains(&self.look_ahead_blocks) {
            let why = format!("is {}: it must be from 1 to 1000000 blocks", self.look_ahead_blocks);
            return Some(("control_motion.look_ahead_blocks", why));
        }
        if self.cycle_us > 1_000_000 {
            return Some(("control_motion.cycle_us", format!("is {}: it must be at most 1000000", self.cycle_us)));
        }
        let deviates = self.corners == CornerRule::JunctionDeviation;
        if deviates != (1..=1_000_000).contains(&self.junction_deviation_um) {
            let why = "must be from 1 to 1000000 with corners junction_deviation, and 0 or left out without";
            return Some((
                "control_motion.junction_deviation_um",
                format!("is {}: it {why}", self.junction_deviation_um),
            ));
        }
        let small = self.small_segments_mm;
        if small > if deviates { 1000 } else { 0 } {
            let why = "must be at most 1000 with corners junction_deviation, and 0 or left out without";
            return Some(("control_motion.small_segments_mm", format!("is {small}: it {why}")));
        }
        if deviates && self.cycle_us > 0 {
            let why = "must be 0 or left out with corners junction_deviation, which has no least time of a block";
            return Some(("control_motion.cycle_us", format!("is {}: it {why}", self.cycle_us)));
        }
        if deviates && self.look_ahead_blocks > 10_000 {
            let why = "must be at most 10000 with corners junction_deviation";
            return Some(("control_motion.look_ahead_blocks", format!("is {}: it {why}", self.look_ahead_blocks)));
        }
        let fits = match self.limited_by {
            LimitedBy::Acceleration if deviates => self.rotary_blocks == RotaryBlocks::LookedAhead,
            LimitedBy::Acceleration => {
                self.corners == CornerRule::Arcs && self.rotary_blocks == RotaryBlocks::Overlapped && self.cycle_us > 0
            }
            LimitedBy::Jerk => self.corners == CornerRule::Spline && self.rotary_blocks != RotaryBlocks::Overlapped,
        };
        let why = "is modelled as acceleration with corners arcs, rotary_blocks overlapped and a cycle_us above 0, as acceleration \
                   with corners junction_deviation and rotary_blocks looked_ahead, or as jerk with corners spline and \
                   rotary_blocks looked_ahead or stopped";
        (!fits).then(|| ("control_motion.limited_by", why.to_owned()))
    }
}

/// Endings of what is written beside a program.
const OTHER_FILES: [&str; 4] = ["apt", "json", "svg", "j2"];

impl DialectFile {
    /// Checks what the types do not say.
    ///
    /// # Errors
    /// With the field and what is wrong with it.
    pub fn check(&self) -> Result<(), PostError> {
        let fault = |field: &str, why: String| Err(PostError::Dialect { field: field.to_owned(), why });
        if self.format != DIALECT_FORMAT {
            return fault("format", format!("must be \"{DIALECT_FORMAT}\", is \"{}\"", self.format));
        }
        if !(20..=2000).contains(&self.lines.max_length) {
            return fault("lines.max_length", format!("is {}: it must be from 20 to 2000", self.lines.max_length));
        }
        let extension = &self.program.extension;
        if !(1..=8).contains(&extension.len()) || !extension.chars().all(|c| c.is_ascii_alphanumeric()) {
            return fault("program.extension", format!("is \"{extension}\": it must be 1 to 8 letters and digits"));
        }
        if OTHER_FILES.iter().any(|other| extension.eq_ignore_ascii_case(other)) {
            return fault("program.extension", format!("is \"{extension}\", which is the ending of another file"));
        }
        if self.program.name_length == 0 || self.program.last_number == 0 {
            return fault("program", "name_length and last_number must be at least 1".to_owned());
        }
        if self.numbers.vector_decimals > 9 {
            return fault("numbers.vector_decimals", "must be at most 9".to_owned());
        }
        if let Some(c) = self.comments.characters.chars().find(|c| !c.is_ascii_graphic()) {
            return fault("comments.characters", format!("{c:?} is no printable ASCII character"));
        }
        if self.feeds.rtcp.is_some() != self.motion.rtcp.is_some() {
            return fault("feeds.rtcp", "must be there if, and only if, motion.rtcp is".to_owned());
        }
        if self.motion.rtcp.as_ref().is_some_and(|r| r.cutting.is_empty()) {
            return fault("motion.rtcp.cutting", "must name a law".to_owned());
        }
        let vectors = self.motion.rtcp.as_ref().and_then(|r| Some((r, r.vectors.as_ref()?)));
        if let Some((rtcp, vectors)) = vectors
            && !rtcp.cutting.iter().any(|c| vectors.laws.contains(&c.law))
        {
            return fault("motion.rtcp.vectors.laws", "must name one of motion.rtcp.cutting".to_owned());
        }
        if let Some((field, why)) = self.control_motion.fault() {
            return fault(field, why);
        }
        if self.several_heads && (self.words.spindles.is_none() || !self.numbers.numbered_axes) {
            return fault("several_heads", "needs words.spindles and numbered_axes".to_owned());
        }
        for (field, lines, names) in self.texts() {
            for line in lines {
                if let Some(name) = unknown_placeholder(line, names) {
                    let known = names.iter().map(|n| format!("{{{n}}}")).collect::<Vec<_>>().join(", ");
                    return fault(field, format!("`{line}` holds {{{name}}}; known there: {known}"));
                }
            }
        }
        Ok(())
    }

    /// Texts with placeholders: field, lines, names.
    fn texts(&self) -> Vec<(&'static str, Vec<&String>, &'static [&'static str])> {
        let w = &self.words;
        let mut all: Vec<(&'static str, Vec<&String>, &'static [&'static str])> = vec![
            ("words.tool_change", w.tool_change.iter().collect(), &["number"]),
            ("words.spindle_on", w.spindle_on.iter().collect(), &["rpm", "code", "m"]),
            ("words.dwell", w.dwell.iter().collect(), &["ms", "s"]),
            (
                "words.work_offsets",
                w.work_offsets.iter().flat_map(|o| o.lines.iter().chain([&o.word])).collect(),
                &["n"],
            ),
            ("subprograms", self.subprograms.texts().collect(), &["number", "padded", "id", "lower_id", "name"]),
            ("words.length", w.length.before.iter().chain([&w.length.code, &w.length.end]).collect(), &["register"]),
        ];
        if let Some(s) = &w.spindles {
            let names = &["rpm", "code", "m", "spindle"];
            all.push(("words.spindles", s.on.iter().chain(&s.off).collect(), names));
        }
        if let Some(r) = &self.motion.rtcp {
            let on = r.on.before.iter().chain([&r.on.code, &r.on.end]);
            all.push(("motion.rtcp.on", on.collect(), &["register", "law"]));
        }
        if let Some(b) = &self.motion.blending {
            all.push(("motion.blending.within", b.within.on.iter().collect(), &["path", "orientation"]));
        }
        all
    }

    /// Returns the word that selects a meaning of F; `None` if the control has none.
    pub(crate) fn feed_code(&self, mode: FeedMode) -> Option<&str> {
        match mode {
            FeedMode::G94 => self.feeds.g94.as_deref(),
            FeedMode::G93 => self.feeds.g93.as_deref(),
            FeedMode::Rtcp => self.feeds.rtcp.as_deref(),
        }
    }

    /// Returns the word of a work offset, and the lines that select it; `None` if the control does
    /// not have so many.
    #[must_use]
    pub fn work_offset_words(&self, offset: WorkOffset) -> Option<(String, Vec<String>)> {
        let number = offset.number();
        let rule = self.words.work_offsets.iter().find(|r| (r.first..=r.last).contains(&number))?;
        let n = (i32::from(number) + rule.plus).to_string();
        let word = fill(&rule.word, &[("n", &n)]);
        let lines: Vec<String> = rule.lines.iter().map(|line| fill(line, &[("n", &n)])).collect();
        Some(if lines.is_empty() { (word.clone(), vec![word]) } else { (word, lines) })
    }

    /// The rule of a rapid law, `None` where the control does not move so.
    pub(crate) fn rapid(&self, is_linear: bool) -> Option<&RapidRule> {
        if is_linear { self.motion.rapid_linear.as_ref() } else { self.motion.rapid_per_axis.as_ref() }
    }
}

/// The text with `{name}` replaced by its value.
pub(crate) fn fill(text: &str, values: &[(&str, &str)]) -> String {
    values.iter().fold(text.to_owned(), |text, (name, value)| text.replace(&format!("{{{name}}}"), value))
}

impl SubprogramRule {
    /// Returns the rule with these values in place of the placeholders.
    #[must_use]
    pub fn filled(&self, values: &[(&str, &str)]) -> Self {
        let fill = |text: &String| fill(text, values);
        Self {
            call: fill(&self.call),
            begin: self.begin.iter().map(fill).collect(),
            end: self.end.iter().map(fill).collect(),
            file: fill(&self.file),
            ..*self
        }
    }
}

/// A name in braces that is none of these.
fn unknown_placeholder<'a>(text: &'a str, names: &[&str]) -> Option<&'a str> {
    let parts = text.split('{').skip(1).map(|part| part.split('}').next().unwrap_or(part));
    parts.into_iter().find(|part| !names.contains(part))
}
