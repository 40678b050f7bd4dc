//! Lengths that nothing asks more of.

use facemill_cl_data::Monitor;
use facemill_nc_program::{ReadProgram, WordMap};
use facemill_tool_model::{AssemblyLength, Lengths, OpenAssembly, ToolAssembly};
use facemill_z_map::DexelMap;

use super::mesh_needs::mesh_needs;
use super::needs::{ForcedBy, Needs, Raise};
use super::posted::{posted_for_length, words_of_length};
use super::stock_needs::{StockNeeds, tool_of};
use crate::motion::moves::resolve;
use crate::motion::setup;
use crate::motion::setup::{HeldAsCut, VerifyError, VerifySettings, VirtualSetup};
use crate::run::scene::RunScene;

/// How lengths are searched for.
#[derive(Clone, Debug, PartialEq)]
pub struct LengthSettings {
    /// As the program is verified.
    pub verify: VerifySettings,
    /// Addition of a forced length to the least free one, mm.
    pub margin: f64,
    /// Length that none goes beyond, mm.
    pub longest: f64,
}

/// The stock, where it is cut as the program goes.
#[derive(Clone, Copy, Debug)]
pub struct LengthStock<'a> {
    /// As it is before the program.
    pub before: &'a DexelMap,
    /// As in [`run_stock`](crate::stock::run::run_stock), mm.
    pub tolerance: f64,
}

/// The lengths that a program needs.
#[derive(Clone, Debug)]
pub struct ClearLengths {
    /// L1 to L4 with their margin, mm.
    pub lengths: Lengths,
    /// The least L1 to L4 at which the run is free, mm; of those that nothing forces, and of those
    /// that rest on a longer one below them, that are as `lengths`.
    pub least: Lengths,
    /// Cause of each; `None` for those that rest on the one below, or on the tool itself.
    pub forced_by: [Option<ForcedBy>; 4],
    /// The length that nothing up to the longest is free with, and where; the lengths then are
    /// those that it was tried with.
    pub hopeless: Option<(AssemblyLength, ForcedBy)>,
    /// The tool with these lengths.
    pub tool: ToolAssembly,
    /// The words of the setup with its length.
    pub words: WordMap,
    /// The program as it is posted for it.
    pub program: ReadProgram,
}

/// The shortest lengths of an assembly with which a program that was read from NC text collides
/// with nothing, and a margin above them. The tip's way is that of the program with the setup's own
/// tool.
///
/// - At the positions of [`verify`](crate::run::verify::verify), no body of the assembly, and none
///   of the machine that goes up with it, is nearer to an obstacle than `verify` allows; least to
///   within 0.01 mm.
/// - With a stock, no body of the assembly meets it as [`run_stock`](crate::stock::run::run_stock)
///   holds them, cut by a flute of the returned length. The flute is halved between lengths that
///   were tried, the others are taken up way by way: with stock that hangs over the tool a shorter
///   one may be free, too.
/// - Lengths with their margin have been tried as such. Where one is forced, a shorter one by more
///   than the margin is not free.
///
/// Contacts of the cutter itself, limits of axes and speeds are not part of it:
/// [`verify`](crate::run::verify::verify) reports them for the returned tool. Bodies of the machine
/// that move against the workpiece as its linear axes do are taken at their places with the length
/// of each run.
///
/// The result does not depend on the number of threads; the monitor may cancel.
///
/// # Errors
/// When the setup or a setting makes no sense, the machine has several heads, or no three linear
/// axes that hold the tip, or the monitor cancels.
pub fn clear_lengths(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    assembly: &OpenAssembly,
    stock: Option<LengthStock<'_>>,
    settings: &LengthSettings,
    monitor: &dyn Monitor,
) -> Result<ClearLengths, VerifyError> {
    check(setup, stock, settings)?;
    let as_cut = HeldAsCut { tool: stock.is_some(), machine: false };
    let verify = VerifySettings { as_cut, ..settings.verify.clone() };
    let search = Search { program, setup, assembly, stock, settings, verify, monitor };
    let mut lengths = [0.0; 4];
    assembly.rest(&mut lengths);
    let mut found = GrownLengths { lengths, least: lengths, by: Default::default(), hopeless: None };
    search.grow(&mut found)?;
    search.lengths_of(found)
}

