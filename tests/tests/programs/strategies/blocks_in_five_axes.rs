//! Blocks and round bars roughed with a tool that leans: layers along a dome, and levels beside a
//! frustum, in five axes; levels across a tilted axis, 3+2.

use std::f64::consts::TAU;

use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter::{self, Motion};
use facemill_tests::oracles::read_back::{ReadBack, TipAndAxis, number};
use facemill_tests::oracles::rest_points::{RestPoint, RestPoints};
use facemill_tests::oracles::wetted::{Band, Wetted};
use facemill_tests::variants::{CUTTING, Written, variant, with_long_flute, written};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use crate::strategies::levels;

/// Radius of the sphere that the dome is of, whose top is at the origin, half side or radius of the
/// dome's outline, and the dome's sectors and rings, mm.
const SPHERE: f64 = 50.0;
const HALF: f64 = 16.0;
const SECTORS: usize = 48;
const RINGS: usize = 16;

/// Stock above the dome and beside it, and heights of the bottoms of dome and stock, mm.
const ABOVE: f64 = 3.0;
const BESIDE: f64 = 1.0;
const BOTTOMS: [f64; 2] = [-12.0, -12.5];

/// Largest depth of a layer, what the last one leaves, and the cusp between passes, mm.
const DEPTH: f64 = 3.0;
const LEFT: f64 = 0.4;
const CUSP: f64 = 0.3;

/// Tolerances of path, linearisation and gouge, and facets under the sphere, mm.
const BUDGET: f64 = 0.1;

/// Corner radius of the mill of the tests of levels, mm.
const CORNER: f64 = 1.0;

/// Distance of places of the tool along its way, mm.
const STEP: f64 = 1.0;

/// Stock around a part.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Block {
    Box,
    Bar,
}

impl Block {
    /// Radius of its outline in a direction, with a half side or radius, mm.
    fn outline(self, half: f64, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        if self == Self::Box { half / sin.abs().max(cos.abs()) } else { half }
    }

    /// Whether a place lies within an outline.
    fn is_over(self, half: f64, p: &Point3<f64>) -> bool {
        p.x.hypot(p.y) < self.outline(half, p.y.atan2(p.x))
    }

    /// Its entry in a job file, between two heights.
    fn stock(self, half: f64, [low, high]: [f64; 2]) -> Value {
        match self {
            Self::Box => json!({ "box": { "min_mm": [-half, -half, low], "max_mm": [half, half, high] } }),
            Self::Bar => {
                json!({ "cylinder": { "base_mm": [0, 0, low], "radius_mm": half, "height_mm": high - low } })
            }
        }
    }
}

/// Height of a place above the sphere, mm.
fn height(p: &Point3<f64>) -> f64 {
    (p + Vector3::z() * SPHERE).coords.norm() - SPHERE
}

/// Triangles of the dome's top, and of its sides and bottom.
fn dome(block: Block) -> [Vec<[Point3<f64>; 3]>; 2] {
    let place = |ring: usize, sector: usize| {
        let angle = TAU * sector as f64 / SECTORS as f64;
        let radius = block.outline(HALF, angle) * ring as f64 / RINGS as f64;
        Point3::new(radius * angle.cos(), radius * angle.sin(), (SPHERE * SPHERE - radius * radius).sqrt() - SPHERE)
    };
    let bottom = |sector: usize| Point3::new(place(RINGS, sector).x, place(RINGS, sector).y, BOTTOMS[0]);
    let (mut top, mut rest) = (Vec::new(), Vec::new());
    for k in 0..SECTORS {
        let next = (k + 1) % SECTORS;
        top.push([place(0, 0), place(1, k), place(1, next)]);
        for ring in 1..RINGS {
            let [a, b, c, d] = [place(ring, k), place(ring + 1, k), place(ring + 1, next), place(ring, next)];
            top.extend([[a, b, c], [a, c, d]]);
        }
        let [a, b, c, d] = [bottom(k), bottom(next), place(RINGS, next), place(RINGS, k)];
        rest.extend([[a, b, c], [a, c, d], [Point3::new(0.0, 0.0, BOTTOMS[0]), b, a]]);
    }
    [top, rest]
}

