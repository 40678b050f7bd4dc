//! Machines for tests, and a second implementation of forward kinematics.
#![allow(dead_code, unreachable_pub, reason = "every test program uses a part of it")]

pub mod oracle;

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::machine_file::{
    ControlToleranceFile, CuttingLawFile, DhRow, FeedFile, Joint, MachineFile, MachineFormat, MotionFile,
    PrismaticJoint, RapidLawFile, RevoluteJoint, RevoluteRange, Sense, ToolChain, WorkpieceChain,
};
use facemill_inverse_kinematics::*;
pub use facemill_test_kit::Random;
use nalgebra::{Matrix4, Point3, Unit, Vector3, Vector4};

/// Values within the limits, endless axes within ±180°.
pub fn random_values(r: &mut Random, machine: &Machine) -> AxisValues {
    AxisValues::from_fn(machine.axes().len(), |k| {
        let a = &machine.axes()[k];
        if a.endless { r.between(-3.1, 3.1) } else { r.between(a.min, a.max) }
    })
}

pub fn row(a_mm: f64, alpha_deg: f64, d_mm: f64, theta_deg: f64) -> DhRow {
    DhRow { a_mm, alpha_deg, d_mm, theta_deg, joint: None, bodies: Vec::new() }
}

pub fn linear(axis: &str, row: DhRow) -> DhRow {
    let joint = PrismaticJoint {
        axis: axis.to_owned(),
        sense: Sense::Positive,
        min_mm: -2000.0,
        max_mm: 2000.0,
        home_mm: 0.0,
        max_velocity_mm_min: 20000.0,
        max_acceleration_mm_s2: None,
        max_jerk_mm_s3: None,
    };
    DhRow { joint: Some(Joint::Prismatic(joint)), ..row }
}

pub fn rotary(axis: &str, sense: Sense, limits_deg: Option<(f64, f64)>, row: DhRow) -> DhRow {
    let range = match limits_deg {
        Some((min_deg, max_deg)) => RevoluteRange::Limited { min_deg, max_deg },
        None => RevoluteRange::Endless,
    };
    let joint = RevoluteJoint {
        axis: axis.to_owned(),
        sense,
        range,
        rollover: None,
        max_wind_up_turns: None,
        home_deg: 0.0,
        max_velocity_deg_min: 5000.0,
        max_acceleration_deg_s2: None,
        max_jerk_deg_s3: None,
    };
    DhRow { joint: Some(Joint::Revolute(joint)), ..row }
}

/// Y, X, Z carried by the head; the last frame is parallel to the bed's.
pub fn head_yxz() -> Vec<DhRow> {
    vec![
        linear("Y", row(0.0, -90.0, 0.0, 90.0)),
        linear("X", row(0.0, 90.0, 0.0, 90.0)),
        linear("Z", row(0.0, -90.0, 0.0, -90.0)),
    ]
}

pub fn file(workpiece: Vec<DhRow>, tool: Vec<DhRow>) -> MachineFile {
    MachineFile {
        format: MachineFormat::V1,
        name: "test machine".to_owned(),
        source: None,
        assumed: Vec::new(),
        workpiece_chain: WorkpieceChain { rows: workpiece, lines: None },
        tool_chains: vec![ToolChain { channel: 1, tool_interface: None, rows: tool, lines: None }],
        bed_bodies: Vec::new(),
        motion: MotionFile {
            cutting: CuttingLawFile::AxesLinear,
            rapid: RapidLawFile::PerAxis,
            control_tolerance: ControlToleranceFile::default(),
        },
        feed: FeedFile { min_mm_min: 1.0, max_mm_min: 24000.0, rapid_mm_min: None },
        tool_change_s: None,
    }
}

pub fn machine(workpiece: Vec<DhRow>, tool: Vec<DhRow>) -> Machine {
    Machine::from_file(file(workpiece, tool)).unwrap()
}

/// Trunnion: table tilts about A (x), turns about C; the A axis is offset from C by `dy`, `dz`;
/// both pass through the rotation point. At the zero pose the table frame is the bed's.
pub fn trunnion_ac(sense: Sense, rotation_point: [f64; 3], dy: f64, dz: f64, a_limits: Option<(f64, f64)>) -> Machine {
    let [x, y, z] = rotation_point;
    let table = vec![
        row(x, 0.0, z + dz, 90.0),
        rotary("A", sense, a_limits, row(y + dy, 90.0, 0.0, 0.0)),
        rotary("C", sense, None, row(-dy, -90.0, 0.0, -90.0)),
        row(-x, 0.0, -z - dz, 90.0),
        row(-y, 0.0, 0.0, -90.0),
    ];
    machine(table, head_yxz())
}

