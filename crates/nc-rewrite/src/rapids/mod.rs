//! Faster links for an existing program: replaces each by the fastest path that is proven free of
//! the stock at that time.

mod finish;
mod numbered;
mod rapids_file;

use std::path::Path;

use facemill_inverse_kinematics::{Axis, AxisValues};
use facemill_job::failure::Failure;
use facemill_job::format::verification_file::VerificationFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::scene::Scene;
use facemill_job::stages::{SHORTEN, Stages};
use facemill_job::stock::map::StockMeshes;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_tool_path::links::choose::{Choice, Chosen};
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::links::fastest;
use facemill_tool_path::links::words::{KeptLines, LinkLines, LinkWords, RapidForm, link_lines, turns_shorter};
use facemill_verification::named_results::not_verified;
use facemill_verification::program::{Verified, VerifyRequest, verify_program};
use facemill_verification::stock_run::CutRequest;
use facemill_virtual_machine::{
    LinkHold, LinkSettings, LinkStage, ProgramLink, VerifySettings, VirtualSetup, run_links,
};

use crate::rapids::finish::finish;

pub use crate::rapids::rapids_file::{LinkReport, RAPIDS_FORMAT, RapidsFile};
pub use facemill_job::format::report::links::{LinksReport, PlannedLinkReport, ShortenedLinks};
pub use facemill_tool_path::links::link_paths::RetractStrategy;
pub use facemill_tool_path::links::tour::{
    LearntTour, Tour, TourCosts, TourError, TourLink, shortest_tour, shortest_tour_by,
};

/// Options of the search for faster links.
#[derive(Clone, Debug)]
pub struct RapidsRequest<'a> {
    /// Name of the program in errors.
    pub program: &'a Path,
    /// Control that it is for.
    pub dialect: Dialect,
    /// Index of the job's setup.
    pub setup: usize,
    /// As in [`VerifyRequest::gouge_limit`].
    pub gouge_limit: Option<f64>,
    /// Lines of the stock, and its initial state.
    pub cut: CutRequest,
    /// Distance to keep from stock and fixtures, mm; `None`: the setup's for rapids.
    pub clearance: Option<f64>,
}

/// Program with faster links.
#[derive(Clone, Debug)]
pub struct Rapids {
    /// Its text: that of the program with other lines in the changed links, the same bytes
    /// elsewhere.
    pub text: Vec<u8>,
    /// Report on the changes.
    pub file: RapidsFile,
    /// Verification of the new program.
    pub verification: VerificationFile,
}

/// Replaces links of a program (all rapids between two runs of cuts) by the fastest path among
/// those of [`RetractStrategy`] that is free of the stock at that time, of part, fixtures and
/// machine: proven as rapids are in certificates, with the clearance of [`LinkSettings`]. A link
/// without a faster free path keeps its bytes, as does all other text.
///
/// Reads the new program again: outside of changed links it has the same motions. Runs it with its
/// stock as [`verify_program`] does; links with a new finding get their old lines back.
///
/// # Errors
/// If a file of the job is wrong, the program is not understood, its control or machine is not
/// supported, or the stages are cancelled.
pub fn faster_rapids(
    job: &Job,
    text: &[u8],
    request: &RapidsRequest<'_>,
    stages: &dyn Stages,
) -> Result<Rapids, Failure> {
    if job.second.is_some() {
        let why =
            "second_tool: links of programs for two heads are not replaced; `facemill verify` runs them as they are";
        return Err(job.wrong(why));
    }
    let job = &job.for_setup(request.setup);
    let program = job.read_program(text, request.dialect).map_err(|e| Failure::input(request.program, e))?;
    let before = verified(job, text, request, stages)?;
    let setup = Setup::read(job, request.setup)?;
    let scene = Scene::new(job, &setup, request.setup)?;
    let clearance = request.clearance.unwrap_or(setup.file.rapid_clearance_mm);
    let form = RapidForm::of(request.dialect);
    let turns_shorter = turns_shorter(&program) || job.machine.axes().iter().any(Axis::rolls_over);
    let stage = LinkSearch { scene, program: &program, request, clearance, form, turns_shorter };
    let mut links = stage.links(stages)?;
    finish(&stage, text, &mut links, &before, stages)
}

fn verified(job: &Job, text: &[u8], request: &RapidsRequest<'_>, stages: &dyn Stages) -> Result<Verified, Failure> {
    let verify = VerifyRequest {
        setup: request.setup,
        gouge_limit: request.gouge_limit,
        cut: Some(request.cut.clone()),
        // Links cut nothing, so they do not decide whether the program finishes its regions.
        finishes: false,
        ..VerifyRequest::new(request.program, request.dialect)
    };
    verify_program(job, text, &verify, stages)
}

