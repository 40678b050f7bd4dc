use facemill_cl_data::CcPoint;
use nalgebra::{Unit, Vector3};

use crate::layout::trace::{Curve, TracePoint};
use crate::strategy::settings::LaySettings;
use crate::strategy::size::PointsLeft;

/// A curve with points put on it, the higher levels to the left.
#[derive(Clone, Debug)]
pub(crate) struct ResampledPiece {
    pub(crate) points: Vec<CcPoint>,
    pub(crate) length: f64,
    pub(crate) closed: bool,
    /// Largest estimated distance of the smooth section from the straight lines between the points,
    /// mm.
    pub(crate) chord: f64,
}

/// Limits of the difference between two points in a row.
#[derive(Clone, Copy)]
struct Limits {
    chord: f64,
    step: f64,
    turn: f64,
}

impl Limits {
    fn of(settings: &LaySettings) -> Self {
        Self {
            chord: settings.chord_tolerance,
            step: settings.max_step,
            turn: settings.max_normal_change.unwrap_or(f64::INFINITY),
        }
    }

    /// The limits of a pass that needs 1 / `factor` times as many points.
    fn scaled(self, factor: f64) -> Self {
        Self { chord: self.chord * factor * factor, step: self.step * factor, turn: self.turn * factor }
    }
}

/// Puts points on a curve: the first and the last at its ends (less the margin), and as few between
/// as the limits ask for, spread so that the last gap is no smaller than it has to be. `None` where
/// the curve is too short.
///
/// # Errors
/// When it needs more points than are left.
pub(crate) fn resample(
    curve: &Curve,
    settings: &LaySettings,
    left: &PointsLeft,
) -> Result<Option<ResampledPiece>, NoPointsLeft> {
    let Some((start, end)) = ends(curve, settings) else { return Ok(None) };
    let mut places = spread(curve, settings, left, start, end).ok_or(NoPointsLeft)?;
    // Places of a curve that leaves its triangle for a while fall together.
    places.dedup_by(|b, a| a.position == b.position);
    let chord = places.windows(2).map(|w| chord_between(curve, &w[0], &w[1])).fold(0.0, f64::max);
    let points: Vec<CcPoint> = places.iter().filter_map(|p| cc_point(curve, p)).collect();
    Ok((points.len() >= 2).then_some(ResampledPiece { points, length: end - start, closed: curve.closed, chord }))
}

/// There are no points left for a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoPointsLeft;

/// Ways at which a pass on the curve begins and ends; `None` where it is too short for one.
fn ends(curve: &Curve, settings: &LaySettings) -> Option<(f64, f64)> {
    let margin = if curve.closed || curve.winds { 0.0 } else { settings.edge_margin };
    let (start, end) = (margin, curve.length() - margin);
    // Shorter than the least gap it is no pass, whatever the settings say.
    (end - start >= settings.min_pass_length.max(least_gap(settings))).then_some((start, end))
}

/// Length of the pass on the curve, mm; 0 where it is too short for one.
pub(crate) fn pass_length(curve: &Curve, settings: &LaySettings) -> f64 {
    ends(curve, settings).map_or(0.0, |(start, end)| end - start)
}

/// Length of the first points of the pass on the curve, at most so many, and their number.
pub(crate) fn beginning(curve: &Curve, settings: &LaySettings, most: usize) -> (f64, usize) {
    let Some((start, end)) = ends(curve, settings) else { return (0.0, 0) };
    let mut n = 0;
    let mut here = curve.at(start);
    while here.way < end && n < most {
        here = next_place(curve, Limits::of(settings), least_gap(settings), &here, end);
        n += 1;
    }
    (here.way - start, n)
}

/// Points are never nearer than this along a pass, mm: over such a way no surface leaves the chord
/// by more than the tolerance, and at a crease, where no gap is small enough for the turn, it keeps
/// the number of points finite.
fn least_gap(settings: &LaySettings) -> f64 {
    (0.5 * settings.chord_tolerance).min(1e-3 * settings.max_step)
}

fn spread(curve: &Curve, settings: &LaySettings, left: &PointsLeft, start: f64, end: f64) -> Option<Vec<TracePoint>> {
    let limits = Limits::of(settings);
    let gap = least_gap(settings);
    let mut best = walk(curve, limits, gap, start, end, left.get())?;
    left.take(best.len())?;
    // The same number of points with tighter limits: six halvings leave the last gap within 2 % of
    // full.
    let (mut low, mut high) = (0.5, 1.0);
    for _ in 0..6 {
        let factor = 0.5 * (low + high);
        match walk(curve, limits.scaled(factor), gap, start, end, best.len()) {
            Some(tighter) => (high, best) = (factor, tighter),
            None => low = factor,
        }
    }
    Some(best)
}

