//! The shortest lengths of a tool assembly with which a program collides with nothing (VMT fig. 2).
//!
//! A program moves the tip: with another assembly the tip and the tool axis go the same way, and
//! the bodies ride higher or lower on the axis. The need of a body that rides on a length is, at
//! each position, the least rise along the axis that frees it of an obstacle. Lengths only ever
//! grow: the search begins with the shortest possible assembly, goes through the program, and
//! raises each length until its bodies are free at that position, until a whole run raises none. As
//! every step was needed with the lengths below it, the search ends at the least free lengths, also
//! where obstacles hang over the tool and block a longer assembly again; another such run proves
//! that a margin above them is free, too.
//!
//! | module | answers |
//! |---|---|
//! | [`posted`] | the program as it is posted for another length |
//! | [`mesh_needs`] | what meshes and bodies of the machine ask of the lengths, position by position |
//! | [`stock_needs`] | what the stock as it is at every moment asks, way by way |
//! | `search` | lengths that neither asks more of, and the margin |

mod mesh_needs;
mod needs;
mod posted;
mod search;
mod stock_needs;

pub use needs::ForcedBy;
pub use posted::{posted_for_length, words_of_length};
pub use search::{ClearLengths, LengthSettings, LengthStock, clear_lengths};
