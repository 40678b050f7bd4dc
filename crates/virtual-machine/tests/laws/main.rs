//! Programs as text on the virtual machine: planted faults and their twins, certificates, and the
//! stock as it is cut.

mod kit;

mod certificate_scenes;
mod certificates;
mod control;
mod dead_core;
mod estimate;
mod far_words;
mod links;
mod links_of_heads;
mod lost_positions;
mod machine_bodies;
mod machine_stock;
mod mesh_bodies;
mod one_motion;
mod outside;
mod planted_faults;
mod rollover;
mod stock_motion;
mod stock_of_heads;
mod stock_run;
mod tool_vectors;
mod two_heads;
