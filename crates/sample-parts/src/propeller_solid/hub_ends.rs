//! Rest of the hub: cylinder beyond the band of the roots, rounded ends and bore.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Point3;

use crate::propeller::hub::{LONGEST_QUAD, ROUNDING, steps};
use crate::propeller_solid::bore::Bore;
use crate::propeller_solid::sector::{BORE, CYLINDER, Corner, ENDS, FACES, Sector};

/// Hub beyond a band of its cylinder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HubEnds {
    pub(crate) radius: f64,
    /// Ends of the cylinder in z.
    pub(crate) cylinder: [f64; 2],
    /// Ends of the band in z.
    pub(crate) band: [f64; 2],
    pub(crate) bore: Option<Bore>,
    pub(crate) tolerance: f64,
}

impl HubEnds {
    /// Adds everything beyond the band, whose rings are given, the lower one first.
    pub(crate) fn add_to(&self, sector: &mut Sector, rings: [&[u32]; 2]) {
        let flat_rings = [0, 1].map(|end| self.add_end(sector, end, rings[end]));
        let n = rings[0].len();
        let Some(bore) = self.bore else {
            for (end, flat_ring) in flat_rings.iter().enumerate() {
                let centre = sector.axis_vertex(self.flat_height(end));
                for i in 0..n {
                    let [a, b] = [corner(flat_ring, i), corner(flat_ring, i + 1)];
                    sector.triangle(FACES, if end == 0 { [b, a, centre] } else { [a, b, centre] });
                }
            }
            return;
        };
        let [low, high] = [0, 1].map(|end| self.flat_height(end));
        let [aft, ahead] = bore.radii();
        let mut bore_rings = Vec::new();
        for (end, flat_ring) in flat_rings.iter().enumerate() {
            let (flat, z) = (self.radius * (1.0 - ROUNDING), self.flat_height(end));
            let wall = bore.radii()[end];
            let n_steps = self.n_quads(sector, flat - wall, wall, n);
            let outline = (1..=n_steps).map(|k| (flat + (wall - flat) * share(k, n_steps), z));
            bore_rings.push(add_rings(sector, flat_ring.clone(), outline, end == 1, |_| FACES));
        }
        let n_steps = self.n_quads(sector, high - low, aft.min(ahead), n);
        let outline =
            (1..n_steps).map(|k| (aft + (ahead - aft) * share(k, n_steps), low + (high - low) * share(k, n_steps)));
        let last = add_rings(sector, bore_rings[0].clone(), outline, false, |_| BORE);
        add_strip(sector, BORE, &last, &bore_rings[1], false);
    }

    /// Height of a flat end.
    fn flat_height(&self, end: usize) -> f64 {
        self.cylinder[end] + [-1.0, 1.0][end] * ROUNDING * self.radius
    }

    /// Adds cylinder and rounding of an end, and returns the ring around its flat.
    fn add_end(&self, sector: &mut Sector, end: usize, ring: &[u32]) -> Vec<u32> {
        let (from, to, sense) = (self.band[end], self.cylinder[end], [-1.0, 1.0][end]);
        let rounding = ROUNDING * self.radius;
        let is_there = (to - from).abs() > 1e-9 * self.radius;
        let n_along = if is_there { self.n_quads(sector, (to - from).abs(), self.radius, ring.len()) } else { 0 };
        let along = (1..=n_along).map(|k| (self.radius, from + (to - from) * share(k, n_along)));
        let n_arc = steps(FRAC_PI_2, rounding, self.tolerance).max(4);
        let arc = (1..=n_arc).map(|k| {
            let (sin, cos) = (FRAC_PI_2 * share(k, n_arc)).sin_cos();
            (self.radius - rounding * (1.0 - cos), to + sense * rounding * sin)
        });
        let outline = along.chain(arc);
        add_rings(sector, ring.to_vec(), outline, end == 1, |k| if k < n_along { CYLINDER } else { ENDS })
    }

    /// Quads over a length along the axis or a radius that are not much longer than wide.
    fn n_quads(&self, sector: &Sector, length: f64, radius: f64, n_around: usize) -> usize {
        let width = sector.angle() * radius / n_around as f64;
        ((length / (LONGEST_QUAD * width)).ceil().max(1.0)) as usize
    }
}

/// Adds strips from a ring along an outline of `(r, z)`, and returns the last ring; `is_upward` as
/// in [`add_strip`], with the group of each strip.
fn add_rings(
    sector: &mut Sector,
    mut ring: Vec<u32>,
    outline: impl Iterator<Item = (f64, f64)>,
    is_upward: bool,
    group: impl Fn(usize) -> usize,
) -> Vec<u32> {
    let n = ring.len();
    for (k, (r, z)) in outline.enumerate() {
        let next: Vec<u32> = (0..n)
            .map(|i| {
                let (sin, cos) = (sector.angle() * share(i, n)).sin_cos();
                sector.vertex(Point3::new(r * cos, r * sin, z))
            })
            .collect();
        add_strip(sector, group(k), &ring, &next, is_upward);
        ring = next;
    }
    ring
}

/// Adds a strip between two rings, seen from outside with `next` above `ring`, or below.
fn add_strip(sector: &mut Sector, group: usize, ring: &[u32], next: &[u32], is_upward: bool) {
    for i in 0..ring.len() {
        let [a, b, c, d] = [corner(ring, i), corner(ring, i + 1), corner(next, i + 1), corner(next, i)];
        sector.quad(group, if is_upward { [a, b, c, d] } else { [b, a, d, c] });
    }
}

/// Corner of a ring, whose last vertex is followed by the first of the next sector.
fn corner(ring: &[u32], at: usize) -> Corner {
    Corner::Turned { vertex: ring[at % ring.len()], turn: (at / ring.len()) as i32 }
}

fn share(k: usize, n: usize) -> f64 {
    k as f64 / n as f64
}
