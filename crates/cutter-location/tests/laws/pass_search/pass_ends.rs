//! Passes beside a point where passes end, against the nearest of all places of the others on
//! analytic surfaces.

use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::neighbours::{CutPass, Neighbour, NeighbourReach, Neighbours, OwnPlace};
use nalgebra::{Point3, Vector3};

use crate::kit::Random;

/// Height of a surface over x and y.
type Height = fn(f64, f64) -> f64;

const SURFACES: [(&str, Height); 6] = [
    ("plane", |_, _| 0.0),
    ("cylinder across", |x, _| -x * x / 120.0),
    ("paraboloid", |x, y| -(x * x + y * y) / 600.0),
    ("steep paraboloid", |x, y| -(x * x + y * y) / 120.0),
    ("saddle", |x, y| (x * x - y * y) / 300.0),
    ("sphere cap", |x, y| (70.0 * 70.0 - x * x - y * y).sqrt()),
];

const REACH: NeighbourReach = NeighbourReach { far: 60.0, opposed: 60.0 };

/// A curve toward +x about a level of y, from one x to another.
#[derive(Clone, Copy, Debug)]
struct Curve {
    level: f64,
    bow: f64,
    from: f64,
    to: f64,
}

impl Curve {
    fn at(&self, z: Height, x: f64) -> Point3<f64> {
        let y = self.level + self.bow * (x / 30.0).powi(2);
        Point3::new(x, y, z(x, y))
    }

    fn point(&self, z: Height, x: f64) -> CutPoint {
        const H: f64 = 1e-4;
        let at = self.at(z, x);
        let slope = |dx: f64, dy: f64| (z(at.x + dx, at.y + dy) - z(at.x - dx, at.y - dy)) / (2.0 * H);
        let normal = Vector3::new(-slope(H, 0.0), -slope(0.0, H), 1.0);
        let feed = self.at(z, x + H) - self.at(z, x - H);
        let cc = CcPoint::new(at, normal, feed).expect("a point");
        CutPoint { cc, posture: Posture { tilt: 0.2, rotate: 0.0 } }
    }

    /// Its points about 2 mm apart.
    fn pass(&self, z: Height) -> CutPass {
        let n = ((self.to - self.from) / 2.0).ceil().max(2.0);
        let x = |k: i32| self.from + (self.to - self.from) * f64::from(k) / n;
        CutPass { points: (0..=n as i32).map(|k| self.point(z, x(k))).collect(), uncut_left: true }
    }

    /// Returns places 0.05 mm apart, continued this far beyond its ends.
    fn dense(&self, z: Height, beyond: f64) -> Vec<Point3<f64>> {
        let n = ((self.to - self.from + 2.0 * beyond) / 0.05).ceil() as i32;
        let x = |k: i32| self.from - beyond + (self.to - self.from + 2.0 * beyond) * f64::from(k) / f64::from(n);
        (0..=n).map(|k| self.at(z, x(k))).collect()
    }
}

/// Checks that a place lies on the side of a point, and no farther ahead or behind than aside.
fn beside(own: &CcPoint, place: &Point3<f64>, is_left: bool) -> Option<[f64; 2]> {
    let between = place - own.position;
    let aside = own.left().dot(&between) * if is_left { 1.0 } else { -1.0 };
    (aside > 1e-6 && own.feed.dot(&between).abs() <= aside).then(|| [between.norm(), aside])
}

/// Returns bounds of the step-over for a ball: the distance to the nearest place of the others if
/// they continued, and twice the way across the feed to where some other is as near as this one.
fn bounds(
    own: &CcPoint,
    is_left: bool,
    others: &[Vec<Point3<f64>>],
    going_on: &[Vec<Point3<f64>>],
) -> Option<[f64; 2]> {
    let least = |of: &[Vec<Point3<f64>>], measure: fn([f64; 2]) -> f64| {
        let places = of.iter().flatten().filter_map(|p| beside(own, p, is_left));
        places.map(measure).fold(f64::INFINITY, f64::min)
    };
    let most = least(others, |[distance, aside]| distance * distance / aside);
    most.is_finite().then(|| [least(going_on, |[distance, _]| distance), most])
}

