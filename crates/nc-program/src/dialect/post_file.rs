use facemill_cl_data::MotionLaw;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::dialect::Dialect;
use crate::dialect::beside_rule::{SubprogramPlace, SubprogramRule, SubprogramsFile};
use crate::dialect::file::{Decimals, DialectFile};
use crate::program::FeedMode;
use crate::words::axis_words::AxisWords;

/// How the program is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PostFile {
    /// Control that the program is written for (docs/dialects.md). `plan` reads back, runs and
    /// certifies the written program for each of them
    /// (docs/dialects.md#verified-programs-and-assumptions).
    pub dialect: Dialect,
    /// Meaning of F; not every dialect has all modes (docs/dialects.md).
    #[serde(default)]
    pub feed_mode: FeedMode,
    /// Rules of the dialect (docs/dialects.md#a-dialect-file-of-ones-own), beside the job;
    /// `dialect` then says which reader reads the programs back, and whose template is taken. Not
    /// with two heads. Default: the dialect's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dialect_file: Option<String>,
    /// NC template (docs/formats.md#nc-template). Default: the dialect's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub template: Option<String>,
    /// Program number (O word); of several setups the first one's, the others count on.
    #[schemars(range(min = 1, max = 99_999_999))]
    #[serde(default = "default_program_number")]
    pub program_number: u32,
    /// Comment beside the program number. Default: job and setup name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program_name: Option<String>,
    /// Block numbers (N words); none where null. Behind 99999 they start again; numbers that the
    /// template uses itself are left out. Default: 1 and 1.
    #[serde(default = "default_block_numbers")]
    pub block_numbers: Option<BlockNumbers>,
    /// Decimals of the words: axis words are rounded to nearest, feeds down, though not below the
    /// machine's smallest. Default: 3, 3, 1, 3.
    #[serde(default)]
    pub decimals: Decimals,
    /// Write `X100.000` instead of `X100.`; both have a decimal point, without which a control may
    /// count in micrometres.
    #[serde(default)]
    pub trailing_zeros: bool,
    /// Longest line, characters, at most what the control takes. Default: 120; with `orientation:
    /// vectors` on Heidenhain 150.
    #[schemars(range(min = 20, max = 500))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_line_length: Option<u16>,
    /// How the tool's direction is written under `rtcp`.
    #[serde(default)]
    pub orientation: Orientation,
    /// Lines of the dialect that switch the control's look-ahead on and off around the motions.
    #[serde(default)]
    pub look_ahead: bool,
    /// Write the tool table and the work offset of each setup beside its program, in the form that
    /// the control loads (docs/dialects.md#tool-and-offset-tables).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tables: bool,
    /// Write the program of each setup a second time, as a main program that calls subprograms
    /// (docs/dialects.md#subprograms). Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subprograms: Option<SubprogramsFile>,
}

/// Form in which a program under RTCP states the tool orientation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Orientation {
    /// Words of the rotary axes: the control goes to the positions that were planned and tested.
    #[default]
    Rotary,
    /// Unit vectors of the tool's axis in feed blocks (docs/dialects.md#tool-vectors), for
    /// `siemens_840d` and `heidenhain`: the control finds the rotary positions itself, and of two
    /// it takes the one it finds nearer.
    Vectors,
}

/// Numbering of blocks. Behind 99999 it starts again; numbers that the template uses itself are
/// left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlockNumbers {
    /// First number.
    #[schemars(range(min = 1, max = 99_999))]
    pub start: u32,
    /// Difference of neighbours.
    #[schemars(range(min = 1, max = 1_000))]
    pub step: u32,
}