/// Goes along the curve in the longest gaps that keep to the limits. `None` when there are more
/// than `max_points`.
fn walk(
    curve: &Curve,
    limits: Limits,
    least_gap: f64,
    start: f64,
    end: f64,
    max_points: usize,
) -> Option<Vec<TracePoint>> {
    let mut places = vec![curve.at(start)];
    let mut here = places[0];
    while here.way < end {
        here = next_place(curve, limits, least_gap, &here, end);
        places.push(here);
        if places.len() > max_points {
            return None;
        }
    }
    Some(places)
}

fn next_place(curve: &Curve, limits: Limits, least_gap: f64, here: &TracePoint, end: f64) -> TracePoint {
    // Rounding must not make eleven steps out of ten.
    let step = limits.step * (1.0 + 1e-12);
    // A closed curve needs three points, or its chords have no inside.
    let step = if curve.closed { step.min(curve.length() / 3.0) } else { step };
    let fit = longest_fit(curve, Limits { step, ..limits }, here, end);
    let way = fit.way.max(here.way + least_gap);
    // Rather two halves than a crumb at the end.
    let way = match end - way {
        rest if rest <= 0.0 => end,
        rest if rest >= least_gap => way,
        _ if end - here.way < 2.0 * least_gap => end,
        _ => 0.5 * (here.way + end),
    };
    if way == fit.way { fit } else { curve.at(way) }
}

/// The farthest place from `here` that keeps to the limits, to a thousandth of the longest step.
fn longest_fit(curve: &Curve, limits: Limits, here: &TracePoint, end: f64) -> TracePoint {
    let fitting = |way: f64| Some(curve.at(way)).filter(|place| within(curve, limits, here, place));
    let farthest = (here.way + limits.step).min(end);
    if let Some(place) = fitting(farthest) {
        return place;
    }
    let (mut low, mut high) = (*here, farthest);
    for _ in 0..10 {
        let middle = 0.5 * (low.way + high);
        match fitting(middle) {
            Some(place) => low = place,
            None => high = middle,
        }
    }
    low
}

fn within(curve: &Curve, limits: Limits, a: &TracePoint, b: &TracePoint) -> bool {
    (b.position - a.position).norm() <= limits.step * (1.0 + 1e-9)
        && (limits.turn == f64::INFINITY || turns_within(curve, limits.turn, a, b))
        && chord_between(curve, a, b) <= limits.chord
}

/// Whether the normals up to `b` are at no larger angle than `turn` to that at `a`.
fn turns_within(curve: &Curve, turn: f64, a: &TracePoint, b: &TracePoint) -> bool {
    let nodes = curve.between(a, b).flat_map(|(_, n)| n);
    !nodes.chain([b.normal]).any(|n| n.angle(&a.normal) > turn)
}

/// Estimates the deviation of the smooth section from the straight line from `a` to `b`, mm.
///
/// Along the surface, the nodes between give it. Across it, facets hide the bend of the surface
/// inside them, but the normals show it: a line of length L whose ends' normals differ by Δθ in the
/// plane of the line is the chord of an arc of height L·Δθ/8. The larger of the two counts. The
/// normals at an open border know one side only, so on facets there the estimate is down to half of
/// what is true.
fn chord_between(curve: &Curve, a: &TracePoint, b: &TracePoint) -> f64 {
    let line = b.position - a.position;
    let length = line.norm();
    let Some(along) = Unit::try_new(line, 0.0) else { return 0.0 };
    // Sines of the angles of normals to the line: their order is that of the angles.
    let sine = |n: &Unit<Vector3<f64>>| n.dot(&along).clamp(-1.0, 1.0);
    let (mut lowest, mut highest) = (sine(&a.normal).min(sine(&b.normal)), sine(&a.normal).max(sine(&b.normal)));
    let (mut across, mut beside_sq) = (0.0f64, 0.0f64);
    for (node, normals) in curve.between(a, b) {
        let off = node - a.position;
        let off = off - along.into_inner() * off.dot(&along).clamp(0.0, length);
        let up = off.dot(&normals[0]).abs();
        across = across.max(up);
        beside_sq = beside_sq.max(off.norm_squared() - up * up);
        for s in normals.iter().map(sine) {
            (lowest, highest) = (lowest.min(s), highest.max(s));
        }
    }
    let bend = length * (highest.asin() - lowest.asin()) / 8.0;
    across.max(bend).hypot(beside_sq.sqrt() + curve.bulge_between(a, b))
}

fn cc_point(curve: &Curve, place: &TracePoint) -> Option<CcPoint> {
    let smooth = CcPoint::new(place.position, place.normal.into_inner(), curve.tangent(place));
    // The chord lies in the facet, so at right angles to its normal.
    smooth.ok().or_else(|| {
        let facet = curve.facet_normal(place)?;
        CcPoint::new(place.position, facet.into_inner(), curve.chord_direction(place)).ok()
    })
}
