//! Faster links of a plan: put into its moves before its program is run, so that every text of it
//! has them.

use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::links::{PlannedLinkReport, ShortenedLinks};
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{SHORTEN, Stages};
use facemill_nc_program::{Compensation, FeedMode, ReadProgram};
use facemill_tool_path::links::choose::Choice;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::fastest;
use facemill_tool_path::links::ways::WayKind;
use facemill_tool_path::links::words::LinkWords;
use facemill_tool_path::moves::{Move, MoveKind};
use facemill_verification::named_results::not_verified;
use facemill_virtual_machine::{
    Finding, LinkDistances, LinkHold, LinkSettings, LinkStage, ProgramLink, VerifySettings, links_off_first_stock,
    run_links,
};
use facemill_z_map::DexelMap;

use crate::passes::operation::PlannedOperation;
use crate::program::output::{OwnProgram, Texts};

/// Fraction of the rapid clearance that is proven to be kept from the initial stock: links begin
/// and end at the whole clearance, and the control may deviate from them slightly.
pub(crate) const KEPT: f64 = 0.9;

/// Links between the passes of a setup, with the results of the search.
pub(crate) struct PlannedLinks {
    clearance: f64,
    is_by_law: bool,
    links: Vec<PlannedLink>,
}

struct PlannedLink {
    /// Piece that its moves go to; `None` if they are not only those to a piece: the link then
    /// stays.
    goal: Option<Goal>,
    /// Its lines at the time of the search.
    lines: [u32; 2],
    before: f64,
    lower_bound: f64,
    better: Option<Better>,
    kept_because: Option<String>,
}

/// Path that replaces a link.
struct Better {
    kind: WayKind,
    time: f64,
    /// Positions before its end.
    over: Vec<Move>,
    /// The replaced rapids: those behind the operation before, if the link begins there, and those
    /// to the piece.
    old: [Vec<Move>; 2],
}

/// Piece that a link goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Goal {
    /// Index of its operation.
    operation: usize,
    /// Its index there.
    piece: usize,
}

/// All rapids to a piece, by the indices of their moves in the program.
struct RapidRun {
    goal: Goal,
    moves: [usize; 2],
    /// Reason why they must stay.
    hold: Option<&'static str>,
}

