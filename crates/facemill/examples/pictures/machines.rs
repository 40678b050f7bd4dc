//! The machine files of `assets/machines`, drawn from themselves.

use std::path::Path;

use facemill::cl_data::Solid;
use facemill::inverse_kinematics::import::JointLine;
use facemill::inverse_kinematics::{AxisKind, AxisValues, BodyPose, Carrier, Machine};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::figure::{Figure, GRAY, GREEN, INK, Mm, RED};

/// Machines and the Z they are drawn at, mm: low enough that the tool is near the table.
const MACHINES: [(&str, f64); 13] = [
    ("head-b-table-c", 1100.0),
    ("head-a-table-c", -350.0),
    ("table-table-a-c", -250.0),
    ("table-table-b-c", -250.0),
    ("head-head-c-a", -350.0),
    ("head-head-c-b", -350.0),
    ("head-b-nutating-table-c", -350.0),
    ("table-table-b-c-nutating", -300.0),
    ("table-y-x-a-c-head-z", -250.0),
    ("bridge-head-head-a-b", -700.0),
    ("head-b-a-table-c-two-linear", -250.0),
    ("dual-c-horizontal-xyzb", -700.0),
    ("dual-c-horizontal-xzab", -700.0),
];
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 640.0;
/// Room above, below and at the sides, pixels.
const MARGINS: [f64; 3] = [60.0, 80.0, 70.0];
/// At the right, for the arrows of linear axes, pixels.
const ROOM_FOR_ARROWS: f64 = 80.0;

/// Names and contents of files.
type Files = Vec<(String, Vec<u8>)>;

/// Draws a picture for each machine.
pub(crate) fn machines() -> Result<Files, Box<dyn std::error::Error>> {
    let draw = |&(name, z): &(&str, f64)| {
        let text = std::fs::read(Path::new("assets/machines").join(format!("{name}.json")))?;
        let heads = Machine::heads_from_json(&text)?;
        Ok((format!("machine-{name}.svg"), picture(&heads, z).into_bytes()))
    };
    MACHINES.iter().map(draw).collect()
}

/// Looking from the front, the right and above; parallel lines stay parallel.
struct View {
    right: Vector3<f64>,
    up: Vector3<f64>,
    toward_eye: Vector3<f64>,
}

impl View {
    fn new(machine: &Machine) -> Self {
        let upright = |v: Vector3<f64>| if machine.head_count() > 1 { level(&v) } else { v };
        let toward_eye = Vector3::new(0.75, -1.2, 0.75).normalize();
        let right = Vector3::z().cross(&toward_eye).normalize();
        let up = toward_eye.cross(&right);
        Self { right: upright(right), up: upright(up), toward_eye: upright(toward_eye) }
    }

    fn at(&self, p: &Point3<f64>) -> Mm {
        [self.right.dot(&p.coords), self.up.dot(&p.coords)]
    }
}

/// In the frame of a table that turns about a level axis: that is drawn along x, and the table's y
/// up.
fn level(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.y, v.z, v.x)
}

/// A flat side of a body: corners and outward normal.
type Side = (Vec<Point3<f64>>, Vector3<f64>);

fn picture(heads: &[Machine], z: f64) -> String {
    let machine = &heads[0];
    let view = View::new(machine);
    let mut q = AxisValues::zeros(machine.axes().len());
    // Two heads meet beside the axis that carries the workpiece.
    let beside = [("Z", z), ("Z1", z), ("Z2", z), ("X1", -450.0), ("X2", 450.0), ("Y1", 300.0), ("Y2", 300.0)];
    for (letter, value) in beside {
        machine.axis_index(letter).into_iter().for_each(|k| q[k] = value);
    }
    let mut bodies: Vec<(BodyPose<'_>, Vec<Side>)> = machine.body_poses(&q).map(|b| (b, sides(&b))).collect();
    // Beds and tables lie behind and below heads; within a group the farther ones come first.
    let rank = |b: &BodyPose<'_>| {
        // Two heads are beside the table, the second one behind it.
        let order = [None, Some(Carrier::OtherHead), Some(Carrier::Table), Some(Carrier::Head)];
        order.iter().position(|c| *c == b.body.carrier())
    };
    let depth = |s: &[Side]| {
        let corners = s.iter().flat_map(|(c, _)| c);
        corners.clone().map(|p| view.toward_eye.dot(&p.coords)).sum::<f64>() / corners.count().max(1) as f64
    };
    bodies.sort_by(|a, b| rank(&a.0).cmp(&rank(&b.0)).then(depth(&a.1).total_cmp(&depth(&b.1))));
    let families: Vec<String> = heads.iter().map(|head| head.family().to_string()).collect();
    let title = match families.iter().all(|family| machine.name().contains(family.as_str())) {
        true => machine.name().to_owned(),
        false => format!("{}: {}", machine.name(), families.join("; ")),
    };
    let mut figure = Figure::new(WIDTH, HEIGHT, &title);
    let places = |still: bool| -> Vec<Mm> {
        let wanted = bodies.iter().filter(|(b, _)| b.body.carrier().is_none() == still);
        wanted.flat_map(|(_, s)| s).flat_map(|(c, _)| c).map(|p| view.at(p)).collect()
    };
    let size = fit(&mut figure, places(false), &places(true));
    for (body, sides) in &bodies {
        draw_body(&mut figure, &view, body.body.carrier(), sides);
    }
    for head in heads {
        let length = 0.16 / heads.len() as f64 * size;
        let [nose, tip] = [0.0, length].map(|length| head.cl_point(&q, length).tip);
        figure.curve(&[view.at(&nose), view.at(&tip)], INK, 4.0, "");
        figure.dot(view.at(&tip), INK);
    }
    draw_axes(&mut figure, &view, heads, &q, &bodies, size);
    legend(&mut figure);
    figure.finish()
}

