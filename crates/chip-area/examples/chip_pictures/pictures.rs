//! The figures.

use std::f64::consts::PI;

use facemill_chip_area::{
    Beside, CutterEnd, Engagement, NeighbourAxis, Orientation, PassError, PassSection, SectionSurface, chip_of_pass,
};

use crate::figure::{BLUE, CHIP, Figure, GRAY, GREEN, INK, Mm, PART, RED, STOCK, TOOL};
use crate::shapes::{self, Contour, neighbours, over, stock_and_chip};

type Drawn = Result<String, PassError>;

fn base(radius: f64, corner_radius: f64, surface: SectionSurface) -> PassSection {
    PassSection {
        cutter: CutterEnd { radius, corner_radius },
        surface,
        engagement: Engagement { depth_of_cut: 2.0, left: Beside::Stock, right: Beside::Stock },
        orientation: Orientation::default(),
        neighbour_axis: NeighbourAxis::Parallel,
    }
}

fn cut(step_over: f64) -> Beside {
    Beside::Cut { step_over }
}

/// Part, stock, neighbours, this pass and its chip.
fn draw(f: &mut Figure, section: &PassSection, reach: f64) {
    let [uncut, chip] = stock_and_chip(section, reach);
    f.area(&[shapes::layer(section.surface, [-8.0, 0.0], [-reach, reach])], PART);
    f.area(&[shapes::tool(section, 0.0, 60.0)], TOOL);
    uncut.iter().for_each(|shape| f.area(shape, STOCK));
    chip.iter().for_each(|shape| f.area(shape, CHIP));
    let line = |height| -> Contour {
        (-100..=100).map(|k| over(section.surface, reach * f64::from(k) / 100.0, height)).collect()
    };
    uncut.iter().flatten().for_each(|ring| f.ring(ring, GRAY, 0.7, ""));
    f.curve(&line(0.0), INK, 1.8, "");
    for way in neighbours(section) {
        f.ring(&shapes::tool(section, way, 60.0), GREEN, 1.3, "6 4");
        f.dot(over(section.surface, way, 0.0), GREEN);
    }
    f.ring(&shapes::tool(section, 0.0, 60.0), BLUE, 1.8, "");
    f.dot([0.0, 0.0], RED);
}

fn along(from: Mm, [x, y]: Mm, length: f64) -> Mm {
    [from[0] + x * length, from[1] + y * length]
}

/// Draws the terms.
pub(crate) fn section() -> Drawn {
    let mut s = base(6.0, 2.0, SectionSurface::Convex { radius: 30.0 });
    s.orientation.lean = 20f64.to_radians();
    s.engagement = Engagement { depth_of_cut: 2.5, left: Beside::Border { distance: 11.0 }, right: cut(4.5) };
    let chip = chip_of_pass(&s)?;
    let mut f = Figure::new(760.0, 430.0, "Section across the feed, seen along the feed");
    f.panel([0.0, 40.0], [760.0, 355.0], [370.0, 255.0], 21.0);
    draw(&mut f, &s, 20.0);
    let axis = shapes::seen(shapes::axis(&s, 0.0));
    let tip = along(shapes::seen(shapes::rim_middle(&s, 0.0)), axis, -2.0);
    f.curve(&[along(tip, axis, -1.0), along(tip, axis, 40.0)], GRAY, 0.9, "12 3 2 3");
    f.arrow([0.0, 0.0], [0.0, 8.6], INK);
    f.text([0.0, 8.6], [8.0, 6.0], INK, "N");
    f.arrow([0.0, 0.0], along([0.0, 0.0], axis, 9.5), BLUE);
    f.text(along([0.0, 0.0], axis, 9.5), [-16.0, 0.0], BLUE, "a");
    let lean = |k: i32| {
        let angle = 0.5 * PI + s.orientation.lean * f64::from(k) / 20.0;
        [6.5 * angle.cos(), 6.5 * angle.sin()]
    };
    f.curve(&(0..=20).map(lean).collect::<Vec<_>>(), INK, 1.1, "");
    f.text(lean(12), [-10.0, -6.0], INK, "lean");
    f.text([0.0, 0.0], [-66.0, 22.0], RED, "CC point");
    let step: Vec<Mm> = (0..=20).map(|k| over(s.surface, 4.5 * f64::from(k) / 20.0, -1.1)).collect();
    f.curve(&step, INK, 1.1, "");
    f.text(over(s.surface, 2.6, -1.1), [-8.0, 18.0], INK, "lf");
    for way in [0.0, 4.5] {
        f.curve(&[over(s.surface, way, -0.2), over(s.surface, way, -1.5)], INK, 0.9, "");
    }
    f.measure(over(s.surface, 11.5, 0.0), over(s.surface, 11.5, 2.5), INK);
    f.text(over(s.surface, 11.5, 1.2), [10.0, 4.0], INK, "ta");
    f.text(over(s.surface, -11.0, 1.2), [-56.0, 0.0], INK, "border");
    f.text([14.2, 6.6], [0.0, 0.0], GREEN, "neighbour,");
    f.text([14.2, 6.6], [0.0, 17.0], GREEN, "cut before");
    f.arrow([-7.5, 4.6], [-1.2, 1.6], RED);
    f.text([-7.5, 4.6], [-122.0, 4.0], RED, &format!("chip {:.4} mm²", chip.area));
    f.text([-10.5, 8.6], [0.0, 0.0], BLUE, "this pass");
    f.panel([0.0, 395.0], [760.0, 35.0], [20.0, 20.0], 1.0);
    f.text([0.0, 0.0], [0.0, 0.0], GRAY, "R 6, r 2, r1 30, ta 2.5, lf 4.5 mm, lean 20°, border 11 mm to the left");
    Ok(f.finish())
}

