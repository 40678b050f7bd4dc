use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use super::corner::LineMotion;
use super::polyline::Polyline;
use super::rounded::RoundedLine;
use super::s_curve::SCurve;
use super::section::Section;
use super::spline::Quartic;
use crate::time_law::law::in_time;
use crate::time_law::span::eval;
use crate::time_law::{AxisBounds, AxisMotion, MotionBounds, MotionLimit};

/// The motion of a program in time.
#[derive(Clone, Debug)]
pub struct ProgramLaw {
    n_axes: usize,
    /// Axis values at the start and at the end of every block, one after the other.
    points: Vec<f64>,
    sections: Vec<TimedSection>,
    block_ends: Vec<f64>,
    /// Largest ṙ allowed by the tip feed of each block; infinite without a cap.
    caps: Vec<f64>,
    /// Time of each block at the largest ṙ proven for it, s; 0 without motion.
    peak_times: Vec<f64>,
}

/// A planned motion from rest to rest.
pub(crate) enum Motion {
    /// Over lines, each from rest to rest.
    Lines(Vec<LineMotion>),
    /// Over several lines, each corner rounded by itself.
    Rounded(Vec<RoundedLine>),
    /// Over several lines, blended.
    Spline(Box<(Polyline, Section)>),
}

/// A motion from rest to rest with the times at which its parts start, and at its end.
#[derive(Clone, Debug)]
enum TimedSection {
    Line { block: usize, curve: SCurve, start: f64 },
    Rounded(Box<(Vec<RoundedLine>, Vec<f64>)>),
    Spline(Box<(Section, Vec<f64>)>),
}

impl TimedSection {
    fn start(&self) -> f64 {
        match self {
            Self::Line { start, .. } => *start,
            Self::Rounded(lines) => lines.1[0],
            Self::Spline(spline) => spline.1[0],
        }
    }

    fn end(&self) -> f64 {
        match self {
            Self::Line { curve, start, .. } => start + curve.duration(),
            Self::Rounded(lines) => lines.1[lines.1.len() - 1],
            Self::Spline(spline) => spline.1[spline.1.len() - 1],
        }
    }
}

/// Returns the times at which the spans of a section that starts at `start` start, and at its end.
fn span_times(section: &Section, start: f64) -> Vec<f64> {
    let mut times = Vec::with_capacity(section.paces.len() + 1);
    let mut t = start;
    times.push(t);
    for pace in &section.paces {
        t += pace.duration();
        times.push(t);
    }
    times
}

impl ProgramLaw {
    pub(crate) fn new(points: Vec<f64>, n_axes: usize, planned: Vec<Motion>) -> Self {
        let n_blocks = points.len() / n_axes - 1;
        let mut law = Self {
            n_axes,
            points,
            sections: Vec::with_capacity(planned.len()),
            block_ends: vec![f64::NAN; n_blocks],
            caps: vec![f64::INFINITY; n_blocks],
            peak_times: vec![0.0; n_blocks],
        };
        for motion in planned {
            match motion {
                Motion::Lines(lines) => lines.into_iter().for_each(|line| law.push_line(line)),
                Motion::Rounded(lines) => law.push_rounded(lines),
                Motion::Spline(planned) => {
                    let (polyline, section) = *planned;
                    let starts = span_times(&section, law.total_time());
                    law.pass(&polyline, &section, &starts);
                    law.sections.push(TimedSection::Spline(Box::new((section, starts))));
                }
            }
        }
        // Blocks without motion end where the one before them does.
        let mut before = 0.0;
        for end in &mut law.block_ends {
            if end.is_nan() {
                *end = before;
            }
            before = *end;
        }
        law
    }

    fn push_line(&mut self, LineMotion { block, curve, cap }: LineMotion) {
        let start = self.total_time();
        self.block_ends[block] = start + curve.duration();
        self.caps[block] = cap;
        self.peak_times[block] = curve.length() / curve.speed();
        self.sections.push(TimedSection::Line { block, curve, start });
    }

