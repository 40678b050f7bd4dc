//! Turns of the tool axis of a file along its passes.

use facemill_cl_data::ClPoint;
use nalgebra::Point3;

/// Turns of the tool axis from one point of the file to the next, in passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisTurns {
    /// Largest turn, rad.
    pub largest: f64,
    /// Line of the point to which it leads; `None` where the axis does not turn.
    pub line: Option<u32>,
    /// Number of jumps: turns by more than [`JUMP_DEG`], and by more than that per mm of the way of
    /// the contact.
    pub jumps: usize,
    /// Line of the first of them.
    pub first_jump: Option<u32>,
}

/// Turn above which it can be a jump, deg; and that per mm. Smaller: turns at corners of a smooth
/// path count; larger: a jump that marks the surface does not.
pub const JUMP_DEG: f64 = 5.0;

/// Turn below which there is none, rad: rounding of the file.
const ROUNDING: f64 = 1e-9;

impl AxisTurns {
    /// Adds the poses of a pass in the file's order with their contacts and lines; poses inserted
    /// on the way to a point have its line.
    pub(crate) fn add_pass(&mut self, poses: &[(ClPoint, Point3<f64>, u32)]) {
        let (mut turn, mut way) = (0.0, 0.0);
        for (k, ends) in poses.windows(2).enumerate() {
            let [(before, from, _), (after, to, line)] = [ends[0], ends[1]];
            turn += angle(&before, &after);
            way += (to - from).norm();
            if poses.get(k + 2).is_none_or(|next| next.2 != line) {
                self.add(turn, way, line);
                (turn, way) = (0.0, 0.0);
            }
        }
    }

    fn add(&mut self, turn: f64, way: f64, line: u32) {
        if turn > self.largest.max(ROUNDING) {
            (self.largest, self.line) = (turn, Some(line));
        }
        if turn > JUMP_DEG.to_radians() && turn > JUMP_DEG.to_radians() * way {
            self.jumps += 1;
            self.first_jump = Some(self.first_jump.map_or(line, |first| first.min(line)));
        }
    }
}

fn angle(a: &ClPoint, b: &ClPoint) -> f64 {
    a.axis.cross(&b.axis).norm().atan2(a.axis.dot(&b.axis))
}
