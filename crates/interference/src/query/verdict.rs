//! Answers to queries of interference and distance.

use nalgebra::Point3;

/// Where a body touches the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Witness {
    /// Index of the triangle in the mesh.
    pub triangle: u32,
    /// A point of that triangle within the body, mesh frame. Of a body that is wholly inside a
    /// closed component it is the point where the component's surface is crossed on the way out
    /// along the body's z axis.
    pub point: Point3<f64>,
}

/// Whether a body touches the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It does not, and is not inside: proven.
    Free,
    /// It does, or is inside, or could not be proven free because a number is not finite.
    Hit(Witness),
}

impl Verdict {
    /// Whether it is [`Verdict::Free`].
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Free)
    }

    /// The triangle that was hit: the hint for the next pose.
    pub fn triangle(&self) -> Option<u32> {
        match self {
            Self::Free => None,
            Self::Hit(w) => Some(w.triangle),
        }
    }
}

/// Nearest point of the mesh to an undilated body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// Distance from the body's core to the mesh's surface, mm; 0 where they meet.
    pub distance: f64,
    /// Index of a nearest triangle in the mesh.
    pub triangle: u32,
    /// The point of that triangle, mesh frame.
    pub point: Point3<f64>,
}
