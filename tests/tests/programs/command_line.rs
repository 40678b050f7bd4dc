//! The `facemill` command: exit codes, messages, interruption, and that the same job always gives
//! the same bytes.

use std::process::{Command, Stdio};
use std::time::Instant;

use facemill::new_job::{NewJob, Series};
use facemill::sample_parts::{PatchSpec, patch};
use facemill::surface_model::{NamedNode, write_obj};
use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::{JobFolder, copy_of, small_patch, small_propeller, unfinished, write_coarse_propeller};
use facemill_tests::program::{code_and_errors, facemill, faults, run};
use facemill_tests::shared::workspace;
use facemill_tests::variants::{box_obj, tiny_patch};
use nalgebra::Isometry3;
use serde_json::{Value, json};

use crate::strategies::several_tools::two_tools;

fn plan(job: &JobFolder, out: &str, more: &[&str]) -> (i32, String) {
    let (file, folder) = (job.job(), job.path(out));
    let mut arguments = vec!["plan", file.to_str().unwrap(), "--out", folder.to_str().unwrap()];
    arguments.extend(more);
    code_and_errors(&run(&arguments))
}

fn names(folder: &std::path::Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A patch, and three narrow bands of a propeller's blades.
#[test]
fn one_and_two_threads_write_the_same_bytes() {
    same_bytes(&[tiny_patch(), small_propeller()]);
}

/// Two tools in a clamping and one of them in a second one, each on what those before leave.
#[test]
fn one_and_two_threads_write_the_same_bytes_of_several_tools_and_setups() {
    let job = two_tools("fanuc");
    // A smaller patch, so that little of the time goes to the bound.
    let spec = PatchSpec::new([36.0, 36.0], 0.33, [1.2, 1.0]).expect("numbers in range");
    let mesh = patch(&spec, 15, 15).expect("numbers in range");
    let nodes = [NamedNode { name: "patch", mesh: 0, transform: Isometry3::identity() }];
    job.write("patch.obj", &write_obj(&[&mesh], &nodes).expect("a mesh"));
    let mut file = job.json("job.json");
    // So close that there is a bound of what the programs before leave.
    file["setups"][0]["rest_cell_mm"] = json!(0.3);
    let mut turned = file["setups"][0].clone();
    (turned["name"], turned["work_from_part"]) = (json!("turned"), json!({ "rotation_deg": 90.0 }));
    file["setups"].as_array_mut().expect("setups").push(turned);
    let mut last = file["operations"][0].clone();
    (last["name"], last["setup"]) = (json!("turned"), json!("turned"));
    let operations = file["operations"].as_array_mut().expect("operations");
    operations.iter_mut().for_each(|operation| operation["setup"] = json!("top"));
    operations.push(last);
    job.write("job.json", file.to_string().as_bytes());

    for threads in ["1", "2"] {
        let (code, errors) = plan(&job, threads, &["--no-html", "--threads", threads]);
        assert_eq!(code, 0, "{errors}");
        // The rest of the stock behind each program, by as many threads.
        let of = |name: &str| job.path(threads).join(name);
        let programs = ["program-top-1-mill.nc", "program-top-2-finer.nc", "program-turned.nc"].map(of);
        for (k, program) in programs.iter().enumerate() {
            let mut verify = Command::new(facemill());
            verify.arg("verify").arg(program).arg("--job").arg(job.job()).args(["--setup", &(k + 1).to_string()]);
            verify.args(["--stock-cell-mm", "0.5", "--rest-out"]).arg(of(&format!("rest-{k}.stock")));
            for (before, program) in programs[..k].iter().enumerate() {
                verify.arg("--after").arg(format!("{}={}", before + 1, program.display()));
            }
            let output = verify.env("RAYON_NUM_THREADS", threads).output().expect("facemill starts");
            let (code, errors) = code_and_errors(&output);
            assert_eq!(code, 0, "{program:?}: {errors}{}", String::from_utf8_lossy(&output.stdout));
        }
    }
    let report = job.json("1/report-top-2-finer.json");
    let planned_on = report["stock"]["planned_on"].as_str().expect("a text");
    assert!(planned_on.starts_with("all that \"top 1 mill\" may leave"), "{planned_on}");
    let all = names(&job.path("1"));
    let several = |ending: &str, n: usize| all.iter().filter(|name| name.ends_with(ending)).count() >= n;
    assert!(several(".nc", 4) && several(".stock", 3) && several(".json", 4), "{all:?}");
    let bytes = |threads: &str, name: &String| std::fs::read(job.path(threads).join(name)).expect("a file");
    assert_eq!(names(&job.path("2")), all);
    // Wall times alone differ.
    for name in all.iter().filter(|name| *name != "timings.json") {
        assert!(bytes("1", name) == bytes("2", name), "{name} differs");
    }
}

#[test]
#[ignore = "plans larger parts twice: a minute"]
fn one_and_two_threads_write_the_same_bytes_of_larger_parts() {
    let propeller = small_propeller();
    let sections = "/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm";
    propeller.set("job.json", &[(sections, json!(120.0))]);
    same_bytes(&[small_patch(), propeller]);
}

fn same_bytes(jobs: &[JobFolder]) {
    for job in jobs {
        for (out, threads) in [("one", "1"), ("two", "2")] {
            let (code, errors) = plan(job, out, &["--threads", threads]);
            assert_eq!(code, 0, "{errors}");
        }
        for name in ["program.nc", "program.apt", "report.json", "solution-space.svg"] {
            let [one, two] = ["one", "two"].map(|out| std::fs::read(job.path(out).join(name)).unwrap());
            assert!(one == two, "{name} differs");
        }
    }
}

/// A propeller whose head is in the way of its neighbouring blade.
fn crowded() -> JobFolder {
    let job = JobFolder::new(&NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 400.0 });
    write_coarse_propeller(&job, 400.0);
    job.set(
        "job.json",
        &[
            ("/operations/0/tolerances/max_step_mm", json!(6.0)),
            ("/operations/0/search/mode", json!("smallest")),
            ("/verification/cut_stock", json!(false)),
            ("/operations/0/pattern", Value::Null),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/from_radius_mm", json!(80.0)),
            ("/operations/0/path/strategy/strategy/cylindrical_sections/to_radius_mm", json!(100.0)),
        ],
    );
    job
}

