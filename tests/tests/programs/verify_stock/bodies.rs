//! A body of the machine in what a program has cut, from the job file on.

use std::fmt::Write as _;
use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::virtual_machine::{Finding, FindingKind};
use facemill::{CutRequest, Job, SilentStages, StockRegion, VerifyRequest, verify_program};
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

use super::{GAUGE, TABLE, plate};

/// Stock on the plate, mm.
const THICKNESS: f64 = 6.0;

/// The plate with a disc on the spindle: of radius 13 about the cutter of radius 10, 3.5 mm above the tip.
fn plate_under_a_disc() -> JobFolder {
    let job = plate();
    job.set("job.json", &[("/setups/0/stock/offset/allowance_mm", json!(THICKNESS))]);
    let file = job.json("job.json");
    let machine = file["machine"].as_str().unwrap();
    let rows = job.json(machine)["tool_chains"][0]["rows"].as_array().unwrap().clone();
    let disc = json!({
        "name": "disc", "shape": { "cylinder": { "radius_mm": 13, "height_mm": 2 } },
        "position_mm": [0, 0, 3.5 - GAUGE], "rotation_xyz_deg": [0, 0, 0], "clearance_mm": 0
    });
    let mut rows: Vec<Value> = rows;
    rows.last_mut().unwrap()["bodies"].as_array_mut().unwrap().push(disc);
    job.set(machine, &[("/tool_chains/0/rows", json!(rows))]);
    job
}

/// Passes at these heights, one after the other, each over all of the plate or in its middle alone.
fn text(passes: &[(f64, bool)]) -> String {
    let words = |x: f64, y: f64, z: f64| format!("X{x:.3} Y{y:.3} Z{:.3} B0. C0.", z + TABLE);
    let mut text = format!("G21 G90 G94\nT1 M6\nS1000 M3\nG0 G43 {} H1\n", words(-60.0, 0.0, 60.0));
    for &(z, is_wide) in passes {
        let sides = if is_wide { -2..=2 } else { 0..=0 };
        for y in sides.map(|k| 12.0 * f64::from(k)) {
            let [from, to] = [words(-60.0, y, z), words(60.0, y, z)];
            let _ =
                writeln!(text, "G0 {}\nG0 {from}\nG1 {to} F2000.\nG0 {}", words(-60.0, y, 60.0), words(60.0, y, 60.0));
        }
    }
    text + "M30\n"
}

/// What is found of the disc.
fn found(job: &JobFolder, text: &str, cut: Option<CutRequest>) -> Vec<Finding> {
    let request = VerifyRequest {
        program: Path::new("program.nc"),
        dialect: Dialect::Fanuc,
        setup: 0,
        gouge_limit: Some(0.05),
        certificates: false,
        cut,
    };
    let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    let verified = verify_program(&job, text.as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{e}"));
    let all = verified.file.verification.findings.into_iter();
    all.filter(|f| f.body.as_deref() == Some("disc") && f.kind == FindingKind::Collision).collect()
}

#[test]
fn a_body_of_the_machine_may_go_where_the_program_has_cut() {
    let job = plate_under_a_disc();
    let lines = |region| CutRequest { cell: 0.5, tolerance: 0.01, region, rest: None, deviation: None };
    // At height 3 the disc is above all stock, at 1 it is below its top; the cutter is narrower than the disc.
    let [wide, deep] = [(3.0, true), (1.0, false)];
    let behind = text(&[wide, deep]);
    assert_eq!(found(&job, &behind, None).len(), 1);
    assert_eq!(found(&job, &behind, Some(lines(StockRegion::Whole))), []);
    // Where it is cut no wider than the cutter, or not yet, the disc meets what is left.
    for early in [text(&[(3.0, false), deep]), text(&[deep, wide])] {
        let met = found(&job, &early, Some(lines(StockRegion::Whole)));
        assert_eq!(met.len(), 1, "{met:?}");
        assert_eq!(met[0].obstacle.as_deref(), Some("stock"));
    }
    // Half of the plate has no lines.
    let half = StockRegion::Rectangle([[-30.0, -30.0], [0.0, 30.0]]);
    assert_eq!(found(&job, &behind, Some(lines(half))).len(), 1);
}