/// Request of a [`PostFile`], a dialect file or a machine that cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PostError {
    /// A number that is out of its range.
    #[error("{field} is {value}: it must be from {min} to {max}")]
    Range {
        /// Name in the file, below `post`.
        field: &'static str,
        /// As given.
        value: u32,
        /// Smallest allowed.
        min: u32,
        /// Largest allowed.
        max: u32,
    },
    /// Something that the control does not do.
    #[error("{field}: {name} has no {value}{}", if instead.is_empty() { String::new() } else { format!("; {instead}") })]
    Absent {
        /// Name in the file, below `post`.
        field: &'static str,
        /// As given.
        value: String,
        /// Name of the control.
        name: String,
        /// Advice.
        instead: String,
    },
    /// The machine's motion law is not one of the control's.
    #[error("dialect: {name} does not move as the machine file says, {key}: {value}; it does {allowed}")]
    Law {
        /// Name of the control.
        name: String,
        /// Key of the machine file.
        key: &'static str,
        /// Value in the machine file.
        value: &'static str,
        /// Values that the control allows.
        allowed: String,
    },
    /// A dialect file that nothing can be written with.
    #[error("dialect file, {field}: {why}")]
    Dialect {
        /// Name in the file.
        field: String,
        /// Fault.
        why: String,
    },
}

/// How a program is written: a checked [`PostFile`] with the template's text.
#[derive(Clone, Debug, PartialEq)]
pub struct PostSettings {
    pub(crate) dialect: Dialect,
    pub(crate) rules: DialectFile,
    pub(crate) feed_mode: FeedMode,
    pub(crate) orientation: Orientation,
    pub(crate) look_ahead: bool,
    pub(crate) tables: bool,
    pub(crate) subprograms: Option<SubprogramsFile>,
    pub(crate) template: Template,
    pub(crate) program_number: u32,
    pub(crate) program_name: Option<String>,
    pub(crate) block_numbers: Option<BlockNumbers>,
    pub(crate) decimals: Decimals,
    pub(crate) trailing_zeros: bool,
    pub(crate) max_line_length: usize,
    /// Motion that plan and verification assume.
    pub(crate) motion: Option<MotionLaw>,
    /// Machine values of the reference position, mm or deg.
    pub(crate) home: Option<AxisWords>,
}

/// A template and what its errors call it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template {
    /// File name, for errors.
    pub name: String,
    /// minijinja source.
    pub text: String,
}

/// Largest difference between a word and the number it was written from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundingBound {
    /// Of every linear axis, mm.
    pub linear: f64,
    /// Of every rotary axis, rad.
    pub rotary: f64,
    /// Angle between a tool axis and its vector in the text, rad; 0 where no vectors are written.
    pub vector: f64,
}

/// Largest block number; older controls have five digits.
pub(crate) const LAST_BLOCK_NUMBER: u32 = 99_999;

/// Largest program number.
pub const LAST_PROGRAM_NUMBER: u32 = 99_999_999;

fn default_program_number() -> u32 {
    1001
}

// serde needs the type of the field.
#[expect(clippy::unnecessary_wraps, reason = "the default of an optional field")]
fn default_block_numbers() -> Option<BlockNumbers> {
    Some(BlockNumbers { start: 1, step: 1 })
}

/// Longest line where nobody says it, characters.
const LONGEST_LINE: u16 = 120;

/// Largest permitted line length, characters.
const MOST_CHARACTERS: u16 = 500;

impl Default for PostFile {
    /// Returns a file that names the default dialect and nothing else.
    fn default() -> Self {
        Self {
            dialect: Dialect::default(),
            dialect_file: None,
            feed_mode: FeedMode::default(),
            template: None,
            program_number: default_program_number(),
            program_name: None,
            block_numbers: default_block_numbers(),
            decimals: Decimals::default(),
            trailing_zeros: false,
            max_line_length: None,
            orientation: Orientation::default(),
            look_ahead: false,
            tables: false,
            subprograms: None,
        }
    }
}

