//! Tip and root of a lofted blade.

use crate::grouped_mesh::GroupedMesh;

/// Closes a row of vertices between two of its columns: both ways from one to the other are joined
/// by triangles, each with the shorter of the next lines across. Wound counter-clockwise as the row
/// is, or the other way.
pub(crate) fn close_row(mesh: &mut GroupedMesh, group: usize, row: &[u32], [from, to]: [usize; 2], is_reversed: bool) {
    let n = row.len();
    let n_onward = (to + n - from) % n;
    let onward = |k: usize| row[(from + k) % n];
    let backward = |k: usize| row[(from + n - k % n) % n];
    let (mut i, mut j) = (0, 0);
    while i < n_onward || j < n - n_onward {
        let advances = j == n - n_onward
            || i < n_onward
                && mesh.distance_sq(onward(i + 1), backward(j)) <= mesh.distance_sq(onward(i), backward(j + 1));
        let [a, b, c] = if advances {
            i += 1;
            [onward(i - 1), onward(i), backward(j)]
        } else {
            j += 1;
            [onward(i), backward(j), backward(j - 1)]
        };
        mesh.triangle(group, if is_reversed { [a, c, b] } else { [a, b, c] });
    }
}
