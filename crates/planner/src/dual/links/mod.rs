//! Faster links for a plan of two heads, put into its moves before its program is run.
//!
//! A link of both heads is one motion of all axes. A faster one replaces it only if the tools and
//! bodies of both heads are proven to keep their distances from part, fixtures, machine, initial
//! stock and each other over this motion.

mod rapid_runs;
pub(crate) mod run_order;

use std::collections::BTreeMap;

use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::links::{PlannedLinkReport, ShortenedLinks};
use facemill_job::stages::{SHORTEN, Stages};
use facemill_nc_program::{Compensation, ReadProgram};
use facemill_tool_path::links::choose::Choice;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::fastest;
use facemill_tool_path::links::ways::WayKind;
use facemill_tool_path::links::words::LinkWords;
use facemill_verification::named_results::not_verified;
use facemill_virtual_machine::program_time::tolerance::View;
use facemill_virtual_machine::{
    Finding, LinkDistances, LinkHold, LinkStage, ProgramLink, VerifySettings, VirtualSetup, links_off_first_stock,
};
use nalgebra::Isometry3;

use self::rapid_runs::{RapidRun, rapid_runs};
use crate::dual::moves::DualMove;
use crate::dual::output::{DualProgram, DualTexts};
use crate::dual::parts::{Part, TwoHeadContext};
use crate::program::planned_links::{KEPT, told};

/// Links of a setup, with the results of the search.
pub(crate) struct DualLinks {
    clearance: f64,
    is_by_law: bool,
    /// Links of the program by the number of their run of rapids, in program order.
    links: Vec<DualLink>,
    /// Runs before the search.
    runs: Vec<RapidRun>,
    /// Moves of all sections with links before the search, by part and section.
    first: BTreeMap<[usize; 2], Vec<DualMove>>,
    /// Time of the rapids of each part before the search, s.
    rapid_times: Vec<f64>,
}

struct DualLink {
    /// Number of its run; `None` if its blocks are not those of a run.
    run: Option<usize>,
    /// Its first and last line during the search.
    lines: [u32; 2],
    before: f64,
    lower_bound: f64,
    better: Option<Better>,
    kept_because: Option<String>,
}

/// Replacement of a link.
struct Better {
    kind: WayKind,
    time: f64,
    /// Positions before its end.
    over: Vec<AxisValues>,
}

impl DualLinks {
    /// Searches the fastest path of every link that is proven free for both heads.
    ///
    /// # Errors
    /// Returns an error if the stages are cancelled.
    pub(crate) fn find(program: &DualProgram<'_, '_>, stages: &dyn Stages) -> Result<Self, Failure> {
        let ground = program.ground;
        let text = program.read()?;
        // As in planning, with the tool of the other head thicker than it is.
        let heads = [0, 1].map(|h| VirtualSetup { machine: &ground.scenes[h].job.machine, ..program.setup(h) });
        let views: [View<'_>; 2] =
            std::array::from_fn(|h| (&ground.scenes[h].job.machine, ground.scenes[h].job.tool.gauge_length()));
        let clock = LinkClock::new(&views);
        let words = LinkWords {
            machine: &ground.scenes[0].job.machine,
            tool_length: ground.scenes[0].job.tool.gauge_length(),
            words: &ground.scenes[0].words,
            table_from_rtcp_words: Isometry3::identity(),
            decimals: ground.scenes[0].job.post.decimals(),
        };
        let runs = rapid_runs(program.parts);
        let seeker = Seeker { ground, text: &text, texts: program.texts, clock: &clock, words, runs: &runs };
        let look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
            let is_between = !matches!(link.hold, Some(LinkHold::WayIn | LinkHold::WayOut));
            is_between.then(|| seeker.link(link, stage))
        };
        let clearance = ground.scenes[0].setup.file.rapid_clearance_mm;
        let keep = LinkDistances { fixtures: clearance, first_stock: KEPT * clearance };
        let monitor = stages.start(SHORTEN, text.blocks.len());
        let links =
            links_off_first_stock(&text, &heads.each_ref(), (&VerifySettings::default(), keep), &look, &*monitor);
        let links: Vec<DualLink> = links.map_err(not_verified)?.into_iter().flatten().collect();
        let sections = runs.iter().flat_map(|run| &run.places).map(|at| [at.part, at.section]);
        let first = sections.map(|[p, s]| ([p, s], program.parts[p].sections[s].moves.clone())).collect();
        let rapid_times = program.texts.times.iter().map(|part| part.rapid).collect();
        Ok(Self { clearance, is_by_law: clock.is_by_law(), links, runs, first, rapid_times })
    }