#[test]
fn trimming_more_than_allowed_is_exit_1_with_files_and_stopping_is_exit_1_without() {
    let job = crowded();
    let (code, errors) = plan(&job, "out", &[]);
    assert_eq!(code, 1, "{errors}");
    let report: Value = serde_json::from_slice(&std::fs::read(job.path("out/report.json")).unwrap()).unwrap();
    let trimmed =
        report["totals"]["trimmed_points"].as_f64().unwrap() / report["totals"]["cc_points"].as_f64().unwrap();
    assert!(trimmed > report["totals"]["max_trimmed_fraction"].as_f64().unwrap());
    // The rest is sound: the program leaves the part before the gaps and comes back behind them.
    let faults = faults(&report);
    assert!(report["verified"] == true && faults.is_empty(), "{faults:?}");

    job.set("job.json", &[("/operations/0/infeasible/trim/max_trimmed_fraction", json!(1.0)), unfinished()]);
    let (code, errors) = plan(&job, "generous", &["--no-verify"]);
    assert_eq!(code, 0, "{errors}");

    job.set("job.json", &[("/operations/0/infeasible", json!("stop"))]);
    let (code, errors) = plan(&job, "stopped", &[]);
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("no feasible posture") && errors.contains(" hits "), "{errors}");
    assert!(names(&job.path("stopped")).is_empty());
}

