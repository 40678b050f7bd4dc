//! Dexel maps: stock with several intervals of material on each line, and what moving bodies take
//! out of it.

pub(crate) mod bodies;
mod crossings;
mod cut;
mod deviation;
mod file;
mod grid;
mod job;
mod map;
mod mesh_stock;
mod nearest;
mod run;
mod skin;
mod steps;
mod tile;
mod tri_dexel;

pub use crate::dexel::bodies::body::{BodyError, RoundRing, TurnedBody};
pub use crate::dexel::bodies::sweep::{MAX_PIECES, Sweep, SweepError};
pub use cut::{Contact, Cut};
pub use deviation::{Cavity, Deviation, DeviationError, DeviationPoint};
pub use file::StockFileError;
pub use grid::{DexelGrid, GridError};
pub use map::{Broken, DexelMap, StockError};
pub use mesh_stock::MeshStockError;
pub use nearest::NearestMaterial;
pub use steps::{Step, StepResult};
pub use tile::Interval;
pub use tri_dexel::TriDexel;
