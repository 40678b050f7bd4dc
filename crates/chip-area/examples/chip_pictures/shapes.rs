//! Polygons of a section, for drawing only.

use std::f64::consts::PI;

use facemill_chip_area::{Beside, NeighbourAxis, Orientation, PassSection, SectionSurface};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use nalgebra::Vector3;

use crate::figure::Mm;

pub(crate) type Contour = Vec<Mm>;
pub(crate) type Shape = Vec<Contour>;

const FAR: f64 = 400.0;

/// Right of the feed and up, of a vector with x along the feed, y to the left and z along the
/// normal of this pass.
pub(crate) fn seen(v: Vector3<f64>) -> Mm {
    [-v.y, v.z]
}

/// CC point and outward normal `way` along the surface to the right.
pub(crate) fn contact(surface: SectionSurface, way: f64) -> (Vector3<f64>, Vector3<f64>) {
    let on_circle = |radius: f64, outward: f64| {
        let (sin, cos) = (way / radius).sin_cos();
        let from_center = Vector3::new(0.0, -sin, outward * cos);
        (from_center * radius - Vector3::z() * (outward * radius), from_center * outward)
    };
    match surface {
        SectionSurface::Plane => (Vector3::new(0.0, -way, 0.0), Vector3::z()),
        SectionSurface::Convex { radius } => on_circle(radius, 1.0),
        SectionSurface::Concave { radius } => on_circle(radius, -1.0),
    }
}

/// The point `height` above the surface, `way` along it to the right.
pub(crate) fn over(surface: SectionSurface, way: f64, height: f64) -> Mm {
    let (cc, n) = contact(surface, way);
    seen(cc + n * height)
}

/// Unit axis of a pass.
pub(crate) fn axis(section: &PassSection, way: f64) -> Vector3<f64> {
    let Orientation { lead, lean } = section.orientation;
    let n = match section.neighbour_axis {
        NeighbourAxis::Parallel => Vector3::z(),
        NeighbourAxis::Turned => contact(section.surface, way).1,
    };
    (Vector3::x() * lead.tan() + n.cross(&Vector3::x()) * lean.tan() + n).normalize()
}

/// Middle of the rim of the cutter, as CLOPT (2) puts it.
pub(crate) fn rim_middle(section: &PassSection, way: f64) -> Vector3<f64> {
    let ((cc, n), a) = (contact(section.surface, way), axis(section, way));
    let r = section.cutter.corner_radius;
    let across = a.cross(&n).cross(&a);
    let toward = if across.norm() > 1e-9 { across.normalize() } else { -Vector3::x() };
    cc + n * r + toward * (section.cutter.radius - r)
}

/// The cutter seen along the feed, with a flute of this length.
pub(crate) fn tool(section: &PassSection, way: f64, flute: f64) -> Contour {
    let (a, middle) = (axis(section, way), rim_middle(section, way));
    let r = section.cutter.corner_radius;
    let rim = section.cutter.radius - r;
    let up = seen(a);
    let below = (-up[1]).atan2(-up[0]);
    // The farthest points of rim and corner in all directions of the lower half.
    let point = |k: i32| {
        let angle = below + 0.5 * PI * (f64::from(k) / 2000.0).powi(3);
        let d = Vector3::new(0.0, -angle.cos(), angle.sin());
        let across = d - a * a.dot(&d);
        let out = if across.norm() > 1e-9 { across.normalize() } else { Vector3::zeros() };
        seen(middle + out * rim + d * r)
    };
    let mut outline: Contour = (-2000..=2000).map(point).collect();
    let top = |p: &Mm| [p[0] + flute * up[0], p[1] + flute * up[1]];
    let ends = [top(&outline[outline.len() - 1]), top(&outline[0])];
    outline.extend(ends);
    outline
}

/// Everything between two heights over the surface and from `from` to `to` along it.
pub(crate) fn layer(surface: SectionSurface, [low, high]: Mm, [from, to]: Mm) -> Contour {
    let way = |k: i32| from + (to - from) * f64::from(k) / 200.0;
    let upper = (0..=200).map(|k| over(surface, way(k), high));
    upper.chain((0..=200).rev().map(|k| over(surface, way(k), low))).collect()
}

/// The stock, from one border or end of the drawing to the other.
pub(crate) fn stock(section: &PassSection, reach: f64) -> Contour {
    let end = |beside| match beside {
        Beside::Border { distance } => distance,
        _ => reach,
    };
    let engagement = &section.engagement;
    let ends = [-end(engagement.left), end(engagement.right)];
    layer(section.surface, [0.0, engagement.depth_of_cut], ends)
}

/// The neighbours' way along the surface to the right.
pub(crate) fn neighbours(section: &PassSection) -> Vec<f64> {
    let sides = [(-1.0, section.engagement.left), (1.0, section.engagement.right)];
    sides
        .into_iter()
        .filter_map(|(side, beside)| match beside {
            Beside::Cut { step_over } => Some(side * step_over),
            _ => None,
        })
        .collect()
}

pub(crate) fn boolean(a: &[Shape], b: &[Shape], rule: OverlayRule) -> Vec<Shape> {
    a.to_vec().overlay_as::<i64>(&b.to_vec(), rule, FillRule::EvenOdd)
}

/// Returns the rest of the stock after the neighbours, and the chip of this pass.
pub(crate) fn stock_and_chip(section: &PassSection, reach: f64) -> [Vec<Shape>; 2] {
    let mut uncut = vec![vec![stock(section, reach)]];
    for way in neighbours(section) {
        uncut = boolean(&uncut, &[vec![tool(section, way, FAR)]], OverlayRule::Difference);
    }
    let chip = boolean(&uncut, &[vec![tool(section, 0.0, FAR)]], OverlayRule::Intersect);
    [uncut, chip]
}
