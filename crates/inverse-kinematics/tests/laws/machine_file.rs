//! Content of a machine file, and refusals.

use crate::common::*;
use facemill_cl_data::{CuttingLaw, RapidLaw, Solid};
use facemill_inverse_kinematics::machine_file::{
    AssumedFile, AssumedValue, BodyFile, DhRow, Joint, MachineFile, PrismaticJoint, RevoluteJoint, Sense, ShapeFile,
    machine_schema,
};
use facemill_inverse_kinematics::*;
use nalgebra::{Matrix4, Point3, Vector3};
use serde_json::{Value, json};

fn refusal(change: impl FnOnce(&mut MachineFile)) -> String {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    change(&mut file);
    Machine::from_file(file).unwrap_err().to_string()
}

fn prismatic(row: &mut DhRow) -> &mut PrismaticJoint {
    match row.joint.as_mut() {
        Some(Joint::Prismatic(j)) => j,
        other => panic!("{other:?}"),
    }
}

fn revolute(row: &mut DhRow) -> &mut RevoluteJoint {
    match row.joint.as_mut() {
        Some(Joint::Revolute(j)) => j,
        other => panic!("{other:?}"),
    }
}

#[test]
fn preset_is_the_machine_it_says() {
    let machine = Machine::head_b_table_c().unwrap();
    let letters: Vec<_> = machine.axes().iter().map(|a| a.letter.to_string()).collect();
    assert_eq!(letters, ["X", "Y", "Z", "B", "C"]);
    let carriers: Vec<_> = machine.axes().iter().map(|a| a.carried_by).collect();
    assert_eq!(carriers, [Carrier::Head, Carrier::Head, Carrier::Head, Carrier::Head, Carrier::Table]);
    let [x, b, c] = [0, 3, 4].map(|k| &machine.axes()[k]);
    assert!((x.max_velocity - 250.0).abs() < 1e-12 && (b.max_velocity.to_degrees() - 60.0).abs() < 1e-12);
    assert!(c.endless && !b.endless && (b.max.to_degrees() - 110.0).abs() < 1e-12);
    let law = machine.motion_law();
    assert_eq!((law.cutting, law.rapid), (CuttingLaw::AxesLinear, RapidLaw::Linear));
    // With all axes at 0 the nose is in the origin, the tool below it.
    let pose = machine.forward(&AxisValues::zeros(5), 200.0);
    assert!((pose.translation.vector - Vector3::new(0.0, 0.0, -200.0)).norm() < 1e-12);
    // B tilts about a pivot 350 mm above the nose, toward +x.
    let tilted = machine.cl_point(&AxisValues::from([0.0, 0.0, 0.0, 0.5, 0.0]), 200.0);
    let expected = Point3::new(-550.0 * 0.5_f64.sin(), 0.0, 350.0 - 550.0 * 0.5_f64.cos());
    assert!((tilted.tip - expected).norm() < 1e-10 && (tilted.axis.x - 0.5_f64.sin()).abs() < 1e-12);
    // By ISO 841 positive C turns the tool right-handed about the still workpiece.
    let turned = machine.cl_point(&AxisValues::from([100.0, 0.0, 0.0, 0.0, 0.5]), 0.0);
    assert!((turned.tip - Point3::new(100.0 * 0.5_f64.cos(), 100.0 * 0.5_f64.sin(), 0.0)).norm() < 1e-10);
}

#[test]
fn every_preset_is_in_the_library_by_its_name() {
    let mut files: Vec<String> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/presets/machines"))
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    files.sort_unstable();
    assert_eq!(preset_names().to_vec(), files);
    for name in preset_names() {
        let heads = Machine::heads_from_json(preset(name).unwrap().as_bytes()).unwrap();
        assert_eq!(heads.len(), if name.starts_with("dual") { 2 } else { 1 }, "{name}");
    }
    assert_eq!(preset("lathe"), None);
}

#[test]
fn a_written_file_is_read_back_the_same() {
    for machine in families() {
        let text = facemill_file_format::to_json(&machine.to_file());
        assert_eq!(Machine::from_json(text.as_bytes()).unwrap(), machine);
    }
}

#[test]
fn schema_knows_every_key_of_the_preset() {
    let schema = machine_schema();
    for line in preset_head_b_table_c().lines().filter_map(|l| l.trim().strip_prefix('"')) {
        let key = line.split('"').next().unwrap();
        assert!(schema.contains(&format!("\"{key}\"")), "{key} is not in the schema");
    }
    assert!(schema.contains("facemill-machine/1"));
}

