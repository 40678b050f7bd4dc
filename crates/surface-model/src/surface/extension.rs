//! Patches of a surface, continued beyond their border.

use std::collections::BTreeMap;

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::mesh::tri_mesh::{Group, MeshError, TriMesh};
use crate::surface::{Surface, SurfacePoint};

/// Largest turn of the border at a vertex that one direction spans, rad; corners that turn outward
/// by more become arcs of such steps.
const ARC_STEP: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// Number of places along the width at which it is tested whether it enters the material, and
/// largest number of rows of triangles.
const STEPS: u32 = 16;

/// Share of the way from a point to its foot by which it may lie behind the facet there and still
/// be outside of the material.
const BEHIND: f64 = 0.5;

/// Distance from the surface within which a place lies on it, mm.
const ON_SURFACE: f64 = 1e-6;

/// Share of the width at which a line is beyond the facets at its start.
const OFF_BORDER: f64 = 1e-3;

/// Most places along a side at which its strip is tested.
const MOST_BESIDE: f64 = 256.0;

/// Largest weight of a corner in a foot that lies on the opposite edge.
const ON_BORDER: f64 = 1e-9;

/// Least advance of the outer border along a side of the patch, as a share of the side's length:
/// less, and the strips of neighbours overlap.
const LEAST_ADVANCE: f64 = 0.05;

/// Rounds in which strips that overlap get narrower, and by how much.
const NARROWINGS: usize = 30;
const NARROWER: f64 = 0.7;

/// Side of a kept triangle on the patch's border, along which the patch continues. The patch lies
/// to the left of the way from the first vertex to the second.
struct BorderSide {
    vertices: [u32; 2],
    normals: [Unit<Vector3<f64>>; 2],
    /// Directions out of the patch at both vertices, along the tangent planes there.
    outward: [Unit<Vector3<f64>>; 2],
    /// Spokes at both vertices.
    spokes: [usize; 2],
}

/// Straight line from a vertex of the border out of the patch.
struct Spoke {
    vertex: u32,
    direction: Unit<Vector3<f64>>,
    width: f64,
}

impl Surface {
    /// Returns the triangles for which `keep` holds as a mesh of their own, continued beyond its
    /// border by `width` (mm, above 0) along the tangent planes there.
    ///
    /// The mesh has the vertices of this one and further ones behind them; its groups are those of
    /// this one, as far as triangles of them are kept, and `name` for the triangles beyond the
    /// border. Triangles without area are not kept.
    ///
    /// The patch does not continue where the tangent plane enters the material, toward a fillet or
    /// a wall, nor over other surface in its plane, and ends before it does, tested in sixteenths
    /// of the width along the lines and along the border, and by rays. Corners become arcs; where
    /// the border curves inward by a radius below the width, strips get narrower so that neighbours
    /// do not overlap: along a border that is a sawtooth of facets they are about as wide as its
    /// teeth. A closed surface has no border, and nothing beyond it.
    ///
    /// # Errors
    /// If the width is not finite, or takes a vertex beyond all numbers.
    pub fn extended(&self, keep: impl Fn(u32) -> bool, width: f64, name: &str) -> Result<TriMesh, MeshError> {
        if !width.is_finite() {
            return Err(MeshError::NotFinite { vertex: self.mesh.vertices().len() });
        }
        let material = Material { surface: self, vertex_normals: vertex_normals(&self.mesh), width };
        let kept: Vec<bool> =
            (0..self.mesh.triangles().len() as u32).map(|t| self.facet_normal(t).is_some() && keep(t)).collect();
        let mut sides: Vec<BorderSide> = self.border_of(&kept).filter(|side| material.is_free_beside(side)).collect();
        let (mut spokes, arcs) = joined_at_corners(&mut sides);
        for spoke in &mut spokes {
            let start = self.mesh.vertices()[spoke.vertex as usize];
            spoke.width = material.free_width(&start, &spoke.direction);
        }
        for side in &sides {
            let width = material.free_width_beside(side);
            side.spokes.iter().for_each(|&spoke| spokes[spoke].width = spokes[spoke].width.min(width));
        }
        self.narrow(&sides, &mut spokes);
        narrow_arcs(&arcs, &mut spokes);
        let length = |side: &BorderSide| (self.end(side, 1) - self.end(side, 0)).norm();
        let mean = sides.iter().map(length).sum::<f64>() / sides.len().max(1) as f64;
        let n_rows = (width / mean).ceil().clamp(1.0, f64::from(STEPS)) as u32;
        self.assembled(&kept, &Skirt { sides, spokes, arcs, n_rows }, name)
    }

