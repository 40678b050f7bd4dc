use crate::passes::cost::*;

#[test]
fn table_is_the_exact_cusp_to_a_hundredth_of_the_allowed_one() {
    let scale = CuspScale { cutter: Cutter::new(80.0, 6.0, 12.0).unwrap(), allowed: 0.1 };
    let postures: Vec<Posture> = [(2.0, 0.0), (5.0, 40.0), (15.0, 85.0)]
        .map(|(tilt, rotate): (f64, f64)| Posture { tilt: tilt.to_radians(), rotate: rotate.to_radians() })
        .to_vec();
    let strip = |step_over, curvature| Strip { step_over, curvature };
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
