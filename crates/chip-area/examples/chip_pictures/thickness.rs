//! The figure of chip thickness.

use crate::figure::{BLUE, CHIP, Figure, GRAY, INK, Mm, PART, RED, STOCK, TOOL};

/// Feed per tooth, drawn far too large, mm.
const FEED: f64 = 1.0;

/// Points of an arc about a centre, angles in rad from the feed.
fn arc([x, y]: Mm, radius: f64, from: f64, to: f64) -> Vec<Mm> {
    (0..=120)
        .map(|k| from + (to - from) * f64::from(k) / 120.0)
        .map(|t| [x + radius * t.cos(), y + radius * t.sin()])
        .collect()
}

/// Draws the material of two teeth, one behind the other, and its thickness along the normal.
fn crescent(f: &mut Figure, center: Mm, radius: f64, engaged: [f64; 2], at: f64) {
    let next = [center[0] + FEED, center[1]];
    let mut chip = arc(next, radius, engaged[0], engaged[1]);
    chip.extend(arc(center, radius, engaged[1], engaged[0]));
    f.area(&[chip], CHIP);
    f.curve(&arc(center, radius, engaged[0] - 0.25, engaged[1] + 0.35), GRAY, 1.2, "6 4");
    f.curve(&arc(next, radius, engaged[0] - 0.25, engaged[1] + 0.35), BLUE, 1.8, "");
    let along = |by: f64| [next[0] + by * at.cos(), next[1] + by * at.sin()];
    // Along the normal, from the tooth before to this one.
    f.curve(&[along(radius - FEED * at.cos()), along(radius)], RED, 2.2, "");
    f.arrow(along(radius), along(radius + 1.5), RED);
    f.text(along(radius + 1.5), [6.0, 2.0], RED, "n");
    f.dot(along(radius), RED);
}

/// The chip of a tooth seen along the axis, and in the section with axis and feed.
pub(crate) fn thickness() -> String {
    let mut f = Figure::new(760.0, 330.0, "Thickness of a tooth's chip: fz · (f·n)");
    let radius = 5.0;
    f.panel([0.0, 40.0], [390.0, 255.0], [130.0, 125.0], 21.0);
    let edge = 0.55f64;
    let y = radius * edge.sin();
    f.area(&[vec![[0.0, -12.0], [14.0, -12.0], [14.0, y], [0.0, y]]], STOCK);
    f.area(&[arc([0.0; 2], radius, 0.0, std::f64::consts::TAU)], TOOL);
    crescent(&mut f, [0.0; 2], radius, [-std::f64::consts::FRAC_PI_2, edge], 0.35);
    f.dot([0.0; 2], INK);
    f.arrow([0.0, 0.0], [2.6, 0.0], INK);
    f.text([2.6, 0.0], [2.0, -6.0], INK, "f");
    f.text([7.4, -4.4], [0.0, 0.0], GRAY, "stock");
    f.text([-4.2, 4.9], [-20.0, -6.0], INK, "seen along the axis");
    f.panel([390.0, 40.0], [370.0, 255.0], [110.0, 190.0], 34.0);
    let (corner, depth) = (3.0, 1.7);
    let top = (1.0f64 - depth / corner).acos();
    f.area(&[vec![[-5.0, -3.0], [9.0, -3.0], [9.0, 0.0], [-5.0, 0.0]]], PART);
    f.area(&[vec![[0.0, 0.0], [9.0, 0.0], [9.0, depth], [0.0, depth]]], STOCK);
    // The angle of the normal from the axis downward is that from the feed and a quarter turn.
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut body = arc([0.0, corner], corner, -quarter, 0.0);
    body.extend([[corner, 9.0], [-9.0, 9.0], [-9.0, 0.0]]);
    f.area(&[body], TOOL);
    crescent(&mut f, [0.0, corner], corner, [-quarter, top - quarter], top - quarter - 0.02);
    f.measure([5.8, 0.0], [5.8, depth], INK);
    f.text([5.8, 0.5 * depth], [6.0, 4.0], INK, "ap");
    f.text([-2.6, 4.9], [-8.0, 6.0], INK, "in the plane of axis and feed");
    f.text([-2.9, -0.6], [0.0, 6.0], GRAY, "part");
    f.finish()
}
