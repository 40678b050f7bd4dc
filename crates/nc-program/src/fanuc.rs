//! Reader of the FANUC dialect.

mod block;
mod g_words;
mod lexer;
mod modal;
mod motion;
mod reader;
mod variant;

pub use reader::{FanucReader, read_fanuc};
