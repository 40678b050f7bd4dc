//! Rewriting of existing programs.
//!
//! [`feed_rewrite::rewrite_feeds`] writes feeds that the axes reach, for a steady feed of the tip,
//! into a program line by line; [`rapids`] replaces its links by faster ones that are free;
//! [`lengths`] finds the shortest tool with which it is free.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | [`mod@lengths`] | shortest tool assembly for an existing program, or of a holder library, and postures that let a shorter one pass |
//! | [`mod@rapids`] | faster links for an existing program: each replaced by the fastest path that is proven free of the stock at that time |
//! | `feed_rewrite` | new feeds for an existing program: the tip, not the norm over all axes, moves at the programmed speed (FEED) |
//!
//! It must not know how a program was planned.

pub mod feed_rewrite;
pub mod lengths;
pub mod rapids;
