//! Ball that touches blade and hub.

use nalgebra::{Point3, Vector3};

use crate::propeller::blade_section::BladeSide;
use crate::propeller_solid::contour::Contour;
use crate::propeller_solid::root_fillet::{RootFillet, place_of};
use crate::spec_error::SpecError;

/// Ball of a root fillet in one place: it touches the blade and the hub's cylinder from outside.
///
/// Lengths in mm, in the frame of [`crate::blade`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FilletContact {
    /// Side of the blade that it touches.
    pub side: BladeSide,
    /// Chord fraction from the leading edge where it touches the blade.
    pub chord_fraction: f64,
    /// Radius of the ball.
    pub radius: f64,
    /// Centre of the ball.
    pub centre: Point3<f64>,
    /// Point where it touches the blade.
    pub on_blade: Point3<f64>,
    /// Point where it touches the hub.
    pub on_hub: Point3<f64>,
}

/// Least and largest angle of a fillet's arc, rad: below it blade and hub are one smooth surface,
/// above it they lie on each other, and the plane of the arc is not determined.
const ARC_RANGE: [f64; 2] = [1e-3, 3.0];

/// Most steps of the search for a centre; it takes about eight.
const MOST_STEPS: usize = 100;

/// Returns the ball that touches the blade at a contour angle, right-handed.
///
/// A ball that touches the blade at radius ρ has its centre on the normal there. Its distance from
/// the hub less its own radius grows from ≤ 0 at ρ = hub radius to ≥ 0 two ball radii outside, so
/// there is a root between; the search keeps it between two radii.
pub(crate) fn ball_at(contour: &Contour<'_>, fillet: &RootFillet, angle: f64) -> Result<FilletContact, SpecError> {
    let hub_radius = contour.surface().spec().hub_radius();
    let radius = fillet.at(angle);
    let touching = |blade_radius: f64| {
        let (on_blade, normal) = contour.point_and_normal(angle, blade_radius);
        let normal = normal.ok_or_else(|| fault(angle, "the edge is sharp; give it a thickness".to_owned()))?;
        Ok::<_, SpecError>((on_blade, on_blade + normal.into_inner() * radius))
    };
    let off = |blade_radius: f64| {
        let (_, centre) = touching(blade_radius)?;
        Ok(centre.x.hypot(centre.y) - (hub_radius + radius))
    };
    let (on_blade, centre) = touching(root(off, [hub_radius, hub_radius + 2.0 * radius], 1e-11 * hub_radius)?)?;
    let out = Vector3::new(centre.x, centre.y, 0.0).normalize();
    let on_hub = Point3::new(hub_radius * out.x, hub_radius * out.y, centre.z);
    let (side, chord_fraction) = place_of(angle);
    let contact = FilletContact { side, chord_fraction, radius, centre, on_blade, on_hub };
    let arc = contact.arc_angle();
    if arc > ARC_RANGE[0] && arc < ARC_RANGE[1] {
        Ok(contact)
    } else {
        let degrees = 180.0 - arc.to_degrees();
        Err(fault(angle, format!("blade and hub meet at {degrees:.1}°, which leaves no room for a ball")))
    }
}

/// Returns a root of a function that is ≤ 0 at the lower end and ≥ 0 at the upper one, to where the
/// function or the rest of the range is below `enough`.
///
/// Illinois' method: secants, with the value of an end that stays twice halved.
fn root<E>(of: impl Fn(f64) -> Result<f64, E>, [mut low, mut high]: [f64; 2], enough: f64) -> Result<f64, E> {
    let (mut at_low, mut at_high) = (of(low)?, of(high)?);
    let (mut middle, mut was_low) = (low, None);
    for _ in 0..MOST_STEPS {
        let share = at_low / (at_low - at_high);
        middle = if share.is_finite() { low + (high - low) * share } else { low };
        let value = of(middle)?;
        if value.abs() <= enough || high - low <= enough {
            break;
        }
        let is_low = value < 0.0;
        let staying = if is_low { &mut at_high } else { &mut at_low };
        if was_low == Some(is_low) {
            *staying *= 0.5;
        }
        was_low = Some(is_low);
        if is_low {
            (low, at_low) = (middle, value);
        } else {
            (high, at_high) = (middle, value);
        }
    }
    Ok(middle)
}

/// Fault of a fillet at a contour angle.
pub(crate) fn fault(angle: f64, message: String) -> SpecError {
    let (side, chord_fraction) = place_of(angle);
    let side = match side {
        BladeSide::Suction => "suction",
        BladeSide::Pressure => "pressure",
    };
    SpecError::Fillet { side, chord_fraction, message }
}

impl FilletContact {
    /// Returns the angle of the arc from blade to hub, rad.
    pub fn arc_angle(&self) -> f64 {
        let [to_blade, to_hub] = [self.on_blade, self.on_hub].map(|p| p - self.centre);
        to_blade.cross(&to_hub).norm().atan2(to_blade.dot(&to_hub))
    }

    /// Returns the point of the fillet at a share of its arc, 0 on the blade and 1 on the hub.
    pub fn on_arc(&self, share: f64) -> Point3<f64> {
        let to_blade = self.on_blade - self.centre;
        let along = to_blade.cross(&(self.on_hub - self.centre)).cross(&to_blade).normalize() * self.radius;
        let (sin, cos) = (share * self.arc_angle()).sin_cos();
        self.centre + to_blade * cos + along * sin
    }

    /// Returns the ball of the mirror image in the plane y = 0.
    pub(crate) fn mirrored(self) -> Self {
        let [centre, on_blade, on_hub] = [self.centre, self.on_blade, self.on_hub].map(|p| Point3::new(p.x, -p.y, p.z));
        Self { centre, on_blade, on_hub, ..self }
    }
}
