//! Files that are no libraries, and libraries of wrong tools: each fault names key and remedy, in
//! bounded time.

use facemill_test_kit::Random;
use facemill_tool_library::{LibraryError, MAX_FAULTS, MAX_TOOLS, is_library, read_library};
use facemill_tool_model::ToolAssembly;
use serde_json::{Value, json};

use crate::kit::{ZipEntry, changed, faults, imported, inch_tool, library, read_one, without, zip};

#[test]
fn missing_values_are_named_by_key() {
    let needed = [
        "/geometry/DC",
        "/geometry/LCF",
        "/geometry/LB",
        "/geometry/NOF",
        "/geometry/RE",
        "/geometry/SFDM",
        "/post-process/number",
        "/unit",
        "/geometry",
        "/holder",
        "/holder/segments",
        "/type",
    ];
    for pointer in needed {
        let (keys, text) = faults(&without(pointer));
        let key = pointer[1..].replace('/', ".");
        assert!(keys.iter().any(|own| *own == key || own.starts_with(&format!("{key}."))), "{pointer}: {text}");
        assert!(text.contains("missing") || text.contains("no segment"), "{pointer}: {text}");
    }
    // All of them at once.
    let (keys, _) = faults(&changed(&[("/geometry", json!({}))]));
    for key in ["geometry.DC", "geometry.LCF", "geometry.LB", "geometry.RE", "geometry.NOF"] {
        assert_eq!(keys.iter().filter(|own| *own == key).count(), 1, "{keys:?}");
    }
    assert_eq!(read_one(&without("/post-process/number")).label(), "tool at position 1 \"1/2 r1/16 long reach\"");
}

