//! Reader of both programs.

use crate::fault::{SiemensFault, SiemensReadError};
use crate::pair::{ReadPair, ReadPairBlock};
use crate::statement::Statement;
use crate::statements::Statements;
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::{AxisLetter, AxisWords};

/// Reads the programs that [`write_siemens_pair`](crate::write_siemens_pair) writes, and no others.
///
/// Both channels must have the same marks and the same blocks between them. The blocks are returned
/// with the words of both channels and their durations in each.
///
/// # Errors At the first line that the writer would not have written there.
pub fn read_siemens_pair(texts: [&str; 2]) -> Result<ReadPair, SiemensReadError> {
    let [first, second] = [read(1, texts[0])?, read(2, texts[1])?];
    if let Some((axis, _)) = second.axes.iter().find(|(a, _)| first.axes.iter().any(|(b, _)| a == b)) {
        return Err(SiemensReadError { channel: 2, line: second.first_line, fault: SiemensFault::Axis(*axis) });
    }
    merge(&first, &second)
}

/// One channel.
struct ChannelReader {
    /// Positions of the axes.
    axes: Vec<(AxisLetter, Option<f64>)>,
    /// Line of the first statement.
    first_line: u32,
    tool_length: f64,
    items: Vec<Item>,
}

struct Item {
    line: u32,
    what: What,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    Mark(u32),
    /// Words of all axes at the end of the block, and its time in s; rapids have none.
    Block {
        is_rapid: bool,
        words: AxisWords,
        time: f64,
    },
}

impl What {
    fn name(&self) -> String {
        match self {
            Self::Mark(number) => format!("mark {number}"),
            Self::Block { is_rapid: true, .. } => "a rapid".to_owned(),
            Self::Block { .. } => "a cutting block".to_owned(),
        }
    }
}

fn home(s: &Statement) -> Option<Vec<AxisLetter>> {
    if let Statement::Home(axes) = s { Some(axes.clone()) } else { None }
}

fn read(channel: usize, text: &str) -> Result<ChannelReader, SiemensReadError> {
    let mut statements = Statements::new(channel, text)?;
    let mut reading = Reading {
        channel: ChannelReader { axes: Vec::new(), first_line: statements.line(), tool_length: 0.0, items: Vec::new() },
        homes: Vec::new(),
        mark: 0,
    };
    let has_path_axes = reading.header(&mut statements)?;
    reading.body(&mut statements, has_path_axes)?;
    reading.end(&mut statements)?;
    Ok(reading.channel)
}

struct Reading {
    channel: ChannelReader,
    /// Axes that the header sends home together, the spindle axis first.
    homes: Vec<Vec<AxisLetter>>,
    /// Number of the last mark.
    mark: u32,
}

impl Reading {
    /// Whether F is per minute.
    fn header(&mut self, s: &mut Statements) -> Result<bool, SiemensReadError> {
        s.expect_one("the safe start", &Statement::SafeStart)?;
        let path = s.take(|s| if let Statement::PathAxes(axes) = s { Some(axes.clone()) } else { None });
        let radii = s.take(|s| if let Statement::Radii(axes) = s { Some(axes.clone()) } else { None });
        let (_, spindle) = s.expect("the way home of the spindle axis", home)?;
        self.add_axes(s, spindle)?;
        self.mark(s)?;
        while let Some((_, axes)) = s.take(home) {
            self.add_axes(s, axes)?;
        }
        self.check_path_axes(s, path.as_ref().map(|(_, p)| p), radii.map_or_else(Vec::new, |(_, r)| r))?;
        self.mark(s)?;
        s.expect_one("the tool change", &Statement::ToolChange)?;
        s.expect_one("the tool's edge", &Statement::Edge)?;
        let length = |s: &Statement| if let Statement::Check(length) = s { Some(*length) } else { None };
        self.channel.tool_length = s.expect("the check of the tool's length", length)?.1;
        s.expect_one("the work offset", &Statement::WorkOffset)?;
        s.expect_one("the spindle's start", &Statement::SpindleOn)?;
        self.approach(s)?;
        s.expect("the coolant", |s| matches!(s, Statement::Coolant | Statement::CoolantOff).then_some(()))?;
        let mode = if path.is_some() { Statement::PerMinute } else { Statement::InverseTime };
        s.expect_one("the feed mode", &mode)?;
        match self.channel.axes.iter().find(|(_, at)| at.is_none()) {
            Some((axis, _)) => Err(s.error(SiemensFault::UnknownAxis(*axis))),
            None => Ok(path.is_some()),
        }
    }

