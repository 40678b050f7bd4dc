//! Slow, independent code that defines what is correct, from the papers alone:
//! - [`brute`]: how deep a cutter is in a mesh and how far a turned body is from it, over all
//!   triangles;
//! - [`touch`]: whether a body touches a mesh, by subdividing triangles;
//! - [`onset`]: the tilt from which on a cutter is free of a torus or saddle, from the surface's
//!   equation;
//! - [`interpreter`]: what a FANUC program does to its axes;
//! - [`paper_machine`]: FEED (9), from axis values of the head-B, table-C mill to the tool;
//! - [`read_back`]: a written program against the meshes of its job, by these three;
//! - [`craig`]: where the rows of a machine file put its links;
//! - [`two_heads`]: a program of two heads in one channel, both tools' places, and how far these
//!   are apart;
//! - [`gltf_groups`]: groups of a binary glTF file;
//! - [`wetted`]: shares of a wetted surface that programs leave within a tolerance;
//! - [`whole_plan`]: the plan of a whole propeller on them;
//! - [`rest_points`]: stock as points, cut by a program, and met by its bodies;
//! - [`slack`]: how much more certificates say than there is, at its places, with the mesh tree's
//!   distance;
//! - [`chip_trial`]: what chips say that passes take, and what their program takes out of the
//!   stock;
//! - [`straight_words`]: words of two programs compared.

pub mod brute;
pub mod chip_trial;
pub mod craig;
pub mod gltf_groups;
pub mod interpreter;
pub mod onset;
pub mod paper_machine;
pub mod read_back;
pub mod rest_points;
pub mod slack;
pub mod straight_words;
pub mod touch;
pub mod two_heads;
pub mod wetted;
pub mod whole_plan;
