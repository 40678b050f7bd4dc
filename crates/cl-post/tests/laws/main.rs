//! Laws of posted CL files.

mod arcs;
mod kit;
mod linuxcnc_interpreter;
mod paths;
mod refused;
mod round_trip;
mod shared_files;
mod statements;
mod tools;
mod turns;
