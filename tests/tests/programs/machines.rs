//! The machine files of `assets/machines` and the commands about machine files.

use facemill::cl_data::{ClPoint, PlacedSolid, RoundFrustum, Solid};
use facemill::inverse_kinematics::import::import_autodesk_machine;
use facemill::inverse_kinematics::machine_file::AssumedValue;
use facemill::inverse_kinematics::{AxisKind, AxisValues, Carrier, Machine};
use facemill_test_kit::Random;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::{shared, workspace};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// File, family, and the limits that docs/machines.md states: axis, min, max (mm or deg; nothing:
/// endless).
type Preset = (&'static str, &'static str, [(&'static str, Option<(f64, f64)>); 5]);

const fn to(limit: f64) -> Option<(f64, f64)> {
    Some((-limit, limit))
}

const PRESETS: [Preset; 11] = [
    (
        "head-b-table-c",
        "head B, table C",
        [("X", to(2600.0)), ("Y", to(2600.0)), ("Z", Some((-350.0, 3250.0))), ("B", to(110.0)), ("C", None)],
    ),
    (
        "head-a-table-c",
        "head A, table C",
        [("X", to(500.0)), ("Y", to(400.0)), ("Z", Some((-600.0, 0.0))), ("A", to(110.0)), ("C", None)],
    ),
    (
        "table-table-a-c",
        "table-table A-C",
        [("X", to(380.0)), ("Y", to(380.0)), ("Z", Some((-550.0, 0.0))), ("A", to(120.0)), ("C", None)],
    ),
    (
        "table-table-b-c",
        "table-table B-C",
        [("X", to(380.0)), ("Y", to(380.0)), ("Z", Some((-550.0, 0.0))), ("B", to(120.0)), ("C", None)],
    ),
    (
        "head-head-c-a",
        "head-head C-A",
        [("X", to(2000.0)), ("Y", to(725.0)), ("Z", Some((-750.0, 0.0))), ("A", to(120.0)), ("C", to(370.0))],
    ),
    (
        "head-head-c-b",
        "head-head C-B",
        [("X", to(2000.0)), ("Y", to(725.0)), ("Z", Some((-750.0, 0.0))), ("B", to(120.0)), ("C", to(370.0))],
    ),
    (
        "head-b-nutating-table-c",
        "head B (nutating, 45° toward +y), table C",
        [("X", to(400.0)), ("Y", to(350.0)), ("Z", Some((-600.0, 0.0))), ("B", Some((-30.0, 180.0))), ("C", None)],
    ),
    (
        "table-table-b-c-nutating",
        "table-table B-C (B nutating, 45° toward +y)",
        [("X", to(300.0)), ("Y", to(350.0)), ("Z", Some((-600.0, 0.0))), ("B", Some((0.0, 180.0))), ("C", None)],
    ),
    (
        "table-y-x-a-c-head-z",
        "table-table A-C",
        [("X", to(1000.0)), ("Y", to(350.0)), ("Z", Some((-700.0, 0.0))), ("A", to(120.0)), ("C", None)],
    ),
    (
        "bridge-head-head-a-b",
        "head-head A-B",
        [("X", to(3000.0)), ("Y", to(1200.0)), ("Z", Some((-1000.0, 0.0))), ("A", to(40.0)), ("B", to(40.0))],
    ),
    (
        "head-b-a-table-c-two-linear",
        "head B-A, table C",
        [("X", Some((-400.0, 800.0))), ("Z", Some((-900.0, 100.0))), ("A", to(60.0)), ("B", to(110.0)), ("C", None)],
    ),
];

/// Files of two heads, and the families of their heads.
const DUALS: [(&str, [&str; 2]); 2] = [
    ("dual-c-horizontal-xyzb", ["head B1, table C", "head B2, table C"]),
    ("dual-c-horizontal-xzab", ["head A1-B1, table C", "head A2-B2, table C"]),
];

fn preset_text(name: &str) -> String {
    std::fs::read_to_string(workspace().join(format!("assets/machines/{name}.json"))).expect("a preset")
}

fn preset(name: &str) -> Machine {
    Machine::from_json(preset_text(name).as_bytes()).expect("a preset that builds")
}

/// Values within the limits; rotary ones alone where the linear ones stay at 0.
fn random_values(random: &mut Random, machine: &Machine, linear_too: bool) -> AxisValues {
    AxisValues::from_fn(machine.axes().len(), |k| {
        let axis = &machine.axes()[k];
        let (min, max) = if axis.endless { (-3.1, 3.1) } else { (axis.min, axis.max) };
        let value = random.between(min, max);
        if axis.kind == AxisKind::Linear && !linear_too { 0.0 } else { value }
    })
}

#[test]
fn every_preset_is_the_machine_it_says() {
    let folder = workspace().join("assets/machines");
    let files = std::fs::read_dir(folder).unwrap().count();
    assert_eq!(files, PRESETS.len() + DUALS.len(), "a file in assets/machines is not tested");
    for (name, family, limits) in PRESETS {
        let machine = preset(name);
        assert_eq!(machine.family().to_string(), family, "{name}");
        for (axis, (letter, range)) in machine.axes().iter().zip(limits) {
            assert_eq!(axis.letter.to_string(), letter, "{name}");
            match range {
                None => assert!(axis.endless, "{name} {letter}"),
                Some((min, max)) => {
                    let [a, b] = [axis.min, axis.max].map(|v| axis.in_word_unit(v));
                    assert!((a - min).abs() < 1e-9 && (b - max).abs() < 1e-9, "{name} {letter}: {a} to {b}");
                }
            }
        }
        let file = machine.to_file();
        assert!(file.source.is_some() && file.is_assumed(AssumedValue::Bodies, ""), "{name}");
        assert!(file.is_assumed(AssumedValue::MaxAcceleration, "X"), "{name}");
        // A machine whose place of axes is not assumed names where it is from.
        let published = !file.is_assumed(AssumedValue::Dimensions, "X");
        assert_eq!(published, file.source.is_some_and(|s| s.contains("Autodesk")), "{name}");
    }
}

#[test]
fn every_preset_obeys_the_schema_and_lists_known_values_alone() {
    let schema = serde_json::from_slice(&run(&["schema", "machine"]).stdout).expect("a schema is JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema that is one");
    for name in PRESETS.into_iter().map(|p| p.0).chain(DUALS.map(|d| d.0)) {
        let mut file: serde_json::Value = serde_json::from_str(&preset_text(name)).unwrap();
        assert!(validator.is_valid(&file), "{name}");
        file["assumed"][0]["value"] = "weather".into();
        assert!(!validator.is_valid(&file), "{name}");
    }
}

#[test]
fn every_preset_goes_there_and_back() {
    let mut r = Random(1);
    for (name, ..) in PRESETS {
        let machine = preset(name);
        for _ in 0..500 {
            let q = random_values(&mut r, &machine, true);
            let pose = machine.forward(&q, 180.0);
            let cl = ClPoint {
                tip: Point3::from(pose.translation.vector),
                axis: Unit::new_normalize(pose.rotation * Vector3::z()),
            };
            let solutions = machine.inverse_near(&cl, 180.0, &q).unwrap_or_else(|e| panic!("{name}: {q:?}: {e}"));
            for s in solutions.iter() {
                assert!(machine.first_beyond_limit(&s.values).is_none(), "{name}: {s:?}");
                let reached = machine.forward(&s.values, 180.0);
                assert!((reached.translation.vector - cl.tip.coords).norm() < 2e-9, "{name}: {q:?}");
                assert!((reached.rotation * Vector3::z() - *cl.axis).norm() < 2e-12, "{name}: {q:?}");
            }
            let same = |v: &AxisValues| {
                (0..5).all(|k| {
                    let d = v[k] - q[k];
                    let linear = machine.axes()[k].kind == AxisKind::Linear;
                    if linear { d.abs() < 1e-5 } else { (0.5 * d).sin().abs() < 1e-8 }
                })
            };
            assert!(solutions.iter().any(|s| same(&s.values)), "{name}: {q:?} is not found again: {solutions:?}");
        }
    }
}

/// tilt = acos((1 + cos B) / 2), of the head's and of the table's kind.
#[test]
fn nutating_axes_tilt_by_their_closed_form() {
    for name in ["head-b-nutating-table-c", "table-table-b-c-nutating"] {
        let machine = preset(name);
        let (b, c) = (machine.axis_index("B").unwrap(), machine.axis_index("C").unwrap());
        for step in 0..=180 {
            let mut q = AxisValues::zeros(5);
            q[b] = f64::from(step).to_radians();
            q[c] = 0.7 * f64::from(step);
            let axis = machine.cl_point(&q, 0.0).axis;
            assert!((axis.z - 0.5 * (1.0 + q[b].cos())).abs() < 1e-12, "{name} at {step}");
        }
    }
}

/// Presets that say they have the numbers of a published file move as that file does.
#[test]
fn presets_from_published_files_move_as_those() {
    let mut r = Random(2);
    let Some(folder) = shared("data/machines") else { return };
    for (name, file) in [
        ("table-table-a-c", "table_ac_head_xyz"),
        ("table-table-b-c", "table_bc_head_xyz"),
        ("head-head-c-a", "table_head_xyzca"),
        ("head-head-c-b", "table_head_xyzcb"),
        ("table-y-x-a-c-head-z", "table_yxac_head_z"),
    ] {
        let text = std::fs::read_to_string(folder.join(format!("autodesk_5ax_{file}.machine"))).unwrap();
        let published = Machine::from_file(import_autodesk_machine(&text).unwrap()).unwrap();
        let machine = preset(name);
        assert!(machine.to_file().source.unwrap().ends_with(file), "{name}");
        for (a, b) in machine.axes().iter().zip(published.axes()) {
            assert_eq!((a.letter, a.endless, a.carried_by), (b.letter, b.endless, b.carried_by), "{name}");
            assert!(a.endless || ((a.min - b.min).abs() < 1e-9 && (a.max - b.max).abs() < 1e-9), "{name} {a:?}");
        }
        for _ in 0..50 {
            let q = random_values(&mut r, &machine, true);
            let (a, b) = (machine.forward(&q, 0.0), published.forward(&q, 0.0));
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-9, "{name}: {q:?}");
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7, "{name}: {q:?}");
        }
    }
}

/// Points on the surface of a solid without its clearance, own frame.
fn surface(solid: &Solid, r: &mut Random) -> Point3<f64> {
    match solid {
        Solid::Box(b) => {
            let mut p = Vector3::from_fn(|_, _| 2.0 * r.unit() - 1.0);
            let side = (3.0 * r.unit()) as usize;
            p[side.min(2)] = if r.unit() < 0.5 { -1.0 } else { 1.0 };
            Point3::from(p.component_mul(&b.half_extents))
        }
        Solid::Hull(h) => {
            let vertices = h.core.vertices();
            vertices[(vertices.len() as f64 * r.unit()) as usize % vertices.len()]
        }
        Solid::Frustum(f) => {
            let (t, angle) = ((3.0 * r.unit() - 1.0).clamp(0.0, 1.0), std::f64::consts::TAU * r.unit());
            let radius = f.radius_low + t * (f.radius_high - f.radius_low);
            let radius = if t == 0.0 || t == 1.0 { radius * r.unit().sqrt() } else { radius };
            Point3::new(radius * angle.cos(), radius * angle.sin(), f.z_low + t * (f.z_high - f.z_low))
        }
    }
}

/// With the linear axes at 0, whatever the rotary axes do: bodies with more than one joint between
/// them, which are tested against each other, keep their clearances.
#[test]
fn bodies_of_presets_keep_clear_of_each_other() {
    let mut r = Random(3);
    for (name, ..) in PRESETS {
        // All axes of the propeller mill at 0 put the nose on the table.
        let machine = preset(name);
        let mut lift = AxisValues::zeros(5);
        lift[2] = if name == "head-b-table-c" { 1500.0 } else { 0.0 };
        let carriers: Vec<_> = machine.bodies().iter().map(|b| b.carrier()).collect();
        assert!(carriers.contains(&Some(Carrier::Head)), "{name} has no body on its head");
        assert!(carriers.iter().any(|c| *c != Some(Carrier::Head)), "{name} has no table");
        for _ in 0..60 {
            let rotary = random_values(&mut r, &machine, false);
            let q = AxisValues::from_fn(5, |k| rotary[k] + lift[k]);
            let poses: Vec<_> = machine.body_poses(&q).collect();
            for a in &poses {
                let others =
                    poses.iter().filter(|b| a.body.joints_from_table().abs_diff(b.body.joints_from_table()) > 1);
                for b in others {
                    let b_from_a: Isometry3<f64> = b.table_from_solid.inverse() * a.table_from_solid;
                    let near = (0..60)
                        .map(|_| b.body.body.solid.core_distance(&(b_from_a * surface(&a.body.body.solid, &mut r))))
                        .fold(f64::INFINITY, f64::min);
                    let keep = a.body.clearance + b.body.clearance;
                    assert!(near > keep, "{name}: {} {near} mm from {} at {q:?}", a.body.name(), b.body.name());
                }
            }
        }
    }
}

/// Of both heads of a dual mill, the linear axes at 0: so they are with a tool of 200 mm in each,
/// whatever the rotary axes do.
#[test]
fn heads_of_dual_mills_keep_clear_of_everything_at_the_zero_pose() {
    let mut r = Random(4);
    for (name, families) in DUALS {
        let heads = Machine::heads_from_json(preset_text(name).as_bytes()).unwrap();
        for (head, family) in heads.iter().zip(families) {
            assert_eq!(head.family().to_string(), family, "{name}");
            let tool = PlacedSolid {
                name: "tool of the other head".to_owned(),
                solid: Solid::Frustum(RoundFrustum {
                    z_low: 0.0,
                    z_high: 200.0,
                    radius_low: 40.0,
                    radius_high: 40.0,
                    rounding: 0.0,
                }),
                frame_from_solid: Isometry3::identity(),
            };
            let head = head.with_tool_in_other_head(&[tool], 200.0);
            for _ in 0..40 {
                let q = random_values(&mut r, &head, false);
                let poses: Vec<_> = head.body_poses(&q).collect();
                for (i, a) in poses.iter().enumerate() {
                    for (_, b) in poses.iter().enumerate().filter(|(k, _)| head.joints_between(i, *k) > 1) {
                        let b_from_a: Isometry3<f64> = b.table_from_solid.inverse() * a.table_from_solid;
                        let near = (0..40)
                            .map(|_| b.body.body.solid.core_distance(&(b_from_a * surface(&a.body.body.solid, &mut r))))
                            .fold(f64::INFINITY, f64::min);
                        let keep = a.body.clearance + b.body.clearance;
                        assert!(near > keep, "{name}: {} {near} mm from {} at {q:?}", a.body.name(), b.body.name());
                    }
                }
            }
        }
    }
}

#[test]
fn machine_check_tells_both_heads_and_what_they_share() {
    for (name, families) in DUALS {
        let file = workspace().join(format!("assets/machines/{name}.json"));
        let output = run(&[std::ffi::OsStr::new("machine"), "check".as_ref(), file.as_os_str()]);
        assert_eq!(code_and_errors(&output).0, 0);
        let text = String::from_utf8(output.stdout).unwrap();
        let (first, rest) = text.split_once("HEAD 2 of 2: tool_chains[1], channel 2").unwrap();
        let (second, both) = rest.split_once("BOTH HEADS").unwrap();
        for ((part, family), own) in [first, second].into_iter().zip(families).zip(["Z1", "Z2"]) {
            let other = if own == "Z1" { "Z2" } else { "Z1" };
            assert!(part.contains(family) && part.contains(own) && !part.contains(other), "{name}: {part}");
            assert!(part.contains("0 not found again") && part.contains("reach of the tool axis"), "{name}: {part}");
        }
        assert!(first.contains("tool axis (0, 0, 1)") && second.contains("tool axis (0, 0, -1)"), "{name}");
        assert!(both.contains("need the same value: C\n"), "{name}: {both}");
        assert!(both.contains("the shared axes on the same lines"), "{name}: {both}");
    }
}

#[test]
fn machine_check_tells_what_a_preset_is() {
    for (name, family, _) in PRESETS.into_iter().step_by(4) {
        let file = workspace().join(format!("assets/machines/{name}.json"));
        let output = run(&[std::ffi::OsStr::new("machine"), "check".as_ref(), file.as_os_str()]);
        assert_eq!(code_and_errors(&output).0, 0);
        let text = String::from_utf8(output.stdout).unwrap();
        for wanted in [
            family,
            "tool_chains[0].rows[0]",
            "zero pose",
            "reach of the tool axis",
            "assumed values",
            "0 not found again",
        ] {
            assert!(text.contains(wanted), "{name}: no {wanted} in\n{text}");
        }
    }
}

#[test]
fn wrong_machine_files_are_exit_2_with_field_and_axis() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("machine.json");
    let text = preset_text("table-table-a-c");
    for (from, to, message) in [
        ("\"min_deg\": -120.0", "\"min_deg\": 130.0", "range.limited.max_deg (axis A)"),
        ("\"value\": \"max_jerk\"", "\"value\": \"max_yerk\"", "max_jerk"),
        ("\"A\"", "\"C\"", "(axis C)"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let (code, errors) = code_and_errors(&run(&["machine", "check", path.to_str().unwrap()]));
        assert!(code == 2 && errors.contains(message) && errors.contains("machine.json"), "{code}: {errors}");
    }
    std::fs::write(&path, "<machine>\n  <axis id=\"U\"/>\n</machine>").unwrap();
    let (code, errors) = code_and_errors(&run(&["machine", "import", path.to_str().unwrap()]));
    assert!(code == 2 && errors.contains("machine.json: line 2, <axis id=\"U\">"), "{code}: {errors}");
}

#[test]
fn an_imported_machine_can_be_checked() {
    let Some(folder) = shared("data/machines") else { return };
    let out = tempfile::tempdir().unwrap();
    let written = out.path().join("fork.json");
    let source = folder.join("autodesk_5ax_table_head_xyzca.machine");
    let [source, target] = [&source, &written].map(|p| p.to_str().unwrap());
    assert_eq!(code_and_errors(&run(&["machine", "import", source, "--out", target])).0, 0);
    let output = run(&["machine", "check", target]);
    assert_eq!(code_and_errors(&output).0, 0);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("head-head C-A") && text.contains("bodies: none"), "{text}");
    let printed = run(&["machine", "import", source]).stdout;
    assert!(printed == std::fs::read(&written).unwrap());
}

