//! Seeds of fronts as curves on a patch.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use crate::distance::patch_vertices::on_edge;
use crate::error::PathError;
use crate::layout::scallop::seed_points::projected;
use crate::layout::scallop::surface_path::{SurfacePath, trace_zero};
use crate::layout::section_layout::extent;
use crate::region::check_group;
use crate::sections::{CylindricalSections, ParallelPlanes, Sections};
use crate::strategy::patch::Patch;
use crate::strategy::scallop::Seed;

/// Curves that fronts begin at.
#[derive(Clone, Debug)]
pub(crate) struct SeedCurves {
    pub(crate) paths: Vec<SurfacePath>,
    /// Whether they are a border, with the region to the left; else they are passes themselves, and
    /// fronts go to both sides.
    pub(crate) is_border: bool,
}

/// A section along a border is looked for this share of the extent beside it: 3 µm on 3 m, as far
/// as the rounding of mesh files goes.
const BESIDE: f64 = 1e-6;

/// The curves of a seed.
///
/// # Errors
/// When it is nowhere on the region.
pub(crate) fn seed_curves(patch: &Patch, seed: &Seed, spacing: f64) -> Result<SeedCurves, PathError> {
    let (paths, is_border) = match seed {
        Seed::Border => (border_of(patch, |_| true), true),
        Seed::GroupBorder(name) => (group_border(patch, name)?, true),
        Seed::Curve(points) => (vec![projected(patch, points, spacing)?], false),
        Seed::Plane { origin, normal } => {
            let planes = ParallelPlanes { origin: *origin, normal: *normal, from: None, to: None };
            (section(patch, &Sections::ParallelPlanes(planes), 0.0), false)
        }
        Seed::Cylinder { axis_origin, axis_direction, radius } => {
            let (axis_origin, axis_direction) = (*axis_origin, *axis_direction);
            let cylinders = CylindricalSections { axis_origin, axis_direction, from_radius: 0.0, to_radius: *radius };
            (section(patch, &Sections::CylindricalSections(cylinders), *radius), false)
        }
    };
    if paths.is_empty() {
        return Err(PathError::SeedNowhere { seed: format!("{seed}; {}", remedy(seed)) });
    }
    Ok(SeedCurves { paths, is_border })
}

/// Remedy for a seed that is nowhere on the region.
fn remedy(seed: &Seed) -> &'static str {
    match seed {
        Seed::Border => {
            "it is closed and has none: take a plane, a cylinder or points that cut it as the seed, or bound it"
        }
        Seed::GroupBorder(_) => "name a group that borders on the region, or take \"border\" as the seed",
        _ => "move the seed so that it cuts the region, or take \"border\" as the seed",
    }
}

/// The borders of the part of a patch that some triangles make up, the part to the left.
pub(crate) fn border_of(patch: &Patch, is_in: impl Fn(u32) -> bool) -> Vec<SurfacePath> {
    let is_border = |t: u32, k: usize| {
        let Some(edge) = patch.edges.of_side(t, k) else { return false };
        patch.edges.sides(edge).iter().filter(|&&side| is_in(side / 3)).count() == 1
    };
    let n = patch.mesh.triangles().len() as u32;
    let sides = (0..n).filter(|&t| is_in(t)).flat_map(|t| (0..3).map(move |k| (t, k)));
    chained(patch, sides.filter(|&(t, k)| is_border(t, k)).collect())
}

/// The border of a patch along the triangles of a group outside it, or the border of the group
/// inside it.
fn group_border(patch: &Patch, name: &str) -> Result<Vec<SurfacePath>, PathError> {
    let mesh = patch.surface.mesh();
    let group = &mesh.groups()[check_group(patch.surface, name)?];
    // Edges by the places of their ends, because each group may have vertices of its own. Zeros of
    // both signs are the same place.
    let bits = |p: &Point3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let edge = |t: usize, k: usize| {
        let corners = mesh.corners(t);
        let [a, b] = [bits(&corners[k]), bits(&corners[(k + 1) % 3])];
        if a < b { [a, b] } else { [b, a] }
    };
    let of_group: BTreeSet<_> = group.triangles.clone().flat_map(|t| [0, 1, 2].map(|k| edge(t, k))).collect();
    let is_own = |t: u32| group.triangles.contains(&(patch.parent(t) as usize));
    let touches = |t: u32, k: usize| {
        let of_parent = patch.side_of_parent(t, k);
        of_parent.is_some_and(|k| of_group.contains(&edge(patch.parent(t) as usize, k)))
    };
    let side_of_border = |t: u32, k: usize| {
        let Some(edge) = patch.edges.of_side(t, k) else { return false };
        let sides = patch.edges.sides(edge);
        let among_others = sides.len() > 1 && sides.iter().any(|s| is_own(s / 3)) && !is_own(t);
        among_others || (sides.len() == 1 && !is_own(t) && touches(t, k))
    };
    let n = patch.mesh.triangles().len() as u32;
    let sides: Vec<(u32, usize)> =
        (0..n).flat_map(|t| (0..3).map(move |k| (t, k))).filter(|&(t, k)| side_of_border(t, k)).collect();
    if sides.is_empty() && (0..n).all(is_own) {
        return Ok(border_of(patch, |_| true));
    }
    Ok(chained(patch, sides))
}

