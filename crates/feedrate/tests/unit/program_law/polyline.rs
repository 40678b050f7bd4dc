use super::*;

#[test]
fn lines_are_found_from_anywhere() {
    let mut line = Polyline::new(&AxisValues::from([0.0]));
    for k in 1..60_u32 {
        line.push(&AxisValues::from([f64::from(k * k)]), f64::from(1 + k % 3), 1.0, 0);
    }
    for near in [0, 1, 7, 31, 58, 90] {
        for i in 0..59 {
            let (a, b) = (line.r[i], line.r[i + 1]);
            assert_eq!((line.line_at(a, near), line.line_at(0.5 * (a + b), near)), (i, i));
        }
        assert_eq!((line.line_at(-3.0, near), line.line_at(1e9, near)), (0, 58));
    }
    assert_eq!(line.at(-1.0, 0)[0], -0.5);
}
