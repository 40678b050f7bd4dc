//! Booleans of polygons, and seeded numbers.

pub(crate) use facemill_test_kit::Random;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

pub(crate) type Contour = Vec<[f64; 2]>;
pub(crate) type Shape = Vec<Contour>;

pub(crate) fn moved(p: [f64; 2], d: [f64; 2], by: f64) -> [f64; 2] {
    [p[0] + by * d[0], p[1] + by * d[1]]
}

pub(crate) fn boolean(a: &Vec<Shape>, b: &Vec<Shape>, rule: OverlayRule) -> Vec<Shape> {
    a.overlay_as::<i64>(b, rule, FillRule::EvenOdd)
}

pub(crate) fn area(shape: &Shape) -> f64 {
    let signed = |c: &Contour| -> f64 {
        (0..c.len()).map(|i| (c[i], c[(i + 1) % c.len()])).map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0])).sum()
    };
    shape.iter().map(signed).sum::<f64>().abs()
}

fn distance(shape: &Shape, p: [f64; 2]) -> f64 {
    let to_edge = |a: [f64; 2], b: [f64; 2]| {
        let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let t = ((ab[0] * ap[0] + ab[1] * ap[1]) / (ab[0] * ab[0] + ab[1] * ab[1])).clamp(0.0, 1.0);
        (ap[0] - t * ab[0]).hypot(ap[1] - t * ab[1])
    };
    let edges = shape.iter().flat_map(|c| (0..c.len()).map(|i| (c[i], c[(i + 1) % c.len()])));
    edges.map(|(a, b)| to_edge(a, b)).fold(f64::INFINITY, f64::min)
}

pub(crate) fn contains(shape: &Shape, p: [f64; 2]) -> bool {
    let edges = shape.iter().flat_map(|c| (0..c.len()).map(|i| (c[i], c[(i + 1) % c.len()])));
    let left_of = edges.filter(|(a, b)| {
        (a[1] <= p[1]) != (b[1] <= p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1])
    });
    left_of.count() % 2 == 1
}

/// The shape at a point.
pub(crate) fn at(shapes: Vec<Shape>, p: [f64; 2]) -> Option<Shape> {
    let near = |shape: &Shape| if contains(shape, p) { 0.0 } else { distance(shape, p) };
    shapes.into_iter().min_by(|a, b| near(a).total_cmp(&near(b))).filter(|s| near(s) < 1e-4)
}
