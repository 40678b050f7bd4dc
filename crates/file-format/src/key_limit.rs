//! Ranges of the numbers of a file, by key.

/// Range of a key's value, in the key's own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyLimit {
    /// Key of the file, as written; in whichever part of the file it is.
    pub key: &'static str,
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
}

impl KeyLimit {
    /// Range from `least` to `most`, both included.
    pub const fn new(key: &'static str, least: f64, most: f64) -> Self {
        Self { key, least, most }
    }

    /// Finds the range of the key that a field's path ends with, such as
    /// `rows[1].joint.prismatic.max_velocity_mm_min`; an index at its end does not count. `None`
    /// for a key without a range.
    pub fn of<'l>(limits: &'l [Self], field: &str) -> Option<&'l Self> {
        let key = field.rsplit('.').next().unwrap_or(field);
        let key = key.split('[').next().unwrap_or(key);
        limits.iter().find(|limit| limit.key == key)
    }

    /// Whether a value is in the range; NaN is in none.
    pub fn contains(&self, value: f64) -> bool {
        (self.least..=self.most).contains(&value)
    }
}
