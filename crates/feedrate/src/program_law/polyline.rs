#[cfg(test)]
#[path = "../../tests/unit/program_law/polyline.rs"]
mod tests;

use facemill_inverse_kinematics::{AxisValues, MAX_AXES};

use super::corner::{LineMotion, ProgramLine};
use crate::time_law::AxisBounds;

/// Axis values of a point without their number.
pub(crate) type Point = [f64; MAX_AXES];

/// Blocks between two stops as straight lines over their summed length r, in which each axis counts
/// by the time it takes at its largest speed: s.
#[derive(Clone, Debug)]
pub(crate) struct Polyline {
    pub(crate) n_axes: usize,
    /// r at every vertex, ascending, from 0.
    pub(crate) r: Vec<f64>,
    /// Axis values of every vertex, one after the other.
    pub(crate) q: Vec<f64>,
    /// Largest ṙ on every line allowed by the tip feed; infinite without a cap.
    pub(crate) caps: Vec<f64>,
    /// Block of the program that each line belongs to.
    pub(crate) blocks: Vec<usize>,
}

impl Polyline {
    pub(crate) fn new(start: &AxisValues) -> Self {
        Self { n_axes: start.len(), r: vec![0.0], q: start.as_slice().to_vec(), caps: Vec::new(), blocks: Vec::new() }
    }

    /// Removes all lines and starts anew.
    pub(crate) fn restart(&mut self, start: &AxisValues) {
        self.r.truncate(1);
        self.q.clear();
        self.q.extend_from_slice(start.as_slice());
        self.caps.clear();
        self.blocks.clear();
    }

    /// Adds the line of a block, of this length, to `end`.
    pub(crate) fn push(&mut self, end: &AxisValues, length: f64, cap: f64, block: usize) {
        self.blocks.push(block);
        self.r.push(self.length() + length);
        self.q.extend_from_slice(end.as_slice());
        self.caps.push(cap);
    }

    /// Returns the motion that stops at every vertex, line by line.
    pub(crate) fn stopping(&self, axes: &[AxisBounds]) -> impl Iterator<Item = LineMotion> {
        let alone = move |k| LineMotion { block: self.blocks[k], curve: self.line(k, axes).alone(), cap: self.caps[k] };
        (0..self.lines()).map(alone)
    }

    /// Returns a line with its limits.
    pub(crate) fn line(&self, index: usize, axes: &[AxisBounds]) -> ProgramLine {
        let at = |k: usize| AxisValues::from_fn(self.n_axes, |axis| self.vertex(k)[axis]);
        ProgramLine::new(&at(index), &at(index + 1), self.r[index + 1] - self.r[index], self.caps[index], axes)
    }

    /// Returns the number of lines.
    pub(crate) fn lines(&self) -> usize {
        self.caps.len()
    }

    pub(crate) fn length(&self) -> f64 {
        self.r[self.r.len() - 1]
    }

    pub(crate) fn vertex(&self, index: usize) -> &[f64] {
        &self.q[index * self.n_axes..(index + 1) * self.n_axes]
    }

    /// Returns the index of the line that contains `r`, the first or last one outside; searched
    /// from `near` on.
    pub(crate) fn line_at(&self, r: f64, near: usize) -> usize {
        let last = self.lines() - 1;
        let mut low = near.min(last);
        let mut step = 1;
        // Widens until r lies between low and high, then halves.
        let mut high = low;
        while self.r[low] > r && low > 0 {
            high = low;
            low = low.saturating_sub(step);
            step *= 2;
        }
        step = 1;
        high = high.max(low);
        while high < last && self.r[high + 1] <= r {
            low = high + 1;
            high = (high + step).min(last);
            step *= 2;
        }
        low + self.r[low + 1..=high].partition_point(|&x| x <= r)
    }

    /// Returns the point at `r` on the line of this index, which may be extended.
    pub(crate) fn on_line(&self, r: f64, line: usize) -> Point {
        let share = (r - self.r[line]) / (self.r[line + 1] - self.r[line]);
        let (a, b) = (self.vertex(line), self.vertex(line + 1));
        let mut out = [0.0; MAX_AXES];
        for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
            *out = a + (b - a) * share;
        }
        out
    }

    /// Returns the point at `r` on the straight line through the points at `a` and `b`.
    pub(crate) fn on_chord(&self, r: f64, a: f64, b: f64) -> Point {
        let (p, q) = (self.at(a, 0), self.at(b, self.lines()));
        let share = (r - a) / (b - a);
        std::array::from_fn(|k| p[k] + (q[k] - p[k]) * share)
    }

    /// Returns the point at `r`; the first and the last line continue beyond the ends.
    pub(crate) fn at(&self, r: f64, near: usize) -> Point {
        self.on_line(r, self.line_at(r, near))
    }
}
