//! Figures of `docs/method.md`, drawn with the formulas of the crates.

use std::f64::consts::{FRAC_PI_2, PI};

use facemill::chip_area::chip_area_between_outlines;
use facemill::cl_data::{CcPoint, Posture, RoundFrustum};
use facemill::tool_model::{Cutter, Outline, cl_from_cc};
use nalgebra::{Point3, Vector3};

use crate::figure::{BLUE, Figure, GRAY, GREEN, INK, Mm, RED, arc};

type Drawn = Result<String, Box<dyn std::error::Error>>;

/// Returns a point plus a direction times a length.
fn along(from: Mm, direction: Mm, length: f64) -> Mm {
    [from[0] + direction[0] * length, from[1] + direction[1] * length]
}

/// Draws the cutter on a CC point, cut by the plane of N and Et′; and the same seen along −N with
/// rotate.
pub(crate) fn contact() -> Drawn {
    let cutter = Cutter::new(40.0, 10.0, 26.0)?;
    let (tilt, rotate) = (18f64.to_radians(), 35f64.to_radians());
    let cc = CcPoint::new(Point3::origin(), Vector3::z(), Vector3::x())?;
    let cl = cl_from_cc(&cutter, &cc, Posture { tilt, rotate: 0.0 });
    let (tip, axis) = ([cl.tip.x, cl.tip.z], [cl.axis.x, cl.axis.z]);
    let across = [axis[1], -axis[0]];
    let (rim, r) = (cutter.rim_radius(), cutter.corner_radius());
    let mut f = Figure::new(860.0, 430.0, "Contact of a tilted cutter (CLOPT (1), (2), torus form)");
    (f.origin, f.scale) = ([330.0, 310.0], [3.6, 3.6]);

    let part = |x: f64| (190f64 * 190.0 - x * x).sqrt() - 190.0;
    let mut ground: Vec<Mm> = (-85..=45).map(f64::from).map(|x| [x, part(x)]).collect();
    let surface = ground.clone();
    ground.extend([[45.0, -28.0], [-85.0, -28.0]]);
    f.area(&ground, "#e9e4da");
    f.curve(&surface, INK, 1.8, "");
    f.curve(&[[-85.0, 0.0], [52.0, 0.0]], GRAY, 0.9, "5 4");

    // Outline of the cutter in its own (across, axis) plane.
    let placed = |[u, z]: Mm| along(along(tip, across, u), axis, z);
    let corner = |side: f64| arc([0.0, r], r, -FRAC_PI_2, 0.0).into_iter().map(move |[u, z]| [side * (rim + u), z]);
    let right: Vec<Mm> = corner(1.0).chain([[rim + r, cutter.flute_length()]]).collect();
    let left: Vec<Mm> = corner(-1.0).chain([[-rim - r, cutter.flute_length()]]).collect();
    let outline: Vec<Mm> = left.iter().rev().chain(&right).map(|p| placed(*p)).collect();
    f.area(&outline, "#d5e3ee");
    let closed: Vec<Mm> = outline.iter().chain(outline.first()).copied().collect();
    f.curve(&closed, BLUE, 1.6, "");
    f.curve(&[placed([0.0, -8.0]), placed([0.0, 52.0])], GRAY, 0.9, "12 3 2 3");

    let center = placed([rim, r]);
    f.curve(&arc(center, r, 0.0, 2.0 * PI), GRAY, 0.9, "3 3");
    f.curve(&[center, [0.0, 0.0]], GRAY, 1.2, "");
    f.text([0.0, 4.0], [5.0, 0.0], GRAY, "r");
    f.arrow(center, placed([0.0, r]), GREEN);
    f.text(placed([0.45 * rim, r]), [-4.0, -12.0], GREEN, "(R − r)·d");
    f.arrow(placed([0.0, r]), tip, GREEN);
    f.text(placed([0.0, 0.5 * r]), [-40.0, 4.0], GREEN, "−r·a");
    f.arrow([0.0, 0.0], [0.0, 44.0], INK);
    f.text([0.0, 44.0], [6.0, 4.0], INK, "N");
    f.arrow([0.0, 0.0], [42.0, 0.0], INK);
    f.text([42.0, 0.0], [-2.0, -10.0], INK, "Et′");
    f.arrow(tip, placed([0.0, 48.0]), BLUE);
    f.text(placed([0.0, 48.0]), [8.0, 0.0], BLUE, "a");
    f.curve(&[tip, along(tip, [0.0, 1.0], 40.0)], GRAY, 0.9, "3 3");
    f.arc(tip, 34.0, [FRAC_PI_2 - tilt, FRAC_PI_2], INK, 1.1);
    f.text(along(tip, [(0.5 * tilt).sin(), (0.5 * tilt).cos()], 34.0), [-4.0, -6.0], INK, "α");
    f.dot(tip, BLUE);
    f.text(tip, [-34.0, 16.0], BLUE, "Pcl");
    f.dot([0.0, 0.0], RED);
    f.text([0.0, 0.0], [-34.0, 18.0], RED, "Pcc");

    (f.origin, f.scale) = ([700.0, 240.0], [2.1, 2.1]);
    f.text([-40.0, 70.0], [0.0, 0.0], GRAY, "seen along −N");
    let toward = [rotate.cos(), rotate.sin()];
    let seen =
        |along_tilt: f64, beside: f64| along(along([0.0, 0.0], toward, along_tilt), [-toward[1], toward[0]], beside);
    let middle = -rim * tilt.cos();
    let disc: Vec<Mm> =
        arc([0.0, 0.0], rim + r, 0.0, 2.0 * PI).into_iter().map(|[u, v]| seen(middle + u * tilt.cos(), v)).collect();
    f.area(&disc, "#d5e3ee");
    f.curve(&disc, BLUE, 1.4, "");
    f.arrow([0.0, 0.0], [54.0, 0.0], INK);
    f.text([54.0, 0.0], [-8.0, 18.0], INK, "Et");
    f.arrow([0.0, 0.0], along([0.0, 0.0], toward, 50.0), INK);
    f.text(along([0.0, 0.0], toward, 50.0), [6.0, 0.0], INK, "Et′");
    f.arc([0.0, 0.0], 34.0, [0.0, rotate], INK, 1.1);
    f.text(along([0.0, 0.0], [(0.5 * rotate).cos(), (0.5 * rotate).sin()], 34.0), [5.0, 4.0], INK, "β");
    f.dot([0.0, 0.0], RED);
    f.text([0.0, 0.0], [-8.0, 20.0], RED, "Pcc");
    f.text([-70.0, -62.0], [0.0, 0.0], GRAY, "left of the feed: β &gt; 0");
    Ok(f.finish())
}

