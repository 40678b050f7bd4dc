use nalgebra::Point3;

use crate::mesh::edges::Edges;
use crate::mesh::tri_mesh::TriMesh;

/// Removes triangles with three distinct corners but without area from the mesh by turning them,
/// and returns their number.
///
/// Such a triangle has one corner b on its longest side, between a and c. Dropping it would leave a
/// slit between the one neighbour at a–c and the two at a–b and b–c. So the side is turned instead:
/// with the neighbour's third corner d, the two triangles become (a, b, d) and (b, c, d), which
/// moves the surface by no more than the lost height. Where no single neighbour lies across, or the
/// turn would give a triangle without area again, it stays for the caller to drop.
pub(crate) fn turn_caps(
    points: &[Point3<f64>],
    triangles: &mut [[u32; 3]],
    is_flat: impl Fn([u32; 3]) -> bool,
) -> usize {
    let mut n_turned = 0;
    // Adjacent caps are solved one after the other, from the outermost in.
    for _ in 0..MOST_ROUNDS {
        let caps: Vec<usize> = (0..triangles.len()).filter(|&t| is_flat(triangles[t])).collect();
        if caps.is_empty() {
            break;
        }
        let Ok(mesh) = TriMesh::new(points.to_vec(), triangles.to_vec()) else { break };
        let edges = Edges::of(&mesh);
        let mut changed = vec![false; triangles.len()];
        let before = n_turned;
        for cap in caps {
            let side = longest_side(&mesh, cap);
            let Some((neighbour, k)) = edges.across(&mesh, cap as u32, side) else { continue };
            let neighbour = neighbour as usize;
            if changed[cap] || changed[neighbour] {
                continue;
            }
            let corner = |j: usize| triangles[cap][(side + j) % 3];
            // The side runs from c to a; the corner after it is b.
            let (c, a, b, d) = (corner(0), corner(1), corner(2), triangles[neighbour][(k + 2) % 3]);
            let (first, second) = ([a, b, d], [b, c, d]);
            if b != d && !is_flat(first) && !is_flat(second) {
                (triangles[cap], triangles[neighbour]) = (first, second);
                (changed[cap], changed[neighbour]) = (true, true);
                n_turned += 1;
            }
        }
        if n_turned == before {
            break;
        }
    }
    n_turned
}

/// Largest number of rounds: more than the rows of adjacent caps that any mesher leaves.
const MOST_ROUNDS: usize = 16;

fn longest_side(mesh: &TriMesh, triangle: usize) -> usize {
    let p = mesh.corners(triangle);
    let length_sq = |k: usize| (p[(k + 1) % 3] - p[k]).norm_squared();
    (1..3).fold(0, |best, k| if length_sq(k) > length_sq(best) { k } else { best })
}

#[cfg(test)]
#[path = "../../tests/unit/mesh/caps.rs"]
mod tests;
