//! Files that a plan writes beside its programs: tool and offset tables, main programs with
//! subprograms, the APT file of all tools. Each is read back by readers of the tests, or by the
//! commands.

use std::collections::BTreeMap;
use std::path::Path;

use facemill::Job;
use facemill::nc_program::read::{AxisAt, MotionKind};
use facemill::nc_program::{Dialect, read_program};
use facemill::setup_programs::control_tables;
use facemill_test_kit::{linuxcnc_interpreter, run_linuxcnc};
use facemill_tests::calls::with_a_call;
use facemill_tests::commands::facemill_in;
use facemill_tests::golden::{CONTROLS, two_heads};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::straight_words::{assert_same_words, straight_words};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::blink_patch;
use serde_json::{Value, json};

use crate::strategies::several_tools::{two_tools, verified};

/// Work offset of the job: no value is that of another axis, and none is 0.
const OFFSET: [(&str, f64); 5] = [("X", 12.5), ("Y", -31.25), ("Z", 140.125), ("B", 0.5), ("C", -7.25)];

/// Two tools of which one has a length register of its own, with a work offset, for a control.
fn job_of(dialect: &str, values: &[(&str, Value)]) -> JobFolder {
    let job = two_tools(dialect);
    let [x, y, z, b, c] = OFFSET.map(|(letter, value)| (letter.to_owned(), json!(value)));
    let of = |all: &[(String, Value)]| Value::Object(all.iter().cloned().collect());
    job.set(
        "job.json",
        &[(
            "/setups/0/work_offset",
            json!({ "register": "G55", "linear_mm": of(&[x, y, z]), "rotary_deg": of(&[b, c]) }),
        )],
    );
    job.set("job.json", values);
    job
}

/// Plans the job; names of the files that it wrote.
fn planned(job: &JobFolder) -> Vec<String> {
    let result = facemill_in(job, &format!("plan job.json --no-html --json --out {}", job.path("out").display()));
    assert_eq!(result.code, 0, "{}{}", result.printed, result.errors);
    let summary: Value = serde_json::from_str(&result.printed).expect("JSON");
    let files = summary["files"].as_array().expect("files");
    files.iter().map(|file| file.as_str().expect("a name").to_owned()).collect()
}

fn text_of(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or_else(|_| panic!("{text} is no number"))
}

/// Number of a word with this begin in a line of words apart by blanks.
fn word(line: &str, begin: &str) -> f64 {
    let found = line.split_whitespace().find_map(|word| word.strip_prefix(begin)?.parse().ok());
    found.unwrap_or_else(|| panic!("{begin} in {line}"))
}

/// Rows of a table of Heidenhain: cells by the columns that its head names.
fn rows(table: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = table.lines();
    assert!(lines.next().is_some_and(|begin| begin.starts_with("BEGIN ") && begin.ends_with(" MM")), "{table}");
    let head = lines.next().expect("columns");
    let starts: Vec<usize> =
        (0..head.len()).filter(|&k| head.as_bytes()[k] != b' ' && (k == 0 || head.as_bytes()[k - 1] == b' ')).collect();
    let cells = |line: &str| {
        let cell = |(k, &from): (usize, &usize)| {
            let to = starts.get(k + 1).copied().unwrap_or(line.len()).min(line.len());
            let of = |text: &str| {
                text.get(from.min(text.len())..to.max(from).min(text.len())).unwrap_or("").trim().to_owned()
            };
            let name = head[from..].split_whitespace().next().expect("a name").to_owned();
            (name, of(line))
        };
        starts.iter().enumerate().map(cell).collect()
    };
    lines.take_while(|line| *line != "[END]").map(cells).collect()
}

