//! Cutters of radius R and corner radius r.

use std::f64::consts::FRAC_1_SQRT_2;

use facemill_cl_data::{RoundFrustum, Solid};

/// The cutting part of a tool: radius R, corner radius r, cutting height. r = 0 is a flat cutter,
/// r = R a ball, between them a bull-nose or face mill with round corners. Tool frame: origin at
/// the tip, z toward the spindle, mm.
///
/// As a solid it is what the turning cutter sweeps: the bottom disc, the quarter torus of the
/// corner, and the cylinder up to the flute length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    radius: f64,
    corner_radius: f64,
    flute_length: f64,
}

/// Why three lengths are not a cutter. Values in mm.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutterError {
    /// The radius is not a positive finite number.
    #[error("radius {0} mm is not a positive length")]
    Radius(f64),
    /// The corner radius is negative, not finite, or larger than the radius.
    #[error("corner radius {corner_radius} mm is not between 0 and the radius {radius} mm")]
    CornerRadius {
        /// r.
        corner_radius: f64,
        /// R.
        radius: f64,
    },
    /// The flute ends below the top of the corner, or nowhere.
    #[error("flute length {flute_length} mm is not a positive length of at least the corner radius {corner_radius} mm")]
    FluteLength {
        /// Cutting height.
        flute_length: f64,
        /// r.
        corner_radius: f64,
    },
}

impl Cutter {
    /// A cutter of radius R, corner radius r and cutting height, mm.
    ///
    /// # Errors
    /// Unless all are finite, 0 < R, 0 ≤ r ≤ R and r ≤ flute length > 0.
    pub fn new(radius: f64, corner_radius: f64, flute_length: f64) -> Result<Self, CutterError> {
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(CutterError::Radius(radius));
        }
        if !(0.0..=radius).contains(&corner_radius) {
            return Err(CutterError::CornerRadius { corner_radius, radius });
        }
        if !(flute_length > 0.0 && flute_length >= corner_radius && flute_length.is_finite()) {
            return Err(CutterError::FluteLength { flute_length, corner_radius });
        }
        Ok(Self { radius, corner_radius, flute_length })
    }

    /// R, mm.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// r, mm.
    pub fn corner_radius(&self) -> f64 {
        self.corner_radius
    }

    /// Cutting height from the tip, mm.
    pub fn flute_length(&self) -> f64 {
        self.flute_length
    }

    /// R − r, mm: radius of the bottom disc and of the circle on which the corner's arcs are
    /// centred.
    pub fn rim_radius(&self) -> f64 {
        self.radius - self.corner_radius
    }

    /// The cylinder of radius R − r, r above the tip and with rounding 0, whose r-neighbourhood is
    /// the cutter below `flute_length − r`. Its upper end is at `flute_length − r`, but never below
    /// its lower one.
    pub fn core(&self) -> RoundFrustum {
        let r = self.corner_radius;
        cylinder(self.rim_radius(), r, self.flute_length - r, 0.0)
    }

    /// Returns the test bodies of the whole cutter for a tolerance t ≥ 0 mm, tool frame
    /// (`docs/architecture.md`, "Test body"): they lie inside the cutter, and no cutter point is
    /// farther than t from all of them. If all are free of the part, no cutter point is deeper than
    /// t in it. With t = 0 they are the cutter itself.
    pub fn test_bodies(&self, tolerance: f64) -> Vec<Solid> {
        let lower = self.lower_test_body(tolerance);
        std::iter::once(lower).chain(self.upper_test_body(tolerance)).map(Solid::Frustum).collect()
    }

    /// The first of the [`Cutter::test_bodies`], which holds the cutter's bottom and side: it lies
    /// inside the cutter, and no cutter point is farther than t from it or from the
    /// [`Cutter::upper_test_body`].
    ///
    /// For r ≥ t radius R − t, corner r − t, bottom raised by t; for r < t a sharp cylinder of
    /// radius R − s raised by s = r + (t − r)/√2. Its top is at the flute length, rounded like its
    /// bottom; where the flute is shorter than 2r − t, the rounding reaches above it, to 2r − t. A
    /// tolerance below 0 counts as 0; one for which nothing of the cutter would be left gives
    /// radius 0.
    pub fn lower_test_body(&self, tolerance: f64) -> RoundFrustum {
        let (t, r) = (tolerance.max(0.0), self.corner_radius);
        if r >= t {
            return cylinder(self.rim_radius(), r, self.flute_length - (r - t), r - t);
        }
        let s = r + (t - r) * FRAC_1_SQRT_2;
        cylinder((self.radius - s).max(0.0), s, self.flute_length, 0.0)
    }

    /// The part of the cutter near its upper rim that the rounded top of
    /// [`Cutter::lower_test_body`] leaves out: a sharp cylinder inside the cutter, from r above the
    /// tip to the flute's end. `None` where there is no such part (sharp corners within t, or a
    /// flute that ends with the corner).
    pub fn upper_test_body(&self, tolerance: f64) -> Option<RoundFrustum> {
        let (t, r) = (tolerance.max(0.0), self.corner_radius);
        let inset = t * FRAC_1_SQRT_2;
        (r >= t && r > 0.0 && self.flute_length > r)
            .then(|| cylinder((self.radius - inset).max(0.0), r, self.flute_length - inset, 0.0))
    }
}

fn cylinder(radius: f64, z_low: f64, z_high: f64, rounding: f64) -> RoundFrustum {
    RoundFrustum { z_low, z_high: z_high.max(z_low), radius_low: radius, radius_high: radius, rounding }
}

#[cfg(test)]
#[path = "../tests/unit/cutter.rs"]
mod tests;
