//! Loop from moves to a verified program, for any number of heads: write, run, prove, refine, take
//! back links that fail, cut the stock.

use std::collections::BTreeSet;

use facemill_job::failure::Failure;
use facemill_virtual_machine::{Certificates, Finding, Verification};

use crate::plan_settings::PlanSettings;
use crate::plan_stock::CutByPlan;
use crate::program::refinement::{ROUNDS, lines_to_refine};
use crate::stage_clock::Clock;

/// Program of `N` heads, with the moves that it is written from. One head is `N` = 1.
pub(crate) trait ProgramOfHeads<const N: usize> {
    /// Texts with their timed blocks.
    type Texts;

    /// Writes the current moves.
    fn write(&self) -> Result<Self::Texts, Failure>;

    /// Runs the text for each head, with the other heads as obstacles.
    fn verify(&self, texts: &Self::Texts) -> Result<[Verification; N], Failure>;

    /// Proves the motion inside the blocks for each head.
    fn certify(&self, texts: &Self::Texts) -> Result<[Certificates; N], Failure>;

    /// Refines the blocks of these lines and returns the number of added poses. A block stays as it
    /// is if no pose in it is feasible.
    fn refine(&mut self, texts: &Self::Texts, lines: &BTreeSet<u32>) -> usize;

    /// Restores the links in whose blocks there is a finding or a line that could not be certified;
    /// `with_all` also restores all others if there is one. Returns whether there was any.
    fn take_back(&mut self, texts: &Self::Texts, doubts: (&[Finding], &[u32]), with_all: bool) -> bool;

    /// Checks that the control reads the feeds as the plan means them.
    fn check_feeds(&self, texts: &Self::Texts, runs: Option<&[Verification; N]>) -> Result<(), Failure>;

    /// Cuts the stock if the program was run, and adds findings to the run. Returns the description
    /// of the check between the lines of the stock, if the plan depends on it.
    fn cut(
        &self,
        texts: &Self::Texts,
        runs: Option<&mut [Verification; N]>,
    ) -> Result<(CutByPlan, Option<String>), Failure>;
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

/// Writes the program until no block needs refinement and no faster link has a finding.
///
/// # Errors
/// Returns an error if the program cannot be written, the control would read other feeds than the
/// plan means, or the stages are cancelled.
pub(crate) fn verified_program<P: ProgramOfHeads<N>, const N: usize>(
    program: &mut P,
    settings: PlanSettings,
    clock: &mut Clock,
) -> Result<VerifiedProgram<P::Texts, N>, Failure> {
    let (mut added_poses, mut round) = (0, 0);
    loop {
        round += 1;
        let (texts, mut verifications, certificates) = refined(program, settings, &mut added_poses, clock)?;
        let certified = certificates.iter().flatten().flat_map(|c| &c.certificates);
        let open: Vec<u32> = certified.filter(|c| !c.certified).map(|c| c.line).collect();
        let take_back = |program: &mut P, runs: Option<&[Verification; N]>| {
            let Some(runs) = runs else { return false };
            let findings: Vec<Finding> = runs.iter().flat_map(|run| &run.findings).cloned().collect();
            program.take_back(&texts, (&findings, &open), round == LINK_ROUNDS)
        };
        if take_back(program, verifications.as_ref()) {
            continue;
        }
        program.check_feeds(&texts, verifications.as_ref())?;
        let (cut, seen) = program.cut(&texts, verifications.as_mut())?;
        clock.lap("cut the stock");
        if take_back(program, verifications.as_ref()) {
            continue;
        }
        // Faults that the cut stock has removed hid the times.
        program.check_feeds(&texts, verifications.as_ref())?;
        return Ok(VerifiedProgram { texts, verifications, certificates, cut, seen, added_poses });
    }
}

/// Text, with the results of running and proving it.
type VerifiedTexts<T, const N: usize> = (T, Option<[Verification; N]>, Option<[Certificates; N]>);

/// Writes the program until no block needs refinement, or the rounds are used up.
fn refined<P: ProgramOfHeads<N>, const N: usize>(
    program: &mut P,
    settings: PlanSettings,
    added_poses: &mut usize,
    clock: &mut Clock,
) -> Result<VerifiedTexts<P::Texts, N>, Failure> {
    for round in 1.. {
        let texts = program.write()?;
        clock.lap("program");
        let verifications = if settings.verify { Some(program.verify(&texts)?) } else { None };
        clock.lap("verify");
        let certificates = if settings.certificates { Some(program.certify(&texts)?) } else { None };
        clock.lap("certify");
        let of_head =
            |h: usize| lines_to_refine(verifications.as_ref().map(|v| &v[h]), certificates.as_ref().map(|c| &c[h]));
        let lines: BTreeSet<u32> = (0..N).flat_map(of_head).collect();
        let put_in = if round == ROUNDS { 0 } else { program.refine(&texts, &lines) };
        clock.lap("mend");
        if put_in == 0 {
            return Ok((texts, verifications, certificates));
        }
        *added_poses += put_in;
    }
    Err(Failure::Internal("rounds without end".to_owned()))
}
