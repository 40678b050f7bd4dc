//! `facemill verify`.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args};
use facemill::called_program::CalledProgram;
use facemill::formats::{LeftAtEnd, VerificationFile};
use facemill::job::stock::map::rectangle_with;
use facemill::job_file::STOCK_TOLERANCE;
use facemill::nc_program::Dialect;
use facemill::report::remaining::RemainingReport;
use facemill::report::stock::StockReport;
use facemill::verification::remaining::open_regions::OpenRegion;
use facemill::virtual_machine::{BetweenPositions, EstimatedPositions, FindingKind, Verification};
use facemill::z_map::DexelMap;
use facemill::{
    CutRequest, DeviationRequest, Failure, Job, StockRegion, VerifyRequest, files, read_rest, verify_program,
};
use serde::Serialize;

use crate::cli::arguments::ad_hoc_setup::StandArguments;
use crate::cli::arguments::called_files::expand_in_place;
use crate::cli::arguments::option_lengths::{above_zero, from_zero, stock_tolerance};
use crate::cli::arguments::program::{ProgramArguments, ProgramOfJob, setup_of};
use crate::cli::deviation_command::{deviation_lines, mesh_bytes, painted_mesh, rest_mesh};
use crate::cli::output::findings_table::findings_table;
use crate::cli::output::say;
use crate::cli::progress::Progress;

/// Supported controls, and the default.
const DIALECTS: &str = "Control of the program: fanuc, haas, mazak, linuxcnc, siemens_840d, heidenhain; default: \
                        the job's, fanuc with --part";

#[derive(Args)]
#[command(
    group = ArgGroup::new("run on").args(["job", "part"]).required(true),
    mut_arg("dialect", |argument| argument.help(DIALECTS))
)]
pub(crate) struct VerifyArguments {
    #[command(flatten)]
    program: ProgramArguments,
    #[command(flatten)]
    stand: StandArguments,
    /// Depth of the cutter that is a finding; default: the smallest that the setup's operations
    /// permit, 0.02 with --part
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = from_zero)]
    gouge_mm: Option<f64>,
    /// Prove the motion of every block between its ends
    #[arg(long)]
    certificates: bool,
    /// Only estimate collisions: positions 2 mm apart in cuts and the cutter's radius in rapids,
    /// and only the edges of tool and holder. For a first look; it can miss collisions
    #[arg(long, conflicts_with = "certificates")]
    fast: bool,
    /// Cut the stock on lines so far apart, and test tool assembly, bodies of the machine and
    /// rapids against the stock of every moment
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    stock_cell_mm: Option<f64>,
    /// Tolerance of the cut stock [default: 0.05]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = stock_tolerance)]
    stock_tolerance_mm: Option<f64>,
    /// Part of the stock to cut: whole, operations (the rectangle around the region that the job's
    /// operations cut, enlarged by the cutter's diameter), or X0,Y0,X1,Y1 in mm of the workpiece
    /// frame. Collisions with stock elsewhere are not detected
    #[arg(long, value_name = "PART", default_value = "whole", value_parser = region, allow_hyphen_values = true,
        requires = "stock_cell_mm", conflicts_with = "rest")]
    stock_region: StockRegion,
    /// Also cut lines along x and y of the workpiece frame (tri-dexel): they show walls along z,
    /// and stock that is thin between lines along z, for three times the time and memory.
    /// --rest-out and --rest-mesh write the lines along z
    #[arg(long, requires = "stock_cell_mm", conflicts_with = "rest")]
    stock_across: bool,
    /// Begin with the rest that another program left (--rest-out) in place of the job's stock
    #[arg(long, value_name = "FILE", conflicts_with = "stock_cell_mm")]
    rest: Option<PathBuf>,
    /// Output file for the stock after the program
    #[arg(long, value_name = "FILE")]
    rest_out: Option<PathBuf>,
    /// Output file for the stock after the program as a closed mesh, by its extension .obj, .stl or
    /// .glb
    #[arg(long, value_name = "FILE", value_parser = rest_mesh)]
    rest_mesh: Option<PathBuf>,
    /// Compare the stock after the program with the part, and write the part in colours of the
    /// deviation to this .glb
    #[arg(long, value_name = "FILE", value_parser = painted_mesh)]
    deviation: Option<PathBuf>,
    /// Compare the stock after the program with the part, with this tolerance to both sides;
    /// default with --deviation: the largest height that the setup's operations may leave
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
    deviation_tolerance_mm: Option<f64>,
    /// Setup of the job, by its name or number, that had nothing to cut: it has no part in a
    /// program that changes tools. Can be given several times
    #[arg(long, value_name = "SETUP")]
    without: Vec<String>,
    /// Output file for the results, as JSON
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Largest number of findings in the table; the file has them all.
const SHOWN: usize = 50;

