//! Full turns of limited rotary axes, cut by cut, over a whole operation.

use std::f64::consts::TAU;

use facemill_cutter_location::{Hints, PoseTest, SearchSettings, limited_rotaries, rewound_axis};
use facemill_inverse_kinematics::{AxisValues, Machine};

use crate::linearity::turned_near;
use crate::segments::{Cut, Filler, PassSegment, PosePair};

/// Number of windings tried for each cut, those nearest to home: a cable is never wound farther,
/// though a limit may allow it.
const MOST_WINDINGS: usize = 64;

/// Largest excess of a value over a limit, rad, that the solution of a pose treats as rounding and
/// cuts off.
const LIMIT_SLACK: f64 = 2e-13;

/// Way of the tip, mm, below which two poses on both sides of a limit are one: a thousandth of the
/// resolution of the finest words.
const SAME_PLACE: f64 = 1e-6;

/// Halvings toward a limit: enough to exhaust a double.
const MAX_HALVINGS: u32 = 60;

/// Breaks in cuts, turns on links, time of the slowest axis, s: compared in this order.
type Cost = (u32, u32, f64);

/// Winds pieces with limited rotary axes for the fewest breaks in cuts, then the fewest turns on
/// links, then the least travel time; from `start`, the end of the operation before, or else from
/// home.
///
/// Within a piece an axis does not turn back. Where no winding holds all of it, the piece ends
/// there and continues as another piece, which begins at or before the last cut of the first one;
/// at a limit that only one pose reaches, at poses 1e-6 mm apart. Exact for the given cuts:
/// Bellman's recursion over all windings of all cuts. Endless axes keep their values.
pub fn wound(
    test: &PoseTest<'_>,
    fallback: Option<&SearchSettings>,
    pieces: Vec<PassSegment>,
    start: Option<AxisValues>,
) -> Vec<PassSegment> {
    let machine = test.cell.machine;
    if limited_rotaries(machine).next().is_none() {
        return pieces;
    }
    let unwrapped: Vec<Vec<AxisValues>> = pieces.iter().map(|p| unwrapped(test, &p.cuts)).collect();
    let chosen = windings(machine, &unwrapped, start.as_ref());
    let all = pieces.into_iter().zip(chosen).flat_map(|(piece, at)| parts(test, fallback, piece, &at));
    all.collect()
}

/// Returns axis values of cuts, each at the turns nearest to those of the cut before, within the
/// limits or not.
fn unwrapped(test: &PoseTest<'_>, cuts: &[Cut]) -> Vec<AxisValues> {
    let mut last: Option<AxisValues> = None;
    cuts.iter()
        .map(|cut| {
            let axes = cut.pose.configuration.axes;
            let axes = last.map_or(axes, |last| turned_near(test, &axes, &last));
            last = Some(axes);
            axes
        })
        .collect()
}

/// Returns the same position with whole turns of its limited axes added, for every number that the
/// limits allow, the nearest to home first.
fn nodes(machine: &Machine, values: &AxisValues) -> Vec<AxisValues> {
    let mut all = vec![*values];
    for k in limited_rotaries(machine) {
        let axis = &machine.axes()[k];
        let fewest = ((axis.min - LIMIT_SLACK - values[k]) / TAU).ceil();
        let most = ((axis.max + LIMIT_SLACK - values[k]) / TAU).floor();
        let nearest = ((axis.home - values[k]) / TAU).round();
        let reach = MOST_WINDINGS as f64;
        let (fewest, most) = (fewest.max(nearest - reach), most.min(nearest + reach));
        let n = (most - fewest + 1.0).max(0.0) as usize;
        let turned = |q: &AxisValues, turn: usize| {
            let (mut q, turn) = (*q, fewest + turn as f64);
            // Exactly unchanged where nothing turns.
            q[k] = if turn == 0.0 { values[k] } else { (values[k] + TAU * turn).clamp(axis.min, axis.max) };
            q
        };
        all = all.iter().flat_map(|q| (0..n).map(|turn| turned(q, turn)).collect::<Vec<_>>()).collect();
    }
    let home = machine.home();
    all.sort_by(|a, b| time(machine, &home, a).total_cmp(&time(machine, &home, b)));
    all.truncate(MOST_WINDINGS);
    all
}

