//! Sample parts as triangle meshes, from tables and from formulas.
//!
//! - Propellers: [`PropellerSpec`] names a [`PropellerSeries`] or has a [`PropellerTable`], and a
//!   diameter; [`blade`] and
//!   [`hub`] mesh one blade and the hub, [`blade_pose`] places the others. [`BladeSurface`] is the
//!   smooth blade behind the mesh, [`chord_error`] their distance.
//! - [`AntiSingingEdge`]: a chamfer of the trailing edges, which all of these have that are made of
//!   a [`PropellerSpec`] with it.
//! - [`propeller_solid`]: hub with bore, blades and root fillets as one closed solid;
//!   [`RootFillet`] has its radii, [`fillet_contact`] the ball in one place.
//! - [`rotor37`]: a compressor blade.
//! - [`BladeLoft`]: a smooth blade through sections of points, and its mesh, from section to
//!   section or between [`Endwalls`] (hub and shroud), with a sector of the hub.
//! - [`patch`]: a wavy sculptured patch with exact normals and curvatures.
//! - [`casting`]: any of these solids with uneven material on it.
//! - [`turned_casting`]: the same with a hub that is turned before.
//! - [`turned_solid`]: a solid of revolution, such as an arbor that clamps a hub.
//! - [`AnalyticPart`]: plane, sphere, cylinder, torus and saddle with exact closest points.
//!
//! Lengths are in mm. [`blade`] and [`hub`] are closed, wound outward, and separate: as solids they
//! overlap, the blade's root reaches into the hub. Mesh vertices lie on the smooth surface. The
//! propeller frame has the shaft as +Z, pointing ahead, so that suction sides face +Z; propellers
//! are right-handed (driving, they turn about +Z) unless their table says otherwise. Blade 0 has
//! its generator line along +X.
//!
//! ```
//! use facemill_sample_parts::{BladeResolution, PropellerSeries, PropellerSpec, SpecError, blade, blade_pose, hub};
//!
//! let spec = PropellerSpec::new(PropellerSeries::Dtmb4119, 3048.0)?;
//! let first = blade(&spec, BladeResolution::for_chord_tolerance(&spec, 0.5)?);
//! let others = (1..spec.n_blades()).map(|k| first.transformed(&blade_pose(&spec, k)));
//! let propeller = others.fold(hub(&spec, 0.5)?.joined(&first), |all, blade| all.joined(&blade));
//! assert_eq!(propeller.groups().len(), 2 + 3 * 5);
//! # Ok::<(), SpecError>(())
//! ```
//!
//! How true the propellers are:
//! - DTMB 4119 and 4382 have their published sections (NACA 66 modified, a = 0.8). The tip, where
//!   the table of 4119 ends in a point, is a rounded edge of 4 % of D.
//! - VP1304 has its published chord, pitch, skew, rake, thickness and camber, on the same section
//!   form: its own ordinates are not in the table. Against a blade of 250 mm made with other
//!   ordinates the largest deviation is 0.45 mm (at the tip; 0.38 mm elsewhere).
//! - Wageningen B has its published sections but for the thickness of the edges, 5 % of the largest
//!   thickness here; two blades use the columns for three.
//! - Edges and tip are rounded with half their thickness, inside chord and radius.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `grouped_mesh` | meshes with named groups |
//! | `sheets` | sheets of a blade: rows of vertices from root to tip |
//! | `spec_error` | faults of a part's description |
//! | `spline` | cubic spline with two continuous derivatives through table values |
//! | `propeller` | propellers: blades from radial tables, and a hub |
//! | `propeller_solid` | propellers as one solid with root fillets and bore |
//! | `rotor37` | rotor 37 as a mesh, from its published table |
//! | `blade_loft` | blades as smooth surfaces through sections of points |
//! | `surface_point` | points of a surface with normal and curvature |
//! | `patch` | wavy sculptured patches |
//! | `analytic_part` | parts with closed normals and curvatures |
//! | `casting` | parts with uneven material on them |
//! | `turned_solid` | solids of revolution, for clamping parts |
//!
//! This crate must not know machines, tools, jobs or files.

mod analytic_part;
mod blade_loft;
mod casting;
mod grouped_mesh;
mod patch;
mod propeller;
mod propeller_solid;
mod rotor37;
mod sheets;
mod spec_error;
mod spline;
mod surface_point;
mod turned_solid;

pub use crate::blade_loft::endwalls::{Endwalls, HubLine, HubSector, HubSet, LoftEnd};
pub use crate::blade_loft::loft_mesh::LoftedBlade;
pub use crate::blade_loft::loft_surface::{BladeLoft, BladeSections, EdgeForm};
pub use crate::propeller::anti_singing::AntiSingingEdge;
pub use crate::propeller::blade::{BladeResolution, blade};
pub use crate::propeller::blade_section::{BladeSection, BladeSide};
pub use crate::propeller::blade_surface::BladeSurface;
pub use crate::propeller::chord_error::{ChordError, chord_error};
pub use crate::propeller::hub::hub;
pub use crate::propeller::spec::{PropellerSeries, PropellerSpec, blade_pose};
pub use crate::propeller::table::{
    Hand, OffsetUnit, PropellerTable, SectionOffsets, TableSections, TableThickness, skew_of_leading_edge,
};
pub use crate::propeller_solid::ball::FilletContact;
pub use crate::propeller_solid::bore::Bore;
pub use crate::propeller_solid::root_fillet::{FilletStation, RootFillet};
pub use crate::propeller_solid::solid::{SolidForm, fillet_contact, propeller_solid};
pub use analytic_part::{AnalyticPart, AnalyticShape, MaterialSide};
pub use casting::{CastingAllowance, TurnedHub, casting, turned_casting};
pub use patch::{PatchSpec, patch};
pub use rotor37::{RotorResolution, rotor37};
pub use spec_error::{LoftError, SpecError, TablePart};
pub use surface_point::SurfacePoint;
pub use turned_solid::turned_solid;
