use super::barrier::{Problem, Scaled, SolverSpan, end_weights};
use super::certify::stretch;
use super::descent::minimise;
use super::law::{SquaredSpeed, TimeLaw};
use super::span::{Ramp, Septic, Span, eval, span};
use super::{JointPath, MotionBounds, TimeLawError};
use facemill_inverse_kinematics::AxisValues;

/// Effort of [`minimum_time_law`]. The result depends only on these numbers, not on a clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeLawSettings {
    /// Number of spans into which the path is cut, with ṙ² quadratic on each. Each piece of the
    /// path has at least one, and more where the path has to be kept to 1e-6 mm and rad. The time
    /// above the least falls about as 1/spans, and computing time grows as spans.
    pub spans: usize,
    /// Number of consecutive solutions, in each of which the limits of spans are tightened by their
    /// excess between the samples.
    pub rounds: usize,
}

impl Default for TimeLawSettings {
    /// Returns settings for about a tenth of a second of computing for five axes.
    fn default() -> Self {
        Self { spans: 1000, rounds: 2 }
    }
}

/// Returns the law of motion from rest to rest that takes the least time along a smooth path within
/// the limits of all axes and the cap on the tip feed.
///
/// Guarantee: along the path as cut into polynomials of degree 7 (which meet the given path and its
/// three derivatives at every knot) no limit is exceeded at any time, proven by the Bernstein
/// coefficients of velocity, acceleration and jerk, to rounding. The time is not proven to be the
/// least: jerk limits make the problem have local minima.
///
/// # Errors
/// ```
/// use facemill_feedrate::{AxisBounds, Jet, JointPath, MotionBounds, PathPoint, TimeLawSettings, minimum_time_law};
/// use facemill_inverse_kinematics::AxisValues;
///
/// /// A quarter of a circle of radius 50 mm in the plane of two linear axes.
/// struct Quarter;
///
/// impl JointPath for Quarter {
///     fn breaks(&self) -> Vec<f64> {
///         vec![0.0, std::f64::consts::FRAC_PI_2]
///     }
///
///     fn at(&self, _piece: usize, u: f64) -> PathPoint {
///         let angle = Jet::parameter(u);
///         let of = |f: fn(&Jet) -> f64| AxisValues::from([50.0 * f(&angle.cos()), 50.0 * f(&angle.sin())]);
///         PathPoint { axes: [of(Jet::value), of(Jet::d1), of(Jet::d2), of(Jet::d3)], tip: None }
///     }
/// }
///
/// let axis = AxisBounds { velocity: 100.0, acceleration: 500.0, jerk: 5000.0 };
/// let settings = TimeLawSettings { spans: 50, rounds: 2 };
/// let law = minimum_time_law(&Quarter, &MotionBounds::new(vec![axis; 2]), &settings)?;
/// let time = law.total_time();
/// assert!(time > 50.0 / 100.0, "no axis is faster than 100 mm/s");
/// assert!((law.piece_ends()[0] - time).abs() < 1e-12);
/// // The parameter leads back to the path, with all that a caller knows of it there.
/// let angle = law.parameter_at(0.5 * time);
/// assert!((law.at(0.5 * time).position[0] - 50.0 * angle.cos()).abs() < 1e-5);
/// # Ok::<(), facemill_feedrate::TimeLawError>(())
/// ```
///
/// # Errors
/// Limits that are not positive; a path that is not finite, does not move, or has jumps of
/// position, first or second derivative.
pub fn minimum_time_law(
    path: &dyn JointPath,
    bounds: &MotionBounds,
    settings: &TimeLawSettings,
) -> Result<TimeLaw, TimeLawError> {
    bounds.check()?;
    let (spans, ramp) = cut(path, bounds, settings.spans)?;
    let scaled = Scaled::new(bounds);
    let n = spans.len();
    let mut tightening = vec![1.0; n];
    let mut best: Option<(f64, Vec<SquaredSpeed>)> = None;
    for _ in 0..settings.rounds.max(1) {
        let problem = problem(&spans, &scaled, &tightening);
        let x = minimise(&problem);
        let paces = paces(&spans, &x);
        let stretches: Vec<f64> = spans.iter().zip(&paces).map(|(s, p)| span_stretch(s, p, &scaled)).collect();
        let most = stretches.iter().copied().fold(0.0, f64::max);
        let paces: Vec<SquaredSpeed> = paces.iter().map(|p| p.scaled(1.0 / (most * most))).collect();
        let time: f64 = paces.iter().map(SquaredSpeed::duration).sum();
        if best.as_ref().is_none_or(|(least, _)| time < *least) {
            best = Some((time, paces));
        }
        for (factor, stretch) in tightening.iter_mut().zip(&stretches) {
            *factor = (*factor * stretch).max(1.0);
        }
    }
    Ok(TimeLaw::new(spans, best.map(|b| b.1).unwrap_or_default(), ramp))
}

