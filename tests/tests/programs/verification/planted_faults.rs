//! Faults planted in a clean program are found where they are, and their harmless twins are not.

use facemill::interference::MeshTree;
use facemill::inverse_kinematics::Machine;
use facemill::nc_program::{Dialect, MappedAxis, WordMap, WorkOffset, read_program};
use facemill::surface_model::TriMesh;
use facemill::tool_model::ToolAssembly;
use facemill::virtual_machine::{
    Finding, FindingKind, Measure, ObstacleKind, Verification, VerifySettings, VirtualObstacle, VirtualSetup, verify,
};
use facemill_tests::jobs::{JobFolder, small_patch, small_patch_planned, text_of};
use facemill_tests::oracles::brute::{Bins, Frustum, RoundedCylinder};
use facemill_tests::oracles::interpreter::{self, Axes, Motion, with_word};
use facemill_tests::oracles::paper_machine::{PIVOT_TO_FACE, tool_on_table};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde_json::{Value, json};

/// The small patch, its clean program, and what it takes to run it.
struct Cell {
    job: JobFolder,
    text: String,
    budget: f64,
    mesh: TriMesh,
    tree: MeshTree,
    bins: Bins,
    cutter: RoundedCylinder,
    pivot_length: f64,
    mount: f64,
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("no number: {v}"))
}

impl Cell {
    fn new() -> Self {
        let (job, planned) = (small_patch(), small_patch_planned());
        assert!(planned.is_clean());
        let tool = job.json("tool.json");
        let mesh = facemill::read_mesh(&job.path("patch.obj"), None, None).unwrap().mesh;
        Self {
            text: text_of(planned, "program.nc"),
            budget: planned.report.budgets[0].against_mesh_mm,
            tree: MeshTree::new(&mesh),
            bins: Bins::new(&mesh, 4.0),
            mesh,
            cutter: RoundedCylinder {
                radius: number(&tool["radius_mm"]),
                corner: number(&tool["corner_radius_mm"]),
                height: number(&tool["flute_length_mm"]),
            },
            pivot_length: PIVOT_TO_FACE + number(&tool["gauge_length_mm"]),
            mount: number(&job.json("job.json")["setups"][0]["table_from_work"]["translation_mm"][2]),
            job,
        }
    }

    /// Runs a text with a tool as it is in a file.
    fn run(&self, text: &str, tool: &Value) -> Verification {
        let machine = Machine::head_b_table_c().unwrap();
        let tool = ToolAssembly::from_json(tool.to_string().as_bytes()).unwrap();
        let axes = machine.axes().iter().map(|a| MappedAxis {
            letter: a.letter.as_str().parse().unwrap(),
            offset: 0.0,
            along_spindle: if a.letter == "Z" { 1.0 } else { 0.0 },
        });
        let words = WordMap::new(axes.collect(), WorkOffset::default(), tool.gauge_length()).unwrap();
        let setup = VirtualSetup {
            machine: &machine,
            table_from_work: Isometry3::translation(0.0, 0.0, self.mount),
            words: &words,
            table_from_rtcp_words: None,
            tool: &tool,
            length_register: tool.number(),
            obstacles: vec![VirtualObstacle {
                name: "part".to_owned(),
                mesh: &self.tree,
                kind: ObstacleKind::Part,
                allowance: 0.0,
                stock: 0.0,
            }],
        };
        let program = read_program(text, Dialect::Fanuc).unwrap();
        let settings = VerifySettings { gouge_limit: self.budget, ..VerifySettings::default() };
        verify(&program, &setup, &settings, &facemill::cl_data::Silent).unwrap()
    }

    fn tool_file(&self) -> Value {
        self.job.json("tool.json")
    }

