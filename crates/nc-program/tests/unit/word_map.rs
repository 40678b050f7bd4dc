use super::*;

fn head_b_table_c(length: f64) -> WordMap {
    let axis = |letter, offset, along_spindle| MappedAxis { letter, offset, along_spindle };
    let axes = vec![
        axis(AxisLetter::X, 12.0, 0.0),
        axis(AxisLetter::Y, -7.5, 0.0),
        axis(AxisLetter::Z, 100.0, 1.0),
        axis(AxisLetter::B, 0.0, 0.0),
        axis(AxisLetter::C, 0.25, 0.0),
    ];
    WordMap::new(axes, WorkOffset::default(), length).unwrap()
}

#[test]
fn words_of_joints_turn_back_into_the_joints() {
    let map = head_b_table_c(253.0);
    for k in -20..20 {
        let t = f64::from(k);
        let joints = [t * 13.7, t * -4.1, t * 7.3, t * 0.07, t * 0.31];
        let back = map.joints(&map.words(&joints).unwrap()).unwrap();
        assert!(joints.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12), "{joints:?} {back:?}");
    }
}

#[test]
fn compensated_z_is_the_tip_at_the_zero_pose() {
    // The gauge line at machine Z = 400 with a tool of 253 has its tip at 147, which G54 with Z =
    // 100 calls 47.
    let words = head_b_table_c(253.0).words(&[0.0, 0.0, 400.0, 0.0, 0.0]).unwrap();
    assert_eq!(words.get(AxisLetter::Z), Some(47.0));
    let words = head_b_table_c(253.0).uncompensated_words(&[0.0, 0.0, 400.0, 0.0, 0.0]).unwrap();
    assert_eq!(words.get(AxisLetter::Z), Some(300.0));
}

#[test]
fn faults_are_named() {
    let map = head_b_table_c(1.0);
    assert_eq!(map.words(&[0.0; 4]), Err(WordMapError::WrongCount { given: 4, axes: 5 }));
    let words = AxisWords::from_words([(AxisLetter::X, 0.0)]).unwrap();
    assert_eq!(map.joints(&words), Err(WordMapError::UnknownAxis(AxisLetter::Y)));
    let words = AxisWords::from_words([(AxisLetter::A, 0.0)]).unwrap();
    assert_eq!(map.joints(&words), Err(WordMapError::NoSuchAxis(AxisLetter::A)));
    let twice = vec![map.axes[0], map.axes[0]];
    assert_eq!(WordMap::new(twice, WorkOffset::default(), 0.0), Err(WordMapError::TwoAxes(AxisLetter::X)));
}
