//! Program from any source, run on the virtual machine in a job's setup.

use std::collections::BTreeMap;
use std::path::Path;

use facemill_cl_data::Silent;
use facemill_inverse_kinematics::Machine;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, SetupFile};
use facemill_job::format::program_stamp::ProgramStamp;
use facemill_job::format::program_times::{NoLawReason, ProgramTimes};
use facemill_job::format::report::deviation::DeviationReport;
use facemill_job::format::report::efficiency::EfficiencyReport;
use facemill_job::format::report::stock::StockReport;
use facemill_job::format::verification_file::{VERIFICATION_FORMAT, VerificationFile};
use facemill_job::load::HEADS_APART;
use facemill_job::load::job::{Job, Setup};
use facemill_job::load::mesh_winding::check_winding;
use facemill_job::load::open_meshes::{open_files, open_stock};
use facemill_job::planning_stock::PlanningStock;
use facemill_job::setup::cell::budget;
use facemill_job::setup::scene::{Scene, uses_rtcp};
use facemill_job::stages::{Stages, TIMES};
use facemill_job::stock::map::StockRegion;
use facemill_job::validate::limits::STOCK_TOLERANCES;
use facemill_nc_program::{Dialect, ReadProgram};
use facemill_virtual_machine::motion::axis_motion::MotionContext;
use facemill_virtual_machine::{
    Assumption, BlockCut, Certificates, Estimate, Finding, HeldAsCut, RemovalLimit, Verification, VerifySettings,
    VirtualSetup, assumptions, certify, merge_findings, place_findings, rapid_lines, verify,
};
use facemill_z_map::DexelMap;

use crate::assumptions::{all_assumptions, cuts_nothing, is_estimate};
use crate::deviation::{CutStock, deviation_of};
use crate::efficiency::efficiencies_of_text;
use crate::feeds::{CutFeeds, FastBlock, KnownCuts, RequiredFeeds};
use crate::merged_heads::{merged_runs, proven_for_both};
use crate::named_results::{name_obstacles, not_verified};
use crate::remaining::open_regions::OpenRegion;
use crate::remaining::{LeftByLine, ProgramSweeps, Remaining, RunningHead, remaining};
use crate::stock_run::{CutRequest, HeadView, blocks_of_heads, cut_stock};
use crate::sub_cell_check::{
    SubCellResult, add_between, held_as_cut, seen_between, seen_in_estimate, seen_of_rest, sub_cell_check,
};
use crate::text_times::{ALL_LINES, TimedText, times_of_text};

/// Options of a program's run.
#[derive(Clone, Debug)]
pub struct VerifyRequest<'a> {
    /// Name of the program in errors.
    pub program: &'a Path,
    /// Control that it is for.
    pub dialect: Dialect,
    /// Index of the job's setup.
    pub setup: usize,
    /// Number of the tool change, from 0, whose part of the program is run
    /// ([`ReadProgram::tool_sections`]); `None`: all of it, with one tool.
    pub section: Option<usize>,
    /// Depth of the cutter below an allowance beyond which it is a finding, mm; `None`: the
    /// smallest permitted by one of the setup's operations.
    pub gouge_limit: Option<f64>,
    /// Also prove the motion of every block between its ends.
    pub certificates: bool,
    /// Also time the program within velocity, acceleration and jerk of the axes.
    pub time_law: bool,
    /// Only estimate collisions, by the paper's rule ([`Estimate`]): fast, but without any proof.
    /// Not with `certificates`.
    pub fast: bool,
    /// Cut the stock as the program goes, and test tool assembly, bodies of the machine and rapids
    /// against it as it then is. Without it, test them against the initial stock; bodies of the
    /// machine are tested so, too, if the cut begins with a rest, the flute is too short to know
    /// the remains between the lines, or the run is an estimate.
    pub cut: Option<CutRequest>,
    /// Whether the program is to finish the regions of the setup's operations: more material left
    /// than they permit is then a finding. It is measured in any case.
    pub finishes: bool,
}

impl<'a> VerifyRequest<'a> {
    /// Returns a request for the job's first setup, with the limits of its operations, against the
    /// initial stock.
    #[must_use]
    pub const fn new(program: &'a Path, dialect: Dialect) -> Self {
        Self {
            program,
            dialect,
            setup: 0,
            section: None,
            gouge_limit: None,
            certificates: false,
            time_law: false,
            fast: false,
            cut: None,
            finishes: true,
        }
    }
}

