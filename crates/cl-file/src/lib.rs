//! APT cutter-location files: tip and tool axis of a program before any machine.
//!
//! [`write_apt`] writes an [`AptSpec`]; [`read_apt`] reads what this and other systems write to an
//! [`AptFile`], with every statement kept, also where its word is not known. [`is_cl_file`] tells a
//! CL file from the program of a control.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `apt_file` | points, statements and their meaning |
//! | `statement` | statements of a text: words, numbers, continued lines |
//! | `reader` | statements to points and their meaning |
//! | `writer` | an [`AptSpec`] as text |
//!
//! It must not know machines or controls.

mod apt_file;
mod reader;
mod statement;
mod writer;

pub use apt_file::{
    AptCutter, AptFile, AptMeaning, AptMove, AptPoint, AptPointKind, AptSpec, AptStatement, AptUnknownWord, is_cl_file,
};
pub use reader::read_apt;
pub use writer::write_apt;
