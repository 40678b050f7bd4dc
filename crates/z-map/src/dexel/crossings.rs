//! Where the lines of a map go through the surface of a part.

use facemill_surface_model::TriMesh;

use crate::dexel::grid::DexelGrid;
use crate::dexel::mesh_stock::{ProjectedTriangle, QUANTUM, window};
use crate::dexel::tile::SIDE;

/// Where a line goes through a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Line of its tile.
    pub line: u16,
    /// Whether the material of the part begins there, upward.
    pub is_begin: bool,
    pub triangle: u32,
    /// Map frame, mm.
    pub height: f64,
}

/// Crossings of the lines of a tile with triangles of a mesh in the map's frame, by line, then
/// upward, at one height beginnings first. `corner` is the first column and row of the tile.
pub(crate) fn crossings_of_tile(grid: &DexelGrid, corner: [usize; 2], mesh: &TriMesh, bin: &[u32]) -> Vec<Crossing> {
    let mut found = Vec::new();
    for &triangle in bin {
        let corners = mesh.corners(triangle as usize);
        let Some([columns, rows]) = window(grid, &corners, 0.0) else { continue };
        let quanta = |c: f64| (c / QUANTUM).round() as i64;
        let facet =
            ProjectedTriangle { places: corners.map(|p| [quanta(p.x), quanta(p.y)]), heights: corners.map(|p| p.z) };
        for j in rows[0].max(corner[1])..=rows[1].min(corner[1] + SIDE - 1) {
            for i in columns[0].max(corner[0])..=columns[1].min(corner[0] + SIDE - 1) {
                let line = ((j - corner[1]) * SIDE + i - corner[0]) as u16;
                if let Some((height, is_begin)) = facet.crossing([quanta(grid.x(i)), quanta(grid.y(j))]) {
                    found.push(Crossing { line, is_begin, triangle, height });
                }
            }
        }
    }
    found.sort_by(|a, b| {
        let by_place = a.line.cmp(&b.line).then(a.height.total_cmp(&b.height));
        by_place.then(b.is_begin.cmp(&a.is_begin)).then(a.triangle.cmp(&b.triangle))
    });
    found
}

/// Of a line's crossings with closed shells those where it comes into the solid and leaves it:
/// where shells overlap, the surface of one inside another is none of the solid's. `None` where it
/// does not go in as often as out, or out first.
pub(crate) fn outer(crossings: impl Iterator<Item = Crossing>) -> Option<Vec<Crossing>> {
    let mut depth = 0_i32;
    let mut kept = Vec::new();
    for crossing in crossings {
        let was_outside = depth == 0;
        depth += if crossing.is_begin { 1 } else { -1 };
        if depth < 0 {
            return None;
        }
        if was_outside || depth == 0 {
            kept.push(crossing);
        }
    }
    (depth == 0).then_some(kept)
}

/// Crossings with the outside of closed shells and with open surfaces, upward.
pub(crate) fn merged(solid: &[Crossing], open: Vec<&Crossing>) -> Vec<Crossing> {
    let mut all: Vec<Crossing> = solid.iter().chain(open).copied().collect();
    all.sort_by(|a, b| a.height.total_cmp(&b.height).then(b.is_begin.cmp(&a.is_begin)));
    all
}
