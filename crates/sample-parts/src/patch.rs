//! Wavy sculptured patches.

use facemill_surface_model::TriMesh;
use nalgebra::{Matrix2, Point3, Vector2};

use crate::grouped_mesh::GroupedMesh;
use crate::spec_error::{SpecError, in_range};
use crate::surface_point::SurfacePoint;

/// A wavy sculptured surface over a rectangle about the origin, material below, in mm.
///
/// With phases `a = 2π·waves_x·x/size_x`, `b = 2π·waves_y·y/size_y` its height is `z =
/// amplitude·⅔·(sin a·cos b + ½·cos(a/2 + b))`, so |z| ≤ amplitude. Convex, concave and saddle
/// regions alternate, and the oblique term leaves no symmetry that could hide an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSpec {
    size: Vector2<f64>,
    amplitude: f64,
    wave_numbers: Vector2<f64>,
}

impl PatchSpec {
    /// A patch of `size` mm (1 to 10,000 each way) with waves of `amplitude` mm (up to the smaller
    /// size), `waves` of them along x and y (0 to 50, fractions allowed).
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn new(size: [f64; 2], amplitude: f64, waves: [f64; 2]) -> Result<Self, SpecError> {
        for length in size {
            in_range("size of the patch", length, 1.0, 10_000.0)?;
        }
        in_range("amplitude", amplitude, 0.0, size[0].min(size[1]))?;
        for n in waves {
            in_range("number of waves", n, 0.0, 50.0)?;
        }
        let wave_numbers = Vector2::from([0, 1].map(|k| std::f64::consts::TAU * waves[k] / size[k]));
        Ok(Self { size: size.into(), amplitude, wave_numbers })
    }

    /// The surface above `(x, y)`, exact; the formula goes on beyond the rectangle.
    pub fn at(&self, x: f64, y: f64) -> SurfacePoint {
        let [kx, ky] = self.wave_numbers.into();
        let scale = 2.0 / 3.0 * self.amplitude;
        let ((sin_a, cos_a), (sin_b, cos_b)) = ((kx * x).sin_cos(), (ky * y).sin_cos());
        let (sin_c, cos_c) = (0.5 * kx * x + ky * y).sin_cos();
        let height = scale * (sin_a * cos_b + 0.5 * cos_c);
        let gradient = scale * Vector2::new(kx * (cos_a * cos_b - 0.25 * sin_c), -ky * (sin_a * sin_b + 0.5 * sin_c));
        let mixed = -kx * ky * (cos_a * sin_b + 0.25 * cos_c);
        let hessian = scale
            * Matrix2::new(
                -kx * kx * (sin_a * cos_b + 0.125 * cos_c),
                mixed,
                mixed,
                -ky * ky * (sin_a * cos_b + 0.5 * cos_c),
            );
        SurfacePoint::of_height(Point3::new(x, y, height), gradient, hessian)
    }
}

/// The open mesh of a patch, `n_x` by `n_y` quads (1 to 2000 each) with vertices on the surface, in
/// one group `patch`.
///
/// # Errors
/// When a number of quads is out of range.
///
/// ```
/// use facemill_sample_parts::{PatchSpec, SpecError, patch};
///
/// let spec = PatchSpec::new([200.0, 120.0], 8.0, [2.0, 1.5])?;
/// assert_eq!(patch(&spec, 100, 60)?.triangles().len(), 12_000);
/// # Ok::<(), SpecError>(())
/// ```
pub fn patch(spec: &PatchSpec, n_x: usize, n_y: usize) -> Result<TriMesh, SpecError> {
    height_mesh("patch", spec.size, [n_x, n_y], |x, y| spec.at(x, y).point)
}

/// An open mesh of points over a rectangle about the origin, seen from above.
pub(crate) fn height_mesh(
    group: &'static str,
    size: Vector2<f64>,
    n: [usize; 2],
    at: impl Fn(f64, f64) -> Point3<f64>,
) -> Result<TriMesh, SpecError> {
    #[expect(clippy::cast_precision_loss, reason = "numbers that large are refused")]
    let number = |k: usize| k as f64;
    for count in n {
        in_range("number of quads", number(count), 1.0, 2000.0)?;
    }
    let mut mesh = GroupedMesh::new(&[group]);
    let place = |k: usize, axis: usize| size[axis] * (number(k) / number(n[axis]) - 0.5);
    let rows: Vec<Vec<u32>> =
        (0..=n[1]).map(|j| (0..=n[0]).map(|i| mesh.vertex(at(place(i, 0), place(j, 1)))).collect()).collect();
    for pair in rows.windows(2) {
        for i in 0..n[0] {
            mesh.quad(0, [pair[0][i], pair[0][i + 1], pair[1][i + 1], pair[1][i]]);
        }
    }
    Ok(mesh.build())
}
