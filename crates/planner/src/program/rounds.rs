//! The loop that brings a program of any number of heads to its end: written, run, proven, refined,
//! relieved of links that do not hold, and cut.

use std::collections::BTreeSet;

use facemill_job::failure::Failure;
use facemill_virtual_machine::{Certificates, Finding, Verification};

use crate::plan_stock::CutByPlan;
use crate::planned::PlanSettings;
use crate::program::refinement::{ROUNDS, lines_to_refine};
use crate::stage_clock::Clock;

/// A program of `N` heads with the moves that it is written from. A machine with one head is `N` =
/// 1.
pub(crate) trait ProgramOfHeads<const N: usize> {
    /// The texts with their timed blocks.
    type Texts;

    /// Writes the moves as they are now.
    fn write(&self) -> Result<Self::Texts, Failure>;

    /// Runs the text for each head, the others in its way.
    fn verify(&self, texts: &Self::Texts) -> Result<[Verification; N], Failure>;

    /// Proves for each head what the blocks do between their ends.
    fn certify(&self, texts: &Self::Texts) -> Result<[Certificates; N], Failure>;

    /// Refines the blocks of these lines; returns the number of poses put in. Where none is
    /// feasible, a block stays as it is.
    fn refine(&mut self, texts: &Self::Texts, lines: &BTreeSet<u32>) -> usize;

    /// Restores links in whose blocks there is a finding or a line that could not be certified,
    /// `with_all` others where there is one; returns whether there was any.
    fn take_back(&mut self, texts: &Self::Texts, doubts: (&[Finding], &[u32]), with_all: bool) -> bool;

    /// Checks that the control understands the feeds as they are meant.
    fn check_feeds(&self, texts: &Self::Texts, runs: Option<&[Verification; N]>) -> Result<(), Failure>;

    /// Cuts the stock, where there is a run to add findings to, and tells what is seen between its
    /// lines, where the plan rests on that.
    fn cut(
        &self,
        texts: &Self::Texts,
        runs: Option<&mut [Verification; N]>,
    ) -> Result<(CutByPlan, Option<String>), Failure>;
}

/// A program with all that was found out about it.
pub(crate) struct Sound<T, const N: usize> {
    pub texts: T,
    pub verifications: Option<[Verification; N]>,
    pub certificates: Option<[Certificates; N]>,
    pub cut: CutByPlan,
    /// What is seen between the lines of the cut stock, where the plan rests on them.
    pub seen: Option<String>,
    /// Poses that were put in to refine blocks.
    pub mended: usize,
}

/// How often links with findings get their old ways back before all of them do.
const LINK_ROUNDS: usize = 3;

/// Writes the program until no block is left to refine and no faster link has a finding.
///
/// # Errors
/// When it cannot be written, its feeds are not what was meant, or the stages are cancelled.
pub(crate) fn sound<P: ProgramOfHeads<N>, const N: usize>(
    program: &mut P,
    settings: PlanSettings,
    clock: &mut Clock,
) -> Result<Sound<P::Texts, N>, Failure> {
    let (mut mended, mut round) = (0, 0);
    loop {
        round += 1;
        let (texts, mut verifications, certificates) = refined(program, settings, &mut mended, clock)?;
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
        // Faults that the cut stock has taken away hid the times.
        program.check_feeds(&texts, verifications.as_ref())?;
        return Ok(Sound { texts, verifications, certificates, cut, seen, mended });
    }
}

/// A text, and what running and proving it gives.
type Written<T, const N: usize> = (T, Option<[Verification; N]>, Option<[Certificates; N]>);

/// Writes the program until no block is left to refine, or that has been tried often enough.
fn refined<P: ProgramOfHeads<N>, const N: usize>(
    program: &mut P,
    settings: PlanSettings,
    mended: &mut usize,
    clock: &mut Clock,
) -> Result<Written<P::Texts, N>, Failure> {
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
        *mended += put_in;
    }
    Err(Failure::Internal("rounds without end".to_owned()))
}
