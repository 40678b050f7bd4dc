//! Passes around what is on a level.

use std::collections::BTreeMap;

use facemill_cl_data::CcPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::reach::Reach;
use crate::room::LevelRoom;

/// Settings of contours.
pub struct ContourSettings<'s> {
    /// Largest distance of a contour from the border of the room, mm.
    pub tolerance: f64,
    /// Largest distance of points, mm.
    pub max_step: f64,
    /// Farthest way from the stock's outside to a contour, mm.
    pub max_run_in: f64,
    /// Whether what is there is on the left of the feed.
    pub is_left: bool,
    /// Whether contours may be cut the other way where they begin outside of the stock then.
    pub is_reversible: bool,
    /// Whether material is left around the cutter with its tip at a point.
    pub is_needed: &'s (dyn Fn(&Point3<f64>) -> bool + Sync),
    /// Whether the upright cutter is outside of all stock with its tip at a point.
    pub is_open: &'s (dyn Fn(&Point3<f64>) -> bool + Sync),
}

/// Pass around a body.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourPass {
    /// CC points in cutting order.
    pub points: Vec<CcPoint>,
    /// Whether the body is on the left of the feed.
    pub is_left: bool,
}

/// Halvings of a side of the lattice up to the border of the room.
const HALVINGS: u32 = 12;

/// Turn of a contour at a point from which on it is two passes, rad: the tip would leave the way
/// between points whose feeds are farther apart.
const SHARP: f64 = 0.35;

/// Places of a closed contour at which a way from outside is sought, at most.
const STARTS: usize = 64;

/// Largest number of tested places on a way from outside.
const MOST_STEPS: f64 = 4_000.0;

/// Returns passes along the border of the room of an upright cutter: they cut what passes side by
/// side leave beside the bodies that are on a level. The tip is on the border, within tolerance.
///
/// Each begins outside of the stock, from where the tool comes on a straight line along its
/// tangent, if there is such a way.
pub fn contour_passes(room: &LevelRoom<'_>, reach: &Reach, settings: &ContourSettings<'_>) -> Vec<ContourPass> {
    let mut passes = Vec::new();
    for border in borders(room, reach) {
        // A smooth arc about the cutter has no sharp turn between chords this near to it.
        let smooth = room.radius() * (1.0 - (0.25 * SHARP).cos());
        let mut tips = simplified(&border, settings.tolerance.min(smooth));
        if !settings.is_left {
            tips.reverse();
        }
        let is_closed = border.len() > 2 && border.first() == border.last();
        if room.keeps_off() {
            tips = stepped(&tips, settings.max_step);
        }
        for run in needed_runs((room, reach.cell()), &tips, is_closed, settings) {
            passes.extend(parts(run).into_iter().filter_map(|part| pass_along(room, reach, part, settings)));
        }
    }
    passes
}

/// Tips of a contour in their order.
struct TipRun {
    tips: Vec<Point3<f64>>,
    /// Whether the last one is the first one, and the contour smooth there.
    is_closed: bool,
}

/// Returns the borders between nodes where the cutter fits and others, each with what is there
/// on the left. A closed one ends where it begins.
fn borders(room: &LevelRoom<'_>, reach: &Reach) -> Vec<Vec<Point3<f64>>> {
    // Sides of cells by their first node, and whether they go along x; each leads to the next.
    type Side = (usize, usize, bool);
    let [nx, ny] = reach.nodes();
    let mut next: BTreeMap<Side, Vec<Side>> = BTreeMap::new();
    let mut is_entered: BTreeMap<Side, bool> = BTreeMap::new();
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            // Corners counter-clockwise, and the side behind each.
            let fits = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| reach.fits_at(i, j));
            let sides: [Side; 4] = [(i, j, true), (i + 1, j, false), (i, j + 1, true), (i, j, false)];
            // With blocked nodes on the left, a border enters the cell where the corners go from
            // blocked to free, and leaves it where they go from free to blocked.
            let is_crossed = |k: usize, from: bool| fits[k] == from && fits[(k + 1) % 4] != from;
            for enter in (0..4).filter(|&k| is_crossed(k, false)) {
                let leave = (1..4).map(|step| (enter + step) % 4).rev().find(|&k| is_crossed(k, true));
                let Some(leave) = leave else { continue };
                next.entry(sides[enter]).or_default().push(sides[leave]);
                is_entered.insert(sides[leave], true);
                is_entered.entry(sides[enter]).or_insert(false);
            }
        }
    }
    let point = |&(i, j, along_x): &Side| {
        let other = if along_x { (i + 1, j) } else { (i, j + 1) };
        let (mut free, mut blocked) = (reach.node(i, j), reach.node(other.0, other.1));
        if !reach.fits_at(i, j) {
            std::mem::swap(&mut free, &mut blocked);
        }
        for _ in 0..HALVINGS {
            let middle = nalgebra::center(&free, &blocked);
            if room.fits(&middle) { free = middle } else { blocked = middle }
        }
        free
    };
    let mut found = Vec::new();
    // Open ones first: they begin where none leads to.
    let open: Vec<Side> = is_entered.iter().filter(|(_, entered)| !**entered).map(|(side, _)| *side).collect();
    let mut starts = open.into_iter();
    while let Some(start) = starts.next().or_else(|| next.iter().find(|(_, to)| !to.is_empty()).map(|(side, _)| *side))
    {
        let mut sides = vec![start];
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            sides.push(to);
            at = to;
        }
        let mut points: Vec<Point3<f64>> = sides.iter().map(point).collect();
        if at == start && points.len() > 1 {
            let last = points.len() - 1;
            points[last] = points[0];
        }
        if points.len() > 1 {
            found.push(points);
        }
    }
    found
}