#[test]
fn wrong_values_are_named_by_key_and_value() {
    let cases: [(&str, Value, &str, &str); 40] = [
        ("/geometry/DC", json!(-0.5), "geometry.DC", "-0.5 in"),
        ("/geometry/DC", json!(0), "geometry.DC", "must be a length"),
        ("/geometry/DC", json!(1e300), "geometry.DC", "10000 mm"),
        ("/geometry/DC", json!("0.5"), "geometry.DC", "the text \"0.5\"; it must be a number"),
        ("/geometry/DC", json!("NaN"), "geometry.DC", "must be a number"),
        ("/geometry/DC", json!([0.5]), "geometry.DC", "is a list"),
        ("/geometry/DC", json!({}), "geometry.DC", "is an object"),
        ("/geometry/DC", json!(true), "geometry.DC", "is true"),
        ("/geometry/DC", json!(0.25), "geometry.DC", "expressions.tool_diameter is 12.7 mm"),
        ("/geometry/RE", json!(-0.1), "geometry.RE", "-0.1 in"),
        ("/geometry/RE", json!(0.3), "geometry.RE", "more than the cutter's radius"),
        ("/geometry/NOF", json!(2.5), "geometry.NOF", "whole number from 1 to 500"),
        ("/geometry/NOF", json!(0), "geometry.NOF", "whole number"),
        ("/geometry/NOF", json!(1e9), "geometry.NOF", "whole number"),
        ("/geometry/LCF", json!(0.05), "geometry.LCF", "shorter than the corner radius"),
        ("/geometry/LCF", json!(3.5), "geometry.LB", "shorter than the flute length"),
        ("/geometry/SFDM", json!(-1), "geometry.SFDM", "-1 in"),
        ("/geometry/HAND", json!("right"), "geometry.HAND", "true or false"),
        ("/geometry", json!([]), "geometry", "must be an object"),
        ("/post-process/number", json!(0), "post-process.number", "whole number from 1"),
        ("/post-process/number", json!(1e12), "post-process.number", "whole number"),
        ("/post-process/number", json!("7"), "post-process.number", "the text \"7\""),
        ("/post-process/length-offset", json!(1000), "post-process.length-offset", "1 to 999"),
        ("/post-process/length-offset", json!("17"), "post-process.length-offset", "the text \"17\""),
        ("/unit", json!("cubits"), "unit", "\"millimeters\" or \"inches\""),
        ("/unit", json!(1), "unit", "\"millimeters\" or \"inches\""),
        ("/holder/unit", json!("furlongs"), "holder.unit", "\"millimeters\" or \"inches\""),
        ("/holder/unit", Value::Null, "holder.unit", "enter the holder's unit"),
        ("/expressions", json!({ "tool_unit": "'millimeters'" }), "unit", "expressions.tool_unit is the text"),
        ("/holder/expressions", json!({ "tool_unit": "inches" }), "holder.unit", "holder.expressions.tool_unit"),
        ("/holder/gaugeLength", json!(60), "geometry.assemblyGaugeLength", "make 136.2 mm"),
        ("/geometry/assemblyGaugeLength", json!(5.76), "geometry.assemblyGaugeLength", "make 146.2 mm"),
        ("/geometry/DCX", json!(0.6), "geometry.DCX", "15.24 mm, more than the diameter 12.7 mm"),
        ("/start-values", json!({ "presets": vec![json!({}); 1001] }), "start-values.presets", "more than 1000"),
        ("/holder/gaugeLength", json!(-3), "holder.gaugeLength", "-3 mm"),
        ("/holder/segments", json!([{ "height": 5 }]), "holder.segments[0].lower-diameter", "is missing"),
        ("/holder/segments", json!([3]), "holder.segments[0].height", "is missing"),
        ("/holder/segments", json!({}), "holder.segments", "must be a list"),
        (
            "/shaft",
            json!({ "segments": [{ "height": -1, "lower-diameter": 1, "upper-diameter": 1 }] }),
            "shaft.segments[0].height",
            "-1 in",
        ),
        ("/start-values", json!({ "presets": [{ "v_f": -5 }] }), "start-values.presets[0].v_f", "is -5"),
    ];
    for (pointer, value, key, words) in cases {
        let (keys, text) = faults(&changed(&[(pointer, value.clone())]));
        assert!(keys.iter().any(|own| own == key), "{pointer} {value}: {text}");
        assert!(text.contains(words), "{pointer} {value}: {text}");
    }
    let (_, text) = faults(&changed(&[("/post-process", json!({ "number": 1001 }))]));
    assert!(text.contains("length registers 1 to 999"), "{text}");
    for (kind, corner, words) in [("flat end mill", 0.02, "sharp corners"), ("ball end mill", 0.2, "a ball of this")] {
        let (keys, text) = faults(&changed(&[("/type", json!(kind)), ("/geometry/RE", json!(corner))]));
        assert!(keys == ["geometry.RE"] && text.contains(words), "{text}");
    }
    let (keys, text) = faults(&changed(&[("/type", json!("face mill")), ("/geometry/TA", json!(45))]));
    assert!(keys == ["geometry.TA"] && text.contains("the side leans") && text.contains("by hand"), "{text}");
    // Any cutter within the tool's outline would be too small.
    assert!(!text.contains("encloses"), "{text}");
    let many: Vec<Value> = vec![json!({ "height": 0.01, "lower-diameter": 9, "upper-diameter": 9 }); 1001];
    let (keys, _) = faults(&changed(&[("/holder/segments", json!(many))]));
    assert_eq!(keys, ["holder.segments"]);
}

