//! Chip section and removal rate along a plan (CHIP, with the outline of the tilted cutter seen along the feed).

use facemill_chip_area::chip_area_between_outlines;
use facemill_cutter_location::cusp::{CutPoint, Ridge};
use facemill_tool_model::{Cutter, Outline};

/// Accuracy of a section area, mm²: a hundredth of the smallest chip anyone cares for with such cutters.
const ACCURACY: f64 = 0.05;

/// Section of the chip at a point, mm²: the stock of thickness `stock` above the surface that this pass takes and the
/// neighbouring one, cut before, has not. Without a neighbour the cutter is in full stock. `None` where it cannot be
/// computed.
pub(crate) fn chip_area_at(cutter: &Cutter, point: &CutPoint, ridge: Option<&Ridge>, stock: f64) -> Option<f64> {
    let own = Outline::new(cutter, point.posture);
    let (from, to) = own.extent();
    let curvature = ridge.map_or(0.0, |r| r.curvature);
    let top = |y: f64| stock + circle_height(curvature, stock, y);
    let before = |y: f64| ridge.and_then(|r| r.neighbour.height_at(y));
    chip_area_between_outlines(before, |y| own.height_at(y), top, from..=to, ACCURACY).ok()
}

/// Height over the tangent of a circle of this curvature, moved outward by `offset`, at `y` from the point of contact; −∞
/// beyond its side.
fn circle_height(curvature: f64, offset: f64, y: f64) -> f64 {
    if curvature == 0.0 {
        return 0.0;
    }
    let radius = 1.0 / curvature + offset;
    let inside = radius * radius - y * y;
    if inside < 0.0 {
        return if curvature > 0.0 { f64::NEG_INFINITY } else { 0.0 };
    }
    // Without the cancellation of R − √(R² − y²).
    -y * y / (radius + inside.sqrt() * radius.signum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use facemill_cl_data::{CcPoint, Posture};
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_narrow_step_takes_stock_times_step() {
        // A flat plane, a disc tilted by 15°: a step of 1 mm takes 2 mm of stock, less what the cusps differ by.
        let cutter = Cutter::new(80.0, 6.0, 12.0).unwrap();
        let point = |y: f64, x: f64| CutPoint {
            cc: CcPoint::new(Point3::new(x, y, 0.0), Vector3::z(), Vector3::x()).unwrap(),
            posture: Posture { tilt: 0.26, rotate: 0.0 },
        };
        let before = [point(1.0, -10.0), point(1.0, 10.0)];
        let own = point(0.0, 0.0);
        let ridge = facemill_cutter_location::cusp::ridges(&cutter, &[own], &before, 10.0)[0].unwrap();
        let area = chip_area_at(&cutter, &own, Some(&ridge), 2.0).unwrap();
        assert!((area - 2.0).abs() < 0.1, "{area}");
        let full = chip_area_at(&cutter, &own, None, 2.0).unwrap();
        assert!(full > 20.0 * area, "{full}");
    }

    #[test]
    fn circle_height_is_that_of_the_circle() {
        for curvature in [0.01f64, -0.01] {
            let r = 1.0 / curvature + 2.0;
            let exact = r.signum() * (r * r - 100.0).sqrt() - r;
            assert!((circle_height(curvature, 2.0, 10.0) - exact).abs() < 1e-12);
        }
    }
}
