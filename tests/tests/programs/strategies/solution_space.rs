//! `facemill solution-space`: the map of one CC point as file and picture.

use facemill::new_job::{NewJob, Series};
use facemill::solution_space_file::{CellFile, PostureFile, ReasonKind, SolutionSpaceFile, StateFile};
use facemill_tests::jobs::{JobFolder, write_coarse_propeller};
use facemill_tests::program::{code_and_errors, facemill, run};
use facemill_tests::shared::workspace;
use serde_json::{Value, json};

/// A small propeller near its hub, searched up to tilts at which head and blades come near each
/// other.
fn crowded() -> JobFolder {
    let job = JobFolder::new(&NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 400.0 });
    write_coarse_propeller(&job, 400.0);
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_mm", json!(6.0)),
            ("/operations/0/search/tilt_deg", json!([2.0, 40.0])),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm", json!(60.0)),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/to_radius_mm", json!(100.0)),
        ],
    );
    job
}

fn arguments<'a>(job: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["solution-space", job, "--out", out];
    all.extend(more);
    all
}

fn holds(cell: &CellFile, p: &PostureFile) -> bool {
    let within = |v: f64, [from, to]: [f64; 2]| from <= v && v <= to;
    within(p.tilt_deg, cell.tilt_deg) && within(p.rotate_deg, cell.rotate_deg)
}

#[test]
fn the_map_covers_its_range_says_why_and_is_the_same_on_any_number_of_threads() {
    let job = crowded();
    let (file, out) = (job.job(), job.path("out"));
    let (file, out) = (file.to_str().unwrap(), out.to_str().unwrap());
    let wanted = ["--operation", "suction side", "--pass", "2", "--point", "9", "--resolution-deg", "0.5"];
    let output = run(&arguments(file, out, &wanted));
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 0, "{errors}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("operation \"suction side\", pass 2, point 9: ") && said.contains("uncertain"), "{said}");
    let bytes = std::fs::read(job.path("out/solution-space.json")).unwrap();
    let map: SolutionSpaceFile = facemill::file_format::from_json(&bytes).unwrap();
    assert_eq!((map.pass, map.point, map.resolution_deg, map.tilt_deg), (2, 9, 0.5, [0.0, 40.0]));
    check_cells(&map);
    // A posture that the search finds is not proven blocked.
    let found = map.found.expect("a posture");
    let there = map.cells.iter().find(|c| holds(c, &found)).unwrap();
    assert!(there.state != StateFile::Blocked && there.reason.is_none(), "{there:?}");

    let svg = std::fs::read_to_string(job.path("out/solution-space.svg")).unwrap();
    assert!(svg.contains("suction side, pass 2, point 9") && svg.ends_with("</svg>\n"));
    assert!(svg.matches("<rect").count() > map.cells.len());
    let is_collision = |r: &facemill::solution_space_file::ReasonFile| matches!(r.kind, ReasonKind::Collision);
    let collides = map.cells.iter().filter_map(|c| c.reason.as_ref()).any(is_collision);
    assert_eq!(svg.contains("body collides"), collides);

    let one = job.path("one");
    let status = std::process::Command::new(facemill())
        .args(arguments(file, one.to_str().unwrap(), &["--operation", "1", "--pass", "2", "--point", "9"]))
        .args(["--resolution-deg", "0.5"])
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .unwrap();
    assert!(status.status.success());
    for name in ["solution-space.json", "solution-space.svg"] {
        let [first, second] = ["out", "one"].map(|folder| std::fs::read(job.path(folder).join(name)).unwrap());
        assert!(first == second, "{name} differs");
    }
}

