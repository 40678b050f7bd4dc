use facemill_inverse_kinematics::{AxisValues, MAX_AXES};

use super::knots::{CHORD, Grain, coarse, graded, shortest, smoothed};
use super::polyline::Polyline;

/// Polynomial of degree 4 by its powers, lowest first.
pub(crate) type Quartic = [f64; 5];

/// A cubic spline with continuous second derivative whose control points lie on a polyline,
/// straight at both ends.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    pub(crate) n_axes: usize,
    /// r at the ends of the pieces, with two more outside at either end.
    knots: Vec<f64>,
    /// Control points, one after the other: piece i has those from i to i + 3.
    control: Vec<f64>,
    /// Line of the polyline on which each control point lies, or the nearby one where the point
    /// lies on a chord.
    lines: Vec<u32>,
    /// Control points before the first index lie on the chord from the start, those from the second
    /// index on the chord to the end.
    chords: (usize, usize),
}

impl Spline {
    /// Creates the spline that stays within `tolerance` of the polyline in every axis at every r,
    /// with a first and a last piece that are straight and no longer than the grain allows.
    ///
    /// `None` where it has more pieces than `most`.
    pub(crate) fn along(polyline: &Polyline, tolerance: &AxisValues, grain: &Grain, most: f64) -> Option<Self> {
        let mut ends = smoothed(polyline, &graded(coarse(polyline, tolerance, grain)));
        loop {
            ends = graded(ends);
            // Their number only grows.
            if (ends.len() - 1) as f64 > most {
                return None;
            }
            let spline = Self::on(polyline, &ends);
            let mut line = 0;
            let mut next = Vec::with_capacity(ends.len());
            for i in 0..spline.pieces() {
                next.push(ends[i]);
                let long = ends[i + 1] - ends[i] > shortest(polyline.length());
                if long && spline.deviation(polyline, tolerance, i, &mut line) > 1.0 {
                    next.push(0.5 * (ends[i] + ends[i + 1]));
                }
            }
            next.push(ends[ends.len() - 1]);
            if next.len() == ends.len() {
                return Some(spline);
            }
            ends = next;
        }
    }

    /// Creates the spline with these ends of pieces.
    fn on(polyline: &Polyline, ends: &[f64]) -> Self {
        let n = ends.len() - 1;
        let (first, last) = (ends[1] - ends[0], ends[n] - ends[n - 1]);
        let mut knots = Vec::with_capacity(n + 5);
        knots.extend([ends[0] - 2.0 * first, ends[0] - first]);
        knots.extend_from_slice(ends);
        knots.extend([ends[n] + last, ends[n] + 2.0 * last]);
        let mut control = Vec::with_capacity((n + 3) * polyline.n_axes);
        let mut lines = Vec::with_capacity(n + 3);
        let mut line = 0;
        // Two ramps on one line need no chords.
        let reach = if n > 2 { (CHORD * first, ends[n] - CHORD * last) } else { (f64::NEG_INFINITY, f64::INFINITY) };
        let mut chords = (0, n + 3);
        for t in knots.windows(3) {
            let r = (t[0] + t[1] + t[2]) / 3.0;
            line = polyline.line_at(r, line);
            let point = if r < reach.0 {
                chords.0 = lines.len() + 1;
                polyline.on_chord(r, 0.0, reach.0)
            } else if r > reach.1 {
                chords.1 = chords.1.min(lines.len());
                polyline.on_chord(r, reach.1, ends[n])
            } else {
                polyline.on_line(r, line)
            };
            control.extend_from_slice(&point[..polyline.n_axes]);
            lines.push(line as u32);
        }
        Self { n_axes: polyline.n_axes, knots, control, lines, chords }
    }

    /// Returns the number of pieces.
    pub(crate) fn pieces(&self) -> usize {
        self.knots.len() - 5
    }

    /// Returns whether a piece lies on one line of the polyline.
    pub(crate) fn is_on_line(&self, piece: usize) -> bool {
        piece >= self.chords.0 && piece + 3 < self.chords.1 && self.lines[piece] == self.lines[piece + 3]
    }

    /// Returns whether a piece lies on a line or a chord.
    pub(crate) fn is_straight(&self, piece: usize) -> bool {
        self.is_on_line(piece) || piece + 3 < self.chords.0 || piece >= self.chords.1
    }

    /// Returns r at the start and the end of a piece.
    pub(crate) fn range(&self, piece: usize) -> (f64, f64) {
        (self.knots[piece + 2], self.knots[piece + 3])
    }

    /// Returns the lines of the polyline that take part in a piece, from the first to the last.
    pub(crate) fn lines(&self, piece: usize) -> std::ops::RangeInclusive<usize> {
        self.lines[piece] as usize..=self.lines[piece + 3] as usize
    }

