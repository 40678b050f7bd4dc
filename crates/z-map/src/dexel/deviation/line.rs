//! One line of the stock against a part.

use facemill_surface_model::Surface;

use crate::dexel::crossings::Crossing;
use crate::dexel::deviation::{Cavity, Record, deeper};
use crate::dexel::grid::DexelGrid;
use crate::dexel::tile::Interval;

/// Where the stock's surface is along a line, seen from a place of the part.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Far {
    /// An end of material at this height.
    Stock(f64),
    /// The next surface of the part comes first.
    Part(f64),
    /// There is no material.
    Nowhere,
}

impl Far {
    /// Returns whether something was cut between the one and the other.
    fn differs_from(self, before: Self) -> bool {
        match (self, before) {
            (Self::Stock(now), Self::Stock(then)) => (now - then).abs() > SAME_HEIGHT,
            (now, then) => now != then,
        }
    }
}

/// One line of both maps.
pub(crate) struct LinePair<'a> {
    pub part: &'a Surface,
    pub grid: &'a DexelGrid,
    pub i: usize,
    pub j: usize,
    pub now: Vec<Interval>,
    pub before: Vec<Interval>,
}

impl LinePair<'_> {
    /// The place of the k-th crossing.
    pub(crate) fn record(&self, crossings: &[Crossing], k: usize) -> Record {
        let Crossing { height, is_begin, triangle, .. } = crossings[k];
        // A surface that is there twice does not stop itself.
        let is_other = |c: &&Crossing| (c.height - height).abs() > SAME_HEIGHT;
        let below = crossings[..k].iter().rev().find(is_other).map(|c| c.height);
        let above = crossings[k + 1..].iter().find(is_other).map(|c| c.height);
        let (inward, outward) = if is_begin { (above, below) } else { (below, above) };
        let far = |line: &[Interval]| far(line, height, is_begin, [inward, outward]);
        let now = far(&self.now);
        let deviation = match now {
            Far::Stock(z) | Far::Part(z) => {
                let is_excess = (z > height) != is_begin;
                let distance = self.distance_from_sheet(z, height, triangle);
                if is_excess { distance } else { -distance }
            }
            Far::Nowhere => f64::NEG_INFINITY,
        };
        Record { height, deviation, triangle, is_cut: now.differs_from(far(&self.before)) }
    }

    /// Distance of a height on the line from the part's surface that looks the same way as a
    /// triangle through which the line goes at another height, and has the height on the same side.
    fn distance_from_sheet(&self, z: f64, height: f64, triangle: u32) -> f64 {
        let along = (z - height).abs();
        let part = self.part;
        let at = |z: f64| self.grid.in_work(self.i, self.j, z);
        let Some(normal) = part.facet_normal(triangle).filter(|_| along > 0.0) else { return along };
        let (end, place) = (at(z), at(height));
        let side = (end - place).dot(&normal).signum();
        let counts = |t: u32| {
            let Some(n) = part.facet_normal(t).filter(|n| n.dot(&normal) > 0.0) else { return false };
            side * n.dot(&(end - part.mesh().corners(t as usize)[0])) >= -ON_PLANE
        };
        let nearest = part.closest_point_where(&end, along, counts);
        nearest.map_or(along, |p| p.distance)
    }

    /// The deepest gap between two intervals that both reach into one and the same interval of the
    /// part.
    pub(crate) fn cavities(&self, solid: &[Crossing]) -> Option<Cavity> {
        let gaps = self.now.windows(2).map(|w| [w[0].top, w[1].bottom]);
        let inside = |g: &[f64; 2]| solid.chunks_exact(2).any(|p| p[0].height < g[0] && g[1] < p[1].height);
        gaps.filter(inside).map(|gap| self.cavity(gap)).reduce(deeper)
    }

    /// The greatest distance from the part over a gap, from above: distance changes by no more than
    /// the way along the line.
    fn cavity(&self, gap: [f64; 2]) -> Cavity {
        let at = |z: f64| self.grid.in_work(self.i, self.j, z);
        let distance = |z: f64| self.part.closest_point(&at(z), f64::INFINITY).map_or(0.0, |p| p.distance);
        let (mut depth, mut least) = (0.0_f64, 0.0_f64);
        let mut waiting = vec![gap];
        while let Some([a, b]) = waiting.pop() {
            let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
            let here = distance(middle);
            least = least.max(here);
            if here + half <= least * (1.0 + CAVITY_SHARE) + CAVITY_LENGTH {
                depth = depth.max(here + half);
            } else {
                waiting.extend([[a, middle], [middle, b]]);
            }
        }
        Cavity { position: at(0.5 * (gap[0] + gap[1])), depth }
    }
}

/// How far from a triangle's plane a point may be and still be on both sides of it, mm: less than
/// anyone measures, more than heights are rounded.
const ON_PLANE: f64 = 1e-6;

/// Heights that are the same, mm: those of triangles that touch are rounded.
const SAME_HEIGHT: f64 = 1e-6;

/// Most by which the depth of a cavity may be overstated: share of the depth, and mm. Less takes
/// more distances; more says less.
const CAVITY_SHARE: f64 = 0.05;

const CAVITY_LENGTH: f64 = 0.01;

/// Where the stock's surface is, seen from a height at which the part's material begins or ends
/// upward. `stops` are the part's next surfaces into its material and out of it.
fn far(line: &[Interval], height: f64, is_begin: bool, stops: [Option<f64>; 2]) -> Far {
    // Turned so that the part's material is below.
    let sign = if is_begin { -1.0 } else { 1.0 };
    let z = sign * height;
    let ends = |i: &Interval| if is_begin { [-i.top, -i.bottom] } else { [i.bottom, i.top] };
    let [inward, outward] = stops.map(|s| s.map(|s| sign * s));
    let around = line.iter().map(ends).find(|[low, high]| *low <= z && z <= *high);
    if let Some([_, high]) = around {
        return match outward.filter(|stop| *stop < high) {
            Some(stop) => Far::Part(sign * stop),
            None => Far::Stock(sign * high),
        };
    }
    let next = line.iter().map(|i| ends(i)[1]).filter(|high| *high < z).reduce(f64::max);
    match (next, inward) {
        (Some(high), stop) if stop.is_none_or(|s| s <= high) => Far::Stock(sign * high),
        (_, Some(stop)) => Far::Part(sign * stop),
        (_, None) => Far::Nowhere,
    }
}
