//! Jobs with several tools: a program for each, one after the other on one stock.

use std::ffi::OsString;

use facemill::{Job, Scene, Setup};
use facemill_tests::commands::{CommandOutput, facemill_in};
use facemill_tests::golden::CONTROLS;
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter::{self, Motion};
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::shared::workspace;
use facemill_tests::variants::{blink_patch, plan};
use serde_json::{Value, json};

use crate::schemas::check;
use crate::strategies::left_above::{LIMIT, OVERLAP, half_cut, large, limit_to};

/// Returns the job in which a large mill leaves out a band, and a small one cuts it: both in one
/// job.
fn both_mills() -> JobFolder {
    let job = half_cut();
    let whole = job.json("job.json")["operations"][0].clone();
    let operation = |name: &str, tool: &str| {
        let mut operation = whole.clone();
        (operation["name"], operation["tool"]) = (json!(name), json!(tool));
        operation
    };
    let range = |mut operation: Value, from: f64, to: f64| {
        let planes = operation.pointer_mut("/path/strategy/strategy/parallel_planes").expect("planes");
        (planes["from_mm"], planes["to_mm"]) = (json!(from), json!(to));
        operation
    };
    let mut rest = operation("whole", "small");
    rest["path"]["strategy"]["region"] =
        json!({ "left_above": { "height_mm": LIMIT, "overlap_mm": OVERLAP, "of": "operations_before" } });
    let [low, high] = [range(operation("low", "large"), -10.0, -4.0), range(operation("high", "large"), 4.0, 10.0)];
    let mut file = job.json("job.json");
    file.as_object_mut().expect("an object").remove("tool");
    file["tools"] = json!({ "large": "tool.json", "small": "small.json" });
    file["setups"][0]["rest_cell_mm"] = json!(0.34);
    file["operations"] = json!([low, high, rest]);
    // Each mill has a number of its own.
    let mut small = job.json("small.json");
    small["number"] = json!(2);
    job.write("small.json", small.to_string().as_bytes());
    job.write("job.json", file.to_string().as_bytes());
    job
}

/// Returns the blocks of a program: without its name and comments.
fn blocks(text: &str) -> Vec<&str> {
    text.lines().filter(|line| !line.starts_with(['(', 'O'])).collect()
}

