use super::*;

#[test]
fn coarse_steps_end_at_one_and_never_repeat() {
    let steps: Vec<f64> = coarse_steps(0.0, 0.1).collect();
    assert_eq!(steps.len(), 11);
    assert_eq!(*steps.last().unwrap(), 1.0);
    assert_eq!(coarse_steps(0.95, 0.1).collect::<Vec<_>>(), [0.95, 1.0]);
    assert_eq!(coarse_steps(1.0, 0.1).collect::<Vec<_>>(), [1.0]);
}
