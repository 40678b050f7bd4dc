mod left_border;
mod surface_side;

use std::collections::BTreeMap;

use facemill_cl_data::Aabb;
use facemill_surface_model::{CurvatureTensor, Edges, Surface, SurfacePoint, TriMesh};
use nalgebra::{Point3, Unit, Vector3};

use crate::error::PathError;
use crate::region::{Region, triangles_of};
use crate::sections::Sections;
use crate::strategy::size::{MAX_PIECES, check_pieces};

/// The region as a mesh of its own, every point of which lies on the drive surface: triangles cut
/// at the box, and cut up so finely that levels are as good as linear along every edge and widths
/// as good as constant.
pub(crate) struct Patch<'a> {
    /// The surface it is a part of.
    pub(crate) surface: &'a Surface,
    /// Its triangles.
    pub(crate) mesh: TriMesh,
    /// How they hang together.
    pub(crate) edges: Edges,
    /// Level of each vertex; empty where no sections give it.
    pub(crate) levels: Vec<f64>,
    /// The triangle of the surface that each triangle is a piece of.
    parents: Vec<u32>,
}

/// How finely a patch is cut up.
pub(crate) struct Fineness {
    /// Longest edge, mm.
    pub(crate) max_edge: f64,
    /// Largest difference between the level at the middle of an edge and the mean of its ends, mm.
    pub(crate) max_bend: f64,
    /// Whether triangles are cut at the ends of the sections' range; else they may reach beyond
    /// them.
    pub(crate) cuts_range: bool,
}

/// Edges are halved at most this often. Twelve halvings bring an edge of 4 m below 1 mm; where a
/// cylinder's axis pierces the surface no number is enough, and the levels there are cut as finely
/// as this allows.
const MAX_ROUNDS: usize = 12;

/// Distance of a cut from the end of a region's range, where a patch asks for no limit, mm.
const COARSEST_BEND: f64 = 0.05;

impl<'a> Patch<'a> {
    /// # Errors
    /// When the region is empty, names an unknown group, or would fall into too many pieces.
    pub(crate) fn new(
        surface: &'a Surface,
        region: &Region,
        sections: Option<&Sections>,
        fineness: &Fineness,
    ) -> Result<Self, PathError> {
        let mut cut = Pieces::of(surface, &triangles_of(surface, region)?);
        if let Some(bounds) = &region.bounds {
            cut.clip(bounds);
        }
        if let Some(between) = &region.between {
            cut.keep_between(between, fineness.max_bend)?;
        }
        if let Some(left) = &region.left {
            cut.keep_left(surface, left, MAX_PIECES)?;
        }
        if let Some(sections) = sections {
            cut.keep_range(sections);
        }
        let corners = cut.triangles.iter().map(|t| t.map(|v| cut.vertices[v as usize]));
        check_pieces(corners, sections, fineness)?;
        for _ in 0..MAX_ROUNDS {
            if !cut.halve_edges(|a, b| fineness.asks_to_halve(sections, a, b)) {
                break;
            }
        }
        if let Some(sections) = sections.filter(|_| fineness.cuts_range) {
            cut.clip_range(sections);
        }
        if cut.triangles.is_empty() {
            return Err(PathError::EmptyRegion { reason: "none lies within box and levels" });
        }
        Self::of_pieces(surface, cut, sections)
    }

    fn of_pieces(surface: &'a Surface, cut: Pieces, sections: Option<&Sections>) -> Result<Self, PathError> {
        let Pieces { vertices, triangles, parents } = cut;
        let levels = sections.map_or_else(Vec::new, |s| vertices.iter().map(|p| s.level(p)).collect());
        let mesh = TriMesh::new(vertices, triangles)
            .map_err(|_| PathError::EmptyRegion { reason: "its coordinates are not finite" })?;
        let edges = Edges::of(&mesh);
        Ok(Self { surface, mesh, edges, levels, parents })
    }

    /// The vertex with the highest or lowest level and its normal, where it is not on a border.
    pub(crate) fn pole(&self, highest: bool) -> Option<(Point3<f64>, Unit<Vector3<f64>>)> {
        let sign = if highest { -1.0 } else { 1.0 };
        let corners = || self.mesh.triangles().iter().enumerate().flat_map(|(t, v)| v.map(|v| (t as u32, v)));
        let by_level = |a: &(u32, u32), b: &(u32, u32)| {
            let [a, b] = [a, b].map(|c| sign * self.levels[c.1 as usize]);
            a.total_cmp(&b)
        };
        let (triangle, pole) = corners().min_by(by_level)?;
        let mut border = (0..self.edges.len() as u32).filter(|&e| self.edges.sides(e).len() == 1);
        if border.any(|e| self.edges.vertices(e).contains(&pole)) {
            return None;
        }
        let at = self.mesh.vertices()[pole as usize];
        Some((at, self.normal(triangle, &at)))
    }

