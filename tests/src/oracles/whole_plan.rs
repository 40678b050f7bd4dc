//! The plan of a whole propeller read back: the points of its wetted surface, and the cutters of
//! its written programs on them. All data comes from the files of job and plan.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Rotation3, Vector3};
use serde_json::Value;

use crate::oracles::gltf_groups::groups_of;
use crate::oracles::interpreter::run;
use crate::oracles::read_back::{ReadBack, TipAndAxis, number, pose};
use crate::oracles::wetted::{Band, Wetted};

/// Distance of places along a motion, mm: between two of them a ball of 10 mm radius leaves less
/// than 0.002 mm.
const STEP: f64 = 0.4;

/// Points of the blades that a job of a whole propeller cuts and of the hub between all blades,
/// each for at most `patch` mm². With one blade of several, the hub counts with the part of one
/// blade.
///
/// # Panics
/// When a file cannot be read, or the job cuts neither one blade nor all.
pub fn points_of_job(job: &Path, band: Band, patch: f64) -> Wetted {
    let groups = groups_of(&job.join("propeller.glb"));
    let copies = Copies::of(&json(&job.join("job.json")));
    let hub = if copies.cut == copies.all { 1.0 } else { 1.0 / copies.all as f64 };
    let weight = |group: &str| match group.split_once('/') {
        Some(("hub", "cylinder")) => hub,
        Some((blade, _)) if blade.strip_prefix("blade-").is_some_and(|k| k.parse().is_ok_and(|k| copies.cuts(k))) => {
            1.0
        }
        _ => 0.0,
    };
    Wetted::of(&groups, weight, band, patch)
}

/// Cuts the points by all programs of a plan, and returns the number of places of cutters. Where
/// the programs cut one blade of several, they are run at the places of the others, too: the hub
/// between two blades is cut from both.
///
/// # Panics
/// When a file cannot be read, or a program is of another kind than the planner writes for the
/// head-B, table-C mill.
pub fn cut_by_plan(wetted: &mut Wetted, job: &Path, plan: &Path) -> usize {
    let file = json(&job.join("job.json"));
    let copies = Copies::of(&file);
    let turns: Vec<Rotation3<f64>> = match copies.cut == copies.all {
        true => vec![Rotation3::identity()],
        false => {
            (0..copies.all).map(|k| Rotation3::from_axis_angle(&Vector3::z_axis(), k as f64 * copies.step)).collect()
        }
    };
    let mut n_places = 0;
    for report in reports(plan) {
        let report = json(&report);
        let program = report["programs"][0]["file"].as_str().expect("a program");
        let text = std::fs::read_to_string(plan.join(program)).unwrap_or_else(|e| panic!("{program}: {e}"));
        let (setup, back) = setup_and_tool(&file, job, report["setup"].as_str().expect("a setup"), &text);
        let part_from_work = pose(&setup["work_from_part"]).inverse();
        let mut places: Vec<TipAndAxis> = Vec::new();
        for motion in run(&text).iter().filter(|motion| !motion.rapid) {
            places.extend(back.places(motion, STEP).into_iter().map(|place| moved(&part_from_work, place)));
        }
        for turn in &turns {
            let turned: Vec<TipAndAxis> = places.iter().map(|(tip, axis)| (turn * tip, turn * axis)).collect();
            wetted.cut(&back.cutter, &turned);
        }
        n_places += places.len();
    }
    n_places
}

fn moved(by: &Isometry3<f64>, (tip, axis): TipAndAxis) -> TipAndAxis {
    (by * tip, by * axis)
}

/// Blades that a job cuts.
struct Copies {
    cut: usize,
    all: usize,
    /// Angle between two of them, rad.
    step: f64,
}

impl Copies {
    fn of(job: &Value) -> Self {
        let operations = job["operations"].as_array().expect("operations");
        let pattern = &operations[0]["pattern"];
        assert!(operations.iter().all(|operation| operation["pattern"] == *pattern), "operations with one pattern");
        let degrees = number(&pattern["index_angle_deg"]);
        let (cut, all) = (number(&pattern["copies"]) as usize, (360.0 / degrees).round() as usize);
        assert!(cut == 1 || cut == all, "{cut} of {all} blades");
        Self { cut, all, step: degrees.to_radians() }
    }

    /// Whether it cuts the blade of this number, from 1.
    fn cuts(&self, blade: usize) -> bool {
        (1..=self.cut).contains(&blade)
    }
}

/// The setup that a program belongs to, and its tool on the machine.
fn setup_and_tool<'a>(job: &'a Value, folder: &Path, name: &str, text: &str) -> (&'a Value, ReadBack) {
    let setups = job["setups"].as_array().expect("setups");
    let is_of = |setup: &&Value| setup["name"].as_str().is_some_and(|start| name.starts_with(start));
    let setup = setups.iter().find(is_of).unwrap_or_else(|| panic!("{name}: no such setup"));
    let change = text.lines().find(|line| line.ends_with(" M6")).expect("a tool change");
    let called = change.split(' ').find_map(|word| word.strip_prefix('T')).expect("a T word");
    let called: u64 = called.parse().unwrap_or_else(|e| panic!("{change}: {e}"));
    let tools = job["tools"].as_object().expect("tools").values();
    let mut files = tools.map(|file| json(&folder.join(file.as_str().expect("a file"))));
    let tool = files.find(|tool| tool["number"] == called).unwrap_or_else(|| panic!("{change}: no such tool"));
    (setup, ReadBack::without_obstacles(setup, &tool))
}

/// Reports of all programs, by name.
fn reports(plan: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(plan).unwrap_or_else(|e| panic!("{}: {e}", plan.display()));
    let is_report = |name: &str| name.starts_with("report-") && name.ends_with(".json");
    let files = entries.map(|entry| entry.expect("an entry").path());
    let mut reports: Vec<PathBuf> =
        files.filter(|path| path.file_name().and_then(|name| name.to_str()).is_some_and(is_report)).collect();
    reports.sort();
    assert!(!reports.is_empty(), "{}: no reports", plan.display());
    reports
}

fn json(file: &Path) -> Value {
    let bytes = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    serde_json::from_slice(&bytes).unwrap_or_else(|e| panic!("{}: {e}", file.display()))
}