/// Fits moving bodies into the margins, with the near part of those at rest; returns the size of
/// the drawing, mm.
fn fit(figure: &mut Figure, mut points: Vec<Mm>, still: &[Mm]) -> f64 {
    let ranges = |points: &[Mm]| {
        [0, 1].map(|k| points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[k]), b.max(p[k]))))
    };
    let near = ranges(&points).map(|(a, b)| (a - 0.5 * (b - a), b + 0.5 * (b - a)));
    points.extend(still.iter().map(|p| [0, 1].map(|k| p[k].clamp(near[k].0, near[k].1))));
    let [(x0, x1), (y0, y1)] = ranges(&points);
    let (room_x, room_y) = (WIDTH - 2.0 * MARGINS[2] - ROOM_FOR_ARROWS, HEIGHT - MARGINS[0] - MARGINS[1]);
    let scale = (room_x / (x1 - x0)).min(room_y / (y1 - y0));
    figure.scale = [scale, scale];
    figure.origin = [
        0.5 * (WIDTH - ROOM_FOR_ARROWS) - 0.5 * (x0 + x1) * scale,
        MARGINS[0] + 0.5 * room_y + 0.5 * (y0 + y1) * scale,
    ];
    room_y.min(room_x) / scale
}

fn sides(body: &BodyPose<'_>) -> Vec<Side> {
    let pose: &Isometry3<f64> = &body.table_from_solid;
    let local = match &body.body.body.solid {
        Solid::Box(b) => box_sides(&b.half_extents),
        Solid::Frustum(f) => frustum_sides([f.radius_low, f.radius_high], [f.z_low, f.z_high]),
        Solid::Hull(h) => {
            let corner = |&k: &u32| h.core.vertices()[k as usize];
            h.core.faces().iter().map(|f| (f.corners.iter().map(corner).collect(), f.normal)).collect()
        }
    };
    local.into_iter().map(|(c, n)| (c.iter().map(|p| pose * p).collect(), pose * n)).collect()
}

fn box_sides(half: &Vector3<f64>) -> Vec<Side> {
    let mut sides = Vec::new();
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        for sign in [-1.0, 1.0] {
            let corner = |a: f64, b: f64| {
                let mut p = Point3::origin();
                (p[k], p[i], p[j]) = (sign * half[k], a * half[i], b * half[j]);
                p
            };
            let mut normal = Vector3::zeros();
            normal[k] = sign;
            sides.push((vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], normal));
        }
    }
    sides
}

fn frustum_sides(radius: [f64; 2], z: [f64; 2]) -> Vec<Side> {
    const STRIPS: u32 = 60;
    let ring = |end: usize, k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(STRIPS)).sin_cos();
        Point3::new(radius[end] * cos, radius[end] * sin, z[end])
    };
    let mut sides: Vec<Side> = (0..STRIPS)
        .map(|k| {
            // A strip reaches under the next, so that no gap shows between them.
            let corners = vec![ring(0, k), ring(0, k + 2), ring(1, k + 2), ring(1, k)];
            let along = (ring(0, k + 1) - ring(0, k)) + (ring(1, k + 1) - ring(1, k));
            let normal = along.cross(&(ring(1, k) - ring(0, k))).normalize();
            (corners, normal)
        })
        .collect();
    sides.push(((0..STRIPS).map(|k| ring(0, k)).collect(), -Vector3::z()));
    sides.push(((0..STRIPS).map(|k| ring(1, k)).collect(), Vector3::z()));
    sides
}

fn draw_body(figure: &mut Figure, view: &View, carrier: Option<Carrier>, sides: &[Side]) {
    let color = match carrier {
        None => [205.0, 208.0, 211.0],
        Some(Carrier::Table) => [236.0, 200.0, 150.0],
        Some(Carrier::Head | Carrier::OtherHead) => [160.0, 192.0, 222.0],
    };
    let light = Vector3::new(0.35, -0.5, 0.8).normalize();
    for (corners, normal) in sides.iter().filter(|(_, n)| n.dot(&view.toward_eye) > 0.0) {
        let bright = 0.72 + 0.28 * normal.dot(&light).max(0.0);
        let [r, g, b] = color.map(|c: f64| (c * bright).round());
        let places: Vec<Mm> = corners.iter().map(|p| view.at(p)).collect();
        figure.area(&places, &format!("rgb({r},{g},{b})"));
        // Strips of a round side have no edges of their own.
        let is_strip = sides.len() > 6 && corners.len() == 4;
        if is_strip {
            figure.curve(&places[..2], GRAY, 0.6, "");
            figure.curve(&places[2..], GRAY, 0.6, "");
        } else {
            let closed: Vec<Mm> = places.iter().chain(places.first()).copied().collect();
            figure.curve(&closed, GRAY, 0.6, "");
        }
    }
}