/// Returns the time of travel of the slowest limited axis, s.
fn time(machine: &Machine, from: &AxisValues, to: &AxisValues) -> f64 {
    let time = |k: usize| (to[k] - from[k]).abs() / machine.axes()[k].max_velocity;
    limited_rotaries(machine).map(time).fold(0.0, f64::max)
}

/// Returns the end of a rapid with endless axes a whole turn nearer to home than the nearest turn,
/// where the slowest axis takes no longer for it: the other way round costs nothing. `None` where
/// there is none.
pub fn unwound(machine: &Machine, from: &AxisValues, to: &AxisValues) -> Option<AxisValues> {
    let time = machine.travel_time(from, to);
    let mut turned = *to;
    for (k, axis) in machine.axes().iter().enumerate().filter(|(_, a)| a.endless && !a.rolls_over()) {
        let wound = to[k] - axis.home;
        let back = to[k] - TAU * wound.signum();
        let is_nearer = (back - axis.home).abs() < wound.abs() - LEAST_UNWOUND;
        if is_nearer && (back - from[k]).abs() <= axis.max_velocity * time {
            turned[k] = back;
        }
    }
    (turned != *to).then_some(turned)
}

/// Least gain of nearness to home for a turn back, rad: at half a turn either way is equally good.
const LEAST_UNWOUND: f64 = 1e-6;

/// Returns the cost from one cut to the next: on a link, or along a piece, where an axis turns with
/// the tool, or turns back.
fn cost(machine: &Machine, on_link: bool, from: &AxisValues, to: &AxisValues) -> Cost {
    let turns = u32::from(rewound_axis(machine, from, to).is_some());
    match (on_link, turns) {
        (true, _) => (0, turns, time(machine, from, to)),
        (false, 0) => (0, 0, 0.0),
        (false, _) => (1, 0, time(machine, from, to)),
    }
}

/// Returns the chosen position of every cut.
pub fn windings(machine: &Machine, pieces: &[Vec<AxisValues>], start: Option<&AxisValues>) -> Vec<Vec<AxisValues>> {
    let layers: Vec<(bool, Vec<AxisValues>)> = pieces
        .iter()
        .flat_map(|cuts| cuts.iter().enumerate())
        .map(|(k, values)| (k == 0, nodes(machine, values)))
        .collect();
    let Some((_, first)) = layers.first() else { return pieces.to_vec() };
    let home = machine.home();
    let mut costs: Vec<Cost> = first
        .iter()
        .map(|q| start.map_or_else(|| (0, 0, time(machine, &home, q)), |start| cost(machine, true, start, q)))
        .collect();
    let mut before: Vec<Vec<u16>> = Vec::with_capacity(layers.len());
    for pair in layers.windows(2) {
        let ((_, from), (on_link, to)) = (&pair[0], &pair[1]);
        let best = |q: &AxisValues| {
            let ways = from.iter().zip(&costs).map(|(p, so_far)| {
                let edge = cost(machine, *on_link, p, q);
                (so_far.0 + edge.0, so_far.1 + edge.1, so_far.2 + edge.2)
            });
            // The first of equals.
            (0_u16..).zip(ways).reduce(|a, b| if b.1 < a.1 { b } else { a })
        };
        // A tested cut has at least one winding.
        let (from, found): (Vec<u16>, Vec<Cost>) = to.iter().map(|q| best(q).unwrap_or_default()).unzip();
        before.push(from);
        costs = found;
    }
    let cheapest = (0..costs.len()).reduce(|a, b| if costs[b] < costs[a] { b } else { a });
    let mut node = cheapest.unwrap_or(0);
    let mut chosen = Vec::with_capacity(layers.len());
    for (k, (_, nodes)) in layers.iter().enumerate().rev() {
        chosen.push(nodes.get(node).copied());
        if k > 0 {
            node = before[k - 1].get(node).map_or(0, |&n| usize::from(n));
        }
    }
    chosen.reverse();
    let mut chosen = chosen.into_iter();
    pieces.iter().map(|cuts| cuts.iter().map(|q| chosen.next().flatten().unwrap_or(*q)).collect()).collect()
}

