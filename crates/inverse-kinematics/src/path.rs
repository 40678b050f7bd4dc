//! Solutions along a path: branch and winding of every pose.

pub(crate) mod choice;
pub(crate) mod edges;
pub(crate) mod follow;
pub(crate) mod result;
pub(crate) mod station;

pub use crate::path::choice::{
    Change, FreeTurn, PathChange, PathChoice, PathError, PathSettings, SegmentKind, SingularStretch,
};

use facemill_cl_data::ClPoint;

use crate::axes::axis::AxisKind;
use crate::axes::axis_values::AxisValues;
use crate::machine::Machine;
use crate::path::edges::Edges;
use crate::path::result::Choosing;
use crate::path::station::{Node, Poses, Station, Stations};

/// Chooses branch and winding of every pose of a path: the sequence of positions with the fewest
/// changes in cuts, among those the fewest on links, and among those the least weighted travel
/// time.
///
/// The minimum is exact for the given poses (Bellman's recursion over all branches at all windings
/// within the limits). Time is linear in the number of poses; beside the result, two bytes are kept
/// for each position and eight for each pose. Among equal sequences the same one is always chosen.
///
/// From one pose to the next a solution continues to a definite one, followed along the ideal
/// motion: tip straight, tool axis turning evenly. With two rotary axes that is proven, see the
/// manual's method; with three it is followed in steps of less than 10°. Everything else is a
/// [`Change`]. `start` is the position of the axes before; of the way
/// from there only the time counts. Each position of the result is within the limits and at its
/// pose to 1e-9 mm and 1e-12 rad; limits between poses are not tested. Axes that do not move the
/// tool cost nothing and stay where `start` has them, at home without it.
///
/// # Errors
/// See [`PathError`].
pub fn choose_along(
    machine: &Machine,
    poses: &[ClPoint],
    segments: &[SegmentKind],
    start: Option<&AxisValues>,
    tool_length: f64,
    settings: &PathSettings,
) -> Result<PathChoice, PathError> {
    check(machine, poses, segments, start, settings)?;
    let of = Poses { machine, poses, tool_length };
    let reference = start.copied().unwrap_or_else(|| machine.home());
    let (chosen, weighted_time) = shortest(of, segments, start, reference, settings)?;
    let mut result = Choosing::new(of, segments, settings);
    let mut stations = Stations::new(of, reference);
    let mut previous: Option<Station> = None;
    for &node in &chosen {
        let Some(station) = stations.next(previous.as_ref())? else { break };
        match &previous {
            None => result.begin(&station, usize::from(node), start),
            Some(previous) => result.go_on(previous, &station, usize::from(node))?,
        }
        previous = Some(station);
    }
    let mut choice = result.finish(previous.as_ref(), weighted_time)?;
    for k in (0..machine.axes().len()).filter(|&k| !machine.moves_tool(k)) {
        choice.values.iter_mut().for_each(|q| q[k] = reference.get_or_zero(k));
    }
    Ok(choice)
}

fn check(
    machine: &Machine,
    poses: &[ClPoint],
    segments: &[SegmentKind],
    start: Option<&AxisValues>,
    settings: &PathSettings,
) -> Result<(), PathError> {
    let n_axes = machine.axes().len();
    if poses.is_empty() {
        return Err(PathError::NoPoses);
    }
    if segments.len() + 1 != poses.len() {
        return Err(PathError::SegmentCount { poses: poses.len(), segments: segments.len() });
    }
    for (k, axis) in machine.axes().iter().enumerate() {
        let value = settings.weights.as_slice().get(k).copied().unwrap_or(f64::NAN);
        if !(value.is_finite() && value >= 0.0) {
            return Err(PathError::Weight { axis: axis.letter, value });
        }
    }
    if settings.singular_cone.is_nan() || settings.singular_cone < 0.0 {
        return Err(PathError::Cone(settings.singular_cone));
    }
    if start.is_some_and(|q| q.len() != n_axes || !q.is_finite()) {
        return Err(PathError::Start { n_axes });
    }
    Ok(())
}

