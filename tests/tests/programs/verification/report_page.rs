//! Pages that `plan`, `view` and `report` write: their data against report and program, and the
//! page itself in a real browser.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;

use facemill_test_kit::Random;
use facemill_tests::calls::with_a_call;
use facemill_tests::golden::two_heads;
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::workspace;
use facemill_tests::variants::{blink_patch, box_obj, tiny_patch};
use flate2::read::GzDecoder;
use serde_json::{Value, json};

/// Runs a command in a job's folder; returns its exit code.
fn facemill(job: &JobFolder, command: &str) -> i32 {
    let root = job.path("");
    let arguments: Vec<String> = command
        .split(' ')
        .map(|word| {
            if root.join(word).exists() || word.contains('/') {
                root.join(word).display().to_string()
            } else {
                word.to_owned()
            }
        })
        .collect();
    let (code, errors) = code_and_errors(&run(&arguments));
    assert!([0, 1, 4].contains(&code), "{command}: {code}: {errors}");
    code
}

fn text(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Content of an element of a page.
fn element<'p>(page: &'p str, id: &str) -> &'p str {
    let begin = page.find(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no element {id}"));
    let content = &page[begin..];
    let content = &content[content.find('>').expect("its tag") + 1..];
    &content[..content.find("</script>").expect("its end")]
}

fn document(page: &str) -> Value {
    serde_json::from_str(element(page, "document")).expect("JSON")
}

/// Bytes of an array of a page.
fn array(page: &str, number: &Value) -> Vec<u8> {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let text = element(page, &format!("array-{number}"));
    let digits: Vec<u32> = text.bytes().filter_map(|b| DIGITS.iter().position(|d| *d == b)).map(|d| d as u32).collect();
    let bytes = digits.chunks(4).flat_map(|group| {
        let bits = group.iter().fold(0, |bits, d| bits << 6 | d) << (6 * (4 - group.len()));
        (0..group.len() - 1).map(move |k| (bits >> (16 - 8 * k)) as u8).collect::<Vec<_>>()
    });
    let mut out = Vec::new();
    GzDecoder::new(&bytes.collect::<Vec<_>>()[..]).read_to_end(&mut out).expect("gzip");
    out
}

/// The patch, planned with certificates and chips into `out`.
fn planned() -> JobFolder {
    let job = tiny_patch();
    assert_eq!(facemill(&job, "plan job.json --out ./out --certificates --chips"), 0);
    job
}

#[test]
fn a_page_holds_the_report_and_the_program_as_their_files_say_and_report_writes_it_again() {
    let job = planned();
    let page = text(&job, "out/report.html");
    let held = document(&page);
    assert_eq!(held["result"], job.json("out/report.json"));
    assert_eq!(held["verdict"]["state"], "good");
    assert_eq!(array(&page, &held["program"]["text"]["array"]), text(&job, "out/program.nc").into_bytes());
    assert_eq!(held["motion"]["n"], job.json("out/report.json")["totals"]["blocks"]);
    let keys: Vec<&str> =
        held["motion"]["figures"].as_array().expect("figures").iter().filter_map(|f| f["key"].as_str()).collect();
    assert_eq!(keys, ["depth", "clearance", "tip", "left", "surface_tilt", "chip", "removal"]);

    let sheet = text(&job, "out/setup-sheet.html");
    for name in ["report.html", "setup-sheet.html"] {
        std::fs::remove_file(job.path("out").join(name)).expect("it was there");
    }
    assert_eq!(facemill(&job, "report ./out --job job.json"), 0);
    assert!(text(&job, "out/report.html") == page, "report.html of `report` is not that of `plan`");
    assert!(text(&job, "out/setup-sheet.html") == sheet, "setup-sheet.html of `report` is not that of `plan`");
}

#[test]
fn cusps_and_tilts_along_passes_are_those_of_report_and_job_and_each_pass_has_its_map() {
    let job = planned();
    let page = text(&job, "out/report.html");
    let held = document(&page);
    let figure = |key: &str| {
        let figures = held["motion"]["figures"].as_array().expect("figures");
        numbers(&page, &figures.iter().find(|f| f["key"] == key).expect("the figure")["values"])
    };
    let left: Vec<f64> = figure("left").into_iter().filter(|h| !h.is_nan()).collect();
    let largest = held["result"]["remaining"]["operations"][0]["largest"]["height_mm"].as_f64().expect("a height");
    let most = left.iter().copied().fold(0.0, f64::max);
    assert!((most - largest).abs() <= 1e-4, "{most} along passes, {largest} in the report");
    let kinds = numbers(&page, &held["motion"]["kinds"]);
    assert!(left.len() > kinds.iter().filter(|k| **k == 1.0).count() / 2, "{} of {}", left.len(), kinds.len());
    // The search of this job is from 14 to 20 deg.
    let tilts: Vec<f64> = figure("surface_tilt").into_iter().filter(|t| !t.is_nan()).collect();
    assert!(tilts.len() > kinds.len() / 3, "{} of {}", tilts.len(), kinds.len());
    let [low, high] = tilts.iter().fold([f64::INFINITY, 0.0_f64], |[a, b], t| [a.min(*t), b.max(*t)]);
    assert!(low > 13.5 && high < 20.5, "{low} to {high}");

    let file = job.json("out/postures.json");
    let (maps, shown) = (file["maps"].as_array().expect("maps"), &held["postures"]);
    assert_eq!(Some(maps.len()), held["result"]["passes"].as_array().map(Vec::len));
    assert_eq!(shown["maps"].as_array().map(Vec::len), Some(maps.len()));
    for (map, shown) in maps.iter().zip(shown["maps"].as_array().expect("maps")) {
        assert!(map.as_object().expect("a map").iter().all(|(key, value)| &shown[key] == value), "{shown}");
        let number = |key: &str, k: usize| map[key][k].as_f64().expect("a number");
        let n = map["n_cells"].as_array().expect("numbers").iter().map(|n| n.as_u64().expect("n") as usize);
        let n: Vec<usize> = n.collect();
        let place = |range: &str, value: f64, n: usize| {
            let share = (value - number(range, 0)) / (number(range, 1) - number(range, 0));
            ((share * n as f64) as usize).min(n - 1)
        };
        let at =
            place("rotate_deg", number("taken_deg", 1), n[1]) * n[0] + place("tilt_deg", number("taken_deg", 0), n[0]);
        let letter = map["cells"].as_str().expect("cells").as_bytes()[at];
        // A cell at the border of the feasible ones is blocked in its middle, but not proven.
        assert!(letter != b'G' && letter != b'C' && letter != b'L' && letter != b'A', "{}", char::from(letter));
        let motion = shown["motion"].as_u64().expect("a motion at the point");
        assert_eq!(kinds[motion as usize], 1.0);
    }
}