/// Runs `machine new` for a family with options in one string, writing to this file.
fn new_machine(family: &str, options: &str, out: &std::path::Path) -> std::process::Output {
    let mut arguments = vec!["machine", "new", "--family", family, "-o", out.to_str().unwrap()];
    arguments.extend(options.split_whitespace());
    run(&arguments)
}

const MEASURED_FAMILIES: [(&str, &str); 8] = [
    ("table-table-bc", "table-table-b-c"),
    ("table-table-ac", "table-table-a-c"),
    ("head-table-bc", "head-b-table-c"),
    ("head-table-ac", "head-a-table-c"),
    ("head-nutating-table-bc", "head-b-nutating-table-c"),
    ("table-table-nutating-bc", "table-table-b-c-nutating"),
    ("head-head-ca", "head-head-c-a"),
    ("head-head-cb", "head-head-c-b"),
];

/// The options that a run prints as defaults make the same machine, with no default left, and it
/// moves as the preset.
#[test]
fn defaults_that_machine_new_prints_are_its_options() {
    let mut r = Random(5);
    let schema = serde_json::from_slice(&run(&["schema", "machine"]).stdout).expect("a schema is JSON");
    let validator = jsonschema::validator_for(&schema).expect("a schema that is one");
    let folder = tempfile::tempdir().unwrap();
    for (family, preset_name) in MEASURED_FAMILIES {
        let [first, second] = ["first", "second"].map(|name| folder.path().join(format!("{family}-{name}.json")));
        let output = new_machine(family, "", &first);
        assert_eq!(code_and_errors(&output).0, 0, "{family}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            text.contains(&format!("defaults of the preset {preset_name}")) && !text.contains("\nmeasured:"),
            "{text}"
        );
        assert!(text.contains("  --sense ") && text.contains(" --sense C=iso\n"), "{text}");
        let options: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  ")).collect();
        let output = new_machine(family, &options.join(" "), &second);
        assert_eq!(code_and_errors(&output).0, 0, "{family}: {options:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(!text.contains("defaults of") && text.contains("assumed, not an option: motion, feed"), "{text}");

        let read = |path| std::fs::read(path).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&read(&second)).unwrap();
        assert!(validator.is_valid(&json), "{family}");
        let json: serde_json::Value = serde_json::from_slice(&read(&first)).unwrap();
        assert!(validator.is_valid(&json), "{family}");
        let tilting = if family.ends_with("ac") || family.ends_with("ca") { "A" } else { "B" };
        let sense = serde_json::json!({ "value": "sense", "axes": [tilting, "C"] });
        assert!(json["assumed"].as_array().unwrap().contains(&sense), "{family}: {}", json["assumed"]);
        let [a, b] = [&first, &second].map(|path| Machine::from_json(&read(path)).unwrap());
        let preset = preset(preset_name);
        for _ in 0..50 {
            let q = random_values(&mut r, &preset, true);
            let expected = preset.forward(&q, 50.0);
            for machine in [&a, &b] {
                let pose = machine.forward(&q, 50.0);
                assert!((pose.translation.vector - expected.translation.vector).norm() < 1e-9, "{family}: {q:?}");
                assert!(pose.rotation.angle_to(&expected.rotation) < 1e-7, "{family}: {q:?}");
            }
        }
        let output = run(&["machine", "check", second.to_str().unwrap()]);
        assert_eq!(code_and_errors(&output).0, 0, "{family}");
        assert!(String::from_utf8(output.stdout).unwrap().contains("0 not found again"), "{family}");
    }
}

