//! The shortest lengths of a tool assembly with which a program collides with nothing (VMT fig. 2).
//!
//! A program moves the tip: of another assembly the tip and the tool axis go the same way, and the
//! bodies ride higher or lower on the axis. What a body that rides on a length needs at a position
//! is where it comes free of an obstacle when it goes up along the axis from where it stands.
//! Lengths only ever grow: the search begins with the shortest assembly there is, goes through the
//! program, and takes each length up to where its bodies are free at that position, until a whole
//! run takes none of them up. As every step was needed with the lengths below it, what it ends at
//! is the least there is, also where obstacles hang over the tool and a longer assembly would be
//! blocked again; that a margin above it is free, too, is another such run.
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
