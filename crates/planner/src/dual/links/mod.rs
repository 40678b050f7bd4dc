//! Faster links for a plan of two heads, put into its moves before its program is run.
//!
//! A link of both heads is one motion of all axes. A faster one replaces it only if the tools and
//! bodies of both heads are proven to keep their distances from part, fixtures, machine, stock and
//! each other over this motion.

mod rapid_runs;
pub(crate) mod run_order;

use std::collections::{BTreeMap, BTreeSet};

use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::report::links::ShortenedLinks;
use facemill_job::stages::Stages;
use facemill_nc_program::read::Compensation;
use facemill_tool_path::links::clock::LinkClock;
use facemill_virtual_machine::program_time::tolerance::MachineView;
use facemill_virtual_machine::{Finding, VirtualSetup};
use facemill_z_map::DexelMap;

use self::rapid_runs::{PairRapidRun, rapid_runs};
use crate::dual::moves::DualMove;
use crate::dual::output::DualTexts;
use crate::dual::parts::ProgramPart;
use crate::dual::program::DualTimes;
use crate::program::link_search::{FasterPath, LineMatch, LinkSearch, RapidLines, RunLines, SearchedLinks};
use crate::program::run_program::RunProgram;

/// Links of a setup, with the results of the search.
pub(crate) struct DualLinks {
    searched: SearchedLinks,
    /// Runs before the search.
    runs: Vec<PairRapidRun>,
    /// Moves of all sections with links before the search, by part and section.
    first: BTreeMap<[usize; 2], Vec<DualMove>>,
    /// Time of the rapids of each part before the search, s.
    rapid_times: Vec<f64>,
    /// Parts in which a turn has become a link since.
    without_turns: BTreeSet<usize>,
}

impl DualLinks {
    /// Searches for the fastest path of every link that is proven free for both heads: of the stock
    /// at that time, which is `cut` with its tolerance, or off the initial stock.
    ///
    /// # Errors
    /// Returns an error if the stages are cancelled.
    pub(crate) fn find(
        program: &RunProgram<'_, 2>,
        (parts, texts): (&[ProgramPart<'_>], &DualTexts),
        cut: Option<(DexelMap, f64)>,
        stages: &dyn Stages,
    ) -> Result<Self, Failure> {
        let scenes = program.scenes;
        let text = program.read()?;
        // As in planning, with the tool of the other head thicker than it is.
        let heads = [0, 1].map(|h| VirtualSetup { machine: &scenes[h].job.machine, ..program.setup(h) });
        let views: [MachineView<'_>; 2] =
            std::array::from_fn(|h| (&scenes[h].job.machine, scenes[h].job.tool.gauge_length()));
        let runs = rapid_runs(parts);
        let lines = |run: &PairRapidRun| RunLines { lines: texts.lines_of(&run.places), hold: run.hold };
        let search = LinkSearch {
            heads: &scenes.map(|scene| scene.link_scene()),
            clock: &LinkClock::new(&views),
            words: scenes[0].link_words(),
            compensation: Compensation::Length(scenes[0].job.tool.length_register()),
            text: &text,
            rapids: RapidLines { runs: runs.iter().map(lines).collect(), rule: LineMatch::Exact },
            clearance: scenes[0].setup.file.rapid_clearance_mm,
        };
        let searched = match cut {
            Some(cut) => search.in_cut_stock(&heads.each_ref(), cut, stages)?,
            None => search.off_first_stock(&heads.each_ref(), stages)?,
        };
        let sections = runs.iter().flat_map(|run| &run.places).map(|at| [at.part, at.section]);
        let first = sections.map(|[p, s]| ([p, s], parts[p].sections[s].moves.clone())).collect();
        let rapid_times = texts.times.iter().map(|part| part.rapid).collect();
        Ok(Self { searched, runs, first, rapid_times, without_turns: BTreeSet::new() })
    }

    /// Writes the faster paths into the moves, and the initial ones where there are none.
    pub(crate) fn put_in(&self, parts: &mut [ProgramPart<'_>]) {
        for ([part, section], moves) in &self.first {
            parts[*part].sections[*section].moves.clone_from(moves);
        }
        let faster: BTreeMap<usize, &FasterPath> = self.searched.faster_paths().collect();
        // Backwards, so that the moves before keep their indices.
        for (run, faster) in faster.iter().rev() {
            let Some((last, others)) = self.runs[*run].places.split_last() else { continue };
            let goal = parts[last.part].sections[last.section].moves[last.at];
            let rapid = |axes: &AxisValues| DualMove { axes: *axes, ..goal };
            // The last one stays, so that the entry begins at exactly the same position.
            parts[last.part].sections[last.section].moves.splice(last.at..last.at, faster.over.iter().map(rapid));
            for at in others.iter().rev() {
                parts[at.part].sections[at.section].moves.remove(at.at);
            }
        }
    }

    /// Restores the links in whose blocks the program has a finding or a line that could not be
    /// certified; `with_all` also restores all others if there is one. Returns whether there was
    /// any.
    pub(crate) fn take_back(
        &mut self,
        parts: &mut [ProgramPart<'_>],
        texts: &DualTexts,
        doubts: (&[Finding], &[u32]),
        with_all: bool,
    ) -> bool {
        let runs = rapid_runs(parts);
        let lines = |run: usize| texts.lines_of(&runs.get(run)?.places);
        let removed = self.searched.take_back(&lines, doubts, with_all);
        if removed.is_empty() {
            return false;
        }
        self.put_in(parts);
        true
    }

    /// Appends moves to a section, by part and section, where a turn behind it becomes a link. From
    /// then on nothing counts as saved in the part.
    pub(crate) fn extend_first(&mut self, section: [usize; 2], moves: &[DualMove]) {
        if let Some(first) = self.first.get_mut(&section) {
            first.extend(moves);
        }
        self.without_turns.insert(section[0]);
    }

    /// Returns the time by which the links shorten each part at constant speeds, s; 0 where a turn
    /// has become a link since.
    pub(crate) fn saved(&self, texts: &DualTexts) -> Vec<f64> {
        let of_part = |(part, (before, now)): (usize, (&f64, &DualTimes))| {
            if self.without_turns.contains(&part) { 0.0 } else { before - now.rapid }
        };
        self.rapid_times.iter().zip(&texts.times).enumerate().map(of_part).collect()
    }

    /// Returns the report on the links, with their lines in the written program.
    pub(crate) fn report(&self, parts: &[ProgramPart<'_>], texts: &DualTexts) -> ShortenedLinks {
        let runs = rapid_runs(parts);
        self.searched.report(&|run| texts.lines_of(&runs.get(run)?.places))
    }
}
