//! Bore of a hub.

use crate::spec_error::{SpecError, in_range};

/// Bore through a hub along its axis: a cylinder, or a cone for a shaft with a taper; lengths in
/// mm.
///
/// ```
/// use facemill_sample_parts::{Bore, SpecError};
///
/// let taper = Bore::taper(90.0, 120.0)?;
/// assert_eq!(taper.radii(), [90.0, 120.0]);
/// # Ok::<(), SpecError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bore {
    aft_radius: f64,
    ahead_radius: f64,
}

/// Least and largest radius of a bore over the hub radius: the flat ends of a hub begin at 0.75.
const RANGE: [f64; 2] = [0.02, 0.7];

impl Bore {
    /// Returns a cylindrical bore.
    ///
    /// # Errors
    /// When the radius is not above 0; [`crate::propeller_solid`] has closer limits.
    pub fn cylinder(radius: f64) -> Result<Self, SpecError> {
        Self::taper(radius, radius)
    }

    /// Returns a conical bore by its radii at both ends of the hub: at its lower end in z, aft, and
    /// its upper one, ahead.
    ///
    /// # Errors
    /// When a radius is not above 0 and finite.
    pub fn taper(aft_radius: f64, ahead_radius: f64) -> Result<Self, SpecError> {
        in_range("bore radius aft", aft_radius, f64::MIN_POSITIVE, f64::MAX)?;
        in_range("bore radius ahead", ahead_radius, f64::MIN_POSITIVE, f64::MAX)?;
        Ok(Self { aft_radius, ahead_radius })
    }

    /// Returns the radii at the lower and at the upper end in z.
    pub fn radii(&self) -> [f64; 2] {
        [self.aft_radius, self.ahead_radius]
    }

    /// Refuses a bore that a hub has no room for, or that is too thin for it.
    pub(crate) fn check(&self, hub_radius: f64) -> Result<(), SpecError> {
        for (field, radius) in [("bore radius aft", self.aft_radius), ("bore radius ahead", self.ahead_radius)] {
            in_range(field, radius, RANGE[0] * hub_radius, RANGE[1] * hub_radius)?;
        }
        Ok(())
    }
}
