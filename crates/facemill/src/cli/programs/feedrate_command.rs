//! `facemill feedrate`.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::called_program::CalledProgram;
use facemill::feeds::{
    BLEND_TOLERANCES, FeedLaw, FeedLawTimes, FeedRewriteError, FeedRewriteSettings, FeedRewriteSummary,
    MAX_TOOL_LENGTH, TipFeed, rewrite_feed_lines,
};
use facemill::machines::read_machine;
use facemill::nc_program::Dialect;
use facemill::nc_program::dialect::ControlMotion;
use facemill::nc_subprograms::may_call;
use facemill::{Failure, files, read_dialect_file};

use crate::cli::arguments::called_files::CALLS_IN_PLACE;
use crate::cli::arguments::dialect::dialect;
use crate::cli::arguments::program::{open_nc, read_nc};
use crate::cli::output::{say, say_bytes};

#[derive(Args)]
pub(crate) struct FeedrateArguments {
    /// NC program
    program: PathBuf,
    /// Machine file
    #[arg(long, value_name = "FILE")]
    machine: PathBuf,
    /// Distance from the gauge line to the tip
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = length)]
    tool_length_mm: f64,
    /// Speed of the tip (mm/min, also for a program in inches), or keep: the speed by the program's
    /// F, in the measure of its control. Default: each block's own F is the tip's speed; programs
    /// with computed F are then refused
    #[arg(long, value_name = "MM_MIN|keep", allow_negative_numbers = true, value_parser = tip_feed)]
    tip_feed: Option<TipFeed>,
    /// Machine position of the zero of an axis' words, as X=-120.5, mm or deg; can be given for
    /// several axes
    #[arg(long, value_name = "AXIS=VALUE", value_parser = offset)]
    work_offset: Vec<(String, f64)>,
    /// Control of the program: fanuc, haas, mazak, linuxcnc, siemens_840d, heidenhain; default: by
    /// the file's extension (ngc, mpf, h, else fanuc)
    #[arg(long, value_name = "NAME", value_parser = dialect)]
    dialect: Option<Dialect>,
    /// Dialect file of the control, for its rapids under RTCP, its decimals and how it runs its
    /// blocks; default: the dialect's own
    #[arg(long, value_name = "FILE")]
    dialect_file: Option<PathBuf>,
    /// Also time the program within acceleration and jerk of every axis, and lower feeds to those
    /// that the axes reach in each block
    #[arg(long)]
    time_law: bool,
    /// Largest deviation of the tip from the program's lines at corners, 0: a stop at every corner;
    /// default: as the machine file says
    #[arg(long, value_name = "MM", requires = "time_law", allow_negative_numbers = true, value_parser = blend_tolerance)]
    blend_tolerance_mm: Option<f64>,
    /// Output file; default: standard output
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write a summary to standard output as JSON; the program goes to --out
    #[arg(long, requires = "out")]
    json: bool,
}

fn offset(text: &str) -> Result<(String, f64), String> {
    let (axis, value) = text.split_once('=').ok_or("is not of the form X=-120.5")?;
    let value = value.parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((axis.trim().to_uppercase(), value))
}

fn tip_feed(text: &str) -> Result<TipFeed, String> {
    if text == "keep" {
        return Ok(TipFeed::Keep);
    }
    let feed = text.parse().ok().filter(|feed: &f64| *feed > 0.0 && feed.is_finite());
    feed.map(TipFeed::Given).ok_or_else(|| "must be a speed above 0 mm/min, or keep".to_owned())
}

fn length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|length: &f64| *length > 0.0 && *length <= MAX_TOOL_LENGTH);
    length.ok_or_else(|| format!("must be above 0, at most {MAX_TOOL_LENGTH} mm: from the gauge line to the tip"))
}

fn blend_tolerance(text: &str) -> Result<f64, String> {
    let [least, most] = BLEND_TOLERANCES;
    let tolerance = text.parse().ok().filter(|t: &f64| *t == 0.0 || (least..=most).contains(t));
    tolerance.ok_or_else(|| format!("must be {least} to {most} mm, or 0: a stop at every corner"))
}

/// Returns the control for a file's extension.
fn dialect_of(path: &Path) -> Dialect {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    match ending.as_str() {
        "ngc" => Dialect::LinuxCnc,
        "mpf" | "spf" => Dialect::Siemens840d,
        "h" => Dialect::Heidenhain,
        _ => Dialect::Fanuc,
    }
}

