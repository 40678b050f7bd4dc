use super::barrier::{Problem, newton_step};

/// Factor by which the weight of time against the barrier grows from one stage to the next. A
/// larger one needs fewer stages of more steps.
const GROWTH: f64 = 4.0;

/// Largest number of Newton steps of one stage; it takes up to 30 until the first limits are near
/// and then about 7.
const STEPS: usize = 60;

/// Fraction of the time that the barrier may cost at the end of the last stage, and the largest
/// number of stages.
const GAP: f64 = 1e-6;
const STAGES: usize = 40;

/// Factor by which the barrier's fraction of the time shrinks at once where the steps follow its
/// minima.
const SHRINKING: f64 = 4.0;

/// Predicted decrease per unknown below which a point is near enough to the barrier's minimum to
/// continue from, and near enough to stay.
const CENTRED: f64 = 2.0;
const DONE: f64 = 0.05;

/// Predicted decrease per unknown from which longer steps than Newton's are tried.
const FAR: f64 = 0.3;

/// Unknowns with their time and the sum of their barriers.
struct Iterate {
    x: Vec<f64>,
    time: f64,
    barrier: f64,
    /// Length of the first trial step from here, based on the last one.
    length: f64,
}

impl Iterate {
    /// Evaluates unknowns; `None` where a limit is reached.
    fn new(problem: &Problem, x: Vec<f64>) -> Option<Self> {
        problem.value(&x).map(|(time, barrier)| Self { x, time, barrier, length: 1.0 })
    }
}

/// Finds unknowns of least time by a barrier method: strictly within every sampled limit, starting
/// from a slow law.
pub(crate) fn minimise(problem: &Problem) -> Vec<f64> {
    let mut x = vec![1.0; problem.n];
    let slow = 1.5 * problem.dilation(&x);
    x.iter_mut().for_each(|v| *v /= slow * slow);
    let Some(mut at) = Iterate::new(problem, x.clone()) else { return x };
    let mut kappa = problem.n as f64 / at.time;
    for _ in 0..STAGES {
        for _ in 0..STEPS {
            match newton(problem, &mut at, (kappa, kappa)) {
                Some(decrement) if decrement > 1e-3 => {}
                _ => break,
            }
        }
        // Each active limit of a span costs 1/κ.
        if 3.0 * problem.n as f64 <= GAP * kappa * at.time {
            break;
        }
        kappa *= GROWTH;
    }
    at.x
}

/// Effort of [`lower`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Largest number of Newton steps.
    pub(crate) steps: usize,
    /// Fraction of the time that the barrier costs at first and at last.
    pub(crate) gaps: (f64, f64),
}

/// Lowers the time from `x`, which is strictly within every limit; the weight of the barrier
/// follows the time.
pub(crate) fn lower(problem: &Problem, x: &mut Vec<f64>, effort: &Effort) {
    let Some(mut at) = Iterate::new(problem, x.clone()) else { return };
    let (mut gap, last) = effort.gaps;
    let n = problem.n as f64;
    let mut centred = false;
    for _ in 0..effort.steps {
        let kappa = |gap: f64, time: f64| 3.0 * n / (gap * time);
        let before = kappa(gap, at.time);
        let foretold = centred && gap > last;
        if foretold {
            gap = (gap / SHRINKING).max(last);
        }
        let weights = (before, kappa(gap, at.time));
        match newton(problem, &mut at, weights) {
            // A full step would still lower the mean barrier of a span by this.
            Some(decrement) if foretold || decrement > CENTRED * n => centred = false,
            Some(decrement) if gap <= last && decrement <= DONE * n => break,
            Some(_) => centred = gap > last,
            None if gap <= last => break,
            None => (gap, centred) = ((gap / SHRINKING).max(last), false),
        }
    }
    *x = at.x;
}

/// Makes one step of Newton's method, which stays strictly feasible and lowers κ·T + barrier, from
/// a point near the minimum for the weight of time `before`.
///
/// With the slacks s of the reached limits, which fall as 1/κ, Newton's step for the weight κ would
/// lead to s·(2 − κ/before): beyond the limits where κ is twice as large. The step that leads to
/// s·before/κ is that for before·(2 − before/κ). Returns the decrease that the full step predicts,
/// in units of one logarithm; `None` where there is no step.
fn newton(problem: &Problem, at: &mut Iterate, (before, kappa): (f64, f64)) -> Option<f64> {
    // The exact Hessian where it is positive definite; it always is without the jerk limits'
    // curvature.
    let toward = before * (2.0 - before / kappa);
    let exact = problem.derivatives(&at.x, toward, 1.0);
    let (step, gradient) = match newton_step(&exact) {
        Some(step) => (step, exact.gradient),
        None => {
            let convex = problem.derivatives(&at.x, toward, 0.0);
            (newton_step(&convex)?, convex.gradient)
        }
    };
    let slope: f64 = step.iter().zip(&gradient).map(|(s, g)| s * g).sum();
    let value = kappa * at.time + at.barrier;
    let trial = |alpha: f64| {
        let x = at.x.iter().zip(&step).map(|(x, s)| x + alpha * s).collect();
        Iterate::new(problem, x).filter(|next| kappa * next.time + next.barrier <= value + 1e-4 * alpha * slope)
    };
    let worth = |at: &Iterate| kappa * at.time + at.barrier;
    let mut length = at.length.min(1.0);
    let mut best = (0..40).find_map(|_| {
        let next = trial(length);
        length *= if next.is_none() { 0.5 } else { 2.0 };
        next
    })?;
    best.length = length;
    // Far below the limits a full step raises the square of the speed only to 5/3 of its value.
    if -slope > FAR * problem.n as f64 {
        let longer = (1..6).map_while(|k| trial(f64::from(1 << k)));
        for next in longer {
            if worth(&next) >= worth(&best) {
                break;
            }
            best = next;
            best.length = 1.0;
        }
    }
    *at = best;
    Some(-slope)
}