/// Triangles as OBJ, with vertices of their own.
fn obj(triangles: &[[Point3<f64>; 3]]) -> String {
    let vertices = triangles.iter().flatten().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = (0..triangles.len()).map(|k| format!("f {} {} {}\n", 3 * k + 1, 3 * k + 2, 3 * k + 3));
    String::from("o dome\n") + &vertices.chain(faces).collect::<String>()
}

/// Largest height of the stock above the dome, at its upper edge or corners, to 0.1 mm upward.
fn highest(block: Block) -> f64 {
    let corner = block.outline(HALF + BESIDE, TAU / 8.0);
    (height(&Point3::new(corner, 0.0, ABOVE)) * 10.0).ceil() / 10.0
}

/// Returns a job that roughs a block in layers along the dome in it, with a tool that leans by 14
/// to 20 deg from the dome's normals.
fn dome_in(block: Block) -> JobFolder {
    let mesh = json!({ "file": "dome.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" });
    let up = json!({ "axis": [0.0, 0.0, 1.0], "half_angle_deg": 40.0 });
    let job = variant(&[
        ("/operations/0/name", json!("rough")),
        ("/operations/0/allowance_mm", json!(LEFT)),
        ("/operations/0/layers", json!({ "from_mm": highest(block), "depth_mm": DEPTH })),
        ("/operations/0/path/strategy/region", json!({ "normal_cone": up, "extend_mm": BESIDE + 1.0 })),
        ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } })),
        ("/operations/0/tolerances/cusp_mm", json!(CUSP)),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/operations/0/tolerances/max_step_over_mm", json!(3.0)),
        ("/setups/0/meshes", json!([mesh])),
        ("/setups/0/stock", block.stock(HALF + BESIDE, [BOTTOMS[1], ABOVE])),
        ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
    ]);
    job.write("dome.obj", obj(&dome(block).concat()).as_bytes());
    with_long_flute(&job, 5.0);
    job
}

/// Places of the tool along motions.
fn places<'a>(back: &ReadBack, motions: impl Iterator<Item = &'a Motion>, step: f64) -> Vec<TipAndAxis> {
    motions.flat_map(|motion| back.places(motion, step)).collect()
}

/// Smallest and largest value, and their difference.
fn range(values: impl Iterator<Item = f64> + Clone) -> [f64; 3] {
    let (low, high) = (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max));
    [low, high, high - low]
}

#[test]
fn layers_in_five_axes_rough_a_box_down_to_the_allowance() {
    assert_layers(Block::Box, 3);
}

#[test]
fn layers_in_five_axes_rough_a_bar_down_to_the_allowance() {
    assert_layers(Block::Bar, 2);
}