fn check(
    setup: &VirtualSetup<'_>,
    stock: Option<LengthStock<'_>>,
    settings: &LengthSettings,
) -> Result<(), VerifyError> {
    setup::check(setup, &settings.verify)?;
    let at_least_0 = |v: f64| v >= 0.0 && v.is_finite();
    for (field, value) in [("margin", settings.margin), ("longest", settings.longest)] {
        if !at_least_0(value) {
            return Err(VerifyError::Setting { field, value, needed: "at least 0" });
        }
    }
    if let Some(tolerance) = stock.map(|s| s.tolerance).filter(|t| !(*t > 0.0 && t.is_finite())) {
        return Err(VerifyError::Setting { field: "tolerance", value: tolerance, needed: "above 0" });
    }
    if setup.machine.head_count() > 1 {
        return Err(VerifyError::Tool { problem: "lengths of machines with several heads are not known".to_owned() });
    }
    let home = setup.machine.home();
    let tip = setup.machine.cl_point(&home, setup.tool.gauge_length()).tip;
    if setup.machine.with_tip_at(&home, &tip, 0.0).is_none() {
        let problem =
            "the machine has no three linear axes that hold the tip where it is with another length".to_owned();
        return Err(VerifyError::Tool { problem });
    }
    Ok(())
}

/// Runs through the program, each with the lengths that the one before needs. Every run but the
/// last takes a length up; with more than these two obstacles raise each other's lengths without an
/// end.
const MAX_RUNS: usize = 60;

/// How much longer than needed a flute may be, mm.
const RESOLUTION: f64 = 5e-3;

/// By how much two lengths may differ and be the same, mm: rounding of sums.
const SAME: f64 = 1e-9;

struct Search<'s, 'a> {
    program: &'s ReadProgram,
    setup: &'s VirtualSetup<'a>,
    assembly: &'s OpenAssembly,
    stock: Option<LengthStock<'s>>,
    settings: &'s LengthSettings,
    verify: VerifySettings,
    monitor: &'s dyn Monitor,
}

struct GrownLengths {
    /// With the margin.
    lengths: Lengths,
    /// Least that is forced.
    least: Lengths,
    by: [Option<Raise>; 4],
    hopeless: Option<(AssemblyLength, Raise)>,
}

impl GrownLengths {
    /// Raises lengths to their needs and the margin; returns whether any was raised and none is
    /// hopeless.
    fn take(&mut self, needs: &Needs, assembly: &OpenAssembly, margin: f64) -> bool {
        if let Some((length, raise)) = needs.hopeless() {
            self.hopeless = Some((length, raise.clone()));
            return false;
        }
        for length in AssemblyLength::ALL {
            let (k, Some(raise)) = (length.index(), needs.of(length)) else { continue };
            self.least[k] = raise.to;
            self.lengths[k] = raise.to + margin;
            self.by[k] = Some(raise.clone());
        }
        assembly.rest(&mut self.lengths);
        !needs.is_none()
    }
}

impl Search<'_, '_> {
    /// Takes lengths up, first without their margin and then with it, until a run asks for no more.
    fn grow(&self, found: &mut GrownLengths) -> Result<(), VerifyError> {
        for margin in [0.0, self.settings.margin] {
            for length in AssemblyLength::ALL {
                let k = length.index();
                if found.by[k].is_some() && found.lengths[k] == found.least[k] {
                    found.lengths[k] += margin;
                }
            }
            self.assembly.rest(&mut found.lengths);
            let mut runs = 0;
            while found.hopeless.is_none() && self.run(found, margin)? {
                runs += 1;
                if runs > MAX_RUNS {
                    return Err(VerifyError::Tool { problem: "no lengths are free of everything at once".to_owned() });
                }
            }
        }
        Ok(())
    }

    /// One run through the program; whether a length went up.
    fn run(&self, found: &mut GrownLengths, margin: f64) -> Result<bool, VerifyError> {
        let needs = self.with(&found.lengths, |scene, moves| {
            let (longest, monitor) = (self.settings.longest, self.monitor);
            Ok(mesh_needs(scene, moves, self.assembly, &found.lengths, longest, monitor)?)
        })?;
        let (Some(stock), true) = (self.stock, needs.is_none()) else {
            return Ok(found.take(&needs, self.assembly, margin));
        };
        if let Some(needs) = self.flute(&found.lengths, &stock)? {
            return Ok(found.take(&needs, self.assembly, margin));
        }
        let needs = self.stock_needs(&found.lengths, &stock, [false, true, true, true], false)?;
        Ok(found.take(&needs, self.assembly, margin))
    }

