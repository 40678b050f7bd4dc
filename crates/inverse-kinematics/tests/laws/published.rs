//! Numbers that others have computed or printed.

use std::path::Path;

use crate::common::*;
use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::machine_file::Sense;
use facemill_inverse_kinematics::measured::{
    AxisMeasurement, MeasuredFamily, MeasuredSense, Measurements, machine_from_measurements,
};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Rotation3, Unit, Vector3};

fn numbers(text: &str) -> Vec<Vec<f64>> {
    let lines = text.lines().filter(|l| l.starts_with(['-', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']));
    lines.map(|l| l.split(',').map(|w| w.trim().parse().unwrap_or(f64::NAN)).collect()).collect()
}

/// FEED's machine: 253 mm from the B axis to the tip, 100 mm of it tool. NC words are joint values,
/// Z less the tool.
fn feed_machine() -> Machine {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    let rows = &mut file.tool_chains[0].rows;
    (rows[2].d_mm, rows[4].d_mm) = (153.0, -153.0);
    Machine::from_file(file).unwrap()
}

#[test]
fn feed_tables_and_equation_9_are_reproduced() {
    let machine = feed_machine();
    for table in ["feedrate_table2.csv", "feedrate_table4.csv"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/golden").join(table);
        let rows = numbers(&std::fs::read_to_string(path).unwrap());
        assert_eq!(rows.len(), 5);
        for row in rows {
            let [x, y, z, b, c, cl_x, cl_y, cl_z] = row[..8] else { panic!("{row:?}") };
            let (b, c) = (b.to_radians(), c.to_radians());
            let q = AxisValues::from([x, y, z + 100.0, b, c]);
            let cl = machine.cl_point(&q, 100.0);
            assert!((cl.tip - Point3::new(cl_x, cl_y, cl_z)).abs().max() < 0.0015, "{row:?}: {cl:?}");
            let l = 253.0;
            let printed = Point3::new(
                c.cos() * x - c.sin() * y - l * b.sin() * c.cos(),
                c.sin() * x + c.cos() * y - l * b.sin() * c.sin(),
                z + l - l * b.cos(),
            );
            assert!((cl.tip - printed).norm() < 1e-10);
            let back = machine.nearest_inverse(&cl, 100.0, Some(&q), BranchPreference::Nearest).unwrap();
            let (mm, rad) = difference(&machine, &back, &q);
            assert!(mm < 1e-9 && rad < 1e-11);
        }
    }
}

/// LinuxCNC's xyzac-trt with its old sense of rotation and with ISO's; offsets as in the headers of
/// the files.
#[test]
fn linuxcnc_trunnion_joints_are_reproduced() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/reference");
    for (name, sense) in [("lcnc_xyzac_trt.csv", Sense::Positive), ("lcnc_xyzac_trt_conventional.csv", Sense::Negative)]
    {
        let Ok(text) = std::fs::read_to_string(folder.join(name)) else {
            eprintln!("skipped: {} is not there", folder.join(name).display());
            continue;
        };
        let machine = trunnion_ac(sense, [1.0, 2.0, 3.0], 20.0, 10.0, Some((-179.0, 179.0)));
        let tool_length = 15.0;
        // Seen from the table the tool turns against the table.
        let turn = if sense == Sense::Positive { -1.0 } else { 1.0 };
        let rows = numbers(&text);
        assert!(rows.len() > 20, "{name} holds {} rows", rows.len());
        for row in rows {
            let [x, y, z, a, c, jx, jy, jz] = row[..] else { panic!("{row:?}") };
            let (a, c) = (a.to_radians(), c.to_radians());
            let axis = Rotation3::from_axis_angle(&Vector3::z_axis(), turn * c)
                * (Rotation3::from_axis_angle(&Vector3::x_axis(), turn * a) * Vector3::z_axis());
            // LinuxCNC adds the tool length to the Z of the workpiece.
            let cl = ClPoint { tip: Point3::new(x, y, z - tool_length), axis };
            let expected = AxisValues::from([jx, jy, jz, a, c]);
            // Where A is 0, C is free and taken over.
            let reference = AxisValues::from([0.0, 0.0, 0.0, 0.0, c]);
            let solutions = machine.inverse_near(&cl, tool_length, &reference).unwrap();
            let agrees = |s: InverseSolution| {
                let (mm, rad) = difference(&machine, &s.values, &expected);
                mm < 1e-6 && rad < 1e-9
            };
            assert!(solutions.iter().any(agrees), "{name}: {expected:?} is not among {solutions:?}");
        }
    }
}

/// The same joints on a machine made from the values of LinuxCNC's pins, one by one as
/// docs/machines.md has them.
#[test]
fn pins_of_linuxcnc_make_the_trunnion_that_they_describe() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/reference");
    let rot_point = [1.0, 2.0, 3.0];
    let [y_offset, z_offset] = [20.0, 10.0];
    for (name, sense) in
        [("lcnc_xyzac_trt.csv", MeasuredSense::Reversed), ("lcnc_xyzac_trt_conventional.csv", MeasuredSense::Iso)]
    {
        let Ok(text) = std::fs::read_to_string(folder.join(name)) else {
            eprintln!("skipped: {} is not there", folder.join(name).display());
            continue;
        };
        let axis = |axis: &str| AxisMeasurement { axis: axis.to_owned(), sense: Some(sense), ..Default::default() };
        let mut measured = Measurements { axes: vec![axis("A"), axis("C")], ..Default::default() };
        measured.places.table_at = Some(rot_point);
        measured.places.table_tilt = Some([0.0, y_offset, z_offset]);
        let file = machine_from_measurements(MeasuredFamily::TableTableAc, &measured).unwrap().file;
        let machine = Machine::from_file(file).unwrap();
        let tool_length = 15.0;
        for row in numbers(&text) {
            let [x, y, z, a, c, jx, jy, jz] = row[..] else { panic!("{row:?}") };
            let joints = AxisValues::from([jx, jy, jz, a.to_radians(), c.to_radians()]);
            let tip = machine.cl_point(&joints, tool_length).tip;
            // LinuxCNC counts the workpiece from the machine's zero, and the tip with the tool.
            let expected = Vector3::new(x, y, z - tool_length) - Vector3::from(rot_point);
            let error = (tip.coords - expected).norm();
            assert!(error < 1e-6, "{name}: {error:e} mm at {row:?}");
        }
    }
}

/// The 25 poses of a published fan path on a trunnion: reached on both branches, and followed
/// without a jump.
#[test]
fn published_fan_path_is_followed_on_a_trunnion() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/nc/ijms2021_fan_path.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: {} is not there", path.display());
        return;
    };
    let machine = trunnion_ac(Sense::Negative, [0.0; 3], 0.0, 50.0, Some((-120.0, 120.0)));
    let mut previous: Option<AxisValues> = None;
    let rows = numbers(&text);
    assert_eq!(rows.len(), 25);
    for row in rows {
        let [x, y, z, i, j, k] = row[..] else { panic!("{row:?}") };
        let cl = ClPoint { tip: Point3::new(x, y, z), axis: Unit::new_normalize(Vector3::new(i, j, k)) };
        assert_eq!(machine.inverse(&cl, 80.0).unwrap().len(), 2);
        let q = machine.nearest_inverse(&cl, 80.0, previous.as_ref(), BranchPreference::Positive).unwrap();
        let reached = cl_by_matrices(&machine, &q, 80.0);
        assert!((reached.tip - cl.tip).norm() < 1e-9 && (*reached.axis - *cl.axis).norm() < 1e-12);
        if let Some(p) = previous {
            assert!((q[3] - p[3]).abs() < 0.3 && (q[4] - p[4]).abs() < 1.0, "jump from {p:?} to {q:?}");
        }
        previous = Some(q);
    }
}