/// The outline of a cutter with lead: rim as an ellipse, offset by the corner.
pub(crate) fn seen_along_the_feed() -> Drawn {
    let mut f = Figure::new(860.0, 365.0, "Outline seen along the feed: the rim is an ellipse, the corner offsets it");
    f.panel([0.0, 40.0], [450.0, 320.0], [195.0, 262.0], 14.0);
    let mut s = base(12.0, 3.0, SectionSurface::Plane);
    s.orientation = Orientation { lead: 24f64.to_radians(), lean: 12f64.to_radians() };
    f.area(&[shapes::tool(&s, 0.0, 60.0)], TOOL);
    let (axis, middle) = (shapes::axis(&s, 0.0), shapes::rim_middle(&s, 0.0));
    let (up, center) = (shapes::seen(axis), shapes::seen(middle));
    let u = axis.cross(&nalgebra::Vector3::x()).normalize();
    let v = axis.cross(&u);
    let rim = |t: f64| shapes::seen(middle + (u * t.cos() + v * t.sin()) * 9.0);
    let ellipse: Vec<Mm> = (0..=120).map(|k| rim(PI * f64::from(k) / 60.0)).collect();
    f.ring(&ellipse, GREEN, 1.5, "5 3");
    f.ring(&shapes::tool(&s, 0.0, 60.0), BLUE, 2.0, "");
    f.curve(&[along(center, up, -9.0), along(center, up, 30.0)], GRAY, 0.9, "12 3 2 3");
    let right = [up[1], -up[0]];
    f.curve(&[along(center, right, -9.0), along(center, right, 9.0)], GREEN, 0.9, "2 3");
    f.dot(center, GREEN);
    f.text(along(center, right, -9.0), [8.0, -8.0], GREEN, "R − r");
    // A point and its normal.
    let (sin, cos) = 50f64.to_radians().sin_cos();
    let squash = axis.x.abs();
    let e = along(along(center, right, 9.0 * sin), up, -9.0 * squash * cos);
    let length = (squash * sin).hypot(cos);
    let n = [squash * sin / length, -cos / length];
    let n = [n[0] * right[0] + n[1] * up[0], n[0] * right[1] + n[1] * up[1]];
    f.arrow(e, along(e, n, 3.0), INK);
    f.dot(e, GREEN);
    f.text(along(e, n, 1.5), [10.0, 4.0], INK, "r·n");
    f.text(e, [-44.0, -6.0], GREEN, "e(t)");
    f.text(along(e, n, 3.0), [4.0, 18.0], BLUE, "p = e + r·n");
    f.curve(&[[-30.0, 0.0], [30.0, 0.0]], INK, 1.6, "");
    f.dot([0.0, 0.0], RED);
    f.text([0.0, 0.0], [-22.0, 20.0], RED, "CC point");
    f.text(along(center, up, 9.0), [8.0, 0.0], GRAY, "axis");
    f.text([-12.5, -3.2], [0.0, 0.0], GRAY, "R 12, r 3 mm, lead 24°, lean 12°");

    f.panel([460.0, 40.0], [400.0, 320.0], [200.0, 262.0], 14.0);
    for (lead, color, row) in [(0.0, INK, 3.0), (8.0, GREEN, 2.0), (20.0, BLUE, 1.0), (45.0, RED, 0.0)] {
        s.orientation = Orientation { lead: f64::to_radians(lead), lean: 0.0 };
        // Without the two points at the end of the flute.
        let mut outline = shapes::tool(&s, 0.0, 60.0);
        outline.truncate(outline.len() - 2);
        f.curve(&outline, color, 1.8, "");
        f.text([-2.2, 9.0], [0.0, 18.0 * row], color, &format!("lead {lead}°"));
    }
    f.curve(&[[-30.0, 0.0], [30.0, 0.0]], INK, 1.2, "5 4");
    f.dot([0.0, 0.0], RED);
    f.text([-12.5, -3.2], [0.0, 0.0], GRAY, "the same cutter, lean 0");
    Ok(f.finish())
}

