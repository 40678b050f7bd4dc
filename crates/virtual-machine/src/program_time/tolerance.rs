//! How far each axis may leave a program's lines so that the tip stays within the control's tolerance.

use facemill_cl_data::ControlTolerance;
use facemill_feedrate::ProgramBlock;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::program_time::run::Run;

/// A machine as one head sees it, and the length of its tool, mm.
pub type View<'a> = (&'a Machine, f64);

/// Turn of all rotary axes between two places at which levers are measured, rad: a hundredth of a lever is what they
/// may grow in between. Smaller places cost more of them in long moves.
const TURN: f64 = 0.02;

/// Way of all linear axes between two such places, mm.
const WAY: f64 = 20.0;

/// Places of one move at most: longer ones are blended a little more tightly.
const MOST_PLACES: f64 = 256.0;

/// Least tolerance that corners are blended with, mm or rad: below it the law's rounding would count.
const LEAST: f64 = 1e-9;

/// Moves whose levers are measured one after the other.
const CHUNK: usize = 1024;

/// Largest levers of the rotary axes that move a head's tool, mm: what the tip moves by per rad. 0 for all others.
#[derive(Clone, Copy, Debug)]
pub struct Levers(AxisValues);

impl Levers {
    /// Levers over the moves of a run, on straight lines of the axes: nowhere larger than told.
    ///
    /// The lever of a rotary axis is the distance of the tip from it, half of the way that half a turn moves the tip by.
    /// Between the places at which it is measured it grows by no more than the tip moves.
    pub fn over(view: View<'_>, run: &Run) -> Self {
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

fn chunk_levers(view: View<'_>, start: AxisValues, moves: &[ProgramBlock]) -> AxisValues {
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
            // The tip moves by `way` and by `turn` times the largest lever on the way, which itself grows by as much.
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
pub fn levers_at((machine, tool_length): View<'_>, q: &AxisValues) -> AxisValues {
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
pub fn moving(machine: &Machine, run: &Run) -> Vec<bool> {
    let moves = |k: usize| run.blocks.iter().any(|block| block.end[k] != run.start[k]);
    let moving: Vec<bool> = (0..run.start.len()).map(moves).collect();
    let turns = machine.axes().iter().zip(&moving).any(|(axis, moves)| *moves && axis.kind == AxisKind::Rotary);
    if turns || !moving.contains(&true) { vec![true; moving.len()] } else { moving }
}

/// What every axis may leave its lines by, mm or rad, so that no head's tip strays by more than `path` and no tool axis turns by
/// more than `orientation`: half of the path for the linear axes together, half for the rotary ones by their levers; all of it for the
/// linear ones where no rotary axis moves. `None` where that is nothing: the axes then stop at every corner.
///
/// `levers` are those of each view over the program. Axes that are not `moving` stay, and stray by nothing.
pub fn blend_tolerance(
    tolerance: ControlTolerance,
    views: &[View<'_>],
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

/// How far the tip may be displaced by linear axes that are each displaced by 1: √n where they are at right angles whatever the
/// rotary axes do, else n.
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
    // The cosine between two of them is a + b·cos θ + c·sin θ in every rotary axis: 0 at three places of each, 0 everywhere.
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
mod tests {
    use facemill_inverse_kinematics::Axis;

    use crate::program_time::tolerance::*;

    struct Random(u64);

    impl Random {
        fn within(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Every machine of the collection, as each of its heads sees it.
    fn machines() -> Vec<Vec<Machine>> {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines");
        let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
        files.sort();
        files.iter().map(|f| Machine::heads_from_json(&std::fs::read(f).unwrap()).unwrap()).collect()
    }

    fn position(random: &mut Random, axes: &[Axis]) -> AxisValues {
        AxisValues::from_fn(axes.len(), |k| {
            let free = axes[k].endless || axes[k].max - axes[k].min > 1e9;
            let (low, high) = if free { (-3.0, 3.0) } else { (axes[k].min, axes[k].max) };
            random.within(low, high)
        })
    }

    fn run(positions: &[AxisValues]) -> Run {
        let block = |end: &AxisValues| ProgramBlock { end: *end, tip_time: 0.0, exact_stop: false };
        let blocks = positions[1..].iter().map(block).collect();
        Run { start: positions[0], blocks, is_rapid: false, vectors: Vec::new() }
    }

    #[test]
    fn axes_within_the_tolerance_take_no_tip_and_no_tool_axis_farther_than_the_control_may() {
        let mut random = Random(11);
        let given = ControlTolerance { path: 0.02, orientation: 3e-4 };
        for heads in machines() {
            let axes = heads[0].axes();
            let views: Vec<View<'_>> = heads.iter().map(|m| (m, 180.0)).collect();
            let positions: Vec<AxisValues> = (0..4).map(|_| position(&mut random, axes)).collect();
            let levers: Vec<Levers> = views.iter().map(|view| Levers::over(*view, &run(&positions))).collect();
            let most = blend_tolerance(given, &views, &levers, &vec![true; axes.len()]).unwrap();
            let mut worst = [0.0_f64; 2];
            for _ in 0..4000 {
                let move_index = (random.within(0.0, 3.0) as usize).min(2);
                let at = positions[move_index].lerp(&positions[move_index + 1], random.within(0.0, 1.0));
                let strayed = AxisValues::from_fn(axes.len(), |k| {
                    at[k] + if random.within(0.0, 1.0) < 0.5 { most[k] } else { -most[k] }
                });
                for (machine, length) in &views {
                    let (a, b) = (machine.cl_point(&at, *length), machine.cl_point(&strayed, *length));
                    worst[0] = worst[0].max((b.tip - a.tip).norm() / given.path);
                    worst[1] = worst[1].max(a.axis.cross(&b.axis).norm().asin() / given.orientation);
                }
            }
            assert!(worst.iter().all(|w| *w <= 1.0), "{}: {worst:?}", heads[0].name());
            // Not far from it either: signs and levers are seldom the worst at once.
            assert!(worst[0] > 0.5, "{}: {worst:?}", heads[0].name());
        }
    }

    /// The tip reaches the whole tolerance where two linear axes move, at a corner of what both may stray by.
    #[test]
    fn linear_axes_have_the_whole_tolerance_where_no_rotary_axis_moves() {
        let given = ControlTolerance { path: 0.02, orientation: 3e-4 };
        let machine = Machine::head_b_table_c().unwrap();
        let (home, views) = (machine.home(), [(&machine, 100.0)]);
        let mut end = home;
        let straying: Vec<usize> = (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Linear).take(2).collect();
        straying.iter().for_each(|&k| end[k] += 10.0);
        let run = run(&[home, end]);
        let levers = [Levers::over(views[0], &run)];
        let most = blend_tolerance(given, &views, &levers, &moving(&machine, &run)).unwrap();
        let mut strayed = home;
        straying.iter().for_each(|&k| strayed[k] += most[k]);
        let tip = |at: &AxisValues| machine.cl_point(at, 100.0).tip;
        assert!(((tip(&strayed) - tip(&home)).norm() - given.path).abs() < 1e-12);
        // The least turn of a rotary axis takes half of it.
        end[3] += 1e-9;
        end[4] += 1e-9;
        let turning = super::tests::run(&[home, end]);
        let half = blend_tolerance(given, &views, &levers, &moving(&machine, &turning)).unwrap();
        assert!(straying.iter().all(|&k| (half[k] - 0.01 / 3f64.sqrt()).abs() < 1e-12));
    }

    #[test]
    fn levers_between_positions_are_never_longer_than_told() {
        let mut random = Random(5);
        for heads in machines() {
            let view = (&heads[0], 180.0);
            let ends = [position(&mut random, heads[0].axes()), position(&mut random, heads[0].axes())];
            let Levers(told) = Levers::over(view, &run(&ends));
            for k in 0..=2000 {
                let at = levers_at(view, &ends[0].lerp(&ends[1], f64::from(k) / 2000.0));
                for axis in 0..at.len() {
                    assert!(at[axis] <= told[axis] && told[axis] < 1e5, "{}: {at:?} {told:?}", heads[0].name());
                }
            }
        }
    }

    #[test]
    fn no_tolerance_is_a_stop_at_every_corner() {
        let machine = Machine::head_b_table_c().unwrap();
        let views = [(&machine, 100.0)];
        let levers = [Levers::over(views[0], &run(&[machine.home(), machine.home()]))];
        for (path, orientation) in [(0.0, 0.0), (0.01, 0.0), (0.0, 1e-3)] {
            assert!(blend_tolerance(ControlTolerance { path, orientation }, &views, &levers, &[true; 5]).is_none());
        }
    }
}