fn span_stretch(span: &Span, pace: &SquaredSpeed, scaled: &Scaled) -> f64 {
    let tip: &[Septic] = span.tip.as_ref().map_or(&[], |t| t);
    stretch((&span.axes, &scaled.axes), (tip, scaled.tip.unwrap_or(0.0)), pace, 0.0)
}

fn problem(spans: &[Span], scaled: &Scaled, tightening: &[f64]) -> Problem {
    let h: Vec<f64> = spans.iter().map(|s| s.h).collect();
    let mut problem = Problem::new(spans.len() + 2);
    for (i, span) in spans.iter().enumerate() {
        let tip: &[Septic] = span.tip.as_ref().map_or(&[], |t| t);
        let part = SolverSpan {
            first: i,
            h: span.h,
            ends: end_weights(&h, i),
            axes: &span.axes,
            limits: &scaled.axes,
            tip,
            tip_limit: scaled.tip.unwrap_or(0.0),
            tightening: tightening[i],
        };
        problem.push(&part);
    }
    problem
}

impl Scaled {
    pub(crate) fn new(bounds: &MotionBounds) -> Self {
        Self {
            axes: bounds.axes.iter().map(|b| [b.velocity.powi(-2), 1.0 / b.acceleration, 1.0 / b.jerk]).collect(),
            // mm/min to mm/s.
            tip: bounds.tip_feed.map(|f| (60.0 / f).powi(2)),
        }
    }
}

/// Returns the unknowns as quadratics over each span's own s.
fn paces(spans: &[Span], x: &[f64]) -> Vec<SquaredSpeed> {
    let h: Vec<f64> = spans.iter().map(|s| s.h).collect();
    (0..spans.len())
        .map(|i| {
            let ([l0, l1], [r0, r1]) = end_weights(&h, i);
            let ends = [l0 * x[i] + l1 * x[i + 1], x[i + 1], r0 * x[i + 1] + r1 * x[i + 2]];
            SquaredSpeed(ends).scaled(h[i].powi(-2))
        })
        .collect()
}

/// Cuts the path into polynomials: every piece in spans of about equal length in r.
fn cut(path: &dyn JointPath, bounds: &MotionBounds, spans: usize) -> Result<(Vec<Span>, Ramp), TimeLawError> {
    let breaks = checked_breaks(path)?;
    let ramp = Ramp { start: breaks[0], length: breaks[breaks.len() - 1] - breaks[0] };
    let last = breaks.len() - 1;
    let r_at = |k: usize| match k {
        0 => 0.0,
        k if k == last => 1.0,
        k => ramp.inverse(breaks[k]),
    };
    let mut out: Vec<Span> = Vec::with_capacity(spans + last);
    for piece in 0..last {
        let (start, end) = (r_at(piece), r_at(piece + 1));
        let n = ((end - start) * spans as f64).round().max(1.0) as usize;
        let r = |k: usize| if k == n { end } else { start + (end - start) * k as f64 / n as f64 };
        for k in 0..n {
            let within = (breaks[piece], breaks[piece + 1]);
            push_spans(path, piece, &ramp, (r(k), r(k + 1)), within, HALVINGS, &mut out)?;
        }
    }
    let n_axes = out[0].axes.len();
    if out.iter().any(|s| s.axes.len() != bounds.axes.len()) {
        return Err(TimeLawError::AxisCount { path: n_axes, bounds: bounds.axes.len() });
    }
    if bounds.tip_feed.is_some() && out.iter().any(|s| s.tip.is_none()) {
        return Err(TimeLawError::NoTip);
    }
    let still = |span: &&Span| span.axes.iter().all(|c| c[1..].iter().all(|&c| c == 0.0));
    match out.iter().find(still) {
        Some(span) => Err(TimeLawError::NoMotion { piece: span.piece }),
        None => Ok((out, ramp)),
    }
}