/// Results of a verification, and the remaining stock if it was cut.
#[derive(Clone, Debug)]
pub struct Verified {
    /// Content of the file.
    pub file: VerificationFile,
    /// The stock after the program.
    pub rest: Option<DexelMap>,
    /// Heights left beside the blocks, if they were measured.
    pub left: Option<LeftByLine>,
    /// Removal of every block with a cutting move, in program order, with two heads both together;
    /// empty if the stock was not cut.
    pub cuts: Vec<BlockCut>,
    /// The part's surface in the colours of its deviation, as GLB, if requested.
    pub painted: Option<Vec<u8>>,
    /// Regions on which it does not keep its operations' limits, for later programs.
    pub open_regions: Vec<OpenRegion>,
    /// All that it cuts, if it was measured.
    pub sweeps: Option<ProgramSweeps>,
    /// Lines of the program's rapids, in order, by which findings are
    /// [merged](facemill_virtual_machine::merge_findings).
    pub rapid_lines: Vec<u32>,
}

impl Verified {
    /// Completes the content of the file: merges its findings, and adds further assumptions in
    /// their order.
    pub fn complete(&mut self, assumptions: impl IntoIterator<Item = Assumption>) {
        let findings = std::mem::take(&mut self.file.verification.findings);
        self.file.verification.findings = merge_findings(findings, &self.rapid_lines);
        self.file.assumptions.extend(assumptions);
        self.file.assumptions.sort();
    }
}

/// Runs a program on the virtual machine in a job's setup: its machine, mounting, work offset,
/// tool, part, fixtures and stock. With two heads, runs it for each, and cuts the stock by both at
/// the same time.
///
/// The origin of the program does not matter; the operations of the job only determine the
/// permitted depth of the cutter. Guarantees the same as [`verify`]: positions are tested exactly,
/// and between them nothing is worse by more than reported; certificates prove this with the
/// control's tolerance. If the stock is cut, guarantees the same as
/// [`run_stock`](facemill_virtual_machine::run_stock), too.
///
/// # Errors
/// If a file of the job is wrong, the setup does not exist, the program is not understood (line,
/// column and text), or the stages are cancelled.
pub fn verify_program(
    job: &Job,
    text: &[u8],
    request: &VerifyRequest<'_>,
    stages: &dyn Stages,
) -> Result<Verified, Failure> {
    let job = &job.for_setup(request.setup);
    let setups = &job.file.setups;
    let setup = setups.get(request.setup).ok_or_else(|| {
        job.wrong(format!("setup {} was requested, but the job has {}", request.setup + 1, setups.len()))
    })?;
    if request.gouge_limit.is_some_and(|g| !(g >= 0.0 && g.is_finite())) {
        return Err(job.wrong("the gouge limit must be a depth of at least 0 mm"));
    }
    if request.fast && request.certificates {
        return Err(job.wrong("the fast mode only estimates and proves no certificates: leave out one of the two"));
    }
    if let Some(cut) = request.cut.as_ref().filter(|c| !STOCK_TOLERANCES.contains(&c.tolerance)) {
        return Err(job.wrong(format!(
            "the tolerance of the cut stock must be from {} to {} mm, is {}",
            STOCK_TOLERANCES.start(),
            STOCK_TOLERANCES.end(),
            cut.tolerance
        )));
    }
    if request.cut.as_ref().is_some_and(|c| c.across && (c.rest.is_some() || c.region != StockRegion::Whole)) {
        return Err(job.wrong("lines along x and y are cut of all of the job's stock, not of a region or a rest of it"));
    }
    let mut program = job.read_program(text, request.dialect).map_err(|e| Failure::input(request.program, e))?;
    if let Some(k) = request.section {
        let mut sections = job.parts_of(&program, request.setup);
        if k >= sections.len() {
            let message =
                format!("has {} tool change(s), and the part behind number {} was requested", sections.len(), k + 1);
            return Err(Failure::input(request.program, message));
        }
        program = sections.swap_remove(k);
    }
    let gouge_limit = request.gouge_limit.unwrap_or_else(|| {
        let limits = job.operations_of(setup).map(|(_, o)| budget(job, o).simulated());
        limits.reduce(f64::min).unwrap_or(0.0)
    });
    let as_cut = match &request.cut {
        Some(_) if request.fast => HeldAsCut::TOOL,
        Some(cut) => held_as_cut(job, cut),
        None => HeldAsCut::NOTHING,
    };
    let stamp = ProgramStamp::new(request.program, text);
    let run = VerificationRun { program: &program, text, stamp, request, gouge_limit, as_cut, stages };
    let mut found = if job.second.is_some() { run.two_heads(job)? } else { run.one_head(job)? };
    found.verification.findings.sort_by_key(|f| (f.first_line, f.kind));
    let machine = match &job.second {
        None => job.machine.clone(),
        Some(_) => job.seen_by(0, 0.0).machine,
    };
    found.assumptions.extend(found.verification.estimate.as_ref().map(is_estimate));
    let open_regions = found.remaining.as_ref().map_or_else(Vec::new, |r| r.open_regions(BTreeMap::new()));
    let (remaining, left) = found.remaining.as_ref().map(|r| (r.report.clone(), r.by_line.clone())).unzip();
    let sweeps = found.remaining.map(Remaining::into_sweeps);
    let file = VerificationFile {
        format: VERIFICATION_FORMAT,
        job: job.file.name.clone(),
        setup: setup.name.clone(),
        program: run.stamp.clone(),
        called_files: Vec::new(),
        dialect: request.dialect.name().to_owned(),
        gouge_limit_mm: gouge_limit,
        times: found.times,
        verification: found.verification,
        assumptions: all_assumptions(assumptions(&program, &machine), found.assumptions),
        remaining,
        efficiency: found.efficiency,
        stock: found.stock,
        deviation: found.deviation,
        certificates: found.certificates,
    };
    let rapid_lines = rapid_lines(&program);
    let (rest, cuts, painted) = (found.rest, found.cuts, found.painted);
    Ok(Verified { file, rest, left, cuts, painted, open_regions, sweeps, rapid_lines })
}

