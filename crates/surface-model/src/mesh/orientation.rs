//! Winding of the pieces of a mesh, also of an open one, by the generalised winding number
//! (Jacobson, Kavan, Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
//! numbers, SIGGRAPH 2013).
//!
//! The field F of a triangle is the winding number at its centroid, without the triangle itself:
//! 0.5 where the mesh closes around the material behind it, −0.5 where it closes around the space
//! in front, 0 on a plate. Turning a piece turns its contribution to the fields of all pieces, so
//! pieces of one body that are wound against each other are found, too.

#[cfg(test)]
#[path = "../../tests/unit/mesh/orientation_laws.rs"]
mod laws;

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::mesh::edges::{DisjointSets, Edges};
use crate::mesh::topology::Topology;
use crate::mesh::tri_mesh::TriMesh;

/// Least mean field of a piece for a decision on its winding: a long tube with a slit of a quarter
/// of its round has 0.37, a blade as long as its chord, a quarter as thick and open at both ends
/// 0.38, a half-sphere 0.32. Below it the piece may as well be the wall of a hollow.
const DECIDED: f64 = 0.36;

/// Field of the surface of a solid.
const SOLID: f64 = 0.5;

/// Least gain in field that a turned piece must give, as a fraction of its area; a clear case has
/// 1.
const LEAST_GAIN: f64 = 0.5;

/// Largest mean field of the others at a closed piece of negative volume that is not a cavity of
/// them.
const NO_CAVITY: f64 = 0.25;

/// Largest number of computed solid angles, and largest and least number of samples: half a second
/// for 500,000 triangles.
const ANGLES: usize = 20_000_000;

const SAMPLES: (usize, usize) = (16, 512);

/// Least number of samples of a piece.
const LEAST_SAMPLES: usize = 4;

/// Winding of a piece of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Winding {
    /// Counter-clockwise seen from outside: the material lies behind it.
    Outward,
    /// The other way: the mesh closes around the space in front of it.
    Inward,
    /// The mesh does not decide: an open surface may have its material on either side.
    Undecided,
}

/// Triangles connected by edges and wound alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoundPiece {
    /// Its lowest triangle.
    pub first_triangle: usize,
    /// Number of triangles.
    pub n_triangles: usize,
    /// Area, mm².
    pub area: f64,
    /// Whether it bounds a volume by itself.
    pub closed: bool,
    /// Its winding.
    pub winding: Winding,
}

/// Pieces of a mesh and the piece of each triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Orientation {
    /// Pieces by their first triangle.
    pub pieces: Vec<WoundPiece>,
    /// Piece of each triangle.
    pub piece_of: Vec<u32>,
}

impl Orientation {
    /// Finds the pieces and their winding.
    ///
    /// Guaranteed: turning a mesh as a whole exchanges `Inward` and `Outward`, except for cavities;
    /// motions change the result only by rounding. An open piece of small field (a plate, dish,
    /// hood or half-sphere) is `Undecided`, and so is the closed wall of a cavity. A duct with only
    /// its inner wall has the shape of a bar that is wound inward, and is reported as that: a
    /// caller that knows the tool has to test whether it fits in there. Pieces beyond the largest
    /// few hundred, and fewer in large meshes, are `Undecided`. Time is bounded by 20 million solid
    /// angles, or 16 for each triangle.
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        let edges = Edges::of(mesh);
        let mut orientation = pieces(mesh, &edges);
        let order = considered(&orientation.pieces, mesh.triangles().len());
        let fields = Fields::of(mesh, &orientation, &order);
        let topology = Topology::of(mesh, &edges);
        let inverted = |k: u32| {
            let piece = &orientation.pieces[k as usize];
            topology.components[topology.component_of[piece.first_triangle] as usize].is_inverted()
        };
        let is_inverted: Vec<bool> = order.iter().map(|&k| inverted(k)).collect();
        let closed: Vec<bool> = order.iter().map(|&k| orientation.pieces[k as usize].closed).collect();
        for (&k, winding) in order.iter().zip(fields.windings(&closed, &is_inverted)) {
            orientation.pieces[k as usize].winding = winding;
        }
        orientation
    }
}

