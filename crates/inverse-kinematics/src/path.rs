use facemill_cl_data::ClPoint;

use crate::{
    AxisKind, AxisLetter, AxisValues, Machine, Unreachable,
    path_edges::Edges,
    path_result::Choosing,
    path_station::{Poses, Station, Stations},
};

/// What lies between two neighbouring poses of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// The tool cuts: the axes have to go on continuously.
    Cut,
    /// The tool is clear of the part: anything may turn.
    Link,
}

/// What axes do between two poses other than to go on along the ideal motion: the tip on a straight line, the tool axis
/// turning evenly in the plane of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A limited rotary axis turns back, or on, by full turns beside what the motion asks for. Told is the axis that
    /// does most; where two do so in one segment the values tell the other.
    Rewind {
        /// Index of the axis.
        axis: usize,
        /// Full turns, in the axis's sense.
        turns: i32,
    },
    /// The next pose is reached by another solution than the one that the motion leads to, or the motion leaves the
    /// reach of the rotary axes.
    Flip,
}

/// A change between pose `segment` and the one behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathChange {
    /// Index of the segment.
    pub segment: usize,
    /// What changes.
    pub change: Change,
}

/// The turn of a rotary axis while the tool axis lies along it, which leaves the tool where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeTurn {
    /// First pose of the stretch in which the axis is free.
    pub first: usize,
    /// Last pose of it. If it is the first one, the axis turns while the tip stands there: the values hold `from`.
    pub last: usize,
    /// Index of the axis.
    pub axis: usize,
    /// Value at which it comes in, rad.
    pub from: f64,
    /// Value at which it leaves, rad.
    pub to: f64,
}

/// Poses near the singular direction, along the rotary axis nearest to the workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingularStretch {
    /// First pose within the cone.
    pub first: usize,
    /// Last pose within the cone.
    pub last: usize,
    /// Smallest angle of a pose's tool axis to the singular direction, rad.
    pub smallest_angle: f64,
    /// Largest turn of a rotary axis per way of the tip in a cut that begins or ends in the stretch, rad/mm; infinite
    /// where an axis turns while the tip stands.
    pub largest_speed: f64,
}

/// The axis values of a whole path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathChoice {
    /// Axis values of every pose; endless axes are unrolled.
    pub values: Vec<AxisValues>,
    /// Changes in cuts: the tool has to be retracted there, the axes turned, and the tool brought back.
    pub breaks: Vec<PathChange>,
    /// Changes on links.
    pub link_turns: Vec<PathChange>,
    /// Turns of a free axis.
    pub free_turns: Vec<FreeTurn>,
    /// Stretches within [`PathSettings::singular_cone`], ascending.
    pub singular: Vec<SingularStretch>,
    /// What was minimised last: sum over segments of the weighted time of the slowest axis, s.
    pub weighted_time: f64,
}

/// What a path costs beside its changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSettings {
    /// Factor on the travel time of every axis, 0 or more.
    pub weights: AxisValues,
    /// Half angle of the cone about the singular direction within which poses are told, rad.
    pub singular_cone: f64,
}

impl PathSettings {
    /// Weights of 1, and a cone of 5°.
    pub fn new(machine: &Machine) -> Self {
        Self { weights: AxisValues::from_fn(machine.axes().len(), |_| 1.0), singular_cone: 5.0_f64.to_radians() }
    }
}

/// Why no axis values are chosen for a path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// There are no poses.
    #[error("the path has no poses")]
    NoPoses,
    /// Not one segment between every two neighbouring poses.
    #[error("{poses} poses have {} segments between them, not {segments}", poses - 1)]
    SegmentCount {
        /// Number of poses.
        poses: usize,
        /// Number of segments given.
        segments: usize,
    },
    /// A weight is missing, below 0 or not finite.
    #[error("the weight of axis {axis} is {value}, but has to be a number of 0 or more")]
    Weight {
        /// The axis.
        axis: AxisLetter,
        /// The weight.
        value: f64,
    },
    /// The cone is not an angle.
    #[error("the cone about the singular direction is {0}, but has to be an angle of 0 or more, rad")]
    Cone(f64),
    /// The start position is not one finite value for each axis.
    #[error("the start position is not {n_axes} finite axis values")]
    Start {
        /// Number of axes of the machine.
        n_axes: usize,
    },
    /// A pose has no solution.
    #[error("pose {index} (counted from 0) cannot be reached: {reason}")]
    Unreachable {
        /// Index of the pose.
        index: usize,
        /// Why.
        reason: Unreachable,
    },
    /// The limits of the rotary axes allow more positions than are looked at.
    #[error(
        "pose {index} has {found} or more positions within the limits of the rotary axes, {most} are looked at; narrow \
         the limits"
    )]
    TooManyWindings {
        /// Index of the pose.
        index: usize,
        /// Positions found.
        found: usize,
        /// Positions looked at.
        most: usize,
    },
}

/// Branch and winding of every pose of a path: of all sequences of positions the one with the fewest changes in cuts,
/// of those the one with the fewest on links, of those the one with the least weighted travel time.
///
/// The minimum is exact for the poses given (Bellman's recursion over all branches at all windings within the limits).
/// Time is linear in the number of poses; beside the result two bytes are kept for each position and eight for each
/// pose. Of equal sequences always the same one is chosen.
///
/// From one pose to the next a solution goes on to a definite one, followed along the ideal motion: tip straight, tool
/// axis turning evenly. With two rotary axes that is proven, see the manual's method; with three it is followed in
/// steps of less than 10°. Everything else is a [`Change`]. `start` is where the axes stand before; the way from there
/// counts its time only. Each position of the result is within the limits and stands at its pose to 1e-9 mm and 1e-12
/// rad; limits between poses are not asked. Axes that do not move the tool cost nothing and stay where `start` has them,
/// at home without it.
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

/// Changes in cuts, changes on links, weighted time.
type Cost = (u32, u32, f64);

/// The chosen node of every station, and the weighted time.
fn shortest(
    of: Poses<'_>,
    segments: &[SegmentKind],
    start: Option<&AxisValues>,
    reference: AxisValues,
    settings: &PathSettings,
) -> Result<(Vec<u16>, f64), PathError> {
    let mut stations = Stations::new(of, reference);
    let Some(mut previous) = stations.next(None)? else { return Err(PathError::NoPoses) };
    let mut costs: Vec<Cost> =
        previous.nodes.iter().map(|n| (0, 0, start.map_or(0.0, |q| of.start_time(q, &n.values, settings)))).collect();
    // Predecessors of the nodes of all stations but the first, and where each station's begin.
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

    /// The value of an endless axis that is by whole turns away from `value` and nearest to `near`; others keep theirs.
    pub(crate) fn unrolled(&self, values: &AxisValues, near: impl Fn(usize) -> f64) -> AxisValues {
        AxisValues::from_fn(values.len(), |k| {
            let axis = &self.machine.axes()[k];
            let endless = axis.kind == AxisKind::Rotary && axis.endless;
            if endless { crate::inverse::nearest_turn(values[k], near(k)) } else { values[k] }
        })
    }
}