/// Lengths by the register that the program takes them from, and machine values of the offset.
fn read_tables(dialect: &str, tools: &str, offset: &str) -> (BTreeMap<u32, f64>, BTreeMap<String, f64>) {
    let words_of = |line: &str| -> BTreeMap<String, f64> {
        OFFSET.iter().map(|(letter, _)| ((*letter).to_owned(), word(line, letter))).collect()
    };
    let g10 = |text: &str, begin: &str| -> Vec<String> {
        text.lines().filter(|line| line.starts_with(begin)).map(str::to_owned).collect()
    };
    match dialect {
        "fanuc" | "haas" | "mazak" => {
            for text in [tools, offset] {
                assert!(
                    text.starts_with("%\nO") && text.ends_with("M30\n%\n") && text.contains("\nG21 G90\n"),
                    "{text}"
                );
                let dialect = Dialect::ALL.into_iter().find(|d| d.name() == dialect).expect("a control");
                read_program(text, dialect).expect("a program of the control");
            }
            let wear = g10(tools, "G10 L11 ");
            assert!(wear.iter().all(|line| word(line, "R") == 0.0) && wear.len() == 2, "{tools}");
            let lengths = g10(tools, "G10 L10 ").iter().map(|line| (word(line, "P") as u32, word(line, "R"))).collect();
            let [line] = g10(offset, "G10 L2 P2 ").try_into().expect("one line");
            (lengths, words_of(&line))
        }
        "linuxcnc" => {
            let lengths = tools.lines().map(|line| (word(line, "T") as u32, word(line, "Z"))).collect();
            let [line] = g10(offset, "G10 L2 P2 ").try_into().expect("one line");
            (lengths, words_of(&line))
        }
        "siemens_840d" => {
            let value =
                |line: &str| Some((line.strip_prefix("$TC_DP3[")?.split_once(",1]=")?.0.to_owned(), line.to_owned()));
            let lengths = tools.lines().filter_map(value);
            let lengths = lengths.map(|(tool, line)| {
                (tool.parse().expect("a number"), number(line.split_once('=').expect("a value").1))
            });
            let frame = offset.lines().find_map(|line| line.strip_prefix("$P_UIFR[2]=CTRANS(")?.strip_suffix(')'));
            let parts: Vec<&str> = frame.expect("a frame").split(',').collect();
            (lengths.collect(), parts.chunks(2).map(|pair| (pair[0].to_owned(), number(pair[1]))).collect())
        }
        _ => {
            let lengths = rows(tools).iter().map(|row| (number(&row["T"]) as u32, number(&row["L"]))).collect();
            let [row] = rows(offset).try_into().expect("one row");
            assert_eq!((row["NO"].as_str(), row["SPA"].as_str()), ("2", "0."));
            let axis = |letter: &str| {
                let name = if "XYZ".contains(letter) { letter.to_owned() } else { format!("{letter}_OFFS") };
                (letter.to_owned(), number(&row[&name]))
            };
            (lengths, OFFSET.iter().map(|(letter, _)| axis(letter)).collect())
        }
    }
}

/// Names of tool table and work offset.
fn table_names(dialect: &str, ending: &str) -> [String; 2] {
    let [tools, offset] = match dialect {
        "linuxcnc" => ["tbl", "ngc"],
        "siemens_840d" => ["spf", "spf"],
        "heidenhain" => ["t", "pr"],
        _ => [ending, ending],
    };
    [format!("tool-table.{tools}"), format!("work-offset.{offset}")]
}

#[test]
fn tables_have_the_values_that_programs_rely_on() {
    for (dialect, ending) in CONTROLS {
        let job = job_of(dialect, &[("/post/tables", json!(true))]);
        let haas_register = if dialect == "haas" { 199 } else { 99 };
        // On 840D and Heidenhain the tool's number is the register.
        let has_registers = !matches!(dialect, "siemens_840d" | "heidenhain");
        if has_registers {
            job.set("finer.json", &[("/length_register", json!(haas_register))]);
        }
        let read = Job::read(&job.job()).unwrap_or_else(|e| panic!("{dialect}: {e}"));
        let [tables] = control_tables(&read).expect("tables").try_into().expect("one clamping");
        let names = tables.files.each_ref().map(|(name, _)| name.clone());
        assert_eq!(names, table_names(dialect, ending));
        let [tools, offset] = tables.files.map(|(_, text)| String::from_utf8(text).expect("text"));
        let (lengths, values) = read_tables(dialect, &tools, &offset);
        for (file, register) in [("tool.json", 1), ("finer.json", if has_registers { haas_register } else { 7 })] {
            let length = job.json(file)["gauge_length_mm"].as_f64().expect("a length");
            assert!((lengths[&register] - length).abs() < 1e-3, "{dialect}: {lengths:?}");
        }
        assert_eq!(values, OFFSET.iter().map(|(l, v)| ((*l).to_owned(), *v)).collect(), "{dialect}: {offset}");
    }
}