/// Finds the pieces, all undecided.
fn pieces(mesh: &TriMesh, edges: &Edges) -> Orientation {
    let n = mesh.triangles().len();
    let mut sets = DisjointSets::new(n);
    let mut open = Vec::new();
    for edge in 0..edges.len() as u32 {
        let sides = edges.sides(edge);
        match edges.directions(mesh, edge) {
            (1, 1) => sets.join(sides[0] / 3, sides[1] / 3),
            (up, down) if up != down => open.extend_from_slice(sides),
            _ => {}
        }
    }
    let mut orientation = Orientation { pieces: Vec::new(), piece_of: vec![0; n] };
    for t in 0..n {
        // The lowest triangle represents its set, so it has been seen before the others.
        let first = sets.find(t as u32) as usize;
        orientation.piece_of[t] = orientation.piece_of[first];
        if first == t {
            orientation.piece_of[t] = orientation.pieces.len() as u32;
            let new =
                WoundPiece { first_triangle: t, n_triangles: 0, area: 0.0, closed: true, winding: Winding::Undecided };
            orientation.pieces.push(new);
        }
        let piece = &mut orientation.pieces[orientation.piece_of[t] as usize];
        piece.n_triangles += 1;
        piece.area += 0.5 * mesh.scaled_normal(t).norm();
    }
    for side in open {
        orientation.pieces[orientation.piece_of[side as usize / 3] as usize].closed = false;
    }
    orientation
}

fn n_samples(n_triangles: usize) -> usize {
    (ANGLES / n_triangles.max(1)).clamp(SAMPLES.0, SAMPLES.1)
}

/// Returns the pieces of largest area, as many as can be evaluated.
fn considered(pieces: &[WoundPiece], n_triangles: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..pieces.len() as u32).collect();
    order.sort_by(|a, b| pieces[*b as usize].area.total_cmp(&pieces[*a as usize].area).then(a.cmp(b)));
    order.truncate(n_samples(n_triangles) / LEAST_SAMPLES);
    order
}

/// Contributions of each piece to the mean field of each other one, with the present winding.
struct Fields {
    areas: Vec<f64>,
    /// Row: the piece with the field; column: the piece that causes it.
    of: Vec<Vec<f64>>,
}

impl Fields {
    fn of(mesh: &TriMesh, orientation: &Orientation, order: &[u32]) -> Self {
        let mut place = vec![usize::MAX; orientation.pieces.len()];
        order.iter().enumerate().for_each(|(row, &k)| place[k as usize] = row);
        let place_of = |t: usize| place[orientation.piece_of[t] as usize];
        let mut triangles: Vec<Vec<u32>> = vec![Vec::new(); order.len()];
        (0..mesh.triangles().len()).filter(|&t| place_of(t) < order.len()).for_each(|t| {
            triangles[place_of(t)].push(t as u32);
        });
        let areas: Vec<f64> = order.iter().map(|&k| orientation.pieces[k as usize].area).collect();
        let total: f64 = areas.iter().sum();
        let spare = n_samples(mesh.triangles().len()) - LEAST_SAMPLES * order.len();
        let row = |own: usize| {
            let n = LEAST_SAMPLES + (spare as f64 * areas[own] / total) as usize;
            let samples = spread(mesh, &triangles[own], areas[own], n);
            let field = |other: &Vec<u32>| samples.iter().map(|&s| field_at(mesh, s, other)).sum::<f64>();
            triangles.iter().map(|other| field(other) / samples.len().max(1) as f64).collect()
        };
        Self { of: (0..order.len()).map(row).collect(), areas }
    }

    /// Returns the mean field of a piece when these pieces are turned.
    fn mean(&self, piece: usize, turned: &[bool]) -> f64 {
        self.of[piece].iter().zip(turned).map(|(f, turned)| if *turned { -f } else { *f }).sum()
    }

    /// Returns the deficit from the field of a solid, times area. A larger field is no deficit:
    /// solids may overlap.
    fn lack(&self, turned: &[bool]) -> f64 {
        (0..self.areas.len()).map(|k| self.areas[k] * (SOLID - self.mean(k, turned)).max(0.0)).sum()
    }

    /// Returns the deficit saved by turning a piece once more.
    fn gain(&self, piece: usize, turned: &[bool]) -> f64 {
        let mut other = turned.to_vec();
        other[piece] = !other[piece];
        self.lack(turned) - self.lack(&other)
    }

