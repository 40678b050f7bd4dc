use facemill_virtual_machine::FindingKind;

use crate::program::link_search::*;

/// Lines of the runs of the tests in the written program.
const LINES: [[u32; 2]; 3] = [[10, 12], [20, 20], [30, 34]];

fn lines_of_run(run: usize) -> Option<[u32; 2]> {
    LINES.get(run).copied()
}

fn link(run: Option<usize>, is_faster: bool) -> SearchedLink {
    let faster = is_faster.then(|| FasterPath { kind: RetractStrategy::Direct, time: 1.0, over: Vec::new() });
    SearchedLink { run, lines: [1, 2], time_before: 3.0, lower_bound: 0.5, faster, kept_because: None }
}

/// Returns a link that stays, three that do not, and one whose run the program no longer has.
fn searched() -> SearchedLinks {
    let kept = SearchedLink { kept_because: Some("it must".to_owned()), ..link(None, false) };
    let faster = [0, 1, 2, 7].map(|run| link(Some(run), true));
    SearchedLinks { clearance: 5.0, is_by_law: false, links: [kept].into_iter().chain(faster).collect() }
}

fn finding(first_line: u32, last_line: u32) -> Finding {
    let finding = Finding::of_line(FindingKind::RapidCollision, first_line, None, "", String::new());
    let [body, obstacle] = ["holder", "clamp"].map(|body| Some(body.to_owned()));
    Finding { last_line, body, obstacle, ..finding }
}

/// Returns the indices of the runs whose faster paths are removed.
fn removed(links: &mut SearchedLinks, doubts: (&[Finding], &[u32]), with_all: bool) -> Vec<usize> {
    links.take_back(&lines_of_run, doubts, with_all).into_iter().map(|(run, _)| run).collect()
}

#[test]
fn the_links_on_lines_in_doubt_are_restored_alone() {
    for (findings, open, runs) in [
        (vec![], vec![], vec![]),
        // Between the runs, and on the lines at the search.
        (vec![finding(13, 19)], vec![1, 2, 21, 29], vec![]),
        (vec![finding(12, 19)], vec![], vec![0]),
        (vec![finding(1, 10)], vec![34], vec![0, 2]),
        (vec![finding(11, 30)], vec![], vec![0, 1, 2]),
        (vec![], vec![20], vec![1]),
    ] {
        let mut links = searched();
        assert_eq!(removed(&mut links, (&findings, &open), false), runs, "{findings:?} {open:?}");
        let left: Vec<usize> = links.faster_paths().map(|(run, _)| run).collect();
        assert_eq!(left, [0, 1, 2, 7].into_iter().filter(|run| !runs.contains(run)).collect::<Vec<_>>());
        // Restored links cannot be restored again.
        assert!(removed(&mut links, (&findings, &open), true).is_empty());
    }
}

#[test]
fn all_links_are_restored_only_if_one_is_in_doubt() {
    let mut links = searched();
    assert!(removed(&mut links, (&[finding(13, 19)], &[]), true).is_empty());
    assert_eq!(removed(&mut links, (&[finding(20, 20)], &[20, 34]), true), [0, 1, 2, 7]);
    let reasons: Vec<Option<&str>> = links.links.iter().map(|link| link.kept_because.as_deref()).collect();
    let others = Some("with faster paths of some links the program repeatedly has findings");
    let kind = FindingKind::RapidCollision;
    let found = format!("the faster path has a finding: {kind}, holder at clamp");
    let open = Some("the faster path could not be certified");
    // A finding takes precedence over an open line.
    assert_eq!(reasons, [Some("it must"), others, Some(&*found), open, others]);
}

#[test]
fn the_report_has_the_lines_and_times_of_the_written_program() {
    let mut links = searched();
    removed(&mut links, (&[finding(10, 10)], &[]), false);
    let report = links.report(&lines_of_run);
    let lines: Vec<[u32; 2]> = report.links.iter().map(|link| link.lines).collect();
    // The first and the last have no run in the program: theirs are those of the search.
    assert_eq!(lines, [[1, 2], LINES[0], LINES[1], LINES[2], [1, 2]]);
    let times: Vec<f64> = report.links.iter().map(|link| link.time_after_s).collect();
    assert_eq!(times, [3.0, 3.0, 1.0, 1.0, 1.0]);
    assert_eq!((report.changed, report.clearance_mm, report.by_acceleration_and_jerk), (3, 5.0, false));
    assert!(report.links[1].way == RetractStrategy::Original && report.links[1].kept_because.is_some());
}

fn rapids(rule: LineMatch) -> RapidLines {
    let run = |lines, hold| RunLines { lines, hold };
    let runs = vec![run(None, None), run(Some([10, 14]), None), run(Some([20, 24]), Some("the coolant changes on it"))];
    RapidLines { runs, rule }
}

#[test]
fn a_link_belongs_to_a_run_by_the_rule_of_its_lines() {
    for (lines, within, exact) in [
        ([10, 14], Some(1), Some(1)),
        ([20, 24], Some(2), Some(2)),
        ([11, 14], Some(1), None),
        ([10, 13], Some(1), None),
        ([9, 14], None, None),
        ([10, 15], None, None),
        ([14, 20], None, None),
    ] {
        assert_eq!(rapids(LineMatch::Within).run_of(lines), within, "{lines:?}");
        assert_eq!(rapids(LineMatch::Exact).run_of(lines), exact, "{lines:?}");
    }
}

#[test]
fn a_link_may_be_replaced_if_neither_text_nor_run_holds_it() {
    let rapids = rapids(LineMatch::Within);
    let why = |hold: Option<LinkHold>, run| rapids.check(hold.as_ref(), run).err();
    assert_eq!(why(None, Some(1)), None);
    assert_eq!(why(None, Some(2)).as_deref(), Some("the coolant changes on it"));
    assert_eq!(why(None, None).as_deref(), Some("its blocks are not those from one pass to the next alone"));
    assert_eq!(why(Some(LinkHold::Laws), Some(1)).as_deref(), Some("its blocks move in different ways"));
    let doubt = Some(LinkHold::Doubt { line: 1, what: "a fault".to_owned() });
    assert_eq!(why(doubt, Some(2)).as_deref(), Some("the positions of the axes are unknown"));
}
