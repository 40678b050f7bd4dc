//! Writes the machine files of `presets/machines`, to which `assets/machines` links, from the lines
//! of their axes: `cargo run -p facemill-inverse-kinematics --example machines`.
//!
//! Offsets, ranges and orders marked "Autodesk" are those of the generic machines of Autodesk's
//! cam-posteditor (MIT); all others are typical, and marked as assumed in the files. Bodies are
//! given in the bed's frame with all axes at 0.

#[path = "machines/dual.rs"]
mod dual;

use std::path::Path;

use facemill_inverse_kinematics::import::{AxisLine, rows_from_axes};
use facemill_inverse_kinematics::machine_file::{
    AssumedFile, AssumedValue, BodyFile, ControlToleranceFile, CuttingLawFile, FeedFile, Joint, MachineFile,
    MachineFormat, MotionFile, PrismaticJoint, RapidLawFile, RevoluteJoint, RevoluteRange, Sense, ShapeFile, ToolChain,
    WorkpieceChain,
};
use facemill_inverse_kinematics::*;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/machines");
    let all = [
        ("head-b-table-c", head_b_table_c()?),
        ("head-a-table-c", head_a_table_c()),
        ("table-table-a-c", trunnion('A')),
        ("table-table-b-c", trunnion('B')),
        ("head-head-c-a", fork('A')),
        ("head-head-c-b", fork('B')),
        ("head-b-nutating-table-c", nutating_head()),
        ("table-table-b-c-nutating", nutating_table()),
        ("table-y-x-a-c-head-z", travelling_trunnion()),
        ("bridge-head-head-a-b", bridge()),
        ("head-b-a-table-c-two-linear", dual_mill_head()),
        ("dual-c-horizontal-xyzb", dual::xyzb()),
        ("dual-c-horizontal-xzab", dual::xzab()),
    ];
    for (name, file) in all {
        Machine::heads(file.clone())?;
        std::fs::write(folder.join(format!("{name}.json")), facemill_file_format::to_json(&file))?;
    }
    Ok(())
}

/// Source of the machines whose B leans.
const LEANS: &str = "typical; B leans by 45° from z toward +y";

const AUTODESK: &str = "Autodesk cam-posteditor (MIT)";

/// Speeds, accelerations and jerks: mm or deg, per min, s², s³.
type Rates = [f64; 3];
const MEDIUM: Rates = [30_000.0, 3_000.0, 30_000.0];
const LARGE: Rates = [20_000.0, 1_000.0, 10_000.0];
const ROTARY: Rates = [7_200.0, 500.0, 5_000.0];
/// Autodesk's rotary axes: 21600 deg/min is theirs, the rest typical.
const ROTARY_AUTODESK: Rates = [21_600.0, 500.0, 5_000.0];

fn sense(on_table: bool) -> Sense {
    if on_table { Sense::Negative } else { Sense::Positive }
}

/// X, Y or Z; its row looks along the letter's direction.
fn linear(axis: char, on_table: bool, [min_mm, max_mm]: [f64; 2], rates: Rates) -> AxisLine {
    let mut direction = Vector3::zeros();
    direction["XYZ".find(axis).unwrap_or_default()] = 1.0;
    let joint = Joint::Prismatic(PrismaticJoint {
        axis: axis.to_string(),
        sense: sense(on_table),
        min_mm,
        max_mm,
        home_mm: 0.0,
        max_velocity_mm_min: rates[0],
        max_acceleration_mm_s2: Some(rates[1]),
        max_jerk_mm_s3: Some(rates[2]),
    });
    AxisLine { joint, direction: Unit::new_normalize(direction), point: Point3::origin(), bodies: Vec::new() }
}

/// A rotary axis about a direction through a point; endless without a range.
fn rotary(axis: char, on_table: bool, line: [[f64; 3]; 2], range: Option<[f64; 2]>, rates: Rates) -> AxisLine {
    let joint = Joint::Revolute(RevoluteJoint {
        axis: axis.to_string(),
        sense: sense(on_table),
        range: range.map_or(RevoluteRange::Endless, |[min_deg, max_deg]| RevoluteRange::Limited { min_deg, max_deg }),
        rollover: None,
        max_wind_up_turns: None,
        home_deg: 0.0,
        max_velocity_deg_min: rates[0],
        max_acceleration_deg_s2: Some(rates[1]),
        max_jerk_deg_s3: Some(rates[2]),
    });
    let direction = Unit::new_normalize(Vector3::from(line[0]));
    AxisLine { joint, direction, point: Point3::from(line[1]), bodies: Vec::new() }
}

