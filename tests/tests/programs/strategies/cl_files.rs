//! Passes from CL files: of a plan itself, and as a CAM system writes them.

use facemill::cc_path::files::read_path_file;
use facemill::cl_data::{CcPoint, ClPoint, Posture};
use facemill::cl_file::{AptPointKind, read_apt};
use facemill::report::outcome::Outcome;
use facemill::tool_model::{Cutter, cl_from_cc};
use facemill::{Failure, Planned};
use facemill_tests::commands::facemill_in;
use facemill_tests::jobs::{JobFolder, small_patch, small_patch_planned, text_of, unfinished};
use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

fn path(axes: &str, max_distance_mm: f64) -> (&'static str, Value) {
    ("/operations/0/path", json!({ "cl": { "file": "part.apt", "axes": axes, "max_distance_mm": max_distance_mm } }))
}

fn either() -> (&'static str, Value) {
    ("/operations/0/direction", json!("either"))
}

/// The job of the small patch by the APT file of its own plan.
fn again(axes: &str) -> Planned {
    let job = small_patch();
    job.write("part.apt", text_of(small_patch_planned(), "program.apt").as_bytes());
    job.set("job.json", &[path(axes, 0.1), either(), unfinished()]);
    job.plan()
}

/// Tips and axes at feed.
fn poses(apt: &str) -> Vec<ClPoint> {
    let file = read_apt(apt).expect("an APT file");
    file.points.iter().filter(|p| p.kind == AptPointKind::Linear).map(|p| p.cl).collect()
}

/// Contact points of a plan.
fn contacts(planned: &Planned) -> Vec<Point3<f64>> {
    let file = read_path_file(text_of(planned, "passes.json").as_bytes()).expect("a path file");
    file.passes.iter().flat_map(|pass| &pass.points_mm).map(|p| Point3::from(*p)).collect()
}

/// The radius of the cutter, 10 mm, turns an angle of the axis into a distance of its rim.
#[test]
fn a_plan_by_its_own_apt_file_with_kept_axes_has_the_same_poses() {
    let (first, second) = (small_patch_planned(), again("kept"));
    assert!(second.outcome() == Outcome::Done, "{:?}", second.report.infeasible);
    let own = poses(&text_of(&second, "program.apt"));
    let is_same = |a: &ClPoint, b: &ClPoint| {
        (a.tip - b.tip).norm() < 1e-4 && 10.0 * (a.axis.into_inner() - b.axis.into_inner()).norm() < 1e-4
    };
    let kept = poses(&text_of(first, "program.apt")).iter().filter(|a| own.iter().any(|b| is_same(a, b))).count();
    let planned = first.report.totals.planned_points;
    assert!(kept >= planned, "{kept} of at least {planned}");
    let [report] = &second.report.cl_paths[..] else { panic!("one operation") };
    assert!(report.tip.expect("kept").mm < 1e-4 && report.axis.deg < 1e-3, "{report:?}");
    assert!(report.above.mm <= 0.1 && report.below.mm <= 0.02, "{report:?}");
    assert!(report.points_off_surface > 0 && report.passes >= first.report.totals.passes, "{report:?}");
    assert!(second.report.postures[0].mode.is_none() && second.report.findings.is_empty());
}

/// Contact points do not depend on the axes: those of the first plan are among the second's.
#[test]
fn a_plan_by_its_own_apt_file_with_searched_axes_touches_the_same_places() {
    let (first, second) = (small_patch_planned(), again("searched"));
    let own = contacts(&second);
    let near = |p: &Point3<f64>| own.iter().map(|q| (p - q).norm()).fold(f64::INFINITY, f64::min);
    let all = contacts(first);
    let missed = all.iter().filter(|p| near(p) > 0.005).count();
    // Points that the second plan trims where it may not enter.
    assert!(missed <= second.report.totals.trimmed_points, "{missed} of {}", all.len());
    let [report] = &second.report.cl_paths[..] else { panic!("one operation") };
    assert!(report.tip.is_none() && report.axis.deg > 0.0 && report.axis.line.is_some(), "{report:?}");
    assert!(second.report.findings.is_empty());
}

/// A plate of 160 by 60 mm, with the tool of the small patch: a face mill of 20 mm, corner 0.75 mm.
fn plate(apt: &str, values: &[(&str, Value)]) -> JobFolder {
    let job = small_patch();
    let plate = "g plate\nv -80 -30 0\nv 80 -30 0\nv 80 30 0\nv -80 30 0\nf 1 2 3\nf 1 3 4\n";
    job.write("patch.obj", plate.as_bytes()).write("part.apt", apt.as_bytes());
    job.set("job.json", &[path("kept", 0.02), either(), unfinished()]).set("job.json", values);
    job
}

