//! Machine files of another program: the result, and refusals.

use std::path::{Path, PathBuf};

use crate::common::*;
use facemill_inverse_kinematics::import::{RotaryRole, import_autodesk_machine};
use facemill_inverse_kinematics::machine_file::AssumedValue;
use facemill_inverse_kinematics::*;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

/// The shared files, sorted; none (and a line that says so) where they are absent.
fn shared_machines() -> Vec<PathBuf> {
    let folder = std::env::var_os("FACEMILL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from)
        .join("data/machines");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("SKIPPED: no shared data at {} (set FACEMILL_SHARED to its folder)", folder.display());
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "machine"));
    files.sort();
    assert_eq!(files.len(), 17);
    files
}

/// Reads an attribute without a parser: every element of these files is on one line.
fn attribute<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let start = line.find(&format!(" {name}=\""))? + name.len() + 3;
    line[start..].split('"').next()
}

fn vector(text: &str) -> Vector3<f64> {
    let words = text.split_whitespace().map(|w| w.trim_end_matches("mm").trim_end_matches("deg"));
    Vector3::from_iterator(words.map(|w| w.parse::<f64>().unwrap()))
}

/// A second reading of an axis element: the motion of its load when its word grows.
struct Element {
    letter: &'static str,
    on_table: bool,
    is_linear: bool,
    vector: Vector3<f64>,
    offset: Vector3<f64>,
    range: Option<(f64, f64)>,
}

fn elements(text: &str) -> Vec<Element> {
    let lines = text.lines().filter(|l| l.trim_start().starts_with("<axis "));
    let element = |line: &str| {
        let coordinate = "XYZ".find(attribute(line, "coordinate").unwrap()).unwrap();
        let is_linear = attribute(line, "actuator") == Some("linear");
        let unit = Vector3::from_fn(|k, _| if k == coordinate { 1.0 } else { 0.0 });
        let range = attribute(line, "range").map(|r| {
            let r: Vec<f64> = r.split(' ').map(|w| vector(&format!("{w} 0 0")).x).collect();
            (r[0], r[1])
        });
        Element {
            letter: if is_linear { ["X", "Y", "Z"][coordinate] } else { ["A", "B", "C"][coordinate] },
            on_table: attribute(line, "link") == Some("table"),
            is_linear,
            vector: attribute(line, "axis").map_or(unit, vector),
            offset: vector(attribute(line, "offset").unwrap()),
            range,
        }
    };
    lines.map(element).collect()
}

impl Element {
    /// Motion of its load.
    fn motion(&self, value: f64) -> Isometry3<f64> {
        if self.is_linear {
            let side = if self.on_table { -1.0 } else { 1.0 };
            return Translation3::from(self.vector * side * value).into();
        }
        let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(self.vector), -value);
        Translation3::from(self.offset) * turn * Translation3::from(-self.offset)
    }
}

/// Returns table from nose by the elements themselves: those of the table in the order of the file,
/// the rotary ones of the head in reverse.
fn pose_by_elements(text: &str, value: &dyn Fn(&str) -> f64) -> Isometry3<f64> {
    let all = elements(text);
    let simulation = text.lines().find(|l| l.contains("<simulation ")).unwrap();
    let at = |name: &str| Translation3::from(vector(attribute(simulation, name).unwrap()));
    let run = |chain: Vec<&Element>| chain.iter().fold(Isometry3::identity(), |m, e| m * e.motion(value(e.letter)));
    let table = run(all.iter().filter(|e| e.on_table).collect());
    let linear = run(all.iter().filter(|e| !e.on_table && e.is_linear).collect());
    let rotary = run(all.iter().filter(|e| !e.on_table && !e.is_linear).rev().collect());
    (table * at("tableAttachPoint")).inverse() * linear * rotary * at("toolAttachPoint")
}

