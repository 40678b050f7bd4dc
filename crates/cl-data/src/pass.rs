//! Passes: points cut without lifting.

/// Points cut without lifting, in the order they are cut: CC points on their way in, poses and
/// blocks on their way out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pass<T> {
    /// The points in cutting order.
    pub points: Vec<T>,
}

impl<T> Pass<T> {
    /// A pass of these points.
    pub fn new(points: Vec<T>) -> Self {
        Self { points }
    }

    /// Every point mapped, in order.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Pass<U> {
        Pass { points: self.points.iter().map(f).collect() }
    }
}
