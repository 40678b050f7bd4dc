//! Tool vectors in place of rotary words: whether they are written, and with what their text says.

use nalgebra::Vector3;

use crate::dialect::file::VectorRule;
use crate::dialect::post_file::{Orientation, PostSettings};
use crate::program::FeedMode;

impl PostSettings {
    /// How tool vectors are written; `None` where rotary words are.
    #[must_use]
    pub fn vector_rule(&self) -> Option<&VectorRule> {
        let rtcp = self.rules.motion.rtcp.as_ref().filter(|_| self.feed_mode == FeedMode::Rtcp)?;
        rtcp.vectors.as_ref().filter(|_| self.orientation == Orientation::Vectors)
    }

    /// A vector as its text says it, of about unit length.
    #[must_use]
    pub fn vector_in_text(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let scale = 10f64.powi(self.rules.numbers.vector_decimals.into());
        Vector3::from(self.vector_units(vector).map(|units| units as f64 / scale))
    }

    /// Components in units of their last decimal.
    pub(crate) fn vector_units(&self, vector: &Vector3<f64>) -> [i64; 3] {
        let scale = 10f64.powi(self.rules.numbers.vector_decimals.into());
        [0, 1, 2].map(|k| (vector[k] * scale).round() as i64)
    }
}
