use nalgebra::{Point3, Rotation3, Unit, Vector3};
use rayon::prelude::*;

use crate::distance::curve_distance::{CurveDistance, CurveFoot};
use crate::distance::patch_vertices::{PatchVertices, on_edge};
use crate::distance::source_curve::SourceCurve;
use crate::layout::scallop::surface_path::{SurfacePath, trace_zero};
use crate::layout::section_walk::SectionWalk;
use crate::strategy::patch::Patch;

/// Distance estimates may be so much too short, as a share: feet are looked for so much farther.
const ESTIMATE: f64 = 1.15;

/// A walk that ends at a border so near to the line, as a share of the distance, has reached it.
const AT_LINE: f64 = 0.1;

/// Leans of the planes that a walk is tried in, rad. The first is straight across the line; the
/// next two come off a border that runs across; the others, off one that runs aslant.
const LEANS: [f64; 9] = [0.0, 1e-3, -1e-3, 0.05, -0.05, 0.15, -0.15, 0.4, -0.4];

/// End of a walk from a vertex to a line.
enum WalkEnd {
    /// At the line, after this way, mm.
    AtLine(f64),
    /// Before it, beyond what is measured, after this way, mm.
    TooFar(f64),
    /// At a border of the patch, or with no way to begin.
    Nowhere,
}

/// Signed distance from lines on a patch, along the surface: above 0 to the left.
///
/// The distance of a vertex is the length of the section of the mesh by the plane at right angles
/// to the line, from its foot on it: exact on planes, cylinders, cones and spheres, and on a prism
/// of any section across its edge, however sharp, as long as it turns by less than half a turn
/// between line and vertex: from there on the side of the line is not known, and the distance can
/// be up to a tenth too short. Elsewhere it is too long by the turn of the line about the way, to
/// the fourth power.
pub(crate) struct OffsetField<'a> {
    patch: &'a Patch<'a>,
    vertices: &'a PatchVertices,
    distance: CurveDistance<'a>,
    /// Largest distance that is measured, mm.
    reach: f64,
    /// Signed distance of each vertex, mm; NaN out of reach.
    pub(crate) values: Vec<f64>,
    /// The same by normals and chord alone.
    estimates: Vec<f64>,
    /// Direction in which the value rises at each vertex; zero where it is not known.
    pub(crate) gradients: Vec<Vector3<f64>>,
    /// Triangles over which the value is continuous, in rising order.
    pub(crate) triangles: Vec<u32>,
}

impl<'a> OffsetField<'a> {
    /// Measures up to `reach` (mm) from the curves.
    pub(crate) fn new(
        patch: &'a Patch<'a>,
        vertices: &'a PatchVertices,
        curves: &'a [SourceCurve],
        reach: f64,
    ) -> Self {
        let distance = CurveDistance::new(patch, vertices, curves, ESTIMATE * reach + longest_edge(patch), |_| true);
        let n = patch.mesh.vertices().len();
        let mut this = Self {
            patch,
            vertices,
            distance,
            reach,
            values: vec![f64::NAN; n],
            estimates: vec![f64::NAN; n],
            gradients: vec![Vector3::zeros(); n],
            triangles: Vec::new(),
        };
        let reached = this.distance.reached();
        let walked: Vec<f64> = reached.par_iter().map(|(v, foot)| this.walked(*v, foot)).collect();
        let fields: Vec<(u32, f64, CurveFoot)> =
            reached.iter().zip(walked).map(|(&(v, foot), value)| (v, value, foot)).collect();
        for (v, value, foot) in fields {
            let sign = if value < 0.0 { -1.0 } else { 1.0 };
            this.values[v as usize] = value;
            this.estimates[v as usize] = foot.across.abs();
            this.gradients[v as usize] = this.gradient(v, &foot, sign);
        }
        let all = 0..patch.mesh.triangles().len() as u32;
        this.triangles = all.filter(|&t| this.is_continuous(t)).collect();
        this
    }

    /// Signed distance of a vertex along the section of the patch by the plane across the line;
    /// where that leaves the patch, by one that leans from it.
    fn walked(&self, vertex: u32, foot: &CurveFoot) -> f64 {
        let (Some(tangent), true) = (Unit::try_new(foot.at.tangent, 1e-9), foot.distance > 1e-9) else {
            return foot.across;
        };
        let normal = self.vertices.normal(vertex);
        // Around an edge the line can be near in space and far along the surface.
        let mut too_far: Option<f64> = None;
        for lean in LEANS {
            let turn = Rotation3::from_axis_angle(&normal, lean);
            match self.way_to_line(vertex, foot, turn * tangent, &(turn * -foot.away)) {
                WalkEnd::AtLine(way) => return (way * lean.cos()).copysign(self.aside(vertex, foot)),
                WalkEnd::TooFar(way) => too_far = too_far.or(Some(way)),
                WalkEnd::Nowhere => {}
            }
        }
        too_far.map_or(foot.across, |way| way.copysign(foot.across))
    }