/// A plan writes what its program relies on: the lengths that it checks, and the offset of
/// its header. The interpreter of LinuxCNC takes all three files.
#[test]
fn a_program_runs_with_the_tables_beside_it() {
    let job = job_of("linuxcnc", &[("/post/tables", json!(true))]);
    let files = planned(&job);
    let names = table_names("linuxcnc", "ngc");
    assert!(names.iter().all(|name| files.contains(name)), "{files:?}");
    let [tools, offset] = names.map(|name| text_of(&job, &format!("out/{name}")));
    let (lengths, values) = read_tables("linuxcnc", &tools, &offset);
    let program = text_of(&job, "out/program.ngc");
    for length in lengths.values() {
        assert!(program.contains(&format!("[ABS[#5403-{length:.3}] GT 0.01]")), "{length}");
    }
    let planned_at = program.lines().find(|line| line.contains("PLANNED AT")).expect("a header");
    assert!(values.iter().all(|(axis, value)| word(planned_at.trim_end_matches(')'), axis) == *value), "{planned_at}");
    linuxcnc_takes_them(&program, &tools, &offset);
}

/// The interpreter of LinuxCNC, where it is installed, runs the program with our tool table, and
/// stops with another length; our offsets are then in its parameters.
fn linuxcnc_takes_them(program: &str, tools: &str, offset: &str) {
    let Some(rs274) = linuxcnc_interpreter() else { return };
    let (is_taken, printed) = run_linuxcnc(&rs274, program, tools, "tables");
    assert!(is_taken && !printed.contains("ABORT"), "{printed}");
    let wrong: String = tools.lines().map(|line| line.replacen("Z1", "Z2", 1) + "\n").collect();
    assert_ne!(wrong, tools);
    let (is_taken, printed) = run_linuxcnc(&rs274, program, &wrong, "tables-wrong");
    assert!(!is_taken || printed.contains("ABORT"), "{printed}");
    // Parameters of G55: X, Y, Z, A, B, C.
    let print = "(DEBUG,AT #5241 #5242 #5243 #5245 #5246)\nM2\n";
    let (is_taken, printed) = run_linuxcnc(&rs274, &offset.replace("M2\n", print), tools, "offsets");
    assert!(is_taken, "{printed}");
    let said = printed.split("AT ").nth(1).expect("a message").split(['"', '\n']).next().expect("a line");
    let values: Vec<f64> = said.trim_end_matches(')').split_whitespace().map(number).collect();
    for ((axis, value), found) in OFFSET.iter().zip(values) {
        // Without a configuration its parameters are in inches.
        let unit = if "XYZ".contains(axis) { 25.4 } else { 1.0 };
        assert!((found * unit - value).abs() < 1e-4, "{axis}: {printed}");
    }
}

#[test]
fn tables_that_a_control_cannot_have_are_refused_before_planning() {
    let job = job_of("fanuc", &[("/post/tables", json!(true))]);
    job.set("finer.json", &[("/assumed", json!([{ "key": "gauge_length_mm", "reason": "not measured" }]))]);
    let out = job.path("out");
    let command = format!("plan job.json --no-html --quiet --out {}", out.display());
    assert!(facemill_in(&job, &command).is_refused_for(&["post.tables", "gauge_length_mm", "tool 7"]));
    let job = job_of("haas", &[("/post/tables", json!(true))]);
    job.set("finer.json", &[("/length_register", json!(201))]);
    assert!(facemill_in(&job, &command).is_refused_for(&["post.tables", "Haas", "200"]));
}