/// A body upright in the bed's frame.
fn body(name: &str, shape: ShapeFile, position_mm: [f64; 3], clearance_mm: f64) -> BodyFile {
    BodyFile { name: name.to_owned(), shape, position_mm, rotation_xyz_deg: [0.0; 3], clearance_mm }
}

fn block(name: &str, size_mm: [f64; 3], position_mm: [f64; 3]) -> BodyFile {
    body(name, ShapeFile::Box { size_mm }, position_mm, 10.0)
}

/// Upright, from its lower end.
fn round(name: &str, radius_mm: f64, height_mm: f64, position_mm: [f64; 3]) -> BodyFile {
    body(name, ShapeFile::Cylinder { radius_mm, height_mm }, position_mm, 5.0)
}

/// The spindle nose at this height: it widens upward.
fn nose(radius: f64, z: f64) -> BodyFile {
    let shape = ShapeFile::Frustum { radius_low_mm: radius, radius_high_mm: 1.5 * radius, height_mm: 2.0 * radius };
    body("spindle nose", shape, [0.0, 0.0, z], 5.0)
}

/// A table's disc, its top at this height, without clearance: the part lies on it.
fn disc(radius_mm: f64, height_mm: f64, top: f64) -> BodyFile {
    body("table", ShapeFile::Cylinder { radius_mm, height_mm }, [0.0, 0.0, top - height_mm], 0.0)
}

/// Exchanges x and y: a part along x for an A axis lies along y for a B axis.
fn swap(line: AxisLine, is_b: bool) -> AxisLine {
    let mut line = line;
    if is_b {
        for body in &mut line.bodies {
            body.position_mm.swap(0, 1);
            if let ShapeFile::Box { size_mm } = &mut body.shape {
                size_mm.swap(0, 1);
            }
        }
    }
    line
}

fn at(z: f64) -> Isometry3<f64> {
    Isometry3::translation(0.0, 0.0, z)
}

/// Builds a whole file, the chains from lines, the ends at these heights.
fn file(name: &str, source: &str, table: (Vec<AxisLine>, f64), head: (Vec<AxisLine>, f64)) -> MachineFile {
    MachineFile {
        format: MachineFormat::V1,
        name: name.to_owned(),
        source: Some(source.to_owned()),
        assumed: Vec::new(),
        workpiece_chain: WorkpieceChain { rows: rows_from_axes(&table.0, &at(table.1)), lines: None },
        tool_chains: vec![ToolChain {
            channel: 1,
            tool_interface: None,
            rows: rows_from_axes(&head.0, &at(head.1)),
            lines: None,
        }],
        bed_bodies: Vec::new(),
        motion: MotionFile {
            cutting: CuttingLawFile::AxesLinear,
            rapid: RapidLawFile::Linear,
            control_tolerance: ControlToleranceFile { path_mm: 0.01, orientation_deg: 0.005 },
        },
        feed: FeedFile { min_mm_min: 1.0, max_mm_min: 24_000.0, rapid_mm_min: None },
        tool_change_s: None,
    }
}

/// Marks typical values: rates and those of the machine as a whole, and these.
fn assuming(mut file: MachineFile, more: &[AssumedValue], velocities: &[&str]) -> MachineFile {
    use AssumedValue::{Bodies, Feed, MaxAcceleration, MaxJerk, MaxVelocity, Motion};
    let whole = |value| AssumedFile { value, axes: Vec::new() };
    file.assumed = more.iter().copied().map(whole).collect();
    file.assumed.push(AssumedFile { value: MaxVelocity, axes: velocities.iter().map(|&v| v.to_owned()).collect() });
    file.assumed.extend([MaxAcceleration, MaxJerk, Bodies, Motion, Feed].map(whole));
    file
}

const UNKNOWN: [AssumedValue; 3] = [AssumedValue::Dimensions, AssumedValue::Limits, AssumedValue::Home];
const XYZ: [&str; 3] = ["X", "Y", "Z"];

/// The propeller mill of the samples; FEED's structure, sizes of our own.
fn head_b_table_c() -> Result<MachineFile, MachineError> {
    let mut file = Machine::head_b_table_c()?.to_file();
    file.source = Some("structure of FEED (9); all sizes typical of a propeller mill with a table of 4 m".to_owned());
    Ok(assuming(file, &UNKNOWN, &[]))
}

/// X, Y, Z carried by the head; a ram with this nose on Z.
fn head_xyz(x: f64, y: f64, z: f64, rates: Rates, on_z: Vec<BodyFile>) -> Vec<AxisLine> {
    let mut lines = vec![
        linear('X', false, [-x, x], rates),
        linear('Y', false, [-y, y], rates),
        linear('Z', false, [-z, 0.0], rates),
    ];
    lines[2].bodies = on_z;
    lines
}