    fn end(&self, side: &BorderSide, k: usize) -> Point3<f64> {
        self.mesh.vertices()[side.vertices[k] as usize]
    }

    /// Returns the sides of kept triangles without another such triangle, in mesh order.
    fn border_of<'s>(&'s self, kept: &'s [bool]) -> impl Iterator<Item = BorderSide> + 's {
        let sides = (0..kept.len()).filter(|&t| kept[t]).flat_map(|t| (0..3).map(move |k| (t as u32, k)));
        sides.filter_map(move |(t, k)| {
            let own = 3 * t + k as u32;
            let edge = self.edges().of_side(t, k)?;
            if self.edges().sides(edge).iter().any(|&side| side != own && kept[side as usize / 3]) {
                return None;
            }
            let (triangle, next) = (self.mesh.triangles()[t as usize], (k + 1) % 3);
            let vertices = [triangle[k], triangle[next]];
            let [a, b] = vertices.map(|v| self.mesh.vertices()[v as usize]);
            let facet = self.facet_normal(t)?;
            let normals = [k, next].map(|k| self.corner_normal(t, k).unwrap_or(facet));
            let [out_a, out_b] = normals.map(|normal| Unit::try_new((b - a).cross(&normal), 0.0));
            Some(BorderSide { vertices, normals, outward: [out_a?, out_b?], spokes: [0; 2] })
        })
    }

    /// Makes strips narrower where their outer border would run backward.
    fn narrow(&self, sides: &[BorderSide], spokes: &mut [Spoke]) {
        for _ in 0..NARROWINGS {
            let mut is_narrower = false;
            for side in sides {
                let [a, b] = [0, 1].map(|k| self.end(side, k));
                let [to_a, to_b] = [0, 1].map(|k| {
                    let spoke = &spokes[side.spokes[k]];
                    spoke.direction.into_inner() * spoke.width
                });
                let normal = side.normals[0].into_inner() + side.normals[1].into_inner();
                // The outer triangles of both diagonals.
                let turns = [(a + to_a - b).cross(&(b + to_b - b)), (a + to_a - a).cross(&(b + to_b - a))];
                let least = LEAST_ADVANCE * (b - a).norm() * to_a.norm().min(to_b.norm()) * normal.norm();
                if turns.iter().any(|turn| turn.dot(&normal) < least) {
                    side.spokes.iter().for_each(|&spoke| spokes[spoke].width *= NARROWER);
                    is_narrower = true;
                }
            }
            if !is_narrower {
                return;
            }
        }
    }

    fn assembled(&self, kept: &[bool], skirt: &Skirt, name: &str) -> Result<TriMesh, MeshError> {
        let (mut triangles, mut groups) = (Vec::new(), Vec::new());
        for group in self.mesh.groups() {
            let start = triangles.len();
            triangles.extend(group.triangles.clone().filter(|&t| kept[t]).map(|t| self.mesh.triangles()[t]));
            if triangles.len() > start {
                groups.push(Group { name: group.name.clone(), triangles: start..triangles.len() });
            }
        }
        let mut vertices = self.mesh.vertices().to_vec();
        let first = vertices.len() as u32;
        for spoke in &skirt.spokes {
            let start = vertices[spoke.vertex as usize];
            let place = |row: u32| f64::from(row) / f64::from(skirt.n_rows) * spoke.width;
            vertices.extend((1..=skirt.n_rows).map(|row| start + spoke.direction.into_inner() * place(row)));
        }
        let start = triangles.len();
        triangles.extend(skirt.triangles(first));
        if triangles.len() > start {
            groups.push(Group { name: name.to_owned(), triangles: start..triangles.len() });
        }
        TriMesh::with_groups(vertices, triangles, groups)
    }
}

/// Material that a patch must not be continued into.
struct Material<'s> {
    surface: &'s Surface,
    /// Normals at vertices: of the facets around them, weighted by their angles.
    vertex_normals: Vec<Vector3<f64>>,
    /// Largest width beyond the border, mm.
    width: f64,
}

