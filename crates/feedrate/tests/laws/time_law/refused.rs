//! Input that has no time law.

use facemill_feedrate::*;
use facemill_inverse_kinematics::AxisValues;

/// One axis by values at the ends of unit pieces: the start and end of each piece.
struct Pieces(Vec<[[f64; 4]; 2]>);

impl JointPath for Pieces {
    fn breaks(&self) -> Vec<f64> {
        (0..=self.0.len()).map(|k| k as f64).collect()
    }
    fn at(&self, piece: usize, u: f64) -> PathPoint {
        let [a, b] = self.0[piece];
        let s = u - piece as f64;
        PathPoint { axes: [0, 1, 2, 3].map(|d| AxisValues::from([a[d] + (b[d] - a[d]) * s])), tip: None }
    }
}

fn refused(path: &dyn JointPath, bounds: &MotionBounds) -> TimeLawError {
    let law = minimum_time_law(path, bounds, &TimeLawSettings { spans: 10, rounds: 1 });
    law.map(|law| law.total_time()).unwrap_err()
}

fn one_axis() -> MotionBounds {
    MotionBounds::new(vec![AxisBounds { velocity: 1.0, acceleration: 1.0, jerk: 1.0 }])
}

fn line(from: f64) -> [[f64; 4]; 2] {
    [[from, 1.0, 0.0, 0.0], [from + 1.0, 1.0, 0.0, 0.0]]
}

#[test]
fn limits_that_are_no_positive_numbers() {
    let path = Pieces(vec![line(0.0)]);
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (k, what) in ["velocity", "acceleration", "jerk"].into_iter().enumerate() {
            let mut bounds = one_axis();
            let b = &mut bounds.axes[0];
            *[&mut b.velocity, &mut b.acceleration, &mut b.jerk][k] = value;
            let text = refused(&path, &bounds).to_string();
            assert!(text.contains(what) && text.contains("axis 0"), "{text}");
        }
        let bounds = MotionBounds { tip_feed: Some(value), ..one_axis() };
        assert!(matches!(refused(&path, &bounds), TimeLawError::BadTipFeed { .. }));
    }
    assert_eq!(refused(&path, &MotionBounds { tip_feed: Some(1.0), ..one_axis() }), TimeLawError::NoTip);
    let two = MotionBounds::new([one_axis().axes, one_axis().axes].concat());
    assert_eq!(refused(&path, &two), TimeLawError::AxisCount { path: 1, bounds: 2 });
}

#[test]
fn jumps_between_pieces_by_order() {
    for order in 0..3 {
        let mut second = line(1.0);
        second[0][order] += 1e-3;
        let error = refused(&Pieces(vec![line(0.0), second]), &one_axis());
        assert_eq!(error, TimeLawError::Jump { piece: 1, axis: 0, order });
    }
    // The third derivative may jump.
    let mut second = line(1.0);
    second[0][3] = 1e-3;
    minimum_time_law(&Pieces(vec![line(0.0), second]), &one_axis(), &TimeLawSettings { spans: 10, rounds: 1 }).unwrap();
}

#[test]
fn paths_that_are_not_finite_stand_still_or_have_no_pieces() {
    for order in 0..4 {
        let mut bad = line(1.0);
        bad[1][order] = f64::NAN;
        let error = refused(&Pieces(vec![line(0.0), bad]), &one_axis());
        assert!(matches!(error, TimeLawError::NotFinite { piece: 1, .. }), "{error}");
    }
    let still = Pieces(vec![[[3.0, 0.0, 0.0, 0.0]; 2]]);
    assert_eq!(refused(&still, &one_axis()), TimeLawError::NoMotion { piece: 0 });
    assert_eq!(refused(&Pieces(vec![]), &one_axis()), TimeLawError::BadBreaks { index: 1 });
}

#[test]
fn a_path_with_the_derivative_of_another_one() {
    let mut wrong = line(0.0);
    wrong[0][1] += 3.0;
    wrong[1][1] += 3.0;
    let error = refused(&Pieces(vec![wrong]), &one_axis());
    assert!(matches!(error, TimeLawError::NotSmooth { piece: 0, .. }), "{error}");
}