/// Autodesk's generic AC and BC tables under a head with X, Y, Z.
fn trunnion(tilt: char) -> MachineFile {
    let is_b = tilt == 'B';
    let line = if is_b { [[0.0, 1.0, 0.0], [0.0, 531.0, 110.0]] } else { [[1.0, 0.0, 0.0], [514.0, 0.0, 110.0]] };
    let mut cradle = rotary(tilt, true, line, Some([-120.0, 120.0]), ROTARY_AUTODESK);
    cradle.bodies = vec![
        block("cradle", [800.0, 300.0, 60.0], [0.0, 0.0, -95.0]),
        block("cradle arm, positive side", [60.0, 220.0, 300.0], [430.0, 0.0, 25.0]),
        block("cradle arm, negative side", [60.0, 220.0, 300.0], [-430.0, 0.0, 25.0]),
    ];
    let mut table = rotary('C', true, [[0.0, 0.0, 1.0], [0.0; 3]], None, ROTARY_AUTODESK);
    table.bodies = vec![disc(250.0, 60.0, 0.0)];
    let ram = vec![nose(60.0, 650.0), block("ram", [240.0, 240.0, 600.0], [0.0, 0.0, 1070.0])];
    let (name, source) = if is_b {
        ("trunnion, table-table B-C", "table_bc_head_xyz")
    } else {
        ("trunnion, table-table A-C", "table_ac_head_xyz")
    };
    let head = head_xyz(380.0, 380.0, 550.0, MEDIUM, ram);
    let source = format!("offsets, ranges, order: {AUTODESK}, {source}");
    let made = file(name, &source, (vec![swap(cradle, is_b), table], 0.0), (head, 650.0));
    assuming(made, &[], &XYZ)
}

/// Autodesk's generic heads with C, and A or B in the fork.
fn fork(tilt: char) -> MachineFile {
    let is_b = tilt == 'B';
    let direction = if is_b { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] };
    let ram = vec![block("ram", [350.0, 350.0, 1000.0], [0.0, 0.0, 1800.0])];
    let mut head = head_xyz(2000.0, 725.0, 750.0, LARGE, ram);
    let mut c = rotary('C', false, [[0.0, 0.0, 1.0], [0.0, 0.0, 1217.921]], Some([-370.0, 370.0]), ROTARY_AUTODESK);
    c.bodies = vec![
        block("fork", [320.0, 240.0, 140.0], [0.0, 0.0, 1205.0]),
        block("fork arm, positive side", [60.0, 180.0, 260.0], [130.0, 0.0, 1005.0]),
        block("fork arm, negative side", [60.0, 180.0, 260.0], [-130.0, 0.0, 1005.0]),
    ];
    let mut spindle = rotary(tilt, false, [direction, [0.0, 0.0, 965.0]], Some([-120.0, 120.0]), ROTARY_AUTODESK);
    spindle.bodies = vec![nose(55.0, 800.0), block("spindle", [180.0, 180.0, 170.0], [0.0, 0.0, 995.0])];
    head.extend([swap(c, is_b), swap(spindle, is_b)]);
    let (name, source) =
        if is_b { ("fork, head-head C-B", "table_head_xyzcb") } else { ("fork, head-head C-A", "table_head_xyzca") };
    let source = format!("offsets, ranges, order: {AUTODESK}, {source}");
    let mut made = file(name, &source, (Vec::new(), 0.0), (head, 800.0));
    made.bed_bodies = vec![body("table", ShapeFile::Box { size_mm: [4200.0, 1600.0, 300.0] }, [0.0, 0.0, -150.0], 0.0)];
    assuming(made, &[], &XYZ)
}

/// A tilts the spindle about x, 200 mm above the nose, in a fork on Z; C turns the table.
fn head_a_table_c() -> MachineFile {
    let ram = vec![
        block("ram", [380.0, 420.0, 900.0], [0.0, 0.0, 1650.0]),
        block("fork arm, positive side", [60.0, 200.0, 400.0], [150.0, 0.0, 1000.0]),
        block("fork arm, negative side", [60.0, 200.0, 400.0], [-150.0, 0.0, 1000.0]),
    ];
    let mut head = head_xyz(500.0, 400.0, 600.0, MEDIUM, ram);
    let mut a = rotary('A', false, [[1.0, 0.0, 0.0], [0.0, 0.0, 900.0]], Some([-110.0, 110.0]), ROTARY);
    a.bodies = vec![nose(50.0, 700.0), round("spindle", 105.0, 330.0, [0.0, 0.0, 800.0])];
    head.push(a);
    let mut table = rotary('C', true, [[0.0, 0.0, 1.0], [0.0; 3]], None, ROTARY);
    table.bodies = vec![disc(400.0, 150.0, 0.0)];
    assuming(file("fork head A, turning table C", "typical", (vec![table], 0.0), (head, 700.0)), &UNKNOWN, &[])
}

