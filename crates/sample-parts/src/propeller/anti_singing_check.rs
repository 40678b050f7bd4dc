//! Propellers with anti-singing edges: whether their sections have room for them.

use crate::propeller::anti_singing::{AntiSingingEdge, RUN_OUT};
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::spec::PropellerSpec;
use crate::spec_error::{SpecError, in_range, is_not_above};

impl PropellerSpec {
    /// Returns the propeller with an anti-singing trailing edge on each blade.
    ///
    /// # Errors
    /// When the chamfer begins inside the hub, or does not meet the suction side within a fifth of
    /// the chord, or leaves no thickness: the angle is then too flat for the section, or the
    /// trailing edge has no thickness. Tested on 64 sections.
    pub fn with_anti_singing_edge(self, edge: AntiSingingEdge) -> Result<Self, SpecError> {
        const SECTIONS: u32 = 64;
        let (surface, radius) = (BladeSurface::new(&self), 0.5 * self.diameter());
        let least = self.hub_radius() / radius + RUN_OUT;
        let [from, to] = edge.range();
        in_range("radius r/R where the anti-singing edge begins", from, least, 1.0)?;
        for k in 0..=SECTIONS {
            let radius_ratio = from + (to - from) * f64::from(k) / f64::from(SECTIONS);
            let section = surface.uncut_section(radius_ratio * radius);
            let wrong = |what: &str| {
                let message = format!("the chamfer of the anti-singing edge {what}; change its angle or its range");
                Err(SpecError::Shape { radius_ratio, message })
            };
            let Some(chamfer) = surface.chamfer_of(&edge, &section) else {
                return wrong("does not meet the suction side within a fifth of the chord");
            };
            let is_thin = |part: u32| {
                let from_end = chamfer.length * f64::from(part) / 32.0;
                let x = 1.0 - from_end;
                let low = section.mean_height(x) - section.half_thickness(x);
                is_not_above(chamfer.end + chamfer.rise * from_end - low, 0.0)
            };
            if (1..=32).any(is_thin) {
                return wrong("leaves no thickness");
            }
        }
        Ok(self.with_checked_edge(edge))
    }
}
