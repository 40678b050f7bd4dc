//! From moves of two heads to text, and the run of that text for each of them.

use std::collections::BTreeMap;

use facemill_cl_data::ClPoint;
use facemill_nc_program::{
    AptCutter, AptMove, AptSpec, HeadSpec, PostSettings, ProgramSpec, ReadProgram, RtcpRapids, WordMap, read_program,
    write_apt, write_program_of_heads,
};
use facemill_virtual_machine::{
    Assumption, BetweenPositions, Certificate, Certificates, ClearancePlace, EstimatedPositions, Finding, GougeSection,
    SectionGouge, Verification, VerifySettings, VirtualSetup, assumptions, certify, verify,
};

use super::channels::channel_files;
use super::moves::DualMove;
use super::plan::{DualGround, Part};
use super::program::{DualTimes, DualWriter, PartFeeds, dual_spec};
use crate::cell::budget;
use crate::follow::Surroundings;
use crate::job_file::OperationFile;
use crate::moves::MoveKind;
use crate::operation::PlannedOperation;
use crate::output::{NOT_VERIFIED, name_obstacles, not_verified, virtual_obstacles};
use crate::program::Timed;
use crate::remaining::{RunningHead, remaining};
use crate::timing::{TimedText, View, Written, time_program, time_text};
use crate::tip_feed::programmed_feed;
use crate::{Failure, RemainingReport, Stages};

/// Where a block comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct BlockPlace {
    /// Index of the part.
    pub part: usize,
    /// Index of its section.
    pub section: usize,
    /// Index of the section's move.
    pub at: usize,
}

/// What is written of a setup.
pub(crate) struct DualTexts {
    /// Timed blocks; the program itself is in the text.
    pub timed: Timed,
    /// NC text.
    pub nc: String,
    /// APT text of each head.
    pub apts: [String; 2],
    /// Line of the NC text, from 1, at which each part begins.
    pub part_lines: Vec<u32>,
    /// Line of every motion block and where it comes from.
    pub places: Vec<(u32, BlockPlace)>,
    /// Times of each part.
    pub times: Vec<DualTimes>,
    /// Line of the NC text of every block of the program.
    block_lines: Vec<u32>,
    /// What the NC text was written from.
    spec: ProgramSpec,
    heads: Vec<HeadSpec>,
    post: PostSettings,
}

/// Timed blocks and texts; `verify` says whether the text will be run on the virtual machine.
pub(crate) fn write_dual_texts(
    ground: &DualGround<'_>,
    parts: &[Part<'_>],
    words: &WordMap,
    verify: bool,
) -> Result<DualTexts, Failure> {
    let jobs = ground.jobs;
    let mut writer = DualWriter::new(jobs, words, ground.shared);
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
    let views: [View<'_>; 2] = std::array::from_fn(|h| (&jobs[h].machine, jobs[h].tool.gauge_length()));
    let written = Written { job: jobs[0], words, table_from_rtcp_words: nalgebra::Isometry3::identity() };
    let slower = time_program(&views, &written, &mut timed)?;
    timed.slow_down(&slower);
    let mut factors = slower.into_iter();
    let mut times = Vec::with_capacity(part_times.len());
    for moves in &part_times {
        let mut of_part = DualTimes::default();
        moves.iter().zip(factors.by_ref()).for_each(|(m, slower)| of_part.add(m, slower));
        times.push(of_part);
    }
    let (spec, heads) = dual_spec(jobs, ground.setups[0], feeds.map(|f| &f.feeds), words, &mut timed)?;
    let post = ground.setups[0].post(jobs[0]);
    let written = write_program_of_heads(&spec, &heads, &post).map_err(|e| jobs[0].wrong(format!("post: {e}")))?;
    let part_lines = timed.operation_starts.iter().map(|&block| written.block_lines[block]).collect();
    // Tip feeds in the order of the report: all of the first head's operation, then all of the second's.
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
            moves: apt_moves(ground, parts, h, verify),
        };
        write_apt(&spec).map_err(|e| Failure::Internal(e.to_string()))
    };
    let apts = [apt(0)?, apt(1)?];
    let places = places.into_iter().map(|(block, place)| (written.block_lines[block], place)).collect();
    let block_lines = written.block_lines;
    Ok(DualTexts { timed, nc: written.text, apts, part_lines, places, times, block_lines, spec, heads, post })
}

