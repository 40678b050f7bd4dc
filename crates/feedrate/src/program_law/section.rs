use rayon::prelude::*;

use super::polyline::Polyline;
use super::spans::Spans;
use super::spline::Quartic;
use crate::time_law::barrier::{Pinned, Problem, Reach, Scaled, SolverSpan, end_weights};
use crate::time_law::certify::{speed_bound, stretch};
use crate::time_law::descent::{Effort, lower};
use crate::time_law::law::SquaredSpeed;

/// Number of spans solved at once. Longer windows have fewer borders; shorter ones need fewer steps
/// each.
const WINDOW: usize = 256;

/// The motion between two stops.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) path: Spans,
    pub(crate) paces: Vec<SquaredSpeed>,
}

/// Constants during the solution of a section.
struct Task<'a> {
    path: &'a Spans,
    scaled: &'a Scaled,
    /// Largest ṙ allowed by the tip feed on every line of the polyline.
    caps: &'a [f64],
    /// Length of every span in the path variable.
    h: Vec<f64>,
    /// Factor by which the limits of every span are tightened.
    tightening: Vec<f64>,
    /// The problem of all spans where they are one window.
    kept: Option<Problem>,
}

/// A motion within every limit. It stores its unknowns instead of its paces, which take three times
/// the memory.
struct Certified {
    x: Vec<f64>,
    /// Factor by which it is slower than its unknowns.
    stretch: f64,
    /// Time, s.
    time: f64,
}

/// Passes over all windows where there are several: the end of the first window, and the effort.
/// The second pass speeds up the parts that the first one kept fixed at the windows' ends.
const SHIFTED: [(usize, Effort); 2] =
    [(WINDOW, Effort { steps: 30, gaps: (0.1, 0.02) }), (WINDOW / 2, Effort { steps: 20, gaps: (0.02, 0.001) })];

/// The pass where there is one window.
const ALONE: [(usize, Effort); 1] = [(WINDOW, Effort { steps: 40, gaps: (0.1, 0.001) })];

/// Passes that correct the excess found by the certificate, and the excess of that correction.
const LAST: [(usize, Effort); 2] = [
    (WINDOW / 4, Effort { steps: 8, gaps: (0.001, 0.001) }),
    (3 * WINDOW / 4, Effort { steps: 8, gaps: (0.001, 0.001) }),
];

/// Stretch of time from which on limits are tightened and the motion is computed again.
const BEYOND: f64 = 1.01;

/// Fraction of acceleration and jerk in the initial motion.
const LEISURE: f64 = 0.3;

/// Certificates below this are not distinguished.
const FLOOR: f64 = 0.998;

/// Initial tightening of the limits, to exceed little between the samples.
const MARGIN: f64 = 1.001;

impl Section {
    /// Plans the motion along a polyline from rest to rest on these spans of it.
    pub(crate) fn plan(polyline: &Polyline, path: Spans, scaled: &Scaled) -> Self {
        let n = path.len();
        let h = (0..n).map(|i| path.length(i)).collect();
        let mut task = Task { path: &path, scaled, caps: &polyline.caps, h, tightening: vec![MARGIN; n], kept: None };
        task.kept = (task.windows(WINDOW).len() == 1).then(|| task.problem(0, n));
        let paces = task.solve(n <= polyline.lines());
        Self { path, paces }
    }

    pub(crate) fn duration(&self) -> f64 {
        self.paces.iter().map(SquaredSpeed::duration).sum()
    }

    /// Returns a bound of ṙ on each line of the polyline and wherever else the line takes part.
    pub(crate) fn peaks(&self) -> Vec<f64> {
        let most: Vec<f64> = (0..self.paces.len())
            .into_par_iter()
            .map(|span| speed_bound(&self.path.advance(span), &self.paces[span]))
            .collect();
        let lines = self.path.len().checked_sub(1).map_or(0, |last| self.path.lines(last).end() + 1);
        let mut peaks = vec![0.0_f64; lines];
        for (span, &most) in most.iter().enumerate() {
            for peak in &mut peaks[self.path.lines(span)] {
                *peak = peak.max(most);
            }
        }
        peaks
    }
}

