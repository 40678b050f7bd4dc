//! Machine files that give the lines of axes: the machine is that of the rows, and wrong lines are
//! named.

use crate::common::*;
use facemill_inverse_kinematics::machine_file::{
    BodyFile, DhRow, Joint, LineChain, LineFile, MachineFile, PlaceFile, ShapeFile,
};
use facemill_inverse_kinematics::*;
use nalgebra::{Matrix4, Rotation3, Vector3};
use serde_json::{Value, json};

/// Turns about the fixed x, y and z axis, and position of a frame.
fn place(frame: &Matrix4<f64>) -> PlaceFile {
    let turn = Rotation3::from_matrix_unchecked(frame.fixed_view::<3, 3>(0, 0).into_owned());
    let (x, y, z) = turn.euler_angles();
    PlaceFile {
        position_mm: frame.column(3).xyz().into(),
        rotation_xyz_deg: [x.to_degrees(), y.to_degrees(), z.to_degrees()],
    }
}

fn matrix(place: &PlaceFile) -> Matrix4<f64> {
    let [x, y, z] = place.rotation_xyz_deg.map(f64::to_radians);
    Matrix4::new_translation(&Vector3::from(place.position_mm)) * Rotation3::from_euler_angles(x, y, z).to_homogeneous()
}

/// Lines of a chain by Craig's matrices with all axes at 0: points anywhere on them, directions of
/// any length. Bodies of fixed rows move with the joint before them.
fn lines_of(rows: &[DhRow], r: &mut Random) -> LineChain {
    let mut frame = Matrix4::<f64>::identity();
    let mut axes: Vec<LineFile> = Vec::new();
    for row in rows {
        frame *= craig(row, &|_| 0.0);
        if let Some(joint) = &row.joint {
            let z = frame.column(2).xyz();
            let point = frame.column(3).xyz() + z * r.between(-300.0, 300.0);
            let is_rotary = matches!(joint, Joint::Revolute(_));
            axes.push(LineFile {
                joint: joint.clone(),
                direction: (z * 10_f64.powf(r.between(-3.0, 3.0))).into(),
                point_mm: is_rotary.then(|| point.into()),
                bodies: Vec::new(),
            });
        }
        for body in &row.bodies {
            let own = PlaceFile { position_mm: body.position_mm, rotation_xyz_deg: body.rotation_xyz_deg };
            let PlaceFile { position_mm, rotation_xyz_deg } = place(&(frame * matrix(&own)));
            let moved = BodyFile { position_mm, rotation_xyz_deg, ..body.clone() };
            axes.last_mut().expect("bodies of presets are on joints").bodies.push(moved);
        }
    }
    LineChain { axes, end: place(&frame) }
}

/// The file of a preset with lines in place of rows.
fn by_lines(mut file: MachineFile, r: &mut Random) -> MachineFile {
    file.workpiece_chain.lines = Some(lines_of(&file.workpiece_chain.rows, r));
    file.workpiece_chain.rows.clear();
    for chain in &mut file.tool_chains {
        chain.lines = Some(lines_of(&chain.rows, r));
        chain.rows.clear();
    }
    file
}

fn rows_of_preset(name: &str) -> MachineFile {
    facemill_file_format::from_json(preset(name).unwrap().as_bytes()).unwrap()
}

#[test]
fn every_preset_given_by_lines_is_the_same_machine() {
    let mut r = Random(97);
    for name in preset_names() {
        let file = rows_of_preset(name);
        let text = facemill_file_format::to_json(&by_lines(file.clone(), &mut r));
        assert!(!text.contains("\"rows\""), "{name}");
        let read: MachineFile = facemill_file_format::from_json(text.as_bytes()).unwrap();
        assert_eq!(facemill_file_format::to_json(&read), text, "{name}");
        let views = Machine::heads_from_json(text.as_bytes()).unwrap();
        for (a, b) in Machine::heads(file).unwrap().iter().zip(&views) {
            assert_eq!(a.axes(), b.axes(), "{name}");
            assert_eq!(a.family().to_string(), b.family().to_string(), "{name}");
            assert_same_motion(name, a, b, &mut r);
        }
        // The file of the machine has rows, and makes the same machine again.
        let again = Machine::heads(views[0].to_file()).unwrap();
        assert_eq!(again, views, "{name}");
    }
}