/// `--lines` writes the same machine as lines, and `machine check` names its chains.
#[test]
fn machines_are_written_and_checked_as_lines() {
    let mut r = Random(6);
    let folder = tempfile::tempdir().unwrap();
    let [rows, lines] = ["rows", "lines"].map(|name| folder.path().join(format!("{name}.json")));
    for (family, _) in MEASURED_FAMILIES {
        let leans = if family.contains("nutating") { " --lean -y" } else { "" };
        assert_eq!(code_and_errors(&new_machine(family, &format!("--force{leans}"), &rows)).0, 0, "{family}");
        assert_eq!(code_and_errors(&new_machine(family, &format!("--force --lines{leans}"), &lines)).0, 0, "{family}");
        let text = std::fs::read_to_string(&lines).unwrap();
        assert!(!text.contains("alpha_deg") && text.contains("\"direction\""), "{family}: {text}");
        let [a, b] = [&rows, &lines].map(|path| Machine::from_json(&std::fs::read(path).unwrap()).unwrap());
        for _ in 0..20 {
            let q = random_values(&mut r, &a, true);
            let off = a.forward(&q, 50.0).to_homogeneous() - b.forward(&q, 50.0).to_homogeneous();
            assert!(off.abs().max() < 1e-9, "{family}: {off}");
        }
        let output = run(&["machine", "check", lines.to_str().unwrap()]);
        assert_eq!(code_and_errors(&output).0, 0, "{family}");
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.starts_with("given by axis lines, from which the rows below are made: workpiece_chain"), "{text}");
        assert!(text.contains("0 not found again") && text.contains("toward -y") != leans.is_empty(), "{text}");
    }
}

