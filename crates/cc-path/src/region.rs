//! Regions: the part of the drive surface that passes are laid on.

use std::sync::Arc;

use facemill_cl_data::Aabb;
use facemill_surface_model::Surface;
use nalgebra::{Unit, Vector3};

use crate::error::PathError;
use crate::left_region::LeftRegion;
use crate::sections::Sections;

/// The part of the drive surface that passes are laid on: all conditions must hold. The default is
/// all of it.
///
/// Triangles without area belong to no region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// Names of mesh groups; a triangle must be in one of them.
    pub groups: Option<Vec<String>>,
    /// Cone of directions that holds the triangle's normal.
    pub normal_cone: Option<NormalCone>,
    /// Box in the workpiece frame, borders included. Triangles that cross its sides are cut there.
    pub bounds: Option<Aabb>,
    /// Sections between whose first and last level the region lies; triangles that cross these are
    /// cut there.
    pub between: Option<Sections>,
    /// Surface on which stock is left; passes lie there and within its overlap.
    pub left: Option<Arc<LeftRegion>>,
}

/// Directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Middle of the cone, workpiece frame.
    pub axis: Unit<Vector3<f64>>,
    /// Largest angle from the axis, rad, from 0 to π.
    pub half_angle: f64,
}

impl NormalCone {
    /// Whether the direction lies in the cone, border included.
    pub fn contains(&self, direction: &Unit<Vector3<f64>>) -> bool {
        self.axis.angle(direction) <= self.half_angle
    }
}

/// Triangles that fulfil groups and cone and reach into the box, in mesh order.
pub(crate) fn triangles_of(surface: &Surface, region: &Region) -> Result<Vec<u32>, PathError> {
    region.groups.iter().flatten().try_for_each(|group| check_group(surface, group).map(drop))?;
    let all = 0..surface.mesh().triangles().len() as u32;
    let solid: Vec<u32> = all.filter(|&t| surface.facet_normal(t).is_some()).collect();
    let solid = not_empty(solid, "the mesh has none with an area")?;
    let grouped = not_empty(keep_groups(surface, region, solid), "its groups are empty")?;
    let faced = match &region.normal_cone {
        Some(cone) => {
            grouped.into_iter().filter(|&t| surface.facet_normal(t).is_some_and(|n| cone.contains(&n))).collect()
        }
        None => grouped,
    };
    let faced = not_empty(faced, "no normal lies in the normal cone")?;
    let boxed = match &region.bounds {
        Some(bounds) => faced
            .into_iter()
            .filter(|&t| Aabb::of_points(&surface.mesh().corners(t as usize)).intersects(bounds))
            .collect(),
        None => faced,
    };
    let boxed = not_empty(boxed, "the box holds none")?;
    if region.left.as_ref().is_some_and(|left| left.is_empty()) {
        return Err(PathError::EmptyRegion { reason: "no more stock is left on any than left_above allows" });
    }
    Ok(boxed)
}

fn not_empty(triangles: Vec<u32>, reason: &'static str) -> Result<Vec<u32>, PathError> {
    if triangles.is_empty() { Err(PathError::EmptyRegion { reason }) } else { Ok(triangles) }
}

/// Whether each triangle of the surface is in a group.
///
/// # Errors
/// When there is no such group.
pub(crate) fn group_triangles(surface: &Surface, group: &str) -> Result<Vec<bool>, PathError> {
    let named = Region { groups: Some(vec![group.to_owned()]), ..Region::default() };
    check_group(surface, group)?;
    let mut is_in = vec![false; surface.mesh().triangles().len()];
    keep_groups(surface, &named, (0..is_in.len() as u32).collect()).into_iter().for_each(|t| is_in[t as usize] = true);
    Ok(is_in)
}

/// Index of a group of the mesh.
///
/// # Errors
/// When there is no such group.
pub(crate) fn check_group(surface: &Surface, group: &str) -> Result<usize, PathError> {
    let groups = surface.mesh().groups();
    groups.iter().position(|g| g.name == group).ok_or_else(|| {
        let known = groups.iter().map(|g| g.name.clone()).filter(|n| !n.is_empty()).collect();
        PathError::UnknownGroup { group: group.to_owned(), known }
    })
}

fn keep_groups(surface: &Surface, region: &Region, triangles: Vec<u32>) -> Vec<u32> {
    let Some(names) = &region.groups else { return triangles };
    let chosen: Vec<_> =
        surface.mesh().groups().iter().filter(|g| names.contains(&g.name)).map(|g| g.triangles.clone()).collect();
    triangles.into_iter().filter(|&t| chosen.iter().any(|r| r.contains(&(t as usize)))).collect()
}

#[cfg(test)]
#[path = "../tests/unit/region.rs"]
mod tests;
