//! Complete plan of one setup: path, postures, moves, text, verification, report.

use facemill_job::failure::Failure;
use facemill_job::format::made_from::MadeFrom;
use facemill_job::load::job::{Job, Setup, WrittenPrograms};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::setup::cell::z_map;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{READ, STOCK_BEFORE, Stages};
use facemill_job_check::post_probe::try_template;
use facemill_z_map::ZMap;

use crate::dual::two_heads::with_two_heads;
use crate::passes::extra_passes::AddedPasses;
use crate::passes::setup_context::SetupContext;
use crate::plan_run::{PlanRun, stages_of};
use crate::plan_settings::PlanSettings;
use crate::plan_stock::StockToCut;
use crate::planned::Planned;
use crate::program::one_head::OneHead;
use crate::stage_clock::Clock;

/// Plans one setup of a job. Its program is tested against the initial stock;
/// [`plan_job`](crate::plan_job::plan_job) cuts it.
///
/// # Errors
/// If the input is wrong, the job cannot be planned under its own terms, or the stages are
/// cancelled.
pub fn plan_setup(job: &Job, index: usize, settings: PlanSettings, stages: &dyn Stages) -> Result<Planned, Failure> {
    let (planned, _) = planned_setup(job, (index, &job.programs), settings, None, stages)?;
    Ok(Planned { sweeps: None, ..planned })
}

/// Setup as a plan has read it, for pages and maps that are made of the plan.
pub struct ReadSetup<'j> {
    /// The setup.
    pub setup: Setup<'j>,
    /// Map by which its postures were tested.
    pub(crate) map: ZMap,
}

/// Plans one setup of a job, and cuts its stock if the program is verified and there is stock;
/// `programs` are those that are written so far. Returns the setup, too; of a machine with two
/// heads, which each have their own, none.
pub(crate) fn planned_setup<'j>(
    job: &'j Job,
    (index, programs): (usize, &WrittenPrograms),
    settings: PlanSettings,
    stock: Option<&StockToCut<'_>>,
    stages: &dyn Stages,
) -> Result<(Planned, Option<ReadSetup<'j>>), Failure> {
    let clock = Clock::new();
    let of_job = job;
    let job = &Job { programs: programs.clone(), ..of_job.for_setup(index) };
    stages.expect(stages_of(job, index, settings, stock.is_some()));
    let made_from = MadeFrom::of(job);
    let mut run = PlanRun { settings, stock, stages, made_from, clock };
    if job.second.is_some() {
        return Ok((with_two_heads(job, index, run)?, None));
    }
    let reading = stages.start(READ, 0);
    let setup = Setup::read(of_job, index)?;
    check_winding(job, &setup, index)?;
    drop(reading);
    let bounding = stages.start(STOCK_BEFORE, 0);
    let setup = setup.after_programs(job, &*bounding)?;
    let map = z_map(&setup)?;
    let scene = Scene::new(job, &setup, index)?;
    try_template(job, &setup, &scene.words)?;
    drop(bounding);
    run.clock.lap("read");
    let context = SetupContext { scene: &scene, map: &map, added: AddedPasses::All };
    let planned = run.plan(&OneHead { context })?;
    drop(scene);
    Ok((planned, Some(ReadSetup { setup, map })))
}
