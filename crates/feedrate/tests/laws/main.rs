//! Laws of feeds, of the times of blocks, and of the least time along a path.

mod feeds;
mod golden;
mod pair;
mod time_law;
