//! The deepest point of a mesh in a body's core, in one walk of the tree.
//!
//! The depth of a point in a convex body is the least below any of its faces, each a plane or the
//! wall of a cone. So the depth of a slab is bounded face by face, eight slabs at once, and the
//! depth of a triangle by the slopes at a few of its points; between these bounds, tests of
//! the body made smaller decide.

use facemill_cl_data::{ConvexPolyhedron, Solid};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::body::bound::Slabs;
use crate::body::edge::{Goal, Sample};
use crate::body::facet::nearest_on_triangle;
use crate::body::lanes::{Lanes, N, vectorized};
use crate::body::{Placed, for_body};
use crate::mesh_tree::build::Child;
use crate::mesh_tree::{MeshTree, Pending, TOUCH};
use crate::query::depth::{ACCURACY, eroded, inner_radius, innermost};
use crate::query::verdict::Separation;

/// Height above the faces of a body: the largest over the faces, minus the depth in the body.
trait Faces {
    /// The height at a point, and its gradient: of length 1, or 0 on an axis.
    fn height(&self, p: &Point3<f64>) -> (f64, Vector3<f64>);

    /// Returns lower bounds of the height over each slab.
    fn least_heights(&self, slabs: &Slabs) -> Lanes;

    /// The lowest point of a triangle and its depth, to [`ACCURACY`], where that is between what
    /// was found and `most`.
    #[inline(always)]
    fn lowest(&self, found: &Deepest<'_>, corners: &[Point3<f64>; 3], most: f64) -> Option<(f64, Point3<f64>)> {
        found.lowest_by_distances(corners, most)
    }
}

impl MeshTree {
    /// [`crate::query::Interference::core_depth`].
    pub(crate) fn deepest(&self, solid: &Solid, pose: &Isometry3<f64>, met: Separation) -> (f64, Separation) {
        let start = Deepest { solid, pose, most: inner_radius(solid), depth: 0.0, at: met };
        match solid {
            Solid::Frustum(f) => {
                let (widening, height) = (f.radius_high - f.radius_low, (f.z_high - f.z_low).max(0.0));
                let slant = widening.hypot(height);
                let share = |length: f64| if slant > 0.0 { length / slant } else { 0.0 };
                let faces = Round {
                    base: pose * Point3::new(0.0, 0.0, f.z_low),
                    axis: pose * Vector3::z(),
                    height,
                    radius_low: f.radius_low,
                    slant_radial: share(widening),
                    slant_axial: share(height),
                };
                self.deepest_from(start, &faces)
            }
            Solid::Box(b) => {
                let axes = pose.rotation.to_rotation_matrix().into_inner();
                let faces = Flat { center: pose * Point3::origin(), axes, half: b.half_extents };
                self.deepest_from(start, &faces)
            }
            Solid::Hull(h) => self.deepest_from(start, &Many { core: &h.core, mesh_from_solid: *pose }),
        }
    }

    /// A start made deeper by what of the mesh is deeper.
    fn deepest_from(&self, start: Deepest<'_>, faces: &impl Faces) -> (f64, Separation) {
        vectorized(
            self.arch,
            #[inline(always)]
            || self.deepest_below(start, faces),
        )
    }

    #[inline(always)]
    fn deepest_below(&self, mut deepest: Deepest<'_>, faces: &impl Faces) -> (f64, Separation) {
        let met = deepest.at;
        deepest.raise(-faces.height(&met.point).0, met.triangle, met.point);
        let mut stack = Pending::new();
        stack.push_root(&self.nodes);
        while let Some((bound, child)) = stack.pop() {
            // A deeper triangle may have overtaken a node in the queue.
            if bound > deepest.beyond() {
                continue;
            }
            match Child::unpack(child) {
                Child::Node(node) => {
                    let node = &self.nodes[node as usize];
                    stack.push_bounded(node, &faces.least_heights(&node.slabs), deepest.beyond());
                }
                Child::Triangle(place) => {
                    deepest.look(faces, &self.corners[place as usize], self.triangles[place as usize]);
                }
            }
        }
        (deepest.depth, deepest.at)
    }
}

/// The deepest point found so far.
#[derive(Clone, Copy)]
struct Deepest<'a> {
    solid: &'a Solid,
    pose: &'a Isometry3<f64>,
    /// Depth of the body's innermost point.
    most: f64,
    depth: f64,
    at: Separation,
}