#[test]
fn wrong_lines_are_exit_2_with_field_and_axis() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("machine.json");
    let options = "--lean -y --lines";
    assert_eq!(code_and_errors(&new_machine("head-nutating-table-bc", options, &path)).0, 0);
    let good: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let b = &good["tool_chains"][0]["lines"]["axes"][3];
    assert_eq!(b["direction"], serde_json::json!([0.0, 1.0, -1.0]), "{b}");
    let point = "/tool_chains/0/lines/axes/3/point_mm";
    let direction = "/tool_chains/0/lines/axes/3/direction";
    for (place, value, message) in [
        (direction, "[0, 0, 0]", "tool_chains[0].lines.axes[3].direction (axis B): is [0, 0, 0]"),
        (direction, "[0, 0, 1]", "the rotary axes C and B are parallel"),
        (direction, "[0, 1]", "tool_chains[0].lines.axes[3].direction, line"),
        (point, "null", "tool_chains[0].lines.axes[3].point_mm (axis B): is missing"),
        (point, "[0, \"NaN\", 0]", "tool_chains[0].lines.axes[3].point_mm[1], line"),
        ("/workpiece_chain", "{}", "workpiece_chain, line"),
        ("/tool_chains/0/lines/axes/3", "{}", "tool_chains[0].lines.axes[3], line"),
    ] {
        let mut file = good.clone();
        *file.pointer_mut(place).unwrap() = serde_json::from_str(value).unwrap();
        std::fs::write(&path, serde_json::to_string_pretty(&file).unwrap()).unwrap();
        let (code, errors) = code_and_errors(&run(&["machine", "check", path.to_str().unwrap()]));
        assert!(code == 2 && errors.contains(message) && errors.contains("machine.json"), "{place}: {code}: {errors}");
    }
    let mut both = good.clone();
    both["tool_chains"][0]["rows"] = serde_json::json!([]);
    std::fs::write(&path, both.to_string()).unwrap();
    let (code, errors) = code_and_errors(&run(&["machine", "check", path.to_str().unwrap()]));
    assert!(code == 2 && errors.contains("tool_chains[0], line 1") && errors.contains("both `rows`"), "{errors}");
    for (family, options, message) in [
        ("head-table-bc", "--lean -y", "--lean: is no option of the family head-table-bc"),
        ("head-nutating-table-bc", "--lean up", "\"up\" is neither +y nor -y"),
    ] {
        let (code, errors) = code_and_errors(&new_machine(family, options, &folder.path().join("new.json")));
        assert!(code == 2 && errors.contains(message), "{code}: {errors}");
    }
}

