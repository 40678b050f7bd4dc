//! Programs that exist, written anew.
//!
//! [`refeed`] puts feeds that the axes reach, for a steady feed of the tip, into a program line by
//! line; [`rapids`] replaces its links by faster ones that are free; [`lengths`] finds the shortest
//! tool with which it is free.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@lengths`] | the shortest tool assembly for a program that exists, or of a holder library, and postures that let a shorter one pass |
//! | [`mod@rapids`] | faster links for a program that exists: each replaced by the fastest way that is proven free, against the stock as it is then |
//! | [`mod@refeed`] | new feeds for a program that exists: the tip moves as fast as programmed, not the norm over all axes (FEED) |
//!
//! It must not know how a program was planned.

pub mod lengths;
pub mod rapids;
pub mod refeed;
