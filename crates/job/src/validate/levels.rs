//! Levels of roughing in a block: an operation for each.

use facemill_cc_path::files::{LeftAboveFile, LeftOfFile, StrategyFile};
use facemill_tool_model::ToolAssembly;
use nalgebra::Vector3;

use crate::format::job_file::{
    CylinderStockFile, JobFile, LevelsFile, MOST_LAYERS, OperationFile, PathFile, SetupFile, StockFile,
};
use crate::frames::direction;
use crate::validate::setup_names::belongs;

/// Share of the radius by which the prism of a round bar may reach beyond it.
const PRISM: f64 = 1e-3;

/// Least sine between the planes' normal and the axis: planes across the axis have no pass on a
/// level.
const LEAST_ACROSS: f64 = 0.1;

/// Returns the first fault of an operation's levels as `field: what it must be`.
///
/// # Errors
/// If there is one.
pub(crate) fn check_levels(k: usize, operation: &OperationFile, job: &JobFile) -> Result<(), String> {
    let Some(levels) = &operation.levels else { return Ok(()) };
    let length_sq = Vector3::from(levels.axis).norm_squared();
    if !(length_sq > 0.0 && length_sq.is_finite()) {
        return Err(format!("operations[{k}].levels.axis: must be a direction, is {:?}", levels.axis));
    }
    let refuse = |what: &str| Err(format!("operations[{k}].levels: {what}"));
    let PathFile::Strategy(path) = &operation.path else {
        return refuse("need passes by parallel_planes; those of a path file are of one surface");
    };
    let StrategyFile::ParallelPlanes(planes) = &path.strategy else {
        return refuse("need the strategy parallel_planes");
    };
    let axis = direction(&levels.axis);
    if Vector3::from(planes.normal).try_normalize(0.0).is_none_or(|n| n.cross(&axis).norm() < LEAST_ACROSS) {
        return Err(format!(
            "operations[{k}].path.strategy.strategy.parallel_planes.normal: must lie across levels.axis, or planes have no \
             passes on a level"
        ));
    }
    let region = &path.region;
    let is_limited = region.groups.is_some() || region.normal_cone.is_some() || region.left_above.is_some();
    if is_limited || region.extend_mm > 0.0 {
        return refuse(
            "are planes of their own, over all of the stock; leave out groups, normal_cone, extend_mm and left_above of \
             path.strategy.region",
        );
    }
    if operation.layers.is_some() {
        return refuse("leave out layers: these are parallel to the drive surface");
    }
    if operation.pattern.is_some() {
        return refuse("cover the whole stock; leave out pattern");
    }
    if path.largest_width_rounds() > 0 {
        return refuse("leave out path.strategy.width_rounds");
    }
    let Some(setup) = job.setups.iter().find(|setup| belongs(operation, setup, job)) else { return Ok(()) };
    if matches!(setup.stock, StockFile::Offset(_)) {
        return refuse("need stock that is a solid of its own: box, cylinder or mesh; of an offset cut layers");
    }
    let Some(top) = top_of(levels, setup) else {
        return Err(format!(
            "operations[{k}].levels.from_mm: is needed, because the stock is a mesh: the height of its top along the axis"
        ));
    };
    if top <= levels.to_mm {
        let given = if levels.from_mm.is_some() { "from_mm" } else { "the top of the stock" };
        return Err(format!("operations[{k}].levels.to_mm: must be below {given}, {top} mm, is {}", levels.to_mm));
    }
    if levels.heights(top).len() as f64 > MOST_LAYERS {
        return Err(format!(
            "operations[{k}].levels.depth_mm: {} mm makes more than {MOST_LAYERS} levels",
            levels.depth_mm
        ));
    }
    Ok(())
}

/// Refuses levels by a tool whose flat bottom is too small for their passes, or that has none.
///
/// # Errors
/// If there are any.
pub(crate) fn check_flat_bottom(
    job: &JobFile,
    is_of: &dyn Fn(&OperationFile) -> bool,
    tool: &ToolAssembly,
) -> Result<(), String> {
    let (number, flat) = (tool.number(), 2.0 * tool.cutter().rim_radius());
    for (k, operation) in job.operations.iter().enumerate().filter(|(_, o)| o.levels.is_some() && is_of(o)) {
        if flat <= 0.0 {
            return Err(format!(
                "operations[{k}].levels: need a cutter with a flat bottom; T{number} has none, because its corner_radius_mm is its \
                 radius_mm"
            ));
        }
        let step_over = operation.tolerances.max_step_over_mm;
        if step_over > flat {
            return Err(format!(
                "operations[{k}].tolerances.max_step_over_mm: must be at most the diameter of the flat bottom of T{number}, {flat} mm, \
                 or strips stay between the passes of a level; is {step_over}"
            ));
        }
    }
    Ok(())
}

/// Returns the height from which levels begin: as given, or the top of the stock; `None` of stock
/// whose top its file alone knows.
fn top_of(levels: &LevelsFile, setup: &SetupFile) -> Option<f64> {
    if levels.from_mm.is_some() {
        return levels.from_mm;
    }
    let axis = direction(&levels.axis);
    match &setup.stock {
        StockFile::Box(b) => Some((0..3).map(|k| (b.min_mm[k] * axis[k]).max(b.max_mm[k] * axis[k])).sum()),
        StockFile::Cylinder(CylinderStockFile { base_mm, axis: along, radius_mm, height_mm }) => {
            let along = direction(along).dot(&axis);
            let across = (1.0 - along * along).max(0.0).sqrt();
            let wide = (1.0 + PRISM) * radius_mm * if across < 1e-9 { 0.0 } else { across };
            Some(Vector3::from(*base_mm).dot(&axis) + (height_mm * along).max(0.0) + wide)
        }
        StockFile::Offset(_) | StockFile::Mesh(_) => None,
    }
}

/// Returns the operations of the levels of an operation, from the highest; `None` of one without
/// levels.
pub(crate) fn each_level(operation: &OperationFile, job: &JobFile) -> Option<Vec<OperationFile>> {
    let levels = operation.levels?;
    let setup = job.setups.iter().find(|setup| belongs(operation, setup, job))?;
    let mut from_mm = top_of(&levels, setup)?;
    let heights = levels.heights(from_mm);
    let n = heights.len();
    let of_level = |(k, to_mm): (usize, f64)| {
        let mut level = operation.clone();
        let is_later = levels.is_later || k > 0;
        level.levels = Some(LevelsFile { from_mm: Some(from_mm), to_mm, is_later, ..levels });
        from_mm = to_mm;
        if n > 1 {
            level.name = format!("{} {} of {n}", operation.name, k + 1);
        }
        if let PathFile::Strategy(strategy) = &mut level.path {
            let step_over = operation.tolerances.max_step_over_mm;
            // Passes begin and end beside the stock.
            strategy.region.extend_mm = step_over;
            strategy.region.left_above = Some(LeftAboveFile {
                height_mm: operation.tolerances.cusp_mm,
                overlap_mm: step_over,
                of: LeftOfFile::InitialStock,
            });
        }
        level
    };
    Some(heights.into_iter().enumerate().map(of_level).collect())
}
