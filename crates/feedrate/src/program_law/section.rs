use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use super::knots::Grain;
use super::polyline::Polyline;
use super::spans::Spans;
use super::spline::Quartic;
use crate::time_law::barrier::{Part, Pinned, Problem, Scaled, end_weights};
use crate::time_law::certify::{speed_bound, stretch};
use crate::time_law::descent::{Effort, lower};
use crate::time_law::law::Pace;

/// Spans that are solved at once. Longer windows have fewer borders; shorter ones need fewer steps each.
const WINDOW: usize = 256;

/// The motion between two stops.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) path: Spans,
    pub(crate) paces: Vec<Pace>,
}

/// What does not change while a section is solved.
struct Task<'a> {
    path: &'a Spans,
    scaled: &'a Scaled,
    /// 1/ṙ² of the tip feed on every span.
    caps: Vec<f64>,
    /// Length of every span in the path variable.
    h: Vec<f64>,
    /// How far the limits of every span are drawn in.
    tightening: Vec<f64>,
}

/// Passes over all windows: where the first window ends, and how far each goes. The first one finds the motion between
/// the windows' ends, which stay slow; the second one speeds these up; the third one takes back what the certificate
/// says is too much, and what the tightening took too much.
const PASSES: [(usize, Effort); 4] = [
    (WINDOW, Effort { steps: 40, gaps: (0.5, 0.02) }),
    (WINDOW / 2, Effort { steps: 25, gaps: (0.1, 0.005) }),
    (WINDOW / 4, Effort { steps: 12, gaps: (0.01, 0.002) }),
    (3 * WINDOW / 4, Effort { steps: 8, gaps: (0.004, 0.002) }),
];

/// Limits are drawn in from the start by this, so that little is exceeded between the samples.
const MARGIN: f64 = 1.001;

impl Section {
    /// The motion along a polyline from rest to rest.
    pub(crate) fn plan(polyline: &Polyline, tolerance: &AxisValues, grain: &Grain, scaled: &Scaled) -> Self {
        let path = Spans::along(polyline, tolerance, grain);
        let n = path.len();
        let cap = |i| path.lines(i).map(|line| polyline.caps[line].powi(-2)).fold(0.0, f64::max);
        let caps = (0..n).map(cap).collect();
        let h = (0..n).map(|i| path.length(i)).collect();
        let mut task = Task { path: &path, scaled, caps, h, tightening: vec![MARGIN; n] };
        let paces = task.solve();
        Self { path, paces }
    }

    pub(crate) fn duration(&self) -> f64 {
        self.paces.iter().map(Pace::duration).sum()
    }

    /// A bound of ṙ on each line of the polyline and wherever else the line takes part.
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
    /// The quickest certified motion of all passes.
    fn solve(&mut self) -> Vec<Pace> {
        let mut x = vec![1.0; self.h.len() + 2];
        self.slow_down(&mut x, 1.5);
        let mut best: Option<(f64, Vec<Pace>)> = None;
        for (first, effort) in &PASSES {
            self.improve(&mut x, *first, effort);
            // The motion still is slow between the first windows.
            if *first == WINDOW {
                continue;
            }
            let (paces, stretches) = self.certified(&x);
            let time: f64 = paces.iter().map(Pace::duration).sum();
            if best.as_ref().is_none_or(|(least, _)| time < *least) {
                best = Some((time, paces));
            }
            for (factor, stretch) in self.tightening.iter_mut().zip(&stretches) {
                *factor *= stretch.max(1.0);
            }
            self.slow_down(&mut x, 1.001);
        }
        best.map(|b| b.1).unwrap_or_default()
    }

    /// Stretches time so that every sample is within its limits by this factor.
    fn slow_down(&self, x: &mut [f64], factor: f64) {
        let slow = factor * self.dilation(x);
        if slow > 1.0 {
            x.iter_mut().for_each(|x| *x /= slow * slow);
        }
    }

    /// The motion, stretched as a whole so that no span exceeds a limit; and by how much each span asks for it.
    fn certified(&self, x: &[f64]) -> (Vec<Pace>, Vec<f64>) {
        let paces = self.paces(x);
        let stretches: Vec<f64> = (0..paces.len()).into_par_iter().map(|i| self.stretch(i, &paces[i])).collect();
        let most = stretches.iter().copied().fold(0.0, f64::max);
        (paces.into_iter().map(|p| p.scaled(most.powi(-2))).collect(), stretches)
    }

    /// The problem of the spans from `start` to `end` and their unknowns.
    fn problem(&self, start: usize, end: usize) -> Problem {
        let mut problem = Problem::new(end - start + 2);
        let (mut axes, mut limits): (Vec<Quartic>, Vec<[f64; 3]>) = (Vec::new(), Vec::new());
        for i in start..end {
            let tip = [self.path.limited(i, &self.scaled.axes, &mut axes, &mut limits)];
            let part = Part {
                first: i - start,
                h: self.h[i],
                ends: end_weights(&self.h, i),
                axes: &axes,
                limits: &limits,
                tip: &tip,
                tip_limit: self.caps[i],
                tightening: self.tightening[i],
            };
            problem.push(&part);
        }
        let n = self.h.len();
        problem.pinned = Pinned { start: if start == 0 { 0 } else { 2 }, end: if end == n { 0 } else { 2 } };
        problem
    }

    /// Starts and ends of windows, the first one of so many spans.
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
        let each = windows.par_iter().map(|&(a, b)| self.problem(a, b).dilation(&x[a..b + 2]));
        each.collect::<Vec<f64>>().into_iter().fold(0.0, f64::max)
    }

    /// Lowers the time in every window, with the unknowns at its ends as they are.
    fn improve(&self, x: &mut [f64], first: usize, effort: &Effort) {
        let windows = self.windows(first);
        let solve = |&(a, b): &(usize, usize)| {
            let problem = self.problem(a, b);
            let mut part = x[a..b + 2].to_vec();
            lower(&problem, &mut part, effort);
            part
        };
        let solved: Vec<Vec<f64>> = windows.par_iter().map(solve).collect();
        for ((a, b), part) in windows.into_iter().zip(solved) {
            let start = if a == 0 { 0 } else { 2 };
            let end = if b == self.h.len() { part.len() } else { part.len() - 2 };
            x[a + start..a + end].copy_from_slice(&part[start..end]);
        }
    }

    fn paces(&self, x: &[f64]) -> Vec<Pace> {
        let pace = |i: usize| {
            let ([l0, l1], [r0, r1]) = end_weights(&self.h, i);
            let ends = [l0 * x[i] + l1 * x[i + 1], x[i + 1], r0 * x[i + 1] + r1 * x[i + 2]];
            Pace(ends).scaled(self.h[i].powi(-2))
        };
        (0..self.h.len()).map(pace).collect()
    }

    fn stretch(&self, span: usize, pace: &Pace) -> f64 {
        let (mut axes, mut limits) = (Vec::new(), Vec::new());
        let tip = [self.path.limited(span, &self.scaled.axes, &mut axes, &mut limits)];
        stretch((&axes, &limits), (&tip, self.caps[span]), pace, 0.0)
    }
}
