//! `facemill tool`: libraries of Fusion in, tool files, tables and drawings out.

use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use facemill::tool_model::{ToolAssembly, ToolFile};
use facemill_tests::commands::{CommandOutput, facemill_in};
use facemill_tests::jobs::{JobFolder, small_patch};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::shared;
use serde_json::{Value, json};

/// Runs `facemill tool` with these arguments, each as it is.
fn tool(arguments: &[&str]) -> CommandOutput {
    let all: Vec<OsString> = ["tool"].iter().chain(arguments).map(OsString::from).collect();
    let output = run(&all);
    let (code, errors) = code_and_errors(&output);
    CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
}

/// A face mill of 40 mm in inches, number 7, in a holder in mm.
fn face_mill() -> Value {
    json!({
        "type": "face mill", "unit": "inches", "description": "Face mill 40 / r1.5",
        "post-process": { "number": 7, "length-offset": 7, "diameter-offset": 7 },
        "geometry": { "DC": 40.0 / 25.4, "RE": 1.5 / 25.4, "NOF": 4, "LCF": 3.0 / 25.4, "LB": 16.0 / 25.4,
            "SFDM": 34.0 / 25.4, "TA": 0, "HAND": true },
        "holder": { "unit": "millimeters", "gaugeLength": 120.0, "segments": [
            { "height": 80.0, "lower-diameter": 24.0, "upper-diameter": 28.0 },
            { "height": 40.0, "lower-diameter": 63.0, "upper-diameter": 63.0 }
        ] },
        "start-values": { "presets": [{ "name": "bronze", "n": 1200, "v_f": 47.25, "v_f_plunge": 20 }] }
    })
}

/// The face mill with values replaced by pointer.
fn changed(values: &[(&str, Value)]) -> Value {
    let mut tool = face_mill();
    values.iter().for_each(|(pointer, value)| facemill_tests::jobs::set(&mut tool, pointer, value.clone()));
    tool
}

/// A face mill, a ball and a drill, as a library beside the small patch.
fn workshop() -> JobFolder {
    let ball = changed(&[
        ("/type", json!("ball end mill")),
        ("/description", json!("ball: \"16\" ../x")),
        ("/post-process", json!({ "number": 12, "length-offset": 12 })),
        ("/unit", json!("millimeters")),
        ("/geometry", json!({ "DC": 16, "NOF": 2, "LCF": 20, "LB": 60, "SFDM": 16 })),
    ]);
    let drill =
        changed(&[("/type", json!("drill")), ("/post-process/number", json!(3)), ("/description", json!("D8"))]);
    let job = small_patch();
    job.write("library.json", &library(&[face_mill(), ball, drill]));
    job
}

fn library(tools: &[Value]) -> Vec<u8> {
    serde_json::to_vec(&json!({ "data": tools, "version": 36 })).expect("JSON")
}

fn text(path: &Path) -> String {
    path.to_str().expect("a path of text").to_owned()
}

/// Names of the files of a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn all_tools_of_a_library_become_files_and_the_others_are_named() {
    let job = workshop();
    let (library, out, report) =
        (text(&job.path("library.json")), text(&job.path("tools")), text(&job.path("report.txt")));
    let done = tool(&["import", &library, "--all", "--out", &out, "--report", &report]);
    assert_eq!(done.code, 0, "{}", done.errors);
    assert_eq!(names(&job.path("tools")), ["t12-ball-16-x.json", "t7-face-mill-40-r1-5.json"]);
    assert_eq!(std::fs::read_to_string(&report).expect("a report"), done.printed);
    for words in [
        &["tool 7", "face mill"][..],
        &["diameter 40 mm", "corner radius 1.5 mm"],
        &["assumed dead_core_radius_mm", "whole flat"],
        &["assumed max_ramp_angle_deg", "0.77 deg"],
        &["preset \"bronze\"", "\"cutting_mm_min\": 1200.15", "\"approach_mm_min\": 508", "\"spindle_rpm\": 1200"],
        &["not read: tool 3 \"D8\"", "type \"drill\""],
        &["2 tool(s) written, 1 not read"],
    ] {
        assert!(done.prints(words), "{words:?}:\n{}", done.printed);
    }
    let bytes = std::fs::read(job.path("tools/t7-face-mill-40-r1-5.json")).expect("a tool");
    let file = ToolAssembly::from_json(&bytes).expect("a tool").to_file();
    let measures = |file: &ToolFile| (file.radius_mm, file.corner_radius_mm, file.stick_out_mm, file.gauge_length_mm);
    assert_eq!(measures(&file), (20.0, 1.5, 16.0, 136.0));
    assert_eq!((file.dead_core_radius_mm, file.max_ramp_angle_deg, file.assumed.len()), (18.5, 0.77, 4));
    // The same again gives the same bytes, but only with --force; nothing of others is replaced.
    let again = ["import", &library, "--all", "--out", &out];
    assert!(tool(&again).is_refused_for(&["exists", "--force"]));
    assert_eq!(tool(&[&again[..], &["--force"]].concat()).code, 0);
    assert_eq!(std::fs::read(job.path("tools/t7-face-mill-40-r1-5.json")).expect("a tool"), bytes);
    std::fs::write(job.path("tools/t7-face-mill-40-r1-5.json"), b"{ \"mine\": 1 }").expect("a file");
    assert!(tool(&[&again[..], &["--force"]].concat()).is_refused_for(&["is no tool file"]));
}

