use serde_json::json;

use super::*;

#[test]
fn certificates_are_read_from_both_files_that_have_them() {
    let list = json!([{ "line": 7, "depth_mm": 0.01, "clearance_mm": null }, { "line": 9, "depth_mm": null }]);
    let of_plan = json!({ "certified": 1, "certificates": list });
    let of_verification = json!({ "certificates": { "certified": 1, "certificates": list } });
    for file in [of_plan.clone(), of_verification["certificates"].clone(), of_verification] {
        let proofs = proofs(&file);
        assert_eq!(proofs[&7], LineProof { depth: Some(0.01), clearance: None });
        assert_eq!(proofs[&9], LineProof::default());
        assert_eq!(proofs.len(), 2);
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