/// Asserts that layers rough a block around the dome, by their texts.
fn assert_layers(block: Block, layers: u32) {
    let job = dome_in(block);
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{block:?}: {}{}", planned.printed, planned.errors);
    assert!(!job.path(&format!("out/program-top-{}-tool.nc", layers + 1)).exists(), "{}", planned.printed);

    let half = HALF + BESIDE;
    let mut points = RestPoints::over([[-half + 0.1; 2], [half - 0.1; 2]], (1.6, 0.4), 12.0, |_, _| -8.0);
    points.left.iter_mut().for_each(|p| p.height = height(&p.place));
    points.left.retain(|p| p.height > 0.0 && p.place.z < ABOVE && block.is_over(half, &p.place));
    let [top, _] = dome(block);
    let band = Band { above: LEFT + CUSP + BUDGET, below: BUDGET - LEFT };
    let mut rest = Wetted::of(&[("top".to_owned(), top)], |_| 1.0, band, 0.25);

    let depth = (highest(block) - LEFT) / f64::from(layers);
    for layer in 1..=layers {
        let program = written(&job, 0, &format!("-top-{layer}-tool"));
        let whose = format!("{block:?}, layer {layer}");
        assert_eq!(program.report["findings"].as_array().map(Vec::len), Some(0), "{whose}");
        let air = number(&program.report["operations"][0]["air_share"]);
        assert!(air < 0.15, "{whose}: {air} of the time in passes is in air");
        assert_leans(&program, &whose);

        // The stock that a layer takes on the dome is no thicker than it is deep, with a cusp of
        // the one before, and what it leaves is even.
        let level = highest(block) - depth * f64::from(layer);
        let before = points.left.clone();
        let met = points.cut(&program.back, &program.motions, STEP);
        assert!(met.is_empty(), "{whose}: {} points, first {:?}", met.len(), met[0]);
        let on_dome = |of: &[RestPoint], heights: [f64; 2]| {
            let is_in = |p: &&RestPoint| heights[0] < p.height && p.height < heights[1];
            of.iter().filter(|p| block.is_over(HALF - 1.0, &p.place)).filter(is_in).count()
        };
        let (below, above) = ([0.0, level - BUDGET], [level + CUSP + BUDGET, f64::INFINITY]);
        assert_eq!(on_dome(&points.left, below), on_dome(&before, below), "{whose} cuts too deep");
        assert_eq!(on_dome(&points.left, above), 0, "{whose} leaves stock above its level");
        let thickest = level + depth + CUSP + BUDGET;
        assert_eq!(on_dome(&before, [thickest, f64::INFINITY]), 0, "{whose} takes more than it is deep");
        rest.cut(&program.back.cutter, &places(&program.back, program.motions.iter().filter(|m| !m.rapid), 0.5));
    }
    let share = &rest.shares()[0];
    assert_eq!((share.above, share.below), (0.0, 0.0), "{block:?}: {share:?}");
}

/// Asserts that the tool leans along the passes of a program by all directions of the dome, and
/// that both rotary axes turn in them.
fn assert_leans(program: &Written, whose: &str) {
    let passes: Vec<&Motion> = program.with_feed(CUTTING).into_iter().map(|(motion, _)| motion).collect();
    let leans = places(&program.back, passes.iter().copied(), STEP);
    let leans = range(leans.iter().map(|(_, axis)| axis.z.acos().to_degrees()));
    let b = range(passes.iter().map(|motion| motion.to.b));
    let c = range(passes.iter().map(|motion| motion.to.c));
    assert!(leans[2] > 15.0, "{whose}: the tool leans from {} to {} deg", leans[0], leans[1]);
    assert!(b[2] > 15.0 && c[2] > 15.0, "{whose}: B turns by {} deg, C by {}", b[2], c[2]);
}

/// Whether a place above a level is over the frustum along an axis: an upright cutter with its
/// corner, which keeps the allowance, does not take it.
fn stays(p: &Point3<f64>, axis: &Vector3<f64>, level: f64) -> bool {
    let above = p.coords.dot(axis) - level;
    let steps = (above / 0.25).ceil().max(1.0) as usize;
    let down = (0..=steps).map(|k| p - axis * (above * k as f64 / steps as f64));
    down.map(|at| levels::distance(&at)).fold(f64::INFINITY, f64::min) < levels::ALLOWANCE + CORNER + 2.0 * BUDGET
}

/// Half side or radius of the block around the frustum of the tests of levels, and its height, mm.
const FRUSTUM_HALF: f64 = 30.0;
const FRUSTUM_TOP: f64 = 30.0;

#[test]
fn levels_in_five_axes_clear_a_box_beside_a_part() {
    assert_levels(Block::Box);
}

#[test]
fn levels_in_five_axes_clear_a_bar_beside_a_part() {
    assert_levels(Block::Bar);
}