    fn windings(&self, closed: &[bool], is_inverted: &[bool]) -> Vec<Winding> {
        let begin: Vec<bool> = (0..closed.len())
            .map(|k| {
                let none = vec![false; closed.len()];
                closed[k] && is_inverted[k] && self.mean(k, &none) - self.of[k][k] < NO_CAVITY
            })
            .collect();
        let free = |k: usize| !closed[k];
        let all: Vec<bool> = (0..closed.len()).map(|k| begin[k] || free(k)).collect();
        let [kept, other] = [begin.clone(), all].map(|turned| self.settled(turned, &free));
        // As wound, unless turning all saves more.
        let area: f64 = self.areas.iter().sum();
        let turned = if self.lack(&other) + 1e-3 * area < self.lack(&kept) { other } else { kept };
        (0..closed.len())
            .map(|k| match (closed[k], turned[k]) {
                (true, true) => Winding::Inward,
                (true, false) => {
                    if is_inverted[k] {
                        Winding::Undecided
                    } else {
                        Winding::Outward
                    }
                }
                (false, _) if self.mean(k, &turned) < DECIDED => Winding::Undecided,
                (false, _) if -self.gain(k, &turned) < LEAST_GAIN * self.areas[k] => Winding::Undecided,
                (false, true) => Winding::Inward,
                (false, false) => Winding::Outward,
            })
            .collect()
    }

    /// Turns piece after piece, the one that saves most first, until none saves as much as a clear
    /// case.
    fn settled(&self, mut turned: Vec<bool>, free: &dyn Fn(usize) -> bool) -> Vec<bool> {
        for _ in 0..2 * turned.len() {
            let gains = (0..turned.len()).filter(|&k| free(k)).map(|k| (k, self.gain(k, &turned)));
            let best = gains.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            match best {
                Some((k, gain)) if gain > LEAST_GAIN * self.areas[k] => turned[k] = !turned[k],
                _ => break,
            }
        }
        turned
    }
}

/// Returns `n` of these triangles, evenly by area; large ones several times.
fn spread(mesh: &TriMesh, triangles: &[u32], area: f64, n: usize) -> Vec<u32> {
    let step = area / n as f64;
    let (mut sum, mut samples) = (0.0, Vec::with_capacity(n));
    for &t in triangles {
        sum += 0.5 * mesh.scaled_normal(t as usize).norm();
        while samples.len() < n && (samples.len() as f64 + 0.5) * step <= sum {
            samples.push(t);
        }
    }
    samples
}

/// Returns the contributions of these triangles to the winding number at the centroid of one that
/// does not count.
fn field_at(mesh: &TriMesh, sample: u32, triangles: &[u32]) -> f64 {
    let [a, b, c] = mesh.corners(sample as usize);
    let p = (a.coords + b.coords + c.coords) / 3.0;
    let mut angles = HalfAngles::default();
    for &t in triangles.iter().filter(|&&t| t != sample) {
        let [a, b, c] = mesh.corners(t as usize);
        angles.add(&(a.coords - p), &(b.coords - p), &(c.coords - p));
    }
    angles.sum() / TAU
}

/// Largest slope of a half solid angle that is summed as a factor, and largest number of such
/// factors: together they turn by less than half a round.
const SMALL_SLOPE: f64 = 0.1;

const FACTORS: usize = 16;

/// Halves of the solid angles of triangles, positive where seen from behind, 0 in their plane, as
/// arguments of complex numbers (Van Oosterom, Strackee, The solid angle of a plane triangle, IEEE
/// Trans. Biomed. Eng. 1983). Small ones are multiplied, and one arctangent is taken of many.
struct HalfAngles {
    sum: f64,
    /// 1 + i·slope for each small angle since the last arctangent, multiplied.
    product: [f64; 2],
    n_factors: usize,
}

impl Default for HalfAngles {
    fn default() -> Self {
        Self { sum: 0.0, product: [1.0, 0.0], n_factors: 0 }
    }
}

impl HalfAngles {
    /// Adds a triangle with these corners, relative to the eye.
    fn add(&mut self, a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) {
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let (volume, lengths) = (a.dot(&b.cross(c)), la * lb * lc);
        if volume.abs() <= 1e-12 * lengths {
            return;
        }
        let real = lengths + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        if volume.abs() > SMALL_SLOPE * real {
            self.sum += volume.atan2(real);
            return;
        }
        let slope = volume / real;
        let [x, y] = self.product;
        self.product = [x - y * slope, y + x * slope];
        self.n_factors += 1;
        if self.n_factors == FACTORS {
            self.close();
        }
    }

    /// Takes the arctangent of the factors.
    fn close(&mut self) {
        let [x, y] = self.product;
        *self = Self { sum: self.sum + y.atan2(x), ..Self::default() };
    }

    fn sum(mut self) -> f64 {
        self.close();
        self.sum
    }
}
