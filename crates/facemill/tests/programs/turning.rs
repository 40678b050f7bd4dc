//! Small jobs whose rotary axes have to turn back, or come near to the pole, read back from the
//! program's text.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use facemill::new_job::{NewJob, new_job};
use facemill::surface_model::{NamedNode, TriMesh, write_obj};
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_setup};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};

/// Plans the example patch, its surface replaced by one of heights `z(x)` over ±40 mm, with values
/// of job and machine set.
fn planned(z: fn(f64) -> f64, job: &[(&str, Value)], machine: &[(&str, Value)], path: Option<Value>) -> Planned {
    let folder = tempfile::tempdir().unwrap();
    let mut files: BTreeMap<String, Vec<u8>> = new_job(&NewJob::Patch { size_mm: 80.0 }).unwrap().into_iter().collect();
    let mesh = sheet(z);
    let node = NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() };
    files.insert("patch.obj".to_owned(), write_obj(&[&mesh], &[node]).unwrap());
    // Entries may descend steeply: this test does not concern them.
    let tool = [("/max_ramp_angle_deg", json!(60.0)), ("/dead_core_radius_mm", json!(0.0))];
    for (name, values) in [("job.json", job), ("machine.json", machine), ("tool.json", &tool)] {
        let mut file: Value = serde_json::from_slice(&files[name]).unwrap();
        for (pointer, value) in values {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            file.pointer_mut(parent).unwrap()[key] = value.clone();
        }
        files.insert(name.to_owned(), serde_json::to_vec(&file).unwrap());
    }
    files.extend(path.map(|path| ("path.json".to_owned(), serde_json::to_vec(&path).unwrap())));
    for (name, bytes) in &files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let job = Job::read(&folder.path().join("job.json")).unwrap();
    let settings = PlanSettings { verify: true, certificates: false };
    plan_setup(&job, 0, settings, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

fn sheet(z: fn(f64) -> f64) -> TriMesh {
    let at = |k: u32| -40.0 + 80.0 * f64::from(k) / 40.0;
    let (vertices, triangles) = facemill_test_kit::grid_by_rows([40, 40], |i, j| Point3::new(at(i), at(j), z(at(i))));
    TriMesh::new(vertices, triangles).unwrap()
}

/// A line of the program with a motion: its number from 1, whether it is rapid, and the words of
/// the rotary axes behind it, deg.
struct MotionLine {
    number: usize,
    rapid: bool,
    feed: f64,
    b: f64,
    c: f64,
}

/// Reads G0, G1, B, C and F, which stay until they are given again.
fn lines(planned: &Planned) -> Vec<MotionLine> {
    let file = planned.files.iter().find(|(name, _)| name == "program.nc").expect("a program without faults");
    let text = String::from_utf8(file.1.clone()).unwrap();
    let (mut rapid, mut b, mut c, mut feed) = (true, 0.0, 0.0, 0.0);
    let mut all = Vec::new();
    for (k, line) in text.lines().enumerate() {
        // Comments, and moves in machine coordinates.
        let line = line.split('(').next().unwrap();
        if line.contains("G53") || line.contains("G28") {
            continue;
        }
        let mut moves = false;
        for word in line.split_whitespace() {
            let (letter, value) = word.split_at(1);
            let Ok(value) = value.parse::<f64>() else { continue };
            match letter {
                "G" if value == 0.0 => rapid = true,
                "G" if value == 1.0 => rapid = false,
                "B" => (b, moves) = (value, true),
                "C" => (c, moves) = (value, true),
                "X" | "Y" | "Z" => moves = true,
                "F" => feed = value,
                _ => {}
            }
        }
        if moves {
            all.push(MotionLine { number: k + 1, rapid, feed, b, c });
        }
    }
    all
}

fn is_clean(planned: &Planned) {
    let findings: Vec<String> = planned.report.findings.iter().map(ToString::to_string).collect();
    let left = &planned.report.remaining;
    assert!(planned.is_clean(), "{findings:?} {left:?}");
    assert_eq!(planned.report.totals.planned_points, planned.report.totals.cc_points);
}

/// Rings of these radii about the z axis, with the surface's side that is uncut outside.
fn rings(radii: &[f64]) -> Value {
    let ring = |r: &f64| -> Vec<[f64; 3]> {
        (0..=40).map(|k| TAU * f64::from(k) / 40.0 + 0.3).map(|a| [r * a.cos(), r * a.sin(), 0.0]).collect()
    };
    let passes: Vec<Value> = radii.iter().map(|r| json!({ "points_mm": ring(r) })).collect();
    json!({ "format": "facemill-path/1", "frame": "work", "passes": passes })
}

/// Rings on a plane with stops of the table's axis.
fn turned_back(limits: Option<[f64; 2]>) -> Turned {
    let range = limits.map(|[min, max]| json!({ "limited": { "min_deg": min, "max_deg": max } }));
    let machine = range.map(|range| ("/workpiece_chain/rows/0/joint/revolute/range", range));
    rings_on(machine.as_slice(), limits)
}

/// Counts of the report, and the path of C in each pass or part of one.
struct Turned {
    count: usize,
    inserted: usize,
    ways: Vec<[f64; 2]>,
}

impl Turned {
    /// Returns the fewest reversals on links with which whole passes are cut in any windings within
    /// limits.
    fn fewest(&self, [min, max]: [f64; 2]) -> usize {
        let mut ends: Vec<(f64, usize)> = Vec::new();
        for (k, [from, to]) in self.ways.iter().enumerate() {
            let wound = (-4..=4).map(|n| [from + 360.0 * f64::from(n), to + 360.0 * f64::from(n)]);
            let held = wound.filter(|way| way.iter().all(|c| (min..=max).contains(c)));
            let after = |[from, to]: [f64; 2]| {
                let turns = |(end, n): &(f64, usize)| n + usize::from((from - end).abs() > 180.0);
                (to, if k == 0 { 0 } else { ends.iter().map(turns).min().unwrap() })
            };
            ends = held.map(after).collect();
        }
        ends.iter().map(|(_, n)| *n).min().unwrap()
    }
}

/// Rings on a plane with values of the machine file set, C within these limits.
fn rings_on(machine: &[(&str, Value)], limits: Option<[f64; 2]>) -> Turned {
    let path = json!({ "file": { "file": "path.json", "max_distance_mm": 0.1, "uncut_side": "right" } });
    let job = [
        ("/operations/0/path", path),
        ("/operations/0/search/mode", json!("smallest")),
        ("/operations/0/search/tilt_deg", json!([8.0, 12.0])),
        ("/operations/0/search/rotate_deg", json!([0.0, 10.0])),
        ("/operations/0/tolerances/cusp_mm", json!(2.0)),
        // Rings alone do not finish the plane.
        ("/operations/0/finish", json!({ "max_above_fraction": 1.0, "max_never_cut_fraction": 1.0 })),
    ];
    let planned = planned(|_| 0.0, &job, machine, Some(rings(&[30.0, 27.0, 24.0])));
    is_clean(&planned);
    let lines = lines(&planned);
    let mut turned = Vec::new();
    for pair in lines.windows(2) {
        if let Some([min, max]) = limits {
            assert!((min..=max).contains(&pair[1].c), "C{} on line {}", pair[1].c, pair[1].number);
        }
        if (pair[1].c - pair[0].c).abs() > 180.001 {
            assert!(pair[1].rapid, "the axis turns back in line {}", pair[1].number);
            turned.push((pair[1].number as u32, pair[0].c, pair[1].c));
        }
    }
    let report = &planned.report.rewinds;
    assert_eq!((report.count, report.branch_changes), (turned.len(), 0));
    for (reported, (line, from, to)) in report.rewinds.iter().zip(&turned) {
        assert!(reported.line == *line && reported.axis == "C");
        assert!((reported.from_deg - from).abs() < 1e-3 && (reported.to_deg - to).abs() < 1e-3, "{reported:?}");
    }
    let cuts = lines.chunk_by(|a, b| a.rapid == b.rapid).filter(|run| !run[0].rapid);
    let ways = cuts.map(|run| [run[0].c, run[run.len() - 1].c]).collect();
    Turned { count: report.count, inserted: report.inserted, ways }
}

#[test]
fn rings_on_a_table_with_stops_are_cut_whole_and_the_table_turns_back_in_the_air() {
    let endless = turned_back(None);
    assert!(endless.count == 0 && endless.ways.iter().all(|[from, to]| ((to - from).abs() - 360.0).abs() < 20.0));
    // One revolution needs the whole range of ±180°: each ring is ended once, and goes on in a part
    // of its own.
    let tight = turned_back(Some([-180.0, 180.0]));
    assert!((tight.inserted, tight.ways.len()) == (3, 6) && tight.count >= 3, "{}", tight.count);
    for limits in [[-200.0, 560.0], [-540.0, 540.0], [-900.0, 900.0]] {
        let turned = turned_back(Some(limits));
        assert_eq!((turned.count, turned.inserted), (turned.fewest(limits), 0), "{limits:?}");
    }
}

#[test]
fn a_head_with_stops_turns_back_above_the_part() {
    let file = include_str!("../../../../assets/machines/head-head-c-a.json");
    let file: Value = serde_json::from_str(file).unwrap();
    // The whole file, key by key.
    let with = |min: f64, max: f64| {
        let mut file = file.clone();
        let rows = file.pointer_mut("/tool_chains/0/rows").unwrap().as_array_mut().unwrap();
        let c = rows.iter_mut().find(|row| row["joint"]["revolute"]["axis"] == "C").unwrap();
        c["joint"]["revolute"]["range"] = json!({ "limited": { "min_deg": min, "max_deg": max } });
        let keys = ["workpiece_chain", "tool_chains", "bed_bodies", "motion", "feed"];
        let values = keys.map(|key| (format!("/{key}"), file[key].clone()));
        let values: Vec<(&str, Value)> =
            values.iter().filter(|(_, v)| !v.is_null()).map(|(key, v)| (key.as_str(), v.clone())).collect();
        rings_on(&values, Some([min, max]))
    };
    let as_it_is = with(-370.0, 370.0);
    assert_eq!((as_it_is.count, as_it_is.inserted), (as_it_is.fewest([-370.0, 370.0]), 0));
    let tight = with(-180.0, 180.0);
    assert!((tight.inserted, tight.ways.len()) == (3, 6) && tight.count >= 3, "{}", tight.count);
}

/// Returns the smallest angle of the tool axis to the table's axis in cuts, deg: the value of B on
/// this machine.
fn nearest_to_pole(planned: &Planned) -> f64 {
    let cutting = planned.report.totals.passes_length_mm;
    assert!(cutting > 100.0);
    let lines = lines(planned);
    let cuts = lines.iter().filter(|l| !l.rapid && l.feed > 0.0);
    cuts.map(|l| l.b.abs()).fold(f64::INFINITY, f64::min)
}

/// The example's feed, and one at which no axis races beside the pole, mm/min.
const FEED: f64 = 1200.0;
const SLOW: f64 = 20.0;

fn near_pole(z: fn(f64) -> f64, mode: &str, tilt: [f64; 2], cone: f64, feed: f64) -> Planned {
    let planes = json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0], "from_mm": -1.0, "to_mm": 1.0 } });
    let job = [
        ("/operations/0/path/strategy/strategy", planes),
        ("/operations/0/search/mode", json!(mode)),
        ("/operations/0/search/tilt_deg", json!(tilt)),
        ("/operations/0/search/rotate_deg", json!([80.0, 85.0])),
        ("/operations/0/search/singular_cone_deg", json!(cone)),
        ("/operations/0/feeds/cutting_mm_min", json!(feed)),
        ("/operations/0/tolerances/max_step_mm", json!(2.0)),
    ];
    planned(z, &job, &[], None)
}