/// The paths along some sides of triangles, each with its triangle to the left.
pub(crate) fn chained(patch: &Patch, sides: Vec<(u32, usize)>) -> Vec<SurfacePath> {
    let ends = |&(t, k): &(u32, usize)| {
        let v = patch.mesh.triangles()[t as usize];
        [v[k], v[(k + 1) % 3]]
    };
    let mut from: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let mut n_into: BTreeMap<u32, usize> = BTreeMap::new();
    for (i, side) in sides.iter().enumerate() {
        let [a, b] = ends(side);
        from.entry(a).or_default().push(i);
        *n_into.entry(b).or_default() += 1;
    }
    let mut used = vec![false; sides.len()];
    let mut paths = Vec::new();
    // Open paths first: they begin where no side leads to.
    for open in [true, false] {
        for start in 0..sides.len() {
            let begins = n_into.get(&ends(&sides[start])[0]).copied().unwrap_or(0) == 0;
            if used[start] || (open && !begins) {
                continue;
            }
            let (mut nodes, mut triangles) = (Vec::new(), Vec::new());
            let mut next = Some(start);
            while let Some(i) = next {
                used[i] = true;
                nodes.push(ends(&sides[i])[0]);
                triangles.push(sides[i].0);
                let last = ends(&sides[i])[1];
                next = from.get(&last).and_then(|after| after.iter().copied().find(|&j| !used[j]));
                if next.is_none() && last != nodes[0] {
                    nodes.push(last);
                    triangles.push(sides[i].0);
                }
            }
            let last_side = triangles.len();
            let closed = last_side >= 3 && ends_closed(&nodes, &sides, &ends, &triangles);
            if nodes.len() >= 2 {
                let nodes = nodes.iter().map(|&v| patch.mesh.vertices()[v as usize]).collect();
                paths.push(SurfacePath { nodes, triangles, closed });
            }
        }
    }
    paths
}

/// Whether a side leads from the last node of a chain back to its first.
fn ends_closed(
    nodes: &[u32],
    sides: &[(u32, usize)],
    ends: &dyn Fn(&(u32, usize)) -> [u32; 2],
    triangles: &[u32],
) -> bool {
    let (first, last, triangle) = (nodes[0], nodes[nodes.len() - 1], triangles[triangles.len() - 1]);
    sides.iter().any(|s| s.0 == triangle && ends(s) == [last, first])
}

/// The section of a patch by a level; where that is a border of the patch, a hair beside it.
fn section(patch: &Patch, sections: &Sections, level: f64) -> Vec<SurfacePath> {
    let hair = BESIDE * extent(&patch.mesh);
    let sections = [level, level + hair, level - hair].map(|at| section_at(patch, sections, at));
    sections.into_iter().find(|paths| !paths.is_empty()).unwrap_or_default()
}

/// The section of a patch by a level.
fn section_at(patch: &Patch, sections: &Sections, level: f64) -> Vec<SurfacePath> {
    let values: Vec<f64> = patch.mesh.vertices().iter().map(|p| sections.level(p) - level).collect();
    let all: Vec<u32> = (0..patch.mesh.triangles().len() as u32).collect();
    let exact = |[a, b]: [u32; 2], t: f64| match t {
        0.0 => values[a as usize],
        1.0 => values[b as usize],
        _ => sections.level(&on_edge(patch, [a, b], t)) - level,
    };
    trace_zero(patch, &values, &all, exact)
}
