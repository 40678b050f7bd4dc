//! Reports of plans, too, list the behaviour that a written program leaves to the control.

use facemill::inverse_kinematics::Machine;
use facemill::nc_program::{Dialect, read_program};
use facemill::new_job::{NewJob, new_job};
use facemill::summary;
use facemill::virtual_machine::assumptions;
use serde_json::{Value, json};

use super::{plan, with};

#[test]
fn what_a_template_leaves_to_the_control_is_in_report_and_summary() {
    let template = Dialect::Siemens840d.template().text;
    let own = template.replace("FGROUP(X,Y,Z)\n", "").replace("\n{{ work_offset }}\nS{{", "\nS{{");
    assert_eq!(template.lines().count(), own.lines().count() + 2);
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = |template: Value| {
        let post = json!({ "dialect": "siemens_840d", "feed_mode": "rtcp", "template": template });
        let small = [
            ("/operations/0/tolerances/max_step_mm", json!(3.0)),
            ("/operations/0/search/tilt_deg", json!([14.0, 20.0])),
            (&format!("{planes}/from_mm"), json!(-1.0)),
            (&format!("{planes}/to_mm"), json!(1.0)),
            ("/post", post),
        ];
        let tolerance = json!({ "path_mm": 0.01, "orientation_deg": 0.005 });
        let motion = json!({ "cutting": "tip_and_rotaries_linear", "rapid": "linear", "control_tolerance": tolerance });
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in new_job(&NewJob::Patch { size_mm: 60.0 }).unwrap() {
            let bytes = match name.as_str() {
                "job.json" => with(&bytes, &small),
                "machine.json" => with(&bytes, &[("/motion", motion.clone())]),
                _ => bytes,
            };
            std::fs::write(folder.path().join(name), bytes).unwrap();
        }
        std::fs::write(folder.path().join("shop.j2"), &own).unwrap();
        let machine = std::fs::read(folder.path().join("machine.json")).unwrap();
        (plan(&folder.path().join("job.json")), machine)
    };
    let (built_in, _) = job(Value::Null);
    // The patch is no solid: the stock on it is on both sides; and nobody has timed the control.
    // Nothing else is left unsaid but what a tool change moves.
    let [change, control, layer] = &built_in.report.assumptions[..] else {
        panic!("{:?}", built_in.report.assumptions)
    };
    assert!(change.text.starts_with("M6 is taken to leave all axes"), "{change}");
    assert!(layer.text.contains("not closed") && layer.text.contains("both sides"), "{layer}");
    assert!(control.text.contains("looking 1000 blocks ahead") && control.text.contains("not checked"), "{control}");
    assert!(summary(&built_in.report).contains("  assumptions       3"));
    let (planned, machine) = job(json!("shop.j2"));
    let file = |ending: &str| {
        let (_, bytes) = planned.files.iter().find(|(name, _)| name.ends_with(ending)).unwrap();
        String::from_utf8(bytes.clone()).unwrap()
    };
    let reported = &planned.report.assumptions;
    let (last, of_text) = reported.split_last().unwrap();
    assert_eq!(last, layer);
    let (last, of_text) = of_text.split_last().unwrap();
    assert_eq!(last, control);
    // As every reader of the text finds them.
    let program = read_program(file(".mpf"), Dialect::Siemens840d).unwrap();
    let machine = Machine::from_json(&machine).unwrap();
    assert_eq!(of_text, assumptions(&program, &machine));
    let has = |start: &str| reported.iter().any(|a| a.text.starts_with(start) && a.line.is_some());
    assert!(
        has("no work offset is selected: G54") && has("no FGROUP: F is taken as the speed of the tip"),
        "{reported:?}"
    );
    assert_eq!(of_text.len(), 3, "{reported:?}");
    let report: Value = serde_json::from_str(&file("report.json")).unwrap();
    assert_eq!(report["assumptions"], serde_json::to_value(reported).unwrap());
    let summary = summary(&planned.report);
    assert!(of_text.iter().all(|a| summary.contains(&a.to_string())), "{summary}");
}
