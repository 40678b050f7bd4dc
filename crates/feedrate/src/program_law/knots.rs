use facemill_inverse_kinematics::{AxisValues, MAX_AXES};

use super::polyline::{Point, Polyline};

/// Largest lengths of spans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grain {
    /// Length at the speeds of the tip feed, s.
    pub(crate) span: f64,
    /// Length of the first and the last piece of a section, in r.
    pub(crate) ramp: f64,
}

/// Largest ratio of neighbouring pieces, with a little for rounding.
const GRADING: f64 = 2.01;

/// Length of the end chords in pieces. The spline has to be straight on the first and the last
/// piece; as pieces at most double, the control points of these reach less than this many times as
/// far.
pub(crate) const CHORD: f64 = 4.0;

/// Returns the length of the first or last piece for which the chord over [`CHORD`] times that
/// length stays within half the tolerance.
fn ramp_length(polyline: &Polyline, tolerance: &AxisValues, ramp: f64, at_end: bool) -> f64 {
    let length = polyline.length();
    let mut w = ramp.min(length / (2.0 * CHORD));
    loop {
        let (a, b) = if at_end { (length - CHORD * w, length) } else { (0.0, CHORD * w) };
        let (first, last) = (polyline.line_at(a, 0), polyline.line_at(b, polyline.lines()));
        let off = |v: usize| {
            let (p, q) = (polyline.on_chord(polyline.r[v], a, b), polyline.vertex(v));
            (0..polyline.n_axes).map(|k| (p[k] - q[k]).abs() / tolerance[k]).fold(0.0, f64::max)
        };
        let one_line = first == last || (at_end && first + 1 == last && b <= polyline.r[last]);
        if one_line || (first + 1..=last).all(|v| off(v) <= 0.5) {
            return w;
        }
        w *= 0.5;
    }
}

/// Returns ends of pieces for which a uniform spline with pieces of these lengths would stay within
/// half the tolerance.
pub(crate) fn coarse(polyline: &Polyline, tolerance: &AxisValues, grain: &Grain) -> Vec<f64> {
    let length = polyline.length();
    let ramp = grain.ramp;
    let last = polyline.lines() - 1;
    let (head, tail) = if last == 0 {
        (ramp.min(0.5 * length), ramp.min(0.5 * length))
    } else {
        (ramp_length(polyline, tolerance, ramp, false), ramp_length(polyline, tolerance, ramp, true))
    };
    let (from, to) = (head, length - tail);
    let mut ends = vec![0.0, head];
    let middle = to - from;
    // Two ramps may share one line.
    if middle > 1e-9 * length {
        let mut line = 0;
        let mut stack = vec![(from, to)];
        while let Some((a, b)) = stack.pop() {
            line = polyline.line_at(a, line);
            let rough = || is_rough(polyline, tolerance, (a, b), line) || is_uneven(polyline, grain.span, (a, b), line);
            if b - a > shortest(length) && rough() {
                let mid = 0.5 * (a + b);
                stack.push((mid, b));
                stack.push((a, mid));
            } else {
                ends.push(b);
            }
        }
    } else {
        ends[1] = 0.5 * length;
    }
    ends.push(length);
    ends
}

/// Returns the length below which pieces are not halved, because rounding would count as bending:
/// 1e-8 mm at 100 mm/s, on long programs more.
pub(crate) fn shortest(length: f64) -> f64 {
    1e-10 + 1e-13 * length
}

/// Returns whether an interval has to be halved; `line` is the one at its start.
fn is_rough(polyline: &Polyline, tolerance: &AxisValues, (a, b): (f64, f64), line: usize) -> bool {
    let w = b - a;
    let mid = 0.5 * (a + b);
    let second = |p: &[f64], r: f64| {
        let (low, high): (Point, Point) = (polyline.at(r - w, line), polyline.at(r + w, line));
        (0..polyline.n_axes).map(|k| ((high[k] - p[k]) - (p[k] - low[k])).abs() / tolerance[k]).fold(0.0, f64::max)
    };
    let bent = |d: f64| d > 0.8 * 6.0;
    if [a, mid, b].into_iter().any(|r| bent(second(&polyline.at(r, line), r))) {
        return true;
    }
    let inside = (line + 1..polyline.lines()).take_while(|&v| polyline.r[v] < b);
    inside.into_iter().any(|v| bent(second(polyline.vertex(v), polyline.r[v])))
}

