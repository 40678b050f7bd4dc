//! Lines of a link: whether they hold only positions, and the lines of another way.

use facemill_inverse_kinematics::{AxisValues, Machine, Rollover};
use facemill_nc_program::dialect::{Decimals, Numbering};
use facemill_nc_program::read::{AxisAt, Compensation, MotionKind, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::{AxisLetter, AxisWords, Dialect, ReadProgram, WordMap};
use facemill_virtual_machine::ProgramLink;
use nalgebra::{Isometry3, Point3};

/// Settings for words of positions.
pub struct LinkWords<'a> {
    /// Machine.
    pub machine: &'a Machine,
    /// Distance from the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Words of axis values.
    pub words: &'a WordMap,
    /// Table frame ← frame of coordinates under RTCP; `None` for a machine without X, Y and Z at
    /// right angles, which has no words under RTCP.
    pub table_from_rtcp_words: Option<Isometry3<f64>>,
    /// Decimals of words.
    pub decimals: Decimals,
}

/// Form of a control's rapids.
pub struct RapidForm {
    /// Text before the words, and behind them.
    code: String,
    end: String,
    always_point: bool,
    plus_sign: bool,
    /// Whether every line has a number, which is not one of its words.
    pub numbers_lines: bool,
}

impl RapidForm {
    /// Returns the form of a dialect.
    pub fn of(dialect: Dialect) -> Self {
        let file = dialect.file();
        Self {
            code: file.words.rapid,
            end: file.words.rapid_end,
            always_point: file.numbers.always_point,
            plus_sign: file.numbers.plus_sign,
            numbers_lines: file.lines.numbering == Numbering::EveryLine,
        }
    }

    /// Returns a number with at least these decimals that is read as exactly this one.
    fn number(&self, decimals: u8, value: f64) -> Option<String> {
        let text =
            (decimals.into()..=MOST_DECIMALS).map(|n| format!("{value:.n$}")).find(|t| t.parse() == Ok(value))?;
        let text = if text.contains('.') { text.trim_end_matches('0') } else { &text };
        let text = if text == "-0." || text == "-0" { &text[1..] } else { text };
        let sign = if self.plus_sign && !text.starts_with('-') { "+" } else { "" };
        let is_whole = !text.contains('.');
        Some(match self.always_point {
            true if is_whole => format!("{sign}{text}."),
            true => format!("{sign}{text}"),
            false => format!("{sign}{}", text.trim_end_matches('.')),
        })
    }
}

/// The lines of a link that can be replaced.
#[derive(Clone, Debug)]
pub struct LinkLines {
    /// Its rapid blocks, from 1; comments between them stay.
    pub lines: Vec<u32>,
    /// Text before the words of each of them: the block number.
    numbers: Vec<String>,
    compensation: Compensation,
    /// The words in force before and at the end.
    before: AxisWords,
    end: AxisWords,
}

