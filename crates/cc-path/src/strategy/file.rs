use facemill_cl_data::Aabb;
use nalgebra::{Point3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::PathError;
use crate::region::{NormalCone, Region};
use crate::sections::{CylindricalSections, ParallelPlanes};
use crate::strategy::Strategy;
use crate::strategy::edge_file::{EdgeFile, RootFile};
use crate::strategy::field_file::{FlowFile, SpiralFile};
use crate::strategy::left_above_file::LeftAboveFile;
use crate::strategy::scallop_file::{ConstantScallopFile, SectionsFile};
use crate::strategy::settings::require;

/// Arrangement of passes: `{"parallel_planes": {…}}`, `{"cylindrical_sections": {…}}`,
/// `{"flow": {…}}`, `{"spiral": {…}}`, `{"constant_scallop": {…}}`, `{"edge": {…}}` or
/// `{"root": {…}}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StrategyFile {
    /// Sections by parallel planes; the level is the distance along their normal.
    ParallelPlanes(ParallelPlanesFile),
    /// Sections by coaxial cylinders; the level is the radius.
    CylindricalSections(CylindricalSectionsFile),
    /// Passes that morph from one border of the region to another.
    Flow(FlowFile),
    /// One pass that winds around over closed levels.
    Spiral(SpiralFile),
    /// Fronts that advance from a seed by the local strip width, for the same cusp everywhere; the
    /// level is the distance from the seed.
    ConstantScallop(ConstantScallopFile),
    /// Curves along an edge, such as the leading edge of a blade, and at distances from it; the
    /// level is the distance.
    Edge(EdgeFile),
    /// Curves along a concave corner, such as the root of a blade, and at distances from it; the
    /// level is the distance.
    Root(RootFile),
}

/// Sections by parallel planes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParallelPlanesFile {
    /// Direction across the passes, workpiece frame; of any length above 0.
    pub normal: [f64; 3],
    /// Point of the plane that levels are counted from, workpiece frame.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// First level. Default: the region's border.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_mm: Option<f64>,
    /// Last level, not below the first. Default: the region's border.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_mm: Option<f64>,
}

/// Sections by coaxial cylinders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylindricalSectionsFile {
    /// Point of the axis, workpiece frame.
    #[serde(default)]
    pub axis_origin_mm: [f64; 3],
    /// Direction of the axis; of any length above 0.
    pub axis_direction: [f64; 3],
    /// Smallest radius to be cut.
    #[schemars(range(min = 0))]
    pub from_radius_mm: f64,
    /// Largest radius to be cut, not below the smallest; passes end at the region's border before.
    #[schemars(range(min = 0))]
    pub to_radius_mm: f64,
}

/// Region of the drive surface; all conditions must hold, and without any it is the whole drive
/// surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionFile {
    /// Names of mesh groups, in full. Default: all of the drive surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<String>>,
    /// Directions that the normals of the triangles must lie in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_cone: Option<NormalConeFile>,
    /// Box that the passes must lie in, workpiece frame.
    #[serde(rename = "box", default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<BoxFile>,
    /// Planes or cylinders between whose first and last level the passes must lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between: Option<SectionsFile>,
    /// Width of the surface that is added beyond the border of groups and cone, along its tangent
    /// planes, up to 100 mm (docs/method.md#surface-beyond-a-border). Passes cover it, so layers
    /// also remove the stock there. It ends at material. Strategies that follow borders of groups
    /// do not permit it. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0, max = 100))]
    pub extend_mm: f64,
    /// Limits the region to places where a stock is higher above the surface than a limit
    /// (docs/method.md#what-earlier-cuts-left). Default: no such limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_above: Option<LeftAboveFile>,
}

/// Directions within an angle of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalConeFile {
    /// Middle of the cone, workpiece frame; of any length above 0.
    pub axis: [f64; 3],
    /// Largest angle from it.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 180))]
    pub half_angle_deg: f64,
}

/// Box parallel to the workpiece axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxFile {
    /// Smallest coordinates.
    pub min_mm: [f64; 3],
    /// Largest coordinates, not below the smallest.
    pub max_mm: [f64; 3],
}

