//! Figures of the sample job in the pages against the stored summary of its plan. `.ci/run`
//! compares that with a plan.

use facemill::virtual_machine::FindingKind;
use facemill_tests::shared::workspace;
use facemill_tests::tables::sample_figures::{PAGES, SampleFigures};

#[test]
fn figures_of_the_sample_in_the_pages_are_those_of_its_plan() {
    let figures = SampleFigures::stored().unwrap();
    for name in PAGES {
        let page = std::fs::read_to_string(workspace().join(name)).unwrap();
        assert!(page.contains("<!-- sample "), "{name} has no figure of the sample");
        let rewritten = figures.rewritten(&page).unwrap();
        let differs = page.lines().zip(rewritten.lines()).find(|(is, must)| is != must);
        assert!(
            page == rewritten,
            "{name} differs from tests/sample-summary.txt; write it anew: cargo run -p facemill-tests --bin sample-figures -- \
             tests/sample-summary.txt --write\nfirst line that differs: {differs:?}"
        );
    }
}

/// Other figures of a plan change a page: otherwise the test above could not fail.
#[test]
fn another_plan_and_a_broken_mark_are_found() {
    let figures = SampleFigures::stored().unwrap();
    let page = "<!-- sample machine -->?<!-- end of sample --> <!-- sample passes --><!-- end of sample -->\n";
    let written = figures.rewritten(page).unwrap();
    assert_eq!(figures.rewritten(&written).unwrap(), written);
    let other = figures.text().replacen("cutting time      ", "cutting time      1", 1);
    let other = SampleFigures::of_summary(&format!("{other}  written to out/propeller: program.nc\n"));
    assert!(figures.first_difference(&other).is_some_and(|[is, _]| is.starts_with("  cutting time")));
    assert_ne!(other.rewritten(page).unwrap(), written);
    assert!(figures.rewritten("<!-- sample machine -->").is_err());
    assert!(figures.rewritten("<!-- sample weight --><!-- end of sample -->").is_err());
}

#[test]
fn kinds_of_findings_that_ci_spares_are_those_that_are_no_faults() {
    let text = |name: &str| std::fs::read_to_string(workspace().join(name)).unwrap();
    let run = text(".ci/run");
    let (_, spared) = run.split_once("def no_fault: IN(").expect("the kinds that .ci/run spares");
    let spared: Vec<&str> = spared.split(')').next().unwrap().split(", ").map(|kind| kind.trim_matches('"')).collect();
    let schema: serde_json::Value = serde_json::from_str(&text("docs/schemas/report.json")).unwrap();
    let kinds = schema["$defs"]["FindingKind"]["oneOf"].as_array().unwrap();
    let is_fault = |kind: &serde_json::Value| serde_json::from_value::<FindingKind>(kind.clone()).unwrap().is_fault();
    let no_faults: Vec<&str> =
        kinds.iter().map(|k| &k["const"]).filter(|k| !is_fault(k)).filter_map(|k| k.as_str()).collect();
    assert_eq!(spared, no_faults);
    assert!(kinds.len() > 20, "{} kinds", kinds.len());
}
