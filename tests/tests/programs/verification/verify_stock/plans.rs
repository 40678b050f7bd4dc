//! Plans that cut their own stock: the report agrees with geometry and the text alone.

use std::path::Path;

use facemill::nc_program::Dialect;
use facemill::report::stock::StockReport;
use facemill::virtual_machine::FindingKind;
use facemill::{CutRequest, Job, PlanSettings, Planned, SilentStages, VerifyRequest, plan_job, verify_program};
use facemill_tests::jobs::{JobFolder, text_of};
use facemill_tests::variants::{tiny_patch, variant};
use serde_json::{Value, json};

const SETTINGS: PlanSettings = PlanSettings { verify: true, certificates: false };

fn plans(job: &JobFolder, cell: Option<f64>) -> Vec<Planned> {
    let job = Job::read(&job.job()).unwrap_or_else(|e| panic!("{e}"));
    plan_job(&job, SETTINGS, cell, &SilentStages).unwrap_or_else(|e| panic!("{e}"))
}

fn cut(planned: &Planned) -> &StockReport {
    planned.report.stock.cut.as_ref().unwrap_or_else(|| panic!("not cut: {:?}", planned.report.stock))
}

/// The plan cuts what the text alone, run as a program from anywhere on the same lines, cuts. The
/// patch is a layer of known thickness: under six passes beside each other all of it goes but the
/// cusps, and nowhere more than all of it.
#[test]
fn a_plan_cuts_what_its_text_cuts() {
    let job = tiny_patch();
    let planned = plans(&job, None).remove(0);
    assert!(planned.is_clean(), "{:?}", planned.report.findings);
    let reported = cut(&planned);
    assert_eq!(planned.report.stock.began_as.as_deref(), Some("the setup's stock"));
    assert_eq!((reported.cell_mm, reported.blocks_not_covered), (1.0, 0));

    let text = text_of(&planned, "program.nc");
    let whole = CutRequest::on_lines(1.0, 0.05);
    let request = VerifyRequest { cut: Some(whole), ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc) };
    let read = Job::read(&job.job()).unwrap();
    let run = verify_program(&read, text.as_bytes(), &request, &SilentStages).unwrap();
    let own = run.file.stock.unwrap();
    assert!((own.removed_mm3 - reported.removed_mm3).abs() < 1e-6 * own.removed_mm3, "{own:?} {reported:?}");
    assert_eq!(own.blocks_in_air, reported.blocks_in_air);
    let rest = planned.rest.as_ref().unwrap().volume();
    assert!((reported.before_mm3 - reported.removed_mm3 - rest).abs() < 1e-6 * reported.before_mm3);

    // The strip that six passes from y = -4 to 4 lie in, and what the cutter reaches beside it.
    let (file, tool) = (job.json("job.json"), job.json("tool.json"));
    let thickness = file["setups"][0]["stock"]["offset"]["allowance_mm"].as_f64().unwrap();
    let [cusp, radius] =
        [&file["operations"][0]["tolerances"]["cusp_mm"], &tool["radius_mm"]].map(|v| v.as_f64().unwrap());
    let least = 60.0 * 8.0 * (thickness - cusp);
    // The waves make the layer no more than a fifth longer than it is from above.
    let most = 1.2 * (80.0 + 2.0 * thickness) * (8.0 + 4.0 * radius) * thickness;
    assert!(reported.removed_mm3 > least && reported.removed_mm3 < most, "{least} {} {most}", reported.removed_mm3);
}

/// Two setups, each of which cuts half of the passes, the second one as `change` says.
fn in_two(change: impl Fn(&mut Value)) -> JobFolder {
    let job = tiny_patch();
    let file = job.json("job.json");
    let mut second = file["setups"][0].clone();
    second["name"] = json!("second");
    second["work_offset"] = json!({ "register": "G55" });
    change(&mut second);
    let half = |setup: &Value, from: f64, to: f64| {
        let mut operation = file["operations"][0].clone();
        operation["setup"] = setup["name"].clone();
        operation["name"] = json!(format!("from {from}"));
        let planes = &mut operation["path"]["strategy"]["strategy"]["parallel_planes"];
        (planes["from_mm"], planes["to_mm"]) = (json!(from), json!(to));
        operation
    };
    let first = &file["setups"][0];
    let operations = json!([half(first, -4.0, -1.0), half(&second, 1.0, 4.0)]);
    job.set("job.json", &[("/setups", json!([first, second])), ("/operations", operations)]);
    job
}

#[test]
fn a_setup_in_the_same_frame_begins_with_what_the_one_before_has_left() {
    let of_two = plans(&in_two(|_| {}), Some(2.0));
    let [first, second] = [&of_two[0], &of_two[1]].map(cut);
    let left = first.before_mm3 - first.removed_mm3;
    assert!((second.before_mm3 - left).abs() < 1e-6 * left, "{first:?} {second:?}");
    assert!(second.removed_mm3 > 0.0 && second.blocks_not_covered == 0);
    let name = &of_two[0].report.setup;
    assert_eq!(of_two[1].report.stock.began_as, Some(format!("the rest of setup \"{name}\"")));
}

