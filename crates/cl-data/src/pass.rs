//! Passes: points cut without lifting.

/// Points cut without lifting, in cutting order: CC points at first, poses and blocks later.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pass<T> {
    /// The points in cutting order.
    pub points: Vec<T>,
}

impl<T> Pass<T> {
    /// Creates a pass of these points.
    pub fn new(points: Vec<T>) -> Self {
        Self { points }
    }

    /// Maps every point, in order.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Pass<U> {
        Pass { points: self.points.iter().map(f).collect() }
    }
}