/// Turned about x so that its axis leans by 45° from z toward +y.
fn leaning(mut body: BodyFile) -> BodyFile {
    body.rotation_xyz_deg = [-45.0, 0.0, 0.0];
    body
}

/// B leans by 45° from z toward +y and crosses the spindle 200 mm above the nose: half a turn lays
/// the tool level.
fn nutating_head() -> MachineFile {
    let along = |d: f64| [0.0, d * 0.5_f64.sqrt(), 900.0 + d * 0.5_f64.sqrt()];
    let ram = vec![
        block("ram", [500.0, 500.0, 1200.0], [0.0, 450.0, 1690.0]),
        leaning(round("swivel seat", 170.0, 160.0, along(260.0))),
    ];
    let mut head = head_xyz(400.0, 350.0, 600.0, MEDIUM, ram);
    let mut b = rotary('B', false, [[0.0, 1.0, 1.0], [0.0, 0.0, 900.0]], Some([-30.0, 180.0]), ROTARY);
    b.bodies = vec![
        nose(50.0, 700.0),
        round("spindle", 110.0, 330.0, [0.0, 0.0, 800.0]),
        leaning(round("knuckle", 150.0, 180.0, along(70.0))),
    ];
    head.push(b);
    let mut table = rotary('C', true, [[0.0, 0.0, 1.0], [0.0; 3]], None, ROTARY);
    table.bodies = vec![disc(400.0, 150.0, 0.0)];
    assuming(file("nutating head B, table C", LEANS, (vec![table], 0.0), (head, 700.0)), &UNKNOWN, &[])
}

/// B leans by 45° from z toward +y and crosses C 60 mm above the table's top.
fn nutating_table() -> MachineFile {
    let along = |d: f64| [0.0, d * 0.5_f64.sqrt(), 60.0 + d * 0.5_f64.sqrt()];
    let mut b = rotary('B', true, [[0.0, 1.0, 1.0], [0.0, 0.0, 60.0]], Some([0.0, 180.0]), ROTARY);
    b.bodies = vec![
        leaning(round("swivel arm", 120.0, 300.0, along(-430.0))),
        round("console", 200.0, 120.0, [0.0, 0.0, -180.0]),
    ];
    let mut table = rotary('C', true, [[0.0, 0.0, 1.0], [0.0; 3]], None, ROTARY);
    table.bodies = vec![disc(300.0, 50.0, 0.0)];
    let ram = vec![nose(50.0, 600.0), block("ram", [240.0, 260.0, 600.0], [0.0, 0.0, 1010.0])];
    let head = head_xyz(300.0, 350.0, 600.0, MEDIUM, ram);
    let mut made = file("nutating table B-C", LEANS, (vec![b, table], 0.0), (head, 600.0));
    made.bed_bodies = vec![block("swivel base", [500.0, 500.0, 500.0], [0.0, -430.0, -540.0])];
    assuming(made, &UNKNOWN, &[])
}

/// Autodesk's generic table that carries Y, X, A and C, under a head that has Z alone.
fn travelling_trunnion() -> MachineFile {
    let mut x = linear('X', true, [-1000.0, 1000.0], MEDIUM);
    x.bodies = vec![block("slide", [900.0, 400.0, 60.0], [0.0, 0.0, 30.0])];
    let mut a = rotary('A', true, [[1.0, 0.0, 0.0], [375.0, 0.0, 300.0]], Some([-120.0, 120.0]), ROTARY_AUTODESK);
    a.bodies = vec![
        block("cradle", [560.0, 260.0, 50.0], [0.0, 0.0, 215.0]),
        block("cradle arm, positive side", [50.0, 200.0, 170.0], [305.0, 0.0, 275.0]),
        block("cradle arm, negative side", [50.0, 200.0, 170.0], [-305.0, 0.0, 275.0]),
    ];
    let mut c = rotary('C', true, [[0.0, 0.0, 1.0], [0.0, 0.0, 300.0]], None, ROTARY_AUTODESK);
    c.bodies = vec![disc(180.0, 50.0, 300.0)];
    let mut z = linear('Z', false, [-700.0, 0.0], MEDIUM);
    z.bodies = vec![nose(50.0, 800.0), block("ram", [220.0, 260.0, 700.0], [0.0, 0.0, 1260.0])];
    let table = vec![linear('Y', true, [-350.0, 350.0], MEDIUM), x, a, c];
    let source = format!("offsets, ranges, order: {AUTODESK}, table_yxac_head_z");
    assuming(file("travelling trunnion, table Y X A C, head Z", &source, (table, 300.0), (vec![z], 800.0)), &[], &XYZ)
}

