//! A body of the machine in what a program has cut, from the job file on.

use std::fmt::Write as _;
use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::virtual_machine::{Finding, FindingKind};
use facemill::{
    CutRequest, Job, PlanSettings, Planned, SilentStages, StockRegion, Verified, VerifyRequest, plan_job,
    verify_program,
};
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

use super::{GAUGE, TABLE, plate};

/// Stock on the plate, mm.
const THICKNESS: f64 = 6.0;

/// The plate with stock of some thickness on it, and a disc on the spindle, its lower side so far
/// above the tip.
fn plate_under_a_disc(thickness: f64, radius: f64, above: f64) -> JobFolder {
    let job = plate();
    job.set("job.json", &[("/setups/0/stock/offset/allowance_mm", json!(thickness))]);
    let file = job.json("job.json");
    let machine = file["machine"].as_str().unwrap();
    let rows = job.json(machine)["tool_chains"][0]["rows"].as_array().unwrap().clone();
    let disc = json!({
        "name": "disc", "shape": { "cylinder": { "radius_mm": radius, "height_mm": 2 } },
        "position_mm": [0, 0, above - GAUGE], "rotation_xyz_deg": [0, 0, 0], "clearance_mm": 0
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

fn verified(job: &JobFolder, text: &str, cut: Option<CutRequest>) -> Verified {
    let request =
        VerifyRequest { gouge_limit: Some(0.05), cut, ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc) };
    let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    verify_program(&job, text.as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

/// Collisions of the disc.
fn of_disc(verified: &Verified) -> Vec<Finding> {
    let all = verified.file.verification.findings.iter();
    all.filter(|f| f.body.as_deref() == Some("disc") && f.kind == FindingKind::Collision).cloned().collect()
}

fn found(job: &JobFolder, text: &str, cut: Option<CutRequest>) -> Vec<Finding> {
    of_disc(&verified(job, text, cut))
}

#[test]
fn a_body_of_the_machine_may_go_where_the_program_has_cut() {
    let job = plate_under_a_disc(THICKNESS, 13.0, 3.5);
    let lines = |region| CutRequest { region, ..CutRequest::on_lines(0.5, 0.01) };
    // At height 3 the disc is above all stock, at 1 it is below its top; the cutter is narrower
    // than the disc.
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
    // The rest of another program is known by its lines alone.
    let whole = || lines(StockRegion::Whole);
    let rest = verified(&job, &text(&[wide]), Some(whole())).rest;
    let of_rest = verified(&job, &text(&[deep]), Some(CutRequest { rest, ..whole() }));
    assert_eq!(of_disc(&of_rest).len(), 1);
    let says = |of: &Verified, what: &str| of.file.assumptions.iter().any(|a| a.text.contains(what));
    assert!(says(&of_rest, "tested against the initial stock"), "{:?}", of_rest.file.assumptions);
    // Half of the plate has no lines.
    let half = StockRegion::Rectangle([[-30.0, -30.0], [0.0, 30.0]]);
    assert_eq!(found(&job, &behind, Some(lines(half))).len(), 1);
}

/// A template that goes once more, in rapid, down beside the plate: the disc, 30 mm above the tip,
/// is then over the plate's edge at this height, in stock that was there at first.
fn plan_with_disc_at(height: f64, changes: &[(&str, Value)]) -> Planned {
    let job = plate_under_a_disc(2.0, 22.0, 30.0);
    let words = |x: f64, z: f64| format!("G0 X{x:.3} Y0. Z{:.3} B0. C0.", z + TABLE);
    let [high, down] = [words(-28.0, 100.0), words(-28.0, height - 30.0)];
    let more = format!("{{{{ body }}}}\n{}\n{high}\n{down}\n{high}\n", words(-60.0, 100.0));
    let template = Dialect::Fanuc.template().text.replacen("{{ body }}\n", &more, 1);
    assert!(template.contains(&more), "{template}");
    job.write("shop.j2", template.as_bytes());
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_mm", json!(5.0)),
            ("/operations/0/tolerances/max_step_over_mm", json!(4.0)),
            ("/operations/0/search/tilt_deg", json!([5.0, 10.0])),
            ("/operations/0/search/rotate_deg", json!([0.0, 20.0])),
            ("/post/template", json!("shop.j2")),
            ("/verification", json!({ "stock_tolerance_mm": 0.01 })),
        ],
    );
    job.set("job.json", changes);
    let read = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    let settings = PlanSettings { verify: true, certificates: false };
    plan_job(&read, settings, Some(0.5), &SilentStages).unwrap_or_else(|e| panic!("{e}")).remove(0)
}

#[test]
fn a_plan_does_not_report_bodies_in_stock_that_it_has_cut() {
    let no_cut = ("/verification/cut_stock", json!(false));
    let as_cut = ("/setups/0/links", json!({ "stock": "as_cut" }));
    for (height, changes, is_met) in [
        (1.0, vec![no_cut], true),
        (1.0, Vec::new(), false),
        (1.0, vec![as_cut.clone()], false),
        // Nearer than is proven.
        (0.3, Vec::new(), true),
        (0.3, vec![as_cut], true),
    ] {
        let planned = plan_with_disc_at(height, &changes);
        let found = &planned.report.findings;
        let of_disc = |f: &Finding| f.body.as_deref() == Some("disc") && f.kind == FindingKind::Collision;
        assert!(found.len() == usize::from(is_met) && found.iter().all(of_disc), "{height} {changes:?}: {found:#?}");
        assert_eq!(planned.is_clean(), !is_met);
    }
}
