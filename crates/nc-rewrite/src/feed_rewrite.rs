//! New feeds for an existing program: the tip, not the norm over all axes, moves at the programmed
//! speed (FEED).

mod called_text;
mod checks;
pub mod law;

use std::io::{BufRead, Write};

use facemill_feedrate::{BlockFeed, FeedLimit, feed_for_block, rapid_time};
use facemill_inverse_kinematics::{AxisKind, AxisValues, FeedRange, Machine};
use facemill_job::failure::Failure;
use facemill_job::load::letter;
use facemill_job::setup::word_map::word_frame;
use facemill_nc_program::dialect::{DialectFile, NumberRule};
use facemill_nc_program::read::{Feed, MotionKind, ProgramReader, ReadBlock, ReadError, ReadMotion};
use facemill_nc_program::{Dialect, FeedMode, MappedAxis, WordMap, WorkOffset};
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader, StraightCut, legs};
use facemill_virtual_machine::program_time::program_moves::{MoveRuns, is_standstill};
use serde::Serialize;

use crate::feed_rewrite::checks::{Computed, Doubts, LAST_BITS, check_vectors, not_raised, rounded_down};
use crate::feed_rewrite::law::{FeedLaw, FeedLawTimes, Law, blending, timed};

/// Desired speed of the tip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum TipFeed {
    /// Each block's own F, taken for the speed of the tip. Refused if F looks computed for it
    /// already.
    #[default]
    Programmed,
    /// The tip's speed by the program's F, in the control's measure.
    Keep,
    /// This speed everywhere, mm/min.
    Given(f64),
}

/// Machine and settings of a program's run.
pub struct FeedRewriteSettings<'a> {
    /// The machine; views of one with several heads are refused.
    pub machine: &'a Machine,
    /// Distance from the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Speed of the tip.
    pub tip_feed: TipFeed,
    /// Position of the words' zero on the axes of the machine, mm or deg, by the axis' name; 0 for
    /// unnamed axes.
    pub work_offset: Vec<(String, f64)>,
    /// Control that the program is for.
    pub dialect: Dialect,
    /// Dialect file of a shop's own control of this dialect: its rapids under RTCP, decimals and
    /// motion between blocks; `None`: the dialect's own. Not checked here
    /// ([`facemill_job::load::post_load::read_dialect_file`]).
    pub dialect_file: Option<DialectFile>,
    /// Limits of acceleration and jerk of every axis, besides the velocities; `None`: velocities
    /// alone.
    pub time_law: Option<FeedLaw>,
}

impl FeedRewriteSettings<'_> {
    /// Returns the dialect file of the control.
    fn rules(&self) -> DialectFile {
        self.dialect_file.clone().unwrap_or_else(|| self.dialect.file())
    }
}

/// Program with new feeds.
#[derive(Debug)]
#[non_exhaustive]
pub struct RewrittenFeeds {
    /// Its text: that of the program with other F words, the same bytes elsewhere.
    pub text: Vec<u8>,
    /// Summary of the changes.
    pub summary: FeedRewriteSummary,
}

/// Times and counts of a program before and after.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FeedRewriteSummary {
    /// Cutting blocks whose axes are all known.
    pub blocks: usize,
    /// Number of them with another F.
    pub changed: usize,
    /// Number of them at the requested speed of the tip.
    pub by_tip_feed: usize,
    /// Number of them at the largest speed of an axis.
    pub by_axis: usize,
    /// Number of them at the largest or smallest F of the control.
    pub by_control: usize,
    /// Number of them lowered to the speed that the axes reach by their accelerations and jerks.
    pub by_law: usize,
    /// Moves that keep their feed: arcs, cycles, and blocks before every axis is known.
    pub kept: usize,
    /// Time of the cutting blocks at their old F, s, for blocks that had one.
    pub time_before_s: f64,
    /// Time of the same blocks at their new F, s.
    pub time_after_s: f64,
    /// Time of the rapids, s.
    pub rapid_time_s: f64,
    /// Times within acceleration and jerk, if requested.
    pub time_law: Option<FeedLawTimes>,
}