/// A bridge that travels along X over a fixed table; its ram carries a head that swivels about A,
/// then B.
fn bridge() -> MachineFile {
    let ram = vec![block("ram", [400.0, 400.0, 1600.0], [0.0, 0.0, 2630.0])];
    let mut head = head_xyz(3000.0, 1200.0, 1000.0, LARGE, ram);
    head[0].bodies = vec![block("bridge", [600.0, 4000.0, 700.0], [-600.0, 0.0, 2250.0])];
    let mut a = rotary('A', false, [[1.0, 0.0, 0.0], [0.0, 0.0, 1550.0]], Some([-40.0, 40.0]), ROTARY);
    a.bodies = vec![
        block("gimbal, front", [460.0, 60.0, 200.0], [0.0, -170.0, 1550.0]),
        block("gimbal, back", [460.0, 60.0, 200.0], [0.0, 170.0, 1550.0]),
    ];
    let mut b = rotary('B', false, [[0.0, 1.0, 0.0], [0.0, 0.0, 1550.0]], Some([-40.0, 40.0]), ROTARY);
    b.bodies = vec![nose(60.0, 1200.0), round("spindle", 110.0, 420.0, [0.0, 0.0, 1320.0])];
    head.extend([a, b]);
    let mut made = file("bridge with swivel head A-B", "typical", (Vec::new(), 0.0), (head, 1200.0));
    made.bed_bodies = vec![body("table", ShapeFile::Box { size_mm: [7000.0, 3000.0, 400.0] }, [0.0, 0.0, -200.0], 0.0)];
    assuming(made, &UNKNOWN, &[])
}

/// One head of a dual mill with two linear axes: C level along x carries the blade; the head has X,
/// Z, then B and A.
fn dual_mill_head() -> MachineFile {
    let mut c = rotary('C', true, [[1.0, 0.0, 0.0], [0.0; 3]], None, ROTARY);
    c.bodies = vec![turned_disc("face plate", 300.0, 120.0)];
    let mut z = linear('Z', false, [-900.0, 100.0], MEDIUM);
    z.bodies = vec![block("ram", [320.0, 320.0, 700.0], [600.0, -580.0, 1420.0])];
    let mut x = linear('X', false, [-400.0, 800.0], MEDIUM);
    x.bodies = vec![block("column", [700.0, 400.0, 2000.0], [600.0, -960.0, 1000.0])];
    let mut b = rotary('B', false, [[0.0, 1.0, 0.0], [600.0, 0.0, 1100.0]], Some([-110.0, 110.0]), ROTARY);
    b.bodies = vec![block("swivel", [200.0, 380.0, 200.0], [600.0, -230.0, 1100.0])];
    let mut a = rotary('A', false, [[1.0, 0.0, 0.0], [600.0, 30.0, 1050.0]], Some([-60.0, 60.0]), ROTARY);
    a.bodies = vec![shifted(nose(50.0, 800.0), 600.0, 30.0), round("spindle", 90.0, 200.0, [600.0, 30.0, 900.0])];
    let end = Isometry3::translation(600.0, 30.0, 800.0);
    let mut made = file(
        "one head of a dual mill, two linear axes",
        "typical; structure of CLOPT's dual mill",
        (vec![c], 0.0),
        (Vec::new(), 0.0),
    );
    made.tool_chains[0].rows = rows_from_axes(&[x, z, b, a], &end);
    assuming(made, &UNKNOWN, &[])
}

/// A disc about the bed's x axis whose front lies at x = 0, behind it.
fn turned_disc(name: &str, radius_mm: f64, height_mm: f64) -> BodyFile {
    let shape = ShapeFile::Cylinder { radius_mm, height_mm };
    BodyFile { rotation_xyz_deg: [0.0, 90.0, 0.0], ..body(name, shape, [-height_mm, 0.0, 0.0], 0.0) }
}

fn shifted(mut body: BodyFile, x: f64, y: f64) -> BodyFile {
    body.position_mm[0] += x;
    body.position_mm[1] += y;
    body
}