impl Deepest<'_> {
    /// Height above which nothing is of interest.
    #[inline(always)]
    fn beyond(&self) -> f64 {
        -(self.depth + ACCURACY)
    }

    #[inline(always)]
    fn raise(&mut self, depth: f64, triangle: u32, point: Point3<f64>) {
        if depth > self.depth {
            self.depth = depth.min(self.most);
            self.at = Separation { distance: 0.0, triangle, point };
        }
    }

    #[inline(always)]
    fn look(&mut self, faces: &impl Faces, corners: &[Point3<f64>; 3], triangle: u32) {
        // The height is convex: its slope at a point bounds it on the whole triangle.
        let mut least = f64::NEG_INFINITY;
        let center = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        for p in [&center, &corners[0], &corners[1], &corners[2]] {
            let (height, gradient) = faces.height(p);
            let slope = |q: &Point3<f64>| gradient.dot(&(q - p));
            let bound = height + slope(&corners[0]).min(slope(&corners[1])).min(slope(&corners[2]));
            least = if bound > least { bound } else { least };
            if least > self.beyond() {
                return;
            }
            self.raise(-height, triangle, *p);
        }
        if least > self.beyond() {
            return;
        }
        if let Some((depth, point)) = faces.lowest(self, corners, self.most.min(-least)) {
            self.raise(depth, triangle, point);
        }
    }

    /// [`Faces::lowest`] by the distances from smaller bodies.
    #[inline(always)]
    fn lowest_by_distances(&self, corners: &[Point3<f64>; 3], most: f64) -> Option<(f64, Point3<f64>)> {
        let goal = Goal { enough: TOUCH, beyond: TOUCH };
        let inside = self.nearest(self.depth + ACCURACY, corners, goal)?;
        let goal = Goal { enough: TOUCH, beyond: f64::INFINITY };
        let found = innermost(self.depth, most, |t| match self.nearest(t, corners, goal) {
            Some(sample) if sample.distance > TOUCH => (sample.distance, sample.point),
            Some(sample) => (0.0, sample.point),
            None => (0.0, inside.point),
        });
        Some(found)
    }

    /// Nearest point of a triangle to the body made smaller.
    #[inline(always)]
    fn nearest(&self, smaller_by: f64, corners: &[Point3<f64>; 3], goal: Goal) -> Option<Sample> {
        let solid = eroded(self.solid, smaller_by.min(self.most));
        for_body!(Placed::new(&solid, self.pose), |body| nearest_on_triangle(&body, corners, goal))
    }
}

/// Two ends and a wall around an axis: a cylinder or frustum.
struct Round {
    base: Point3<f64>,
    axis: Vector3<f64>,
    height: f64,
    radius_low: f64,
    /// Unit direction of the wall, radial and along the axis.
    slant_radial: f64,
    slant_axial: f64,
}

impl Faces for Round {
    #[inline(always)]
    fn height(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let from_base = p - self.base;
        let z = from_base.dot(&self.axis);
        let beside = from_base - self.axis * z;
        let radial = beside.norm();
        let wall = (radial - self.radius_low) * self.slant_axial - z * self.slant_radial;
        let (below, above) = (-z, z - self.height);
        if wall >= below && wall >= above {
            let outward = if radial > 0.0 { beside / radial } else { Vector3::zeros() };
            (wall, outward * self.slant_axial - self.axis * self.slant_radial)
        } else if below >= above {
            (below, -self.axis)
        } else {
            (above, self.axis)
        }
    }

    #[inline(always)]
    fn least_heights(&self, slabs: &Slabs) -> Lanes {
        let (b, a) = (&self.base, &self.axis);
        let mut least = [0.0; N];
        for (k, least) in least.iter_mut().enumerate() {
            let (x, y, z) = (slabs.center.x[k] - b.x, slabs.center.y[k] - b.y, slabs.center.z[k] - b.z);
            let (nx, ny, nz) = (slabs.normal.x[k], slabs.normal.y[k], slabs.normal.z[k]);
            let height = x * a.x + y * a.y + z * a.z;
            let up = a.x * nx + a.y * ny + a.z * nz;
            let reach = slabs.reach(k, up);
            let ends = if -height > height - self.height { -height } else { height - self.height } - reach;
            let (u, v, w) = (x - a.x * height, y - a.y * height, z - a.z * height);
            let radial = (u * u + v * v + w * w).sqrt();
            let outward = if radial > 0.0 { (u * nx + v * ny + w * nz) / radial } else { 0.0 };
            let cos = outward * self.slant_axial - up * self.slant_radial;
            let wall = (radial - self.radius_low) * self.slant_axial - height * self.slant_radial - slabs.reach(k, cos);
            *least = if wall > ends { wall } else { ends };
        }
        least
    }
}