#[test]
fn a_setup_in_another_frame_or_with_other_stock_begins_with_its_own_and_says_why() {
    let turned = |s: &mut Value| s["work_from_part"] = json!({ "rotation_axis": [0, 0, 1], "rotation_deg": 90 });
    let thinner = |s: &mut Value| s["stock"]["offset"]["allowance_mm"] = json!(0.1);
    for (change, why) in [(&turned as &dyn Fn(&mut Value), "workpiece frame"), (&thinner, "not stated as")] {
        let of_two = plans(&in_two(change), Some(4.0));
        let reported = of_two[1].report.stock.began_as.as_ref().unwrap();
        assert!(reported.starts_with("the setup's stock: ") && reported.contains(why), "{reported}");
        let own = cut(&of_two[1]);
        assert!((own.before_mm3 - cut(&of_two[0]).before_mm3).abs() > 1e-3, "{own:?}");
    }
}

/// Lines that are farther apart than the rapid clearance say nothing of rapids that are proven to
/// keep off the stock as it was at first.
#[test]
fn lines_far_apart_are_no_findings_of_a_program_that_keeps_off_the_stock() {
    let with = &plans(&tiny_patch(), Some(30.0))[0];
    assert!(with.is_clean() && with.report.verified && with.report.findings.is_empty(), "{:?}", with.report.findings);
    assert!(with.report.stock.cut.is_some());
    let without = &plans(&variant(&[("/verification", json!({ "cut_stock": false }))]), Some(30.0))[0];
    assert!(without.is_clean(), "{:?}", without.report.findings);
    let why = without.report.stock.not_cut_because.as_ref().unwrap();
    assert!(why.contains("verification.cut_stock") && without.rest.is_none(), "{why}");
}

/// A template that goes straight down behind the last pass: how steep that is, the cut stock alone
/// tells where links go through what has been cut.
#[test]
fn what_meets_the_cut_stock_rejects_the_program() {
    let job = tiny_patch();
    let plain = &plans(&job, None)[0];
    let text = String::from_utf8(plain.files.iter().find(|(name, _)| name == "program.nc").unwrap().1.clone()).unwrap();
    let is_cut = |line: &&str| ["X", "Y", "Z", "B", "C"].iter().all(|word| line.contains(&format!(" {word}")));
    let cuts: Vec<&str> = text.lines().filter(is_cut).collect();
    let words: Vec<&str> = cuts[cuts.len() / 2].split(' ').filter(|w| !w.starts_with(['N', 'F', 'G'])).collect();
    let z = words.iter().find_map(|word| word.strip_prefix('Z')).unwrap();
    let at = |height: f64| format!("Z{:.3}", z.parse::<f64>().unwrap() + height);
    let over = words.join(" ").replace(&format!("Z{z}"), &at(30.0));
    let down = format!("{{{{ body }}}}\nG0 {over}\nG1 {} F500.\nG0 {}\n", at(-0.3), at(30.0));
    let template = Dialect::Fanuc.template().text.replacen("{{ body }}\n", &down, 1);
    assert!(template.contains(&down), "{template}");
    job.write("shop.j2", template.as_bytes());
    job.set("job.json", &[("/post/template", json!("shop.j2")), ("/setups/0/links", json!({ "stock": "as_cut" }))]);
    let with = &plans(&job, Some(1.0))[0];
    let all = &with.report.findings;
    let steep = all.iter().filter(|f| f.kind == FindingKind::RampTooSteep);
    assert!(steep.clone().count() > 0 && steep.clone().all(|f| f.obstacle.as_deref() == Some("stock")), "{all:?}");
    assert!(!with.is_clean() && with.report.verified);
    assert!(with.files.iter().any(|(name, _)| name == "program.rejected.nc"));
}

/// Where nobody asks for a distance of lines, stock that cannot be cut is no fault of the program;
/// where somebody does, it is one of the job.
#[test]
fn stock_that_cannot_be_cut_is_reported() {
    // The patch is an open mesh: without anything on it there is no solid.
    let bare = variant(&[("/setups/0/stock/offset/allowance_mm", json!(0.0))]);
    let planned = &plans(&bare, None)[0];
    let why = planned.report.stock.not_cut_because.as_ref().unwrap();
    assert!(planned.is_clean() && planned.report.verified && why.contains("not closed"), "{why}");
    let read = Job::read(&bare.job()).unwrap();
    let requested = plan_job(&read, SETTINGS, Some(1.0), &SilentStages).err().unwrap().to_string();
    assert!(requested.contains("not closed") && requested.contains("job.json"), "{requested}");
    let settings = PlanSettings { verify: false, ..SETTINGS };
    let unverified = &plan_job(&read, settings, None, &SilentStages).unwrap()[0];
    assert!(!unverified.report.verified && unverified.report.stock.cut.is_none());
    assert_eq!(unverified.report.stock.not_cut_because.as_deref(), Some("the program was not verified"));
}