/// Subprograms of every control: the main program is verified as the flat one, and a fault planted
/// in a subprogram is found at its line of the written text.
#[test]
fn main_programs_with_subprograms_are_verified_as_they_are_written() {
    for (dialect, ending) in CONTROLS {
        let has_both = !matches!(dialect, "mazak" | "siemens_840d");
        let place = if has_both && dialect != "linuxcnc" { "program" } else { "files" };
        let asked = json!({ "per": if dialect == "haas" { "operation" } else { "pass" }, "in": place });
        let job = if dialect == "fanuc" { two_tools(dialect) } else { blink_of(dialect) };
        job.set("job.json", &[("/post/subprograms", asked)]);
        let files = planned(&job);
        let main = format!("program-main.{ending}");
        assert!(files.contains(&main), "{dialect}: {files:?}");
        let called = verified(&job, &format!("out/{main}"));
        assert_eq!(called.code, 0, "{dialect}: {}{}", called.printed, called.errors);
        let (head, results) = called.printed.split_once('\n').expect("a line");
        assert!(head.contains("calls expanded"), "{head}");
        if dialect == "fanuc" {
            // Lines are those of the written files; all else is the same.
            let plain = |text: &str| -> String {
                let line = |line: &str| line.split("line ").next().unwrap_or(line).to_owned() + "\n";
                text.lines().map(line).collect()
            };
            assert_eq!(plain(results), plain(&verified(&job, "out/program.nc").printed));
        }
        let is_sub = |name: &&String| name.to_uppercase().starts_with("PASS_") || name.starts_with("O2");
        let subs: Vec<&String> = files.iter().filter(is_sub).collect();
        assert_eq!(subs.is_empty(), place == "program", "{dialect}: {files:?}");
        planted_fault_is_found(&job, dialect, &main, subs.last().copied().unwrap_or(&main));
    }
}

/// A motion as read: its kind, its words and its feed.
type ReadMove = (MotionKind, Vec<(String, f64)>, String);