#[test]
fn a_page_of_another_program_is_kept_and_plan_writes_an_animation() {
    let job = blink_patch();
    std::fs::create_dir(job.path("out")).expect("a folder");
    let foreign = b"<html>a report of another program</html>";
    for name in ["out/report.html", "out/setup-sheet.html"] {
        job.write(name, foreign);
        let (out, file) = (job.path("out"), job.job());
        let arguments = ["plan".as_ref(), file.as_os_str(), "--no-verify".as_ref(), "--out".as_ref(), out.as_os_str()];
        let (code, errors) = code_and_errors(&run(&arguments));
        assert!(code == 2 && errors.contains("was not written by facemill"), "{code}: {errors}");
        assert!(!job.path("out/program.nc").exists());
        assert_eq!(text(&job, name).as_bytes(), foreign);
        std::fs::remove_file(job.path(name)).expect("it is there");
    }
    job.write("out/report.html", foreign);
    facemill(&job, "plan job.json --out ./out --no-verify --no-html --animation ./planned.glb");
    assert_eq!(text(&job, "out/report.html").as_bytes(), foreign);
    assert!(!job.path("out/postures.json").exists());
    let (out, file) = (job.path("out"), job.job());
    let (code, errors) =
        code_and_errors(&run(&["report".as_ref(), out.as_os_str(), "--job".as_ref(), file.as_os_str()]));
    assert!(code == 2 && errors.contains("was not written by facemill"), "{code}: {errors}");
    std::fs::remove_file(job.path("out/report.html")).expect("it is there");
    facemill(&job, "report ./out --job job.json --animation ./again.glb");
    let glb = |name: &str| std::fs::read(job.path(name)).expect("an animation");
    assert!(glb("planned.glb") == glb("again.glb"), "the animation of `plan` is not that of `report`");
    // Its own pages are replaced.
    facemill(&job, "plan job.json --out ./out --no-verify");
    assert!(document(&text(&job, "out/report.html"))["postures"].is_object());
}

