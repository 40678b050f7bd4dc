//! `facemill post`: plans and files of others posted on the command line.

use std::path::Path;

use facemill::cl_file::read_apt;
use facemill::inverse_kinematics::{self, AxisKind, AxisValues, Machine};
use facemill::nc_program::Dialect;
use facemill_test_kit::{linuxcnc_interpreter, run_linuxcnc};
use facemill_tests::jobs::{JobFolder, small_patch, small_patch_planned, text_of};
use facemill_tests::oracles::straight_words::{assert_same_words, straight_words};
use facemill_tests::program::{code_and_errors, run};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// A machine that comes with facemill.
fn preset(job: &JobFolder, name: &str) -> String {
    let text = facemill::inverse_kinematics::preset(name).expect("a preset");
    let file = format!("{name}.json");
    job.write(&file, text.as_bytes());
    place(job, &file)
}

fn place(job: &JobFolder, name: &str) -> String {
    job.path(name).to_str().expect("text").to_owned()
}

/// Runs `facemill post` on a file of the folder; exit code, what was printed, and errors.
fn post(job: &JobFolder, cl: &str, options: &[&str]) -> (i32, String, String) {
    let (cl, out) = (place(job, cl), place(job, "posted.nc"));
    let output = run(&[&["post", &cl, "-o", &out], options].concat());
    let (code, errors) = code_and_errors(&output);
    (code, String::from_utf8_lossy(&output.stdout).into_owned(), errors)
}

/// A folder with the tool of a short file, and the file.
fn short_file(text: &str) -> JobFolder {
    let job = small_patch();
    job.write("part.apt", text.as_bytes());
    job
}

const SHORT: &str = "PARTNO/SHORT\nMULTAX/ON\nLOADTL/1\nSPINDL/1200,RPM,CLW\nRAPID\nGOTO/0,0,60\nFEDRAT/600,MMPM\n\
                     GOTO/0,0,50\nGOTO/20,0,50,0.2,0,1\nRAPID\nGOTO/20,0,90\nFINI\n";

/// The APT file of a plan leads to the axis positions of the plan on the same machine, and its
/// program is verified against the part.
#[test]
fn the_apt_file_of_a_plan_leads_to_its_axis_positions() {
    let job = small_patch();
    job.set("job.json", &[("/post/decimals", json!({"linear": 6, "rotary": 6, "feed": 1, "inverse_time": 3}))]);
    let planned = job.plan();
    let program = text_of(&planned, "program.nc");
    job.write("program.apt", text_of(&planned, "program.apt").as_bytes());
    let options = ["--job", &place(&job, "job.json"), "--branch", "positive"];
    let as_planned = ["--rapid-tolerance-mm", "none", "--tolerance-mm", "0.1", "--certificates"];
    let (code, printed, errors) = post(&job, "program.apt", &[&options[..], &as_planned[..]].concat());
    assert_eq!(code, 0, "{printed}{errors}");
    assert!(printed.contains("against the part  T1: 0 fault(s)"), "{printed}");
    let proofs = &job.json("posted.post.json")["verifications"][0]["certificates"];
    assert!(
        proofs["blocks"].as_u64() > Some(100) && proofs["certified"] == proofs["blocks"],
        "{}",
        proofs["certified"]
    );
    let posted = std::fs::read_to_string(job.path("posted.nc")).expect("a program");
    assert_same_words(&straight_words(&program), &straight_words(&posted));
}

/// The APT file of a plan goes to every control on three kinds of machines, and is what it says
/// when it is read back.
#[test]
fn the_apt_file_of_a_plan_is_posted_for_all_controls_on_three_machines() {
    let job = small_patch();
    job.write("program.apt", text_of(small_patch_planned(), "program.apt").as_bytes());
    let tool = place(&job, "tool.json");
    for name in ["table-table-a-c", "head-head-c-a", "head-b-table-c"] {
        let machine = preset(&job, name);
        for dialect in Dialect::ALL {
            let mount = if name == "head-b-table-c" { "0,0,300" } else { "0,0,100" };
            let mut options =
                vec!["--machine", &machine, "--tool", &tool, "--dialect", dialect.name(), "--mount", mount];
            if dialect == Dialect::LinuxCnc {
                // Its interpreter has no work offset: words are those of the machine.
                options.extend(["--work-offset", "0,0,0"]);
            }
            let (code, printed, errors) = post(&job, "program.apt", &options);
            assert_eq!(code, 0, "{name} {}: {printed}{errors}", dialect.name());
            if dialect == Dialect::LinuxCnc {
                its_interpreter_comes_to_every_point(&job, name, mount);
            }
        }
    }
}