#[test]
fn machine_new_keeps_measured_values_and_files_that_exist() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("machine.json");
    let options = "--name mill --table-at -203.1,-204.7,-612.35 --table-tilt 0.012,0,62.48 --limits b=-35:110 \
                   --rapid B=18000 --reversed C";
    let output = new_machine("table-table-bc", options, &out);
    assert_eq!(code_and_errors(&output).0, 0);
    let text = String::from_utf8(output.stdout).unwrap();
    let (measured, defaults) = text.split_once("defaults of").unwrap();
    for part in
        ["--table-at -203.1,-204.7,-612.35", "--table-tilt 0.012,0,62.48", "--limits B=-35:110", "--sense C=reversed"]
    {
        assert!(measured.contains(part) && !defaults.contains(part), "{part}: {text}");
    }
    assert!(
        defaults.contains("--limits X=-380:380")
            && defaults.contains("--sense B=iso")
            && text.contains("it has no bodies"),
        "{text}"
    );
    let bytes = std::fs::read(&out).unwrap();
    let machine = Machine::from_json(&bytes).unwrap();
    assert_eq!(machine.name(), "mill");
    // With these readings the nose is where the table's origin is.
    let at = AxisValues::from([-203.1, -204.7, -612.35, 0.0, 0.7]);
    assert!(machine.forward(&at, 0.0).translation.vector.norm() < 1e-9);
    // Places are measured; of the senses that of B is not.
    let output = run(&["machine", "check", out.to_str().unwrap()]);
    let text = String::from_utf8(output.stdout).unwrap();
    let turns: Vec<&str> = text.lines().filter(|line| line.contains("turns about")).collect();
    let is_marked = |axis: &str| turns.iter().any(|line| line.trim_start().starts_with(axis) && line.ends_with(" *"));
    assert!(turns.len() == 2 && is_marked("B") && !is_marked("C"), "{text}");

    let (code, errors) = code_and_errors(&new_machine("head-head-ca", "", &out));
    assert!(code == 2 && errors.contains("machine.json: exists; --force"), "{code}: {errors}");
    assert!(std::fs::read(&out).unwrap() == bytes);
    assert_eq!(code_and_errors(&new_machine("table-table-bc", &format!("--force {options}"), &out)).0, 0);
    assert!(std::fs::read(&out).unwrap() == bytes);
}