#[test]
fn an_imported_tool_is_one_that_a_job_takes() {
    let job = workshop();
    let (library, out) = (text(&job.path("library.json")), text(&job.path("tools")));
    assert_eq!(tool(&["import", &library, "--number", "7", "--out", &out]).code, 0);
    assert_eq!(names(&job.path("tools")), ["t7-face-mill-40-r1-5.json"]);
    job.set("job.json", &[("/tool", json!("tools/t7-face-mill-40-r1-5.json"))]);
    let checked = facemill_in(&job, "check job.json");
    assert_eq!(checked.code, 0, "{}", checked.errors);
    let words = ["tool T7", "R 20 mm, r 1.5 mm", "136.0 mm from gauge line", "assumed: dead_core_radius_mm"];
    assert!(checked.prints(&words), "{}", checked.printed);
    // It plans a program without faults, whose page names the assumed values, too.
    let written = facemill_in(&job, &format!("plan job.json --out {}", text(&job.path("pages"))));
    assert_eq!(written.code, 0, "{}", written.errors);
    let is_page = |name: &&String| name.ends_with(".html");
    let files = names(&job.path("pages"));
    assert!(files.iter().any(|name| name == "program.nc"), "{files:?}");
    let pages: Vec<&String> = files.iter().filter(is_page).collect();
    let noted = "4 assumed values of the tool (dead_core_radius_mm, max_ramp_angle_deg, ";
    let has_note =
        |name: &&String| std::fs::read_to_string(job.path("pages").join(name)).expect("a page").contains(noted);
    assert!(!pages.is_empty() && pages.iter().any(has_note), "{pages:?}");
}

#[test]
fn faults_name_file_tool_and_key_and_nothing_is_written() {
    let job = JobFolder::of(&[]);
    let place = text(&job.path("library.json"));
    let mut missing = face_mill();
    missing["geometry"].as_object_mut().expect("an object").remove("DC");
    job.write("library.json", &library(&[missing, face_mill(), changed(&[("/geometry/NOF", json!(-2))])]));
    let out = text(&job.path("tools"));
    let refused = tool(&["import", &place, "--all", "--out", &out]);
    let first = "library.json: tool 7 \"Face mill 40 / r1.5\": geometry.DC is missing; ";
    assert!(refused.is_refused_for(&[first, "geometry.NOF is -2; ", "--skip-faulty"]), "{}", refused.errors);
    assert!(!job.path("tools").exists());
    let skipped = tool(&["import", &place, "--all", "--skip-faulty", "--out", &out]);
    assert!(skipped.code == 0 && skipped.prints(&["1 tool(s) written, 2 not read"]), "{}", skipped.errors);
    // Three tools have the number: all are selected, and faults of any are refused.
    let refused = tool(&["import", &place, "--number", "7", "--out", &text(&job.path("other"))]);
    assert!(refused.is_refused_for(&[first]), "{}", refused.errors);
    let refused = tool(&["import", &place, "--number", "8", "--out", &out]);
    assert!(refused.is_refused_for(&["no tool with number 8; it has the numbers 7"]), "{}", refused.errors);
    // A list has all of them.
    let listed = tool(&["list", &place]);
    assert!(listed.code == 0 && listed.prints(&["not read", "geometry.DC is missing"]), "{}", listed.printed);
}

