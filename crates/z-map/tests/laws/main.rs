//! Laws of the Z-map against brute force over all triangles.

mod heights;
mod kit;
mod poses;
