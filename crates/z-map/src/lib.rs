//! Z-map of a mesh: one height per node of a regular grid, one proven maximum per cell.
//!
//! CLOPT tests a tool pose against a Z-map: the surface's z at the (x, y) of a point is compared with the point's z.
//! Between nodes such an answer is an estimate ([`gouge_estimate`], [`ring_estimate`], [`corners_estimate`]); a
//! [`ZMap`] therefore also keeps the maximum of the mesh over every cell, which no point of the mesh exceeds, and a
//! pyramid of maxima over them. [`certainly_free`] answers from those alone: "free" is proven, anything else means that
//! the mesh has to decide.
//!
//! [`NodeHeights`] has the heights alone, where no proof is asked for.
//!
//! ```
//! use facemill_cl_data::{RoundFrustum, Solid};
//! use facemill_surface_model::TriMesh;
//! use facemill_z_map::{ZMap, ZMapSettings, certainly_free};
//! use nalgebra::{Isometry3, Point3, Translation3};
//!
//! let corners = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)].map(|(x, y)| Point3::new(x, y, 0.1 * x));
//! let ramp = TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])?;
//! let map = ZMap::build(&ramp, &Isometry3::identity(), &ZMapSettings { cell: 2.0, margin: 5.0 })?;
//! assert!((map.height_at(33.0, 50.0).unwrap() - 3.3).abs() < 1e-12);
//!
//! let pin = RoundFrustum { z_low: 0.0, z_high: 60.0, radius_low: 8.0, radius_high: 8.0, rounding: 2.0 };
//! let pose = |z: f64| Translation3::new(50.0, 50.0, z).into();
//! assert!(certainly_free(&map, &Solid::Frustum(pin), &pose(8.5)));
//! assert!(!certainly_free(&map, &Solid::Frustum(pin), &pose(6.0)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The map's frame is the caller's choice, z pointing away from the material; everything below the topmost surface
//! counts as material there, so under an overhang nothing is ever proven free. Lengths are mm. It must not know
//! machines.

mod certain;
mod dexel;
mod estimate;
mod heights;
mod lattice;
mod map;
mod pyramid;
mod raster;
mod separation;

pub use certain::certainly_free;
pub use dexel::{
    BodyError, Broken, Contact, Cut, DexelGrid, DexelMap, GridError, Interval, MAX_PIECES, MeshStockError, RoundRing,
    StockError, StockFileError, Sweep, SweepError, TriDexel, TurnedBody,
};
pub use estimate::{PointClearance, Ring, corners_estimate, gouge_estimate, ring_estimate};
pub use heights::NodeHeights;
pub use map::{ZMap, ZMapError, ZMapSettings};
