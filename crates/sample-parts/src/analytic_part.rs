//! Parts with closed normals and curvatures.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, TAU};

use facemill_surface_model::TriMesh;
use nalgebra::{Matrix2, Point3, Unit, Vector2, Vector3};

use crate::grouped_mesh::GroupedMesh;
use crate::patch::height_mesh;
use crate::spec_error::{SpecError, in_range};
use crate::surface_point::SurfacePoint;

/// On which side of a surface the material is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaterialSide {
    /// Inside: the surface is that of a ball or a shaft.
    Inside,
    /// Outside: the surface is that of a hollow or a bore.
    Outside,
}

/// A surface whose closest points, normals and curvatures have closed forms; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum AnalyticShape {
    /// Rectangle in z = 0 about the origin, material below.
    Plane {
        /// Sizes along x and y.
        size: [f64; 2],
    },
    /// Sphere about the origin.
    Sphere {
        /// Radius.
        radius: f64,
        /// Material inside or outside.
        material: MaterialSide,
    },
    /// Open tube about the z axis, half its length on each side of the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Length.
        length: f64,
        /// Material inside or outside.
        material: MaterialSide,
    },
    /// Torus about the z axis, material inside: convex outside, saddle-shaped inside.
    Torus {
        /// Radius of the circle of centres.
        major_radius: f64,
        /// Radius of the tube, at most 0.95 of the other.
        minor_radius: f64,
    },
    /// `z = x²/(2·concave_radius) − y²/(2·convex_radius)` over a rectangle about the origin,
    /// material below.
    Saddle {
        /// Sizes along x and y.
        size: [f64; 2],
        /// Radius of curvature along x at the origin, where the surface is hollow.
        concave_radius: f64,
        /// Radius of curvature along y at the origin, where it is convex.
        convex_radius: f64,
    },
}

/// An [`AnalyticShape`] whose lengths are in range: a mesh to plan on, and the truth to measure a
/// plan by.
///
/// ```
/// use facemill_sample_parts::{AnalyticPart, AnalyticShape, MaterialSide};
///
/// let ball = AnalyticPart::new(AnalyticShape::Sphere { radius: 30.0, material: MaterialSide::Inside })?;
/// let mesh = ball.mesh(8)?;
/// let nearest = ball.project(&mesh.vertices()[0]).ok_or("only the centre has no nearest point")?;
/// assert!((nearest.point - mesh.vertices()[0]).norm() < 1e-9, "vertices are on the surface");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalyticPart {
    shape: AnalyticShape,
}

impl AnalyticPart {
    /// A part; lengths are 1e-3 to 1e5 mm.
    ///
    /// # Errors
    /// When a length is out of range.
    pub fn new(shape: AnalyticShape) -> Result<Self, SpecError> {
        let length = |field, value| in_range(field, value, 1e-3, 1e5);
        match shape {
            AnalyticShape::Plane { size } => {
                length("size along x", size[0])?;
                length("size along y", size[1])?;
            }
            AnalyticShape::Sphere { radius, .. } => {
                length("radius", radius)?;
            }
            AnalyticShape::Cylinder { radius, length: along, .. } => {
                length("radius", radius)?;
                length("length", along)?;
            }
            AnalyticShape::Torus { major_radius, minor_radius } => {
                length("major radius", major_radius)?;
                in_range("minor radius", minor_radius, 1e-3, 0.95 * major_radius)?;
            }
            AnalyticShape::Saddle { size, concave_radius, convex_radius } => {
                length("size along x", size[0])?;
                length("size along y", size[1])?;
                length("concave radius", concave_radius)?;
                length("convex radius", convex_radius)?;
            }
        }
        Ok(Self { shape })
    }

    /// The shape.
    pub fn shape(&self) -> AnalyticShape {
        self.shape
    }

