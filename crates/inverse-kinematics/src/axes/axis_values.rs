use std::ops::{Index, IndexMut};

/// Largest number of axes of a machine: the dual mill has nine.
pub const MAX_AXES: usize = 10;

/// One value per axis, in the order of [`Machine::axes`](crate::machine::Machine::axes): mm for
/// linear axes, rad for rotary ones.
///
/// They are the values on the machine's scales (joint values), not the words of an NC program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisValues {
    // Entries from `len` on are 0.
    values: [f64; MAX_AXES],
    len: usize,
}

impl AxisValues {
    /// Returns `n` axes at 0. More than [`MAX_AXES`] are cut off.
    pub fn zeros(n: usize) -> Self {
        Self { values: [0.0; MAX_AXES], len: n.min(MAX_AXES) }
    }

    /// Returns the value of each of `n` axes by its index. More than [`MAX_AXES`] are cut off.
    pub fn from_fn(n: usize, mut value: impl FnMut(usize) -> f64) -> Self {
        let mut q = Self::zeros(n);
        for k in 0..q.len {
            q.values[k] = value(k);
        }
        q
    }

    /// Returns the values of a slice; `None` when it is longer than [`MAX_AXES`].
    pub fn from_slice(values: &[f64]) -> Option<Self> {
        (values.len() <= MAX_AXES).then(|| Self::from_fn(values.len(), |k| values[k]))
    }

    /// Returns the number of axes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there is no axis.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the values in axis order.
    pub fn as_slice(&self) -> &[f64] {
        &self.values[..self.len]
    }

    /// Iterates over the values in axis order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.as_slice().iter().copied()
    }

    /// Returns the value of axis `index`, 0 where there is none.
    pub fn get_or_zero(&self, index: usize) -> f64 {
        self.values.get(index).copied().unwrap_or(0.0)
    }

    /// Returns every axis at the fraction `t` of its way from here (t = 0) to `end` (t = 1). Both
    /// ends are met exactly, and an axis that does not move keeps its value exactly.
    #[must_use]
    pub fn lerp(&self, end: &Self, t: f64) -> Self {
        if t == 1.0 {
            return *end;
        }
        Self::from_fn(self.len, |k| self.values[k] + (end.values[k] - self.values[k]) * t)
    }

    /// Returns whether every value is finite.
    pub fn is_finite(&self) -> bool {
        self.iter().all(f64::is_finite)
    }
}

impl<const N: usize> From<[f64; N]> for AxisValues {
    fn from(values: [f64; N]) -> Self {
        const { assert!(N <= MAX_AXES, "more values than MAX_AXES") };
        Self::from_fn(N, |k| values[k])
    }
}

impl Index<usize> for AxisValues {
    type Output = f64;
    fn index(&self, index: usize) -> &f64 {
        &self.values[..self.len][index]
    }
}

impl IndexMut<usize> for AxisValues {
    fn index_mut(&mut self, index: usize) -> &mut f64 {
        &mut self.values[..self.len][index]
    }
}

#[cfg(test)]
#[path = "../../tests/unit/axes/axis_values.rs"]
mod tests;
