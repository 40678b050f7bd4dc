//! Z-map of a mesh: one height per node of a regular grid, one proven maximum per cell. And dexel
//! maps: stock with several intervals of material on each line.
//!
//! CLOPT tests a tool pose against a Z-map: the surface's z at the (x, y) of a point is compared
//! with the point's z. Between nodes such an answer ([`ZMap::height_at`]) is an estimate; a
//! [`ZMap`] therefore also keeps the maximum of the mesh over every cell, which no point of the
//! mesh exceeds, and a pyramid of maxima over them. [`certainly_free`] answers from those alone:
//! "free" is proven, anything else means that the mesh has to decide.
//!
//! [`NodeHeights`] has the heights alone, where no proof is needed.
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
//! A [`DexelMap`] is a solid as parallel lines. What a body of revolution sweeps is taken out of it
//! ([`DexelMap::remove`]), from each line exactly what is inside, or within a stated tolerance
//! where the axis turns; [`DexelMap::meets`] only queries, and [`DexelMap::nearest`] returns the
//! distance of a solid. It is made from a box, a cylinder or a closed mesh with an allowance, kept
//! as bytes, and exported as a closed mesh. [`DexelMap::deviation`] compares it with the part that
//! it should have become.
//!
//! ```
//! use facemill_cl_data::ClPoint;
//! use facemill_tool_model::Cutter;
//! use facemill_z_map::{DexelMap, Sweep, TurnedBody};
//! use nalgebra::{Isometry3, Point3, Vector3};
//!
//! let mut stock = DexelMap::of_box(&Isometry3::identity(), [0.0; 3], [60.0, 40.0, 20.0], 0.5)?;
//! let body = TurnedBody::of_cutter(&Cutter::new(5.0, 1.0, 15.0)?);
//! let at = |x: f64| ClPoint { tip: Point3::new(x, 20.0, 18.0), axis: Vector3::z_axis() };
//! let cut = stock.remove(&Sweep { body: &body, from: at(-10.0), to: at(70.0) }, 0.01)?;
//! // A slot of 10 mm, 2 mm deep, less what its two round corners of 1 mm leave.
//! let section = 20.0 - 2.0 * (1.0 - std::f64::consts::FRAC_PI_4);
//! assert!((cut.volume / (60.0 * section) - 1.0).abs() < 0.03);
//! assert_eq!(DexelMap::from_bytes(&stock.to_bytes())?, stock);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`SweptCutter`] answers the opposite question: the height of the material that a cutter's
//! motions leave on places of a surface, along the surface's normal and without a grid.
//!
//! A Z-map's frame is the caller's choice, z pointing away from the material; everything below the
//! topmost surface counts as material there, so under an overhang nothing is ever proven free.
//! Lengths are mm.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `dexel` | dexel maps: stock with several intervals of material on each line, and what moving bodies take out of it |
//! | `left` | heights of material that a moving cutter leaves on places of a surface |
//! | `pyramid` | highest values of blocks of cells, level by level |
//! | `raster` | regular grid of a Z-map, and triangles raised on it |
//! | `lattice` | raising the nodes of a grid to a triangle |
//! | `map` | Z-map: heights over a grid, with the highest of each cell |
//! | `separation` | proofs that boxes are farther than a distance from a body |
//! | `certain` | bodies that are certainly free of a map |
//!
//! It must not know machines.

mod certain;
mod dexel;
mod lattice;
mod left;
mod map;
mod pyramid;
mod raster;
mod separation;

pub use crate::left::SweptCutter;
pub use crate::left::place::LeftHeight;
pub use crate::left::place::{CutterMotion, SurfacePlace};
pub use crate::map::heights::NodeHeights;
pub use certain::certainly_free;
pub use dexel::{
    BodyError, Broken, Cavity, Contact, Cut, Deviation, DeviationError, DeviationPoint, DexelGrid, DexelMap, GridError,
    Interval, MAX_PIECES, MeshStockError, NearestMaterial, RoundRing, Step, StepResult, StockError, StockFileError,
    Sweep, SweepError, TriDexel, TurnedBody,
};
pub use left::left_heights;
pub use map::{ZMap, ZMapError, ZMapSettings};
