//! Two channel programs for Siemens 840D from one program of two heads: writer, and a reader of its
//! programs.
//!
//! [`write_siemens_pair`] writes a program per channel with marks at which both wait for each
//! other; [`read_siemens_pair`] reads such a pair, and refuses any other statement.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `fault` | faults of a pair |
//! | `pair` | settings of a pair, and a pair that was read |
//! | `statement` | statements of a line |
//! | `statements` | statements of a program, in order |
//! | `reader` | both programs to blocks of both heads |
//! | `channel` | axes of a channel, and their words |
//! | `writer` | a program of two heads as two texts |
//!
//! It must not know how motions were planned.

mod channel;
mod fault;
mod pair;
mod reader;
mod statement;
mod statements;
mod writer;

pub use crate::fault::{SiemensFault, SiemensReadError};
pub use crate::pair::{ReadPair, ReadPairBlock, SiemensFeed, SiemensPair, SiemensSettings};
pub use crate::reader::read_siemens_pair;
pub use crate::writer::write_siemens_pair;