#[test]
fn shared_machines_move_as_their_elements_say() {
    let mut r = Random(3);
    for path in shared_machines() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let machine = Machine::from_file(import_autodesk_machine(&text).unwrap()).unwrap();
        for element in elements(&text) {
            let axis = &machine.axes()[machine.axis_index(element.letter).unwrap()];
            assert_eq!(axis.carried_by == Carrier::Table, element.on_table, "{name}");
            match element.range {
                Some((min, max)) => {
                    assert!((axis.in_word_unit(axis.min) - min).abs() < 1e-9, "{name} {axis:?}");
                    assert!((axis.in_word_unit(axis.max) - max).abs() < 1e-9, "{name} {axis:?}");
                }
                None => assert!(axis.endless, "{name} {axis:?}"),
            }
        }
        for _ in 0..50 {
            let q = random_values(&mut r, &machine);
            let expected = pose_by_elements(&text, &|letter| q[machine.axis_index(letter).unwrap()]);
            let pose = machine.forward(&q, 0.0);
            // Lengths are rounded to 1e-5 mm.
            let shift = (pose.translation.vector - expected.translation.vector).norm();
            let turn = pose.rotation.angle_to(&expected.rotation);
            assert!(shift < 1e-4 && turn < 1e-7, "{name}: {shift} mm, {turn} rad");
        }
    }
}

#[test]
fn shared_machines_go_there_and_back() {
    let mut r = Random(5);
    for path in shared_machines() {
        let machine = Machine::from_file(import_autodesk_machine(&std::fs::read_to_string(&path).unwrap()).unwrap());
        let machine = machine.unwrap();
        for _ in 0..200 {
            let q = random_values(&mut r, &machine);
            let cl = machine.cl_point(&q, 120.0);
            let solutions = machine.inverse_near(&cl, 120.0, &q).unwrap();
            let found = solutions.iter().any(|s| {
                let (mm, rad) = difference(&machine, &s.values, &q);
                mm < 1e-6 && rad < 1e-9
            });
            assert!(found, "{}: {q:?} is not among {solutions:?}", path.display());
            for s in solutions.iter() {
                let reached = cl_by_matrices(&machine, &s.values, 120.0);
                assert!((reached.tip - cl.tip).norm() < 1e-8 && (*reached.axis - *cl.axis).norm() < 1e-11);
            }
        }
    }
}

