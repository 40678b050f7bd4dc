//! All setups of a job, each on the stock that earlier ones leave.

use std::collections::BTreeMap;
use std::ops::Range;

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::stages::Stages;
use facemill_job::stock::setup_order::check_before;
use facemill_job::validate::setup_chain::{programs_before, work_from_work};
use facemill_verification::remaining::ProgramSweeps;

use crate::plan::{ReadSetup, planned_setup};
use crate::plan_settings::PlanSettings;
use crate::plan_stock::StockToCut;
use crate::planned::Planned;

/// Plans all setups of a job in their order, and cuts the stock of each by its own verified
/// program: on lines `cell` mm apart, or as the job's `verification` says. A setup begins with the
/// rest that the one before leaves if both state the same stock, in one workpiece frame or as a
/// mesh; each report says what its stock began as, or why none was cut.
///
/// Guarantees, besides the guarantees of [`plan_setup`](crate::plan::plan_setup): on every line of
/// the stock, no body that must not meet the material left at that moment does so by more than
/// twice the tolerance.
///
/// Setups on whose regions nothing is left get no program.
///
/// # Errors
/// [`Failure::NothingToCut`] if no setup gets a program; as
/// [`plan_setup`](crate::plan::plan_setup); if the stock cannot be turned into lines at the
/// requested distance.
pub fn plan_job(
    job: &Job,
    settings: PlanSettings,
    cell: Option<f64>,
    stages: &dyn Stages,
) -> Result<Vec<Planned>, Failure> {
    let planned = plan_job_with_setups(job, settings, cell, stages, |_, _| ())?;
    Ok(planned.into_iter().map(|(planned, ())| planned).collect())
}

/// Plans all setups of a job as [`plan_job`] does; returns each with what `keep` makes of it and of
/// the setup as it was read, before the next setup is planned. On a machine with two heads there is
/// no such setup.
///
/// A setup holds its meshes and its stock: of a job with many of them, they take more memory
/// together than there may be.
///
/// # Errors
/// As [`plan_job`].
pub fn plan_job_with_setups<'j, T>(
    job: &'j Job,
    settings: PlanSettings,
    cell: Option<f64>,
    stages: &dyn Stages,
    keep: impl FnMut(&Planned, Option<ReadSetup<'j>>) -> T,
) -> Result<Vec<(Planned, T)>, Failure> {
    let planned = planned_setups(job, 0..job.file.setups.len(), settings, (cell, stages), keep)?;
    let (planned, nothing): (Vec<_>, Vec<_>) = planned.into_iter().partition(Result::is_ok);
    match nothing.into_iter().filter_map(Result::err).next_back() {
        Some(why) if planned.is_empty() => Err(Failure::NothingToCut(why)),
        _ => Ok(planned.into_iter().flatten().collect()),
    }
}

/// Plans one setup of a job: its files and report are those that [`plan_job`] makes of it, whatever
/// the job's other setups are. Where setups before it cut the same stock, plans these, too.
///
/// # Errors
/// As [`plan_job`]; [`Failure::NothingToCut`] if this setup gets no program.
pub fn plan_job_setup(
    job: &Job,
    index: usize,
    settings: PlanSettings,
    cell: Option<f64>,
    stages: &dyn Stages,
) -> Result<Planned, Failure> {
    let (before, _) = programs_before(&job.file.setups, index);
    let first = before.first().copied().unwrap_or(index);
    let last = planned_setups(job, first..index + 1, settings, (cell, stages), |_, _| ())?.pop();
    let (planned, ()) =
        last.unwrap_or_else(|| Err("there is no such setup".to_owned())).map_err(Failure::NothingToCut)?;
    Ok(planned)
}

/// A planned setup, with what is kept of it, or the reason why there is nothing to cut.
type PlannedOrEmpty<T> = Result<(Planned, T), String>;

/// Plans setups in their order.
fn planned_setups<'j, T>(
    job: &'j Job,
    setups: Range<usize>,
    settings: PlanSettings,
    (cell, stages): (Option<f64>, &dyn Stages),
    mut keep: impl FnMut(&Planned, Option<ReadSetup<'j>>) -> T,
) -> Result<Vec<PlannedOrEmpty<T>>, Failure> {
    if cell.is_some_and(|c| !(c > 0.0 && c.is_finite())) {
        return Err(job.wrong("the distance of the stock's lines must be a length above 0 mm"));
    }
    setups.clone().try_for_each(|k| check_before(job, k))?;
    let _sharing = job.share_meshes();
    let mut all: Vec<PlannedOrEmpty<T>> = Vec::new();
    let mut programs = job.programs.clone();
    let mut inputs = BTreeMap::new();
    let first = setups.start;
    for index in setups {
        // Setups in which nothing is to be cut leave the rest of those before them.
        let (chain, _) = programs_before(&job.file.setups, index);
        let mut made = chain.iter().rev().filter(|k| **k >= first).map(|&k| (k, &all[k - first]));
        let last = made.find_map(|(k, planned)| {
            let (planned, _) = planned.as_ref().ok().filter(|(planned, _)| planned.program_to_run().is_some())?;
            Some((k, planned))
        });
        let before = last.and_then(|(k, planned)| planned.rest.as_ref().map(|rest| (k, rest)));
        let stock = StockToCut { cell: cell.or(job.file.verification.stock_cell_mm), index, before };
        match planned_setup(job, (index, &programs), settings, Some(&stock), stages) {
            Err(Failure::NothingToCut(why)) => {
                programs.add(index, None, job.post.dialect());
                all.push(Err(why));
            }
            planned => {
                let (mut planned, read) = planned?;
                unchanged(job, &mut inputs, &planned)?;
                let sweeps = planned.sweeps.take().filter(|_| planned.program_to_run().is_some());
                if let Some(sweeps) = sweeps {
                    let before = chain.iter().filter(|k| **k >= first).map(|k| (*k, k - first));
                    for (k, at) in before {
                        lower(job, (k, index), all[at].as_mut().ok().map(|(planned, _)| planned), &sweeps)?;
                    }
                }
                let program = planned.program_to_run().map(|(name, text)| (name.into(), text.to_vec()));
                programs.add(index, program, job.post.dialect());
                let kept = keep(&planned, read);
                all.push(Ok((planned, kept)));
            }
        }
    }
    for planned in all.iter_mut().flatten().map(|(planned, _)| planned) {
        let open = std::mem::take(&mut planned.open_regions);
        planned.left_at_end = open.iter().map(|region| region.at_end(&planned.report.setup)).collect();
    }
    Ok(all)
}

/// Lowers what the setup `k` has left open to what a later program, of the setup `index`, cuts.
fn lower(
    job: &Job,
    (k, index): (usize, usize),
    planned: Option<&mut Planned>,
    sweeps: &ProgramSweeps,
) -> Result<(), Failure> {
    let setups = &job.file.setups;
    let motion = work_from_work(&setups[k], &setups[index]);
    let mut regions = planned.into_iter().flat_map(|planned| &mut planned.open_regions);
    regions.try_for_each(|region| region.lower(&setups[index].name, motion, |on| sweeps.heights(on)))
}

/// Checks that a setup was made from files as those before it were: meshes are read once for all.
fn unchanged(job: &Job, inputs: &mut BTreeMap<String, String>, planned: &Planned) -> Result<(), Failure> {
    for input in &planned.report.made_from.inputs {
        let before = inputs.insert(input.file.clone(), input.blake3.clone());
        if before.is_some_and(|before| before != input.blake3) {
            return Err(job.wrong(format!("{} has changed while the job was planned; plan it again", input.file)));
        }
    }
    Ok(())
}
