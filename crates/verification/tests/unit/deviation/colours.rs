use crate::deviation::colours::*;

#[test]
fn colours_grow_with_the_deviation_and_stop() {
    let red = |d: f64| colour(Condition::Gouged(-d), 0.1);
    assert_eq!((red(0.1), red(0.4), red(7.0)), (RED[0], RED[1], RED[1]));
    assert!(red(0.2)[1] < RED[0][1] && red(0.3)[1] < red(0.2)[1]);
    let blue = |d: f64| colour(Condition::Excess(d), 0.1);
    assert!(blue(0.1) == BLUE[0] && blue(0.4) == BLUE[1] && blue(0.3)[0] < blue(0.2)[0]);
    assert_eq!(colour(Condition::NoStock, 0.1), RED[1]);
}
