//! Part, stock, machine and tool named one by one mean what the same files mean in a job.

use std::path::Path;

use facemill::formats::VerificationFile;
use facemill::nc_program::Dialect;
use facemill::virtual_machine::FindingKind;
use facemill::{
    AD_HOC_GOUGE_LIMIT, AdHocSetup, AdHocStock, CutRequest, Job, SilentStages, VerifyRequest, verify_program,
};
use facemill_tests::jobs::JobFolder;
use facemill_tests::shared::workspace;
use serde_json::json;

use super::{ALLOWANCE, TABLE, plate, program};

fn stand(job: &JobFolder) -> AdHocSetup {
    AdHocSetup {
        part: job.path("plate.obj"),
        fixtures: Vec::new(),
        unit: None,
        up_axis: None,
        stock: AdHocStock::Offset(ALLOWANCE),
        machine: job.path("machine.json"),
        tool: job.path("tool.json"),
        length_register: None,
        dialect: Dialect::Fanuc,
        dialect_file: None,
        mount: [0.0, 0.0, TABLE],
        work_offset: [0.0; 3],
        register: "G54".to_owned(),
    }
}

fn run(job: &Job, text: &str) -> VerificationFile {
    let cut = CutRequest::on_lines(1.0, 0.01);
    let request = VerifyRequest {
        gouge_limit: Some(AD_HOC_GOUGE_LIMIT),
        cut: Some(cut),
        ..VerifyRequest::new(Path::new("program.nc"), Dialect::Fanuc)
    };
    verify_program(job, text.as_bytes(), &request, &SilentStages).unwrap_or_else(|e| panic!("{e}")).file
}

#[test]
fn a_program_has_the_same_findings_by_a_job_and_by_its_files() {
    let job = plate();
    // Paths of a job are beside it; those of a stand are the caller's.
    let file = job.path("plate.obj").display().to_string();
    let meshes = ("/setups/0/meshes", json!([{ "file": file, "role": "drive" }]));
    job.set("job.json", &[meshes, facemill_tests::jobs::unfinished()]);
    // Too deep in one place, and beyond the stock at rapid rate in another.
    let text = program(1, 0.15).replace("F2000.", "F1000.").replace("M30", "G0 X-30. Y0. Z-180.\nM30");
    let by_job = run(&Job::read(&job.job()).unwrap(), &text);
    let findings = |found: &VerificationFile| serde_json::to_value(&found.verification.findings).unwrap();
    let all = findings(&by_job);
    let kinds: Vec<&str> = all.as_array().unwrap().iter().filter_map(|f| f["kind"].as_str()).collect();
    assert!(kinds.contains(&"gouge") && kinds.len() > 1, "{kinds:?}");

    let by_files = run(&Job::of_ad_hoc_setup(&stand(&job)).unwrap(), &text);
    assert_eq!(findings(&by_files), all);
    let stock = |found: &VerificationFile| serde_json::to_value(&found.stock).unwrap();
    assert_eq!(stock(&by_files), stock(&by_job));

    // Other statements have other findings.
    let other = |change: &dyn Fn(&mut AdHocSetup)| {
        let mut stand = stand(&job);
        change(&mut stand);
        run(&Job::of_ad_hoc_setup(&stand).unwrap(), &text)
    };
    assert_ne!(findings(&other(&|s| s.length_register = Some(7))), all);
    assert_ne!(findings(&other(&|s| s.register = "G55".to_owned())), all);
    assert_ne!(findings(&other(&|s| s.work_offset = [0.0, 0.0, -1.0])), all);
    // A function of the machine builder is harmless where a dialect file says so.
    let own = std::fs::read(workspace().join("crates/nc-program/dialects/fanuc.json")).unwrap();
    let mut rules: serde_json::Value = serde_json::from_slice(&own).unwrap();
    rules["harmless_functions"].as_array_mut().unwrap().push(json!(202));
    job.write("dialect.json", rules.to_string().as_bytes());
    let counted = |dialect_file| {
        let job = Job::of_ad_hoc_setup(&AdHocSetup { dialect_file, ..stand(&job) }).unwrap();
        let found = run(&job, &text.replace("M30", "M202\nM30"));
        found.verification.findings.iter().filter(|f| f.kind == FindingKind::UnknownFunction).count()
    };
    assert_eq!([counted(None), counted(Some(job.path("dialect.json")))], [1, 0]);
    // A program that flies above the stock says so, and one that meets it does not.
    let in_air = |found: &VerificationFile| found.assumptions.iter().any(|a| a.text.contains("removes stock"));
    let above = other(&|s| s.mount = [0.0, 0.0, TABLE - 50.0]);
    assert!(in_air(&above) && !in_air(&by_files));
    assert_ne!(findings(&above), all);
    // The box is the plate of 30 x 30 x 6 mm itself.
    let boxed = other(&|s| s.stock = AdHocStock::Box).stock.unwrap();
    assert!((boxed.before_mm3 - 5400.0).abs() < 1e-6 * 5400.0, "{boxed:?}");
    let meshed = other(&|s| s.stock = AdHocStock::Mesh(s.part.clone())).stock.unwrap();
    assert!((meshed.before_mm3 - 5400.0).abs() < 1e-6 * 5400.0, "{meshed:?}");
}

#[test]
fn what_is_wrong_with_a_stand_is_named() {
    let job = plate();
    let refused = |change: &dyn Fn(&mut AdHocSetup)| {
        let mut stand = stand(&job);
        change(&mut stand);
        Job::of_ad_hoc_setup(&stand).err().expect("it is wrong").to_string()
    };
    let missing = refused(&|s| s.machine = "missing.json".into());
    assert!(missing.contains("cannot read missing.json"), "{missing}");
    let register = refused(&|s| s.length_register = Some(0));
    assert!(register.contains("tool.json") && register.contains("length_register"), "{register}");
    let thin = refused(&|s| s.stock = AdHocStock::Offset(-1.0));
    assert!(thin.contains("stock.offset.allowance_mm"), "{thin}");
    let far = refused(&|s| s.mount = [f64::INFINITY, 0.0, 0.0]);
    assert!(far.contains("mount") && far.contains("finite"), "{far}");
    let high = refused(&|s| s.mount = [0.0, 0.0, 1e7]);
    assert!(high.contains("table_from_work.translation_mm"), "{high}");
}