/// Head that turns by B about an axis at 45° between y and z, above a table that turns about C.
pub fn nutating_head() -> Machine {
    let mut tool = head_yxz();
    // From the frame parallel to the bed: z leans by −45° about x, which is 45° toward +y.
    tool.push(rotary("B", Sense::Positive, Some((-180.0, 180.0)), row(0.0, -45.0, 300.0, 0.0)));
    tool.push(row(0.0, 45.0, -200.0, 0.0));
    machine(vec![rotary("C", Sense::Negative, None, row(0.0, 0.0, 0.0, 0.0))], tool)
}

/// Fork: C then A in the head.
pub fn head_ca() -> Machine {
    let mut tool = head_yxz();
    tool.push(rotary("C", Sense::Positive, None, row(0.0, 0.0, 0.0, 90.0)));
    tool.push(rotary("A", Sense::Positive, Some((-120.0, 120.0)), row(0.0, 90.0, 0.0, 0.0)));
    tool.push(row(30.0, -90.0, -180.0, 0.0));
    machine(Vec::new(), tool)
}

/// A machine with joints in random order, senses and general directions, split anywhere between
/// table and head.
pub fn random_machine(r: &mut Random) -> Machine {
    random_machine_of(r, ["X", "Y", "Z", "B", "C"], |r| r.between(-180.0, 180.0))
}

/// Returns the same with joints of these addresses, and angles between them as given: right angles
/// make poles and parallel joints.
pub fn random_machine_of(r: &mut Random, axes: [&str; 5], angle: impl Fn(&mut Random) -> f64) -> Machine {
    loop {
        let mut joints = axes;
        for k in (1..5).rev() {
            joints.swap(k, r.below(k + 1));
        }
        let n_table = r.below(6);
        let mut chains = [Vec::new(), Vec::new()];
        for (k, axis) in joints.iter().enumerate() {
            let any = row(r.between(-200.0, 200.0), angle(r), r.between(-200.0, 200.0), angle(r));
            let mut row = if ["A", "B", "C"].contains(axis) {
                rotary(axis, Sense::Positive, Some((-180.0, 180.0)), any)
            } else {
                linear(axis, any)
            };
            if r.below(2) == 0 {
                match row.joint.as_mut() {
                    Some(Joint::Prismatic(j)) => j.sense = Sense::Negative,
                    Some(Joint::Revolute(j)) => j.sense = Sense::Negative,
                    None => {}
                }
            }
            chains[usize::from(k >= n_table)].push(row);
        }
        let [table, mut tool] = chains;
        tool.push(row(r.between(-50.0, 50.0), angle(r), r.between(-300.0, 0.0), 17.0));
        if let Ok(machine) = Machine::from_file(file(table, tool)) {
            return machine;
        }
    }
}

fn right_angle(r: &mut Random) -> f64 {
    [-90.0, 0.0, 90.0, 180.0][r.below(4)]
}

/// CLOPT's variant of the dual mill as one head sees it: two linear and two rotary joints in the
/// head, C of the workpiece level along the bed's x. Head: Y, Z, then B about y, then A about x.
pub fn dual_mill_head() -> Machine {
    // The table's z is the bed's x.
    let table = vec![rotary("C", Sense::Positive, None, row(0.0, 90.0, 0.0, 90.0)), row(0.0, 0.0, 0.0, 0.0)];
    let tool = vec![
        linear("Y", row(0.0, -90.0, 0.0, 0.0)),
        linear("Z", row(0.0, 90.0, 0.0, 0.0)),
        rotary("B", Sense::Positive, Some((-120.0, 120.0)), row(40.0, -90.0, 60.0, 0.0)),
        rotary("A", Sense::Positive, Some((-120.0, 120.0)), row(25.0, 90.0, 80.0, 90.0)),
        row(10.0, 90.0, 30.0, 0.0),
    ];
    machine(table, tool)
}

/// Two linear and three rotary joints: a dual mill's head, machines in general position, and some
/// with right angles, many of them with two rotary joints parallel.
pub fn families_of_three_rotaries() -> Vec<Machine> {
    let axes = ["X", "Y", "A", "B", "C"];
    let mut r = Random(12);
    let mut all = vec![dual_mill_head()];
    all.extend((0..8).map(|_| random_machine_of(&mut r, axes, |r| r.between(-180.0, 180.0))));
    all.extend((0..12).map(|_| random_machine_of(&mut r, axes, right_angle)));
    all
}

