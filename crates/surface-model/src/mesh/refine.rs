use std::collections::HashMap;

use crate::mesh::tri_mesh::TriMesh;

/// A mesh whose triangles were divided.
#[derive(Clone, Debug)]
pub struct Refined {
    /// The same surface in smaller triangles, in one group.
    pub mesh: TriMesh,
    /// For each of its triangles the original one.
    pub parents: Vec<u32>,
    /// Whether it stopped before the edges were as short as requested.
    pub is_coarse: bool,
}

/// Largest number of halvings of an edge: 2⁻⁴⁰ of any edge is less than rounding.
const MAX_LEVELS: usize = 40;

impl TriMesh {
    /// Returns the same surface in triangles with no edge longer than `edge` mm, where that takes
    /// no more than `max_triangles` (or as many as there are); else as fine as with one halving of
    /// the long edges less.
    ///
    /// Edges that are too long are halved on both sides alike: no vertex lies within another
    /// triangle's edge. The first vertices are those of the mesh.
    #[must_use]
    pub fn refined(&self, edge: f64, max_triangles: usize) -> Refined {
        let mut vertices = self.vertices().to_vec();
        let mut parts: Vec<([u32; 3], u32)> = self.triangles().iter().copied().zip(0..).collect();
        let mut is_coarse = true;
        for _ in 0..MAX_LEVELS {
            let is_long = |a: u32, b: u32| (vertices[a as usize] - vertices[b as usize]).norm() > edge;
            let long = |t: &[u32; 3]| [is_long(t[0], t[1]), is_long(t[1], t[2]), is_long(t[2], t[0])];
            let splits: Vec<[bool; 3]> = parts.iter().map(|(t, _)| long(t)).collect();
            let more: usize = splits.iter().flatten().filter(|s| **s).count();
            if more == 0 {
                is_coarse = false;
                break;
            }
            if parts.len() + more > max_triangles.max(self.triangles().len()) {
                break;
            }
            let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
            let mut next = Vec::with_capacity(parts.len() + more);
            for ((t, parent), split) in parts.iter().zip(&splits) {
                let mut middle = |k: usize| {
                    let (a, b) = (t[k], t[(k + 1) % 3]);
                    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        vertices.push(nalgebra::center(&vertices[a as usize], &vertices[b as usize]));
                        (vertices.len() - 1) as u32
                    })
                };
                let middles = [0, 1, 2].map(|k| split[k].then(|| middle(k)));
                divide(*t, middles, |part| next.push((part, *parent)));
            }
            parts = next;
        }
        let (triangles, parents): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        let mesh = Self::new(vertices, triangles).unwrap_or_default();
        Refined { mesh, parents, is_coarse }
    }
}

/// Passes the parts of a triangle whose sides may have middles; side k leads from corner k to the
/// next.
fn divide(t: [u32; 3], middles: [Option<u32>; 3], mut part: impl FnMut([u32; 3])) {
    let [a, b, c] = t;
    match middles {
        [None, None, None] => part(t),
        [Some(m), Some(n), Some(o)] => [[a, m, o], [m, b, n], [o, n, c], [m, n, o]].into_iter().for_each(part),
        [Some(m), None, None] => [[a, m, c], [m, b, c]].into_iter().for_each(part),
        [Some(m), Some(n), None] => [[m, b, n], [a, m, n], [a, n, c]].into_iter().for_each(part),
        // Turned until one of the two above fits.
        [m, n, o] => divide([b, c, a], [n, o, m], part),
    }
}