#[test]
fn certificates_of_another_program_are_refused_and_view_keeps_their_list_out_of_the_page() {
    let job = planned();
    let path = job.path("out/certificates.json");
    let mut file: Value = job.json("out/certificates.json");
    file["programs"][0]["blake3"] = json!("00");
    std::fs::write(&path, file.to_string()).expect("it is written");
    let out = job.path("out");
    let (code, errors) =
        code_and_errors(&run(&["report".as_ref(), out.as_os_str(), "--job".as_ref(), job.job().as_os_str()]));
    assert!(
        code == 2 && errors.contains("certificates.json") && errors.contains("another program"),
        "{code}: {errors}"
    );
    std::fs::write(job.path("out/report.json"), r#"{"format": "facemill-report/9"}"#).expect("it is written");
    let (code, errors) =
        code_and_errors(&run(&["report".as_ref(), out.as_os_str(), "--job".as_ref(), job.job().as_os_str()]));
    assert!(code == 2 && errors.contains("facemill-report/9"), "{code}: {errors}");

    assert_eq!(facemill(&job, "view out/program.nc --job job.json --certificates -o ./seen.html"), 0);
    let seen = document(&text(&job, "seen.html"));
    assert_eq!(seen["result"]["certificates"], Value::Null);
    assert_eq!(seen["result"]["certified"]["blocks"], file["blocks"]);
    assert_eq!(seen["verdict"]["state"], "partly_tested");
    assert!(seen["verdict"]["because"].to_string().contains("stock was not cut"), "{}", seen["verdict"]);
    assert!(seen["thinned"].to_string().contains("facemill verify --certificates"), "{}", seen["thinned"]);
}

#[test]
fn report_refuses_a_program_or_a_part_that_the_plan_did_not_have() {
    let job = blink_patch();
    assert_eq!(facemill(&job, "plan job.json --out ./out --no-verify --no-html"), 0);
    assert!(!job.path("out/report.html").exists() && !job.path("out/setup-sheet.html").exists());
    let refused = |job: &JobFolder| {
        let (out, file) = (job.path("out"), job.job());
        let (code, errors) =
            code_and_errors(&run(&["report".as_ref(), out.as_os_str(), "--job".as_ref(), file.as_os_str()]));
        assert_eq!(code, 2, "{errors}");
        errors
    };
    let nc = text(&job, "out/program.nc");
    job.write("out/program.nc", nc.replacen("G1", "G01", 1).as_bytes());
    assert!(refused(&job).contains("program was changed"));
    job.write("out/program.nc", nc.as_bytes());
    facemill_tests::variants::write_patch(&job, 20);
    assert!(refused(&job).contains("patch.obj"));
}

/// Path of Chromium, which node drives; `None` with a printed reason where one is absent.
fn browser() -> Option<PathBuf> {
    let found = |names: &[&str]| {
        let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
        names.iter().find_map(|name| folders.iter().map(|f| f.join(name)).find(|path| path.is_file()))
    };
    if found(&["node"]).is_none() {
        println!("skipped: node is not installed");
        return None;
    }
    let chromium = found(&["chromium", "chromium-browser", "google-chrome"]);
    if chromium.is_none() {
        println!("skipped: Chromium is not installed");
    }
    chromium
}

/// Asserts that the Khronos validator finds nothing in a glTF file; where it is not installed
/// (`npm install --prefix target/ci-node gltf-validator`), prints that it is not run.
fn assert_valid_gltf(file: &Path) {
    let modules = workspace().join("target/ci-node");
    let script = workspace().join("crates/report-page/tests/browser/validate.mjs");
    if !modules.join("node_modules/gltf-validator").is_dir() {
        println!("skipped: gltf-validator is not installed");
        return;
    }
    let output = Command::new("node").arg(script).arg(modules).arg(file).output().expect("node");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let issues: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(issues["messages"], json!([]), "{}", file.display());
}

/// Opens a page in a browser; `None` where there is none.
fn measured(page: &Path, lines: &[usize]) -> Option<Value> {
    let chromium = browser()?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/report-page/tests/browser/measure.mjs");
    let lines: Vec<String> = lines.iter().map(usize::to_string).collect();
    let output = Command::new("node").arg(script).arg(chromium).arg(page).arg(lines.join(",")).output().expect("node");
    assert!(output.status.success(), "{}: {}", page.display(), String::from_utf8_lossy(&output.stderr));
    let measured: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // No page may complain, reach for a network, or run what it only holds.
    assert_eq!(measured["problems"], json!([]), "{}", page.display());
    assert_eq!(measured["scripts_run"], json!([]), "{}", page.display());
    let requests = measured["requests"].as_array().expect("requests");
    assert!(requests.len() == 1 && requests[0].as_str().is_some_and(|url| url.starts_with("file://")), "{requests:?}");
    Some(measured)
}

/// Checks that the scene shows something, and another thing at another time.
fn assert_shown(measured: &Value) {
    let [a, b] = [0, 1].map(|k| &measured["shown"][k]);
    for shown in [a, b] {
        assert!(shown["colours"].as_u64() > Some(50), "{shown}");
        assert!(shown["background"].as_f64() < Some(0.97), "{shown}");
    }
    assert_ne!(a["sum"], b["sum"], "the same picture at two times");
}

/// Checks that keys lead through the program's lines, and that all controls are reachable on a
/// tablet.
fn assert_usable_by_keyboard_and_tablet(measured: &Value) {
    let keys = &measured["keyboard"];
    assert_eq!(keys["lines"], json!([2, 3, 2, keys["n"], 1]));
    assert_eq!(keys["now"], "2");
    assert_eq!(
        (&measured["sliders"], &measured["shortcut"]),
        (&json!(true), &json!({ "checkbox": true, "range": true }))
    );
    let dialog = json!({ "role": "dialog", "has_focus": true, "is_open": false, "returns": true });
    assert_eq!(measured["dialog"], dialog);
    for width in ["820", "1180"] {
        let on = &measured["tablet"][width];
        assert_eq!((&on["overflow"], &on["wrong"]), (&json!(0), &json!([])), "{width} px");
        assert!(on["view"][0].as_f64() > Some(400.0) && on["view"][1].as_f64() > Some(200.0), "{on}");
    }
}

#[test]
fn a_browser_shows_the_pose_of_every_line_and_a_click_leads_to_it() {
    let job = planned();
    let nc = text(&job, "out/program.nc");
    let motions = interpreter::run(&nc);
    let read_back = ReadBack::of(&job, 0);
    let mut random = Random(21);
    let mut chosen: Vec<usize> = (0..200).map(|_| random.below(motions.len())).collect();
    chosen.sort_unstable();
    chosen.dedup_by_key(|k| motions[*k].line);
    // Of a line with several motions, the last one.
    let last = |k: usize| motions.iter().rposition(|m| m.line == motions[k].line).expect("itself");
    let lines: Vec<usize> = chosen.iter().map(|&k| motions[k].line).collect();
    let Some(measured) = measured(&job.path("out/report.html"), &lines) else { return };
    let mut compared = 0;
    for (at, &k) in chosen.iter().enumerate() {
        let (tip, axis) = read_back.end(&motions[last(k)]);
        for c in 0..3 {
            let shown = |key: &str| measured[key][at][c].as_f64().expect("a number");
            assert!((shown("poses") - tip[c]).abs() < 1e-6, "line {}: {} for {tip}", lines[at], measured["poses"][at]);
            assert!((shown("axes") - axis[c]).abs() < 1e-9, "line {}", lines[at]);
        }
        let text = nc.lines().nth(lines[at] - 1).expect("a line");
        assert_eq!(measured["lines"][at], text);
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
    assert_shown(&measured);
    let clicked = &measured["clicked"];
    assert!(clicked["line"].is_u64() && clicked["line"] == clicked["shown"], "{clicked}");
    assert_eq!(measured["banner"], "");
    // In motion fewer shapes are drawn, and no motion of the path that is not done.
    let shapes = &measured["motion_shapes"];
    let drawn = |when: &str, what: &str| shapes[when][what].as_u64().expect("a number");
    assert!(
        shapes["isCoarse"] == true && shapes["moving"]["pixels"].as_f64() < shapes["resting"]["pixels"].as_f64(),
        "{shapes}"
    );
    assert!(drawn("moving", "triangles") <= drawn("resting", "triangles").min(16_000), "{shapes}");
    assert!(0 < drawn("moving", "segments") && drawn("moving", "segments") < drawn("resting", "segments"), "{shapes}");
    let last = |which: &str| -> Vec<i64> {
        let paths = shapes[which].as_array().expect("paths").iter();
        paths.flat_map(|lines| lines.as_array().expect("lines")).map(|k| k.as_i64().expect("a motion")).collect()
    };
    let pairs: Vec<_> = last("fineDone").into_iter().zip(last("coarseDone")).collect();
    assert!(pairs.iter().all(|(fine, coarse)| coarse <= fine && fine - coarse <= 64), "{pairs:?}");
    let stock = &measured["stock"];
    let keys = stock["keys"].as_i64().expect("a number");
    assert!(keys > 1, "{stock}");
    assert_eq!([&stock["start"], &stock["before_first"], &stock["first"], &stock["end"]], [-1, -1, 0, keys - 1]);
    let sheet = &measured["sheet"];
    assert_eq!(sheet["rows"], sheet["all_rows"], "rows are missing in print");
    assert!(sheet["rows"].as_u64() > Some(40) && sheet["app_hidden"] == true, "{sheet}");
    assert!(sheet["repeats"] == true && sheet["running"].as_str().expect("text").contains("VERIFIED"), "{sheet}");
    for heading in ["What the control must be set to", "Distances to measure"] {
        assert!(sheet["headings"].to_string().contains(heading), "{}", sheet["headings"]);
    }
    assert_usable_by_keyboard_and_tablet(&measured);
    let map = &measured["postures"];
    assert!(map["is_open"] == true && map["wanted"] == map["shown"] && map["colours"].as_u64() > Some(3), "{map}");
    assert!(map["off_mm"].as_f64() < Some(0.02), "{map}");
    assert!(measured["pdf_pages"].as_u64() <= Some(5), "{}", measured["pdf_pages"]);
    assert_eq!(sheet["sheets"], 1, "printed with the sheet open");
    let stamp = job.json("out/report.json")["programs"][0]["blake3"].clone();
    assert!(sheet["text"].as_str().expect("text").contains(stamp.as_str().expect("a checksum")));

    let alone = self::measured(&job.path("out/setup-sheet.html"), &[]).expect("as before");
    assert_eq!(alone["sheet"]["text"], sheet["text"]);
}

#[test]
fn a_browser_shows_a_rejected_program_in_red_and_leads_from_a_finding_to_its_block() {
    let job = tiny_patch();
    let template = include_str!("../../../../crates/nc-program/templates/fanuc.j2");
    let kept: Vec<&str> = template.lines().filter(|l| !l.starts_with("G0 G90 G43 ")).collect();
    job.write("post.j2", (kept.join("\n") + "\n").as_bytes());
    job.set("job.json", &[("/post/template", json!("post.j2"))]);
    assert_eq!(facemill(&job, "plan job.json --out ./out"), 4);
    let held = document(&text(&job, "out/report.html"));
    assert_eq!(held["verdict"]["state"], "faulty");
    assert_eq!(held["program"]["file"], "program.rejected.nc");
    let Some(measured) = measured(&job.path("out/report.html"), &[]) else { return };
    let banner = measured["banner"].as_str().expect("text");
    assert!(banner.starts_with("REJECTED: this program has faults and must not be run."), "{banner}");
    assert_eq!(measured["sheet"]["stamp"], "REJECTED: DO NOT RUN");
    assert!(measured["sheet"]["running"].as_str().expect("text").starts_with("REJECTED: DO NOT RUN"));
    assert_usable_by_keyboard_and_tablet(&measured);
    let finding = &measured["finding"];
    assert_eq!(finding["line"], finding["worst"]);
    assert_eq!(finding["marked"], finding["worst"].to_string());
    let line = finding["worst"].as_u64().expect("a line") as usize;
    let block = text(&job, "out/program.rejected.nc").lines().nth(line - 1).expect("it").to_owned();
    assert!(finding["shown"].as_str().expect("text").contains(&block), "{finding} for {block}");
}

/// Gives all bodies of a machine file a name that begins so; returns how many there are.
fn rename_bodies(value: &mut Value, name: &str) -> usize {
    let mut n = 0;
    match value {
        Value::Array(list) => list.iter_mut().for_each(|v| n += rename_bodies(v, name)),
        Value::Object(map) => {
            for (key, value) in map.iter_mut() {
                let bodies = value.as_array_mut().filter(|_| key.ends_with("bodies"));
                match bodies {
                    Some(bodies) => {
                        for body in bodies {
                            body["name"] = json!(format!("{name} {}", body["name"]));
                            n += 1;
                        }
                    }
                    None => n += rename_bodies(value, name),
                }
            }
        }
        _ => {}
    }
    n
}

#[test]
fn hostile_names_are_shown_and_not_run() {
    let job = blink_patch();
    let script = "<script>hostile=1</script>";
    let name = format!("</title></script>{script}");
    let operation = "</script><img src=x onerror=hostile=2>";
    let names = [("/name", json!(name)), ("/setups/0/name", json!(script)), ("/operations/0/name", json!(operation))];
    job.set("job.json", &names);
    let setup = job.json("job.json")["operations"][0].get("setup").cloned();
    if setup.is_some_and(|s| s.is_string()) {
        job.set("job.json", &[("/operations/0/setup", json!(script))]);
    }
    // Of a group of the mesh, of a clamp's file and of bodies of the machine, too.
    let group = "</script><script>hostile=3</script>";
    let obj = text(&job, "patch.obj");
    assert!(obj.contains("patch"), "the group is called otherwise");
    let renamed = |line: &str| {
        if line.starts_with("g ") || line.starts_with("o ") {
            format!("{}{group}", &line[..2])
        } else {
            line.to_owned()
        }
    };
    job.write("patch.obj", obj.lines().map(renamed).collect::<Vec<_>>().join("\n").as_bytes());
    let body = "<img src=x onerror=hostile=4>";
    let mut machine = job.json("machine.json");
    let n_bodies = rename_bodies(&mut machine, body);
    assert!(n_bodies > 0, "the machine has no bodies: this tests nothing");
    job.write("machine.json", machine.to_string().as_bytes());
    assert_eq!(facemill(&job, "plan job.json --out ./out --no-verify"), 0);
    let held = document(&text(&job, "out/report.html"));
    assert!(
        held["machine"]["bodies"].to_string().contains(body) && held["setup"]["outlines"].to_string().contains("img")
    );
    let nc = text(&job, "out/program.nc");
    job.write("foreign.nc", nc.replacen("N1 ", &format!("({script})\n(]]>-->{script})\nN1 "), 1).as_bytes());
    facemill(&job, "view ./foreign.nc --job job.json");
    for page in ["out/report.html", "foreign.html", "out/setup-sheet.html"] {
        assert!(!text(&job, page).contains("<script>hostile"), "{page}");
        let Some(measured) = measured(&job.path(page), &[]) else { return };
        assert!(measured["sheet"]["text"].as_str().expect("text").contains(&name), "{page}");
        if page != "out/setup-sheet.html" {
            assert!(measured["labels"].as_str().expect("text").contains(script), "{page}");
        }
    }
}

#[test]
fn foreign_and_empty_programs_have_pages() {
    let job = blink_patch();
    // Cuts 3 mm below the surface, and an arc that is not simulated.
    let program = "G21 G17 G90 G94 G54\nT1 M6\nG0 G43 Z300. H1\nS1000 M3\nG0 X-30. Y0. B0. C0.\nG1 Z-3. F500.\nX30.\nG2 X40. Y10. I0. J10.\nG0 Z300.\nM30\n";
    job.write("foreign.nc", program.as_bytes());
    assert_eq!(facemill(&job, "view ./foreign.nc --job job.json --stock-cell-mm 2 -o ./foreign.html"), 1);
    let held = document(&text(&job, "foreign.html"));
    assert_eq!(held["verdict"]["state"], "faulty");
    assert!(
        held["motion"]["not_followed"].as_str().expect("a reason").contains("line 8"),
        "{}",
        held["motion"]["not_followed"]
    );
    job.write("empty.nc", b"%\n(NOTHING)\nM30\n%\n");
    facemill(&job, "view ./empty.nc --job job.json");
    let empty = document(&text(&job, "empty.html"));
    assert_eq!(empty["motion"]["n"], 0);
    // What is wrong besides, such as material left, may reject it.
    assert!(["not_verified", "faulty"].iter().any(|state| empty["verdict"]["state"] == *state), "{}", empty["verdict"]);
    assert!(empty["verdict"]["because"].to_string().contains("moves no axis"), "{}", empty["verdict"]);
    assert!(text(&job, "foreign.html").contains("<title>REJECTED - "));
    let Some(foreign) = measured(&job.path("foreign.html"), &[]) else { return };
    assert_shown(&foreign);
    assert_eq!(foreign["finding"]["line"], foreign["finding"]["worst"]);
    let empty = measured(&job.path("empty.html"), &[]).expect("as before");
    assert_eq!(empty["motions"], 0);
}

/// The page of a program with calls has the motion and the verdict of the flat one; it shows lines
/// with their numbers in the written files, and names the text that runs.
#[test]
fn calls_of_subprograms_are_expanded_on_the_page() {
    let job = planned();
    let flat = text(&job, "out/program.nc");
    let [main, sub] = with_a_call(&flat);
    job.write("main.nc", main.as_bytes());
    job.write("O2999.nc", sub.as_bytes());
    job.write("flat.nc", flat.as_bytes());
    let codes = ["flat", "main"].map(|name| facemill(&job, &format!("view ./{name}.nc --job job.json")));
    assert_eq!(codes[0], codes[1]);
    let [flat_page, page] = ["flat", "main"].map(|name| document(&text(&job, &format!("{name}.html"))));
    for key in ["/motion/n", "/motion/total", "/verdict/state", "/verdict/because", "/operation_times"] {
        assert_eq!(page.pointer(key), flat_page.pointer(key), "{key}");
    }
    assert_eq!(page["result"]["findings"], flat_page["result"]["findings"]);
    assert_eq!(page["program"]["file"], "main.nc with its calls expanded");
    let call = main.lines().position(|line| line.starts_with("M98")).expect("a call") + 1;
    let run =
        |first_line: usize, file: &str, line: usize| json!({ "first_line": first_line, "file": file, "line": line });
    let written = [run(1, "main.nc", 1), run(call, "O2999.nc", 3), run(call + 3, "main.nc", call + 1)];
    assert_eq!(page["program"]["written"], json!(written));
    assert!(flat_page["program"].get("written").is_none());
    let assumptions = page["result"]["assumptions"].as_array().expect("assumptions");
    let texts: Vec<&str> = assumptions.iter().filter_map(|a| a["text"].as_str()).collect();
    let at = main.lines().position(|line| line.starts_with("M98")).expect("a call") + 1;
    let places = format!("1 to {} are main.nc 1 to {}, {at} to {} are O2999.nc 3 to 5, ", at - 1, at - 1, at + 2);
    let stamp = |bytes: &str| facemill::formats::checksum(bytes.as_bytes());
    let said = |what: &str| texts.iter().any(|text| text.contains(what));
    assert!(said(&places) && said(&format!("O2999.nc ({})", stamp(&sub))) && said(&stamp(&main)), "{texts:?}");
    assert!(!flat_page.to_string().contains("calls of subprograms"));
    let Some(measured) = measured(&job.path("main.html"), &[1, call, call + 3]) else { return };
    assert_eq!(measured["numbers"], json!(["main.nc 1", "O2999.nc 3", format!("main.nc {}", call + 1)]));
}

#[test]
fn motions_without_a_time_are_counted_and_not_timed() {
    let job = blink_patch();
    // An arc, and a cut before any F.
    let program = "G21 G17 G90 G94 G54\nT1 M6\nG0 G43 Z300. H1\nS1000 M3\nG0 X-30. Y0. B0. C0.\nG1 Z100. F500.\nX30.\nG2 X40. Y10. I0. J10.\nG1 X0.\nG0 Z300.\nM30\n";
    job.write("untimed.nc", program.as_bytes());
    facemill(&job, "view ./untimed.nc --job job.json -o ./untimed.html");
    let page = text(&job, "untimed.html");
    let held = document(&page);
    let untimed = numbers(&page, &held["motion"]["untimed"]);
    let n = untimed.iter().filter(|u| **u == 1.0).count();
    assert!(n > 0 && held["motion"]["n_untimed"] == json!(n), "{n}: {}", held["motion"]["n_untimed"]);
    let times = numbers(&page, &held["motion"]["times"]);
    assert!(untimed.iter().zip(&times).all(|(u, t)| *u == 0.0 || (*t - 0.1).abs() < 1e-9));
    // They are in no sum.
    let of_parts = held["operation_times"].as_array().expect("parts").iter();
    let sum: f64 = of_parts.map(|t| t["cut"].as_f64().expect("s") + t["rapid"].as_f64().expect("s")).sum();
    let timed: f64 = untimed.iter().zip(&times).filter(|(u, _)| **u == 0.0).map(|(_, t)| t).sum();
    assert!((sum - timed).abs() < 1e-4 * times.len() as f64, "{sum} for {timed}");
    let Some(measured) = measured(&job.path("untimed.html"), &[]) else { return };
    assert_shown(&measured);
    let told = if n == 1 { "1 motion is not timed".to_owned() } else { format!("{n} motions are not timed") };
    assert!(measured["sheet"]["text"].as_str().expect("text").contains(&told), "{told}");
}

#[test]
fn both_tools_of_a_machine_with_two_heads_are_on_its_page() {
    let job = two_heads();
    facemill(&job, "plan job.json --out ./out --animation ./motion.glb");
    assert_valid_gltf(&job.path("motion.glb"));
    let page = text(&job, "out/report.html");
    let held = document(&page);
    assert_eq!(held["result"], job.json("out/report.json"));
    assert_eq!(
        (held["tools"].as_array().map(Vec::len), held["motion"]["paths"].as_array().map(Vec::len)),
        (Some(2), Some(2))
    );
    assert!(held["motion"]["n"].as_u64() > Some(20) && held["stock"].is_object(), "{}", held["not_shown"]);
    assert!(held["not_shown"].to_string().contains("postures.json"), "{}", held["not_shown"]);
    let sheet_rows = held["control_settings"].as_array().expect("settings").iter();
    assert_eq!(sheet_rows.filter(|s| s["name"] == "Tool length").count(), 2);
    std::fs::remove_file(job.path("out/report.html")).expect("it was there");
    facemill(&job, "report ./out --job job.json");
    let again = document(&text(&job, "out/report.html"));
    assert_eq!((&again["motion"]["n"], &again["result"]), (&held["motion"]["n"], &held["result"]));
    let Some(measured) = measured(&job.path("out/report.html"), &[]) else { return };
    assert_shown(&measured);
    assert_usable_by_keyboard_and_tablet(&measured);
}

#[test]
fn all_pieces_of_the_stock_are_drawn_and_the_gap_between_them() {
    let job = blink_patch();
    // A plate over another, 4 mm apart.
    let [lower, upper] =
        [[-12.0, -8.0], [-4.0, 3.0]].map(|[low, high]| box_obj([-45.0, -45.0, low], [45.0, 45.0, high]));
    let corner = |word: &str| word.parse::<u32>().map_or(word.to_owned(), |v| (v + 8).to_string());
    let moved = |line: &str| {
        let words = line.split(' ').map(|word| if line.starts_with('f') { corner(word) } else { word.to_owned() });
        words.collect::<Vec<_>>().join(" ")
    };
    let upper: Vec<String> = upper.lines().map(moved).collect();
    job.write("stock.obj", (lower + &upper.join("\n") + "\n").as_bytes());
    let stock = json!({ "mesh": { "file": "stock.obj", "unit": "millimetre", "up_axis": "z" } });
    job.set("job.json", &[("/setups/0/stock", stock)]);
    job.write("still.nc", b"G21 G17 G90 G94 G54\nT1 M6\nG0 G43 Z300. H1\nX20. Y10. B0. C0.\nM30\n");
    facemill(&job, "view ./still.nc --job job.json -o ./still.html");
    let page = text(&job, "still.html");
    assert!(numbers(&page, &document(&page)["stock"]["first_counts"]).contains(&2.0));
    let Some(measured) = measured(&job.path("still.html"), &[]) else { return };
    let stock = &measured["stock"];
    assert_eq!((&stock["pieces"], &stock["levels"]), (&json!(2), &json!([-12, -8, -4, 3])), "{stock}");
    assert_eq!(stock["highest"].as_f64().map(f64::round), Some(7.0), "{stock}");
}

/// Numbers of an array of a page; NaN where they are not known.
fn numbers(page: &str, described: &Value) -> Vec<f64> {
    let number = |key: &str| described[key].as_f64().expect("a number");
    let (mut values, mut whole, mut raw, mut shift) = (Vec::new(), 0_i64, 0_u64, 0);
    for byte in array(page, &described["array"]) {
        raw |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            whole += (raw >> 1) as i64 ^ -((raw & 1) as i64);
            let is_gap = described["gaps"] == true && whole == 0;
            values.push(if is_gap { f64::NAN } else { number("offset") + whole as f64 * number("unit") });
            (raw, shift) = (0, 0);
        }
    }
    assert_eq!(values.len() as f64, number("n"));
    values
}

#[test]
fn without_certificates_clearances_at_block_ends_are_no_less_than_verification_found() {
    let job = blink_patch();
    facemill(&job, "plan job.json --out ./out");
    let page = text(&job, "out/report.html");
    let held = document(&page);
    let figures = held["motion"]["figures"].as_array().expect("figures");
    let clearance = figures.iter().find(|f| f["key"] == "clearance").expect("clearances");
    let least = numbers(&page, &clearance["values"]).into_iter().fold(f64::INFINITY, f64::min);
    let worst = held["result"]["worst"]["clearance_mm"].as_f64().expect("a clearance");
    // Positions between ends may be nearer, by little along so short blocks.
    assert!(least >= worst - 1e-3 && least <= worst + 1.0, "{least} at ends, {worst} anywhere");
    let n = held["motion"]["n"].as_u64().expect("a number") as usize;
    let times: f64 = numbers(&page, &held["motion"]["times"]).iter().sum();
    let program = &held["result"]["times"];
    let total = program["cutting_s"].as_f64().expect("a time") + program["rapid_s"].as_f64().expect("a time");
    assert!((times - total).abs() <= 1e-5 * n as f64, "{times} s in the page, {total} s in the report");
}

#[test]
fn the_animation_is_gltf_with_a_track_for_each_axis() {
    let job = blink_patch();
    facemill(&job, "plan job.json --out ./out --no-verify --no-html");
    facemill(&job, "report ./out --job job.json --animation ./motion.glb");
    assert_valid_gltf(&job.path("motion.glb"));
    let bytes = std::fs::read(job.path("motion.glb")).expect("an animation");
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let text = &bytes[20..20 + word(12)];
    let binary = &bytes[28 + word(12)..];
    assert_eq!((&bytes[16..20], word(20 + word(12))), (&b"JSON"[..], binary.len()));
    let file: Value = serde_json::from_slice(text).expect("JSON");
    let index = |v: &Value| v.as_u64().expect("an index") as usize;
    let floats = |accessor: &Value| -> Vec<f32> {
        let accessor = &file["accessors"][index(accessor)];
        let view = &file["bufferViews"][index(&accessor["bufferView"])];
        let from = index(&view["byteOffset"]);
        let bytes = &binary[from..from + index(&view["byteLength"])];
        bytes.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    };
    let animation = &file["animations"][0];
    let channels = animation["channels"].as_array().expect("channels");
    assert_eq!(channels.len(), 5);
    for channel in channels {
        let sampler = &animation["samplers"][index(&channel["sampler"])];
        let (times, values) = (floats(&sampler["input"]), floats(&sampler["output"]));
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "times go on");
        let bounds = &file["accessors"][index(&sampler["input"])];
        assert_eq!(bounds["max"][0].as_f64().map(|t| t as f32), times.last().copied());
        let width = if channel["target"]["path"] == "rotation" { 4 } else { 3 };
        assert_eq!(values.len(), width * times.len());
        if width == 4 {
            let quaternions: Vec<&[f32]> = values.chunks(4).collect();
            assert!(quaternions.iter().all(|q| (q.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-5));
            // Viewers turn the short way: no step may be long.
            let dot = |p: &[f32], q: &[f32]| p.iter().zip(q).map(|(a, b)| a * b).sum::<f32>().abs();
            assert!(quaternions.windows(2).all(|pair| dot(pair[0], pair[1]) > 0.9));
        }
    }
    let part = file["nodes"].as_array().expect("nodes").iter().find(|n| n["name"] == "part").expect("the part");
    let primitive = &file["meshes"][index(&part["mesh"])]["primitives"][0];
    let [low, high] = ["min", "max"].map(|key| &file["accessors"][index(&primitive["attributes"]["POSITION"])][key]);
    assert!((high[0].as_f64().expect("x") - low[0].as_f64().expect("x") - 80.0).abs() < 0.01);
}

/// Value of a setting of the control on a page.
fn setting<'d>(held: &'d Value, name: &str) -> &'d str {
    let mut all = held["control_settings"].as_array().expect("settings").iter();
    let found = all.find(|s| s["name"].as_str().is_some_and(|n| n.starts_with(name)));
    found.and_then(|s| s["value"].as_str()).unwrap_or_else(|| panic!("no {name}"))
}