pub(crate) fn run(arguments: &VerifyArguments) -> Result<ExitCode, Failure> {
    crate::cli::progress::watch_interrupts().map_err(Failure::Internal)?;
    let mut read = arguments.program.read_with(&arguments.stand)?;
    let path = &arguments.program.program;
    let called = expand_in_place(&mut read, path)?;
    if read.setups.len() < 2 && !arguments.without.is_empty() {
        return Err(Failure::input(path, "--without is for a program of several tools, in a job with several"));
    }
    if read.setups.len() > 1 {
        return run_sections(arguments, read, called.as_ref());
    }
    let ProgramOfJob { job, setup, dialect, text, .. } = read;
    let rest = arguments.rest.as_ref().map(|path| read_rest(&job, setup, path)).transpose()?;
    let request = request_of(arguments, (setup, None), cut_of(arguments, rest)?, dialect);
    check_outputs(arguments)?;
    let mut verified = verify_program(&job, &text, &request, &Progress::new(false))?;
    verified.complete(arguments.stand.assumptions(arguments.program.dialect));
    if let Some(called) = &called {
        called.complete(&mut verified.file);
    }
    let file = &verified.file;
    let clean = is_clean(file);
    let text = verification_text(file);
    let outputs = outputs(arguments, &verified.file, (verified.rest, verified.painted))?;
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_each(&outputs)?;
    say(&text)?;
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn check_outputs(arguments: &VerifyArguments) -> Result<(), Failure> {
    let paths = [&arguments.out, &arguments.rest_mesh, &arguments.rest_out, &arguments.deviation];
    files::check_outputs(paths.into_iter().flatten().map(PathBuf::as_path))
}

/// Returns whether a verified program has no fault.
fn is_clean(file: &VerificationFile) -> bool {
    is_clean_but_left(file) && file.verification.faults().next().is_none()
}

/// Returns whether a verified part has no fault but material that later parts may cut.
fn is_clean_but_left(file: &VerificationFile) -> bool {
    let gouged = file.deviation.as_ref().is_some_and(|d| d.exceeds_gouge_limit);
    file.verification.faults().all(|finding| finding.kind == FindingKind::Excess) && !gouged
}

/// Returns the setups of a program's clamping that have no part in it.
///
/// # Errors
/// If one is none of them.
fn without_part(arguments: &VerifyArguments, job: &Job, setups: Range<usize>) -> Result<BTreeSet<usize>, Failure> {
    let of = |name: &String| {
        let setup = setup_of(job, Some(name))?;
        let is_own = Some(setup).filter(|setup| setups.contains(setup));
        is_own.ok_or_else(|| job.wrong(format!("--without {name}: is no setup of this program's tools")))
    };
    arguments.without.iter().map(of).collect()
}

/// Verifies a program that changes tools: the part behind each change with its tool, on what the
/// parts before it leave.
fn run_sections(
    arguments: &VerifyArguments,
    read: ProgramOfJob,
    called: Option<&CalledProgram>,
) -> Result<ExitCode, Failure> {
    let ProgramOfJob { mut job, setups, dialect, text, .. } = read;
    let path = &arguments.program.program;
    check_outputs(arguments)?;
    if arguments.stock_across {
        return Err(Failure::input(path, "--stock-across is for the program of one tool; choose it with --setup"));
    }
    let program = job.read_program(&text, dialect).map_err(|e| Failure::input(path, e))?;
    let sections = job.parts_of(&program, setups.start);
    let region = match arguments.stock_region {
        StockRegion::Operations => {
            rectangle_with(&job, None, setups.clone())?.map_or(StockRegion::Operations, StockRegion::Rectangle)
        }
        region => region,
    };
    let mut rest = arguments.rest.as_ref().map(|rest| read_rest(&job, setups.start, rest)).transpose()?;
    // Whether each part so far ran with its own tool, and none was missing.
    let (mut is_whole, mut painted) = (true, None);
    let (mut texts, mut results, mut clean) = (String::new(), Vec::new(), true);
    let without = without_part(arguments, &job, setups.clone())?;
    let has_part = |setup: &usize| !without.contains(setup);
    let mut next = setups.start;
    let mut open: Vec<(usize, Vec<OpenRegion>)> = Vec::new();
    for (k, section) in sections.iter().enumerate() {
        // Without a setup of its tool the part is run as that of the next one, and its tool is a
        // finding.
        let tool = section.called_tool();
        let mut left = (next..setups.end).filter(has_part);
        let first = left.clone().next();
        let own = left.find(|&s| Some(job.for_setup(s).tool.number()) == tool);
        is_whole &= own.is_some() || tool.is_none();
        let Some(setup) = own.or(first) else {
            texts += &format!("tool change {} of {}: A TOOL TOO MANY, T{}\n", k + 1, sections.len(), tool.unwrap_or(0));
            clean = false;
            break;
        };
        for skipped in next..setup {
            if has_part(&skipped) {
                texts += &format!("no tool change for \"{}\": A TOOL IS MISSING\n", job.file.setups[skipped].name);
                (clean, is_whole) = (false, false);
            }
            job.programs.add(skipped, None, dialect);
        }
        next = setup + 1;
        is_whole &= k + 1 < sections.len() || !(next..setups.end).any(|missing| has_part(&missing));
        let mut cut = cut_of(arguments, rest.take())?;
        if let Some(cut) = &mut cut {
            if cut.rest.is_none() {
                cut.region = region;
            }
            // The stock behind the last part is compared with the part; all that the setup's own
            // stock lost counts as cut.
            let compared = cut.deviation.take().filter(|_| is_whole && k + 1 == sections.len());
            cut.deviation = compared.map(|compared| DeviationRequest { since_stock: true, ..compared });
        }
        let request = request_of(arguments, (setup, Some(k)), cut, dialect);
        let mut verified = verify_program(&job, &text, &request, &Progress::new(false))?;
        verified.complete(arguments.stand.assumptions(arguments.program.dialect));
        if let Some(called) = called {
            called.complete(&mut verified.file);
        }
        clean &= is_clean_but_left(&verified.file);
        if let Some(sweeps) = verified.sweeps.take() {
            // All parts are cut in one workpiece frame.
            for region in open.iter_mut().flat_map(|(_, regions)| regions) {
                region.lower(&job.file.setups[setup].name, None, |on| sweeps.heights(on))?;
            }
        }
        open.push((setup, std::mem::take(&mut verified.open_regions)));
        texts += &verification_text(&verified.file);
        results.push(verified.file);
        (rest, painted) = (verified.rest, verified.painted);
        job.programs.add_section(setup, (path.clone(), text.clone()), dialect, k);
    }
    for missing in (next..setups.end).filter(has_part) {
        texts += &format!("no tool change for \"{}\": A TOOL IS MISSING\n", job.file.setups[missing].name);
        clean = false;
    }
    let at_end = |(setup, regions): &(usize, Vec<OpenRegion>)| {
        regions.iter().map(|region| region.at_end(&job.file.setups[*setup].name)).collect::<Vec<_>>()
    };
    let left: Vec<LeftAtEnd> = open.iter().flat_map(at_end).collect();
    if !left.is_empty() {
        texts += "left after all parts, of operations whose own parts leave more than their limits:\n";
    }
    for left in &left {
        texts += &format!("  {}: {}\n", if left.is_kept() { "finished" } else { "NOT FINISHED" }, left.in_words());
        clean &= left.is_kept();
    }
    if !is_whole {
        // What the programs leave together is not known.
        (rest, painted) = (None, None);
        let of_stock = [
            ("--rest-out", arguments.rest_out.is_some()),
            ("--rest-mesh", arguments.rest_mesh.is_some()),
            ("--deviation", arguments.deviation.is_some()),
            ("--deviation-tolerance-mm", arguments.deviation_tolerance_mm.is_some()),
        ];
        for (option, _) in of_stock.into_iter().filter(|(_, is_requested)| *is_requested) {
            texts += &format!("{option}: NOT DONE, as the parts are not those of the job's tools\n");
        }
    }
    let made = outputs(arguments, &results, (rest, painted))?;
    if !crate::cli::progress::start_writing() {
        return Err(Failure::Interrupted);
    }
    files::write_each(&made)?;
    say(&texts)?;
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Returns the request for the program of a setup, or for its part behind a tool change.
fn request_of<'a>(
    arguments: &'a VerifyArguments,
    (setup, section): (usize, Option<usize>),
    cut: Option<CutRequest>,
    dialect: Dialect,
) -> VerifyRequest<'a> {
    VerifyRequest {
        setup,
        section,
        gouge_limit: arguments.gouge_mm.or_else(|| arguments.stand.gouge_limit()),
        certificates: arguments.certificates,
        time_law: !arguments.fast,
        fast: arguments.fast,
        cut,
        ..VerifyRequest::new(&arguments.program.program, dialect)
    }
}

