//! Motions to certify, and the answer.

use nalgebra::{Isometry3, Point3, Vector3};

/// Motion of a solid over an interval of time, with its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionInterval {
    /// Pose in the middle of the interval.
    pub mesh_from_solid: Isometry3<f64>,
    /// Velocity of the solid's origin there, mm per unit of time, mesh frame.
    pub velocity: Vector3<f64>,
    /// Angular velocity there, rad per unit of time, mesh frame.
    pub spin: Vector3<f64>,
    /// Half of the interval's length: time runs from −half to half.
    pub half: f64,
    /// No point of the solid's core is ever farther than this from where its velocity in the middle
    /// would have brought it, mm.
    pub deviation: f64,
}

/// Whether a moving solid touches the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepVerdict {
    /// At no time of the interval: proven.
    Clear,
    /// Not proven; the triangle that could not be separated from the solid.
    Unproven(Option<u32>),
}

/// Poses that a solid gets into by two turns about a fixed point.
///
/// For a and b in −1..=1, the solid is turned from its pose in the middle about the centre by a
/// times the first turn, then by b times the second, and moved by at most `shift`. A solid of
/// revolution may be spun about its own axis besides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnRange {
    /// Pose in the middle, a = b = 0.
    pub mesh_from_solid: Isometry3<f64>,
    /// The fixed point, mesh frame.
    pub center: Point3<f64>,
    /// Largest turns, as axis times angle (rad), mesh frame.
    pub turns: [Vector3<f64>; 2],
    /// Largest movement besides, mm.
    pub shift: f64,
}

impl TurnRange {
    /// Sum of both angles, rad.
    fn angle(&self) -> f64 {
        self.turns[0].norm() + self.turns[1].norm()
    }

    /// No point at a distance from the centre moves farther than this, mm.
    pub fn farthest(&self, from_center: f64) -> f64 {
        self.angle() * from_center + self.shift
    }

    /// Returns the largest departure of a point at a distance from the centre from its first-order
    /// movement, mm.
    ///
    /// The second derivative along a straight way from the middle to any (a, b) is no longer than
    /// the square of the sum of the angles times the distance.
    pub fn remainder(&self, from_center: f64) -> f64 {
        0.5 * self.angle().powi(2) * from_center + self.shift
    }

    /// First-order movements of a mesh point, seen from the solid, at the four corners of the
    /// range.
    pub fn corner_moves(&self, q: &Point3<f64>) -> [Vector3<f64>; 4] {
        let [first, second] = self.turns.map(|turn| turn.cross(&(q - self.center)));
        [first + second, first - second, second - first, -first - second]
    }

    pub(crate) fn is_finite(&self) -> bool {
        let turns = self.turns.iter().flat_map(|t| t.iter());
        self.center.iter().chain(turns).chain([&self.shift]).all(|v| v.is_finite())
    }
}
