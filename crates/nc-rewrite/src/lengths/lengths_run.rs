//! Program with all data for the search for lengths.

use crate::lengths::lengths_file::{LENGTHS_FORMAT, LengthName, LengthReport, LengthsFile, NoLength, Posting};
use facemill_job::failure::Failure;
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::cell::budget;
use facemill_job::setup::scene::Scene;
use facemill_job::stages::Stages;
use facemill_nc_program::ReadProgram;
use facemill_tool_model::{AssemblyLength, OpenAssembly};
use facemill_verification::named_results::{name_obstacle, name_obstacles_of, not_verified};
use facemill_verification::stock_run::stock_before;
use facemill_virtual_machine::{
    Certificates, ClearLengths, Finding, FindingKind, ForcedBy, HeldAsCut, LengthSettings, LengthStock, VerifyError,
    VerifySettings, VirtualSetup, certify, clear_lengths, run_stock, verify,
};
use facemill_z_map::DexelMap;

use crate::lengths::{AlsoProgram, FoundLengths, LengthsRequest};

/// A search for the shortest lengths: a program in a setup, its stock and its settings.
pub(crate) struct LengthsRun<'a> {
    pub(crate) scene: Scene<'a>,
    pub(crate) program: &'a ReadProgram,
    pub(crate) stamp: ProgramStamp,
    pub(crate) request: &'a LengthsRequest<'a>,
    pub(crate) stages: &'a dyn Stages,
    stock: Option<DexelMap>,
    verify: VerifySettings,
}

impl<'a> LengthsRun<'a> {
    pub(crate) fn new(
        (job, setup, at): (&'a Job, &'a Setup<'a>, &AlsoProgram<'_>),
        (program, stamp): (&'a ReadProgram, ProgramStamp),
        request: &'a LengthsRequest<'a>,
        stages: &'a dyn Stages,
    ) -> Result<Self, Failure> {
        let scene = Scene::new(job, setup, at.setup)?;
        scene.check_frame_of(program, at.program)?;
        let stock = match &request.cut {
            Some(cut) => Some(match &cut.rest {
                Some(rest) => rest.clone(),
                None => stock_before(job, setup, cut.cell, cut.region, cut.tolerance)?,
            }),
            None => None,
        };
        let limits = job.operations_of(setup.file).map(|(_, o)| budget(job, o).simulated());
        let gouge_limit = limits.reduce(f64::min).unwrap_or(0.0);
        let as_cut = HeldAsCut { tool: stock.is_some(), machine: false };
        let verify = VerifySettings { gouge_limit, as_cut, is_whole: true, ..VerifySettings::default() };
        Ok(Self { scene, program, stamp, request, stages, stock, verify })
    }

    fn at(&self) -> VirtualSetup<'_> {
        self.scene.virtual_setup(self.request.dialect)
    }

    /// Returns the shortest lengths of an assembly, up to the longest and with a margin.
    pub(crate) fn lengths(
        &self,
        assembly: &OpenAssembly,
        [longest, margin]: [f64; 2],
    ) -> Result<ClearLengths, Failure> {
        let settings = LengthSettings { verify: self.verify.clone(), margin, longest };
        let monitor = self.stages.start("find lengths", 0);
        let stock = self.stock.as_ref().zip(self.request.cut.as_ref());
        let stock = stock.map(|(before, cut)| LengthStock { before, tolerance: cut.tolerance });
        let found = clear_lengths(self.program, &self.at(), assembly, stock, &settings, &*monitor);
        found.map_err(|e| match e {
            VerifyError::Tool { .. } | VerifyError::Setting { .. } => self.scene.job.wrong(e),
            other => not_verified(other),
        })
    }

