//! `facemill chip-area`, and `facemill feedrate`: FEED's tables on the command line; only F words
//! change, and the tip then moves at the requested speed, by matrices made from the rows of the
//! machine file.

use facemill::feeds::{FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::Machine;
use facemill::nc_program::read::{AxisAt, MotionKind};
use facemill::nc_program::{Dialect, FeedMode, read_program};
use facemill::virtual_machine::FindingKind;
use facemill::{Job, PlanSettings, Planned, SilentStages, plan_job, rewrite_feeds};
use facemill_test_kit::Random;
use facemill_tests::jobs::{JobFolder, small_patch, small_patch_planned, text_of, unfinished};
use facemill_tests::oracles::craig::{Words, end_of};
use facemill_tests::program::run;
use facemill_tests::shared::workspace;
use facemill_tests::variants::tiny_patch;
use serde_json::{Value, json};

/// FEED's machine: 253 mm from the B axis to the tip, 100 mm of it tool.
fn machine() -> Value {
    let file = std::fs::read(workspace().join("assets/machines/head-b-table-c.json")).unwrap();
    let mut file: Value = serde_json::from_slice(&file).unwrap();
    let rows = &mut file["tool_chains"][0]["rows"];
    (rows[2]["d_mm"], rows[4]["d_mm"]) = (153.0.into(), (-153.0).into());
    file
}

const LENGTH: f64 = 100.0;

/// Where the tip is in the frame of the table; the words are those with the tool's length in force.
fn tip(machine: &Value, words: &Words) -> [f64; 3] {
    let mut joints = words.clone();
    *joints.get_mut("Z").unwrap() += LENGTH;
    let head = end_of(&machine["tool_chains"][0]["rows"], &joints);
    let table = end_of(&machine["workpiece_chain"]["rows"], &joints);
    let tip = table.try_inverse().unwrap() * head * nalgebra::Vector4::new(0.0, 0.0, -LENGTH, 1.0);
    [tip.x, tip.y, tip.z]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// The text without F words.
fn without_feeds(text: &str) -> String {
    let is_feed = |word: &&str| word.starts_with('F') && word[1..].starts_with(|c: char| c.is_ascii_digit());
    let line = |l: &str| l.split(' ').filter(|w| !is_feed(w)).collect::<Vec<_>>().join(" ");
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn tables_of_feed_come_out_of_the_command() {
    let folder = JobFolder::of(&[]);
    folder.write("machine.json", machine().to_string().as_bytes());
    for name in ["feedrate_table2.csv", "feedrate_table4.csv"] {
        let table = std::fs::read_to_string(workspace().join("assets/golden").join(name)).unwrap();
        let rows = table.lines().filter(|l| l.starts_with(|c: char| c == '-' || c.is_ascii_digit()));
        let rows: Vec<Vec<&str>> = rows.map(|l| l.split(',').collect()).collect();
        let blocks = rows.iter().map(|r| format!("G1 X{} Y{} Z{} B{} C{}\n", r[0], r[1], r[2], r[3], r[4]));
        let text =
            format!("%\nO1 (FEED, {name})\nG21 G90 G94 G54\nG43 H1\nF1000.\n{}M30\n%\n", blocks.collect::<String>());
        folder.write("table.nc", text.as_bytes());
        let [program, machine, out] = ["table.nc", "machine.json", "new.nc"].map(|n| folder.path(n));
        let [program, machine, out] = [&program, &machine, &out].map(|p| p.to_str().unwrap());
        let arguments = ["feedrate", program, "--machine", machine, "--tool-length-mm", "100", "--tip-feed", "1000"];
        let outcome = run(&[&arguments[..], &["-o", out]].concat());
        assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stderr));
        let new = std::fs::read_to_string(out).unwrap();
        assert_eq!(without_feeds(&new), without_feeds(&text));
        let feeds: Vec<f64> = new
            .lines()
            .filter(|l| l.starts_with("G1"))
            .filter_map(|l| l.split(" F").nth(1).map(|f| f.parse().unwrap()))
            .collect();
        let printed: Vec<f64> = rows[1..].iter().map(|r| r[10].parse().unwrap()).collect();
        assert_eq!(feeds.len(), printed.len(), "{new}");
        for (feed, printed) in feeds.iter().zip(&printed) {
            assert!((feed - printed).abs() < 0.25, "{name}: F{feed}, printed {printed}");
        }
        // Without a file the program goes to standard output, the same bytes.
        assert_eq!(run(&arguments).stdout, new.as_bytes());
    }
}

/// A control with the begin of a program, and whether its F counts all axes; with inverse time it
/// counts none.
const CONTROLS: [(Dialect, &str, bool); 7] = [
    (Dialect::Fanuc, "%\nO0007 (RANDOM F12)\nG21 G90 G94 G54\nG43 H1\n", true),
    (Dialect::Haas, "%\nO0007 (RANDOM F12)\nG21 G90 G94 G54\nG43 H1\n", true),
    (Dialect::Mazak, "%\nO0007 (RANDOM F12)\nG21 G90 G94 G54\nG43 H1\n", true),
    (Dialect::LinuxCnc, "G21 G90 G93 G54\nG43 H1\n", false),
    (Dialect::LinuxCnc, "G21 G90 G94 G54\nG43 H1\n", false),
    (Dialect::Siemens840d, "G54 G71 G90 G94\nD1\n", false),
    (Dialect::Siemens840d, "G54 G71 G90 G94\nD1\nFGROUP(X,Y,Z,B,C)\nFGREF[B]=57.29578\nFGREF[C]=57.29578\n", true),
];

/// Moves with F here and there, rapids and arcs between.
fn program(random: &mut Random, dialect: Dialect, head: &str) -> String {
    let mut at = [0.0, 0.0, 150.0, -10.0, 20.0];
    let is_inverse = head.contains("G93");
    let mut text = head.to_owned();
    for k in 0..60 {
        for (value, step) in at.iter_mut().zip([8.0, 8.0, 2.0, 1.5, 6.0]) {
            *value += random.between(-step, step);
        }
        let [x, y, z, b, c] = at;
        let words = format!("X{x:.3} Y{y:.3} Z{z:.3} B{b:.4} C{c:.4}");
        let line = match k {
            0 | 20 => format!("G0 {words}"),
            30 if !is_inverse => format!("G2 X{:.3} Y{y:.3} I5. J0. F321.", x + 10.0),
            31 => format!("G1 {words}"),
            _ if is_inverse => format!("G1 {words} F{:.3}", random.between(20.0, 90.0)),
            _ if k == 1 || random.between(0.0, 1.0) < 0.3 => {
                format!("G1 {words} F{:.1}", random.between(200.0, 2000.0))
            }
            _ => format!("G1 {words}"),
        };
        let line = if is_inverse && k == 31 { format!("{line} F40.") } else { line };
        let comment = if k % 7 == 3 && dialect != Dialect::Siemens840d { " (F1.)" } else { "" };
        text.push_str(&format!("N{} {line}{comment}\n", 10 * (k + 1)));
    }
    text + "M30\n"
}

#[test]
fn nothing_but_f_words_changes_and_the_tip_keeps_to_its_feed() {
    let mut random = Random(5);
    let file = machine();
    let machine = Machine::from_json(file.to_string().as_bytes()).unwrap();
    for (dialect, head, counts_all) in CONTROLS {
        for queried in [Some(800.0), None] {
            let text = program(&mut random, dialect, head);
            let settings = FeedRewriteSettings {
                machine: &machine,
                tool_length: LENGTH,
                tip_feed: queried.map_or(TipFeed::Programmed, TipFeed::Given),
                work_offset: Vec::new(),
                dialect,
                dialect_file: None,
                time_law: None,
            };
            let new =
                rewrite_feeds(text.as_bytes(), &settings).unwrap_or_else(|why| panic!("{dialect:?}: {why}\n{text}"));
            let summary = new.summary;
            let new = String::from_utf8(new.text).unwrap();
            assert_eq!(without_feeds(&new), without_feeds(&text), "{dialect:?}");
            let [before, after] = [&text, &new].map(|t| read_program(t, dialect).unwrap());
            let mut last: Option<Words> = None;
            let mut n = 0;
            for (old, new) in before.blocks.iter().zip(&after.blocks) {
                let (Some(was), Some(is)) = (&old.motion, &new.motion) else { continue };
                assert_eq!(was.position, is.position);
                let words: Words = is
                    .position
                    .iter()
                    .map(|(letter, at)| match at {
                        AxisAt::Word(word) => (letter.to_string(), word),
                        other => panic!("{letter} at {other:?}"),
                    })
                    .collect();
                let from = last.replace(words.clone());
                let (Some(from), MotionKind::Linear) = (from, is.kind) else {
                    // A kept block has its old feed.
                    assert_eq!(was.feed.map(|f| f.value), is.feed.map(|f| f.value), "line {}", old.line);
                    continue;
                };
                let feed = is.feed.unwrap();
                let way = distance(tip(&file, &words), tip(&file, &from));
                let counted = words.iter().filter(|(name, _)| counts_all || "XYZ".contains(name.as_str()));
                let norm = counted.map(|(name, to)| (to - from[name]).powi(2)).sum::<f64>().sqrt();
                let inverse = feed.mode == FeedMode::G93;
                let time = if inverse { 60.0 / feed.value } else { 60.0 * norm / feed.value };
                let axis_time = slowest(&machine, &from, &words);
                let wanted = match (queried, was.feed.unwrap()) {
                    (Some(queried), _) => 60.0 * way / queried,
                    (None, old) if inverse => 60.0 / old.value,
                    (None, old) => 60.0 * way / old.value,
                };
                let least = wanted.max(axis_time);
                // F is rounded down, and stays where it says the same.
                let coarse = if feed.value < 1000.0 { 1e-3 } else { 0.1 / feed.value };
                let coarse = if inverse { 1e-4 } else { coarse };
                let stays = inverse && queried.is_none() && axis_time <= wanted;
                assert!(!stays || was.feed == is.feed, "line {}: {:?} {feed:?}", old.line, was.feed);
                let outcome = format!("{dialect:?} line {}: {time} s, least {least} s", old.line);
                assert!(time >= least * (1.0 - 1e-9) && time <= least * (1.0 + 1.1 * coarse), "{outcome}");
                n += 1;
            }
            assert!(n > 50 && summary.blocks == n, "{dialect:?}: {n} cuts, {summary:?}");
            assert_eq!(summary.by_tip_feed + summary.by_axis + summary.by_control, n);
        }
    }
}

fn slowest(machine: &Machine, from: &Words, to: &Words) -> f64 {
    let of = |axis: &facemill::inverse_kinematics::Axis| {
        let name = axis.letter.to_string();
        (to[&name] - from[&name]).abs() / axis.in_word_unit(axis.max_velocity)
    };
    machine.axes().iter().map(of).fold(0.0, f64::max)
}

#[test]
fn programs_that_cannot_be_trusted_are_refused_by_line() {
    let machine = Machine::from_json(machine().to_string().as_bytes()).unwrap();
    let head = "G21 G90 G94 G54\nG43 H1\nG0 X0. Y0. Z150. B0. C0.\n";
    for (rest, outcome) in [
        ("G1 X1. F0.\n", &["line 4", "feed is 0"][..]),
        ("G1 X1.\n", &["line 4", "no feed", "--tip-feed"]),
        ("G1 A5. F100.\n", &["line 4", "A"]),
        ("G1 B300. F100.\n", &["line 4", "axis B", "300", "limits"]),
        ("G1 X1. F100.\nG55 X2.\n", &["line 5"]),
        ("G1 X1. F100.\nG1 X#101\n", &["line 5", "not evaluated"]),
        ("M98 P1000\nG1 X1. F100.\n", &["line 4", "not evaluated"]),
        ("G1 X1. Q\u{a7}\n", &["line 4", "column"]),
        ("/G1 X1. F100.\n", &["line 4", "switch"]),
        ("/F100.\nG1 X1.\n", &["line 4", "switch"]),
    ] {
        let why = refused(&machine, Dialect::Fanuc, &format!("{head}{rest}M30\n"));
        assert!(outcome.iter().all(|part| why.contains(part)), "{rest}: {why}");
    }
    let siemens = "G54 G71 G90 G94\nD1\nG0 X0 Y0 Z150 B0 C0\n";
    for (rest, outcome) in [
        ("FGROUP(X,Y,Z,B)\nG1 X1 F100\n", "FGROUP(X,Y,Z,B)"),
        ("FGROUP(X,Y,Z,B,C)\nG1 X1 F100\n", "FGREF"),
        ("G1 B5 F100\n", "rotary axes alone"),
        ("OVR=50\nG1 X1 F100\n", "changes feeds"),
        ("FB=50\nG1 X1 F100\n", "line 4: FB=50 changes feeds"),
        ("FZ=0.1\nG1 X1 F100\n", "changes feeds"),
        ("LIMS=500\nG1 X1 F100\n", "the spindle's speed"),
        ("OFFN=2\nG1 X1 F100\n", "OFFN=2"),
        ("FXS[X]=1\nG1 X1 F100\n", "FXS[X]=1"),
    ] {
        let why = refused(&machine, Dialect::Siemens840d, &format!("{siemens}{rest}M30\n"));
        assert!(why.contains(outcome) && why.contains("line "), "{rest}: {why}");
    }
    let why = refused(&machine, Dialect::LinuxCnc, "G21 G90 G94 G54\nM430\nG1 X1. F100.\nM2\n");
    assert!(why.contains("kinematics"), "{why}");
}

/// Why a program gets no new feeds.
fn refused(machine: &Machine, dialect: Dialect, text: &str) -> String {
    let settings = FeedRewriteSettings {
        machine,
        tool_length: LENGTH,
        tip_feed: TipFeed::Programmed,
        work_offset: Vec::new(),
        dialect,
        dialect_file: None,
        time_law: None,
    };
    rewrite_feeds(text.as_bytes(), &settings).expect_err(text)
}

/// A flat disc across a plane takes a rectangle; a ball alone takes the segment of its circle below
/// the stock's surface.
#[test]
fn chip_areas_of_simple_cases_are_reported() {
    let outcome = |arguments: &[&str]| {
        let output = run(&[&["chip-area"], arguments].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        text.split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    let disc = outcome(&["--radius-mm", "40", "--depth-of-cut-mm", "2"]);
    assert!((disc - 160.0).abs() < 1e-6, "{disc}");
    let beside = outcome(&["--radius-mm", "40", "--depth-of-cut-mm", "2", "--right", "cut", "--right-mm", "30"]);
    assert!((beside - 60.0).abs() < 1e-6, "{beside}");
    let ball = outcome(&["--radius-mm", "6", "--corner-radius-mm", "6", "--depth-of-cut-mm", "2"]);
    let segment = 36.0 * (4.0_f64 / 6.0).acos() - 4.0 * 20.0_f64.sqrt();
    assert!((ball - segment).abs() < 1e-6, "{ball}, segment {segment}");
    let folder = JobFolder::of(&[]);
    folder.write(
        "cases.csv",
        b"name,radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,right\nball,6,6,plane,2,stock,stock\n",
    );
    let table = run(&["chip-area", "--table", folder.path("cases.csv").to_str().unwrap()]);
    let table = String::from_utf8(table.stdout).unwrap();
    let area: f64 = table.lines().nth(1).unwrap().split(',').nth(7).unwrap().parse().unwrap();
    assert!((area - segment).abs() < 1e-9, "{table}");
    let cases = folder.path("cases.csv").to_str().unwrap().to_owned();
    folder.write("cases.csv", b"radius_mm,corner_radius_mm,surface,depth_of_cut_mm,left,right\n");
    for (arguments, expected) in [
        (&["--radius-mm", "-1", "--depth-of-cut-mm", "2"][..], "--radius-mm: "),
        (&["--radius-mm", "40", "--depth-of-cut-mm", "2", "--surface", "cone"], "plane, convex, concave"),
        (&["--radius-mm", "40"], "--depth-of-cut-mm"),
        (&["--radius-mm", "1e300", "--depth-of-cut-mm", "2"], "--radius-mm: cutter.radius is 1e300 mm"),
        (&["--table", &cases], "no case"),
    ] {
        let output = run(&[&["chip-area"], arguments].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && errors.contains(expected), "{errors}");
        assert!(!errors.contains("line 2") && errors.len() < 400, "{errors}");
    }
}

/// Checks the tolerance of the path, which a Heidenhain control needs and others accept.
fn smoothing(job: &JobFolder) {
    let allowed = [("path_mm", json!(0.004)), ("orientation_deg", json!(0.005))];
    let allowed = allowed.map(|(key, value)| (format!("/motion/control_tolerance/{key}"), value));
    let allowed: Vec<(&str, Value)> = allowed.iter().map(|(key, value)| (&**key, value.clone())).collect();
    job.set("machine.json", &allowed);
}

/// The program that a plan wrote, whatever the control calls its files.
fn program_of(planned: &Planned) -> String {
    let is_program = |name: &str| name.starts_with("program.") && !name.ends_with(".apt");
    let name = &planned.files.iter().find(|(name, _)| is_program(name)).expect("a program").0;
    text_of(planned, name)
}

/// Plans a small job for a control that keeps to this law under RTCP; its program holds these
/// words, is read back and run without a finding, and every block of it is certified.
fn plan_for(dialect: &str, mode: &str, cutting: &str, words: &[&str]) {
    let job = tiny_patch();
    smoothing(&job);
    // The register that G43 H takes is none of D and TOOL CALL.
    job.set("tool.json", &[("/length_register", json!(5))]);
    job.set("machine.json", &[("/motion/cutting", json!(cutting))]);
    job.set("job.json", &[("/post/dialect", json!(dialect)), ("/post/feed_mode", json!(mode))]);
    let settings = PlanSettings { verify: true, certificates: true };
    let planned = plan_job(&Job::read(&job.job()).unwrap(), settings, None, &SilentStages).unwrap().pop().unwrap();
    assert!(planned.is_clean(), "{dialect} {mode}: {:?}", planned.report.findings);
    // Links are shortened under every motion law, and proven with all else.
    let links = planned.report.links.shortened.as_ref().unwrap();
    assert!(links.changed >= 3 && links.changed == links.links.len(), "{dialect} {mode}: {links:?}");
    assert!(planned.report.verified && planned.report.findings.is_empty());
    assert!(planned.report.worst.gouge_mm.is_some());
    let text = program_of(&planned);
    assert!(words.iter().all(|w| text.contains(w)), "{dialect} {mode}: {}", &text[..2000.min(text.len())]);
    let certificates: Value = serde_json::from_str(&text_of(&planned, "certificates.json")).unwrap();
    let all = certificates["certificates"].as_array().unwrap();
    let open: Vec<&Value> = all.iter().filter(|c| c["certified"] != json!(true)).collect();
    assert!(all.len() > 50 && open.is_empty(), "{dialect} {mode}: {open:#?}");
    new_feeds_are_understood(&job, dialect, mode, &text, &planned);
}

/// The program's own speeds of the tip change no byte, whatever its F counts; another speed is that
/// of the tip.
fn new_feeds_are_understood(job: &JobFolder, dialect: &str, mode: &str, text: &str, planned: &Planned) {
    let read = facemill::machines::read_machine(&job.path("machine.json")).unwrap();
    let tool_length = job.json("tool.json")["gauge_length_mm"].as_f64().unwrap();
    let rewritten = |tip_feed: TipFeed| {
        let settings = FeedRewriteSettings {
            machine: &read.heads[0],
            tool_length,
            tip_feed,
            work_offset: Vec::new(),
            dialect: Dialect::ALL.into_iter().find(|d| d.name() == dialect).unwrap(),
            dialect_file: None,
            time_law: None,
        };
        rewrite_feeds(text.as_bytes(), &settings)
    };
    let kept = rewritten(TipFeed::Keep).unwrap_or_else(|why| panic!("{dialect} {mode}: {why}"));
    assert!(kept.text == text.as_bytes() && kept.summary.kept == 0, "{dialect} {mode}: {:?}", kept.summary);
    let totals = &planned.report.totals;
    let time = totals.passes_time_s + totals.approach_time_s;
    assert!((kept.summary.time_after_s / time - 1.0).abs() < 5e-3, "{dialect} {mode}: {:?} {time} s", kept.summary);
    match (mode, rewritten(TipFeed::Programmed)) {
        ("g94", found) => assert!(found.is_err_and(|why| why.contains("--tip-feed keep")), "{dialect}"),
        (_, found) => assert!(found.unwrap().text == text.as_bytes(), "{dialect} {mode}"),
    }
    assert!((kept.summary.rapid_time_s / totals.rapid_time_s - 1.0).abs() < 1e-9, "{dialect} {mode}: {totals:?}");
    // Half the time of a slow tip at twice its speed: what the axes limit at 60 mm/min is nothing.
    let [slow, fast] = [30.0, 60.0].map(|feed| rewritten(TipFeed::Given(feed)).unwrap().summary);
    assert!((slow.time_after_s / fast.time_after_s - 2.0).abs() < 1e-3, "{dialect} {mode}: {slow:?} {fast:?}");
    assert!(fast.time_after_s > 0.99 * totals.passes_length_mm, "{dialect} {mode}: {fast:?}");
}

/// Options out of range are refused by name, and a file without a program by its own.
#[test]
fn feedrate_refuses_what_cannot_be_meant() {
    let folder = JobFolder::of(&[]);
    folder.write("machine.json", machine().to_string().as_bytes());
    folder.write("empty.nc", b"\n  \n");
    folder.write("one.nc", b"G21 G90 G94 G54\nG43 H1\nG0 X0. Y0. Z150. B0. C0.\nG1 X1. F100.\nM30\n");
    // Turns with an F of their own, among blocks whose F is the tip's anyhow.
    let turns: String = (1..=20).map(|k| format!("G1 X{k}. B{}.5 F{}.\n", k % 7, 300 + 17 * k)).collect();
    let ways: String = (1..=60).map(|k| format!("G1 X{}. F500.\n", k % 2)).collect();
    let start = "G21 G90 G94 G54\nG43 H1\nG0 X0. Y0. Z150. B0. C0.\n";
    folder.write("mixed.nc", format!("{start}{turns}{ways}M30\n").as_bytes());
    let path = |name: &str| folder.path(name).to_str().unwrap().to_owned();
    let outcome = |program: &str, length: &str, more: &[&str]| {
        let (program, machine) = (path(program), path("machine.json"));
        let arguments = ["feedrate", &program, "--machine", &machine, "--tool-length-mm", length];
        let output = run(&[&arguments[..], more].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(outcome("one.nc", "100", &["--tip-feed", "keep"]).0, Some(0));
    for (program, length, more, expected) in [
        ("empty.nc", "100", &[][..], "empty.nc"),
        ("mixed.nc", "100", &[], "F changes in 19 of 19 blocks"),
        ("mixed.nc", "100", &["-o", &path("mixed.nc")], "is an input"),
        ("one.nc", "0", &[], "--tool-length-mm"),
        ("one.nc", "-5", &[], "--tool-length-mm"),
        ("one.nc", "NaN", &[], "--tool-length-mm"),
        ("one.nc", "100", &["--work-offset", "X=1", "--work-offset", "X=1"], "--work-offset X: is given twice"),
        ("one.nc", "100", &["--tip-feed", "kept"], "--tip-feed"),
        ("one.nc", "100", &["--time-law", "--blend-tolerance-mm", "1e9"], "--blend-tolerance-mm"),
        ("one.nc", "100", &["--time-law", "--blend-tolerance-mm", "1e-12"], "--blend-tolerance-mm"),
    ] {
        let (code, errors) = outcome(program, length, more);
        assert!(code == Some(2) && errors.contains(expected), "{more:?} {length}: {errors}");
    }
    // A dialect file has to be one of the program's control.
    for (file, expected) in [("haas.json", "a dialect file of haas, but --dialect is fanuc"), ("no.json", "no.json")] {
        folder.write("haas.json", facemill::file_format::to_json(&Dialect::Haas.file()).as_bytes());
        let (code, errors) = outcome("one.nc", "100", &["--tip-feed", "keep", "--dialect-file", &path(file)]);
        assert!(code == Some(2) && errors.contains(expected), "{file}: {errors}");
    }
    let haas = path("haas.json");
    assert_eq!(
        outcome("one.nc", "100", &["--tip-feed", "keep", "--dialect", "haas", "--dialect-file", &haas]).0,
        Some(0)
    );
    // Under RTCP, too, F stays within the range of the control: 1 to 24000 mm/min. Nothing exceeds
    // its requested speed for that.
    let rtcp = start.replace("G43 H1", "G43.4 H1") + "G1 X40. Y40. F100.\nM30\n";
    folder.write("rtcp.nc", rtcp.as_bytes());
    let out = path("ranged.nc");
    assert_eq!(outcome("rtcp.nc", "100", &["--tip-feed", "1000000", "-o", &out]).0, Some(0));
    let text = std::fs::read_to_string(&out).unwrap();
    let feed: f64 = text.split(" F").nth(1).and_then(|f| f.lines().next()).unwrap().parse().unwrap();
    assert!((15000.0..=24000.0).contains(&feed), "F{feed}");
    for program in ["rtcp.nc", "one.nc"] {
        let (code, errors) = outcome(program, "100", &["--tip-feed", "0.5"]);
        assert!(code == Some(2) && errors.contains("line 4: it needs F0.5000"), "{program}: {errors}");
        assert!(errors.contains("the smallest that the machine accepts is 1"), "{program}: {errors}");
        assert_eq!(outcome(program, "100", &["--tip-feed", "0.995"]).0, Some(0), "{program}");
    }
    let (code, errors) = outcome("one.nc", "100", &["--time-law", "--blend-tolerance-mm", "0"]);
    assert!(code == Some(0) && errors.contains("a stop at every corner"), "{errors}");
}

/// Plans for other controls are read back, run and free of findings, as for the first one.
#[test]
fn programs_for_other_controls_are_planned_and_verified() {
    let plan = |dialect, mode, words: &[&str]| plan_for(dialect, mode, "axes_linear", words);
    plan("linuxcnc", "g93", &["G93", "O100 IF"]);
    plan("siemens_840d", "g94", &["FGROUP(", "GOTOF LENGTH_OK"]);
    plan("siemens_840d", "g93", &["G93", "RTLION"]);
    plan("heidenhain", "g94", &["FN 14: ERROR", "FMAX M91"]);
}

/// The same where the control keeps the tip on a line under RTCP, in cuts and at rapid rate.
#[test]
fn programs_that_keep_the_tip_on_a_line_are_planned_and_verified_with_their_rapids() {
    plan_for("linuxcnc", "rtcp", "tip_and_rotaries_linear", &["M428", "M429"]);
    plan_for("siemens_840d", "rtcp", "tip_and_rotaries_linear", &["TRAORI", "ORIAXES"]);
    plan_for("siemens_840d", "rtcp", "tip_linear_vector_turned", &["TRAORI", "ORIVECT"]);
    plan_for("heidenhain", "rtcp", "tip_and_rotaries_linear", &["PATHCTRL AXIS", "FUNCTION RESET TCPM"]);
    plan_for("heidenhain", "rtcp", "tip_linear_vector_turned", &["PATHCTRL VECTOR"]);
}

/// A template that turns the spindle at another speed is found in plan's own text, where it begins.
#[test]
fn a_template_with_another_spindle_speed_has_a_finding() {
    let job = tiny_patch();
    let template = Dialect::Fanuc.template().text;
    let slower = template.replace("S{{ spindle.rpm }} {{ spindle.code }}", "S100 {{ spindle.code }}");
    assert_ne!(template, slower);
    job.write("shop.j2", slower.as_bytes());
    job.set("job.json", &[("/post/template", json!("shop.j2"))]);
    let planned = job.plan();
    let [finding] = &planned.report.findings[..] else { panic!("{:?}", planned.report.findings) };
    assert!(finding.kind == FindingKind::OtherSpindleSpeed && finding.note.contains("S100"), "{finding}");
    let line = program_of(&planned).lines().nth(finding.first_line as usize - 1).unwrap().to_owned();
    assert!(line.contains("S100") && !planned.is_clean(), "{line}");
}

/// A template without FGROUP lets F count the linear axes alone: not the feeds that were planned.
#[test]
fn a_template_that_changes_what_f_counts_is_refused() {
    let job = tiny_patch();
    smoothing(&job);
    let template = Dialect::Siemens840d.template().text;
    let without = template.replace("FGROUP({%", "; ({%").replace("FGREF[{{", "; [{{");
    assert_ne!(template, without);
    job.write("shop.j2", without.as_bytes());
    // Else passes that lose time to the rotary axes are cut with these at rest, and F is the same.
    let turning = ("/operations/0/search/mode", json!({ "fixed": { "lead_deg": 10.0, "lean_deg": 4.0 } }));
    let post = [("/post/dialect", json!("siemens_840d")), ("/post/template", json!("shop.j2")), turning];
    job.set("job.json", &post);
    let why = job.try_plan().err().expect("other feeds").to_string();
    assert!(why.contains("shop.j2") && why.contains("FGROUP") && why.contains("planned"), "{why}");
}

/// A program from anywhere is run with the job unchanged: the plan's own program has the figures of
/// its report, with one block deeper it gouges there, and words that are not understood are
/// reported with their lines.
#[test]
fn programs_from_anywhere_are_run_with_the_job_unchanged() {
    let (job, planned) = (small_patch(), small_patch_planned());
    // Its passes are a band of the region.
    job.set("job.json", &[unfinished()]);
    let text = text_of(planned, "program.nc");
    job.write("program.nc", text.as_bytes());
    let path = |name: &str| job.path(name).to_str().unwrap().to_owned();
    let verify = |program: &str, more: &[&str]| {
        run(&[&["verify", &path(program), "--job", &path("job.json"), "--out", &path("found.json")], more].concat())
    };
    let found = || -> Value { serde_json::from_slice(&std::fs::read(job.path("found.json")).unwrap()).unwrap() };

    let clean = verify("program.nc", &["--certificates"]);
    assert_eq!(clean.status.code(), Some(0), "{}", String::from_utf8_lossy(&clean.stderr));
    let file = found();
    assert_eq!(file["format"], "facemill-verification/1");
    assert_eq!(file["findings"], json!([]));
    // The report lists the control's settings that a FANUC program leaves open, and nothing that
    // the program says.
    let rests_on: Vec<&str> =
        file["assumptions"].as_array().unwrap().iter().filter_map(|a| a["text"].as_str()).collect();
    let expected = [
        "both sides",
        "the mesh patch.obj is not closed",
        "how rapids go",
        "M6 is taken to leave all axes where they are",
        "motion.control_tolerance",
        "times by acceleration and jerk take the control as",
    ];
    for part in expected {
        assert!(rests_on.iter().any(|text| text.contains(part)), "{part}: {rests_on:?}");
    }
    assert!(rests_on.len() <= expected.len() + 1, "{rests_on:?}");
    assert!(rests_on.iter().all(|text| String::from_utf8_lossy(&clean.stdout).contains(text)));
    // One definition of times, and one way to them: from the text.
    let times = serde_json::to_value(&planned.report.times).unwrap();
    for key in ["cutting_s", "rapid_s", "constant_cutting_s", "constant_rapid_s"] {
        let [outcome, planned] = [&file["times"][key], &times[key]].map(|v| v.as_f64().unwrap());
        assert!(planned > 1.0 && (outcome - planned).abs() < 1e-9 * planned, "{key}: {outcome} s, planned {planned} s");
    }
    let rapid = planned.report.totals.rapid_time_s;
    assert!((file["rapid_time_s"].as_f64().unwrap() - rapid).abs() < 1e-9 * rapid, "{rapid} s");
    assert_eq!(file["largest_gouge"]["depth_mm"], json!(planned.report.worst.gouge_mm));
    assert_eq!(file["smallest_clearance"]["distance_mm"], json!(planned.report.worst.clearance_mm));
    assert_eq!(file["certificates"]["certified"], file["certificates"]["blocks"]);

    // The stock as it is cut: nothing meets it, and the program finds nothing more to cut in its
    // own rest.
    let rest = path("rest.stock");
    let cut = verify("program.nc", &["--stock-cell-mm", "2", "--rest-out", &rest]);
    assert_eq!(cut.status.code(), Some(0), "{}", String::from_utf8_lossy(&cut.stdout));
    let removed = |file: &Value| file["stock"]["removed_mm3"].as_f64().unwrap();
    let first = removed(&found());
    // Of what lies over the passes' band, 48 mm of the patch's 200.
    assert!(first > 0.3 * 48.0 / 200.0 * found()["stock"]["before_mm3"].as_f64().unwrap());
    assert_eq!(verify("program.nc", &["--rest", &rest]).status.code(), Some(0));
    assert!(removed(&found()).abs() < 1e-3 * first, "{} of {first}", removed(&found()));
    assert_eq!(found()["stock"]["blocks_not_covered"], json!(0));
    // Half of the lines: less is cut, and the report says how much was not seen.
    let [[x0, y0], [x1, y1]]: [[f64; 2]; 2] = serde_json::from_value(found()["stock"]["region_mm"].clone()).unwrap();
    let half = format!("{x0},{y0},{},{y1}", 0.5 * (x0 + x1));
    let part = verify("program.nc", &["--stock-cell-mm", "2", "--stock-region", &half]);
    assert!(part.status.code() == Some(0) && String::from_utf8_lossy(&part.stdout).contains("not covered"));
    assert!(removed(&found()) > 0.2 * first && removed(&found()) < 0.8 * first, "{} of {first}", removed(&found()));
    assert!(found()["stock"]["blocks_not_covered"].as_u64().unwrap() > 0);
    // Around what is cut nothing is missing.
    assert_eq!(verify("program.nc", &["--stock-cell-mm", "2", "--stock-region", "operations"]).status.code(), Some(0));
    assert!((removed(&found()) / first - 1.0).abs() < 0.01, "{} of {first}", removed(&found()));

    // One position of a pass 0.2 mm deeper along the spindle.
    let is_cut = |l: &str| l.contains(" Z") && l.contains(" B") && l.contains(" F");
    let lines: Vec<&str> = text.lines().collect();
    let cuts: Vec<usize> = (0..lines.len()).filter(|&k| is_cut(lines[k])).collect();
    let at = cuts[cuts.len() / 2];
    let lowered = |word: &str| match word.strip_prefix('Z') {
        Some(z) => format!("Z{:.3}", z.parse::<f64>().unwrap() - 0.2),
        None => word.to_owned(),
    };
    let deeper: Vec<String> = (0..lines.len())
        .map(|k| if k == at { lines[k].split(' ').map(lowered).collect::<Vec<_>>().join(" ") } else { lines[k].into() })
        .collect();
    job.write("deeper.nc", deeper.join("\n").as_bytes());
    let outcome = verify("deeper.nc", &[]);
    assert_eq!(outcome.status.code(), Some(1));
    let gouge = &found()["findings"][0];
    assert_eq!((&gouge["kind"], &gouge["worst_line"]), (&json!("gouge"), &json!(at + 1)), "{gouge}");
    let outcome = String::from_utf8_lossy(&outcome.stdout).into_owned();
    assert!(outcome.lines().any(|l| l.contains(" gouge ") && l.contains("cutter, part")), "{outcome}");
    // A limit of one's own.
    assert_eq!(verify("deeper.nc", &["--gouge-mm", "0.5"]).status.code(), Some(0));

    // Cut off on its way to the control, and without its offset.
    let short: Vec<&str> = lines[..at].iter().copied().filter(|l| !l.ends_with(" G54")).collect();
    job.write("short.nc", short.join("\n").as_bytes());
    assert_eq!(verify("short.nc", &[]).status.code(), Some(1));
    let (outcome, file) = (found()["findings"].clone(), found());
    assert_eq!((outcome.as_array().unwrap().len(), &outcome[0]["kind"]), (1, &json!("no_end")), "{outcome}");
    assert_eq!(outcome[0]["first_line"], json!(short.len()));
    let offset = |a: &Value| a["text"].as_str().unwrap().starts_with("no work offset is selected: G54");
    assert!(file["assumptions"].as_array().unwrap().iter().any(offset), "{}", file["assumptions"]);
    // Twice the feeds, and another spindle speed: not what the job asks for, though the axes may
    // follow.
    let number = |word: &str, letter: char| word.strip_prefix(letter).and_then(|n| n.parse::<f64>().ok());
    let doubled = |word: &str| match (number(word, 'F'), number(word, 'S')) {
        (Some(f), _) => format!("F{:.1}", 2.0 * f),
        (_, Some(_)) => "S40000".to_owned(),
        _ => word.to_owned(),
    };
    let line = |l: &&str| l.split(' ').map(doubled).collect::<Vec<_>>().join(" ");
    job.write("faster.nc", lines.iter().map(line).collect::<Vec<_>>().join("\n").as_bytes());
    let outcome = verify("faster.nc", &[]);
    assert_eq!(outcome.status.code(), Some(1));
    let file = found();
    let of = |kind: &str| file["findings"].as_array().unwrap().iter().find(|f| f["kind"] == kind).cloned();
    let (feed, speed) = (of("feed_above_job").expect("a feed"), of("other_spindle_speed").expect("a speed"));
    let ratio = feed["measure"]["feed_ratio"].as_f64().unwrap();
    assert!(ratio > 1.01 && ratio < 2.02, "{feed}");
    assert!(feed["note"].as_str().unwrap().contains("the job permits at most 2000 mm/min"), "{feed}");
    assert!(lines[speed["first_line"].as_u64().unwrap() as usize - 1].contains(" S"), "{speed}");
    assert!(speed["note"].as_str().unwrap().contains("S40000"), "{speed}");

    job.write("wrong.nc", b"G21 G90\nG1 X1. Q$\n");
    for (program, more, expected) in [
        ("wrong.nc", &[][..], "line 2, column"),
        ("nothing.nc", &[], "nothing.nc"),
        ("program.nc", &["--setup", "3"], "no setup \"3\""),
        ("program.nc", &["--gouge-mm", "-1"], "'--gouge-mm <MM>': must be a length of at least 0 mm"),
        ("program.nc", &["--stock-cell-mm", "0"], "'--stock-cell-mm <MM>': must be a length above 0 mm"),
        ("program.nc", &["--stock-cell-mm", "1", "--stock-tolerance-mm", "0"], "'--stock-tolerance-mm <MM>': must"),
        ("program.nc", &["--stock-cell-mm", "1", "--deviation-tolerance-mm", "nan"], "'--deviation-tolerance-mm <MM>'"),
        (
            "program.nc",
            &["--stock-cell-mm", "1", "--stock-region", "1,2,3"],
            "must be whole, operations, or X0,Y0,X1,Y1",
        ),
        ("program.nc", &["--stock-cell-mm", "1", "--stock-region", "1e5,1e5,2e5,2e5"], "no rectangle with stock in it"),
        ("program.nc", &["--rest", &path("rest.stock"), "--stock-region", "operations"], "--stock-region"),
        ("program.nc", &["--rest", &path("job.json")], "job.json"),
        ("program.nc", &["--rest-out", &path("rest.stock")], "no stock is cut"),
        ("program.nc", &["--dialect", "tnc"], "heidenhain"),
    ] {
        let output = verify(program, more);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && errors.contains(expected), "{errors}");
    }
}
