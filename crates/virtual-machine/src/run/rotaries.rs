//! Rotary axes that turn farther in one block than a control, or who reads the program, may mean.

use facemill_inverse_kinematics::{AxisKind, AxisValues, Motion};

use crate::finding::episodes::{Contact, Key};
use crate::finding::{FindingKind, Measure};
use crate::motion::moves::Move;
use crate::motion::spans::Spans;
use crate::run::chunk_result::ChunkResult;
use crate::run::scene::RunScene;

/// Largest contribution of the rounding of words to the turn of an axis in one block, rad.
const ROUNDING: f64 = 2e-3 * std::f64::consts::PI / 180.0;

/// Turn of the rotary axes together between two looks at how near the tool axis is to the pole,
/// rad. It moves the tool axis by no more; larger passes over a way across a cone that is not much
/// wider.
const LOOK: f64 = 0.25 * std::f64::consts::PI / 180.0;

/// Turn of the tool axis below which it stands still, rad: rounding of words. On the pole itself
/// any turn is free.
const STANDS: f64 = 0.01 * std::f64::consts::PI / 180.0;

/// Where rotary axes turn by more than half a turn in one block, and where they turn far with the
/// tool axis near the pole.
///
/// More than half a turn is a [`FindingKind::Rewind`] in a cutting move, and a
/// [`FindingKind::LinkRewind`] in a rapid between cuts; ways in and home are not judged. A turn by
/// more than [`singular_turn`](crate::motion::setup::VerifySettings::singular_turn) beyond that of
/// the tool axis, in a cutting move that comes within
/// [`singular_cone`](crate::motion::setup::VerifySettings::singular_cone) of the pole, is a
/// [`FindingKind::Singularity`].
pub(crate) fn turns(scene: &RunScene<'_>, moves: &[Move]) -> ChunkResult {
    let mut result = ChunkResult::default();
    let is_cut = |m: &Move| !m.is_rapid;
    let cuts = moves.iter().position(is_cut)..moves.iter().rposition(is_cut);
    for (index, m) in moves.iter().enumerate() {
        let is_between = cuts.start.is_some_and(|k| k < index) && cuts.end.is_some_and(|k| index < k);
        if let Some((axis, turn)) = farthest(scene, m).filter(|_| is_between || !m.is_rapid) {
            if turn > std::f64::consts::PI + ROUNDING {
                let kind = if m.is_rapid { FindingKind::LinkRewind } else { FindingKind::Rewind };
                result.episodes.record(index, contact(scene, kind, (axis, turn), (1.0, m.end)));
            }
            if let Some(at) = near_pole(scene, m, turn) {
                result.episodes.record(index, contact(scene, FindingKind::Singularity, (axis, turn), at));
            }
        }
    }
    result
}

/// The rotary axis between this head's tool and the work that turns farthest, and its turn, rad.
fn farthest(scene: &RunScene<'_>, m: &Move) -> Option<(usize, f64)> {
    let machine = scene.setup.machine;
    let is_own = |k: usize| machine.axes()[k].kind == AxisKind::Rotary && machine.moves_tool(k);
    let rotary = (0..m.start.len()).filter(|&k| is_own(k));
    rotary.map(|k| (k, (m.end[k] - m.start[k]).abs())).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

/// Where the tool axis is nearest to the pole on a cutting move on which the farthest axis turns by
/// `turn`: the fraction of the move's time and the axis values; `None` where that is no finding.
fn near_pole(scene: &RunScene<'_>, m: &Move, turn: f64) -> Option<(f64, AxisValues)> {
    let (machine, settings) = (scene.setup.machine, scene.settings);
    if m.is_rapid || turn <= settings.singular_turn + ROUNDING {
        return None;
    }
    let motion = Motion::new(machine, m.law, &m.start, &m.end, scene.tool_length).ok()?;
    let start = machine.cl_point(&m.start, scene.tool_length).axis;
    let (mut nearest, mut moved) = (None, 0.0_f64);
    for at in looks(scene, m) {
        let Ok(axes) = motion.at(at) else { continue };
        let cl = machine.cl_point(&axes, scene.tool_length);
        let angle = machine.angle_to_singular(&cl)?;
        moved = moved.max(start.cross(&cl.axis).norm().atan2(start.dot(&cl.axis)));
        if nearest.as_ref().is_none_or(|(least, _)| angle < *least) {
            nearest = Some((angle, (at, axes)));
        }
    }
    let is_far = moved > STANDS && turn - moved > settings.singular_turn + ROUNDING;
    nearest.filter(|(angle, _)| is_far && *angle <= settings.singular_cone).map(|(_, at)| at)
}

/// The times of a move at which it is looked how near the tool axis is to the pole, both ends among
/// them.
fn looks(scene: &RunScene<'_>, m: &Move) -> Vec<f64> {
    let machine = scene.setup.machine;
    let axes = machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary);
    let turns: f64 = axes.map(|(k, _)| (m.end[k] - m.start[k]).abs()).sum();
    let spans = Spans::new(machine, m.law, [&m.start, &m.end], scene.tool_length);
    let of_part = |[from, to]: [f64; 2]| {
        // The cast saturates.
        let n = (turns * (to - from) / LOOK).ceil().max(1.0) as u32;
        (0..=n).map(move |k| if k == n { to } else { from + (to - from) * f64::from(k) / f64::from(n) })
    };
    std::iter::once(0.0).chain(spans.parts.into_iter().flat_map(of_part)).collect()
}

fn contact(
    scene: &RunScene<'_>,
    kind: FindingKind,
    (axis, turn): (usize, f64),
    (at, axes): (f64, AxisValues),
) -> Contact {
    Contact {
        key: Key::of_axis(kind, Some(axis)),
        measure: Some(Measure::TurnDeg(turn.to_degrees())),
        place: None,
        axes,
        cl: scene.cl_at(&axes),
        at,
    }
}
