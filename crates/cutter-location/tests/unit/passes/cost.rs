use crate::passes::cost::*;

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
