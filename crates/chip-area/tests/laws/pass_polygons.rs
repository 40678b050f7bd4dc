//! The chip of a pass against booleans of polygons of the true shapes: the cutter's solid in space,
//! sampled and seen along the feed, which shares no code and no formula of the outline with the
//! crate.

use std::f64::consts::{PI, TAU};

use facemill_chip_area::{
    Beside, ChipArea, CutterEnd, Engagement, NeighbourAxis, Orientation, PassError, PassSection, Pose, SectionSurface,
    chip_of_pass,
};
use i_overlay::core::overlay_rule::OverlayRule;
use nalgebra::Vector3;

use crate::kit::{Contour, Random, Shape, area, at, boolean, moved};

/// Length of flutes and half that of planes, beyond every section here.
const FAR: f64 = 120.0;
/// Corners on a full circle of the tool, times the fineness of the polygons.
const CORNERS: u32 = 6_000;
/// Longest chord on a surface near the CC point, mm, over the fineness of the polygons, and its
/// range, farther than any chip here.
const CHORD: f64 = 0.02;
const NEAR: f64 = 30.0;

fn section(random: &mut Random) -> PassSection {
    let radius = random.between(10.0, 60.0);
    let surface = match (3.0 * random.unit()) as u32 {
        0 => SectionSurface::Plane,
        1 => SectionSurface::Convex { radius },
        _ => SectionSurface::Concave { radius },
    };
    let radius = random.between(1.0, 10.0);
    let corner_radius = match (5.0 * random.unit()) as u32 {
        0 => 0.0,
        1 => radius,
        _ => radius * random.between(0.0, 1.0),
    };
    // Mostly moderate, sometimes zero, sometimes small.
    let angle = |random: &mut Random| match (6.0 * random.unit()) as u32 {
        0 => 0.0,
        1 => random.between(-1e-3, 1e-3),
        2 => random.between(-1.4, 1.4),
        _ => random.between(-0.6, 0.6),
    };
    let step_over = |random: &mut Random| {
        let most = if random.one_in(4.0) { 0.1 } else { 1.2 * radius };
        random.between(0.0, most)
    };
    let [left, mut right] = [0; 2].map(|_| match (4.0 * random.unit()) as u32 {
        0 => Beside::Stock,
        1 => Beside::Border { distance: step_over(random) },
        _ => Beside::Cut { step_over: step_over(random) },
    });
    if let (Beside::Cut { step_over: a }, Beside::Cut { step_over: b }) = (left, right)
        && a.min(b) < 0.1
    {
        // Between two that close there is less than the sag of the polygons' chords.
        right = Beside::Stock;
    }
    PassSection {
        cutter: CutterEnd { radius, corner_radius },
        surface,
        engagement: Engagement { depth_of_cut: random.between(0.0, 5.0), left, right },
        orientation: Orientation { lead: angle(random), lean: angle(random) },
        neighbour_axis: if random.one_in(3.0) { NeighbourAxis::Turned } else { NeighbourAxis::Parallel },
    }
}

/// Factor that moves corners outward that are a `step` (rad) apart, so that the polygon has the
/// circle's area: its error is then that of a part of one chord.
fn equal_area(step: f64) -> f64 {
    (step / step.sin()).sqrt()
}

/// Convex hull, counter-clockwise (monotone chain).
fn hull(mut points: Contour) -> Contour {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Contour = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut lower = half(&mut points.iter().copied());
    lower.extend(half(&mut points.iter().rev().copied()));
    lower
}

