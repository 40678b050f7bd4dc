//! New feeds for a program that exists: the tip moves as fast as programmed, not the norm over all axes (FEED).

use facemill_feedrate::{BlockFeed, FeedLimit, feed_for_block, rapid_time};
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_nc_program::{
    AxisAt, Compensation, Dialect, Feed, FeedMode, MappedAxis, MotionKind, NoteKind, NumberRule, ProgramReader,
    ReadBlock, ReadMotion, WordMap, WordMapError, WorkOffset,
};
use nalgebra::Point3;
use serde::Serialize;

use crate::Failure;
use crate::program::letter;
use crate::refeed_law::{Law, Moves, RefeedLaw, RefeedLawTimes, blending, stands, timed};
use facemill_virtual_machine::CountedAxes;

/// What a program is run on.
pub struct RefeedSettings<'a> {
    /// The machine; its views with several heads are refused.
    pub machine: &'a Machine,
    /// From the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Speed of the tip, mm/min; `None`: each block's own F, taken as that.
    pub tip_feed: Option<f64>,
    /// Where the words' zero is on the axes of the machine, mm or deg, by the axis' name; 0 where it is not named.
    pub work_offset: Vec<(String, f64)>,
    /// Control that the program is for.
    pub dialect: Dialect,
    /// Within acceleration and jerk of every axis, too; `None`: within their velocities.
    pub time_law: Option<RefeedLaw>,
}

/// A program with new feeds.
#[derive(Debug)]
pub struct Refed {
    /// Its text: that of the program with other F words, byte for byte.
    pub text: Vec<u8>,
    /// What was done.
    pub summary: RefeedSummary,
}

/// Times and counts of a program before and after.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RefeedSummary {
    /// Cutting blocks whose axes are all known.
    pub blocks: usize,
    /// Of them with another F.
    pub changed: usize,
    /// Of them as fast as the tip was asked for.
    pub by_tip_feed: usize,
    /// Of them as fast as an axis can.
    pub by_axis: usize,
    /// Of them at the largest or smallest F of the control.
    pub by_control: usize,
    /// Of them lowered to what the axes reach by their accelerations and jerks.
    pub by_law: usize,
    /// Moves that keep their feed: arcs, cycles, and blocks before every axis is known.
    pub kept: usize,
    /// Time of the cutting blocks at their old F, s; of those that had one.
    pub time_before_s: f64,
    /// Time of the same blocks at their new F, s.
    pub time_after_s: f64,
    /// Time of the rapids, s.
    pub rapid_time_s: f64,
    /// Times within acceleration and jerk, where these were asked for.
    pub time_law: Option<RefeedLawTimes>,
}

/// Gives every straight cutting block of a program the F with which the tip moves at its speed (FEED (3) to (8)); all else is
/// kept byte for byte. Without RTCP F counts axes and the tip's speed is another in every block: all axes, 1 deg as 1 mm; with
/// LinuxCNC and without FGROUP of a Siemens control the linear ones alone. Under RTCP and with inverse time the axes' speeds
/// alone lower it. F has at least four digits and is rounded down, never to zero.
///
/// With a time law the tip never is asked for more than the axes reach in a block: the program is read twice, all its straight moves
/// are timed between, and each F is lowered to what the largest speed in its block asks for.
///
/// The program is read line by line; besides its text the new one is all that is held, and with a time law the ends of the moves.
///
/// # Errors
/// With the line: what is not understood, or not evaluated and may move axes or skip blocks; an axis that the machine does not
/// have; another work offset than the first; words in inches; motions and feeds that a switch skips (`/`); a feed of zero, or none; an axis beyond its limits (of linear axes where the work
/// offset is told); F below the control's smallest.
pub fn refeed(text: &[u8], settings: &RefeedSettings<'_>) -> Result<Refed, String> {
    let Some(law) = &settings.time_law else {
        let mut out = Vec::with_capacity(text.len() + text.len() / 8);
        let run = read(text, Refeeder::new(settings, Law::Off)?, Some(&mut out))?;
        return Ok(Refed { text: out, summary: run.summary });
    };
    let run = Refeeder::new(settings, Law::Collecting(Moves::default()))?;
    let tolerance = blending(settings.machine, law)?;
    let Law::Collecting(moves) = read(text, run, None)?.law else { return Err("no moves were collected".to_owned()) };
    let (peak_times, times) = timed(settings.machine, settings.tool_length, tolerance, moves)?;
    let mut out = Vec::with_capacity(text.len() + text.len() / 8);
    let mut summary = read(text, Refeeder::new(settings, Law::Known(peak_times, 0))?, Some(&mut out))?.summary;
    summary.time_law = Some(RefeedLawTimes { lowered_blocks: summary.by_law, ..times });
    Ok(Refed { text: out, summary })
}

