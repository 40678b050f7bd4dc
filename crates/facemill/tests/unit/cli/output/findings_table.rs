use super::*;
use facemill::virtual_machine::{FindingKind, Measure};

fn finding() -> Finding {
    Finding {
        kind: FindingKind::Gouge,
        first_line: 10,
        last_line: 11,
        worst_line: 10,
        episodes: 1,
        block_number: None,
        block_text: "G1 X1.".to_owned(),
        body: Some("cutter".to_owned()),
        obstacle: Some("plate".to_owned()),
        axis: None,
        measure: Some(Measure::DepthMm(0.3)),
        place_work_mm: Some([-30.0, 10.0, -0.0]),
        pose: None,
        time_s: Some(59.96),
        note: String::new(),
    }
}

#[test]
fn columns_stand_below_each_other_and_nothing_is_left_out() {
    let axis = Finding {
        kind: FindingKind::AxisLimit,
        last_line: 10,
        body: None,
        obstacle: None,
        axis: Some("X".to_owned()),
        place_work_mm: None,
        time_s: None,
        note: "head 1".to_owned(),
        ..finding()
    };
    let table = findings_table(&[finding(), axis]);
    assert_eq!(table.len(), 3);
    for text in ["10 (10-11)", "1:00.0", "gouge", "cutter, plate", "0.300 mm deep", "-30.00 10.00 0.00", "`G1 X1.`"] {
        assert!(table[1].contains(text), "{text} is not in {}", table[1]);
    }
    for (k, text) in ["axis X", "axis beyond its limits", "`G1 X1.` head 1"].into_iter().enumerate() {
        assert!(table[2].contains(text), "{k}: {text} is not in {}", table[2]);
    }
    let at = |line: &str, text: &str| line.find(text).unwrap_or_else(|| panic!("{text} is not in {line}"));
    assert_eq!(at(&table[0], "what"), at(&table[1], "gouge"));
    assert_eq!(at(&table[0], "between"), at(&table[2], "axis X"));
    assert_eq!(at(&table[0], "block"), at(&table[1], "`G1"));
    assert_eq!(findings_table(&[]), [] as [String; 0]);
}
