//! Places of what is left that passes do not reach.

use nalgebra::{Point3, Unit, Vector3};

use crate::left_region::StockHeight;
use crate::left_region::ball_tree::{Ball, BallTree};

/// Point of a pass with the strip that the pass cuts there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripPoint {
    /// On the surface, workpiece frame, mm.
    pub position: Point3<f64>,
    /// Normal of the surface.
    pub normal: Unit<Vector3<f64>>,
    /// Half the width of the strip, mm.
    pub half_width: f64,
}

/// Distance of balls along a pass, as a share of their radius: their common width is then 0.8 %
/// narrower than they are. Larger: places at the edge of a strip count as not reached; smaller:
/// more balls.
const SPACING: f64 = 0.25;

/// Most balls on a pass between two points.
const MOST: f64 = 1_000.0;

/// Returns the indices of places that are farther than half the strip's width from all passes.
pub(crate) fn not_reached(places: &[StockHeight], passes: &[Vec<StripPoint>]) -> Vec<usize> {
    let tree = BallTree::new(passes.iter().flat_map(|pass| balls(pass)).collect());
    let reached = |p: &StockHeight| tree.deepest(&p.position, Some(&p.normal), -1.0) >= 0.0;
    (0..places.len()).filter(|&k| !reached(&places[k])).collect()
}

/// Balls that cover the strip of a pass.
fn balls(pass: &[StripPoint]) -> Vec<Ball> {
    let wider = 1.0 / (1.0 - 0.25 * SPACING * SPACING).sqrt();
    let ball = |position, normal, half: f64| Ball { center: position, radius: half * wider, normal };
    let mut found = Vec::new();
    for (k, point) in pass.iter().enumerate() {
        found.push(ball(point.position, point.normal, point.half_width));
        let Some(next) = pass.get(k + 1) else { continue };
        let (way, half) = (next.position - point.position, point.half_width.min(next.half_width));
        let n = (way.norm() / (SPACING * half)).min(MOST).ceil();
        let between = (1..n as usize).map(|i| i as f64 / n);
        found.extend(between.map(|t| {
            let width = point.half_width + (next.half_width - point.half_width) * t;
            ball(point.position + way * t, if t < 0.5 { point.normal } else { next.normal }, width)
        }));
    }
    found
}