/// The interpreter of LinuxCNC takes the posted program and brings the tool to every point of the
/// APT file, by the forward solution of its words; skipped where it is not installed.
fn its_interpreter_comes_to_every_point(job: &JobFolder, machine: &str, mount: &str) {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    let length = job.json("tool.json")["gauge_length_mm"].as_f64().expect("a length");
    let text = std::fs::read_to_string(job.path("posted.nc")).expect("a program");
    let table = format!("T1 P1 Z{length} D20 ;mill\n");
    let (is_taken, printed) = run_linuxcnc(&rs274, &text, &table, &format!("plan-{machine}"));
    assert!(is_taken && printed.contains("PROGRAM_END"), "{machine}: {printed}");
    let machine = Machine::from_json(inverse_kinematics::preset(machine).expect("a preset").as_bytes()).unwrap();
    let along = machine.length_compensation_travel().expect("a spindle axis");
    let shift: Vec<f64> = mount.split(',').map(|v| v.parse().expect("a number")).collect();
    let ends = printed.lines().filter_map(|line| {
        let rest = line.split_once("STRAIGHT_TRAVERSE(").or_else(|| line.split_once("STRAIGHT_FEED("))?.1;
        let values: Vec<f64> = rest.trim_end_matches(')').split(',').filter_map(|v| v.trim().parse().ok()).collect();
        let q = AxisValues::from_fn(machine.axes().len(), |k| {
            let axis = &machine.axes()[k];
            let value = values["XYZABC".find(axis.letter.as_str()).expect("an axis")];
            if axis.kind == AxisKind::Linear { value + along[k] * length } else { value.to_radians() }
        });
        let cl = machine.cl_point(&q, length);
        Some((cl.tip - Vector3::from_column_slice(&shift), cl.axis))
    });
    let ends: Vec<_> = ends.collect();
    let file = read_apt(std::fs::read(job.path("program.apt")).expect("a file")).expect("an APT file");
    assert!(file.points.len() > 100, "{}", file.points.len());
    let mut at = 0;
    for point in &file.points {
        let is_it = |(tip, axis): &(nalgebra::Point3<f64>, nalgebra::Unit<Vector3<f64>>)| {
            (tip - point.cl.tip).norm() < 0.02 && (**axis - *point.cl.axis).norm() < 1e-4
        };
        let found = ends[at..].iter().position(is_it);
        at += found.unwrap_or_else(|| panic!("{}: line {} is not reached", machine.name(), point.line));
    }
}

#[test]
fn a_posted_program_and_its_report_are_written() {
    let job = short_file(SHORT);
    let machine = preset(&job, "table-table-a-c");
    let tool = place(&job, "tool.json");
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "fanuc", "--mount", "0,0,50"];
    let (code, printed, errors) = post(&job, "part.apt", &options);
    assert_eq!(code, 0, "{printed}{errors}");
    assert!(printed.contains("NOT CHECKED AGAINST A PART"), "{printed}");
    // Words are coordinates of the file while no axis is turned.
    let words = straight_words(&std::fs::read_to_string(job.path("posted.nc")).unwrap());
    let at = |x: f64, z: f64| words.iter().any(|(_, w)| w.get("X") == Some(&x) && w.get("Z") == Some(&z));
    assert!(at(0.0, 60.0) && at(0.0, 50.0), "{words:?}");
    let report = job.json("posted.post.json");
    let (_, schema) = (0, run(&["schema", "post"]).stdout);
    let validator = jsonschema::validator_for(&serde_json::from_slice::<Value>(&schema).unwrap()).unwrap();
    let faults: Vec<String> = validator.iter_errors(&report).map(|e| e.to_string()).collect();
    assert!(faults.is_empty(), "{faults:?}");
    assert_eq!(report["checked_against_part"], json!(false));
    assert_eq!(report["program"]["file"], json!("posted.nc"));
    assert!(report["deviation"]["tip_mm"].as_f64().unwrap() < 0.01);
}

/// A tool that is not the file's has exit code 1, and 0 if it is meant; the program is written both
/// times.
#[test]
fn another_cutter_has_exit_code_1_unless_it_is_meant() {
    let job = short_file("");
    let machine = preset(&job, "table-table-a-c");
    let tool = place(&job, "tool.json");
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "fanuc", "--mount", "0,0,50"];
    for cutter in ["CUTTER/3,0", "TLDATA/MILL,3,0,75,0,0", "$$-> CUTTER / 3.0"] {
        job.write("part.apt", SHORT.replace("MULTAX", &format!("{cutter}\nMULTAX")).as_bytes());
        let (code, printed, errors) = post(&job, "part.apt", &options);
        assert_eq!(code, 1, "{printed}{errors}");
        let report = job.json("posted.post.json");
        assert_eq!((report["faults"].as_array().map(Vec::len), &report["faults"][0]["line"]), (Some(1), &json!(2)));
        let program = std::fs::read(job.path("posted.nc")).expect("a program");
        let (code, printed, errors) = post(&job, "part.apt", &[&options[..], &["--other-cutter", "1"]].concat());
        assert_eq!(code, 0, "{printed}{errors}");
        assert!(printed.contains("line 2: ANOTHER CUTTER: "), "{printed}");
        assert_eq!(program, std::fs::read(job.path("posted.nc")).expect("a program"));
    }
}