pub(crate) fn run(arguments: &FeedrateArguments) -> Result<ExitCode, Failure> {
    let read = read_machine(&arguments.machine)?;
    let machine = read.heads.first().ok_or_else(|| Failure::input(&arguments.machine, "has no head"))?;
    let program = open_nc(&arguments.program)?;
    let dialect = arguments.dialect.unwrap_or_else(|| dialect_of(&arguments.program));
    let called = called(&program, &arguments.program, dialect)?;
    let own_file = arguments.dialect_file.as_deref();
    let own_file = own_file.map(|file| read_dialect_file(file, dialect, "--dialect")).transpose()?;
    let control_motion = own_file.clone().unwrap_or_else(|| dialect.file()).control_motion;
    let settings = FeedRewriteSettings {
        machine,
        tool_length: arguments.tool_length_mm,
        tip_feed: arguments.tip_feed.unwrap_or_default(),
        work_offset: arguments.work_offset.clone(),
        dialect,
        dialect_file: own_file,
        time_law: arguments.time_law.then_some(FeedLaw { blend_tolerance: arguments.blend_tolerance_mm }),
    };
    files::check_outputs(arguments.out.as_deref())?;
    let failed = |why: FeedRewriteError| match why {
        FeedRewriteError::Read(source) => Failure::Read { file: arguments.program.clone(), source },
        FeedRewriteError::Write(source) => Failure::Write { file: arguments.out.clone().unwrap_or_default(), source },
        other => match &called {
            Some((called, _)) => other.of_called(called, &arguments.program),
            None => Failure::input(&arguments.program, other),
        },
    };
    let from_start = || -> std::io::Result<Box<dyn BufRead + '_>> {
        if let Some((_, text)) = &called {
            return Ok(Box::new(text.as_slice()));
        }
        Ok(Box::new(start_of(&program)?))
    };
    if let Some((called, _)) = &called {
        eprint!("{}{CALLS_IN_PLACE}", called.summary_line());
    }
    let Some(out) = &arguments.out else {
        // Nothing is printed before the whole program is known to be right.
        let mut text = Vec::new();
        let summary = rewrite_feed_lines(from_start, &settings, &mut text).map_err(failed)?;
        say_bytes(&text)?;
        eprint!("{}", summary_text(&summary, &control_motion));
        return Ok(ExitCode::SUCCESS);
    };
    let summary = files::write_through(out, |new| rewrite_feed_lines(from_start, &settings, new))?.map_err(failed)?;
    let text = summary_text(&summary, &control_motion);
    say(&if arguments.json { facemill::file_format::to_json(&summary) } else { text })?;
    Ok(ExitCode::SUCCESS)
}

/// Returns a reader of a file from its start.
fn start_of(program: &File) -> std::io::Result<BufReader<File>> {
    let mut file = program.try_clone()?;
    file.rewind()?;
    Ok(BufReader::with_capacity(AT_ONCE, file))
}

/// Returns the program with its calls expanded; `None` without calls. A program without any is not
/// held in memory.
fn called(program: &File, path: &Path, dialect: Dialect) -> Result<Option<(CalledProgram, Vec<u8>)>, Failure> {
    let failed = |source| Failure::Read { file: path.to_owned(), source };
    let mut lines = start_of(program).map_err(failed)?;
    let mut line = Vec::new();
    loop {
        line.clear();
        // A line that is longer is no call.
        let n = (&mut lines).take(LONGEST_CALL).read_until(b'\n', &mut line).map_err(failed)?;
        if n == 0 {
            return Ok(None);
        }
        if line.ends_with(b"\n") || (n as u64) < LONGEST_CALL {
            if may_call(&line, dialect) {
                let expanded = CalledProgram::expanded(path, &read_nc(path)?, dialect)?;
                return Ok(expanded.map(|(called, text)| (called, CalledProgram::numbered(text, dialect))));
            }
        } else {
            lines.skip_until(b'\n').map_err(failed)?;
        }
    }
}

/// Bytes of the longest line that may be a call.
const LONGEST_CALL: u64 = 4096;

/// Bytes of a program per read.
const AT_ONCE: usize = 1 << 18;

/// Formats hours, minutes and seconds with tenths.
fn clock(seconds: f64) -> String {
    let tenths = (10.0 * seconds).round() as u64;
    let (seconds, tenths) = (tenths / 10, tenths % 10);
    format!("{}:{:02}:{:02}.{tenths}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

fn summary_text(s: &FeedRewriteSummary, control_motion: &ControlMotion) -> String {
    let assumption = control_motion.assumption();
    let by_law = s.time_law.map_or_else(String::new, |_| format!(", acceleration and jerk {}", s.by_law));
    let timed = |law: FeedLawTimes| {
        let [before, after, rapid] = [law.cutting_time_before_s, law.cutting_time_s, law.rapid_time_s].map(clock);
        let stops = if law.stops_at_corners { ", with a stop at every corner" } else { "" };
        let assumed = assumption.as_ref().map_or_else(String::new, |text| format!("  assumption        {text}\n"));
        format!(
            "  within acceleration and jerk: cutting time {before} before, {after} after; rapid time {rapid}{stops}\n{assumed}"
        )
    };
    format!(
        "  cutting blocks    {}, {} with another F\n  limited by        tip feed {}, axes {}, control {}{by_law}\n  kept as they are  {} \
         (arcs, cycles, blocks before every axis is known)\n  cutting time      {} before, {} after\n  rapid time        {}\n{}",
        s.blocks,
        s.changed,
        s.by_tip_feed,
        s.by_axis,
        s.by_control,
        s.kept,
        clock(s.time_before_s),
        clock(s.time_after_s),
        clock(s.rapid_time_s),
        s.time_law.map_or_else(String::new, timed)
    )
}