/// Checks that words and lines that the sheet names are in the text, and that registers have the
/// control's names.
fn assert_settings_are_of_the_text(control: &str, held: &Value, program: &str) {
    let tip = setting(held, "Tip control");
    if let Some(words) = tip.strip_prefix("the program switches it on with ") {
        let words = words.split(':').next().expect("words");
        assert!(!words.trim().is_empty(), "{control}: {tip}");
        for word in words.split(' ') {
            assert!(program.contains(word), "{control}: {word} is not in the text");
        }
    } else {
        assert!(tip.starts_with("off: "), "{control}: {tip}");
    }
    // The page's line is that of the file, and before the first block under the length.
    let length = setting(held, "Tool length");
    let (before, quoted) = length.split_once("(file line ").unwrap_or_else(|| panic!("{control}: {length}"));
    assert!(before.contains("compares it before it moves with it"), "{control}: {length}");
    let (line, quoted) = quoted.split_once(": \"").expect("a text");
    let line: usize = line.parse().expect("a number");
    let begin = quoted.trim_end_matches("\")").trim_end_matches('…');
    assert!(program.lines().nth(line - 1).expect("a line").trim().starts_with(begin), "{control}: {length}");
    let [register, place] = [&held["setup"]["work_offset"]["register"], &held["tools"][0]["length_place"]];
    let (register, place) = (register.as_str().expect("text"), place.as_str().expect("text"));
    let (wanted, in_place) = match control {
        "heidenhain" => ("PRESET 1 (CYCL DEF 247 DATUM SETTING Q339=+1 ;DATUM NUMBER)", "tool table"),
        "siemens_840d" => ("G54", "cutting edge D1"),
        _ => ("G54", "H"),
    };
    assert!(register == wanted && place.contains(in_place), "{control}: {register}, {place}");
    let rapids = setting(held, "Rapids");
    let set_by = match control {
        "heidenhain" | "linuxcnc" => "as this control always does",
        "siemens_840d" => "selected by RTLION (file line ",
        _ => "setting to check: ",
    };
    assert!(rapids.contains(set_by), "{control}: {rapids}");
}