impl PostFile {
    /// Checks the ranges and joins the template: the text of the file that [`PostFile::template`]
    /// names, which the caller has read, or `None` for the dialect's own.
    ///
    /// # Errors
    /// When a number is out of its range, or the control has no word for a requested function.
    pub fn settings(&self, template: Option<Template>) -> Result<PostSettings, PostError> {
        self.settings_of(self.dialect.file(), template.unwrap_or_else(|| self.dialect.template()))
    }

    /// The same with a dialect file and a template of one's own.
    ///
    /// # Errors
    /// As [`PostFile::settings`], and when nothing can be written with the dialect file.
    pub fn settings_of(&self, rules: DialectFile, template: Template) -> Result<PostSettings, PostError> {
        rules.check()?;
        in_range("program_number", self.program_number, 1, rules.program.last_number.min(LAST_PROGRAM_NUMBER))?;
        let most = rules.numbers.max_decimals;
        for (field, decimals, most) in [
            ("decimals.linear", self.decimals.linear, most.linear),
            ("decimals.rotary", self.decimals.rotary, most.rotary),
            ("decimals.feed", self.decimals.feed, most.feed),
            ("decimals.inverse_time", self.decimals.inverse_time, most.inverse_time),
        ] {
            in_range(field, decimals.into(), 0, most.min(6).into())?;
        }
        let longest = self.longest_line(&rules);
        in_range("max_line_length", longest.into(), 20, rules.lines.max_length.min(MOST_CHARACTERS).into())?;
        if let Some(numbers) = self.block_numbers {
            in_range("block_numbers.start", numbers.start, 1, LAST_BLOCK_NUMBER)?;
            in_range("block_numbers.step", numbers.step, 1, 1000)?;
        }
        self.check_words(&rules)?;
        Ok(PostSettings {
            dialect: self.dialect,
            rules,
            feed_mode: self.feed_mode,
            orientation: self.orientation,
            look_ahead: self.look_ahead,
            tables: self.tables,
            subprograms: self.subprograms,
            template,
            program_number: self.program_number,
            program_name: self.program_name.clone(),
            block_numbers: self.block_numbers,
            decimals: self.decimals,
            trailing_zeros: self.trailing_zeros,
            max_line_length: longest.into(),
            motion: None,
            home: None,
        })
    }

    /// Longest line, characters.
    fn longest_line(&self, rules: &DialectFile) -> u16 {
        let vectors = rules.motion.rtcp.as_ref().and_then(|rtcp| rtcp.vectors.as_ref());
        let is_long = self.orientation == Orientation::Vectors && vectors.is_some_and(|v| v.complete);
        let own = if is_long { rules.lines.max_length.min(MOST_CHARACTERS) } else { LONGEST_LINE };
        self.max_line_length.unwrap_or(own)
    }

    /// Whether the control has words for feed mode, tool vectors and look-ahead.
    fn check_words(&self, rules: &DialectFile) -> Result<(), PostError> {
        let absent = |field, value: &str, instead: &str| {
            let (value, name, instead) = (value.to_owned(), rules.name.clone(), instead.to_owned());
            Err(PostError::Absent { field, value, name, instead })
        };
        if rules.feed_code(self.feed_mode).is_none() {
            return absent("feed_mode", self.feed_mode.name(), &rules.feeds.absent);
        }
        if self.orientation == Orientation::Vectors {
            if self.feed_mode != FeedMode::Rtcp {
                return absent("orientation", "tool vectors without RTCP", "take the feed mode rtcp");
            }
            if rules.motion.rtcp.as_ref().is_none_or(|r| r.vectors.is_none()) {
                return absent("orientation", "tool vectors", "take rotary");
            }
        }
        if self.look_ahead && rules.motion.look_ahead.is_none() {
            return absent("look_ahead", "switch for its look-ahead", "leave it out");
        }
        if self.tables && rules.tables.is_none() {
            return absent("tables", "tables", "leave it out, or name their form under `tables` of the dialect file");
        }
        if let Some(asked) = &self.subprograms {
            let Some(rule) = rule_of(asked, rules) else {
                let (value, instead) = match asked.place {
                    SubprogramPlace::Program => ("subprograms in the same program", "take `\"in\": \"files\"`"),
                    SubprogramPlace::Files => ("subprograms in files of their own", "take `\"in\": \"program\"`"),
                };
                let has_none = rules.subprograms.in_program.is_none() && rules.subprograms.in_files.is_none();
                let instead = if has_none { "name their words in the dialect file, or leave it out" } else { instead };
                return absent("subprograms.in", value, instead);
            };
            if let Some(first) = asked.first_number {
                in_range("subprograms.first_number", first, 1, rule.last_number)?;
            }
        }
        Ok(())
    }
}