/// Returns the right half of a dilated cylinder's outline, from the axis below to the axis above.
fn half_outline(body: &RoundFrustum, more: f64) -> Vec<Mm> {
    let (radius, rounding) = (body.radius_low, body.rounding + more);
    let lower = arc([radius, body.z_low], rounding, -FRAC_PI_2, 0.0);
    let upper = arc([radius, body.z_high], rounding, 0.0, FRAC_PI_2);
    let ends = [[0.0, body.z_low - rounding], [0.0, body.z_high + rounding]];
    std::iter::once(ends[0]).chain(lower).chain(upper).chain(std::iter::once(ends[1])).collect()
}

/// Returns the right half of a cutter's outline.
fn half_cutter(c: &Cutter) -> Vec<Mm> {
    let corner = arc([c.rim_radius(), c.corner_radius()], c.corner_radius(), -FRAC_PI_2, 0.0);
    let ends = [[c.radius(), c.flute_length()], [0.0, c.flute_length()]];
    std::iter::once([0.0, 0.0]).chain(corner).chain(ends).collect()
}

/// Draws cutter and test bodies in the half plane, tolerances far too large to be seen.
pub(crate) fn test_body() -> Drawn {
    let mut f = Figure::new(860.0, 380.0, "Test bodies: inside the cutter, and no cutter point farther than t away");
    f.scale = [6.6, 6.6];
    for (cutter, t, left, name) in [
        (Cutter::new(40.0, 12.0, 24.0)?, 5.0, 60.0, "r ≥ t: radius R − t, corner r − t, raised by t"),
        (Cutter::new(40.0, 3.0, 24.0)?, 8.0, 480.0, "r &lt; t: sharp, radius R − s, raised by s"),
    ] {
        f.origin = [left, 310.0];
        let outline = half_cutter(&cutter);
        f.area(&outline, "#d5e3ee");
        let body = cutter.lower_test_body(t);
        f.area(&half_outline(&body, 0.0), "#f0d9d5");
        f.curve(&half_outline(&body, t), GREEN, 1.2, "4 3");
        f.curve(&outline, BLUE, 1.8, "");
        f.curve(&half_outline(&body, 0.0), RED, 1.8, "");
        if let Some(upper) = cutter.upper_test_body(t) {
            f.curve(&half_outline(&upper, 0.0), RED, 1.2, "7 4");
        }
        f.curve(&[[0.0, -4.0], [0.0, 34.0]], GRAY, 0.9, "12 3 2 3");
        let bottom = body.z_low - body.rounding;
        f.arrow([8.0, 0.0], [8.0, bottom], INK);
        f.text([8.0, 0.5 * bottom], [8.0, 5.0], INK, if cutter.corner_radius() >= t { "t" } else { "s" });
        let center = [cutter.rim_radius(), cutter.corner_radius()];
        f.dot(center, GRAY);
        if cutter.corner_radius() < t {
            let corner = [body.radius_low, body.z_low];
            f.arrow(center, corner, INK);
            f.text(corner, [-34.0, -8.0], INK, "t − r");
        }
        f.origin = [left, 60.0];
        f.text([0.0, 0.0], [0.0, 0.0], GRAY, name);
    }
    f.origin = [60.0, 365.0];
    for (x, color, text) in [
        (0.0, BLUE, "cutter"),
        (70.0, RED, "test body (dashed: upper test body)"),
        (320.0, GREEN, "t-neighbourhood of the test body"),
    ] {
        f.text([0.0, 0.0], [x, 0.0], color, text);
    }
    Ok(f.finish())
}

