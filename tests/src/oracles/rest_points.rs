//! Stock as points, cut by a program's cutter and met by its bodies: slow, and with no code of the
//! product.

use nalgebra::Point3;

use crate::oracles::brute::in_tool;
use crate::oracles::interpreter::Motion;
use crate::oracles::read_back::{ReadBack, TipAndAxis};

/// Points of stock, each with its height above the part.
pub struct RestPoints {
    /// Points that are left.
    pub left: Vec<RestPoint>,
}

/// A point of stock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestPoint {
    /// Its place, workpiece frame.
    pub place: Point3<f64>,
    /// Its height above the part, mm.
    pub height: f64,
    /// Least distance that the cutter has had from it, mm.
    pub clearance: f64,
}

/// A point of the rest that a program must not meet there.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Line of the motion.
    pub line: usize,
    /// The point.
    pub point: Point3<f64>,
    /// How deep it is in the body, mm; 0 where bodies give no depth.
    pub depth: f64,
}

impl RestPoints {
    /// Over a surface z(x, y), in steps of `step` mm along x and y between two corners, and of
    /// `rise` mm upward to a height.
    pub fn over(
        [low, high]: [[f64; 2]; 2],
        (step, rise): (f64, f64),
        height: f64,
        surface: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let steps = |from: f64, to: f64, by: f64| (0..=((to - from) / by) as usize).map(move |k| from + by * k as f64);
        let mut left = Vec::new();
        for x in steps(low[0], high[0], step) {
            for y in steps(low[1], high[1], step) {
                left.extend(steps(0.5 * rise, height, rise).map(|height| RestPoint {
                    place: Point3::new(x, y, surface(x, y) + height),
                    height,
                    clearance: f64::INFINITY,
                }));
            }
        }
        Self { left }
    }

    /// Points that are left for certain behind programs in steps of `step` mm: between two steps
    /// the cutter is no nearer to a point than at one of them, less half a step.
    pub fn certain(&self, step: f64) -> Vec<Point3<f64>> {
        self.left.iter().filter(|p| p.clearance > 0.5 * step).map(|p| p.place).collect()
    }

    /// Cuts the points by a program, and returns those that a body, or in rapid the cutter, meets
    /// on its way while they are there.
    pub fn cut(&mut self, back: &ReadBack, motions: &[Motion], step: f64) -> Vec<Met> {
        let mut met = Vec::new();
        let reach = back.bodies.iter().map(|b| b.shape.high).fold(back.cutter.height, f64::max) + 200.0;
        for motion in motions {
            for place in back.places(motion, step) {
                self.meet(back, motion, &place, reach, &mut met);
                if !motion.rapid {
                    self.left.retain_mut(|p| {
                        let (rho, z) = in_tool(&place.0, &place.1, &p.place);
                        p.clearance = p.clearance.min(back.cutter.signed_distance(rho, z));
                        p.clearance > 0.0
                    });
                }
            }
        }
        met
    }

    fn meet(&self, back: &ReadBack, motion: &Motion, (tip, axis): &TipAndAxis, reach: f64, met: &mut Vec<Met>) {
        for p in self.left.iter().map(|p| &p.place).filter(|p| (*p - tip).norm() < reach) {
            let (rho, z) = in_tool(tip, axis, p);
            let in_cutter = -back.cutter.signed_distance(rho, z);
            let in_body = back.bodies.iter().any(|b| b.shape.distance(rho, z) <= 0.0);
            // The lower end of the first body is the upper end of the cutter.
            if in_body && z > back.cutter.height + ROUNDING || motion.rapid && in_cutter > ROUNDING {
                met.push(Met { line: motion.line, point: *p, depth: in_cutter.max(0.0) });
            }
        }
    }
}

/// Depth that counts as rounding of the text, mm.
const ROUNDING: f64 = 0.02;
