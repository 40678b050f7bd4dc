use crate::machine::work_frame::*;

#[test]
fn words_under_length_compensation_are_the_tips_coordinates_at_the_rotary_offsets() {
    let machine = Machine::head_b_table_c().unwrap();
    let travel = machine.length_compensation_travel().unwrap();
    for (c_offset, tool_length) in [(0.0, 120.0), (0.7, 250.0), (-2.0, 0.0)] {
        let index = |letter: &str| machine.axis_index(letter).unwrap();
        let mut offset = AxisValues::zeros(machine.axes().len());
        (offset[index("X")], offset[index("Y")], offset[index("Z")]) = (800.0, -35.0, 410.0);
        offset[index("C")] = c_offset;
        let frame = machine.work_coordinates(&offset).unwrap();
        for words in [[0.0, 0.0, 0.0], [12.5, -3.0, 77.0]] {
            let mut q = offset;
            for (k, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
                q[index(letter)] += words[k] + tool_length * travel.get_or_zero(index(letter));
            }
            let tip = frame.inverse_transform_point(&machine.cl_point(&q, tool_length).tip);
            assert!((tip.coords - Vector3::from(words)).norm() < 1e-9, "{tip} for {words:?}");
        }
    }
}

#[test]
fn the_frame_turns_with_the_table() {
    // Seen from the table, a turned table's X axis points the other way round.
    let machine = Machine::head_b_table_c().unwrap();
    let mut offset = AxisValues::zeros(machine.axes().len());
    let at_zero = machine.work_coordinates(&offset).unwrap();
    offset[machine.axis_index("C").unwrap()] = 0.3;
    let turned = machine.work_coordinates(&offset).unwrap();
    assert!((at_zero.rotation.angle_to(&turned.rotation) - 0.3).abs() < 1e-12);
}
