//! APT cutter-location files: tip and tool axis of a program before any machine.
//!
//! [`write_apt`] writes an [`AptSpec`]; [`read_apt`] reads files of this and other systems to an
//! [`AptFile`], with every statement kept, even with an unknown word. [`is_cl_file`] distinguishes
//! a CL file from the program of a control. [`arc_chords`], [`csys_frame`] and the checks beside
//! them are common to all that use the points of a file.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | `apt_file` | points, statements and their meaning |
//! | `words` | frames, units, and words that move the tool in ways that are not followed |
//! | `chords` | arcs as chords |
//! | `statement` | statements of a text: words, numbers, continued lines |
//! | `arc` | arcs of CIRCLE, MOVARC and TLON |
//! | `cutters` | cutters of CUTTER, TLDATA and Creo's comments |
//! | `reader` | statements to points and their meaning |
//! | `writer` | an [`AptSpec`] as text |
//!
//! It must not know machines or controls.

mod apt_file;
mod arc;
mod chords;
mod cutters;
mod reader;
mod statement;
mod words;
mod writer;

pub use apt_file::{
    AptArc, AptCoolant, AptCutter, AptFile, AptMeaning, AptMove, AptPoint, AptPointKind, AptSpec, AptStatement,
    AptUnknownWord, ClUnit, CutterWord, FileCutter, FileMill, is_cl_file,
};
pub use chords::arc_chords;
pub use cutters::CutterInForce;
pub use reader::{read_apt, read_apt_in};
pub use words::{ClFault, ClSystems, check_units, check_word, csys_frame, csys_note, free_text, major_word, unit_note};
pub use writer::write_apt;