/// New feeds, links and lengths of a main program with subprograms are those of the flat one, and
/// the new program has the blocks of its subprograms in place of the calls.
#[test]
fn feeds_links_and_lengths_of_called_subprograms_are_those_of_the_flat_program() {
    for (name, place) in [("fanuc", "program"), ("siemens_840d", "files"), ("heidenhain", "program")] {
        let job = blink_of(name);
        job.set("job.json", &[("/post/subprograms", json!({ "per": "pass", "in": place }))]);
        planned(&job);
        let dialect = Dialect::ALL.into_iter().find(|d| d.name() == name).expect("a control");
        let ending = CONTROLS.into_iter().find(|(of, _)| *of == name).expect("a control").1;
        let moves = |file: &str| -> Vec<ReadMove> {
            let program = read_program(text_of(&job, file).as_bytes(), dialect).expect("a program");
            let of = |m: &facemill::nc_program::read::ReadMotion| {
                let word = |(letter, at): (facemill::nc_program::AxisLetter, AxisAt)| match at {
                    AxisAt::Word(word) => Some((letter.to_string(), word)),
                    _ => None,
                };
                (m.kind, m.position.iter().filter_map(word).collect(), format!("{:?}", m.feed))
            };
            program.motions().map(|(_, m)| of(m)).collect()
        };
        let path = |file: &str| job.path(file).display().to_string();
        let mut printed = Vec::new();
        for kind in ["program", "program-main"] {
            let program = path(&format!("out/{kind}.{ending}"));
            let (job_file, out) = (path("job.json"), path(&format!("rapids-{kind}.{ending}")));
            let report = path(&format!("rapids-{kind}.json"));
            let rapids = run(&["rapids", &program, "--job", &job_file, "-o", &out, "--report", &report]);
            assert_eq!(code_and_errors(&rapids).0, 0, "{name} {kind}: {:?}", code_and_errors(&rapids));
            let lengths = path(&format!("lengths-{kind}.json"));
            let found = run(&["lengths", &program, "--job", &job_file, "-o", &lengths]);
            assert_eq!(code_and_errors(&found).0, 0, "{name} {kind}: {:?}", code_and_errors(&found));
            let length = job.json("tool.json")["gauge_length_mm"].to_string();
            let (machine, out) = (path("machine.json"), path(&format!("feeds-{kind}.{ending}")));
            let words = ["feedrate", &program, "--machine", &machine, "--tool-length-mm", &length];
            let feeds = run(&[&words[..], &["--dialect", name, "--tip-feed", "500", "-o", &out]].concat());
            assert_eq!(code_and_errors(&feeds).0, 0, "{name} {kind}: {:?}", code_and_errors(&feeds));
            printed.push([rapids, found, feeds].map(|one| {
                let all = [one.stdout, one.stderr].concat();
                String::from_utf8_lossy(&all).contains("calls expanded")
            }));
        }
        assert_eq!(printed, [[false; 3], [true; 3]], "{name}");
        for new in ["rapids", "feeds"] {
            let [flat, called] = ["program", "program-main"].map(|kind| moves(&format!("{new}-{kind}.{ending}")));
            assert!(flat.len() > 20 && flat == called, "{name} {new}: {} and {} moves", flat.len(), called.len());
            assert_ne!(moves(&format!("out/program.{ending}")), flat, "{name} {new}: nothing was changed");
        }
        let [flat, called] = ["program", "program-main"].map(|kind| job.json(&format!("lengths-{kind}.json")));
        let values = |file: &Value| -> Vec<Value> {
            file["lengths"].as_array().expect("lengths").iter().map(|l| l["length_mm"].clone()).collect()
        };
        assert_eq!(values(&flat), values(&called), "{name}");
        // Lines and texts are those of the written files: each text is in its line.
        for by in called["lengths"].as_array().expect("lengths").iter().filter_map(|l| l.get("forced_by")) {
            let text = by["block_text"].as_str().expect("a text");
            let written = written_line(&job, &called, &by["line"]);
            assert!(written.contains(text), "{name}: `{text}` in `{written}`");
        }
        // Links are those of the flat program: each begins and ends in a line with the same words.
        let [of_flat, rapids] = ["program", "program-main"].map(|kind| job.json(&format!("rapids-{kind}.json")));
        let ends = |report: &Value| -> Vec<String> {
            let links = report["links"].as_array().expect("links").iter();
            let lines = links.flat_map(|link| link["lines"].as_array().expect("lines"));
            lines.map(|line| without_number(&written_line(&job, report, line))).collect()
        };
        assert!(ends(&of_flat).len() >= 2 && ends(&of_flat) == ends(&rapids), "{name}: {:?}", ends(&rapids));
        for file in [&called, &rapids] {
            assert_eq!(file["program"]["file"], json!(format!("program-main.{ending}")), "{name}");
            assert_eq!(file["called_files"] == json!([]), place == "program", "{name}");
        }
        for planted in ["F0", "Q"] {
            feed_fault_is_found(&job, name, planted);
        }
    }
}

/// Words of a line, without its number.
fn without_number(line: &str) -> String {
    let is_number = |word: &str| word.trim_start_matches('N').parse::<u32>().is_ok();
    let words: Vec<&str> = line.split_whitespace().collect();
    words[usize::from(words.first().is_some_and(|first| is_number(first)))..].join(" ")
}

/// Line of the written files that a report counts: those of called files behind the program's.
fn written_line(job: &JobFolder, report: &Value, line: &Value) -> String {
    let line = line.as_u64().expect("a line");
    let called = report["called_files"].as_array().into_iter().flatten();
    let called = called.map(|file| (file["first_line"].as_u64().expect("a line"), &file["file"]));
    let files = std::iter::once((1, &report["program"]["file"])).chain(called);
    let (first, file) = files.take_while(|(first, _)| *first <= line).last().expect("a file");
    let text = text_of(job, &format!("out/{}", file.as_str().expect("a name")));
    text.lines().nth((line - first) as usize).unwrap_or_else(|| panic!("line {line} in {file}")).to_owned()
}

