//! `facemill lengths`: exit codes, what it tells, and what it writes.

use facemill_tests::commands::{facemill_in, files_of};
use facemill_tests::jobs::JobFolder;
use serde_json::{Value, json};

use super::{MARGIN, PAST, SLACK, TOP, holder, with_wall};

/// The patch with a wall, and a program that goes past it.
fn past_the_wall() -> JobFolder {
    let job = with_wall();
    job.write("past.nc", PAST.as_bytes());
    job
}

/// Makes a library of these holders for the shank of the job's tool.
fn shelve(job: &JobFolder, name: &str, holders: &[(&str, [f64; 2])]) {
    let shank = job.json("tool.json")["body"]["sections"][0]["diameter_high_mm"].as_f64().unwrap();
    let holders: Vec<Value> = holders.iter().map(|(name, range)| holder(name, shank, *range, 40.0)).collect();
    job.write(name, json!({ "format": "facemill-holders/1", "holders": holders }).to_string().as_bytes());
}

/// Whether the job's program is free with the tool of a file, and with one that is shorter by the
/// margin and more.
fn is_free_with(job: &JobFolder, tool: &str) -> [bool; 2] {
    let own = job.json("job.json")["tool"].clone();
    job.set("job.json", &[("/tool", json!(tool))]);
    let found = [0.0, MARGIN + SLACK + 0.1].map(|shorter| {
        let [stick_out, gauge] = ["stick_out_mm", "gauge_length_mm"].map(|key| job.json(tool)[key].as_f64().unwrap());
        job.set(tool, &[("/stick_out_mm", json!(stick_out - shorter)), ("/gauge_length_mm", json!(gauge - shorter))]);
        facemill_in(job, "verify past.nc --job job.json").code == 0
    });
    job.set("job.json", &[("/tool", own)]);
    found
}

#[test]
fn a_holder_is_reported_and_written_and_is_free_in_the_job() {
    let job = past_the_wall();
    shelve(&job, "shelf.json", &[("stout", [5.0, 60.0]), ("too short", [5.0, 15.0])]);
    let output =
        facemill_in(&job, "lengths past.nc --job job.json --holders shelf.json -o lengths.json --tool-out short.json");
    assert_eq!(output.code, 0, "{}{}", output.errors, output.printed);
    let (file, tool) = (job.json("lengths.json"), job.json("short.json"));
    assert_eq!((&file["format"], &file["holder"]), (&json!("facemill-lengths/1"), &json!("stout")));
    let stick_out = file["holders"][0]["stick_out_mm"].as_f64().unwrap();
    assert!((stick_out - (TOP + 2.0 - SLACK + MARGIN)).abs() < 0.01, "{stick_out}");
    assert_eq!((&tool["stick_out_mm"], file["findings"].as_array().unwrap().len()), (&json!(stick_out), 0));
    let line =
        |of: &str| output.printed.lines().find(|l| l.contains(of)).unwrap_or_else(|| panic!("{}", output.printed));
    assert!(line("* stout:").contains(&format!("stick-out {stick_out:.2} mm")));
    assert!(line("  too short:").contains(file["holders"][1]["why_not"].as_str().unwrap()));
    assert!(line("L2").contains(&format!("{stick_out:.2}")) && line("findings").ends_with('0'));
    assert_eq!(is_free_with(&job, "short.json"), [true, false]);
}

#[test]
fn the_tool_as_it_is_given_without_files_and_the_margin_is_added() {
    let job = past_the_wall();
    let before = files_of(&job);
    let table = |margin: &str| {
        let output = facemill_in(&job, &format!("lengths past.nc --job job.json --margin-mm {margin}"));
        assert_eq!(output.code, 0, "{}{}", output.errors, output.printed);
        let row = output.printed.lines().find(|l| l.trim_start().starts_with("L3")).unwrap().to_owned();
        row.split_whitespace().nth(2).unwrap().parse::<f64>().unwrap()
    };
    assert!((table("3.5") - table("0.5") - 3.0).abs() < 0.011);
    assert!(files_of(&job) == before);
}

