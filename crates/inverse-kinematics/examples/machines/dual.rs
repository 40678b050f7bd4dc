//! Dual mills: two heads that face each other along a level C.
//!
//! All numbers are in the table's frame with all axes at 0: z is C and points to the first head, y
//! is up, the hub's seat is at the origin. The second head is the first one turned by half a turn
//! about the upright through [`CENTRE`].

use std::f64::consts::PI;

use facemill_inverse_kinematics::import::{AxisLine, rows_from_axes};
use facemill_inverse_kinematics::machine_file::{BodyFile, Joint, MachineFile, ShapeFile, ToolChain};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{LARGE, MEDIUM, ROTARY, UNKNOWN, assuming, block, body, file, linear, nose, rotary, round};

/// Middle between the two heads: that of the propeller's hub.
const CENTRE: f64 = 150.0;
/// The spindle nose and B of the first head.
const NOSE: f64 = CENTRE + 1300.0;
const PIVOT: f64 = NOSE + 250.0;

/// X, Y, Z and B in each head: three linear and two rotary joints with C.
pub(super) fn xyzb() -> MachineFile {
    let mut x = linear('X', false, [-1000.0, 1000.0], LARGE);
    x.bodies = vec![block("column", [400.0, 2500.0, 600.0], [-450.0, -350.0, PIVOT + 750.0])];
    let mut y = linear('Y', false, [-800.0, 800.0], LARGE);
    y.bodies = vec![block("saddle", [90.0, 500.0, 560.0], [-190.0, 0.0, PIVOT + 750.0])];
    let mut z = linear('Z', false, [-1500.0, 100.0], MEDIUM);
    z.bodies = [ram(150.0)].into_iter().chain(fork()).collect();
    dual("dual mill, C level, X Y Z B in each head", [x, y, z, tilting()])
}

/// X, Z, A and B in each head: two linear and three rotary joints with C.
pub(super) fn xzab() -> MachineFile {
    let mut x = linear('X', false, [-1000.0, 1000.0], LARGE);
    x.bodies = vec![block("column", [400.0, 2000.0, 600.0], [-350.0, -600.0, PIVOT + 950.0])];
    let mut z = linear('Z', false, [-1500.0, 100.0], MEDIUM);
    z.bodies = vec![ram(350.0)];
    let mut a = rotary('A', false, [[1.0, 0.0, 0.0], [0.0, 0.0, PIVOT + 250.0]], Some([-45.0, 45.0]), ROTARY);
    a.bodies = fork().into_iter().chain([block("swivel", [160.0, 340.0, 140.0], [0.0, 0.0, PIVOT + 250.0])]).collect();
    dual("dual mill, C level, X Z A B in each head", [x, z, a, tilting()])
}

/// B with the spindle.
fn tilting() -> AxisLine {
    let mut b = rotary('B', false, [[0.0, 1.0, 0.0], [0.0, 0.0, PIVOT]], Some([-100.0, 100.0]), ROTARY);
    b.bodies = vec![nose(45.0, NOSE), round("spindle", 85.0, 250.0, [0.0, 0.0, NOSE + 90.0])];
    b
}

/// The ram begins so far behind B.
fn ram(behind: f64) -> BodyFile {
    block("ram", [260.0, 320.0, 900.0], [0.0, 0.0, PIVOT + behind + 450.0])
}

/// Both arms that hold B.
fn fork() -> [BodyFile; 2] {
    let arm = |name, y| block(name, [160.0, 60.0, 280.0], [0.0, y, PIVOT + 40.0]);
    [arm("fork arm, upper", 140.0), arm("fork arm, lower", -140.0)]
}

/// Builds two heads with these lines and the propeller's support.
fn dual(name: &str, head: [AxisLine; 4]) -> MachineFile {
    let bed_from_table = bed_from_table();
    let mut c = rotary('C', true, [[0.0, 0.0, 1.0], [0.0; 3]], None, ROTARY);
    // The part sits on it.
    let arbor = |name, radius_mm, from: f64, to: f64| {
        let shape = ShapeFile::Cylinder { radius_mm, height_mm: to - from };
        body(name, shape, [0.0, 0.0, from], 0.0)
    };
    c.bodies = vec![arbor("arbor", 60.0, -620.0, 0.0)];
    let mut made = file(name, "typical; structure of CLOPT's dual mill", (Vec::new(), 0.0), (Vec::new(), 0.0));
    made.workpiece_chain.rows = rows_from_axes(&[moved(c, &bed_from_table)], &bed_from_table);
    let facing = Translation3::new(0.0, 0.0, 2.0 * CENTRE) * Isometry3::rotation(Vector3::new(0.0, PI, 0.0));
    let place = [Isometry3::identity(), facing];
    let tool_chain = |(k, table_from_head): (usize, Isometry3<f64>)| {
        let bed_from_head = bed_from_table * table_from_head;
        let lines: Vec<AxisLine> =
            head.iter().map(|line| numbered(at_home(moved(line.clone(), &bed_from_head)), k + 1)).collect();
        let end = bed_from_head * Isometry3::translation(0.0, 0.0, NOSE);
        ToolChain { channel: k as u32 + 1, tool_interface: None, rows: rows_from_axes(&lines, &end), lines: None }
    };
    made.tool_chains = place.into_iter().enumerate().map(tool_chain).collect();
    let bed = [
        block("headstock", [220.0, 1780.0, 300.0], [0.0, -780.0, -780.0]),
        block("bed", [3200.0, 150.0, 6400.0], [0.0, -1755.0, CENTRE]),
    ];
    made.bed_bodies = bed.into_iter().map(|b| moved_body(b, &bed_from_table)).collect();
    assuming(made, &UNKNOWN, &[])
}

/// The bed's x is the table's z, its z is up.
fn bed_from_table() -> Isometry3<f64> {
    let columns = Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns));
    Isometry3::from_parts(Translation3::identity(), turn)
}

fn moved(mut line: AxisLine, to_from: &Isometry3<f64>) -> AxisLine {
    line.direction = to_from.rotation * line.direction;
    line.point = to_from * line.point;
    line.bodies = line.bodies.into_iter().map(|b| moved_body(b, to_from)).collect();
    line
}

fn moved_body(mut body: BodyFile, to_from: &Isometry3<f64>) -> BodyFile {
    let [x, y, z] = body.rotation_xyz_deg.map(f64::to_radians);
    let (x, y, z) = (to_from.rotation * UnitQuaternion::from_euler_angles(x, y, z)).euler_angles();
    body.rotation_xyz_deg = [x, y, z].map(|angle| rounded(angle.to_degrees()));
    body.position_mm = (to_from * Point3::from(body.position_mm)).coords.map(rounded).into();
    body
}

/// To a millionth, without a sign of zero.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6 + 0.0
}

/// Homes beside the arbor and the headstock, and at the end of Z: behind them there is no room for
/// the second head.
fn at_home(mut line: AxisLine) -> AxisLine {
    if let Joint::Prismatic(j) = &mut line.joint {
        j.home_mm = match j.axis.as_str() {
            "X" => 700.0,
            "Z" => j.max_mm,
            _ => 0.0,
        };
    }
    line
}

/// The axis of head `head`: X1, X2. Its bodies are called by it too.
fn numbered(mut line: AxisLine, head: usize) -> AxisLine {
    match &mut line.joint {
        Joint::Prismatic(j) => j.axis = format!("{}{head}", j.axis),
        Joint::Revolute(j) => j.axis = format!("{}{head}", j.axis),
    }
    for body in &mut line.bodies {
        body.name = format!("{} {head}", body.name);
    }
    line
}