/// The lines that the library makes of rows are those of the preset, too.
#[test]
fn every_preset_by_lines_of_the_library_is_the_same_machine() {
    let mut r = Random(98);
    for name in preset_names() {
        let file = rows_of_preset(name);
        let lines = file.clone().by_lines();
        assert_eq!(lines.clone().by_lines(), lines, "{name}");
        let views = Machine::heads(lines).unwrap();
        for (a, b) in Machine::heads(file).unwrap().iter().zip(&views) {
            assert_same_motion(name, a, b, &mut r);
        }
    }
}

/// A body that a chain has before its first joint is one of the bed.
#[test]
fn bodies_before_the_first_joint_become_those_of_the_bed() {
    let mut file = rows_of_preset("head-b-table-c");
    let mut probe = file.workpiece_chain.rows[0].bodies[0].clone();
    probe.name = "probe".to_owned();
    file.workpiece_chain.rows.insert(0, DhRow { bodies: vec![probe], ..row(30.0, 20.0, 7.0, 50.0) });
    let [a, b] = [file.clone(), file.by_lines()].map(|file| Machine::from_file(file).unwrap());
    let q = AxisValues::from([10.0, 20.0, 30.0, 0.4, 0.5]);
    let probe = |machine: &Machine| {
        let probe = machine.body_poses(&q).find(|pose| pose.body.name() == "probe").unwrap();
        (probe.table_from_solid.to_homogeneous(), probe.body.link)
    };
    let [(in_rows, row), (in_lines, bed)] = [probe(&a), probe(&b)];
    assert_eq!((row, bed), (LinkId::Row { carrier: Carrier::Table, row: 0 }, LinkId::Bed));
    assert!((in_rows - in_lines).abs().max() < 1e-9);
}

/// Asserts that two machines have the same poses, axis values and bodies.
fn assert_same_motion(name: &str, a: &Machine, b: &Machine, r: &mut Random) {
    for _ in 0..100 {
        let q = random_values(r, a);
        let length = r.between(0.0, 300.0);
        let expected = forward_by_matrices(a, &q, length);
        let difference: Matrix4<f64> = b.forward(&q, length).to_homogeneous() - expected;
        let (turn, shift) = (difference.fixed_view::<3, 3>(0, 0).abs().max(), difference.column(3).abs().max());
        assert!(turn < 1e-12 && shift < 1e-9, "{name}: {turn:e}, {shift:e} mm at {q:?}");

        let cl = cl_by_matrices(a, &q, length);
        let (by_rows, by_lines) = (a.inverse(&cl, length).unwrap(), b.inverse(&cl, length).unwrap());
        assert_eq!(by_rows.len(), by_lines.len(), "{name}: {q:?}");
        for one in by_rows.iter() {
            let other = by_lines.iter().map(|s| difference_of(a, &one.values, &s.values)).fold(f64::INFINITY, f64::min);
            assert!(other < 1.0, "{name}: {other} times the tolerance at {q:?}");
        }

        let bodies = a.body_poses(&q).zip(b.body_poses(&q));
        assert_eq!(a.bodies().len(), b.bodies().len(), "{name}");
        for (of_rows, of_lines) in bodies {
            assert_eq!(of_rows.body.name(), of_lines.body.name(), "{name}");
            assert_eq!(of_rows.body.joints_from_table(), of_lines.body.joints_from_table(), "{name}");
            let off = (of_rows.table_from_solid.to_homogeneous() - of_lines.table_from_solid.to_homogeneous()).abs();
            assert!(off.max() < 1e-9, "{name}: {} is off by {:e}", of_rows.body.name(), off.max());
        }
    }
}

/// Largest difference of two positions in multiples of 1e-9 mm and 1e-12 rad.
fn difference_of(machine: &Machine, a: &AxisValues, b: &AxisValues) -> f64 {
    let (linear, rotary) = difference(machine, a, b);
    (linear / 1e-9).max(rotary / 1e-12)
}

/// The text of a preset by lines, changed.
fn changed(name: &str, change: impl FnOnce(&mut Value)) -> String {
    let file = by_lines(rows_of_preset(name), &mut Random(5));
    let mut json = serde_json::to_value(file).unwrap();
    change(&mut json);
    json.to_string()
}

