//! Layers over a casting that is thicker in the middle: the upper ones cut the hill alone, and what
//! all of them leave is even. The height of the casting is known in closed form.

use std::collections::HashMap;
use std::f64::consts::PI;

use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::read_back::{TipAndAxis, number};
use facemill_tests::oracles::rest_points::{RestPoint, RestPoints};
use facemill_tests::oracles::wetted::{Band, Wetted};
use facemill_tests::variants::{CUTTING, Written, box_obj, variant, with_long_flute, written};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

/// Half sides of the plate, whose top is at z = 0, and width of the casting around it, mm.
const PLATE: [f64; 2] = [16.0, 12.0];
const AROUND: f64 = 4.0;

/// Height of the casting on the plate, mm: the hill's top, the plain around it, and the hill's
/// radius.
const TOP: f64 = 9.0;
const PLAIN: f64 = 3.0;
const HILL: f64 = 18.0;

/// Largest depth of a layer, what the last one leaves, and the cusp between passes, mm.
const DEPTH: f64 = 3.0;
const LEFT: f64 = 0.4;
const CUSP: f64 = 0.3;

/// Layers of equal depth, none deeper than `DEPTH`, and heights that they leave, mm.
const LAYERS: usize = 3;

/// Tolerances of path, linearisation and gouge, and the casting's facets under the hill, mm.
const BUDGET: f64 = 0.1;

/// Distance between passes, and width of a layer's passes beyond what it has to cut, mm.
const STEP_OVER: f64 = 3.0;

/// Distance to which the border of the hill above a level is known, mm.
const BORDER: f64 = 0.5;

/// Distance of points of stock beside each other, and above each other, mm.
const STEPS: (f64, f64) = (1.6, 0.25);

/// Distance of places of the tool along its way, mm.
const STEP: f64 = 1.0;

/// Height of the casting at a distance from the hill's axis, mm.
fn casting_at(distance: f64) -> f64 {
    let cos = (PI * distance.min(HILL) / HILL).cos();
    0.5 * (TOP + PLAIN) + 0.5 * (TOP - PLAIN) * cos
}

/// Distance from the hill's axis at which the casting has a height, mm.
fn distance_of(height: f64) -> f64 {
    HILL / PI * ((2.0 * height - TOP - PLAIN) / (TOP - PLAIN)).acos()
}

/// Depth of each layer, and the height that one of them leaves, from 1, mm.
fn depth() -> f64 {
    (TOP - LEFT) / LAYERS as f64
}

fn level(layer: usize) -> f64 {
    TOP - depth() * layer as f64
}

/// The casting as OBJ: a grid of columns of 2 mm, from under the plate to the height above it.
fn casting_obj() -> String {
    let [x, y] = [PLATE[0] + AROUND, PLATE[1] + AROUND];
    let [columns, rows] = [x as usize, y as usize];
    let mut text = String::from("o casting\n");
    for i in 0..=columns {
        for j in 0..=rows {
            let (u, v) = (2.0 * i as f64 - x, 2.0 * j as f64 - y);
            text += &format!("v {u} {v} -8.5\nv {u} {v} {}\n", casting_at(u.hypot(v)));
        }
    }
    let at = |(i, j): (usize, usize), is_top: usize| 2 * (i * (rows + 1) + j) + is_top + 1;
    let mut face = |[a, b, c, d]: [usize; 4]| text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    for i in 0..columns {
        for j in 0..rows {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            face(corners.map(|corner| at(corner, 1)));
            let [a, b, c, d] = corners.map(|corner| at(corner, 0));
            face([d, c, b, a]);
        }
    }
    // Counter-clockwise around the casting, seen from above.
    let front = (0..columns).map(|i| (i, 0)).chain((0..rows).map(|j| (columns, j)));
    let back = (1..=columns).rev().map(|i| (i, rows)).chain((1..=rows).rev().map(|j| (0, j)));
    let border: Vec<(usize, usize)> = front.chain(back).collect();
    for (k, &from) in border.iter().enumerate() {
        let to = border[(k + 1) % border.len()];
        face([at(from, 0), at(to, 0), at(to, 1), at(from, 1)]);
    }
    text
}

/// Returns a job that roughs the top of the plate in layers from the top of the hill.
fn hill() -> JobFolder {
    let mesh = |file: &str| json!({ "file": file, "unit": "millimetre", "up_axis": "z" });
    let mut plate = mesh("plate.obj");
    plate["role"] = json!("drive");
    let up = json!({ "axis": [0.0, 0.0, 1.0], "half_angle_deg": 5.0 });
    let job = variant(&[
        ("/operations/0/name", json!("rough")),
        ("/operations/0/allowance_mm", json!(LEFT)),
        ("/operations/0/layers", json!({ "from_mm": TOP, "depth_mm": DEPTH })),
        ("/operations/0/path/strategy/region", json!({ "normal_cone": up, "extend_mm": AROUND + 1.0 })),
        ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } })),
        ("/operations/0/tolerances/cusp_mm", json!(CUSP)),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/operations/0/tolerances/max_step_over_mm", json!(STEP_OVER)),
        ("/setups/0/meshes", json!([plate])),
        ("/setups/0/stock", json!({ "mesh": mesh("casting.obj") })),
        ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
    ]);
    let [x, y] = PLATE;
    job.write("plate.obj", box_obj([-x, -y, -8.0], [x, y, 0.0]).as_bytes());
    job.write("casting.obj", casting_obj().as_bytes());
    // Longer than the layer by its cusp and by what the bound of the stock adds.
    with_long_flute(&job, 5.0);
    job
}