impl LinkWords<'_> {
    /// Returns the position given by its rounded words, and these words.
    pub fn rounded(&self, compensation: Compensation, axes: &AxisValues) -> Option<(AxisWords, AxisValues)> {
        match compensation {
            Compensation::Rtcp(_) => self.rounded_tip(axes),
            Compensation::Length(_) => {
                let words = self.in_decimals(&self.words.words(axes.as_slice()).ok()?)?;
                Some((words, AxisValues::from_slice(&self.words.joints(&words).ok()?)?))
            }
            Compensation::Off => {
                let exact = self.words.uncompensated_words(axes.as_slice()).ok()?;
                let words = self.in_decimals(&exact)?;
                let mut rounded = *axes;
                for (k, (exact, word)) in exact.iter().zip(words.iter()).enumerate() {
                    let by = word.value - exact.value;
                    rounded[k] += if word.letter.kind() == AxisKind::Rotary { by.to_radians() } else { by };
                }
                Some((words, rounded))
            }
        }
    }

    fn rounded_tip(&self, axes: &AxisValues) -> Option<(AxisWords, AxisValues)> {
        let tip = self.machine.cl_point(axes, self.tool_length).tip;
        let table_from_words = self.table_from_rtcp_words?;
        let tip = table_from_words.inverse_transform_point(&tip);
        let words = self.in_decimals(&self.words.rtcp_words(&tip, axes.as_slice()).ok()?)?;
        let coordinate = |letter| words.get(letter);
        let tip = Point3::new(coordinate(AxisLetter::X)?, coordinate(AxisLetter::Y)?, coordinate(AxisLetter::Z)?);
        let turned = AxisValues::from_slice(&self.words.joints(&words).ok()?)?;
        Some((words, self.machine.with_tip_at(&turned, &(table_from_words * tip), self.tool_length)?))
    }

    /// Returns the axes whose words give the direction of turning by their sign.
    fn signed(&self) -> impl Iterator<Item = AxisLetter> + '_ {
        let axes = self.machine.axes().iter().zip(self.words.axes());
        axes.filter(|(axis, _)| axis.rollover == Some(Rollover::SignDirected)).map(|(_, mapped)| mapped.letter)
    }

    fn in_decimals(&self, words: &AxisWords) -> Option<AxisWords> {
        let rounded = words.iter().map(|word| {
            let scale = 10f64.powi(self.decimals.of(word.letter.kind()).into());
            (word.letter, (word.value * scale).round() / scale)
        });
        AxisWords::from_words(rounded).ok().filter(|all| all.iter().all(|w| w.value.abs() < 1e6))
    }

    /// Returns the lines of a way through these positions in place of a link, without their
    /// endings, and without numbers where the control has one on each line, with only the words
    /// that change. The last position is the link's own, to the last bit.
    ///
    /// # Errors
    /// When no words express it, or where rotary axes turn the shorter way (`turns_shorter`), and
    /// one would turn by 180 deg or more in a block.
    pub fn lines(
        &self,
        form: &RapidForm,
        turns_shorter: bool,
        link: &LinkLines,
        through: &[AxisValues],
    ) -> Result<Vec<String>, String> {
        let not_said = || "no words of the control say the faster way".to_owned();
        let (_, over) = through.split_last().ok_or_else(not_said)?;
        let mut at = link.before;
        let mut lines = Vec::with_capacity(through.len());
        let places = over.iter().map(|axes| Some(self.rounded(link.compensation, axes)?.0));
        for words in places.chain([Some(link.end)]) {
            let words = words.ok_or_else(not_said)?;
            if let Some(axis) = half_turn(&at, &words).filter(|_| turns_shorter) {
                return Err(format!(
                    "{axis} would turn by 180 deg or more in one block of the faster way, under M126 or rollover"
                ));
            }
            if let Some(axis) = self.signed().find(|axis| at.get(*axis) != words.get(*axis)) {
                return Err(format!("the sign of words says which way round {axis} turns"));
            }
            let mut line = link.numbers.get(lines.len()).cloned().unwrap_or_default();
            line.push_str(&form.code);
            for word in words.iter().filter(|w| at.get(w.letter) != Some(w.value)) {
                let decimals = self.decimals.of(word.letter.kind());
                line.push_str(&format!(" {}{}", word.letter, form.number(decimals, word.value).ok_or_else(not_said)?));
            }
            if !form.end.is_empty() {
                line.push(' ');
                line.push_str(&form.end);
            }
            at = words;
            lines.push(line);
        }
        Ok(lines)
    }
}

/// Returns a rotary axis that turns by half a turn or more from some words to others.
fn half_turn(from: &AxisWords, to: &AxisWords) -> Option<AxisLetter> {
    let turns = |letter| Some((to.get(letter)? - from.get(letter)?).abs() >= 180.0);
    let rotary = to.iter().map(|w| w.letter).filter(|letter| letter.kind() == AxisKind::Rotary);
    rotary.into_iter().find(|letter| turns(*letter) == Some(true))
}

/// Returns whether M126 is anywhere in a program for Heidenhain: rotary axes then turn the shorter
/// way.
pub fn turns_shorter(program: &ReadProgram) -> bool {
    let says = |block: &ReadBlock| block.text.to_ascii_uppercase().replace(' ', "").contains("M126");
    program.dialect == Dialect::Heidenhain && program.blocks.iter().any(says)
}

/// Largest number of decimals of a rewritten word of a foreign program.
const MOST_DECIMALS: usize = 9;

/// Reason why the lines of a link must stay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptLines {
    /// Line that has more than positions of the axes, if one does.
    pub line: Option<u32>,
    /// The reason.
    pub why: String,
}

impl KeptLines {
    /// Returns a reason that no single line has.
    pub fn because(why: impl Into<String>) -> Self {
        Self { line: None, why: why.into() }
    }
}

