//! Text of the moves of two heads.

use facemill_cl_data::ClPoint;
use facemill_cl_file::{AptCutter, AptMove, AptSpec, write_apt};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::OperationFile;
use facemill_job::setup::cell::budget;
use facemill_job::validate::tip_feed::programmed_feed;
use facemill_nc_program::{HeadSpec, PostSettings, ProgramSpec, write_program_of_heads};
use facemill_tool_path::moves::MoveKind;
use facemill_verification::merged_heads::merged_runs;
use facemill_verification::text_times::{ALL_LINES, TimedText};
use facemill_virtual_machine::program_time::tolerance::MachineView;
use facemill_virtual_machine::{GougeSection, SectionGouge, Verification};

use super::channels::channel_files;
use super::moves::DualMove;
use super::program::{DualTimes, DualWriter, PartFeeds, dual_spec};
use crate::dual::parts::{ProgramPart, TwoHeadContext};
use crate::passes::operation::PlannedOperation;
use crate::program::output::NOT_VERIFIED;
use crate::program::timed::Timed;
use crate::program::timing::text::time_text;
use crate::program::timing::{WrittenWords, time_program};

/// Origin of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BlockPlace {
    /// Index of the part.
    pub part: usize,
    /// Index of its section.
    pub section: usize,
    /// Index of the section's move.
    pub at: usize,
}

/// Texts of a setup.
pub(crate) struct DualTexts {
    /// Timed blocks; the program itself is in the text.
    pub timed: Timed,
    /// NC text.
    pub nc: String,
    /// APT text of each head.
    pub apts: [String; 2],
    /// Line of the NC text, from 1, at which each part begins.
    pub part_lines: Vec<u32>,
    /// Line and origin of every motion block.
    pub places: Vec<(u32, BlockPlace)>,
    /// Times of each part.
    pub times: Vec<DualTimes>,
    /// Line of the NC text of every block of the program.
    block_lines: Vec<u32>,
    /// Input of the NC text.
    spec: ProgramSpec,
    heads: Vec<HeadSpec>,
    post: PostSettings,
}

