//! Words of NC text: axes, lengths and numbers.

pub(crate) mod axis_lengths;
pub(crate) mod axis_words;
pub mod number_text;
pub(crate) mod said_words;

pub use crate::words::axis_lengths::AxisLengths;
pub use crate::words::axis_words::{AxisKind, AxisNameError, AxisWord, TooManyAxes};
pub use crate::words::said_words::{SaidWords, StateWord};
