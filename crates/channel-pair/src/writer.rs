//! Writer of both programs.

use std::fmt::Write;

use crate::channel::{Channel, Group, WordPositions, channels, norm};
use crate::pair::{SiemensFeed, SiemensPair, SiemensSettings};
use crate::statement::{ALARM, CHECK_TOLERANCE, FGREF, LABEL, SAFE_START};
use facemill_nc_program::dialect::{BlockNumbers, Decimals};
use facemill_nc_program::words::{AxisKind, number_text};
use facemill_nc_program::{
    AxisLetter, AxisWords, Block, Coolant, FeedMode, HeadSpec, ProgramSpec, WorkOffset, WriteError, check_heads,
    clean_fanuc_comment as clean_comment, spindle_speed,
};

/// Decimals of the seconds of a dwell.
const DWELL_DECIMALS: u8 = 6;

/// Writes the blocks of a program of two heads as two channel programs for Siemens 840D, one for
/// each head; the axes of no head (C) belong to the first. The tool and spindle of `spec` are those
/// of the first head, as for
/// [`write_program_of_heads`](facemill_nc_program::write_program_of_heads).
///
/// Each block is in both channels and takes the same time in both: a channel whose axes stand still
/// waits (`G4 F`). Marks (`WAITM(n,1,2)`) follow every rapid, come before and after every run of
/// cutting blocks and before a comment, and follow every [`SiemensSettings::blocks_per_mark`]
/// cutting blocks. Between marks each channel runs by itself. Unless C is coupled, the two heads
/// are therefore together as planned only at marks, and the header of the text says that it is an
/// estimate.
///
/// # Errors When there are not two heads or they share something, an axis has the number of
/// neither, a setting is out of its range, the program does not start with a rapid that names every
/// axis, the program holds blocks other than comments, spindle starts, rapids and cuts, or a number
/// fits no word.
pub fn write_siemens_pair(
    spec: &ProgramSpec,
    all: &[HeadSpec],
    settings: &SiemensSettings,
) -> Result<SiemensPair, WriteError> {
    check(spec, all, settings)?;
    let channels = channels(spec, all)?;
    let mut writer = PairWriter {
        spec,
        settings,
        texts: [(); 2].map(|()| Text { text: String::new(), numbers: settings.block_numbers, next: 0 }),
        place: WordPositions::new(&spec.axes, settings.decimals),
        mark: 0,
        since_mark: 0,
        channels,
    };
    writer.header()?;
    for (index, block) in spec.program.blocks.iter().enumerate() {
        writer.block(index, block)?;
    }
    writer.end();
    Ok(SiemensPair { channels: writer.texts.map(|t| t.text) })
}

fn check(spec: &ProgramSpec, all: &[HeadSpec], settings: &SiemensSettings) -> Result<(), WriteError> {
    check_heads(spec, all)?;
    let setting = |place: &str, why| Err(WriteError::NotInChannels { place: place.to_owned(), why });
    if settings.program_feed == FeedMode::Rtcp {
        return Err(WriteError::RtcpOfHeads);
    }
    if settings.blocks_per_mark == 0 {
        return setting("blocks_per_mark", "must be at least 1");
    }
    if !(2..=99).contains(&settings.last_mark) {
        return setting("last_mark", "must be from 2 to 99");
    }
    let Decimals { linear, rotary, feed, inverse_time } = settings.decimals;
    if [linear, rotary, feed, inverse_time].into_iter().max() > Some(6) {
        return setting("decimals", "must be from 0 to 6");
    }
    Ok(())
}

struct PairWriter<'a> {
    spec: &'a ProgramSpec,
    settings: &'a SiemensSettings,
    channels: [Channel<'a>; 2],
    texts: [Text; 2],
    place: WordPositions,
    /// Number of the last mark.
    mark: u32,
    /// Cutting blocks since that mark.
    since_mark: u32,
}