#[test]
fn faults_are_reported_with_field_and_axis() {
    assert_eq!(
        refusal(|f| prismatic(&mut f.tool_chains[0].rows[1]).max_mm = -3000.0),
        "tool_chains[0].rows[1].joint.prismatic.max_mm (axis X): is -3000, which is below the minimum -2600"
    );
    assert_eq!(
        refusal(|f| prismatic(&mut f.tool_chains[0].rows[2]).home_mm = 9000.0),
        "tool_chains[0].rows[2].joint.prismatic.home_mm (axis Z): is 9000, which is outside the limits -350 to 3250"
    );
    assert_eq!(
        refusal(|f| revolute(&mut f.workpiece_chain.rows[0]).max_velocity_deg_min = 0.0),
        "workpiece_chain.rows[0].joint.revolute.max_velocity_deg_min (axis C): is 0.0, but has to be from 1 to 10000000: is the unit \
         right?"
    );
    assert!(
        refusal(|f| revolute(&mut f.tool_chains[0].rows[3]).axis = "Q".into()).contains("rows[3].joint.revolute.axis")
    );
    assert_eq!(
        refusal(|f| revolute(&mut f.tool_chains[0].rows[3]).axis = "C".into()),
        "tool_chains[0].rows[3].joint (axis C): is the address of another joint already; axes of a second head \
             take a number (X2), and an axis that two heads share belongs in workpiece_chain alone"
    );
    assert!(refusal(|f| f.tool_chains[0].rows[4].d_mm = f64::NAN).starts_with("tool_chains[0].rows[4].d_mm: "));
    assert!(refusal(|f| f.tool_chains[0].rows[4].bodies[1].clearance_mm = -1.0).contains("bodies[1].clearance_mm"));
    assert!(refusal(|f| f.tool_chains[0].rows[4].bodies[0].name.clear()).contains("bodies[0].name"));
    let far = |f: &mut MachineFile| f.tool_chains[0].rows[4].bodies[0].position_mm[1] = 2e6;
    assert!(
        refusal(far).ends_with("bodies[0].position_mm[1]: is 2000000, more than 1000000 from 0: is the unit right?")
    );
    assert!(refusal(|f| f.tool_chains[0].rows[2].a_mm = -1e300).contains("rows[2].a_mm (axis Z): is -1"));
    assert!(refusal(|f| prismatic(&mut f.tool_chains[0].rows[1]).max_mm = 1e7).contains("max_mm (axis X): is 1000"));
    assert!(refusal(|f| f.feed.max_mm_min = 0.5).starts_with("feed.max_mm_min"));
    assert!(refusal(|f| f.motion.control_tolerance.path_mm = -0.1).contains("control_tolerance.path_mm"));
}

/// Returns every number of a file with this key, as paths of JSON; the first entry of a list.
fn places(value: &Value, key: &str, at: &str, found: &mut Vec<String>) {
    let children: Vec<(String, &Value)> = match value {
        Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
        Value::Array(list) => list.iter().enumerate().map(|(k, v)| (k.to_string(), v)).collect(),
        _ => return,
    };
    for (name, child) in children {
        let here = format!("{at}/{name}");
        if name == key {
            found.push(if child.is_array() { format!("{here}/0") } else { here.clone() });
        }
        places(child, key, &here, found);
    }
}

/// Returns the preset with every optional key, one joint with limits and one endless.
fn full() -> Value {
    let mut file: Value = serde_json::from_str(preset_head_b_table_c()).unwrap();
    file["feed"]["rapid_mm_min"] = json!(24_000);
    file["tool_change_s"] = json!(15);
    let c = &mut file["workpiece_chain"]["rows"][0]["joint"]["revolute"];
    c["max_wind_up_turns"] = json!(10);
    c["home_deg"] = json!(0);
    file["motion"]["control_tolerance"] = json!({ "path_mm": 0.01, "orientation_deg": 0.01 });
    file["workpiece_chain"]["rows"][0]["bodies"][0]["rotation_xyz_deg"] = json!([0, 0, 0]);
    file
}