/// Splits a piece at these positions into the parts between which an axis turns back.
fn parts(
    test: &PoseTest<'_>,
    fallback: Option<&SearchSettings>,
    piece: PassSegment,
    at: &[AxisValues],
) -> Vec<PassSegment> {
    let machine = test.cell.machine;
    let PassSegment { copy, pass, uncut_left, curve, cuts, .. } = piece;
    let filler = Filler::new(test, fallback, curve);
    let mut runs: Vec<Vec<Cut>> = vec![Vec::new()];
    let mut last: Option<Cut> = None;
    for (cut, axes) in cuts.iter().zip(at) {
        let cut = placed(cut, axes);
        if let Some(last) = last.filter(|l| rewound_axis(machine, &l.pose.configuration.axes, axes).is_some()) {
            let (end, begin) = turning_place(test, &filler, &last, &cut);
            runs.last_mut().into_iter().for_each(|run| run.extend(end));
            runs.push(begin.into_iter().collect());
        }
        runs.last_mut().into_iter().for_each(|run| run.push(cut));
        last = Some(cut);
    }
    let is_whole = runs.len() == 1;
    let part = |k: usize| if is_whole { None } else { Some(k as u32) };
    let of = |(k, cuts)| PassSegment { copy, pass, cuts, uncut_left, curve, part: part(k) };
    runs.into_iter().enumerate().map(of).collect()
}

/// Returns a cut with the machine at the same position by other turns.
fn placed(cut: &Cut, axes: &AxisValues) -> Cut {
    let mut cut = *cut;
    cut.pose.configuration.axes = *axes;
    cut
}

/// Returns the pose at another one's winding, where that is within the limits.
fn at_winding_of(test: &PoseTest<'_>, cut: &Cut, like: &Cut) -> Option<Cut> {
    let mut axes = turned_near(test, &cut.pose.configuration.axes, &like.pose.configuration.axes);
    for k in limited_rotaries(test.cell.machine) {
        let axis = &test.cell.machine.axes()[k];
        let inside = axes[k].clamp(axis.min, axis.max);
        if (axes[k] - inside).abs() > LIMIT_SLACK {
            return None;
        }
        axes[k] = inside;
    }
    Some(placed(cut, &axes))
}

/// Returns the cut to add at the end of the part that ends with `last`, if any, and the one to
/// begin the next part with before `next`: the same pose at both windings; at a limit that only one
/// pose reaches, the poses next to it.
fn turning_place(test: &PoseTest<'_>, filler: &Filler<'_, '_>, last: &Cut, next: &Cut) -> (Option<Cut>, Option<Cut>) {
    let inserted = |cut: Cut| Cut { inserted: true, ..cut };
    if let Some(begin) = at_winding_of(test, last, next) {
        return (None, Some(inserted(begin)));
    }
    if let Some(end) = at_winding_of(test, next, last) {
        return (Some(inserted(end)), None);
    }
    let (mut low, mut high) = (*last, *next);
    let mut hints = Hints::default();
    for _ in 0..MAX_HALVINGS {
        if (high.pose.cl.tip - low.pose.cl.tip).norm() < SAME_PLACE {
            break;
        }
        let Some(middle) = filler.middle(&PosePair { from: &low, to: &high }, &mut hints) else { break };
        match (at_winding_of(test, &middle, last), at_winding_of(test, &middle, next)) {
            (Some(end), Some(begin)) => return (Some(end), Some(begin)),
            (Some(end), None) => low = end,
            (None, Some(begin)) => high = begin,
            (None, None) => break,
        }
    }
    let beside = |cut: Cut, known: &Cut| (cut.pose.cl != known.pose.cl).then_some(cut);
    (beside(low, last), beside(high, next))
}
