//! Positions of the axes that words of a program lead to.

pub(crate) mod resolver;
pub(crate) mod rolled_words;
pub(crate) mod tool_vectors;