    /// Refines the patch around a vertex until the triangles there have sides of at most `radius`,
    /// and takes them out.
    ///
    /// # Errors
    /// When nothing is left.
    pub(crate) fn open_at(self, at: &Point3<f64>, radius: f64, sections: &Sections) -> Result<Self, PathError> {
        let Self { surface, mesh, parents, .. } = self;
        let mut cut = Pieces { vertices: mesh.vertices().to_vec(), triangles: mesh.triangles().to_vec(), parents };
        // Edges may grow with the distance, so that the triangles stay well shaped.
        let most = |a: &Point3<f64>, b: &Point3<f64>| {
            radius.max(0.5 * nalgebra::distance(a, at).min(nalgebra::distance(b, at)))
        };
        for _ in 0..MAX_ROUNDS {
            if !cut.halve_edges(|a, b| nalgebra::distance(a, b) > most(a, b)) {
                break;
            }
        }
        let keep: Vec<bool> =
            cut.triangles.iter().map(|t| t.iter().all(|&v| cut.vertices[v as usize] != *at)).collect();
        cut.keep(&keep);
        if cut.triangles.is_empty() {
            return Err(PathError::EmptyRegion { reason: "none is left around its lowest or highest place" });
        }
        Self::of_pieces(surface, cut, Some(sections))
    }

    /// The triangle of the surface that a triangle of the patch is a piece of.
    pub(crate) fn parent(&self, triangle: u32) -> u32 {
        self.parents[triangle as usize]
    }

    /// Normal of the smooth surface at a point of a triangle of the patch.
    pub(crate) fn normal(&self, triangle: u32, p: &Point3<f64>) -> Unit<Vector3<f64>> {
        let parent = self.parents[triangle as usize];
        let barycentric = barycentric(p, &self.surface.mesh().corners(parent as usize));
        self.surface.normal_at(&SurfacePoint { position: *p, triangle: parent, barycentric, distance: 0.0 })
    }

    /// Sum of weighted normals that gives the normal of the smooth surface its direction.
    pub(crate) fn normal_sum(&self, triangle: u32, p: &Point3<f64>) -> Vector3<f64> {
        let parent = self.parents[triangle as usize];
        let weights = barycentric(p, &self.surface.mesh().corners(parent as usize));
        let facet = self.surface.facet_normal(parent);
        let of_corner = |k: usize| self.surface.corner_normal(parent, k).or(facet).map(Unit::into_inner);
        (0..3).filter_map(|k| Some(of_corner(k)? * weights[k])).sum()
    }

    /// Curvature of the smooth surface at a point of a triangle of the patch.
    pub(crate) fn curvature(&self, triangle: u32, p: &Point3<f64>) -> Option<CurvatureTensor> {
        let parent = self.parents[triangle as usize];
        let barycentric = barycentric(p, &self.surface.mesh().corners(parent as usize));
        self.surface.curvature_at(&SurfacePoint { position: *p, triangle: parent, barycentric, distance: 0.0 })
    }

    /// Normal of the facet that a triangle of the patch is a piece of.
    pub(crate) fn facet_normal(&self, triangle: u32) -> Option<Unit<Vector3<f64>>> {
        self.surface.facet_normal(self.parents[triangle as usize])
    }

    /// Least height of that facet over its longest side: near 0 for a sliver, whose normal means
    /// little.
    pub(crate) fn facet_shape(&self, triangle: u32) -> f64 {
        let parent = self.parents[triangle as usize] as usize;
        let [a, b, c] = self.surface.mesh().corners(parent);
        let longest_sq = [b - a, c - b, a - c].iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        self.surface.mesh().scaled_normal(parent).norm() / longest_sq
    }
}

impl Fineness {
    fn asks_to_halve(&self, sections: Option<&Sections>, a: &Point3<f64>, b: &Point3<f64>) -> bool {
        nalgebra::distance_squared(a, b) > self.max_edge * self.max_edge
            || sections.is_some_and(|s| s.bend(a, b) > self.max_bend)
    }
}

