//! Words of NC text: axes, lengths and numbers.

pub(crate) mod axis_lengths;
pub(crate) mod axis_words;
pub mod number_text;
pub(crate) mod said_words;
