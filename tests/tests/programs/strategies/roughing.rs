//! Roughing in layers: a program for each, planned on what those before it leave.

use std::collections::HashSet;
use std::ffi::OsString;

use facemill::cl_data::Silent;
use facemill::nc_program::Dialect;
use facemill::sample_parts::PatchSpec;
use facemill::{Job, Setup};
use facemill_tests::commands::{CommandOutput, facemill_in};
use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::interpreter;
use facemill_tests::oracles::read_back::ReadBack;
use facemill_tests::oracles::rest_points::{RestPoint, RestPoints};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{box_obj, variant, with_long_flute};
use nalgebra::Point3;
use serde_json::{Value, json};

use crate::strategies::several_tools::lines_of_findings;

/// Stock on the patch, thickness of its layers and what they leave, mm.
const STOCK: f64 = 4.0;
const DEPTH: f64 = 2.0;
const LEFT: f64 = 0.4;

/// Half of the band across x that the passes cover, mm.
const BAND: f64 = 8.0;

/// Distance of points of stock beside each other, and above each other, mm.
const STEPS: (f64, f64) = (2.0, 0.2);

/// Distance of places of the tool along its way, mm.
const STEP: f64 = 1.0;

/// Flute of the mill, mm: more than a layer is thick, less than the stock.
const FLUTE: f64 = 3.0;

/// Returns a job that roughs a band of the small patch in two layers and finishes it.
fn layers() -> JobFolder {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let job = variant(&[
        (&format!("{planes}/from_mm"), json!(-BAND)),
        (&format!("{planes}/to_mm"), json!(BAND)),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/setups/0/stock/offset/allowance_mm", json!(STOCK)),
        ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
    ]);
    with_long_flute(&job, FLUTE);
    let mut file = job.json("job.json");
    let mut finish = file["operations"][0].clone();
    finish["name"] = json!("finish");
    let mut rough = finish.clone();
    rough["name"] = json!("rough");
    rough["allowance_mm"] = json!(LEFT);
    rough["layers"] = json!({ "from_mm": STOCK, "depth_mm": DEPTH });
    rough["tolerances"]["cusp_mm"] = json!(0.3);
    rough["feeds"]["removal_rate"] = json!({ "target_cm3_min": 9.0, "min_mm_min": 100.0 });
    file["operations"] = json!([rough, finish]);
    job.write("job.json", file.to_string().as_bytes());
    job
}

/// Returns the program of a tool, from 1.
fn program(k: usize) -> String {
    format!("out/program-top-{k}-tool.nc")
}

