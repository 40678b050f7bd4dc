use std::collections::BTreeMap;

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
    /// Whether the region is in one piece, each end is one closed line, and there is no other
    /// border: levels are closed, and a spiral can rise over them.
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
                is_closed: is_one
                    && ends.iter().all(|end| end.is_closed)
                    && ends[0].n_edges + ends[1].n_edges == borders.len(),
            });
        }
    }
    found.sort_by(|a, b| b.length.total_cmp(&a.length));
    Ok(found)
}

/// Returns whether a border lies at an end, as far as it takes little time to find out: true of all
/// ends but groups.
fn is_near(patch: &Patch, borders: &[[u32; 2]], end: &FlowEndFile) -> Result<bool, PathError> {
    let FlowEndFile::Group(group) = end else { return Ok(true) };
    let is_in = group_triangles(patch.surface, group)?;
    let is_at = |p: &Point3<f64>| patch.surface.closest_point_where(p, WITHIN_MM, |t| is_in[t as usize]).is_some();
    Ok(borders.iter().any(|edge| edge.iter().all(|&v| is_at(&patch.mesh.vertices()[v as usize]))))
}

/// Border edges on an end of a flow.
struct EndLine {
    n_edges: usize,
    /// Whether they are one closed line.
    is_closed: bool,
    length: f64,
    middle: Point3<f64>,
}

impl EndLine {
    fn of(patch: &Patch, borders: &[[u32; 2]], values: &[Option<f64>], value: f64) -> Self {
        let is_on = |edge: &&[u32; 2]| edge.iter().all(|&v| values[v as usize] == Some(value));
        let on_end: Vec<[u32; 2]> = borders.iter().filter(is_on).copied().collect();
        let (mut length, mut moment) = (0.0, Vector3::zeros());
        let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &[v, w] in &on_end {
            let [a, b] = [v, w].map(|v| patch.mesh.vertices()[v as usize]);
            let part = nalgebra::distance(&a, &b);
            length += part;
            moment += nalgebra::center(&a, &b).coords * part;
            beside.entry(v).or_default().push(w);
            beside.entry(w).or_default().push(v);
        }
        let n_edges = on_end.len();
        let is_closed = beside.values().all(|next| next.len() == 2) && walked_around(&beside) == n_edges;
        Self { n_edges, is_closed, length, middle: Point3::from(moment / length.max(f64::MIN_POSITIVE)) }
    }
}

/// Returns the number of vertices around a line from its first one, where each has two neighbours.
fn walked_around(beside: &BTreeMap<u32, Vec<u32>>) -> usize {
    let Some((&first, _)) = beside.first_key_value() else { return 0 };
    let (mut before, mut at, mut n) = (first, beside[&first][0], 1);
    while at != first {
        let next = beside[&at].iter().find(|&&v| v != before).copied().unwrap_or(before);
        (before, at, n) = (at, next, n + 1);
    }
    n
}

#[cfg(test)]
#[path = "../../../tests/unit/layout/field/possible_flows.rs"]
mod tests;