    /// Returns the need of the flute against the stock: bisects between a length that meets it and
    /// one that does not, each with a run of its own, because a longer flute leaves another stock.
    fn flute(&self, lengths: &Lengths, stock: &LengthStock<'_>) -> Result<Option<Needs>, VerifyError> {
        let of_flute = |flute: f64| -> Result<Needs, VerifyError> {
            let mut all = *lengths;
            all[0] = flute;
            // A shank at least as long as the tool has it: its holder is not known yet.
            all[1] = all[1].max(self.assembly.lengths()[1]);
            self.assembly.rest(&mut all);
            self.stock_needs(&all, stock, [true, false, false, false], true)
        };
        let mut last = of_flute(lengths[0])?;
        if last.is_none() {
            return Ok(None);
        }
        let (mut blocked, mut step) = (lengths[0], 1.0);
        let mut free = loop {
            let tried = (blocked + step).min(self.settings.longest);
            let needs = of_flute(tried)?;
            if needs.is_none() {
                break tried;
            }
            if tried >= self.settings.longest {
                break f64::INFINITY;
            }
            (blocked, last, step) = (tried, needs, 2.0 * step);
        };
        while free.is_finite() && free - blocked > RESOLUTION {
            let middle = 0.5 * (blocked + free);
            let needs = of_flute(middle)?;
            if needs.is_none() {
                free = middle;
            } else {
                (blocked, last) = (middle, needs);
            }
        }
        let raise = last.of(AssemblyLength::Flute).cloned();
        let mut needs = Needs::default();
        if let Some(raise) = raise {
            needs.add(AssemblyLength::Flute, Raise { to: free, ..raise });
        }
        Ok(Some(needs))
    }

    fn stock_needs(
        &self,
        lengths: &Lengths,
        stock: &LengthStock<'_>,
        asks: [bool; 4],
        is_until_first: bool,
    ) -> Result<Needs, VerifyError> {
        self.with(lengths, |scene, moves| {
            let (tolerance, longest, assembly) = (stock.tolerance, self.settings.longest, self.assembly);
            let run = StockNeeds { scene, moves, assembly, tolerance, longest, is_until_first, asks };
            run.find(stock.before, lengths, self.monitor)
        })
    }

    /// Does something with the program as it is posted for these lengths.
    fn with<T>(
        &self,
        lengths: &Lengths,
        look: impl FnOnce(&RunScene<'_>, &[crate::motion::moves::Move]) -> Result<T, VerifyError>,
    ) -> Result<T, VerifyError> {
        let (tool, words, program) = self.posted(lengths)?;
        let setup = VirtualSetup { words: &words, tool: &tool, ..self.setup.clone() };
        let scene = RunScene::new(&setup, &self.verify)?;
        let resolved = resolve(&program, &setup, &self.verify);
        look(&scene, &resolved.moves)
    }

    fn posted(&self, lengths: &Lengths) -> Result<(ToolAssembly, WordMap, ReadProgram), VerifyError> {
        let tool = tool_of(self.assembly, lengths)?;
        let words = words_of_length(self.setup.words, tool.gauge_length())
            .map_err(|e| VerifyError::Tool { problem: e.to_string() })?;
        let program = posted_for_length(self.program, self.setup, &words);
        Ok((tool, words, program))
    }

    fn lengths_of(&self, found: GrownLengths) -> Result<ClearLengths, VerifyError> {
        let GrownLengths { lengths, least, by, hopeless } = found;
        let (tool, words, program) = self.posted(&lengths)?;
        let mut out = ClearLengths {
            lengths,
            least: lengths,
            forced_by: Default::default(),
            hopeless: None,
            tool,
            words,
            program,
        };
        for (k, raise) in by.into_iter().enumerate() {
            if let Some(raise) = raise.filter(|_| self.can_be_shorter(&lengths, k)) {
                out.least[k] = least[k];
                out.forced_by[k] = Some(self.forced_by(&raise));
            }
        }
        out.hopeless = hopeless.map(|(length, raise)| (length, self.forced_by(&raise)));
        Ok(out)
    }

    /// Whether those below a length leave it to be shorter: one that rests on them is not forced
    /// itself.
    fn can_be_shorter(&self, lengths: &Lengths, k: usize) -> bool {
        let mut lower = *lengths;
        lower[k] = 0.0;
        self.assembly.rest(&mut lower);
        lower[k] < lengths[k] - SAME
    }

    fn forced_by(&self, raise: &Raise) -> ForcedBy {
        let block = &self.program.blocks[raise.block];
        ForcedBy {
            line: block.line,
            block_number: block.number,
            block_text: block.text.to_string(),
            body: raise.body.clone(),
            obstacle: raise.obstacle.clone(),
            place_work_mm: raise.place.coords.into(),
            tip_work_mm: raise.cl.tip.coords.into(),
            axis_work: raise.cl.axis.into_inner().into(),
        }
    }
}