/// Fusion takes the value of an expression, so a number beside it must be the same, of whatever
/// measure.
#[test]
fn expressions_agree_with_the_numbers_beside_them() {
    let keys = [
        ("tool_diameter", "/geometry/DC", " in"),
        ("tool_cornerRadius", "/geometry/RE", " in"),
        ("tool_fluteLength", "/geometry/LCF", " in"),
        ("tool_bodyLength", "/geometry/LB", " in"),
        ("tool_overallLength", "/geometry/OAL", " in"),
        ("tool_shaftDiameter", "/geometry/SFDM", " in"),
        ("tool_shoulderLength", "/geometry/shoulder-length", " in"),
        ("tool_assemblyGaugeLength", "/geometry/assemblyGaugeLength", " in"),
        ("tool_numberOfFlutes", "/geometry/NOF", ""),
        ("tool_number", "/post-process/number", ""),
    ];
    for (name, pointer, unit) in keys {
        let value = inch_tool().pointer(pointer).and_then(Value::as_f64).expect("a number");
        let tool = |text: String| changed(&[("/expressions", json!({ name: text }))]);
        assert_eq!(
            imported(&tool(format!("{value}{unit}"))),
            imported(&changed(&[("/expressions", json!({}))])),
            "{name}"
        );
        let bare = imported(&tool(value.to_string()));
        assert!(bare.notes.iter().all(|note| !note.contains(name)), "{name}");
        // 1e-4 in is 2.5 µm.
        let other = if unit.is_empty() { value + 1.0 } else { value + 1e-4 };
        let (keys, text) = faults(&tool(format!("{other}{unit}")));
        assert!(
            keys.contains(&pointer[1..].replace('/', ".")) && text.contains(&format!("expressions.{name} is")),
            "{text}"
        );
        // Another unit than the tool's.
        if !unit.is_empty() {
            assert_eq!(imported(&tool(format!("{} mm", value * 25.4))).file, bare.file, "{name}");
            assert!(read_one(&tool(format!("{value} mm"))).import.is_err(), "{name}");
        }
        // Anything else is noted, and the tool is read.
        let noted = imported(&tool("2 * other".to_owned()));
        assert!(noted.notes.iter().any(|note| note.contains(&format!("expressions.{name} is"))), "{:?}", noted.notes);
        assert_eq!(noted.file, bare.file);
    }
    // Long tools have the same tolerance as short ones.
    let long = [("/geometry/OAL", json!(30.0)), ("/expressions", json!({ "tool_overallLength": "30.001 in" }))];
    assert_eq!(faults(&changed(&long)).0, ["geometry.OAL"]);
    // Values that are missing, or that only the expression has.
    for (name, text, key) in [
        ("tool_shoulderDiameter", "0.7 in", "geometry.shoulder-diameter"),
        ("tool_maximumCuttingDiameter", "0.7 in", "geometry.DCX"),
    ] {
        let (keys, why) = faults(&changed(&[("/expressions", json!({ name: text }))]));
        assert!(keys == [key] && why.contains("is missing, but"), "{why}");
    }
    let leaning = [("/type", json!("face mill")), ("/expressions", json!({ "tool_taperAngle": "45 deg" }))];
    let (keys, text) = faults(&changed(&leaning));
    assert!(keys == ["geometry.TA"] && text.contains("is 0, but"), "{text}");
}

#[test]
fn a_message_names_twenty_faults_of_a_tool_and_counts_the_rest() {
    let wrong: Vec<Value> = vec![json!({ "height": -1, "lower-diameter": 1, "upper-diameter": 1 }); 500];
    let (keys, text) = faults(&changed(&[("/shaft", json!({ "segments": wrong }))]));
    assert_eq!(keys.len(), MAX_FAULTS);
    assert!(text.ends_with("; and 480 more") && text.len() < 4000, "{text}");
    let (_, text) = faults(&without("/geometry/DC"));
    assert!(!text.contains("more"), "{text}");
}

fn refusal(bytes: &[u8]) -> String {
    read_library(bytes).expect_err("no library").to_string()
}

#[test]
fn other_files_are_refused() {
    let deep = |open: &str, n: usize| format!("{{\"data\":{}", open.repeat(n));
    let cases: [(&[u8], &str); 15] = [
        (b"", "neither JSON nor a zip"),
        (b"  \n", "neither JSON nor a zip"),
        (b"solid cube", "neither JSON nor a zip"),
        (b"\x00\xff\xfe", "neither JSON nor a zip"),
        (b"[]", "no list \"data\""),
        (b"{}", "no list \"data\""),
        (b"{\"data\": {}}", "no list \"data\""),
        (b"{\"data\": [", "line 1"),
        (b"{\"data\": []} {}", "line 1"),
        (b"{\"data\": [], \"data\": []}", "given twice"),
        (b"{\"data\": [NaN]}", "line 1"),
        (b"{\"data\": [1e999]}", "line 1"),
        (b"{\"data\": [\"\xff\"]}", "line 1"),
        (deep("[", 1_000_000).leak().as_bytes(), "recursion limit"),
        (deep("[{\"a\":", 500_000).leak().as_bytes(), "recursion limit"),
    ];
    for (bytes, words) in cases {
        let why = refusal(bytes);
        assert!(why.contains(words), "{}: {why}", String::from_utf8_lossy(&bytes[..bytes.len().min(30)]));
    }
    // More values than are read, and more tools.
    let many = format!("{{\"data\":[{}0]}}", "0,".repeat(2_000_000));
    assert!(refusal(many.as_bytes()).contains("more than 1000000 values"));
    let many = format!("{{\"data\":[{}0]}}", "0,".repeat(MAX_TOOLS));
    assert_eq!(read_library(many.as_bytes()), Err(LibraryError::TooManyTools(MAX_TOOLS + 1)));
    // Tools that are no objects are faults of their own.
    let tools = read_library(b"{\"data\": [1, null, []]}").expect("a library");
    assert!(tools.iter().all(|tool| tool.import.is_err()) && tools.len() == 3);
    assert!(is_library(b"{\"data\": [1]}") && !is_library(b"{\"format\": \"facemill-tool/1\"}") && !is_library(b"PK"));
}