impl Material<'_> {
    /// Returns whether the patch may continue beyond the middle of a side.
    fn is_free_beside(&self, side: &BorderSide) -> bool {
        let middle = nalgebra::center(&self.surface.end(side, 0), &self.surface.end(side, 1));
        let direction = side.outward[0].into_inner() + side.outward[1].into_inner();
        Unit::try_new(direction, 1e-9).is_some_and(|d| self.free_width(&middle, &d) > 0.0)
    }

    /// Returns the length of a line from a point of the border, at most the width, before it enters
    /// the material.
    fn free_width(&self, start: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> f64 {
        let along = |step: u32| self.width * f64::from(step) / f64::from(STEPS);
        let is_inside = |step: u32| {
            let p = start + direction.into_inner() * along(step);
            self.surface.closest_point(&p, f64::INFINITY).is_some_and(|foot| {
                let way = p - foot.position;
                let is_on = way.norm() <= ON_SURFACE;
                is_on || self.normal_at(&foot).is_some_and(|n| way.dot(&n) < -BEHIND * way.norm())
            })
        };
        // Thin walls lie between two steps.
        let off = OFF_BORDER * self.width;
        let wall = self.surface.ray(&(start + direction.into_inner() * off), direction, self.width - off);
        let to_wall = wall.map_or(f64::INFINITY, |hit| off + hit.point.distance);
        along((1..=STEPS).take_while(|&step| along(step) < to_wall && !is_inside(step)).count() as u32)
    }

    /// Returns the least free width along a side.
    fn free_width_beside(&self, side: &BorderSide) -> f64 {
        let [a, b] = [0, 1].map(|k| self.surface.end(side, k));
        let n = ((b - a).norm() * f64::from(STEPS) / self.width).ceil().clamp(1.0, MOST_BESIDE);
        let [from, to] = side.outward.map(Unit::into_inner);
        let places = (1..n as u32).map(|k| f64::from(k) / n);
        let widths = places.filter_map(|t| {
            let direction = Unit::try_new(from.lerp(&to, t), 1e-9)?;
            Some(self.free_width(&(a + (b - a) * t), &direction))
        });
        widths.fold(self.width, f64::min)
    }

    /// Returns the normal that tells the sides apart at a foot: of the facet, or of the facets
    /// around the edge or vertex that it lies on (Bærentzen and Aanæs 2005).
    fn normal_at(&self, foot: &SurfacePoint) -> Option<Unit<Vector3<f64>>> {
        let (mesh, edges) = (self.surface.mesh(), self.surface.edges());
        let own = self.surface.facet_normal(foot.triangle)?;
        let is_off = foot.barycentric.map(|weight| weight <= ON_BORDER);
        let corner = |k: usize| mesh.triangles()[foot.triangle as usize][k] as usize;
        let sum = match is_off {
            [false, false, false] => return Some(own),
            [false, true, true] => self.vertex_normals[corner(0)],
            [true, false, true] => self.vertex_normals[corner(1)],
            [true, true, false] => self.vertex_normals[corner(2)],
            _ => {
                // Side k runs from corner k to the next; the corner off it is the one behind both.
                let off = is_off.iter().position(|&off| off)?;
                let sides = edges.sides(edges.of_side(foot.triangle, (off + 1) % 3)?);
                let normals = sides.iter().filter_map(|&side| self.surface.facet_normal(side / 3));
                normals.fold(Vector3::zeros(), |sum, n| sum + n.into_inner())
            }
        };
        Some(Unit::try_new(sum, 1e-9).unwrap_or(own))
    }
}

/// Normals at vertices: those of the facets around them, weighted by their angles there.
fn vertex_normals(mesh: &TriMesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices().len()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        let Some(normal) = Unit::try_new(mesh.scaled_normal(t), 0.0) else { continue };
        let corners = mesh.corners(t);
        for (k, &vertex) in triangle.iter().enumerate() {
            let [to_next, to_last] = [1, 2].map(|step| corners[(k + step) % 3] - corners[k]);
            normals[vertex as usize] += normal.into_inner() * to_next.angle(&to_last);
        }
    }
    normals
}