    fn point(&self, index: usize) -> &[f64] {
        &self.control[index * self.n_axes..(index + 1) * self.n_axes]
    }

    /// Returns the Bézier points of a piece by axis (blossoms of the four control points).
    fn bezier(&self, piece: usize, axis: usize, share: &Shares) -> [f64; 4] {
        let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|k| self.point(piece + k)[axis]);
        let mix = |a: f64, b: f64, s: f64| a + (b - a) * s;
        let (b1, b2) = (mix(p1, p2, share.inner[0]), mix(p1, p2, share.inner[1]));
        let b0 = mix(mix(p0, p1, share.start[0]), b1, share.start[1]);
        let b3 = mix(b2, mix(p2, p3, share.end[0]), share.end[1]);
        [b0, b1, b2, b3]
    }

    fn shares(&self, piece: usize) -> Shares {
        let t: [f64; 6] = std::array::from_fn(|k| self.knots[piece + k]);
        let share = |low: usize, at: usize, high: usize| (t[at] - t[low]) / (t[high] - t[low]);
        Shares {
            start: [share(0, 2, 3), share(1, 2, 3)],
            inner: [share(1, 2, 4), share(1, 3, 4)],
            end: [share(2, 3, 5), share(2, 3, 4)],
        }
    }

    /// Returns the axes over a piece as polynomials in its own s.
    pub(crate) fn polynomials(&self, piece: usize, axes: &mut Vec<Quartic>) {
        axes.clear();
        let share = self.shares(piece);
        let straight = self.is_straight(piece);
        for axis in 0..self.n_axes {
            let [b0, b1, b2, b3] = self.bezier(piece, axis, &share);
            // Exactly straight, so rounding does not appear as curvature.
            let bend = [3.0 * (b1 - b0), 3.0 * ((b2 - b1) - (b1 - b0)), (b3 - b0) - 3.0 * (b2 - b1)];
            let [c1, c2, c3] = if straight { [b3 - b0, 0.0, 0.0] } else { bend };
            axes.push([b0, c1, c2, c3, 0.0]);
        }
    }

    /// Returns a bound of the distance between spline and polyline at the same r in a piece, as a
    /// fraction of the tolerance.
    ///
    /// Between two breaks (vertices of the polyline and the piece's ends) their difference is
    /// cubic, with the second derivative of the spline, which is at most its larger end value M. So
    /// it is at most the larger value at the breaks plus M·(distance of the breaks)²/8.
    fn deviation(&self, polyline: &Polyline, tolerance: &AxisValues, piece: usize, line: &mut usize) -> f64 {
        if self.is_on_line(piece) {
            return 0.0;
        }
        let (a, b) = self.range(piece);
        let share = self.shares(piece);
        let mut bezier = [[0.0; 4]; MAX_AXES];
        let mut bend = [0.0; MAX_AXES];
        for axis in 0..self.n_axes {
            let p = self.bezier(piece, axis, &share);
            let second = |k: usize| 6.0 * ((p[k + 2] - p[k + 1]) - (p[k + 1] - p[k])).abs() / (b - a).powi(2);
            bend[axis] = second(0).max(second(1)) / tolerance[axis];
            bezier[axis] = p;
        }
        let off = |r: f64, q: &[f64]| {
            let s = (r - a) / (b - a);
            (0..self.n_axes).map(|k| (cubic(&bezier[k], s) - q[k]).abs() / tolerance[k]).fold(0.0, f64::max)
        };
        *line = polyline.line_at(a, *line);
        let mut at = a;
        let mut before = off(a, &polyline.on_line(a, *line));
        let mut most: f64 = 0.0;
        let sharpest = bend.iter().copied().fold(0.0, f64::max);
        loop {
            let inside = *line + 1 < polyline.r.len() - 1 && polyline.r[*line + 1] < b;
            let next = if inside { polyline.r[*line + 1] } else { b };
            let after =
                if inside { off(next, polyline.vertex(*line + 1)) } else { off(b, &polyline.on_line(b, *line)) };
            most = most.max(before.max(after) + sharpest * (next - at).powi(2) / 8.0);
            if !inside || most > 1.0 {
                return most;
            }
            (*line, at, before) = (*line + 1, next, after);
        }
    }
}

/// Positions of the blossoms' arguments between the knots.
struct Shares {
    start: [f64; 2],
    inner: [f64; 2],
    end: [f64; 2],
}

fn cubic(b: &[f64; 4], s: f64) -> f64 {
    let t = 1.0 - s;
    t * t * (t * b[0] + 3.0 * s * b[1]) + s * s * (3.0 * t * b[2] + s * b[3])
}
