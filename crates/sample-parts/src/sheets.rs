//! Sheets of a blade: rows of vertices from root to tip.

use crate::grouped_mesh::GroupedMesh;

/// Groups of a blade, in the order of its mesh.
pub(crate) const BLADE_GROUPS: [&str; 5] = ["suction", "pressure", "edge", "tip", "root"];
pub(crate) const SUCTION: usize = 0;
pub(crate) const PRESSURE: usize = 1;
pub(crate) const EDGE: usize = 2;
pub(crate) const TIP: usize = 3;
pub(crate) const ROOT: usize = 4;

/// Vertices by row (root to tip) and column (leading to trailing edge).
pub(crate) type Sheet = Vec<Vec<u32>>;

/// Fills the space between the sheets of a blade's suction and pressure side: both sides, root and
/// tip.
///
/// Sheets share their first and last column; what they share of the first and last row needs no
/// closing. `group` says where the quad of a row and column goes that is inside on the side given
/// last.
pub(crate) fn close_sheets(
    mesh: &mut GroupedMesh,
    [suction, pressure]: &[Sheet; 2],
    group: impl Fn(usize, usize, usize) -> usize,
) {
    let (last_row, last_column) = (suction.len() - 1, suction[0].len() - 1);
    for row in 0..last_row {
        for k in 0..last_column {
            let quad = |s: &Sheet| [s[row][k], s[row][k + 1], s[row + 1][k + 1], s[row + 1][k]];
            let [on_suction, on_pressure] = [suction, pressure].map(quad);
            // In a corner of the tip three vertices are shared: a diagonal between two of them
            // would lie on both sides.
            let is_shared = |v: u32| on_suction.contains(&v) && on_pressure.contains(&v);
            mesh.quad_without(group(row, k, SUCTION), on_suction, is_shared);
            let [a, b, c, d] = on_pressure;
            mesh.quad_without(group(row, k, PRESSURE), [a, d, c, b], is_shared);
        }
    }
    for k in 0..last_column {
        let across = |row: usize| [suction[row][k], suction[row][k + 1], pressure[row][k + 1], pressure[row][k]];
        let [a, b, c, d] = across(0);
        mesh.quad(ROOT, [a, d, c, b]);
        mesh.quad(TIP, across(last_row));
    }
}