impl Task<'_> {
    /// Returns the fastest certified motion of all passes; more of them where the path is smooth.
    fn solve(&mut self, is_smooth: bool) -> Vec<SquaredSpeed> {
        let mut x = self.guess();
        self.slow_down(&mut x, 1.1);
        for (first, effort) in if self.kept.is_some() { &ALONE[..] } else { &SHIFTED } {
            self.improve(&mut x, *first, effort);
        }
        let most = self.draw_in(&x);
        let mut best = Certified { time: self.time(&x, most), x: x.clone(), stretch: most };
        // Where spans are few, more passes cost little, and where one is far beyond its limits all
        // of them are slowed down by it.
        let more = if is_smooth { LAST.len() } else { usize::from(most >= BEYOND) };
        for (first, effort) in &LAST[..more] {
            self.kept = self.kept.is_some().then(|| self.problem(0, self.h.len()));
            self.slow_down(&mut x, 1.001);
            self.improve(&mut x, *first, effort);
            let most = self.draw_in(&x);
            let time = self.time(&x, most);
            if time < best.time {
                best.x.copy_from_slice(&x);
                (best.stretch, best.time) = (most, time);
            }
        }
        // A long program's paces take most of the memory: nothing else is kept beside them except
        // their inputs.
        drop((x, std::mem::take(&mut self.tightening)));
        (0..self.h.len()).map(|i| self.certified_pace(i, &best.x, best.stretch)).collect()
    }

    /// Tightens the limits by the excess of a motion in each span; returns the largest stretch of
    /// time that a span requires.
    fn draw_in(&mut self, x: &[f64]) -> f64 {
        let stretches = self.stretches(x);
        for (factor, stretch) in self.tightening.iter_mut().zip(&stretches) {
            *factor *= stretch.max(1.0);
        }
        stretches.into_iter().fold(0.0, f64::max)
    }

    /// Returns the stretch of time that each span requires.
    fn stretches(&self, x: &[f64]) -> Vec<f64> {
        (0..self.h.len()).into_par_iter().map(|i| self.stretch(i, &self.pace(i, x))).collect()
    }

    /// Returns an initial motion, nearly within the limits: at the steady speeds of the spans, with
    /// changes in between that a fraction of acceleration and jerk allows.
    ///
    /// From rest at the jerk j the square of the speed is β with β^¾ = 3/√2·√j·r, so β^¾ may rise
    /// and fall by that much.
    fn guess(&self) -> Vec<f64> {
        let windows = self.windows(WINDOW);
        let n = self.h.len();
        let mut reaches = vec![Reach { steady: 0.0, change: 0.0, bend: 0.0 }; n];
        // Each window into its own part: joining the parts afterwards would need twice the memory.
        let mut parts = Vec::with_capacity(windows.len());
        let mut rest = reaches.as_mut_slice();
        for (a, b) in windows {
            let (part, behind) = rest.split_at_mut(b - a);
            parts.push(((a, b), part));
            rest = behind;
        }
        parts.into_par_iter().for_each(|(window, part)| {
            self.on(window, |problem| part.copy_from_slice(problem.reaches()));
        });
        let mut x: Vec<f64> = reaches.iter().map(|reach| reach.steady).collect();
        let limit = |x: &mut [f64], i: usize, from: usize| {
            let d = 0.5 * (self.h[i] + self.h[from]);
            let roots = x[from].sqrt();
            let z = roots * roots.sqrt() + LEISURE * 1.5 * reaches[i].bend.sqrt() * d;
            let root = z.cbrt();
            x[i] = x[i].min(x[from] + LEISURE * reaches[i].change * d).min(root * root * root * root);
        };
        (1..n).for_each(|i| limit(&mut x, i, i - 1));
        (0..n - 1).rev().for_each(|i| limit(&mut x, i, i + 1));
        for _ in 0..2 {
            let before = x.clone();
            for i in 1..n - 1 {
                let mean = 0.25 * (before[i - 1] + before[i + 1]) + 0.5 * before[i];
                x[i] = mean.min(reaches[i].steady);
            }
        }
        let (first, last) = (x[0], x[n - 1]);
        x.insert(0, first);
        x.push(last);
        x
    }

    /// Passes the problem of a window to a function; that of the only window is kept.
    fn on<T>(&self, (start, end): (usize, usize), ask: impl FnOnce(&Problem) -> T) -> T {
        match &self.kept {
            Some(problem) if (start, end) == (0, self.h.len()) => ask(problem),
            _ => ask(&self.problem(start, end)),
        }
    }

    /// Stretches time until every sample is within its limits by this factor.
    fn slow_down(&self, x: &mut [f64], factor: f64) {
        let slow = factor * self.dilation(x);
        if slow > 1.0 {
            x.iter_mut().for_each(|x| *x /= slow * slow);
        }
    }

    /// Returns the time of a motion that is stretched as a whole until no span exceeds a limit, s.
    fn time(&self, x: &[f64], stretch: f64) -> f64 {
        (0..self.h.len()).map(|i| self.certified_pace(i, x, stretch).duration()).sum()
    }

    fn certified_pace(&self, span: usize, x: &[f64], stretch: f64) -> SquaredSpeed {
        self.pace(span, x).scaled(stretch.powi(-2))
    }

    /// Returns 1/ṙ² of the tip feed on a span.
    fn cap(&self, span: usize) -> f64 {
        self.path.lines(span).map(|line| self.caps[line].powi(-2)).fold(0.0, f64::max)
    }

    /// Returns the problem of the spans from `start` to `end` and their unknowns.
    fn problem(&self, start: usize, end: usize) -> Problem {
        let mut problem = Problem::new(end - start + 2);
        let (mut axes, mut limits): (Vec<Quartic>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
        for i in start..end {
            let tip = [self.path.limited(i, &self.scaled.axes, &mut axes, &mut limits)];
            let part = SolverSpan {
                first: i - start,
                h: self.h[i],
                ends: end_weights(&self.h, i),
                axes: &axes,
                limits: &limits,
                tip: &tip,
                tip_limit: self.cap(i),
                tightening: self.tightening[i],
            };
            problem.push(&part);
        }
        let n = self.h.len();
        problem.pinned = Pinned { start: if start == 0 { 0 } else { 2 }, end: if end == n { 0 } else { 2 } };
        problem
    }

    /// Returns starts and ends of windows, the first one of so many spans.
    fn windows(&self, first: usize) -> Vec<(usize, usize)> {
        let n = self.h.len();
        let mut out = Vec::new();
        let mut start = 0;
        let mut end = first;
        while start < n {
            // No short window at the end.
            if end + WINDOW / 4 >= n {
                end = n;
            }
            out.push((start, end));
            (start, end) = (end, end + WINDOW);
        }
        out
    }

    fn dilation(&self, x: &[f64]) -> f64 {
        let windows = self.windows(WINDOW);
        let each = windows.par_iter().map(|&(a, b)| self.on((a, b), |problem| problem.dilation(&x[a..b + 2])));
        each.collect::<Vec<f64>>().into_iter().fold(0.0, f64::max)
    }

    /// Lowers the time in every window, with the unknowns at its ends fixed.
    fn improve(&self, x: &mut [f64], first: usize, effort: &Effort) {
        let windows = self.windows(first);
        let solve = |&(a, b): &(usize, usize)| {
            let mut part = x[a..b + 2].to_vec();
            self.on((a, b), |problem| lower(problem, &mut part, effort));
            part
        };
        let solved: Vec<Vec<f64>> = windows.par_iter().map(solve).collect();
        for ((a, b), part) in windows.into_iter().zip(solved) {
            let start = if a == 0 { 0 } else { 2 };
            let end = if b == self.h.len() { part.len() } else { part.len() - 2 };
            x[a + start..a + end].copy_from_slice(&part[start..end]);
        }
    }

    fn pace(&self, span: usize, x: &[f64]) -> SquaredSpeed {
        let ([l0, l1], [r0, r1]) = end_weights(&self.h, span);
        let ends = [l0 * x[span] + l1 * x[span + 1], x[span + 1], r0 * x[span + 1] + r1 * x[span + 2]];
        SquaredSpeed(ends).scaled(self.h[span].powi(-2))
    }

    fn stretch(&self, span: usize, pace: &SquaredSpeed) -> f64 {
        let (mut axes, mut limits) = (Vec::new(), Vec::new());
        let tip = [self.path.limited(span, &self.scaled.axes, &mut axes, &mut limits)];
        stretch((&axes, &limits), (&tip, self.cap(span)), pace, FLOOR)
    }
}