/// The drawing has the nose and the pivot at their measured places, is that of `machine draw`, and
/// replaces no file unasked.
#[test]
fn machine_new_draws_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let [out, drawing, again] = ["mill.json", "mill.svg", "again.svg"].map(|name| folder.path().join(name));
    let options = "--table-at -203.1,-204.7,-612.35 --table-tilt 0.012,0,62.48 --sense B=iso --reversed C";
    let output = new_machine("table-table-bc", options, &out);
    assert_eq!(code_and_errors(&output).0, 0);
    assert!(String::from_utf8(output.stdout).unwrap().contains("mill.svg"));
    let svg = std::fs::read_to_string(&drawing).unwrap();
    for text in [
        ">nose: X 203.1, Y 204.7, Z 612.35<",
        ">table tilt B: X 0.012, Y 0, Z 62.48<",
        ">C, table: turns about (0, 0, -1); endless *<",
        ">B, table: turns about (0, 1, 0); -120 to 120° *<",
    ] {
        assert!(svg.contains(text), "{text} in {svg}");
    }
    let draw = |out: &std::path::Path, more: &[&str]| {
        let mill = out.with_file_name("mill.json");
        let words = ["machine", "draw", mill.to_str().unwrap(), "-o", out.to_str().unwrap()];
        run(&[&words[..], more].concat())
    };
    assert_eq!(code_and_errors(&draw(&again, &[])).0, 0);
    assert_eq!(std::fs::read_to_string(&again).unwrap(), svg);
    let (code, errors) = code_and_errors(&draw(&again, &[]));
    assert!(code == 2 && errors.contains("again.svg: exists; --force"), "{code}: {errors}");
    assert_eq!(code_and_errors(&draw(&again, &["--force"])).0, 0);
    // A drawing of before stays, and then nothing is written.
    std::fs::remove_file(&out).unwrap();
    let (code, errors) = code_and_errors(&new_machine("table-table-bc", options, &out));
    assert!(code == 2 && errors.contains("mill.svg: exists; --force") && !out.exists(), "{code}: {errors}");
    let other = format!("{options} --drawing {}", folder.path().join("other.svg").display());
    assert_eq!(code_and_errors(&new_machine("table-table-bc", &other, &out)).0, 0);
    assert_eq!(std::fs::read_to_string(folder.path().join("other.svg")).unwrap(), svg);
    let same = format!("{options} --force --drawing {}", out.display());
    let (code, errors) = code_and_errors(&new_machine("table-table-bc", &same, &out));
    assert!(code == 2 && errors.contains("is named for two files"), "{code}: {errors}");
}

