use crate::passes::cost::*;

#[test]
fn table_is_the_exact_cusp_to_a_hundredth_of_the_allowed_one() {
    let scale = CuspScale { cutter: Cutter::new(80.0, 6.0, 12.0).unwrap(), allowed: 0.1 };
    let postures: Vec<Posture> = [(2.0, 0.0), (5.0, 40.0), (15.0, 85.0)]
        .map(|(tilt, rotate): (f64, f64)| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() })
        .to_vec();
    let strip = |step_over, across| Strip { step_over, curvature: FeedCurvature::straight(across) };
    let table = CuspTable::new(&scale, &postures, &[strip(10.0, -1e-3), strip(40.0, 1e-3)]);
    for (k, &posture) in postures.iter().enumerate() {
        for i in 0..=20 {
            for j in 0..=20 {
                let at = strip(10.0 + 1.5 * f64::from(i), -1e-3 + 1e-4 * f64::from(j));
                let (exact, found) = (scale.height(posture, &at), table.height(k, &at));
                assert!((exact - found).abs() < 0.01 * exact.max(1.0), "{posture:?} {at:?}: {exact} {found}");
                assert!((scale.rate(posture, &at) - rate(exact)).abs() < 1e-12 && table.rate(k, &at) == rate(found));
            }
        }
    }
}

#[test]
fn bend_and_twist_along_the_feed_count_to_a_tenth() {
    let scale = CuspScale { cutter: Cutter::new(40.0, 5.0, 12.0).unwrap(), allowed: 0.1 };
    let postures: Vec<Posture> = [(5.0, -34.0), (8.0, 20.0), (15.0, -60.0)]
        .map(|(tilt, rotate): (f64, f64)| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() })
        .to_vec();
    let mut random = facemill_test_kit::Random(3);
    let strips: Vec<Strip> = (0..300)
        .map(|_| Strip {
            step_over: random.between(4.0, 9.0),
            curvature: FeedCurvature {
                along: random.between(0.0, 4e-3),
                twist: random.between(-2e-3, 2e-3),
                across: random.between(0.0, 4e-3),
            },
        })
        .collect();
    let table = CuspTable::new(&scale, &postures, &strips);
    let mut straight_error = 0.0f64;
    for (k, &posture) in postures.iter().enumerate() {
        for at in &strips {
            let (exact, found) = (scale.height(posture, at), table.height(k, at));
            assert!((exact - found).abs() < 0.1 * exact.max(0.5), "{posture:?} {at:?}: {exact} {found}");
            let straight = Strip { curvature: FeedCurvature::straight(at.curvature.across), ..*at };
            straight_error = straight_error.max((scale.height(posture, &straight) - exact).abs());
        }
    }
    assert!(straight_error > 0.3, "{straight_error}");
}

#[test]
fn an_endless_axis_takes_the_short_way() {
    let machine = Machine::head_b_table_c().unwrap();
    let scale = MotionScale::new(&machine, 1.0, 0.1);
    let c = machine.axis_index("C").unwrap();
    let at = |degrees: f64| {
        let mut q = AxisValues::zeros(machine.axes().len());
        q[c] = degrees.to_radians();
        scale.scaled(&q)
    };
    let (short, long) = (scale.cost(&at(179.0), &at(-179.0), 1.0), scale.cost(&at(0.0), &at(2.0), 1.0));
    assert!(machine.axes()[c].endless && (short - long).abs() < 1e-9 * long, "{short} {long}");
    assert!((scale.cost(&at(0.0), &at(2.0), 2.0) - 0.5 * long).abs() < 1e-12);
}