/// Writes timed blocks and texts; `verify` states whether the text will be run on the virtual
/// machine.
pub(crate) fn write_dual_texts(
    context: &TwoHeadContext<'_>,
    parts: &[ProgramPart<'_>],
    verify: bool,
) -> Result<DualTexts, Failure> {
    let (jobs, words) = (context.jobs(), &context.scenes[0].words);
    let mut writer = DualWriter::new(jobs, words, context.shared);
    if !verify {
        writer.comment(NOT_VERIFIED.to_owned());
    }
    let first = parts.first().ok_or_else(|| Failure::Internal("no operation".to_owned()))?;
    let feeds = spindle_feeds(parts, first)?;
    let mut speeds = feeds.map(|f| f.feeds.spindle_rpm);
    let mut places = Vec::new();
    let mut part_times = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let name = part_name(part);
        writer.part(&name);
        for (h, file) in part.files.iter().enumerate() {
            let Some(rpm) = file.map(|f| f.feeds.spindle_rpm).filter(|rpm| *rpm != speeds[h]) else { continue };
            writer.spindle(h, rpm);
            speeds[h] = rpm;
        }
        let files = files_of(part)?;
        let feeds = PartFeeds { name: &name, feeds: files.map(|f| &f.feeds) };
        let mut of_part = Vec::new();
        for (section, s) in part.sections.iter().enumerate() {
            if !s.comment.is_empty() {
                writer.comment(s.comment.clone());
            }
            for (at, m) in s.moves.iter().enumerate() {
                places.push((writer.n_blocks(), BlockPlace { part: k, section, at }));
                of_part.push(writer.push(m, &feeds)?);
            }
        }
        part_times.push(of_part);
    }
    let mut timed = writer.finish();
    let views: [MachineView<'_>; 2] = std::array::from_fn(|h| (&jobs[h].machine, jobs[h].tool.gauge_length()));
    let written = WrittenWords { job: jobs[0], words, table_from_rtcp_words: nalgebra::Isometry3::identity() };
    let slower = time_program(&views, &written, &mut timed)?;
    timed.slow_down(&slower);
    let mut factors = slower.into_iter();
    let mut times = Vec::with_capacity(part_times.len());
    for moves in &part_times {
        let mut of_part = DualTimes::default();
        moves.iter().zip(factors.by_ref()).for_each(|(m, slower)| of_part.add(m, slower));
        times.push(of_part);
    }
    let (spec, heads) = dual_spec(jobs, context.scenes[0].setup, feeds.map(|f| &f.feeds), words, &mut timed)?;
    let post = context.scenes[0].setup.post(jobs[0]);
    let written = write_program_of_heads(&spec, &heads, &post).map_err(|e| jobs[0].wrong(format!("post: {e}")))?;
    let part_lines = timed.operation_starts.iter().map(|&block| written.block_lines[block]).collect();
    // Tip feeds in the order of the report: all of the first head's operation, then all of the
    // second's.
    timed.tip_feeds = times.iter().flat_map(|t| t.tip_feeds.iter().flatten().copied()).collect();
    timed.cut_feeds = times.iter().flat_map(|t| t.cut_feeds.iter().flatten().copied()).collect();
    let apt = |h: usize| {
        let cutter = jobs[h].tool.cutter();
        let spec = AptSpec {
            part_name: spec.job_name.clone(),
            tool_number: heads[h].tool.number,
            cutter: AptCutter {
                radius: cutter.radius(),
                corner_radius: cutter.corner_radius(),
                height: cutter.flute_length(),
            },
            spindle: heads[h].spindle,
            coolant: spec.coolant,
            moves: apt_moves(context, parts, h, verify),
        };
        write_apt(&spec).map_err(|e| Failure::Internal(e.to_string()))
    };
    let apts = [apt(0)?, apt(1)?];
    let places = places.into_iter().map(|(block, place)| (written.block_lines[block], place)).collect();
    let block_lines = written.block_lines;
    Ok(DualTexts { timed, nc: written.text, apts, part_lines, places, times, block_lines, spec, heads, post })
}

fn part_name(part: &ProgramPart<'_>) -> String {
    let names: Vec<&str> = part.files.iter().flatten().map(|f| f.name.as_str()).collect();
    names.join(" + ")
}

/// Returns the operations of a part, a single one twice.
fn files_of<'a>(part: &ProgramPart<'a>) -> Result<[&'a OperationFile; 2], Failure> {
    match part.files {
        [Some(a), Some(b)] => Ok([a, b]),
        [Some(a), None] | [None, Some(a)] => Ok([a, a]),
        [None, None] => Err(Failure::Internal("a part without operations".to_owned())),
    }
}

/// Returns the first operation of each head, which sets the initial spindle speeds and the coolant.
fn spindle_feeds<'a>(parts: &[ProgramPart<'a>], first: &ProgramPart<'a>) -> Result<[&'a OperationFile; 2], Failure> {
    let fallback = files_of(first)?;
    Ok([0, 1].map(|h| parts.iter().find_map(|p| p.files[h]).unwrap_or(fallback[h])))
}

fn apt_moves(context: &TwoHeadContext<'_>, parts: &[ProgramPart<'_>], head: usize, verify: bool) -> Vec<AptMove> {
    let (job, setup) = (context.scenes[head].job, context.scenes[head].setup);
    let work_from_table = setup.table_from_work.inverse();
    let cl = |m: &DualMove| -> ClPoint {
        job.machine.cl_point(&m.axes, job.tool.gauge_length()).transformed(&work_from_table)
    };
    let mut moves = Vec::new();
    if !verify {
        moves.push(AptMove::Comment(NOT_VERIFIED.to_owned()));
    }
    for part in parts {
        let Some(file) = part.files[head] else { continue };
        moves.push(AptMove::Comment(file.name.clone()));
        let own = part.sections.iter().flat_map(|s| &s.moves).filter(|m| m.working[head]);
        moves.extend(own.map(|m| match m.kind {
            MoveKind::Rapid => AptMove::Rapid(cl(m)),
            kind => {
                let feed = programmed_feed(&file.feeds, job.tool.n_inserts(), kind, m.chips[head].as_ref()).mm_min;
                AptMove::Linear { cl: cl(m), feed }
            }
        }));
    }
    moves
}

