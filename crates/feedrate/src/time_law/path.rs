use facemill_inverse_kinematics::AxisValues;
use nalgebra::Vector3;

/// A point of a path with its first three derivatives by the path's parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct PathPoint {
    /// Axis values and their first, second and third derivative.
    pub axes: [AxisValues; 4],
    /// Position of the tip and its derivatives, mm, for a path with a tip. Used only for the cap on
    /// the tip feed.
    pub tip: Option<[Vector3<f64>; 4]>,
}

/// A path of the axes q(u): three times differentiable within each of its pieces, and twice across
/// their ends.
pub trait JointPath {
    /// Returns the parameter at the ends of the pieces, ascending: one more than there are pieces.
    fn breaks(&self) -> Vec<f64>;

    /// Returns the point at `u` as a point of this piece: at its ends the derivatives are the
    /// limits from inside the piece.
    fn at(&self, piece: usize, u: f64) -> PathPoint;
}
