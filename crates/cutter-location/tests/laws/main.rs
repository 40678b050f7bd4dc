//! Laws of the tilt and rotate search, of passes, entries, exits and links, against closed forms
//! and dense scans.

mod approach;
mod band;
mod branch;
mod certified;
mod heads;
mod kit;
mod link;
mod machine_bodies;
mod map;
mod map_cases;
mod mesh_bodies;
mod neighbours;
mod pairs;
mod pass_costs;
mod pass_ends;
mod passes;
mod postures;
mod rapid_blocks;
mod reasons;
mod relief;
mod rods;
mod search;
mod windings;
mod workcells;
