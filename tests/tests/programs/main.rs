//! Jobs that are planned, what is written of them, and what programs from anywhere are held to. All
//! in one executable: its tests fill both cores, and the planner is linked once. `cargo test -p
//! facemill-tests --test programs MODULE` runs those of a module.

mod chip_feeds;
mod command_line;
mod control_files;
mod feed_modes;
mod first_contact;
mod limits;
mod machines;
mod own_dialects;
mod own_parts;
mod post_command;
mod program_commands;
mod program_variants;
mod rapids;
mod schemas;
mod setup_variants;
mod shared_blades;
mod shared_meshes;
mod splitter_blades;
mod strategies;
mod three_rotaries;
mod tool_commands;
mod tool_vectors;
mod verification;
mod whole_propeller;
