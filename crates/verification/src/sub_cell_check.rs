//! Collisions with the stock below the resolution of its lines.

use facemill_job::failure::Failure;
use facemill_job::load::job::Job;
use facemill_job::setup::programs_before::{each_program_before, not_run};
use facemill_job::stages::{LOOK, Stages};
use facemill_job::stock::map::StockMeshes;
use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{
    BetweenPositions, Finding, FindingKind, HeldAsCut, Verification, VerifySettings, certain_depth, is_known_to_cut,
    remaining_collisions, unresolved_findings, verify,
};

use crate::named_results::{name_obstacles, not_verified};
use crate::stock_run::{CutRequest, HeadView};

/// Additional results of a head's run against the whole initial stock, for a run that leaves the
/// stock to the cutting runs.
pub struct SubCellResult {
    /// Findings that cannot be ruled out against the remaining stock.
    pub findings: Vec<Finding>,
    /// Bounds between the positions of all bodies that move near the initial stock.
    pub positions: Option<BetweenPositions>,
}

impl SubCellResult {
    /// Counts also the blocks without bounds between positions near the stock.
    pub fn keep_open(&self, known: &mut Option<BetweenPositions>) {
        let (Some(known), Some(positions)) = (known, &self.positions) else { return };
        known.open_blocks = known.open_blocks.max(positions.open_blocks);
        let lines = [known.first_open_line, positions.first_open_line];
        known.first_open_line = lines.into_iter().flatten().min();
    }
}

