use std::f64::consts::FRAC_PI_2;

use crate::pass::error::PassError;
use crate::pass::{Beside, CutterEnd, Engagement, PassSection};
use crate::section::tool_section::PARALLEL;

impl Beside {
    /// Returns the distance that defines it, with its name.
    fn distance(&self, [step_over, border]: [&'static str; 2]) -> Option<(&'static str, f64)> {
        match *self {
            Self::Stock => None,
            Self::Cut { step_over: length } => Some((step_over, length)),
            Self::Border { distance } => Some((border, distance)),
        }
    }
}

impl Engagement {
    /// Returns the distances to both sides, with the paths of their fields.
    pub(crate) fn distances(&self) -> [Option<(&'static str, f64)>; 2] {
        [
            self.left.distance(["engagement.left.step_over", "engagement.left.distance"]),
            self.right.distance(["engagement.right.step_over", "engagement.right.distance"]),
        ]
    }
}

/// Returns the fields of a section with their values; absent ones have a valid value.
fn fields(section: &PassSection) -> [(&'static str, f64, Rule); 8] {
    let PassSection { cutter, surface, engagement, orientation, .. } = section;
    let [(left, to_left), (right, to_right)] = engagement.distances().map(|distance| distance.unwrap_or(("", 0.0)));
    [
        ("cutter.radius", cutter.radius, Rule::Positive),
        ("cutter.corner_radius", cutter.corner_radius, Rule::NotNegative),
        ("surface.radius", surface.radius().unwrap_or(1.0), Rule::Positive),
        ("engagement.depth_of_cut", engagement.depth_of_cut, Rule::NotNegative),
        (left, to_left, Rule::NotNegative),
        (right, to_right, Rule::NotNegative),
        ("orientation.lead", orientation.lead, Rule::Acute),
        ("orientation.lean", orientation.lean, Rule::Acute),
    ]
}

/// Rule of a value.
#[derive(Clone, Copy)]
enum Rule {
    Positive,
    NotNegative,
    /// An angle between −90° and 90°.
    Acute,
}

/// Returns whether a length is beyond the limits where the squares of lengths run out of digits.
fn is_out_of_range(field: &str, value: f64) -> bool {
    const LARGEST: f64 = 1e7;
    const LARGEST_SURFACE: f64 = 1e15;
    const LEAST_RADIUS: f64 = 1e-6;
    match field {
        "surface.radius" => !(LEAST_RADIUS..=LARGEST_SURFACE).contains(&value),
        "cutter.radius" => !(LEAST_RADIUS..=LARGEST).contains(&value),
        _ => value > LARGEST,
    }
}

/// Checks that every value is in its range, without testing the cutter in its place.
pub(crate) fn check_values(section: &PassSection) -> Result<(), PassError> {
    for (field, value, rule) in fields(section) {
        match rule {
            _ if !value.is_finite() => return Err(PassError::NotFinite { field, value }),
            Rule::Positive if value <= 0.0 => return Err(PassError::NotPositive { field, value }),
            Rule::NotNegative if value < 0.0 => return Err(PassError::Negative { field, value }),
            Rule::Positive | Rule::NotNegative if is_out_of_range(field, value) => {
                return Err(PassError::OutOfRange { field, value });
            }
            Rule::Acute if value.abs() >= FRAC_PI_2 - PARALLEL => {
                return Err(PassError::AxisNotAbove { field, value });
            }
            _ => {}
        }
    }
    let PassSection { cutter, surface, engagement, .. } = section;
    let CutterEnd { radius, corner_radius } = *cutter;
    if corner_radius > radius {
        return Err(PassError::CornerTooLarge { corner_radius, radius });
    }
    let Some(surface_radius) = surface.radius() else { return Ok(()) };
    if surface.curvature() < 0.0 {
        let depth_of_cut = engagement.depth_of_cut;
        if corner_radius >= surface_radius {
            return Err(PassError::CornerDoesNotFit { corner_radius, surface_radius });
        }
        if depth_of_cut >= surface_radius {
            return Err(PassError::DepthReachesCentre { depth_of_cut, surface_radius });
        }
    }
    match engagement.distances().into_iter().flatten().find(|(_, value)| *value >= FRAC_PI_2 * surface_radius) {
        Some((field, value)) => Err(PassError::TooFarAround { field, value, surface_radius }),
        None => Ok(()),
    }
}