/// An archive with one entry that is not packed.
fn archive(name: &str, bytes: &[u8], stated: u32) -> Vec<u8> {
    let length = |n: usize| (n as u32).to_le_bytes();
    let name_length = (name.len() as u16).to_le_bytes();
    let mut sum = flate2::Crc::new();
    sum.update(bytes);
    let common =
        [&[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &sum.sum().to_le_bytes(), &length(bytes.len()), &stated.to_le_bytes()]
            .concat();
    let local = [b"PK\x03\x04", &common[..], &name_length, &[0, 0], name.as_bytes(), bytes].concat();
    let directory = [b"PK\x01\x02\x14\0", &common[..], &name_length, &[0; 16], name.as_bytes()].concat();
    let end = [b"PK\x05\x06\0\0\0\0\x01\0\x01\0", &length(directory.len())[..], &length(local.len()), &[0, 0]].concat();
    [local, directory, end].concat()
}

#[test]
fn files_that_are_no_library_are_refused_in_bounded_time() {
    let job = JobFolder::of(&[]);
    let good = library(&[face_mill()]);
    let whole = archive("tools.json", &good, good.len() as u32);
    job.write("library.tools", &whole);
    let done = tool(&["import", &text(&job.path("library.tools")), "--all", "--out", &text(&job.path("tools"))]);
    assert_eq!(done.code, 0, "{}", done.errors);
    let deep = [b"{\"data\":".to_vec(), b"[".repeat(10_000_000)].concat();
    let many = [b"{\"data\":[0".to_vec(), b",0".repeat(20_000_000), b"]}".to_vec()].concat();
    let cases: [(&[u8], &[&str]); 9] = [
        (b"", &["neither JSON nor a zip"]),
        (b"not a zip", &["neither JSON nor a zip"]),
        (&whole[..whole.len() - 1], &["no whole zip archive"]),
        (&archive("../tools.json", &good, good.len() as u32), &["../tools.json", "leads out"]),
        (&archive("tools.json", &good, 1 << 30), &["more than 64 MB"]),
        (&archive("tools.json", &good, 5), &["another size"]),
        (&deep, &["recursion limit", "line 1"]),
        (&many, &["more than 1000000 values"]),
        (b"{\"format\": \"facemill-tool/1\"}", &["missing field"]),
    ];
    for (bytes, words) in cases {
        job.write("wrong.tools", bytes);
        let place = text(&job.path("wrong.tools"));
        let out = text(&job.path("none"));
        for arguments in [&["import", &place, "--all", "--out", &out][..], &["list", &place], &["show", &place]] {
            let begin = Instant::now();
            let refused = tool(arguments);
            assert!(refused.is_refused_for(words) && refused.errors.contains("wrong.tools"), "{}", refused.errors);
            assert!(begin.elapsed().as_secs() < 20, "{words:?}");
        }
    }
    assert!(!job.path("none").exists());
}

#[test]
fn tools_are_listed_shown_and_drawn() {
    let job = workshop();
    let (library, out) = (text(&job.path("library.json")), text(&job.path("tools")));
    assert_eq!(tool(&["import", &library, "--all", "--out", &out]).code, 0);
    std::fs::write(job.path("tools/notes.json"), b"{}").expect("a file");
    for (place, kind) in [(&library, "face mill"), (&out, "round corner")] {
        let listed = tool(&["list", place]);
        assert_eq!(listed.code, 0, "{}", listed.errors);
        assert!(listed.prints(&["Face mill 40 / r1.5", kind, "136"]), "{}", listed.printed);
        assert!(listed.prints(&["ball: \"16\" ../x", "ball", "16"]), "{}", listed.printed);
    }
    assert!(tool(&["list", &library]).prints(&["not read: library.json: tool 3 \"D8\""]));
    assert!(tool(&["list", &out]).prints(&["1 other file(s)"]));
    let ours = text(&job.path("tools/t7-face-mill-40-r1-5.json"));
    for arguments in [&["show", &ours][..], &["show", &library, "--number", "7"]] {
        let shown = tool(arguments);
        for words in [
            &["dead core of radius 18.5 mm"][..],
            &["assumed dead_core_radius_mm"],
            &["16 to 96 mm: diameter 24 to 28"],
        ] {
            assert!(shown.prints(words), "{words:?}:\n{}", shown.printed);
        }
    }
    assert!(tool(&["show", &library]).is_refused_for(&["has 3 tools", "--number"]));
    assert!(tool(&["show", &ours, "--number", "8"]).is_refused_for(&["has tool 7, not 8"]));
    // A file that cannot be read does not end the list of its folder.
    std::fs::File::create(job.path("tools/large.json")).and_then(|file| file.set_len(65 << 20)).expect("a file");
    let listed = tool(&["list", &out]);
    assert!(
        listed.code == 0 && listed.prints(&["not read", "large.json", "64"]),
        "{}{}",
        listed.printed,
        listed.errors
    );
    assert!(listed.prints(&["Face mill 40 / r1.5"]), "{}", listed.printed);
    let pictures = ["a.svg", "b.svg"].map(|name| text(&job.path(name)));
    assert_eq!(tool(&["draw", &ours, "-o", &pictures[0]]).code, 0);
    assert_eq!(tool(&["draw", &library, "--number", "7", "-o", &pictures[1]]).code, 0);
    let again = ["draw", &ours, "-o", &pictures[0]];
    assert!(tool(&again).is_refused_for(&["a.svg", "exists", "--force"]));
    assert_eq!(tool(&[&again[..], &["--force"]].concat()).code, 0);
    let [a, b] = pictures.map(|path| std::fs::read_to_string(path).expect("a picture"));
    assert_eq!(a, b);
    for label in ["Ø 40<", "r 1.5<", "flute length 3<", "stick-out 16<", "gauge length 136<"] {
        assert!(a.contains(label), "{label}");
    }
}

/// Tools of one number are chosen by their position, and an import of all names them.
#[test]
fn tools_of_one_number_are_chosen_by_position() {
    let job = JobFolder::of(&[]);
    let other = changed(&[("/description", json!("second"))]);
    job.write("library.json", &library(&[face_mill(), other, changed(&[("/post-process/number", json!(9))])]));
    let (place, out) = (text(&job.path("library.json")), text(&job.path("tools")));
    assert!(tool(&["show", &place, "--number", "7"]).is_refused_for(&["2 tools with number 7", "1, 2", "--position"]));
    assert!(tool(&["show", &place, "--position", "2"]).prints(&["tool 7 \"second\""]));
    assert!(tool(&["list", &place]).prints(&["2", "7", "second"]));
    for wrong in ["0", "4"] {
        let refused = tool(&["show", &place, "--position", wrong]);
        assert!(refused.is_refused_for(&[&format!("no tool at position {wrong}"), "3 tools"]), "{}", refused.errors);
    }
    let picture = text(&job.path("tool.svg"));
    assert_eq!(tool(&["draw", &place, "--position", "2", "-o", &picture]).code, 0);
    let all = tool(&["import", &place, "--all", "--out", &out]);
    assert!(all.code == 0 && all.prints(&["note: tools at positions 1, 2 all have number 7"]), "{}", all.printed);
    let one = text(&job.path("one"));
    let done = tool(&["import", &place, "--position", "2", "--position", "3", "--out", &one]);
    assert!(done.code == 0 && !done.printed.contains("note: tools at"), "{}{}", done.printed, done.errors);
    assert_eq!(names(&job.path("one")), ["t7-second.json", "t9-face-mill-40-r1-5.json"]);
}

#[test]
fn a_report_replaces_no_file() {
    let job = workshop();
    let (library, out) = (text(&job.path("library.json")), text(&job.path("tools")));
    let import = |report: &str, more: &[&str]| {
        tool(&[&["import", &library, "--all", "--out", &out, "--report", report][..], more].concat())
    };
    // The folder of the tools does not exist yet, then it does.
    let ours = text(&job.path("tools/./T7-face-mill-40-r1-5.json"));
    assert!(import(&ours, &[]).is_refused_for(&["is a tool file of this import"]));
    assert!(!job.path("tools").exists());
    std::fs::create_dir(job.path("tools")).expect("a folder");
    assert!(import(&ours, &["--force"]).is_refused_for(&["is a tool file of this import"]));
    let report = job.path("report.txt");
    std::fs::write(&report, b"mine").expect("a file");
    assert!(import(&text(&report), &[]).is_refused_for(&["report.txt", "exists", "--force"]));
    assert_eq!(std::fs::read(&report).expect("a file"), b"mine");
    assert!(names(&job.path("tools")).is_empty());
    assert_eq!(import(&text(&report), &["--force"]).code, 0);
    assert_ne!(std::fs::read(&report).expect("a file"), b"mine");
}

/// The picture of the page is that of the command on the page.
#[test]
fn the_picture_of_a_tool_is_drawn_anew() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let job = JobFolder::of(&[]);
    let picture = text(&job.path("tool.svg"));
    let drawn = tool(&["draw", &text(&root.join("assets/propeller/tool.json")), "-o", &picture]);
    assert_eq!(drawn.code, 0, "{}", drawn.errors);
    let stored = std::fs::read_to_string(root.join("docs/pictures/tool.svg")).expect("a picture");
    let hint = "facemill tool draw assets/propeller/tool.json -o docs/pictures/tool.svg --force";
    assert!(std::fs::read_to_string(&picture).expect("a picture") == stored, "draw it anew: {hint}");
}