/// Lines of one channel.
struct Text {
    text: String,
    numbers: Option<BlockNumbers>,
    next: u32,
}

impl Text {
    fn block(&mut self, line: &str) {
        if let Some(numbers) = self.numbers {
            let number = u64::from(numbers.start) + u64::from(numbers.step) * u64::from(self.next);
            // Eight digits; block numbers may repeat, because nothing jumps to them. Writing to a
            // String cannot fail.
            let _ = write!(self.text, "N{} ", number % 100_000_000);
            self.next += 1;
        }
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn comment(&mut self, text: &str) {
        let _ = writeln!(self.text, "; {text}");
    }
}

impl PairWriter<'_> {
    fn both(&mut self, line: &str) {
        self.texts.iter_mut().for_each(|t| t.block(line));
    }

    fn wait(&mut self) {
        self.mark = self.mark % self.settings.last_mark + 1;
        self.since_mark = 0;
        self.both(&format!("WAITM({},1,2)", self.mark));
    }

    fn header(&mut self) -> Result<(), WriteError> {
        let Some((first, true)) = self.spec.program.first_motion() else { return Err(WriteError::FirstMotion) };
        self.place.go(first, "the first motion")?;
        if let Some(letter) = self.place.unknown() {
            let (place, why) = (format!("axis {letter}"), "the first motion must name every axis of the machine");
            return Err(WriteError::NotInChannels { place, why });
        }
        let offset = work_offset(self.spec.work_offset)?;
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            comments(channel, &self.spec.job_name, self.settings, text);
            text.block(SAFE_START);
            if self.settings.feed == SiemensFeed::G94 {
                path_axes(channel, text);
            }
            home(channel, Group::Spindle, text);
        }
        self.wait();
        self.home_rest();
        self.wait();
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            tool(channel, &offset, text)?;
        }
        for group in [Group::Rotary, Group::Across, Group::Spindle] {
            for (channel, text) in self.channels.iter().zip(&mut self.texts) {
                let words: Vec<String> = channel.group(group).map(|l| self.place.word(l)).collect();
                if !words.is_empty() {
                    text.block(&format!("G0 {}", words.join(" ")));
                }
            }
            self.wait();
        }
        self.both(coolant_code(self.spec.coolant));
        self.both(match self.settings.feed {
            SiemensFeed::G93 => "G93",
            SiemensFeed::G94 => "G94",
        });
        Ok(())
    }

    /// Writes the moves home of all but the spindle axes.
    fn home_rest(&mut self) {
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            home(channel, Group::Across, text);
            home(channel, Group::Rotary, text);
        }
    }

    fn end(&mut self) {
        if self.since_mark > 0 {
            self.wait();
        }
        for line in ["M9", "M5", "G94"] {
            self.both(line);
        }
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            home(channel, Group::Spindle, text);
        }
        self.wait();
        self.home_rest();
        self.wait();
        for line in ["M30", LABEL, ALARM, "M0", "M30"] {
            self.both(line);
        }
    }

    fn block(&mut self, index: usize, block: &Block) -> Result<(), WriteError> {
        let place = format!("block {index}");
        match block {
            Block::Comment(text) => {
                if self.since_mark > 0 {
                    self.wait();
                }
                self.texts.iter_mut().for_each(|t| t.comment(&clean_comment(text)));
                Ok(())
            }
            Block::Rapid { words } => self.rapid(words, &place),
            Block::Linear { words, feed } => self.cut(words, *feed, &place),
            Block::SpindleOn { rpm, clockwise, spindle } => self.spindle(*rpm, *clockwise, *spindle, place),
            _ => {
                let why = "two channel programs hold comments, starts of spindles, rapids and cutting moves alone";
                Err(WriteError::NotInChannels { place, why })
            }
        }
    }

    /// Starts a spindle in the channel of its head; both channels wait first, so that neither cuts
    /// with the speed of the next pass.
    fn spindle(&mut self, rpm: f64, clockwise: bool, spindle: Option<u32>, place: String) -> Result<(), WriteError> {
        if self.since_mark > 0 {
            self.wait();
        }
        let speed = spindle_speed(rpm, &place)?;
        let own = self.channels.iter().position(|c| Some(c.head.spindle_number) == spindle);
        let why = "a spindle must be named by the number of one head's";
        let own = own.ok_or(WriteError::NotInChannels { place, why })?;
        self.texts[own].block(&format!("S{speed} {}", spindle_code(clockwise)));
        Ok(())
    }

    fn rapid(&mut self, words: &AxisWords, place: &str) -> Result<(), WriteError> {
        if self.since_mark > 0 {
            self.wait();
        }
        let changed = self.place.go(words, place)?;
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            text.block(&format!("G0 {}", words_of(channel, &changed, &self.place)));
        }
        self.wait();
        Ok(())
    }

    fn cut(&mut self, words: &AxisWords, feed: f64, place: &str) -> Result<(), WriteError> {
        let changed = self.place.go(words, place)?;
        let settings = self.settings;
        let positive = feed > 0.0 && feed.is_finite();
        if !positive {
            return Err(WriteError::Number { place: place.to_owned(), what: "a feed", value: feed });
        }
        // Blocks per minute; infinite for a block of G94 in which nothing moves.
        let per_minute = if settings.program_feed == FeedMode::G93 { feed } else { feed / norm(&changed) };
        let inverse = match (per_minute.is_finite(), settings.feed) {
            (true, SiemensFeed::G93) => {
                let decimals = settings.decimals.inverse_time;
                let units = rounded_down(per_minute, decimals, "a feed in 1/min", place)?;
                units as f64 / 10f64.powi(decimals.into())
            }
            _ => per_minute,
        };
        for (channel, text) in self.channels.iter().zip(&mut self.texts) {
            let own: Vec<(AxisLetter, f64)> =
                changed.iter().filter(|(l, _)| channel.letters().any(|own| own == *l)).copied().collect();
            if own.is_empty() {
                let seconds = 60.0 / inverse;
                let error = || WriteError::Number { place: place.to_owned(), what: "a time in s", value: seconds };
                let dwell = number_text::number(seconds, DWELL_DECIMALS, false).ok_or_else(error)?;
                text.block(&format!("G4 F{dwell}"));
                continue;
            }
            let (value, decimals, what) = match settings.feed {
                SiemensFeed::G93 => (inverse, settings.decimals.inverse_time, "a feed in 1/min"),
                SiemensFeed::G94 => (norm(&own) * inverse, settings.decimals.feed, "a feed in mm/min"),
            };
            let mut f = String::from("F");
            number_text::push_units(&mut f, rounded_down(value, decimals, what, place)?, decimals, false);
            text.block(&format!("G1 {} {f}", words_of(channel, &changed, &self.place)));
        }
        self.since_mark += 1;
        if self.since_mark >= settings.blocks_per_mark {
            self.wait();
        }
        Ok(())
    }
}