fn part_name(part: &Part<'_>) -> String {
    let names: Vec<&str> = part.files.iter().flatten().map(|f| f.name.as_str()).collect();
    names.join(" + ")
}

/// The operations of a part; that of the only one twice.
fn files_of<'a>(part: &Part<'a>) -> Result<[&'a OperationFile; 2], Failure> {
    match part.files {
        [Some(a), Some(b)] => Ok([a, b]),
        [Some(a), None] | [None, Some(a)] => Ok([a, a]),
        [None, None] => Err(Failure::Internal("a part without operations".to_owned())),
    }
}

/// The first operation of each head: the spindle speeds that the program starts with, and its coolant, are theirs.
fn spindle_feeds<'a>(parts: &[Part<'a>], first: &Part<'a>) -> Result<[&'a OperationFile; 2], Failure> {
    let fallback = files_of(first)?;
    Ok([0, 1].map(|h| parts.iter().find_map(|p| p.files[h]).unwrap_or(fallback[h])))
}

fn apt_moves(ground: &DualGround<'_>, parts: &[Part<'_>], head: usize, verify: bool) -> Vec<AptMove> {
    let (job, setup) = (ground.jobs[head], ground.setups[head]);
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
    /// Takes the times that are told from the text.
    ///
    /// # Errors
    /// None but for a fault in here.
    pub(crate) fn time(&mut self, ground: &DualGround<'_>, words: &WordMap) -> Result<(), Failure> {
        let jobs = ground.jobs;
        let views: [View<'_>; 2] = std::array::from_fn(|h| (&jobs[h].machine, jobs[h].tool.gauge_length()));
        let (machine, tool_length) = views[0];
        let at = Surroundings { machine, tool_length, words, frame: None, work_offset: None };
        let (dialect, rapids) = (self.post.dialect(), RtcpRapids::default());
        let control = &self.post.rules().control_motion;
        let written = TimedText { text: self.nc.as_bytes(), dialect, control, rapids, block_lines: &self.block_lines };
        time_text(&views, at, &written, &mut self.timed)
    }

    /// Files with their names, and the state of the program in it.
    ///
    /// # Errors
    /// When a control of two channels cannot be programmed so.
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

/// A text and what it was written from: what the virtual machine runs, once for each head.
pub(crate) struct DualProgram<'p, 'a> {
    pub ground: &'p DualGround<'a>,
    pub parts: &'p [Part<'a>],
    pub words: &'p WordMap,
    pub texts: &'p DualTexts,
}

impl DualProgram<'_, '_> {
    /// Runs the text for both heads.
    pub(crate) fn verify(&self, stages: &dyn Stages) -> Result<[Verification; 2], Failure> {
        let program = self.read()?;
        let run = |h: usize| {
            let what = if h == 0 { "verify head 1" } else { "verify head 2" };
            let monitor = stages.start(what, program.blocks.len());
            let mut found = verify(&program, &self.setup(h), &self.settings(h), &*monitor).map_err(not_verified)?;
            name_obstacles(&mut found, self.ground.setups[h]);
            Ok::<_, Failure>(found)
        };
        Ok([run(0)?, run(1)?])
    }

    /// Proves for both heads what the blocks of the text do between their ends.
    pub(crate) fn certify(&self, stages: &dyn Stages) -> Result<[Certificates; 2], Failure> {
        let program = self.read()?;
        let run = |h: usize| {
            let what = if h == 0 { "certify head 1" } else { "certify head 2" };
            let monitor = stages.start(what, program.blocks.len());
            certify(&program, &self.setup(h), &self.settings(h), &*monitor).map_err(not_verified)
        };
        Ok([run(0)?, run(1)?])
    }

    /// Measures what the text leaves on the regions of the setup's operations, whichever head cuts there.
    pub(crate) fn remaining(&self, stages: &dyn Stages) -> Result<Option<RemainingReport>, Failure> {
        let (setups, settings) = ([self.setup(0), self.setup(1)], [self.settings(0), self.settings(1)]);
        let heads = [0, 1].map(|h| RunningHead { at: &setups[h], settings: &settings[h] });
        remaining(self.ground.jobs[0], self.ground.setups[0], &self.read()?, &heads, stages)
    }

    /// What the text leaves to the control.
    pub(crate) fn assumptions(&self) -> Result<Vec<Assumption>, Failure> {
        Ok(assumptions(&self.read()?, self.ground.machines[0]))
    }

    pub(super) fn read(&self) -> Result<ReadProgram, Failure> {
        let program = read_program(&self.texts.nc, self.ground.jobs[0].post.dialect());
        program.map_err(|e| self.ground.jobs[0].unread(&e))
    }

    pub(super) fn setup(&self, head: usize) -> VirtualSetup<'_> {
        let (job, setup) = (self.ground.jobs[head], self.ground.setups[head]);
        VirtualSetup {
            machine: self.ground.machines[head],
            table_from_work: setup.table_from_work,
            words: self.words,
            table_from_rtcp_words: nalgebra::Isometry3::identity(),
            tool: &job.tool,
            length_register: job.tool.length_register(),
            obstacles: virtual_obstacles(setup),
        }
    }

    pub(super) fn settings(&self, head: usize) -> VerifySettings {
        let section = |(part, &first_line): (&Part<'_>, &u32)| {
            // A head that stands by cuts nothing.
            let limit = part.files[head].map_or(0.0, |o| budget(self.ground.jobs[head], o).simulated());
            GougeSection { name: part_name(part), first_line, gouge_limit: limit }
        };
        let sections = self.parts.iter().zip(&self.texts.part_lines).map(section).collect();
        VerifySettings { gouge_limit: 0.0, sections, is_whole: true, ..VerifySettings::default() }
    }
}