/// Reads a program line by line, and writes it with its new feeds where it is to be written.
fn read<'s>(text: &[u8], mut run: Refeeder<'s>, mut out: Option<&mut Vec<u8>>) -> Result<Refeeder<'s>, String> {
    let settings = run.settings;
    let mut reader = ProgramReader::new(settings.dialect);
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        let block = reader.read_line(line).map_err(|e| e.to_string())?;
        match (block.map(|block| run.block(&block).map(|edit| (block, edit))), &mut out) {
            (None, Some(out)) => out.extend_from_slice(line),
            (Some(Ok((block, edit))), Some(out)) => edit.apply(line, &block, out),
            (None | Some(Ok(_)), None) => {}
            (Some(Err(why)), _) => {
                let shown = String::from_utf8_lossy(line.trim_ascii()).into_owned();
                return Err(format!("{why}: {shown}"));
            }
        }
    }
    let doubts = |kind| matches!(kind, NoteKind::NotEvaluated | NoteKind::Branch);
    if let Some(note) = reader.finish().1.iter().find(|n| doubts(n.kind)) {
        let what =
            "is not evaluated and may move axes, change offsets or skip blocks, so speeds behind it are not known";
        return Err(format!("line {}: {} {what}", note.line, note.text));
    }
    Ok(run)
}

/// What is done to a line.
enum Edit {
    Keep,
    /// Its F has this number.
    Feed(String),
}

impl Edit {
    fn apply(&self, line: &[u8], block: &ReadBlock, out: &mut Vec<u8>) {
        let place = block.feed_place;
        let start = place.line_start();
        match (self, place.number_span(), place.insert_at()) {
            (Self::Feed(number), Some(span), _) => {
                out.extend_from_slice(&line[..span.start - start]);
                out.extend_from_slice(number.as_bytes());
                out.extend_from_slice(&line[span.end - start..]);
            }
            (Self::Feed(number), None, Some(at)) => {
                let (before, behind) = line.split_at(at - start);
                out.extend_from_slice(before);
                if !before.ends_with(b" ") {
                    out.push(b' ');
                }
                out.push(b'F');
                out.extend_from_slice(number.as_bytes());
                if behind.first().is_some_and(|b| !b.is_ascii_whitespace()) {
                    out.push(b' ');
                }
                out.extend_from_slice(behind);
            }
            _ => out.extend_from_slice(line),
        }
    }
}

struct Refeeder<'s> {
    settings: &'s RefeedSettings<'s>,
    home: Vec<f64>,
    /// The words of the program's first work offset.
    words: Option<WordMap>,
    /// Where the axes are, where all are known.
    at: Option<AxisValues>,
    /// The feed in force in the new program.
    in_force: Option<Feed>,
    counted: CountedAxes,
    /// How the control's numbers look.
    numbers: NumberRule,
    law: Law,
    summary: RefeedSummary,
}