    fn tool(&self, at: &Axes) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let (tip, axis) = tool_on_table(at, self.pivot_length);
        (tip - Vector3::z() * self.mount, axis)
    }

    /// Depth of the cutter over a motion, and the fraction of it where it is deepest.
    fn depth(&self, m: &Motion) -> (f64, f64) {
        let n = 40;
        let at = |k: u32| {
            let t = f64::from(k) / f64::from(n);
            let (tip, axis) = self.tool(&m.from.lerp(&m.to, t));
            (self.bins.depth(&self.cutter, &tip, &axis), t)
        };
        (0..=n).map(at).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
    }

    /// Motions, the index of the one that ends at a cut far from others, and the one after it.
    fn cut_in_the_middle(&self) -> (Vec<Motion>, usize) {
        let motions = interpreter::run(&self.text);
        let middle = |m: &Motion| {
            let (tip, _) = self.tool(&m.to);
            !m.rapid && tip.coords.xy().norm() < 30.0
        };
        let k = motions.iter().position(middle).expect("a cut near the middle");
        (motions, k)
    }

    /// The program with the end of motion `k` lowered, and the largest depth over the two motions
    /// it changes with the fraction along the first where that is.
    fn lowered(&self, motions: &[Motion], k: usize, by: f64) -> (String, f64) {
        let (here, next) = (&motions[k], &motions[k + 1]);
        let mut text = with_word(&self.text, here.line, 'Z', here.to.z - by);
        text = with_word(&text, next.line, 'Z', next.to.z);
        let changed = interpreter::run(&text);
        (text, self.depth(&changed[k]).0.max(self.depth(&changed[k + 1]).0))
    }
}

fn gouges(v: &Verification) -> Vec<&Finding> {
    v.findings.iter().filter(|f| f.kind == FindingKind::Gouge).collect()
}

#[test]
fn a_block_lowered_beyond_the_budget_is_found_and_one_lowered_less_is_not() {
    let cell = Cell::new();
    let tool = cell.tool_file();
    assert!(cell.run(&cell.text, &tool).faults().next().is_none(), "the program is clean before");
    let (motions, k) = cell.cut_in_the_middle();
    for (share, found) in [(1.1, true), (0.9, false)] {
        // How far to lower the block so that the cutter is that deep, by brute force.
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..30 {
            let by = 0.5 * (low + high);
            if cell.lowered(&motions, k, by).1 < share * cell.budget { low = by } else { high = by }
        }
        let (text, depth) = cell.lowered(&motions, k, low);
        assert!((depth / cell.budget - share).abs() < 0.02, "{depth} {}", cell.budget);
        let v = cell.run(&text, &tool);
        let deepest = v.largest_gouge.as_ref().expect("some depth").depth_mm;
        assert!((deepest - depth).abs() < 0.01 * cell.budget, "{deepest} by the machine, {depth} by brute force");
        let gouges = gouges(&v);
        if !found {
            assert!(v.faults().next().is_none(), "{:?}", v.findings);
            continue;
        }
        let lines: Vec<u32> = [k, k + 1].map(|k| motions[k].line as u32).to_vec();
        assert_eq!(gouges.len(), 1, "{gouges:?}");
        let gouge = gouges[0];
        assert!(gouge.first_line >= lines[0] && gouge.last_line <= lines[1], "{gouge} and not {lines:?}");
        assert!(lines.contains(&gouge.worst_line), "{gouge} and not {lines:?}");
        assert_eq!(gouge.block_text, text.lines().nth(gouge.worst_line as usize - 1).unwrap());
        assert!(matches!(gouge.measure, Some(Measure::DepthMm(d)) if (d - depth).abs() < 0.01 * cell.budget));
        assert_eq!((gouge.obstacle.as_deref(), v.faults().count()), (Some("part"), 1), "{:?}", v.findings);
    }
}