/// Asserts that levels of a tool that leans clear a block around the frustum, by their texts.
fn assert_levels(block: Block) {
    let levels_mm = [26.0, 22.0];
    let job = levels::block(&json!({ "to_mm": 22.0, "depth_mm": 4.0 }));
    let cone = json!({ "axis": [0.0, 0.0, 1.0], "half_angle_deg": 20.0 });
    job.set(
        "job.json",
        &[
            ("/setups/0/stock", block.stock(FRUSTUM_HALF, [0.0, FRUSTUM_TOP])),
            ("/operations/0/search/tilt_deg", json!([3.0, 6.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 30.0])),
            ("/operations/0/search/mode", Value::Null),
            ("/operations/0/search/tool_axis_cone", cone),
            ("/operations/0/tolerances/cusp_mm", json!(CUSP)),
            ("/operations/0/tolerances/max_step_over_mm", json!(8.0)),
            // A tool that leans leaves more beside walls.
            ("/operations/0/finish", json!({ "max_above_fraction": 0.02 })),
        ],
    );
    let programs = ["top-1-tool", "top-2-tool"];
    let reports = levels::planned(&job, &programs);
    let back = ReadBack::of(&job, 0);
    let mut points = RestPoints::over([[-29.0, -29.0], [29.0, 29.0]], (3.0, 0.75), 9.0, |_, _| 21.0);
    points.left.iter_mut().for_each(|p| p.height = levels::distance(&p.place));
    points.left.retain(|p| block.is_over(FRUSTUM_HALF - 0.1, &p.place));
    let mut top = FRUSTUM_TOP;
    for ((program, report), level) in programs.iter().zip(&reports).zip(levels_mm) {
        let whose = format!("{block:?}, {program}");
        assert_eq!(report["verified"], true, "{whose}");
        let air = number(&report["operations"][0]["air_share"]);
        assert!(air < 0.2, "{whose}: {air} of the time in passes is in air");
        let motions = interpreter::run(&levels::text(&job, &format!("out/program-{program}.nc")));
        let cuts = places(&back, motions.iter().filter(|m| !m.rapid), STEP);
        let leans = range(cuts.iter().map(|(_, axis)| axis.z.acos().to_degrees()));
        let sides = range(cuts.iter().map(|(_, axis)| axis.x));
        assert!(leans[0] > 2.9 && leans[1] < 20.1 && sides[2] > 0.05, "{whose}: {leans:?} deg, {sides:?}");

        let before = points.left.clone();
        let met = points.cut(&back, &motions, STEP);
        assert!(met.is_empty(), "{whose}: {} points, first {:?}", met.len(), met[0]);
        // It cuts neither the allowance nor below its level.
        let kept = |of: &[RestPoint]| {
            of.iter().filter(|p| p.height < levels::ALLOWANCE - BUDGET || p.place.z < level - BUDGET).count()
        };
        assert_eq!(kept(&points.left), kept(&before), "{whose} cuts the allowance or below its level");
        // Of its slab only what is over the part stays, and the little that the leaning cutter does
        // not reach beside it; nor is there more above its slab: no cut is thicker than a level.
        let up = Vector3::z();
        let is_free = |p: &&RestPoint| !stays(&p.place, &up, level);
        let of_slab = |of: &[RestPoint], low: f64| {
            of.iter().filter(|p| p.place.z > low + CUSP + BUDGET).filter(is_free).map(|p| p.height).collect()
        };
        let (all, left): (Vec<f64>, Vec<f64>) = (of_slab(&before, level), of_slab(&points.left, level));
        let higher: Vec<f64> = of_slab(&before, top);
        let farthest = left.iter().chain(&higher).copied().fold(0.0, f64::max);
        assert!(left.len() * 50 < all.len(), "{whose} leaves {} of {} points", left.len(), all.len());
        assert!(higher.len() * 50 < all.len(), "{whose} meets {} points above its slab", higher.len());
        assert!(farthest < 5.0, "{whose} leaves stock {farthest} mm from the part");
        top = level;
    }
}