#[test]
fn words_that_the_sheet_names_of_a_foreign_program_are_those_of_its_text() {
    let job = blink_patch();
    job.set("machine.json", &[("/motion/rapid", json!("linear"))]);
    // Inches, two meanings of F, tip control by another word than ours, and no check of a length.
    let program = "G20 G17 G90 G94 G54\nT1 M6\nS1000 M3\n(TOOL LENGTH #11001)\nG0 G43.5 X0. Y0. Z12. B0. C0. H1\nG1 Z11. F20.\nG49\nG28 G91 Z0.\n\
                   G90 G94 G1 G43 Z12. X0. Y0. B0. C0. H1 F20.\nG93 Z11. X1. Y1. F2.\nM30\n";
    job.write("foreign.nc", program.as_bytes());
    facemill(&job, "view ./foreign.nc --job job.json -o ./foreign.html");
    let held = document(&text(&job, "foreign.html"));
    let tip = setting(&held, "Tip control");
    assert!(tip.contains("G43.5") && tip.contains("file line 5"), "{tip}");
    let length = setting(&held, "Tool length");
    assert!(length.ends_with("the program does not compare it before it moves with it: check it by hand"), "{length}");
    let feed = setting(&held, "Meaning of F");
    assert!(feed.contains("inch/min") && feed.contains("inverse time"), "{feed}");
    assert!(!feed.contains("header"), "{feed}");
    let smoothing = setting(&held, "Smoothing");
    assert!(smoothing.contains("no word of the program"), "{smoothing}");
}