/// Returns the words of a dialect for subprograms; `None` if it has none.
fn rule_of<'a>(asked: &SubprogramsFile, rules: &'a DialectFile) -> Option<&'a SubprogramRule> {
    match asked.place {
        SubprogramPlace::Program => rules.subprograms.in_program.as_ref(),
        SubprogramPlace::Files => rules.subprograms.in_files.as_ref(),
    }
}

fn in_range(field: &'static str, value: u32, min: u32, max: u32) -> Result<(), PostError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(PostError::Range { field, value, min, max }) }
}

impl Template {
    /// The template that comes with a dialect: a start for one's own.
    #[must_use]
    pub fn of(dialect: Dialect) -> Self {
        dialect.template()
    }
}

impl PostSettings {
    /// Control the program is written for.
    #[must_use]
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// The dialect file that the program is written by.
    #[must_use]
    pub fn rules(&self) -> &DialectFile {
        &self.rules
    }

    /// The same by another dialect file, which has to be one that [`PostFile::settings_of`] takes.
    #[must_use]
    pub fn with_rules(&self, rules: DialectFile) -> Self {
        Self { rules, ..self.clone() }
    }

    /// Returns the meaning of F.
    #[must_use]
    pub fn feed_mode(&self) -> FeedMode {
        self.feed_mode
    }

    /// Decimals of the words.
    #[must_use]
    pub fn decimals(&self) -> Decimals {
        self.decimals
    }

    /// The same with another program number, of at most eight digits: programs of one job must not
    /// overwrite each other on the control.
    #[must_use]
    pub fn with_number_after(&self, programs_before: u32) -> Self {
        let program_number = self.program_number.saturating_add(programs_before).min(LAST_PROGRAM_NUMBER);
        Self { program_number, ..self.clone() }
    }

    /// Ending of the program's file, without the point.
    #[must_use]
    pub fn extension(&self) -> &str {
        &self.rules.program.extension
    }

    /// Returns whether tool and offset tables are to be written.
    #[must_use]
    pub fn tables(&self) -> bool {
        self.tables
    }

    /// Returns the subprograms to be written, with the words for them; `None` if none are wanted.
    #[must_use]
    pub fn subprograms(&self) -> Option<(SubprogramsFile, &SubprogramRule)> {
        let asked = self.subprograms?;
        Some((asked, rule_of(&asked, &self.rules)?))
    }

    /// Number of the program.
    pub fn program_number(&self) -> u32 {
        self.program_number
    }

    /// How far rounding to the written decimals may move an axis: half a unit of the last decimal.
    /// A vector of which every component is off by that is off by the diagonal of its cube.
    #[must_use]
    pub fn rounding_bound(&self) -> RoundingBound {
        let half_unit = |decimals: u8| 0.5 * 10f64.powi(-i32::from(decimals));
        let vector = |_| (half_unit(self.rules.numbers.vector_decimals) * 3f64.sqrt()).min(1.0).asin();
        RoundingBound {
            linear: half_unit(self.decimals.linear),
            rotary: half_unit(self.decimals.rotary).to_radians(),
            vector: self.vector_rule().map_or(0.0, vector),
        }
    }
}