fn sides(neighbours: &Neighbours, pass: usize, point: usize) -> [Option<Neighbour>; 2] {
    neighbours.of(OwnPlace { pass, point }).nearest
}

#[test]
fn passes_five_apart_are_five_apart_up_to_their_ends_wherever_a_surface_falls() {
    for (name, z) in SURFACES {
        let passes: Vec<CutPass> =
            (-4..=4).map(|k| Curve { level: 5.0 * f64::from(k), bow: 0.0, from: -30.0, to: 30.0 }.pass(z)).collect();
        let n_passes = passes.len();
        let neighbours = Neighbours::new(passes, REACH);
        for pass in 0..n_passes {
            for point in 0..neighbours.passes()[pass].points.len() {
                for (is_left, found) in [false, true].into_iter().zip(sides(&neighbours, pass, point)) {
                    let is_outermost = pass == if is_left { n_passes - 1 } else { 0 };
                    assert_eq!(found.is_none(), is_outermost, "{name}: {pass} {point} {found:?}");
                    let Some(found) = found else { continue };
                    // Five millimetres of y, on a slope that is less steep across than these
                    // surfaces are anywhere.
                    let step = found.strip.step_over;
                    assert!((4.99..5.6).contains(&step), "{name}: pass {pass} point {point}: {step}");
                }
            }
        }
    }
}

#[test]
fn beside_ends_anywhere_the_step_over_is_that_of_the_nearest_pass() {
    let mut random = Random(23);
    let mut n_beside_ends = 0;
    for (name, z) in SURFACES {
        for family in 0..4 {
            let (skew, bow) = (random.between(-0.4, 0.4), random.between(-3.0, 3.0));
            let hollow = random.between(-0.01, 0.01);
            let step = random.between(3.0, 8.0);
            let end = |y: f64| 24.0 + skew * y + hollow * y * y;
            let mut curves: Vec<Curve> = (-3..=3)
                .map(|k| step * f64::from(k))
                .map(|level| Curve { level, bow, from: -end(level), to: end(-level) })
                .collect();
            // One is partial. If cut first, it is beside those cut later.
            let mut partial = curves.remove(2 + family % 3);
            partial.from = random.between(-15.0, 5.0);
            curves.insert(0, partial);
            let neighbours = Neighbours::new(curves.iter().map(|c| c.pass(z)).collect(), REACH);
            let dense: Vec<_> = curves.iter().map(|c| c.dense(z, 0.0)).collect();
            let going_on: Vec<_> = curves.iter().map(|c| c.dense(z, 20.0)).collect();
            let without = |of: &[Vec<Point3<f64>>], k: usize| [&of[..k], &of[k + 1..]].concat();
            for pass in 0..curves.len() {
                let (others, going_on) = (without(&dense, pass), without(&going_on, pass));
                for point in 0..neighbours.passes()[pass].points.len() {
                    let own = neighbours.passes()[pass].points[point].cc;
                    for (is_left, found) in [false, true].into_iter().zip(sides(&neighbours, pass, point)) {
                        let Some([least, most]) = bounds(&own, is_left, &others, &going_on) else { continue };
                        let place = format!("{name} {family}: pass {pass} point {point} {is_left}");
                        let found = found.unwrap_or_else(|| panic!("{place}: none, but {least} to {most}"));
                        let step = found.strip.step_over;
                        assert!(step > 0.95 * least && step < 1.05 * most, "{place}: {step}, {least} to {most}");
                        n_beside_ends += usize::from(most > 1.02 * least);
                    }
                }
            }
        }
    }
    assert!(n_beside_ends > 50, "{n_beside_ends}");
}