    fn push_rounded(&mut self, lines: Vec<RoundedLine>) {
        let mut t = self.total_time();
        let mut starts = Vec::with_capacity(lines.len() + 1);
        starts.push(t);
        for line in &lines {
            t += line.duration();
            starts.push(t);
            self.block_ends[line.block] = t;
            self.caps[line.block] = line.cap;
            self.peak_times[line.block] = line.length() / line.peak();
        }
        self.sections.push(TimedSection::Rounded(Box::new((lines, starts))));
    }

    /// Records when the ends of a section's blocks are passed.
    fn pass(&mut self, polyline: &Polyline, section: &Section, starts: &[f64]) {
        let path = &section.path;
        let mut span = 0;
        for (line, &block) in polyline.blocks.iter().enumerate() {
            let r = polyline.r[line + 1];
            while span + 1 < path.len() && path.end(span) < r {
                span += 1;
            }
            self.block_ends[block] = starts[span] + section.paces[span].time_to(path.s_at(span, r));
            self.caps[block] = polyline.caps[line];
        }
        for ((&block, peak), r) in polyline.blocks.iter().zip(section.peaks()).zip(polyline.r.windows(2)) {
            self.peak_times[block] = (r[1] - r[0]) / peak;
        }
        // The last end is that of the section, to the last bit.
        if let Some(&block) = polyline.blocks.last() {
            self.block_ends[block] = starts[starts.len() - 1];
        }
    }

    /// Returns the time of the whole program, s.
    pub fn total_time(&self) -> f64 {
        self.sections.last().map_or(0.0, TimedSection::end)
    }

    /// Returns the number of parts of the law: lines from stop to stop, and spans of blended ones.
    pub fn parts(&self) -> usize {
        let parts = |section: &TimedSection| match section {
            TimedSection::Line { .. } => 1,
            TimedSection::Rounded(lines) => lines.0.len(),
            TimedSection::Spline(spline) => spline.0.paces.len(),
        };
        self.sections.iter().map(parts).sum()
    }

    /// Returns the times at which the blocks end, s, in order. A block whose end is a blended
    /// corner ends where the path passes the corner.
    pub fn block_ends(&self) -> &[f64] {
        &self.block_ends
    }

    /// Returns the time of each block in this motion, s.
    pub fn block_times(&self) -> Vec<f64> {
        let starts = std::iter::once(0.0).chain(self.block_ends.iter().copied());
        self.block_ends.iter().zip(starts).map(|(end, start)| end - start).collect()
    }

    /// Returns the time in which each block would be run at the largest speed that it has in this
    /// motion, s: proven to be no more than its time, and 0 without motion. If the feed of a block
    /// requires no less time than this, the block can be run as here; the machine cannot reach a
    /// higher feed.
    ///
    /// A block counts with the blends at its ends, in which its neighbours take part, as far as
    /// they reach.
    /// reach.
    pub fn block_peak_times(&self) -> &[f64] {
        &self.peak_times
    }

    /// Returns the axes at time `t`, s; before the start and after the end they are at rest.
    pub fn at(&self, t: f64) -> AxisMotion {
        self.motion(t).0
    }

