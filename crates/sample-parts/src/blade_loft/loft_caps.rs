//! Tip and root of a lofted blade.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Unit, Vector3, center};

use crate::blade_loft::endwalls::RevolvedWall;
use crate::grouped_mesh::GroupedMesh;

/// Rounds in which the facets of an end are halved.
const MOST_ROUNDS: usize = 40;

/// Height over the longest side below which a facet is avoided. Larger: well-shaped ends get longer
/// lines across. Smaller: facets between three points of a flat edge, which other facets cut.
const THIN: f64 = 0.01;

/// Vertex data that a mesh has beside its triangles.
#[derive(Default)]
pub(crate) struct MeshInWork {
    /// Normal of each vertex.
    pub(crate) normals: Vec<Unit<Vector3<f64>>>,
    /// Natural coordinates of the blade's vertices.
    pub(crate) coordinates: Vec<[f64; 2]>,
    /// Largest distance of the surface from the facets.
    pub(crate) chord: f64,
}

/// Closes a row of vertices between two of its columns: both ways from one to the other are joined
/// by triangles, each with the shorter of the next lines across. Wound counter-clockwise as the row
/// is, or the other way.
pub(crate) fn close_row(mesh: &mut GroupedMesh, group: usize, row: &[u32], [from, to]: [usize; 2], is_reversed: bool) {
    let n = row.len();
    let n_onward = (to + n - from) % n;
    let onward = |k: usize| row[(from + k) % n];
    let backward = |k: usize| row[(from + n - k % n) % n];
    let n_backward = n - n_onward;
    let (mut i, mut j) = (0, 0);
    while i < n_onward || j < n_backward {
        // The common end comes last of both ways: before, a flat edge there would be one line.
        let is_open = i < n_onward && (i + 1 < n_onward || j + 1 >= n_backward);
        let is_backward_open = j < n_backward && (j + 1 < n_backward || i + 1 >= n_onward);
        let across = [[onward(i + 1), backward(j)], [onward(i), backward(j + 1)]];
        let is_thin = |third: u32| is_thin(&[onward(i), backward(j), third].map(|v| mesh.point(v)));
        let [first, second] = [is_thin(across[0][0]), is_thin(across[1][1])];
        let is_nearer = mesh.distance_sq(across[0][0], across[0][1]) <= mesh.distance_sq(across[1][0], across[1][1]);
        let advances = is_open && (!is_backward_open || if first == second { is_nearer } else { second });
        let [a, b, c] = if advances {
            i += 1;
            [onward(i - 1), onward(i), backward(j)]
        } else {
            j += 1;
            [onward(i), backward(j), backward(j - 1)]
        };
        mesh.triangle(group, if is_reversed { [a, c, b] } else { [a, b, c] });
    }
}

/// Whether a facet has as good as no height over its longest side.
fn is_thin([a, b, c]: &[Point3<f64>; 3]) -> bool {
    let longest_sq = [b - a, c - b, a - c].map(|side| side.norm_squared()).into_iter().fold(0.0, f64::max);
    (b - a).cross(&(c - a)).norm() <= THIN * longest_sq
}

/// Halves the sides between facets of an end that are farther than a tolerance from its wall, and
/// puts their middles on it. The end's border stays. Without a wall nothing changes.
pub(crate) fn lay_on_wall(
    mesh: &mut GroupedMesh,
    group: usize,
    wall: Option<&RevolvedWall>,
    tolerance: f64,
    made: &mut MeshInWork,
) {
    let Some(wall) = wall else { return };
    // Half the tolerance: the border of the end has its own distance.
    let limit = 0.5 * tolerance;
    for _ in 0..MOST_ROUNDS {
        let marked = far_sides(mesh, group, wall, limit);
        if marked.is_empty() {
            break;
        }
        let mut is_cut = BTreeSet::new();
        let mut middles = BTreeMap::new();
        for (side, [first, second]) in marked {
            if is_cut.contains(&first) || is_cut.contains(&second) {
                continue;
            }
            is_cut.extend([first, second]);
            let [a, b] = side.map(|v| mesh.point(v));
            let [p, q] = [a, b].map(|p| wall.place(&p));
            let middle = wall.point([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])], 0.0);
            // The blade is on the wall's good side, so that its end faces the other way.
            let normal = wall.normal(&middle);
            made.normals.push(-normal);
            middles.insert(side, mesh.vertex(middle));
        }
        split(mesh.triangles_mut(group), &middles);
    }
    let left = far_sides(mesh, group, wall, 0.0);
    let off = left.keys().map(|side| wall.height(&middle_of(mesh, side)).abs()).fold(0.0, f64::max);
    made.chord = made.chord.max(off);
}

fn middle_of(mesh: &GroupedMesh, [a, b]: &[u32; 2]) -> Point3<f64> {
    center(&mesh.point(*a), &mesh.point(*b))
}

/// Sides between two facets of a group whose middle is farther from the wall than a limit, with
/// their facets.
fn far_sides(mesh: &mut GroupedMesh, group: usize, wall: &RevolvedWall, limit: f64) -> BTreeMap<[u32; 2], [usize; 2]> {
    let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (t, [a, b, c]) in mesh.triangles_mut(group).iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            sides.entry([*p.min(q), *p.max(q)]).or_default().push(t);
        }
    }
    let inner = sides.into_iter().filter_map(|(side, facets)| Some((side, <[usize; 2]>::try_from(facets).ok()?)));
    inner.filter(|(side, _)| wall.height(&middle_of(mesh, side)).abs() > limit).collect()
}

/// Divides each triangle with a new middle on one of its sides.
fn split(triangles: &mut Vec<[u32; 3]>, middles: &BTreeMap<[u32; 2], u32>) {
    for t in 0..triangles.len() {
        let corners = triangles[t];
        for k in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
            if let Some(&middle) = middles.get(&[a.min(b), a.max(b)]) {
                triangles[t] = [a, middle, c];
                triangles.push([middle, b, c]);
            }
        }
    }
}