/// Sum of two convex polygons: their edges in the order of direction, from the lowest corner of
/// both.
fn sum(a: &Contour, b: &Contour) -> Contour {
    let lowest =
        |c: &Contour| c.iter().copied().min_by(|p, q| p[1].total_cmp(&q[1]).then(p[0].total_cmp(&q[0]))).unwrap();
    let mut edges = Vec::new();
    for c in [a, b] {
        edges.extend((0..c.len()).map(|i| {
            let (from, to) = (c[i], c[(i + 1) % c.len()]);
            let edge = [to[0] - from[0], to[1] - from[1]];
            (edge[1].atan2(edge[0]).rem_euclid(TAU), edge)
        }));
    }
    edges.sort_by(|p, q| p.0.total_cmp(&q.0));
    let (p, q) = (lowest(a), lowest(b));
    let mut corner = [p[0] + q[0], p[1] + q[1]];
    let next = |(_, e): &(f64, [f64; 2])| {
        let here = corner;
        corner = [here[0] + e[0], here[1] + e[1]];
        here
    };
    edges.iter().map(next).collect()
}

/// Right of the feed and up, of a vector with x along the feed, y to the left and z along the
/// normal of this pass.
fn seen(v: Vector3<f64>) -> [f64; 2] {
    [-v.y, v.z]
}

/// Unit tool axis in space of the pass whose normal is given.
fn axis(section: &PassSection, n: Vector3<f64>) -> Vector3<f64> {
    let Orientation { lead, lean } = section.orientation;
    let against = match section.neighbour_axis {
        NeighbourAxis::Parallel => Vector3::z(),
        NeighbourAxis::Turned => n,
    };
    (Vector3::x() * lead.tan() + against.cross(&Vector3::x()) * lean.tan() + against).normalize()
}

/// CC point and outward normal `way` along the surface to the right.
fn contact(section: &PassSection, way: f64) -> (Vector3<f64>, Vector3<f64>) {
    let on_circle = |radius: f64, outward: f64| {
        let (sin, cos) = (way / radius).sin_cos();
        let from_center = Vector3::new(0.0, -sin, outward * cos);
        (from_center * radius - Vector3::z() * (outward * radius), from_center * outward)
    };
    match section.surface {
        SectionSurface::Plane => (Vector3::new(0.0, -way, 0.0), Vector3::z()),
        SectionSurface::Convex { radius } => on_circle(radius, 1.0),
        SectionSurface::Concave { radius } => on_circle(radius, -1.0),
    }
}

/// Returns the cutter at a CC point by CLOPT (2), seen along the feed: only its end, and with the
/// flute.
fn end_and_tool(section: &PassSection, way: f64, fine: u32) -> [Contour; 2] {
    let corners = CORNERS * fine;
    let CutterEnd { radius, corner_radius: r } = section.cutter;
    let (cc, n) = contact(section, way);
    let a = axis(section, n);
    let rim = radius - r;
    let across = a.cross(&n).cross(&a);
    // Along the axis the limit of a lead.
    let toward = if across.norm() > 1e-9 { across.normalize() } else { -Vector3::x() };
    let tip = cc + n * r + toward * rim - a * r;
    // Across the axis in the section: where the flute begins the rim is exact, elsewhere of the
    // circle's area.
    let u = a.cross(&Vector3::x()).normalize();
    let v = a.cross(&u);
    let circle = (0..corners).map(|i| (i, TAU * f64::from(i) / f64::from(corners))).map(|(i, t)| {
        let rim = if i.is_multiple_of(corners / 2) { rim } else { rim * equal_area(TAU / f64::from(corners)) };
        (rim * t.cos(), rim * t.sin())
    });
    let (middle, up) = (tip + a * r, seen(a));
    let lower = |p: &[f64; 2]| (p[0] - seen(middle)[0]) * up[0] + (p[1] - seen(middle)[1]) * up[1] <= 1e-12;
    let mut outline = hull(circle.map(|(x, y)| seen(middle + u * x + v * y)).filter(lower).collect());
    if r > 0.0 {
        outline = sum(&outline, &corner(r, up, corners));
    }
    // The flute goes up from the two points that are farthest across the axis.
    let across = |p: &[f64; 2]| p[0] * up[1] - p[1] * up[0];
    let ends = [
        *outline.iter().min_by(|a, b| across(a).total_cmp(&across(b))).unwrap(),
        *outline.iter().max_by(|a, b| across(a).total_cmp(&across(b))).unwrap(),
    ];
    // Outside the stock a fiftieth of the corners suffices, and the ends of straight pieces.
    let n = outline.len();
    let long = |i: usize, j: usize| {
        (outline[i][0] - outline[j][0]).hypot(outline[i][1] - outline[j][1]) > 0.05 / f64::from(fine)
    };
    let near = |p| height(section, p) < section.engagement.depth_of_cut + 0.2;
    let matters = |i: usize| {
        i.is_multiple_of(50 * fine as usize) || near(outline[i]) || long(i, (i + 1) % n) || long(i, (i + n - 1) % n)
    };
    let kept = (0..n).filter(|&i| matters(i)).map(|i| outline[i]);
    let end: Contour = kept.chain(ends).collect();
    let with_flute = end.iter().copied().chain(ends.map(|p| moved(p, up, FAR))).collect();
    // Even a flat end seen edge on has an area with a little of its flute.
    let end = end.iter().copied().chain(end.iter().map(|p| moved(*p, up, 0.01))).collect();
    [hull(end), hull(with_flute)]
}