#[test]
fn archives_that_are_no_libraries_are_refused() {
    let text = library(&[inch_tool()]);
    let good = || ZipEntry::new("tools.json", &text);
    let bomb = vec![b' '; 70 << 20];
    let cases: [(Vec<u8>, &str); 15] = [
        (zip(&[]), "no entry tools.json"),
        (zip(&[ZipEntry::new("other.json", &text)]), "no entry tools.json"),
        (zip(&[ZipEntry::new("tools.txt", &text)]), "no entry tools.json"),
        (zip(&[good(), good()]), "have one name"),
        (zip(&[good(), ZipEntry::new("more.json", &text)]), "tools.json, more.json"),
        (zip(&[good(), ZipEntry::new("../../x", b"")]), "\"../../x\", whose name leads out"),
        (zip(&[ZipEntry::new("../tools.json", &text)]), "leads out of the archive"),
        (zip(&[ZipEntry::new("/tools.json", &text)]), "leads out of the archive"),
        (zip(&[ZipEntry::new("..\\tools.json", &text)]), "leads out of the archive"),
        (zip(&[ZipEntry { flags: 1, ..good() }]), "with a password"),
        (zip(&[ZipEntry { method: Some(14), ..good() }]), "another way than"),
        (zip(&[ZipEntry { checksum: Some(1), ..good() }]), "checksum"),
        (zip(&[ZipEntry { stated: Some(u32::MAX), ..good() }]), "more than 64 MB"),
        (zip(&[ZipEntry::new("tools.json", &bomb)]), "more than 64 MB"),
        // A bomb that claims to be small is unpacked no farther than it claims.
        (zip(&[ZipEntry { stated: Some(1000), ..ZipEntry::new("tools.json", &bomb) }]), "another size"),
    ];
    for (k, (bytes, words)) in cases.iter().enumerate() {
        let why = refusal(bytes);
        assert!(why.contains(words), "{k}: {why}");
    }
    let many: Vec<ZipEntry<'_>> = (0..65).map(|_| ZipEntry::new("a.png", b"")).collect();
    assert!(refusal(&zip(&many)).contains("more than 64 entries"));
    let whole = zip(&[good()]);
    for cut in 4..whole.len() {
        assert!(read_library(&whole[..cut]).is_err(), "{cut} bytes");
    }
}

/// Changed bytes of text and archive: read or refused, never a panic, and a tool that was read is
/// one.
#[test]
fn changed_bytes_are_read_or_refused() {
    let mut random = Random(0x70_01);
    let text = library(&[inch_tool(), changed(&[("/type", json!("ball end mill")), ("/geometry/RE", json!(0))])]);
    let archive = zip(&[ZipEntry { is_stored: true, ..ZipEntry::new("tools.json", &text) }]);
    let (mut sound, mut refused) = (0, 0);
    for round in 0..4000 {
        let mut bytes = if round % 2 == 0 { text.clone() } else { archive.clone() };
        for _ in 0..1 + random.below(3) {
            let at = random.below(bytes.len());
            match random.below(4) {
                0 => bytes[at] = random.bits() as u8,
                1 => bytes[at] = b"0123456789-+eE.,:\"{}[]"[random.below(22)],
                2 => drop(bytes.drain(at..(at + random.below(20)).min(bytes.len()))),
                _ => bytes.insert(at, b'9'),
            }
        }
        let Ok(tools) = read_library(&bytes) else {
            refused += 1;
            continue;
        };
        for tool in tools.into_iter().filter_map(|tool| tool.import.ok()) {
            let again = facemill_file_format::to_json(&tool.file);
            assert_eq!(ToolAssembly::from_json(again.as_bytes()).expect("a tool").to_file(), tool.file);
            sound += 1;
        }
    }
    assert!(sound > 500 && refused > 500, "{sound} tools, {refused} files refused");
}
