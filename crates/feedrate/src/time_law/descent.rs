use super::barrier::{Problem, newton_step};

/// Factor by which the weight of time against the barrier grows from one stage to the next. Larger ones need fewer stages
/// of more steps.
const GROWTH: f64 = 4.0;

/// Newton steps of one stage at most; it takes up to 30 until the first limits are near and then about 7.
const STEPS: usize = 60;

/// Stages end when the barrier costs this share of the time at most, and so many there are at most.
const GAP: f64 = 1e-6;
const STAGES: usize = 40;

/// Unknowns of least time by a barrier method: strictly within every sampled limit, from a slow law on.
pub(crate) fn minimise(problem: &Problem) -> Vec<f64> {
    let mut x = vec![1.0; problem.n];
    let slow = 1.5 * problem.dilation(&x);
    x.iter_mut().for_each(|v| *v /= slow * slow);
    let mut kappa = problem.n as f64 / problem.time(&x);
    for _ in 0..STAGES {
        stage(problem, &mut x, kappa);
        // Each active limit of a span costs 1/κ.
        if 3.0 * problem.n as f64 <= GAP * kappa * problem.time(&x) {
            break;
        }
        kappa *= GROWTH;
    }
    x
}

/// Newton's method on κ·T + barrier; every step stays strictly feasible and lowers it.
fn stage(problem: &Problem, x: &mut Vec<f64>, kappa: f64) {
    for _ in 0..STEPS {
        let Some(value) = problem.value(x, kappa) else { return };
        // The exact Hessian where it is positive definite; without the jerk limits' curvature it always is.
        let exact = problem.derivatives(x, kappa, 1.0);
        let (step, gradient) = match newton_step(&exact) {
            Some(step) => (step, exact.gradient),
            None => {
                let convex = problem.derivatives(x, kappa, 0.0);
                let Some(step) = newton_step(&convex) else { return };
                (step, convex.gradient)
            }
        };
        let slope: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum();
        // The decrease that a full step promises, in units of one logarithm.
        if -slope < 1e-3 {
            return;
        }
        let trial = |alpha: f64| -> Vec<f64> { x.iter().zip(&step).map(|(x, s)| x + alpha * s).collect() };
        let lower = |x: &[f64], alpha: f64| problem.value(x, kappa).is_some_and(|v| v <= value + 1e-4 * alpha * slope);
        let found = (0..40).map(|k| 0.5_f64.powi(k)).map(|alpha| (trial(alpha), alpha)).find(|(x, a)| lower(x, *a));
        let Some((next, _)) = found else { return };
        *x = next;
    }
}
