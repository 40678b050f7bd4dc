//! Dexel maps: stock with several intervals of material on each line, and what moving bodies take out of it.

mod body;
mod cut;
mod grid;
mod map;
mod side;
mod straight;
mod sweep;
mod tile;

pub use body::{BodyError, RoundRing, TurnedBody};
pub use cut::{Contact, Cut};
pub use grid::{DexelGrid, GridError};
pub use map::{Broken, DexelMap, StockError};
pub use sweep::{MAX_PIECES, Sweep, SweepError};
pub use tile::Interval;
