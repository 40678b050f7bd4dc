//! Regions that passes serve badly: each place is cut within the limit, or lies in an island that
//! the report lists. Places and what is left on them come from the mesh's own triangles and the
//! motions of the written text, without code of the product.

use facemill_test_kit::Random;
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::oracles::rest_points::{RestPoint, RestPoints};
use facemill_tests::variants::variant;
use nalgebra::Point3;
use serde_json::{Value, json};

/// Steps along the program, mm.
const STEP: f64 = 0.25;

/// Places that are looked at.
const PLACES: usize = 400;

/// A region: vertices and triangles in the plane z = 0, facing up.
#[derive(Default)]
struct Sheet {
    vertices: Vec<[f64; 2]>,
    triangles: Vec<[usize; 3]>,
}

impl Sheet {
    /// Adds a grid of squares of 2 mm, without the triangles whose middles are refused.
    fn with(mut self, low: [f64; 2], squares: [usize; 2], keep: impl Fn([f64; 2]) -> bool) -> Self {
        let first = self.vertices.len();
        let at = |i: usize, j: usize| [low[0] + 2.0 * i as f64, low[1] + 2.0 * j as f64];
        for j in 0..=squares[1] {
            self.vertices.extend((0..=squares[0]).map(|i| at(i, j)));
        }
        let node = |i: usize, j: usize| first + j * (squares[0] + 1) + i;
        for (i, j) in (0..squares[1]).flat_map(|j| (0..squares[0]).map(move |i| (i, j))) {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            self.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| {
                let mean = |k: usize| t.iter().map(|&v| self.vertices[v][k]).sum::<f64>() / 3.0;
                keep([mean(0), mean(1)])
            }));
        }
        self
    }

    fn obj(&self) -> String {
        let vertices = self.vertices.iter().map(|[x, y]| format!("v {x} {y} 0\n"));
        let faces = self.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
        vertices.chain(faces).collect()
    }

    /// Places spread over the triangles by area.
    fn places(&self) -> Vec<[f64; 2]> {
        let mut random = Random(11);
        let corners = |t: &[usize; 3]| t.map(|v| self.vertices[v]);
        let area = |t: &[usize; 3]| {
            let [a, b, c] = corners(t);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
        };
        let all: f64 = self.triangles.iter().map(area).sum();
        let mut place = || {
            let mut left = all * random.unit();
            let chosen = self.triangles.iter().find(|t| {
                left -= area(t);
                left <= 0.0
            });
            let [a, b, c] = corners(chosen.unwrap_or(&self.triangles[0]));
            let (u, v) = (random.unit().sqrt(), random.unit());
            [0, 1].map(|k| (1.0 - u) * a[k] + u * (1.0 - v) * b[k] + u * v * c[k])
        };
        (0..PLACES).map(|_| place()).collect()
    }
}

/// Plans a region by a strategy, and returns the share of places above the limit: as sampled here,
/// and as reported.
fn checked(name: &str, sheet: &Sheet, (strategy, edge_fill): (&Value, bool), shortest: f64) -> [f64; 2] {
    let job: JobFolder = variant(&[
        ("/operations/0/path/strategy/strategy", strategy.clone()),
        ("/operations/0/path/strategy/edge_fill", json!(edge_fill)),
        ("/operations/0/path/strategy/min_pass_length_mm", json!(shortest)),
        ("/operations/0/tolerances/cusp_mm", json!(0.05)),
        ("/operations/0/search/tilt_deg", json!([8.0, 20.0])),
        ("/operations/0/finish", json!({ "max_above_fraction": 1.0, "max_never_cut_fraction": 1.0 })),
        ("/verification/cut_stock", json!(false)),
    ]);
    job.write("patch.obj", sheet.obj().as_bytes());
    let planned = job.try_plan().unwrap_or_else(|e| panic!("{name}: {e}"));
    let report = serde_json::to_value(&planned.report).expect("JSON");
    let left = &report["remaining"]["operations"][0];
    let number = |v: &Value| v.as_f64().expect("a number");
    let (limit, spacing) = (number(&left["limit_mm"]), number(&left["spacing_mm"]));

    let height = limit + number(&report["remaining"]["accuracy_mm"]) + 0.005;
    let point = |[x, y]: [f64; 2]| RestPoint { place: Point3::new(x, y, height), height, clearance: f64::INFINITY };
    let mut rest = RestPoints { left: sheet.places().into_iter().map(point).collect() };
    rest.cut(&ReadBack::of(&job, 0), &interpreter::run(&text_of(&planned, "program.nc")), STEP);

    let islands = left["largest_islands"].as_array().expect("a list");
    let is_listed = |p: &RestPoint| {
        let place = [p.place.x, p.place.y];
        islands.iter().any(|island| {
            (0..2).all(|k| {
                let [from, to] = ["from_mm", "to_mm"].map(|key| number(&island[key][k]));
                (from - 2.0 * spacing..=to + 2.0 * spacing).contains(&place[k])
            })
        })
    };
    let all_listed = left["islands"].as_u64().expect("a number") as usize == islands.len();
    for p in &rest.left {
        assert!(!all_listed || is_listed(p), "{name}: nothing says that {p:?} is left: {islands:?}");
    }
    [rest.left.len() as f64 / PLACES as f64, number(&left["above_fraction"])]
}

