//! A plate milled by hand-written programs with a tilted face mill: cusps, a planted gouge and what
//! was not reached are what closed forms say, in the report and in the colours.

mod across;
mod bodies;
mod estimates;
mod feeds;
mod plans;
mod planted_feeds;
mod rests;
mod stand_command;
mod stands;

use std::fmt::Write as _;
use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::new_job::NewJob;
use facemill::report::deviation::{CuspsNotCompared, DeviationFigures, DeviationReport};
use facemill::{CutRequest, DeviationRequest, Failure, Job, SilentStages, Verified, VerifyRequest, verify_program};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::paper_machine::PIVOT_TO_FACE;
use serde_json::{Value, json};

const RADIUS: f64 = 10.0;
const TILT_DEG: f64 = 10.0;
const STEP: f64 = 6.0;
const GAUGE: f64 = 120.0;
const ALLOWANCE: f64 = 0.5;
/// Height of the workpiece on the table.
const TABLE: f64 = 300.0;

/// Returns the cusp of a flat disc of this radius, tilted along the feed: its outline is an
/// ellipse.
fn cusp() -> f64 {
    RADIUS * TILT_DEG.to_radians().sin() * (1.0 - (1.0 - (STEP / (2.0 * RADIUS)).powi(2)).sqrt())
}

/// A plate of 30 × 30 × 6 mm, top at z = 0, whose top is to be cut, with 0.5 mm on it; a flat
/// cutter of 20 mm.
fn plate() -> JobFolder {
    let job = JobFolder::new(&NewJob::Patch { size_mm: 60.0 });
    let mut obj = String::new();
    for k in 0..8 {
        let at = |axis: u32, low: f64, high: f64| if k >> axis & 1 == 1 { high } else { low };
        let _ = writeln!(obj, "v {} {} {}", at(0, -15.0, 15.0), at(1, -15.0, 15.0), at(2, -6.0, 0.0));
    }
    obj += "g top\nf 5 6 8\nf 5 8 7\n";
    obj += "g sides\nf 1 3 4\nf 1 4 2\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";
    let mesh = |more: Value| {
        let mut mesh = json!({ "file": "plate.obj", "unit": "millimetre", "up_axis": "z" });
        mesh.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        mesh
    };
    job.write("plate.obj", obj.as_bytes());
    let meshes = json!([mesh(json!({ "role": "drive", "groups": ["top"] })), mesh(json!({ "role": "part" }))]);
    let offset = json!({ "offset": { "allowance_mm": ALLOWANCE } });
    job.set("job.json", &[("/setups/0/meshes", meshes), ("/setups/0/stock", offset)]);
    job.set(
        "tool.json",
        &[
            ("/radius_mm", json!(RADIUS)),
            ("/corner_radius_mm", json!(0)),
            ("/flute_length_mm", json!(10)),
            ("/dead_core_radius_mm", json!(0)),
            ("/max_ramp_angle_deg", json!(90)),
            ("/cutting_edge_angle_deg", json!(90)),
            ("/stick_out_mm", json!(60)),
            ("/gauge_length_mm", json!(GAUGE)),
            ("/body/sections", section(50.0, 16.0)),
            ("/holder/sections", section(60.0, 30.0)),
        ],
    );
    job
}

/// One section of a tool's body.
fn section(length: f64, diameter: f64) -> Value {
    json!([{ "length_mm": length, "diameter_low_mm": diameter, "diameter_high_mm": diameter }])
}

/// Words of the tilted cutter with its lowest point at a place of the work, by the paper's equation
/// (9) with C = 0.
fn words([x, y, z]: [f64; 3]) -> String {
    let (sin, cos) = TILT_DEG.to_radians().sin_cos();
    let l = PIVOT_TO_FACE + GAUGE;
    let tip = [x - RADIUS * cos, y, z + RADIUS * sin + TABLE];
    format!("X{:.4} Y{:.4} Z{:.4} B{TILT_DEG} C0.", tip[0] + l * sin, tip[1], tip[2] - l + l * cos)
}

/// Where the pass in the middle goes down.
const GOUGED_AT: f64 = 5.0;