/// Returns whether the caps of the lines in an interval differ so much that the least of them must
/// not apply to all of it.
fn is_uneven(polyline: &Polyline, span: f64, (a, b): (f64, f64), line: usize) -> bool {
    let lines = (line..polyline.lines()).take_while(|&k| polyline.r[k] < b);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for k in lines {
        // Without a cap the axes limit ṙ to at most the root of their number.
        let cap = polyline.caps[k].min(MAX_AXES as f64);
        (least, most) = (least.min(cap), most.max(cap));
    }
    most > EVEN * least && b - a > span * least.min(1.0)
}

/// Largest ratio of caps on one piece, unless it is as short as a span.
const EVEN: f64 = 1.02;

/// Returns the same ends with more between them, until neighbouring pieces differ by a factor of 2
/// at most. The first and the last one stay: nothing bends there.
pub(crate) fn graded(ends: Vec<f64>) -> Vec<f64> {
    let mut ends = ends;
    loop {
        let n = ends.len();
        ends = graded_forward(&ends, 1.0);
        ends.reverse();
        ends = graded_forward(&ends, -1.0);
        ends.reverse();
        if ends.len() == n {
            return ends;
        }
    }
}

/// Halves spans that are longer than twice the one before them; `sign` is −1 where the ends
/// descend.
fn graded_forward(ends: &[f64], sign: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(ends.len());
    out.push(ends[0]);
    let mut before = f64::INFINITY;
    let mut stack = Vec::new();
    for (k, pair) in ends.windows(2).enumerate() {
        if k == 0 || k + 2 == ends.len() {
            before = sign * (pair[1] - pair[0]);
            out.push(pair[1]);
            continue;
        }
        stack.push((pair[0], pair[1]));
        while let Some((a, b)) = stack.pop() {
            let width = sign * (b - a);
            if width > GRADING * before {
                let mid = 0.5 * (a + b);
                stack.push((mid, b));
                stack.push((a, mid));
            } else {
                before = width;
                out.push(b);
            }
        }
    }
    out
}

/// Growth of neighbouring pieces where the path bends. A larger one bends the spline more than the
/// path; a smaller one needs more pieces.
const SMOOTH: f64 = 1.25;

/// Returns ends of pieces whose lengths change slowly where the path bends, and are about those
/// given there or shorter. The first and the last piece stay.
pub(crate) fn smoothed(polyline: &Polyline, ends: &[f64]) -> Vec<f64> {
    let n = ends.len() - 1;
    if n < 4 {
        return ends.to_vec();
    }
    let widths = slowly_changing(polyline, ends);
    let (mut at, mut k) = (ends[1], 1);
    let mut out = vec![ends[0], at];
    loop {
        while k + 2 < n && at >= ends[k + 1] {
            k += 1;
        }
        let width = between(ends, &widths, k, at);
        // The rest makes one piece, of up to half as much again.
        if at + 1.5 * width >= ends[n - 1] {
            break;
        }
        at += width;
        out.push(at);
    }
    out.extend([ends[n - 1], ends[n]]);
    out
}

/// Returns lengths of pieces that differ by at most the factor [`SMOOTH`] between neighbours where
/// the path bends.
fn slowly_changing(polyline: &Polyline, ends: &[f64]) -> Vec<f64> {
    let n = ends.len() - 1;
    let mut widths: Vec<f64> = ends.windows(2).map(|e| e[1] - e[0]).collect();
    let mut line = 0;
    let mut bends = Vec::with_capacity(n);
    for (e, w) in ends.windows(2).zip(&widths) {
        line = polyline.line_at(e[0] - w, line);
        bends.push(polyline.line_at(e[1] + w, line) != line);
    }
    for k in 2..n - 1 {
        if bends[k] && bends[k - 1] {
            widths[k] = widths[k].min(SMOOTH * widths[k - 1]);
        }
    }
    for k in (1..n - 2).rev() {
        if bends[k] && bends[k + 1] {
            widths[k] = widths[k].min(SMOOTH * widths[k + 1]);
        }
    }
    widths
}

/// Returns the length of pieces at `at` in piece `k`, linear between the middles of pieces.
fn between(ends: &[f64], width: &[f64], k: usize, at: f64) -> f64 {
    let middle = |k: usize| 0.5 * (ends[k] + ends[k + 1]);
    let (a, b) = if at < middle(k) { (k.saturating_sub(1).max(1), k) } else { (k, (k + 1).min(width.len() - 2)) };
    if a == b {
        return width[a];
    }
    let share = (at - middle(a)) / (middle(b) - middle(a));
    width[a] + (width[b] - width[a]) * share
}