#[test]
fn postures_leave_the_cone_about_the_pole_where_there_is_tilt_to_leave_it_with() {
    let crowned: fn(f64) -> f64 = |x| -x * x / 800.0;
    for (z, mode) in [((|_| 0.0) as fn(f64) -> f64, "smallest"), (crowned, "smallest"), (crowned, "smooth")] {
        // So slow that no axis races: else the plan goes round the pole of itself.
        let through = near_pole(z, mode, [0.0, 10.0], 0.0, SLOW);
        let around = near_pole(z, mode, [0.0, 10.0], 1.5, FEED);
        is_clean(&around);
        assert!(nearest_to_pole(&around) >= 1.499, "{mode}: {}", nearest_to_pole(&around));
        // Next to the cone the table may still be too slow for the feed, which the report lists; in
        // it there is no block.
        let reported = &around.report.singular_blocks;
        assert!(reported.iter().all(|s| s.smallest_angle_deg > 1.5 && s.smallest_angle_deg < 5.0), "{reported:?}");
        if mode == "smallest" {
            assert!(nearest_to_pole(&through) < 1.0, "{}", nearest_to_pole(&through));
        }
    }
}

#[test]
fn where_the_tilt_does_not_lead_out_of_the_cone_poses_are_kept_and_their_blocks_named() {
    let planned = near_pole(|x| -x * x / 800.0, "smallest", [0.2, 0.2], 1.5, FEED);
    assert_eq!(planned.report.totals.planned_points, planned.report.totals.cc_points);
    let reported = &planned.report.singular_blocks;
    let lines = lines(&planned);
    // Blocks that are in the cone at an end, of those at the feed of cuts.
    let cuts: Vec<&[MotionLine]> = lines.windows(2).filter(|w| !w[0].rapid && !w[1].rapid).collect();
    let inside = |w: &&&[MotionLine]| w[0].b.abs().min(w[1].b.abs()) < 1.49;
    let named = |n: usize| reported.iter().find(|s| (s.first_line as usize..=s.last_line as usize).contains(&n));
    let approach = |w: &&&[MotionLine]| w[0].b == w[1].b && w[0].c == w[1].c;
    let mut n = 0;
    for w in cuts.iter().filter(inside).filter(|w| !approach(w)) {
        let run = named(w[1].number).unwrap_or_else(|| panic!("line {} is not named", w[1].number));
        assert!(run.smallest_angle_deg <= w[0].b.abs().min(w[1].b.abs()) + 1e-3);
        n += 1;
    }
    assert!(n > 3 && reported.iter().all(|s| s.smallest_angle_deg < 5.0), "{n} {reported:?}");
}