/// Passes along x, the last one `last` steps beside the middle; with `gouge` the one in the middle
/// goes that deep at x = 5.
fn program(last: i32, gouge: f64) -> String {
    let mut text = format!("G21 G90 G94\nG0 G43 {} H1\n", words([-30.0, -18.0, 40.0]));
    for k in -3..=last {
        let y = STEP * f64::from(k);
        let _ = writeln!(text, "G0 {}\nG1 {} F2000.", words([-30.0, y, 40.0]), words([-30.0, y, 0.0]));
        for x in (-25..=35).step_by(5).map(f64::from) {
            let z = if k == 0 && x == GOUGED_AT { -gouge } else { 0.0 };
            let _ = writeln!(text, "G1 {}", words([x, y, z]));
        }
        let _ = writeln!(text, "G0 {}", words([35.0, y, 40.0]));
    }
    text + "M30\n"
}

fn verified(job: &JobFolder, text: &str, cell: f64, tolerance: Option<f64>) -> Result<Verified, Failure> {
    verified_for(Dialect::Fanuc, job, text, cell, tolerance)
}

fn verified_for(
    dialect: Dialect,
    job: &JobFolder,
    text: &str,
    cell: f64,
    tolerance: Option<f64>,
) -> Result<Verified, Failure> {
    let request = VerifyRequest {
        gouge_limit: Some(0.05),
        cut: Some(CutRequest {
            deviation: Some(DeviationRequest { tolerance, painted: true, since_stock: false }),
            ..CutRequest::on_lines(cell, 0.002)
        }),
        ..VerifyRequest::new(Path::new("program.nc"), dialect)
    };
    verify_program(&Job::read(&job.job())?, text.as_bytes(), &request, &SilentStages)
}

fn report(found: &Verified) -> &DeviationReport {
    found.file.deviation.as_ref().expect("it was requested")
}

/// Words have four decimals; the ways that are cut lie within the tolerance of the program's.
const NEAR: f64 = 0.005;

/// How far beside a pass the disc's outline is this high.
fn beside(height: f64) -> f64 {
    let sin = TILT_DEG.to_radians().sin();
    RADIUS * (1.0 - (1.0 - height / (RADIUS * sin)).powi(2)).sqrt()
}

/// The sum of all areas, mm².
fn sum(figures: &DeviationFigures) -> f64 {
    let a = &figures.area_mm2;
    a.within + a.gouged + a.excess + a.not_reached + a.no_stock + a.not_measured
}

/// The ridge is measured to the fall of its slope within half a cell, so the error falls with the
/// cell; areas are the ellipse's.
#[test]
fn cusps_are_those_of_the_tilted_disc() {
    let job = plate();
    let (sin, half) = (TILT_DEG.to_radians().sin(), STEP / 2.0);
    let slope = sin * half / (RADIUS * RADIUS - half * half).sqrt();
    for cell in [1.0, 0.3] {
        let found = verified(&job, &program(3, 0.0), cell, Some(0.04)).unwrap();
        let report = report(&found);
        assert!(!report.exceeds_gouge_limit && report.cavity.is_none());
        let drive = &report.drive;
        let excess = drive.largest_excess.unwrap().value_mm;
        assert!(excess <= cusp() + NEAR && excess >= cusp() - 0.5 * slope * cell - NEAR, "{excess} {}", cusp());
        assert!(drive.largest_gouge.is_none_or(|g| g.value_mm < NEAR), "{:?}", drive.largest_gouge);
        let a = drive.area_mm2;
        assert!((sum(drive) - 900.0).abs() < 1e-6, "{a:?}");
        assert!(a.gouged + a.no_stock + a.not_reached + a.not_measured == 0.0, "{a:?}");
        let share = a.within / 900.0;
        // Both sides of a border between within and excess are off by half a cell at most.
        assert!((share - 2.0 * beside(0.04) / STEP).abs() <= 2.0 * cell / STEP, "{share}");
        // Words of the program alone say what the disc leaves; of passes that are four cells apart.
        let cusps = report.cusps.as_ref().unwrap();
        if cell * 4.0 <= STEP {
            let ratio = cusps.ratio.unwrap();
            assert!((cusps.largest_predicted_mm - cusp()).abs() < 1e-3, "{cusps:?} {}", cusp());
            assert!(cusps.compared > 10 && cusps.uncut == 0, "{cusps:?}");
            assert!((1.0 - ratio.median).abs() < (0.5 * slope * cell + NEAR) / cusp(), "{cusps:?}");
        }
        let measured: f64 = drive.histogram.iter().map(|b| b.area_mm2).sum();
        assert!((measured - 900.0).abs() < 1e-6 && drive.histogram.len() == 18);
        let over = |from: f64| drive.histogram.iter().filter(move |b| b.from_mm.is_some_and(|f| f >= from - 1e-9));
        assert!((over(0.04).map(|b| b.area_mm2).sum::<f64>() - a.excess).abs() < 1e-6);
        assert!(over(0.1).all(|b| b.area_mm2 == 0.0));
    }
}

