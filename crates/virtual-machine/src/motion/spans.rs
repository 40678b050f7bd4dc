//! The parts of a move that have to be looked at: within one turn of every axis each, and none that
//! repeats another.

#[cfg(test)]
#[path = "../../tests/unit/motion/spans_laws.rs"]
mod laws;

use std::f64::consts::TAU;

use facemill_cl_data::{CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion};

use crate::motion::stepping::stops;

/// Whole turns of one axis that are followed in one rapid while other axes move, too. More take
/// positions by the million for a way that the machine's travel does not ask for; fewer refuse a
/// way home with the table wound far.
const MOST_TURNS: f64 = 200.0;

/// The same of a cut: longer spirals are written in shorter blocks.
const MOST_TURNS_CUT: f64 = 50.0;

/// Whole turns of all blocks together that turn an axis by more than one while others move: bounds
/// the time of a run by the machine and not by the numbers of its text.
const MOST_TURNS_OF_PROGRAM: f64 = 500.0;

/// Way of the tip, mm, below which it rests while the rotary axes turn: rounding of forward
/// kinematics.
const STANDS: f64 = 1e-9;

/// The parts of a move that have to be looked at, and what they stand for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spans {
    /// Fractions of the move's time, in order: no axis of a rapid stops within a part, and none
    /// turns by more than a turn.
    pub(crate) parts: Vec<[f64; 2]>,
    /// The turns that the last part repeats, where there are any.
    pub(crate) repeated: Option<Repeated>,
}

/// Turns of one axis alone that end where the last part begins: there is nothing on them that is
/// not on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeated {
    /// Fractions of the move's time at which they begin and end.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Their number.
    pub(crate) turns: f64,
}

impl Spans {
    /// Of a move under `law` between two positions with this tool length.
    pub(crate) fn new(machine: &Machine, law: BlockLaw, ends: [&AxisValues; 2], tool_length: f64) -> Self {
        let mut breaks = vec![0.0, 1.0];
        if law == BlockLaw::Rapid(RapidLaw::PerAxis) {
            breaks.extend(stops(machine, ends));
            breaks.sort_by(f64::total_cmp);
            breaks.dedup();
        }
        let from = breaks[breaks.len() - 2];
        let turns = |from: f64, to: f64| {
            let way = |k: usize| {
                let stop = goes_for(machine, law, ends, k);
                (ends[1][k] - ends[0][k]).abs() * (to.min(stop) - from.min(stop)) / stop
            };
            rotary(machine).map(way).fold(0.0, f64::max) / TAU
        };
        let all = turns(from, 1.0);
        let repeats = all > 1.0 && is_alone(machine, law, ends, from, tool_length);
        let repeated = repeats.then(|| Repeated { from, to: 1.0 - (1.0 - from) / all, turns: all - 1.0 });
        if let Some(repeated) = repeated {
            breaks.insert(breaks.len() - 1, repeated.to);
        }
        let is_gap = |pair: &[f64]| repeated.is_some_and(|r| pair[0] == r.from && pair[1] == r.to);
        let looked_at = breaks.windows(2).filter(|pair| !is_gap(pair));
        // Axes that follow a vector do not turn evenly, and not on and on.
        let is_even = law != BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
        let parts = looked_at.flat_map(|pair| {
            let whole = (turns(pair[0], pair[1]) - ROUNDING).min(MOST_TURNS).ceil();
            divided([pair[0], pair[1]], if is_even { whole.max(1.0) } else { 1.0 })
        });
        Self { parts: parts.collect(), repeated }
    }
}

/// Part of a turn by which a part may turn farther: rounding of the times at which whole turns end.
const ROUNDING: f64 = 1e-9;

/// An interval in `n` equal parts.
fn divided([from, to]: [f64; 2], n: f64) -> impl Iterator<Item = [f64; 2]> {
    let at = move |k: f64| if k == n { to } else { from + (to - from) * (k / n) };
    (0..n as usize).map(move |k| [at(k as f64), at((k + 1) as f64)])
}

/// Turns of the blocks of a program that turn an axis by more than one while others move.
#[derive(Debug, Default)]
pub(crate) struct LongTurns {
    sum: f64,
}

impl LongTurns {
    /// Adds those of a move. Returns why the move is not followed, if it is not.
    pub(crate) fn add(
        &mut self,
        machine: &Machine,
        law: BlockLaw,
        ends: [&AxisValues; 2],
        tool_length: f64,
    ) -> Option<String> {
        let all = rotary(machine).map(|k| (ends[1][k] - ends[0][k]).abs() / TAU).fold(0.0, f64::max);
        if all <= 1.0 {
            return None;
        }
        let repeated = Spans::new(machine, law, ends, tool_length).repeated.map_or(0.0, |r| r.turns);
        let turns = all - repeated;
        if turns <= 1.0 + ROUNDING {
            return None;
        }
        let most = if matches!(law, BlockLaw::Rapid(_)) { MOST_TURNS } else { MOST_TURNS_CUT };
        if turns > most {
            return Some(format!("more than {most} turns of an axis in one block while others move: not run"));
        }
        self.sum += turns;
        (self.sum > MOST_TURNS_OF_PROGRAM).then(|| {
            format!(
                "turns an axis by {turns:.0} turns while others move, more than {MOST_TURNS_OF_PROGRAM} with those of the \
                 blocks before: not run"
            )
        })
    }
}

fn rotary(machine: &Machine) -> impl Iterator<Item = usize> + '_ {
    machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Rotary).map(|(k, _)| k)
}

/// Part of the move's time for which an axis goes, from the move's start on; 1 for one at rest.
fn goes_for(machine: &Machine, law: BlockLaw, [start, end]: [&AxisValues; 2], axis: usize) -> f64 {
    if law != BlockLaw::Rapid(RapidLaw::PerAxis) || start[axis] == end[axis] {
        return 1.0;
    }
    (end[axis] - start[axis]).abs() / machine.axes()[axis].max_velocity / machine.travel_time(start, end)
}

/// Whether from this time on one rotary axis turns alone, or with linear axes that hold the tip
/// where it is.
fn is_alone(machine: &Machine, law: BlockLaw, ends: [&AxisValues; 2], from: f64, tool_length: f64) -> bool {
    let moves = |k: &usize| ends[0][*k] != ends[1][*k] && goes_for(machine, law, ends, *k) > from;
    let mut going = (0..machine.axes().len()).filter(moves);
    let is_rotary = |k: &usize| machine.axes()[*k].kind == AxisKind::Rotary;
    if law != BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) {
        return going.next().as_ref().is_some_and(is_rotary) && going.next().is_none();
    }
    let Ok(motion) = Motion::new(machine, law, ends[0], ends[1], tool_length) else { return false };
    let (a, b) = (motion.ideal(0.0), motion.ideal(1.0));
    going.filter(is_rotary).count() == 1 && (b.tip - a.tip).norm() <= STANDS
}