/// The measures of its cutter.
fn mill(job: &JobFolder) -> Cutter {
    let tool = job.json("tool.json");
    let [radius, corner, flute] =
        ["radius_mm", "corner_radius_mm", "flute_length_mm"].map(|key| tool[key].as_f64().expect("a length"));
    Cutter::new(radius, corner, flute).expect("a cutter")
}

/// As a CAM system for three axes writes it: no axes, both cuts joined at feed beside the plate.
fn facing(height: f64) -> String {
    format!(
        "PARTNO/FACE\nUNITS/MM\nLOADTL/1\nSPINDL/1200,RPM,CLW\nRAPID\nGOTO/-120,-16,50\nRAPID\nGOTO/-120,-16,{height}\n\
         FEDRAT/1200\nGOTO/120,-16,{height}\nGOTO/120,16,{height}\nGOTO/-120,16,{height}\nRAPID\nGOTO/-120,16,50\nFINI\n"
    )
}

#[test]
fn a_plate_is_faced_by_a_file_for_three_axes() {
    let planned = plate(&facing(0.0), &[]).plan();
    assert!(planned.outcome() == Outcome::Done, "{:?}", planned.report.findings);
    let [report] = &planned.report.cl_paths[..] else { panic!("one operation") };
    assert_eq!((report.cuts, report.points, report.passes, report.points_off_surface), (1, 4, 2, 4));
    assert_eq!((report.tip.map(|tip| tip.mm), report.axis.deg, report.below.mm), (Some(0.0), 0.0, 0.0));
    // Two cuts of 240 mm and 32 mm between them; what is over the plate of 160 mm with the rim's
    // 10.
    assert!((report.length_mm - 512.0).abs() < 1e-6, "{report:?}");
    assert!((300.0..=370.0).contains(&report.in_passes_mm), "{report:?}");
    let way = report.planned_mm;
    assert!(way <= report.in_passes_mm + 1e-6 && way > report.in_passes_mm - 10.0, "{report:?}");
    assert_eq!((report.points_without_direction, report.contact_jumps, report.axis_jumps), (0, 0, 0));
    assert_eq!((report.largest_turn.deg, report.largest_turn.line), (0.0, None));
    // Poses over the plate are on both lines of the file.
    let own = poses(&text_of(&planned, "program.apt"));
    let over: Vec<&ClPoint> = own.iter().filter(|cl| cl.tip.x.abs() < 80.0).collect();
    let is_on_a_line =
        |cl: &&ClPoint| (cl.tip.y.abs() - 16.0).abs() < 1e-9 && cl.tip.z.abs() < 1e-9 && cl.axis.z == 1.0;
    assert!(over.len() > 60 && over.iter().all(is_on_a_line));
    // The same with axes of ours, which lean.
    let searched = plate(&facing(0.0), &[path("searched", 0.02)]).plan();
    let [report] = &searched.report.cl_paths[..] else { panic!("one operation") };
    assert!((14.0 - 1e-6..20.1).contains(&report.axis.deg), "{report:?}");
    assert!(
        contacts(&searched).iter().all(|p| p.z.abs() < 1e-6 && p.x.abs() < 80.1 && (p.y.abs() - 16.0).abs() < 1e-6)
    );
}

/// The unit of the job is that of a file without UNITS, and refuses one with another unit.
#[test]
fn the_unit_of_a_path_is_that_of_a_file_without_units() {
    let text = "LOADTL/1\nSPINDL/1200,RPM,CLW\nRAPID\nGOTO/-12,-1.6,5\nRAPID\nGOTO/-12,-1.6,0\nFEDRAT/120\nGOTO/12,-1.6,0\n\
                RAPID\nGOTO/12,-1.6,5\nFINI\n";
    let cm = ("/operations/0/path/cl/unit", json!("cm"));
    let planned = plate(text, std::slice::from_ref(&cm)).plan();
    let [report] = &planned.report.cl_paths[..] else { panic!("one operation") };
    assert!((report.length_mm - 240.0).abs() < 1e-6, "{report:?}");
    assert_eq!(report.notes, ["UNITS is missing: lengths are in cm, the unit given beside the file"]);
    let refused = plate(&format!("UNITS/MM\n{text}"), &[cm]).try_plan();
    let why = refused.err().expect("another unit").to_string();
    assert!(why.contains("part.apt: line 1, column 1: UNITS: it is not the unit"), "{why}");
}