/// Returns all requested files in full: one that cannot be made must not leave others behind.
fn outputs<'a>(
    arguments: &'a VerifyArguments,
    results: &impl Serialize,
    (rest, painted): (Option<DexelMap>, Option<Vec<u8>>),
) -> Result<Vec<(&'a Path, Vec<u8>)>, Failure> {
    let mut outputs: Vec<(&Path, Vec<u8>)> = Vec::new();
    if let Some(out) = &arguments.out {
        outputs.push((out, facemill::file_format::to_json(results).into_bytes()));
    }
    if let (Some(out), Some(rest)) = (&arguments.rest_mesh, &rest) {
        outputs.push((out, mesh_bytes(out, rest)?));
    }
    if let (Some(out), Some(rest)) = (&arguments.rest_out, rest) {
        outputs.push((out, rest.to_bytes()));
    }
    if let (Some(out), Some(painted)) = (&arguments.deviation, painted) {
        outputs.push((out, painted));
    }
    Ok(outputs)
}

/// Returns the options on stock.
fn cut_of(arguments: &VerifyArguments, rest: Option<DexelMap>) -> Result<Option<CutRequest>, Failure> {
    let tolerance = arguments.stock_tolerance_mm.unwrap_or(STOCK_TOLERANCE);
    let is_compared = arguments.deviation.is_some() || arguments.deviation_tolerance_mm.is_some();
    let deviation = is_compared.then_some(DeviationRequest {
        tolerance: arguments.deviation_tolerance_mm,
        painted: arguments.deviation.is_some(),
        since_stock: arguments.program.has_programs_before(),
    });
    if let Some(rest) = rest {
        let cell = rest.grid().cell();
        return Ok(Some(CutRequest { rest: Some(rest), deviation, ..CutRequest::on_lines(cell, tolerance) }));
    }
    if arguments.stock_across && arguments.stock_region != StockRegion::Whole {
        let message = "--stock-across cuts all of the stock: leave out --stock-region, or --stock-across";
        return Err(Failure::input(&arguments.program.program, message));
    }
    if let Some(cell) = arguments.stock_cell_mm {
        return Ok(Some(CutRequest {
            region: arguments.stock_region,
            across: arguments.stock_across,
            across_walls: arguments.stock_region == StockRegion::Whole,
            deviation,
            ..CutRequest::on_lines(cell, tolerance)
        }));
    }
    let needing = [
        ("--rest-out", arguments.rest_out.is_some()),
        ("--rest-mesh", arguments.rest_mesh.is_some()),
        ("--deviation", arguments.deviation.is_some()),
        ("--deviation-tolerance-mm", is_compared),
        ("--stock-tolerance-mm", arguments.stock_tolerance_mm.is_some()),
    ];
    match needing.iter().find(|(_, is_there)| *is_there) {
        Some((option, _)) => {
            let message = format!("{option} needs --stock-cell-mm or --rest: without them no stock is cut");
            Err(Failure::input(&arguments.program.program, message))
        }
        None => Ok(None),
    }
}

