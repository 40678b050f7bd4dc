//! Sections of a cutter: area of the chip in them.

pub(crate) mod elliptic;
pub(crate) mod error;
pub(crate) mod level_curve;
pub(crate) mod quadrature;
pub(crate) mod rim;
pub(crate) mod slab;
pub(crate) mod tool_section;
pub(crate) mod turned;

use nalgebra::{Point2, Vector2};

use crate::section::error::{ChipAreaError, Position};
use crate::section::rim::Rim;
use crate::section::slab::{Cut, Layer};
use crate::section::tool_section::{Contact, PARALLEL, ToolSection};

/// The cutter in the section: above its bottom it continues without end along the axis as flute.
///
/// Exhaustive, so that a new one is handled everywhere: each has its own closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SectionCutter {
    /// Flat end, sharp corner; the corner touches the surface.
    Flat {
        /// Radius of the cutter, mm.
        radius: f64,
    },
    /// Ball end.
    Ball {
        /// Radius of the cutter and its ball, mm.
        radius: f64,
    },
}

/// The part's surface in the section.
///
/// Exhaustive, so that a new one is handled everywhere: each has its own closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SectionSurface {
    /// Straight line.
    Plane,
    /// Circle seen from outside.
    Convex {
        /// Radius of the surface (r1), mm.
        radius: f64,
    },
    /// Circle seen from inside.
    Concave {
        /// Radius of the surface (r1), mm.
        radius: f64,
    },
}

/// Sense of the step from the first position to the second, about the origin of the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSign {
    /// Counter-clockwise: the polar angle grows.
    Positive,
    /// Clockwise.
    Negative,
}

/// Section across the feed through two neighbouring positions of a cutter, with the tool axis in
/// the section plane (CHIP, figs. 1 to 3).
///
/// Section plane: x to the right, y up; the surface is a circle about the origin. Lengths are mm,
/// angles rad. On a plane only the directions count: its outward normal is at the polar angle
/// `alpha0`, and the positive step is a quarter turn counter-clockwise from it, which is the limit
/// of a convex surface of growing radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipSection {
    /// Cutter, radius r2.
    pub cutter: SectionCutter,
    /// Surface, radius r1.
    pub surface: SectionSurface,
    /// Thickness of the stock over the surface, along its normal (ta).
    pub depth_of_cut: f64,
    /// Length of the step along the surface (lf): an arc of the angle lf / r1 (CHIP (1)).
    pub step_over: f64,
    /// Sense of the step.
    pub step_sign: StepSign,
    /// Polar angle of the first CC point (α), on a plane of its normal.
    pub alpha0: f64,
    /// Lean of the tool axis from +y toward +x; the paper's tilt θt with the opposite sign.
    pub lean: f64,
}

/// Returns the area of the chip between two neighbouring positions, mm²: the stock inside the
/// cutter at the second position and not inside the cutter at the first (CHIP (2) to (9)).
///
/// Only the piece of stock that touches the second CC point counts; a flute that meets the far side
/// of a concave surface cuts nothing here. Flute contact (the paper's fig. 3, ta > tmax) needs no
/// case of its own: the flute is part of the outline.
///
/// Closed form up to rounding: the outlines are circles and lines, and between their crossings the
/// chip is bounded by one arc from below and one from above, whose integrals are elementary. Of the
/// ten printed values, seven agree within the print's 4e-4, the agreement of the paper's own
/// comparison. Three do not: the untilted convex ball (exact 2.0909 at the 45° of the paper's table
/// 1; the printed 1.9863 is the area at 25°), the tilted concave flat (exact 1.8217, printed
/// 1.8247) and the tilted concave ball (exact 2.3684, printed 2.4444). The cause of the last two is
/// not known; the exact area is returned.
///
/// Limits: 0 for a depth of cut or a step of 0; a plane is the limit of both curved surfaces.
///
/// # Errors
/// When a value is not finite or out of its range, or the section has an impossible cutter
/// position: see [`ChipAreaError`].
pub fn chip_area(section: &ChipSection) -> Result<f64, ChipAreaError> {
    check_values(section)?;
    let placed = TurnedSection::new(section);
    let tools = placed.tools()?;
    for ((tool, contact), position) in tools.iter().zip(&placed.contacts).zip([Position::First, Position::Second]) {
        if placed.layer.is_gouged_by(tool, contact.point) {
            return Err(ChipAreaError::BelowSurface { position });
        }
    }
    if section.depth_of_cut == 0.0 || section.step_over == 0.0 {
        return Ok(0.0);
    }
    let cut = Cut {
        layer: &placed.layer,
        tool: &tools[1],
        borders: [None; 2],
        before: [Some(tools[0]), None],
        seed: placed.contacts[1].point,
    };
    Ok(cut.area())
}

impl SectionCutter {
    fn radius(&self) -> f64 {
        match *self {
            Self::Flat { radius } | Self::Ball { radius } => radius,
        }
    }
}

