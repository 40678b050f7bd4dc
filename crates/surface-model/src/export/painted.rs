use nalgebra::Isometry3;

use super::glb::Document;
use super::{ExportError, NamedNode, check};
use crate::mesh::tri_mesh::TriMesh;

/// Writes binary glTF 2.0 of a mesh whose vertices have colours (`COLOR_0`), in metres, +Y up,
/// under one name.
///
/// Colours are red, green and blue for screens (sRGB). The file stores them linear with 16 bits
/// each, as glTF requires, on a material that is neither metal nor mirror and shows both sides.
/// Viewers blend between vertices. Coordinates are rounded to single precision of a metre. The same
/// mesh always gives the same bytes.
///
/// # Errors
/// When there is not one colour for each vertex, no triangle, or the data takes more than 4 GiB.
pub fn write_painted_glb(name: &str, mesh: &TriMesh, colours: &[[u8; 3]]) -> Result<Vec<u8>, ExportError> {
    let node = NamedNode { name, mesh: 0, transform: Isometry3::identity() };
    check(&[mesh], std::slice::from_ref(&node))?;
    let n_vertices = mesh.vertices().len();
    if colours.len() != n_vertices {
        return Err(ExportError::Colours { n_colours: colours.len(), n_vertices });
    }
    let linear: Vec<[u16; 3]> = colours.iter().map(|c| c.map(linear)).collect();
    let (mut document, mut bin) = (Document::default(), Vec::new());
    let stored = document.store(mesh, 0, &mut bin)?;
    document.paint(&linear, &mut bin)?;
    document.add_node(&node, mesh, &stored);
    document.bytes(bin)
}

/// Returns a colour component as light, by the curve of sRGB (IEC 61966-2-1).
fn linear(byte: u8) -> u16 {
    let c = f64::from(byte) / 255.0;
    let light = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    (light * 65535.0).round() as u16
}
