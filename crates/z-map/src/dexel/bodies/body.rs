use std::f64::consts::FRAC_PI_2;

use facemill_tool_model::Cutter;

use crate::dexel::bodies::lanes::{LANES, Wide};

/// A ring about the tool axis that is rounded by a ball: a disc of this radius at this height,
/// dilated. mm, tool frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundRing {
    /// Radius of the ring, 0 on the axis.
    pub radius: f64,
    /// Height over the tip.
    pub height: f64,
    /// Radius of the ball.
    pub rounding: f64,
}

/// A convex body of revolution: the convex hull of rounded rings about one axis.
///
/// Every convex part of a tool is of this kind: a ball is one ring of radius 0, a bull-nose cutter
/// the ring of its corner and the sharp one at the end of its flute, a section of a shank or holder
/// two rings. Tool frame: origin at the tip, z toward the spindle, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnedBody {
    corners: Vec<Corner>,
    /// The outline from the bottom to the top.
    arcs: Vec<Arc>,
}

/// Corner whose hull a body is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    pub(crate) ring: RoundRing,
    /// Whether only the lower half of the ball counts: a cutter's corner, above which the flute may
    /// end.
    is_lower: bool,
}

/// Why rings are not a body.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// There is no ring.
    #[error("a body of revolution needs at least one ring")]
    NoRing,
    /// More rings than the outline is made for.
    #[error("{0} rings are more than the {max} of one body; give a stack as several bodies",
        max = TurnedBody::MAX_RINGS)]
    TooManyRings(usize),
    /// A length is not finite or a radius below zero.
    #[error("ring {index}: radius {}, height {} and rounding {} mm must be finite, radius and rounding not below 0",
        ring.radius, ring.height, ring.rounding)]
    BadRing {
        /// Which ring, from 0.
        index: usize,
        /// Ring.
        ring: RoundRing,
    },
    /// All rings lie in one plane without rounding, or on the axis.
    #[error("the rings make a body without volume: give two heights and a radius, or a rounding")]
    Flat,
}

/// Part of the outline in the half plane of distance from the axis and height: normals between two
/// directions.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Arc {
    ring: RoundRing,
    from: [f64; 2],
    to: [f64; 2],
}

impl TurnedBody {
    /// Largest number of rings of one body.
    pub const MAX_RINGS: usize = 16;

    /// The convex hull of rings.
    ///
    /// # Errors
    /// When a length is no number to work with, or the hull has no volume.
    pub fn new(rings: &[RoundRing]) -> Result<Self, BodyError> {
        if rings.is_empty() {
            return Err(BodyError::NoRing);
        }
        if rings.len() > Self::MAX_RINGS {
            return Err(BodyError::TooManyRings(rings.len()));
        }
        for (index, &ring) in rings.iter().enumerate() {
            let RoundRing { radius, height, rounding } = ring;
            if !(radius >= 0.0 && rounding >= 0.0 && (radius + rounding + height.abs()).is_finite()) {
                return Err(BodyError::BadRing { index, ring });
            }
        }
        let is_round = rings.iter().any(|r| r.rounding > 0.0);
        let is_high = rings.iter().any(|r| r.height != rings[0].height);
        let is_wide = rings.iter().any(|r| r.radius > 0.0);
        let has_volume = is_round || (is_high && is_wide);
        if !has_volume {
            return Err(BodyError::Flat);
        }
        Ok(Self::of(rings.iter().map(|&ring| Corner { ring, is_lower: false }).collect()))
    }

    /// All that the turning cutter is: bottom disc, corner, and cylinder up to the flute length.
    pub fn of_cutter(cutter: &Cutter) -> Self {
        let corner =
            RoundRing { radius: cutter.rim_radius(), height: cutter.corner_radius(), rounding: cutter.corner_radius() };
        let end = RoundRing { radius: cutter.radius(), height: cutter.flute_length(), rounding: 0.0 };
        Self::of(vec![Corner { ring: corner, is_lower: true }, Corner { ring: end, is_lower: false }])
    }

    /// The sphere of this radius that touches the tip's plane.
    ///
    /// # Errors
    /// When the radius is not a positive length.
    pub fn ball(radius: f64) -> Result<Self, BodyError> {
        Self::new(&[RoundRing { radius: 0.0, height: radius, rounding: radius }])
    }