    /// Rotary axes, then linear ones, then the spindle axis.
    fn approach(&mut self, s: &mut Statements) -> Result<(), SiemensReadError> {
        for kind in [Some(AxisKind::Rotary), Some(AxisKind::Linear), None] {
            let spindle = self.homes.first().cloned().unwrap_or_default();
            let all = self.channel.axes.iter().map(|(a, _)| *a);
            let is_in = |a: &AxisLetter| kind.map_or(spindle.contains(a), |k| a.kind() == k && !spindle.contains(a));
            let wanted: Vec<AxisLetter> = all.filter(is_in).collect();
            if !wanted.is_empty() {
                let expected = "the way to the first position: rotary axes, then linear ones, then the spindle axis";
                let names = |words: &AxisWords| words.iter().map(|w| w.letter).collect::<Vec<_>>();
                let is_wanted = |s: &Statement| rapid(s).filter(|words| is_same(&names(words), &wanted));
                let (line, words) = s.expect(expected, is_wanted)?;
                self.go(s, line, &words)?;
            }
            self.mark(s)?;
        }
        Ok(())
    }

    fn add_axes(&mut self, s: &Statements, axes: Vec<AxisLetter>) -> Result<(), SiemensReadError> {
        self.homes.push(axes.clone());
        for axis in axes {
            if self.channel.axes.iter().any(|(a, _)| *a == axis) {
                return Err(s.error(SiemensFault::Axis(axis)));
            }
            self.channel.axes.push((axis, None));
        }
        Ok(())
    }

    /// Checks that F counts all axes of the channel, or time.
    fn check_path_axes(
        &self,
        s: &Statements,
        path: Option<&Vec<AxisLetter>>,
        radii: Vec<AxisLetter>,
    ) -> Result<(), SiemensReadError> {
        let all: Vec<AxisLetter> = self.channel.axes.iter().map(|(a, _)| *a).collect();
        let rotary: Vec<AxisLetter> = all.iter().copied().filter(|a| a.kind() == AxisKind::Rotary).collect();
        let is_right = match path {
            Some(path) => is_same(path, &all) && is_same(&radii, &rotary),
            None => radii.is_empty(),
        };
        let expected = "FGROUP of all axes and FGREF of the rotary ones, or neither";
        if is_right { Ok(()) } else { Err(s.error(SiemensFault::NotHere { expected })) }
    }

    fn mark(&mut self, s: &mut Statements) -> Result<(), SiemensReadError> {
        let (line, number) = s.expect("a mark", mark)?;
        self.add_mark(s, line, number)
    }

    fn add_mark(&mut self, s: &Statements, line: u32, found: u32) -> Result<(), SiemensReadError> {
        let before = std::mem::replace(&mut self.mark, found);
        if found != before + 1 && !(found == 1 && before > 1) {
            let fault = SiemensFault::MarkOrder { found, before };
            return Err(SiemensReadError { channel: s.channel, line, fault });
        }
        self.channel.items.push(Item { line, what: What::Mark(found) });
        Ok(())
    }

    /// Moves the axes to the positions of these words; returns the norm of their travels, mm and
    /// deg.
    fn go(&mut self, s: &Statements, line: u32, words: &AxisWords) -> Result<f64, SiemensReadError> {
        let mut length = 0.0_f64;
        for word in words.iter() {
            let at = self.channel.axes.iter_mut().find(|(a, _)| *a == word.letter);
            let fault = SiemensFault::Axis(word.letter);
            let (_, at) = at.ok_or(SiemensReadError { channel: s.channel, line, fault })?;
            length = length.hypot(word.value - at.replace(word.value).unwrap_or(word.value));
        }
        Ok(length)
    }

    fn body(&mut self, s: &mut Statements, is_per_minute: bool) -> Result<(), SiemensReadError> {
        loop {
            if let Some((line, number)) = s.take(mark) {
                self.add_mark(s, line, number)?;
            } else if let Some((line, words)) = s.take(rapid) {
                self.go(s, line, &words)?;
                self.push(s, line, true, 0.0)?;
            } else if let Some((line, (words, feed))) = s.take(cut) {
                let length = self.go(s, line, &words)?;
                self.push(s, line, false, if is_per_minute { 60.0 * length / feed } else { 60.0 / feed })?;
            } else if let Some((line, seconds)) = s.take(dwell) {
                self.push(s, line, false, seconds)?;
            } else if s.take(|s| (*s == Statement::SpindleOn).then_some(())).is_none() {
                return Ok(());
            }
        }
    }

