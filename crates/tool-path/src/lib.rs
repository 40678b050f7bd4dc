//! Conversion of tested poses to moves of a program.
//!
//! A pass of tested poses becomes segments between points without a pose, each on one branch of the
//! machine, with tested poses inserted until the control stays near the path ([`segments`],
//! [`linearity`]). Full turns of rotary axes are chosen for all of them ([`winding`]). They get
//! entries, exits and links ([`moves`]), in the order with the fastest links ([`moves::order`]).
//! [`links`] finds the fastest free way from one place to another: its paths
//! ([`links::link_paths`]), their times ([`links::clock`]), the choice among them
//! ([`links::choose`]), the order of many ([`links::tour`]). [`segments::pole`] keeps postures off
//! the pole, [`segments::steep_cuts`] ends segments where the tool would go down into stock too
//! steeply. [`chips`] computes the section of the chip.
//!
//! Modules; each imports only those above it:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@linearity`] | deviation of the control from the intended motion between two blocks |
//! | [`mod@links`] | links: the fastest free way from one run of cuts to the next |
//! | `outline_table` | heights of a cutter's outline from a table: many heights of the same outline for little more than the points of the table |
//! | [`mod@chips`] | chip section at one point of a pass (CHIP, with the outline of the tilted cutter seen along the feed) |
//! | [`mod@path_error`] | failures of moves |
//! | [`mod@segments`] | from planned passes to segments that are cut without lifting, in every place of the pattern |
//! | [`mod@winding`] | full turns of limited rotary axes, cut by cut, over a whole operation |
//! | [`mod@moves`] | from segments to the sequence of moves of an operation: entries, cuts, exits, links, with axis values |
//!
//! It must not know jobs, files of jobs, or program text except for the rapids of links.

pub mod chips;
pub mod linearity;
pub mod links;
#[cfg(test)]
#[path = "../tests/unit/move_laws.rs"]
mod move_laws;
pub mod moves;
mod outline_table;
pub mod path_error;
pub mod segments;
pub mod winding;
#[cfg(test)]
#[path = "../tests/unit/winding_laws.rs"]
mod winding_laws;