/// Returns the part of the stock by name or corners.
fn region(text: &str) -> Result<StockRegion, String> {
    match text {
        "whole" => return Ok(StockRegion::Whole),
        "operations" => return Ok(StockRegion::Operations),
        _ => {}
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 && [x0, y0, x1, y1].iter().all(|v| v.is_finite()) => {
            Ok(StockRegion::Rectangle([[x0, y0], [x1, y1]]))
        }
        _ => Err("must be whole, operations, or X0,Y0,X1,Y1 in mm with X0 below X1 and Y0 below Y1".to_owned()),
    }
}

fn verification_text(file: &VerificationFile) -> String {
    let v: &Verification = &file.verification;
    let mut lines = vec![format!("{} - {}, read as {}", file.job, file.setup, file.dialect)];
    lines.extend(v.estimate.as_ref().map(estimate_lines));
    lines.extend([format!(
        "  blocks            {} with a motion, cutting length {:.1} m",
        v.n_blocks,
        v.cutting_length_mm / 1000.0
    )]);
    lines.extend(file.times.summary_lines());
    lines.extend([
        match &v.largest_gouge {
            Some(g) => format!(
                "  largest gouge     {:.3} mm in {}, line {}; allowed {:.3} mm",
                g.depth_mm, g.obstacle, g.line, file.gouge_limit_mm
            ),
            None => format!("  largest gouge     none; allowed {:.3} mm", file.gouge_limit_mm),
        },
        match &v.smallest_clearance {
            Some(c) => {
                format!("  smallest clearance {:.3} mm ({} and {}, line {})", c.distance_mm, c.body, c.obstacle, c.line)
            }
            None => "  smallest clearance none".to_owned(),
        },
    ]);
    lines.extend(v.wind_up.iter().filter(|w| w.turns > 1.0).map(|w| format!("  wind-up           {w}")));
    lines.extend(v.between.as_ref().map(between_lines));
    lines.extend(file.stock.iter().flat_map(StockReport::summary_lines));
    lines.extend(file.remaining.iter().flat_map(RemainingReport::summary_lines));
    lines.extend(file.efficiency.iter().map(|e| e.summary_line(file.efficiency.len() > 1)));
    lines.extend(file.deviation.as_ref().map(deviation_lines).unwrap_or_default());
    if let Some(c) = &file.certificates {
        lines.push(format!("  certified blocks  {} of {}", c.certified, c.blocks));
        lines.extend(c.uncertified().next().map(|first| {
            let why = first.reason.as_deref().unwrap_or_default();
            format!("    NOT PROVEN       {} blocks, first in line {}: {why}", c.blocks - c.certified, first.line)
        }));
    }
    lines.push(format!("  assumptions       {}", file.assumptions.len()));
    lines.extend(file.assumptions.iter().map(|a| format!("    {a}")));
    lines.push(format!("  findings          {}", v.findings.len()));
    let shown = &v.findings[..v.findings.len().min(SHOWN)];
    lines.extend(findings_table(shown).into_iter().map(|line| format!("    {line}")));
    if v.findings.len() > SHOWN {
        lines.push(format!("    and {} more; --out writes them all", v.findings.len() - SHOWN));
    }
    lines.join("\n") + "\n"
}

fn between_lines(between: &BetweenPositions) -> String {
    let BetweenPositions { cutter_mm, bodies_mm, open_blocks, first_open_line } = between;
    let known = format!("  between positions cutter within {cutter_mm:.3} mm, bodies within {bodies_mm:.3} mm");
    match first_open_line {
        Some(line) => format!("{known}; UNKNOWN on {open_blocks} blocks, first in line {line}"),
        None => known,
    }
}

fn estimate_lines(positions: &EstimatedPositions) -> String {
    let EstimatedPositions { cut_step_mm, rapid_step_mm } = positions;
    format!(
        "  AN ESTIMATE       nothing is proven between positions, {cut_step_mm} mm apart in cuts and {rapid_step_mm} mm in rapids, nor \
         between edges"
    )
}

#[cfg(test)]
#[path = "../../tests/unit/cli/verify_command.rs"]
mod tests;