#[test]
fn the_sheet_says_what_a_probe_at_the_datum_reads() {
    let job = blink_patch();
    let offset_of = |job: &JobFolder| {
        facemill(job, "plan job.json --out ./out --no-verify");
        let held = document(&text(job, "out/report.html"));
        (held["setup"]["work_offset"].clone(), held["setup"]["table_from_work"].clone())
    };
    let (at, table_from_work) = offset_of(&job);
    let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v}"));
    let datum = [3, 7, 11].map(|k| number(&table_from_work[k]));
    let axes = at["axes"].as_array().expect("axes");
    let axis = |letter: &str| axes.iter().find(|a| a["letter"] == letter).expect("the axis");
    // Words and table are parallel on this machine.
    let mut readings = json!({});
    for (c, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
        let expected = number(&axis(letter)["value"]) + datum[c] - number(&at["program_zero"][c]);
        let reading = number(&axis(letter)["reading_at_datum"]);
        assert!((reading - expected).abs() < 1e-9, "{letter}: {reading} for {expected}");
        let of_probe = number(&axis(letter)["probe_lengths"]);
        assert!((of_probe - if letter == "Z" { 1.0 } else { 0.0 }).abs() < 1e-9, "{letter}: {of_probe}");
        readings[letter] = json!(reading);
    }
    let is_same = datum.iter().zip(0..).all(|(d, c)| (d - number(&at["program_zero"][c as usize])).abs() < 1e-6);
    assert_eq!(at["is_same_frame"], json!(is_same));
    // With these readings as its values the offset is at the datum.
    job.set("job.json", &[("/setups/0/work_offset/linear_mm", readings)]);
    let (at, _) = offset_of(&job);
    assert_eq!(at["is_same_frame"], true, "{at}");
    for axis in at["axes"].as_array().expect("axes") {
        assert!((number(&axis["reading_at_datum"]) - number(&axis["value"])).abs() < 1e-9, "{axis}");
    }
}

