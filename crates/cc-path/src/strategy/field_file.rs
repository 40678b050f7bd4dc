use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::PathError;
use crate::sections::Sections;
use crate::strategy::field::{Flow, FlowEnd, Spiral, SpiralLevels};
use crate::strategy::file::{CylindricalSectionsFile, ParallelPlanesFile, unit};

/// Passes that morph from one border of the region to another, spaced by strip widths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowFile {
    /// Border of the first level.
    pub from: FlowEndFile,
    /// Border of the last level.
    pub to: FlowEndFile,
    /// How far a border may be from the group, curve, plane or cylinder that names it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[serde(default = "default_within_mm")]
    pub within_mm: f64,
}

/// How far a border may be from what names it, by default, mm.
pub(crate) const WITHIN_MM: f64 = 0.05;

fn default_within_mm() -> f64 {
    WITHIN_MM
}

/// Part of the region's border: all of it that lies at a mesh group, on a curve, in a plane or on a
/// cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FlowEndFile {
    /// Name of a mesh group that the region borders on.
    Group(String),
    /// Polyline along the border.
    Curve(FlowCurveFile),
    /// Plane that the border lies in.
    Plane(FlowPlaneFile),
    /// Cylinder that the border lies on.
    Cylinder(FlowCylinderFile),
}

/// Polyline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowCurveFile {
    /// Its points, workpiece frame; of a closed one, the last is the first again.
    #[schemars(length(min = 2, max = 10000))]
    pub points_mm: Vec<[f64; 3]>,
}

/// Plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowPlaneFile {
    /// Point of the plane, workpiece frame.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// Normal of the plane, workpiece frame; of any length above 0.
    pub normal: [f64; 3],
}

/// Cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowCylinderFile {
    /// Point of the axis, workpiece frame.
    #[serde(default)]
    pub axis_origin_mm: [f64; 3],
    /// Direction of the axis; of any length above 0.
    pub axis_direction: [f64; 3],
    /// Radius.
    #[schemars(range(min = 0))]
    pub radius_mm: f64,
}

/// Levels of a spiral; each has to be one closed curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SpiralFile {
    /// Sections by parallel planes.
    ParallelPlanes(ParallelPlanesFile),
    /// Sections by coaxial cylinders.
    CylindricalSections(CylindricalSectionsFile),
    /// Levels of a flow between two closed borders.
    Flow(FlowFile),
}

impl FlowFile {
    pub(crate) fn to_flow(&self) -> Result<Flow, PathError> {
        let names = |end: &'static str| match end {
            "from" => ["length of flow.from.plane.normal", "length of flow.from.cylinder.axis_direction"],
            _ => ["length of flow.to.plane.normal", "length of flow.to.cylinder.axis_direction"],
        };
        let (from, to) = (self.from.to_end(names("from"))?, self.to.to_end(names("to"))?);
        let flow = Flow { from, to, within: self.within_mm };
        flow.check()?;
        Ok(flow)
    }
}

impl FlowEndFile {
    fn to_end(&self, [normal, axis]: [&'static str; 2]) -> Result<FlowEnd, PathError> {
        Ok(match self {
            Self::Group(group) => FlowEnd::Group(group.clone()),
            Self::Curve(curve) => FlowEnd::Curve(curve.points_mm.iter().map(|p| Point3::from(*p)).collect()),
            Self::Plane(f) => FlowEnd::Plane { origin: Point3::from(f.origin_mm), normal: unit(normal, &f.normal)? },
            Self::Cylinder(f) => FlowEnd::Cylinder {
                axis_origin: Point3::from(f.axis_origin_mm),
                axis_direction: unit(axis, &f.axis_direction)?,
                radius: f.radius_mm,
            },
        })
    }
}

impl SpiralFile {
    pub(crate) fn to_spiral(&self) -> Result<Spiral, PathError> {
        let levels = match self {
            Self::ParallelPlanes(f) => SpiralLevels::Sections(Sections::ParallelPlanes(f.to_planes()?)),
            Self::CylindricalSections(f) => SpiralLevels::Sections(Sections::CylindricalSections(f.to_sections()?)),
            Self::Flow(f) => SpiralLevels::Flow(f.to_flow()?),
        };
        Ok(Spiral { levels })
    }
}

#[cfg(test)]
#[path = "../../tests/unit/strategy/field_file.rs"]
mod tests;