/// Largest distance of a span's polynomials from the path between its ends, mm or rad, as far as
/// two points in between show.
const ACCURACY: f64 = 1e-6;

/// Largest number of halvings of a span. Each brings a smooth path nearer by 2⁸; a path that still
/// is off has wrong derivatives.
const HALVINGS: u32 = 8;

/// Adds the span between two ends, halved until it keeps to the path.
fn push_spans(
    path: &dyn JointPath,
    piece: usize,
    ramp: &Ramp,
    (a, b): (f64, f64),
    within: (f64, f64),
    halvings: u32,
    out: &mut Vec<Span>,
) -> Result<(), TimeLawError> {
    let whole = span(path, piece, ramp, (a, b), within)?;
    let off = |s: f64| -> f64 {
        let u = ramp.at(a + (b - a) * s)[0].clamp(within.0, within.1);
        let given = path.at(piece, u).axes[0];
        let differences = whole.axes.iter().enumerate().map(|(k, c)| (eval(c, s)[0] - given.get_or_zero(k)).abs());
        differences.fold(0.0, f64::max)
    };
    // Large values have more rounding.
    let allowed = whole.axes.iter().map(|c| 1e-12 * c[0].abs()).fold(ACCURACY, f64::max);
    if off(0.5) <= allowed && off(0.3) <= allowed {
        out.push(whole);
        return Ok(());
    }
    if halvings == 0 {
        return Err(TimeLawError::NotSmooth { piece, parameter: ramp.at(a)[0] });
    }
    let mid = 0.5 * (a + b);
    push_spans(path, piece, ramp, (a, mid), within, halvings - 1, out)?;
    push_spans(path, piece, ramp, (mid, b), within, halvings - 1, out)
}

/// Largest jump of a derivative between pieces as a fraction of its largest value: rounding passes,
/// corners do not.
const JUMP: f64 = 1e-9;

/// Returns the ends of the pieces after checking that position, first and second derivative are
/// continuous there.
fn checked_breaks(path: &dyn JointPath) -> Result<Vec<f64>, TimeLawError> {
    let breaks = path.breaks();
    if let Some(index) = breaks.iter().position(|b| !b.is_finite()) {
        return Err(TimeLawError::BadBreaks { index });
    }
    if let Some(index) = (1..breaks.len().max(2)).find(|&k| k >= breaks.len() || breaks[k] <= breaks[k - 1]) {
        return Err(TimeLawError::BadBreaks { index });
    }
    let n = breaks.len() - 1;
    let ends: Vec<_> = (0..n).map(|k| (path.at(k, breaks[k]).axes, path.at(k, breaks[k + 1]).axes)).collect();
    for order in 0..3 {
        for axis in 0..ends[0].0[0].len() {
            let value = |q: &[AxisValues; 4]| q[order].get_or_zero(axis);
            let most = ends.iter().flat_map(|(a, b)| [value(a).abs(), value(b).abs()]).fold(0.0, f64::max);
            for piece in 1..n {
                let jump = (value(&ends[piece].0) - value(&ends[piece - 1].1)).abs();
                if jump > JUMP * most {
                    return Err(TimeLawError::Jump { piece, axis, order });
                }
            }
        }
    }
    Ok(breaks)
}
