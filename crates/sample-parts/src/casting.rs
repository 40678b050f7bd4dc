//! Castings: a part with material on it that is nowhere quite the same.

use std::collections::HashMap;
use std::f64::consts::TAU;

use facemill_surface_model::{Surface, SurfaceSettings, TriMesh};
use nalgebra::{Point3, Vector3};

use crate::spec_error::{SpecError, in_range};

/// Material on a casting: `mean` ± `variation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CastingAllowance {
    mean: f64,
    variation: f64,
}

/// Waves of the allowance along the longest side of the part.
const WAVES: f64 = 1.5;

/// Phases of the waves along x, y and z: without them the allowance would have the symmetries of
/// the part.
const PHASES: [f64; 3] = [0.31, 0.77, 0.13];

impl CastingAllowance {
    /// Returns an allowance of `mean` mm, which varies by up to `variation` mm over the part.
    ///
    /// # Errors
    /// When the mean is not between 0 and 1,000 mm, or the variation not between 0 and the mean.
    pub fn new(mean: f64, variation: f64) -> Result<Self, SpecError> {
        in_range("mean allowance", mean, 0.0, 1000.0)?;
        in_range("variation of the allowance", variation, 0.0, mean)?;
        Ok(Self { mean, variation })
    }

    /// Returns the least allowance, mm.
    pub fn least(&self) -> f64 {
        self.mean - self.variation
    }

    /// Returns the largest allowance, mm.
    pub fn largest(&self) -> f64 {
        self.mean + self.variation
    }

    /// Returns the allowance at a point, mm, with `length` the longest side of the part: waves
    /// along x, y and z, the mean of their sines.
    fn at(&self, p: &Point3<f64>, length: f64) -> f64 {
        let wave = |k: usize| (TAU * (WAVES * p[k] / length + PHASES[k])).sin();
        self.mean + self.variation * (wave(0) + wave(1) + wave(2)) / 3.0
    }
}

/// Hub of a casting that is turned before it is milled: about z, at a bore and both faces the
/// material of the casting ends where the part does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnedHub {
    /// Radius of the bore, mm.
    pub bore_radius: f64,
    /// Heights of the faces in z, the lower one first, mm.
    pub faces: [f64; 2],
}

/// Material on turned faces, mm: that rounding leaves no corner of the part outside.
const ON_FACES: f64 = 0.01;

impl TurnedHub {
    /// Returns a value that is above 0 beyond a face or in the bore, the distance from the nearest
    /// of them, and negative elsewhere. The bore is wider by the sagitta of facets that span a cube
    /// of the lattice, so that none of them lies in that of the part.
    fn beyond(&self, p: &Point3<f64>, cell: f64) -> f64 {
        let [low, high] = self.faces;
        let bore = self.bore_radius + 3.0 * cell * cell / (4.0 * self.bore_radius);
        (p.z - high - ON_FACES).max(low - p.z - ON_FACES).max(bore - p.x.hypot(p.y))
    }
}

/// Most nodes of the lattice that a casting is made on.
const MOST_NODES: f64 = 2e8;

/// Least share of a lattice edge between a node and the surface: facets keep an area.
const LEAST_SHARE: f64 = 1e-3;

/// Corners of a cube of the lattice, as steps along x, y and z, for the six tetrahedra around its
/// diagonal.
const TETRAHEDRA: [[[usize; 3]; 4]; 6] = [
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 0, 1], [0, 1, 1], [1, 1, 1]],
];

/// Returns the casting of closed solids, which may overlap, mm: the closed surface at the distance
/// from the part that the allowance has there, with rounded edges; one around all of what overlaps
/// or comes near.
///
/// The surface is that of a function on a cubic lattice of `cell` mm. Over an edge of the part it
/// is rounded by the allowance a there, and up to cell²/2a nearer to the part; on sides and in
/// hollows much less.
///
/// # Errors
/// When the cell is not above 0 and up to twice the least allowance, or so small that the lattice
/// has more than 2·10⁸ nodes, or the part has no triangle.
pub fn casting(part: &TriMesh, allowance: CastingAllowance, cell: f64) -> Result<TriMesh, SpecError> {
    cast(part, allowance, cell, None)
}

/// Returns the casting of a part whose hub is turned before it is milled: that of [`casting`],
/// without what is beyond the faces and in the bore. Its faces are 0.01 mm thicker, and its bore is
/// wider by up to cell²/R: the facets of its wall do not reach into the part's. Their edge is
/// chamfered by up to a cell.
///
/// # Errors
/// As [`casting`], and when the bore is not wider than a cell, or the faces are not in their order.
pub fn turned_casting(
    part: &TriMesh,
    allowance: CastingAllowance,
    cell: f64,
    hub: TurnedHub,
) -> Result<TriMesh, SpecError> {
    in_range("bore of a turned casting", hub.bore_radius, cell, f64::MAX)?;
    in_range("upper face of a turned casting", hub.faces[1], hub.faces[0], f64::MAX)?;
    cast(part, allowance, cell, Some(hub))
}