impl SectionSurface {
    /// > 0 convex, < 0 concave.
    pub(crate) fn curvature(&self) -> f64 {
        match *self {
            Self::Plane => 0.0,
            Self::Convex { radius } => 1.0 / radius,
            Self::Concave { radius } => -1.0 / radius,
        }
    }

    pub(crate) fn radius(&self) -> Option<f64> {
        match *self {
            Self::Plane => None,
            Self::Convex { radius } | Self::Concave { radius } => Some(radius),
        }
    }
}

fn check_values(section: &ChipSection) -> Result<(), ChipAreaError> {
    let (cutter_radius, surface_radius) = (section.cutter.radius(), section.surface.radius());
    let radii = [("cutter.radius", cutter_radius), ("surface.radius", surface_radius.unwrap_or(1.0))];
    let lengths = [("depth_of_cut", section.depth_of_cut), ("step_over", section.step_over)];
    let angles = [("alpha0", section.alpha0), ("lean", section.lean)];
    if let Some(&(field, _)) = radii.iter().chain(&lengths).chain(&angles).find(|(_, v)| !v.is_finite()) {
        return Err(ChipAreaError::NotFinite { field });
    }
    if let Some(&(field, value)) = radii.iter().find(|(_, v)| *v <= 0.0) {
        return Err(ChipAreaError::NotPositive { field, value });
    }
    if let Some(&(field, value)) = lengths.iter().find(|(_, v)| *v < 0.0) {
        return Err(ChipAreaError::Negative { field, value });
    }
    let (depth_of_cut, step_over) = (section.depth_of_cut, section.step_over);
    if let SectionSurface::Concave { radius: surface_radius } = section.surface {
        if matches!(section.cutter, SectionCutter::Ball { .. }) && cutter_radius >= surface_radius {
            return Err(ChipAreaError::BallTooLarge { cutter_radius, surface_radius });
        }
        if depth_of_cut >= surface_radius {
            return Err(ChipAreaError::DepthReachesCentre { depth_of_cut, surface_radius });
        }
    }
    match surface_radius {
        Some(surface_radius) if step_over >= std::f64::consts::PI * surface_radius => {
            Err(ChipAreaError::StepTooLong { step_over, surface_radius })
        }
        _ => Ok(()),
    }
}

/// The section in the tool's frame: origin at the first CC point, y along the axis.
struct TurnedSection {
    cutter: SectionCutter,
    layer: Layer,
    contacts: [Contact; 2],
    /// Whether the step leads toward +x at the first position.
    steps_right: bool,
}

impl TurnedSection {
    fn new(section: &ChipSection) -> Self {
        let curvature = section.surface.curvature();
        let sense = if section.step_sign == StepSign::Positive { 1.0 } else { -1.0 };
        // Polar angle of a direction of the section plane, as seen along the tool axis.
        let turned = section.alpha0 + section.lean;
        let radial = Vector2::new(turned.cos(), turned.sin());
        let normal = if curvature < 0.0 { -radial } else { radial };
        let tangent = Vector2::new(-radial.y, radial.x) * sense;
        let first = Contact { point: Point2::origin(), normal };
        Self {
            cutter: section.cutter,
            layer: Layer::new(curvature, normal, section.depth_of_cut),
            contacts: [first, first.stepped(curvature, tangent, section.step_over)],
            steps_right: tangent.x > 0.0,
        }
    }

    fn tools(&self) -> Result<[ToolSection; 2], ChipAreaError> {
        let below = |position| Err(ChipAreaError::BelowSurface { position });
        if self.layer.curvature == 0.0 && self.contacts[0].normal.y.abs() <= PARALLEL {
            return Err(ChipAreaError::AxisInPlane);
        }
        if self.contacts[0].normal.y < -PARALLEL {
            return below(Position::First);
        }
        if self.contacts[1].normal.y < -PARALLEL {
            return below(Position::Second);
        }
        let (rim, side) = match self.cutter {
            SectionCutter::Ball { radius } => (Rim { rim: 0.0, corner: radius, squash: 0.0 }, 0.0),
            SectionCutter::Flat { radius } => {
                let side = if self.left_corner_touches()? { 1.0 } else { -1.0 };
                (Rim { rim: radius, corner: 0.0, squash: 0.0 }, side)
            }
        };
        Ok(self.contacts.map(|contact| ToolSection::touching(rim, &contact, side)))
    }

    /// Returns whether the left corner touches: the bottom rises from the corner in contact. Where
    /// it is parallel to the surface the other position decides, and where it is at both, the
    /// corner that leads the step.
    fn left_corner_touches(&self) -> Result<bool, ChipAreaError> {
        let rises_right = self.contacts.map(|c| c.normal.x);
        match rises_right.map(|x| if x.abs() <= PARALLEL { 0.0 } else { x.signum() }) {
            [0.0, 0.0] => Ok(!self.steps_right),
            [first, second] if first * second < 0.0 => Err(ChipAreaError::CornerChanges),
            [first, second] => Ok(first + second > 0.0),
        }
    }
}
