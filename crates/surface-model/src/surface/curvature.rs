use nalgebra::{Matrix3, Unit, Vector3};

use crate::mesh::tri_mesh::TriMesh;
use crate::surface::normals::SmoothVertices;

/// Curvature of a surface at a point: the turn of the unit normal per step along the surface, 1/mm.
///
/// Positive where the surface bends away from the outside (convex, as a ball seen from outside),
/// negative where it bends towards it (concave, where a cutter may gouge). It is an estimate: on a
/// mesh of a smooth surface its error falls with the edge length, and is largest where triangles
/// are irregular and at open edges.
///
/// Source: Rusinkiewicz, Estimating curvatures and their derivatives on triangle meshes, 3DPVT
/// 2004, section 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvatureTensor {
    /// Unit normal, out of the material.
    pub normal: Unit<Vector3<f64>>,
    /// Symmetric; maps a tangent step to the change of the normal, and the normal to zero; 1/mm.
    pub tensor: Matrix3<f64>,
}

/// The two extreme normal curvatures and their directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalCurvatures {
    /// Largest normal curvature, 1/mm.
    pub max: f64,
    /// Smallest normal curvature, 1/mm; negative where a convex cutter of larger radius can gouge.
    pub min: f64,
    /// Tangent direction of the largest. Any tangent at an umbilic point, where both are equal.
    pub max_direction: Unit<Vector3<f64>>,
    /// Tangent direction of the smallest, a right angle from the other about the normal.
    pub min_direction: Unit<Vector3<f64>>,
}

impl CurvatureTensor {
    /// Returns the normal curvature in the direction of `along`, whose part along the normal is
    /// ignored; 1/mm.
    ///
    /// `None` when `along` is parallel to the normal.
    pub fn normal_curvature(&self, along: &Vector3<f64>) -> Option<f64> {
        let tangent = along - self.normal.into_inner() * self.normal.dot(along);
        let direction = Unit::try_new(tangent, 1e-12 * along.norm())?;
        Some(direction.dot(&(self.tensor * direction.into_inner())))
    }

    /// Returns principal curvatures and directions.
    pub fn principal(&self) -> PrincipalCurvatures {
        let (u, v) = tangents(&self.normal);
        let entry = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(self.tensor * b));
        let (uu, uv, vv) = (entry(&u, &u), entry(&u, &v), entry(&v, &v));
        // The tensor in the plane turned by the angle that makes it diagonal.
        let angle = 0.5 * (2.0 * uv).atan2(uu - vv);
        let half = (0.5 * (uu - vv)).hypot(uv);
        let mean = 0.5 * (uu + vv);
        let (s, c) = angle.sin_cos();
        PrincipalCurvatures {
            max: mean + half,
            min: mean - half,
            max_direction: Unit::new_normalize(u.into_inner() * c + v.into_inner() * s),
            min_direction: Unit::new_normalize(v.into_inner() * c - u.into_inner() * s),
        }
    }

    /// Returns the weighted sum of tensors, each turned from its own normal to `normal`; `None`
    /// where a tensor with a weight is missing.
    pub(crate) fn blend(
        normal: Unit<Vector3<f64>>,
        parts: &[(f64, Option<&VertexCurvature>)],
    ) -> Option<CurvatureTensor> {
        let mut tensor = Matrix3::zeros();
        for &(weight, part) in parts.iter().filter(|(w, _)| *w > 0.0) {
            let part = part?;
            tensor += weight * turned(&part.tensor, &part.normal, &normal);
        }
        Some(Self { normal, tensor })
    }
}

/// Curvature at a smooth vertex.
#[derive(Clone, Debug)]
pub(crate) struct VertexCurvature {
    normal: Unit<Vector3<f64>>,
    tensor: Matrix3<f64>,
}

/// Returns the curvature at each smooth vertex: means of the facets around it, weighted by the part
/// of their area nearest to it.
pub(crate) fn vertex_curvatures(
    mesh: &TriMesh,
    facets: &[Option<Unit<Vector3<f64>>>],
    smooth: &SmoothVertices,
) -> Vec<Option<VertexCurvature>> {
    let mut sums = vec![(0.0, Matrix3::zeros()); smooth.normals.len()];
    for (t, facet) in facets.iter().enumerate() {
        let corners = [0, 1, 2].map(|k| smooth.of_corner[3 * t + k] as usize);
        let (Some(facet), [Some(a), Some(b), Some(c)]) = (facet, corners.map(|s| smooth.normals[s])) else { continue };
        let Some(tensor) = facet_curvature(&mesh.corners(t), facet, &[a, b, c]) else { continue };
        for ((s, normal), weight) in corners.into_iter().zip([a, b, c]).zip(voronoi_areas(mesh, t)) {
            sums[s].0 += weight;
            sums[s].1 += weight * turned(&tensor, facet, &normal);
        }
    }
    sums.into_iter()
        .zip(&smooth.normals)
        .map(|((weight, sum), normal)| {
            let tensor = sum / weight;
            (weight > 0.0 && tensor.iter().all(|x| x.is_finite()))
                .then_some(VertexCurvature { normal: (*normal)?, tensor })
        })
        .collect()
}