#[test]
fn a_holder_grown_into_its_clearance_is_found_and_one_that_just_keeps_it_is_not() {
    let cell = Cell::new();
    let motions = interpreter::run(&cell.text);
    let tool = cell.tool_file();
    let flute = number(&tool["flute_length_mm"]);
    let low = flute + number(&tool["body"]["sections"][0]["length_mm"]);
    let section = &tool["holder"]["sections"][0];
    let length = number(&section["length_mm"]);
    let grown = |radius: f64| Frustum { low, high: low + length, radius_low: radius, radius_high: radius };
    // Its nearest position over the program, at block ends.
    let nearest = |radius: f64, stride: usize| -> (f64, usize) {
        let mut nearest = (4.0, 0);
        for m in motions.iter().step_by(stride) {
            let (tip, axis) = cell.tool(&m.to);
            let d = cell.bins.distance(&grown(radius), &tip, &axis, nearest.0);
            if d < nearest.0 {
                nearest = (d, m.line);
            }
        }
        nearest
    };
    let limit = number(&tool["holder"]["clearance_mm"]) - VerifySettings::default().clearance_slack;
    for (wanted, found) in [(limit - 0.05, true), (limit + 0.05, false)] {
        let (mut small, mut large) = (15.0, 60.0);
        for _ in 0..11 {
            let radius = 0.5 * (small + large);
            if nearest(radius, 3).0 > wanted { small = radius } else { large = radius }
        }
        let (distance, line) = nearest(small, 1);
        assert!((distance - wanted).abs() < 0.04, "{distance} {wanted}");
        let mut file = tool.clone();
        file["holder"]["sections"][0]["diameter_low_mm"] = json!(2.0 * small);
        file["holder"]["sections"][0]["diameter_high_mm"] = json!(2.0 * small);
        let v = cell.run(&cell.text, &file);
        if found {
            let hits: Vec<&Finding> = v.faults().collect();
            assert!(!hits.is_empty(), "nothing found at {distance}");
            assert!(hits.iter().all(|f| f.kind == FindingKind::HolderCollision), "{hits:?}");
            assert!(hits.iter().all(|f| f.body.as_deref() == Some("holder section 1")), "{hits:?}");
            let reported = hits.iter().filter_map(|f| f.measure).map(|m| m.value()).fold(f64::INFINITY, f64::min);
            // Between block ends it may be a little nearer.
            assert!(reported <= distance + 1e-6 && reported > distance - 0.04, "{reported} {distance}");
            assert!(hits.iter().any(|f| (f.first_line..=f.last_line).contains(&(line as u32))), "{hits:?} not {line}");
        } else {
            assert!(v.faults().next().is_none(), "{:?}", v.findings);
        }
    }
}

#[test]
fn a_link_lowered_into_the_part_is_found_and_one_just_above_it_is_not() {
    let cell = Cell::new();
    let tool = cell.tool_file();
    let motions = interpreter::run(&cell.text);
    let top = cell.mesh.aabb().max.z;
    // A rapid from one place above the part to another, with further rapids on both sides.
    let k = (1..motions.len() - 1)
        .filter(|&k| motions[k - 1..=k + 1].iter().all(|m| m.rapid))
        .max_by(|&i, &j| {
            let way = |k: usize| (cell.tool(&motions[k].to).0 - cell.tool(&motions[k].from).0).norm();
            way(i).total_cmp(&way(j))
        })
        .expect("a link");
    let planted = |height: f64| -> (String, f64) {
        // Start and end of the link lowered so that the lower of its tips is at this height.
        let lowest = cell.tool(&motions[k].to).0.z.min(cell.tool(&motions[k].from).0.z);
        let by = lowest - height;
        let mut text = with_word(&cell.text, motions[k - 1].line, 'Z', motions[k - 1].to.z - by);
        text = with_word(&text, motions[k].line, 'Z', motions[k].to.z - by);
        text = with_word(&text, motions[k + 1].line, 'Z', motions[k + 1].to.z);
        let changed = interpreter::run(&text);
        (text, (k - 1..=k + 1).map(|k| cell.depth(&changed[k]).0).fold(0.0, f64::max))
    };
    let lines = [motions[k - 1].line as u32, motions[k + 1].line as u32];
    let (text, depth) = planted(top - 6.0);
    assert!(depth > 0.5, "the link misses the part: {depth}");
    let v = cell.run(&text, &tool);
    let hits: Vec<&Finding> = v.faults().filter(|f| f.kind == FindingKind::RapidCollision).collect();
    assert!(!hits.is_empty(), "{:?}", v.findings);
    assert!(v.faults().all(|f| f.first_line >= lines[0] && f.last_line <= lines[1]), "{:?} not {lines:?}", v.findings);
    // A tilted cutter's rim is deeper than its tip by R times the sine of the tilt.
    let (text, depth) = planted(top + cell.cutter.radius + 1.0);
    assert_eq!(depth, 0.0);
    assert!(cell.run(&text, &tool).faults().next().is_none());
}