fn tool(section: &PassSection, way: f64, fine: u32) -> Contour {
    let [_, tool] = end_and_tool(section, way, fine);
    tool
}

/// Height over the surface.
fn height(section: &PassSection, [x, y]: [f64; 2]) -> f64 {
    match section.surface {
        SectionSurface::Plane => y,
        SectionSurface::Convex { radius } => x.hypot(y + radius) - radius,
        SectionSurface::Concave { radius } => radius - x.hypot(y - radius),
    }
}

/// Circle of a corner about the origin, finest where its normal is against the axis: there a single
/// normal goes with a bottom of any width. Exact there and where the flute begins, otherwise moved
/// outward so that the area of a chord is the arc's.
fn corner(radius: f64, axis: [f64; 2], corners: u32) -> Contour {
    let n = corners / 5;
    let below = axis[1].atan2(axis[0]) + PI;
    let off = |i: i32| {
        let u = f64::from(i) / f64::from(n);
        0.5 * PI * (0.15 + 0.85 * u * u) * u
    };
    let steps = (-(n as i32)..=n as i32).map(|i| (i, off(i)));
    let lower = steps.map(|(i, at)| {
        let step = off(i + 1) - off(i);
        let wide = if i % n as i32 == 0 { radius } else { radius * (1.0 + step * step / 12.0) };
        [wide * (below + at).cos(), wide * (below + at).sin()]
    });
    // The upper half is inside the flute.
    let upper = (1..100).map(|i| below + 0.5 * PI + PI * f64::from(i) / 100.0);
    lower.chain(upper.map(|t| [radius * t.cos(), radius * t.sin()])).collect()
}

/// The stock of the cut, and everything at or below its surface, the part included.
fn stock_and_ground(section: &PassSection, fine: u32) -> (Shape, Shape) {
    let ta = section.engagement.depth_of_cut;
    let outer = || vec![[-FAR, -FAR], [FAR, -FAR], [FAR, FAR], [-FAR, FAR]];
    let strip = |bottom: f64, top: f64| vec![vec![[-FAR, bottom], [FAR, bottom], [FAR, top], [-FAR, top]]];
    let circle = |center: f64, radius: f64| -> Contour {
        // Fine near the tool, with corners moved outward so that the area of a chord is the arc's,
        // and coarse beyond.
        let above_tangent = if center < 0.0 { (-center / (ta - center)).acos() + 0.05 } else { PI };
        let side = (NEAR / radius).min(above_tangent);
        let n = (side * radius / CHORD) as u32 * fine;
        let wide = radius * equal_area(side / f64::from(n));
        let near = (0..2 * n).map(|i| side * (f64::from(i) / f64::from(n) - 1.0));
        let far = (0..200).map(|i| side + 2.0 * (PI - side) * f64::from(i) / 200.0);
        // The contact is at the top of a convex circle and at the bottom of a concave one.
        let to_contact = -center.signum();
        near.chain(far).map(|t| [wide * t.sin(), center + to_contact * wide * t.cos()]).collect()
    };
    match section.surface {
        SectionSurface::Plane => (strip(0.0, ta), strip(-FAR, ta)),
        SectionSurface::Convex { radius } => {
            let stock = circle(-radius, radius + ta);
            (vec![stock.clone(), circle(-radius, radius)], vec![stock])
        }
        SectionSurface::Concave { radius } => {
            let hollow = circle(radius, radius - ta);
            (vec![circle(radius, radius), hollow.clone()], vec![outer(), hollow])
        }
    }
}