/// Weights of the corners at the point of the triangle's plane below `p`, not negative and of
/// sum 1.
fn barycentric(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> [f64; 3] {
    let (e, f) = (b - a, c - a);
    let n = e.cross(&f);
    let n_sq = n.norm_squared();
    if n_sq == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let d = p - a;
    // Written so that NaN, from products that overflow, counts as 0.
    let within = |share: f64, most: f64| if share > 0.0 { share.min(most) } else { 0.0 };
    let v = within(d.cross(&f).dot(&n) / n_sq, 1.0);
    let w = within(e.cross(&d).dot(&n) / n_sq, 1.0 - v);
    [1.0 - v - w, v, w]
}

/// Triangles being cut. Vertices on a cut edge are shared by the triangles on both sides, so
/// nothing comes apart.
struct Pieces {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    parents: Vec<u32>,
}

impl Pieces {
    fn of(surface: &Surface, parents: &[u32]) -> Self {
        let mesh = surface.mesh();
        let mut new_index = vec![u32::MAX; mesh.vertices().len()];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::with_capacity(parents.len()));
        for &t in parents {
            triangles.push(mesh.triangles()[t as usize].map(|v| {
                let index = &mut new_index[v as usize];
                if *index == u32::MAX {
                    *index = vertices.len() as u32;
                    vertices.push(mesh.vertices()[v as usize]);
                }
                *index
            }));
        }
        Self { vertices, triangles, parents: parents.to_vec() }
    }

    /// Cuts off what lies outside the box.
    fn clip(&mut self, bounds: &Aabb) {
        for k in 0..3 {
            if bounds.min[k].is_finite() {
                self.clip_below(|p| p[k] - bounds.min[k]);
            }
            if bounds.max[k].is_finite() {
                self.clip_below(|p| bounds.max[k] - p[k]);
            }
        }
    }

    /// Cuts off what has a negative `height`, which is linear.
    fn clip_below(&mut self, height: impl Fn(&Point3<f64>) -> f64) {
        let heights = self.vertices.iter().map(&height).collect();
        self.clip_by(heights);
    }

    /// Cuts off what is negative by values at the vertices, linear between them.
    fn clip_by(&mut self, heights: Vec<f64>) {
        let mut cuts = BTreeMap::new();
        let (mut triangles, mut parents) = (Vec::new(), Vec::new());
        for (t, &parent) in self.triangles.iter().zip(&self.parents) {
            let mut polygon: Vec<u32> = Vec::with_capacity(4);
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let (ha, hb) = (heights[a as usize], heights[b as usize]);
                if ha >= 0.0 {
                    polygon.push(a);
                }
                if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
                    polygon.push(cut_vertex(&mut self.vertices, &mut cuts, a, b, &heights));
                }
            }
            for k in 2..polygon.len() {
                triangles.push([polygon[0], polygon[k - 1], polygon[k]]);
                parents.push(parent);
            }
        }
        self.triangles = triangles;
        self.parents = parents;
    }

    /// Cuts off what is outside the range, where levels between vertices are as good as linear.
    fn clip_range(&mut self, sections: &Sections) {
        let (low, high) = sections.range();
        if low.is_finite() {
            self.clip_below(|p| sections.level(p) - low);
        }
        if high.is_finite() {
            self.clip_below(|p| high - sections.level(p));
        }
    }

    /// Cuts off what is outside the range, by straight lines no farther than `max_bend` from it.
    ///
    /// # Errors
    /// When it would fall into too many pieces.
    fn keep_between(&mut self, sections: &Sections, max_bend: f64) -> Result<(), PathError> {
        // Samples of a region are cut no more finely than this, mm.
        let max_bend = max_bend.min(COARSEST_BEND);
        self.keep_range(sections);
        if !sections.is_linear() {
            let (low, high) = sections.range();
            let asks = |a: &Point3<f64>, b: &Point3<f64>| {
                let (level, way) = (sections.level(a), nalgebra::distance(a, b));
                // The chord of an arc of this radius is so far from it. A triangle that an end
                // crosses comes within its longest edge of it.
                let is_rough = |end: f64| (level - end).abs() <= way && way * way > 8.0 * end * max_bend;
                [low, high].into_iter().any(|end| end > 0.0 && is_rough(end))
            };
            for _ in 0..MAX_ROUNDS {
                if !self.halve_edges(asks) {
                    break;
                }
                if self.triangles.len() > MAX_PIECES {
                    return Err(PathError::Setting {
                        setting: "region.between",
                        value: if high.is_finite() { high } else { low },
                        range: "no radius at which the surface itself runs along the cylinder",
                    });
                }
            }
        }
        self.clip_range(sections);
        Ok(())
    }

    /// Leaves out triangles that surely have no level of the strategy's range.
    fn keep_range(&mut self, sections: &Sections) {
        let (low, high) = sections.range();
        let levels: Vec<f64> = self.vertices.iter().map(|p| sections.level(p)).collect();
        let keep: Vec<bool> = self
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| self.vertices[v as usize]);
                let of = t.map(|v| levels[v as usize]);
                // The level changes by at most the way: inside the triangle it can be lower than at
                // every corner.
                let reach = if sections.is_linear() { 0.0 } else { (b - a).norm().max((c - a).norm()) };
                of.iter().any(|&l| l >= low) && of.iter().any(|&l| l - reach <= high)
            })
            .collect();
        self.keep(&keep);
    }

    /// Keeps the triangles for which it is true.
    fn keep(&mut self, keep: &[bool]) {
        let mut kept = keep.iter();
        self.triangles.retain(|_| *kept.next().unwrap_or(&true));
        let mut kept = keep.iter();
        self.parents.retain(|_| *kept.next().unwrap_or(&true));
    }

    /// Halves every edge for which `asks` holds, and cuts the triangles at them accordingly.
    /// Returns whether there was any.
    fn halve_edges(&mut self, asks: impl Fn(&Point3<f64>, &Point3<f64>) -> bool) -> bool {
        self.halve_edges_of(|_, a, b| asks(a, b))
    }

    /// Does the same, where `asks` also knows the triangle of the surface that the edge is on: on
    /// that of either side it may hold.
    fn halve_edges_of(&mut self, asks: impl Fn(u32, &Point3<f64>, &Point3<f64>) -> bool) -> bool {
        let mut middles = BTreeMap::new();
        for (t, &parent) in self.triangles.iter().zip(&self.parents) {
            for k in 0..3 {
                let key = ordered(t[k], t[(k + 1) % 3]);
                let [a, b] = [self.vertices[key.0 as usize], self.vertices[key.1 as usize]];
                if asks(parent, &a, &b) {
                    middles.entry(key).or_insert_with(|| {
                        self.vertices.push(nalgebra::center(&a, &b));
                        self.vertices.len() as u32 - 1
                    });
                }
            }
        }
        if middles.is_empty() {
            return false;
        }
        let (mut triangles, mut parents) = (Vec::new(), Vec::new());
        for (t, &parent) in self.triangles.iter().zip(&self.parents) {
            let middle = |k: usize| middles.get(&ordered(t[k], t[(k + 1) % 3])).copied();
            let before = triangles.len();
            split(*t, [middle(0), middle(1), middle(2)], &mut triangles);
            parents.resize(parents.len() + triangles.len() - before, parent);
        }
        self.triangles = triangles;
        self.parents = parents;
        true
    }
}

