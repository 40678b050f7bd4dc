//! Loop from moves to a verified program, for any number of heads: write, run, prove, refine, take
//! back links that fail, cut the stock.

use std::collections::BTreeSet;

use facemill_job::failure::Failure;
use facemill_job::format::report::stock::PlannedStockReport;
use facemill_job::stages::{Stages, WRITE};
use facemill_virtual_machine::{Certificates, Finding, Verification};

use crate::plan_settings::PlanSettings;
use crate::plan_stock::{CutByPlan, StockBefore};
use crate::program::cut_stock::{cut_by_heads, held_as_cut, stock_of_links};
use crate::program::heads::Heads;
use crate::program::output::check_feeds;
use crate::program::refinement::{ROUNDS, lines_to_refine, lines_too_near};
use crate::program::run_program::RunProgram;
use crate::stage_clock::Clock;

/// Moves of a setup on their way to a verified program.
pub(crate) struct HeadsProgram<'r, 'a, H: Heads<'a, N>, const N: usize> {
    pub heads: &'r H,
    pub moves: H::Moves,
    pub settings: PlanSettings,
    pub before: &'r StockBefore,
    /// Faster links, or the reason why none were searched.
    pub links: Result<H::Links, String>,
    pub stages: &'r dyn Stages,
}

/// Program with all results on it.
pub(crate) struct VerifiedProgram<T, const N: usize> {
    pub texts: T,
    pub verifications: Option<[Verification; N]>,
    pub certificates: Option<[Certificates; N]>,
    pub cut: CutByPlan,
    /// Description of the check between the lines of the cut stock, if the plan depends on it.
    pub seen: Option<String>,
    /// Number of poses added to refine blocks.
    pub added_poses: usize,
}

/// Number of rounds in which links with findings get their old paths back before all of them do.
const LINK_ROUNDS: usize = 3;

/// Writes faster links that are free for every head into the moves, or returns why there are none.
///
/// # Errors
/// If the stages are cancelled.
pub(crate) fn shorten_links<'a, H: Heads<'a, N>, const N: usize>(
    heads: &H,
    moves: &mut H::Moves,
    before: &StockBefore,
    stages: &dyn Stages,
) -> Result<Result<H::Links, String>, Failure> {
    let scene = heads.scenes()[0];
    if !scene.setup.file.links.shorten {
        return Ok(Err("the job says so (links.shorten)".to_owned()));
    }
    let cut = match stock_of_links(scene, before) {
        Ok(cut) => cut,
        Err(why) => return Ok(Err(why)),
    };
    let texts = heads.write_draft(moves)?;
    let mut links = heads.find_links(moves, &texts, cut, stages)?;
    heads.put_in(&mut links, moves);
    Ok(Ok(links))
}

impl<'a, H: Heads<'a, N>, const N: usize> HeadsProgram<'_, 'a, H, N> {
    /// Writes the program until no block needs refinement and no faster link has a finding.
    ///
    /// # Errors
    /// Returns an error if the program cannot be written, the control would read other feeds than
    /// the plan means, or the stages are cancelled.
    pub(crate) fn verified(&mut self, clock: &mut Clock) -> Result<VerifiedProgram<H::Texts, N>, Failure> {
        let (mut added_poses, mut round, mut near_rounds) = (0, 0, 0);
        loop {
            round += 1;
            let (texts, mut verifications, certificates) =
                self.refined(&mut added_poses, if near_rounds == 0 { ROUNDS } else { 1 }, clock)?;
            let certified = certificates.iter().flatten().flat_map(|c| &c.certificates);
            let open: Vec<u32> = certified.filter(|c| !c.certified).map(|c| c.line).collect();
            if self.take_back(&texts, verifications.as_ref(), &open, round >= LINK_ROUNDS) {
                continue;
            }
            self.check_feeds(&texts, verifications.as_ref())?;
            let (cut, seen) = self.cut(&texts, verifications.as_mut())?;
            clock.lap("cut the stock");
            if self.take_back(&texts, verifications.as_ref(), &open, round >= LINK_ROUNDS) {
                continue;
            }
            // Postures keep the clearances, but between them the tool may come nearer.
            near_rounds += 1;
            if let Some(runs) = verifications.as_ref().filter(|_| near_rounds < ROUNDS) {
                let put_in = self.heads.refine(&mut self.moves, &texts, &lines_too_near(runs));
                clock.lap("mend");
                added_poses += put_in;
                if put_in > 0 {
                    continue;
                }
            }
            // Faults that the cut stock has removed hid the times.
            self.check_feeds(&texts, verifications.as_ref())?;
            return Ok(VerifiedProgram { texts, verifications, certificates, cut, seen, added_poses });
        }
    }