/// Returns a line of fewer points, none of the others farther than the tolerance from it.
fn simplified(points: &[Point3<f64>], tolerance: f64) -> Vec<Point3<f64>> {
    let mut kept = vec![false; points.len()];
    let last = points.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let farthest = (from + 1..to)
            .map(|k| (k, distance_to_line(&points[k], &points[from], &points[to])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((k, _)) = farthest.filter(|(_, distance)| *distance > tolerance) {
            kept[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    let mut line: Vec<Point3<f64>> = points.iter().zip(kept).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect();
    line.dedup_by(|b, a| (*b - *a).norm() <= SAME_PLACE);
    line
}

/// Least distance of two points of a contour, mm.
const SAME_PLACE: f64 = 1e-3;

/// Distance of a point from a stretch; of one without length from its point.
fn distance_to_line(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let (along, to) = (b - a, p - a);
    let share = (to.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to - along * share).norm()
}

/// Returns the runs of a contour that are needed. A closed contour that is needed all around begins
/// at a sharp turn, if it has one.
fn needed_runs(
    (room, step): (&LevelRoom<'_>, f64),
    tips: &[Point3<f64>],
    is_closed: bool,
    settings: &ContourSettings<'_>,
) -> Vec<TipRun> {
    // Sides, not points: a long one passes material between its ends.
    let n = tips.len().saturating_sub(1);
    let is_needed: Vec<bool> = (0..n)
        .map(|k| {
            let way = tips[k + 1] - tips[k];
            let places = |step: f64| {
                let n = (way.norm() / step).ceil().clamp(1.0, MOST_STEPS) as usize;
                (0..=n).map(move |s| tips[k] + way * (s as f64 / n as f64))
            };
            let is_off = room.keeps_off() && places(step).any(|place| room.is_kept_off(&place));
            !is_off && places(settings.max_step).any(|place| (settings.is_needed)(&place))
        })
        .collect();
    if is_closed && n > 2 {
        if let Some(gap) = is_needed.iter().position(|needed| !needed) {
            // Begins at the gap, so that no run goes over the first point.
            let turned: Vec<Point3<f64>> = (0..=n).map(|k| tips[(gap + k) % n]).collect();
            let of_turned: Vec<bool> = (0..n).map(|k| is_needed[(gap + k) % n]).collect();
            return open_runs(&turned, &of_turned);
        }
        let turn = |k: usize| turn_at(&tips[(k + n - 1) % n], &tips[k], &tips[(k + 1) % n]);
        let corner = (0..n).find(|&k| turn(k) > SHARP);
        let from = corner.unwrap_or(0);
        let turned = (0..=n).map(|k| tips[(from + k) % n]).collect();
        return vec![TipRun { tips: turned, is_closed: corner.is_none() }];
    }
    open_runs(tips, &is_needed)
}

fn open_runs(tips: &[Point3<f64>], is_needed: &[bool]) -> Vec<TipRun> {
    let mut runs = Vec::new();
    let mut run: Vec<Point3<f64>> = Vec::new();
    for (k, needed) in is_needed.iter().enumerate() {
        if *needed {
            if run.is_empty() {
                run.push(tips[k]);
            }
            run.push(tips[k + 1]);
        } else if !run.is_empty() {
            runs.push(TipRun { tips: std::mem::take(&mut run), is_closed: false });
        }
    }
    if !run.is_empty() {
        runs.push(TipRun { tips: run, is_closed: false });
    }
    runs
}

fn turn_at(before: &Point3<f64>, at: &Point3<f64>, after: &Point3<f64>) -> f64 {
    (at - before).angle(&(after - at))
}

/// Returns the parts of a run between its sharp turns.
fn parts(run: TipRun) -> Vec<TipRun> {
    if run.is_closed {
        return vec![run];
    }
    let mut found = Vec::new();
    let mut part = Vec::new();
    for (k, tip) in run.tips.iter().enumerate() {
        part.push(*tip);
        let is_sharp = k > 0 && k + 1 < run.tips.len() && turn_at(&run.tips[k - 1], tip, &run.tips[k + 1]) > SHARP;
        if is_sharp {
            found.push(TipRun { tips: std::mem::replace(&mut part, vec![*tip]), is_closed: false });
        }
    }
    found.push(TipRun { tips: part, is_closed: false });
    found.retain(|part| part.tips.len() > 1);
    found
}

/// Returns the pass of a part, from outside of the stock if there is a way.
fn pass_along(
    room: &LevelRoom<'_>,
    reach: &Reach,
    part: TipRun,
    settings: &ContourSettings<'_>,
) -> Option<ContourPass> {
    let search = RunInSearch { room, settings, step: reach.cell() };
    let reversed = || TipRun { tips: part.tips.iter().rev().copied().collect(), is_closed: part.is_closed };
    let found = search.best(&part).map(|found| (found, settings.is_left));
    let found = found.or_else(|| {
        let turned = if settings.is_reversible { search.best(&reversed()) } else { None };
        turned.map(|found| (found, !settings.is_left))
    });
    let (tips, is_left) = found.unwrap_or_else(|| (part.tips.clone(), settings.is_left));
    let points = cc_points(room, &stepped(&tips, settings.max_step));
    (points.len() > 1).then_some(ContourPass { points, is_left })
}

/// Search of a way from outside of the stock to a contour.
struct RunInSearch<'s, 'a> {
    room: &'s LevelRoom<'a>,
    settings: &'s ContourSettings<'s>,
    step: f64,
}

impl RunInSearch<'_, '_> {
    /// Returns the tips of the shortest way from outside and along all of the part; `None` if there
    /// is none.
    fn best(&self, part: &TipRun) -> Option<Vec<Point3<f64>>> {
        let n = part.tips.len() - 1;
        let starts = if part.is_closed { (0..n).step_by(n.div_ceil(STARTS)).collect() } else { vec![0] };
        let way = |k: usize| {
            let before = if part.is_closed { part.tips[(k + n - 1) % n] } else { part.tips[0] };
            let tangent = tangent(&before, &part.tips[k], &part.tips[k + 1])?;
            self.outward(&part.tips[k], -tangent.into_inner()).map(|(length, from)| (k, length, from))
        };
        let found = starts.into_iter().filter_map(way).min_by(|a, b| a.1.total_cmp(&b.1));
        found.map(|(k, length, from)| {
            let along = (0..=n).map(|j| if part.is_closed { part.tips[(k + j) % n] } else { part.tips[j] });
            let run_in = (length > SAME_PLACE).then_some(from);
            run_in.into_iter().chain(along).collect()
        })
    }

    /// Returns the way from a tip in a direction to where the cutter is outside of the stock, and
    /// its end.
    fn outward(&self, tip: &Point3<f64>, direction: Vector3<f64>) -> Option<(f64, Point3<f64>)> {
        let n = (self.settings.max_run_in / self.step).ceil().clamp(1.0, MOST_STEPS) as usize;
        let at = |k: usize| tip + direction * (k as f64 * self.step);
        for k in 0..=n {
            let place = at(k);
            if k > 0 && !self.room.fits(&place) {
                return None;
            }
            if (self.settings.is_open)(&place) {
                return Some((k as f64 * self.step, place));
            }
        }
        None
    }
}

/// Returns the mean direction of two sides of a line.
fn tangent(before: &Point3<f64>, at: &Point3<f64>, after: &Point3<f64>) -> Option<Unit<Vector3<f64>>> {
    let unit = |v: Vector3<f64>| v.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros);
    Unit::try_new(unit(at - before) + unit(after - at), 1e-9)
}

/// Returns a line with further points, none farther apart than a step.
fn stepped(tips: &[Point3<f64>], max_step: f64) -> Vec<Point3<f64>> {
    let mut line = vec![tips[0]];
    for pair in tips.windows(2) {
        let way = pair[1] - pair[0];
        let n = (way.norm() / max_step).ceil().clamp(1.0, MOST_STEPS) as usize;
        line.extend((1..=n).map(|k| pair[0] + way * (k as f64 / n as f64)));
    }
    line
}

/// Returns the CC points of tips: each one rim ahead.
fn cc_points(room: &LevelRoom<'_>, tips: &[Point3<f64>]) -> Vec<CcPoint> {
    let normal = room.plane().axis();
    let last = tips.len() - 1;
    // A closed contour ends as it began: behind a run-in its ends have one direction each.
    let point = |k: usize| {
        let (before, after) = (&tips[k.saturating_sub(1)], &tips[(k + 1).min(last)]);
        let feed = tangent(before, &tips[k], after)?;
        let position = tips[k] + feed.into_inner() * room.rim_radius();
        CcPoint::new(position, normal.into_inner(), feed.into_inner()).ok()
    };
    (0..=last).filter_map(point).collect()
}
