//! Meshes read and written: files of every kind, sound and broken.

mod broken_bytes;
mod gltf_files;
mod mesh_export;
mod mesh_files;
mod painted;
mod shared_meshes;
mod threemf_files;