/// Link with the result of its search.
struct SearchedLink {
    /// Lines of its first and last motion.
    lines: [u32; 2],
    /// Its own lines; `None` if they stay.
    own: Option<LinkLines>,
    before: f64,
    lower_bound: f64,
    better: Option<(Chosen, Vec<String>)>,
    kept: Option<KeptLines>,
}

/// Shared data of the search for links.
struct LinkSearch<'a> {
    scene: Scene<'a>,
    program: &'a ReadProgram,
    request: &'a RapidsRequest<'a>,
    clearance: f64,
    form: RapidForm,
    /// Whether rotary axes go the shorter way somewhere.
    turns_shorter: bool,
}

impl LinkSearch<'_> {
    /// Returns every link between two runs of cuts, with the fastest free path.
    fn links(&self, stages: &dyn Stages) -> Result<Vec<SearchedLink>, Failure> {
        let at = self.scene.virtual_setup(self.request.dialect);
        let mut stock = match &self.request.cut.rest {
            Some(rest) => rest.clone(),
            None => StockMeshes::of(self.scene.setup).map(
                self.scene.job,
                self.scene.setup,
                self.request.cut.cell,
                self.request.cut.region,
            )?,
        };
        let views = [(&self.scene.job.machine, self.scene.job.tool.gauge_length())];
        let clock = LinkClock::new(&views);
        let keep = LinkSettings { clearance: self.clearance, tolerance: self.request.cut.tolerance };
        let mut found = Vec::new();
        let mut failed = None;
        let mut visit = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
            if failed.is_some() || matches!(link.hold, Some(LinkHold::WayIn | LinkHold::WayOut)) {
                return;
            }
            match self.link(&at, &clock, link, stage) {
                Ok(link) => found.push(link),
                Err(why) => failed = Some(why),
            }
        };
        let monitor = stages.start(SHORTEN, self.program.blocks.len());
        let verify = VerifySettings::default();
        run_links(self.program, &[&at], (&verify, &keep), &mut stock, &mut visit, &*monitor).map_err(not_verified)?;
        match failed {
            Some(why) => Err(Failure::input(self.request.program, why)),
            None => Ok(found),
        }
    }

    fn link(
        &self,
        at: &VirtualSetup<'_>,
        clock: &LinkClock<'_>,
        link: &ProgramLink,
        stage: &LinkStage<'_, '_>,
    ) -> Result<SearchedLink, String> {
        let line = |block: Option<&usize>| block.map_or(0, |&b| self.program.blocks[b].line);
        let lines = [line(link.blocks.first()), line(link.blocks.last())];
        let own = reason_to_keep(link).map_or_else(|| link_lines(self.program, &self.scene.words, link), Err);
        let own = match own {
            Ok(own) => own,
            Err(why) => {
                let before = clock.time(link.law, &link.start, &link.ends)?;
                let end = link.ends.last().copied().unwrap_or(link.start);
                let lower_bound = clock.least_time(&link.start, &end);
                return Ok(SearchedLink { lines, own: None, before, lower_bound, better: None, kept: Some(why) });
            }
        };
        let writer = self.writer(at);
        let rounded = |axes: &AxisValues| writer.rounded(own.compensation(), axes).map(|(_, rounded)| rounded);
        let choice = fastest(&[self.scene.link_scene()], clock, (link, stage), &rounded)?;
        let Choice { before, lower_bound, better, .. } = choice;
        let said = |way: &Chosen| writer.lines(&self.form, self.turns_shorter, &own, &way.through);
        let (better, kept) = match better.map(|way| said(&way).map(|texts| (way, texts))).transpose() {
            Ok(better) => (better, None),
            Err(why) => (None, Some(KeptLines::because(why))),
        };
        Ok(SearchedLink { lines, own: Some(own), before, lower_bound, better, kept })
    }

    fn writer<'w>(&'w self, at: &VirtualSetup<'_>) -> LinkWords<'w> {
        LinkWords {
            machine: &self.scene.job.machine,
            tool_length: self.scene.job.tool.gauge_length(),
            words: &self.scene.words,
            table_from_rtcp_words: at.table_from_rtcp_words,
            decimals: self.scene.job.post.decimals(),
        }
    }
}

/// Returns the reason why a link is not examined.
fn reason_to_keep(link: &ProgramLink) -> Option<KeptLines> {
    match &link.hold {
        Some(LinkHold::Doubt { line, what }) => {
            let why = format!("the positions of the axes are unknown: {what}");
            Some(KeptLines { line: Some(*line), why })
        }
        Some(LinkHold::Laws) => Some(KeptLines::because("its blocks move in different ways")),
        _ => None,
    }
}