/// Returns the collisions with the initial stock of tool bodies, machine bodies and the cutter in
/// rapid that cannot be ruled out against the remaining stock, per head, without those known to
/// meet the remaining stock. `then` are the findings of each head without the initial stock;
/// `not_covered` are the lines of the blocks on which its tool may reach stock without lines: all
/// of it counts as remaining there. For bodies of the machine it counts so wherever there are no
/// lines.
///
/// # Errors
/// As for [`cut_stock`](crate::stock_run::cut_stock).
pub fn sub_cell_check<const N: usize>(
    program: &ReadProgram,
    heads: [(&HeadView<'_>, &VerifySettings); N],
    cut: &CutRequest,
    (then, not_covered): ([&[Finding]; N], &[Vec<u32>; N]),
    stages: &dyn Stages,
) -> Result<[SubCellResult; N], Failure> {
    let mut queried = [const { Vec::new() }; N];
    let mut found = Vec::with_capacity(N);
    for (h, (on, settings)) in heads.into_iter().enumerate() {
        // Every finding deep enough to be detected between the lines needs a check.
        let at_first = VerifySettings {
            as_cut: HeldAsCut::NOTHING,
            probed_lines: Vec::new(),
            gouge_limit: 0.0,
            sections: Vec::new(),
            ..settings.clone()
        };
        let run = run("verify against all of the stock", program, (on, &at_first), stages)?;
        queried[h] = unresolved_findings(on.at, &run.findings, then[h]);
        let is_beside = |f: &&Finding| not_covered[h].iter().any(|line| (f.first_line..=f.last_line).contains(line));
        let beside = queried[h].iter().filter(|f| !is_of_machine(f)).filter(is_beside);
        found.push(SubCellResult { findings: beside.cloned().collect(), positions: run.between });
    }
    let left = left_between(program, heads, cut, queried, stages)?;
    found.iter_mut().zip(left).for_each(|(found, left)| found.findings.extend(left));
    found.try_into().map_err(|_| Failure::Internal("a head without a run".to_owned()))
}

/// Removes collisions of machine bodies with the initial stock from the heads' runs if that stock
/// is known to be cut by then, and adds those that cannot be ruled out against the remaining stock.
/// The region is that of the lines. Returns whether there were any to check, and the remaining
/// stock is known.
///
/// # Errors
/// As for [`cut_stock`](crate::stock_run::cut_stock).
pub fn hold_machine_as_cut<const N: usize>(
    program: &ReadProgram,
    heads: [(&HeadView<'_>, &VerifySettings); N],
    cut: &CutRequest,
    mut at_first: [&mut Verification; N],
    stages: &dyn Stages,
) -> Result<bool, Failure> {
    let of_machine = |on: &HeadView<'_>, found: &[Finding], known: &[Finding]| -> Vec<Finding> {
        unresolved_findings(on.at, found, known).into_iter().filter(is_of_machine).collect()
    };
    let is_met = heads.iter().zip(&at_first).any(|((on, _), run)| !of_machine(on, &run.findings, &[]).is_empty());
    if !is_met || !is_cut_known(&tools(&heads), cut.cell, cut.tolerance) {
        return Ok(false);
    }
    let mut queried = [const { Vec::new() }; N];
    for ((queried, at_first), (on, settings)) in queried.iter_mut().zip(&mut at_first).zip(heads) {
        let as_cut = HeldAsCut { machine: true, ..settings.as_cut };
        let without = VerifySettings { as_cut, ..settings.clone() };
        let then = run("verify without the stock", program, (on, &without), stages)?;
        *queried = of_machine(on, &at_first.findings, &then.findings);
        let news = of_machine(on, &then.findings, &at_first.findings);
        at_first.findings.retain(|f| !queried.contains(f));
        at_first.findings.extend(news);
    }
    let left = left_between(program, heads, cut, queried, stages)?;
    at_first.into_iter().zip(left).for_each(|(at_first, left)| add_between(&mut at_first.findings, left));
    Ok(true)
}

/// Returns whether a finding to check is of a body of the machine rather than the tool.
fn is_of_machine(finding: &Finding) -> bool {
    matches!(finding.kind, FindingKind::Collision | FindingKind::NearMiss)
}

fn run(
    what: &'static str,
    program: &ReadProgram,
    (on, settings): (&HeadView<'_>, &VerifySettings),
    stages: &dyn Stages,
) -> Result<Verification, Failure> {
    let monitor = stages.start(what, program.blocks.len());
    let mut run = verify(program, on.at, settings, &*monitor).map_err(not_verified)?;
    name_obstacles(&mut run, on.scene.setup);
    Ok(run)
}

/// Returns the findings to check of each head that cannot be ruled out against the remaining stock.
fn left_between<const N: usize>(
    program: &ReadProgram,
    heads: [(&HeadView<'_>, &VerifySettings); N],
    cut: &CutRequest,
    queried: [Vec<Finding>; N],
    stages: &dyn Stages,
) -> Result<[Vec<Finding>; N], Failure> {
    let is_queried =
        queried.iter().any(|queried| !queried.is_empty()) && is_cut_known(&tools(&heads), cut.cell, cut.tolerance);
    let Some((on, _)) = heads.first().filter(|_| is_queried) else { return Ok([const { Vec::new() }; N]) };
    let monitor = stages.start(LOOK, program.blocks.len());
    let mut outside = StockMeshes::of(on.scene.setup).outside(on.scene.job, on.scene.setup, cut.cell, cut.region)?;
    each_program_before(on.scene.job, on.scene.setup, 0, |before| {
        if before.fault.is_none() && is_known_to_cut(before.at.tool.cutter(), cut.cell, cut.tolerance) {
            let head = [(&before.at, &VerifySettings::default(), Vec::new())];
            remaining_collisions(&before.text, head, &mut outside, cut.tolerance, &*monitor)
                .map_err(|e| not_run(before.path, e))?;
        }
        Ok(())
    })?;
    let mut queried = queried.into_iter();
    let views = heads.map(|(on, settings)| (on.at, settings, queried.next().unwrap_or_default()));
    remaining_collisions(program, views, &mut outside, cut.tolerance, &*monitor).map_err(not_verified)
}

/// Adds the findings between the lines, except those whose blocks have a finding on the same bodies
/// in the stock already.
pub fn add_between(findings: &mut Vec<Finding>, between: Vec<Finding>) {
    let is_known = |f: &Finding| {
        let alike = |k: &&Finding| (k.kind, &k.body, &k.obstacle) == (f.kind, &f.body, &f.obstacle);
        findings.iter().filter(alike).any(|k| k.first_line <= f.first_line && f.last_line <= k.last_line)
    };
    let new: Vec<Finding> = between.into_iter().filter(|f| !is_known(f)).collect();
    findings.extend(new);
    findings.sort_by_key(|f| (f.first_line, f.kind));
}

/// Returns which bodies a cut tests against the stock at that time: bodies of the machine, too, if
/// all its possible remains are known.
pub fn held_as_cut(job: &Job, cut: &CutRequest) -> HeldAsCut {
    let tools: Vec<&ToolAssembly> =
        [&job.tool].into_iter().chain(job.second.as_ref().map(|second| &second.tool)).collect();
    HeldAsCut { tool: true, machine: cut.rest.is_none() && is_cut_known(&tools, cut.cell, cut.tolerance) }
}

fn tools<'a, const N: usize>(heads: &[(&HeadView<'a>, &VerifySettings); N]) -> [&'a ToolAssembly; N] {
    heads.map(|(on, _)| &on.scene.job.tool)
}

/// Returns whether the removal of all these tools between the lines is known.
pub fn is_cut_known(tools: &[&ToolAssembly], cell: f64, tolerance: f64) -> bool {
    tools.iter().all(|tool| is_known_to_cut(tool.cutter(), cell, tolerance))
}

/// Stock for bodies of the machine if the remains between the lines are unknown.
const MACHINE_AT_FIRST: &str = "bodies of the machine are tested against the initial stock";

/// Describes the check between the lines of stock that began as the rest of another program.
pub fn seen_of_rest(cell: f64) -> String {
    format!(
        "the rest that the stock began as is taken to have no material between its lines, {cell} mm apart; {MACHINE_AT_FIRST}"
    )
}

/// Describes the check between the lines of cut stock by an estimate.
pub fn seen_in_estimate(cell: f64) -> String {
    format!("the fast mode does not search between the lines of the stock, {cell} mm apart; {MACHINE_AT_FIRST}")
}

/// Describes the test of machine bodies in a plan that avoids the initial stock.
pub fn machine_as_cut(cell: f64, tolerance: f64) -> String {
    format!(
        "bodies of the machine that meet the initial stock are tested against all that may remain of it at that time, on lines {cell} mm \
         apart and within {tolerance} mm"
    )
}

/// Describes the check between the lines of cut stock by these tools.
pub fn seen_between(tools: &[&ToolAssembly], cell: f64, tolerance: f64) -> String {
    if !is_cut_known(tools, cell, tolerance) {
        return format!(
            "between the lines of the stock, {cell} mm apart, collisions are not detected: the flute is too short; reduce the \
             distance of the lines; {MACHINE_AT_FIRST}"
        );
    }
    let depth = certain_depth(cell, tolerance);
    format!(
        "between the lines of the stock, {cell} mm apart, cutter and sections of the tool are detected if stock is more than {depth:.2} mm below \
         their surface; their parts thinner than {:.2} mm are not checked there; bodies of the machine are tested against all that may \
         be left",
        2.0 * depth
    )
}