/// Distance of a place from the hill's axis, mm.
fn from_axis(p: &Point3<f64>) -> f64 {
    p.x.hypot(p.y)
}

/// Number of points in each column.
fn columns(points: &[RestPoint]) -> HashMap<[u64; 2], usize> {
    let mut columns = HashMap::new();
    for p in points {
        *columns.entry([p.place.x, p.place.y].map(f64::to_bits)).or_default() += 1;
    }
    columns
}

/// Lowest points of the cutter along the passes of a program, without entries and exits.
fn contacts_in_passes(program: &Written) -> Vec<Point3<f64>> {
    let cutter = &program.back.cutter;
    let lowest = |(tip, axis): &TipAndAxis| {
        let down = (axis.scale(axis.z) - Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::x);
        tip + axis.scale(cutter.corner) + down * (cutter.radius - cutter.corner) - Vector3::z() * cutter.corner
    };
    let passes = program.with_feed(CUTTING);
    passes.iter().flat_map(|(motion, _)| program.back.places(motion, STEP)).map(|place| lowest(&place)).collect()
}

#[test]
fn layers_level_an_uneven_casting_from_its_hill_down_to_an_even_rest() {
    let job = hill();
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    assert!(!job.path(&format!("out/program-top-{}-tool.nc", LAYERS + 1)).exists(), "{}", planned.printed);

    let [x, y] = PLATE.map(|half| half + AROUND - 0.5);
    let mut points = RestPoints::over([[-x, -y], [x, y]], STEPS, TOP, |_, _| 0.0);
    points.left.retain(|p| p.height < casting_at(from_axis(&p.place)));
    let is_on_plate = |p: &Point3<f64>| p.x.abs() < PLATE[0] && p.y.abs() < PLATE[1];
    let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[i, j]: [f64; 2]| Point3::new(i * PLATE[0], j * PLATE[1], 0.0));
    let plate = [("plate".to_owned(), vec![[a, b, c], [a, c, d]])];
    let band = Band { above: LEFT + CUSP + BUDGET, below: BUDGET - LEFT };
    let mut rest = Wetted::of(&plate, |_| 1.0, band, 0.25);

    let programs: Vec<Written> = (1..=LAYERS).map(|k| written(&job, 0, &format!("-top-{k}-tool"))).collect();
    let mut farthest = Vec::new();
    for (k, program) in (1..).zip(&programs) {
        let before = points.left.clone();
        let met = points.cut(&program.back, &program.motions, STEP);
        assert!(met.is_empty(), "layer {k}: {} points, first {:?}", met.len(), met[0]);
        // Of the plate it takes all above its level, and nothing below.
        let above = |p: &&RestPoint| is_on_plate(&p.place) && p.height > level(k) + CUSP + BUDGET;
        assert_eq!(points.left.iter().filter(above).count(), 0, "layer {k} leaves stock above its level");
        let below = |of: &[RestPoint]| of.iter().filter(|p| p.height < level(k) - BUDGET).count();
        assert_eq!(below(&points.left), below(&before), "layer {k} cuts below its level");
        // No column loses more than the layer, a cusp of the one before, and a step of points.
        let left = columns(&points.left);
        let lost = columns(&before).into_iter().map(|(at, n)| n - left.get(&at).copied().unwrap_or(0));
        let thickest = STEPS.1 * lost.max().unwrap_or(0) as f64;
        assert!(thickest <= depth() + CUSP + STEPS.1, "layer {k} takes {thickest} mm");
        assert!(thickest >= depth() - CUSP - STEPS.1, "layer {k} takes {thickest} mm");
        let air = number(&program.report["operations"][0]["air_share"]);
        assert!(air < 0.15, "layer {k}: {air} of the time in passes is in air");

        let contacts = contacts_in_passes(program);
        let off_level = contacts.iter().map(|p| (p.z - level(k)).abs()).fold(0.0, f64::max);
        assert!(off_level < BUDGET, "layer {k}: a contact {off_level} mm off its level");
        farthest.push(contacts.iter().map(from_axis).fold(0.0, f64::max));
        let cuts = program.motions.iter().filter(|motion| !motion.rapid);
        let cuts: Vec<TipAndAxis> = cuts.flat_map(|motion| program.back.places(motion, 0.5)).collect();
        rest.cut(&program.back.cutter, &cuts);
    }
    // Passes of the upper layers are where the hill is above the level, and one step beyond;
    // those of the last one go on beyond the corners of the plate.
    let reach = |k: usize| distance_of(level(k)) + STEP_OVER + BORDER;
    for k in [1, 2] {
        assert!(farthest[k - 1] <= reach(k), "layer {k} goes {} mm from the axis, not {}", farthest[k - 1], reach(k));
    }
    let corner = PLATE[0].hypot(PLATE[1]);
    assert!(reach(2) < corner && farthest[2] > corner, "{farthest:?}, corner at {corner} mm");

    // Allowance and cusp are left on the plate, and nowhere less than the allowance.
    let share = &rest.shares()[0];
    assert_eq!((share.above, share.below), (0.0, 0.0), "{share:?}");
    let findings = |program: &Written| program.report["findings"].as_array().map(Vec::len);
    assert!(programs.iter().all(|program| findings(program) == Some(0)));
    let remaining = |program: &Written| -> Value { program.report["remaining"]["operations"][0].clone() };
    for (k, program) in (1..).zip(&programs) {
        assert_eq!(number(&remaining(program)["above_fraction"]), 0.0, "layer {k}: {}", remaining(program));
    }
}
