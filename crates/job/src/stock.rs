//! Stock before a setup: its map, rests of earlier jobs, the order of setups.

pub mod map;
pub mod rest;
pub mod setup_order;
pub mod walls;
