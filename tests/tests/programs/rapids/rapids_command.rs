//! `facemill rapids`: exit codes, what it tells, and what it writes.

use facemill::z_map::DexelMap;
use facemill_tests::commands::{facemill_in, files_of};
use facemill_tests::jobs::JobFolder;
use facemill_tests::variants::box_obj;
use serde_json::{Value, json};

use super::controls::block;
use super::two_ways;

const HEAD: &str = "G21 G90 G94 G49";
/// A link far above both ways, and what it is with nothing in the way.
const FAR: &str = "G0 Z440.\nN70 X-30. Y5. B2.5 C-12.\nZ330.\n";
const DIRECT: &str = "G0 X-30. Y5. B2.5 C-12.\n";

fn text(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn program_report_and_table_agree_and_the_program_is_as_much_faster() {
    let job = block();
    // Without the jerk of one axis links are timed as programs are.
    job.set("machine.json", &[("/tool_chains/0/rows/2/joint/prismatic/max_jerk_mm_s3", Value::Null)]);
    job.write("old.nc", two_ways(HEAD, FAR).as_bytes());
    let output = facemill_in(&job, "rapids old.nc --job job.json -o new.nc --report links.json --stock-cell-mm 4");
    assert_eq!(output.code, 0, "{}", output.errors);
    assert_eq!(text(&job, "new.nc"), two_ways(HEAD, DIRECT));
    let report = job.json("links.json");
    assert_eq!((&report["format"], &report["changed"]), (&json!("facemill-rapids/1"), &json!(1)));
    assert_eq!((&report["findings"], &report["by_acceleration_and_jerk"]), (&json!([0, 0]), &json!(false)));
    let [link] = &report["links"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!([&link["lines"], &link["new_lines"], &link["way"]], [&json!([9, 11]), &json!([9, 9]), &json!("direct")]);

    // The table has the same numbers.
    let seconds = ["time_before_s", "time_after_s", "lower_bound_s"].map(|key| link[key].as_f64().unwrap());
    let row: Vec<&str> = output.printed.lines().find(|l| l.contains(" 9-11 ")).unwrap().split_whitespace().collect();
    assert_eq!(row[1..4], seconds.map(|s| format!("{s:.3}")));
    assert!(output.prints(&["links", "1, 1 with another way"]) && row[4] == "direct", "{}", output.printed);
    assert!(output.prints(&["timed within", "velocity alone"]), "{}", output.printed);

    // The runs of both programs are apart by what the link gains.
    let rapid_time = |program: &str| {
        let output = facemill_in(&job, &format!("verify {program} --job job.json --out found.json"));
        assert_eq!(output.code, 0, "{program}: {}", output.printed);
        job.json("found.json")["rapid_time_s"].as_f64().unwrap()
    };
    let gained = rapid_time("old.nc") - rapid_time("new.nc");
    assert!(gained > 0.1 && (gained - (seconds[0] - seconds[1])).abs() < 1e-6, "{gained} {seconds:?}");
}

#[test]
fn a_program_keeps_its_faults_and_they_are_exit_1() {
    let job = block();
    // The second way goes into the part, and the end of the program is gone.
    let faulty =
        |across: &str| two_ways(HEAD, across).replace("G1 X30.\nG0 Z440.\nM30\n%", "G1 X0. Z296. F500.\nG0 Z440.");
    job.write("old.nc", faulty(FAR).as_bytes());
    let before = facemill_in(&job, "verify old.nc --job job.json --stock-cell-mm 4 --out found.json");
    assert_eq!(before.code, 1, "{}", before.printed);
    let n = job.json("found.json")["findings"].as_array().unwrap().len();
    let output = facemill_in(&job, "rapids old.nc --job job.json -o new.nc --report links.json --stock-cell-mm 4");
    assert_eq!(output.code, 1, "{}", output.errors);
    assert_eq!(text(&job, "new.nc"), faulty(DIRECT));
    assert_eq!(job.json("links.json")["findings"], json!([n, n]));
    assert!(n > 1 && output.prints(&["findings", &format!("{n} before, {n} after")]), "{}", output.printed);
}

/// Between both ways, 30 mm above the workpiece's zero, are a clamp of 20 mm, and stock of 34 mm
/// that another program left.
#[test]
fn clearance_and_the_rest_of_another_program_count() {
    let job = block();
    let between = |top: f64| ([-30.0, -8.0, 5.0], [10.0, 8.0, top]);
    job.write("clamp.obj", box_obj(between(20.0).0, between(20.0).1).as_bytes());
    let clamp = json!({ "file": "clamp.obj", "role": "fixture", "unit": "millimetre", "up_axis": "z" });
    let drive = job.json("job.json")["setups"][0]["meshes"][0].clone();
    let above = json!([0.0, 0.0, 60.0]);
    let meshes = [("/setups/0/meshes", json!([drive, clamp])), ("/setups/0/clearance/plane/origin_mm", above)];
    job.set("job.json", &meshes);
    let across = |link: &str| two_ways(HEAD, link).replace("Y0.", "Y-30.").replace("G1 X30.", "G1 X-10.");
    job.write("old.nc", across("G0 Z440.\nX-30. Y30.\nZ330.\n").as_bytes());
    let link = |more: &str| -> Value {
        let output = facemill_in(&job, &format!("rapids old.nc --job job.json -o new.nc --report links.json {more}"));
        assert_eq!(output.code, 0, "{more}: {}{}", output.errors, output.printed);
        job.json("links.json")["links"][0].clone()
    };
    let free = link("--stock-cell-mm 4");
    assert_eq!((&free["way"], text(&job, "new.nc")), (&json!("direct"), across("G0 X-30. Y30.\n")));
    let wide = link("--stock-cell-mm 4 --clearance-mm 12");
    assert_eq!(job.json("links.json")["clearance_mm"], json!(12.0));
    assert!(wide["way"] != "direct" && wide["time_after_s"].as_f64() > free["time_after_s"].as_f64(), "{wide}");

    // Stock has to contain its part: the block is left of another one.
    let own = job.json("job.json");
    job.write("block.obj", box_obj(between(34.0).0, between(34.0).1).as_bytes());
    let part = json!([{ "file": "block.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" }]);
    job.set(
        "job.json",
        &[("/setups/0/meshes", part), ("/setups/0/stock", json!({ "offset": { "allowance_mm": 0.0 } }))],
    );
    let output = facemill_in(&job, "verify old.nc --job job.json --stock-cell-mm 4 --rest-out left.stock");
    assert_eq!(output.code, 0, "{}{}", output.errors, output.printed);
    job.write("job.json", own.to_string().as_bytes());
    let output = facemill_in(&job, "rapids old.nc --job job.json -o new.nc --rest left.stock");
    assert!(output.is_refused_for(&["left.stock", "is not a rest of the stock of setup"]), "{}", output.errors);
    // Marked as the setup's own it stands for what another program left of that.
    facemill_in(&job, "verify old.nc --job job.json --stock-cell-mm 4 --rest-out own.stock");
    let map = |name: &str| DexelMap::from_bytes(&std::fs::read(job.path(name)).unwrap()).unwrap();
    job.write("left.stock", &map("left.stock").with_origin(map("own.stock").origin().to_vec()).to_bytes());
    let over = link("--rest left.stock --clearance-mm 1");
    assert!(over["way"] != "direct" && over["way"] != "original", "{over}");
    // Over the block by the clearance, and not as high as it went.
    let new = text(&job, "new.nc");
    let heights = new.split_whitespace().filter_map(|word| word.strip_prefix('Z')?.parse::<f64>().ok());
    let highest = heights.filter(|z| *z < 440.0).fold(f64::NEG_INFINITY, f64::max);
    assert!((335.0..400.0).contains(&highest), "{new}");
}

#[test]
fn what_cannot_be_done_is_exit_2_and_writes_nothing() {
    let job = block();
    job.write("old.nc", two_ways(HEAD, FAR).as_bytes());
    job.write("wrong.nc", two_ways(HEAD, "G0 Z440. Q$\n").as_bytes());
    job.write("tnc.nc", b"0 BEGIN PGM A MM\n1 L X+1 R0 F$\n");
    let before = files_of(&job);
    for (words, expected) in [
        ("gone.nc --job job.json -o new.nc", &["cannot read", "gone.nc"][..]),
        ("wrong.nc --job job.json -o new.nc --report links.json", &["wrong.nc", "line 9, column"]),
        ("old.nc --job job.json --stock-cell-mm 4 -o old.nc", &["old.nc", "is an input", "another file"]),
        ("old.nc --job job.json --stock-cell-mm 4 -o new.nc --report old.nc", &["old.nc", "is an input"]),
        ("old.nc --job job.json --stock-cell-mm 4 -o tool.json", &["tool.json", "is an input"]),
        // Refused before the program is read.
        ("wrong.nc --job job.json -o wrong.nc", &["wrong.nc", "is an input"]),
        ("wrong.nc --job job.json -o new.nc --report patch.obj", &["patch.obj", "is an input"]),
        ("wrong.nc --job job.json -o new.nc --report new.nc", &["new.nc", "named for two files"]),
        ("old.nc --job job.json --stock-cell-mm 4 -o new.nc --report new.nc", &["new.nc", "named for two files"]),
        ("old.nc --job job.json -o new.nc --clearance-mm -1", &["--clearance-mm", "at least 0"]),
        ("old.nc --job job.json -o new.nc --clearance-mm nan", &["--clearance-mm", "at least 0"]),
        ("old.nc --job job.json -o new.nc --gouge-mm -1", &["--gouge-mm", "at least 0"]),
        ("old.nc --job job.json -o new.nc --stock-cell-mm 0", &["--stock-cell-mm", "above 0 mm"]),
        ("old.nc --job job.json -o new.nc --stock-cell-mm 1e-4", &["lines", "use 0.", "--stock-cell-mm"]),
        ("old.nc --job job.json -o new.nc --stock-tolerance-mm 0", &["--stock-tolerance-mm", "from 0.0001 to 0.5 mm"]),
        ("old.nc --job job.json -o new.nc --rest tool.json", &["tool.json"]),
        ("old.nc --job job.json -o new.nc --rest a.stock --stock-cell-mm 1", &["--rest", "--stock-cell-mm"]),
        ("tnc.nc --job job.json -o new.nc --dialect heidenhain", &["tnc.nc", "line 2, column"]),
        ("old.nc --job job.json -o new.nc --dialect tnc", &["--dialect", "heidenhain"]),
        ("old.nc --job job.json -o new.nc --setup 2", &["job.json", "no setup \"2\""]),
        ("old.nc -o new.nc", &["--job"]),
        ("old.nc --job gone.json -o new.nc", &["cannot read", "gone.json"]),
        ("old.nc --job job.json", &["--out"]),
    ] {
        let output = facemill_in(&job, &format!("rapids {words}"));
        assert!(output.is_refused_for(expected), "{words}: exit {}: {}{}", output.code, output.errors, output.printed);
        assert!(files_of(&job) == before, "{words}");
    }
}