/// Program and the options of its run.
struct VerificationRun<'a> {
    program: &'a ReadProgram,
    text: &'a [u8],
    stamp: ProgramStamp,
    request: &'a VerifyRequest<'a>,
    gouge_limit: f64,
    as_cut: HeldAsCut,
    stages: &'a dyn Stages,
}

/// Results of the runs.
struct RunResults {
    verification: Verification,
    times: ProgramTimes,
    assumptions: Vec<Assumption>,
    certificates: Option<Certificates>,
    remaining: Option<Remaining>,
    efficiency: Vec<EfficiencyReport>,
    stock: Option<StockReport>,
    rest: Option<DexelMap>,
    cuts: Vec<BlockCut>,
    deviation: Option<DeviationReport>,
    painted: Option<Vec<u8>>,
}

impl RunResults {
    /// Returns the results without cut stock.
    fn of(verification: Verification, certificates: Option<Certificates>) -> Self {
        let assumptions = Vec::new();
        Self {
            verification,
            times: ProgramTimes::default(),
            assumptions,
            certificates,
            remaining: None,
            efficiency: Vec::new(),
            stock: None,
            rest: None,
            cuts: Vec::new(),
            deviation: None,
            painted: None,
        }
    }
}

/// Results of cutting the stock.
struct Cut<const N: usize> {
    /// Knowledge about each head's cuts.
    known: [KnownCuts; N],
    /// Collisions with the stock, of each head.
    findings: [Vec<Finding>; N],
    report: StockReport,
    rest: DexelMap,
    cuts: Vec<BlockCut>,
    deviation: Option<DeviationReport>,
    painted: Option<Vec<u8>>,
    /// Description of the check between the lines.
    seen_between: String,
    /// Additional results of the runs against the whole initial stock, without the findings.
    between: Vec<SubCellResult>,
}

impl RunResults {
    /// Adds the results of cutting the stock; returns the knowledge about the heads' cuts.
    fn take<const N: usize>(&mut self, cut: Cut<N>) -> [KnownCuts; N] {
        self.verification.findings.extend(cut.findings.into_iter().flatten());
        self.assumptions.extend(cuts_nothing(&cut.report, &cut.cuts));
        self.assumptions.push(Assumption { line: None, text: cut.seen_between });
        cut.between.iter().for_each(|between| between.keep_open(&mut self.verification.between));
        (self.stock, self.rest, self.cuts) = (Some(cut.report), Some(cut.rest), cut.cuts);
        (self.deviation, self.painted) = (cut.deviation, cut.painted);
        cut.known
    }
}