/// Cells fill the range, areas are their sums, reasons stand where they must.
fn check_cells(map: &SolutionSpaceFile) {
    let width = |[from, to]: [f64; 2]| to - from;
    let whole = width(map.tilt_deg) * width(map.rotate_deg);
    let mut sums = [0.0; 3];
    for cell in &map.cells {
        let area = width(cell.tilt_deg) * width(cell.rotate_deg) / whole;
        sums[cell.state as usize] += area;
        match cell.state {
            StateFile::Free => assert_eq!(cell.reason, None),
            StateFile::Blocked => assert!(cell.reason.is_some()),
            StateFile::Uncertain => assert!(width(cell.tilt_deg).max(width(cell.rotate_deg)) < 0.5 + 1e-9),
        }
        if let Some(why) = &cell.reason {
            let meets = matches!(why.kind, ReasonKind::Gouge | ReasonKind::Collision);
            assert!(why.body.is_some() == meets && why.obstacle.is_some() == meets && !why.text.is_empty(), "{why:?}");
            assert!(why.obstacle.as_ref().is_none_or(|o| why.text.contains(o.as_str())), "{why:?}");
        }
    }
    assert!((sums.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    for (sum, said) in sums.iter().zip([map.area.free, map.area.blocked, map.area.uncertain]) {
        assert!((sum - said).abs() < 1e-9);
    }
    assert!(map.area.free > 0.5 && map.area.blocked > 0.001 && map.area.uncertain < 0.1, "{:?}", map.area);
}

#[test]
fn the_file_obeys_the_schema_that_is_checked_in_and_unknown_keys_are_refused() {
    let output = run(&["schema", "solution-space"]);
    assert_eq!(code_and_errors(&output).0, 0);
    let kept = std::fs::read(workspace().join("docs/schemas/solution-space.json")).unwrap_or_default();
    assert!(
        output.stdout == kept,
        "docs/schemas/solution-space.json is not what `facemill schema solution-space` prints; regenerate it: \
         cargo run --release -- schema solution-space > docs/schemas/solution-space.json"
    );
    let job = crowded();
    let out = job.path("out");
    let wanted = ["--operation", "1", "--pass", "1", "--point", "3", "--resolution-deg", "4"];
    assert_eq!(code_and_errors(&run(&arguments(job.job().to_str().unwrap(), out.to_str().unwrap(), &wanted))).0, 0);
    let mut file: Value = serde_json::from_slice(&std::fs::read(out.join("solution-space.json")).unwrap()).unwrap();
    let schema: Value = serde_json::from_slice(&kept).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    assert!(validator.is_valid(&file));
    file["cells"][0]["colour"] = json!("red");
    assert!(!validator.is_valid(&file));
    let text = serde_json::to_vec(&file).unwrap();
    let refused = facemill::file_format::from_json::<SolutionSpaceFile>(&text).unwrap_err().to_string();
    assert!(refused.contains("colour"), "{refused}");
}

#[test]
fn missing_items_are_reported_with_the_existing_ones() {
    let job = crowded();
    // Few passes, for they are laid each time.
    let sections = "/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm";
    job.set("job.json", &[(sections, json!(90.0))]);
    let (file, out) = (job.job(), job.path("out"));
    let cases: [(&[&str], &[&str]); 6] = [
        (&["--operation", "2", "--pass", "1", "--point", "1"], &["--operation 2", "1 \"suction side\""]),
        (&["--operation", "pressure", "--pass", "1", "--point", "1"], &["--operation pressure", "\"suction side\""]),
        (&["--operation", "1", "--pass", "0", "--point", "1"], &["--pass 0", "are 1 to "]),
        (&["--operation", "1", "--pass", "9999", "--point", "1"], &["--pass 9999", "are 1 to "]),
        (&["--operation", "1", "--pass", "2", "--point", "99999"], &["--point 99999", "of pass 2 are 1 to "]),
        (&["--operation", "1", "--pass", "1", "--point", "1", "--resolution-deg", "nan"], &["0.05 to 10"]),
    ];
    for (wanted, expected) in cases {
        let output = run(&arguments(file.to_str().unwrap(), out.to_str().unwrap(), wanted));
        let (code, errors) = code_and_errors(&output);
        assert_eq!(code, 2, "{wanted:?}: {errors}");
        assert!(expected.iter().all(|e| errors.contains(e)), "{wanted:?}: {errors}");
        assert!(!out.exists(), "{wanted:?} wrote something");
    }
}

#[test]
fn a_certified_search_is_planned_and_its_width_is_checked() {
    let job = crowded();
    job.set(
        "job.json",
        &[
            ("/operations/0/infeasible/trim/max_trimmed_fraction", json!(1.0)),
            ("/operations/0/pattern", Value::Null),
            ("/operations/0/tolerances/max_step_mm", json!(15.0)),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm", json!(99.0)),
        ],
    );
    for (width, message) in [(json!(0.0), "must be from"), (json!(0.2), "to 0.1"), (json!("fine"), "certified_u_width")]
    {
        job.set("job.json", &[("/operations/0/search/certified_u_width", width)]);
        let (code, errors) = code_and_errors(&run(&["check", job.job().to_str().unwrap()]));
        assert_eq!(code, 2, "{errors}");
        assert!(errors.contains("certified_u_width") && errors.contains(message), "{errors}");
    }
    job.set("job.json", &[("/operations/0/search/certified_u_width", json!(0.01))]);
    let planned = job.plan();
    assert!(planned.report.totals.planned_points > 0 && planned.report.findings.iter().all(|f| !f.kind.is_fault()));
}