#[test]
fn wrong_lines_are_named_with_field_and_axis() {
    let head = "/tool_chains/0/lines";
    let cases: [(&str, Value, &str); 10] = [
        ("/axes/3/direction", json!([0, 0, 0]), "tool_chains[0].lines.axes[3].direction (axis B): is [0, 0, 0], but"),
        ("/axes/3/point_mm", Value::Null, "tool_chains[0].lines.axes[3].point_mm (axis B): is missing"),
        ("/axes/3/point_mm", json!([0, 2e6, 0]), "lines.axes[3].point_mm[1] (axis B): is 2000000, more than 1000000"),
        ("/axes/3/joint/revolute/axis", json!("C"), "lines.axes[3].joint (axis C): is the address of another joint"),
        (
            "/axes/1/joint/prismatic/max_mm",
            json!(-9e3),
            "tool_chains[0].lines.axes[1].joint.prismatic.max_mm (axis X): is -9000, which is below the minimum",
        ),
        ("/axes/3/bodies/0/clearance_mm", json!(-1), "lines.axes[3].bodies[0].clearance_mm: is -1, but"),
        ("/end/position_mm", json!([0, 0, -2e6]), "tool_chains[0].lines.end.position_mm[2]: is -2000000"),
        ("/end/rotation_xyz_deg", json!([0, 400, 0]), "lines.end.rotation_xyz_deg[1]: is 400.0, but has to be from"),
        // Both turn about z through the origin, with linear axes between.
        (
            "/axes/3",
            json!({
                "joint": { "revolute": { "axis": "B", "range": "endless", "max_velocity_deg_min": 9000 } },
                "direction": [0, 0, -2], "point_mm": [0, 0, 77]
            }),
            "the rotary axes C and B are parallel, so the tool axis has one degree of freedom only",
        ),
        ("/axes/2/direction", json!([1, 0, 0]), "the linear axes"),
    ];
    for (place, value, message) in cases {
        let text = changed("head-b-table-c", |json| {
            json.pointer_mut(&format!("{head}{place}"))
                .map(|field| *field = value.clone())
                .unwrap_or_else(|| panic!("{place}"));
        });
        let error = Machine::from_json(text.as_bytes()).expect_err(message).to_string();
        assert!(error.contains(message), "{place}: {error}");
    }
    // Neighbours on one line turn as one.
    let text = changed("head-head-c-b", |json| {
        let axes = &mut json["tool_chains"][0]["lines"]["axes"];
        axes[4]["direction"] = axes[3]["direction"].clone();
        axes[4]["point_mm"] = axes[3]["point_mm"].clone();
    });
    let error = Machine::from_json(text.as_bytes()).unwrap_err().to_string();
    let message = "tool_chains[0].lines.axes[4] (axis B): is on the line of axis C (tool_chains[0].lines.axes[3])";
    assert!(error.contains(message), "{error}");
    // A value that no text has.
    let mut file = by_lines(rows_of_preset("head-b-table-c"), &mut Random(5));
    file.tool_chains[0].lines.as_mut().unwrap().axes[3].point_mm = Some([0.0, 0.0, f64::NAN]);
    let error = Machine::from_file(file.clone()).unwrap_err().to_string();
    assert_eq!(error, "tool_chains[0].lines.axes[3].point_mm[2] (axis B): is not a finite number");
    file.tool_chains[0].lines.as_mut().unwrap().axes[3].direction[1] = f64::INFINITY;
    let error = Machine::from_file(file).unwrap_err().to_string();
    assert_eq!(error, "tool_chains[0].lines.axes[3].direction[1] (axis B): is not a finite number");
}

