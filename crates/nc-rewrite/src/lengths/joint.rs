//! Lengths that suit several programs of one tool.

use facemill_job::failure::Failure;
use facemill_tool_model::{AssemblyLength, Lengths, OpenAssembly};
use facemill_virtual_machine::{ClearLengths, Finding, ForcedBy};

use crate::lengths::FoundLengths;
use crate::lengths::lengths_file::{LengthName, OtherLengthsProgram, Posting};
use crate::lengths::lengths_run::LengthsRun;

/// Searches for one tool, at least one, each for one of its programs.
pub(crate) struct Joint<'r, 'a> {
    pub(crate) runs: &'r [LengthsRun<'a>],
}

/// Lengths for all programs.
pub(crate) struct JointLengths {
    /// Result of each search, with the same lengths if none is hopeless; else those up to the
    /// hopeless one.
    pub(crate) found: Vec<ClearLengths>,
    /// Cause of each length, with the index of its program.
    forced_by: [Option<(usize, ForcedBy)>; 4],
}

/// By how much two lengths may differ and be the same, mm: rounding of sums.
const SAME: f64 = 1e-9;

/// Most rounds: each but the last raises a length, and obstacles could raise each other's without
/// an end.
const MAX_ROUNDS: usize = 60;

impl JointLengths {
    /// Returns the lengths, mm.
    pub(crate) fn lengths(&self) -> &Lengths {
        &self.found[0].lengths
    }

    /// Returns what forces a length, with the index of its program.
    pub(crate) fn forced_by(&self, length: AssemblyLength) -> Option<(usize, &ForcedBy)> {
        self.forced_by[length.index()].as_ref().map(|(k, by)| (*k, by))
    }

    /// Returns the program for which no length is free, and what blocks it.
    pub(crate) fn hopeless(&self) -> Option<(usize, &(AssemblyLength, ForcedBy))> {
        let last = self.found.len() - 1;
        Some((last, self.found[last].hopeless.as_ref()?))
    }
}

impl Joint<'_, '_> {
    /// Returns the name of a program's setup; `None` of the first program.
    pub(crate) fn setup_of(&self, run: usize) -> Option<String> {
        (run > 0).then(|| self.runs[run].scene.setup.file.name.clone())
    }

    /// Returns the least lengths of an assembly with which no program has a collision, and the
    /// margin: each search begins with those that the others need, and only ever raises them.
    ///
    /// # Errors
    /// If a search has one, or the programs raise each other's lengths without an end.
    pub(crate) fn lengths(&self, assembly: &OpenAssembly, longest: f64) -> Result<JointLengths, Failure> {
        let margin = self.runs[0].request.margin;
        if let [run] = self.runs {
            let own = run.lengths(assembly, [longest, margin])?;
            let forced_by = own.forced_by.clone().map(|by| by.map(|by| (0, by)));
            return Ok(JointLengths { found: vec![own], forced_by });
        }
        let free = self.raised(assembly, [longest, 0.0], ([0.0; 4], Default::default()))?;
        if free.hopeless().is_some() {
            return Ok(free);
        }
        let mut least = *free.lengths();
        for (length, by) in least.iter_mut().zip(&free.forced_by) {
            *length += if by.is_some() { margin } else { 0.0 };
        }
        self.raised(assembly, [longest, margin], (least, free.forced_by))
    }

    /// Returns lengths from these on that all programs are free with, what forced them before
    /// included.
    fn raised(
        &self,
        assembly: &OpenAssembly,
        limits: [f64; 2],
        (mut least, mut forced_by): (Lengths, [Option<(usize, ForcedBy)>; 4]),
    ) -> Result<JointLengths, Failure> {
        for _ in 0..MAX_ROUNDS {
            let mut found = Vec::new();
            let mut is_raised = false;
            for (k, run) in self.runs.iter().enumerate() {
                let own = run.lengths(&assembly.clone().at_least(least), limits)?;
                let is_hopeless = own.hopeless.is_some();
                for l in 0..4 {
                    if own.lengths[l] > least[l] + SAME {
                        is_raised = true;
                        least[l] = own.lengths[l];
                        forced_by[l] = own.forced_by[l].clone().map(|by| (k, by));
                    }
                }
                found.push(own);
                if is_hopeless {
                    return Ok(JointLengths { found, forced_by });
                }
            }
            if !is_raised {
                return Ok(JointLengths { found, forced_by });
            }
        }
        Err(self.runs[0].scene.job.wrong("no lengths are free in all programs at once"))
    }

    /// Returns all findings of the ordinary runs of the programs, each with the setup of its
    /// program as [`Joint::setup_of`] names it.
    pub(crate) fn findings(&self, found: &JointLengths) -> Result<Vec<(Option<String>, Finding)>, Failure> {
        let mut all = Vec::new();
        for (k, (run, own)) in self.runs.iter().zip(&found.found).enumerate() {
            all.extend(run.findings(own)?.into_iter().map(|finding| (self.setup_of(k), finding)));
        }
        Ok(all)
    }

    /// Returns the report on lengths.
    pub(crate) fn report(&self, found: &JointLengths, assembly: &OpenAssembly) -> Result<FoundLengths, Failure> {
        let lead = found.hopeless().map_or(0, |(k, _)| k);
        let mut report = self.runs[lead].lengths_report(&found.found[lead], assembly)?;
        if lead > 0 {
            // The report is that of the first program all the same.
            let (first, file) = (&self.runs[0], &mut report.file);
            file.setup.clone_from(&first.scene.setup.file.name);
            file.program = first.stamp.clone();
            file.none_is_free.iter_mut().for_each(|none| none.setup = self.setup_of(lead));
        }
        for length in &mut report.file.lengths {
            let index = AssemblyLength::ALL.into_iter().find(|l| LengthName::of(*l) == length.name);
            if let Some((k, by)) = index.and_then(|l| found.forced_by(l)) {
                length.setup = self.setup_of(k);
                length.forced_by = Some(self.runs[k].named(by.clone()));
                length.rests_on = None;
            }
        }
        for (k, run) in self.runs.iter().enumerate().skip(1) {
            let own = found.found.get(k).filter(|_| report.tool.is_some());
            report.file.others.push(run.as_other(own, assembly)?);
        }
        Ok(report)
    }
}

impl LengthsRun<'_> {
    /// Returns the report on another program than the first; without lengths it has no run.
    fn as_other(&self, found: Option<&ClearLengths>, assembly: &OpenAssembly) -> Result<OtherLengthsProgram, Failure> {
        let run = found.map(|found| self.lengths_report(found, assembly)).transpose()?.map(|report| report.file);
        let posting = run.as_ref().map_or(Posting::AsItIs, |file| file.posting);
        let (findings, certificates) = run.map_or_else(Default::default, |file| (file.findings, file.certificates));
        Ok(OtherLengthsProgram {
            setup: self.scene.setup.file.name.clone(),
            program: self.stamp.clone(),
            called_files: Vec::new(),
            posting,
            findings,
            certificates,
        })
    }
}
