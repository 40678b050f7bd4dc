use nalgebra::{Point3, Vector3};

use crate::error::PathError;
use crate::layout::field::winding::Winding;
use crate::strategy::patch::Patch;
use crate::strategy::size::MAX_CROSSINGS;

/// Course of a spiral: its turns so far equal the angle around.
pub(crate) struct Helix<'a> {
    pub(crate) patch: &'a Patch<'a>,
    pub(crate) winding: &'a Winding,
    /// Turns that belong to the level of each vertex, counted from where the spiral starts when it
    /// runs forward.
    pub(crate) progress: &'a [f64],
    /// Whether the levels rise along it when it runs forward.
    pub(crate) rises: bool,
    /// Level that it ends at.
    pub(crate) end: f64,
}

/// A point on a side of a triangle.
#[derive(Clone, Copy)]
pub(crate) struct SidePoint {
    pub(crate) triangle: u32,
    /// The side runs from this corner to the next.
    pub(crate) side: usize,
    /// Share of the side before the point.
    pub(crate) share: f64,
}

/// A curve through triangles.
#[derive(Default)]
pub(crate) struct Walked {
    pub(crate) nodes: Vec<Point3<f64>>,
    /// The triangle after each node.
    pub(crate) triangles: Vec<u32>,
    /// Gradient of progress less angle at each node.
    pub(crate) gradients: Vec<Vector3<f64>>,
}

impl Walked {
    fn push(&mut self, node: Point3<f64>, triangle: u32, gradient: Vector3<f64>) {
        if self.nodes.last() == Some(&node) {
            self.nodes.pop();
            self.triangles.pop();
            self.gradients.pop();
        }
        self.nodes.push(node);
        self.triangles.push(triangle);
        self.gradients.push(gradient);
    }
}

impl Helix<'_> {
    /// The values of progress less angle at the corners of a triangle.
    pub(crate) fn corner_values(&self, t: u32) -> [f64; 3] {
        let turns = self.winding.turns(t);
        [0, 1, 2].map(|k| self.vertex_value(t, k) - turns[k])
    }

    fn vertex_value(&self, t: u32, k: usize) -> f64 {
        let v = self.patch.mesh.triangles()[t as usize][k];
        self.progress[v as usize] - self.winding.at(v)
    }

    /// Goes forward from a point that a level runs through into its triangle; `gradients` are those
    /// of progress less angle at the vertices. The last node is on the level that the spiral ends
    /// at, inside the last triangle.
    ///
    /// # Errors
    /// When the curve leaves the patch before.
    pub(crate) fn walk(&self, start: SidePoint, gradients: &[Vector3<f64>]) -> Result<Walked, PathError> {
        let on_side = |at: SidePoint| {
            let v = self.patch.mesh.triangles()[at.triangle as usize];
            let ends = [v[at.side], v[(at.side + 1) % 3]].map(|v| v as usize);
            let [a, b] = ends.map(|v| self.patch.mesh.vertices()[v]);
            let [level_a, level_b] = ends.map(|v| self.patch.levels[v]);
            let level = level_a + (level_b - level_a) * at.share;
            (a + (b - a) * at.share, level, gradients[ends[0]].lerp(&gradients[ends[1]], at.share))
        };
        let of_start = self.corner_values(start.triangle);
        let (a, b) = (of_start[start.side], of_start[(start.side + 1) % 3]);
        let value = a + (b - a) * start.share;
        // Whole turns by which the triangle at hand is ahead.
        let (mut t, mut whole) = self.first_triangle(start, value).ok_or_else(|| self.left(&on_side(start).0))?;
        let (mut here, mut level, gradient) = on_side(start);
        let mut walked = Walked::default();
        walked.push(here, t, gradient);
        for _ in 0..MAX_CROSSINGS {
            let Some(exit) = self.exit(t, value, whole) else { break };
            let (next, next_level, gradient) = on_side(exit);
            if if self.rises { next_level >= self.end } else { next_level <= self.end } {
                let share = (self.end - level) / (next_level - level);
                let last = here + (next - here) * if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 };
                walked.push(last, t, gradient);
                return Ok(walked);
            }
            (t, _, whole) = self.across(t, exit.side, whole).ok_or_else(|| self.left(&next))?;
            walked.push(next, t, gradient);
            (here, level) = (next, next_level);
        }
        Err(self.left(&here))
    }

    /// The triangle that the curve enters at a point, and the whole turns by which it is ahead.
    ///
    /// Corners at the value count as above it. Where both ends of the side are on one side of it,
    /// the curve runs through one of them, up to rounding, and enters a triangle around that one.
    fn first_triangle(&self, start: SidePoint, value: f64) -> Option<(u32, f64)> {
        let SidePoint { triangle, side, share } = start;
        let above = self.above(triangle, value, 0.0);
        if above[side] != above[(side + 1) % 3] {
            let beyond = || self.across(triangle, side, 0.0).map(|(t, _, whole)| (t, whole));
            return if above[side] == self.rises { Some((triangle, 0.0)) } else { beyond() };
        }
        let corner = if share < 0.5 { side } else { (side + 1) % 3 };
        // Around the corner one way, and the other way up to a border.
        [true, false].into_iter().find_map(|leftward| {
            let (mut t, mut corner, mut whole) = (triangle, corner, 0.0);
            loop {
                let sides = [corner, (corner + 2) % 3];
                if sides.into_iter().any(|side| self.enters(t, side, value, whole)) {
                    return Some((t, whole));
                }
                let side;
                (t, side, whole) = self.across(t, sides[usize::from(leftward)], whole)?;
                corner = if leftward { side } else { (side + 1) % 3 };
                if t == triangle {
                    return None;
                }
            }
        })
    }

    /// The triangle across a side, its own side there, and the whole turns by which it is ahead,
    /// by those of the triangle before.
    fn across(&self, t: u32, side: usize, whole: f64) -> Option<(u32, usize, f64)> {
        let (u, j) = self.patch.edges.across(&self.patch.mesh, t, side)?;
        Some((u, j, whole + self.winding.turns(t)[side] - self.winding.turns(u)[(j + 1) % 3]))
    }

    fn left(&self, position: &Point3<f64>) -> PathError {
        PathError::NoSpiral {
            level: self.end,
            fault: "is not reached: the spiral leaves the region",
            position: *position,
        }
    }

    /// Whether the corners of a triangle are at or above a value. The whole turns are kept apart,
    /// so that both triangles at an edge agree to the last digit.
    fn above(&self, t: u32, value: f64, whole: f64) -> [bool; 3] {
        let turns = self.winding.turns(t);
        [0, 1, 2].map(|k| self.vertex_value(t, k) - value >= whole + turns[k])
    }

    /// Whether the curve enters a triangle through a side.
    fn enters(&self, t: u32, side: usize, value: f64, whole: f64) -> bool {
        let above = self.above(t, value, whole);
        above[side] == self.rises && above[(side + 1) % 3] != self.rises
    }

    /// Where the curve leaves a triangle. Of forward curves with rising levels, the higher values
    /// are on the left.
    fn exit(&self, t: u32, value: f64, whole: f64) -> Option<SidePoint> {
        let above = self.above(t, value, whole);
        let side = (0..3).find(|&k| above[k] != self.rises && above[(k + 1) % 3] == self.rises)?;
        let turns = self.winding.turns(t);
        let off = |k: usize| self.vertex_value(t, k) - value - (whole + turns[k]);
        let (a, b) = (off(side), off((side + 1) % 3));
        let share = a / (a - b);
        Some(SidePoint { triangle: t, side, share: if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 } })
    }
}
