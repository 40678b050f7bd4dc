//! Depth of a cutter in triangles, by formulas of its own and bisection of triangles: the
//! definition of correct.

use nalgebra::{Point3, Unit, Vector3};

/// A cutter as a solid: R, r of its lower edge, height of its sharp top above the tip, mm.
#[derive(Clone, Copy, Debug)]
pub struct Cutter {
    pub radius: f64,
    pub corner: f64,
    pub height: f64,
}

/// A place of the tool: tip and axis.
pub type TipAndAxis = (Point3<f64>, Unit<Vector3<f64>>);

/// A triangle.
pub type Triangle = [Point3<f64>; 3];

/// Bisection ends where no deeper place than by this can be left, mm.
const RESOLUTION: f64 = 1e-9;

impl Cutter {
    /// How far a point is outside, mm (inside negative: its distance from the cutter's surface),
    /// and a slope of that. It is the largest of convex functions, and so is convex.
    pub fn outside(&self, (tip, axis): &TipAndAxis, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let up = axis.into_inner();
        let z = (p - tip).dot(&up);
        let across = p - tip - up * z;
        let rho = across.norm();
        let rim = self.radius - self.corner;
        let lower = if rho > rim && z < self.corner {
            let (side, down) = (rho - rim, self.corner - z);
            let away = (side * side + down * down).sqrt();
            (away - self.corner, (across * (side / rho) - up * down) / away)
        } else if rho - self.radius > -z {
            (rho - self.radius, across / rho)
        } else {
            (-z, -up)
        };
        if z - self.height > lower.0 { (z - self.height, up) } else { lower }
    }

    /// How deep the cutter is at most in the triangles at any of the places: the largest distance
    /// of a point of theirs in it from its surface, to a millionth of a micrometre; 0 where it
    /// touches none. Of depths above `at_most` only that they are.
    pub fn depth(&self, places: impl Iterator<Item = TipAndAxis>, triangles: &[Triangle], at_most: f64) -> f64 {
        let mut lowest = 0.0;
        for place in places {
            for t in triangles {
                self.lower(&place, t, &mut lowest);
                if lowest < -at_most {
                    return -lowest;
                }
            }
        }
        -lowest
    }

    /// Brings `lowest` down to the lowest value over a triangle. A convex function lies above its
    /// slope's plane: where that is not below `lowest` at a corner, nothing is.
    fn lower(&self, place: &TipAndAxis, t: &Triangle, lowest: &mut f64) {
        let middle = Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0);
        let (here, slope) = self.outside(place, &middle);
        let along = t.map(|corner| here + slope.dot(&(corner - middle)));
        let k = (0..3).min_by(|&a, &b| along[a].total_cmp(&along[b])).unwrap();
        if along[k] >= *lowest - RESOLUTION {
            return;
        }
        *lowest = lowest.min(here).min(self.outside(place, &t[k]).0);
        if along[k] >= *lowest - RESOLUTION {
            return;
        }
        // The longest side is halved.
        let side = |k: usize| (t[(k + 1) % 3] - t[k]).norm_squared();
        let k = (0..3).max_by(|&a, &b| side(a).total_cmp(&side(b))).unwrap();
        let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
        let half = nalgebra::center(&a, &b);
        self.lower(place, &[a, half, c], lowest);
        self.lower(place, &[half, b, c], lowest);
    }
}
