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
    next: Option<ExitSide>,
    position: Point3<f64>,
    way: f64,
    n_steps: usize,
}

/// Side by which a walk leaves the triangle that it crosses next.
#[derive(Clone, Copy, Debug)]
struct ExitSide {
    triangle: u32,
    side: usize,
    /// Its ends: one below the plane, one above or on it.
    ends: [u32; 2],
    /// Their heights above the plane, mm.
    heights: [f64; 2],
}

/// Place at which a walk leaves a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WalkStep {
    pub(crate) position: Point3<f64>,
    /// The triangle that was crossed.
    pub(crate) triangle: u32,
    /// Length of the walk so far, mm.
    pub(crate) way: f64,
    /// Ends of the side that it leaves by, the lower index first: the same for the triangle behind.
    pub(crate) edge: [u32; 2],
    /// Share of the way from the first of them to the second.
    pub(crate) share: f64,
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
        let ahead = |exit: &ExitSide| (this.crossing(exit) - place).dot(toward);
        let exits = exits.filter_map(|(triangle, side)| this.exit(triangle, side));
        let best = exits.map(|exit| (exit, ahead(&exit))).filter(|(_, ahead)| *ahead > least);
        this.next = Some(best.reduce(|a, b| if b.1 > a.1 { b } else { a })?.0);
        Some(this)
    }

    fn height(&self, vertex: u32) -> f64 {
        self.normal.dot(&(self.patch.mesh.vertices()[vertex as usize] - self.through))
    }

    /// A side of a triangle, if the plane crosses it.
    fn exit(&self, triangle: u32, side: usize) -> Option<ExitSide> {
        let corners = self.patch.mesh.triangles()[triangle as usize];
        let ends = [corners[side], corners[(side + 1) % 3]];
        let heights = ends.map(|v| self.height(v));
        is_crossed(heights).then_some(ExitSide { triangle, side, ends, heights })
    }

    /// Where the plane crosses a side.
    fn crossing(&self, exit: &ExitSide) -> Point3<f64> {
        let [a, b] = exit.ends.map(|v| self.patch.mesh.vertices()[v as usize]);
        let [ha, hb] = exit.heights;
        a + (b - a) * (ha / (ha - hb))
    }

    /// Side by which the plane leaves the triangle behind a side.
    fn behind(&self, exit: &ExitSide) -> Option<ExitSide> {
        let (triangle, entry) = self.patch.edges.across(&self.patch.mesh, exit.triangle, exit.side)?;
        // Its side runs the other way.
        let ([end, start], [height_of_end, height_of_start]) = (exit.ends, exit.heights);
        let apex = self.patch.mesh.triangles()[triangle as usize][(entry + 2) % 3];
        let height = self.height(apex);
        let (side, ends, heights) = if is_crossed([height_of_end, height]) {
            ((entry + 1) % 3, [end, apex], [height_of_end, height])
        } else {
            ((entry + 2) % 3, [apex, start], [height, height_of_start])
        };
        Some(ExitSide { triangle, side, ends, heights })
    }
}

/// Whether one end of a side is below a plane, and one above or on it.
fn is_crossed([a, b]: [f64; 2]) -> bool {
    (a >= 0.0) != (b >= 0.0)
}

impl Iterator for SectionWalk<'_> {
    type Item = WalkStep;

    fn next(&mut self) -> Option<WalkStep> {
        let exit = self.next?;
        let position = self.crossing(&exit);
        self.way += (position - self.position).norm();
        self.position = position;
        self.n_steps += 1;
        self.next = if self.n_steps < MOST_STEPS { self.behind(&exit) } else { None };
        let ([a, b], [ha, hb]) = (exit.ends, exit.heights);
        let (edge, share) = if a < b { ([a, b], ha / (ha - hb)) } else { ([b, a], hb / (hb - ha)) };
        Some(WalkStep { position, triangle: exit.triangle, way: self.way, edge, share })
    }
}