/// Returns a feed in units of its last decimal, rounded down, but at least one unit.
fn rounded_down(value: f64, decimals: u8, what: &'static str, place: &str) -> Result<i64, WriteError> {
    let units = number_text::units_below(value, decimals).filter(|_| value > 0.0);
    let error = || WriteError::Number { place: place.to_owned(), what, value };
    Ok(units.ok_or_else(error)?.max(1))
}

/// Returns the words of the channel's changed axes, or of all its axes if none has changed: every
/// block must be in both channels.
fn words_of(channel: &Channel<'_>, changed: &[(AxisLetter, f64)], place: &WordPositions) -> String {
    let is_changed = |letter: &AxisLetter| changed.iter().any(|(l, _)| l == letter);
    let none = !channel.letters().any(|l| is_changed(&l));
    let words: Vec<String> = channel.letters().filter(|l| none || is_changed(l)).map(|l| place.word(l)).collect();
    words.join(" ")
}

fn comments(channel: &Channel<'_>, job: &str, settings: &SiemensSettings, text: &mut Text) {
    let axes: Vec<String> = channel.letters().map(|l| l.to_string()).collect();
    let tool = &channel.head.tool;
    text.comment(&clean_comment(job));
    text.comment(&format!("CHANNEL {} OF 2: HEAD {}", channel.index + 1, clean_comment(&channel.head.name)));
    text.comment(&format!("AXES {}", axes.join(" ")));
    text.comment("ESTIMATE, NOT VERIFIED AS IT RUNS: THE CHANNELS WAIT FOR EACH OTHER AT WAIT MARKS ALONE.");
    text.comment("BETWEEN MARKS EACH RUNS BY ITSELF, SO THAT BOTH HEADS ARE WHERE THEY WERE CHECKED TOGETHER");
    text.comment("ONLY AT MARKS, UNLESS C IS COUPLED TO BOTH CHANNELS.");
    text.comment(&format!("TOOL T{} {}", tool.number, clean_comment(&tool.name)));
    text.comment(match settings.feed {
        SiemensFeed::G93 => "F IS INVERSE TIME",
        SiemensFeed::G94 => "F IS THE NORM OVER THE AXES OF THIS CHANNEL WITH 1 DEG AS 1 MM",
    });
}