/// Returns the tensor in the facet's plane that best explains the differences of the corner normals
/// along the three sides, by least squares (Rusinkiewicz, section 3.1).
fn facet_curvature(
    p: &[nalgebra::Point3<f64>; 3],
    facet: &Unit<Vector3<f64>>,
    normals: &[Unit<Vector3<f64>>; 3],
) -> Option<Matrix3<f64>> {
    let u = Unit::try_new(p[1] - p[0], 0.0)?;
    let v = Unit::new_normalize(facet.cross(&u));
    let (mut m, mut r) = (Matrix3::zeros(), Vector3::zeros());
    for k in 0..3 {
        let (i, j) = (k, (k + 1) % 3);
        let step = p[j] - p[i];
        let turn = normals[j].into_inner() - normals[i].into_inner();
        // Two equations per side for the entries uu, uv, vv: tensor · step = turn, seen in the
        // plane.
        for row in [
            (Vector3::new(step.dot(&u), step.dot(&v), 0.0), turn.dot(&u)),
            (Vector3::new(0.0, step.dot(&u), step.dot(&v)), turn.dot(&v)),
        ] {
            m += row.0 * row.0.transpose();
            r += row.0 * row.1;
        }
    }
    let entries = m.cholesky()?.solve(&r);
    let (u, v) = (u.into_inner(), v.into_inner());
    let mixed = u * v.transpose() + v * u.transpose();
    Some(entries.x * u * u.transpose() + entries.y * mixed + entries.z * v * v.transpose())
}

/// Moves a tensor from the plane with normal `from` to the plane with normal `to` by the smallest
/// turn.
fn turned(tensor: &Matrix3<f64>, from: &Unit<Vector3<f64>>, to: &Unit<Vector3<f64>>) -> Matrix3<f64> {
    let cosine = from.dot(to);
    // Opposite normals: the planes are the same, and any half turn in them keeps the tensor of a
    // plane.
    if cosine <= -1.0 + 1e-9 {
        return *tensor;
    }
    // Rodrigues' formula with the unnormalised axis: it needs no angle, and loses nothing near
    // zero.
    let cross = from.cross(to).cross_matrix();
    let turn = Matrix3::identity() + cross + cross * cross / (1.0 + cosine);
    turn * tensor * turn.transpose()
}

/// Returns the parts of a triangle's area that are nearest to each of its corners; where it is
/// obtuse, half of it for the obtuse corner and a quarter for each other (Meyer et al., Discrete
/// differential-geometry operators, 2003, section 3.3).
fn voronoi_areas(mesh: &TriMesh, triangle: usize) -> [f64; 3] {
    let p = mesh.corners(triangle);
    let area = 0.5 * mesh.scaled_normal(triangle).norm();
    let side_sq = [0, 1, 2].map(|k| (p[(k + 2) % 3] - p[(k + 1) % 3]).norm_squared());
    // Scalar product of the two sides at each corner.
    let dot = [0, 1, 2].map(|k| (p[(k + 1) % 3] - p[k]).dot(&(p[(k + 2) % 3] - p[k])));
    if let Some(obtuse) = dot.iter().position(|&d| d <= 0.0) {
        return [0, 1, 2].map(|k| if k == obtuse { 0.5 * area } else { 0.25 * area });
    }
    [0, 1, 2].map(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        (side_sq[i] * dot[i] + side_sq[j] * dot[j]) / (16.0 * area)
    })
}

/// Returns two unit tangents that make a right-handed frame with the normal.
fn tangents(n: &Unit<Vector3<f64>>) -> (Unit<Vector3<f64>>, Unit<Vector3<f64>>) {
    let mut axis = Vector3::zeros();
    axis[n.iamin()] = 1.0;
    let u = Unit::new_normalize(n.cross(&axis));
    (u, Unit::new_normalize(n.cross(&u)))
}

#[cfg(test)]
#[path = "../../tests/unit/surface/curvature.rs"]
mod tests;