#[test]
fn the_documentation_has_every_key_of_the_document() {
    let job = blink_patch();
    facemill(&job, "plan job.json --out ./out --no-verify");
    let page = text(&job, "out/setup-sheet.html");
    assert!(page.contains("<noscript><p><b>NOT VERIFIED; "));
    let held = document(&page);
    let docs = include_str!("../../../../docs/report-page.md");
    let table = docs.split("| key | content |").nth(1).expect("a table");
    let cells =
        table.lines().take_while(|line| line.is_empty() || line.starts_with('|')).filter_map(|l| l.split('|').nth(1));
    let mut documented: Vec<&str> = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    let mut keys: Vec<&str> = held.as_object().expect("an object").keys().map(String::as_str).collect();
    documented.sort_unstable();
    keys.sort_unstable();
    assert_eq!(documented, keys);
}

#[test]
fn every_control_has_a_page_that_follows_its_program() {
    let controls = [
        ("fanuc", "g94", "nc"),
        ("haas", "g94", "nc"),
        ("mazak", "rtcp", "nc"),
        ("linuxcnc", "g93", "ngc"),
        ("siemens_840d", "rtcp", "mpf"),
        ("heidenhain", "rtcp", "h"),
        ("fanuc", "rtcp", "nc"),
        ("haas", "rtcp", "nc"),
        ("linuxcnc", "rtcp", "ngc"),
    ];
    for (control, mode, ending) in controls {
        let job = blink_patch();
        job.set("job.json", &[("/post/dialect", json!(control)), ("/post/feed_mode", json!(mode))]);
        if mode == "rtcp" {
            job.set("machine.json", &[("/motion/cutting", json!("tip_and_rotaries_linear"))]);
        }
        facemill(&job, "plan job.json --out ./out --no-verify");
        let page = text(&job, "out/report.html");
        let held = document(&page);
        let motion = &held["motion"];
        assert_eq!(held["program"]["file"], format!("program.{ending}"), "{control}");
        assert_eq!(motion["not_followed"], Value::Null, "{control}");
        assert_eq!((&motion["by_law"], &held["verdict"]["state"]), (&json!(true), &json!("not_verified")), "{control}");
        assert_eq!(held["program"]["operations"].as_array().map(Vec::len), Some(1), "{control}");
        let passes = held["result"]["passes"].as_array().map(Vec::len);
        assert_eq!(held["program"]["passes"].as_array().map(Vec::len), passes, "{control}");
        let [by_length, by_time] = ["feeds", "inverse_feeds"].map(|key| !motion[key].is_null());
        assert_eq!((by_length, by_time), (mode != "g93", mode == "g93"), "{control}");
        let under_rtcp = numbers(&page, &motion["rtcp"]).contains(&1.0);
        assert_eq!(under_rtcp, mode == "rtcp", "{control}");
        assert_settings_are_of_the_text(control, &held, &text(&job, &format!("out/program.{ending}")));
        if control == "siemens_840d" {
            let Some(measured) = measured(&job.path("out/report.html"), &[]) else { continue };
            assert_shown(&measured);
            assert!(measured["banner"].as_str().expect("text").starts_with("Not verified"), "{}", measured["banner"]);
        }
    }
}
