use facemill_inverse_kinematics::AxisValues;
use rayon::prelude::*;

use super::polyline::Polyline;
use super::section::Section;
use super::spline::Quartic;
use crate::time_law::law::in_time;
use crate::time_law::span::eval;
use crate::{AxisBounds, AxisMotion, MotionBounds, MotionLimit};

/// The motion of a program in time.
#[derive(Clone, Debug)]
pub struct ProgramLaw {
    start: AxisValues,
    sections: Vec<Timed>,
    block_ends: Vec<f64>,
    /// Largest ṙ by the tip feed of each block; infinite without a cap.
    caps: Vec<f64>,
}

/// A section with the times at which its spans start, and at its end.
#[derive(Clone, Debug)]
struct Timed {
    section: Section,
    starts: Vec<f64>,
}

impl Timed {
    fn new(section: Section, start: f64) -> Self {
        let mut starts = Vec::with_capacity(section.paces.len() + 1);
        let mut t = start;
        starts.push(t);
        for pace in &section.paces {
            t += pace.duration();
            starts.push(t);
        }
        Self { section, starts }
    }

    fn end(&self) -> f64 {
        self.starts[self.starts.len() - 1]
    }
}

impl ProgramLaw {
    pub(crate) fn new(start: AxisValues, n_blocks: usize, planned: Vec<(Polyline, Section)>) -> Self {
        let mut law = Self {
            start,
            sections: Vec::with_capacity(planned.len()),
            block_ends: vec![f64::NAN; n_blocks],
            caps: vec![f64::INFINITY; n_blocks],
        };
        let mut t = 0.0;
        for (polyline, section) in planned {
            let timed = Timed::new(section, t);
            t = timed.end();
            law.pass(&polyline, &timed);
            law.sections.push(timed);
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

    /// Notes when the ends of a section's blocks are passed.
    fn pass(&mut self, polyline: &Polyline, timed: &Timed) {
        let path = &timed.section.path;
        let mut span = 0;
        for (line, &block) in polyline.blocks.iter().enumerate() {
            let r = polyline.r[line + 1];
            while span + 1 < path.len() && path.end(span) < r {
                span += 1;
            }
            let within = timed.section.paces[span].time_to(path.s_at(span, r));
            self.block_ends[block] = timed.starts[span] + within;
            self.caps[block] = polyline.caps[line];
        }
        // The end of the last one is that of the section, to the last bit.
        if let Some(&block) = polyline.blocks.last() {
            self.block_ends[block] = timed.end();
        }
    }

    /// Time of the whole program, s.
    pub fn total_time(&self) -> f64 {
        self.sections.last().map_or(0.0, Timed::end)
    }

    /// Number of spans that the law is made of.
    pub fn spans(&self) -> usize {
        self.sections.iter().map(|s| s.section.paces.len()).sum()
    }

    /// Times at which the blocks end, s, in order. A block whose end is a blended corner ends where the path passes the
    /// corner.
    pub fn block_ends(&self) -> &[f64] {
        &self.block_ends
    }

    /// The least time in which each block can be run within this motion, s: what G93 asks for, as 60/time.
    pub fn block_times(&self) -> Vec<f64> {
        let starts = std::iter::once(0.0).chain(self.block_ends.iter().copied());
        self.block_ends.iter().zip(starts).map(|(end, start)| end - start).collect()
    }

    /// The axes at time `t`, s; before the start and after the end they stand.
    pub fn at(&self, t: f64) -> AxisMotion {
        self.motion(t).0
    }

    /// The axes at time `t`, and ṙ.
    fn motion(&self, t: f64) -> (AxisMotion, f64) {
        let n = self.start.len();
        let zero = AxisValues::zeros(n);
        let i = self.sections.partition_point(|s| s.starts[0] <= t).saturating_sub(1);
        let Some(timed) = self.sections.get(i) else {
            let still =
                AxisMotion { position: self.start, velocity: zero, acceleration: zero, jerk: zero, tip_feed: None };
            return (still, 0.0);
        };
        let spans = timed.section.paces.len();
        let k = timed.starts.partition_point(|&start| start <= t).clamp(1, spans) - 1;
        let pace = &timed.section.paces[k];
        let s = pace.position((t.min(timed.end()) - timed.starts[k]).max(0.0));
        let moving = (0.0..=timed.end()).contains(&t);
        let rates = if moving { pace.rates(s) } else { [0.0; 3] };
        let mut axes: Vec<Quartic> = Vec::with_capacity(n);
        let r = timed.section.path.polynomials(k, &mut axes);
        let mut out = [zero; 4];
        for (axis, c) in axes.iter().enumerate() {
            for (values, value) in out.iter_mut().zip(in_time(eval(c, s), rates)) {
                values[axis] = value;
            }
        }
        let [position, velocity, acceleration, jerk] = out;
        (AxisMotion { position, velocity, acceleration, jerk, tip_feed: None }, eval(&r, s)[1] * rates[0])
    }

    /// What holds each block back: the limit that is used most at its middle and its ends, and the share of it that is
    /// used there. `None` for blocks without motion.
    pub fn block_limits(&self, axes: &[AxisBounds]) -> Vec<Option<(MotionLimit, f64)>> {
        let bounds = MotionBounds::new(axes.to_vec());
        let most = |block: usize| {
            let (start, end) = (if block == 0 { 0.0 } else { self.block_ends[block - 1] }, self.block_ends[block]);
            let at = |share: f64| {
                let (motion, rate) = self.motion(start + (end - start) * share);
                let tip = (MotionLimit::TipFeed, rate / self.caps[block]);
                motion.binding(&bounds).map(|axis| if tip.1 >= axis.1 { tip } else { axis })
            };
            let found = [0.02, 0.5, 0.98].into_iter().filter_map(at);
            if end > start { found.reduce(|most, next| if next.1 > most.1 { next } else { most }) } else { None }
        };
        (0..self.block_ends.len()).into_par_iter().map(most).collect()
    }
}