/// A file in inches without UNITS is posted as one with UNITS, in the unit of the option.
#[test]
fn the_unit_of_a_file_without_units_is_that_of_the_option() {
    let job = short_file("");
    let machine = preset(&job, "table-table-a-c");
    let tool = place(&job, "tool.json");
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "fanuc", "--mount", "0,0,50"];
    let inches = "PARTNO/SHORT\nMULTAX/ON\nLOADTL/1\nSPINDL/1200,RPM,CLW\nRAPID\nGOTO/0,0,2.5\nFEDRAT/20\nGOTO/0,0,2\n\
                  GOTO/1,0,2,0.28,0,0.96\nRAPID\nGOTO/1,0,3.5\nFINI\n";
    let posted = |text: &str, more: &[&str]| {
        job.write("part.apt", text.as_bytes());
        let (code, printed, errors) = post(&job, "part.apt", &[&options[..], more].concat());
        assert_eq!(code, 0, "{printed}{errors}");
        (
            std::fs::read_to_string(job.path("posted.nc")).expect("a program"),
            job.json("posted.post.json")["notes"].clone(),
        )
    };
    let said = posted(&inches.replace("MULTAX", "UNITS/INCHES\nMULTAX"), &[]);
    let given = posted(inches, &["--cl-unit", "inch"]);
    assert_eq!((&given.0, &said.1), (&said.0, &json!([])));
    assert_eq!(given.1[0]["text"], json!("UNITS is missing: lengths are in inches, the unit given beside the file"));
    let (as_mm, notes) = posted(inches, &[]);
    assert!(as_mm != given.0 && notes[0]["text"] == json!("UNITS is missing: lengths are taken as mm"), "{notes}");
    job.write("part.apt", inches.replace("MULTAX", "UNITS/INCHES\nMULTAX").as_bytes());
    let (code, _, errors) = post(&job, "part.apt", &[&options[..], &["--cl-unit", "mm"]].concat());
    assert!(code == 2 && errors.contains("part.apt: line 2, column 1: UNITS: it is not the unit"), "{errors}");
}

/// A part in the way is found, and the exit code says so.
#[test]
fn a_program_that_cuts_into_the_part_has_faults() {
    let text = SHORT.replace("GOTO/0,0,50", "GOTO/0,0,-5").replace("GOTO/20,0,50", "GOTO/20,0,-5");
    let job = short_file(&text);
    let part = "v -50 -50 0\nv 50 -50 0\nv 50 50 0\nv -50 50 0\nf 1 2 3\nf 1 3 4\n";
    job.write("plate.obj", part.as_bytes());
    let machine = preset(&job, "table-table-a-c");
    let (tool, part) = (place(&job, "tool.json"), place(&job, "plate.obj"));
    let of_part = ["--part", &part, "--stock", "offset:20"];
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "fanuc", "--mount", "0,0,100"];
    let (code, printed, errors) = post(&job, "part.apt", &[&options[..], &of_part[..]].concat());
    assert_eq!(code, 1, "{printed}{errors}");
    assert!(printed.contains("against the part") && !printed.contains("NOT CHECKED"), "{printed}");
    let report = job.json("posted.post.json");
    let findings = report["verifications"][0]["findings"].as_array().unwrap();
    assert!(findings.iter().any(|f| f["kind"] == json!("gouge")), "{findings:?}");
}