/// The slabs of a chip in the tool's frame.
pub(crate) fn slabs() -> Drawn {
    let mut s = base(6.0, 2.0, SectionSurface::Convex { radius: 20.0 });
    s.orientation.lean = 14f64.to_radians();
    s.engagement = Engagement { depth_of_cut: 3.0, left: cut(3.5), right: Beside::Stock };
    let chip = chip_of_pass(&s)?;
    let mut f = Figure::new(760.0, 420.0, "Slabs: between two cuts each edge is one line or circle");
    f.panel([0.0, 40.0], [760.0, 350.0], [250.0, 275.0], 34.0);
    // The tool's frame: the axis up.
    let (sin, cos) = s.orientation.lean.sin_cos();
    let turned = |[x, y]: Mm| [x * cos + y * sin, y * cos - x * sin];
    let ring = |c: &Contour| -> Contour { c.iter().copied().map(turned).collect() };
    let [uncut, chips] = stock_and_chip(&s, 14.0);
    f.area(&[ring(&shapes::layer(s.surface, [-8.0, 0.0], [-14.0, 14.0]))], PART);
    f.area(&[ring(&shapes::tool(&s, 0.0, 40.0))], TOOL);
    uncut.iter().flatten().for_each(|c| f.area(&[ring(c)], STOCK));
    let chip_ring: Vec<Contour> = chips.iter().flatten().map(ring).collect();
    f.area(&chip_ring, CHIP);
    uncut.iter().flatten().for_each(|c| f.ring(&ring(c), GRAY, 0.8, ""));
    f.ring(&ring(&shapes::tool(&s, -3.5, 40.0)), GREEN, 1.4, "6 4");
    f.ring(&ring(&shapes::tool(&s, 0.0, 40.0)), BLUE, 1.8, "");
    // Cuts: ends of the ranges, kinks and crossings; the chip's own corners among them.
    let [own, other] = [0.0, -3.5].map(|way| turned(shapes::seen(shapes::rim_middle(&s, way))));
    let corners = chip_ring.iter().flat_map(|c| {
        let n = c.len();
        (0..n)
            .filter(move |&i| {
                let (a, b, d) = (c[(i + n - 1) % n], c[i], c[(i + 1) % n]);
                let (p, q) = ([b[0] - a[0], b[1] - a[1]], [d[0] - b[0], d[1] - b[1]]);
                let turn = (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]);
                turn.abs() > 0.15
            })
            .map(|i| c[i][0])
    });
    let kinks =
        [own[0] - 6.0, own[0] - 4.0, own[0] + 4.0, own[0] + 6.0, other[0] - 4.0, other[0] + 4.0, other[0] + 6.0];
    let ends = chip_ring.iter().flatten().fold([f64::MAX, f64::MIN], |[a, b], p| [a.min(p[0]), b.max(p[0])]);
    for x in kinks.into_iter().chain(corners).filter(|x| ends[0] - 1e-9 <= *x && *x <= ends[1] + 1e-9) {
        f.curve(&[[x, -2.2], [x, 6.5]], RED, 0.9, "2 3");
    }
    f.arrow([-6.6, 5.0], [-5.0, 5.0], INK);
    f.text([-5.0, 5.0], [6.0, 4.0], INK, "x");
    f.arrow([-6.6, 5.0], [-6.6, 6.6], BLUE);
    f.text([-6.6, 6.6], [-6.0, -8.0], BLUE, "y, along the axis");
    f.dot([0.0, 0.0], RED);
    f.panel([0.0, 390.0], [760.0, 30.0], [20.0, 18.0], 1.0);
    let text = format!(
        "R 6, r 2, r1 20, ta 3, lf 3.5 mm from the left, lean 14°: chip {:.4} mm²; dotted: the cuts that meet it",
        chip.area
    );
    f.text([0.0, 0.0], [0.0, 0.0], GRAY, &text);
    Ok(f.finish())
}