    /// A mesh with vertices on the surface and `resolution` quads (4 to 500) along each direction,
    /// a quarter turn of a sphere.
    ///
    /// Sphere and torus are closed, the others open; one group with the shape's name.
    ///
    /// # Errors
    /// When the resolution is out of range.
    pub fn mesh(&self, resolution: usize) -> Result<TriMesh, SpecError> {
        #[expect(clippy::cast_precision_loss, reason = "numbers that large are refused")]
        in_range("resolution", resolution as f64, 4.0, 500.0)?;
        match self.shape {
            AnalyticShape::Plane { size } => {
                height_mesh("plane", size.into(), [resolution; 2], |x, y| Point3::new(x, y, 0.0))
            }
            AnalyticShape::Saddle { size, concave_radius, convex_radius } => {
                let height = |x: f64, y: f64| 0.5 * (x * x / concave_radius - y * y / convex_radius);
                height_mesh("saddle", size.into(), [resolution; 2], |x, y| Point3::new(x, y, height(x, y)))
            }
            AnalyticShape::Sphere { radius, material } => Ok(sphere_mesh(radius, material, resolution)),
            AnalyticShape::Cylinder { radius, length, material } => {
                let at = |u: f64, v: f64| {
                    let (sin, cos) = (TAU * u).sin_cos();
                    Point3::new(radius * cos, radius * sin, length * (v - 0.5))
                };
                Ok(tube_mesh("cylinder", at, resolution, false, material))
            }
            AnalyticShape::Torus { major_radius, minor_radius } => {
                let at = |u: f64, v: f64| {
                    let ((sin, cos), (sin_v, cos_v)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
                    let r = major_radius + minor_radius * cos_v;
                    Point3::new(r * cos, r * sin, minor_radius * sin_v)
                };
                Ok(tube_mesh("torus", at, resolution, true, MaterialSide::Inside))
            }
        }
    }

    /// The closest point of the surface, continued without bounds for plane, cylinder and saddle.
    ///
    /// `None` where the closest point is not unique: the centre of a sphere, the axis of a
    /// cylinder, axis and circle of centres of a torus, and beyond the centres of curvature in the
    /// symmetry planes of a saddle; and for a point that is not finite.
    pub fn project(&self, point: &Point3<f64>) -> Option<SurfacePoint> {
        if !point.coords.iter().all(|c| c.is_finite()) {
            return None;
        }
        match self.shape {
            AnalyticShape::Plane { .. } => {
                Some(SurfacePoint::of_height(Point3::new(point.x, point.y, 0.0), Vector2::zeros(), Matrix2::zeros()))
            }
            AnalyticShape::Sphere { radius, material } => {
                let normal = Unit::try_new(point.coords, 0.0)?;
                let [k1, k2] = [1.0 / radius; 2];
                let first = perpendicular(&normal);
                Some(on_side(frame(Point3::from(normal.into_inner() * radius), normal, first, [k1, k2]), material))
            }
            AnalyticShape::Cylinder { radius, material, .. } => {
                let normal = Unit::try_new(Vector3::new(point.x, point.y, 0.0), 0.0)?;
                let foot = Point3::from(normal.into_inner() * radius + Vector3::z() * point.z);
                let around = Unit::new_unchecked(Vector3::z().cross(&normal));
                Some(on_side(frame(foot, normal, around, [1.0 / radius, 0.0]), material))
            }
            AnalyticShape::Torus { major_radius, minor_radius } => project_torus(point, major_radius, minor_radius),
            AnalyticShape::Saddle { concave_radius, convex_radius, .. } => {
                project_saddle(point, concave_radius, convex_radius)
            }
        }
    }
}

/// A surface point with curvatures along `first` and across it, k1 first.
fn frame(
    point: Point3<f64>,
    normal: Unit<Vector3<f64>>,
    first: Unit<Vector3<f64>>,
    curvatures: [f64; 2],
) -> SurfacePoint {
    SurfacePoint { point, normal, curvatures, directions: [first, Unit::new_unchecked(normal.cross(&first))] }
}

fn on_side(inside: SurfacePoint, material: MaterialSide) -> SurfacePoint {
    match material {
        MaterialSide::Inside => inside,
        MaterialSide::Outside => inside.flipped(),
    }
}

/// A unit vector at right angles to another.
fn perpendicular(v: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let axis = if v.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    Unit::new_normalize(axis.cross(v))
}

fn project_torus(point: &Point3<f64>, major: f64, minor: f64) -> Option<SurfacePoint> {
    let out = Unit::try_new(Vector3::new(point.x, point.y, 0.0), 0.0)?;
    let centre = Point3::from(out.into_inner() * major);
    let normal = Unit::try_new(point - centre, 0.0)?;
    let around = Vector3::z().cross(&out);
    let meridian = Unit::new_normalize(around.cross(&normal));
    let across = normal.dot(&out) / (major + minor * normal.dot(&out));
    Some(frame(centre + normal.into_inner() * minor, normal, meridian, [1.0 / minor, across]))
}

/// The foot q satisfies p = q + λ·(−qx/a, qy/b, 1): x and y follow from λ, and the height of q
/// above the surface falls strictly with λ from −b to a. Between these, the centres of curvature of
/// the two parabolas, the foot is unique.
fn project_saddle(p: &Point3<f64>, a: f64, b: f64) -> Option<SurfacePoint> {
    let foot = |lambda: f64| {
        let (x, y) = (p.x / (1.0 - lambda / a), p.y / (1.0 + lambda / b));
        Point3::new(x, y, p.z - lambda)
    };
    let above = |lambda: f64| {
        let q = foot(lambda);
        q.z - 0.5 * (q.x * q.x / a - q.y * q.y / b)
    };
    let (mut low, mut high) = (-b, a);
    // Halving 200 times ends at neighbouring numbers wherever the root is.
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if above(middle) > 0.0 { low = middle } else { high = middle }
    }
    let lambda = 0.5 * (low + high);
    let q = foot(lambda);
    let reach = 1e-9 * (a + b);
    let inside = lambda > reach - b && lambda < a - reach;
    let gradient = Vector2::new(q.x / a, -q.y / b);
    let hessian = Matrix2::new(1.0 / a, 0.0, 0.0, -1.0 / b);
    inside.then(|| SurfacePoint::of_height(q, gradient, hessian))
}