/// Every point that is drawn is compared, or counted with the reason: of passes three cells apart
/// that they are too close.
#[test]
fn reasons_for_cusps_that_are_not_compared_are_counted() {
    let job = plate();
    for cell in [1.0, 2.0] {
        let found = verified(&job, &program(1, 0.0), cell, Some(0.04)).unwrap();
        let cusps = report(&found).cusps.as_ref().unwrap();
        let CuspsNotCompared { no_neighbour, too_close, beside_an_end, too_low, not_measured } = cusps.not_compared;
        let others = no_neighbour + too_close + beside_an_end + too_low + not_measured;
        assert_eq!(cusps.compared + cusps.uncut + others, cusps.sampled, "{cusps:?}");
        let is_close = 4.0 * cell > STEP;
        assert_eq!((too_close > cusps.sampled / 2, cusps.compared > 0), (is_close, !is_close), "{cusps:?}");
        assert_eq!(too_low, 0, "{cusps:?}");
    }
}

/// The passes of [`program`] with words of the tip, and the tool's axis in cuts as given.
fn tip_program(axis: &str) -> String {
    let (sin, cos) = TILT_DEG.to_radians().sin_cos();
    let tip = |[x, y, z]: [f64; 3]| format!("X{:+.4} Y{:+.4} Z{:+.4}", x - RADIUS * cos, y, z + RADIUS * sin + TABLE);
    let words = format!("B{TILT_DEG:+} C+0");
    let cut = if axis.starts_with('T') { "LN" } else { "L" };
    let mut text =
        "BEGIN PGM TIPS MM\nTOOL CALL 1 Z S6000\nM3\nFUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\n".to_owned();
    for k in -3..=3 {
        let y = STEP * f64::from(k);
        let _ = writeln!(text, "L {} {words} R0 FMAX\nL {} R0 F2000", tip([-30.0, y, 40.0]), tip([-30.0, y, 0.0]));
        for x in (-25..=35).step_by(5).map(f64::from) {
            let _ = writeln!(text, "{cut} {} {axis}", tip([x, y, 0.0]));
        }
        let _ = writeln!(text, "L {} {words} R0 FMAX", tip([35.0, y, 40.0]));
    }
    text + "M30\nEND PGM TIPS MM\n"
}

/// A vector, of any length, is the tool's axis as rotary words are.
#[test]
fn cusps_of_tool_vectors_are_those_of_rotary_words() {
    let job = plate();
    job.set("machine.json", &[("/motion/cutting", json!("tip_and_rotaries_linear"))]);
    let (sin, cos) = TILT_DEG.to_radians().sin_cos();
    let of = |axis: &str| {
        let found = verified_for(Dialect::Heidenhain, &job, &tip_program(axis), 1.0, Some(0.04)).unwrap();
        report(&found).cusps.clone().unwrap_or_else(|| panic!("{axis}: no cusps"))
    };
    let by_words = of(&format!("B{TILT_DEG:+} C+0"));
    assert!(by_words.compared > 10 && (by_words.largest_predicted_mm - cusp()).abs() < 1e-3, "{by_words:?}");
    for length in [1.0, 2.5] {
        let by_vectors = of(&format!("TX{:+.12} TY+0 TZ{:+.12}", length * sin, length * cos));
        // Neighbours on both sides are equally near: which one is taken is up to rounding.
        assert!(by_vectors.compared.abs_diff(by_words.compared) <= 2, "{by_vectors:?} {by_words:?}");
        assert_eq!(by_vectors.sampled, by_words.sampled);
        assert!((by_vectors.largest_predicted_mm - by_words.largest_predicted_mm).abs() < 1e-5, "{by_vectors:?}");
        assert!((by_vectors.ratio.unwrap().median - by_words.ratio.unwrap().median).abs() < 1e-3, "{by_vectors:?}");
    }
}

