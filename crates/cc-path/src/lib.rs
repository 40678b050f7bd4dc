//! CC paths: the points where the cutter is to touch the part, in passes.
//!
//! They come from one of two sources:
//! - a path file, read by [`read_path_file`] and put on the drive surface by [`project`];
//! - [`lay_passes`]: curves on a [`Region`] of the drive surface by a [`Strategy`]. [`Sections`] by
//!   parallel planes or coaxial cylinders give every place a *level* (distance along the
//!   normal, radius), a [`Flow`] does so by a field between two borders of the region; passes are
//!   curves of equal level, or one [`Spiral`] over them. The caller says how wide a strip may be at
//!   a CC point, and levels are chosen so that no neighbours lie farther apart along the surface;
//!   points are put on them by chord tolerance, largest step and turn of the normal. With
//!   [`LaySettings::edge_fill`], passes are *fronts* instead: they lean from the levels as the
//!   strip width requires, and partial passes fill up an edge where strips are narrow. An [`Edge`]
//!   or [`Root`] has passes at distances from a line on the surface.
//!
//! ```
//! use facemill_cc_path::{LaySettings, PathError, Strategy, lay_passes};
//! use facemill_cc_path::strategies::{ParallelPlanes, Region, UncutSide};
//! use facemill_cl_data::Silent;
//! use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
//! use nalgebra::{Point3, Vector3};
//!
//! // A rectangle of 100 mm × 60 mm, to be cut along x in strips of at most 12 mm.
//! let corners = [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]].map(|[x, y]| Point3::new(x, y, 0.0));
//! let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).expect("indices are in range");
//! let surface = Surface::new(mesh, SurfaceSettings::default());
//! let planes = ParallelPlanes { origin: Point3::origin(), normal: Vector3::y_axis(), from: None, to: None };
//! let settings = LaySettings { max_step_over: 20.0, uncut: Some(UncutSide::Left), ..LaySettings::default() };
//!
//! let strategy = Strategy::ParallelPlanes(planes);
//! let laid = lay_passes(&surface, &Region::default(), &strategy, &settings, &|_| 12.0, &Silent)?;
//!
//! assert_eq!(laid.passes.len(), 6, "five strips");
//! // From the lowest y up, with uncut stock on the left: the feed is +x.
//! assert!(laid.passes.iter().all(|p| p.pass.points[0].feed == Vector3::x_axis()));
//! # Ok::<(), PathError>(())
//! ```
//!
//! Guaranteed: every point lies on the mesh and on its level, front or spiral to rounding; the
//! result is the same on any number of threads; no input makes it panic. Estimated: chords, from
//! the turn of the smooth normals inside facets.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `path_file` | Path files: passes of CC points as a user writes them |
//! | `error` | faults of path files and of passes that cannot be laid |
//! | `left_region` | surface on which stock is left, by heights measured on places |
//! | `sections` | sections by planes and cylinders, which give every place a level |
//! | `region` | regions: the part of the drive surface that passes are laid on |
//! | `strategy` | strategies: settings of the passes on a surface, and their limits |
//! | `harmonic` | harmonic functions on meshes: fields between curves, the angle around a tube |
//! | `distance` | distance along the surface from curves on it |
//! | `layout` | passes laid on a surface: level curves, their step by strip widths, their order |
//! | `project` | points of a path file projected on a surface |
//! | `samples` | points spread evenly over a region of the drive surface: where it is measured what a program leaves |
//!
//! It must not know holders or machines; what it needs to know of the tool comes in as the strip
//! width.
//!
//! Inside: `region` chooses triangles, `patch` cuts them at the box and refines them, `widths` gets
//! strip widths, `levels` chooses levels; `edge_fill` plans fronts and puts them on the patch;
//! `section_layout` decides between both; `field` has levels of a flow and spirals; `offset` has
//! passes beside a line; `scallop` advances fronts along the surface by `distance`; `trace` finds
//! the curves, `resample` puts points on them, `order` puts them in order; `samples` spreads
//! points over a region, one in each cell of a `lattice`, whatever is laid on it, or along the
//! lines of a `line_band`; `size` bounds all of them.
//!
//! [`Edge`]: strategies::Edge
//! [`Flow`]: strategies::Flow
//! [`Region`]: strategies::Region
//! [`Root`]: strategies::Root
//! [`Sections`]: strategies::Sections
//! [`Spiral`]: strategies::Spiral
//! [`read_path_file`]: files::read_path_file

mod distance;
mod error;
mod harmonic;
#[cfg(test)]
#[path = "../tests/unit/laws/mod.rs"]
mod laws;
mod layout;
mod left_region;
mod path_file;
mod project;
mod region;
mod samples;
mod sections;
mod strategy;
#[cfg(test)]
#[path = "../tests/unit/test_kit.rs"]
mod test_kit;

pub use crate::error::{PathError, Remedy};
pub use crate::layout::field::possible_flows::{PossibleFlow, possible_flows};
pub use crate::layout::generate_passes::{LaidPass, PassLayout, lay_passes};
pub use crate::layout::offset::rolling_ball::CornerRest;
pub use crate::left_region::{LeftIsland, LeftRegion, StockHeight, StripPoint};
pub use crate::project::{ProjectSettings, feed_along, project};
pub use crate::samples::{RegionSample, RequestedRegion, RequestedStrategy};
pub use crate::strategy::Strategy;
pub use crate::strategy::settings::LaySettings;
pub use crate::strategy::size::MAX_POINTS;

/// Files of paths and strategies.
pub mod files {
    pub use crate::path_file::{
        PassFile, PathFile, PathFileError, PathFormat, PathFrame, read_path_file, write_path_file,
    };
    pub use crate::strategy::edge_file::{EdgeFile, EdgeLineFile, RootFile, RootLineFile};
    pub use crate::strategy::field_file::{
        FlowCurveFile, FlowCylinderFile, FlowEndFile, FlowFile, FlowPlaneFile, SpiralFile,
    };
    pub use crate::strategy::file::{
        BoxFile, CylindricalSectionsFile, NormalConeFile, ParallelPlanesFile, RegionFile, StrategyFile,
    };
    pub use crate::strategy::left_above_file::{LeftAboveFile, LeftOfFile, ProgramWithToolFile};
    pub use crate::strategy::scallop_file::{
        ConstantScallopFile, SectionsFile, SeedCylinderFile, SeedFile, SeedPlaneFile,
    };
}

/// Strategies, the sections that they lie in, and what limits them.
pub mod strategies {
    pub use crate::region::{NormalCone, Region};
    pub use crate::sections::{CylindricalSections, ParallelPlanes, Sections};
    pub use crate::strategy::edge::{Edge, EdgeLine, Root, RootLine};
    pub use crate::strategy::field::{Flow, FlowEnd, Spiral, SpiralLevels};
    pub use crate::strategy::scallop::{ConstantScallop, Seed};
    pub use crate::strategy::settings::{Direction, LevelOrder, Pattern, UncutSide};
}
