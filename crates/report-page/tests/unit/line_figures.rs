use serde_json::json;

use super::*;

#[test]
fn certificates_are_read_from_both_files_that_have_them() {
    let seven =
        json!({ "line": 7, "depth_mm": 0.01, "depth_with_control_mm": 0.02, "clearance_mm": null, "certified": true });
    let list = json!([seven, { "line": 9, "depth_mm": null }]);
    let of_plan = json!({ "certified": 1, "certificates": list });
    let of_verification = json!({ "certificates": { "certified": 1, "certificates": list } });
    for file in [of_plan.clone(), of_verification["certificates"].clone(), of_verification] {
        let proofs = proofs(&file);
        assert_eq!(
            proofs[&7],
            LineProof { depth: Some(0.01), depth_with_control: Some(0.02), clearance: None, is_certified: true }
        );
        assert_eq!(proofs[&9], LineProof::default());
        assert_eq!(proofs.len(), 2);
    }
}

#[test]
fn of_several_motions_of_a_line_the_worst_proof_counts_in_any_order() {
    let proof = |depth: Value, clearance: f64, certified: bool| {
        json!({
            "line": 7, "depth_mm": depth, "depth_with_control_mm": depth, "clearance_mm": clearance, "certified": certified
        })
    };
    let deep = proof(json!(0.03), 5.0, true);
    let near = proof(json!(0.01), 2.0, true);
    let unknown = proof(Value::Null, 9.0, false);
    for list in [[&deep, &near], [&near, &deep]] {
        let found = proofs(&json!({ "certificates": list }))[&7];
        assert_eq!((found.depth, found.clearance, found.is_certified), (Some(0.03), Some(2.0), true));
        assert_eq!(found.depth_with_control, Some(0.03));
    }
    for list in [[&deep, &unknown], [&unknown, &deep]] {
        let found = proofs(&json!({ "certificates": list }))[&7];
        assert_eq!((found.depth, found.clearance, found.is_certified), (None, Some(5.0), false));
    }
}

#[test]
fn the_largest_chip_of_a_line_counts_whatever_the_name_of_the_operation() {
    let csv = "# program.nc blake3 00\noperation,place,pass,point,s_mm,area_mm2,full_stock,tip_feed_before_mm_min,\
               tip_feed_after_mm_min,removal_rate_before_cm3_min,removal_rate_after_cm3_min,chip_thickness_before_mm,\
               chip_thickness_after_mm,line\n\"a, b\",1,1,1,0.000,1.5000,0,1.0,1.0,2.000,2.500,0.1,0.1,30\n\
               side,1,1,2,1.000,1.2000,0,1.0,1.0,2.000,3.500,0.1,0.1,30\nside,1,1,3,2.000,9.0000,0,,,,,,,\n";
    let chips = chips(csv);
    assert_eq!(chips.len(), 1);
    assert_eq!(chips[&30], LineChip { area: Some(1.5), removal_rate: Some(3.5) });
}

#[test]
fn a_block_shows_the_highest_place_of_the_cuts_within_the_distance_and_not_beyond_a_rapid() {
    let left = LeftByLine { spacing_mm: 5.0, heights_mm: [(10, 0.02), (12, 0.08), (14, 0.5)].into() };
    // Lines 10 to 13 cut 3 mm each, 14 is a rapid with a place of another pass, 15 cuts again.
    let ways = [Some(3.0), Some(3.0), Some(3.0), Some(3.0), None, Some(3.0)];
    let found = left_along(&ways, &[10, 11, 12, 13, 14, 15], &left);
    assert_eq!(found, [Some(0.02), Some(0.08), Some(0.08), Some(0.08), None, None]);
}
