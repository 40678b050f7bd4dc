//! Laws of programs with the files that they call.

mod places;