fn read(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn operations_of_two_tools_in_one_job_are_those_of_two_jobs() {
    let together = both_mills();
    plan(&together);
    let [large_text, small_text] =
        ["1-large", "2-small"].map(|of| read(&together, &format!("out/program-top-{of}.nc")));
    let same = |a: &str, b: &str| assert!(blocks(a) == blocks(b), "{} and {} blocks", blocks(a).len(), blocks(b).len());
    // The job of the first tool leaves the same program.
    let apart = half_cut();
    apart.write("small.json", read(&together, "small.json").as_bytes());
    let whole = apart.json("job.json")["operations"].clone();
    let mut of_large = together.json("job.json")["operations"].clone();
    of_large.as_array_mut().expect("operations").truncate(2);
    for operation in of_large.as_array_mut().expect("operations") {
        operation.as_object_mut().expect("an operation").remove("tool");
    }
    apart.set("job.json", &[("/operations", of_large)]);
    plan(&apart);
    same(&large_text, &read(&apart, "out/program.nc"));
    // So does that of the second tool, on what the first program leaves.
    apart.write("large.nc", large_text.as_bytes());
    apart.set(
        "job.json",
        &[
            ("/operations", whole),
            ("/setups/0/programs_before", json!([large()])),
            ("/setups/0/rest_cell_mm", json!(0.34)),
        ],
    );
    limit_to(&apart, json!("operations_before"));
    plan(&apart);
    same(&small_text, &read(&apart, "out/program.nc"));
    let report_apart: Value = serde_json::from_str(&read(&apart, "out/report.json")).expect("JSON");

    // Each program calls its own tool, and is verified on what the one before leaves.
    assert!(large_text.contains("T1 M6") && small_text.contains("T2 M6"));
    let report: Value = serde_json::from_str(&read(&together, "out/report-top-2-small.json")).expect("JSON");
    assert_eq!(report["stock"]["began_as"], "the rest of setup \"top 1 large\"");
    let on = |report: &Value| report["stock"]["planned_on"].as_str().expect("a text").to_owned();
    assert_eq!(on(&report).replace("top 1 large", "large.nc"), on(&report_apart));
    assert!(on(&report).starts_with("all that \"top 1 large\" may leave"), "{}", on(&report));
    // What is left counts both programs: nothing is above the limit or never cut.
    let left = &report["remaining"]["operations"][0];
    assert!(left["largest"]["height_mm"].as_f64() <= Some(LIMIT), "{left}");
    assert_eq!((left["never_cut_fraction"].as_f64(), left["exceeded"].as_bool()), (Some(0.0), Some(false)));

    // Verified again, each program in its own place; the second one with the first.
    let (job, first) = (together.job(), together.path("out/program-top-1-large.nc"));
    let verify = |program: &str, setup: &str, after: bool| {
        let program = together.path(program);
        let mut words: Vec<OsString> = vec!["verify".into(), program.into(), "--job".into(), job.clone().into()];
        words.extend(["--setup".into(), setup.into()]);
        words.extend(
            after.then(|| [OsString::from("--after"), format!("1={}", first.display()).into()]).into_iter().flatten(),
        );
        let output = run(&words);
        let (code, errors) = code_and_errors(&output);
        CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
    };
    let second = "out/program-top-2-small.nc";
    assert_eq!(verify("out/program-top-1-large.nc", "1", false).code, 0);
    let refused = verify(second, "2", false);
    assert!(refused.is_refused_for(&["operations_before", "\"top 1 large\"", "--after 1=FILE"]), "{}", refused.errors);
    let done = verify(second, "top 2 small", true);
    assert!(done.code == 0, "{}{}", done.printed, done.errors);

    assert_compared_at_the_end(&together);

    // A program in the place of the other has the wrong tool, and so has one that calls the other.
    let wrong = verify("out/program-top-1-large.nc", "2", true);
    assert!(wrong.code == 1 && wrong.prints(&["tool", "T1"]), "{}{}", wrong.printed, wrong.errors);
    let changed = small_text.replacen("T2 M6", "T1 M6", 1);
    together.write("out/wrong.nc", changed.as_bytes());
    let wrong = verify("out/wrong.nc", "2", true);
    let line = 1 + changed.lines().position(|line| line.contains("T1 M6")).expect("a tool change");
    assert!(wrong.code == 1 && wrong.prints(&[&line.to_string(), "T1"]), "{}{}", wrong.printed, wrong.errors);

    // Its pages are written again from its folder, also the one on the job.
    let report_again = || facemill_in(&together, &format!("report {} --job job.json", together.path("out").display()));
    let again = report_again();
    assert_eq!(again.code, 0, "{}{}", again.printed, again.errors);
    let page = read(&together, "out/job-report.html");
    assert!(page.contains("program-top-2-small.nc") && again.prints(&["job-report.html"]), "{page}");
    // Not beside another program than the report on the job has.
    let other = read(&together, "out/job-report.json").replace("\"blake3\": \"", "\"blake3\": \"0");
    together.write("out/job-report.json", other.as_bytes());
    let refused = report_again();
    assert!(refused.is_refused_for(&["job-report.json", "describes another program"]), "{}", refused.errors);
}

/// Runs `facemill verify` with these words, apart by spaces; `@` stands for the job's folder.
fn verify_in(job: &JobFolder, words: &str) -> CommandOutput {
    let folder = job.path("").display().to_string();
    let words = format!("verify {words} --job @job.json").replace('@', &folder);
    let output = run(&words.split_whitespace().collect::<Vec<_>>());
    let (code, errors) = code_and_errors(&output);
    CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
}

/// Asserts that the stock behind a program of all tools is that behind the programs of each, and
/// that its comparison with the part counts all that both cut.
fn assert_compared_at_the_end(job: &JobFolder) {
    let verify = |words: &str| {
        let done = verify_in(job, words);
        assert_eq!(done.code, 0, "{words}: {}{}", done.printed, done.errors);
        done
    };
    let (cell, compared) = ("--stock-cell-mm 0.5 --stock-tolerance-mm 0.002", "--deviation-tolerance-mm 0.1");
    let joined =
        verify(&format!("@out/program.nc {cell} {compared} --deviation @all.glb --rest-out @all.rest -o @all.json"));
    assert!(joined.prints(&["deviation         within tolerance to 0.100 mm"]), "{}", joined.printed);
    verify(&format!("@out/program-top-1-large.nc --setup 1 {cell} {compared} --rest-out @first.rest -o @first.json"));
    let second = "@out/program-top-2-small.nc --setup 2 --after 1=@out/program-top-1-large.nc --rest @first.rest";
    verify(&format!("{second} {compared} --stock-tolerance-mm 0.002 --rest-out @second.rest -o @second.json"));
    let bytes = |name: &str| std::fs::read(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert!(bytes("all.rest") == bytes("second.rest") && bytes("all.glb").starts_with(b"glTF"));
    let (all, first, second) = (job.json("all.json"), job.json("first.json"), job.json("second.json"));
    let parts = all.as_array().expect("a list");
    assert!(parts.len() == 2 && parts[0]["deviation"].is_null());
    let area = |of: &Value, kind: &str| of["deviation"]["part"]["area_mm2"][kind].as_f64().expect("an area");
    let kinds = ["within", "gouged", "excess", "not_reached", "no_stock", "not_measured"];
    let [of_all, of_first, of_second] = [&parts[1], &first, &second].map(|of| kinds.map(|kind| area(of, kind)));
    assert_eq!(of_all, of_second, "behind both programs");
    // The large mill alone leaves the band in the middle.
    let [sum, same] = [of_all, of_first].map(|areas| areas.iter().sum::<f64>());
    assert!((sum - same).abs() < 1e-6 * sum, "{of_all:?} {of_first:?}");
    assert!(of_all[0] > of_first[0] + 100.0 && of_all[3] < of_first[3] - 100.0, "{of_all:?} {of_first:?}");
}

#[test]
fn what_a_tool_leaves_counts_at_the_end_of_the_job_where_a_later_one_cuts_it() {
    let job = both_mills();
    let mut file = job.json("job.json");
    let operations = file["operations"].as_array().expect("operations").clone();
    let [mut low, high, rest] = <[Value; 3]>::try_from(operations).expect("three operations");
    job.set("job.json", &[("/operations", json!([low]))]);
    plan(&job);
    job.write("passes.json", read(&job, "out/passes.json").as_bytes());
    // The large mill is to finish the band that it leaves in the middle, too.
    let region = json!({ "box": { "min_mm": [-60.0, -10.0, -30.0], "max_mm": [60.0, 10.0, 30.0] } });
    low["path"] = json!({ "file": { "file": "passes.json", "max_distance_mm": 0.01, "region": region } });
    let mut planned = |from: f64| {
        let mut rest = rest.clone();
        rest["path"]["strategy"]["strategy"]["parallel_planes"]["from_mm"] = json!(from);
        file["operations"] = json!([low, high, rest]);
        job.write("job.json", file.to_string().as_bytes());
        let out = job.path("out");
        let done = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
        let report: Value = serde_json::from_str(&read(&job, "out/job-report.json")).expect("JSON");
        let own: Value = serde_json::from_str(&read(&job, "out/report-top-1-large.json")).expect("JSON");
        assert_eq!(own["remaining"]["operations"][0]["exceeded"], json!(true), "its own program leaves the band");
        let [left] = report["left_at_end"].as_array().expect("a list").as_slice() else {
            panic!("{}", report["left_at_end"]);
        };
        assert_eq!((&left["operation"], &left["lowered_by"]), (&json!("low"), &json!(["top 2 small"])), "{left}");
        assert!(left["above_fraction"].as_f64() > Some(0.2), "{left}");
        (done, report["outcome"].clone(), left.clone())
    };
    let (done, outcome, left) = planned(-10.0);
    assert!(done.code == 0 && outcome == "done", "{}{}", done.printed, done.errors);
    assert!(left["above_at_end"].as_f64() < Some(0.01) && left["never_cut_at_end"] == 0.0, "{left}");
    assert!(done.prints(&["left at the end"]), "{}", done.printed);
    assert!(done.prints(&["operation \"low\"", "cut deeper by top 2 small"]), "{}", done.printed);
    // So says the text of both, part by part.
    let verified_again = |code: i32, finished: &str| {
        let done = verified(&job, "out/program.nc");
        assert_eq!(done.code, code, "{}{}", done.printed, done.errors);
        assert!(
            done.prints(&["left after all parts"]) && done.prints(&[finished, "operation \"low\""]),
            "{}",
            done.printed
        );
    };
    verified_again(0, "  finished");
    // The small mill cuts the band's upper half alone.
    let (done, outcome, left) = planned(0.0);
    assert!(done.code == 1 && outcome == "incomplete", "{}{}", done.printed, done.errors);
    assert!((0.05..0.2).contains(&left["above_at_end"].as_f64().expect("a share")), "{left}");
    assert!(done.prints(&["JOB NOT MET"]) && done.prints(&["after its own program"]), "{}", done.printed);
    verified_again(1, "NOT FINISHED");
}

#[test]
fn a_tool_with_nothing_to_cut_has_no_part_in_the_program_of_all_tools() {
    let job = both_mills();
    let mut file = job.json("job.json");
    let operations = file["operations"].as_array().expect("operations").clone();
    let [low, _, rest] = <[Value; 3]>::try_from(operations).expect("three operations");
    // The large mill cuts all, so that nothing is left for the small one; then it comes again.
    let mut all = low.clone();
    all["name"] = json!("all");
    all["path"]["strategy"]["strategy"]["parallel_planes"]["to_mm"] = json!(10.0);
    file["operations"] = json!([all, rest, low]);
    job.write("job.json", file.to_string().as_bytes());
    let out = job.path("out");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
    assert!(planned.code == 0, "{}{}", planned.printed, planned.errors);
    for said in ["T1: program-top-3-large.nc", "nothing to cut    top 2 small: verify with --without"] {
        assert!(planned.prints(&[said]), "{said}: {}", planned.printed);
    }
    let text = read(&job, "out/program.nc");
    assert!(text.matches("T1 M6").count() == 2 && !text.contains("T2"), "{text}");
    let verify = |more: &str| {
        let words = format!("verify {} --job job.json {more}", out.join("program.nc").display());
        facemill_in(&job, words.trim_end())
    };
    let missing = verify("");
    assert!(missing.code == 1 && missing.prints(&["\"top 2 small\": A TOOL IS MISSING"]), "{}", missing.printed);
    let done = verify("--without 2");
    assert!(done.code == 0 && !done.prints(&["MISSING"]), "{}{}", done.printed, done.errors);
    // A setup that has a part is not without one.
    let wrong = verify("--without 2 --without 3");
    assert!(wrong.code == 1 && wrong.prints(&["A TOOL TOO MANY, T1"]), "{}{}", wrong.printed, wrong.errors);
    // Behind other parts than the job's the stock is not handed on.
    let cut = "@out/program.nc --stock-cell-mm 2 --rest-out @wrong.rest --deviation @wrong.glb --rest-mesh @wrong.stl";
    for without in ["--without 2 --without 3", ""] {
        let wrong = verify_in(&job, &format!("{cut} {without}"));
        for option in ["--rest-out", "--rest-mesh", "--deviation"] {
            assert!(wrong.code == 1 && wrong.prints(&[option, "NOT DONE"]), "{}{}", wrong.printed, wrong.errors);
        }
        assert!(["wrong.rest", "wrong.stl", "wrong.glb"].iter().all(|name| !job.path(name).exists()));
    }
    let whole = verify_in(&job, &format!("{cut} --without 2"));
    assert!(whole.code == 0 && job.path("wrong.stl").exists(), "{}{}", whole.printed, whole.errors);
    let unknown = verify("--without 9");
    assert!(unknown.is_refused_for(&["9"]), "{}{}", unknown.printed, unknown.errors);
    let alone = verify("--setup 1 --without 2");
    assert!(alone.is_refused_for(&["--without", "several tools"]), "{}{}", alone.printed, alone.errors);
}

/// Returns a job with two tools on a few passes, for a control.
pub(crate) fn two_tools(dialect: &str) -> JobFolder {
    let job = blink_patch();
    let mut file = job.json("job.json");
    file.as_object_mut().expect("an object").remove("tool");
    file["tools"] = json!({ "mill": "tool.json", "finer": "finer.json" });
    // So coarse that no bound is had, which takes most of the time elsewhere.
    file["setups"][0]["rest_cell_mm"] = json!(2.0);
    let mut first = file["operations"][0].clone();
    first["tool"] = json!("mill");
    let mut second = first.clone();
    (second["tool"], second["name"]) = (json!("finer"), json!("again"));
    file["operations"] = json!([first, second]);
    file["post"]["dialect"] = json!(dialect);
    if dialect == "linuxcnc" {
        file["post"]["feed_mode"] = json!("g93");
    }
    job.write("job.json", file.to_string().as_bytes());
    let mut finer = job.json("tool.json");
    // Longer, so that the length of one is not that of the other.
    let [arbor, gauge] = ["/holder/sections/0/length_mm", "/gauge_length_mm"]
        .map(|key| finer.pointer(key).and_then(Value::as_f64).expect("a length"));
    (finer["number"], finer["name"]) = (json!(7), json!("finer mill"));
    (finer["holder"]["sections"][0]["length_mm"], finer["gauge_length_mm"]) =
        (json!(arbor + 20.0), json!(gauge + 20.0));
    job.write("finer.json", finer.to_string().as_bytes());
    job
}

/// Verifies a program of all tools; returns its exit code, what it printed, and its errors.
pub(crate) fn verified(job: &JobFolder, program: &str) -> CommandOutput {
    let words = ["verify".into(), job.path(program).into_os_string(), "--job".into(), job.job().into()];
    let output = run::<OsString>(&words);
    let (code, errors) = code_and_errors(&output);
    CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
}

#[test]
fn a_program_that_changes_tools_is_those_of_its_tools_and_its_faults_are_found_on_every_control() {
    for (dialect, ending) in CONTROLS {
        let job = two_tools(dialect);
        let out = job.path("out");
        let planned = facemill_in(&job, &format!("plan job.json --no-html --json --out {}", out.display()));
        assert_eq!(planned.code, 0, "{dialect}: {}", planned.errors);
        let summary: Value = serde_json::from_str(&planned.printed).expect("JSON");
        let joined = &summary["joined_programs"][0];
        assert_eq!(joined["file"], format!("program.{ending}"), "{dialect}: {joined}");
        let tools: Vec<u64> =
            joined["sections"].as_array().expect("sections").iter().filter_map(|s| s["tool"].as_u64()).collect();
        assert_eq!(tools, [1, 7], "{dialect}");
        let text = read(&job, &format!("out/program.{ending}"));
        // Each motion of both programs is in it, in their order; the numbers of blocks go on.
        let words = |text: &str| -> Vec<String> {
            let number = |word: &str| word.trim_start_matches('N').bytes().all(|b| b.is_ascii_digit());
            let blocks = text
                .lines()
                .map(|line| line.split_whitespace().skip_while(|w| number(w)).collect::<Vec<_>>().join(" "));
            blocks.filter(|b| b.contains('X') && b.contains('Y') && !b.contains(';') && !b.starts_with('(')).collect()
        };
        let of_each = ["1-mill", "2-finer"].map(|of| words(&read(&job, &format!("out/program-top-{of}.{ending}"))));
        assert!(of_each.iter().all(|words| words.len() > 10), "{dialect}");
        assert_eq!(words(&text), of_each.concat(), "{dialect}");
        let again = verified(&job, &format!("out/program.{ending}"));
        assert_eq!(again.code, 0, "{dialect}: {}{}", again.printed, again.errors);
        assert!(again.prints(&["top 1 mill"]) && again.prints(&["top 2 finer"]), "{dialect}: {}", again.printed);
        assert_faults_are_found(&job, dialect, ending, &text);
    }
}

/// Asserts that a check that compares with the length of the other tool, and an end of the program
/// before the change, are found in a program with all tools.
fn assert_faults_are_found(job: &JobFolder, dialect: &str, ending: &str, text: &str) {
    let length = |tool: &str| {
        let mm = job.json(tool)["gauge_length_mm"].as_f64().expect("a length");
        format!("{mm:.3}")
    };
    let (own, others) = (length("finer.json"), length("tool.json"));
    let lines: Vec<&str> = text.lines().collect();
    let is_comment = |line: &str| line.contains("(TOOL LENGTH") || line.contains("; TOOL LENGTH");
    // The check of the second tool compares with the length of the first.
    let check = lines.iter().position(|line| line.contains(&own) && !is_comment(line)).expect("a check");
    let mut changed: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    changed[check] = changed[check].replace(&own, &others);
    job.write(&format!("changed.{ending}"), (changed.join("\n") + "\n").as_bytes());
    let result = verified(job, &format!("changed.{ending}"));
    let found = result.prints(&["tool length", &others]);
    assert!(result.code == 1 && found, "{dialect}: {}{}", result.printed, result.errors);
    // An end of the program before the change: nothing behind it is run.
    let home = lines[..check].iter().rposition(|line| line.ends_with("M5")).expect("spindle off");
    let end = if dialect == "linuxcnc" { "M2" } else { "M30" };
    let mut changed: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    changed[home] = changed[home].replace("M5", end);
    job.write(&format!("changed.{ending}"), (changed.join("\n") + "\n").as_bytes());
    let result = verified(job, &format!("changed.{ending}"));
    assert!(result.code == 1, "{dialect}: {}{}", result.printed, result.errors);
    assert!(result.prints(&["a tool change follows"]), "{dialect}: {}", result.printed);
}

#[test]
fn the_first_tool_comes_again_and_each_clamping_has_its_program() {
    let job = two_tools("heidenhain");
    let mut file = job.json("job.json");
    let operation = |name: &str, setup: &str, tool: &str| {
        let mut operation = file["operations"][0].clone();
        (operation["name"], operation["setup"], operation["tool"]) = (json!(name), json!(setup), json!(tool));
        operation
    };
    let operations = json!([
        operation("a", "top", "mill"),
        operation("b", "top", "finer"),
        operation("c", "top", "mill"),
        operation("d", "again", "mill"),
        operation("e", "again", "finer"),
    ]);
    // A face that looks down, below the patch.
    job.write("face.obj", FACE.as_bytes());
    let datum = json!({ "file": "face.obj", "role": "datum", "unit": "millimetre", "up_axis": "z" });
    file["setups"][0]["meshes"].as_array_mut().expect("meshes").push(datum);
    let mut second = file["setups"][0].clone();
    second["name"] = json!("again");
    file["setups"].as_array_mut().expect("setups").push(second);
    file["operations"] = operations;
    job.write("job.json", file.to_string().as_bytes());
    job.set("machine.json", &[("/tool_change_s", json!(12.5))]);
    let out = job.path("out");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    for (name, setup, calls) in [("program-top.h", "top", vec![1, 7, 1]), ("program-again.h", "again", vec![1, 7])] {
        let text = read(&job, &format!("out/{name}"));
        let called = text.lines().filter_map(|line| line.split("TOOL CALL ").nth(1)?.split(' ').next()?.parse().ok());
        assert_eq!(called.collect::<Vec<u32>>(), calls, "{name}");
        // Begin and end have one name.
        let names: Vec<&str> = text.lines().filter_map(|line| line.split(" PGM ").nth(1)).collect();
        assert!(names.len() == 2 && names[0] == names[1], "{names:?}");
        let words: [OsString; 6] =
            ["verify".into(), out.join(name).into(), "--job".into(), job.job().into(), "--setup".into(), setup.into()];
        let output = run(&words);
        assert_eq!(code_and_errors(&output).0, 0, "{}", String::from_utf8_lossy(&output.stdout));
    }
    assert_handed_on(&job);
    assert_job_report(&job, &planned);
    assert_described(&job);
    // A batch has a task for each tool of each setup.
    let batch = json!({ "format": "facemill-batch/1", "jobs": { "list": ["job.json"] } });
    job.write("batch.json", batch.to_string().as_bytes());
    let tasks = facemill_in(&job, "batch expand batch.json");
    assert_eq!((tasks.code, tasks.printed.lines().count()), (0, 5), "{}{}", tasks.printed, tasks.errors);
    // The next plan leaves none of these programs behind as if it were current.
    job.set("job.json", &[("/post/template", json!("own.j2"))]);
    let template =
        std::fs::read_to_string(workspace().join("crates/nc-program/templates/heidenhain.j2")).expect("a template");
    job.write("own.j2", template.replace("section.number", "1").as_bytes());
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
    assert!(planned.code == 0 && planned.prints(&["not written", "LBL 99"]), "{}{}", planned.printed, planned.errors);
    assert!(!out.join("program-top.h").exists() && !out.join("program-again.h").exists());
}

/// Asserts that the second clamping begins with the stock of the first one, and that the program of
/// all tools of the first is to it as those of each.
fn assert_handed_on(job: &JobFolder) {
    let verify = |words: &str| verify_in(job, words);
    let first = verify("@out/program-top.h --setup top --stock-cell-mm 1 --rest-out @top.rest");
    assert_eq!(first.code, 0, "{}{}", first.printed, first.errors);
    let second =
        "@out/program-again.h --setup again --rest @top.rest --deviation-tolerance-mm 0.1 --stock-tolerance-mm 0.002";
    let all = verify(&format!("{second} --after top=@out/program-top.h -o @all.json"));
    assert_eq!(all.code, 0, "{}{}", all.printed, all.errors);
    let each = ["1-mill", "2-finer", "3-mill"].map(|of| format!("--after {}=@out/program-top-{of}.h", &of[..1]));
    let each = verify(&format!("{second} {} -o @each.json", each.join(" ")));
    assert_eq!(each.code, 0, "{}{}", each.printed, each.errors);
    assert_eq!(read(job, "all.json").replace("all.json", "each.json"), read(job, "each.json"));
    // Without it less is known.
    let none = verify(&format!("{second} -o @none.json"));
    assert!(none.code == 0 && read(job, "none.json") != read(job, "each.json"), "{}{}", none.printed, none.errors);
    // The last tool alone, without the programs before it, has not cut what they did.
    let alone = "@out/program-again-2-finer.h --setup 5 --rest @top.rest --deviation-tolerance-mm 0.1";
    let done = verify(&format!("{alone} --stock-tolerance-mm 0.002 -o @alone.json"));
    assert_eq!(done.code, 0, "{}{}", done.printed, done.errors);
    let [parts, alone] = ["all.json", "alone.json"].map(|name| job.json(name));
    let area = |of: &Value, kind: &str| of["deviation"]["part"]["area_mm2"][kind].as_f64().expect("an area");
    let not_reached = [&parts[1], &alone].map(|of| area(of, "not_reached"));
    assert!(not_reached[0] + 1.0 < not_reached[1] && area(&parts[1], "gouged") == 0.0, "{not_reached:?}");
    // A tool too many, and a program that is not there.
    let wrong = verify(&format!("{second} --after again=@out/program-top.h"));
    assert!(wrong.is_refused_for(&["program-top.h", "tool change 3 calls T1"]), "{}", wrong.errors);
    let absent = verify(&format!("{second} --after top=@out/none.h"));
    assert!(absent.is_refused_for(&["none.h"]), "{}", absent.errors);
}

/// A face 20 mm by 10 mm that looks down, at x from 0 on.
const FACE: &str = "v 0 -5 -12\nv 20 -5 -12\nv 20 5 -12\nv 0 5 -12\nf 1 4 3\nf 1 3 2\n";

#[test]
fn a_datum_is_finished_and_not_cut() {
    let job = two_tools("fanuc");
    job.write("face.obj", FACE.as_bytes());
    let mut file = job.json("job.json");
    let patch = file["setups"][0]["meshes"][0].clone();
    let refused = |datum: &Value, stock: Option<Value>, words: &[&str]| {
        let mut file = file.clone();
        file["setups"][0]["meshes"].as_array_mut().expect("meshes").push(datum.clone());
        if let Some(stock) = stock {
            file["setups"][0]["stock"] = stock;
        }
        job.write("job.json", file.to_string().as_bytes());
        let checked = facemill_in(&job, "check job.json");
        let is_named = words.iter().all(|word| checked.errors.contains(word));
        assert!(checked.code == 2 && is_named, "{words:?}: {}{}", checked.printed, checked.errors);
    };
    let face = json!({ "file": "face.obj", "role": "datum", "unit": "millimetre", "up_axis": "z" });
    let mut thick = face.clone();
    thick["allowance_mm"] = json!(0.5);
    refused(&thick, None, &["meshes[1].allowance_mm", "a datum is finished"]);
    let mut both = patch;
    both["role"] = json!("datum");
    refused(&both, None, &["meshes[1].groups", "is a drive surface, too"]);
    let stock = json!({ "box": { "min_mm": [-60.0, -60.0, -20.0], "max_mm": [60.0, 60.0, 6.0] } });
    refused(&face, Some(stock), &["setups[0].meshes[1]", "there is stock on the datum at (", "-12.0)"]);
    // On the lower face of the block there is none.
    let stock = json!({ "box": { "min_mm": [-60.0, -60.0, -12.0], "max_mm": [60.0, 60.0, 6.0] } });
    file["setups"][0]["meshes"].as_array_mut().expect("meshes").push(face);
    file["setups"][0]["stock"] = stock;
    job.write("job.json", file.to_string().as_bytes());
    let checked = facemill_in(&job, "check job.json");
    assert_eq!(checked.code, 0, "{}{}", checked.printed, checked.errors);
}

/// Asserts that `check` has a line for each operation of the five programs, and says once what
/// holds for several.
fn assert_described(job: &JobFolder) {
    let checked = facemill_in(job, "check job.json");
    assert_eq!(checked.code, 0, "{}", checked.errors);
    let lines: Vec<&str> = checked.printed.lines().map(str::trim).collect();
    let count = |begin: &str| lines.iter().filter(|line| line.starts_with(begin)).count();
    assert_eq!([count("tool T1"), count("tool T7"), count("the part is")], [1, 1, 1], "{}", checked.printed);
    assert_eq!([count("clamping \"top\""), count("clamping \"again\"")], [1, 1], "{}", checked.printed);
    for (tool, name, is_first) in
        [("T1", "a", true), ("T7", "b", false), ("T1", "c", false), ("T1", "d", true), ("T7", "e", false)]
    {
        let on = if is_first { "" } else { ", on what is left" };
        assert_eq!(count(&format!("{tool}{on}: \"{name}\", ")), 1, "{}", checked.printed);
    }
}

/// Asserts that the report on a planned job says of its five programs what their reports say.
fn assert_job_report(job: &JobFolder, planned: &CommandOutput) {
    let of_job: Value = serde_json::from_str(&read(job, "out/job-report.json")).expect("JSON");
    check("job-report", "a report on a job", &of_job);
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let number = |value: &Value| value.as_f64().expect("a number");
    let sum = |all: &[Value], key: &str| all.iter().map(|of| number(&of[key])).sum::<f64>();
    let is = |a: f64, b: f64| assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} in place of {b}: {of_job}");
    let clampings = list(&of_job["clampings"]);
    for (clamping, changes) in clampings.iter().zip([2.0, 1.0]) {
        let programs = list(&clamping["programs"]);
        is(number(&clamping["time_s"]), sum(&programs, "time_s") + changes * 12.5);
        for program in &programs {
            let own = read(job, &format!("out/{}", program["report"].as_str().expect("a name")));
            let own: Value = serde_json::from_str(&own).expect("JSON");
            is(number(&program["time_s"]), number(&own["times"]["cutting_s"]) + number(&own["times"]["rapid_s"]));
            is(number(&program["removed_mm3"]), number(&own["stock"]["cut"]["removed_mm3"]));
            assert_eq!(
                (&program["programs"][0], &program["blake3"]),
                (&own["programs"][0]["file"], &own["programs"][0]["blake3"])
            );
            assert_eq!(program["operations"], own["operations"]);
        }
        // Each change is at the line of the program with all tools.
        let joined = read(job, &format!("out/{}", clamping["joined_program"].as_str().expect("a name")));
        for program in &programs {
            let line = program["line_in_joined"].as_u64().expect("a line") as usize;
            let call = format!("TOOL CALL {}", program["tool_number"]);
            assert!(joined.lines().nth(line - 1).is_some_and(|l| l.contains(&call)), "{program}");
        }
    }
    is(number(&of_job["total_time_s"]), sum(&clampings, "time_s"));
    assert_eq!((&of_job["tool_changes"], &of_job["tool_change_s"]), (&json!(3), &json!(12.5)));
    let placed = |k: usize| &clampings[k]["placement"];
    assert_eq!((&placed(0)["moved_by"], &placed(1)["compared_with"]), (&Value::Null, &json!("top")));
    for clamping in &clampings {
        let datums = list(&clamping["datums"]);
        let [datum] = &datums[..] else { panic!("{datums:?}") };
        let on_table: f64 = number(&clamping["placement"]["table_from_work"]["translation_mm"][2]);
        assert_eq!((&datum["shape"], &datum["direction"]), (&json!("plane"), &json!([0.0, 0.0, -1.0])));
        is(number(&datum["place_mm"][2]), on_table - 12.0);
        is(number(&datum["place_mm"][0]), 10.0);
        assert_eq!((&datum["in_first"], &datum["radius_mm"]), (&json!(true), &Value::Null));
    }
    assert_eq!(clampings[1]["stock"].as_str().map(|s| s.contains("the rest of setup \"top 3 mill\"")), Some(true));
    assert!(planned.prints(&["5 program(s) in 2 clamping(s)", "3 tool change(s) of 12.5 s"]), "{}", planned.printed);
}

#[test]
fn faults_of_a_tool_change_are_found_at_their_blocks() {
    let job = two_tools("fanuc");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    let text = read(&job, "out/program.nc");
    let lines: Vec<&str> = text.lines().collect();
    let change = lines.iter().position(|line| line.ends_with("T7 M6")).expect("a tool change");
    let line_of =
        |begin: usize, what: &str| begin + lines[begin..].iter().position(|l| l.contains(what)).expect("a line");
    let with = |change: &dyn Fn(&mut Vec<String>)| {
        let mut changed: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        change(&mut changed);
        job.write("changed.nc", (changed.join("\n") + "\n").as_bytes());
        verified(&job, "changed.nc")
    };
    let found = |result: &CommandOutput, words: &[&str]| {
        assert!(result.code == 1 && result.prints(words), "{words:?}: {}{}", result.printed, result.errors);
    };
    assert_eq!(with(&|_| {}).code, 0);
    let at = |line: usize| (line + 1).to_string();
    // Another tool; the length register of another.
    found(&with(&|l| l[change] = "N900 T9 M6".to_owned()), &[&at(change), "calls another tool than T7"]);
    let compensation = line_of(change, "G43");
    // The tool before again is no change: its successor is missing, and so is its length.
    let before = with(&|l| l[change] = "N900 T1 M6".to_owned());
    found(&before, &[&at(compensation), "H7", "H1"]);
    assert!(before.printed.contains("A TOOL IS MISSING"), "{}", before.printed);
    found(&with(&|l| l[compensation] = l[compensation].replace("H7", "H1")), &[&at(compensation), "H1", "H7"]);
    // No change at all.
    let missing = with(&|l| l[change] = "N900 M5".to_owned());
    assert!(missing.code == 1 && missing.printed.contains("A TOOL IS MISSING"), "{}", missing.printed);
    // A change over the work: without the ways home before it.
    let last_cut = lines[..change].iter().rposition(|l| l.contains("M9")).expect("coolant off");
    let over_work = with(&|l| {
        for line in &mut l[last_cut..change] {
            if line.contains("G28") {
                *line = "N900 M5".to_owned();
            }
        }
    });
    found(&over_work, &["tool change away from the reference position"]);
    // The spindle axis home alone: the next part begins where no one knows.
    let rotary = line_of(last_cut, "G28 B0. C0.");
    let turned = with(&|l| {
        for k in [rotary, line_of(rotary + 1, "G28 B0. C0.")] {
            l[k] = "N900 M5".to_owned();
        }
    });
    found(&turned, &["tool change away from the reference position", "axis B"]);

    // A template of one's own that begins and ends each part as a program.
    let template =
        std::fs::read_to_string(workspace().join("crates/nc-program/templates/fanuc.j2")).expect("a template");
    let template =
        template.replace("section.first", "true").replace("section.last", "true").replace("section.number", "1");
    job.write("own.j2", template.as_bytes());
    job.set("job.json", &[("/post/template", json!("own.j2"))]);
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("own").display()));
    assert!(
        planned.code == 0 && planned.prints(&["one program", "not written", "section.first"]),
        "{}",
        planned.printed
    );
    assert!(!job.path("own/program.nc").exists());
}