impl DualTexts {
    /// Returns the first and last line of the blocks of consecutive places; `None` without any.
    pub(crate) fn lines_of(&self, places: &[BlockPlace]) -> Option<[u32; 2]> {
        let line = |place: &BlockPlace| {
            let at = self.places.binary_search_by(|(_, known)| known.cmp(place)).ok()?;
            Some(self.places[at].0)
        };
        Some([line(places.first()?)?, line(places.last()?)?])
    }

    /// Returns the lines of the cuts of every operation, part by part, the first head's before the
    /// second's.
    pub(crate) fn cut_lines(&self, parts: &[ProgramPart<'_>]) -> Vec<u32> {
        let of_head = |part: usize, head: usize| {
            let places = self.places.iter().filter(move |(_, place)| place.part == part);
            places.filter_map(move |(line, place)| {
                let m = &parts[place.part].sections[place.section].moves[place.at];
                (m.kind == MoveKind::Cut && m.working[head]).then_some(*line)
            })
        };
        (0..parts.len()).flat_map(|part| [0, 1].map(|head| of_head(part, head))).flatten().collect()
    }

    /// Takes the reported times from the text.
    ///
    /// # Errors
    /// Returns an error only for an internal fault.
    pub(crate) fn time(&mut self, context: &TwoHeadContext<'_>) -> Result<(), Failure> {
        let jobs = context.jobs();
        let views: [MachineView<'_>; 2] = std::array::from_fn(|h| (&jobs[h].machine, jobs[h].tool.gauge_length()));
        let (dialect, rapids) = (self.post.dialect(), self.post.rtcp_rapids().unwrap_or_default());
        let control = &self.post.rules().control_motion;
        let written = TimedText {
            text: self.nc.as_bytes(),
            dialect,
            control,
            rapids,
            block_lines: &self.block_lines,
            lines: ALL_LINES,
        };
        time_text(&views, context.scenes[0].motion_context(), &written, &mut self.timed)
    }

    /// Returns the files with their names, which have the state of the program in them.
    ///
    /// # Errors
    /// Returns an error if a control with two channels has no words for the program.
    pub(crate) fn files(self, suffix: &str, state: &str) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        let channels = channel_files(&self.spec, &self.heads, &self.post, suffix, state)?;
        let [first, second] = self.apts;
        let mut files = vec![
            (format!("program{suffix}{state}.{}", self.post.extension()), self.nc.into_bytes()),
            (format!("program{suffix}-head-1{state}.apt"), first.into_bytes()),
            (format!("program{suffix}-head-2{state}.apt"), second.into_bytes()),
        ];
        files.extend(channels);
        Ok(files)
    }
}

/// Returns the permitted depth of each head's cutter in each part of a text.
pub(crate) fn gouge_sections(
    context: &TwoHeadContext<'_>,
    parts: &[ProgramPart<'_>],
    texts: &DualTexts,
) -> [Vec<GougeSection>; 2] {
    let section = |h: usize, (part, &first_line): (&ProgramPart<'_>, &u32)| {
        // A waiting head cuts nothing.
        let gouge_limit = part.files[h].map_or(0.0, |o| budget(context.scenes[h].job, o).simulated());
        GougeSection { name: part_name(part), first_line, gouge_limit }
    };
    [0, 1].map(|h| parts.iter().zip(&texts.part_lines).map(|part| section(h, part)).collect())
}

/// Merges both verifications, with the sections of the operations in their order.
pub(crate) fn merged(
    runs: [Verification; 2],
    heads: &[usize],
    parts: &[ProgramPart<'_>],
    operations: &[PlannedOperation<'_>],
) -> Verification {
    let sections: Vec<SectionGouge> = operations
        .iter()
        .zip(heads)
        .filter_map(|(o, &h)| {
            let part = parts.iter().position(|p| p.files[h].is_some_and(|f| f.name == o.operation.name))?;
            Some(SectionGouge { name: o.operation.name.clone(), ..runs[h].sections.get(part)?.clone() })
        })
        .collect();
    merged_runs(runs, sections)
}