#[test]
fn each_place_of_an_adverse_region_is_cut_or_listed() {
    let hole = |[x, y]: [f64; 2]| x.hypot(y) > 5.0;
    let all = |_: [f64; 2]| true;
    let planes = json!({ "parallel_planes": { "normal": [0, 1, 0] } });
    let fronts = |seed: Value| json!({ "constant_scallop": { "seed": seed } });
    let seed = json!({ "plane": { "origin_mm": [0, -7, 0], "normal": [0, 1, 0] } });

    let holed = Sheet::default().with([-14.0, -12.0], [14, 12], hole);
    // One above the other, so that a seed on the lower reaches only it.
    let two = Sheet::default().with([-12.0, -14.0], [12, 5], all).with([-12.0, 4.0], [12, 5], all);
    // Two squares that share one vertex.
    let mut touching = Sheet::default().with([-12.0, -12.0], [6, 6], all).with([0.0, 0.0], [6, 6], all);
    touching.triangles.iter_mut().flatten().filter(|v| **v == 49).for_each(|v| *v = 48);
    // Needles along one side, and all triangles of a row twice.
    let mut rough = Sheet::default().with([-12.0, -8.0], [12, 8], all);
    let n = rough.vertices.len();
    rough.vertices.extend((0..=48).map(|k| [-12.0 + 0.5 * f64::from(k), 8.02]));
    for k in 0..48 {
        let below = n - 13 + k / 4;
        rough.triangles.push([below, n + k + 1, n + k]);
    }
    rough.triangles.extend_from_within(0..24);

    for (name, sheet) in [("hole", &holed), ("two", &two), ("touching", &touching), ("rough", &rough)] {
        for (strategy, edge_fill) in [(&planes, true), (&fronts(json!("border")), false)] {
            let [sampled, reported] = checked(name, sheet, (strategy, edge_fill), 1.0);
            assert!(
                sampled <= reported + 0.01 && reported < 0.03,
                "{name}, {strategy}: {sampled}, reported {reported}"
            );
        }
    }
    // Fronts of a seed on one of two plates go on over the other.
    let [sampled, reported] = checked("two", &two, (&fronts(seed), false), 1.0);
    assert!(sampled <= reported + 0.01 && reported < 0.03, "{sampled}, reported {reported}");
    // A crumb beside a plate, on which no pass is long enough: left, and said.
    let crumb = Sheet::default().with([-12.0, -8.0], [12, 8], all).with([20.0, -3.0], [3, 3], all);
    let share = 36.0 / (384.0 + 36.0);
    // Of fronts, stretches at the corners of the plate are short, too.
    for (strategy, edge_fill, most) in [(&planes, true, 1.02 * share), (&fronts(json!("border")), false, 0.25)] {
        let [sampled, reported] = checked("crumb", &crumb, (strategy, edge_fill), 12.0);
        assert!(reported > 0.98 * share && reported < most, "{share}, reported {reported}");
        assert!((sampled - reported).abs() < 0.06, "{sampled}, reported {reported}");
    }
}