#[test]
fn a_folder_that_cannot_be_written_is_exit_3_and_named() {
    let job = tiny_patch();
    job.write("taken", b"a file");
    let (code, errors) = plan(&job, "taken", &["--no-verify"]);
    assert_eq!(code, 3, "{errors}");
    assert!(errors.contains("taken") && errors.contains("cannot write"), "{errors}");
    assert_eq!(std::fs::read(job.path("taken")).unwrap(), b"a file");
}

#[test]
fn usage_errors_are_exit_2() {
    for arguments in [&["plan"][..], &["fly"], &["plan", "a", "--threads", "many"], &["schema", "poem"], &[]] {
        assert_eq!(run(arguments).status.code(), Some(2), "{arguments:?}");
    }
    let job = tiny_patch();
    for threads in ["0", "-1", "1025", "99999999999999999999", "2.5", ""] {
        let (code, errors) = plan(&job, "out", &[&format!("--threads={threads}"), "--no-verify"]);
        assert_eq!(code, 2, "--threads {threads}: {errors}");
        assert!(errors.contains("--threads"), "--threads {threads}: {errors}");
    }
    for cell in ["0", "-1", "nan", "inf"] {
        let (code, errors) = plan(&job, "out", &[&format!("--stock-cell-mm={cell}")]);
        assert!(code == 2 && errors.contains("--stock-cell-mm") && !errors.contains("job.json"), "{cell}: {errors}");
    }
    assert!(names(&job.path("out")).is_empty());
    // As many are accepted as are permitted: what is wrong here is another thing.
    let (code, errors) = plan(&job, "out", &["--threads=1024", "--set=/tool=\"gone.json\""]);
    assert!(code == 2 && errors.contains("gone.json") && !errors.contains("--threads"), "{errors}");
    // More threads than the machine has are none of its business.
    assert_eq!(plan(&job, "out", &["--threads", "16", "--no-verify"]).0, 0);
}

/// Reads the progress of a command until it reports the begin of a stage.
#[cfg(unix)]
fn wait_for(stage: &str, progress: impl std::io::BufRead) {
    for line in progress.lines() {
        let line = line.unwrap();
        let Ok(object) = serde_json::from_str::<Value>(&line) else { panic!("{line}") };
        if object["event"] == "stage_began" && object["stage"] == stage {
            return;
        }
    }
    panic!("the command ended before `{stage}`");
}

/// How long it takes is printed, not tested: other work on the machine may delay it.
#[test]
#[cfg(unix)]
fn an_interrupt_stops_and_leaves_no_half_file() {
    use std::io::{BufReader, Read};
    use std::os::unix::process::ExitStatusExt;
    let job = JobFolder::new(&NewJob::Propeller { series: Series::Dtmb4119, diameter_mm: 3048.0 });
    job.set("job.json", &[("/operations/0/tolerances/max_step_mm", json!(2.0))]);
    let out = job.path("out");
    // As soon as the command works at all, and in the search, which takes seconds.
    for stage in ["read the meshes", "tilt and rotate"] {
        let mut child = Command::new(facemill())
            .args([
                "plan".as_ref(),
                job.job().as_os_str(),
                "--json-progress".as_ref(),
                "--out".as_ref(),
                out.as_os_str(),
            ])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut progress = BufReader::new(child.stderr.take().unwrap());
        wait_for(stage, &mut progress);
        let sent = Instant::now();
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let mut errors = String::new();
        progress.read_to_string(&mut errors).unwrap();
        let status = child.wait().unwrap();
        println!("in `{stage}`: stopped after {:.2} s", sent.elapsed().as_secs_f64());
        assert_eq!(status.signal(), None, "in `{stage}`");
        assert_eq!(status.code(), Some(130), "in `{stage}`: {errors}");
        assert!(names(&out).is_empty(), "{:?}", names(&out));
    }
}

