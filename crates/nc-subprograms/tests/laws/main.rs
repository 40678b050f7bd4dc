//! Laws of subprograms: splitting and expanding gives the program, and lines are those of the
//! files.

mod calls;
mod interpreter;
mod kit;
mod round_trip;