/// Gives every straight cutting block of a program the F at which the tip moves at its speed (FEED
/// (3) to (8)); keeps all other bytes. Without RTCP, F counts axes, and the tip's speed differs
/// from block to block: all axes, 1 deg as 1 mm; with LinuxCNC, and without FGROUP of a Siemens
/// control, the linear ones alone. Under RTCP and with inverse time, only the axes' speeds lower
/// it. F has at least four digits, with inverse time five, if the control accepts so many decimals,
/// and is rounded down, by no more than 1 %; an equivalent F stays as it is. Feeds of a program in
/// inches stay inch/min (on Heidenhain tenths of it), and count 1 deg as 1 inch if they count axes
/// that turn.
///
/// With a time law the tip's speed never exceeds the one that the axes reach in a block: the
/// program is read twice, with all its straight moves timed between, and each F is lowered to the
/// largest speed in its block.
///
/// [`rewrite_feed_lines`] does the same without holding the text.
///
/// # Errors
/// With the line: text that is not understood, or that is not evaluated and may move axes or skip
/// blocks; an axis that the machine does not have; another work offset than the first; motions and
/// feeds that a switch skips (`/`); a feed of zero, or none; an axis beyond its limits (for linear
/// axes only with a work offset); F below the control's smallest, or of more decimals than it
/// accepts.
pub fn rewrite_feeds(text: &[u8], settings: &FeedRewriteSettings<'_>) -> Result<RewrittenFeeds, String> {
    let mut out = Vec::with_capacity(text.len() + text.len() / 8);
    let summary = rewrite_feed_lines(|| Ok(text), settings, &mut out).map_err(|stopped| stopped.to_string())?;
    Ok(RewrittenFeeds { text: out, summary })
}

/// Reason why a program has no new feeds.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FeedRewriteError {
    /// The program cannot be read.
    #[error("{0}")]
    Read(std::io::Error),
    /// The new one cannot be written.
    #[error("{0}")]
    Write(std::io::Error),
    /// The program or the settings have a fault.
    #[error("{0}")]
    Program(String),
    /// A line of the program has a fault.
    #[error("line {line}: {why}{}", shown(block_text.as_deref()))]
    Line {
        /// Its number, from 1.
        line: u32,
        /// The fault.
        why: String,
        /// Text of the line where it is the block at fault.
        block_text: Option<String>,
    },
    /// The text of the program is not understood.
    #[error("{0}")]
    Text(ReadError),
}

/// Returns the end of a message, which shows the block at fault.
fn shown(block_text: Option<&str>) -> String {
    block_text.map_or_else(String::new, |text| format!(": {text}"))
}

impl From<String> for FeedRewriteError {
    fn from(what: String) -> Self {
        Self::Program(what)
    }
}

/// Runs [`rewrite_feeds`] line by line from a source, opened at its start each time, to a new
/// program: holds one line at a time, and with a time law the ends of all moves.
///
/// Output that was written before a failure is no program.
///
/// # Errors
/// As [`rewrite_feeds`], and the errors of source and output.
pub fn rewrite_feed_lines<R: BufRead>(
    open: impl Fn() -> std::io::Result<R>,
    settings: &FeedRewriteSettings<'_>,
    out: &mut dyn Write,
) -> Result<FeedRewriteSummary, FeedRewriteError> {
    let words = word_map(settings)?;
    let Some(law) = &settings.time_law else {
        return Ok(read(&open, FeedOptimizer::new(settings, &words, Law::Off)?, Some(out))?.summary);
    };
    let run = FeedOptimizer::new(settings, &words, Law::Collecting(MoveRuns::default()))?;
    let tolerance = blending(settings.machine, law)?;
    let control = settings.rules().control_motion;
    let Law::Collecting(moves) = read(&open, run, None)?.law else {
        return Err("no moves were collected".to_owned().into());
    };
    let (peak_times, times) = timed(
        settings.machine,
        settings.tool_length,
        (tolerance, &control),
        word_frame(settings.machine, &words),
        moves,
    )?;
    let known = FeedOptimizer::new(settings, &words, Law::Known(peak_times, 0))?;
    let mut summary = read(&open, known, Some(out))?.summary;
    summary.time_law = Some(FeedLawTimes { lowered_blocks: summary.by_law, ..times });
    Ok(summary)
}