/// A cube blown up to a sphere, so that there are no poles with slivers; sides are cut at equal
/// angles.
fn sphere_mesh(radius: f64, material: MaterialSide, resolution: usize) -> TriMesh {
    let mut mesh = GroupedMesh::new(&["sphere"]);
    let n = i32::try_from(resolution).unwrap_or(i32::MAX);
    let place = |k: i32| (FRAC_PI_4 * (2.0 * f64::from(k) / f64::from(n) - 1.0)).tan();
    let mut known = BTreeMap::new();
    // Faces of the cube by the axis they are across; (axis, next, last) is right-handed.
    for (axis, level) in [(0, 0), (0, n), (1, 0), (1, n), (2, 0), (2, n)] {
        let mut vertex = |i: i32, j: i32| {
            let mut lattice = [0; 3];
            (lattice[axis], lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (level, i, j);
            *known.entry(lattice).or_insert_with(|| {
                let direction = Vector3::from(lattice.map(place));
                mesh.vertex(Point3::from(direction * (radius / direction.norm())))
            })
        };
        let rows: Vec<Vec<u32>> = (0..=n).map(|j| (0..=n).map(|i| vertex(i, j)).collect()).collect();
        for pair in rows.windows(2) {
            for i in 0..resolution {
                let quad = [pair[0][i], pair[0][i + 1], pair[1][i + 1], pair[1][i]];
                mesh.quad(0, turned(quad, (level == n) == (material == MaterialSide::Inside)));
            }
        }
    }
    mesh.build()
}

/// A mesh closed in u, and in v if so; `at` takes shares of a turn, u then v right-handed with the
/// outside.
fn tube_mesh(
    name: &'static str,
    at: impl Fn(f64, f64) -> Point3<f64>,
    n: usize,
    closed: bool,
    material: MaterialSide,
) -> TriMesh {
    let mut mesh = GroupedMesh::new(&[name]);
    #[expect(clippy::cast_precision_loss, reason = "at most 500")]
    let share = |k: usize| k as f64 / n as f64;
    let n_rows = if closed { n } else { n + 1 };
    let rows: Vec<Vec<u32>> =
        (0..n_rows).map(|j| (0..n).map(|i| mesh.vertex(at(share(i), share(j)))).collect()).collect();
    for j in 0..n {
        let (low, high) = (&rows[j], &rows[(j + 1) % n_rows]);
        for i in 0..n {
            let k = (i + 1) % n;
            mesh.quad(0, turned([low[i], low[k], high[k], high[i]], material == MaterialSide::Inside));
        }
    }
    mesh.build()
}

/// The quad as it is, or seen from behind.
fn turned([a, b, c, d]: [u32; 4], as_is: bool) -> [u32; 4] {
    if as_is { [a, b, c, d] } else { [a, d, c, b] }
}