/// Plants a word that new feeds refuse in the last cut of the last subprogram: `feedrate` names its
/// file and its line there, and shows the line as it is written.
fn feed_fault_is_found(job: &JobFolder, dialect: &str, planted: &str) {
    let ending = CONTROLS.into_iter().find(|(of, _)| *of == dialect).expect("a control").1;
    let main = format!("program-main.{ending}");
    let entries = std::fs::read_dir(job.path("out")).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("text"));
    let file = names.filter(|name| name.starts_with("PASS_")).max().unwrap_or_else(|| main.clone());
    let path = format!("out/{file}");
    let text = text_of(job, &path);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let end = lines.iter().rposition(|line| ["M99", "RET", "LBL 0"].iter().any(|end| line.contains(end)));
    let is_cut = |line: &String| line.contains(" F") && !line.contains("FMAX");
    let at = lines[..end.expect("an end")].iter().rposition(is_cut).expect("a cut");
    let words = lines[at].split(' ').map(|word| if word.starts_with('F') { planted } else { word });
    lines[at] = words.collect::<Vec<_>>().join(" ");
    job.write(&path, (lines.join("\n") + "\n").as_bytes());
    let length = job.json("tool.json")["gauge_length_mm"].to_string();
    let of = |name: &str| job.path(name).display().to_string();
    let (program, machine, new) = (of(&format!("out/{main}")), of("machine.json"), of("new"));
    let words = ["feedrate", &program, "--machine", &machine, "--tool-length-mm", &length];
    let (code, errors) =
        code_and_errors(&run(&[&words[..], &["--dialect", dialect, "--tip-feed", "keep", "-o", &new]].concat()));
    let place = format!("{file}: line {}", at + 1);
    let shown = if planted == "F0" { lines[at].as_str() } else { "" };
    let is_named = errors.contains(&place) && errors.contains(shown);
    assert!(code == 2 && is_named, "{dialect} {planted}, {place}: {code}: {errors}");
    job.write(&path, text.as_bytes());
}

/// The patch that is planned in a blink, for a control.
fn blink_of(dialect: &str) -> JobFolder {
    let job = blink_patch();
    let mode = if dialect == "linuxcnc" { "g93" } else { "g94" };
    job.set("job.json", &[("/post/dialect", json!(dialect)), ("/post/feed_mode", json!(mode))]);
    job
}

#[test]
fn subprograms_that_a_control_has_not_are_refused() {
    for dialect in ["mazak", "siemens_840d"] {
        let job = blink_of(dialect);
        job.set("job.json", &[("/post/subprograms", json!({ "per": "pass", "in": "program" }))]);
        let result = facemill_in(&job, "check job.json");
        assert!(result.is_refused_for(&["post.subprograms.in", "files"]), "{dialect}: {}", result.errors);
    }
    // Numbers of the job's own programs.
    let job = blink_of("fanuc");
    job.set("job.json", &[("/post/subprograms", json!({ "per": "pass", "in": "files", "first_number": 1001 }))]);
    let result = facemill_in(&job, &format!("plan job.json --no-html --quiet --out {}", job.path("out").display()));
    assert!(result.is_refused_for(&["post.subprograms", "1001 to", "first_number"]), "{}", result.errors);
}

/// A program without a time by the law of motion names the line that has none: in a subprogram with
/// its file.
#[test]
fn a_line_of_a_subprogram_without_a_time_is_named_with_its_file() {
    let job = blink_of("fanuc");
    planned(&job);
    let [main, sub] = with_a_call(&text_of(&job, "out/program.nc"));
    job.write("main.nc", main.as_bytes());
    let mut lines: Vec<&str> = sub.lines().collect();
    lines.insert(4, "G2 X0. Y0. R900.");
    job.write("O2999.nc", (lines.join("\n") + "\n").as_bytes());
    let result = facemill_in(&job, "verify ./main.nc --job job.json -o ./found.json");
    let why = "unknown within acceleration: O2999.nc: line 5 is not a straight move";
    assert!(result.printed.contains(&format!("least times       {why}")), "{}{}", result.printed, result.errors);
    let reasons = job.json("found.json")["times"]["no_law_because"].clone();
    assert!(reasons[0].as_str().is_some_and(|reason| reason.starts_with(why)), "{reasons}");
}

