//! Values that ask for work without end, or that no tool and machine has: refused with file, key
//! and limit, before anything is planned.

use facemill::{Failure, Job, describe_setup};
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::blink_patch;
use serde_json::{Value, json};

fn checked(job: &JobFolder) -> Result<Vec<String>, Failure> {
    describe_setup(&Job::read(&job.job())?, 0)
}

fn refused(file: &str, values: &[(&str, Value)]) -> String {
    let job = blink_patch();
    job.set(file, values);
    match checked(&job) {
        Err(e) => e.to_string(),
        Ok(lines) => panic!("{values:?} is taken: {lines:?}"),
    }
}

#[test]
fn passes_points_and_pieces_without_end_are_refused_with_the_key_and_a_value_that_is_enough() {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let cases = [
        (json!({ "max_step_over_mm": 0.001 }), "tolerances.max_step_over_mm", "largest step-over of 0.0"),
        (json!({ "max_step_mm": 0.001, "max_step_over_mm": 0.03 }), "tolerances.max_step_mm", "largest step of "),
    ];
    for (tolerances, key, remedy) in cases {
        let bounds = [(format!("{planes}/from_mm"), Value::Null), (format!("{planes}/to_mm"), Value::Null)];
        let set = tolerances.as_object().into_iter().flatten();
        let set = set.map(|(key, value)| (format!("/operations/0/tolerances/{key}"), value.clone()));
        let values: Vec<(String, Value)> = bounds.into_iter().chain(set).collect();
        let values: Vec<(&str, Value)> = values.iter().map(|(pointer, v)| (pointer.as_str(), v.clone())).collect();
        let e = refused("job.json", &values);
        assert!(e.contains("job.json: operations[0].path.strategy: ") && e.contains(key) && e.contains(remedy), "{e}");
    }
    let rings =
        json!({ "cylindrical_sections": { "axis_direction": [0, 0, 1], "from_radius_mm": 1, "to_radius_mm": 40 } });
    let tolerance = "/operations/0/tolerances/path_chord_mm";
    let e = refused("job.json", &[("/operations/0/path/strategy/strategy", rings), (tolerance, json!(1e-6))]);
    assert!(e.contains("tolerances.path_chord_mm, which is 0.000001") && e.contains("pieces"), "{e}");
    let pattern = json!({ "copies": 1000, "index_angle_deg": 0.36, "axis": [0, 0, 1] });
    let e = refused(
        "job.json",
        &[("/operations/0/pattern", pattern), ("/operations/0/tolerances/max_step_mm", json!(0.01))],
    );
    assert!(e.contains("more than 2000;") && e.contains("each of the 1000 places"), "{e}");
}

#[test]
fn a_vertex_far_out_costs_no_more_than_the_passes_that_it_asks_for() {
    let job = blink_patch();
    let text = String::from_utf8(std::fs::read(job.path("patch.obj")).expect("a mesh")).expect("text");
    let at = text.find("\nv ").expect("a vertex") + 1;
    let end = at + text[at..].find('\n').expect("an end");
    job.write("patch.obj", format!("{}v -99999 -99999 -99999{}", &text[..at], &text[end..]).as_bytes());
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    job.set("job.json", &[(&format!("{planes}/from_mm"), Value::Null), (&format!("{planes}/to_mm"), Value::Null)]);
    // Passes on the spike, all but the first too long for their facets, or a refusal: nothing
    // hangs.
    match checked(&job) {
        Ok(lines) => assert!(lines.iter().any(|l| l.contains("-99999.0")), "{lines:?}"),
        Err(e) => assert!(e.to_string().contains("over 100"), "{e}"),
    }
}

#[test]
fn values_that_no_tool_machine_or_control_has_are_refused_with_file_key_and_limits() {
    let (c, x) = ("/workpiece_chain/rows/0/joint/revolute", "/tool_chains/0/rows/1/joint/prismatic");
    let cases: &[(&str, String, Value, &[&str])] = &[
        ("tool.json", "/n_inserts".into(), json!(1_000_000_000), &["n_inserts", "from 1 to 500"]),
        (
            "tool.json",
            "/holder/sections/0/diameter_low_mm".into(),
            json!(0),
            &["holder.sections[0].diameter_low_mm", "from 0.01"],
        ),
        (
            "tool.json",
            "/body/sections/0/diameter_high_mm".into(),
            json!(0),
            &["body.sections[0].diameter_high_mm", "from 0.01"],
        ),
        ("tool.json", "/radius_mm".into(), json!(9000), &["radius_mm", "wider than the machine's table"]),
        (
            "machine.json",
            format!("{x}/max_velocity_mm_min"),
            json!(1e-9),
            &["max_velocity_mm_min (axis X)", "from 1 to 1000000"],
        ),
        (
            "machine.json",
            format!("{c}/max_velocity_deg_min"),
            json!(1e300),
            &["max_velocity_deg_min (axis C)", "from 1 to"],
        ),
        (
            "machine.json",
            format!("{x}/max_acceleration_mm_s2"),
            json!(1e300),
            &["max_acceleration_mm_s2", "from 0.1 to"],
        ),
        ("machine.json", format!("{c}/max_jerk_deg_s3"), json!(1e-9), &["max_jerk_deg_s3 (axis C)", "from 0.01 to"]),
        (
            "machine.json",
            "/motion/control_tolerance/path_mm".into(),
            json!(1e300),
            &["control_tolerance.path_mm", "from 0 to 10"],
        ),
        (
            "machine.json",
            "/motion/control_tolerance/orientation_deg".into(),
            json!(1e300),
            &["orientation_deg", "from 0 to 5"],
        ),
        (
            "job.json",
            "/verification/stock_tolerance_mm".into(),
            json!(1e-9),
            &["verification.stock_tolerance_mm", "from 0.0001 to 0.5"],
        ),
        (
            "job.json",
            "/operations/0/entry/tangential_arc/radius_mm".into(),
            json!(1e6),
            &["entry.tangential_arc.radius_mm", "to 10000"],
        ),
        (
            "job.json",
            "/operations/0/exit/tangential_arc/straight_mm".into(),
            json!(-1.0),
            &["exit.tangential_arc.straight_mm", "from 0 to 1000"],
        ),
    ];
    for (file, pointer, value, words) in cases {
        let e = refused(file, &[(pointer.as_str(), value.clone())]);
        assert!(e.contains(file) && words.iter().all(|w| e.contains(w)), "{pointer}: {e}");
    }
}
