//! Every mesh of the shared data gets a sound plan with at least 95 % of its CC points; passes are
//! too far apart to finish it.

use facemill::report::outcome::Outcome;
use facemill_tests::shared::shared;
use facemill_tests::tables::meshes::{CASES, SAME, markdown, outcomes};

/// A blade by planes and a propeller by cylinders; all meshes are for the sweep.
#[test]
fn a_blade_and_a_propeller_of_the_shared_meshes_are_planned() {
    are_planned(&["bladex_blade_upper.stl", "r2b2_propeller.stl"]);
}

#[test]
#[ignore = "plans all shared meshes: three minutes"]
fn every_shared_mesh_is_planned() {
    are_planned(&CASES.map(|c| c.file));
}

#[test]
fn every_shared_mesh_has_a_case() {
    let Some(folder) = shared("data/meshes") else {
        println!("SKIPPED: the shared meshes are not there");
        return;
    };
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().to_string_lossy().into_owned();
        let known = CASES.iter().any(|c| c.file == name) || SAME.iter().any(|s| s.0 == name);
        assert!(known, "{name} has no case");
    }
}

fn are_planned(files: &[&str]) {
    let outcomes = outcomes(files, 5.0);
    if outcomes.is_empty() {
        println!("SKIPPED: the shared meshes are not there, nothing is planned");
    }
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
                assert!(totals.cc_points >= 500, "{}: only {} CC points", o.file, totals.cc_points);
                assert!(planned.report.verified);
                let budget = planned.report.budgets[0].against_mesh_mm;
                let deep = planned.report.worst.gouge_mm.unwrap_or(0.0);
                if deep > budget || planned.outcome() == Outcome::Faulty {
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

#[test]
fn files_of_the_same_mesh_read_alike() {
    for (name, other) in SAME {
        let [Some(a), Some(b)] = [name, other].map(|f| shared(&format!("data/meshes/{f}"))) else {
            println!("SKIPPED: {name} is not there");
            continue;
        };
        // STL has 32-bit numbers: a blade of 300 mm to a few hundredths of a micrometre.
        let [a, b] = [a, b].map(|file| facemill::read_mesh(&file, None, None).unwrap().mesh);
        assert_eq!(a.triangles().len(), b.triangles().len());
        for k in 0..a.triangles().len() {
            let (p, q) = (a.corners(k), b.corners(k));
            assert!((0..3).any(|turn| (0..3).all(|i| (p[i] - q[(i + turn) % 3]).norm() < 1e-4)), "triangle {k}");
        }
    }
}