impl<'s> Refeeder<'s> {
    fn new(settings: &'s RefeedSettings<'s>, law: Law) -> Result<Self, String> {
        let machine = settings.machine;
        if machine.head_count() > 1 {
            return Err("the machine has several heads; feeds are planned again for one".to_owned());
        }
        for (name, value) in &settings.work_offset {
            if machine.axis_index(name).is_none() {
                return Err(format!("--work-offset {name}: the machine has no such axis"));
            }
            if !value.is_finite() {
                return Err(format!("--work-offset {name}: {value} is no finite number"));
            }
        }
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if settings.tip_feed.is_some_and(|f| !positive(f)) {
            return Err("--tip-feed: must be above 0 mm/min".to_owned());
        }
        if !(settings.tool_length >= 0.0 && settings.tool_length.is_finite()) {
            return Err("--tool-length-mm: must be a length of at least 0".to_owned());
        }
        let home = machine.home();
        Ok(Self {
            settings,
            home: home.iter().collect(),
            words: None,
            at: None,
            in_force: None,
            counted: CountedAxes::default(),
            numbers: settings.dialect.file().numbers,
            law,
            summary: RefeedSummary::default(),
        })
    }

    fn block(&mut self, block: &ReadBlock) -> Result<Edit, String> {
        let at_line = |why: String| format!("line {}: {why}", block.line);
        let is_named = block.feed_span().is_some();
        self.counted.read(self.settings.dialect, block).map_err(&at_line)?;
        if block.skippable && (is_named || block.motion.is_some()) {
            return Err(at_line(
                "a switch decides whether it is run, and so which feed and place the next has".to_owned(),
            ));
        }
        let stands = stands(block);
        if stands {
            self.law.stop();
        }
        let Some(motion) = &block.motion else {
            self.forget_feed(is_named);
            return Ok(Edit::Keep);
        };
        let edit = self.motion(block, motion, is_named);
        if stands {
            self.law.stop();
        }
        edit.map_err(at_line)
    }

    fn motion(&mut self, block: &ReadBlock, motion: &ReadMotion, is_named: bool) -> Result<Edit, String> {
        let from = self.at;
        let to = self.end(motion)?;
        self.at = to;
        if let Some(axes) = &to {
            self.within_limits(axes)?;
        }
        match (motion.kind, from, to) {
            (MotionKind::Linear, Some(from), Some(to)) => self.cut(block, motion, &from, &to),
            (MotionKind::Rapid | MotionKind::ReferenceReturn, from, to) => {
                if let (Some(from), Some(to)) = (from, to) {
                    let (machine, length) = (self.settings.machine, self.settings.tool_length);
                    // Where the tip goes straight this is a lower bound all the more.
                    self.summary.rapid_time_s += rapid_time(machine, machine.motion_law().rapid, &from, &to, length);
                    self.law.rapid(self.settings.machine, &from, &to);
                }
                if motion.kind == MotionKind::ReferenceReturn {
                    self.law.stop();
                }
                self.forget_feed(is_named);
                Ok(Edit::Keep)
            }
            _ => {
                self.law.stop();
                self.summary.kept += 1;
                self.keep(block, motion)
            }
        }
    }

    /// An F that stands where it is only remembered is in force behind it, whatever was before.
    fn forget_feed(&mut self, is_named: bool) {
        if is_named {
            self.in_force = None;
        }
    }

    /// A block that keeps its feed says it where another one is in force.
    fn keep(&mut self, block: &ReadBlock, motion: &ReadMotion) -> Result<Edit, String> {
        let is_other = motion.feed.is_some() && self.in_force.is_some() && motion.feed != self.in_force;
        self.in_force = motion.feed.or(self.in_force);
        match motion.feed {
            Some(feed) if is_other && block.feed_span().is_none() => with_place(block, feed.value.to_string()),
            _ => Ok(Edit::Keep),
        }
    }

    /// Where a move ends; `None` while the program has not named every axis.
    fn end(&mut self, motion: &ReadMotion) -> Result<Option<AxisValues>, String> {
        if motion.is_inch {
            return Err("its words count in inches; new feeds are mm/min".to_owned());
        }
        if motion.tool.is_some() {
            return Err("tool vectors stand for rotary words; feeds need these".to_owned());
        }
        let words = match self.words.take() {
            Some(words) => words,
            None => self.word_map(motion.work_offset)?,
        };
        let found = match motion.compensation {
            Compensation::Rtcp(_) => self.rtcp_end(&words, motion),
            _ => {
                words.joints_at(motion, &self.home).map(|joints| Some(AxisValues::from_fn(joints.len(), |k| joints[k])))
            }
        };
        self.words = Some(words);
        match found {
            Ok(end) => Ok(end),
            Err(WordMapError::UnknownAxis(_)) => Ok(None),
            Err(why) => Err(why.to_string()),
        }
    }