impl VerificationRun<'_> {
    fn one_head(&self, job: &Job) -> Result<RunResults, Failure> {
        let setup = Setup::read(job, self.request.setup)?;
        check_winding(job, &setup, self.request.setup)?;
        let setup = setup.after_programs(job, &Silent)?;
        let scene = Scene::new(job, &setup, self.request.setup)?;
        scene.check_frame_of(self.program, self.request.program)?;
        let at = scene.virtual_setup(self.request.dialect);
        let mut found = self.found(&at, &setup, "")?;
        found.times = self.times(&[(&job.machine, job.tool.gauge_length())], &scene, &mut found);
        let required = RequiredFeeds::of(job, setup.file);
        let [feeds] = self.cut_feeds(required.as_ref(), [(&job.machine, job.tool.gauge_length())], &at);
        let cut = self.request.cut.as_ref();
        let on = HeadView { scene: &scene, at: &at };
        let then = [&*found.verification.findings];
        let cut = cut.map(|cut| self.cut([(&on, &feeds.fast)], then, cut)).transpose()?;
        let known = cut.map(|cut| found.take(cut));
        let [known] = known.map_or([None], |known| known.map(Some));
        self.compare_feeds(required.as_ref(), &[(&feeds, known, "")], &mut found);
        self.measure(&[(job, &at)], &setup, &mut found)?;
        self.place(&at, &mut found.verification)?;
        found.assumptions.extend(open_files(&setup).chain(open_stock(&setup)));
        if setup.planning_stock != (PlanningStock::Own { why: None }) {
            let text = format!("before the program the stock is taken as {}", setup.planning_stock);
            found.assumptions.push(Assumption { line: None, text });
        }
        Ok(found)
    }

    /// Cuts the stock by all heads, and determines which of these blocks of each are cuts; `then`
    /// are each head's findings so far.
    fn cut<const N: usize>(
        &self,
        heads: [(&HeadView<'_>, &[FastBlock]); N],
        then: [&[Finding]; N],
        cut: &CutRequest,
    ) -> Result<Cut<N>, Failure> {
        let settings: [VerifySettings; N] = std::array::from_fn(|h| {
            let (on, fast) = heads[h];
            let probed_lines = fast.iter().map(|block| block.line).collect();
            VerifySettings {
                probed_lines,
                removal: removal_of(on.scene.job, on.scene.setup.file, h),
                ..self.settings()
            }
        });
        let views = std::array::from_fn(|h| (heads[h].0, &settings[h]));
        let done = cut_stock(self.program, views, cut, self.stages)?;
        let (mut deviation, mut painted) = (None, None);
        if let (Some(required), Some((on, _))) = (&cut.deviation, heads.first()) {
            let now = std::iter::once(&done.rest).chain(&done.across);
            let lines: Vec<[&DexelMap; 2]> = done.before.iter().zip(now).map(|(before, now)| [before, now]).collect();
            let held = CutStock {
                program: self.program,
                stamp: &self.stamp,
                heads: &heads.map(|(on, _)| on.at),
                lines: &lines,
                cell: done.report.cell_mm,
                tolerance: cut.tolerance,
                gouge_limit: self.gouge_limit,
            };
            let found = deviation_of(on.scene.job, on.scene.setup, &held, required, self.stages)?;
            (deviation, painted) = (Some(found.0), found.1);
        }
        let accuracy = [done.report.tolerance_mm, done.report.cell_mm];
        let known = std::array::from_fn(|h| KnownCuts::of(&done.runs[h], &done.not_covered[h], accuracy));
        let cuts = blocks_of_heads(&done.runs);
        let mut findings = done.runs.map(|run| run.findings);
        let seen_between = if self.request.fast {
            seen_in_estimate(accuracy[1])
        } else if cut.rest.is_some() {
            seen_of_rest(accuracy[1])
        } else {
            seen_between(&heads.map(|(on, _)| &on.scene.job.tool), accuracy[1], accuracy[0])
        };
        let mut between = Vec::new();
        if cut.rest.is_none() && !self.request.fast {
            between.extend(sub_cell_check(self.program, views, cut, (then, &done.not_covered), self.stages)?);
            let new = between.iter_mut().map(|between| std::mem::take(&mut between.findings));
            findings.iter_mut().zip(new).for_each(|(all, new)| add_between(all, new));
        }
        let (report, rest) = (done.report, done.rest);
        Ok(Cut { known, findings, report, rest, cuts, deviation, painted, seen_between, between })
    }

    fn settings(&self) -> VerifySettings {
        VerifySettings {
            gouge_limit: self.gouge_limit,
            as_cut: self.as_cut,
            is_whole: true,
            estimate: self.request.fast.then(Estimate::default),
            ..VerifySettings::default()
        }
    }

    /// Runs the program for each head, with the other one's tool as it is.
    fn two_heads(&self, job: &Job) -> Result<RunResults, Failure> {
        if uses_rtcp(self.program) {
            let message = "its words are the tip's (RTCP), which machines with two heads do not support";
            return Err(Failure::input(self.request.program, message));
        }
        let seen = [job.seen_by(0, HEADS_APART), job.seen_by(1, HEADS_APART)];
        let machines = [job.seen_by(0, 0.0).machine, job.seen_by(1, 0.0).machine];
        let setups = [Setup::read(&seen[0], self.request.setup)?, Setup::read(&seen[1], self.request.setup)?];
        check_winding(job, &setups[0], self.request.setup)?;
        let scenes = Scene::of_heads(seen.each_ref(), setups.each_ref(), machines.each_ref(), self.request.setup)?;
        let at = scenes.each_ref().map(|scene| scene.virtual_setup(self.request.dialect));
        let of_head = |h: usize| self.found(&at[h], &setups[h], ["head 1", "head 2"][h]);
        let (mut first, mut second) = (of_head(0)?, of_head(1)?);
        let certificates = first.certificates.zip(second.certificates).map(|(a, b)| proven_for_both(&[a, b]));
        let heads = [0, 1].map(|h| (&machines[h], seen[h].tool.gauge_length()));
        let required = RequiredFeeds::of(job, setups[0].file);
        // Words are the axes' own, regardless of the head whose view reads them.
        let feeds = self.cut_feeds(required.as_ref(), heads, &at[0]);
        let on = [0, 1].map(|h| HeadView { scene: &scenes[h], at: &at[h] });
        let views = [(&on[0], &feeds[0].fast[..]), (&on[1], &feeds[1].fast[..])];
        let then = [&*first.verification.findings, &*second.verification.findings];
        let mut cut = self.request.cut.as_ref().map(|cut| self.cut(views, then, cut)).transpose()?;
        // Each finding gets the name of its head, with the rest of that head's findings.
        for (h, found) in [&mut first.verification, &mut second.verification].into_iter().enumerate() {
            found.findings.extend(cut.iter_mut().flat_map(|cut| std::mem::take(&mut cut.findings[h])));
        }
        let verification = merged_runs([first.verification, second.verification], Vec::new());
        let mut found = RunResults::of(verification, certificates);
        let views = [0, 1].map(|h| (&seen[h].machine, seen[h].tool.gauge_length()));
        found.times = self.times(&views, &scenes[0], &mut found);
        let known = cut.map(|cut| found.take(cut)).map_or([None, None], |known| known.map(Some));
        let [first, second] = known;
        let feeds = [(&feeds[0], first, "head 1"), (&feeds[1], second, "head 2")];
        self.compare_feeds(required.as_ref(), &feeds, &mut found);
        self.measure(&[(&seen[0], &at[0]), (&seen[1], &at[1])], &setups[0], &mut found)?;
        self.place(&at[0], &mut found.verification)?;
        found.assumptions.extend(open_files(&setups[0]).chain(open_stock(&setups[0])));
        Ok(found)
    }

    /// Returns the time of the program: for machines as each head sees them, with the lengths of
    /// their tools.
    fn times(&self, views: &[(&Machine, f64)], scene: &Scene<'_>, found: &mut RunResults) -> ProgramTimes {
        let constant = [found.verification.cutting_time_s, found.verification.rapid_time_s];
        if !self.request.time_law {
            return ProgramTimes::constant(constant, vec![NoLawReason::Text("not requested".to_owned())]);
        }
        let _timing = self.stages.start(TIMES, 0);
        let (dialect, rapids) = (self.request.dialect, self.program.rtcp_rapids);
        // A control other than the job's has its own dialect file.
        let control = &if scene.job.post.dialect() == dialect {
            scene.job.post.rules().control_motion.clone()
        } else {
            dialect.file().control_motion
        };
        let lines = match (self.request.section, self.program.blocks.first(), self.program.blocks.last()) {
            (Some(_), Some(first), Some(last)) => first.line..last.line + 1,
            _ => ALL_LINES,
        };
        let written = TimedText { text: self.text, dialect, control, rapids, block_lines: &[], lines };
        let times = times_of_text(views, scene.motion_context(), &written, constant);
        let text = control.assumption().filter(|_| times.no_law_because.is_empty());
        found.assumptions.extend(text.map(|text| Assumption { line: None, text }));
        times
    }

    /// Measures the material that the program leaves on the regions of the job's operations; an
    /// excess over their limits is a finding if the program is to finish them. `on` are the job and
    /// the machine as each head sees them.
    fn measure(
        &self,
        on: &[(&Job, &VirtualSetup<'_>)],
        setup: &Setup<'_>,
        found: &mut RunResults,
    ) -> Result<(), Failure> {
        if self.request.fast {
            return Ok(());
        }
        let settings = self.settings();
        let heads: Vec<RunningHead<'_>> = on.iter().map(|&(_, at)| RunningHead { at, settings: &settings }).collect();
        let Some((job, _)) = on.first() else { return Ok(()) };
        found.remaining = remaining(job, setup, self.program, &heads, self.stages)?;
        found.efficiency = efficiencies_of_text(on, setup, self.program)?;
        if self.request.finishes {
            let last = self.program.blocks.last().map_or(1, |block| block.line);
            found.verification.findings.extend(found.remaining.iter().flat_map(|r| r.report.findings(last)));
        }
        Ok(())
    }

    /// Compares speeds of cuts with the job's, seen by machines with the lengths of their tools.
    fn cut_feeds<const N: usize>(
        &self,
        required: Option<&RequiredFeeds>,
        views: [(&Machine, f64); N],
        at: &VirtualSetup<'_>,
    ) -> [CutFeeds; N] {
        let (words, frame) = (at.words, at.table_from_rtcp_words);
        views.map(|(machine, tool_length)| {
            let at = MotionContext { machine, tool_length, words, frame, work_offset: Some(words.work_offset()) };
            required.map(|required| required.feeds_of_cuts(self.program, at)).unwrap_or_default()
        })
    }

    /// Adds findings where feeds and spindle speeds differ from the job's, and their assumptions,
    /// for the fast blocks of each head, with the knowledge about its cuts, and its name.
    fn compare_feeds(
        &self,
        required: Option<&RequiredFeeds>,
        heads: &[(&CutFeeds, Option<KnownCuts>, &str)],
        found: &mut RunResults,
    ) {
        let Some(required) = required else { return };
        for (feeds, known, head) in heads {
            found.verification.findings.extend(required.findings(self.program, &feeds.fast, known.as_ref(), head));
            found.assumptions.extend(
                required.assumptions(&feeds.fast, known.as_ref()).into_iter().chain(feeds.note(required, head)),
            );
        }
        found.verification.findings.extend(required.other_speeds(self.program));
    }

    /// Adds the machine's position to findings that are made from the text.
    fn place(&self, at: &VirtualSetup<'_>, verification: &mut Verification) -> Result<(), Failure> {
        place_findings(self.program, at, &self.settings(), &mut verification.findings).map_err(not_verified)
    }

    fn found(&self, at: &VirtualSetup<'_>, setup: &Setup<'_>, head: &'static str) -> Result<RunResults, Failure> {
        let settings = self.settings();
        let blocks = self.program.blocks.len();
        let monitor = self.stages.start(if head.is_empty() { "verify program" } else { head }, blocks);
        let mut verification = verify(self.program, at, &settings, &*monitor).map_err(not_verified)?;
        drop(monitor);
        name_obstacles(&mut verification, setup);
        let certificates = self.request.certificates.then(|| {
            let monitor = self.stages.start("certify program", blocks);
            certify(self.program, at, &settings, &*monitor).map_err(not_verified)
        });
        let certificates = certificates.transpose()?;
        Ok(RunResults::of(verification, certificates))
    }
}

/// Returns the largest removal rate of a head's operations in a setup (0 or 1), if each has one.
/// Entries and exits are not slowed down for it, so that up to their speed any rate is permitted.
pub fn removal_of(job: &Job, setup: &SetupFile, head: usize) -> Option<RemovalLimit> {
    let of = |o: &OperationFile| {
        let removal = o.feeds.removal_rate.as_ref()?;
        let slowest = removal.min_mm_min.max(o.feeds.approach_mm_min);
        Some(RemovalLimit { largest: MM3_PER_CM3 * removal.target_cm3_min, slowest })
    };
    let own = job.operations_of(setup).filter(|(_, o)| o.head as usize == head + 1);
    let all: Option<Vec<RemovalLimit>> = own.map(|(_, o)| of(o)).collect();
    let larger = |a: RemovalLimit, b: RemovalLimit| RemovalLimit {
        largest: a.largest.max(b.largest),
        slowest: a.slowest.max(b.slowest),
    };
    all?.into_iter().reduce(larger)
}

const MM3_PER_CM3: f64 = 1000.0;
