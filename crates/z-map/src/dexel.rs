//! Dexel maps: stock with several intervals of material on each line, and what moving bodies take out of it.

mod body;
mod crossings;
mod cut;
mod deviation;
mod dilated;
mod file;
mod grid;
mod job;
mod lanes;
mod line_deviation;
mod map;
mod mesh_stock;
mod nearest;
mod placed;
mod run;
mod side;
mod skin;
mod steps;
mod straight;
mod sweep;
mod tile;
mod tri_dexel;
mod turning;

pub use body::{BodyError, RoundRing, TurnedBody};
pub use cut::{Contact, Cut};
pub use deviation::{Cavity, Deviation, DeviationError, Place};
pub use file::StockFileError;
pub use grid::{DexelGrid, GridError};
pub use map::{Broken, DexelMap, StockError};
pub use mesh_stock::MeshStockError;
pub use nearest::NearestMaterial;
pub use steps::{Step, StepResult};
pub use sweep::{MAX_PIECES, Sweep, SweepError};
pub use tile::Interval;
pub use tri_dexel::TriDexel;