fn cast(part: &TriMesh, allowance: CastingAllowance, cell: f64, hub: Option<TurnedHub>) -> Result<TriMesh, SpecError> {
    in_range("cell of a casting", cell, f64::MIN_POSITIVE, 2.0 * allowance.least())?;
    let bounds = part.aabb();
    let size = bounds.half_extents() * 2.0;
    let margin = allowance.largest() + 2.0 * cell;
    let n = [0, 1, 2].map(|k| ((size[k] + 2.0 * margin) / cell).ceil() + 1.0);
    in_range("nodes of the lattice of a casting", n.iter().product(), 8.0, MOST_NODES)?;
    let lattice = Lattice {
        surface: Surface::new(part.clone(), SurfaceSettings::default()),
        allowance,
        hub,
        length: size.max(),
        origin: bounds.min - Vector3::repeat(margin),
        cell,
        n: n.map(|n| n as usize),
    };
    lattice.surface_of(&lattice.values())
}

/// Lattice around a part.
struct Lattice {
    surface: Surface,
    allowance: CastingAllowance,
    /// Hub that is turned before.
    hub: Option<TurnedHub>,
    /// Longest side of the part, mm.
    length: f64,
    origin: Point3<f64>,
    cell: f64,
    n: [usize; 3],
}

impl Lattice {
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.n[1] + j) * self.n[2] + k
    }

    fn node(&self, index: usize) -> Point3<f64> {
        let (ij, k) = (index / self.n[2], index % self.n[2]);
        let (i, j) = (ij / self.n[1], ij % self.n[1]);
        self.origin + Vector3::new(i as f64, j as f64, k as f64) * self.cell
    }

    /// Returns the distance of each node from the casting's surface, mm, negative inside; of nodes
    /// far from it the sign alone counts.
    fn values(&self) -> Vec<f64> {
        let far = self.allowance.largest() + 3.0 * self.cell;
        let mut values = Vec::with_capacity(self.n.iter().product());
        for column in 0..self.n[0] * self.n[1] {
            // Columns begin outside of the part.
            let (mut is_inside, mut crosses) = (false, false);
            for k in 0..self.n[2] {
                let p = self.node(column * self.n[2] + k);
                let distance = self.surface.closest_point(&p, far).map_or(far, |foot| foot.distance);
                crosses |= distance <= self.cell;
                if crosses {
                    is_inside = self.surface.is_inside(&p);
                }
                crosses = distance <= self.cell;
                let out = if is_inside { -distance } else { distance };
                let value = out - self.allowance.at(&p, self.length);
                values.push(self.hub.map_or(value, |hub| value.max(hub.beyond(&p, self.cell))));
            }
        }
        values
    }

    /// Returns the surface on which values between the nodes, linear in each tetrahedron, are 0.
    fn surface_of(&self, values: &[f64]) -> Result<TriMesh, SpecError> {
        let mut facets =
            Facets { lattice: self, values, vertices: Vec::new(), triangles: Vec::new(), known: HashMap::new() };
        for i in 0..self.n[0] - 1 {
            for j in 0..self.n[1] - 1 {
                for k in 0..self.n[2] - 1 {
                    facets.add_cube([i, j, k]);
                }
            }
        }
        let Facets { vertices, triangles, .. } = facets;
        let unplaced = SpecError::OutOfRange {
            field: "number of vertices of a casting",
            value: vertices.len() as f64,
            least: 0.0,
            most: f64::from(u32::MAX),
        };
        TriMesh::new(vertices, triangles).map_err(|_| unplaced)
    }
}

/// Facets on a lattice, as far as they are found.
struct Facets<'l> {
    lattice: &'l Lattice,
    values: &'l [f64],
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// Vertices by the nodes of their lattice edge, the one inside first.
    known: HashMap<[usize; 2], u32>,
}

impl Facets<'_> {
    fn add_cube(&mut self, at: [usize; 3]) {
        let lattice = self.lattice;
        let index = |step: [usize; 3]| lattice.index([0, 1, 2].map(|k| at[k] + step[k]));
        let is_inside = |node: usize| self.values[node] < 0.0;
        let first = is_inside(index([0; 3]));
        let corners = (0..8).map(|c| index([c >> 2, (c >> 1) & 1, c & 1]));
        if corners.into_iter().all(|c| is_inside(c) == first) {
            return;
        }
        for tetrahedron in TETRAHEDRA {
            let nodes = tetrahedron.map(index);
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                nodes.into_iter().partition(|&node| self.values[node] < 0.0);
            match (&*inside, &*outside) {
                (&[a], &[p, q, r]) => self.add([[a, p], [a, q], [a, r]]),
                (&[a, b, c], &[p]) => self.add([[a, p], [b, p], [c, p]]),
                (&[a, b], &[p, q]) => {
                    self.add([[a, p], [a, q], [b, q]]);
                    self.add([[a, p], [b, q], [b, p]]);
                }
                _ => {}
            }
        }
    }

    /// Adds the triangle between three lattice edges, wound outward.
    fn add(&mut self, edges: [[usize; 2]; 3]) {
        let [a, b, c] = edges.map(|edge| self.vertex(edge));
        let corners = [a, b, c].map(|v| self.vertices[v as usize]);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let outward = edges.iter().fold(Vector3::zeros(), |sum, [inside, outside]| {
            sum + (self.lattice.node(*outside) - self.lattice.node(*inside))
        });
        self.triangles.push(if normal.dot(&outward) < 0.0 { [a, c, b] } else { [a, b, c] });
    }

    fn vertex(&mut self, edge: [usize; 2]) -> u32 {
        let [inside, outside] = edge;
        let (low, high) = (self.values[inside], self.values[outside]);
        let share = (low / (low - high)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let (from, to) = (self.lattice.node(inside), self.lattice.node(outside));
        *self.known.entry(edge).or_insert_with(|| {
            self.vertices.push(from + (to - from) * share);
            self.vertices.len() as u32 - 1
        })
    }
}
