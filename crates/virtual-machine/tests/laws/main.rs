//! Programs as text on the virtual machine: planted faults and their twins, certificates, and the
//! stock as it is cut.

mod certificate_scenes;
mod certificates;
mod control;
mod estimate;
mod far_words;
mod kit;
mod lost_positions;
mod machine_bodies;
mod mesh_bodies;
mod one_motion;
mod planted_faults;
mod rollover;
mod stock;
mod tool_vectors;
mod two_heads;
