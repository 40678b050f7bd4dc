//! Laws of the tilt and rotate search, of passes, entries, exits and links, against closed forms
//! and dense scans.

mod certified;
mod heads;
mod kit;
mod links;
mod machine_bodies;
mod maps;
mod mesh_bodies;
mod pairs;
mod pass_search;
mod reasons;
mod refused_ways;
mod relief;
mod rods;
mod search;
mod workcells;