fn text(job: &JobFolder, name: &str) -> String {
    std::fs::read_to_string(job.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn report(job: &JobFolder, k: usize) -> Value {
    serde_json::from_str(&text(job, &format!("out/report-top-{k}-tool.json"))).expect("JSON")
}

/// Verifies a program with further words.
fn verified(job: &JobFolder, program: &str, more: &[String]) -> CommandOutput {
    let mut words: Vec<OsString> = vec!["verify".into(), job.path(program).into(), "--job".into(), job.job().into()];
    words.extend(more.iter().map(OsString::from));
    let output = run(&words);
    let (code, errors) = code_and_errors(&output);
    CommandOutput { code, printed: String::from_utf8(output.stdout).expect("text"), errors }
}

#[test]
fn layers_take_the_stock_one_by_one_and_no_body_meets_what_is_left() {
    let job = layers();
    let out = job.path("out");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", out.display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);

    // Points of stock, cut by the texts: no body meets one that is there, and each program leaves
    // its allowance on the band, to the cusp between its passes.
    let spec = PatchSpec::new([80.0, 80.0], 1.6, [1.2, 1.0]).expect("numbers in range");
    let surface = |x: f64, y: f64| spec.at(x, y).point.z;
    let mut points = RestPoints::over([[-39.5, -39.5], [39.5, 39.5]], STEPS, STOCK, surface);
    let budget = 0.1;
    let mut known = Job::read(&job.job()).expect("a job");
    let mut before = points.left.len();
    for (k, allowance) in [(1, LEFT + 0.5 * (STOCK - LEFT)), (2, LEFT), (3, 0.0)] {
        // The layer that a program leaves is that of its setup.
        let at_first = points.left.clone();
        let motions = interpreter::run(&text(&job, &program(k)));
        let met = points.cut(&ReadBack::of(&job, 0), &motions, STEP);
        assert!(met.is_empty(), "program {k}: {} points, first {:?}", met.len(), met[0]);
        assert!(points.left.len() < before, "program {k} cuts nothing");
        before = points.left.len();
        known.programs.add(k - 1, Some((job.path(&program(k)), text(&job, &program(k)).into_bytes())), Dialect::Fanuc);
        assert_bound(&known, k, &points, &at_first);
        let in_band = |p: &&RestPoint| p.place.y.abs() < BAND - 2.0 && p.place.x.abs() < 34.0;
        let of_band = || points.left.iter().filter(in_band).map(|p| p.height);
        let highest = of_band().fold(0.0, f64::max);
        let cusp = if k == 3 { 0.1 } else { 0.3 };
        assert!(highest <= allowance + cusp + budget, "program {k} leaves {highest} mm");
        let kept = of_band().filter(|h| *h < allowance - budget).count();
        let in_layer = |h: f64| h < allowance - budget;
        let all = RestPoints::over([[-39.5, -39.5], [39.5, 39.5]], STEPS, STOCK, surface);
        let all = all.left.iter().filter(|p| in_band(p) && in_layer(p.height)).count();
        assert_eq!(kept, all, "program {k} cuts into what it has to leave");
    }

    // Each is planned on what those before it may leave, and says so.
    let planned_on = |k: usize| report(&job, k)["stock"]["planned_on"].as_str().expect("a text").to_owned();
    assert_eq!(planned_on(1), "the setup's stock");
    assert!(planned_on(2).starts_with("all that \"top 1 tool\" may leave, on lines 0."), "{}", planned_on(2));
    assert!(planned_on(3).contains("\"top 1 tool\", \"top 2 tool\""), "{}", planned_on(3));
    let checked = facemill_in(&job, "check job.json");
    for words in
        ["T1: \"rough 1 of 2\", parallel planes, 2.2 mm left", "links are planned on all that may be left of it"]
    {
        assert!(checked.prints(&[words]), "{words}: {}", checked.printed);
    }

    // All in one text, verified part by part.
    let all = verified(&job, "out/program.nc", &[]);
    assert!(all.code == 0 && all.printed.matches("cutting length").count() == 3, "{}{}", all.printed, all.errors);

    // The first layer skipped: the second one meets stock above its flute, or takes more at a time
    // than it may.
    let (first, text_of_first) = (job.path(&program(1)), text(&job, &program(1)));
    let words = |more: &[&str]| -> Vec<String> {
        let alone = ["--setup", "top 2 tool", "--stock-cell-mm", "1"];
        alone.iter().chain(more).map(|word| (*word).to_owned()).collect()
    };
    let clean = verified(&job, &program(2), &words(&["--after", &format!("1={}", first.display())]));
    assert_eq!(clean.code, 0, "{}{}", clean.printed, clean.errors);
    let lines: Vec<&str> = text_of_first.lines().collect();
    let cut = lines.iter().position(|line| line.contains(" G1 ")).expect("a cut");
    let home = lines.iter().rposition(|line| line.ends_with("M9")).expect("coolant off");
    let without = [&lines[..cut], &lines[home..]].concat().join("\n") + "\n";
    job.write("without.nc", without.as_bytes());
    let without = format!("1={}", job.path("without.nc").display());
    let skipped = verified(&job, &program(2), &words(&["--after", &without]));
    assert_eq!(skipped.code, 1, "{}{}", skipped.printed, skipped.errors);
    for kind in ["cutter takes too much", "collision of the tool assembly"] {
        assert!(skipped.printed.contains(kind), "{kind}: {}", skipped.printed);
    }
    // In each pass, which has both layers before it, and more than it may take in some.
    let text_of_second = text(&job, &program(2));
    let lines: Vec<&str> = text_of_second.lines().collect();
    let is_pass = |line: usize| lines[line - 1].starts_with("(PASS ");
    let begins: Vec<usize> = (1..=lines.len()).filter(|line| is_pass(*line)).chain([lines.len()]).collect();
    let found = lines_of_findings(&skipped.printed, "stock");
    for pass in begins.windows(2) {
        let is_in = |[from, to]: &[usize; 2]| pass[0] < *to && *from < pass[1];
        assert!(found.iter().any(is_in), "nothing in lines {pass:?}: {}", skipped.printed);
    }
    let too_much = lines_of_findings(&skipped.printed, "cutter takes too much");
    let is_cut = |[from, to]: &[usize; 2]| (*from..=*to).all(|line| !is_pass(line) && !lines[line - 1].contains("G0 "));
    assert!(!too_much.is_empty() && too_much.iter().all(is_cut), "{too_much:?}: {}", skipped.printed);
}

/// Asserts that all points that are left behind some programs lie in the bound of the next one's
/// stock, and that most of those that the last one has cut do not.
fn assert_bound(known: &Job, programs: usize, points: &RestPoints, before: &[RestPoint]) {
    if programs == known.file.setups.len() {
        return;
    }
    let setup = Setup::read(known, programs).expect("a setup").after_programs(&known.for_setup(programs), &Silent);
    let setup = setup.expect("a bound");
    let bound = setup.stock_solid.as_ref().expect("a solid");
    let outside = points.certain(STEP).iter().filter(|p| !bound.is_inside(p)).count();
    assert_eq!(outside, 0, "of {} points that {programs} programs leave", points.left.len());
    let key = |p: &RestPoint| [p.place.x, p.place.y, p.place.z].map(f64::to_bits);
    let left: HashSet<[u64; 3]> = points.left.iter().map(key).collect();
    let cut: Vec<&RestPoint> = before.iter().filter(|p| !left.contains(&key(p))).collect();
    let known_to_be = cut.iter().filter(|p| !bound.is_inside(&p.place)).count();
    assert!(2 * known_to_be > cut.len(), "{known_to_be} of {} points are known to be cut", cut.len());
}

#[test]
fn a_turned_setup_begins_with_what_the_one_before_leaves_of_a_casting() {
    let casting = json!({ "mesh": { "file": "box.obj", "unit": "millimetre", "up_axis": "z" } });
    let job = assert_turned([&casting, &casting]);
    // Of a casting that is not closed the inside is not known: there is no bound.
    let first = text(&job, "out/program-top.nc");
    let open: Vec<String> = job_box().lines().map(str::to_owned).collect();
    let last = open.iter().rposition(|line| line.starts_with('f')).expect("a face");
    job.write("box.obj", (open[..last].join("\n") + "\n").as_bytes());
    let mut open = Job::read(&job.job()).expect("a job");
    open.programs.add(0, Some((job.path("out/program-top.nc"), first.into_bytes())), Dialect::Fanuc);
    let own = Setup::read(&open, 1).expect("a setup").after_programs(&open.for_setup(1), &Silent).expect("a setup");
    let why = own.planning_stock.to_string();
    assert!(why.starts_with("the setup's stock, because") && why.contains("closed"), "{why}");
}

#[test]
fn a_turned_setup_begins_with_what_the_one_before_leaves_of_a_box() {
    // The box is not square: turned by 90 deg its sides change places.
    let of = |x: f64, y: f64| json!({ "box": { "min_mm": [-x, -y, -6.0], "max_mm": [x, y, TURNED_TOP] } });
    let job = assert_turned([&of(41.0, 43.0), &of(43.0, 41.0)]);
    job.set("job.json", &[("/setups/1/stock", of(41.0, 43.0))]);
    let checked = facemill_in(&job, "check job.json");
    assert!(checked.prints(&["it is not where the part takes that of setup \"top\""]), "{}", checked.printed);
}

#[test]
fn a_turned_setup_begins_with_what_the_one_before_leaves_of_a_bar() {
    let of = |base: [f64; 3], axis: [f64; 3]| json!({ "cylinder": { "base_mm": base, "axis": axis, "radius_mm": 70.0, "height_mm": 6.0 + TURNED_TOP } });
    // Stated from its other end.
    let low = of([0.0, 0.0, -6.0], [0.0, 0.0, 1.0]);
    assert_turned([&low, &of([0.0, 0.0, TURNED_TOP], [0.0, 0.0, -1.0])]);
}

/// Height of the stock of the job with a turned setup, mm.
const TURNED_TOP: f64 = 3.5;

fn job_box() -> String {
    box_obj([-41.0, -41.0, -6.0], [41.0, 41.0, TURNED_TOP])
}

/// Asserts that a setup that is turned by 90 deg begins with what the one before leaves, each with
/// a stock of its own; returns the job, planned.
fn assert_turned(stocks: [&Value; 2]) -> JobFolder {
    let planes = "/operations/0/path/strategy/strategy/parallel_planes";
    let top = TURNED_TOP;
    let job = variant(&[
        (&format!("{planes}/from_mm"), json!(-BAND)),
        (&format!("{planes}/to_mm"), json!(BAND)),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/setups/0/stock", stocks[0].clone()),
        ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
    ]);
    job.write("box.obj", job_box().as_bytes());
    with_long_flute(&job, 8.0);
    let mut file = job.json("job.json");
    let mut turned = file["setups"][0].clone();
    (turned["name"], turned["work_from_part"]) = (json!("turned"), json!({ "rotation_deg": 90.0 }));
    turned["stock"] = stocks[1].clone();
    let mut first = file["operations"][0].clone();
    (first["setup"], first["allowance_mm"]) = (json!("top"), json!(LEFT));
    let mut second = file["operations"][0].clone();
    (second["setup"], second["name"]) = (json!("turned"), json!("finish"));
    file["setups"].as_array_mut().expect("setups").push(turned);
    file["operations"] = json!([first, second]);
    job.write("job.json", file.to_string().as_bytes());
    let planned = facemill_in(&job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    let report: Value = serde_json::from_str(&text(&job, "out/report-turned.json")).expect("JSON");
    assert_eq!(report["stock"]["began_as"], "the rest of setup \"top\"");
    let planned_on = report["stock"]["planned_on"].as_str().expect("a text");
    assert!(planned_on.starts_with("all that \"top\" may leave"), "{planned_on}");

    // Points cut by the first program and turned with the part lie in the bound, and no body of the
    // second one meets them.
    let spec = PatchSpec::new([80.0, 80.0], 1.6, [1.2, 1.0]).expect("numbers in range");
    let surface = |x: f64, y: f64| spec.at(x, y).point.z;
    let mut points = RestPoints::over([[-39.5, -39.5], [39.5, 39.5]], STEPS, STOCK, surface);
    points.left.retain(|p| p.place.z < top - 0.05);
    let first = text(&job, "out/program-top.nc");
    let met = points.cut(&ReadBack::of(&job, 0), &interpreter::run(&first), STEP);
    assert!(met.is_empty(), "{} points, first {:?}", met.len(), met[0]);
    points.left.iter_mut().for_each(|p| p.place = Point3::new(-p.place.y, p.place.x, p.place.z));
    let mut known = Job::read(&job.job()).expect("a job");
    known.programs.add(0, Some((job.path("out/program-top.nc"), first.into_bytes())), Dialect::Fanuc);
    let setup = Setup::read(&known, 1).expect("a setup").after_programs(&known.for_setup(1), &Silent).expect("a bound");
    let bound = setup.stock_solid.as_ref().expect("a solid");
    let outside = points.certain(STEP).iter().filter(|p| !bound.is_inside(p)).count();
    assert_eq!(outside, 0, "of {} points", points.left.len());
    // The band that the first program has cut is along y here.
    assert!(!bound.is_inside(&Point3::new(0.0, 20.0, 3.0)) && bound.is_inside(&Point3::new(20.0, 0.0, 3.0)));
    let second = text(&job, "out/program-turned.nc");
    let met = points.cut(&ReadBack::of(&job, 1), &interpreter::run(&second), STEP);
    assert!(met.is_empty(), "{} points, first {:?}", met.len(), met[0]);
    job
}

#[test]
fn programs_of_other_jobs_count_with_their_tool_and_without_faults() {
    let job = layers();
    let out = job.path("out");
    let planned = facemill_in(&job, &format!("plan job.json --no-html --no-verify --out {}", out.display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    let first = text(&job, &program(1));
    let mut file = job.json("job.json");
    file["operations"].as_array_mut().expect("operations").remove(0);
    let mut alone = |program: &str, tool: Option<&str>| {
        job.write("before.nc", program.as_bytes());
        let mut before = json!({ "file": "before.nc" });
        if let Some(tool) = tool {
            before["tool"] = json!(tool);
        }
        file["setups"][0]["programs_before"] = json!([before]);
        job.write("job.json", file.to_string().as_bytes());
        facemill_in(&job, "check job.json")
    };
    let good = alone(&first, None);
    assert!(good.code == 0 && good.prints(&["cut by 1 program(s) of other jobs"]), "{}{}", good.printed, good.errors);
    let wrong = alone(&first.replace("T1 M6", "T4 M6"), None);
    assert!(wrong.code == 2 && wrong.errors.contains("calls another tool than T1"), "{}", wrong.errors);
    let mut other = job.json("tool.json");
    other["number"] = json!(4);
    job.write("other.json", other.to_string().as_bytes());
    let wrong = alone(&first, Some("other.json"));
    assert!(wrong.code == 2 && wrong.errors.contains("calls another tool than T4"), "{}", wrong.errors);
    let nothing: Vec<&str> = first.lines().filter(|line| !line.contains('X') && !line.contains('Z')).collect();
    let wrong = alone(&nothing.join("\n"), None);
    assert!(wrong.code == 2 && wrong.errors.contains("no move at a feed"), "{}{}", wrong.printed, wrong.errors);
}

/// Half sides of a plate, its casting around it on all sides, and the material on its top, mm.
const PLATE: [f64; 2] = [22.0, 16.0];
const AROUND: f64 = 5.0;

/// Returns a job that roughs the top of a plate in two layers and finishes it, from a casting that
/// reaches beyond its sides; passes run on by so many mm.
fn plate(extend: f64) -> JobFolder {
    let stock = json!({ "mesh": { "file": "casting.obj", "unit": "millimetre", "up_axis": "z" } });
    let mesh = json!([{ "file": "plate.obj", "role": "drive", "unit": "millimetre", "up_axis": "z" }]);
    let up = json!({ "normal_cone": { "axis": [0.0, 0.0, 1.0], "half_angle_deg": 5.0 }, "extend_mm": extend });
    let job = variant(&[
        ("/operations/0/path/strategy/region", up),
        ("/operations/0/path/strategy/strategy", json!({ "parallel_planes": { "normal": [0.0, 1.0, 0.0] } })),
        ("/operations/0/tolerances/max_step_mm", json!(4.0)),
        ("/setups/0/meshes", mesh),
        ("/setups/0/stock", stock),
        ("/setups/0/clearance/plane/origin_mm/2", json!(30.0)),
    ]);
    let [x, y] = PLATE;
    job.write("plate.obj", box_obj([-x, -y, -8.0], [x, y, 0.0]).as_bytes());
    let (far_x, far_y) = (x + AROUND, y + AROUND);
    job.write("casting.obj", box_obj([-far_x, -far_y, -8.5], [far_x, far_y, STOCK]).as_bytes());
    with_long_flute(&job, 2.0 * FLUTE);
    let mut file = job.json("job.json");
    let mut finish = file["operations"][0].clone();
    finish["name"] = json!("finish");
    let mut rough = finish.clone();
    rough["name"] = json!("rough");
    rough["allowance_mm"] = json!(LEFT);
    rough["layers"] = json!({ "from_mm": STOCK, "depth_mm": DEPTH });
    rough["tolerances"]["cusp_mm"] = json!(0.3);
    file["operations"] = json!([rough, finish]);
    job.write("job.json", file.to_string().as_bytes());
    job
}

/// Returns the points of the casting above the top of the plate that the programs of its job leave,
/// and the heights of those that lie beyond the plate's sides.
fn plate_cut(job: &JobFolder) -> (RestPoints, Vec<f64>) {
    let planned = facemill_in(job, &format!("plan job.json --no-html --out {}", job.path("out").display()));
    assert_eq!(planned.code, 0, "{}{}", planned.printed, planned.errors);
    let far = [PLATE[0] + AROUND - 0.5, PLATE[1] + AROUND - 0.5];
    let mut points = RestPoints::over([far.map(|f| -f), far], (1.5, 0.2), STOCK, |_, _| 0.0);
    for k in 1..=3 {
        let met = points.cut(&ReadBack::of(job, 0), &interpreter::run(&text(job, &program(k))), STEP);
        assert!(met.is_empty(), "program {k}: {} points, first {:?}", met.len(), met[0]);
    }
    let is_beyond = |p: &&RestPoint| p.place.x.abs() > PLATE[0] || p.place.y.abs() > PLATE[1];
    let beyond = points.left.iter().filter(is_beyond).map(|p| p.height).collect();
    (points, beyond)
}

#[test]
fn passes_that_run_on_beyond_the_border_take_the_casting_there() {
    let (left, _) = plate_cut(&plate(AROUND + 1.0));
    // The cusp of the finish, and the budget of the text.
    let highest = left.left.iter().map(|p| p.height).fold(0.0, f64::max);
    assert!(highest <= 0.2, "{highest} mm is left of {STOCK}");
    let (_, beyond) = plate_cut(&plate(0.0));
    assert!(beyond.iter().any(|height| *height > STOCK - 0.2), "passes end at the border: {beyond:?}");
}

#[test]
fn wrong_layers_are_refused() {
    let refused = |values: &[(&str, Value)], words: &[&str]| {
        let job = layers();
        job.set("job.json", values);
        let done = facemill_in(&job, "check job.json");
        let is_named = words.iter().all(|word| done.errors.contains(word));
        assert!(done.code == 2 && is_named, "{words:?}: {}{}", done.printed, done.errors);
    };
    refused(
        &[("/operations/0/layers/from_mm", json!(3.0))],
        &["layers.from_mm", "the stock is 4.00 mm above", "3.00 mm"],
    );
    refused(
        &[("/operations/0/layers/depth_mm", json!(3.5))],
        &["layers.depth_mm", "longer flute than that of T1, 3 mm"],
    );
    refused(&[("/operations/0/allowance_mm", json!(4.0))], &["operations[0].layers.from_mm", "allowance_mm, 4 mm"]);
    refused(&[("/operations/0/layers/depth_mm", json!(0.011))], &["operations[0].layers.depth_mm", "more than 200"]);
    refused(
        &[(
            "/operations/0/path/strategy/region",
            json!({ "left_above": { "height_mm": 0.1, "overlap_mm": 1.0, "of": "initial_stock" } }),
        )],
        &["operations[0].layers", "leave out path.strategy.region.left_above"],
    );
    let region = "/operations/0/path/strategy/region";
    refused(&[(region, json!({ "extend_mm": 101.0 }))], &["region.extend_mm", "from 0 to 100"]);
    refused(
        &[
            (region, json!({ "extend_mm": 2.0 })),
            ("/operations/0/path/strategy/strategy", json!({ "edge": { "width_mm": 2.0 } })),
        ],
        &["operations[0].path.strategy.region.extend_mm", "leave it out"],
    );
    refused(&[("/setups/0/rest_cell_mm", json!(0.0))], &["setups[0].rest_cell_mm", "0.05"]);
    refused(&[("/setups/0/programs_before", json!([{ "file": "none.nc" }]))], &["none.nc"]);
}
