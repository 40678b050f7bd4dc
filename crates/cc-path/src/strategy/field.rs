//! Strategies whose levels are those of a field on the surface.

use nalgebra::{Point3, Unit, Vector3};

use crate::error::PathError;
use crate::sections::Sections;
use crate::strategy::settings::require;

/// Passes morph from one border of the region to another: they are level curves of the harmonic
/// function that is 0 on the one and 1 on the other, and run into all other borders at right
/// angles.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Border with the lowest level.
    pub from: FlowEnd,
    /// Border with the highest level.
    pub to: FlowEnd,
    /// How far a border may be from what names it, mm, above 0.
    pub within: f64,
}

/// Names a part of a region's border: all of it that lies within a distance of something.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FlowEnd {
    /// A mesh group beside the region.
    Group(String),
    /// A polyline, workpiece frame.
    Curve(Vec<Point3<f64>>),
    /// A plane.
    Plane {
        /// Point of the plane, workpiece frame.
        origin: Point3<f64>,
        /// Normal of the plane.
        normal: Unit<Vector3<f64>>,
    },
    /// A cylinder.
    Cylinder {
        /// Point of the axis, workpiece frame.
        axis_origin: Point3<f64>,
        /// Direction of the axis.
        axis_direction: Unit<Vector3<f64>>,
        /// Radius, mm.
        radius: f64,
    },
}

/// One pass winds around a tube, a boss or a cap, from its first closed level to its last.
#[derive(Clone, Debug, PartialEq)]
pub struct Spiral {
    /// Levels that the pass rises over, a step for each turn.
    pub levels: SpiralLevels,
}

/// Levels of a spiral: closed curves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SpiralLevels {
    /// Sections.
    Sections(Sections),
    /// Levels of a flow between two closed borders.
    Flow(Flow),
}

/// Most points of a curve that names a border: each is compared with each edge of the border.
pub(crate) const MAX_CURVE_POINTS: usize = 10_000;

impl Flow {
    /// # Errors
    /// When a number is not in its range.
    pub(crate) fn check(&self) -> Result<(), PathError> {
        let within = self.within;
        require("flow.within", within, "finite and above 0", within.is_finite() && within > 0.0)?;
        self.from.check("points of flow.from.curve", "flow.from.cylinder.radius")?;
        self.to.check("points of flow.to.curve", "flow.to.cylinder.radius")
    }
}

impl FlowEnd {
    fn check(&self, points: &'static str, radius_name: &'static str) -> Result<(), PathError> {
        match self {
            Self::Curve(curve) => {
                let n = curve.len();
                require(points, n as f64, "from 2 to 10,000", (2..=MAX_CURVE_POINTS).contains(&n))?;
                let is_finite = curve.iter().all(|p| p.coords.iter().all(|c| c.is_finite()));
                require(points, f64::NAN, "finite", is_finite)
            }
            Self::Cylinder { radius, .. } => {
                require(radius_name, *radius, "finite and not below 0", radius.is_finite() && *radius >= 0.0)
            }
            Self::Group(_) | Self::Plane { .. } => Ok(()),
        }
    }
}