/// Two cuts along the middle of the plate: the axis leans by 10 deg in the first and by 30 in the
/// second.
fn leaning(job: &JobFolder) -> String {
    let mut text = String::from("UNITS/MM\nMULTAX/ON\nRAPID\nGOTO/-60,0,80,0,0,1\nRAPID\n");
    for k in 0..=60 {
        let at = Point3::new(-60.0 + 2.0 * f64::from(k), 0.0, 0.0);
        let cc = CcPoint::new(at, Vector3::z(), Vector3::x()).expect("a point");
        if k == 31 {
            text += "RAPID\nGOTO/2,0,80,0,0,1\nRAPID\n";
        }
        let tilt = if k < 31 { 10_f64 } else { 30.0 };
        let cl = cl_from_cc(&mill(job), &cc, Posture { tilt: tilt.to_radians(), rotate: 0.0 });
        let (t, a) = (cl.tip, cl.axis);
        text += &format!("GOTO/{:.7},{:.7},{:.7},{:.9},{:.9},{:.9}\n", t.x, t.y, t.z, a.x, a.y, a.z);
        text += if k == 0 { "FEDRAT/1200\n" } else { "" };
    }
    text + "RAPID\nGOTO/60,0,80,0,0,1\nFINI\n"
}

#[test]
fn kept_poses_that_are_not_permitted_are_left_out_by_name() {
    let cone = ("/operations/0/search/tool_axis_cone", json!({ "axis": [0, 0, 1], "half_angle_deg": 20 }));
    let trim = ("/operations/0/infeasible", json!({ "trim": { "max_trimmed_fraction": 0.6 } }));
    let job = plate("", &[cone.clone(), trim]);
    job.write("part.apt", leaning(&job).as_bytes());
    let planned = job.plan();
    let report = &planned.report;
    assert!(report.totals.trimmed_points >= 30 && report.totals.planned_points >= 30, "{:?}", report.totals);
    assert!(
        report.infeasible.iter().any(|i| i.reason.contains("cone") && i.would_help.is_empty()),
        "{:?}",
        report.infeasible
    );
    assert!(report.findings.is_empty());
    // Of the 120 mm of the file half leans too far.
    let way = &report.cl_paths[0];
    assert!((way.length_mm - way.in_passes_mm).abs() < 5.0 && way.planned_mm < 0.6 * way.in_passes_mm, "{way:?}");
    // Every pose that is cut is one of the file.
    assert!(report.cl_paths[0].tip.expect("kept").mm < 1e-6, "{:?}", report.cl_paths);
    let job = plate("", &[cone, ("/operations/0/infeasible", json!("stop"))]);
    job.write("part.apt", leaning(&job).as_bytes());
    let stopped = job.try_plan();
    assert!(matches!(stopped, Err(Failure::Infeasible(why)) if why.contains("cone")));
}

#[test]
fn files_that_are_no_path_are_refused_with_file_line_and_remedy() {
    let cut = |replaced: &str, by: &str| facing(0.0).replace(replaced, by);
    let refused = |apt: &str, values: &[(&str, Value)], words: &[&str]| {
        let job = plate(apt, values);
        let output = facemill_in(&job, "plan job.json --quiet");
        assert!(output.is_refused_for(words), "{words:?}: {} {}", output.code, output.errors);
    };
    refused(&facing(-0.5), &[], &["part.apt", "line 10", "0.500 mm deep", "max_distance_mm"]);
    refused(&facing(3.0), &[], &["part.apt", "line 10", "3.000 mm", "workpiece frame"]);
    refused(
        &cut("UNITS/MM", "UNITS/MM\nCUTTER/63,0.75"),
        &[],
        &["part.apt", "line 3", "diameter 63.000", "diameter 20.000"],
    );
    refused(&cut("GOTO/", "RAPID\nGOTO/"), &[], &["part.apt", "no statement moves the tool at feed"]);
    refused(&cut("GOTO/120,16", "GOTO/1x,16"), &[], &["part.apt", "line 11", "1x"]);
    refused("{}", &[], &["part.apt", "no CL file"]);
    refused(&facing(0.0), &[("/operations/0/path/cl/tool", json!(4))], &["part.apt", "tool 4", "1 (line 10)"]);
    refused(&facing(0.0), &[("/operations/0/path/cl/file", json!("none.apt"))], &["none.apt"]);
    refused(&facing(0.0), &[("/operations/0/path/cl/max_distance_mm", json!(0))], &["path.cl.max_distance_mm"]);
    refused(&facing(0.0), &[("/operations/0/path/cl/max_distance", json!(0))], &["max_distance_mm"]);
    refused(&facing(0.0), &[("/operations/0/direction", json!("climb"))], &["path.cl.axes", "either", "uncut_side"]);
}
