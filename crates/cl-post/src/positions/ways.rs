//! Positions between two points that keep the motion of the control within a tolerance.

use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_inverse_kinematics::motion::{Linearisation, LineariseError, MotionTolerance, deviation_bound, linearise};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine};

use crate::scene::MAX_BETWEEN;

/// Machine and laws by which moves are followed.
pub(crate) struct MotionRules<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) tool_length: f64,
    pub(crate) cutting: CuttingLaw,
    pub(crate) rapid: BlockLaw,
    /// Whether each axis goes at its own speed in rapids.
    pub(crate) has_bent_rapids: bool,
    pub(crate) in_cuts: MotionTolerance,
    /// On chords of arcs.
    pub(crate) on_chords: MotionTolerance,
    /// `None`: a rapid is one block.
    pub(crate) in_rapids: Option<MotionTolerance>,
    pub(crate) retract: Option<f64>,
}

/// Largest difference of axis values that are the same, mm or rad.
const SAME: f64 = 1e-7;

/// Reason why there are no positions between two points.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BetweenFault {
    /// No way of the axes is near enough.
    #[error("on the way to it: {0}")]
    Linearise(#[from] LineariseError),
    /// The tool reverses.
    #[error("the tool axis reverses on the way to it; put a point between")]
    Reverses,
    /// More positions than are allowed.
    #[error("more than {MAX_BETWEEN} positions are needed on the way to it; allow a larger tolerance")]
    TooMany,
}

/// Returns whether the motion of the control between two positions keeps a tolerance.
pub(crate) fn held_by(
    ways: &MotionRules<'_>,
    (law, tolerance): (BlockLaw, &MotionTolerance),
    from: &AxisValues,
    to: &AxisValues,
) -> bool {
    tolerance.used_by(&deviation_bound(ways.machine, law, from, to, ways.tool_length)) <= 1.0
}

/// Returns the positions between two, each with the pose that is meant there: none where the motion
/// of the control keeps the tolerance.
pub(crate) fn between(
    ways: &MotionRules<'_>,
    (law, tolerance): (BlockLaw, &MotionTolerance),
    [from, to]: [&AxisValues; 2],
    [start, end]: [&ClPoint; 2],
) -> Result<Vec<(AxisValues, ClPoint)>, BetweenFault> {
    let turns_vector = law == BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    if !turns_vector && held_by(ways, (law, tolerance), from, to) {
        return Ok(Vec::new());
    }
    if start.axis.dot(&end.axis) < -1.0 + 1e-9 {
        return Err(BetweenFault::Reverses);
    }
    let settings = Linearisation { max_between: MAX_BETWEEN, ..Linearisation::new(law, ways.tool_length, *tolerance) };
    let found = linearise(ways.machine, &[*start, *end], from, &settings);
    let is_ours = |way: &facemill_inverse_kinematics::motion::Linearised| {
        same(&way.positions[0], from) && way.positions.last().is_some_and(|last| same(last, to))
    };
    match found {
        Ok(way) if is_ours(&way) => {
            let meant = |fraction: f64| meant(start, end, fraction);
            let inner = way.positions.iter().zip(&way.source).skip(1).take(way.positions.len() - 2);
            Ok(inner.map(|(q, source)| (*q, meant(source.fraction))).collect())
        }
        // At a pole the axes are free: they follow the ends that were chosen for the whole path.
        other => evenly(ways, (law, tolerance), [from, to], [start, end])
            .map_err(|why| other.err().map_or(why, BetweenFault::from)),
    }
}

/// Returns positions at equal parts of the way, as many as the tolerance needs, with the rotary
/// axes near an even motion.
fn evenly(
    ways: &MotionRules<'_>,
    (law, tolerance): (BlockLaw, &MotionTolerance),
    [from, to]: [&AxisValues; 2],
    [start, end]: [&ClPoint; 2],
) -> Result<Vec<(AxisValues, ClPoint)>, BetweenFault> {
    let mut parts = 1;
    while parts <= MAX_BETWEEN {
        parts *= 2;
        let inner: Option<Vec<(AxisValues, ClPoint)>> = (1..parts)
            .map(|k| {
                let t = k as f64 / parts as f64;
                let pose = meant(start, end, t);
                Some((near(ways, &pose, &from.lerp(to, t))?, pose))
            })
            .collect();
        let Some(inner) = inner else { continue };
        let ends = std::iter::once(from).chain(inner.iter().map(|(q, _)| q)).chain([to]);
        let all: Vec<&AxisValues> = ends.collect();
        if all.windows(2).all(|pair| held_by(ways, (law, tolerance), pair[0], pair[1])) {
            return Ok(inner);
        }
    }
    Err(BetweenFault::TooMany)
}

/// Returns the position at a pose whose rotary axes are nearest to those of `guess`.
pub(crate) fn near(ways: &MotionRules<'_>, pose: &ClPoint, guess: &AxisValues) -> Option<AxisValues> {
    let solutions = ways.machine.inverse_near(pose, ways.tool_length, guess).ok()?;
    let turn = |q: &AxisValues| rotary_way(ways, q, guess);
    solutions.iter().map(|s| s.values).min_by(|a, b| turn(a).total_cmp(&turn(b)))
}

/// Returns the position at the start of a way from which the axes come to `to` at its end without
/// turning anew: the way is followed backward. `None` where they cannot, and without a tolerance.
pub(crate) fn before(ways: &MotionRules<'_>, [start, end]: [&ClPoint; 2], to: &AxisValues) -> Option<AxisValues> {
    let law = BlockLaw::Cutting(ways.cutting);
    let tolerance = ways.in_rapids?;
    let settings = Linearisation { max_between: MAX_BETWEEN, ..Linearisation::new(law, ways.tool_length, tolerance) };
    let way = linearise(ways.machine, &[*end, *start], to, &settings).ok()?;
    let is_ours = way.positions.first().is_some_and(|first| same(first, to));
    way.positions.last().copied().filter(|q| is_ours && ways.machine.first_beyond_limit(q).is_none())
}

/// Sum of the turns of the rotary axes between two positions, rad.
pub(crate) fn rotary_way(ways: &MotionRules<'_>, from: &AxisValues, to: &AxisValues) -> f64 {
    let axes = ways.machine.axes().iter().enumerate();
    axes.filter(|(_, axis)| axis.kind == AxisKind::Rotary).map(|(k, _)| (to[k] - from[k]).abs()).sum()
}

/// The pose that the file means at a fraction of the way between two.
fn meant(start: &ClPoint, end: &ClPoint, t: f64) -> ClPoint {
    let axis = start.axis.try_slerp(&end.axis, t, 1e-12).unwrap_or(start.axis);
    ClPoint { tip: start.tip + (end.tip - start.tip) * t, axis }
}

fn same(a: &AxisValues, b: &AxisValues) -> bool {
    a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() <= SAME)
}
