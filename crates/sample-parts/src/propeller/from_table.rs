//! Propellers by tables: what their numbers describe together.

use crate::propeller::blade_grid::ROOT_DEPTH;
use crate::propeller::blade_section::BladeSection;
use crate::propeller::blade_surface::BladeSurface;
use crate::propeller::hub::least_hub_length;
use crate::propeller::spec::{PropellerSpec, check_diameter};
use crate::propeller::table::PropellerTable;
use crate::spec_error::{SpecError, in_range, is_not_above};

/// Largest share of the radius over which the tip may be rounded: a thicker tip is no tip.
const MOST_TIP_ROUNDING: f64 = 0.1;

impl PropellerSpec {
    /// A propeller by a radial table with `diameter` in mm, 1 to 20,000.
    ///
    /// The series with tables are such propellers: the same table gives the same mesh
    /// ([`crate::PropellerSeries::table`]).
    ///
    /// # Errors
    /// When a number of the table is out of its range, with its row, or when the blade that the
    /// numbers describe has no chord, pitch or thickness somewhere, also at its root inside the
    /// hub, wraps around the hub or does not fit the hub's length. The blade is tested on 128
    /// sections outside the hub and 16 inside.
    pub fn from_table(table: PropellerTable, diameter: f64) -> Result<Self, SpecError> {
        check_diameter(diameter)?;
        table.check()?;
        let hub_length = table.hub_length_ratio.map(|ratio| ratio * diameter);
        let spec = Self::of_checked(table, diameter);
        let surface = BladeSurface::new(&spec);
        check_shape(&surface)?;
        check_root(&surface)?;
        if let Some(length) = hub_length {
            let least = least_hub_length(&spec);
            in_range("hub length", length, least, f64::max(least, 5.0 * diameter))?;
        }
        Ok(spec)
    }
}

/// Refuses blades that are none, though each number of their table is in range.
fn check_shape(surface: &BladeSurface) -> Result<(), SpecError> {
    const SECTIONS: u32 = 128;
    let radius = 0.5 * surface.spec().diameter();
    let hub = surface.spec().hub_radius() / radius;
    let rounding = surface.tip_rounding_ratio();
    let wrong = |radius_ratio: f64, message: String| Err(SpecError::Shape { radius_ratio, message });
    if is_not_above(rounding, 0.0) || rounding > MOST_TIP_ROUNDING.min(0.5 * (1.0 - hub)) {
        let message = format!(
            "the tip is {rounding:.4} D thick; give the last row a thickness and a chord that make it thinner than \
             {MOST_TIP_ROUNDING} D and thicker than 0"
        );
        return wrong(1.0, message);
    }
    for k in 0..=SECTIONS {
        let ratio = hub + (1.0 - hub) * f64::from(k) / f64::from(SECTIONS);
        let section = surface.section(ratio * radius);
        let around = section.chord() * section.pitch_angle().cos() / section.radius();
        if is_not_above(section.chord(), 0.0) || is_not_above(section.pitch(), 0.0) {
            return wrong(ratio, "chord or pitch is not above 0 between the rows; add rows here".to_owned());
        }
        if around >= std::f64::consts::TAU {
            return wrong(ratio, "the chord goes more than once around the hub; correct it".to_owned());
        }
        if k == SECTIONS {
            break;
        }
        if let Some(x) = thin_station(&section) {
            let message = format!("the thickness is not above 0 at x/c {x:.3} between the given places; add some here");
            return wrong(ratio, message);
        }
    }
    Ok(())
}

/// Chord fraction between the edges at which a section has no thickness.
fn thin_station(section: &BladeSection<'_>) -> Option<f64> {
    const STATIONS: u32 = 64;
    let mut stations = (1..STATIONS).map(|j| f64::from(j) / f64::from(STATIONS));
    stations.find(|x| is_not_above(section.half_thickness(*x), 0.0))
}

/// Refuses blades whose root inside the hub is none: below the innermost row all goes on straight.
fn check_root(surface: &BladeSurface) -> Result<(), SpecError> {
    const SECTIONS: u32 = 16;
    let radius = 0.5 * surface.spec().diameter();
    let hub = surface.spec().hub_radius() / radius;
    for k in 0..SECTIONS {
        let ratio = hub * (1.0 - ROOT_DEPTH * (1.0 - f64::from(k) / f64::from(SECTIONS)));
        let section = surface.section(ratio * radius);
        let lengths = [section.chord(), section.pitch()];
        if lengths.into_iter().any(|length| is_not_above(length, 0.0)) || thin_station(&section).is_some() {
            let message = format!(
                "chord, pitch or thickness is not above 0 inside the hub, where the blade begins at r/R {:.4}; add a \
                 row below the hub",
                hub * (1.0 - ROOT_DEPTH)
            );
            return Err(SpecError::Shape { radius_ratio: ratio, message });
        }
    }
    Ok(())
}
