//! How far each axis may leave a program's lines so that the tip stays within the control's
//! tolerance.

use facemill_cl_data::ControlTolerance;
use facemill_feedrate::ProgramBlock;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::program_time::run::MotionRun;

/// A machine as one head sees it, and the length of its tool, mm.
pub type MachineView<'a> = (&'a Machine, f64);

/// Turn of all rotary axes between two places at which levers are measured, rad: a hundredth of a
/// lever is what they may grow in between. Smaller places cost more of them in long moves.
const TURN: f64 = 0.02;

/// Way of all linear axes between two such places, mm.
const WAY: f64 = 20.0;

/// Places of one move at most: longer ones are blended a little more tightly.
const MOST_PLACES: f64 = 256.0;

/// Least tolerance that corners are blended with, mm or rad: below it the law's rounding would
/// count.
const LEAST: f64 = 1e-9;

/// Moves whose levers are measured one after the other.
const CHUNK: usize = 1024;

/// Largest levers of the rotary axes that move a head's tool, mm: what the tip moves by per rad. 0
/// for all others.
#[derive(Clone, Copy, Debug)]
pub struct Levers(AxisValues);

impl Levers {
    /// Upper bounds on the levers over the moves of a run, on straight lines of the axes.
    ///
    /// The lever of a rotary axis is the distance of the tip from it, half of the way that half a
    /// turn moves the tip by. Between the places at which it is measured it grows by no more than
    /// the tip moves.
    pub fn over(view: MachineView<'_>, run: &MotionRun) -> Self {
        let of_chunk = |(k, moves): (usize, &[ProgramBlock])| {
            let start = (k * CHUNK).checked_sub(1).map_or(run.start, |before| run.blocks[before].end);
            chunk_levers(view, start, moves)
        };
        let chunks: Vec<AxisValues> = run.blocks.par_chunks(CHUNK).enumerate().map(of_chunk).collect();
        let n = view.0.axes().len();
        Self(chunks.iter().fold(AxisValues::zeros(n), |most, next| larger(&most, next)))
    }
}

fn larger(a: &AxisValues, b: &AxisValues) -> AxisValues {
    AxisValues::from_fn(a.len(), |k| a[k].max(b[k]))
}

fn chunk_levers(view: MachineView<'_>, start: AxisValues, moves: &[ProgramBlock]) -> AxisValues {
    let n = view.0.axes().len();
    let mut from = start;
    let mut at = levers_at(view, &from);
    let mut levers = at;
    for to in moves.iter().map(|m| m.end) {
        let (way, turn) = ways(view.0, &from, &to);
        let places = (way / WAY).max(turn / TURN).ceil().clamp(1.0, MOST_PLACES);
        let (way, turn) = (0.5 * way / places, 0.5 * turn / places);
        for k in 1..=places as usize {
            let next = levers_at(view, &from.lerp(&to, k as f64 / places));
            let near = larger(&at, &next);
            let most = near.iter().fold(0.0, f64::max);
            // The tip moves by `way` and by `turn` times the largest lever on the way, which itself
            // grows by as much.
            let growth = if turn < 1.0 { way + turn * (most + way) / (1.0 - turn) } else { f64::INFINITY };
            for k in (0..n).filter(|&k| has_lever(view.0, k)) {
                levers[k] = levers[k].max(near[k] + growth);
            }
            at = next;
        }
        from = to;
    }
    levers
}

fn has_lever(machine: &Machine, axis: usize) -> bool {
    machine.axes()[axis].kind == AxisKind::Rotary && machine.moves_tool(axis)
}

/// Sums of the ways of linear and of rotary axes, mm and rad.
fn ways(machine: &Machine, from: &AxisValues, to: &AxisValues) -> (f64, f64) {
    let of = |kind: AxisKind| {
        let axes = machine.axes().iter().enumerate().filter(move |(_, a)| a.kind == kind);
        axes.map(|(k, _)| (to.get_or_zero(k) - from.get_or_zero(k)).abs()).sum()
    };
    (of(AxisKind::Linear), of(AxisKind::Rotary))
}

/// Levers of the rotary axes at a position, mm: what the tip moves by per rad.
pub fn levers_at((machine, tool_length): MachineView<'_>, q: &AxisValues) -> AxisValues {
    let tip = machine.cl_point(q, tool_length).tip;
    let axes = machine.axes();
    AxisValues::from_fn(axes.len(), |k| {
        if !has_lever(machine, k) {
            return 0.0;
        }
        let mut turned = *q;
        turned[k] += std::f64::consts::PI;
        0.5 * (machine.cl_point(&turned, tool_length).tip - tip).norm()
    })
}