/// Everything on this side of a border `way` along the surface to the right.
fn this_side(section: &PassSection, way: f64) -> Shape {
    let (cc, n) = contact(section, way);
    let (cc, n) = (seen(cc), seen(n));
    let inward = if way < 0.0 { [n[1], -n[0]] } else { [-n[1], n[0]] };
    let ends = [moved(cc, n, -4.0 * FAR), moved(cc, n, 4.0 * FAR)];
    vec![vec![ends[0], ends[1], moved(ends[1], inward, 4.0 * FAR), moved(ends[0], inward, 4.0 * FAR)]]
}

fn sides(section: &PassSection) -> [(f64, Beside); 2] {
    [(-1.0, section.engagement.left), (1.0, section.engagement.right)]
}

fn polygon_area(section: &PassSection, fine: u32) -> f64 {
    let (stock, _) = stock_and_ground(section, fine);
    let mut stock = vec![stock];
    for (side, beside) in sides(section) {
        if let Beside::Border { distance } = beside {
            stock = boolean(&stock, &vec![this_side(section, side * distance)], OverlayRule::Intersect);
        }
    }
    let cut = boolean(&stock, &vec![vec![tool(section, 0.0, fine)]], OverlayRule::Intersect);
    let Some(cut) = at(cut, [0.0, 0.0]) else { return 0.0 };
    let mut chip = vec![cut];
    for (side, beside) in sides(section) {
        if let Beside::Cut { step_over } = beside {
            chip = boolean(&chip, &vec![vec![tool(section, side * step_over, fine)]], OverlayRule::Difference);
        }
    }
    chip.iter().map(area).sum()
}

/// Relative accuracy of the comparison, and the area below which it is absolute, mm².
const TOLERANCE: f64 = 1e-6;
const SMALL: f64 = 0.01;

/// The polygons must come within the tolerance of the area, if necessary with chords a fifth and a
/// twenty-fifth as long: the error of chords shrinks with their square, a wrong area stays wrong.
fn compare_one(section: &PassSection, chip: &ChipArea) {
    for fine in [1, 5, 25] {
        let polygons = polygon_area(section, fine);
        if (chip.area - polygons).abs() <= TOLERANCE * polygons.max(SMALL) {
            return;
        }
        assert!(fine < 25, "{section:?}: {chip:?}, polygons {polygons}");
    }
}