/// Plants a cut into the part in the last subprogram, and asserts that it is found at its line.
fn planted_fault_is_found(job: &JobFolder, dialect: &str, main: &str, sub: &str) {
    let path = format!("out/{sub}");
    let text = text_of(job, &path);
    let end = match dialect {
        "linuxcnc" => "ENDSUB",
        "siemens_840d" => "RET",
        "heidenhain" if sub == main => "LBL 0",
        "heidenhain" => "END PGM",
        _ => "M99",
    };
    let lines: Vec<&str> = text.lines().collect();
    let end = lines.iter().rposition(|line| line.contains(end)).expect("an end");
    let is_cut = |line: &&str| line.contains('Z') && line.contains('F') && !line.contains("FMAX");
    let at = lines[..end].iter().rposition(is_cut).expect("a cut");
    let words = lines[at].split(' ').map(|word| if word.starts_with('Z') { "Z-90." } else { word });
    let mut changed: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
    let planted = words.collect::<Vec<_>>().join(" ");
    changed[at] = planted.clone();
    job.write(&path, (changed.join("\n") + "\n").as_bytes());
    let report = job.path("found.json");
    let words = [
        "verify",
        &format!("{}", job.path(&format!("out/{main}")).display()),
        "--job",
        &format!("{}", job.job().display()),
        "-o",
        &format!("{}", report.display()),
    ];
    let (code, errors) = code_and_errors(&run(&words));
    assert_eq!(code, 1, "{dialect}: {errors}");
    let found: Value = serde_json::from_slice(&std::fs::read(report).expect("a report")).expect("JSON");
    // Lines count on from file to file.
    let mut first = 0;
    // Of a setup with several tools a list.
    let results = found.as_array().map_or(std::slice::from_ref(&found), Vec::as_slice);
    for result in results {
        for called in result["called_files"].as_array().into_iter().flatten() {
            if called["file"] == sub {
                first = called["first_line"].as_u64().expect("a line") - 1;
            }
        }
    }
    assert_eq!(first == 0, sub == main, "{dialect}: {found}");
    let line = first + at as u64 + 1;
    let findings: Vec<&Value> = results.iter().flat_map(|r| r["findings"].as_array().expect("findings")).collect();
    let is_there =
        |f: &&&Value| f["worst_line"] == line && f["block_text"].as_str().is_some_and(|text| text.contains("Z-90."));
    assert!(findings.iter().any(|f| is_there(&f)), "{dialect}: `{planted}` in line {line}: {findings:?}");
    job.write(&path, text.as_bytes());
}

/// A plan without subprograms and tables removes those of the plan before.
#[test]
fn nothing_of_an_earlier_plan_stays() {
    let job = blink_of("fanuc");
    let asked = json!({ "per": "pass", "in": "files" });
    job.set("job.json", &[("/post/subprograms", asked), ("/post/tables", json!(true))]);
    planned(&job);
    let names = |folder: &Path| -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("text")).collect()
    };
    let of_control =
        |name: &String| ["O2", "tool-table", "work-offset", "program-main"].iter().any(|begin| name.starts_with(begin));
    assert!(names(&job.path("out")).iter().filter(|name| of_control(name)).count() >= 4);
    job.write("out/O2999.nc", b"%\nO2999 (OF THE SHOP)\nM99\n%\n");
    job.set("job.json", &[("/post/subprograms", Value::Null), ("/post/tables", json!(false))]);
    planned(&job);
    let left: Vec<String> = names(&job.path("out")).into_iter().filter(of_control).collect();
    assert_eq!(left, ["O2999.nc"]);
}

