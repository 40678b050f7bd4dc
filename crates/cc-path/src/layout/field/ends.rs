use std::collections::{BTreeMap, BTreeSet};

use facemill_surface_model::Surface;
use nalgebra::{Point3, Vector3};

use crate::error::PathError;
use crate::region::group_triangles;
use crate::strategy::field::{Flow, FlowEnd};
use crate::strategy::patch::Patch;

/// The values of a flow that are given: 0 at the vertices of the one end, 1 at those of the other.
///
/// # Errors
/// When an end names no border or one with interruptions, both name the same place, or a part of
/// the region does not lie between both.
pub(crate) fn end_values(patch: &Patch, flow: &Flow) -> Result<Vec<Option<f64>>, PathError> {
    let borders = border_edges(patch);
    let mut values = vec![None; patch.mesh.vertices().len()];
    let from = EndBorder::of(patch, &borders, &flow.from, "from", flow.within)?;
    let to = EndBorder::of(patch, &borders, &flow.to, "to", flow.within)?;
    for (end, value) in [(&from, 0.0), (&to, 1.0)] {
        for v in end.edges.iter().flat_map(|&e| borders[e]) {
            let position = patch.mesh.vertices()[v as usize];
            match values[v as usize].replace(value) {
                Some(before) if before != value => return Err(PathError::FlowEndsTouch { position }),
                _ => {}
            }
        }
    }
    let is_open = |e: &usize| !from.edges.contains(e) && !to.edges.contains(e);
    let open: Vec<usize> = (0..borders.len()).filter(is_open).collect();
    for run in open_runs(&borders, &open, &values) {
        from.check_whole(patch, &borders, &run, &values, 0.0)?;
        to.check_whole(patch, &borders, &run, &values, 1.0)?;
    }
    check_parts(patch, &values)?;
    Ok(values)
}

/// The border of a patch against an end of a flow.
struct EndBorder<'a> {
    end: &'a FlowEnd,
    /// "from" or "to".
    name: &'static str,
    within: f64,
    /// Distance of each border edge from the end by its farthest place, mm.
    distances: Vec<f64>,
    /// Border edges that lie on it.
    edges: BTreeSet<usize>,
}

/// An end is longer than this many times the distance allowed. Shorter: a border that crosses the
/// plane, cylinder or curve lies on it for about twice that distance, and would be an end. Longer:
/// short ends are refused.
const LONGER: f64 = 4.0;

/// Open edges between two edges on an end interrupt it where they are no farther from it than so
/// many times the distance allowed,
const WOBBLE: f64 = 10.0;

/// or than this share of their length; else they are a slot, at whose sides passes end.
const SHALLOW: f64 = 0.1;

impl<'a> EndBorder<'a> {
    /// # Errors
    /// When the end names no border, or only places where a border crosses it.
    fn of(
        patch: &Patch,
        borders: &[[u32; 2]],
        end: &'a FlowEnd,
        name: &'static str,
        within: f64,
    ) -> Result<Self, PathError> {
        let distance = distance_to(patch.surface, end)?;
        let of_edge = |edge: &[u32; 2]| {
            let [a, b] = edge.map(|v| patch.mesh.vertices()[v as usize]);
            distance(&a).max(distance(&b)).max(distance(&nalgebra::center(&a, &b)))
        };
        let distances: Vec<f64> = borders.iter().map(of_edge).collect();
        let near: Vec<usize> = (0..borders.len()).filter(|&e| distances[e] <= within).collect();
        let mut runs = open_runs(borders, &near, &vec![None; patch.mesh.vertices().len()]);
        runs.retain(|run| length_of(patch, borders, run) > LONGER * within);
        if runs.is_empty() {
            let nearest = distances.into_iter().fold(f64::INFINITY, f64::min);
            return Err(PathError::NoFlowEnd { end: name, what: described(end), within, nearest });
        }
        Ok(Self { end, name, within, distances, edges: runs.into_iter().flatten().collect() })
    }

    /// # Errors
    /// When a run of open edges interrupts the end, whose vertices have this value.
    fn check_whole(
        &self,
        patch: &Patch,
        borders: &[[u32; 2]],
        run: &[usize],
        values: &[Option<f64>],
        value: f64,
    ) -> Result<(), PathError> {
        let mut ends = run.iter().flat_map(|&e| borders[e]).filter_map(|v| values[v as usize]).peekable();
        let lies_between = ends.peek().is_some() && ends.all(|of_end| of_end == value);
        let Some(&farthest) = run.iter().max_by(|a, b| self.distances[**a].total_cmp(&self.distances[**b])) else {
            return Ok(());
        };
        let off = self.distances[farthest];
        if !lies_between || off > (WOBBLE * self.within).max(SHALLOW * length_of(patch, borders, run)) {
            return Ok(());
        }
        let [a, b] = borders[farthest].map(|v| patch.mesh.vertices()[v as usize]);
        let position = nalgebra::center(&a, &b);
        let (end, what, within) = (self.name, described(self.end), self.within);
        Err(PathError::FlowEndBroken { end, what, within, farthest: off, position })
    }
}