impl StrategyFile {
    /// The strategy, with unit directions.
    ///
    /// # Errors
    /// When a direction has no length or a range is empty; the error names the field.
    pub fn to_strategy(&self) -> Result<Strategy, PathError> {
        match self {
            Self::ParallelPlanes(f) => f.to_planes().map(Strategy::ParallelPlanes),
            Self::CylindricalSections(f) => f.to_sections().map(Strategy::CylindricalSections),
            Self::Flow(f) => f.to_flow().map(Strategy::Flow),
            Self::Spiral(f) => f.to_spiral().map(Strategy::Spiral),
            Self::ConstantScallop(f) => f.to_scallop().map(Strategy::ConstantScallop),
            Self::Edge(f) => f.to_edge().map(Strategy::Edge),
            Self::Root(f) => f.to_root().map(Strategy::Root),
        }
    }
}

impl ParallelPlanesFile {
    pub(crate) fn to_planes(&self) -> Result<ParallelPlanes, PathError> {
        let low = self.from_mm.unwrap_or(f64::NEG_INFINITY);
        let high = self.to_mm.unwrap_or(f64::INFINITY);
        require("parallel_planes.to_mm", high, "not below from_mm", low <= high)?;
        Ok(ParallelPlanes {
            origin: Point3::from(self.origin_mm),
            normal: unit("length of parallel_planes.normal", &self.normal)?,
            from: self.from_mm,
            to: self.to_mm,
        })
    }
}

impl CylindricalSectionsFile {
    pub(crate) fn to_sections(&self) -> Result<CylindricalSections, PathError> {
        let (low, high) = (self.from_radius_mm, self.to_radius_mm);
        require("cylindrical_sections.from_radius_mm", low, "not below 0", low >= 0.0)?;
        require("cylindrical_sections.to_radius_mm", high, "not below from_radius_mm", low <= high)?;
        Ok(CylindricalSections {
            axis_origin: Point3::from(self.axis_origin_mm),
            axis_direction: unit("length of cylindrical_sections.axis_direction", &self.axis_direction)?,
            from_radius: low,
            to_radius: high,
        })
    }
}

impl RegionFile {
    /// The region with angles in rad; without the limit by `left_above`, which has to be measured,
    /// and without the surface of `extend_mm`.
    ///
    /// # Errors
    /// When the cone's axis has no length, its angle is out of range, the box is empty, or the
    /// sections or `extend_mm` are out of range; the error names the field.
    pub fn to_region(&self) -> Result<Region, PathError> {
        self.left_above.as_ref().map_or(Ok(()), LeftAboveFile::check)?;
        require("region.extend_mm", self.extend_mm, "from 0 to 100", (0.0..=100.0).contains(&self.extend_mm))?;
        Ok(Region {
            groups: self.groups.clone(),
            normal_cone: self.normal_cone.as_ref().map(NormalConeFile::to_cone).transpose()?,
            bounds: self.bounds.as_ref().map(BoxFile::to_bounds).transpose()?,
            between: self.between.as_ref().map(SectionsFile::to_sections).transpose()?,
            left: None,
        })
    }
}

impl NormalConeFile {
    fn to_cone(&self) -> Result<NormalCone, PathError> {
        let angle = self.half_angle_deg;
        let holds = angle > 0.0 && angle <= 180.0;
        require("region.normal_cone.half_angle_deg", angle, "above 0 and up to 180", holds)?;
        let axis = unit("length of region.normal_cone.axis", &self.axis)?;
        Ok(NormalCone { axis, half_angle: angle.to_radians() })
    }
}

impl BoxFile {
    fn to_bounds(&self) -> Result<Aabb, PathError> {
        let names = ["region.box.max_mm[0]", "region.box.max_mm[1]", "region.box.max_mm[2]"];
        for (k, name) in names.into_iter().enumerate() {
            require(name, self.max_mm[k], "not below that of min_mm", self.min_mm[k] <= self.max_mm[k])?;
        }
        Ok(Aabb { min: Point3::from(self.min_mm), max: Point3::from(self.max_mm) })
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

pub(crate) fn unit(what: &'static str, v: &[f64; 3]) -> Result<Unit<Vector3<f64>>, PathError> {
    let v = Vector3::from(*v);
    // Scaled first, so that no length that can be written is lost in the squares.
    let largest = v.amax();
    let direction = (largest.is_finite() && largest > 0.0).then(|| Unit::new_normalize(v / largest));
    direction.ok_or(PathError::Setting { setting: what, value: v.norm(), range: "finite and above 0" })
}

#[cfg(test)]
#[path = "../../tests/unit/strategy/file.rs"]
mod tests;
