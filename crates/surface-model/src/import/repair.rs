use std::collections::HashSet;

use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::import::RawMesh;
use crate::import::settings::{ImportFault, ImportSettings};
use crate::mesh::caps::turn_caps;
use crate::mesh::edges::Edges;
use crate::mesh::topology::{Component, Topology};
use crate::mesh::tri_mesh::{Group, TriMesh};
use crate::mesh::weld::weld;

/// Faults of a mesh file, and their repairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepairReport {
    /// Triangles in the file, polygons cut into triangles.
    pub n_triangles_in: usize,
    /// Dropped: triangles that were, after welding, without area (two corners in one place, or a
    /// height within the weld tolerance).
    pub n_degenerate: usize,
    /// Turned: triangles with three corners in a line, which became part of their neighbour so that
    /// no slit opens.
    pub n_turned: usize,
    /// Dropped: triangles that were there before, with the same corners and the same winding.
    pub n_duplicates: usize,
    /// Vertices that were taken together with another one at the same place.
    pub n_welded_vertices: usize,
    /// Edges with one triangle.
    pub n_open_edges: usize,
    /// Edges with three or more triangles.
    pub n_non_manifold_edges: usize,
    /// Edges with two triangles that are wound against each other.
    pub n_miswound_edges: usize,
    /// Components: triangles that hang together by edges.
    pub n_components: usize,
    /// Components that bound a volume.
    pub n_closed: usize,
    /// Closed components with a negative volume: wound inside out, unless they are cavities.
    pub n_inverted: usize,
    /// The components by their first triangle.
    pub components: Vec<Component>,
}

/// Welds, mends or drops triangles without area, drops duplicates, and analyses the rest.
pub(crate) fn repair(raw: RawMesh, settings: &ImportSettings) -> Result<(TriMesh, RepairReport), ImportFault> {
    let points: Vec<Point3<f64>> = raw.vertices.iter().map(|p| settings.to_mm(p)).collect();
    if let Some(k) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(ImportFault::NotFinite { place: format!("vertex {k}, turned into mm,") });
    }
    let tolerance = settings.weld_tolerance.max(0.0);
    let stands_for = weld(&points, tolerance);
    let welded: Vec<[u32; 3]> = raw.triangles.iter().map(|t| t.map(|v| stands_for[v as usize])).collect();
    let mut kept = Kept::default();
    kept.take(&welded, &raw.groups, |t| !is_flat(&points, t, tolerance) || all_differ(t));
    // Triangles with three corners in a line leave a slit when they are dropped, so these are
    // turned if possible.
    let mut solid = kept.triangles;
    let n_turned = turn_caps(&points, &mut solid, |t| is_flat(&points, t, tolerance));
    let groups = kept.groups;
    let mut kept = Kept { triangles: Vec::new(), groups: Vec::new(), ..kept };
    kept.seen.clear();
    kept.take(&solid, &groups, |t| !is_flat(&points, t, tolerance));
    if kept.triangles.is_empty() {
        return Err(ImportFault::Empty { n_degenerate: raw.triangles.len() });
    }
    let mut report = RepairReport {
        n_triangles_in: raw.triangles.len(),
        n_degenerate: kept.n_degenerate,
        n_turned,
        n_duplicates: kept.n_duplicates,
        n_welded_vertices: stands_for.iter().enumerate().filter(|&(k, &v)| v as usize != k).count(),
        ..RepairReport::default()
    };
    let mesh = compact(&points, kept)?;
    report.look_at(&mesh);
    Ok((mesh, report))
}

impl RepairReport {
    fn look_at(&mut self, mesh: &TriMesh) {
        let topology = Topology::of(mesh, &Edges::of(mesh));
        self.n_open_edges = topology.n_open_edges;
        self.n_non_manifold_edges = topology.n_non_manifold_edges;
        self.n_miswound_edges = topology.n_miswound_edges;
        self.components = topology.components;
        self.n_components = self.components.len();
        self.n_closed = self.components.iter().filter(|c| c.closed).count();
        self.n_inverted = self.components.iter().filter(|c| c.is_inverted()).count();
    }
}

fn all_differ([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// Returns whether a triangle's height over its longest side is within the tolerance (mm), or only
/// rounding.
fn is_flat(points: &[Point3<f64>], t: [u32; 3], tolerance: f64) -> bool {
    let [a, b, c] = t.map(|v| points[v as usize]);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let twice_area = (b - a).cross(&(c - a)).norm();
    // An area that overflows is useless for computing.
    let has_area = twice_area.is_finite() && twice_area > longest * tolerance.max(1e-12 * longest);
    !all_differ(t) || !has_area
}

/// Triangles that stay.
#[derive(Default)]
struct Kept {
    triangles: Vec<[u32; 3]>,
    groups: Vec<Group>,
    seen: HashSet<[u32; 3]>,
    n_degenerate: usize,
    n_duplicates: usize,
}

impl Kept {
    fn take(&mut self, triangles: &[[u32; 3]], groups: &[Group], is_good: impl Fn([u32; 3]) -> bool) {
        for g in groups {
            let start = self.triangles.len();
            for &t in &triangles[g.triangles.clone()] {
                if !is_good(t) {
                    self.n_degenerate += 1;
                } else if !self.seen.insert(lowest_first(t)) {
                    self.n_duplicates += 1;
                } else {
                    self.triangles.push(t);
                }
            }
            self.groups.push(Group { name: g.name.clone(), triangles: start..self.triangles.len() });
        }
    }
}

/// Returns the same triangle with its lowest vertex first.
fn lowest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Builds the mesh of the triangles that stay, with the vertices they use in the order of the file.
fn compact(points: &[Point3<f64>], kept: Kept) -> Result<TriMesh, ImportFault> {
    let mut place = vec![u32::MAX; points.len()];
    kept.triangles.iter().flatten().for_each(|&v| place[v as usize] = 0);
    let mut vertices = Vec::new();
    for (p, place) in points.iter().zip(&mut place) {
        if *place == 0 {
            *place = vertices.len() as u32;
            vertices.push(*p);
        }
    }
    let triangles = kept.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let groups = kept.groups.into_iter().filter(|g| !g.triangles.is_empty()).collect();
    TriMesh::with_groups(vertices, triangles, groups)
        .map_err(|e| ImportFault::Element { element: "the mended mesh".into(), message: e.to_string() })
}
