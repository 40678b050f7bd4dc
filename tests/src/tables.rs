//! Tables and figures of the pages: [`key_tables`] those of `docs/formats.md`, [`sample_figures`]
//! those of the sample, [`blades`] and [`meshes`] plans on every shared blade and mesh,
//! [`strategy_table`] parts by all strategies, [`sweep`] verdicts of the mesh tree against the
//! oracle.

pub mod blades;
pub mod key_tables;
pub mod meshes;
pub mod sample_figures;
pub mod strategy_table;
pub mod sweep;
