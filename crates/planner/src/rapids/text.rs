//! The lines of a link: whether they say nothing but places, and those of another way.

use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_nc_program::{
    AxisAt, AxisKind, AxisLetter, AxisWords, Compensation, Decimals, Dialect, MotionKind, ReadBlock, ReadCommand,
    ReadMotion, ReadProgram, WordMap,
};
use facemill_virtual_machine::ProgramLink;
use nalgebra::{Isometry3, Point3};

/// How positions become words.
pub(crate) struct LinkWords<'a> {
    pub machine: &'a Machine,
    pub tool_length: f64,
    pub words: &'a WordMap,
    pub table_from_rtcp_words: Isometry3<f64>,
    pub decimals: Decimals,
    pub always_point: bool,
}

/// The lines of a link that can be replaced.
#[derive(Clone, Debug)]
pub(crate) struct LinkLines {
    /// Its rapid blocks, from 1; comments between them stay.
    pub lines: Vec<u32>,
    /// What stands before the words of each of them: the block number.
    numbers: Vec<String>,
    compensation: Compensation,
    /// The words in force before and at the end.
    before: AxisWords,
    end: AxisWords,
}

impl LinkWords<'_> {
    /// The position as its rounded words give it, and these.
    pub(crate) fn rounded(&self, compensation: Compensation, axes: &AxisValues) -> Option<(AxisWords, AxisValues)> {
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
        let tip = self.table_from_rtcp_words.inverse_transform_point(&tip);
        let words = self.in_decimals(&self.words.rtcp_words(&tip, axes.as_slice()).ok()?)?;
        let coordinate = |letter| words.get(letter);
        let tip = Point3::new(coordinate(AxisLetter::X)?, coordinate(AxisLetter::Y)?, coordinate(AxisLetter::Z)?);
        let turned = AxisValues::from_slice(&self.words.joints(&words).ok()?)?;
        Some((words, self.machine.with_tip_at(&turned, &(self.table_from_rtcp_words * tip), self.tool_length)?))
    }

    fn in_decimals(&self, words: &AxisWords) -> Option<AxisWords> {
        let rounded = words.iter().map(|word| {
            let scale = 10f64.powi(self.decimals.of(word.letter.kind()).into());
            (word.letter, (word.value * scale).round() / scale)
        });
        AxisWords::from_words(rounded).ok().filter(|all| all.iter().all(|w| w.value.abs() < 1e6))
    }

    /// The lines of a way through these positions in place of a link, without their endings: as many words as change. The last
    /// position is the link's own, to the last bit.
    pub(crate) fn lines(&self, link: &LinkLines, through: &[AxisValues]) -> Option<Vec<String>> {
        let (_, over) = through.split_last()?;
        let mut at = link.before;
        let mut lines = Vec::with_capacity(through.len());
        let places = over.iter().map(|axes| Some(self.rounded(link.compensation, axes)?.0));
        for words in places.chain([Some(link.end)]) {
            let words = words?;
            let mut line = link.numbers.get(lines.len()).cloned().unwrap_or_default();
            line.push_str("G0");
            for word in words.iter().filter(|w| at.get(w.letter) != Some(w.value)) {
                line.push_str(&format!(" {}{}", word.letter, self.number(word.letter, word.value)?));
            }
            at = words;
            lines.push(line);
        }
        Some(lines)
    }

    /// A number that is read as exactly this one.
    fn number(&self, letter: AxisLetter, value: f64) -> Option<String> {
        let least = usize::from(self.decimals.of(letter.kind()));
        let text = (least..=MOST_DECIMALS).map(|n| format!("{value:.n$}")).find(|t| t.parse() == Ok(value))?;
        let text = if text.contains('.') { text.trim_end_matches('0') } else { &text };
        let text = if text == "-0." || text == "-0" { &text[1..] } else { text };
        let is_whole = !text.contains('.');
        Some(match self.always_point {
            true if is_whole => format!("{text}."),
            true => text.to_owned(),
            false => text.trim_end_matches('.').to_owned(),
        })
    }
}

/// Decimals of the words of programs from elsewhere that are told again.
const MOST_DECIMALS: usize = 9;

