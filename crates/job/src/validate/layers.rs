//! Layers of roughing: an operation for each.

use facemill_cc_path::files::{LeftAboveFile, LeftOfFile};
use facemill_tool_model::ToolAssembly;

use crate::format::job_file::{JobFile, LayersFile, MOST_LAYERS, OperationFile, PathFile};
use crate::validate::levels::each_level;
use crate::validate::setup_chain::programs_before;
use crate::validate::setup_names::belongs;

/// Distance around material that the passes of a layer cover as well, as a multiple of the largest
/// step-over: the tool leaves it sideways.
const OVERLAP: f64 = 1.0;

/// Returns the first fault of an operation's layers as `field: what it must be`.
///
/// # Errors
/// If there is one.
pub(crate) fn check_layers(k: usize, operation: &OperationFile) -> Result<(), String> {
    let Some(layers) = &operation.layers else { return Ok(()) };
    let at = format!("operations[{k}].layers");
    let PathFile::Strategy(strategy) = &operation.path else {
        return Err(format!("{at}: need a strategy that lays passes; those of a path file are of one surface"));
    };
    if strategy.region.left_above.is_some() {
        return Err(format!(
            "{at}: are laid where material is left by themselves; leave out path.strategy.region.left_above"
        ));
    }
    if layers.from_mm <= operation.allowance_mm {
        return Err(format!(
            "{at}.from_mm: must be above the operation's allowance_mm, {} mm, is {}",
            operation.allowance_mm, layers.from_mm
        ));
    }
    let n = layers.allowances(operation.allowance_mm).len();
    if n as f64 > MOST_LAYERS {
        return Err(format!("{at}.depth_mm: {} mm makes more than {MOST_LAYERS} layers", layers.depth_mm));
    }
    Ok(())
}

/// Returns why an operation's region cannot be continued beyond its border.
///
/// # Errors
/// If it cannot.
pub(crate) fn check_extension(k: usize, operation: &OperationFile) -> Result<(), String> {
    if operation.region().extend_mm <= 0.0 {
        return Ok(());
    }
    let PathFile::Strategy(strategy) = &operation.path else {
        let kind = if matches!(operation.path, PathFile::Cl(_)) { "cl" } else { "file" };
        return Err(format!(
            "operations[{k}].path.{kind}.region.extend_mm: a path file has all its points; leave it out"
        ));
    };
    if strategy.strategy.to_strategy().is_ok_and(|s| s.follows_groups()) {
        return Err(format!(
            "operations[{k}].path.strategy.region.extend_mm: passes that follow an edge, a root or the border of a group need the \
             surface around their region; leave it out"
        ));
    }
    Ok(())
}

/// Refuses layers thicker than the flute of their tool.
///
/// # Errors
/// If there are any.
pub(crate) fn check_flute(
    job: &JobFile,
    is_of: &dyn Fn(&OperationFile) -> bool,
    tool: &ToolAssembly,
) -> Result<(), String> {
    let flute = tool.cutter().flute_length();
    for operation in job.operations.iter().filter(|o| is_of(o)) {
        let cusp = operation.tolerances.cusp_mm;
        let key = if operation.levels.is_some() { "levels" } else { "layers" };
        if let Some(depth) = operation.depth_of_layer().filter(|depth| depth + cusp >= flute) {
            return Err(format!(
                "operation \"{}\": {key}.depth_mm: {depth} mm, and the cusp of {cusp} mm that a layer leaves, need a longer flute \
                 than that of T{}, {flute} mm",
                operation.name,
                tool.number()
            ));
        }
    }
    Ok(())
}

/// Returns the job with an operation for each layer and level, in the place of those with several,
/// and which of its operations these are. The first layer of each has `layers` from the surface
/// that it leaves.
pub(crate) fn with_layers(job: JobFile) -> (JobFile, Vec<bool>) {
    let mut is_layer = Vec::new();
    let mut operations = Vec::new();
    for operation in &job.operations {
        if let Some(levels) = each_level(operation, &job) {
            is_layer.resize(is_layer.len() + levels.len(), true);
            operations.extend(levels);
            continue;
        }
        let Some(layers) = operation.layers else {
            operations.push(operation.clone());
            is_layer.push(false);
            continue;
        };
        let allowances = layers.allowances(operation.allowance_mm);
        let n = allowances.len();
        for (k, allowance_mm) in allowances.into_iter().enumerate() {
            let mut layer = OperationFile { allowance_mm, ..operation.clone() };
            layer.layers = (k == 0).then_some(LayersFile { from_mm: layers.from_mm - allowance_mm, ..layers });
            if n > 1 {
                layer.name = format!("{} {} of {n}", operation.name, k + 1);
            }
            if let PathFile::Strategy(strategy) = &mut layer.path {
                // Later passes cut what a layer leaves.
                strategy.width_rounds.get_or_insert(0);
                strategy.region.left_above = Some(LeftAboveFile {
                    height_mm: operation.tolerances.cusp_mm,
                    overlap_mm: OVERLAP * operation.tolerances.max_step_over_mm,
                    of: LeftOfFile::InitialStock,
                });
            }
            operations.push(layer);
            is_layer.push(true);
        }
    }
    (JobFile { operations, ..job }, is_layer)
}

/// Lays layers behind other programs of the same stock where these leave material.
pub(crate) fn measure_behind_programs(job: &mut JobFile, is_layer: &[bool]) {
    for index in 0..job.setups.len() {
        if programs_before(&job.setups, index).0.is_empty() && job.setups[index].programs_before.is_empty() {
            continue;
        }
        let setup = &job.setups[index];
        let is_of_setup: Vec<bool> = job.operations.iter().map(|o| belongs(o, setup, job)).collect();
        let of_setup = job.operations.iter_mut().zip(is_layer.iter().zip(&is_of_setup));
        for (operation, _) in of_setup.filter(|(_, (is_layer, is_of_setup))| **is_layer && **is_of_setup) {
            if let PathFile::Strategy(strategy) = &mut operation.path
                && let Some(left) = &mut strategy.region.left_above
            {
                left.of = LeftOfFile::OperationsBefore;
            }
        }
    }
}