    /// Direction to the left of the line at a foot: at right angles to the mean of the normals at
    /// both ends of the way, so that it shows the side over a crease too.
    fn left(&self, vertex: u32, foot: &CurveFoot) -> Vector3<f64> {
        let mean = foot.at.normal.into_inner() + self.vertices.normal(vertex).into_inner();
        mean.cross(&foot.at.tangent).try_normalize(1e-9).unwrap_or_else(|| foot.at.normal.cross(&foot.at.tangent))
    }

    /// How far a vertex lies to the left of the line through its foot, in space.
    fn aside(&self, vertex: u32, foot: &CurveFoot) -> f64 {
        self.left(vertex, foot).dot(&(self.patch.mesh.vertices()[vertex as usize] - foot.at.position))
    }

    /// Way from a vertex to the line in the plane with this normal.
    fn way_to_line(&self, vertex: u32, foot: &CurveFoot, plane: Unit<Vector3<f64>>, toward: &Vector3<f64>) -> WalkEnd {
        let left = self.left(vertex, foot);
        let aside = |p: &Point3<f64>| left.dot(&(p - foot.at.position));
        let start = self.aside(vertex, foot);
        let (mut before, mut way) = (start, 0.0);
        let Some(walk) = SectionWalk::from_vertex(self.patch, self.vertices, vertex, plane, toward) else {
            return WalkEnd::Nowhere;
        };
        for step in walk {
            let here = aside(&step.position);
            if (here >= 0.0) != (start >= 0.0) || here == 0.0 {
                let share = if before == here { 1.0 } else { before / (before - here) };
                return WalkEnd::AtLine(way + (step.way - way) * share.clamp(0.0, 1.0));
            }
            if step.way > (1.5 * foot.distance).max(self.reach) + longest_side(self.patch, step.triangle) {
                return WalkEnd::TooFar(step.way);
            }
            (before, way) = (here, step.way);
        }
        // A line along the border of the patch is where the walk ends, but for the bend of the line
        // between its nodes.
        if before.abs() <= AT_LINE * foot.distance { WalkEnd::AtLine(way + before.abs()) } else { WalkEnd::Nowhere }
    }

    fn gradient(&self, vertex: u32, foot: &CurveFoot, sign: f64) -> Vector3<f64> {
        if foot.away != Vector3::zeros() {
            return foot.away * sign;
        }
        self.vertices.normal(vertex).cross(&foot.at.tangent)
    }

    /// Whether the value rises by no more than the way between its corners: not where feet of
    /// different lines, or of both sides of one, meet.
    fn is_continuous(&self, triangle: u32) -> bool {
        let values = self.patch.mesh.triangles()[triangle as usize].map(|v| self.values[v as usize]);
        let spread =
            values.into_iter().fold(f64::NEG_INFINITY, f64::max) - values.into_iter().fold(f64::INFINITY, f64::min);
        values.iter().all(|v| v.is_finite()) && spread <= 1.25 * longest_side(self.patch, triangle)
    }

    /// Value a share of the way along an edge: linear between its ends, bent as the estimate is.
    fn along(&self, edge: [u32; 2], t: f64) -> f64 {
        let [a, b] = edge.map(|v| v as usize);
        let linear = |of: &[f64]| of[a] + (of[b] - of[a]) * t;
        let value = linear(&self.values);
        if t <= 0.0 || t >= 1.0 || (self.values[a] >= 0.0) != (self.values[b] >= 0.0) {
            return value;
        }
        let p = on_edge(self.patch, edge, t);
        let Some(foot) = self.distance.foot(&edge, &p, &self.vertices.normal_between(edge, t)) else { return value };
        let bend = (foot.across.abs() - linear(&self.estimates)) * value.signum();
        let length = (self.patch.mesh.vertices()[b] - self.patch.mesh.vertices()[a]).norm();
        if bend.abs() < 0.25 * length { value + bend } else { value }
    }

    /// The curves of a level in some triangles; `store` has as many values as the patch has
    /// vertices, which this overwrites.
    pub(crate) fn trace(&self, level: f64, among: &[u32], store: &mut Vec<f64>) -> Vec<SurfacePath> {
        store.resize(self.values.len(), f64::NAN);
        for &v in among.iter().flat_map(|&t| &self.patch.mesh.triangles()[t as usize]) {
            store[v as usize] = self.values[v as usize] - level;
        }
        trace_zero(self.patch, store, among, |edge, t| self.along(edge, t) - level)
    }
}

fn longest_edge(patch: &Patch) -> f64 {
    (0..patch.mesh.triangles().len() as u32).map(|t| longest_side(patch, t)).fold(0.0, f64::max)
}

pub(crate) fn longest_side(patch: &Patch, triangle: u32) -> f64 {
    let [a, b, c] = patch.mesh.corners(triangle as usize);
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}