    fn push(&mut self, s: &Statements, line: u32, is_rapid: bool, time: f64) -> Result<(), SiemensReadError> {
        let known = self.channel.axes.iter().map(|(a, at)| (*a, at.unwrap_or_default()));
        let words = AxisWords::from_words(known);
        let words = words.map_err(|e| SiemensReadError { channel: s.channel, line, fault: e.into() })?;
        self.channel.items.push(Item { line, what: What::Block { is_rapid, words, time } });
        Ok(())
    }

    fn end(&mut self, s: &mut Statements) -> Result<(), SiemensReadError> {
        s.expect_one("a block, a mark or M9", &Statement::CoolantOff)?;
        s.expect_one("M5", &Statement::SpindleOff)?;
        s.expect_one("G94", &Statement::PerMinute)?;
        for (k, axes) in self.homes.clone().into_iter().enumerate() {
            s.expect_one("the way home, as at the start", &Statement::Home(axes))?;
            if k == 0 {
                self.mark(s)?;
            }
        }
        self.mark(s)?;
        let last = [Statement::End, Statement::Label, Statement::Alarm, Statement::Stop, Statement::End];
        for statement in last {
            s.expect_one("the end with its alarm for a tool of another length", &statement)?;
        }
        let expected = "nothing behind the end";
        if s.is_over() { Ok(()) } else { Err(s.error(SiemensFault::NotHere { expected })) }
    }
}

/// Whether two lists hold the same axes in any order.
fn is_same(some: &[AxisLetter], wanted: &[AxisLetter]) -> bool {
    some.len() == wanted.len() && wanted.iter().all(|a| some.contains(a))
}

fn mark(s: &Statement) -> Option<u32> {
    if let Statement::Mark(number) = s { Some(*number) } else { None }
}

fn rapid(s: &Statement) -> Option<AxisWords> {
    if let Statement::Rapid(words) = s { Some(*words) } else { None }
}

fn cut(s: &Statement) -> Option<(AxisWords, f64)> {
    if let Statement::Cut { words, feed } = s { Some((*words, *feed)) } else { None }
}

fn dwell(s: &Statement) -> Option<f64> {
    if let Statement::Dwell(seconds) = s { Some(*seconds) } else { None }
}

/// Merges both channels item by item: marks with marks of the same number, blocks with blocks of
/// the same kind.
fn merge(first: &ChannelReader, second: &ChannelReader) -> Result<ReadPair, SiemensReadError> {
    let mut pair =
        ReadPair { blocks: Vec::new(), marks: Vec::new(), tool_lengths: [first.tool_length, second.tool_length] };
    for k in 0..first.items.len().max(second.items.len()) {
        let [a, b] = [first, second].map(|c| c.items.get(k));
        match (a.map(|i| &i.what), b.map(|i| &i.what)) {
            (Some(What::Mark(a)), Some(What::Mark(b))) if a == b => pair.marks.push(*a),
            (
                Some(What::Block { is_rapid, words, time }),
                Some(What::Block { is_rapid: other_rapid, words: other_words, time: other_time }),
            ) if is_rapid == other_rapid => {
                let line = |item: Option<&Item>| item.map_or(0, |i| i.line);
                let all = words.iter().chain(other_words.iter()).map(|w| (w.letter, w.value));
                let error = |fault| SiemensReadError { channel: 2, line: line(b), fault };
                pair.blocks.push(ReadPairBlock {
                    is_rapid: *is_rapid,
                    words: AxisWords::from_words(all).map_err(|e| error(e.into()))?,
                    times: [*time, *other_time],
                    marks_before: pair.marks.len(),
                    lines: [line(a), line(b)],
                });
            }
            (what, other) => {
                let name = |what: Option<&What>| what.map_or_else(|| "the end".to_owned(), What::name);
                let line = b.map_or(second.items.last().map_or(1, |i| i.line), |i| i.line);
                let fault = SiemensFault::OtherChannel { first: name(what), second: name(other) };
                return Err(SiemensReadError { channel: 2, line, fault });
            }
        }
    }
    Ok(pair)
}
