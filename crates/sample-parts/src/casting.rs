//! Castings: a part with material on it that is nowhere quite the same.

use std::f64::consts::TAU;

use facemill_surface_model::{MeshError, TriMesh};
use nalgebra::{Point3, Vector3};

use crate::spec_error::{SpecError, in_range};

/// Material on a casting: `mean` ± `variation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CastingAllowance {
    mean: f64,
    variation: f64,
}

/// Waves of the allowance along the longest side of the part.
const WAVES: f64 = 1.5;

/// Phases of the waves along x, y and z: without them the allowance would have the symmetries of
/// the part.
const PHASES: [f64; 3] = [0.31, 0.77, 0.13];

/// Least cosine between the normal of a vertex and those of its facets by which its way is
/// lengthened: sharper corners have less material on their sides.
const SHARPEST: f64 = 0.35;

impl CastingAllowance {
    /// Returns an allowance of `mean` mm, which varies by up to `variation` mm over the part.
    ///
    /// # Errors
    /// When the mean is not between 0 and 1,000 mm, or the variation not between 0 and the mean.
    pub fn new(mean: f64, variation: f64) -> Result<Self, SpecError> {
        in_range("mean allowance", mean, 0.0, 1000.0)?;
        in_range("variation of the allowance", variation, 0.0, mean)?;
        Ok(Self { mean, variation })
    }

    /// Returns the least allowance, mm.
    pub fn least(&self) -> f64 {
        self.mean - self.variation
    }

    /// Returns the largest allowance, mm.
    pub fn largest(&self) -> f64 {
        self.mean + self.variation
    }

    /// Returns the allowance at a point, mm, with `length` the longest side of the part: waves
    /// along x, y and z, the mean of their sines.
    fn at(&self, p: &Point3<f64>, length: f64) -> f64 {
        let wave = |k: usize| (TAU * (WAVES * p[k] / length + PHASES[k])).sin();
        self.mean + self.variation * (wave(0) + wave(1) + wave(2)) / 3.0
    }
}

/// Returns the casting of closed solids, mm: each vertex goes outward along its normal, so far that
/// each of its facets moves by at least the allowance there. Triangles and groups stay as they are;
/// solids that overlap stay separate ones, so a casting has no fillet where they meet.
///
/// Facets move by the allowance at their corners; at edges of less than 41° between the sides these
/// move by less.
///
/// # Errors
/// When coordinates overflow.
pub fn casting(part: &TriMesh, allowance: CastingAllowance) -> Result<TriMesh, MeshError> {
    let size = part.aabb().half_extents() * 2.0;
    let length = size.max().max(f64::MIN_POSITIVE);
    let facets: Vec<Vector3<f64>> = (0..part.triangles().len())
        .map(|t| {
            let [a, b, c] = part.corners(t);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        })
        .collect();
    let mut normals = vec![Vector3::zeros(); part.vertices().len()];
    for (t, corners) in part.triangles().iter().enumerate() {
        let at = part.corners(t);
        for k in 0..3 {
            let (next, before) = (at[(k + 1) % 3] - at[k], at[(k + 2) % 3] - at[k]);
            // By angles, so that the diagonals of quads do not matter.
            normals[corners[k] as usize] += facets[t] * next.angle(&before);
        }
    }
    let normals: Vec<Vector3<f64>> =
        normals.iter().map(|n| n.try_normalize(f64::MIN_POSITIVE).unwrap_or_default()).collect();
    let mut least_cosine = vec![1.0_f64; normals.len()];
    for (t, corners) in part.triangles().iter().enumerate() {
        for &v in corners.iter().filter(|_| facets[t] != Vector3::zeros()) {
            let cosine = &mut least_cosine[v as usize];
            *cosine = cosine.min(normals[v as usize].dot(&facets[t]));
        }
    }
    let moved =
        |(v, p): (usize, &Point3<f64>)| p + normals[v] * (allowance.at(p, length) / least_cosine[v].max(SHARPEST));
    let vertices = part.vertices().iter().enumerate().map(moved).collect();
    TriMesh::with_groups(vertices, part.triangles().to_vec(), part.groups().to_vec())
}