fn compare(seed: u64, cases: usize) {
    let mut random = Random(seed);
    let (mut by_method, mut refused) = ([0; 3], 0);
    while by_method.iter().sum::<usize>() < cases {
        let section = section(&mut random);
        match chip_of_pass(&section) {
            Ok(chip) => {
                compare_one(&section, &chip);
                by_method[chip.method as usize] += 1;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(refused < cases / 4 && by_method.iter().all(|n| *n > cases / 10), "{refused} {by_method:?}");
}

#[test]
fn the_area_is_that_of_the_polygons() {
    compare(31, 300);
}

#[test]
#[ignore = "the same for 4000 more cases: two minutes"]
fn the_area_is_that_of_the_polygons_in_thousands_of_cases() {
    compare(32, 4000);
}

#[test]
fn what_is_held_in_narrow_bands_of_heights_only_is_not_missed() {
    let section = |radius, corner_radius, surface, depth_of_cut, left, right, lead, lean| PassSection {
        cutter: CutterEnd { radius, corner_radius },
        surface,
        engagement: Engagement { depth_of_cut, left, right },
        orientation: Orientation { lead, lean },
        neighbour_axis: NeighbourAxis::Turned,
    };
    let (concave, convex) =
        (SectionSurface::Concave { radius: 20.754491 }, SectionSurface::Convex { radius: 49.69475 });
    let (left, border) = (Beside::Cut { step_over: 0.0055863 }, Beside::Border { distance: 1.1331284 });
    let right = Beside::Cut { step_over: 0.0570629 };
    for section in [
        // A bottom that is farther from the wall between its corners than at one of them, by 1.4
        // µm.
        section(8.2777957, 6.0219411, concave, 3.880506, left, Beside::Stock, 0.0, 0.29693088),
        // A ball whose side reaches beyond the border of the stock between two heights.
        section(2.0952021, 2.0952021, convex, 1.3403985, border, right, -0.3974905, 0.5764608),
    ] {
        let chip = chip_of_pass(&section).unwrap();
        compare_one(&section, &chip);
    }
}

/// Area of the cutter below the surface: of its end anywhere, of the flute where it is connected to
/// the CC point in cut and part.
fn gouge_area(section: &PassSection, way: f64) -> f64 {
    let (stock, ground) = stock_and_ground(section, 2);
    let part = boolean(&vec![ground.clone()], &vec![stock], OverlayRule::Difference);
    let below = |tool: &Vec<Shape>| boolean(&part, tool, OverlayRule::Intersect).iter().map(area).sum::<f64>();
    let [end, tool] = end_and_tool(section, way, 2);
    let bite = boolean(&vec![ground], &vec![vec![tool]], OverlayRule::Intersect);
    let flute = at(bite, seen(contact(section, way).0)).map_or(0.0, |bite| below(&vec![bite]));
    flute.max(below(&vec![vec![end]]))
}

#[test]
fn a_pose_is_refused_exactly_where_its_polygon_is_below_the_surface() {
    refused_below(33, 30);
}

#[test]
#[ignore = "the same for ten times as many cases: a minute"]
fn a_pose_is_refused_exactly_where_its_polygon_is_below_the_surface_in_hundreds_of_cases() {
    refused_below(34, 300);
}

fn refused_below(seed: u64, cases: u32) {
    let mut random = Random(seed);
    let (mut free, mut below) = (0, [0; 3]);
    while free < cases || below.iter().any(|&n| n < cases / 4) {
        let mut section = section(&mut random);
        let radius = random.between(10.0, 30.0);
        section.surface = SectionSurface::Concave { radius };
        section.cutter.radius *= 2.0;
        section.neighbour_axis = NeighbourAxis::Parallel;
        let mut poses = vec![(Pose::This, 0.0)];
        for (pose, (side, beside)) in [Pose::Left, Pose::Right].into_iter().zip(sides(&section)) {
            if let Beside::Cut { step_over } = beside {
                poses.push((pose, side * step_over));
            }
        }
        // Chords of the concave surface reach into the part by less than the first; a gouge may be
        // as small as that.
        let (noise, least) = (2e-5, 5e-6);
        let below_by = |way: f64| gouge_area(&section, way);
        match chip_of_pass(&section) {
            Ok(_) if free < cases => {
                assert!(poses.iter().all(|&(_, way)| below_by(way) < noise), "{section:?}");
                free += 1;
            }
            Err(PassError::BelowSurface { pose }) if below[pose as usize] < cases / 2 => {
                let way = poses.iter().find(|p| p.0 == pose).expect("a pose there is").1;
                let (_, n) = contact(&section, way);
                // The polygons cannot decide an axis almost in the surface.
                if n.dot(&axis(&section, n)) > 0.05 {
                    assert!(below_by(way) > least, "{section:?} {pose}");
                    below[pose as usize] += 1;
                }
            }
            _ => {}
        }
    }
}