#[test]
fn new_propellers_are_the_committed_samples() {
    let folder = tempfile::tempdir().unwrap();
    for part in ["propeller", "propeller-dual", "propeller-whole"] {
        let dir = folder.path().join(part);
        let (code, errors) = code_and_errors(&run(&["new", part, dir.to_str().unwrap()]));
        assert_eq!(code, 0, "{errors}");
        let sample = workspace().join("assets").join(part);
        for name in names(&dir) {
            let [new, committed] = [&dir, &sample].map(|f| std::fs::read(f.join(&name)).unwrap_or_default());
            assert!(
                new == committed,
                "assets/{part}/{name} is not what `facemill new {part}` writes; \
                 regenerate it: cargo run --release -- new {part} NEW && cp NEW/* assets/{part}/"
            );
        }
        let again = code_and_errors(&run(&["new", part, dir.to_str().unwrap()]));
        assert_eq!(again.0, 2, "{}", again.1);
        assert!(again.1.contains("not empty"), "{}", again.1);
    }
}

/// A job in which one thing is wrong: its name, what is done to the folder, and what the message
/// must hold.
type Wrong = (&'static str, fn(&JobFolder), &'static [&'static str]);

fn job(f: &JobFolder, pointer: &str, value: Value) {
    f.set("job.json", &[(pointer, value)]);
}
fn tool(f: &JobFolder, pointer: &str, value: Value) {
    f.set("tool.json", &[(pointer, value)]);
}
fn machine(f: &JobFolder, pointer: &str, value: Value) {
    f.set("machine.json", &[(pointer, value)]);
}
fn replace(f: &JobFolder, name: &str, from: &str, to: &str) {
    let text = std::fs::read_to_string(f.path(name)).unwrap();
    assert!(text.contains(from), "{name} has no {from}");
    f.write(name, text.replacen(from, to, 1).as_bytes());
}

const WRONG: &[Wrong] = &[
    ("unknown key", |f| replace(f, "job.json", "\"gouge_mm\"", "\"gauge_mm\""), &["job.json", "gauge_mm", "gouge_mm"]),
    (
        "unknown key in a tool",
        |f| replace(f, "tool.json", "\"corner_radius_mm\"", "\"corner_radios_mm\""),
        &["tool.json", "corner_radios_mm", "corner_radius_mm"],
    ),
    (
        "unknown key in a machine",
        |f| replace(f, "machine.json", "\"theta_deg\"", "\"theta\""),
        &["machine.json", "theta", "theta_deg"],
    ),
    (
        "missing key",
        |f| job(f, "/operations/0/tolerances/cusp_mm", Value::Null),
        &["job.json", "operations[0].tolerances", "cusp_mm"],
    ),
    ("NaN", |f| replace(f, "job.json", "\"cusp_mm\": 0.1", "\"cusp_mm\": NaN"), &["job.json", "line"]),
    ("too large a number", |f| replace(f, "job.json", "\"cusp_mm\": 0.1", "\"cusp_mm\": 1e999"), &["job.json", "line"]),
    (
        "a text for a number",
        |f| job(f, "/operations/0/feeds/spindle_rpm", json!("fast")),
        &["job.json", "operations[0].feeds.spindle_rpm"],
    ),
    (
        "half a file",
        |f| {
            let t = std::fs::read(f.job()).unwrap();
            f.write("job.json", &t[..t.len() / 2]);
        },
        &["job.json", "line"],
    ),
    (
        "an empty file",
        |f| {
            f.write("job.json", b"");
        },
        &["job.json"],
    ),
    (
        "no text",
        |f| {
            f.write("job.json", &[0xff, 0xfe, 0x00]);
        },
        &["job.json"],
    ),
    ("format of the future", |f| job(f, "/format", json!("facemill-job/9")), &["job.json", "format", "facemill-job/1"]),
    (
        "negative tolerance",
        |f| job(f, "/operations/0/tolerances/gouge_mm", json!(-0.1)),
        &["job.json", "operations[0].tolerances.gouge_mm", "must be", "-0.1"],
    ),
    (
        "tilt backward",
        |f| job(f, "/operations/0/search/tilt_deg", json!([9.0, 3.0])),
        &["job.json", "operations[0].search.tilt_deg"],
    ),
    (
        "no direction",
        |f| job(f, "/setups/0/clearance/plane/normal", json!([0.0, 0.0, 0.0])),
        &["job.json", "clearance.plane.normal"],
    ),
    ("no setup", |f| job(f, "/setups", json!([])), &["job.json", "setups"]),
    ("no operation", |f| job(f, "/operations", json!([])), &["job.json", "operations"]),
    (
        "no drive surface",
        |f| job(f, "/setups/0/meshes/0/role", json!("part")),
        &["job.json", "setups[0].meshes", "drive"],
    ),
    (
        "zigzag in climb",
        |f| job(f, "/operations/0/path/strategy/linking", json!("zigzag")),
        &["job.json", "linking", "either"],
    ),
    (
        "unknown group",
        |f| job(f, "/setups/0/meshes/0/groups", json!(["blade"])),
        &["job.json", "setups[0].meshes[0].groups", "blade", "patch"],
    ),
    (
        "region's group",
        |f| job(f, "/operations/0/path/strategy/region", json!({"groups": ["hub"]})),
        &["job.json", "region.groups", "hub", "patch"],
    ),
    (
        "a strategy without range",
        |f| {
            job(
                f,
                "/operations/0/path/strategy/strategy",
                json!({"cylindrical_sections": {"axis_direction": [0, 0, 1], "from_radius_mm": 5.0, "to_radius_mm": 1.0}}),
            )
        },
        &["job.json", "to_radius_mm"],
    ),
    (
        "passes beside the part",
        |f| {
            job(
                f,
                "/operations/0/path/strategy/strategy",
                json!({"cylindrical_sections": {"axis_direction": [0, 0, 1], "from_radius_mm": 5000.0, "to_radius_mm": 5001.0}}),
            )
        },
        &["job.json", "operations[0].path"],
    ),
    (
        "work offset",
        |f| job(f, "/setups/0/work_offset", json!({"register": "G99"})),
        &["job.json", "work_offset.register", "G54"],
    ),
    (
        "axis of another machine",
        |f| job(f, "/setups/0/work_offset", json!({"linear_mm": {"W": 1.0}})),
        &["job.json", "work_offset.linear_mm", "W"],
    ),
    ("missing mesh", |f| job(f, "/setups/0/meshes/0/file", json!("gone.obj")), &["gone.obj", "cannot read"]),
    ("mesh of no known kind", |f| job(f, "/setups/0/meshes/0/file", json!("tool.json")), &["tool.json", ".stl"]),
    ("missing tool", |f| job(f, "/tool", json!("gone.json")), &["gone.json", "cannot read"]),
    (
        "missing path file",
        |f| job(f, "/operations/0/path", json!({"file": {"file": "gone.path", "max_distance_mm": 1.0}})),
        &["gone.path", "cannot read"],
    ),
    ("mesh with NaN", |f| replace(f, "patch.obj", "\nv ", "\nv nan 0 0\nv "), &["patch.obj"]),
    (
        "mesh with a bad index",
        |f| {
            let t = std::fs::read_to_string(f.path("patch.obj")).unwrap();
            f.write("patch.obj", (t + "f 1 2 999999\n").as_bytes());
        },
        &["patch.obj"],
    ),
    (
        "empty mesh",
        |f| {
            f.write("patch.obj", b"# nothing\n");
        },
        &["patch.obj"],
    ),
    (
        "mesh file that is none",
        |f| {
            f.write("patch.stl", b"no mesh");
            job(f, "/setups/0/meshes/0/file", json!("patch.stl"));
        },
        &["patch.stl"],
    ),
    (
        "GLB that is none",
        |f| {
            f.write("patch.glb", b"glTF\x02\0\0\0");
            job(f, "/setups/0/meshes/0/file", json!("patch.glb"));
        },
        &["patch.glb"],
    ),
    (
        "corner larger than the cutter",
        |f| tool(f, "/corner_radius_mm", json!(11.0)),
        &["tool.json", "corner_radius", "radius"],
    ),
    ("cutter without radius", |f| tool(f, "/radius_mm", json!(0.0)), &["tool.json", "radius"]),
    (
        "holder longer than the gauge length",
        |f| tool(f, "/gauge_length_mm", json!(2.0)),
        &["tool.json", "gauge_length"],
    ),
    ("ramp of no angle", |f| tool(f, "/max_ramp_angle_deg", json!(-1.0)), &["tool.json", "max_ramp_angle"]),
    ("machine without joints", |f| machine(f, "/tool_chains/0/rows", json!([])), &["machine.json"]),
    (
        "axis limits the wrong way",
        |f| machine(f, "/tool_chains/0/rows/0/joint/prismatic/min_mm", json!(9999.0)),
        &["machine.json", "tool_chains[0].rows[0].joint.prismatic", "9999", "axis Y"],
    ),
    ("missing template", |f| job(f, "/post/template", json!("gone.txt")), &["gone.txt", "cannot read"]),
    (
        "broken template",
        |f| {
            f.write("post.txt", b"{% if %}");
            job(f, "/post/template", json!("post.txt"));
        },
        &["post"],
    ),
    ("unknown dialect", |f| job(f, "/post/dialect", json!("klingon")), &["job.json", "post.dialect", "fanuc"]),
];

#[test]
fn bad_input_is_exit_2_with_file_and_field() {
    let good = tiny_patch();
    let folder = good.job();
    let good = folder.parent().unwrap();
    let mut failures = Vec::new();
    for (name, change, words) in WRONG {
        let job = copy_of(good);
        change(&job);
        // Offsets are used only when a program is written.
        let (code, errors) = if name.contains("another machine") {
            plan(&job, "out", &["--no-verify"])
        } else {
            code_and_errors(&run(&["check".as_ref(), job.job().as_os_str()]))
        };
        let missing: Vec<&&str> = words.iter().filter(|w| !errors.contains(**w)).collect();
        if code != 2 || !missing.is_empty() || errors.contains("panicked") {
            failures.push(format!("{name}: exit {code}, without {missing:?}: {errors}"));
        }
        if errors.lines().count() > 12 {
            failures.push(format!("{name}: too long: {errors}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn an_operation_of_a_setup_that_does_not_exist_is_named() {
    let f = tiny_patch();
    job(&f, "/operations/0/setup", json!("bottom"));
    let (code, errors) = code_and_errors(&run(&["check".as_ref(), f.job().as_os_str()]));
    assert_eq!(code, 2);
    assert!(errors.contains("operations[0].setup") && errors.contains("bottom"), "{errors}");
}

/// Each file by what is said of it, or by its format.
#[test]
fn check_tells_unit_and_up_axis_of_every_mesh() {
    let f = tiny_patch();
    f.write("clamp.obj", box_obj([-0.1, -0.1, 0.1], [0.1, 0.1, 0.2]).as_bytes());
    let meshes = &f.json("job.json")["setups"][0]["meshes"];
    let clamp = json!({ "file": "clamp.obj", "role": "fixture", "unit": "inch", "up_axis": "x" });
    job(&f, "/setups/0/meshes", json!([meshes[0], clamp]));
    let printed_output = facemill_in(&f, "check job.json");
    assert_eq!(printed_output.code, 0, "{}", printed_output.errors);
    for taken in ["mesh patch.obj in millimetres, z up: ", "mesh clamp.obj in inches, x up: "] {
        assert!(printed_output.prints(&[taken]), "{}", printed_output.printed);
    }
}
