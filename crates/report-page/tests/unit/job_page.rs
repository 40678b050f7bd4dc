use facemill_job::format::job_file::FinishFile;
use facemill_job::format::job_report::{
    CuspsAtEnd, DatumReport, DatumShapeReport, JOB_REPORT_FORMAT, LeftAtEnd, LeftAtEndPlace, SecondToolReport,
};
use facemill_job::format::report::operations::OperationReport;

use super::*;

fn operation(name: &str, passes: f64) -> OperationReport {
    OperationReport {
        operation: name.to_owned(),
        first_line: 12,
        passes_time_s: passes,
        approach_time_s: 5.0,
        rapid_time_s: 5.0,
        air_share: Some(0.125),
        removed_mm3: Some(2500.0),
    }
}

fn program(number: u32, operations: Vec<OperationReport>) -> ToolProgramReport {
    ToolProgramReport {
        setup: format!("up {number}"),
        programs: vec![format!("program-{number}.nc")],
        blake3: None,
        line_in_joined: Some(40 * number),
        report: format!("report-{number}.json"),
        tool_number: number,
        tool: "mill <8 & \"12\">".to_owned(),
        gauge_length_mm: 120.0,
        second_tool: None,
        planned_on: String::new(),
        time_s: operations.iter().map(OperationReport::time_s).sum(),
        removed_mm3: Some(2500.0),
        verified: true,
        faults: 0,
        other_findings: 0,
        certified_blocks: Some([90, 90]),
        planned_fraction: 1.0,
        incomplete_because: Vec::new(),
        operations,
    }
}

fn pose(rotation_deg: f64, z: f64) -> PoseReport {
    PoseReport { translation_mm: [0.0, 0.0, z], rotation_axis: [1.0, 0.0, 0.0], rotation_deg }
}

fn bore(in_first: bool) -> DatumReport {
    DatumReport {
        file: "part <1>.glb".to_owned(),
        group: "hub/bore".to_owned(),
        shape: DatumShapeReport::Cylinder,
        place_mm: [0.0, 0.0, 500.0],
        direction: Some([0.0, 0.0, 1.0]),
        radius_mm: Some(45.0),
        deviation_mm: 0.001,
        in_first,
    }
}

fn report() -> JobReport {
    let placement = |moved_by: Option<PoseReport>| PlacementReport {
        work_offset: "G54".to_owned(),
        work_from_part: pose(0.0, 0.0),
        table_from_work: pose(0.0, 500.0),
        compared_with: moved_by.is_some().then(|| "suction".to_owned()),
        moved_by,
    };
    let clamping = |name: &str, placement, programs: Vec<ToolProgramReport>| ClampingReport {
        name: name.to_owned(),
        time_s: programs.iter().map(|p| p.time_s).sum(),
        placement,
        stock: "a <box>".to_owned(),
        datums: vec![bore(name == "suction")],
        fixtures: Vec::new(),
        joined_program: Some("program.nc".to_owned()),
        joined_blake3: None,
        not_joined_because: None,
        programs,
        without_program: Vec::new(),
    };
    let clampings = vec![
        clamping(
            "suction",
            placement(None),
            vec![program(1, vec![operation("rough", 590.0)]), program(2, vec![operation("finish", 290.0)])],
        ),
        clamping(
            "pressure",
            placement(Some(pose(180.0, 1000.0))),
            vec![program(1, vec![operation("other side", 890.0)])],
        ),
    ];
    JobReport {
        format: JOB_REPORT_FORMAT.to_owned(),
        job: "a job".to_owned(),
        machine: "a machine".to_owned(),
        outcome: Outcome::Done,
        incomplete_because: Vec::new(),
        total_time_s: 1830.0,
        tool_changes: 1,
        tool_change_s: Some(30.0),
        clampings,
        left_at_end: Vec::new(),
    }
}

fn page(report: &JobReport) -> String {
    String::from_utf8(job_html(report)).unwrap()
}

#[test]
fn the_page_has_the_mark_of_pages_and_no_text_of_the_job_as_markup() {
    let page = page(&report());
    assert!(page.contains("facemill-page/"));
    assert!(page.contains("mill &lt;8 &amp; &quot;12&quot;&gt;") && page.contains("a &lt;box&gt;"), "{page}");
    assert!(!page.contains("<box>") && !page.contains("<8 &") && !page.contains("<script"), "{page}");
}