#[test]
fn levels_across_a_tilted_axis_leave_the_allowance_in_a_box() {
    assert_tilted(Block::Box);
}

#[test]
fn levels_across_a_tilted_axis_leave_the_allowance_in_a_bar() {
    assert_tilted(Block::Bar);
}

/// Asserts that levels across a tilted axis clear a block down to the frustum, by their texts.
fn assert_tilted(block: Block) {
    // 30 deg about x: the tool comes from +z and -y, and the last level cuts through the top of the
    // frustum's edge, which is 27 mm high along this axis.
    let axis = Vector3::new(0.0, -0.5, 0.75f64.sqrt());
    let half = 20.0;
    let job = levels::block(&json!({ "axis": [axis.x, axis.y, axis.z], "to_mm": 25.0, "depth_mm": 5.0 }));
    job.set(
        "job.json",
        &[
            ("/setups/0/stock", block.stock(half, [0.0, 28.0])),
            ("/setups/0/clearance", json!({ "sphere": { "radius_mm": 80.0 } })),
            ("/operations/0/search/preferred_branch", json!("nearest_home")),
            ("/operations/0/path/strategy/strategy/parallel_planes/normal", json!([1.0, 0.0, 0.0])),
        ],
    );
    job.set("tool.json", &[("/flute_length_mm", json!(8.0)), ("/stick_out_mm", json!(42.0))]);
    let gauge = number(&job.json("tool.json")["gauge_length_mm"]) + 2.0;
    job.set("tool.json", &[("/gauge_length_mm", json!(gauge))]);
    let programs = ["top-1-tool", "top-2-tool"];
    let reports = levels::planned(&job, &programs);
    let back = ReadBack::of(&job, 0);
    let mut points = RestPoints::over([[-half + 0.5; 2], [half - 0.5; 2]], (2.2, 0.75), 28.0, |_, _| 0.0);
    points.left.iter_mut().for_each(|p| p.height = levels::distance(&p.place));
    points.left.retain(|p| block.is_over(half - 0.1, &p.place) && p.place.coords.dot(&axis) > 20.0);
    let up = |p: &RestPoint| p.place.coords.dot(&axis);
    let top = half * 0.5 + 28.0 * axis.z;
    for ((program, report), level) in programs.iter().zip(&reports).zip([25.0 + 0.5 * (top - 25.0), 25.0]) {
        let whose = format!("{block:?}, {program}");
        assert_eq!(report["verified"], true, "{whose}");
        let air = number(&report["operations"][0]["air_share"]);
        assert!(air < 0.35, "{whose}: {air} of the time in passes is in air");
        let motions = interpreter::run(&levels::text(&job, &format!("out/program-{program}.nc")));
        let cuts = places(&back, motions.iter().filter(|m| !m.rapid), STEP);
        assert!(cuts.iter().all(|(_, a)| a.dot(&axis) > 1.0 - 1e-6), "{whose}: the tool leans");
        let before = points.left.clone();
        let met = points.cut(&back, &motions, STEP);
        assert!(met.is_empty(), "{whose}: {} points, first {:?}", met.len(), met[0]);
        let kept = |of: &[RestPoint]| {
            of.iter().filter(|p| p.height < levels::ALLOWANCE - BUDGET || up(p) < level - BUDGET).count()
        };
        assert_eq!(kept(&points.left), kept(&before), "{whose} cuts the allowance or below its level");
        // Above the level, nothing is left but over the part with its allowance.
        let above = |p: &&RestPoint| up(p) > level + BUDGET && !stays(&p.place, &axis, level);
        let left: Vec<&RestPoint> = points.left.iter().filter(above).collect();
        let all = before.iter().filter(above).count();
        assert!(
            left.is_empty() && all > 100,
            "{whose} leaves {} of {all} points, first {:?}",
            left.len(),
            left.first()
        );
    }
}