/// Length of the second mill's neck as planned, and with a holder that is too long, mm.
const NECKS: [f64; 2] = [22.0, 4.0];

/// Writes the second tool with a neck of a length and a holder of a diameter below its arbor; the
/// whole of it is always as long.
fn write_finer(job: &JobFolder, neck: f64, holder: f64) {
    let flute = job.json("finer.json")["flute_length_mm"].as_f64().expect("a length");
    let [low, high] = [60.0 + NECKS[0] - neck, 40.0];
    let section = |length: f64, diameter: f64| json!({ "length_mm": length, "diameter_low_mm": diameter, "diameter_high_mm": diameter });
    job.set(
        "finer.json",
        &[
            ("/stick_out_mm", json!(flute + neck)),
            ("/gauge_length_mm", json!(flute + neck + low + high)),
            ("/body/sections", json!([section(neck, 6.0)])),
            ("/holder/sections", json!([section(low, holder), section(high, 60.0)])),
        ],
    );
}

/// Returns the first and last lines of findings whose text has some words, by the table that
/// `verify` prints: a line, or a line and the lines around it as in `180 (167-198, 2 times)`.
pub(crate) fn lines_of_findings(printed: &str, words: &str) -> Vec<[usize; 2]> {
    let of = |row: &str| {
        let place = row.trim_start().split("  ").next().unwrap_or("");
        let numbers: Vec<usize> =
            place.split(|c: char| !c.is_ascii_digit()).filter_map(|number| number.parse().ok()).collect();
        match *numbers {
            [line] => Some([line; 2]),
            [_, from, to, ..] => Some([from, to]),
            _ => None,
        }
    };
    let table = printed.lines().skip_while(|line| !line.trim_start().starts_with("line  "));
    let is_row = |row: &&str| row.trim_start().starts_with(|c: char| c.is_ascii_digit());
    table.filter(is_row).filter(|row| row.contains(words)).filter_map(of).collect()
}