    /// Writes the program until no block needs refinement, or so many rounds are used up.
    fn refined(
        &mut self,
        added_poses: &mut usize,
        rounds: usize,
        clock: &mut Clock,
    ) -> Result<VerifiedTexts<H::Texts, N>, Failure> {
        for round in 1.. {
            let writing = self.stages.start(WRITE, 0);
            let texts = self.heads.write(&self.moves, self.settings.verify)?;
            drop(writing);
            clock.lap("program");
            let program = self.program(&texts);
            let verifications = self.settings.verify.then(|| program.verify(self.stages)).transpose()?;
            clock.lap("verify");
            let certificates = self.settings.certificates.then(|| program.certify(self.stages)).transpose()?;
            clock.lap("certify");
            let of_head =
                |h: usize| lines_to_refine(verifications.as_ref().map(|v| &v[h]), certificates.as_ref().map(|c| &c[h]));
            let lines: BTreeSet<u32> = (0..N).flat_map(of_head).collect();
            let put_in = if round == rounds { 0 } else { self.heads.refine(&mut self.moves, &texts, &lines) };
            clock.lap("mend");
            if put_in == 0 {
                return Ok((texts, verifications, certificates));
            }
            *added_poses += put_in;
        }
        Err(Failure::Internal("rounds without end".to_owned()))
    }

    fn program<'p>(&'p self, texts: &'p H::Texts) -> RunProgram<'p, N> {
        let as_cut = held_as_cut(&self.heads.scenes(), self.before);
        self.heads.program(&self.moves, texts, as_cut)
    }

    /// Restores links, and replaces turns, with findings or open lines; returns whether there were
    /// any.
    fn take_back(&mut self, texts: &H::Texts, runs: Option<&[Verification; N]>, open: &[u32], with_all: bool) -> bool {
        let Some(runs) = runs else { return false };
        let findings: Vec<Finding> = runs.iter().flat_map(|run| &run.findings).cloned().collect();
        let links = self.links.as_mut().ok();
        self.heads.take_back(links, &mut self.moves, texts, (&findings, open), with_all)
    }

    /// Checks that the control reads the feeds as the plan means them.
    fn check_feeds(&self, texts: &H::Texts, runs: Option<&[Verification; N]>) -> Result<(), Failure> {
        check_feeds(self.heads.scenes()[0].job, H::timed(texts), runs.and_then(|runs| runs.first()))
    }

    /// Cuts the stock if the program was run, and adds findings to the run. Returns the description
    /// of the check between the lines of the stock, if the plan depends on it.
    fn cut(
        &self,
        texts: &H::Texts,
        runs: Option<&mut [Verification; N]>,
    ) -> Result<(CutByPlan, Option<String>), Failure> {
        let Some(runs) = runs else {
            return Ok((CutByPlan::not_cut(PlannedStockReport::not_requested(false)), None));
        };
        let program = self.program(texts);
        cut_by_heads(&program.read()?, program.cutting_heads(), self.before, runs.each_mut(), self.stages)
    }
}

/// Text, with the results of running and proving it.
type VerifiedTexts<T, const N: usize> = (T, Option<[Verification; N]>, Option<[Certificates; N]>);
