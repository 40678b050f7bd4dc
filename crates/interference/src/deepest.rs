//! The deepest point of a mesh in a body's core, in one walk of the tree.
//!
//! The depth of a point in a convex body is the least below any of its faces, each a plane or the wall of a cone. So the depth of a
//! slab is bounded face by face, eight slabs at once, and the depth of a triangle by the slopes at a few of its points; between
//! these bounds the body made smaller tells.

use facemill_cl_data::Solid;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use crate::body::{Placed, for_body};
use crate::bound::Slabs;
use crate::depth::{ACCURACY, eroded, inner_radius, innermost};
use crate::edge::{Goal, Sample};
use crate::facet::nearest_on_triangle;
use crate::lanes::{Lanes, N, vectorized};
use crate::mesh_tree::{MeshTree, Pending, TOUCH};
use crate::query::Separation;
use crate::tree_build::Child;

/// Height above the faces of a body: the largest over the faces, minus the depth in the body.
trait Faces {
    /// The height at a point, and its gradient: of length 1, or 0 on an axis.
    fn height(&self, p: &Point3<f64>) -> (f64, Vector3<f64>);

    /// What the height over each slab is not below.
    fn least_heights(&self, slabs: &Slabs) -> Lanes;
}

impl MeshTree {
    /// [`crate::Interference::core_depth`].
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
            // What waited may have been overtaken by a deeper triangle.
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
        let goal = Goal { enough: TOUCH, beyond: TOUCH };
        let Some(inside) = self.nearest(self.depth + ACCURACY, corners, goal) else { return };
        self.raise(-faces.height(&inside.point).0, triangle, inside.point);
        let goal = Goal { enough: TOUCH, beyond: f64::INFINITY };
        let (depth, point) = innermost(self.depth, self.most.min(-least), |t| match self.nearest(t, corners, goal) {
            Some(sample) if sample.distance > TOUCH => (sample.distance, sample.point),
            Some(sample) => (0.0, sample.point),
            None => (0.0, inside.point),
        });
        self.raise(depth, triangle, point);
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