#[test]
fn a_holder_of_the_second_tool_that_is_too_long_is_found_at_its_blocks() {
    let job = two_tools("fanuc");
    write_finer(&job, NECKS[0], 30.0);
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    assert_eq!(verified(&job, "out/program.nc").code, 0);

    // The same with a holder that is as long, and no thicker than the neck.
    write_finer(&job, NECKS[1], 6.0);
    let twin = verified(&job, "out/program.nc");
    assert_eq!(twin.code, 0, "{}{}", twin.printed, twin.errors);

    write_finer(&job, NECKS[1], 30.0);
    let faulty = verified(&job, "out/program.nc");
    let found = lines_of_findings(&faulty.printed, "holder section");
    assert!(faulty.code == 1 && !found.is_empty(), "{}{}", faulty.printed, faulty.errors);
    let text = read(&job, "out/program.nc");
    let lines: Vec<&str> = text.lines().collect();
    let change = lines.iter().position(|line| line.ends_with("T7 M6")).expect("a tool change") + 1;
    assert!(found.iter().all(|[first, _]| *first > change), "{found:?} with a change in line {change}");

    // The block in which the holder first comes too near, by distances of its own, in the program
    // of this tool: the same block is in the whole program behind the change.
    let own = two_tools("fanuc");
    own.write("tool.json", read(&job, "finer.json").as_bytes());
    let (back, of_tool) = (ReadBack::of(&own, 0), read(&job, "out/program-top-2-finer.nc"));
    let motions = interpreter::run(&of_tool);
    let is_met = |motion: &&Motion| back.places(motion, 0.2).iter().any(|place| back.room(place, 0.1) < -0.05);
    let first = motions.iter().find(is_met).expect("a block with the holder in the stock").line;
    let words = |line: &str| line.split_once(' ').map_or("", |(_, words)| words).to_owned();
    let block = words(of_tool.lines().nth(first - 1).expect("a line"));
    let at = change + 1 + lines[change..].iter().position(|line| words(line) == block).expect("the block");
    assert!(found.iter().any(|[from, to]| (*from..=*to).contains(&at)), "line {at} ({block}) is in none of {found:?}");
}

