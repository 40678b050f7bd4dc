use nalgebra::{Point3, Unit, Vector3};

use crate::strategy::patch::Patch;

/// Vertices of a patch with what surrounds them.
pub(crate) struct PatchVertices {
    /// Smooth normal of each, on the side of its first triangle at a crease; +Z where it has no
    /// triangle.
    normals: Vec<Unit<Vector3<f64>>>,
    /// Where the triangles of each vertex begin.
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl PatchVertices {
    pub(crate) fn of(patch: &Patch) -> Self {
        let n = patch.mesh.vertices().len();
        let mut starts = vec![0u32; n + 1];
        for &v in patch.mesh.triangles().iter().flatten() {
            starts[v as usize + 1] += 1;
        }
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; 3 * patch.mesh.triangles().len()];
        for (t, corners) in patch.mesh.triangles().iter().enumerate() {
            for &v in corners {
                triangles[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        let mut this = Self { normals: Vec::new(), starts, triangles };
        let normal = |v: usize| match this.triangles(v as u32).first() {
            Some(&t) => patch.normal(t, &patch.mesh.vertices()[v]),
            None => Vector3::z_axis(),
        };
        this.normals = (0..n).map(normal).collect();
        this
    }

    /// The triangles at a vertex, in rising order.
    pub(crate) fn triangles(&self, v: u32) -> &[u32] {
        let [from, to] = [v, v + 1].map(|k| self.starts[k as usize] as usize);
        &self.triangles[from..to]
    }

    /// The smooth normal at a vertex.
    pub(crate) fn normal(&self, v: u32) -> Unit<Vector3<f64>> {
        self.normals[v as usize]
    }

    /// The smooth normal at a place between two vertices.
    pub(crate) fn normal_between(&self, [a, b]: [u32; 2], t: f64) -> Unit<Vector3<f64>> {
        let mixed = self.normal(a).into_inner() * (1.0 - t) + self.normal(b).into_inner() * t;
        Unit::try_new(mixed, 1e-9).unwrap_or(self.normal(a))
    }
}

/// The place a share of the way from one vertex of a patch to another.
pub(crate) fn on_edge(patch: &Patch, [a, b]: [u32; 2], t: f64) -> Point3<f64> {
    let [a, b] = [a, b].map(|v| patch.mesh.vertices()[v as usize]);
    a + (b - a) * t
}
