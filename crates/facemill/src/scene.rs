//! Search, plan, verification and stock of a scene.

use std::path::Path;

use facemill_cl_data::CcPoint;
use facemill_cutter_location::{FoundPosture, Hints, Infeasible, PoseTest, search};
use facemill_job::failure::Failure;
use facemill_job::setup::cell::{search_curve, search_settings, z_map};
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_nc_program::Dialect;
use facemill_planner::{PlanSettings, Planned, plan_setup};
use facemill_verification::program::{Verified, VerifyRequest, verify_program};
use facemill_verification::stock_run::CutRequest;

/// Work of all stages on one [`Scene`], the setup of a job on a machine with one head.
///
/// ```no_run
/// use facemill::nc_program::Dialect;
/// use facemill::{Job, PlanSettings, Scene, Setup, SilentStages, UseScene};
///
/// let job = Job::read(std::path::Path::new("assets/propeller/job.json"))?;
/// let setup = Setup::read(&job, 0)?;
/// let scene = Scene::new(&job, &setup, 0)?;
/// let planned = scene.plan(PlanSettings { verify: false, certificates: false }, &SilentStages)?;
/// let (_, text) = &planned.files[0];
/// let verified = scene.verify(text, Dialect::Fanuc, &SilentStages)?;
/// assert!(verified.file.verification.findings.is_empty());
/// # Ok::<(), facemill::Failure>(())
/// ```
pub trait UseScene {
    /// Searches a posture at each CC point (workpiece frame), one by one, with the ranges of an
    /// operation; `uncut_left` states whether the uncut stock is to the left of the feed.
    ///
    /// Each result is the posture that [`search`](search()) finds, or the reason that blocks most
    /// of its curve.
    ///
    /// # Errors
    /// If the job has no such operation, the operation no search curve, or the machine two heads.
    fn search(
        &self,
        operation: &str,
        cc: &[CcPoint],
        uncut_left: bool,
    ) -> Result<Vec<Result<FoundPosture, Infeasible>>, Failure>;

    /// Plans the operations of the setup, as [`plan_setup`].
    ///
    /// # Errors
    /// As [`plan_setup`], and if the machine has two heads.
    fn plan(&self, settings: PlanSettings, stages: &dyn Stages) -> Result<Planned, Failure>;

    /// Runs a program of any source against the initial stock, as [`verify_program`].
    ///
    /// # Errors
    /// As [`verify_program`], and if the machine has two heads.
    fn verify(&self, text: &[u8], dialect: Dialect, stages: &dyn Stages) -> Result<Verified, Failure>;

    /// Runs a program and cuts the stock as [`verify_program`]; `rest` of the result is the
    /// remaining stock.
    ///
    /// # Errors
    /// As [`verify_program`], and if the machine has two heads.
    fn cut(&self, text: &[u8], dialect: Dialect, request: CutRequest, stages: &dyn Stages)
    -> Result<Verified, Failure>;
}

/// Name of a program without a file, in errors.
const PROGRAM: &str = "program";

/// Refuses the scene of one of two heads: the other head would be missing.
fn check_one_head(scene: &Scene<'_>) -> Result<(), Failure> {
    match scene.job.second {
        Some(_) => Err(scene.job.wrong(
            "second_tool: a scene is that of one head; take plan_setup and verify_program for a machine with two",
        )),
        None => Ok(()),
    }
}

impl UseScene for Scene<'_> {
    fn search(
        &self,
        operation: &str,
        cc: &[CcPoint],
        uncut_left: bool,
    ) -> Result<Vec<Result<FoundPosture, Infeasible>>, Failure> {
        check_one_head(self)?;
        let named = self.job.operations_of(self.setup.file).map(|(_, o)| o).find(|o| o.name == operation);
        let operation = named.ok_or_else(|| {
            self.job.wrong(format!("operations: setup \"{}\" has none named \"{operation}\"", self.setup.file.name))
        })?;
        let map = z_map(self.setup)?;
        let cell = self.workcell(operation, &map);
        let test = PoseTest::new(&cell);
        let curve = search_curve(self.job, operation, uncut_left)?;
        let settings = search_settings(operation);
        let mut hints = Hints::default();
        Ok(cc.iter().map(|cc| search(&test, cc, &curve, &settings, 0.0, None, &mut hints)).collect())
    }

    fn plan(&self, settings: PlanSettings, stages: &dyn Stages) -> Result<Planned, Failure> {
        check_one_head(self)?;
        plan_setup(self.job, self.index, settings, stages)
    }

    fn verify(&self, text: &[u8], dialect: Dialect, stages: &dyn Stages) -> Result<Verified, Failure> {
        check_one_head(self)?;
        let request = VerifyRequest { setup: self.index, ..VerifyRequest::new(Path::new(PROGRAM), dialect) };
        verify_program(self.job, text, &request, stages)
    }

    fn cut(
        &self,
        text: &[u8],
        dialect: Dialect,
        request: CutRequest,
        stages: &dyn Stages,
    ) -> Result<Verified, Failure> {
        check_one_head(self)?;
        let request =
            VerifyRequest { setup: self.index, cut: Some(request), ..VerifyRequest::new(Path::new(PROGRAM), dialect) };
        verify_program(self.job, text, &request, stages)
    }
}