    /// Returns all findings of the ordinary run of the program as posted for these lengths.
    pub(crate) fn findings(&self, found: &ClearLengths) -> Result<Vec<Finding>, Failure> {
        let setup = VirtualSetup { tool: &found.tool, words: &found.words, ..self.at() };
        let monitor = self.stages.start("verify program", found.program.blocks.len());
        let run = verify(&found.program, &setup, &self.verify, &*monitor).map_err(not_verified)?;
        let mut findings = run.findings;
        if let (Some(stock), Some(cut)) = (&self.stock, &self.request.cut) {
            let mut stock = stock.clone();
            let run = run_stock(&found.program, &setup, &self.verify, &mut stock, cut.tolerance, &*monitor);
            findings.extend(run.map_err(not_verified)?.findings);
        }
        name_obstacles_of(&mut findings, self.scene.setup);
        findings.sort_by_key(|f| (f.first_line, f.kind));
        Ok(findings)
    }

    /// Returns the proofs for every block of the program as posted for these lengths.
    fn certificates(&self, found: &ClearLengths) -> Result<Certificates, Failure> {
        let setup = VirtualSetup { tool: &found.tool, words: &found.words, ..self.at() };
        let monitor = self.stages.start("certify program", found.program.blocks.len());
        certify(&found.program, &setup, &self.verify, &*monitor).map_err(not_verified)
    }

    /// Returns the report on lengths.
    pub(crate) fn lengths_report(
        &self,
        found: &ClearLengths,
        assembly: &OpenAssembly,
    ) -> Result<FoundLengths, Failure> {
        let findings = if found.hopeless.is_none() { self.findings(found)? } else { Vec::new() };
        let certificates = match (&found.hopeless, self.request.certificates) {
            (None, true) => Some(self.certificates(found)?),
            _ => None,
        };
        let all = if found.hopeless.is_none() { &AssemblyLength::ALL[..] } else { &[] };
        let is_posted_again = found.program.blocks != self.program.blocks;
        let file = LengthsFile {
            format: LENGTHS_FORMAT,
            job: self.scene.job.file.name.clone(),
            setup: self.scene.setup.file.name.clone(),
            program: self.stamp.clone(),
            called_files: Vec::new(),
            others: Vec::new(),
            replanned_blake3: None,
            dialect: self.request.dialect.name().to_owned(),
            tool: self.scene.job.tool.name().to_owned(),
            margin_mm: self.request.margin,
            stock_cell_mm: self.stock.as_ref().map(|s| s.grid().cell()),
            posting: if is_posted_again { Posting::Again } else { Posting::AsItIs },
            lengths: all.iter().filter_map(|&l| self.length(l, found, assembly)).collect(),
            none_is_free: found.hopeless.as_ref().map(|(length, by)| NoLength {
                name: LengthName::of(*length),
                longest_mm: self.request.longest,
                setup: None,
                by: self.named(by.clone()),
            }),
            holder: None,
            holders: Vec::new(),
            replans: Vec::new(),
            findings,
            certificates,
        };
        let tool = found.hopeless.is_none().then(|| found.tool.to_file());
        Ok(FoundLengths { file, tool, replanned: None })
    }

    fn length(&self, length: AssemblyLength, found: &ClearLengths, assembly: &OpenAssembly) -> Option<LengthReport> {
        let k = length.index();
        if length == AssemblyLength::LowerHolder && !assembly.has_lower() {
            return None;
        }
        let forced_by = found.forced_by[k].clone().map(|by| self.named(by));
        Some(LengthReport {
            name: LengthName::of(length),
            meaning: LengthName::of(length).meaning(),
            now_mm: OpenAssembly::open(&self.scene.job.tool).lengths()[k],
            length_mm: found.lengths[k],
            rests_on: forced_by.is_none().then(|| assembly.rests_on(length)),
            setup: None,
            forced_by,
        })
    }

    /// Adds the part of the obstacle at its place.
    pub(crate) fn named(&self, mut by: ForcedBy) -> ForcedBy {
        name_obstacle(&mut by.obstacle, by.place_work_mm, self.scene.setup);
        by
    }
}

/// Returns whether a body above the cutter collides.
pub(crate) fn is_of_bodies(finding: &Finding) -> bool {
    matches!(finding.kind, FindingKind::HolderCollision | FindingKind::Collision)
}
