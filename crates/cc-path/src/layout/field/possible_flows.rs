use facemill_surface_model::Surface;
use nalgebra::{Point3, Vector3};

use crate::error::PathError;
use crate::layout::field::ends::{border_edges, connected_parts, end_values};
use crate::layout::section_layout::extent;
use crate::region::{Region, group_triangles};
use crate::strategy::field_file::{FlowEndFile, FlowFile, WITHIN_MM};
use crate::strategy::patch::{Fineness, Patch};

/// Flow that can be laid on a region.
#[derive(Clone, Debug, PartialEq)]
pub struct PossibleFlow {
    /// The flow, in the order in which its ends were given.
    pub flow: FlowFile,
    /// Way from the middle of the first end to that of the last, mm, workpiece frame; passes run
    /// across it.
    pub way: Vector3<f64>,
    /// Length of both ends together, mm.
    pub length: f64,
    /// Whether the region is in one piece and has no other border: levels are closed, and a spiral
    /// can rise over them.
    pub is_closed: bool,
}

/// Returns the flows that can be laid on a region between two of these ends, those with the longest
/// ends first.
///
/// Ends at which the region has no border, that have interruptions or touch each other, or do not
/// hold each part of the region between them, have no flow.
///
/// # Errors
/// If the region is empty, names an unknown group or has too many facets, or an end names an
/// unknown group or has a number out of range.
pub fn possible_flows(
    surface: &Surface,
    region: &Region,
    ends: &[FlowEndFile],
) -> Result<Vec<PossibleFlow>, PathError> {
    let max_edge = extent(surface.mesh()).max(f64::MIN_POSITIVE);
    let fineness = Fineness { max_edge, max_bend: WITHIN_MM / 2.0, cuts_range: false };
    let patch = Patch::new(surface, region, None, &fineness)?;
    let borders = border_edges(&patch);
    let is_one = connected_parts(&patch).len() == 1;
    let mut near = Vec::new();
    for end in ends {
        if is_near(&patch, &borders, end)? {
            near.push(end);
        }
    }
    let mut found = Vec::new();
    for (k, from) in near.iter().enumerate() {
        for to in &near[k + 1..] {
            let file = FlowFile { from: (*from).clone(), to: (*to).clone(), within_mm: WITHIN_MM };
            let Ok(values) = end_values(&patch, &file.to_flow()?) else { continue };
            let ends = [0.0, 1.0].map(|value| EndLine::of(&patch, &borders, &values, value));
            found.push(PossibleFlow {
                flow: file,
                way: ends[1].middle - ends[0].middle,
                length: ends[0].length + ends[1].length,
                is_closed: is_one && ends[0].n_edges + ends[1].n_edges == borders.len(),
            });
        }
    }
    found.sort_by(|a, b| b.length.total_cmp(&a.length));
    Ok(found)
}

/// Returns whether a border lies at an end. Other ends than groups are quickly compared later.
fn is_near(patch: &Patch, borders: &[[u32; 2]], end: &FlowEndFile) -> Result<bool, PathError> {
    let FlowEndFile::Group(group) = end else { return Ok(true) };
    let is_in = group_triangles(patch.surface, group)?;
    let is_at = |p: &Point3<f64>| patch.surface.closest_point_where(p, WITHIN_MM, |t| is_in[t as usize]).is_some();
    Ok(borders.iter().any(|edge| edge.iter().all(|&v| is_at(&patch.mesh.vertices()[v as usize]))))
}

/// Border edges on an end of a flow.
struct EndLine {
    n_edges: usize,
    length: f64,
    middle: Point3<f64>,
}

impl EndLine {
    fn of(patch: &Patch, borders: &[[u32; 2]], values: &[Option<f64>], value: f64) -> Self {
        let on_end = borders.iter().filter(|edge| edge.iter().all(|&v| values[v as usize] == Some(value)));
        let (mut n_edges, mut length, mut moment) = (0, 0.0, Vector3::zeros());
        for edge in on_end {
            let [a, b] = edge.map(|v| patch.mesh.vertices()[v as usize]);
            let part = nalgebra::distance(&a, &b);
            n_edges += 1;
            length += part;
            moment += nalgebra::center(&a, &b).coords * part;
        }
        Self { n_edges, length, middle: Point3::from(moment / length.max(f64::MIN_POSITIVE)) }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/field/possible_flows.rs"]
mod tests;