#[test]
fn values_beyond_their_limits_are_refused_with_field_and_limits_and_those_within_are_read() {
    let read = |file: &Value| Machine::from_json(file.to_string().as_bytes()).map_err(|e| e.to_string());
    read(&full()).unwrap();
    for limit in MACHINE_LIMITS {
        let mut found = Vec::new();
        places(&full(), limit.key, "", &mut found);
        assert!(!found.is_empty(), "{}", limit.key);
        for place in found {
            let with = |value: f64| {
                let mut file = full();
                *file.pointer_mut(&place).unwrap() = json!(value);
                read(&file)
            };
            let range = format!("has to be from {} to {}", limit.least, limit.most);
            let beyond = |value: f64, away: f64| value + away * (1e-3 * value.abs()).max(1e-6);
            for outside in [beyond(limit.least, -1.0), beyond(limit.most, 1.0), 1e300, -1e300] {
                let e = with(outside).unwrap_err();
                assert!(e.contains(limit.key) && e.contains(&range), "{place} {outside}: {e}");
            }
            // Within this limit, another law may refuse it: a home outside of its axis.
            for inside in [limit.least, limit.most] {
                let is_taken = with(inside).map_or_else(|e| !e.contains(&range), |_| true);
                assert!(is_taken, "{place} {inside}");
            }
        }
    }
}

#[test]
fn unknown_keys_and_formats_are_refused_with_the_nearest() {
    let text = preset_head_b_table_c();
    let typo = text.replacen("max_velocity_deg_min", "max_velocty_deg_min", 1);
    match Machine::from_json(typo.as_bytes()).unwrap_err() {
        MachineError::Format(e) => {
            assert!(e.field.starts_with("workpiece_chain.rows[0].joint"), "{e}");
            assert_eq!(e.hint.as_deref(), Some("did you mean `max_velocity_deg_min`?"));
        }
        e => panic!("{e}"),
    }
    let version = text.replace("facemill-machine/1", "facemill-machine/7");
    assert!(Machine::from_json(version.as_bytes()).unwrap_err().to_string().contains("format"));
    for cut in 0..text.len() - 1 {
        assert!(Machine::from_json(&text.as_bytes()[..cut]).is_err());
    }
}

#[test]
fn structures_without_a_closed_solution_are_refused_by_name() {
    let c = || rotary("C", Sense::Negative, None, row(0.0, 0.0, 0.0, 0.0));
    let three_axes = Machine::from_file(file(Vec::new(), head_yxz())).unwrap_err();
    assert_eq!(three_axes, MachineError::UnsupportedStructure { head: 0, n_linear: 3, n_rotary: 0 });
    let mut parallel = head_yxz();
    parallel.push(rotary("A", Sense::Positive, None, row(50.0, 0.0, 0.0, 0.0)));
    assert!(matches!(
        Machine::from_file(file(vec![c()], parallel)).unwrap_err(),
        MachineError::ParallelRotaries { first, second } if first == "C" && second == "A"
    ));
    let mut along = head_yxz();
    along.push(rotary("B", Sense::Positive, None, row(0.0, -90.0, 0.0, 0.0)));
    along.push(rotary("C", Sense::Positive, None, row(0.0, 90.0, 0.0, 0.0)));
    assert!(matches!(
        Machine::from_file(file(Vec::new(), along)).unwrap_err(),
        MachineError::ToolAlongRotary { axis } if axis == "C"
    ));
    let flat = vec![
        linear("Y", row(0.0, -90.0, 0.0, 90.0)),
        linear("X", row(0.0, 90.0, 0.0, 90.0)),
        linear("Z", row(0.0, 0.0, 0.0, 0.0)),
        rotary("B", Sense::Positive, None, row(0.0, 40.0, 0.0, 0.0)),
        row(0.0, 90.0, 0.0, 0.0),
    ];
    assert!(matches!(Machine::from_file(file(vec![c()], flat)).unwrap_err(), MachineError::DependentLinears { .. }));
}