/// Every cutter on every surface.
pub(crate) fn cases() -> Drawn {
    let mut f = Figure::new(900.0, 790.0, "Cutters and surfaces: the axis leans by 15° toward the cut side");
    let surfaces = [
        ("plane", SectionSurface::Plane),
        ("convex, r1 20", SectionSurface::Convex { radius: 20.0 }),
        ("concave, r1 20", SectionSurface::Concave { radius: 20.0 }),
    ];
    let ends = [("flat", 0.0, 0.0), ("bull-nose, r 2", 2.0, 0.0), ("ball", 6.0, 0.0), ("r 2, lead 30°", 2.0, 30.0)];
    for (row, (end, corner_radius, lead)) in ends.into_iter().enumerate() {
        for (column, (name, surface)) in surfaces.into_iter().enumerate() {
            let mut s = base(6.0, corner_radius, surface);
            s.engagement = Engagement { depth_of_cut: 2.0, left: cut(1.5), right: Beside::Stock };
            let steep = if matches!(surface, SectionSurface::Concave { .. }) { 25.0 } else { 15.0 };
            s.orientation = Orientation { lead: f64::to_radians(lead), lean: f64::to_radians(steep) };
            let corner = [20.0 + 290.0 * column as f64, 70.0 + 180.0 * row as f64];
            f.panel(corner, [280.0, 150.0], [150.0, 112.0], 12.0);
            draw(&mut f, &s, 16.0);
            f.panel([corner[0], corner[1] - 20.0], [280.0, 20.0], [0.0, 14.0], 1.0);
            let label = match chip_of_pass(&s) {
                Ok(chip) => format!("{end}, {name}: {:.4} mm²", chip.area),
                Err(error) => format!("{end}, {name}: {error}"),
            };
            f.text([0.0, 0.0], [2.0, 0.0], INK, &label);
        }
    }
    f.panel([20.0, 766.0], [860.0, 24.0], [0.0, 14.0], 1.0);
    f.text(
        [0.0, 0.0],
        [0.0, 0.0],
        GRAY,
        "R 6, ta 2, lf 1.5 mm (dashed: the pass before, on the left); in concave surfaces the lean is 25°, so that the bottom is clear",
    );
    Ok(f.finish())
}