/// Words T, P, Z and D of the rows of a LinuxCNC table.
fn rows(table: &str) -> Vec<[f64; 4]> {
    let row = |line: &str| {
        let words = line.split(';').next().unwrap_or_default();
        let word = |letter: char| -> f64 {
            let word = words.split_whitespace().find_map(|word| word.strip_prefix(letter));
            word.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{letter} in {line}"))
        };
        ['T', 'P', 'Z', 'D'].map(word)
    };
    table.lines().filter(|line| !line.trim().is_empty()).map(row).collect()
}

#[test]
fn tables_have_the_tools_that_are_named() {
    let job = workshop();
    let (library, out) = (text(&job.path("library.json")), text(&job.path("tools")));
    assert_eq!(tool(&["import", &library, "--all", "--out", &out]).code, 0);
    let tools = ["t12-ball-16-x.json", "t7-face-mill-40-r1-5.json"].map(|name| text(&job.path("tools").join(name)));
    let table = text(&job.path("tool.tbl"));
    let written = tool(&["table", &tools[0], &tools[1], "--dialect", "linuxcnc", "-o", &table]);
    assert_eq!(written.code, 0, "{}", written.errors);
    let ours = std::fs::read_to_string(&table).expect("a table");
    assert_eq!(rows(&ours), [[7.0, 7.0, 136.0, 40.0], [12.0, 12.0, 180.0, 16.0]]);
    // The table does not depend on the order of the files, and is printed without --out.
    let printed = tool(&["table", &tools[1], &tools[0], "--dialect", "linuxcnc"]);
    assert_eq!(printed.printed, ours);
    let inches = tool(&["table", &tools[0], "--dialect", "linuxcnc", "--unit", "inch"]);
    assert!((rows(&inches.printed)[0][2] * 25.4 - 180.0).abs() < 1e-4, "{}", inches.printed);
    let siemens = tool(&["table", &tools[1], "--dialect", "siemens_840d"]);
    for line in [
        "$TC_DP1[7,1]=121",
        "$TC_DP3[7,1]=136.0000",
        "$TC_DP4[7,1]=0",
        "$TC_DP5[7,1]=0",
        "$TC_DP6[7,1]=20.0000",
        "$TC_DP7[7,1]=1.5000",
        "M17",
        "$TC_TP2[7]=\"7\"",
        "; T7 Face mill 40 / r1.5",
    ] {
        assert!(siemens.printed.lines().any(|own| own == line), "{line}:\n{}", siemens.printed);
    }
    let again = ["table", &tools[0], "--dialect", "linuxcnc", "-o", &table];
    assert!(tool(&again).is_refused_for(&["tool.tbl", "exists", "--force"]));
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), ours);
    assert_eq!(tool(&[&again[..], &["--force"]].concat()).code, 0);
    assert!(
        tool(&["table", &tools[0], &tools[0], "--dialect", "siemens_840d"]).is_refused_for(&["both have number 12"])
    );
    assert!(tool(&["table", &library, "--dialect", "siemens"]).is_refused_for(&["is a tool library"]));
}