    fn word_map(&self, work_offset: WorkOffset) -> Result<WordMap, String> {
        let machine = self.settings.machine;
        let travel =
            machine.length_compensation_travel().ok_or("the machine's linear axes are dependent at the zero pose")?;
        let axes = machine.axes().iter().enumerate().map(|(k, axis)| {
            let named = self.settings.work_offset.iter().find(|(name, _)| name == axis.letter.as_str());
            let offset = named.map_or(0.0, |(_, value)| *value);
            let offset = if axis.kind == AxisKind::Rotary { offset.to_radians() } else { offset };
            let letter = letter(axis.letter.as_str()).map_err(|e: Failure| e.to_string())?;
            Ok(MappedAxis { letter, offset, along_spindle: travel.get_or_zero(k) })
        });
        let axes = axes.collect::<Result<_, String>>()?;
        WordMap::new(axes, work_offset, self.settings.tool_length).map_err(|e| e.to_string())
    }

    /// Axis values of a position under RTCP: X, Y and Z are the tip's, in the frame of the table at rotary words 0.
    fn rtcp_end(&self, words: &WordMap, motion: &ReadMotion) -> Result<Option<AxisValues>, WordMapError> {
        let machine = self.settings.machine;
        let mut tip = Point3::origin();
        let mut axes = machine.home();
        for (k, axis) in words.axes().iter().enumerate() {
            let Some(AxisAt::Word(word)) = motion.position.get(axis.letter) else { return Ok(None) };
            match machine.axes()[k].kind {
                AxisKind::Rotary => axes[k] = axis.offset + word.to_radians(),
                AxisKind::Linear => {
                    let coordinate = "XYZ".find(axis.letter.letter()).ok_or(WordMapError::Rtcp)?;
                    tip[coordinate] = word + axis.offset;
                }
            }
        }
        Ok(machine.with_tip_at(&axes, &tip, self.settings.tool_length))
    }

    fn within_limits(&self, axes: &AxisValues) -> Result<(), String> {
        let machine = self.settings.machine;
        for (k, axis) in machine.axes().iter().enumerate() {
            let is_placed = axis.kind == AxisKind::Rotary || !self.settings.work_offset.is_empty();
            let slack = LIMIT_SLACK;
            if is_placed && !axis.endless && !(axis.min - slack..=axis.max + slack).contains(&axes[k]) {
                let [value, min, max] = [axes[k], axis.min, axis.max].map(|v| axis.in_word_unit(v));
                return Err(format!("axis {} goes to {value:.3}, its limits are {min:.3} and {max:.3}", axis.letter));
            }
        }
        Ok(())
    }

