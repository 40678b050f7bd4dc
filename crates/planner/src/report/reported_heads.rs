//! Setup of a machine with any number of heads, as the report and the files of its plan see it.

use facemill_job::failure::Failure;
use facemill_job::format::report::Report;
use facemill_job::format::report::links::TurnsReport;
use facemill_virtual_machine::{Certificates, Verification};

use crate::program::heads::Heads;
use crate::program::one_head::OneHead;
use crate::program::output::{Texts, time_texts};
use crate::program::planned_links::PlannedLinks;
use crate::program::planned_turns::turns_report;
use crate::report::rotary_reversals::RotaryReversals;

/// Setup of a machine with `N` heads whose program has been verified.
pub(crate) trait ReportedHeads<'a, const N: usize>: Heads<'a, N> {
    /// Returns the head of every operation, in the order of the report.
    fn heads_of(moves: &Self::Moves) -> Vec<usize>;

    /// Writes into the operations what refinement has added to the program.
    fn complete(moves: &mut Self::Moves);

    /// Replaces times by those of the text.
    ///
    /// # Errors
    /// Returns an error only for an internal fault.
    fn time(&self, texts: &mut Self::Texts) -> Result<(), Failure>;

    /// Merges the runs of all heads, with sections in the order of the operations.
    fn merged_run(runs: [Verification; N], moves: &Self::Moves) -> Verification;

    /// Merges the proofs of all heads.
    fn merged_proof(proofs: [Certificates; N]) -> Certificates;

    /// Returns the behaviour of the rotary axes along the program.
    fn rotary_reversals(&self, moves: &Self::Moves, texts: &Self::Texts) -> RotaryReversals;

    /// Returns the report on turns; `None` where none were sought.
    fn turns(&self, moves: &Self::Moves, texts: &Self::Texts) -> Option<TurnsReport>;

    /// Returns the lines of all cutting moves, operation by operation in the order of the report.
    fn cut_lines(moves: &Self::Moves, texts: &Self::Texts) -> Vec<u32>;

    /// Adds what only programs of several heads have.
    fn add_pairs(&self, report: &mut Report, moves: &Self::Moves, texts: &Self::Texts, links: Option<&Self::Links>);

    /// Returns the programs with their names, which have the state of the program in them.
    ///
    /// # Errors
    /// Returns an error if a control with a channel for each head has no words for the program.
    fn files(&self, texts: Self::Texts, suffix: &str, state: &str) -> Result<Vec<(String, Vec<u8>)>, Failure>;
}

impl<'a> ReportedHeads<'a, 1> for OneHead<'a> {
    fn heads_of(moves: &Self::Moves) -> Vec<usize> {
        vec![0; moves.len()]
    }

    fn complete(_: &mut Self::Moves) {}

    fn time(&self, texts: &mut Texts) -> Result<(), Failure> {
        time_texts(self.context.scene, texts)
    }

    fn merged_run([run]: [Verification; 1], _: &Self::Moves) -> Verification {
        run
    }

    fn merged_proof([proof]: [Certificates; 1]) -> Certificates {
        proof
    }

    fn rotary_reversals(&self, moves: &Self::Moves, texts: &Texts) -> RotaryReversals {
        RotaryReversals::of(self.context.scene.job, moves, texts)
    }

    fn turns(&self, moves: &Self::Moves, texts: &Texts) -> Option<TurnsReport> {
        turns_report(moves, &texts.timed)
    }

    fn cut_lines(_: &Self::Moves, texts: &Texts) -> Vec<u32> {
        texts.cut_lines()
    }

    fn add_pairs(&self, _: &mut Report, _: &Self::Moves, _: &Texts, _: Option<&PlannedLinks>) {}

    fn files(&self, texts: Texts, suffix: &str, state: &str) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        let extension = self.context.scene.job.post.extension();
        Ok(vec![
            (format!("program{suffix}{state}.{extension}"), texts.nc.into_bytes()),
            (format!("program{suffix}{state}.apt"), texts.apt.into_bytes()),
        ])
    }
}
