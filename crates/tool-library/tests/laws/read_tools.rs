//! Tools of sound libraries: every measure, in mm, and what is assumed.

use facemill_test_kit::Random;
use facemill_tool_library::{CutterKind, ToolRefusal, read_library};
use facemill_tool_model::{Section, SpindleRotation, ToolAssembly};
use serde_json::{Value, json};

use crate::kit::{ZipEntry, changed, faults, imported, inch_tool, library, read_one, without, zip};

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-6, "{a} is not {b}");
}

fn is_section(section: &Section, length: f64, low: f64, high: f64) {
    near(section.length_mm, length);
    near(section.diameter_low_mm, low);
    near(section.diameter_high_mm, high);
}

#[test]
fn an_inch_tool_in_a_millimetre_holder_has_every_measure() {
    let read = read_one(&inch_tool());
    assert_eq!((read.number, read.position, read.kind.as_str()), (Some(7), 1, "bull nose end mill"));
    assert_eq!(read.label(), "tool 7 \"1/2 r1/16 long reach\"");
    let tool = read.import.expect("a tool");
    let file = &tool.file;
    assert_eq!((tool.kind, file.name.as_str(), file.number), (CutterKind::BullNose, "1/2 r1/16 long reach", 7));
    assert_eq!((file.length_register, file.n_inserts), (Some(17), 4));
    assert_eq!(file.spindle_rotation, SpindleRotation::Clockwise);
    near(file.radius_mm, 6.35);
    near(file.corner_radius_mm, 1.5875);
    near(file.flute_length_mm, 25.4);
    near(file.stick_out_mm, 76.2);
    // 3 in and 70 mm: the segment above the gauge line is none of the length.
    near(file.gauge_length_mm, 146.2);
    // Neck of 0.48 in to 2.5 in above the tip, cone of 0.25 in, shank of 0.625 in.
    let [neck, cone, shank] = &file.body.sections[..] else { panic!("{:?}", file.body) };
    is_section(neck, 38.1, 12.192, 12.192);
    is_section(cone, 6.35, 12.192, 15.875);
    is_section(shank, 6.35, 15.875, 15.875);
    // From the nose up: the step has no height.
    let [nose, wide, above] = &file.holder.sections[..] else { panic!("{:?}", file.holder) };
    is_section(nose, 20.0, 40.0, 50.0);
    is_section(wide, 50.0, 63.0, 63.0);
    is_section(above, 2.0, 48.0, 48.0);
    let assembly = ToolAssembly::new(file.clone()).expect("a tool");
    near(assembly.cutter().rim_radius(), 4.7625);
}

#[test]
fn what_a_library_does_not_say_is_assumed_and_listed() {
    let tool = imported(&inch_tool());
    // The whole flat, R - r, and a small ramp.
    near(tool.file.dead_core_radius_mm, 6.35 - 1.5875);
    near(tool.file.max_ramp_angle_deg, 1.0);
    let keys: Vec<&str> = tool.file.assumed.iter().map(|assumed| assumed.key.as_str()).collect();
    assert_eq!(keys, ["dead_core_radius_mm", "max_ramp_angle_deg", "body.clearance_mm", "holder.clearance_mm"]);
    assert!(tool.notes.iter().any(|note| note.contains("diameter offset 27")), "{:?}", tool.notes);
    assert!(tool.notes.iter().any(|note| note.contains("2 mm above the gauge line")), "{:?}", tool.notes);
    // What a wide core leaves room for below it is no more than half a millimetre.
    let mut random = Random(9);
    for _ in 0..200 {
        let diameter = random.between(0.1, 40.0);
        let values = [
            ("/geometry/DC", json!(diameter)),
            ("/geometry/RE", json!(random.between(0.0, 0.5 * diameter))),
            ("/geometry/LCF", json!(20.0)),
            ("/geometry/LB", json!(25.0)),
            ("/geometry/assemblyGaugeLength", Value::Null),
            ("/expressions", json!({})),
        ];
        let file = imported(&changed(&values)).file;
        let recess = 2.0 * file.dead_core_radius_mm * file.max_ramp_angle_deg.to_radians().tan();
        assert!(recess <= 0.5 && file.max_ramp_angle_deg <= 1.0, "{file:?}");
    }
    // A preset permits less.
    let gentle = imported(&changed(&[("/start-values", json!({ "presets": [{ "ramp-angle": 0.5 }] }))]));
    near(gentle.file.max_ramp_angle_deg, 0.5);
    // Other missing values are assumed, too.
    let older = |pointer: &str, key: &str| {
        let tool = imported(&without(pointer));
        assert!(tool.file.assumed.iter().any(|assumed| assumed.key == key), "{pointer}: {:?}", tool.file.assumed);
        tool.file
    };
    older("/geometry/HAND", "spindle_rotation");
    // Without any gauge length all segments count.
    let mut bare = without("/holder/gaugeLength");
    bare["geometry"].as_object_mut().expect("an object").remove("assemblyGaugeLength");
    let bare = imported(&bare).file;
    near(bare.gauge_length_mm, 148.2);
    assert!(bare.assumed.iter().any(|assumed| assumed.key == "gauge_length_mm"), "{:?}", bare.assumed);
}