/// Families by the names of the files: letters on the table and on the head, from the bed outward.
#[test]
fn shared_machines_are_of_the_family_in_their_name() {
    for path in shared_machines() {
        let name = path.file_stem().unwrap().to_string_lossy().to_uppercase();
        let file = import_autodesk_machine(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert!(!file.is_assumed(AssumedValue::Limits, "X") && file.is_assumed(AssumedValue::MaxVelocity, "X"));
        assert!(file.is_assumed(AssumedValue::MaxAcceleration, "Z") && file.is_assumed(AssumedValue::Motion, ""));
        let family = Machine::from_file(file).unwrap().family();
        let (table, head) = name.strip_prefix("AUTODESK_5AX_TABLE").unwrap().split_once("_HEAD_").unwrap();
        let letters = |linear: &[AxisLetter], rotary: &[RotaryRole]| -> String {
            linear.iter().map(ToString::to_string).chain(rotary.iter().map(|r| r.letter.to_string())).collect()
        };
        assert_eq!(letters(&family.linear_table, &family.table), table.trim_start_matches('_'), "{name}");
        assert_eq!(letters(&family.linear_head, &family.head), head, "{name}");
    }
}

const SMALL: &str = r#"<?xml version="1.0"?>
<machine xmlns="http://www.hsmworks.com/xml/2009/machine">
  <vendor>V</vendor><model>M</model>
  <capabilities maximumFeedrate="12000mm/min"/>
  <simulation tableAttachPoint="0mm 0mm 0mm" toolAttachPoint="0mm 0mm 25in"/>
  <axis actuator="linear" coordinate="X" id="X" link="table" offset="0mm 0mm 0mm" range="-1m 1m" rapidFeed="500mm/s"/>
  <axis actuator="linear" coordinate="Y" id="Y" link="head" offset="0mm 0mm 0mm" range="-380mm 380mm"/>
  <axis actuator="linear" coordinate="Z" id="Z" link="head" offset="0mm 0mm 0mm" range="-550mm 0mm"/>
  <spindle axis="0 0 1"/>
  <axis actuator="rotational" axis="0 1 1" coordinate="Y" id="U" link="table" maximumFeed="20rpm" offset="0mm 0mm 1cm" range="-1rad 1rad"/>
  <axis actuator="rotational" axis="0 0 1" coordinate="Z" id="V" link="table" offset="0mm 0mm 0mm"/>
</machine>
"#;

#[test]
fn units_vectors_and_known_speeds_are_taken() {
    let file = import_autodesk_machine(SMALL).unwrap();
    assert_eq!((file.name.as_str(), file.feed.max_mm_min), ("V M", 12000.0));
    assert!(!file.is_assumed(AssumedValue::MaxVelocity, "X") && file.is_assumed(AssumedValue::MaxVelocity, "Y"));
    assert!(!file.is_assumed(AssumedValue::MaxVelocity, "B") && file.is_assumed(AssumedValue::MaxVelocity, "C"));
    assert!(!file.is_assumed(AssumedValue::Feed, ""));
    let machine = Machine::from_file(file).unwrap();
    let [x, b] = ["X", "B"].map(|l| &machine.axes()[machine.axis_index(l).unwrap()]);
    assert!((x.max_velocity - 500.0).abs() < 1e-9 && (x.max - 1000.0).abs() < 1e-9);
    assert!((b.max - 1.0).abs() < 1e-12 && (b.max_velocity.to_degrees() - 120.0).abs() < 1e-9);
    assert!((machine.cl_point(&AxisValues::zeros(5), 0.0).tip.z - 635.0).abs() < 1e-9);
    assert_eq!(machine.family().to_string(), "table-table B-C (B nutating, 45° toward +y)");
}

#[test]
fn faults_are_reported_with_line_and_element() {
    let refusal = |from: &str, to: &str| {
        assert!(SMALL.contains(from), "{from}");
        import_autodesk_machine(&SMALL.replace(from, to)).unwrap_err().to_string()
    };
    let u = "line 10, <axis id=\"U\">: ";
    for (from, to, message) in [
        ("axis=\"0 1 1\"", "axis=\"0 0 0\"", format!("{u}`axis` is \"0 0 0\", which is no direction")),
        ("axis=\"0 1 1\" ", "", format!("{u}has no attribute `axis`")),
        ("1cm", "1furlong", format!("{u}`offset` has \"1furlong\", which is no number with a unit of mm, cm, m, in")),
        ("0mm 0mm 1cm", "0mm 1cm", format!("{u}`offset` has 2 numbers, 3 are wanted")),
        ("-1rad 1rad", "1rad -1rad", format!("{u}`range` ends at ")),
        ("-1rad 1rad", "0.5rad 1rad", format!("{u}`homePosition` 0 is outside the range")),
        (
            "link=\"table\" maximumFeed",
            "link=\"bed\" maximumFeed",
            format!("{u}`link` is \"bed\", known are head, table"),
        ),
        ("id=\"U\"", "id=\"U\" control=\"manual\"", format!("{u}is not driven")),
        ("20rpm", "-20rpm", format!("{u}`maximumFeed` is below 0")),
        (
            "coordinate=\"Z\" id=\"V\"",
            "coordinate=\"Y\" id=\"V\"",
            "line 11, <axis id=\"V\">: is a second axis B".into(),
        ),
        (" range=\"-550mm 0mm\"", "", "line 8, <axis id=\"Z\">: has no attribute `range`".into()),
        ("<spindle axis=\"0 0 1\"/>", "", "line 2, <machine>: has no <spindle>".into()),
        ("<spindle axis=\"0 0 1\"/>", "<spindle/>", "line 9, <spindle>: has no attribute `axis`".into()),
        ("toolAttachPoint", "tool", "line 5, <simulation>: has no attribute `toolAttachPoint`".into()),
        (
            "actuator=\"linear\" coordinate=\"X\"",
            "actuator=\"linear\" axis=\"1 0 0\" coordinate=\"X\"",
            "line 6, <axis id=\"X\">: is linear with a vector".into(),
        ),
        ("</machine>", "", "is no XML: ".into()),
    ] {
        let reported = refusal(from, to);
        assert!(reported.starts_with(&message), "{reported}\nwanted: {message}");
    }
    let other = import_autodesk_machine("<part/>").unwrap_err().to_string();
    assert!(other.contains("this is no Autodesk machine file"), "{other}");
    let z = SMALL.lines().find(|l| l.contains("id=\"Z\"")).unwrap();
    let late = SMALL.replace(z, "").replace("</machine>", &format!("{}\n</machine>", z.replace("head", "table")));
    let reported = import_autodesk_machine(&late).unwrap_err().to_string();
    assert!(reported.contains("<axis id=\"Z\">: is a linear axis behind the rotary axis B of its side"), "{reported}");
}
