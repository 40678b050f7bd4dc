//! Sides of a root: the groups that passes lie on, each with the surface that the ball also
//! touches.

use facemill_surface_model::Surface;

use crate::error::PathError;
use crate::layout::offset::edge_lines::group_indices;
use crate::region::Region;

/// A group that passes lie on.
pub(crate) struct RootSide {
    /// The region of them.
    pub(crate) region: Region,
    /// The surface of the other group.
    pub(crate) other: Surface,
}

/// The sides of a root that belong to the region, in the order of the groups.
///
/// # Errors
/// When there is no such group, or none belongs to the region.
pub(crate) fn root_sides(surface: &Surface, region: &Region, groups: &[String; 2]) -> Result<Vec<RootSide>, PathError> {
    group_indices(surface, groups)?;
    let [first, second] = groups;
    let belongs = |group: &String| region.groups.as_ref().is_none_or(|of_region| of_region.contains(group));
    let side = |own: &String, other: &String| RootSide {
        region: Region { groups: Some(vec![own.clone()]), ..region.clone() },
        other: Surface::new(surface.mesh().select_groups(|name| name == other), surface.settings()),
    };
    let both = [(first, second), (second, first)];
    let sides: Vec<RootSide> =
        both.into_iter().filter(|(own, _)| belongs(own)).map(|(own, other)| side(own, other)).collect();
    if sides.is_empty() { Err(PathError::RootOutside { groups: groups.clone() }) } else { Ok(sides) }
}