/// Reads a program line by line, and writes it with its new feeds if there is an output.
fn read<'s, R: BufRead>(
    open: &impl Fn() -> std::io::Result<R>,
    mut run: FeedOptimizer<'s>,
    mut out: Option<&mut dyn Write>,
) -> Result<FeedOptimizer<'s>, FeedRewriteError> {
    let start = || open().map_err(FeedRewriteError::Read);
    let mut reader = ProgramReader::of_source(run.settings.dialect, start()?).map_err(FeedRewriteError::Read)?;
    let mut source = start()?;
    let mut doubts = Doubts::default();
    let (mut line, mut new) = (Vec::new(), Vec::new());
    loop {
        line.clear();
        if source.read_until(b'\n', &mut line).map_err(FeedRewriteError::Read)? == 0 {
            break;
        }
        let block = reader.read_line(&line).map_err(FeedRewriteError::Text)?;
        if let Some(block) = &block {
            doubts.read(block);
        }
        let edit = match &block {
            Some(block) => run.block(block).map_err(|why| FeedRewriteError::Line {
                line: block.line,
                why,
                block_text: Some(String::from_utf8_lossy(line.trim_ascii()).into_owned()),
            })?,
            None => Edit::Keep,
        };
        let Some(out) = &mut out else { continue };
        new.clear();
        match &block {
            Some(block) => edit.apply(&line, block, &mut new),
            None => new.extend_from_slice(&line),
        }
        out.write_all(&new).map_err(FeedRewriteError::Write)?;
    }
    doubts.check(&reader.finish().1)?;
    run.computed.check()?;
    Ok(run)
}

/// Change of a line.
enum Edit {
    Keep,
    /// Its F gets this number.
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

struct FeedOptimizer<'s> {
    settings: &'s FeedRewriteSettings<'s>,
    follower: MotionReader<'s>,
    /// Feed in force in the new program.
    in_force: Option<Feed>,
    /// Format of the control's numbers.
    numbers: NumberRule,
    law: Law,
    computed: Computed,
    summary: FeedRewriteSummary,
}

/// Longest tool, mm: as for all lengths in jobs.
pub const MAX_TOOL_LENGTH: f64 = facemill_job::validate::FARTHEST;

/// Checks the settings, and returns the words of the machine.
fn word_map(settings: &FeedRewriteSettings<'_>) -> Result<WordMap, String> {
    let machine = settings.machine;
    if machine.head_count() > 1 {
        return Err("the machine has several heads; feeds are planned again for one".to_owned());
    }
    for (k, (name, value)) in settings.work_offset.iter().enumerate() {
        if machine.axis_index(name).is_none() {
            return Err(format!("--work-offset {name}: the machine has no such axis"));
        }
        if settings.work_offset[..k].iter().any(|(other, _)| other == name) {
            return Err(format!("--work-offset {name}: is given twice; give one value for each axis"));
        }
        if !value.is_finite() {
            return Err(format!("--work-offset {name}: {value} is not a finite number"));
        }
    }
    if let TipFeed::Given(feed) = settings.tip_feed
        && !(feed > 0.0 && feed.is_finite())
    {
        return Err("--tip-feed: must be above 0 mm/min".to_owned());
    }
    if !(settings.tool_length > 0.0 && settings.tool_length <= MAX_TOOL_LENGTH) {
        return Err(format!("--tool-length-mm: must be above 0, at most {MAX_TOOL_LENGTH} mm"));
    }
    let travel =
        machine.length_compensation_travel().ok_or("the machine's linear axes are dependent at the zero pose")?;
    let axes = machine.axes().iter().enumerate().map(|(k, axis)| {
        let named = settings.work_offset.iter().find(|(name, _)| name == axis.letter.as_str());
        let offset = named.map_or(0.0, |(_, value)| *value);
        let offset = if axis.kind == AxisKind::Rotary { offset.to_radians() } else { offset };
        let letter = letter(axis.letter.as_str()).map_err(|e: Failure| e.to_string())?;
        Ok(MappedAxis { letter, offset, along_spindle: travel.get_or_zero(k) })
    });
    let axes = axes.collect::<Result<_, String>>()?;
    WordMap::new(axes, WorkOffset::default(), settings.tool_length).map_err(|e| e.to_string())
}

impl<'s> FeedOptimizer<'s> {
    fn new(settings: &'s FeedRewriteSettings<'s>, words: &'s WordMap, law: Law) -> Result<Self, String> {
        let machine = settings.machine;
        let frame = word_frame(machine, words);
        let at = MotionContext { machine, tool_length: settings.tool_length, words, frame, work_offset: None };
        let rules = settings.rules();
        Ok(Self {
            settings,
            follower: MotionReader::new(at, settings.dialect, rules.rtcp_rapids()),
            in_force: None,
            numbers: rules.numbers,
            law,
            computed: Computed::default(),
            summary: FeedRewriteSummary::default(),
        })
    }