/// Every fault of a file has exit code 2, its line, and leaves no file behind.
#[test]
fn wrong_files_are_refused_with_their_line() {
    let job = short_file("");
    let machine = preset(&job, "table-table-a-c");
    let tool = place(&job, "tool.json");
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "haas", "--mount", "0,0,50"];
    for (text, expected) in [
        (String::new(), "is no CL file"),
        ("G21\nG0 X1\nM30\n".to_owned(), "is no CL file"),
        (SHORT.replace("GOTO/0,0,50", "GOTO/0,0,nan"), "line 8, column 10: `nan` has no valid number"),
        (SHORT.replace("GOTO/0,0,50", "GOTO/0,0,1e400"), "line 8, column 10"),
        (SHORT.replace("0.2,0,1", "0,0,0"), "line 9, column 1: GOTO: the axis has length zero"),
        (SHORT.replace("GOTO/0,0,50", "GOTO/0,0,-9000"), "line 8: the machine does not reach it: axis Z"),
        (SHORT.replace("LOADTL/1", "LOADTL/5"), "line 3: LOADTL calls T5; the tools given are T1"),
        (SHORT.replace("FINI", "TRACUT/1"), "line 12: TRACUT is not followed"),
        (SHORT.replace("FEDRAT/600,MMPM\n", ""), "line 7: the tool cuts, and no FEDRAT"),
    ] {
        job.write("part.apt", text.as_bytes());
        let (code, printed, errors) = post(&job, "part.apt", &options);
        assert!(code == 2 && printed.is_empty() && errors.contains(expected), "{expected}: {code} {errors}");
        assert!(!job.path("posted.nc").exists() && !job.path("posted.post.json").exists());
    }
    job.write("part.apt", SHORT.as_bytes());
    for (more, expected) in [
        (&["--certificates"][..], "--certificates needs --job or --part"),
        (&["--tolerance-mm", "0"], "--tolerance-mm"),
        (&["--feed-mode", "rtcp"], "motion.cutting"),
        (&["--retract-mm", "-1"], "--retract-mm"),
        (&["--work-register", "G99"], "--work-register G99"),
        (&["--tool", &tool], "T1 is given twice"),
        (&["--job", &place(&job, "job.json")], "cannot be used with"),
    ] {
        let (code, _, errors) = post(&job, "part.apt", &[&options[..], more].concat());
        assert!(code == 2 && errors.contains(expected), "{expected}: {code} {errors}");
        assert!(!job.path("posted.nc").exists());
    }
    let same = place(&job, "part.apt");
    let output = run(&[&["post", &same, "-o", &same], &options[..]].concat());
    assert!(code_and_errors(&output).0 != 0);
    assert_eq!(std::fs::read(Path::new(&same)).unwrap(), SHORT.as_bytes());
}

/// Two spirals of 1.6 turns with rapids between them, on which an axis with limits has to turn
/// back.
fn two_spirals() -> String {
    let mut text = "UNITS/MM\nMULTAX/ON\nLOADTL/1\nSPINDL/1200,RPM,CLW\nFEDRAT/600,MMPM\n".to_owned();
    let n = 96;
    let line = |k: i32, z: f64| {
        let (sin, cos) = (std::f64::consts::TAU * 1.6 * f64::from(k) / f64::from(n)).sin_cos();
        format!("GOTO/{},{},{z},{},{},1\n", 30.0 * cos, 30.0 * sin, 0.3 * cos, 0.3 * sin)
    };
    for _ in 0..2 {
        text += &format!("RAPID\n{}", line(0, 200.0));
        text.extend((0..=n).map(|k| line(k, 150.0)));
        text += &format!("RAPID\n{}RAPID\n{}", line(n, 200.0), line(n, 250.0));
        text += &format!("RAPID\n{}RAPID\n{}", line(0, 260.0), line(0, 230.0));
    }
    text + "FINI\n"
}

/// Rotary axes that turn anew in a rapid without a lift are a fault, until a run against the part
/// finds nothing.
#[test]
fn a_turn_in_a_rapid_is_a_fault_unless_the_run_against_the_part_passes() {
    let job = short_file(&two_spirals());
    job.write("plate.obj", b"v -50 -50 0\nv 50 -50 0\nv 50 50 0\nv -50 50 0\nf 1 2 3\nf 1 3 4\n");
    let machine = preset(&job, "head-head-c-a");
    let (tool, part) = (place(&job, "tool.json"), place(&job, "plate.obj"));
    let options = ["--machine", &machine, "--tool", &tool, "--dialect", "fanuc", "--mount", "0,0,100"];
    let text_of_all = |report: &Value, key: &str| report[key].to_string();
    let (code, printed, errors) = post(&job, "part.apt", &options);
    assert_eq!(code, 1, "{printed}{errors}");
    assert!(text_of_all(&job.json("posted.post.json"), "faults").contains("without a lift"), "{printed}");
    let of_part = ["--part", &part, "--stock", "offset:1"];
    let (code, printed, errors) = post(&job, "part.apt", &[&options[..], &of_part[..]].concat());
    assert_eq!(code, 0, "{printed}{errors}");
    let report = job.json("posted.post.json");
    assert_eq!(report["faults"], json!([]));
    assert!(text_of_all(&report, "notes").contains("without a lift"), "{report}");
}