    /// A cone's frustum about the axis, dilated by a clearance: a section of a shank or holder.
    ///
    /// # Errors
    /// When a length is no number to work with, or the body has no volume.
    pub fn frustum(heights: [f64; 2], radii: [f64; 2], clearance: f64) -> Result<Self, BodyError> {
        let ring = |k: usize| RoundRing { radius: radii[k], height: heights[k], rounding: clearance };
        Self::new(&[ring(0), ring(1)])
    }

    fn of(corners: Vec<Corner>) -> Self {
        let arcs = outline(&corners);
        Self { corners, arcs }
    }

    pub(crate) fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// A body that holds all that is within a length of this one.
    pub(crate) fn dilated(&self, by: f64) -> Self {
        let wider = |c: &Corner| {
            let ring = RoundRing { rounding: c.ring.rounding + by, ..c.ring };
            Corner { ring, is_lower: false }
        };
        Self::of(self.corners.iter().map(wider).collect())
    }

    /// Height along the axis.
    pub(crate) fn height(&self) -> f64 {
        let along = |sense: f64| self.corners.iter().map(|c| c.reach(0.0, sense)).fold(f64::NEG_INFINITY, f64::max);
        along(1.0) + along(-1.0)
    }

    /// The height on the axis from which no point of the body is farther than the returned
    /// distance, mm.
    pub(crate) fn middle(&self) -> (f64, f64) {
        let along = |sense: f64| self.corners.iter().map(|c| c.reach(0.0, sense)).fold(f64::NEG_INFINITY, f64::max);
        let middle = 0.5 * (along(1.0) - along(-1.0));
        let far = |c: &Corner| c.ring.radius.hypot(c.ring.height - middle) + c.ring.rounding;
        let reach = self.corners.iter().map(far).fold(0.0, f64::max);
        (middle, reach)
    }

    /// Signed distance from the outline of a point at this distance from the axis and this height,
    /// and the outward normal there. Exact outside; inside a lower bound of the depth with the same
    /// zeroes. Convex.
    #[inline(always)]
    pub(crate) fn gap(&self, radial: f64, height: f64) -> (f64, [f64; 2]) {
        let mut best = (f64::NEG_INFINITY, [0.0, -1.0]);
        for arc in &self.arcs {
            let (x, z) = (radial - arc.ring.radius, height - arc.ring.height);
            let is_between = arc.from[0] * z - arc.from[1] * x >= 0.0 && x * arc.to[1] - z * arc.to[0] >= 0.0;
            let length = (x * x + z * z).sqrt();
            let (distance, normal) = if is_between && length > 0.0 {
                (length, [x / length, z / length])
            } else {
                let (from, to) = (arc.from[0] * x + arc.from[1] * z, arc.to[0] * x + arc.to[1] * z);
                if from >= to { (from, arc.from) } else { (to, arc.to) }
            };
            let distance = distance - arc.ring.rounding;
            if distance > best.0 {
                best = (distance, normal);
            }
        }
        best
    }

