use crate::stock::walls::*;

#[test]
fn lines_square_to_the_surface_weigh_most_and_none_weighs_nothing() {
    let wall = weights_of([[3.0, 0.0, 0.0], [-2.0, 0.0, 0.0]].into_iter());
    assert!(wall[0] > 0.9 && wall[1] == wall[2] && wall[1] > 0.04, "{wall:?}");
    let floor = weights_of([[0.0, 0.0, 5.0]].into_iter());
    assert!(floor[2] > 0.9, "{floor:?}");
    let slope = weights_of([[1.0, 1.0, 1.0]].into_iter());
    assert!(slope.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-12), "{slope:?}");
    for weights in [wall, floor, slope, weights_of(std::iter::empty())] {
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