    /// Returns the axes at time `t`, and ṙ.
    fn motion(&self, t: f64) -> (AxisMotion, f64) {
        let i = self.sections.partition_point(|s| s.start() <= t).saturating_sub(1);
        let mut out = [AxisValues::zeros(self.n_axes); 4];
        let moving = (0.0..=self.total_time()).contains(&t);
        let rate = match self.sections.get(i) {
            None => {
                out[0] = self.point(0);
                0.0
            }
            Some(TimedSection::Line { block, curve, start }) => {
                let [r, rates @ ..] = curve.at((t - start).clamp(0.0, curve.duration()));
                let rates = if moving { rates } else { [0.0; 3] };
                let (from, to) = (self.point(*block), self.point(block + 1));
                out[0] = from.lerp(&to, r / curve.length());
                for (values, rate) in out[1..].iter_mut().zip(rates) {
                    *values = AxisValues::from_fn(self.n_axes, |k| (to[k] - from[k]) / curve.length() * rate);
                }
                rates[0]
            }
            Some(TimedSection::Rounded(lines)) => {
                let (lines, starts) = &**lines;
                let k = starts.partition_point(|&start| start <= t).clamp(1, lines.len()) - 1;
                let line = &lines[k];
                let [r, rates @ ..] = line.at((t.min(starts[lines.len()]) - starts[k]).max(0.0));
                let rates = if moving { rates } else { [0.0; 3] };
                let slopes = [k.saturating_sub(1), k, (k + 1).min(lines.len() - 1)].map(|k| self.slopes(&lines[k]));
                let from = self.point(line.block);
                for axis in 0..self.n_axes {
                    let [before, slope, after] = slopes.map(|s| s[axis]);
                    let mut q = line.rounding(r, [slope - before, after - slope]);
                    q[0] += from[axis] + slope * r;
                    q[1] += slope;
                    for (values, value) in out.iter_mut().zip(in_time(q, rates)) {
                        values[axis] = value;
                    }
                }
                rates[0]
            }
            Some(TimedSection::Spline(spline)) => {
                let (section, starts) = &**spline;
                let spans = section.paces.len();
                let k = starts.partition_point(|&start| start <= t).clamp(1, spans) - 1;
                let pace = &section.paces[k];
                let s = pace.position((t.min(starts[spans]) - starts[k]).max(0.0));
                let rates = if moving { pace.rates(s) } else { [0.0; 3] };
                let mut axes: Vec<Quartic> = Vec::with_capacity(self.n_axes);
                let r = section.path.polynomials(k, &mut axes);
                for (axis, c) in axes.iter().enumerate() {
                    for (values, value) in out.iter_mut().zip(in_time(eval(c, s), rates)) {
                        values[axis] = value;
                    }
                }
                eval(&r, s)[1] * rates[0]
            }
        };
        let [position, velocity, acceleration, jerk] = out;
        (AxisMotion { position, velocity, acceleration, jerk, tip_feed: None }, rate)
    }

    /// Returns the derivatives of the axes by r along a line.
    fn slopes(&self, line: &RoundedLine) -> AxisValues {
        let (from, to) = (self.point(line.block), self.point(line.block + 1));
        AxisValues::from_fn(self.n_axes, |k| (to[k] - from[k]) / line.length())
    }

    /// Returns axis values at the end of block `index` − 1, at the start for 0.
    fn point(&self, index: usize) -> AxisValues {
        let at = &self.points[index * self.n_axes..(index + 1) * self.n_axes];
        AxisValues::from_fn(self.n_axes, |k| at[k])
    }

    /// Returns the limiting factor of each block, and the used fraction of it: the limit that is
    /// used most at its middle and its ends, among equal ones that of the middle. `None` for blocks
    /// without motion.
    pub fn block_limits(&self, axes: &[AxisBounds]) -> Vec<Option<(MotionLimit, f64)>> {
        let bounds = MotionBounds::new(axes.to_vec());
        let most = |block: usize| {
            let (start, end) = (if block == 0 { 0.0 } else { self.block_ends[block - 1] }, self.block_ends[block]);
            let at = |share: f64| {
                let (motion, rate) = self.motion(start + (end - start) * share);
                let tip = (MotionLimit::TipFeed, rate / self.caps[block]);
                motion.binding(&bounds).map(|axis| if tip.1 >= axis.1 { tip } else { axis })
            };
            let found = [0.5, 0.02, 0.98].into_iter().filter_map(at);
            let more = |most: (MotionLimit, f64), next: (MotionLimit, f64)| next.1 > most.1 * (1.0 + 1e-9);
            if end > start { found.reduce(|most, next| if more(most, next) { next } else { most }) } else { None }
        };
        (0..self.block_ends.len()).into_par_iter().map(most).collect()
    }
}