    /// The same for several points: distance (less beyond the upper edge), and the normal's parts
    /// across and along the axis.
    #[inline(always)]
    pub(crate) fn gaps(&self, radial: &Wide, height: &Wide) -> (Wide, Wide, Wide) {
        let (mut gap, mut across, mut along) = ([f64::NEG_INFINITY; LANES], [0.0; LANES], [-1.0; LANES]);
        for arc in &self.arcs {
            let RoundRing { radius, height: level, rounding } = arc.ring;
            let ([from_x, from_z], [to_x, to_z]) = (arc.from, arc.to);
            if rounding == 0.0 && from_z >= 0.0 {
                // The upper edge: the surfaces at it have the same zeroes, and need no root.
                for l in 0..LANES {
                    let (x, z) = (radial[l] - radius, height[l] - level);
                    let (from, to) = (from_x * x + from_z * z, to_x * x + to_z * z);
                    let is_from = from >= to;
                    let side = if is_from { from } else { to };
                    let is_best = side > gap[l];
                    gap[l] = if is_best { side } else { gap[l] };
                    across[l] = if is_best { if is_from { from_x } else { to_x } } else { across[l] };
                    along[l] = if is_best { if is_from { from_z } else { to_z } } else { along[l] };
                }
                continue;
            }
            for l in 0..LANES {
                // Selections and no branches: this is what the vector instructions are for.
                let (x, z) = (radial[l] - radius, height[l] - level);
                let length = (x * x + z * z).sqrt();
                let (from, to) = (from_x * x + from_z * z, to_x * x + to_z * z);
                let (past_from, past_to) = (from_x * z - from_z * x, x * to_z - z * to_x);
                let least = if past_from < past_to { past_from } else { past_to };
                let is_between = (least >= 0.0) & (length > 0.0);
                let is_from = from >= to;
                let side = if is_from { from } else { to };
                let (side_x, side_z) = (if is_from { from_x } else { to_x }, if is_from { from_z } else { to_z });
                let part = 1.0 / length;
                let distance = if is_between { length } else { side } - rounding;
                let nx = if is_between { x * part } else { side_x };
                let nz = if is_between { z * part } else { side_z };
                let is_best = distance > gap[l];
                gap[l] = if is_best { distance } else { gap[l] };
                across[l] = if is_best { nx } else { across[l] };
                along[l] = if is_best { nz } else { along[l] };
            }
        }
        (gap, across, along)
    }
}

impl Corner {
    /// How far the corner reaches along a unit direction with these parts across and along the
    /// axis.
    #[inline(always)]
    pub(crate) fn reach(&self, across: f64, along: f64) -> f64 {
        let RoundRing { radius, height, rounding } = self.ring;
        let round = if self.is_lower && along > 0.0 { across } else { 1.0 };
        radius * across + height * along + rounding * round
    }

    /// Returns the part of the ring that counts for normals upward along the axis (`along` above 0)
    /// or not.
    pub(crate) fn flat_end(&self, along: f64) -> RoundRing {
        if self.is_lower && along > 0.0 { self.sharp() } else { self.ring }
    }

    /// The ring at which the lower half of the ball ends.
    fn sharp(&self) -> RoundRing {
        RoundRing { radius: self.ring.radius + self.ring.rounding, rounding: 0.0, ..self.ring }
    }
}

/// Directions in which the hull changes from one ring to another, and the arcs between them.
fn outline(corners: &[Corner]) -> Vec<Arc> {
    let mut turns = vec![-FRAC_PI_2, 0.0, FRAC_PI_2];
    // Rings as they count below and above.
    let rings: Vec<RoundRing> =
        corners.iter().flat_map(|c| [Some(c.ring), c.is_lower.then(|| c.sharp())]).flatten().collect();
    for (k, a) in rings.iter().enumerate() {
        for b in &rings[..k] {
            // (Δρ, Δz)·n + Δr = 0.
            let (dx, dz, dr) = (a.radius - b.radius, a.height - b.height, a.rounding - b.rounding);
            let size = dx.hypot(dz);
            if size > 0.0 && dr.abs() <= size {
                let (toward, off) = (dz.atan2(dx), (-dr / size).clamp(-1.0, 1.0).acos());
                let angles = [toward + off, toward - off].map(|t| t.sin().atan2(t.cos()));
                turns.extend(angles.into_iter().filter(|t| t.abs() < FRAC_PI_2));
            }
        }
    }
    turns.sort_by(f64::total_cmp);
    let direction = |t: f64| if t.abs() == FRAC_PI_2 { [0.0, t.signum()] } else { [t.cos(), t.sin()] };
    let mut arcs: Vec<Arc> = Vec::new();
    for pair in turns.windows(2).filter(|pair| pair[1] > pair[0]) {
        let [x, z] = direction(0.5 * (pair[0] + pair[1]));
        let farther = |best: Corner, c: Corner| if c.reach(x, z) > best.reach(x, z) { c } else { best };
        let Some(corner) = corners.iter().copied().reduce(farther) else { continue };
        let ring = corner.flat_end(z);
        match arcs.last_mut() {
            Some(last) if last.ring == ring => last.to = direction(pair[1]),
            _ => arcs.push(Arc { ring, from: direction(pair[0]), to: direction(pair[1]) }),
        }
    }
    arcs
}