/// A strip without passes keeps its allowance and is reported as such, and the bottom too; walls
/// along the lines are not measured.
#[test]
fn unreached_material_is_distinguished_from_material_left() {
    let found = verified(&plate(), &program(1, 0.0), 0.5, Some(0.04)).unwrap();
    let (drive, part) = (&report(&found).drive, &report(&found).part);
    let left = drive.largest_not_reached.unwrap();
    assert!((left.value_mm - ALLOWANCE).abs() < 1e-6 && left.at_mm[1] > STEP, "{left:?}");
    // Beside the last pass the outline rises up to the allowance.
    assert!(drive.largest_excess.is_some_and(|e| e.value_mm > 0.4 && e.value_mm <= ALLOWANCE + NEAR));
    let strip = 30.0 * (15.0 - STEP - beside(ALLOWANCE));
    assert!((drive.area_mm2.not_reached - strip).abs() <= 30.0 * 0.5, "{} {strip}", drive.area_mm2.not_reached);
    let (sides, faces) = (4.0 * 30.0 * 6.0, 2.0 * 900.0);
    assert!((sum(part) - sides - faces).abs() < 1e-6);
    assert!((part.area_mm2.not_reached - drive.area_mm2.not_reached - 900.0).abs() < 1e-6, "{part:?}");
    assert!((part.area_mm2.not_measured - sides).abs() < 1e-6, "{part:?}");
}

#[test]
fn a_planted_gouge_is_reported_with_its_depth_and_place_and_is_red() {
    let job = plate();
    let found = verified(&job, &program(1, 0.15), 0.3, Some(0.04)).unwrap();
    let report = report(&found);
    assert!(report.exceeds_gouge_limit);
    let gouge = report.drive.largest_gouge.unwrap();
    assert_eq!(report.part.largest_gouge, Some(gouge));
    assert!((gouge.value_mm - 0.15).abs() < 0.02, "{gouge:?}");
    assert!(
        (gouge.at_mm[0] - GOUGED_AT).abs() < 1.0 && gouge.at_mm[1].abs() < 0.5 && gouge.at_mm[2].abs() < 1e-9,
        "{gouge:?}"
    );
    // Within a limit that is deeper it is no fault, and in the gouge's own tolerance nothing is
    // gouged.
    let found = verified(&job, &program(1, 0.03), 0.5, None).unwrap();
    let lenient = found.file.deviation.as_ref().unwrap();
    assert!(!lenient.exceeds_gouge_limit && lenient.drive.area_mm2.gouged == 0.0);
    assert!(lenient.drive.largest_gouge.is_some_and(|g| (0.02..0.035).contains(&g.value_mm)));

    let found = verified(&job, &program(1, 0.15), 0.5, Some(0.04)).unwrap();
    let vertices = painted(found.painted.as_ref().unwrap());
    let colour_at = |x: f64, y: f64| {
        let distance = |v: &([f64; 3], [f64; 3])| (v.0[0] - x).hypot(v.0[1] - y).hypot(v.0[2]);
        vertices.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap().1
    };
    let [gouged, fine, left, ridge] =
        [(GOUGED_AT, 0.0), (-8.0, 0.0), (0.0, 14.0), (-9.0, 3.0)].map(|(x, y)| colour_at(x, y));
    assert!(gouged[0] > 3.0 * gouged[1] && gouged[0] > 3.0 * gouged[2], "{gouged:?}");
    assert!(fine[1] > 2.0 * fine[0] && fine[1] > 2.0 * fine[2], "{fine:?}");
    assert!(left[0] == left[1] && left[1] == left[2], "{left:?}");
    assert!(ridge[2] > 2.0 * ridge[0] && ridge[2] > 1.1 * ridge[1], "{ridge:?}");

    let why = verified(&job, &program(1, 0.0), 1.0, Some(0.0)).err().unwrap().to_string();
    assert!(why.contains("tolerance of the deviation") && why.contains("above 0"), "{why}");
}

