use super::*;

/// Texts of the faults of a block.
fn faults(kind: PositionKind, cut_time: Option<f64>, planned: f64) -> Vec<(Option<u32>, String)> {
    let mut all = Comparison::new(0.01);
    all.kind_and_time(kind, (3, 9), cut_time, planned);
    all.finish(1).faults.into_iter().map(|fault| (fault.line, fault.text)).collect()
}

#[test]
fn a_cut_that_is_a_rapid_and_another_time_are_faults() {
    let cut = PositionKind::Cut(600.0);
    assert_eq!(faults(cut, Some(1.0), 1.0), []);
    assert_eq!(faults(PositionKind::Rapid, None, 0.0), []);
    assert_eq!(faults(PositionKind::FastCut, Some(0.5), 0.5), []);
    let rapid = (Some(3), "line 9 of the program is a rapid, and is to be a cut".to_owned());
    assert_eq!(faults(cut, None, 1.0), std::slice::from_ref(&rapid));
    assert_eq!(faults(cut, None, 0.0), std::slice::from_ref(&rapid));
    // A rapid whose axes have to go together.
    assert_eq!(faults(PositionKind::FastCut, None, 0.5), [rapid]);
    for time in [0.8, 1.2, f64::INFINITY] {
        let found = faults(cut, Some(time), 1.0);
        assert!(found.len() == 1 && found[0].1.contains("and 1.000 s by the feed of the file"), "{found:?}");
    }
}