/// Writes the axes over which F is the speed with G94 (FGROUP), rotary ones at their reference
/// radius.
fn path_axes(channel: &Channel<'_>, text: &mut Text) {
    let all: Vec<String> = channel.letters().map(|l| l.to_string()).collect();
    text.block(&format!("FGROUP({})", all.join(",")));
    let rotary = channel.letters().filter(|l| l.kind() == AxisKind::Rotary);
    let radii: Vec<String> = rotary.map(|l| format!("FGREF[{l}]={FGREF}")).collect();
    if !radii.is_empty() {
        text.block(&radii.join(" "));
    }
}

fn home(channel: &Channel<'_>, group: Group, text: &mut Text) {
    let words: Vec<String> = channel.group(group).map(|l| format!("{l}=0")).collect();
    if !words.is_empty() {
        text.block(&format!("G75 FP=1 {}", words.join(" ")));
    }
}

fn tool(channel: &Channel<'_>, offset: &str, text: &mut Text) -> Result<(), WriteError> {
    let HeadSpec { name, tool, spindle, .. } = channel.head;
    let place = |field: &str| format!("{field} of head {name}");
    let error = || WriteError::Number { place: place("tool.length"), what: "a length", value: tool.length };
    let length = number_text::number(tool.length, 3, true).ok_or_else(error)?;
    let speed = spindle_speed(spindle.rpm, &place("spindle.rpm"))?;
    text.block(&format!("T{} M6", tool.number));
    text.block("D1");
    text.block(&format!("IF ABS($P_TOOLL[1]-{length})>{CHECK_TOLERANCE} GOTOF {}", LABEL.trim_end_matches(':')));
    text.block(offset);
    text.block(&format!("S{speed} {}", spindle_code(spindle.clockwise)));
    Ok(())
}

fn spindle_code(clockwise: bool) -> &'static str {
    if clockwise { "M3" } else { "M4" }
}

fn coolant_code(coolant: Coolant) -> &'static str {
    match coolant {
        Coolant::Off => "M9",
        Coolant::Flood => "M8",
        Coolant::Mist => "M7",
    }
}

/// Returns the code of a work offset: G54 to G57, then G505 and on.
fn work_offset(offset: WorkOffset) -> Result<String, WriteError> {
    match offset.number() {
        n @ 1..=4 => Ok(format!("G{}", 53 + n)),
        n @ 5..=99 => Ok(format!("G{}", 500 + n)),
        _ => {
            let why = "840D has the work offsets 1 to 99 (G54 to G57, G505 to G599)";
            Err(WriteError::NotInChannels { place: "work_offset".to_owned(), why })
        }
    }
}