/// A side that the job names twice, with an allowance of its own: the part is closed all the same,
/// and is compared with the finish that the program should leave.
#[test]
fn allowances_count_and_surfaces_named_twice_are_there_once() {
    let job = plate();
    job.set("job.json", &[("/setups/0/meshes/0/allowance_mm", json!(0.1))]);
    let found = verified(&job, &program(3, 0.0), 0.5, Some(0.04)).unwrap();
    let (drive, part) = (&report(&found).drive, &report(&found).part);
    assert!((sum(drive) - 900.0).abs() < 1e-6 && (sum(part) - 2520.0).abs() < 1e-6, "{drive:?} {part:?}");
    assert!((drive.largest_gouge.unwrap().value_mm - 0.1).abs() < NEAR, "{drive:?}");
    assert!(report(&found).exceeds_gouge_limit && drive.area_mm2.gouged > 0.5 * 900.0);
    assert!(drive.largest_not_reached.is_none() && part.area_mm2.no_stock == 0.0, "{part:?}");
}

/// A post on the plate that is a check surface: what it covers is no surface of the part, and it is
/// no stock on it.
#[test]
fn check_surfaces_are_what_the_part_is_joined_to() {
    let job = plate();
    let mut post = String::new();
    for k in 0..8 {
        let at = |axis: u32, low: f64, high: f64| if k >> axis & 1 == 1 { high } else { low };
        let _ = writeln!(post, "v {} {} {}", at(0, -5.0, 5.0), at(1, 11.0, 14.0), at(2, -3.0, 8.0));
    }
    post +=
        "f 5 6 8\nf 5 8 7\nf 1 3 4\nf 1 4 2\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";
    job.write("post.obj", post.as_bytes());
    let check =
        json!({ "file": "post.obj", "unit": "millimetre", "up_axis": "z", "role": "check", "allowance_mm": 0.2 });
    let mut meshes = job.json("job.json")["setups"][0]["meshes"].clone();
    meshes.as_array_mut().unwrap().push(check);
    job.set("job.json", &[("/setups/0/meshes", meshes)]);
    let found = verified(&job, &program(-1, 0.0), 0.5, Some(0.04)).unwrap();
    let drive = &report(&found).drive;
    assert!(!report(&found).exceeds_gouge_limit && (sum(drive) - 900.0).abs() < 1e-6, "{drive:?}");
    let left = drive.largest_not_reached.unwrap().value_mm;
    assert!(left < 0.6, "{left}: the post is not stock on the plate");
    // The covered rectangle, but for a cell around it.
    assert!((drive.area_mm2.not_measured - 30.0).abs() < 2.0 * (10.0 + 3.0) * 0.75, "{drive:?}");
}

/// Places (mm, +Z up) and colours of the vertices of a GLB, from its bytes.
fn painted(bytes: &[u8]) -> Vec<([f64; 3], [f64; 3])> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let bin = &bytes[28 + length..];
    let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
    let data = |name: &str| {
        let accessor = &json["accessors"][attributes[name].as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap() as usize;
        (&bin[start..], accessor["count"].as_u64().unwrap() as usize)
    };
    let (points, n) = data("POSITION");
    let (colours, m) = data("COLOR_0");
    assert_eq!(n, m);
    let point = |k: usize| {
        let at = |c: usize| f64::from(f32::from_le_bytes(points[12 * k + 4 * c..][..4].try_into().unwrap())) * 1000.0;
        [at(0), -at(2), at(1)]
    };
    let colour =
        |k: usize| [0, 1, 2].map(|c| f64::from(u16::from_le_bytes(colours[8 * k + 2 * c..][..2].try_into().unwrap())));
    (0..n).map(|k| (point(k), colour(k))).collect()
}
