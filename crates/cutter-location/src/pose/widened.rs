//! CC points at which a proof needed a larger width than requested.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use facemill_cl_data::CcPoint;

/// Points at which the width of a proof had to be larger than requested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widened {
    /// Their number.
    pub points: usize,
    /// The largest width that was reached at one of them.
    pub largest: f64,
}

impl Widened {
    /// Adds up the points of two tests.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { points: self.points + other.points, largest: self.largest.max(other.largest) }
    }
}

/// Largest width of each point that needed more than the requested one, by the bits of its place: a
/// sum that does not depend on the order of the searches.
#[derive(Debug, Default)]
pub(crate) struct Widths(Mutex<BTreeMap<[u64; 3], f64>>);

impl Widths {
    pub(crate) fn note(&self, cc: &CcPoint, width: f64) {
        let place = [cc.position.x, cc.position.y, cc.position.z].map(f64::to_bits);
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let largest = all.entry(place).or_insert(width);
        *largest = largest.max(width);
    }

    pub(crate) fn widened(&self) -> Option<Widened> {
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let largest = all.values().copied().reduce(f64::max)?;
        Some(Widened { points: all.len(), largest })
    }
}