#[test]
fn a_setup_is_never_seen_with_the_tool_of_another() {
    let folder = both_mills();
    let job = Job::read(&folder.job()).expect("a job");
    assert_eq!([0, 1].map(|k| job.for_setup(k).tool.number()), [1, 2]);
    assert_eq!(job.tool.number(), 1);
    // A view of a setup keeps a tool that is put in the place of its own.
    let view = job.for_setup(1);
    let other = Job { tool: job.tool.clone(), ..view };
    assert_eq!(other.for_setup(1).tool.number(), 1);
    let setup = Setup::read(&job, 1).expect("a setup");
    assert!(Scene::new(&job.for_setup(1), &setup, 1).is_ok());
    for wrong in [&job, &job.for_setup(0)] {
        let why = Scene::new(wrong, &setup, 1).err().expect("an error").to_string();
        assert!(why.contains("the tool of setup 2 was not chosen"), "{why}");
    }
}

#[test]
fn wrong_tools_of_a_job_are_refused_by_name() {
    let job = blink_patch();
    let mut file = job.json("job.json");
    file.as_object_mut().expect("an object").remove("tool");
    file["tools"] = json!({ "a": "tool.json", "b": "other.json" });
    file["operations"][0]["tool"] = json!("b");
    job.write("job.json", file.to_string().as_bytes());
    let check = || facemill_in(&job, "check job.json");
    assert!(check().is_refused_for(&["other.json"]), "{}", check().errors);
    job.write("other.json", job.json("tool.json").to_string().as_bytes());
    assert!(check().is_refused_for(&["tools", "\"a\" and \"b\"", "number 1"]), "{}", check().errors);
    let mut other = job.json("tool.json");
    other["number"] = json!(5);
    job.write("other.json", other.to_string().as_bytes());
    assert!(check().code == 0 && check().prints(&["tool T5"]), "{}", check().errors);
    other["length_register"] = json!(1);
    job.write("other.json", other.to_string().as_bytes());
    assert!(check().is_refused_for(&["\"a\" and \"b\"", "length_register 1"]), "{}", check().errors);
    job.set("other.json", &[("/length_register", json!(5))]);
    job.set("job.json", &[("/operations/0/tool", json!("c"))]);
    assert!(check().is_refused_for(&["operations[0].tool", "there is no tool \"c\"", "a, b"]), "{}", check().errors);

    // Nothing is before the first program.
    let region = json!({ "left_above": { "height_mm": 0.1, "overlap_mm": 1.0, "of": "operations_before" } });
    job.set("job.json", &[("/operations/0/tool", json!("a")), ("/operations/0/path/strategy/region", region)]);
    let planned = facemill_in(&job, &format!("plan job.json --out {}", job.path("out").display()));
    assert!(planned.is_refused_for(&["operations_before", "its program is the first one"]), "{}", planned.errors);
}
