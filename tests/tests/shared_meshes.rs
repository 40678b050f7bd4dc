//! Every mesh of the shared data gets a plan with at least 95 % of its CC points.

use facemill_tests::meshes::{CASES, markdown, outcomes};
use facemill_tests::shared::shared;

#[test]
fn every_shared_mesh_is_planned() {
    let Some(folder) = shared("data/meshes") else { return };
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        assert!(CASES.iter().any(|c| c.file == name), "{name} has no case");
    }
    let outcomes = outcomes();
    println!("{}", markdown(&outcomes));
    let mut short = Vec::new();
    for o in &outcomes {
        match &o.result {
            Err(why) => short.push(format!("{}: {why}", o.file)),
            Ok(planned) => {
                let totals = &planned.report.totals;
                if totals.planned_fraction < 0.95 {
                    short.push(format!("{}: {:?}", o.file, planned.report.infeasible));
                }
                assert!(totals.cc_points > 100, "{}: only {} CC points", o.file, totals.cc_points);
                assert!(planned.report.verified);
                let budget = planned.report.budgets[0].against_mesh_mm;
                let deep = planned.report.worst.gouge_mm.unwrap_or(0.0);
                if deep > budget || !planned.is_clean() {
                    let worst = &planned.report.worst;
                    short.push(format!(
                        "{}: {deep} mm of {budget}: {:?} {worst:?}",
                        o.file,
                        planned.report.findings.first()
                    ));
                }
            }
        }
    }
    assert!(short.is_empty(), "{}", short.join("\n"));
}
