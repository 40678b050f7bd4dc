//! Lines along z through a triangle dilated by a ball.

use nalgebra::{Point3, Vector3};

/// All that is not farther than a radius from a triangle: a prism, three cylinders and three balls.
pub(crate) struct Dilated {
    corners: [Point3<f64>; 3],
    radius: f64,
    /// Unit normal, and for each edge the vector within the plane whose product with a point's offset from the edge's
    /// start is positive inside; `None` for a triangle without area, which is its edges.
    plane: Option<(Vector3<f64>, [Vector3<f64>; 3])>,
}

impl Dilated {
    pub(crate) fn new(corners: &[Point3<f64>; 3], radius: f64) -> Self {
        let [a, b, c] = corners;
        let plane = (b - a).cross(&(c - a)).try_normalize(0.0).map(|n| {
            let inward = |from: &Point3<f64>, to: &Point3<f64>| n.cross(&(to - from));
            (n, [inward(a, b), inward(b, c), inward(c, a)])
        });
        Self { corners: *corners, radius, plane }
    }

    /// Where the line through (x, y) is inside.
    ///
    /// The solid is convex, so the line's ends are the least and the greatest of all places where it meets one of the
    /// parts' surfaces.
    pub(crate) fn interval(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        let mut found = [f64::INFINITY, f64::NEG_INFINITY];
        let mut meet = |z: f64| {
            if z.is_finite() {
                found = [found[0].min(z), found[1].max(z)];
            }
        };
        let foot = Point3::new(x, y, 0.0);
        for k in 0..3 {
            let (a, b) = (&self.corners[k], &self.corners[(k + 1) % 3]);
            for z in ball(&(foot - a), self.radius).into_iter().flatten() {
                meet(z);
            }
            for z in rod(&(foot - a), &(b - a), self.radius).into_iter().flatten() {
                meet(z);
            }
        }
        if let Some((n, inward)) = &self.plane
            && n.z != 0.0
        {
            for offset in [n * self.radius, n * -self.radius] {
                let z = n.dot(&(self.corners[0] + offset - foot)) / n.z;
                let p = foot + Vector3::z() * z - offset;
                if (0..3).all(|k| inward[k].dot(&(p - self.corners[k])) >= 0.0) {
                    meet(z);
                }
            }
        }
        (found[0] < found[1]).then_some(found)
    }
}

/// Heights at which a line meets a ball whose centre the line's foot is this far from.
fn ball(foot: &Vector3<f64>, radius: f64) -> Option<[f64; 2]> {
    let half = radius * radius - foot.x * foot.x - foot.y * foot.y;
    (half >= 0.0).then(|| [-foot.z - half.sqrt(), -foot.z + half.sqrt()])
}

/// Heights at which a line meets the side of a cylinder about an edge, between its ends; the foot is from its start.
fn rod(foot: &Vector3<f64>, edge: &Vector3<f64>, radius: f64) -> Option<[f64; 2]> {
    let length_sq = edge.norm_squared();
    let across = |v: &Vector3<f64>| v - edge * (v.dot(edge) / length_sq);
    let (u, f) = (across(&Vector3::z()), across(foot));
    // |f + z·u|² = radius².
    let (a, b, c) = (u.norm_squared(), u.dot(&f), f.norm_squared() - radius * radius);
    let root = b * b - a * c;
    if !(a > 0.0 && root >= 0.0) {
        return None;
    }
    let between = |z: f64| {
        let along = (foot + Vector3::z() * z).dot(edge);
        if (0.0..=length_sq).contains(&along) { z } else { f64::NAN }
    };
    Some([(-b - root.sqrt()) / a, (-b + root.sqrt()) / a].map(between))
}
