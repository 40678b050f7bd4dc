use super::*;

fn planned(setup: &str) -> PlannedPasses {
    PlannedPasses {
        setup: setup.to_owned(),
        passes: 12,
        planned_fraction: 0.995,
        passes_length_mm: 12_345.0,
        floor_mm: Some(11_000.0),
        efficiency: Some(1.1223),
        over_least_floor: Some(1.3),
        by_time_law: true,
        passes_time_s: 600.0,
        time_over_feed: Some(1.375),
        approach_time_s: 60.0,
        link_time_s: 30.0,
        total_time_s: 690.0,
        cusp_p99_mm: Some(0.071),
        cusp_largest_mm: None,
        never_cut_fraction: Some(0.001),
        region_area_mm2: Some(12_000.0),
        region_length_mm: Some(0.0),
        rotary_reversals: 3,
        posture_jumps: 4,
        faults: 0,
    }
}

fn compared(strategy: &str, failed: Option<&str>, setups: Vec<PlannedPasses>) -> ComparedStrategy {
    let failed = failed.map(str::to_owned);
    ComparedStrategy { strategy: strategy.to_owned(), mounting_angle_deg: 0.0, failed, outcome: None, setups }
}

#[test]
fn a_table_has_a_row_for_each_strategy_and_reasons_for_those_without_a_plan() {
    let mut file = PathsFile::new("blade");
    file.compared = vec![
        compared("levels", None, vec![planned("s")]),
        compared("a strategy that fails", Some("no pass\nat all"), Vec::new()),
    ];
    let table = file.table();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 5, "{table}");
    assert!(lines[1].contains("over feed") && lines[2].contains("1.38"), "{table}");
    assert!(lines[4].starts_with("  least time: none"), "{table}");
    assert!(lines[1].contains("efficiency") && !lines[1].contains("mounting") && !lines[1].contains("setup"));
    assert!(lines[2].contains("12.35 m") && lines[2].contains("1.122") && lines[2].contains("  -  "), "{table}");
    assert_eq!(lines[3], "  a strategy that fails  no plan: no pass at all");
    // Columns stand below their headings.
    let end = |line: &str, text: &str| line.find(text).map(|at| at + text.len());
    assert_eq!(end(lines[1], "length"), end(lines[2], "12.35 m"));

    file.compared[0].setups.push(planned("t"));
    file.compared[0].mounting_angle_deg = 30.0;
    let table = file.table();
    assert!(table.contains("mounting") && table.contains("30 deg") && table.lines().count() == 6, "{table}");
}

#[test]
fn the_plan_of_least_time_is_named_with_its_gain_and_the_first_plans_passed_over() {
    let mut file = PathsFile::new("blade");
    file.compared =
        vec![compared("job", None, vec![planned("s")]), compared("planes across", None, vec![planned("s")])];
    file.compared[1].mounting_angle_deg = -30.0;
    let over = |k: usize| PassedOverStrategy { index: k % 2, total_time_s: 300.0, reason: format!("reason {k}") };
    let fastest = FastestStrategy {
        index: 1,
        strategy: "planes across".to_owned(),
        mounting_angle_deg: -30.0,
        total_time_s: 345.0,
        job_time_s: Some(690.0),
        verified: true,
        passed_over: (0..5).map(over).collect(),
    };
    file.fastest = Some(fastest.clone());
    let table = file.table();
    assert!(table.contains("least time: planes across, mounting turned by -30 deg, "), "{table}");
    assert!(table.contains(", 50 % less"), "{table}");
    assert!(table.contains("faster but not taken: job, ") && table.contains(": reason 2"), "{table}");
    assert!(!table.contains("reason 3") && table.contains("and 2 more"), "{table}");
    file.fastest = Some(FastestStrategy { index: 0, total_time_s: 690.0, passed_over: Vec::new(), ..fastest });
    assert!(file.table().contains("no other complete plan takes less"), "{}", file.table());
}
