use std::slice::from_ref;

use facemill_virtual_machine::{FindingKind, Measure};

use crate::stock_run::tri_dexel_run::*;

fn found(lines: [u32; 2], body: &str, depth: Option<f64>) -> Finding {
    let finding = Finding::of_line(FindingKind::RapidCollision, lines[0], None, "", String::new());
    Finding {
        last_line: lines[1],
        worst_line: lines[1],
        body: Some(body.to_owned()),
        measure: depth.map(Measure::DepthMm),
        ..finding
    }
}

#[test]
fn the_wider_of_two_findings_stays_with_the_worse_depth() {
    let reported = |first: &[Finding], new: &[Finding]| {
        let mut all = first.to_vec();
        add_findings(&mut all, new.to_vec());
        all.iter().map(|f| (f.first_line, f.last_line, f.measure)).collect::<Vec<_>>()
    };
    let depth = |d: f64| Some(Measure::DepthMm(d));
    let (wide, narrow) = (found([3, 9], "cutter", None), found([4, 5], "cutter", Some(0.7)));
    assert_eq!(reported(from_ref(&wide), from_ref(&narrow)), [(3, 9, depth(0.7))]);
    assert_eq!(reported(from_ref(&narrow), from_ref(&wide)), [(3, 9, depth(0.7))]);
    let deeper = found([4, 4], "cutter", Some(0.9));
    assert_eq!(reported(&[narrow.clone(), found([7, 7], "cutter", Some(0.8))], &[wide, deeper]), [(3, 9, depth(0.9))]);
    // Others, and those that only overlap, stay.
    let others = [found([5, 9], "cutter", Some(0.1)), found([4, 5], "shank", Some(0.1))];
    assert_eq!(reported(&[narrow], &others).len(), 3);
}
