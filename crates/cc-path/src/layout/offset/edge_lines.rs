//! Lines between groups of the mesh, on a patch.

use std::collections::BTreeSet;

use facemill_surface_model::Surface;

use crate::error::PathError;
use crate::layout::scallop::seeds::chained;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::region::check_group;
use crate::strategy::patch::Patch;

/// A side of a triangle of a patch on the border between two groups of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BorderSide {
    pub(crate) triangle: u32,
    pub(crate) side: usize,
    /// Group of the triangle, by its index.
    pub(crate) own: usize,
    /// Group across.
    pub(crate) other: usize,
}

/// The lines between two groups of the surface on a patch that has at least one of them; the second
/// lies to the left.
///
/// # Errors
/// When there is no such group, or both have no common border in the region.
pub(crate) fn lines_between(patch: &Patch, groups: &[String; 2]) -> Result<Vec<SurfacePath>, PathError> {
    let [first, second] = group_indices(patch.surface, groups)?;
    let sides = border_sides(patch);
    let of = |own: usize, other: usize| -> Vec<(u32, usize)> {
        sides.iter().filter(|s| s.own == own && s.other == other).map(|s| (s.triangle, s.side)).collect()
    };
    let left = of(second, first);
    if !left.is_empty() {
        return Ok(chained(patch, left));
    }
    let right = of(first, second);
    if right.is_empty() {
        let names = neighbours(&sides, first, patch.surface);
        return Err(PathError::NoGroupBorder { groups: groups.clone(), neighbours: names });
    }
    Ok(chained(patch, right).into_iter().map(reversed).collect())
}

/// # Errors
/// When there is no such group.
pub(crate) fn group_indices<const N: usize>(surface: &Surface, groups: &[String; N]) -> Result<[usize; N], PathError> {
    let mut indices = [0; N];
    for (index, name) in indices.iter_mut().zip(groups) {
        *index = check_group(surface, name)?;
    }
    Ok(indices)
}

/// The sides of a patch across which another group of the surface begins, in the patch or outside
/// it.
pub(crate) fn border_sides(patch: &Patch) -> Vec<BorderSide> {
    let group = |t: u32| patch.surface.mesh().group_of(t as usize);
    let n = patch.mesh.triangles().len() as u32;
    let mut sides = Vec::new();
    for triangle in 0..n {
        let Some(own) = group(patch.parent(triangle)) else { continue };
        for side in 0..3 {
            let other = match patch.edges.across(&patch.mesh, triangle, side) {
                Some((across, _)) => group(patch.parent(across)),
                None => outside(patch, triangle, side).and_then(group),
            };
            if let Some(other) = other.filter(|&g| g != own) {
                sides.push(BorderSide { triangle, side, own, other });
            }
        }
    }
    sides
}

/// The triangle of the surface across a side at the border of the patch.
fn outside(patch: &Patch, triangle: u32, side: usize) -> Option<u32> {
    let (surface, parent) = (patch.surface, patch.parent(triangle));
    let of_parent = patch.side_of_parent(triangle, side)?;
    surface.edges().across(surface.mesh(), parent, of_parent).map(|(t, _)| t)
}

fn neighbours(sides: &[BorderSide], group: usize, surface: &Surface) -> Vec<String> {
    let others: BTreeSet<usize> = sides.iter().filter(|s| s.own == group).map(|s| s.other).collect();
    others.into_iter().map(|g| surface.mesh().groups()[g].name.clone()).collect()
}

fn reversed(mut path: SurfacePath) -> SurfacePath {
    path.nodes.reverse();
    path.triangles.reverse();
    path
}