/// The gauge length of the assembly takes the place of the holder's: nothing is assumed then.
#[test]
fn the_gauge_length_of_the_assembly_is_taken() {
    let same = imported(&inch_tool());
    let mut random = Random(11);
    let by_assembly = imported(&without("/holder/gaugeLength"));
    assert_eq!((by_assembly.file, by_assembly.notes), (same.file.clone(), same.notes));
    for _ in 0..50 {
        // 3 in below the holder, segments of 72 mm above.
        let above = random.between(1.0, 72.0);
        let tool = |own: f64| {
            changed(&[
                ("/holder/gaugeLength", json!(own)),
                ("/geometry/assemblyGaugeLength", json!((76.2 + above) / 25.4)),
            ])
        };
        let file = imported(&tool(above)).file;
        near(file.gauge_length_mm, 76.2 + above);
        let mut alone = tool(above);
        alone["holder"].as_object_mut().expect("a holder").remove("gaugeLength");
        let alone = imported(&alone).file;
        near(alone.gauge_length_mm, 76.2 + above);
        assert_eq!(alone.assumed, same.file.assumed);
        let (keys, text) = faults(&tool(above - 0.02));
        assert!(keys == ["geometry.assemblyGaugeLength"] && text.contains("correct the wrong one"), "{text}");
    }
    // The segments must reach the gauge line, and the gauge line be above the nose.
    for (assembly, words) in [(6.0, "draw the rest"), (3.0, "no more than the length below the holder")] {
        let mut alone = changed(&[("/geometry/assemblyGaugeLength", json!(assembly))]);
        alone["holder"].as_object_mut().expect("a holder").remove("gaugeLength");
        let (keys, text) = faults(&alone);
        assert!(keys == ["geometry.assemblyGaugeLength"] && text.contains(words), "{text}");
    }
    let mut short = changed(&[("/holder/gaugeLength", json!(80))]);
    short["geometry"].as_object_mut().expect("an object").remove("assemblyGaugeLength");
    let (keys, text) = faults(&short);
    assert!(keys == ["holder.gaugeLength"] && text.contains("draw the rest"), "{text}");
}

/// A shaft that the library does not describe is not guessed.
#[test]
fn a_shaft_has_a_diameter_all_the_way() {
    let (keys, text) = faults(&without("/geometry/SFDM"));
    assert!(keys == ["geometry.SFDM"] && text.contains("enter the shaft diameter"), "{text}");
    assert_eq!(faults(&changed(&[("/geometry/SFDM", json!(0))])).0, ["geometry.SFDM"]);
    // Segments that reach the holder describe it: 2 in above the flute.
    let whole = |height: f64| {
        let mut tool = without("/geometry/SFDM");
        tool["shaft"] = json!({ "segments": [
            { "height": 1.5, "lower-diameter": 0.48, "upper-diameter": 0.48 },
            { "height": height, "lower-diameter": 0.48, "upper-diameter": 0.75 }
        ] });
        tool
    };
    let file = imported(&whole(0.5)).file;
    assert_eq!(file.body.sections.len(), 2);
    is_section(&file.body.sections[1], 12.7, 12.192, 19.05);
    assert!(file.assumed.iter().all(|assumed| assumed.key != "body.sections"));
    // Up to rounding, and no farther.
    near(imported(&whole(0.4999)).file.body.length_mm(), 50.8);
    assert_eq!(faults(&whole(0.499)).0, ["geometry.SFDM"]);
    // Without a length above the flute there is no shaft.
    let mut none = changed(&[("/geometry/LCF", json!(3.0)), ("/expressions", json!({}))]);
    none["geometry"].as_object_mut().expect("an object").remove("SFDM");
    assert!(imported(&none).file.body.sections.is_empty());
}

