//! Text of a setup with its origin, as the virtual machine runs it once for each head.

use facemill_job::failure::Failure;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{CERTIFY, Stages, VERIFY};
use facemill_nc_program::ReadProgram;
use facemill_verification::feeds::RequiredFeeds;
use facemill_verification::named_results::{name_obstacles, not_verified};
use facemill_verification::remaining::{LeftPlace, Remaining, RunningHead, left_places, remaining};
use facemill_virtual_machine::{
    Assumption, Certificates, GougeSection, HeldAsCut, Verification, VerifySettings, VirtualSetup, assumptions,
    certify, verify,
};

use crate::program::cut_stock::CuttingHead;

/// Stages of running the text, by head; the first ones are those of a machine with one head.
pub(crate) const VERIFY_STAGES: [&str; 3] = [VERIFY, "verify head 1", "verify head 2"];

/// Stages of proving its blocks.
pub(crate) const CERTIFY_STAGES: [&str; 3] = [CERTIFY, "certify head 1", "certify head 2"];

/// Text of `N` heads with its origin.
pub(crate) struct RunProgram<'p, const N: usize> {
    /// Setup as each head sees it.
    pub scenes: [&'p Scene<'p>; N],
    /// NC text.
    pub nc: &'p str,
    /// Permitted depth of each head's cutter in each part of the text.
    pub sections: [Vec<GougeSection>; N],
    /// Bodies tested only against the stock at that time, by
    /// [`cut_by_heads`](crate::program::cut_stock::cut_by_heads), and not against the initial
    /// stock.
    pub as_cut: HeldAsCut,
}

impl<const N: usize> RunProgram<'_, N> {
    /// Runs the text for each head.
    ///
    /// # Errors
    /// If the text cannot be read, or the stages are cancelled.
    pub(crate) fn verify(&self, stages: &dyn Stages) -> Result<[Verification; N], Failure> {
        let program = self.read()?;
        let mut runs = self.of_heads(|h| {
            let monitor = stages.start(stage(VERIFY_STAGES, h, N), program.blocks.len());
            let mut found = verify(&program, &self.setup(h), &self.settings(h), &*monitor).map_err(not_verified)?;
            name_obstacles(&mut found, self.scenes[h].setup);
            Ok(found)
        })?;
        if let (Some(first), Some(scene)) = (runs.first_mut(), self.scenes.first()) {
            // A shop's template may turn the spindles at will.
            let required = RequiredFeeds::of(scene.job, scene.setup.file);
            first.findings.extend(required.iter().flat_map(|required| required.other_speeds(&program)));
            first.findings.sort_by_key(|f| (f.first_line, f.kind));
        }
        Ok(runs)
    }

    /// Proves the motion inside the blocks of the text for each head.
    ///
    /// # Errors
    /// If the text cannot be read, or the stages are cancelled.
    pub(crate) fn certify(&self, stages: &dyn Stages) -> Result<[Certificates; N], Failure> {
        let program = self.read()?;
        self.of_heads(|h| {
            let monitor = stages.start(stage(CERTIFY_STAGES, h, N), program.blocks.len());
            certify(&program, &self.setup(h), &self.settings(h), &*monitor).map_err(not_verified)
        })
    }

    /// Measures the material that the text leaves on the regions of the setup's operations,
    /// whichever head cuts there.
    ///
    /// # Errors
    /// As [`remaining`].
    pub(crate) fn remaining(&self, stages: &dyn Stages) -> Result<Option<Remaining>, Failure> {
        let scene = self.first();
        self.with_heads(|heads| remaining(scene.job, scene.setup, &self.read()?, heads, stages))
    }

    /// Measures the heights that the text leaves on places of the regions of the setup's
    /// operations, in the order of the setup.
    ///
    /// # Errors
    /// As [`left_places`].
    pub(crate) fn left_places(&self, stages: &dyn Stages) -> Result<Vec<Vec<LeftPlace>>, Failure> {
        let scene = self.first();
        self.with_heads(|heads| left_places(scene.job, scene.setup, &self.read()?, heads, stages))
    }

    /// Returns the assumptions about behaviour that the text leaves to the control.
    ///
    /// # Errors
    /// If the text cannot be read.
    pub(crate) fn assumptions(&self) -> Result<Vec<Assumption>, Failure> {
        Ok(assumptions(&self.read()?, self.first().machine))
    }

    /// Returns the heads as they cut the stock.
    pub(crate) fn cutting_heads(&self) -> [CuttingHead<'_>; N] {
        std::array::from_fn(|h| CuttingHead { scene: self.scenes[h], at: self.setup(h), settings: self.settings(h) })
    }

    /// Returns the program as read from the text.
    ///
    /// # Errors
    /// If the job's own template makes a text that cannot be read.
    pub(crate) fn read(&self) -> Result<ReadProgram, Failure> {
        let job = self.first().job;
        job.read_program(self.nc.as_bytes(), job.post.dialect()).map_err(|e| job.unread(&e))
    }

    /// Returns the machine with everything on it, as a head sees it.
    pub(crate) fn setup(&self, head: usize) -> VirtualSetup<'_> {
        let scene = self.scenes[head];
        scene.virtual_setup(scene.job.post.dialect())
    }

    fn settings(&self, head: usize) -> VerifySettings {
        VerifySettings {
            // No stock is cut before the first operation.
            gouge_limit: 0.0,
            sections: self.sections[head].clone(),
            is_whole: true,
            as_cut: self.as_cut,
            ..VerifySettings::default()
        }
    }

    fn first(&self) -> &Scene<'_> {
        self.scenes[0]
    }

    fn with_heads<T>(&self, of: impl FnOnce(&[RunningHead<'_>]) -> T) -> T {
        let setups: [VirtualSetup<'_>; N] = std::array::from_fn(|h| self.setup(h));
        let settings: [VerifySettings; N] = std::array::from_fn(|h| self.settings(h));
        let heads: [RunningHead<'_>; N] =
            std::array::from_fn(|h| RunningHead { at: &setups[h], settings: &settings[h] });
        of(&heads)
    }

    fn of_heads<T>(&self, of: impl FnMut(usize) -> Result<T, Failure>) -> Result<[T; N], Failure> {
        let all: Vec<T> = (0..N).map(of).collect::<Result<_, _>>()?;
        all.try_into().map_err(|_| Failure::Internal("heads without results".to_owned()))
    }
}

/// Returns the name of a head's stage.
fn stage(names: [&'static str; 3], head: usize, n_heads: usize) -> &'static str {
    let by_number = names.get(head + 1).copied().filter(|_| n_heads > 1);
    by_number.unwrap_or(names[0])
}