/// A table refuses a gauge length that nobody measured, naming the file: the program's own check of
/// the length could not find it.
#[test]
fn assumed_lengths_are_in_no_table() {
    let job = JobFolder::of(&[]);
    let mut open = changed(&[("/post-process/number", json!(9)), ("/post-process/length-offset", json!(9))]);
    open["holder"].as_object_mut().expect("a holder").remove("gaugeLength");
    job.write("library.json", &library(&[face_mill(), open]));
    let out = text(&job.path("tools"));
    assert_eq!(tool(&["import", &text(&job.path("library.json")), "--all", "--out", &out]).code, 0);
    let tools = ["t7-face-mill-40-r1-5.json", "t9-face-mill-40-r1-5.json"];
    let [sound, open] = tools.map(|name| text(&job.path("tools").join(name)));
    for dialect in ["linuxcnc", "siemens_840d"] {
        let refused = tool(&["table", &sound, &open, "--dialect", dialect]);
        let words = ["t9-face-mill-40-r1-5.json", "tool 9 \"Face mill", "\"gauge_length_mm\" is under \"assumed\""];
        assert!(refused.is_refused_for(&words), "{}", refused.errors);
        assert_eq!(tool(&["table", &sound, "--dialect", dialect]).code, 0);
    }
}

/// Our rows have the words of a row in the control's own example tables.
#[test]
fn a_table_of_linuxcnc_is_read_alike() {
    let Some(table) = shared("data/tools/5axis.tbl") else { return };
    let rows = rows(&std::fs::read_to_string(table).expect("a table"));
    assert!(rows.len() >= 4 && rows.iter().all(|[number, pocket, length, _]| number == pocket && *length > 0.0));
}