#[test]
fn bodies_move_with_their_links() {
    let mut r = Random(31);
    let body = |name: &str| BodyFile {
        name: name.to_owned(),
        shape: ShapeFile::Cylinder { radius_mm: 30.0, height_mm: 50.0 },
        position_mm: [10.0, -20.0, 30.0],
        rotation_xyz_deg: [20.0, -50.0, 110.0],
        clearance_mm: 2.0,
    };
    for machine in families() {
        let mut file = machine.to_file();
        for row in file.workpiece_chain.rows.iter_mut().chain(&mut file.tool_chains[0].rows) {
            row.bodies = vec![body("on a row")];
        }
        file.bed_bodies = vec![body("on the bed")];
        let machine = Machine::from_file(file.clone()).unwrap();
        for _ in 0..20 {
            let q = random_values(&mut r, &machine);
            let table_from_bed = craig_chain(&file.workpiece_chain.rows, &machine, &q).try_inverse().unwrap();
            assert_eq!(machine.body_poses(&q).len(), machine.bodies().len());
            for pose in machine.body_poses(&q) {
                let bed_from_link = match pose.body.link {
                    LinkId::Bed => Matrix4::identity(),
                    LinkId::Row { carrier, row } => {
                        let rows = match carrier {
                            Carrier::Table => &file.workpiece_chain.rows,
                            Carrier::Head => &file.tool_chains[0].rows,
                            Carrier::OtherHead => panic!("there is one head"),
                        };
                        craig_chain(&rows[..=row], &machine, &q)
                    }
                };
                let turn = |axis: Vector3<f64>, deg: f64| Matrix4::new_rotation(axis * deg.to_radians());
                let link_from_solid = Matrix4::new_translation(&Vector3::new(10.0, -20.0, 30.0))
                    * turn(Vector3::z(), 110.0)
                    * turn(Vector3::y(), -50.0)
                    * turn(Vector3::x(), 20.0);
                let expected = table_from_bed * bed_from_link * link_from_solid;
                assert!((pose.table_from_solid.to_homogeneous() - expected).abs().max() < 1e-9);
            }
        }
        // The clearance is in the solid: 2 mm beside the wall is on its surface.
        let beside = Point3::new(32.0, 0.0, 25.0);
        assert!(machine.bodies().iter().all(|b| b.body.solid.distance(&beside).abs() < 1e-12));
    }
}

#[test]
fn shapes_are_placed_as_the_file_says() {
    let machine = Machine::head_b_table_c().unwrap();
    let named = |name: &str| machine.bodies().iter().find(|b| b.name() == name).unwrap();
    assert_eq!(named("table").carrier(), Some(Carrier::Table));
    assert_eq!(named("head").carrier(), Some(Carrier::Head));
    assert!(matches!(named("head").body.solid, Solid::Box(b) if b.half_extents == Vector3::new(150.0, 150.0, 250.0)));
    assert!(matches!(named("spindle nose").body.solid, Solid::Frustum(f)
        if (f.z_low, f.z_high, f.radius_low, f.radius_high, f.rounding) == (0.0, 250.0, 90.0, 90.0, 5.0)));
    // The nose body is on the nose, behind the tool, in every pose.
    let q = AxisValues::from([100.0, 200.0, 700.0, -0.8, 2.0]);
    let pose = machine.body_poses(&q).find(|p| p.body.name() == "spindle nose").unwrap();
    let nose = machine.forward(&q, 0.0);
    assert!((pose.table_from_solid.to_homogeneous() - nose.to_homogeneous()).abs().max() < 1e-10);
}

#[test]
fn assumed_values_are_reported_and_those_of_no_axis_refused() {
    let assumed = |value, axes: &[&str]| AssumedFile { value, axes: axes.iter().map(|&a| a.to_owned()).collect() };
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    file.assumed = vec![assumed(AssumedValue::MaxJerk, &["B"]), assumed(AssumedValue::Limits, &[])];
    let text = facemill_file_format::to_json(&file);
    let file = Machine::from_json(text.as_bytes()).unwrap().to_file();
    assert!(file.is_assumed(AssumedValue::MaxJerk, "B") && !file.is_assumed(AssumedValue::MaxJerk, "C"));
    assert!(file.is_assumed(AssumedValue::Limits, "X") && !file.is_assumed(AssumedValue::Home, "X"));
    let unknown = refusal(|f| f.assumed = vec![assumed(AssumedValue::MaxJerk, &["B", "A"])]);
    assert_eq!(unknown, "assumed[0].axes[1] (axis A): is the address of no joint");
    let whole = refusal(|f| f.assumed = vec![assumed(AssumedValue::Motion, &["B"])]);
    assert!(whole.starts_with("assumed[0].axes[0] (axis B): ") && whole.contains("leave `axes` out"), "{whole}");
    assert_eq!(refusal(|f| f.source = Some(" ".to_owned())), "source: is empty");
    let nose = refusal(|f| f.tool_chains[0].tool_interface = Some(String::new()));
    assert_eq!(nose, "tool_chains[0].tool_interface: is empty");
}