    /// Returns the change of a line.
    ///
    /// # Errors
    /// With the fault of the block, without its line.
    fn block(&mut self, block: &ReadBlock) -> Result<Edit, String> {
        let is_named = block.feed_span().is_some();
        if block.skippable && (is_named || block.motion.is_some()) {
            let why = "a switch decides whether it is run, and so determines feed and position of the next block";
            return Err(why.to_owned());
        }
        let stops = is_standstill(block);
        if stops {
            self.law.stop();
        }
        if let Some(motion) = &block.motion {
            check_vectors(self.settings.dialect, motion)?;
        }
        let way = self.follower.block(block)?;
        let Some(motion) = &block.motion else {
            self.forget_feed(is_named);
            return Ok(Edit::Keep);
        };
        let edit = self.motion(block, motion, way);
        if stops {
            self.law.stop();
        }
        edit
    }

    fn motion(&mut self, block: &ReadBlock, motion: &ReadMotion, way: AxisMotion) -> Result<Edit, String> {
        match way {
            AxisMotion::Cut(cut) => {
                self.within_limits(&cut.to)?;
                self.cut(block, motion, &cut)
            }
            AxisMotion::Rapid { positions, law } => {
                let (machine, length) = (self.settings.machine, self.settings.tool_length);
                for [from, to] in legs(&positions) {
                    self.within_limits(to)?;
                    self.summary.rapid_time_s += rapid_time(machine, law, from, to, length);
                    self.law.rapid((machine, length), law, [from, to]);
                }
                if motion.kind == MotionKind::ReferenceReturn {
                    self.law.stop();
                }
                self.forget_feed(block.feed_span().is_some());
                Ok(Edit::Keep)
            }
            AxisMotion::None => Ok(Edit::Keep),
            AxisMotion::Other(end) => {
                if let Some(end) = end {
                    self.within_limits(&end)?;
                }
                if motion.kind.is_rapid() {
                    self.forget_feed(block.feed_span().is_some());
                    return Ok(Edit::Keep);
                }
                self.law.stop();
                self.keep(block, motion)
            }
        }
    }

    /// Forgets the feed: an F that is only remembered in its block is in force behind it,
    /// regardless of the previous one.
    fn forget_feed(&mut self, is_named: bool) {
        if is_named {
            self.in_force = None;
        }
    }

