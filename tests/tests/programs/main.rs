//! Jobs that are planned, what is written of them, and what programs from anywhere are held to. All
//! in one executable: its tests fill both cores, and the planner is linked once. `cargo test -p
//! facemill-tests --test programs MODULE` runs those of a module.

mod certificates;
mod chip_feeds;
mod command_line;
mod constant_scallop;
mod edges_and_roots;
mod feed_modes;
mod first_contact;
mod flow_and_spiral;
mod left_above;
mod limits;
mod machines;
mod mended;
mod mutants;
mod paths;
mod planted_faults;
mod program_commands;
mod program_variants;
mod rapids;
mod read_back;
mod real_programs;
mod rejected;
mod remaining;
mod schemas;
mod setup_variants;
mod shared_meshes;
mod solution_space;
mod three_rotaries;
mod tool_vectors;
mod turns;
mod verify_stock;