/// Returns the lines of a link, or the reason why they must stay.
///
/// # Errors
/// With the line: the content of a block besides positions of the axes.
pub fn link_lines(program: &ReadProgram, words: &WordMap, link: &ProgramLink) -> Result<LinkLines, KeptLines> {
    let (Some(&first), Some(&last)) = (link.blocks.first(), link.blocks.last()) else {
        return Err(KeptLines::because("it has no block"));
    };
    let in_block = |block: &ReadBlock, why: String| KeptLines { line: Some(block.line), why };
    let mut lines = Vec::new();
    let mut numbers = Vec::new();
    let mut motion_of = None;
    for block in &program.blocks[first..=last] {
        if is_comment(block) {
            continue;
        }
        let motion = plain_rapid(program.dialect, block).map_err(|why| in_block(block, why))?;
        if motion.work_offset != words.work_offset() {
            return Err(in_block(block, format!("its words refer to {}", motion.work_offset)));
        }
        lines.push(block.line);
        // On Heidenhain every line has its consecutive number.
        let number = block.number.filter(|_| program.dialect != Dialect::Heidenhain);
        numbers.push(number.map_or_else(String::new, |_| number_text(&block.text)));
        motion_of = motion_of.or(Some(motion)).filter(|m| m.compensation == motion.compensation);
        if motion_of.is_none() {
            return Err(in_block(block, "the length compensation is another".to_owned()));
        }
    }
    let before = program.blocks[..first].iter().rev().find_map(|b| b.motion.as_ref());
    let end = program.blocks[last].motion.as_ref();
    let (Some(before), Some(end)) = (before, end) else {
        return Err(KeptLines::because("it has no place to start from"));
    };
    if before.compensation != end.compensation || before.work_offset != end.work_offset {
        return Err(KeptLines::because("offset or length compensation change before it"));
    }
    let all = |motion: &ReadMotion| -> Result<AxisWords, String> {
        let words = words.axes().iter().map(|axis| match motion.position.get(axis.letter) {
            Some(AxisAt::Word(value)) => Ok((axis.letter, value)),
            _ => Err(format!("axis {} is at no word", axis.letter)),
        });
        let words: Vec<_> = words.collect::<Result<_, String>>()?;
        AxisWords::from_words(words).map_err(|e| e.to_string())
    };
    let [before, at_end] = [all(before), all(end)].map(|words| words.map_err(KeptLines::because));
    Ok(LinkLines { lines, numbers, compensation: end.compensation, before: before?, end: at_end? })
}

impl LinkLines {
    /// Returns the length compensation at the end of the link.
    pub fn compensation(&self) -> Compensation {
        self.compensation
    }
}

/// Returns whether a line has no effect on the machine.
fn is_comment(block: &ReadBlock) -> bool {
    let says = |c: &ReadCommand| matches!(c, ReadCommand::Comment(_));
    block.motion.is_none() && !block.sets_state && !block.skippable && block.commands.iter().all(says)
}

/// Returns the motion of a block with nothing but G0, a number and positions of axes as absolute
/// words in mm and deg.
fn plain_rapid(dialect: Dialect, block: &ReadBlock) -> Result<&ReadMotion, String> {
    let motion = block.motion.as_ref().ok_or("says something else than a place")?;
    if motion.kind != MotionKind::Rapid || motion.via.is_some() || motion.tool.is_some() || motion.arc.is_some() {
        return Err("is no plain rapid".to_owned());
    }
    if block.skippable {
        return Err("a switch decides whether it is run".to_owned());
    }
    if motion.is_inch {
        return Err("counts in inches".to_owned());
    }
    if !block.commands.is_empty() {
        return Err("says something besides a place".to_owned());
    }
    let is_dialogue = dialect == Dialect::Heidenhain;
    let words = if is_dialogue { words_of(&dialogue_places(&block.text)?) } else { words_of(&block.text) };
    for (letter, number, value) in words? {
        let is_plain = match letter {
            // No radius compensation.
            'R' if is_dialogue => number == "0",
            'N' | 'G' if is_dialogue => false,
            'N' => true,
            'G' => value == 0.0 && number.bytes().all(|b| b == b'0'),
            _ => {
                let axis = AxisLetter::new(letter, 0).filter(|_| !matches!(letter, 'F' | 'S'));
                let at = axis.and_then(|axis| motion.position.get(axis));
                at == Some(AxisAt::Word(value))
            }
        };
        if !is_plain {
            let what = if dialect == Dialect::Siemens840d { "a word that is no place" } else { "no absolute place" };
            return Err(format!("`{letter}{number}` is {what}"));
        }
    }
    Ok(motion)
}

/// Returns the text between L and FMAX of a line in dialogue format, and behind it, with decimal
/// points.
fn dialogue_places(text: &str) -> Result<String, String> {
    let code = text.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    let places = code.strip_prefix(['L', 'l']).filter(|rest| rest.starts_with(' '));
    let places = places.map(|rest| rest.to_ascii_uppercase().replacen("FMAX", " ", 1).replace(',', "."));
    places.ok_or_else(|| format!("`{code}` is not understood as places"))
}

/// Returns letter, number and value of every word of a line.
fn words_of(text: &str) -> Result<Vec<(char, String, f64)>, String> {
    let mut words = Vec::new();
    let mut rest = text.trim();
    while let Some(letter) = rest.chars().next() {
        let behind = rest[letter.len_utf8()..].trim_start();
        let behind = behind.strip_prefix('=').unwrap_or(behind).trim_start();
        let end = behind.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+'))).unwrap_or(behind.len());
        let number = &behind[..end];
        let value = number.parse().map_err(|_| format!("`{rest}` is not understood as places"))?;
        words.push((letter.to_ascii_uppercase(), number.to_owned(), value));
        rest = behind[end..].trim_start();
    }
    Ok(words)
}

/// Returns `N120 ` of a line that begins with its number.
fn number_text(text: &str) -> String {
    let digits = text[1..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |k| k + 1);
    format!("{} ", &text[..digits])
}
