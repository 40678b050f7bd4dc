//! The tilt at which a tilted cutter begins to gouge an analytic surface behind its contact, from
//! the surface's equation alone: no mesh, no code under test.

use std::f64::consts::TAU;

use facemill_test_kit::golden_least;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::oracles::brute::SECTIONS;

/// Signed distance of a point from the torus about z with material inside, mm: positive outside the
/// material.
pub fn torus_distance(p: &Point3<f64>, major_radius: f64, minor_radius: f64) -> f64 {
    (p.x.hypot(p.y) - major_radius).hypot(p.z) - minor_radius
}

/// Signed distance of a point from `z = x²/(2·concave) − y²/(2·convex)`, mm: positive above. Exact
/// to rounding where the point is nearer to the surface than the centres of curvature.
///
/// The foot of p lies at p − t·(−x/concave, y/convex, 1), (x, y) its place. So x = p.x/(1 −
/// t/concave), y = p.y/(1 + t/convex), and the foot's height leaves one equation for t, whose left
/// side falls with t.
pub fn saddle_distance(p: &Point3<f64>, concave: f64, convex: f64) -> f64 {
    let foot = |t: f64| (p.x / (1.0 - t / concave), p.y / (1.0 + t / convex));
    let is_above = |t: f64| {
        let (x, y) = foot(t);
        p.z - t > 0.5 * (x * x / concave - y * y / convex)
    };
    let (mut low, mut high) = (-convex, concave);
    for _ in 0..64 {
        let t = 0.5 * (low + high);
        if is_above(t) { low = t } else { high = t }
    }
    let (x, y) = foot(low);
    low * (1.0 + (x / concave).powi(2) + (y / convex).powi(2)).sqrt()
}

/// The lowest part of a cutter's test body: every point within `rounding` of a disc of radius `rim`
/// that lies `height` above the tip, mm. Only its rim matters behind the contact.
#[derive(Clone, Copy, Debug)]
pub struct RoundDisc {
    /// Radius of the circle of the corner's centres.
    pub rim: f64,
    /// Its height.
    pub height: f64,
    /// Radius of the ball.
    pub rounding: f64,
}

impl RoundDisc {
    /// That of a cutter with R and r.
    pub fn of_cutter(radius: f64, corner: f64) -> Self {
        Self { rim: radius - corner, height: corner, rounding: corner }
    }

    /// All points within `by` of it.
    pub fn dilated(self, by: f64) -> Self {
        Self { rounding: self.rounding + by, ..self }
    }

    /// Points about each of which the ball of radius `by` lies inside the cutter.
    pub fn eroded(self, by: f64) -> Self {
        let cut = (by - self.rounding).max(0.0);
        Self { rim: self.rim - cut, height: self.height + cut, rounding: (self.rounding - by).max(0.0) }
    }

    /// Signed distance from a surface of the point of the body that is deepest below or nearest
    /// above it, found over the rim to 1e-10 mm.
    pub fn gap(&self, part_from_tool: &Isometry3<f64>, distance: &dyn Fn(&Point3<f64>) -> f64) -> f64 {
        let n = 90;
        let at = |k: f64| {
            let (sin, cos) = (TAU * k / f64::from(n)).sin_cos();
            distance(&(part_from_tool * Point3::new(self.rim * cos, self.rim * sin, self.height))) - self.rounding
        };
        let sampled: Vec<f64> = (0..n).map(|k| at(f64::from(k))).collect();
        let is_lowest = |k: &i32| {
            let value = |k: i32| sampled[k.rem_euclid(n) as usize];
            value(*k) <= value(k - 1) && value(*k) <= value(k + 1)
        };
        let about = |k: i32| golden_least(SECTIONS, |u| at(f64::from(k - 1) + 2.0 * u));
        (0..n).filter(is_lowest).map(about).chain(sampled.iter().copied()).fold(f64::INFINITY, f64::min)
    }
}

/// Where a cutter touches a surface, and the unit tangent along which its bottom rises by the tilt.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// The point.
    pub at: Point3<f64>,
    /// Unit normal, out of the material.
    pub normal: Vector3<f64>,
    /// Unit tangent from the contact to the far side of the disc.
    pub across: Vector3<f64>,
}

impl Touch {
    /// Part from tool frame of a cutter that touches with its corner after being lifted along the
    /// normal.
    pub fn pose(&self, cutter: &RoundDisc, tilt: f64, lift: f64) -> Isometry3<f64> {
        let (sin, cos) = tilt.sin_cos();
        let x = self.across * cos + self.normal * sin;
        let z = self.normal * cos - self.across * sin;
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        let centre = self.at + self.normal * (cutter.rounding + lift);
        let to_corner = turn * Vector3::new(-cutter.rim, 0.0, cutter.height);
        Isometry3::from_parts(Translation3::from(centre - to_corner), turn)
    }
}

/// The tilt from which on a body is free, by bisection to 1e-11 rad between a tilt that hits and
/// one that is free.
///
/// # Panics
/// When these are not so.
pub fn onset(hit: f64, free: f64, is_free: &dyn Fn(f64) -> bool) -> f64 {
    assert!(!is_free(hit) && is_free(free), "no onset between {hit} and {free}");
    let (mut hit, mut free) = (hit, free);
    while free - hit > 1e-11 {
        let middle = 0.5 * (hit + free);
        if is_free(middle) { free = middle } else { hit = middle }
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;
    use facemill_test_kit::Random;

    #[test]
    fn saddle_distance_is_that_along_the_normal() {
        let (concave, convex) = (60.0, 80.0);
        let mut random = Random(3);
        for _ in 0..1000 {
            let [x, y] = [0; 2].map(|_| random.between(-60.0, 60.0));
            let far = random.between(-30.0, 40.0);
            let foot = Point3::new(x, y, 0.5 * (x * x / concave - y * y / convex));
            let normal = Vector3::new(-x / concave, y / convex, 1.0).normalize();
            let found = saddle_distance(&(foot + normal * far), concave, convex);
            assert!((found - far).abs() < 1e-10, "{found} for {far} at {foot}");
        }
    }

    #[test]
    fn a_ball_about_any_point_of_the_eroded_disc_is_in_the_cutter() {
        use crate::oracles::brute::RoundedCylinder;
        let mut random = Random(4);
        for corner in [0.0, 0.3, 2.0, 12.0] {
            let cutter = RoundedCylinder { radius: 25.0, corner, height: 60.0 };
            let by = random.between(0.2, 1.0);
            let small = RoundDisc::of_cutter(25.0, corner).eroded(by);
            for _ in 0..1000 {
                let (sin, cos) = random.between(-TAU / 4.0, TAU / 4.0).sin_cos();
                let (rho, z) = (small.rim + small.rounding * cos, small.height + small.rounding * sin);
                assert!(cutter.signed_distance(rho, z) <= 1e-9 - by, "{corner} {by}: ({rho}, {z})");
            }
        }
    }
}