/// Draws a disc that touches the tangent plane and dips into a facet.
pub(crate) fn seating() -> Drawn {
    let cutter = Cutter::new(80.0, 6.0, 12.0)?;
    let tilt = 2f64.to_radians();
    let outline = Outline::new(&cutter, Posture { tilt, rotate: 0.0 });
    let delta = 0.35f64.to_radians();
    let mut f = Figure::new(720.0, 330.0, "Seating: tangent plane, facet and outline (heights × 50)");
    (f.origin, f.scale) = ([320.0, 200.0], [9.0, 450.0]);
    let steps = |from: i32, to: i32| (from..=to).map(|k| 0.5 * f64::from(k));
    f.curve(&[[-33.0, 0.0], [40.0, 0.0]], GRAY, 0.9, "5 4");
    f.text([40.0, 0.0], [-104.0, 16.0], GRAY, "tangent plane");
    f.curve(&[[-33.0, -33.0 * delta.tan()], [40.0, 40.0 * delta.tan()]], INK, 2.0, "");
    f.text([40.0, 40.0 * delta.tan()], [-40.0, 22.0], INK, "facet");
    let curve = |lift: f64| -> Vec<Mm> {
        steps(-50, 60).filter_map(|y| outline.height_at(y).map(|z| [y, z + lift])).filter(|p| p[1] < 0.32).collect()
    };
    f.curve(&curve(0.0), BLUE, 1.8, "");
    // Deepest where the outline's slope is that of the facet.
    let radius = cutter.rim_radius() / tilt.sin() + cutter.corner_radius();
    let deepest = radius * delta;
    let dip = 0.5 * radius * delta * delta;
    f.curve(&curve(dip), GREEN, 1.4, "6 4");
    let at = |y: f64| outline.height_at(y).unwrap_or(0.0);
    f.arrow([deepest, deepest * delta.tan()], [deepest, at(deepest)], RED);
    f.text([deepest, at(deepest)], [8.0, 4.0], RED, "((R − r)/sin α + r)·δ²/2");
    f.dot([0.0, 0.0], RED);
    f.text([0.0, 0.0], [-32.0, 18.0], RED, "Pcc");
    f.text([33.0, 0.07], [0.0, 0.0], INK, "δ");
    f.origin = [20.0, 312.0];
    f.text(
        [0.0, 0.0],
        [0.0, 0.0],
        INK,
        &format!("R 80, r 6, α = 2°, δ = 0.35°: dips by {dip:.3} mm, {deepest:.1} mm beside the CC point; green: lifted by as much"),
    );
    Ok(f.finish())
}

