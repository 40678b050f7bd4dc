//! Views along the coordinates of the table frame.

use nalgebra::{Point3, Vector3};

/// A direction of view: coordinates to the right and up, and the sign of the third one toward the
/// eye.
pub(crate) struct ViewKind {
    pub(crate) name: &'static str,
    pub(crate) right: usize,
    pub(crate) up: usize,
    depth: usize,
    toward: f64,
}

/// Front, side and top.
pub(crate) const VIEWS: [ViewKind; 3] = [
    ViewKind { name: "front: x to the right, z up", right: 0, up: 2, depth: 1, toward: -1.0 },
    ViewKind { name: "side: y to the right, z up", right: 1, up: 2, depth: 0, toward: 1.0 },
    ViewKind { name: "top: x to the right, y up", right: 0, up: 1, depth: 2, toward: 1.0 },
];

/// A view at its place of the sheet.
pub(crate) struct SheetView {
    pub(crate) of: &'static ViewKind,
    /// Left and top edge, width and height, pixels.
    pub(crate) corner: [f64; 2],
    pub(crate) size: [f64; 2],
    /// Place of the table's origin, pixels.
    pub(crate) origin: [f64; 2],
    /// Pixels per mm.
    pub(crate) scale: f64,
}

impl SheetView {
    /// Returns the place of a point, pixels: y grows downward.
    pub(crate) fn at(&self, p: &Point3<f64>) -> [f64; 2] {
        let [u, v] = self.along(&p.coords);
        [self.origin[0] + self.scale * u, self.origin[1] + self.scale * v]
    }

    /// Returns a vector of the table frame as it is seen, in its own length.
    pub(crate) fn along(&self, v: &Vector3<f64>) -> [f64; 2] {
        [v[self.of.right], 0.0 - v[self.of.up]]
    }

    /// Returns the share of a direction toward the eye.
    pub(crate) fn toward(&self, v: &Vector3<f64>) -> f64 {
        self.of.toward * v[self.of.depth]
    }

    /// Returns two unit vectors across a direction as they are seen; the turn from the first to the
    /// second is right-handed about it.
    pub(crate) fn frame(&self, direction: &Vector3<f64>) -> ([f64; 2], [f64; 2]) {
        let mut right = Vector3::zeros();
        right[self.of.right] = 1.0;
        let a = (right - direction * right.dot(direction)).normalize();
        let b = direction.cross(&a);
        (self.along(&a), self.along(&b))
    }
}