/// The APT file of all tools names tools and operations, and leads to the axis positions of the
/// program with all tools.
#[test]
fn the_apt_file_of_a_setup_leads_to_its_axis_positions() {
    let job = job_of("fanuc", &[("/post/decimals", json!({"linear": 6, "rotary": 6, "feed": 1, "inverse_time": 3}))]);
    // A third operation with the second tool, at another speed and with another coolant.
    let mut operations = job.json("job.json")["operations"].clone();
    let mut third = operations[1].clone();
    (third["name"], third["feeds"]["spindle_rpm"], third["feeds"]["coolant"]) =
        (json!("third"), json!(777), json!("mist"));
    operations.as_array_mut().expect("operations").push(third);
    job.set("job.json", &[("/operations", operations)]);
    let files = planned(&job);
    assert!(files.contains(&"program.apt".to_owned()), "{files:?}");
    let apt = text_of(&job, "out/program.apt");
    let heads: Vec<&str> = apt
        .lines()
        .filter(|line| {
            ["PARTNO", "UNITS", "PPRINT/", "LOADTL/", "SPINDL/", "COOLNT/", "FINI"]
                .iter()
                .any(|word| line.starts_with(word))
        })
        .collect();
    let count = |word: &str| heads.iter().filter(|line| line.starts_with(word)).count();
    assert_eq!((count("PARTNO"), count("UNITS"), count("FINI"), count("LOADTL/")), (1, 1, 1, 2), "{heads:?}");
    let order = [
        "PPRINT/TOOL 1 ",
        "LOADTL/1",
        "PPRINT/TOOL 7 finer mill",
        "LOADTL/7",
        "PPRINT/again",
        "PPRINT/third",
        "SPINDL/777.,RPM,CLW",
        "COOLNT/MIST",
    ];
    let mut at = 0;
    for begin in order {
        let found = heads[at..].iter().position(|line| line.starts_with(begin));
        at += found.unwrap_or_else(|| panic!("{begin} behind {} in {heads:?}", heads[..at].join(" "))) + 1;
    }
    let place = |name: &str| job.path(name).display().to_string();
    let options = ["--branch", "positive", "--rapid-tolerance-mm", "none", "--tolerance-mm", "0.1"];
    let (cl, out, file) = (place("out/program.apt"), place("posted.nc"), place("job.json"));
    let output = run(&[&["post", &cl, "-o", &out, "--job", &file], &options[..]].concat());
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 0, "{}{errors}", String::from_utf8_lossy(&output.stdout));
    let posted = text_of(&job, "posted.nc");
    assert!(["(AGAIN)", "(THIRD)", "S777 M3", "T7 M6"].iter().all(|word| posted.contains(word)), "{posted}");
    assert_same_words(&straight_words(&text_of(&job, "out/program.nc")), &straight_words(&posted));
}

/// On a machine with two heads the table has the tools of both, and the offset all axes.
#[test]
fn tables_of_two_heads_have_both_tools() {
    let job = two_heads();
    job.set("job.json", &[("/post/tables", json!(true))]);
    let read = Job::read(&job.job()).expect("a job");
    let [tables] = control_tables(&read).expect("tables").try_into().expect("one clamping");
    let [tools, offset] = tables.files.map(|(_, text)| String::from_utf8(text).expect("text"));
    let lengths: Vec<f64> = tools.lines().filter(|l| l.starts_with("G10 L10 ")).map(|l| word(l, "R")).collect();
    let file = |name: &str| job.json(name)["gauge_length_mm"].as_f64().expect("a length");
    assert_eq!(lengths, [file("tool.json"), file("tool-2.json")]);
    let line = offset.lines().find(|line| line.starts_with("G10 L2 ")).expect("an offset");
    assert!(read.machine.axes().iter().all(|axis| line.contains(&format!(" {}", axis.letter.as_str()))), "{line}");
    job.set("job.json", &[("/post/subprograms", json!({ "per": "pass", "in": "files" }))]);
    let why = Job::read(&job.job()).map(drop).expect_err("subprograms of two heads").to_string();
    assert!(why.contains("post.subprograms") && why.contains("two heads"), "{why}");
}
