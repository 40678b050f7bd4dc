//! Laws of the Z-map against brute force over all triangles, and of dexel maps against closed forms
//! and stamps.

mod dexel_bodies;
mod dexel_deviation;
mod dexel_files;
mod dexel_kit;
mod dexel_meshes;
mod dexel_nearest;
mod dexel_orders;
mod dexel_sweeps;
mod dexel_volumes;
mod heights;
mod kit;
mod left;
mod poses;
