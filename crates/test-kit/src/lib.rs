//! Kit of the tests: random numbers with a seed, meshes of plain shapes, slow answers by
//! definition, outside programs, and where data beside the workspace is.
//!
//! Nothing here shares code with what it tests, and no product crate depends on it.
//!
//! Modules, each of which imports those above it alone:
//!
//! | module | holds |
//! |---|---|
//! | `random` | seeded numbers, vectors, directions and motions |
//! | `meshes` | boxes, grids, balls, caps, rings and soups as vertices and triangles |
//! | `svg` | texts of pictures in the widest font |
//! | `linuxcnc` | the interpreter of LinuxCNC, where it is installed |
//! | `oracles` | volumes, open edges, crossings and least values by their definition |

mod linuxcnc;
mod meshes;
mod oracles;
mod random;
mod svg;

pub use linuxcnc::{linuxcnc_interpreter, run_linuxcnc, run_linuxcnc_beside};
pub use meshes::{
    Mesh, ball_mesh, box_mesh, cap_mesh, grid_around, grid_by_columns, grid_by_rows, odd_triangle, ring_mesh, soup_mesh,
};
pub use oracles::{crossing_of_line, golden_least, least_over_triangle, open_edges, volume};
pub use random::Random;
pub use svg::{drawn_width, texts_outside};

/// Folder of NC programs from public sources, beside the workspace; tests that read them say that
/// they are skipped where it is absent.
pub const SHARED_NC: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/nc");
