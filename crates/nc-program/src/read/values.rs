//! Values in NC text: numbers, expressions, functions and variables.

pub(crate) mod expression;
pub(crate) mod functions;
pub(crate) mod number;
pub(crate) mod variables;
