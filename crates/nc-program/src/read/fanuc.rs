//! Reader of the FANUC dialect.

mod block;
mod g_words;
mod lexer;
mod macros;
mod motion;
mod reader;
mod variant;
mod variant_codes;
mod variants;

pub use crate::read::fanuc::reader::{FanucReader, read_fanuc};
pub use crate::read::fanuc::variants::{read_haas, read_linuxcnc, read_mazak};