/// Whether a control with this tolerance blends no corner.
pub fn stops_at_corners(tolerance: ControlTolerance) -> bool {
    tolerance.path <= 0.0 || tolerance.orientation <= 0.0
}

/// Which axes may stray in a run: those that move where no rotary axis does, else all.
pub fn moving(machine: &Machine, run: &MotionRun) -> Vec<bool> {
    let moves = |k: usize| run.blocks.iter().any(|block| block.end[k] != run.start[k]);
    let moving: Vec<bool> = (0..run.start.len()).map(moves).collect();
    let turns = machine.axes().iter().zip(&moving).any(|(axis, moves)| *moves && axis.kind == AxisKind::Rotary);
    if turns || !moving.contains(&true) { vec![true; moving.len()] } else { moving }
}

/// Returns the distance that every axis may keep from its lines, mm or rad, so that no head's tip
/// strays by more than `path` and no tool axis turns by more than `orientation`: half of the path
/// for the linear axes together, half for the rotary ones by their levers; all of it for the linear
/// ones where no rotary axis moves. `None` if that is nothing: the axes then stop at every corner.
///
/// `levers` are those of each view over the program. Axes that are not `moving` stay, and stray by
/// nothing.
pub fn blend_tolerance(
    tolerance: ControlTolerance,
    views: &[MachineView<'_>],
    levers: &[Levers],
    moving: &[bool],
) -> Option<AxisValues> {
    if stops_at_corners(tolerance) {
        return None;
    }
    let axes = views.first()?.0.axes();
    let mut all = AxisValues::from_fn(axes.len(), |_| f64::INFINITY);
    for ((machine, _), Levers(levers)) in views.iter().zip(levers) {
        let strays = |k: &usize| moving[*k] && machine.moves_tool(*k);
        let of = |kind: AxisKind| (0..axes.len()).filter(move |&k| axes[k].kind == kind).filter(strays);
        let (linears, n) = (of(AxisKind::Linear).collect::<Vec<_>>(), of(AxisKind::Rotary).count() as f64);
        let share = if n > 0.0 { 0.5 } else { 1.0 } * tolerance.path;
        for &k in &linears {
            all[k] = all[k].min(share / linear_reach(machine, &linears));
        }
        for k in of(AxisKind::Rotary) {
            // The lever itself may be longer by what the tip has strayed.
            let by_path = share / (n * (levers[k] + tolerance.path));
            all[k] = all[k].min(by_path).min(tolerance.orientation / n);
        }
    }
    // An axis that moves no tip may stray as the freest one does.
    let most = all.iter().filter(|t| t.is_finite()).fold(0.0, f64::max);
    let all = AxisValues::from_fn(all.len(), |k| if all[k].is_finite() { all[k] } else { most });
    all.iter().all(|t| t >= LEAST).then_some(all)
}

/// How far the tip may be displaced by linear axes that are each displaced by 1: √n where they are
/// at right angles whatever the rotary axes do, else n.
fn linear_reach(machine: &Machine, linears: &[usize]) -> f64 {
    let axes = machine.axes();
    let n = linears.len() as f64;
    let directions = |q: &AxisValues| -> Vec<Vector3<f64>> {
        let tip = machine.cl_point(q, 0.0).tip;
        let moved = |&k: &usize| {
            let mut q = *q;
            q[k] += 1.0;
            machine.cl_point(&q, 0.0).tip - tip
        };
        linears.iter().map(moved).collect()
    };
    // The cosine between two of them is a + b·cos θ + c·sin θ in every rotary axis: 0 at three
    // places of each, 0 everywhere.
    let places = 3_usize.pow(axes.iter().filter(|a| a.kind == AxisKind::Rotary).count() as u32);
    let square = (0..places).all(|mut place| {
        let turned = AxisValues::from_fn(axes.len(), |k| {
            if axes[k].kind == AxisKind::Linear {
                return 0.0;
            }
            let third = place % 3;
            place /= 3;
            third as f64 * std::f64::consts::TAU / 3.0
        });
        let d = directions(&turned);
        (0..d.len()).all(|i| (0..i).all(|j| d[i].dot(&d[j]).abs() < 1e-9))
    });
    if square { n.sqrt().max(1.0) } else { n.max(1.0) }
}

#[cfg(test)]
#[path = "../../tests/unit/program_time/tolerance.rs"]
mod tests;
