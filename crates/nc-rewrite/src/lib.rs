//! Programs that exist, written anew.
//!
//! [`refeed`] puts feeds that the axes reach, for a steady feed of the tip, into a program line by line; [`rapids`] replaces its
//! links by faster ones that are free; [`lengths`] finds the shortest tool with which it is free.
//!
//! It must not know how a program was planned.

pub mod lengths;
pub mod rapids;
pub mod refeed;