/// The pieces of a triangle whose side k (from corner k to k + 1) is halved at `middles[k]`.
fn split(t: [u32; 3], middles: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
    let turned = |k: usize| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
    match middles {
        [None, None, None] => out.push(t),
        [Some(m), None, None] => split_one(turned(0), m, out),
        [None, Some(m), None] => split_one(turned(1), m, out),
        [None, None, Some(m)] => split_one(turned(2), m, out),
        [Some(m), Some(n), None] => split_two(turned(0), m, n, out),
        [None, Some(m), Some(n)] => split_two(turned(1), m, n, out),
        [Some(n), None, Some(m)] => split_two(turned(2), m, n, out),
        [Some(l), Some(m), Some(n)] => out.extend([[t[0], l, n], [l, t[1], m], [n, m, t[2]], [l, m, n]]),
    }
}

fn split_one([a, b, c]: [u32; 3], ab: u32, out: &mut Vec<[u32; 3]>) {
    out.extend([[a, ab, c], [ab, b, c]]);
}

fn split_two([a, b, c]: [u32; 3], ab: u32, bc: u32, out: &mut Vec<[u32; 3]>) {
    out.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]);
}

fn ordered(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn cut_vertex(
    vertices: &mut Vec<Point3<f64>>,
    cuts: &mut BTreeMap<(u32, u32), u32>,
    a: u32,
    b: u32,
    heights: &[f64],
) -> u32 {
    let (a, b) = ordered(a, b);
    *cuts.entry((a, b)).or_insert_with(|| {
        let (ha, hb) = (heights[a as usize], heights[b as usize]);
        let (p, q) = (vertices[a as usize], vertices[b as usize]);
        vertices.push(p + (q - p) * (ha / (ha - hb)));
        vertices.len() as u32 - 1
    })
}

#[cfg(test)]
#[path = "../../tests/unit/strategy/patch.rs"]
mod tests;