fn length_of(patch: &Patch, borders: &[[u32; 2]], run: &[usize]) -> f64 {
    let places = run.iter().map(|&e| borders[e].map(|v| patch.mesh.vertices()[v as usize]));
    places.map(|[a, b]| nalgebra::distance(&a, &b)).sum()
}

/// Open edges in runs between vertices that have a value.
fn open_runs(borders: &[[u32; 2]], open: &[usize], values: &[Option<f64>]) -> Vec<Vec<usize>> {
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for &e in open {
        let inner = borders[e].into_iter().filter(|&v| values[v as usize].is_none());
        inner.for_each(|v| at.entry(v).or_default().push(e));
    }
    let mut seen: BTreeSet<usize> = BTreeSet::new();
    let mut runs = Vec::new();
    for &first in open {
        if !seen.insert(first) {
            continue;
        }
        let mut run = vec![first];
        let mut next = 0;
        while next < run.len() {
            let beside = borders[run[next]].iter().filter_map(|v| at.get(v)).flatten();
            run.extend(beside.filter(|&&e| seen.insert(e)).copied().collect::<Vec<_>>());
            next += 1;
        }
        runs.push(run);
    }
    runs
}

/// The vertices of each border edge.
pub(crate) fn border_edges(patch: &Patch) -> Vec<[u32; 2]> {
    let is_border = |e: &u32| patch.edges.sides(*e).len() == 1;
    (0..patch.edges.len() as u32).filter(is_border).map(|e| patch.edges.vertices(e)).collect()
}

fn described(end: &FlowEnd) -> String {
    match end {
        FlowEnd::Group(group) => format!("group \"{group}\""),
        FlowEnd::Curve(_) => "its curve".to_owned(),
        FlowEnd::Plane { .. } => "its plane".to_owned(),
        FlowEnd::Cylinder { .. } => "its cylinder".to_owned(),
    }
}

type Distance<'a> = Box<dyn Fn(&Point3<f64>) -> f64 + 'a>;

fn distance_to<'a>(surface: &'a Surface, end: &'a FlowEnd) -> Result<Distance<'a>, PathError> {
    Ok(match end {
        FlowEnd::Group(group) => {
            let is_in = group_triangles(surface, group)?;
            Box::new(move |p| {
                let nearest = surface.closest_point_where(p, f64::INFINITY, |t| is_in[t as usize]);
                nearest.map_or(f64::INFINITY, |at| at.distance)
            })
        }
        FlowEnd::Curve(points) => Box::new(move |p| {
            points.windows(2).map(|w| distance_to_segment(p, &w[0], &w[1])).fold(f64::INFINITY, f64::min)
        }),
        FlowEnd::Plane { origin, normal } => Box::new(move |p| normal.dot(&(p - origin)).abs()),
        FlowEnd::Cylinder { axis_origin, axis_direction, radius } => Box::new(move |p| {
            let d = p - axis_origin;
            let radial: Vector3<f64> = d - axis_direction.into_inner() * axis_direction.dot(&d);
            (radial.norm() - radius).abs()
        }),
    })
}

fn distance_to_segment(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let ab = b - a;
    let share = (p - a).dot(&ab) / ab.norm_squared();
    // Of a segment without length, the share is NaN: then its first end counts.
    let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
    (p - (a + ab * share)).norm()
}

/// Every part of the patch has to touch both ends: elsewhere the field would be constant, and
/// nothing be cut.
fn check_parts(patch: &Patch, values: &[Option<f64>]) -> Result<(), PathError> {
    for part in connected_parts(patch) {
        let touches = |value: f64| {
            let corners = part.iter().flat_map(|&t| patch.mesh.triangles()[t as usize]);
            corners.into_iter().any(|v| values[v as usize] == Some(value))
        };
        let Some(end) = [("from", 0.0), ("to", 1.0)].into_iter().find(|(_, value)| !touches(*value)) else { continue };
        let [a, b, c] = patch.mesh.corners(part[0] as usize);
        let position = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        return Err(PathError::FlowMisses { end: end.0, position });
    }
    Ok(())
}

/// The triangles of the patch in parts that hang together by edges.
pub(crate) fn connected_parts(patch: &Patch) -> Vec<Vec<u32>> {
    let n = patch.mesh.triangles().len();
    let mut seen = vec![false; n];
    let mut parts = Vec::new();
    for first in 0..n as u32 {
        if std::mem::replace(&mut seen[first as usize], true) {
            continue;
        }
        let mut part = vec![first];
        let mut next = 0;
        while next < part.len() {
            let t = part[next];
            next += 1;
            for edge in (0..3).filter_map(|k| patch.edges.of_side(t, k)) {
                for &side in patch.edges.sides(edge) {
                    if !std::mem::replace(&mut seen[side as usize / 3], true) {
                        part.push(side / 3);
                    }
                }
            }
        }
        parts.push(part);
    }
    parts
}
