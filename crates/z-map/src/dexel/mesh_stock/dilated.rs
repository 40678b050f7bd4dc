//! Lines along z through a triangle dilated by a ball.

use nalgebra::{Point3, Vector3};

/// All that is not farther than a radius from a triangle: a prism, three cylinders and three balls.
pub(crate) struct Dilated {
    corners: [Point3<f64>; 3],
    radius: f64,
    /// Unit normal, and for each edge the vector within the plane whose product with a point's
    /// offset from the edge's start is positive inside; `None` for a triangle without area, which
    /// is its edges.
    plane: Option<(Vector3<f64>, [Vector3<f64>; 3])>,
    edges: [Edge; 3],
}

/// An edge as the axis of a cylinder, and what of it is the same for all lines.
struct Edge {
    /// From its start to its end; zero where they are one point.
    along: Vector3<f64>,
    length: f64,
    /// Part of the lines' direction across it, and the square of its length.
    across: Vector3<f64>,
    across_sq: f64,
}

impl Dilated {
    pub(crate) fn new(corners: &[Point3<f64>; 3], radius: f64) -> Self {
        let [a, b, c] = corners;
        let plane = (b - a).cross(&(c - a)).try_normalize(0.0).map(|n| {
            let inward = |from: &Point3<f64>, to: &Point3<f64>| n.cross(&(to - from));
            (n, [inward(a, b), inward(b, c), inward(c, a)])
        });
        Self { corners: *corners, radius, plane, edges: [Edge::new(a, b), Edge::new(b, c), Edge::new(c, a)] }
    }

    /// Where the line through (x, y) is inside.
    ///
    /// The solid is convex, so the line's ends are the least and the greatest of all places where
    /// it meets one of the parts' surfaces.
    pub(crate) fn interval(&self, x: f64, y: f64) -> Option<[f64; 2]> {
        let mut found = [f64::INFINITY, f64::NEG_INFINITY];
        let mut meet = |z: f64| {
            if z.is_finite() {
                found = [found[0].min(z), found[1].max(z)];
            }
        };
        let foot = Point3::new(x, y, 0.0);
        for k in 0..3 {
            let from_corner = foot - self.corners[k];
            let of_ball = ball(&from_corner, self.radius);
            let of_rod = self.edges[k].rod(&from_corner, self.radius);
            of_ball.into_iter().chain(of_rod).flatten().for_each(&mut meet);
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

impl Edge {
    fn new(from: &Point3<f64>, to: &Point3<f64>) -> Self {
        let length = (to - from).norm();
        let along = if length > 0.0 { (to - from) / length } else { Vector3::zeros() };
        let across = Vector3::z() - along * along.z;
        Self { along, length, across, across_sq: across.norm_squared() }
    }

    /// Heights at which a line meets the side of the cylinder about the edge, between its ends; the
    /// line's foot is from its start.
    fn rod(&self, foot: &Vector3<f64>, radius: f64) -> Option<[f64; 2]> {
        let reach = foot.dot(&self.along);
        let beside = foot - self.along * reach;
        // |beside + z·across|² = radius².
        let (a, b, c) = (self.across_sq, self.across.dot(&beside), beside.norm_squared() - radius * radius);
        let root = b * b - a * c;
        if !(a > 0.0 && self.length > 0.0 && root >= 0.0) {
            return None;
        }
        let is_between = |z: &f64| (0.0..=self.length).contains(&(reach + z * self.along.z));
        let root = root.sqrt();
        Some([(-b - root) / a, (-b + root) / a].map(|z| if is_between(&z) { z } else { f64::NAN }))
    }
}
