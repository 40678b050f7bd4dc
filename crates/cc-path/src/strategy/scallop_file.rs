use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::PathError;
use crate::sections::Sections;
use crate::strategy::file::{CylindricalSectionsFile, ParallelPlanesFile, unit};
use crate::strategy::scallop::{ConstantScallop, Seed};
use crate::strategy::settings::require;

/// Fronts that advance from a seed by the local strip width.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstantScallopFile {
    /// Where fronts begin.
    pub seed: SeedFile,
    /// A second place where fronts begin; those of both meet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_seed: Option<SeedFile>,
    /// Levels between which the passes lie. Default: the region alone bounds them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<SectionsFile>,
}

/// Sections that bound passes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SectionsFile {
    /// Parallel planes.
    ParallelPlanes(ParallelPlanesFile),
    /// Coaxial cylinders.
    CylindricalSections(CylindricalSectionsFile),
}

/// Where fronts begin: `"border"`, or one of the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SeedFile {
    /// The whole border of the region; the first passes lie half a strip inside.
    Border,
    /// Name of a mesh group: the border of the region with it, or its own border inside the region;
    /// the first passes lie half a strip beside it.
    GroupBorder(String),
    /// Points on the surface, workpiece frame, which are a pass; closed where the last is the
    /// first.
    PointsMm(#[schemars(length(min = 2))] Vec<[f64; 3]>),
    /// The section by a plane, which is a pass.
    Plane(SeedPlaneFile),
    /// The section by a cylinder, which is a pass.
    Cylinder(SeedCylinderFile),
}

/// Plane that cuts out a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeedPlaneFile {
    /// Normal of the plane, workpiece frame; of any length above 0.
    pub normal: [f64; 3],
    /// Point of the plane, workpiece frame.
    #[serde(default)]
    pub origin_mm: [f64; 3],
}

/// Cylinder that cuts out a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeedCylinderFile {
    /// Point of the axis, workpiece frame.
    #[serde(default)]
    pub axis_origin_mm: [f64; 3],
    /// Direction of the axis; of any length above 0.
    pub axis_direction: [f64; 3],
    /// Radius.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_mm: f64,
}

impl SectionsFile {
    pub(crate) fn to_sections(&self) -> Result<Sections, PathError> {
        match self {
            Self::ParallelPlanes(f) => f.to_planes().map(Sections::ParallelPlanes),
            Self::CylindricalSections(f) => f.to_sections().map(Sections::CylindricalSections),
        }
    }
}

impl ConstantScallopFile {
    pub(crate) fn to_scallop(&self) -> Result<ConstantScallop, PathError> {
        let files = std::iter::once(&self.seed).chain(&self.second_seed);
        let within = self.within.as_ref().map(SectionsFile::to_sections);
        let seeds = files.map(SeedFile::to_seed).collect::<Result<Vec<_>, _>>()?;
        let setting = "number of different seeds in constant_scallop.seed and constant_scallop.second_seed";
        require(setting, 1.0, "2; leave second_seed out", seeds.len() == 1 || seeds[0] != seeds[1])?;
        Ok(ConstantScallop { seeds, within: within.transpose()? })
    }
}

impl SeedFile {
    fn to_seed(&self) -> Result<Seed, PathError> {
        Ok(match self {
            Self::Border => Seed::Border,
            Self::GroupBorder(name) => Seed::GroupBorder(name.clone()),
            Self::PointsMm(points) => {
                let n = points.len() as f64;
                require("number of constant_scallop.seed.points_mm", n, "at least 2", points.len() >= 2)?;
                let largest = points.iter().flatten().fold(0.0, |most: f64, c| most.max(c.abs()));
                require("constant_scallop.seed.points_mm", largest, "up to 1e9", largest <= 1e9)?;
                Seed::Curve(points.iter().map(|p| Point3::from(*p)).collect())
            }
            Self::Plane(f) => Seed::Plane {
                origin: Point3::from(f.origin_mm),
                normal: unit("length of constant_scallop.seed.plane.normal", &f.normal)?,
            },
            Self::Cylinder(f) => {
                let holds = f.radius_mm.is_finite() && f.radius_mm > 0.0;
                require("constant_scallop.seed.cylinder.radius_mm", f.radius_mm, "finite and above 0", holds)?;
                Seed::Cylinder {
                    axis_origin: Point3::from(f.axis_origin_mm),
                    axis_direction: unit("length of constant_scallop.seed.cylinder.axis_direction", &f.axis_direction)?,
                    radius: f.radius_mm,
                }
            }
        })
    }
}

#[cfg(test)]
#[path = "../../tests/unit/strategy/scallop_file.rs"]
mod tests;
