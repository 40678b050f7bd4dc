use facemill_surface_model::{MeshError, TriMesh};
use nalgebra::Point3;

use crate::dexel::map::DexelMap;
use crate::dexel::tile::Interval;

impl DexelMap {
    /// The boundary of the material as a closed mesh wound outward, workpiece frame, mm: every
    /// interval is the prism over its cell, and the mesh encloses exactly the map's
    /// [`DexelMap::volume`].
    ///
    /// Vertices are shared and no edge ends within another, so every edge has as many triangles on
    /// one side as on the other. Where two prisms touch in an edge only, four triangles meet there.
    ///
    /// # Errors
    /// When there are more than 2³² vertices; a coarser map is needed then.
    pub fn to_mesh(&self) -> Result<TriMesh, MeshError> {
        let mut skin = Skin::new(self);
        let [nx, ny] = self.grid().n_lines();
        for j in 0..ny {
            for i in 0..nx {
                for Interval { bottom, top } in self.intervals(i, j) {
                    skin.level(i, j, bottom, false);
                    skin.level(i, j, top, true);
                }
            }
        }
        // Walls across x, then across y: seen from the side of smaller coordinates.
        for j in 0..ny {
            for i in 0..=nx {
                skin.walls([i.wrapping_sub(1), j], [i, j], [[i, j + 1], [i, j]]);
            }
        }
        for j in 0..=ny {
            for i in 0..nx {
                skin.walls([i, j.wrapping_sub(1)], [i, j], [[i, j], [i + 1, j]]);
            }
        }
        TriMesh::new(skin.vertices, skin.triangles)
    }
}

/// A mesh in the making. Vertices stand over the corners of cells, at every height at which a line
/// beside it begins or ends.
struct Skin<'a> {
    map: &'a DexelMap,
    /// First vertex of each corner, row by row.
    starts: Vec<usize>,
    heights: Vec<f64>,
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Skin<'a> {
    fn new(map: &'a DexelMap) -> Self {
        let grid = map.grid();
        let [nx, ny] = grid.n_lines();
        let (mut starts, mut heights, mut vertices) = (vec![0], Vec::new(), Vec::new());
        for j in 0..=ny {
            for i in 0..=nx {
                let beside = [(1, 1), (0, 1), (1, 0), (0, 0)];
                let lines = beside.into_iter().flat_map(|(a, b)| map.intervals(i.wrapping_sub(a), j.wrapping_sub(b)));
                let mut ends: Vec<f64> = lines.flat_map(|i| [i.bottom, i.top]).collect();
                ends.sort_by(f64::total_cmp);
                ends.dedup();
                let (x, y) = (grid.x(i) - 0.5 * grid.cell(), grid.y(j) - 0.5 * grid.cell());
                vertices.extend(ends.iter().map(|&z| grid.work_from_map() * Point3::new(x, y, z)));
                heights.extend(ends);
                starts.push(heights.len());
            }
        }
        Self { map, starts, heights, vertices, triangles: Vec::new() }
    }

    /// Vertices of a corner between two of its heights, both included.
    fn chain(&self, [i, j]: [usize; 2], from: f64, to: f64) -> std::ops::Range<usize> {
        let corner = j * (self.map.grid().n_lines()[0] + 1) + i;
        let (start, end) = (self.starts[corner], self.starts[corner + 1]);
        let heights = &self.heights[start..end];
        start + heights.partition_point(|&z| z < from)..start + heights.partition_point(|&z| z <= to)
    }

    /// The lower or upper end of a prism.
    fn level(&mut self, i: usize, j: usize, z: f64, is_up: bool) {
        let [a, b, c, d] =
            [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|corner| self.chain(corner, z, z).start);
        self.triangle(is_up, a, b, c);
        self.triangle(is_up, a, c, d);
    }

    /// Walls between two neighbours, where one has material and the other none. The corners are the
    /// right one and the left one for who looks from the first neighbour.
    fn walls(&mut self, first: [usize; 2], second: [usize; 2], corners: [[usize; 2]; 2]) {
        let intervals = |[i, j]: [usize; 2]| self.map.intervals(i, j).collect::<Vec<_>>();
        let (first, second) = (intervals(first), intervals(second));
        let mut ends: Vec<f64> = first.iter().chain(&second).flat_map(|i| [i.bottom, i.top]).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        for pair in ends.windows(2) {
            let is_in = |of: &[Interval]| of.iter().any(|i| i.bottom <= pair[0] && pair[1] <= i.top);
            let (a, b) = (is_in(&first), is_in(&second));
            if a != b {
                self.wall(corners, [pair[0], pair[1]], a);
            }
        }
    }

    /// A rectangle between two corners, with all vertices that stand at its sides; `is_out` when it
    /// looks away from the first neighbour.
    fn wall(&mut self, corners: [[usize; 2]; 2], [from, to]: [f64; 2], is_out: bool) {
        let [mut right, mut left] = corners.map(|corner| self.chain(corner, from, to));
        let (mut a, mut b) = (right.start, left.start);
        (right.start, left.start) = (a + 1, b + 1);
        loop {
            let next = |chain: &std::ops::Range<usize>| self.heights.get(chain.start).filter(|_| !chain.is_empty());
            let is_right = match (next(&right), next(&left)) {
                (Some(r), Some(l)) => r <= l,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (None, None) => break,
            };
            let c = if is_right { right.start } else { left.start };
            self.triangle(is_out, a, c, b);
            if is_right {
                (a, right.start) = (c, c + 1);
            } else {
                (b, left.start) = (c, c + 1);
            }
        }
    }

    fn triangle(&mut self, keeps_order: bool, a: usize, b: usize, c: usize) {
        // `TriMesh::new` refuses vertices that 32 bits do not count.
        let [a, b, c] = [a, b, c].map(|v| u32::try_from(v).unwrap_or(u32::MAX));
        self.triangles.push(if keeps_order { [a, b, c] } else { [a, c, b] });
    }
}
