use nalgebra::Point3;

use crate::strategy::patch::Patch;

impl Patch<'_> {
    /// The side of the surface's triangle that a side of a triangle of the patch is a piece of;
    /// `None` of a side that cuts through it.
    pub(crate) fn side_of_parent(&self, triangle: u32, side: usize) -> Option<usize> {
        let corners = self.surface.mesh().corners(self.parent(triangle) as usize);
        let v = self.mesh.triangles()[triangle as usize];
        let ends = [v[side], v[(side + 1) % 3]].map(|v| self.mesh.vertices()[v as usize]);
        let lies_on = |k: usize| ends.iter().all(|p| is_between(p, &corners[k], &corners[(k + 1) % 3]));
        (0..3).find(|&k| lies_on(k))
    }
}

/// Whether a place lies on the line from `a` to `b`, to rounding.
fn is_between(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> bool {
    let (along, off) = (b - a, p - a);
    along.cross(&off).norm() <= 1e-9 * along.norm_squared()
}