#[test]
fn a_narrow_ring_around_an_assumed_core_is_noted() {
    let notes = |corner: f64| imported(&changed(&[("/geometry/RE", json!(corner / 25.4))])).notes;
    let is_noted = |corner: f64| notes(corner).iter().any(|note| note.contains("give dead_core_radius_mm"));
    assert!(is_noted(0.0) && is_noted(0.4) && !is_noted(0.6) && !is_noted(6.35));
}

#[test]
fn presets_become_feeds_of_a_job() {
    let presets = imported(&inch_tool()).presets;
    let feeds: Vec<String> = presets.iter().map(|preset| preset.job_feeds()).collect();
    let expected = [
        r#""feeds": { "cutting_mm_min": 1270, "approach_mm_min": 508, "spindle_rpm": 3000, "coolant": "flood" }"#,
        // 0.002 in at each of 4 teeth, 1000 times a minute.
        r#""feeds": { "cutting_mm_min": 203.2, "spindle_rpm": 1000, "coolant": "off" }"#,
        r#""feeds": {  }"#,
    ];
    assert_eq!(feeds, expected);
    assert_eq!(presets[0].name, "steel");
    serde_json::from_str::<Value>(&format!("{{ {} }}", feeds[0])).expect("JSON of a job");
}

#[test]
fn kinds_differ_in_corner_radius_and_dead_core() {
    let of = |kind: &str, corner: Value| imported(&changed(&[("/type", json!(kind)), ("/geometry/RE", corner)])).file;
    let flat = of("flat end mill", json!(0));
    assert_eq!(flat.corner_radius_mm, 0.0);
    // A tool file has the dead core below R: nearly all of the flat.
    near(flat.dead_core_radius_mm, 0.99 * 6.35);
    let ball = of("ball end mill", json!(0.25));
    assert_eq!((ball.corner_radius_mm, ball.dead_core_radius_mm), (ball.radius_mm, 0.0));
    assert_eq!(of("ball end mill", Value::Null).corner_radius_mm, 6.35);
    let face = of("face mill", json!(0.03));
    near(face.corner_radius_mm, 0.762);
    let left = imported(&changed(&[("/geometry/HAND", json!(false))])).file;
    assert_eq!(left.spindle_rotation, SpindleRotation::Counterclockwise);
}