/// A machine of every family, and some in general position.
pub fn families() -> Vec<Machine> {
    let mut r = Random(11);
    let mut all = vec![
        Machine::head_b_table_c().unwrap(),
        trunnion_ac(Sense::Negative, [1.0, 2.0, 3.0], 20.0, 10.0, Some((-110.0, 110.0))),
        trunnion_ac(Sense::Positive, [0.0; 3], 0.0, 0.0, Some((-110.0, 110.0))),
        nutating_head(),
        head_ca(),
    ];
    all.extend((0..12).map(|_| random_machine(&mut r)));
    all
}

/// Returns both views of each preset with two heads: one of three linear and two rotary joints, one
/// of two and three.
pub fn dual_mills() -> [Vec<Machine>; 2] {
    ["dual-c-horizontal-xyzb", "dual-c-horizontal-xzab"].map(|name| {
        let path = format!("{}/../../assets/machines/{name}.json", env!("CARGO_MANIFEST_DIR"));
        Machine::heads_from_json(&std::fs::read(path).unwrap()).unwrap()
    })
}

/// Craig's matrix of a row, written out (Introduction to Robotics, 3rd edition, eq. 3.6).
pub fn craig(row: &DhRow, values: &dyn Fn(&str) -> f64) -> Matrix4<f64> {
    let (mut d, mut theta) = (row.d_mm, row.theta_deg.to_radians());
    let sign = |s: Sense| if s == Sense::Positive { 1.0 } else { -1.0 };
    match &row.joint {
        Some(Joint::Prismatic(j)) => d += sign(j.sense) * values(&j.axis),
        Some(Joint::Revolute(j)) => theta += sign(j.sense) * values(&j.axis),
        None => {}
    }
    let (sa, ca) = row.alpha_deg.to_radians().sin_cos();
    let (st, ct) = theta.sin_cos();
    #[rustfmt::skip]
    let m = Matrix4::new(
        ct,      -st,      0.0,  row.a_mm,
        st * ca,  ct * ca, -sa,  -sa * d,
        st * sa,  ct * sa,  ca,   ca * d,
        0.0,      0.0,      0.0,  1.0,
    );
    m
}

/// Returns bed from the end of a chain's first `n` rows.
pub fn craig_chain(rows: &[DhRow], machine: &Machine, q: &AxisValues) -> Matrix4<f64> {
    let value = |axis: &str| q[machine.axis_index(axis).unwrap()];
    rows.iter().fold(Matrix4::identity(), |m, row| m * craig(row, &value))
}

/// Returns table from tool by multiplying Craig's matrices.
pub fn forward_by_matrices(machine: &Machine, q: &AxisValues, tool_length: f64) -> Matrix4<f64> {
    let file = machine.to_file();
    let table = craig_chain(&file.workpiece_chain.rows, machine, q);
    let nose = craig_chain(&file.tool_chains[machine.head()].rows, machine, q);
    table.try_inverse().unwrap() * nose * Matrix4::new_translation(&Vector3::new(0.0, 0.0, -tool_length))
}

pub fn cl_by_matrices(machine: &Machine, q: &AxisValues, tool_length: f64) -> ClPoint {
    let m = forward_by_matrices(machine, q, tool_length);
    let [axis, tip] = [m * Vector4::new(0.0, 0.0, 1.0, 0.0), m * Vector4::new(0.0, 0.0, 0.0, 1.0)];
    ClPoint { tip: Point3::from(tip.xyz()), axis: Unit::new_normalize(axis.xyz()) }
}

/// Returns the largest difference of linear (mm) and rotary values (rad) of the axes that move the
/// tool, apart from full turns.
pub fn difference(machine: &Machine, a: &AxisValues, b: &AxisValues) -> (f64, f64) {
    let mut worst = (0.0_f64, 0.0_f64);
    for (k, axis) in machine.axes().iter().enumerate().filter(|(_, a)| a.carried_by != Carrier::OtherHead) {
        let d = a[k] - b[k];
        match axis.kind {
            AxisKind::Linear => worst.0 = worst.0.max(d.abs()),
            AxisKind::Rotary => worst.1 = worst.1.max((0.5 * d).sin().abs() * 2.0),
        }
    }
    worst
}
