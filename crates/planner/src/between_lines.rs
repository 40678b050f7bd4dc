//! What meets the stock where the lines that it is cut on do not show it.

use facemill_nc_program::ReadProgram;
use facemill_tool_model::ToolAssembly;
use facemill_virtual_machine::{
    Finding, VerifySettings, certain_depth, in_question, is_known_to_cut, still_there, verify,
};

use crate::output::{name_obstacles, not_verified};
use crate::stock_map::StockMeshes;
use crate::verify_stock::{CutRequest, Stand};
use crate::{Failure, Stages};

/// Of tool bodies and the cutter in rapid that meet the stock as it was at first, and are not known to meet what is left of it, those
/// that are not proven to be free of that: of each head. `then` is what is found of each without the stock at first, `not_covered` the
/// lines of the blocks on which it may reach stock that has no lines: there all of it counts as left.
///
/// # Errors
/// As of [`cut_stock`](crate::verify_stock::cut_stock).
pub(crate) fn between_lines<const N: usize>(
    program: &ReadProgram,
    heads: [(&Stand<'_>, &VerifySettings); N],
    cut: &CutRequest,
    (then, not_covered): ([&[Finding]; N], &[Vec<u32>; N]),
    stages: &dyn Stages,
) -> Result<[Vec<Finding>; N], Failure> {
    let mut asked = [const { Vec::new() }; N];
    for ((asked, (on, settings)), then) in asked.iter_mut().zip(heads).zip(then) {
        // Whatever is deep enough to be found between the lines is in question.
        let at_first = VerifySettings {
            stock_is_cut: false,
            probed_lines: Vec::new(),
            gouge_limit: 0.0,
            sections: Vec::new(),
            ..(*settings).clone()
        };
        let monitor = stages.start("verify against all of the stock", program.blocks.len());
        let mut run = verify(program, on.at, &at_first, &*monitor).map_err(not_verified)?;
        name_obstacles(&mut run, on.setup);
        *asked = in_question(&run.findings, then);
    }
    let mut found: [Vec<Finding>; N] = std::array::from_fn(|h| {
        let is_beside = |f: &&Finding| not_covered[h].iter().any(|line| (f.first_line..=f.last_line).contains(line));
        asked[h].iter().filter(is_beside).cloned().collect()
    });
    let is_asked = asked.iter().any(|asked| !asked.is_empty()) && is_cut_known(&tools(&heads), cut.cell, cut.tolerance);
    let Some((on, _)) = heads.first().filter(|_| is_asked) else { return Ok(found) };
    let monitor = stages.start("look between the lines", program.blocks.len());
    let mut outside = StockMeshes::of(on.setup).outside(on.job, on.setup, cut.cell, cut.region)?;
    let mut asked = asked.into_iter();
    let views = heads.map(|(on, settings)| (on.at, settings, asked.next().unwrap_or_default()));
    let between = still_there(program, views, &mut outside, cut.tolerance, &*monitor).map_err(not_verified)?;
    found.iter_mut().zip(between).for_each(|(found, between)| found.extend(between));
    Ok(found)
}

/// Adds what was found between the lines, but for what is told of all of these blocks already, of the same bodies in the stock.
pub(crate) fn add_between(findings: &mut Vec<Finding>, between: Vec<Finding>) {
    let is_told = |f: &Finding| {
        let alike = |k: &&Finding| (k.kind, &k.body, &k.obstacle) == (f.kind, &f.body, &f.obstacle);
        findings.iter().filter(alike).any(|k| k.first_line <= f.first_line && f.last_line <= k.last_line)
    };
    let new: Vec<Finding> = between.into_iter().filter(|f| !is_told(f)).collect();
    findings.extend(new);
    findings.sort_by_key(|f| (f.first_line, f.kind));
}

fn tools<'a, const N: usize>(heads: &[(&Stand<'a>, &VerifySettings); N]) -> [&'a ToolAssembly; N] {
    heads.map(|(on, _)| &on.job.tool)
}

/// Whether of all of these tools it is known what they take between the lines.
fn is_cut_known(tools: &[&ToolAssembly], cell: f64, tolerance: f64) -> bool {
    tools.iter().all(|tool| is_known_to_cut(tool.cutter(), cell, tolerance))
}

/// What is seen between the lines of stock that began as the rest of another program.
pub(crate) fn seen_of_rest(cell: f64) -> String {
    format!("of the rest that the stock began as, nothing is left between its lines, {cell} mm apart")
}

/// What is seen between the lines of cut stock by these tools.
pub(crate) fn seen_between(tools: &[&ToolAssembly], cell: f64, tolerance: f64) -> String {
    if !is_cut_known(tools, cell, tolerance) {
        return format!(
            "between the lines of the stock, {cell} mm apart, nothing is seen: the flute is too short for it; take a smaller \
             distance of the lines"
        );
    }
    let depth = certain_depth(cell, tolerance);
    format!(
        "between the lines of the stock, {cell} mm apart, cutter and sections of the tool are found that go deeper than {depth:.2} mm below \
         their surface into it; what of them is thinner than {:.2} mm is not asked there",
        2.0 * depth
    )
}
