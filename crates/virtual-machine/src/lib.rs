//! Runs NC text on a virtual machine tool and reports what it would do (VMT, first form).
//!
//! [`verify`] takes a program that was read back from its text, a [`VirtualSetup`] (machine,
//! mounting, work offset, tool, obstacles) and [`VerifySettings`], and gives a [`Verification`]:
//! [`Finding`]s, the largest gouge, the smallest clearance, times and lengths.
//!
//! ```
//! use facemill_cl_data::Silent;
//! use facemill_interference::MeshTree;
//! use facemill_inverse_kinematics::Machine;
//! use facemill_nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
//! use facemill_surface_model::TriMesh;
//! use facemill_tool_model::ToolAssembly;
//! use facemill_virtual_machine::*;
//! use nalgebra::{Isometry3, Point3};
//!
//! let machine = Machine::head_b_table_c()?;
//! let axes = machine.axes().iter().map(|a| MappedAxis {
//!     letter: a.letter.as_str().parse().unwrap(),
//!     offset: 0.0,
//!     along_spindle: if a.letter == "Z" { 1.0 } else { 0.0 },
//! });
//! let words = WordMap::new(axes.collect(), WorkOffset::default(), 120.0)?;
//! let tool = ToolAssembly::from_json(br#"{
//!     "format": "facemill-tool/1", "name": "mill 50", "number": 1, "radius_mm": 25, "corner_radius_mm": 4,
//!     "n_inserts": 4, "flute_length_mm": 12, "max_ramp_angle_deg": 3, "spindle_rotation": "clockwise",
//!     "stick_out_mm": 60, "gauge_length_mm": 120,
//!     "body": { "clearance_mm": 1, "sections": [{ "length_mm": 48, "diameter_low_mm": 44, "diameter_high_mm": 44 }] },
//!     "holder": { "clearance_mm": 2, "sections": [{ "length_mm": 60, "diameter_low_mm": 80, "diameter_high_mm": 80 }] }
//! }"#)?;
//! // The part is a square on the table; the program cuts 0.2 mm too deep on its way.
//! let corner = |x, y| Point3::new(x, y, 0.0);
//! let square = vec![corner(-90.0, -90.0), corner(90.0, -90.0), corner(90.0, 90.0), corner(-90.0, 90.0)];
//! let mesh = MeshTree::new(&TriMesh::new(square, vec![[0, 1, 2], [0, 2, 3]])?);
//! let text = "G21 G90 G94\nG0 G43 X-200. Y0. Z50. B0. C0. H1\nG0 Z0.1\nG1 X0. F1000.\nG1 X100. Z-0.2\nG0 Z100.\n";
//! let program = read_program(text, Dialect::Fanuc)?;
//!
//! let part = VirtualObstacle { name: "plate".into(), mesh: &mesh, kind: ObstacleKind::Part, allowance: 0.0, stock: 0.0 };
//! let setup = VirtualSetup {
//!     machine: &machine,
//!     table_from_work: Isometry3::identity(),
//!     words: &words,
//!     table_from_rtcp_words: Some(Isometry3::identity()),
//!     tool: &tool,
//!     length_register: tool.number(),
//!     obstacles: vec![part],
//! };
//! let v = verify(&program, &setup, &VerifySettings::default(), &Silent)?;
//! let gouge = v.findings.iter().find(|f| f.kind == FindingKind::Gouge).expect("the cut is too deep");
//! assert_eq!(gouge.worst_line, 5);
//! assert!(matches!(gouge.measure, Some(Measure::DepthMm(depth)) if (depth - 0.2).abs() < 0.01));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! It measures the text, by the distance between solids and mesh: not by the test that decided in
//! the search. A position is tested exactly; between two of them bodies come nearer, and the cutter
//! deeper, by at most [`BetweenPositions`]. There stock is a thickness on a mesh or the raw solid;
//! [`run_stock`] cuts it and checks the tool against the rest; [`remaining_collisions`] does so for
//! stock between its lines, and for bodies of the machine.
//!
//! A program of a machine with several heads is run once for each ([`VirtualSetup`]); findings name
//! the head in their note. All of them cut one stock ([`run_stock_of_heads`]).
//!
//! [`clear_lengths`] says how short the tool assembly may be for a program, and which block forces
//! each of its lengths.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `finding` | findings: faults of a program and their measures |
//! | [`mod@motion`] | motion that a program asks of a machine: modal state, axis positions, steps and rates between them |
//! | [`mod@program_time`] | times of programs by the law of motion: runs between stops, corners within tolerance, rounded tool vectors |
//! | `run` | runs of programs against meshes: cutter, holder and machine bodies at every step and between steps |
//! | `proof` | what is proven of a move, and what is not |
//! | `stock` | runs of programs against stock that they cut |
//! | `lengths` | the shortest lengths of a tool assembly with which a program collides with nothing (VMT fig |
//! | `links` | the links of a program, from one run of cuts to the next at rapid rate, and whether another way there is free |
//!
//! It must not know how the path was planned.

#[cfg(test)]
extern crate self as facemill_virtual_machine;

mod finding;
#[cfg(test)]
#[path = "../tests/laws/kit/mod.rs"]
mod kit;
mod lengths;
#[cfg(test)]
#[path = "../tests/unit/lengths_laws.rs"]
mod lengths_laws;
mod links;
pub mod motion;
pub mod program_time;
mod proof;
#[cfg(test)]
#[path = "../tests/unit/rates_laws.rs"]
mod rates_laws;
mod run;
mod stock;

pub use crate::finding::merge::{merge_findings, rapid_lines};
pub use crate::motion::assumptions::{Assumption, assumptions};
pub use crate::motion::counted_axes::CountedAxes;
pub use crate::motion::moves::first_text_fault;
pub use crate::motion::positions::rolled_words::RolledWords;
pub use crate::motion::positions::tool_vectors::not_unit;
pub use crate::motion::setup::{
    Estimate, GougeSection, HeldAsCut, ObstacleKind, RemovalLimit, VerifyError, VerifySettings, VirtualObstacle,
    VirtualSetup,
};
pub use crate::proof::certificate::{Certificate, Certificates, certify};
pub use crate::run::verify::{place_findings, verify};
pub use crate::stock::cover::blocks_beyond;
pub use crate::stock::remaining::swept_by_cuts;
pub use crate::stock::run::{BlockCut, StockRun, run_stock, run_stock_of_heads};
pub use crate::stock::unresolved_findings::{
    HeadFindings, certain_depth, is_known_to_cut, outside_layer, remaining_collisions, unresolved_findings,
};
pub use finding::{
    AxisReading, BetweenPositions, ClearancePlace, EstimatedPositions, Finding, FindingKind, GougePlace, Measure, Pose,
    SectionGouge, Verification, WindUp,
};
pub use lengths::{
    ClearLengths, ForcedBy, LengthSettings, LengthStock, clear_lengths, posted_for_length, words_of_length,
};
pub use links::{
    LinkDistances, LinkHold, LinkSettings, LinkStage, ProgramLink, links_off_first_stock, run_links, with_first_stock,
};