/// The same tool, whatever units tool and holder are written in, and where the unit is.
#[test]
fn units_change_no_measure() {
    let same = imported(&inch_tool()).file;
    let mut metric = inch_tool();
    for pointer in [
        "/geometry/DC",
        "/geometry/RE",
        "/geometry/LCF",
        "/geometry/LB",
        "/geometry/OAL",
        "/geometry/SFDM",
        "/geometry/shoulder-length",
        "/geometry/assemblyGaugeLength",
    ] {
        let value = metric.pointer_mut(pointer).expect("a length");
        *value = json!(value.as_f64().expect("a number") * 25.4);
    }
    for segment in metric.pointer_mut("/shaft/segments").and_then(Value::as_array_mut).expect("segments") {
        for value in segment.as_object_mut().expect("a segment").values_mut() {
            *value = json!(value.as_f64().expect("a number") * 25.4);
        }
    }
    metric["unit"] = json!("millimeters");
    metric["start-values"] = json!({});
    assert_eq!(imported(&metric).file, same);
    // Older files have the unit among the expressions, in quotation marks; null counts as missing.
    let older = changed(&[("/unit", Value::Null), ("/expressions/tool_unit", json!("'inches'"))]);
    assert_eq!(imported(&older).file, same);
    let holder =
        changed(&[("/holder/unit", Value::Null), ("/holder/expressions", json!({ "tool_unit": "'millimeters'" }))]);
    assert_eq!(imported(&holder).file, same);
    // A holder in inches.
    let mut inches = inch_tool();
    inches["holder"] = json!({ "unit": "inches", "gaugeLength": 2.0, "segments": [
        { "height": 2.0, "lower-diameter": 1.5, "upper-diameter": 2.5 }] });
    inches["geometry"]["assemblyGaugeLength"] = json!(5.0);
    let file = imported(&inches).file;
    is_section(&file.holder.sections[0], 50.8, 38.1, 63.5);
    near(file.gauge_length_mm, 127.0);
    // Without a unit of its own it has the tool's, if both gauge lengths say so.
    inches["holder"].as_object_mut().expect("a holder").remove("unit");
    let unnamed = imported(&inches);
    assert_eq!(unnamed.file, file);
    assert!(unnamed.notes.iter().any(|note| note.contains("no unit")), "{:?}", unnamed.notes);
    for (part, key) in [("geometry", "assemblyGaugeLength"), ("holder", "gaugeLength")] {
        let mut open = inches.clone();
        open[part].as_object_mut().expect("an object").remove(key);
        let (keys, text) = faults(&open);
        assert!(keys == ["holder.unit"] && text.contains("enter the holder's unit"), "{text}");
    }
}

/// Segments of a shaft begin at the end of the flute or of the shoulder: the body has room for
/// both.
#[test]
fn a_shoulder_above_the_flute_widens_the_body() {
    let tool =
        imported(&changed(&[("/geometry/shoulder-length", json!(1.5)), ("/geometry/shoulder-diameter", json!(0.5))]));
    let widths: Vec<(f64, f64)> = tool.file.body.sections.iter().map(|s| (s.length_mm, s.diameter_low_mm)).collect();
    // Shoulder 12.7 mm wide, then the neck, then the cone of the lower stack and its shank.
    near(widths[0].0, 12.7);
    near(widths[0].1, 12.7);
    let length: f64 = widths.iter().map(|(length, _)| length).sum();
    near(length, 50.8);
    // A shaft without segments begins at the end of the shoulder alone.
    let mut plain = changed(&[("/geometry/shoulder-length", json!(1.5)), ("/geometry/shoulder-diameter", json!(0.45))]);
    plain.as_object_mut().expect("a tool").remove("shaft");
    let sections = imported(&plain).file.body.sections;
    assert_eq!(sections.len(), 2, "{sections:?}");
    is_section(&sections[0], 12.7, 11.43, 11.43);
    is_section(&sections[1], 38.1, 15.875, 15.875);
}

#[test]
fn other_types_are_refused_by_name_and_the_rest_is_read() {
    let kinds = ["tapered mill", "drill", "lollipop mill", "holder", "Face Mill"];
    let mut tools: Vec<Value> = kinds.iter().map(|kind| changed(&[("/type", json!(kind))])).collect();
    tools.push(inch_tool());
    let read = read_library(&library(&tools)).expect("a library");
    for (tool, kind) in read.iter().zip(kinds) {
        assert_eq!(tool.import, Err(ToolRefusal::OtherKind(kind.to_owned())));
        assert!(tool.import.as_ref().expect_err("refused").to_string().contains(kind));
    }
    assert!(read[5].import.is_ok() && read[5].position == 6);
}

#[test]
fn an_archive_holds_the_same_tools_as_its_text() {
    let text = library(&[inch_tool(), changed(&[("/type", json!("drill"))])]);
    let plain = read_library(&text).expect("a library");
    for is_stored in [false, true] {
        let entry = ZipEntry { is_stored, ..ZipEntry::new("tools.json", &text) };
        let picture = ZipEntry { method: Some(14), ..ZipEntry::new("pictures/7.png", b"none") };
        assert_eq!(read_library(&zip(&[picture, entry])).expect("a library"), plain);
    }
    // A byte order mark is no part of the text.
    assert_eq!(read_library(&[b"\xef\xbb\xbf", &text[..]].concat()).expect("a library"), plain);
}
