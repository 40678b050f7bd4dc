//! Programs that must not be run, and feeds in the stock.

use facemill_tests::jobs::JobFolder;
use facemill_tests::oracles::read_back::{TipAndAxis, number};
use facemill_tests::program::{code_and_errors, run};
use facemill_tests::variants::{CUTTING, planned, tiny_patch, variant};
use serde_json::json;

/// The header's template without the line that switches length compensation on.
fn without_length_compensation() -> String {
    let template = include_str!("../../../../crates/nc-program/templates/fanuc.j2");
    let kept: Vec<&str> = template.lines().filter(|l| !l.starts_with("G0 G90 G43 ")).collect();
    assert!(kept.len() < template.lines().count());
    kept.join("\n") + "\n"
}

fn programs(job: &JobFolder) -> Vec<String> {
    let entries = std::fs::read_dir(job.path("out")).into_iter().flatten();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|n| n.ends_with(".nc") || n.ends_with(".apt"));
    names.sort();
    names
}

fn plan(job: &JobFolder) -> (i32, String) {
    let (file, out) = (job.job(), job.path("out"));
    code_and_errors(&run(&["plan".as_ref(), file.as_os_str(), "--out".as_ref(), out.as_os_str()]))
}

#[test]
fn a_program_with_faults_has_a_name_of_its_own_and_remains_of_an_earlier_plan_are_reported() {
    let job = tiny_patch();
    assert_eq!(plan(&job).0, 0);
    assert_eq!(programs(&job), ["program.apt", "program.nc"]);

    job.write("post.j2", without_length_compensation().as_bytes());
    job.set("job.json", &[("/post/template", json!("post.j2"))]);
    assert_eq!(plan(&job).0, 4);
    assert_eq!(programs(&job), ["program.rejected.apt", "program.rejected.nc"]);

    job.set("job.json", &[("/post/template", json!(null))]);
    assert_eq!(plan(&job).0, 0);
    assert_eq!(programs(&job), ["program.apt", "program.nc"]);

    // No tool axis within a degree of straight down.
    let cone = json!({ "axis": [0, 0, -1], "half_angle_deg": 1 });
    job.set("job.json", &[("/operations/0/search/tool_axis_cone", cone)]);
    let (code, errors) = plan(&job);
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("program.nc") && errors.contains("an earlier plan"), "{errors}");
    assert_eq!(programs(&job), ["program.earlier.apt", "program.earlier.nc"]);
}

#[test]
fn in_the_stock_nothing_is_faster_than_the_cuts() {
    let fast = 3000.0;
    let job = variant(&[("/operations/0/feeds/approach_mm_min", json!(fast))]);
    let allowance = number(&job.json("job.json")["setups"][0]["stock"]["offset"]["allowance_mm"]);
    let written = planned(&job);
    let (mut at_approach, mut slowed) = (0, 0);
    let mut feeds = written.feeds.iter().copied();
    for m in &written.motions {
        let Some(feed) = feeds.next().flatten() else { continue };
        // Of the whole motion the cutter's smallest distance from the part, by brute force.
        let back = &written.back;
        let gap = |(tip, axis): &TipAndAxis| {
            back.grounds
                .iter()
                .map(|g| g.bins.gap(&back.cutter, tip, axis, 2.0 * allowance))
                .fold(f64::INFINITY, f64::min)
        };
        let nearest = back.places(m, 0.5).iter().map(gap).fold(f64::INFINITY, f64::min);
        if feed > CUTTING {
            assert_eq!(feed, fast);
            assert!(nearest >= allowance - 0.05, "line {}: {feed} mm/min {nearest} mm above the part", m.line);
            at_approach += 1;
        } else {
            slowed += usize::from(nearest > 0.2 * allowance);
        }
    }
    assert!(at_approach > 0 && slowed > 0, "{at_approach} {slowed}");
}