/// The faces of a polyhedron.
struct Many<'a> {
    core: &'a ConvexPolyhedron,
    mesh_from_solid: Isometry3<f64>,
}

impl Many<'_> {
    /// A point of a triangle, in the solid's frame, that is lower than given below every face;
    /// `None` where there is none.
    fn point_below(&self, corners: &[Point3<f64>; 3], depth: f64) -> Option<Point3<f64>> {
        let mut left = corners.to_vec();
        for face in self.core.faces() {
            let height = |p: &Point3<f64>| face.normal.dot(&p.coords) - face.offset + depth;
            let mut lower = Vec::with_capacity(left.len() + 1);
            for (k, a) in left.iter().enumerate() {
                let b = &left[(k + 1) % left.len()];
                let (above_a, above_b) = (height(a), height(b));
                if above_a <= 0.0 {
                    lower.push(*a);
                }
                if (above_a <= 0.0) != (above_b <= 0.0) {
                    lower.push(a + (b - a) * (above_a / (above_a - above_b)));
                }
            }
            left = lower;
        }
        let sum: Vector3<f64> = left.iter().map(|p| p.coords).sum();
        (!left.is_empty()).then(|| Point3::from(sum / left.len() as f64))
    }
}

impl Faces for Many<'_> {
    fn height(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let (height, normal) = self.core.height(&self.mesh_from_solid.inverse_transform_point(p));
        (height, self.mesh_from_solid.rotation * normal)
    }

    #[inline(always)]
    fn least_heights(&self, slabs: &Slabs) -> Lanes {
        let (rotation, origin) = (self.mesh_from_solid.rotation, self.mesh_from_solid.translation.vector);
        let mut least = [f64::NEG_INFINITY; N];
        for face in self.core.faces() {
            let n = rotation * face.normal;
            let offset = face.offset + n.dot(&origin);
            for (k, least) in least.iter_mut().enumerate() {
                let (c, m) = (&slabs.center, &slabs.normal);
                let height = c.x[k] * n.x + c.y[k] * n.y + c.z[k] * n.z - offset;
                let lowest = height - slabs.reach(k, m.x[k] * n.x + m.y[k] * n.y + m.z[k] * n.z);
                *least = if lowest > *least { lowest } else { *least };
            }
        }
        least
    }

    /// Finds the deepest place of the triangle. Its part below every face by a depth is a polygon:
    /// it is halved until it vanishes.
    fn lowest(&self, found: &Deepest<'_>, corners: &[Point3<f64>; 3], most: f64) -> Option<(f64, Point3<f64>)> {
        let corners = corners.map(|p| self.mesh_from_solid.inverse_transform_point(&p));
        let mut lowest = None;
        let (mut low, mut high) = (found.depth, most);
        let mut next = low + ACCURACY;
        // Of a span of metres, sixty halves leave nothing.
        for _ in 0..60 {
            match self.point_below(&corners, next) {
                Some(point) => {
                    low = next.max(-self.core.height(&point).0);
                    lowest = Some((low, self.mesh_from_solid * point));
                }
                None => high = next,
            }
            if high - low <= ACCURACY {
                break;
            }
            next = 0.5 * (low + high);
        }
        lowest
    }
}

/// The six faces of a box.
struct Flat {
    center: Point3<f64>,
    /// Columns are the box's axes.
    axes: Matrix3<f64>,
    half: Vector3<f64>,
}

impl Faces for Flat {
    #[inline(always)]
    fn height(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let local = self.axes.tr_mul(&(p - self.center));
        let heights = local.abs() - self.half;
        let face = heights.imax();
        (heights[face], self.axes.column(face) * 1f64.copysign(local[face]))
    }

    #[inline(always)]
    fn least_heights(&self, slabs: &Slabs) -> Lanes {
        let (c, m) = (&self.center, &self.axes);
        let mut least = [f64::NEG_INFINITY; N];
        for (k, least) in least.iter_mut().enumerate() {
            let (x, y, z) = (slabs.center.x[k] - c.x, slabs.center.y[k] - c.y, slabs.center.z[k] - c.z);
            let (nx, ny, nz) = (slabs.normal.x[k], slabs.normal.y[k], slabs.normal.z[k]);
            for i in 0..3 {
                let local = x * m[(0, i)] + y * m[(1, i)] + z * m[(2, i)];
                let cos = nx * m[(0, i)] + ny * m[(1, i)] + nz * m[(2, i)];
                let face = local.abs() - self.half[i] - slabs.reach(k, cos);
                *least = if face > *least { face } else { *least };
            }
        }
        least
    }
}