    fn cut(
        &mut self,
        block: &ReadBlock,
        motion: &ReadMotion,
        from: &AxisValues,
        to: &AxisValues,
    ) -> Result<Edit, String> {
        let (machine, length) = (self.settings.machine, self.settings.tool_length);
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        if let Some(feed) = motion.feed.filter(|f| f.value <= 0.0 || f.value.is_nan()) {
            return Err(format!("its feed is {}", feed.value));
        }
        let tip = |axes: &AxisValues| machine.cl_point(axes, length).tip;
        let way = (tip(to) - tip(from)).norm();
        let mode = motion.feed.map_or(if is_rtcp { FeedMode::Rtcp } else { FeedMode::G94 }, |f| f.mode);
        let (counted, is_norm) = match mode {
            FeedMode::G94 if is_rtcp => return Err("F is not the tip's under RTCP there".to_owned()),
            FeedMode::G94 => self.counted.length(self.settings.dialect, machine, from, to)?,
            FeedMode::G93 | FeedMode::Rtcp => (way, false),
        };
        let before = motion.feed.map(|f| match f.mode {
            FeedMode::G93 => 60.0 / f.value,
            FeedMode::G94 | FeedMode::Rtcp => 60.0 * counted / f.value,
        });
        let asked = match (self.settings.tip_feed, motion.feed, before) {
            (Some(tip_feed), ..) => tip_feed,
            (None, Some(Feed { mode: FeedMode::G93, .. }), Some(time)) => 60.0 * way.max(LEAST_WAY) / time,
            (None, Some(feed), _) => feed.value,
            (None, ..) => return Err("it has no feed; give one with --tip-feed".to_owned()),
        };
        let mut range = machine.feed_range();
        if !is_norm {
            // The range is of F in mm/min over all axes.
            (range.min, range.max) = (0.0, f64::INFINITY);
        }
        let mut fed = feed_for_block(machine.axes(), from, to, way, asked, &range).map_err(|e| e.to_string())?;
        if fed.limit == FeedLimit::NoMotion {
            self.summary.kept += 1;
            return self.keep(block, motion);
        }
        let is_lowered = self.law.cut([from, to], &mut fed, before, &range);
        self.count(&fed, before, is_lowered);
        let value = match mode {
            FeedMode::G93 => 60.0 / fed.time,
            FeedMode::G94 if is_norm => fed.f_word,
            FeedMode::G94 | FeedMode::Rtcp => 60.0 * counted / fed.time,
        };
        let most = self.numbers.max_decimals;
        let most = if mode == FeedMode::G93 { most.inverse_time } else { most.feed };
        let rounded = rounded_down(value, most, self.numbers.always_point);
        let (number, value) = rounded.ok_or_else(|| format!("it needs F{value:e}, which no word can say"))?;
        let feed = Feed { mode, value };
        let is_same = self.in_force == Some(feed) && mode != FeedMode::G93;
        self.in_force = Some(feed);
        self.summary.changed += usize::from(motion.feed != Some(feed));
        let is_named = block.feed_span().is_some();
        Ok(if is_same && !is_named || motion.feed == Some(feed) && is_named {
            Edit::Keep
        } else {
            with_place(block, number)?
        })
    }

    fn count(&mut self, fed: &BlockFeed, before: Option<f64>, is_lowered: bool) {
        let summary = &mut self.summary;
        summary.blocks += 1;
        match fed.limit {
            _ if is_lowered => summary.by_law += 1,
            FeedLimit::TipFeed | FeedLimit::NoMotion => summary.by_tip_feed += 1,
            FeedLimit::Axis(_) => summary.by_axis += 1,
            FeedLimit::ControlMax | FeedLimit::ControlMin => summary.by_control += 1,
        }
        if let Some(before) = before {
            summary.time_before_s += before;
            summary.time_after_s += fed.time;
        }
    }
}

/// The feed of a block, where the block has a place for one.
fn with_place(block: &ReadBlock, number: String) -> Result<Edit, String> {
    match block.feed_span().is_some() || block.insert_feed_at().is_some() {
        true => Ok(Edit::Feed(number)),
        false => Err(format!("it needs F{number} and has no place for a feed")),
    }
}

/// A feed rounded down, as text and as the number that this is: with a decimal at least, and with as many of the control's as
/// four digits take. `None` where that is zero.
fn rounded_down(value: f64, most_decimals: u8, always_point: bool) -> Option<(String, f64)> {
    let leading = value.log10().floor().clamp(-9.0, 9.0) as i32;
    let decimals = (3 - leading).clamp(1, i32::from(most_decimals).max(1));
    let scale = 10f64.powi(decimals);
    // What is a whole number of units but for the last bits of a double stays it.
    let units = (value * scale * (1.0 + 1e-12)).floor();
    let text = format!("{:.*}", usize::try_from(decimals).unwrap_or(1), units / scale);
    let text = text.trim_end_matches('0');
    let plain = text.trim_end_matches('.');
    let value = plain.parse().ok()?;
    (units >= 1.0).then(|| (if always_point { text } else { plain }.to_owned(), value))
}

/// How far beyond a limit a position may seem, mm or rad: rounding of words.
const LIMIT_SLACK: f64 = 1e-6;

/// Way that a tip counts for with inverse time where it stands, mm.
const LEAST_WAY: f64 = 1e-9;
