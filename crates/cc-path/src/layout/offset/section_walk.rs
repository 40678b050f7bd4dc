use nalgebra::{Point3, Unit, Vector3};

use crate::distance::patch_vertices::PatchVertices;
use crate::strategy::patch::Patch;

/// Most triangles that a walk crosses.
const MOST_STEPS: usize = 100_000;

/// Section of a patch by a plane, from a place of it to one side, triangle by triangle.
///
/// Vertices on the plane count as above it, so that every triangle on the way has one side to enter
/// and one to leave by. It ends at the border of the patch, and at edges where more than two
/// triangles meet.
pub(crate) struct SectionWalk<'a> {
    patch: &'a Patch<'a>,
    through: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    /// Triangle that is crossed next, and the side by which the walk leaves it.
    next: Option<(u32, usize)>,
    position: Point3<f64>,
    way: f64,
    n_steps: usize,
}

/// Place at which a walk leaves a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WalkStep {
    pub(crate) position: Point3<f64>,
    /// The triangle that was crossed.
    pub(crate) triangle: u32,
    /// Length of the walk so far, mm.
    pub(crate) way: f64,
}

impl<'a> SectionWalk<'a> {
    /// Begins at a vertex; `None` where the plane leads into no triangle `toward` that side.
    pub(crate) fn from_vertex(
        patch: &'a Patch<'a>,
        vertices: &PatchVertices,
        vertex: u32,
        normal: Unit<Vector3<f64>>,
        toward: &Vector3<f64>,
    ) -> Option<Self> {
        let opposite = |&t: &u32| {
            let corners = patch.mesh.triangles()[t as usize];
            Some((t, (corners.iter().position(|&v| v == vertex)? + 1) % 3))
        };
        let exits = vertices.triangles(vertex).iter().filter_map(opposite);
        Self::by_best(patch, patch.mesh.vertices()[vertex as usize], normal, toward, exits, 0.0)
    }

    /// Begins at a place of a triangle, in a plane moved a millionth toward its middle, so that it
    /// never runs along a side.
    pub(crate) fn from_place(
        patch: &'a Patch<'a>,
        triangle: u32,
        place: Point3<f64>,
        normal: Unit<Vector3<f64>>,
        toward: &Vector3<f64>,
    ) -> Option<Self> {
        let [a, b, c] = patch.mesh.corners(triangle as usize);
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let inside = place + (middle - place) * 1e-6;
        Self::by_best(patch, inside, normal, toward, (0..3).map(|k| (triangle, k)), f64::NEG_INFINITY)
    }

    /// Leaves by the exit that lies farthest on the side, and more than `least` (mm).
    fn by_best(
        patch: &'a Patch<'a>,
        place: Point3<f64>,
        normal: Unit<Vector3<f64>>,
        toward: &Vector3<f64>,
        exits: impl Iterator<Item = (u32, usize)>,
        least: f64,
    ) -> Option<Self> {
        let mut this = Self { patch, through: place, normal, next: None, position: place, way: 0.0, n_steps: 0 };
        let ahead = |&(t, k): &(u32, usize)| Some((this.crossing(t, k)? - place).dot(toward));
        let best = exits.filter_map(|exit| Some((exit, ahead(&exit)?))).filter(|(_, ahead)| *ahead > least);
        this.next = Some(best.reduce(|a, b| if b.1 > a.1 { b } else { a })?.0);
        Some(this)
    }

    fn height(&self, vertex: u32) -> f64 {
        self.normal.dot(&(self.patch.mesh.vertices()[vertex as usize] - self.through))
    }

    /// Where the plane crosses a side.
    fn crossing(&self, triangle: u32, side: usize) -> Option<Point3<f64>> {
        let corners = self.patch.mesh.triangles()[triangle as usize];
        let [a, b] = [corners[side], corners[(side + 1) % 3]];
        let [ha, hb] = [a, b].map(|v| self.height(v));
        if (ha >= 0.0) == (hb >= 0.0) {
            return None;
        }
        let [a, b] = [a, b].map(|v| self.patch.mesh.vertices()[v as usize]);
        Some(a + (b - a) * (ha / (ha - hb)))
    }

    /// Triangle behind a side, and the side by which the plane leaves it.
    fn behind(&self, (triangle, side): (u32, usize)) -> Option<(u32, usize)> {
        let (next, entry) = self.patch.edges.across(&self.patch.mesh, triangle, side)?;
        let corners = self.patch.mesh.triangles()[next as usize];
        let is_above = |k: usize| self.height(corners[k % 3]) >= 0.0;
        let exit = if is_above(entry + 1) == is_above(entry + 2) { entry + 2 } else { entry + 1 };
        Some((next, exit % 3))
    }
}

impl Iterator for SectionWalk<'_> {
    type Item = WalkStep;

    fn next(&mut self) -> Option<WalkStep> {
        let (triangle, side) = self.next?;
        let position = self.crossing(triangle, side)?;
        self.way += (position - self.position).norm();
        self.position = position;
        self.n_steps += 1;
        self.next = if self.n_steps < MOST_STEPS { self.behind((triangle, side)) } else { None };
        Some(WalkStep { position, triangle, way: self.way })
    }
}