    /// Writes the faster paths into the moves, and the initial ones where there are none.
    pub(crate) fn put_in(&self, parts: &mut [Part<'_>]) {
        for ([part, section], moves) in &self.first {
            parts[*part].sections[*section].moves.clone_from(moves);
        }
        let better = |link: &DualLink| Some((link.run?, link.better.as_ref()?.over.clone()));
        let over: BTreeMap<usize, Vec<AxisValues>> = self.links.iter().filter_map(better).collect();
        // Backwards, so that the moves before keep their indices.
        for (run, over) in over.iter().rev() {
            let Some((last, others)) = self.runs[*run].places.split_last() else { continue };
            let goal = parts[last.part].sections[last.section].moves[last.at];
            let rapid = |axes: &AxisValues| DualMove { axes: *axes, ..goal };
            // The last one stays, so that the entry begins at exactly the same position.
            parts[last.part].sections[last.section].moves.splice(last.at..last.at, over.iter().map(rapid));
            for at in others.iter().rev() {
                parts[at.part].sections[at.section].moves.remove(at.at);
            }
        }
    }
}

impl DualLinks {
    /// Restores the links in whose blocks the program has a finding or a line that could not be
    /// certified; `with_all` also restores all others if there is one. Returns whether there was
    /// any.
    pub(crate) fn take_back(
        &mut self,
        parts: &mut [Part<'_>],
        texts: &DualTexts,
        (findings, open_lines): (&[Finding], &[u32]),
        with_all: bool,
    ) -> bool {
        let runs = rapid_runs(parts);
        let why = |link: &DualLink| {
            let run = runs.get(link.run.filter(|_| link.better.is_some())?)?;
            let [first, last] = texts.lines_of(&run.places)?;
            let found = findings.iter().find(|f| f.first_line <= last && f.last_line >= first);
            let open = open_lines.iter().any(|line| (first..=last).contains(line));
            found.map(told).or_else(|| open.then(|| "the faster path could not be certified".to_owned()))
        };
        let found: Vec<Option<String>> = self.links.iter().map(why).collect();
        if found.iter().all(Option::is_none) {
            return false;
        }
        for (link, found) in self.links.iter_mut().zip(found).filter(|(_, found)| with_all || found.is_some()) {
            if link.better.take().is_some() {
                let others = || "with faster paths of some links the program repeatedly has findings".to_owned();
                link.kept_because = Some(found.unwrap_or_else(others));
            }
        }
        self.put_in(parts);
        true
    }

    /// Returns the time by which the links shorten each part at constant speeds, s.
    pub(crate) fn saved(&self, texts: &DualTexts) -> Vec<f64> {
        self.rapid_times.iter().zip(&texts.times).map(|(before, now)| before - now.rapid).collect()
    }

    /// Returns the report on the links, with their lines in the written program.
    pub(crate) fn report(&self, parts: &[Part<'_>], texts: &DualTexts) -> ShortenedLinks {
        let runs = rapid_runs(parts);
        let of_link = |link: &DualLink| {
            let run = link.run.and_then(|run| runs.get(run));
            PlannedLinkReport {
                lines: run.and_then(|run| texts.lines_of(&run.places)).unwrap_or(link.lines),
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

/// Data for the search for links.
struct Seeker<'a> {
    ground: &'a TwoHeadContext<'a>,
    text: &'a ReadProgram,
    texts: &'a DualTexts,
    clock: &'a LinkClock<'a>,
    words: LinkWords<'a>,
    runs: &'a [RapidRun],
}

impl Seeker<'_> {
    fn link(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> DualLink {
        let line = |block: Option<&usize>| block.map_or(0, |&b| self.text.blocks[b].line);
        let lines = [line(link.blocks.first()), line(link.blocks.last())];
        let run = self.run_of(lines);
        let found = self.check(link, run).and_then(|()| self.choice(link, stage));
        match found {
            Ok(Choice { before, lower_bound, better }) => {
                let better = better.map(|way| Better {
                    kind: way.kind,
                    time: way.time,
                    over: way.through.split_last().map_or_else(Vec::new, |(_, over)| over.to_vec()),
                });
                DualLink { run, lines, before, lower_bound, better, kept_because: None }
            }
            Err(why) => {
                let before = self.clock.time(link.law, &link.start, &link.ends).unwrap_or(0.0);
                let lower_bound = link.ends.last().map_or(0.0, |end| self.clock.least_time(&link.start, end));
                DualLink { run, lines, before, lower_bound, better: None, kept_because: Some(why) }
            }
        }
    }

    /// Returns the number of the run with exactly these first and last lines.
    fn run_of(&self, lines: [u32; 2]) -> Option<usize> {
        self.runs.iter().position(|run| self.texts.lines_of(&run.places) == Some(lines))
    }

    /// Checks that another path may replace a link.
    ///
    /// # Errors
    /// The reason why it must stay.
    fn check(&self, link: &ProgramLink, run: Option<usize>) -> Result<(), String> {
        match &link.hold {
            Some(LinkHold::Doubt(_)) => return Err("the positions of the axes are unknown".to_owned()),
            Some(LinkHold::Laws) => return Err("its blocks move in different ways".to_owned()),
            _ => {}
        }
        match run.map(|run| self.runs[run].hold) {
            Some(None) => Ok(()),
            Some(Some(why)) => Err(why.to_owned()),
            None => Err("its blocks are not those from one pass to the next alone".to_owned()),
        }
    }

    fn choice(&self, link: &ProgramLink, stage: &LinkStage<'_, '_>) -> Result<Choice, String> {
        let scenes = self.ground.scenes.each_ref().map(|scene| scene.link_scene());
        let compensation = Compensation::Length(self.ground.scenes[0].job.tool.length_register());
        let rounded = |axes: &AxisValues| self.words.rounded(compensation, axes).map(|(_, rounded)| rounded);
        fastest(&scenes, self.clock, (link, stage), &rounded)
    }
}
