//! Order of the runs that both heads cut, with the shortest links.

use facemill_cl_data::Monitor;
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_tool_path::links::clock::LinkClock;
use facemill_tool_path::moves::order::{CutPath, LinkTimes, PassOrderReport, farthest_touch, shortest_order};
use facemill_virtual_machine::program_time::tolerance::MachineView;

use crate::dual::moves::{DualMover, ReachedRun};
use crate::dual::parts::TwoHeadContext;

/// Returns the order of runs with the shortest links and the report on it, or `None` if the setup
/// does not request it. Runs that can touch each other keep their order, whichever heads' cutters
/// can.
///
/// # Errors
/// Returns an error if the monitor cancels.
pub(crate) fn run_order(
    context: &TwoHeadContext<'_>,
    mover: &DualMover<'_, '_>,
    runs: &[&ReachedRun],
    from: Option<AxisValues>,
    monitor: &dyn Monitor,
) -> Result<Option<(Vec<usize>, PassOrderReport)>, Failure> {
    if !mover.settings[0].shortest_order {
        return Ok(None);
    }
    let views = context.scenes.each_ref().map(|scene| (scene.machine, scene.tool_length()));
    let paths: Option<Vec<CutPath>> = runs.iter().map(|run| path(run, &views)).collect();
    let paths = paths.ok_or_else(|| Failure::Internal("a run without stops".to_owned()))?;
    let reach = context.jobs().map(|job| farthest_touch(job.tool.cutter()));
    let start = from.unwrap_or_else(|| views[0].0.home());
    let clock = LinkClock::new(&views);
    let least = |a: &AxisValues, b: &AxisValues| clock.least_time(a, &mover.turned(b, a));
    let times = LinkTimes { least: &least, as_made: None };
    Ok(Some(shortest_order(&paths, &start, reach[0].max(reach[1]), &times, monitor)?))
}

/// Returns the tips of both heads from the first move of a run's entry to the last of its exit, in
/// the table frame; `None` without any.
fn path(run: &ReachedRun, views: &[MachineView<'_>; 2]) -> Option<CutPath> {
    let stops = run.run.stops.iter().map(|stop| stop.pose.axes);
    let along: Vec<AxisValues> =
        run.down.iter().map(|m| m.axes).chain(stops).chain(run.up.iter().map(|m| m.axes)).collect();
    let tips = |(machine, length): &MachineView<'_>| along.iter().map(|at| machine.cl_point(at, *length).tip).collect();
    Some(CutPath { ends: [*along.first()?, *along.last()?], tips: views.iter().map(tips).collect() })
}