/// Draws the chip of a pass beside the one before it, across the feed.
pub(crate) fn chip() -> Drawn {
    let cutter = Cutter::new(80.0, 6.0, 12.0)?;
    let outline = Outline::new(&cutter, Posture { tilt: 2f64.to_radians(), rotate: 0.0 });
    let (step, stock) = (30.0, 2.0);
    let before = |y: f64| outline.height_at(y - step);
    let own = |y: f64| outline.height_at(y);
    let (from, to) = outline.extent();
    let area = chip_area_between_outlines(before, own, |_| stock, from..=to, 1e-3)?;
    let full = chip_area_between_outlines(|_| None, own, |_| stock, from..=to, 1e-3)?;
    let mut f = Figure::new(860.0, 330.0, "Chip section across the feed (heights × 10)");
    // Seen along the feed, y (to the left of it) points to the left.
    (f.origin, f.scale) = ([480.0, 250.0], [-3.4, 34.0]);
    let places: Vec<f64> = (-200..=280).map(|k| 0.5 * f64::from(k)).collect();
    let top = |y: f64| before(y).map_or(stock, |z| z.min(stock));
    let uncut: Vec<Mm> = places.iter().map(|&y| [y, top(y)]).collect();
    let ground = [[140.0, 0.0], [-100.0, 0.0]];
    f.area(&uncut.iter().copied().chain(ground).collect::<Vec<_>>(), "#efe6d2");
    let inside: Vec<f64> = places.iter().copied().filter(|&y| own(y).is_some_and(|z| z < top(y))).collect();
    let upper = inside.iter().map(|&y| [y, top(y)]);
    let lower = inside.iter().rev().map(|&y| [y, own(y).unwrap_or(stock)]);
    f.area(&upper.chain(lower).collect::<Vec<_>>(), "#e3a08f");
    f.area(&[[140.0, 0.0], [-100.0, 0.0], [-100.0, -0.9], [140.0, -0.9]], "#d9d5cc");
    f.curve(&ground, INK, 2.0, "");
    let curve = |g: &dyn Fn(f64) -> Option<f64>| -> Vec<Mm> {
        places.iter().filter_map(|&y| g(y).map(|z| [y, z])).filter(|p| p[1] < 5.6).collect()
    };
    f.curve(&curve(&before), BLUE, 1.6, "6 4");
    f.curve(&curve(&own), RED, 1.8, "");
    f.dot([0.0, 0.0], RED);
    f.dot([step, 0.0], BLUE);
    f.text([step, 5.6], [-150.0, 4.0], BLUE, "pass before");
    f.text([0.0, 5.6], [60.0, 4.0], RED, "this pass");
    f.text([-84.0, stock], [-22.0, -6.0], GRAY, "stock");
    f.text([-84.0, 0.0], [-22.0, 18.0], GRAY, "part");
    f.origin = [20.0, 310.0];
    f.text(
        [0.0, 0.0],
        [0.0, 0.0],
        INK,
        &format!("R 80, r 6, α = 2°, β = 0, stock {stock} mm, step-over {step} mm: {area:.1} mm²; without a pass before {full:.1} mm²"),
    );
    Ok(f.finish())
}
