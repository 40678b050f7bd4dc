use crate::search::bezier::*;

fn posture_deg(tilt: f64, rotate: f64) -> Posture {
    Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() }
}

#[test]
fn curve_runs_from_start_to_end_and_never_back() {
    for order in [SearchOrder::TiltFirst, SearchOrder::RotateFirst] {
        for weight in [0.05, 1.0, 30.0] {
            let curve = SearchCurve::new(posture_deg(2.0, 0.0), posture_deg(15.0, -85.0), order, weight).unwrap();
            assert_eq!(curve.at(0.0), curve.start());
            assert_eq!(curve.at(1.0), curve.end());
            for k in 0..1000 {
                let (p, q) = (curve.at(f64::from(k) / 1000.0), curve.at(f64::from(k + 1) / 1000.0));
                assert!(q.tilt >= p.tilt - 1e-15 && q.rotate <= p.rotate + 1e-15);
            }
        }
    }
}

#[test]
fn a_large_weight_hugs_the_middle_control_point() {
    let at = |w| {
        SearchCurve::new(posture_deg(2.0, 0.0), posture_deg(15.0, -85.0), SearchOrder::TiltFirst, w).unwrap().at(0.5)
    };
    assert!(at(100.0).tilt.to_degrees() > 14.8 && at(100.0).rotate.to_degrees() > -1.0);
    assert!(at(0.01).tilt.to_degrees() < 9.0);
}

#[test]
fn turn_table_inverts_itself() {
    let curve =
        SearchCurve::new(posture_deg(0.0, 0.0), posture_deg(15.0, 85.0), SearchOrder::RotateFirst, 1.0).unwrap();
    let table = TurnTable::new(&curve);
    for k in 0..=100 {
        let u = f64::from(k) / 100.0;
        assert!((table.u_at(table.turn_at(u)) - u).abs() < 1e-9);
    }
}

#[test]
fn ranges_that_go_back_are_refused() {
    assert!(SearchCurve::new(posture_deg(5.0, 0.0), posture_deg(2.0, 0.0), SearchOrder::TiltFirst, 1.0).is_err());
    assert!(SearchCurve::new(posture_deg(2.0, 10.0), posture_deg(5.0, -20.0), SearchOrder::TiltFirst, 1.0).is_err());
    assert!(SearchCurve::new(posture_deg(2.0, 0.0), posture_deg(5.0, 1.0), SearchOrder::TiltFirst, f64::NAN).is_err());
}