#[test]
fn where_nothing_works_it_is_exit_1_with_the_report_and_no_tool() {
    let job = past_the_wall();
    shelve(&job, "shelf.json", &[("too short", [5.0, 15.0])]);
    for (option, of) in [("--holders shelf.json", "too short"), ("--longest-mm 15", "is free of")] {
        // A tool that an earlier run wrote, which would be taken for this run's.
        let has_earlier = option.starts_with("--longest");
        if has_earlier {
            job.write("short.json", &std::fs::read(job.path("tool.json")).unwrap());
        }
        let output = facemill_in(
            &job,
            &format!("lengths past.nc --job job.json {option} -o lengths.json --tool-out short.json"),
        );
        assert_eq!(output.code, 1, "{option}: {}{}", output.errors, output.printed);
        assert!(output.printed.contains(of), "{option}: {}", output.printed);
        let said = |what: &str| output.errors.contains(what);
        assert!(said("no tool works") && said("short.json is not written"), "{option}: {}", output.errors);
        assert_eq!(said("earlier run was removed"), has_earlier, "{option}: {}", output.errors);
        let file = job.json("lengths.json");
        assert!(file.get("holder").is_none() && !job.path("short.json").exists(), "{option}: {file}");
    }
    assert_eq!(job.json("lengths.json")["none_is_free"]["longest_mm"], json!(15.0));

    // Faults that no length mends: the lengths are reported, and the tool is written.
    job.write("past.nc", PAST.replace("M30\n%\n", "").as_bytes());
    let output = facemill_in(&job, "lengths past.nc --job job.json -o lengths.json --tool-out short.json");
    assert_eq!(output.code, 1, "{}{}", output.errors, output.printed);
    let findings = job.json("lengths.json")["findings"].clone();
    assert_eq!((findings.as_array().unwrap().len(), &findings[0]["kind"]), (1, &json!("no_end")));
    assert!(job.path("short.json").exists());
}

#[test]
fn what_cannot_be_meant_is_exit_2_and_writes_nothing() {
    let job = past_the_wall();
    shelve(&job, "shelf.json", &[("stout", [5.0, 60.0])]);
    job.write("wrong.nc", PAST.replace("G1 Y10.", "G1 Y10. Q$").as_bytes());
    for (name, pointer, value) in [
        ("bore.json", "/holders/0/bore_mm", json!(0)),
        ("range.json", "/holders/0/stick_out_mm", json!([60.0, 5.0])),
        ("sections.json", "/holders/0/sections", json!([])),
        ("unknown.json", "/holders/0/bore", json!(12)),
        ("none.json", "/holders", json!([])),
    ] {
        job.write(name, job.json("shelf.json").to_string().as_bytes());
        job.set(name, &[(pointer, value)]);
    }
    job.write("half.json", &std::fs::read(job.path("shelf.json")).unwrap()[..60]);
    let before = files_of(&job);
    let job_of = "past.nc --job job.json -o lengths.json --tool-out short.json";
    let holders = |name: &str| format!("{job_of} --holders {name}");
    let wrong: Vec<(String, &[&str])> = vec![
        (holders("gone.json"), &["cannot read", "gone.json"]),
        (holders("bore.json"), &["bore.json", "holders[0].bore_mm", "more than 0"]),
        (holders("range.json"), &["range.json", "holders[0].stick_out_mm[1]"]),
        (holders("sections.json"), &["sections.json", "holders[0].sections", "projection_mm"]),
        (holders("unknown.json"), &["unknown.json", "holders[0]", "bore", "did you mean"]),
        (holders("none.json"), &["none.json", "holders: there is none"]),
        (holders("half.json"), &["half.json", "line 1"]),
        (holders("tool.json"), &["tool.json", "unknown field", "`holders`"]),
        (format!("{job_of} --replan"), &["--holders"]),
        (format!("{job_of} --program-out new.nc"), &["--replan"]),
        (format!("{job_of} --margin-mm -1"), &["--margin-mm", "at least 0"]),
        (format!("{job_of} --margin-mm inf"), &["--margin-mm", "at least 0"]),
        (format!("{job_of} --longest-mm -1"), &["--longest-mm", "at least 0"]),
        (format!("{job_of} --stock-cell-mm 0"), &["--stock-cell-mm", "above 0 mm"]),
        (
            format!("{job_of} --stock-cell-mm 1 --stock-tolerance-mm -1"),
            &["--stock-tolerance-mm", "from 0.0001 to 0.5 mm"],
        ),
        (format!("{job_of} --rest tool.json"), &["tool.json"]),
        (job_of.replace("past.nc", "wrong.nc"), &["wrong.nc", "line 8, column"]),
        (job_of.replace("--job job.json", ""), &["--job"]),
        // The job's own tool is an input, and one file is not two.
        (job_of.replace("short.json", "tool.json"), &["tool.json", "is an input"]),
        (job_of.replace("past.nc", "wrong.nc").replace("lengths.json", "wrong.nc"), &["wrong.nc", "is an input"]),
        (holders("shelf.json").replace("lengths.json", "shelf.json"), &["shelf.json", "is an input"]),
        (job_of.replace("short.json", "lengths.json"), &["lengths.json", "named for two files"]),
        // A file that no earlier run has written is neither overwritten nor removed.
        (
            job_of.replace("short.json", "shelf.json --longest-mm 15"),
            &["shelf.json", "not a tool file", "name another"],
        ),
        (job_of.replace("short.json", "shelf.json"), &["shelf.json", "not a tool file"]),
        (format!("{} --replan --program-out bore.json", holders("shelf.json")), &["bore.json", "not a program"]),
    ];
    for (words, expected) in wrong {
        let output = facemill_in(&job, &format!("lengths {words}"));
        assert!(output.is_refused_for(expected), "{words}: exit {}: {}{}", output.code, output.errors, output.printed);
        assert!(files_of(&job) == before, "{words}");
    }
}