    /// Keeps the feed of a block, and states it if another one is in force.
    fn keep(&mut self, block: &ReadBlock, motion: &ReadMotion) -> Result<Edit, String> {
        self.summary.kept += 1;
        let is_other = motion.feed.is_some() && self.in_force.is_some() && motion.feed != self.in_force;
        self.in_force = motion.feed.or(self.in_force);
        match motion.feed {
            Some(feed) if is_other && block.feed_span().is_none() => {
                with_place(block, self.text_of(in_unit(feed.value, motion.feed_unit)))
            }
            _ => Ok(Edit::Keep),
        }
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

    fn cut(&mut self, block: &ReadBlock, motion: &ReadMotion, cut: &StraightCut) -> Result<Edit, String> {
        let machine = self.settings.machine;
        if cut.is_free() {
            self.law.free(cut);
            return self.keep(block, motion);
        }
        self.computed_feed(cut, motion.feed);
        let mut range = machine.feed_range();
        if !cut.is_norm {
            // The range applies to F, which is not in mm/min over all axes here.
            (range.min, range.max) = (0.0, f64::INFINITY);
        }
        let (way, requested) = self.requested_speed(cut, motion.feed)?;
        let given = if cut.is_norm { requested } else { within_range(requested, cut, &machine.feed_range()) };
        let mut fed =
            feed_for_block(machine.axes(), &cut.from, &cut.to, way, given, &range).map_err(|e| e.to_string())?;
        let faster = if cut.is_norm { 60.0 * way / (requested * fed.time) } else { given / requested };
        if fed.limit == FeedLimit::ControlMin || !cut.is_norm {
            not_raised(faster, machine.feed_range().min)?;
        }
        if fed.limit == FeedLimit::NoMotion {
            return self.keep(block, motion);
        }
        let is_lowered = self.law.cut(cut, &mut fed, &range);
        self.count(&fed, cut.time, is_lowered);
        let mode = cut.mode;
        let value = match mode {
            FeedMode::G93 => 60.0 / fed.time,
            FeedMode::G94 if cut.is_norm => fed.f_word,
            FeedMode::G94 | FeedMode::Rtcp => 60.0 * cut.counted / fed.time,
        };
        let least = machine.feed_range().min;
        if !cut.is_norm && mode != FeedMode::G93 && value < least * (1.0 - SAME_FEED) {
            return Err(format!("it needs F{value:.4}, but the smallest that the machine accepts is {least}"));
        }
        let unit = motion.feed_unit;
        let number = self.number(value / unit, motion.feed.map(|f| f.value / unit), mode)?;
        let value = number.as_ref().map_or_else(|| motion.feed.map_or(value, |f| f.value), |(_, value)| *value * unit);
        let feed = Feed { mode, value };
        let is_same = self.in_force == Some(feed) && mode != FeedMode::G93;
        self.in_force = Some(feed);
        self.summary.changed += usize::from(motion.feed != Some(feed));
        let is_named = block.feed_span().is_some();
        if is_same && !is_named || motion.feed == Some(feed) && is_named {
            return Ok(Edit::Keep);
        }
        with_place(block, number.map_or_else(|| self.text_of(in_unit(value, unit)), |(text, _)| text))
    }

    /// Returns a number of the program, with a point if the control requires one.
    fn text_of(&self, value: f64) -> String {
        let text = value.to_string();
        if self.numbers.always_point && !text.contains('.') { text + "." } else { text }
    }

    /// Returns the length of the tip's path and its desired speed.
    fn requested_speed(&self, cut: &StraightCut, feed: Option<Feed>) -> Result<(f64, f64), String> {
        // For a tip at rest, a path of nearly no length keeps the time.
        let kept = |time: f64| (cut.way.max(LEAST_WAY), 60.0 * cut.way.max(LEAST_WAY) / time);
        match (self.settings.tip_feed, feed, cut.time) {
            (TipFeed::Given(requested), ..) => Ok((cut.way, requested)),
            (TipFeed::Keep, _, Some(time)) => Ok(kept(time)),
            (TipFeed::Programmed, Some(Feed { mode: FeedMode::G93, .. }), Some(time)) => Ok(kept(time)),
            (TipFeed::Programmed, Some(feed), _) => Ok((cut.way, feed.value)),
            _ => Err("it has no feed; give one with --tip-feed".to_owned()),
        }
    }

    fn computed_feed(&mut self, cut: &StraightCut, feed: Option<Feed>) {
        if self.settings.tip_feed == TipFeed::Programmed {
            self.computed.read(cut, feed);
        }
    }

    /// Returns the text and value of a feed; `None` if the existing one is equivalent.
    fn number(&self, value: f64, old: Option<f64>, mode: FeedMode) -> Result<Option<(String, f64)>, String> {
        let most = self.numbers.max_decimals;
        let (most, digits) = match mode {
            FeedMode::G93 => (most.inverse_time, 5),
            FeedMode::G94 | FeedMode::Rtcp => (most.feed, 4),
        };
        if old.is_some_and(|old| old <= value * (1.0 + LAST_BITS) && old >= value * (1.0 - SAME_FEED)) {
            return Ok(None);
        }
        rounded_down(value, most, digits, self.numbers.always_point).map(Some)
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

/// Converts a feed (mm/min) to the program's unit, without the factor's error in the last digits.
fn in_unit(feed: f64, unit: f64) -> f64 {
    if unit == 1.0 { feed } else { (feed / unit * 1e9).round() / 1e9 }
}

/// Limits a speed of the tip (mm/min) to those whose F, which counts the block's path by the
/// control's rule, the control accepts.
fn within_range(requested: f64, cut: &StraightCut, range: &FeedRange) -> f64 {
    if cut.mode == FeedMode::G93 || cut.way <= LEAST_WAY || cut.counted <= 0.0 {
        return requested;
    }
    let share = cut.way / cut.counted;
    requested.max(range.min * share).min(range.max * share)
}

/// Returns the feed of a block, if the block has a place for one.
fn with_place(block: &ReadBlock, number: String) -> Result<Edit, String> {
    match block.feed_span().is_some() || block.insert_feed_at().is_some() {
        true => Ok(Edit::Feed(number)),
        false => Err(format!("it needs F{number} but has no place for a feed")),
    }
}

/// Tolerance of a position beyond a limit, mm or rad: rounding of words.
const LIMIT_SLACK: f64 = 1e-6;

/// Path length of a tip at rest whose time is kept, mm.
const LEAST_WAY: f64 = 1e-9;

/// Largest fraction by which an existing F below the new one still stays. Larger: repeated runs
/// make programs ever slower.
const SAME_FEED: f64 = 1e-5;