/// Returns the rapids to every piece but the first one of all, in program order.
fn rapid_runs(operations: &[PlannedOperation<'_>]) -> Vec<RapidRun> {
    let mut runs = Vec::new();
    // Index of the next move, and of the first one behind the operation before.
    let (mut at, mut behind) = (0, None);
    for (operation, o) in operations.iter().enumerate() {
        for (piece, moves) in o.moves.pieces.iter().map(|p| &p.moves).enumerate() {
            let rapids = leading_rapids(moves);
            let first = if piece == 0 { behind.take() } else { Some(at) };
            if let Some(first) = first.filter(|_| rapids > 0) {
                let hold = if piece == 0 { change_before(operations, operation) } else { None };
                runs.push(RapidRun { goal: Goal { operation, piece }, moves: [first, at + rapids - 1], hold });
            }
            at += moves.len();
        }
        behind = Some(at);
        at += o.moves.retract.len();
    }
    runs
}

fn leading_rapids(moves: &[Move]) -> usize {
    moves.iter().take_while(|m| m.kind == MoveKind::Rapid).count()
}

/// Returns the change of the program between two operations, which happens far from the part, on
/// the present link.
fn change_before(operations: &[PlannedOperation<'_>], operation: usize) -> Option<&'static str> {
    let [before, now] = [operation.checked_sub(1)?, operation].map(|k| &operations[k].operation.feeds);
    let changes = before.spindle_rpm != now.spindle_rpm || before.coolant != now.coolant;
    changes.then_some("spindle or coolant change on it")
}

impl PlannedLinks {
    /// Searches for the fastest path of every link that is proven free: of the stock at that time,
    /// which is `cut` with its tolerance, or off the initial stock.
    ///
    /// # Errors
    /// If the stages are cancelled.
    pub(crate) fn find(
        program: &OwnProgram<'_>,
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<Self, Failure> {
        let Scene { job, setup, .. } = program.scene;
        let text = program.read()?;
        let at = program.virtual_setup();
        let views = [(&job.machine, job.tool.gauge_length())];
        let clock = LinkClock::new(&views);
        let words = LinkWords {
            machine: &job.machine,
            tool_length: job.tool.gauge_length(),
            words: &program.scene.words,
            table_from_rtcp_words: program.scene.written_frame()?,
            decimals: job.post.decimals(),
        };
        let runs = rapid_runs(program.operations);
        let seeker = Seeker { program, text: &text, clock: &clock, words, runs };
        let clearance = setup.file.rapid_clearance_mm;
        let look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
            let is_between = !matches!(link.hold, Some(LinkHold::WayIn | LinkHold::WayOut));
            is_between.then(|| seeker.link(link, stage))
        };
        let monitor = stages.start(SHORTEN, text.blocks.len());
        let verify = VerifySettings::default();
        let links = match cut {
            Some((mut stock, tolerance)) => {
                let mut links = Vec::new();
                let mut visit = |link: &ProgramLink, stage: &LinkStage<'_, '_>| links.push(look(link, stage));
                let keep = LinkSettings { clearance, tolerance };
                run_links(&text, &at, (&verify, &keep), &mut stock, &mut visit, &*monitor).map(|()| links)
            }
            None => {
                let keep = LinkDistances { fixtures: clearance, first_stock: KEPT * clearance };
                links_off_first_stock(&text, &[&at], (&verify, keep), &look, &*monitor)
            }
        };
        let links = links.map_err(not_verified)?.into_iter().flatten().collect();
        Ok(Self { clearance, is_by_law: clock.is_by_law(), links })
    }

    /// Puts the faster paths into the moves.
    pub(crate) fn put_in(&mut self, operations: &mut [PlannedOperation<'_>]) {
        for link in &mut self.links {
            let (Some(goal), Some(better)) = (link.goal, &mut link.better) else { continue };
            let behind = if goal.piece == 0 { goal.operation.checked_sub(1) } else { None };
            let behind = behind.map(|k| std::mem::take(&mut operations[k].moves.retract)).unwrap_or_default();
            let moves = &mut operations[goal.operation].moves.pieces[goal.piece].moves;
            let end = leading_rapids(moves).saturating_sub(1);
            // The last one stays: the start of the entry, to the last bit.
            better.old = [behind, moves.splice(..end, better.over.iter().copied()).collect()];
        }
    }

    /// Restores the old paths of links in whose blocks the program has a finding or a line that
    /// could not be certified, and if requested those of all others; returns whether there were
    /// any.
    pub(crate) fn take_back(
        &mut self,
        operations: &mut [PlannedOperation<'_>],
        texts: &Texts,
        (findings, open_lines): (&[Finding], &[u32]),
        with_all: bool,
    ) -> bool {
        let runs = rapid_runs(operations);
        let why = |link: &PlannedLink| {
            let goal = link.goal.filter(|_| link.better.is_some())?;
            let [first, last] = texts.lines_of_moves(runs.iter().find(|run| run.goal == goal)?.moves);
            let found = findings.iter().find(|f| f.first_line <= last && f.last_line >= first);
            let open = open_lines.iter().any(|line| (first..=last).contains(line));
            found.map(told).or_else(|| open.then(|| "the faster path could not be certified".to_owned()))
        };
        let found: Vec<Option<String>> = self.links.iter().map(why).collect();
        if found.iter().all(Option::is_none) {
            return false;
        }
        for (link, found) in self.links.iter_mut().zip(found).filter(|(_, found)| with_all || found.is_some()) {
            let (Some(goal), Some(better)) = (link.goal, link.better.take()) else { continue };
            let [behind, to_piece] = better.old;
            operations[goal.operation].moves.pieces[goal.piece].moves.splice(..better.over.len(), to_piece);
            if let Some(before) = goal.operation.checked_sub(1).filter(|_| goal.piece == 0) {
                operations[before].moves.retract = behind;
            }
            let others = || "with faster paths of some links the program repeatedly has findings".to_owned();
            link.kept_because = Some(found.unwrap_or_else(others));
        }
        true
    }

    /// Returns the report on the links, by the lines of the written program.
    pub(crate) fn report(&self, operations: &[PlannedOperation<'_>], texts: &Texts) -> ShortenedLinks {
        let runs = rapid_runs(operations);
        let of_link = |link: &PlannedLink| {
            let run = link.goal.and_then(|goal| runs.iter().find(|run| run.goal == goal));
            PlannedLinkReport {
                lines: run.map_or(link.lines, |run| texts.lines_of_moves(run.moves)),
                time_before_s: link.before,
                time_after_s: link.better.as_ref().map_or(link.before, |better| better.time),
                lower_bound_s: link.lower_bound,
                way: link.better.as_ref().map_or(WayKind::Original, |better| better.kind),
                kept_because: link.kept_because.clone(),
            }
        };
        ShortenedLinks::new(self.clearance, self.is_by_law, self.links.iter().map(of_link).collect())
    }
}

/// Describes a finding in blocks that the final program lacks.
pub(crate) fn told(finding: &Finding) -> String {
    let bodies = [&finding.body, &finding.obstacle].into_iter().flatten().cloned().collect::<Vec<_>>().join(" at ");
    let measure = finding.measure.as_ref().map_or_else(String::new, |m| format!(", {m}"));
    format!("the faster path has a finding: {}, {bodies}{measure}", finding.kind)
}

/// Data for the search for links.
struct Seeker<'a> {
    program: &'a OwnProgram<'a>,
    text: &'a ReadProgram,
    clock: &'a LinkClock<'a>,
    words: LinkWords<'a>,
    runs: Vec<RapidRun>,
}

impl Seeker<'_> {
    fn link(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> PlannedLink {
        let line = |block: Option<&usize>| block.map_or(0, |&b| self.text.blocks[b].line);
        let lines = [line(link.blocks.first()), line(link.blocks.last())];
        let goal = self.run_of(lines).map(|run| run.goal);
        let found = self.check(link, lines).and_then(|()| self.choice(link, stage));
        match found {
            Ok(Choice { before, lower_bound, better }) => {
                let better = better.map(|way| Better {
                    kind: way.kind,
                    time: way.time,
                    over: way.through.split_last().map_or_else(Vec::new, |(_, over)| self.rapids(over)),
                    old: [Vec::new(), Vec::new()],
                });
                PlannedLink { goal, lines, before, lower_bound, better, kept_because: None }
            }
            Err(why) => {
                let before = self.clock.time(link.law, &link.start, &link.ends).unwrap_or(0.0);
                let lower_bound = link.ends.last().map_or(0.0, |end| self.clock.least_time(&link.start, end));
                PlannedLink { goal, lines, before, lower_bound, better: None, kept_because: Some(why) }
            }
        }
    }

    /// Returns the rapids to a piece that include these lines.
    fn run_of(&self, lines: [u32; 2]) -> Option<&RapidRun> {
        self.runs.iter().find(|run| {
            let [first, last] = self.program.texts.lines_of_moves(run.moves);
            first <= lines[0] && lines[1] <= last
        })
    }

    /// Checks that another path may replace a link.
    ///
    /// # Errors
    /// With the reason why it must stay.
    fn check(&self, link: &ProgramLink, lines: [u32; 2]) -> Result<(), String> {
        match &link.hold {
            Some(LinkHold::Doubt(_)) => return Err("the positions of the axes are unknown".to_owned()),
            Some(LinkHold::Laws) => return Err("its blocks move in different ways".to_owned()),
            _ => {}
        }
        match self.run_of(lines) {
            Some(RapidRun { hold: None, .. }) => Ok(()),
            Some(RapidRun { hold: Some(why), .. }) => Err((*why).to_owned()),
            None => Err("its blocks are not those from one pass to the next alone".to_owned()),
        }
    }

    fn choice(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Result<Choice, String> {
        let job = self.program.scene.job;
        let compensation = match job.post.feed_mode() {
            FeedMode::Rtcp => Compensation::Rtcp(job.tool.length_register()),
            FeedMode::G94 | FeedMode::G93 => Compensation::Length(job.tool.length_register()),
        };
        let rounded = |axes: &AxisValues| self.words.rounded(compensation, axes).map(|(_, rounded)| rounded);
        fastest(&[self.program.scene.link_scene()], self.clock, (link, stage), &rounded)
    }

    fn rapids(&self, over: &[AxisValues]) -> Vec<Move> {
        let Scene { job, setup, .. } = self.program.scene;
        let work_from_table = setup.table_from_work.inverse();
        let at = |axes: &AxisValues| {
            let cl = job.machine.cl_point(axes, job.tool.gauge_length()).transformed(&work_from_table);
            Move { kind: MoveKind::Rapid, cl, axes: *axes, chip: None }
        };
        over.iter().map(at).collect()
    }
}

#[cfg(test)]
#[path = "../../tests/unit/program/planned_links.rs"]
mod tests;
