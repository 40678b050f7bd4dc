//! NC programs with subprograms: calls expanded to one text, and passes made subprograms.
//!
//! [`expand`] puts the blocks of subprograms in place of the calls, so that readers of flat
//! programs read what the control runs; a [`LineMap`] gives the line of the written files for each
//! line. [`split`] takes [`Section`]s of a flat program out of it as subprograms, in the same file
//! or in files of their own; [`pass_sections`] finds the passes of a program of `facemill`.
//!
//! ```
//! use facemill_nc_program::Dialect;
//! use facemill_nc_subprograms::expand;
//!
//! let text = b"%\nO1\nG0 X0.\nM98 P2\nM30\nO2\nG1 X5. F100.\nM99\n%\n";
//! let expanded = expand(text, "main.nc", Dialect::Fanuc, &|_| None)?.expect("a call");
//! assert_eq!(expanded.text, b"%\nO1\nG0 X0.\nG1 X5. F100.\nM30\n%\n");
//! assert_eq!(expanded.lines.written(4), 7);
//! # Ok::<(), facemill_nc_subprograms::ExpandError>(())
//! ```
//!
//! Guarantees: a call is expanded only where its subprogram is found and has no branch, no jump, no
//! local variable and no end of the program, so that the flat text does what the control does; any
//! other call stays as it is, and a reader reports it. Text, depth, executed blocks and files are
//! bounded. Splitting and expanding a program gives its blocks in their order.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `line_map` | lines of written files for lines of an expanded text |
//! | `line_code` | a line without number, blanks and comments |
//! | `calls` | calls, begins and ends of subprograms of each control |
//! | `sources` | files of programs, with the lines where subprograms begin and end |
//! | `expand` | calls replaced by the blocks of subprograms |
//! | `sections` | passes and operations of a program |
//! | `split` | sections of a program as subprograms |
//!
//! It must not know jobs and machines, and opens no file.

mod calls;
mod expand;
mod line_code;
mod line_map;
mod sections;
mod sources;
mod split;

pub use expand::{ExpandError, ExpandedFile, ExpandedProgram, expand, renumbered};
pub use line_map::LineMap;
pub use sections::{Section, operation_sections, pass_sections};
pub use sources::may_call;
pub use split::{SplitError, SplitProgram, SplitSettings, split};