#[test]
fn bars_are_as_long_as_the_operations_take() {
    let page = page(&report());
    let widths: Vec<f64> = page
        .split("<rect ")
        .skip(1)
        .map(|rect| rect.split("width=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
        .collect();
    // The longest clamping fills the picture: 600 and 300 of 900 s, and 900 of 900 s.
    assert_eq!(widths.len(), 3);
    for (width, share) in widths.into_iter().zip([6.0 / 9.0, 3.0 / 9.0, 1.0]) {
        assert!((width - share * PICTURE[0]).abs() < 0.01, "{width}");
    }
}

#[test]
fn the_page_says_times_positions_and_results() {
    let mut report = report();
    let text = page(&report);
    for part in [
        "0:30:30 on the machine in 2 clamping(s), with 1 tool change(s) of 30 s",
        "on the table, from its position in &quot;suction&quot;: turned 180.0000 deg about (1.000000, 0.000000, 0.000000), then moved by (0.000, 0.000, 1000.000) mm",
        "90 of 90 blocks certified",
        "T2 mill &lt;8 &amp; &quot;12&quot;&gt;</td><td style=\"text-align:right;white-space:nowrap\">120.0</td>",
        "12.5 %",
        "<a href=\"report-2.html\">program-2.nc</a>",
        "<p class=\"stamp ok\">VERIFIED<small>3 programs",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    report.tool_change_s = None;
    assert!(page(&report).contains("without 1 tool change(s), whose time the machine file does not say"));
}

#[test]
fn the_stamp_is_that_of_the_worst_program() {
    let stamped = |change: &dyn Fn(&mut JobReport)| {
        let mut report = report();
        change(&mut report);
        page(&report)
    };
    let faulty = stamped(&|r| {
        r.outcome = Outcome::Faulty;
        r.clampings[1].programs[0].faults = 2;
    });
    assert!(
        faulty.contains("REJECTED: DO NOT RUN<small>1 of 3 programs") && faulty.contains("<title>REJECTED"),
        "{faulty}"
    );
    assert!(stamped(&|r| r.clampings[0].programs[0].verified = false).contains("NOT VERIFIED<small>1 of 3"));
    let open = stamped(&|r| r.clampings[0].programs[0].certified_blocks = Some([90, 88]));
    assert!(open.contains("<p class=\"stamp warn\">NO FAULT, NOT ALL IS PROVEN<small>1 of 3"), "{open}");
    let apart = stamped(&|r| r.clampings[1].not_joined_because = Some("line 40 is not as in it".to_owned()));
    assert!(apart.contains("stamp warn\">VERIFIED ONE BY ONE<small>1 clamping"), "{apart}");
    let idle = stamped(&|r| r.clampings[1].without_program.push("pressure 2 ball".to_owned()));
    assert!(idle.contains("stamp warn\">NO FAULT<small>1 setups") && idle.contains("pressure 2 ball"), "{idle}");
    let less = stamped(&|r| {
        r.outcome = Outcome::Incomplete;
        r.incomplete_because.push("cusp <too> high".to_owned());
    });
    assert!(
        less.contains("NO FAULT, JOB NOT MET<small>for 1 reason") && less.contains("<li>cusp &lt;too&gt; high</li>"),
        "{less}"
    );
    assert!(!less.contains("Left at the end"), "{less}");
    // Reports of earlier builds have the reasons of programs alone.
    let earlier = stamped(&|r| {
        r.outcome = Outcome::Incomplete;
        r.clampings[0].programs[1].incomplete_because.push("cusp too high".to_owned());
    });
    assert!(earlier.contains("NO FAULT, JOB NOT MET<small>1 of 3"), "{earlier}");
}

#[test]
fn the_page_names_the_tool_of_the_second_head() {
    let mut report = report();
    let second = SecondToolReport { number: 9, name: "ball <6>".to_owned(), gauge_length_mm: 80.0 };
    report.clampings[0].programs[0].second_tool = Some(second);
    let page = page(&report);
    assert!(page.contains(" and, on head 2, T9 ball &lt;6&gt; of 80.000 mm, <a"), "{page}");
}

#[test]
fn the_page_lists_what_later_programs_do_not_lower() {
    let mut report = report();
    let left = LeftAtEnd {
        setup: "up 1".to_owned(),
        operation: "rough <b>".to_owned(),
        region: 50.0,
        limit_mm: 0.16,
        allowed: FinishFile::default(),
        exceeded: true,
        above_fraction: 0.25,
        above_at_end: 0.125,
        never_cut_at_end: 0.0625,
        highest_at_end: Some(LeftAtEndPlace { height_mm: 0.75, at_mm: [1.0, 2.0, 3.0] }),
        cusps: Some(CuspsAtEnd {
            points: 7,
            kept: true,
            limit_mm: 0.1,
            highest_at_end: Some(LeftAtEndPlace { height_mm: 0.0625, at_mm: [4.0, 5.0, 6.0] }),
        }),
        lowered_by: vec!["up 2".to_owned(), "up 3".to_owned()],
        exceeded_at_end: true,
    };
    let kept = LeftAtEnd { highest_at_end: None, above_at_end: 0.0, exceeded_at_end: false, ..left.clone() };
    report.left_at_end = vec![left, kept];
    let page = page(&report);
    for part in
        ["<td>up 1, rough &lt;b&gt;</td>", ">25.00 %</td>", ">12.50 %</td>", ">6.25 %</td>", ">0.750</td>", ">no</td>"]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert!(
        page.contains(
            "predicted cusps at 7 points are within 0.100 mm after all programs, the highest place measured for \
             them 0.062 mm at (4.0, 5.0, 6.0); cut deeper by up 2, up 3<"
        ),
        "{page}"
    );
    assert!(page.contains(">0.00 %</td>") && page.contains(">none above</td>") && page.contains(">yes</td>"), "{page}");
}
