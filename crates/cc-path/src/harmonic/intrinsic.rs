use facemill_surface_model::{Edges, TriMesh};

/// A triangulation given by lengths alone: the mesh at first, then the intrinsic Delaunay
/// triangulation of the same surface (Fisher, Springborn, Bobenko, Schröder 2006).
///
/// Sides are numbered `3 · triangle + k` and run from corner k to corner k + 1, as in [`Edges`].
pub(crate) struct Intrinsic {
    triangles: Vec<[u32; 3]>,
    lengths: Vec<[f64; 3]>,
    /// The side across each side; none on borders and edges that are not manifold.
    across: Vec<[u32; 3]>,
    /// Jump of an angle along each side, opposite on both sides of an edge; sums up to 0 around
    /// each triangle.
    jumps: Vec<[f64; 3]>,
}

const NONE: u32 = u32::MAX;

/// Triangles are made to exceed their triangle inequality by this share of the mean edge, so that
/// slivers have an area (Sharp and Crane 2020). Larger: lengths of sound meshes change. Smaller:
/// rounding decides on the angles of slivers.
const LEAST_EXCESS: f64 = 1e-6;

/// Edges are flipped where the cotangents of the opposite angles sum up to less than this.
const FLIPPED: f64 = -1e-9;

/// Flips per edge, at most: a bound for input that rounding would flip without end.
const MOST_FLIPS: usize = 30;

impl Intrinsic {
    /// The triangulation of a mesh, with jumps of an angle along its sides (0 for a function).
    pub(crate) fn of(mesh: &TriMesh, edges: &Edges, jumps: Option<Vec<[f64; 3]>>) -> Self {
        let triangles = mesh.triangles().to_vec();
        let length = |t: usize, k: usize| {
            let [a, b] = [k, (k + 1) % 3].map(|k| mesh.vertices()[triangles[t][k] as usize]);
            (b - a).norm()
        };
        let lengths: Vec<[f64; 3]> = (0..triangles.len()).map(|t| [0, 1, 2].map(|k| length(t, k))).collect();
        let across = (0..triangles.len() as u32)
            .map(|t| [0, 1, 2].map(|k| edges.across(mesh, t, k).map_or(NONE, |(u, j)| 3 * u + j as u32)))
            .collect();
        let jumps = jumps.unwrap_or_else(|| vec![[0.0; 3]; triangles.len()]);
        let mut this = Self { triangles, lengths, across, jumps };
        this.relax_slivers();
        this.flip_to_delaunay();
        this
    }

    /// Lengthens all sides alike until every triangle has an area.
    fn relax_slivers(&mut self) {
        let sum: f64 = self.lengths.iter().flatten().sum();
        let excess = LEAST_EXCESS * sum / (3 * self.lengths.len()).max(1) as f64;
        let lack = |l: &[f64; 3]| {
            let longest = l[0].max(l[1]).max(l[2]);
            excess + 2.0 * longest - (l[0] + l[1] + l[2])
        };
        let most = self.lengths.iter().map(lack).fold(0.0, f64::max);
        self.lengths.iter_mut().flatten().for_each(|l| *l += most);
    }

    fn flip_to_delaunay(&mut self) {
        let n_sides = 3 * self.triangles.len() as u32;
        let mut queue: std::collections::VecDeque<u32> = (0..n_sides).collect();
        let mut left = MOST_FLIPS * n_sides as usize;
        while let Some(side) = queue.pop_front().filter(|_| left > 0) {
            let other = self.at(side, &self.across);
            if other == NONE || other / 3 == side / 3 || self.cotangent(side) + self.cotangent(other) >= FLIPPED {
                continue;
            }
            left -= 1;
            queue.extend(self.flip(side, other));
        }
    }

    fn at<T: Copy>(&self, side: u32, values: &[[T; 3]]) -> T {
        values[side as usize / 3][side as usize % 3]
    }

