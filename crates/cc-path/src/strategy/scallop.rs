//! Constant scallop: fronts from seeds.

use std::fmt;

use nalgebra::{Point3, Unit, Vector3};

use crate::sections::Sections;

/// Passes are fronts that advance from their seeds by the local strip width, so that the cusp
/// between them is the same everywhere; the level is the distance from the seed, summed up from
/// front to front, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstantScallop {
    /// Where fronts begin: one, or two that meet.
    pub seeds: Vec<Seed>,
    /// Sections between whose ends the passes lie; the region alone bounds them where there are
    /// none.
    pub within: Option<Sections>,
}

/// Where fronts begin.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Seed {
    /// The whole border of the region: the first passes lie half a strip inside.
    Border,
    /// The border of the region with a group of the mesh, or that of a group inside the region; the
    /// first passes lie half a strip beside it.
    GroupBorder(String),
    /// A polyline on the surface, which is a pass; closed where the last point is the first.
    Curve(Vec<Point3<f64>>),
    /// The section by a plane, which is a pass.
    Plane {
        /// Point of the plane, workpiece frame.
        origin: Point3<f64>,
        /// Its normal; which of its two senses does not matter.
        normal: Unit<Vector3<f64>>,
    },
    /// The section by a cylinder, which is a pass.
    Cylinder {
        /// Point of the axis, workpiece frame.
        axis_origin: Point3<f64>,
        /// Direction of the axis; which of its two senses does not matter.
        axis_direction: Unit<Vector3<f64>>,
        /// Radius, mm.
        radius: f64,
    },
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Border => write!(f, "on the border of the region"),
            Self::GroupBorder(name) => write!(f, "on the border with group \"{name}\""),
            Self::Curve(points) => write!(f, "of {} points", points.len()),
            Self::Plane { origin, .. } => write!(f, "on the plane through {:?}", <[f64; 3]>::from(origin.coords)),
            Self::Cylinder { radius, .. } => write!(f, "on the cylinder of radius {radius} mm"),
        }
    }
}
