//! Root fillets with edges as large as they can be.

use crate::propeller::blade::BladeResolution;
use crate::propeller::blade_grid::BladeGrid;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::spec::PropellerSpec;
use crate::propeller_solid::contact_loop::ContactLoop;
use crate::propeller_solid::contour::Contour;
use crate::propeller_solid::root_fillet::{FilletStation, RootFillet};
use crate::propeller_solid::solid::check_radii;
use crate::spec_error::SpecError;

/// Chord fractions between which a fitted fillet has its whole radius.
const WHOLE: [f64; 2] = [0.25, 0.75];

/// Factor by which an edge's radius is made smaller until nothing folds, and once more, since finer
/// meshes find folds that coarser ones miss.
const STEP: f64 = 0.85;

/// Most steps of both edges together: then an edge has a hundredth of the radius.
const MOST_STEPS: usize = 56;

/// Chord tolerance of the balls that are tried over the fillet's radius.
const TOLERANCE: f64 = 2e-3;

impl RootFillet {
    /// Returns the fillet of a radius in mm from 0.25 to 0.75 of the chord that gets smaller toward
    /// the edges only as far as it must so as not to fold: an edge that leans over the hub takes
    /// but a small ball.
    ///
    /// A search by steps of 15 %, up to two of them too far. Whether neighbouring blades leave room
    /// is for [`crate::propeller_solid`] to say.
    ///
    /// ```
    /// use facemill_sample_parts::{BladeSide, PropellerSeries, PropellerSpec, RootFillet, SpecError};
    ///
    /// let spec = PropellerSpec::new(PropellerSeries::Vp1304, 250.0)?;
    /// let fillet = RootFillet::fitted(&spec, 5.0)?;
    /// let at = |x| fillet.radius(BladeSide::Suction, x);
    /// assert!((at(0.5) - 5.0).abs() < 1e-9 && at(0.0) < 3.0);
    /// # Ok::<(), SpecError>(())
    /// ```
    ///
    /// # Errors
    /// When the radius is out of the range of [`crate::propeller_solid`], or the fillet folds
    /// whatever the radii at the edges are, or they would be below a range.
    pub fn fitted(spec: &PropellerSpec, radius: f64) -> Result<Self, SpecError> {
        let surface = BladeSurface::new(spec);
        let grid = BladeGrid::new(&surface, BladeResolution::default());
        let contour = Contour::new(&surface);
        let mut shares = [1.0, 1.0];
        for _ in 0..MOST_STEPS {
            let fillet = with_edges(radius, shares)?;
            check_radii(&surface, &fillet)?;
            let balls = ContactLoop::new(&contour, &fillet, &grid.fractions, TOLERANCE * radius);
            match balls.and_then(|balls| balls.check_folds()) {
                Ok(()) => {
                    let shares = shares.map(|share: f64| if share < 1.0 { share * STEP } else { share });
                    let fillet = with_edges(radius, shares)?;
                    check_radii(&surface, &fillet)?;
                    return Ok(fillet);
                }
                Err(SpecError::Fillet { chord_fraction, .. }) if !(WHOLE[0]..=WHOLE[1]).contains(&chord_fraction) => {
                    shares[usize::from(chord_fraction > 0.5)] *= STEP;
                }
                Err(fault) => return Err(fault),
            }
        }
        Err(SpecError::Fillet {
            side: "suction",
            chord_fraction: if shares[0] < shares[1] { 0.0 } else { 1.0 },
            message: format!("the fillet folds whatever its radius at this edge is; make that of {radius} mm smaller"),
        })
    }
}

/// Returns a fillet with shares of its radius at the leading and at the trailing edge.
fn with_edges(radius: f64, [leading, trailing]: [f64; 2]) -> Result<RootFillet, SpecError> {
    let at = |chord_fraction, radius| FilletStation { chord_fraction, suction: radius, pressure: radius };
    RootFillet::varying(&[
        at(0.0, leading * radius),
        at(WHOLE[0], radius),
        at(WHOLE[1], radius),
        at(1.0, trailing * radius),
    ])
}