/// A trunnion B-C by hand: readings with which the tip touches a point of the table, from turns of
/// the point about B and C in the plane of x and z and that of x and y.
fn touch([x, y, z]: [f64; 3], tilt: f64, c: f64, at: [f64; 3], tilt_z: f64, length: f64) -> String {
    let (sin, cos) = (-c.to_radians()).sin_cos();
    let [x, y] = [cos * x - sin * y, sin * x + cos * y];
    let (sin, cos) = (-tilt.to_radians()).sin_cos();
    let z = z - tilt_z;
    let [x, z] = [cos * x + sin * z, cos * z - sin * x + tilt_z];
    format!("X={},Y={},Z={},B={tilt},C={c}", x + at[0], y + at[1], z + at[2] + length)
}

#[test]
fn machine_check_finds_a_swapped_sense_from_two_poses() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("mill.json");
    let (at, tilt, length) = ([-203.1, -204.7, -612.35], 62.48, 152.31);
    let point = [120.0, -35.0, 40.0];
    let poses = [(0.0, 0.0), (25.0, 70.0)].map(|(b, c)| touch(point, b, c, at, tilt, length));
    let check = |options: &str, more: &[&str]| {
        let options = format!("--force --table-at -203.1,-204.7,-612.35 {options}");
        assert_eq!(code_and_errors(&new_machine("table-table-bc", &options, &out)).0, 0);
        let words = ["machine", "check", out.to_str().unwrap(), "--tool-length-mm", "152.31"];
        let touches = ["--touch", &poses[0], "--touch", &poses[1]];
        let output = run(&[&words[..], &touches, more].concat());
        let (code, errors) = code_and_errors(&output);
        (code, String::from_utf8(output.stdout).unwrap(), errors)
    };
    let (code, text, errors) = check("--table-tilt 0,0,62.48", &[]);
    assert!(code == 0 && text.contains("measured poses: agree, tips 0.0000 mm apart"), "{text}{errors}");
    let (code, text, errors) = check("--table-tilt 0,0,62.48 --reversed C", &[]);
    assert!(code == 2 && text.contains("DO NOT AGREE"), "{text}");
    assert!(errors.contains("mill.json") && errors.contains("another sign of sense of C"), "{errors}");
    let (code, text, errors) = check("--table-tilt 0,0,-62.48", &[]);
    let expected = "other sign of Z of the B axis, seen from the table's origin";
    assert!(code == 2 && text.contains(expected) && errors.contains(expected), "{text}{errors}");
    // Both wrong at once.
    let (code, _, errors) = check("--table-tilt 0,0,-62.48 --reversed B", &[]);
    assert!(code == 2 && errors.contains("sense of B and Z of the B axis"), "{errors}");
    let (code, _, errors) = check("--table-tilt 0,0,70", &[]);
    assert!(code == 2 && errors.contains("measure pivots and readings again"), "{errors}");
    // The same with the point known: the sense of X can be wrong, too.
    let known = ["--touch-point", "120,-35,40"];
    assert_eq!(check("--table-tilt 0,0,62.48", &known).0, 0);
    let (code, _, errors) = check("--table-tilt 0,0,62.48 --reversed X", &known);
    assert!(code == 2 && errors.contains("sense of X"), "{errors}");
    for (more, message) in [
        (&["--touch", "X=1,Y=2,Z=3,B=0"][..], "pose 3 has no reading of C"),
        (&["--touch", "X=1,Y=2,Z=3,A=0,B=0,C=0"], "pose 3 has a reading of A too many"),
        (&["--touch", "X1"], "is not of the form X=-12.5"),
        (&["--touch-tolerance-mm", "0"], "tolerance is 0"),
        (&["--touch-point", "1,2"], "--touch-point"),
    ] {
        let (code, _, errors) = check("--table-tilt 0,0,62.48", more);
        assert!(code == 2 && errors.contains(message), "{message}: {code} {errors}");
    }
    let (code, errors) = code_and_errors(&run(&["machine", "check", out.to_str().unwrap(), "--touch", &poses[0]]));
    assert!(code == 2 && errors.contains("--tool-length-mm"), "{errors}");
}