/// Draws the possible sides of a pass.
pub(crate) fn sides() -> Drawn {
    let mut f = Figure::new(900.0, 620.0, "First, further and last passes, and the flute in the stock");
    let border = |distance| Beside::Border { distance };
    let panels = [
        ("first pass, in the middle of the stock", 2.0, Beside::Stock, Beside::Stock, 10.0, 0.0),
        ("first pass, at the border", 2.0, Beside::Stock, border(2.0), 10.0, 0.0),
        ("further pass to the left", 2.0, Beside::Stock, cut(4.0), 10.0, 0.0),
        ("last pass, at the border", 2.0, border(1.5), cut(4.0), 10.0, 0.0),
        ("last pass, between two: step-overs 5 and 2.5", 2.0, cut(5.0), cut(2.5), 10.0, 0.0),
        ("flute in the stock: ta above tmax", 9.0, Beside::Stock, cut(3.0), 40.0, -40.0),
    ];
    for (i, (name, depth_of_cut, left, right, lead, lean)) in panels.into_iter().enumerate() {
        let mut s = base(6.0, 3.0, SectionSurface::Plane);
        s.engagement = Engagement { depth_of_cut, left, right };
        s.orientation = Orientation { lead: f64::to_radians(lead), lean: f64::to_radians(lean) };
        let corner = [20.0 + 440.0 * (i % 2) as f64, 70.0 + 180.0 * (i / 2) as f64];
        let (place, scale) = if lean == 0.0 { ([210.0, 105.0], 15.0) } else { ([150.0, 135.0], 11.0) };
        f.panel(corner, [420.0, 145.0], place, scale);
        draw(&mut f, &s, 30.0);
        f.panel([corner[0], corner[1] - 20.0], [420.0, 20.0], [0.0, 14.0], 1.0);
        f.text([0.0, 0.0], [2.0, 0.0], INK, &format!("{name}: {:.4} mm²", chip_of_pass(&s)?.area));
    }
    f.panel([20.0, 592.0], [860.0, 28.0], [0.0, 16.0], 1.0);
    let text = "R 6, r 3 mm on a plane, lead 10°; last panel: ta 9 mm, lead 40°, lean −40°";
    f.text([0.0, 0.0], [0.0, 0.0], GRAY, text);
    Ok(f.finish())
}

/// Neighbours with a parallel axis and with one that has turned.
pub(crate) fn turned() -> Drawn {
    let mut f = Figure::new(900.0, 390.0, "The neighbour's axis: parallel, or turned with the surface");
    let axes = [("parallel", NeighbourAxis::Parallel), ("turned", NeighbourAxis::Turned)];
    for (i, (name, neighbour_axis)) in axes.into_iter().enumerate() {
        let mut s = base(6.0, 1.0, SectionSurface::Convex { radius: 14.0 });
        s.orientation = Orientation { lead: 12f64.to_radians(), lean: 8f64.to_radians() };
        s.engagement = Engagement { depth_of_cut: 3.0, left: Beside::Stock, right: cut(4.0) };
        s.neighbour_axis = neighbour_axis;
        let corner = [20.0 + 440.0 * i as f64, 70.0];
        f.panel(corner, [420.0, 280.0], [210.0, 190.0], 19.0);
        draw(&mut f, &s, 18.0);
        if neighbour_axis == NeighbourAxis::Turned {
            for height in [0.5, 1.0, 1.5, 2.0, 2.5] {
                let arc: Vec<Mm> = (-60..=60).map(|k| over(s.surface, 0.2 * f64::from(k), height)).collect();
                f.curve(&arc, RED, 0.6, "2 3");
            }
        }
        for way in [0.0, 4.0] {
            let (axis, from) = (shapes::seen(shapes::axis(&s, way)), shapes::seen(shapes::rim_middle(&s, way)));
            f.curve(&[along(from, axis, -3.0), along(from, axis, 30.0)], GRAY, 0.9, "12 3 2 3");
        }
        f.panel([corner[0], corner[1] - 20.0], [420.0, 20.0], [0.0, 14.0], 1.0);
        f.text([0.0, 0.0], [2.0, 0.0], INK, &format!("{name}: {:.4} mm²", chip_of_pass(&s)?.area));
    }
    f.panel([20.0, 356.0], [860.0, 28.0], [0.0, 18.0], 1.0);
    let text = "R 6, r 1, r1 14, ta 3, lf 4 mm, lead 12°, lean 8°; dotted: arcs of equal height, on which the turned outline is moved by lf";
    f.text([0.0, 0.0], [0.0, 0.0], GRAY, text);
    Ok(f.finish())
}