/// Both runs as one, with the sections of the operations, in their order.
pub(crate) fn merged(
    runs: [Verification; 2],
    heads: &[usize],
    parts: &[Part<'_>],
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

/// Both runs as one: findings of both, each with its head, those of one and the same axis once; extremes of both.
pub(crate) fn merged_runs(runs: [Verification; 2], sections: Vec<SectionGouge>) -> Verification {
    let [first, second] = runs;
    let mut findings: Vec<Finding> = Vec::new();
    for (h, found) in [first.findings, second.findings].into_iter().enumerate() {
        for mut finding in found {
            // What axes and text do is the same in both runs; their notes name the head.
            let same = |f: &Finding| {
                let alone = f.body.is_none() && finding.body.is_none();
                alone
                    && (f.kind, f.first_line, f.last_line) == (finding.kind, finding.first_line, finding.last_line)
                    && f.axis == finding.axis
                    && without_head(&f.note) == without_head(&finding.note)
            };
            if h == 1 && findings.iter().any(same) {
                continue;
            }
            if let Some(body) = &mut finding.body {
                *body = format!("head {}: {body}", h + 1);
            }
            findings.push(finding);
        }
    }
    findings.sort_by_key(|f| (f.first_line, f.kind));
    let deeper = |g: &facemill_virtual_machine::GougePlace| g.depth_mm;
    let largest_gouge =
        first.largest_gouge.into_iter().chain(second.largest_gouge).max_by(|a, b| deeper(a).total_cmp(&deeper(b)));
    let nearer = |c: &ClearancePlace| c.distance_mm;
    let of_head = |h: usize, c: ClearancePlace| ClearancePlace { body: format!("head {h}: {}", c.body), ..c };
    let smallest_clearance = first
        .smallest_clearance
        .map(|c| of_head(1, c))
        .into_iter()
        .chain(second.smallest_clearance.map(|c| of_head(2, c)))
        .min_by(|a, b| nearer(a).total_cmp(&nearer(b)));
    Verification {
        findings,
        largest_gouge,
        sections,
        smallest_clearance,
        between: first.between.zip(second.between).map(between_of_both),
        estimate: first.estimate.zip(second.estimate).map(estimate_of_both),
        n_positions: first.n_positions + second.n_positions,
        cutting_length_mm: first.cutting_length_mm + second.cutting_length_mm,
        ..Verification {
            findings: Vec::new(),
            largest_gouge: None,
            sections: Vec::new(),
            smallest_clearance: None,
            ..first
        }
    }
}

/// What holds between the positions of both heads.
fn between_of_both((a, b): (BetweenPositions, BetweenPositions)) -> BetweenPositions {
    BetweenPositions {
        cutter_mm: a.cutter_mm.max(b.cutter_mm),
        bodies_mm: a.bodies_mm.max(b.bodies_mm),
        open_blocks: a.open_blocks.max(b.open_blocks),
        first_open_line: [a, b].into_iter().filter_map(|b| b.first_open_line).min(),
    }
}

/// How far apart the positions of both heads' estimates are at most.
fn estimate_of_both((a, b): (EstimatedPositions, EstimatedPositions)) -> EstimatedPositions {
    EstimatedPositions {
        cut_step_mm: a.cut_step_mm.max(b.cut_step_mm),
        rapid_step_mm: a.rapid_step_mm.max(b.rapid_step_mm),
    }
}

/// A finding's note without the head that it begins with.
fn without_head(note: &str) -> &str {
    let rest = note.strip_prefix("head 1").or_else(|| note.strip_prefix("head 2"));
    rest.map_or(note, |rest| rest.trim_start_matches(':').trim_start())
}

/// Both heads' certificates as one for each block: proven is what is proven for both.
pub(crate) fn proven_for_both([first, second]: &[Certificates; 2]) -> Certificates {
    let mut by_line: BTreeMap<u32, [Option<&Certificate>; 2]> = BTreeMap::new();
    for (h, certificates) in [first, second].into_iter().enumerate() {
        for c in &certificates.certificates {
            by_line.entry(c.line).or_default()[h] = Some(c);
        }
    }
    let both = by_line.into_values().filter_map(|both| match both {
        [Some(a), Some(b)] => Some(proven_block(a, b)),
        // A line that only one run has a doubt about is proven for none.
        [Some(only), None] | [None, Some(only)] => Some(Certificate { certified: false, ..only.clone() }),
        [None, None] => None,
    });
    Certificates::new(both.collect())
}

fn proven_block(a: &Certificate, b: &Certificate) -> Certificate {
    let larger = |x: Option<f64>, y: Option<f64>| Some(f64::max(x?, y?));
    let between = |c: &Certificate, h: usize| {
        c.clearance_between.clone().map(|[body, obstacle]| [format!("head {h}: {body}"), obstacle])
    };
    let (clearance_mm, clearance_between) = match (a.clearance_mm, b.clearance_mm) {
        (Some(x), Some(y)) if y < x => (Some(y), between(b, 2)),
        (Some(x), _) => (Some(x), between(a, 1)),
        (None, y) => (y, between(b, 2)),
    };
    let reason = |c: &Certificate, h: usize| c.reason.as_ref().map(|r| format!("head {h}: {r}"));
    Certificate {
        line: a.line,
        block_number: a.block_number,
        depth_mm: larger(a.depth_mm, b.depth_mm),
        depth_with_control_mm: larger(a.depth_with_control_mm, b.depth_with_control_mm),
        clearance_mm,
        clearance_between,
        certified: a.certified && b.certified,
        reason: reason(a, 1).or_else(|| reason(b, 2)),
        uncertified_between: a.uncertified_between.clone().or_else(|| b.uncertified_between.clone()),
        doubted_since_line: a.doubted_since_line.or(b.doubted_since_line),
        intervals: a.intervals.saturating_add(b.intervals),
    }
}