#[test]
fn wrong_options_of_machine_new_are_exit_2_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("machine.json");
    for (family, options, parts) in [
        ("table-y", "", ["--family", "table-table-bc"]),
        ("table-table-bc", "--pivot-length 200", ["--pivot-length", "--table-tilt"]),
        ("head-table-bc", "--table-tilt 0,0,1", ["--table-tilt", "--pivot-length"]),
        ("head-table-bc", "--c-offset 0,1", ["--c-offset", "head-table-bc"]),
        ("head-head-ca", "--pivot-length long", ["--pivot-length", "long"]),
        ("table-table-bc", "--table-at 1,2", ["--table-at", "3 numbers"]),
        ("table-table-bc", "--table-at 1,nan,2", ["--table-at", "nan"]),
        ("table-table-bc", "--table-at 1,2,3e9", ["--table-at", "unit"]),
        ("table-table-bc", "--rapid A=100", ["--rapid", "A is no axis of table-table-bc"]),
        ("table-table-bc", "--reversed A", ["--reversed", "A is no axis"]),
        ("table-table-bc", "--reversed C --reversed C", ["--reversed", "twice for C"]),
        ("table-table-bc", "--reversed C --sense C=iso", ["--sense, --reversed", "twice for C"]),
        ("table-table-bc", "--sense A=iso", ["--sense", "A is no axis"]),
        ("table-table-bc", "--sense C", ["--sense", "AXIS=reversed"]),
        ("table-table-bc", "--sense C=left", ["--sense", "AXIS=reversed"]),
        ("head-table-bc", "--pivot-length 0", ["--pivot-length", "above 0"]),
        ("head-head-ca", "--pivot-length -165", ["--pivot-length", "turn its sign"]),
        ("table-table-bc", "--limits B=5:-5", ["--limits", "of B"]),
        ("table-table-bc", "--limits B=5", ["--limits", "MIN:MAX"]),
        ("table-table-bc", "--limits X=endless", ["--limits", "linear"]),
        ("table-table-bc", "--limits B=0:1 --limits B=0:2", ["--limits", "twice for B"]),
        ("table-table-bc", "--limits B=-9e9:9e9", ["--limits", "value of B"]),
        ("table-table-bc", "--limits B=0:10 --home B=11", ["--home", "outside its limits 0 to 10"]),
        ("table-table-bc", "--rapid B=0", ["--rapid", "value of B"]),
        ("table-table-bc", "--acceleration X=-1", ["--acceleration", "value of X"]),
        ("table-table-bc", "--jerk X=1e99", ["--jerk", "value of X"]),
        ("table-table-bc", "--jerk X", ["--jerk", "X=100"]),
    ] {
        let (code, errors) = code_and_errors(&new_machine(family, options, &out));
        assert!(code == 2 && parts.iter().all(|part| errors.contains(part)), "{family} {options}: {code}: {errors}");
        assert!(!out.exists(), "{family} {options}");
    }
    for name in ["", " ", "\t\u{a0}"] {
        let path = out.to_str().unwrap();
        let output = run(&["machine", "new", "--family", "table-table-bc", "-o", path, "--name", name]);
        let (code, errors) = code_and_errors(&output);
        assert!(code == 2 && errors.contains("--name") && errors.contains("blank"), "{name:?}: {code}: {errors}");
        assert!(!out.exists(), "{name:?}");
    }
    let (code, errors) = code_and_errors(&run(&["machine", "new", "--family", "table-table-bc"]));
    assert!(code == 2 && errors.contains("--out"), "{code}: {errors}");
}