/// Changes in cuts of a solution that the path may not begin with: more than any path has.
const NEVER: u32 = u32::MAX / 2;

/// Changes in cuts, changes on links, weighted time.
type Cost = (u32, u32, f64);

/// Returns the chosen node of every station, and the weighted time.
fn shortest(
    of: Poses<'_>,
    segments: &[SegmentKind],
    start: Option<&AxisValues>,
    reference: AxisValues,
    settings: &PathSettings,
) -> Result<(Vec<u16>, f64), PathError> {
    let mut stations = Stations::new(of, reference);
    let Some(mut previous) = stations.next(None)? else { return Err(PathError::NoPoses) };
    let is_start = |n: &Node| start.is_some_and(|q| of.machine.same_rotaries(&n.values, q));
    let only_start = settings.begins_at_start && previous.nodes.iter().any(is_start);
    let first_cost = |n: &Node| {
        let breaks = if only_start && !is_start(n) { NEVER } else { 0 };
        (breaks, 0, start.map_or(0.0, |q| of.start_time(q, &n.values, settings)))
    };
    let mut costs: Vec<Cost> = previous.nodes.iter().map(first_cost).collect();
    // Predecessors of the nodes of all stations except the first, and the index where each
    // station's begin.
    let (mut before, mut begins): (Vec<u16>, Vec<usize>) = (Vec::new(), Vec::new());
    while let Some(station) = stations.next(Some(&previous))? {
        let kind = segments[previous.last];
        let edges = Edges::new(of, (&previous, &station), kind, &settings.weights);
        begins.push(before.len());
        let mut next = Vec::with_capacity(station.nodes.len());
        for to in &station.nodes {
            let mut best: Option<(Cost, u16)> = None;
            for (k, (from, cost)) in (0_u16..).zip(previous.nodes.iter().zip(&costs)) {
                let edge = edges.edge(from, to);
                let (breaks, turns) = match (edge.change, kind) {
                    (None, _) => (0, 0),
                    (Some(_), SegmentKind::Cut) => (1, 0),
                    (Some(_), SegmentKind::Link) => (0, 1),
                };
                let sum = (cost.0 + breaks, cost.1 + turns, cost.2 + edges.time(&edge.way));
                if best.is_none_or(|(best, _)| sum < best) {
                    best = Some((sum, k));
                }
            }
            // A station has at least one node.
            let (cost, from) = best.unwrap_or_default();
            next.push(cost);
            before.push(from);
        }
        costs = next;
        previous = station;
    }
    let cheapest = (0_u16..).zip(&costs).reduce(|a, b| if b.1 < a.1 { b } else { a });
    let (mut node, &(_, _, time)) = cheapest.unwrap_or((0, &(0, 0, 0.0)));
    let mut chosen = vec![node];
    for &begin in begins.iter().rev() {
        node = before[begin + usize::from(node)];
        chosen.push(node);
    }
    chosen.reverse();
    Ok((chosen, time))
}

impl Poses<'_> {
    fn start_time(&self, start: &AxisValues, to: &AxisValues, settings: &PathSettings) -> f64 {
        let axes = self.machine.axes();
        let time = |k: usize| settings.weights[k] * self.way(k, start[k], to[k]).abs() / axes[k].max_velocity;
        (0..axes.len()).filter(|&k| self.machine.moves_tool(k)).map(time).fold(0.0, f64::max)
    }

    /// Returns an endless axis' value moved by whole turns to be nearest to `near`; other axes keep
    /// theirs.
    pub(crate) fn unrolled(&self, values: &AxisValues, near: impl Fn(usize) -> f64) -> AxisValues {
        AxisValues::from_fn(values.len(), |k| {
            let axis = &self.machine.axes()[k];
            let endless = axis.kind == AxisKind::Rotary && axis.endless;
            if endless { crate::inverse::nearest_turn(values[k], near(k)) } else { values[k] }
        })
    }
}
