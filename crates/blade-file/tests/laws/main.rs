//! Laws of the reader of blade descriptions.

mod hostile_files;
mod read_blades;