/// Two rotary axes on one line at zero turn apart where linear axes between them have moved.
#[test]
fn rotary_axes_on_one_line_with_linear_axes_between_are_taken() {
    let text = changed("head-b-a-table-c-two-linear", |json| {
        let table = json["workpiece_chain"]["lines"]["axes"][0].clone();
        let axes = &mut json["tool_chains"][0]["lines"]["axes"];
        for key in ["direction", "point_mm"] {
            axes[2][key] = table[key].clone();
        }
        axes[3]["point_mm"] = json!([0.0, 0.0, 500.0]);
        axes[3]["direction"] = json!([0.0, 1.0, 0.0]);
    });
    let machine = Machine::from_json(text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    let tip = |b: f64, c: f64| {
        let turned = |a: &Axis| match a.letter.to_string().as_str() {
            "A" => 0.5,
            "B" => b,
            "C" => c,
            _ => 100.0,
        };
        machine.forward(&AxisValues::from_fn(5, |k| turned(&machine.axes()[k])), 50.0).translation.vector
    };
    assert!((tip(0.7, 0.0) - tip(0.0, 0.7)).norm() > 1.0 && (tip(0.7, 0.0) - tip(0.0, -0.7)).norm() > 1.0);
}

#[test]
fn rows_and_lines_exclude_each_other() {
    let both = changed("head-b-table-c", |json| json["tool_chains"][0]["rows"] = json!([]));
    let error = Machine::from_json(both.as_bytes()).unwrap_err().to_string();
    assert!(
        error.starts_with("tool_chains[0], line 1, ") && error.contains(": has both `rows` and `lines`"),
        "{error}"
    );
    let neither = changed("head-b-table-c", |json| json["workpiece_chain"] = json!({}));
    let error = Machine::from_json(neither.as_bytes()).unwrap_err().to_string();
    assert!(
        error.starts_with("workpiece_chain, line 1, ") && error.contains(": has neither `rows` nor `lines`"),
        "{error}"
    );
    let mut file = rows_of_preset("head-b-table-c");
    let rows = file.tool_chains[0].rows.clone();
    file.tool_chains[0].lines = Some(lines_of(&rows, &mut Random(5)));
    let error = Machine::from_file(file).unwrap_err().to_string();
    assert_eq!(error, "tool_chains[0].lines: are given beside rows: leave one of both out");
}

/// Lines a kilometre apart that lean by a few degrees have their common normal far away.
#[test]
fn lines_whose_rows_no_machine_has_are_named() {
    let text = changed("head-b-table-c", |json| {
        json["tool_chains"][0]["lines"]["axes"][3]["direction"] = json!([0.02, 0.0, 1.0]);
        json["tool_chains"][0]["lines"]["axes"][3]["point_mm"] = json!([9e5, 0.0, 0.0]);
    });
    let error = Machine::from_json(text.as_bytes()).unwrap_err().to_string();
    assert!(
        error.starts_with("tool_chains[0].lines.axes[2] (axis Z): makes a row with -45000000 mm, more than 1000000"),
        "{error}"
    );
}

/// Directions of any finite length, however small or large, are those of the same line.
#[test]
fn the_length_of_a_direction_has_no_effect() {
    let with = |scale: f64| {
        let text = changed("head-b-nutating-table-c", |json| {
            json["tool_chains"][0]["lines"]["axes"][3]["direction"] = json!([0.0, scale, scale]);
        });
        Machine::from_json(text.as_bytes()).unwrap()
    };
    for scale in [1e-300, 3.0, 1e300] {
        assert_eq!(with(scale), with(1.0));
    }
}

/// The mesh of a body on a line is read, and its field is that of the line.
#[test]
fn bodies_on_lines_are_meshes_as_those_on_rows() {
    let mut file = by_lines(rows_of_preset("head-b-table-c"), &mut Random(5));
    let shape = serde_json::from_value(json!({ "mesh": { "file": "ram.stl" } })).unwrap();
    file.tool_chains[0].lines.as_mut().unwrap().axes[2].bodies[0].shape = shape;
    let error = Machine::from_file(file.clone()).unwrap_err().to_string();
    assert!(error.starts_with("tool_chains[0].lines.axes[2].bodies[0].shape.mesh: names the mesh file"), "{error}");
    let file = file.with_hulls(|mesh| {
        assert_eq!(mesh.field, "tool_chains[0].lines.axes[2].bodies[0].shape.mesh");
        let points = [[0.0; 3], [9.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 6.0]].map(nalgebra::Point3::from);
        facemill_cl_data::ConvexPolyhedron::around(&points, []).map(std::sync::Arc::new)
    });
    let machine = Machine::from_file(file.unwrap()).unwrap();
    assert!(matches!(shape_of(&machine, 2), ShapeFile::Mesh(mesh) if mesh.hull.is_some()));
}

fn shape_of(machine: &Machine, joint: usize) -> ShapeFile {
    let rows = machine.to_file().tool_chains[0].rows.clone();
    rows.into_iter().filter(|row| row.joint.is_some()).nth(joint).unwrap().bodies[0].shape.clone()
}