/// Makes the spokes of an arc no longer than those at its ends, which strips have narrowed.
fn narrow_arcs(arcs: &[[usize; 2]], spokes: &mut [Spoke]) {
    for pairs in arcs.chunk_by(|a, b| a[1] == b[0]) {
        let of_arc = || pairs.iter().flatten().copied();
        let least = of_arc().map(|spoke| spokes[spoke].width).fold(f64::INFINITY, f64::min);
        of_arc().for_each(|spoke| spokes[spoke].width = least);
    }
}

/// Strips of triangles beyond the border of a patch.
struct Skirt {
    sides: Vec<BorderSide>,
    spokes: Vec<Spoke>,
    /// Pairs of neighbouring spokes at one vertex, counter-clockwise.
    arcs: Vec<[usize; 2]>,
    n_rows: u32,
}

impl Skirt {
    /// Returns the triangles, whose vertices beyond the border follow from `first`, spoke by spoke.
    fn triangles(&self, first: u32) -> Vec<[u32; 3]> {
        let vertex = |spoke: usize, row: u32| {
            let Spoke { vertex, width, .. } = self.spokes[spoke];
            if row == 0 || width <= 0.0 { vertex } else { first + spoke as u32 * self.n_rows + row - 1 }
        };
        let strips = self.sides.iter().map(|side| side.spokes).chain(self.arcs.iter().map(|&[from, to]| [from, to]));
        let mut triangles = Vec::new();
        for [from, to] in strips {
            for row in 0..self.n_rows {
                let [near, far] = [row, row + 1].map(|row| [vertex(from, row), vertex(to, row)]);
                let both = [[near[1], near[0], far[0]], [near[1], far[0], far[1]]];
                triangles.extend(both.into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
            }
        }
        triangles
    }
}

/// Gives the sides their spokes, common to both where two meet in a vertex, and returns the spokes
/// and the pairs of them that bound the steps of arcs.
fn joined_at_corners(sides: &mut [BorderSide]) -> (Vec<Spoke>, Vec<[usize; 2]>) {
    let mut meeting: BTreeMap<u32, [Vec<usize>; 2]> = BTreeMap::new();
    for (s, side) in sides.iter().enumerate() {
        for (k, vertex) in side.vertices.into_iter().enumerate() {
            meeting.entry(vertex).or_default()[k].push(s);
        }
    }
    let (mut spokes, mut arcs): (Vec<Spoke>, Vec<[usize; 2]>) = (Vec::new(), Vec::new());
    for (vertex, [starting, ending]) in meeting {
        let mut add = |direction: Unit<Vector3<f64>>| {
            spokes.push(Spoke { vertex, direction, width: 0.0 });
            spokes.len() - 1
        };
        let (&[out], &[into]) = (&*starting, &*ending) else {
            starting.iter().for_each(|&s| sides[s].spokes[0] = add(sides[s].outward[0]));
            ending.iter().for_each(|&s| sides[s].spokes[1] = add(sides[s].outward[1]));
            continue;
        };
        let directions = corner(&sides[into], &sides[out]);
        let all: Vec<usize> = directions.into_iter().map(&mut add).collect();
        (sides[into].spokes[1], sides[out].spokes[0]) = (all[0], all[all.len() - 1]);
        arcs.extend(all.windows(2).map(|pair| [pair[0], pair[1]]));
    }
    (spokes, arcs)
}

/// Returns the directions of the spokes where one side ends and the next begins: one, or those of
/// an arc around a corner that turns outward.
fn corner(into: &BorderSide, out: &BorderSide) -> Vec<Unit<Vector3<f64>>> {
    let (from, to) = (into.outward[1].into_inner(), out.outward[0].into_inner());
    let normal = into.normals[1].into_inner() + out.normals[0].into_inner();
    let Some(normal) = Unit::try_new(normal, 1e-9) else { return vec![into.outward[1], out.outward[0]] };
    let turn = from.cross(&to).dot(&normal).atan2(from.dot(&to));
    if turn <= ARC_STEP {
        return vec![Unit::try_new(from + to, 1e-9).unwrap_or(into.outward[1])];
    }
    let n = (turn / ARC_STEP).ceil();
    let between = (1..n as u32).map(|k| Rotation3::from_axis_angle(&normal, turn * f64::from(k) / n) * into.outward[1]);
    std::iter::once(into.outward[1]).chain(between).chain([out.outward[0]]).collect()
}

#[cfg(test)]
#[path = "../../tests/unit/surface/extension.rs"]
mod tests;