/// Returns the position of a joint's row when the linear axes have moved and the rotary ones have
/// not.
fn moved(lines: &[JointLine], k: usize, q: &AxisValues) -> Point3<f64> {
    let before = lines[..k].iter().filter(|l| l.kind == AxisKind::Linear);
    before.fold(lines[k].point, |p, l| p + l.direction.into_inner() * q[l.axis])
}

fn draw_axes(
    figure: &mut Figure,
    view: &View,
    heads: &[Machine],
    q: &AxisValues,
    bodies: &[(BodyPose<'_>, Vec<Side>)],
    size: f64,
) {
    let machine = &heads[0];
    let mut labels = Vec::new();
    for (h, head) in heads.iter().enumerate() {
        let lines = head.joint_lines();
        let rotary = lines.iter().enumerate().filter(|(_, l)| l.kind == AxisKind::Rotary);
        // Axes that both heads share are drawn once.
        for (k, line) in rotary.filter(|(_, l)| h == 0 || !head.is_shared(l.axis)) {
            let letter = machine.axes()[line.axis].letter.to_string();
            labels.push(draw_rotary(figure, view, &moved(&lines, k, q), &line.direction, &letter, size)[0]);
        }
    }
    let sides = [
        (0, Carrier::Head, Carrier::Head),
        (0, Carrier::Table, Carrier::Table),
        (1, Carrier::Head, Carrier::OtherHead),
    ];
    for (h, carrier, drawn) in sides.into_iter().filter(|s| s.0 < heads.len()) {
        let lines = heads[h].joint_lines();
        let of: Vec<&JointLine> = lines.iter().filter(|l| l.kind == AxisKind::Linear && l.carrier == carrier).collect();
        let own = bodies.iter().filter(|(b, _)| b.body.carrier() == Some(drawn));
        let places: Vec<Mm> = own.flat_map(|(_, s)| s).flat_map(|(c, _)| c).map(|p| view.at(p)).collect();
        let middle = places.iter().map(|p| p[1]).sum::<f64>() / places.len().max(1) as f64;
        let right = places.iter().map(|p| p[0]).chain(labels.iter().copied()).fold(f64::NEG_INFINITY, f64::max);
        let edge = (WIDTH - 30.0 - figure.origin[0]) / figure.scale[0] - 0.15 * size;
        let start = [(right + 0.08 * size).min(edge), middle];
        for line in of {
            let along = view.at(&Point3::from(line.direction.into_inner() * 0.15 * size));
            let end = [start[0] + along[0], start[1] + along[1]];
            figure.arrow(start, end, GREEN);
            let name = machine.axes()[line.axis].letter.to_string();
            figure.text(end, [7.0, if along[1] > 0.0 { -4.0 } else { 14.0 }], GREEN, &name);
        }
    }
}

/// Draws the line of a rotary axis, and an arrow round it in its positive sense; returns the
/// position of its letter.
fn draw_rotary(
    figure: &mut Figure,
    view: &View,
    point: &Point3<f64>,
    direction: &Vector3<f64>,
    letter: &str,
    size: f64,
) -> Mm {
    let [low, high] = [-0.2, 0.34].map(|t| point + direction * (t * size));
    figure.curve(&[view.at(&low), view.at(&high)], RED, 1.4, "10 3 2 3");
    let across = if direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = direction.cross(&across).normalize();
    let v = direction.cross(&u);
    let center = point + direction * (0.28 * size);
    let round = |deg: f64| {
        let (sin, cos) = deg.to_radians().sin_cos();
        view.at(&(center + (u * cos + v * sin) * (0.05 * size)))
    };
    let arc: Vec<Mm> = (0..=52).map(|k| round(5.0 * f64::from(k))).collect();
    figure.curve(&arc, RED, 1.8, "");
    figure.arrow(arc[50], arc[52], RED);
    figure.text(view.at(&high), [5.0, -5.0], RED, letter);
    view.at(&high)
}

fn legend(figure: &mut Figure) {
    figure.scale = [1.0, 1.0];
    figure.origin = [0.0, 0.0];
    let below = 56.0 - HEIGHT;
    figure.area(&[[0.0, below], [WIDTH, below], [WIDTH, -HEIGHT], [0.0, -HEIGHT]], "#ffffff");
    let line =
        |figure: &mut Figure, x: f64, y: f64, color: &str, text: &str| figure.text([x, -y], [0.0, 0.0], color, text);
    line(
        figure,
        20.0,
        HEIGHT - 36.0,
        INK,
        "blue: moves with the head; orange: with the table; grey: does not move; black: a tool",
    );
    line(
        figure,
        20.0,
        HEIGHT - 16.0,
        INK,
        "arrows: how the tool moves against the workpiece when the word grows (ISO 841)",
    );
}
