//! Small planned programs, read back from their text.

mod time_law;
mod turning;