    /// Half the cotangents' weight of a side: the cotangent of the angle opposite to it.
    pub(crate) fn cotangent(&self, side: u32) -> f64 {
        let (t, k) = (side as usize / 3, side as usize % 3);
        let [c, a, b] = [0, 1, 2].map(|j| self.lengths[t][(k + j) % 3]);
        (a * a + b * b - c * c) / (4.0 * area([a, b, c]))
    }

    /// Turns the diagonal of the two triangles at an edge, and returns the sides around them.
    fn flip(&mut self, side: u32, other: u32) -> [u32; 4] {
        let next = |s: u32, j: u32| s - s % 3 + (s % 3 + j) % 3;
        // Corners a, b of the edge; c across this side, d across the other.
        let [ab, bc, ca] = [0, 1, 2].map(|j| next(side, j));
        let [_, ad, db] = [0, 1, 2].map(|j| next(other, j));
        let [a, b, c] = [ab, bc, ca].map(|s| self.at(s, &self.triangles));
        let d = self.at(db, &self.triangles);
        let length = |s| self.at(s, &self.lengths);
        let [l_ab, l_bc, l_ca, l_ad, l_db] = [ab, bc, ca, ad, db].map(length);
        // Both triangles in the plane, the edge from the origin along x, c above and d below.
        let foot = |near: f64, far: f64| (l_ab * l_ab + near * near - far * far) / (2.0 * l_ab);
        let height = |near: f64, far: f64| 2.0 * area([l_ab, near, far]) / l_ab;
        let l_cd = (foot(l_ca, l_bc) - foot(l_ad, l_db)).hypot(height(l_ca, l_bc) + height(l_ad, l_db));
        let jump = |s| self.at(s, &self.jumps);
        let [j_bc, j_ca, j_ad, j_db] = [bc, ca, ad, db].map(jump);
        let beyond = |s| self.at(s, &self.across);
        let outer = [ca, ad, db, bc].map(beyond);
        // New triangles (c, a, d) and (d, b, c).
        let (t, u) = (side / 3, other / 3);
        self.triangles[t as usize] = [c, a, d];
        self.triangles[u as usize] = [d, b, c];
        self.lengths[t as usize] = [l_ca, l_ad, l_cd];
        self.lengths[u as usize] = [l_db, l_bc, l_cd];
        self.jumps[t as usize] = [j_ca, j_ad, -(j_ca + j_ad)];
        self.jumps[u as usize] = [j_db, j_bc, -(j_db + j_bc)];
        // An outer side that lies on one of the two triangles itself has moved.
        let moved = |s: u32| match s {
            s if s == ca => 3 * t,
            s if s == ad => 3 * t + 1,
            s if s == db => 3 * u,
            s if s == bc => 3 * u + 1,
            s => s,
        };
        let outer = outer.map(moved);
        self.across[t as usize] = [outer[0], outer[1], 3 * u + 2];
        self.across[u as usize] = [outer[2], outer[3], 3 * t + 2];
        for side in [3 * t, 3 * t + 1, 3 * u, 3 * u + 1] {
            let other = self.at(side, &self.across);
            if other != NONE {
                self.across[other as usize / 3][other as usize % 3] = side;
            }
        }
        [3 * t, 3 * t + 1, 3 * u, 3 * u + 1]
    }

    /// Sides with their vertices, half the cotangent of the angle opposite, and the jump along
    /// them.
    pub(crate) fn sides(&self) -> impl Iterator<Item = ([u32; 2], f64, f64)> + '_ {
        (0..3 * self.triangles.len() as u32).map(|side| {
            let (t, k) = (side as usize / 3, side as usize % 3);
            let ends = [self.triangles[t][k], self.triangles[t][(k + 1) % 3]];
            (ends, 0.5 * self.cotangent(side), self.jumps[t][k])
        })
    }
}

/// Area of a triangle by its sides, accurate for slivers (Kahan 2014).
fn area(mut l: [f64; 3]) -> f64 {
    l.sort_by(|x, y| y.total_cmp(x));
    let [a, b, c] = l;
    0.25 * ((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))).max(f64::MIN_POSITIVE).sqrt()
}

#[cfg(test)]
#[path = "../../tests/unit/harmonic/intrinsic.rs"]
mod tests;