/// The lines of a link, or why they must stay.
///
/// # Errors
/// With the line: what a block says besides places of the axes.
pub(crate) fn link_lines(program: &ReadProgram, words: &WordMap, link: &ProgramLink) -> Result<LinkLines, String> {
    let (Some(&first), Some(&last)) = (link.blocks.first(), link.blocks.last()) else {
        return Err("it has no block".to_owned());
    };
    let mut lines = Vec::new();
    let mut numbers = Vec::new();
    let mut motion_of = None;
    for block in &program.blocks[first..=last] {
        if is_comment(block) {
            continue;
        }
        let motion = plain_rapid(program.dialect, block).map_err(|why| format!("line {}: {why}", block.line))?;
        if motion.work_offset != words.work_offset() {
            return Err(format!("line {}: its words refer to {}", block.line, motion.work_offset));
        }
        lines.push(block.line);
        numbers.push(block.number.map_or_else(String::new, |_| number_text(&block.text)));
        motion_of = motion_of.or(Some(motion)).filter(|m| m.compensation == motion.compensation);
        if motion_of.is_none() {
            return Err(format!("line {}: the length compensation is another", block.line));
        }
    }
    let before = program.blocks[..first].iter().rev().find_map(|b| b.motion.as_ref());
    let end = program.blocks[last].motion.as_ref();
    let (Some(before), Some(end)) = (before, end) else { return Err("it has no place to start from".to_owned()) };
    if before.compensation != end.compensation || before.work_offset != end.work_offset {
        return Err("offset or length compensation change before it".to_owned());
    }
    let all = |motion: &ReadMotion| {
        let words = words.axes().iter().map(|axis| match motion.position.get(axis.letter) {
            Some(AxisAt::Word(value)) => Ok((axis.letter, value)),
            _ => Err(format!("axis {} is at no word", axis.letter)),
        });
        let words: Vec<_> = words.collect::<Result<_, String>>()?;
        AxisWords::from_words(words).map_err(|e| e.to_string())
    };
    Ok(LinkLines { lines, numbers, compensation: end.compensation, before: all(before)?, end: all(end)? })
}

impl LinkLines {
    pub(crate) fn compensation(&self) -> Compensation {
        self.compensation
    }
}

/// A line that says nothing to the machine.
fn is_comment(block: &ReadBlock) -> bool {
    let says = |c: &ReadCommand| matches!(c, ReadCommand::Comment(_));
    block.motion.is_none() && !block.sets_state && !block.skippable && block.commands.iter().all(says)
}

/// The motion of a block with nothing but G0, a number and places of axes as absolute words in mm and deg.
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
    for (letter, number, value) in words_of(&block.text)? {
        let is_plain = match letter {
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

/// Letter, number and value of every word of a line.
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

/// `N120 ` of a line that begins with its number.
fn number_text(text: &str) -> String {
    let digits = text[1..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |k| k + 1);
    format!("{} ", &text[..digits])
}

/// A program with some lines replaced: each of these lists of lines by these texts, where the first of them stood. Says, for
/// every list, from which line to which its texts stand.
pub(crate) fn replaced(text: &[u8], all: &[(&[u32], &[String])]) -> (Vec<u8>, Vec<[u32; 2]>) {
    let mut out = Vec::with_capacity(text.len());
    let mut places = vec![[0; 2]; all.len()];
    let (mut line, mut written) = (0, 0);
    let mut next = 0;
    for source in text.split_inclusive(|byte| *byte == b'\n') {
        line += 1;
        while next < all.len() && all[next].0.last().is_none_or(|last| *last < line) {
            next += 1;
        }
        let Some((lines, texts)) = all.get(next).filter(|(lines, _)| lines.contains(&line)) else {
            out.extend_from_slice(source);
            written += 1;
            continue;
        };
        if lines.first() != Some(&line) {
            continue;
        }
        let ending: &[u8] = if source.ends_with(b"\r\n") { b"\r\n" } else { b"\n" };
        places[next] = [written + 1, written + texts.len() as u32];
        for text in *texts {
            out.extend_from_slice(text.as_bytes());
            out.extend_from_slice(ending);
        }
        written += texts.len() as u32;
    }
    (out, places)
}
