//! Tested poses to moves of a program.
//!
//! A pass of tested poses becomes pieces between points without a pose, each on one branch of the machine, with tested poses put
//! between points until the control keeps near the path ([`pieces`], [`linearity`]); full turns of rotary axes are chosen for all
//! of them ([`winding`]); they get entries, exits and links ([`moves`]), in the order in which links take the least time
//! ([`moves::order`]). [`links`] finds the fastest free way from one place to another: its ways ([`links::ways`]), their times ([`links::clock`]), the
//! choice among them ([`links::choose`]), the order of many ([`links::tour`]). [`pieces::pole`] keeps postures off the pole. [`chips`] has the section that a cutter takes.
//!
//! It must not know jobs, files of jobs, or text of programs but for the rapids of links.

pub mod chips;
pub mod linearity;
pub mod links;
#[cfg(test)]
mod move_laws;
pub mod moves;
mod outline_table;
pub mod path_error;
pub mod pieces;
pub mod winding;
#[cfg(test)]
mod winding_laws;
