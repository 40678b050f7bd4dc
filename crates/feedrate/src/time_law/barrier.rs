use super::lanes::{LANES, Lanes};
use super::span::eval;

/// Limits in the solver's form: reciprocals of velocity², acceleration and jerk of every axis, and
/// of the square of the tip's speed.
pub(crate) struct Scaled {
    pub(crate) axes: Vec<[f64; 3]>,
    pub(crate) tip: Option<f64>,
}

/// Bounds of samples on β, β' and β'' (derivatives by r of β = ṙ²), one sample per lane.
struct Group {
    /// First of the three unknowns that it depends on.
    first: [u32; LANES],
    /// β, β', β'' from the three unknowns.
    rows: [[Lanes; 3]; 3],
    /// β where the rows are 0: 1 in lanes without a sample, which then have no effect.
    still: Lanes,
    /// Weight in the integral of the time.
    weight: Lanes,
    /// β·velocity ≤ 1.
    velocity: Lanes,
    /// Range of its acceleration and jerk rows.
    lines: std::ops::Range<u32>,
}

/// One axis at samples: |a·(β, β')| ≤ 1 and √β·|j·(β, β', β'')| ≤ 1; 0 where a sample has fewer
/// axes.
struct AxisRows {
    a: [Lanes; 2],
    j: [Lanes; 3],
}

/// Samples of a span.
const SAMPLES: usize = 3;

/// A span in the solver's form.
pub(crate) struct SolverSpan<'a, const K: usize> {
    /// First of its three unknowns.
    pub(crate) first: usize,
    /// Length in the path variable.
    pub(crate) h: f64,
    /// Weights from [`end_weights`].
    pub(crate) ends: ([f64; 2], [f64; 2]),
    /// Axes as polynomials in s, and their limits as in [`Scaled`].
    pub(crate) axes: &'a [[f64; K]],
    pub(crate) limits: &'a [[f64; 3]],
    /// Coordinates whose joint speed is capped, and 1/cap².
    pub(crate) tip: &'a [[f64; K]],
    pub(crate) tip_limit: f64,
    /// Factor of tightening: limits are those of a motion faster by this factor.
    pub(crate) tightening: f64,
}

/// Numbers of unknowns at the start and at the end that keep their values.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pinned {
    pub(crate) start: usize,
    pub(crate) end: usize,
}

/// Limits of the motion in a span, by its samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Largest β at constant speed.
    pub(crate) steady: f64,
    /// Largest |β'|, and largest √β·|β''|, where the other terms are 0.
    pub(crate) change: f64,
    pub(crate) bend: f64,
}

/// The discrete problem: least time over the unknowns of a quadratic spline β with all limits at
/// the samples.
pub(crate) struct Problem {
    groups: Vec<Group>,
    lines: Vec<AxisRows>,
    samples: usize,
    reaches: Vec<Reach>,
    pub(crate) n: usize,
    pub(crate) pinned: Pinned,
}

/// Gradient and the symmetric band of the Hessian: row i holds columns i, i + 1, i + 2.
pub(crate) struct Quadratic {
    pub(crate) gradient: Vec<f64>,
    pub(crate) band: Vec<[f64; 3]>,
}

/// Returns weights of the values at the left and right end of span `i` from the unknowns i, i + 1
/// and i + 1, i + 2.
pub(crate) fn end_weights(h: &[f64], i: usize) -> ([f64; 2], [f64; 2]) {
    let share = |a: f64, b: f64| [b / (a + b), a / (a + b)];
    let left = if i == 0 { [1.0, 0.0] } else { share(h[i - 1], h[i]) };
    let right = if i + 1 == h.len() { [0.0, 1.0] } else { share(h[i], h[i + 1]) };
    (left, right)
}

impl Problem {
    /// Creates a problem without samples, for spans with `n` unknowns together.
    pub(crate) fn new(n: usize) -> Self {
        let groups = Vec::with_capacity((SAMPLES * n).div_ceil(LANES));
        Self { groups, lines: Vec::new(), samples: 0, reaches: Vec::with_capacity(n), n, pinned: Pinned::default() }
    }

    /// Adds the samples of a span.
    pub(crate) fn push<const K: usize>(&mut self, part: &SolverSpan<K>) {
        // The largest steady speed, and reciprocals: by velocity and acceleration, by jerk; of
        // change and bend.
        let mut most = [0.0; 4];
        for (s, weight) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
            self.sample(part, s, weight, &mut most);
        }
        let [still, jerk, change, bend] = most;
        let steady = 1.0 / still.max(jerk.cbrt().powi(2));
        self.reaches.push(Reach { steady, change: 1.0 / change, bend: 1.0 / bend });
    }

    /// Returns the reach of each span, in the order in which the spans were added.
    pub(crate) fn reaches(&self) -> &[Reach] {
        &self.reaches
    }

    /// Returns the group and the lane of the next sample.
    fn next_lane(&mut self) -> usize {
        let lane = self.samples % LANES;
        if lane == 0 {
            let start = self.lines.len() as u32;
            let (rows, weight) = ([[Lanes::ZERO; 3]; 3], Lanes::ZERO);
            let (still, velocity, lines) = (Lanes::all(1.0), Lanes::ZERO, start..start);
            self.groups.push(Group { first: [0; LANES], rows, still, weight, velocity, lines });
        }
        self.samples += 1;
        lane
    }

    fn sample<const K: usize>(&mut self, part: &SolverSpan<K>, s: f64, weight: f64, most: &mut [f64; 4]) {
        let lane = self.next_lane();
        let Some(group) = self.groups.last_mut() else { return };
        let ([l0, l1], [r0, r1]) = part.ends;
        let t = 1.0 - s;
        // A combination of left end, middle control point and right end, in the unknowns.
        let row = |l: f64, m: f64, r: f64| [l * l0, l * l1 + m + r * r0, r * r1];
        let d = 1.0 / part.h;
        let rows = [
            row(t * t, 2.0 * s * t, s * s),
            row(-2.0 * t * d, 2.0 * (1.0 - 2.0 * s) * d, 2.0 * s * d),
            row(2.0 * d * d, -4.0 * d * d, 2.0 * d * d),
        ];
        let f = part.tightening;
        let speed_sq: f64 = part.tip.iter().map(|c| (eval(c, s)[1] * d).powi(2)).sum();
        let mut velocity = speed_sq * part.tip_limit * f * f;
        let mut line = group.lines.start as usize;
        for (c, limit) in part.axes.iter().zip(part.limits) {
            let limit = [limit[0] * f * f, limit[1] * f * f, limit[2] * f * f * f];
            let [_, q1, q2, q3] = eval(c, s);
            let (q1, q2, q3) = (q1 * d, q2 * d * d, q3 * d * d * d);
            velocity = velocity.max(q1 * q1 * limit[0]);
            let a = [q2 * limit[1], 0.5 * q1 * limit[1]];
            let j = [q3 * limit[2], 1.5 * q2 * limit[2], 0.5 * q1 * limit[2]];
            if q1 == 0.0 && q2 == 0.0 && q3 == 0.0 {
                continue;
            }
            if line == self.lines.len() {
                self.lines.push(AxisRows { a: [Lanes::ZERO; 2], j: [Lanes::ZERO; 3] });
            }
            let into = &mut self.lines[line];
            (0..2).for_each(|k| into.a[k].0[lane] = a[k]);
            (0..3).for_each(|k| into.j[k].0[lane] = j[k]);
            line += 1;
            let sizes = [a[0].abs(), j[0].abs(), a[1].abs(), j[2].abs()];
            *most = std::array::from_fn(|k| most[k].max(sizes[k]));
        }
        most[0] = most[0].max(velocity);
        group.lines.end = self.lines.len() as u32;
        group.first[lane] = part.first as u32;
        (0..3).for_each(|k| (0..3).for_each(|c| group.rows[k][c].0[lane] = rows[k][c]));
        group.still.0[lane] = 0.0;
        group.weight.0[lane] = weight * part.h;
        group.velocity.0[lane] = velocity;
    }

    /// Returns the factor by which time has to be stretched until no sample exceeds a limit.
    pub(crate) fn dilation(&self, x: &[f64]) -> f64 {
        pulp::Arch::new().dispatch(Dilation { problem: self, x })
    }

    /// Returns the time by Simpson's rule on each span and the sum of the barriers; `None` where a
    /// limit is reached.
    pub(crate) fn value(&self, x: &[f64]) -> Option<(f64, f64)> {
        // Positive unknowns keep β above 0 on every whole span.
        if x.iter().any(|&x| x.is_nan() || x <= 0.0) {
            return None;
        }
        pulp::Arch::new().dispatch(Value { problem: self, x })
    }

    /// Returns gradient and Hessian; `curved` is the fraction of the jerk limits' own curvature
    /// (which may make it indefinite).
    pub(crate) fn derivatives(&self, x: &[f64], kappa: f64, curved: f64) -> Quadratic {
        let mut out = Quadratic { gradient: vec![0.0; self.n], band: vec![[0.0; 3]; self.n] };
        for (i, x) in x.iter().enumerate() {
            out.gradient[i] = -1.0 / x;
            out.band[i][0] = 1.0 / (x * x);
        }
        pulp::Arch::new().dispatch(Derivatives { problem: self, x, kappa, curved, out: &mut out });
        self.pin(&mut out);
        out
    }

    /// Makes the step of pinned unknowns 0.
    fn pin(&self, q: &mut Quadratic) {
        let (start, end) = (self.pinned.start, self.n - self.pinned.end);
        for i in (0..start).chain(end..self.n) {
            q.gradient[i] = 0.0;
            q.band[i] = [1.0, 0.0, 0.0];
            for back in 1..=2.min(i) {
                q.band[i - back][back] = 0.0;
            }
        }
    }
}

impl Group {
    /// Returns β, β' and β''.
    #[inline(always)]
    fn state(&self, x: &[f64]) -> [Lanes; 3] {
        let mut at = [Lanes::ZERO; 3];
        for (lane, &first) in self.first.iter().enumerate() {
            let k = first as usize;
            (0..3).for_each(|i| at[i].0[lane] = x[k + i]);
        }
        let [b, b1, b2] = self.rows.map(|w| w[0] * at[0] + w[1] * at[1] + w[2] * at[2]);
        [b + self.still, b1, b2]
    }

    #[inline(always)]
    fn lines<'a>(&self, problem: &'a Problem) -> &'a [AxisRows] {
        &problem.lines[self.lines.start as usize..self.lines.end as usize]
    }

    /// Returns gradient and Hessian by β, β', β'' of the samples' contributions: (00, 01, 02, 11,
    /// 12, 22).
    #[inline(always)]
    fn local(&self, lines: &[AxisRows], [b, b1, b2]: [Lanes; 3], kappa: f64, curved: f64) -> ([Lanes; 3], [Lanes; 6]) {
        let one = Lanes::all(1.0);
        let inverse_b = one.over(b);
        let root = inverse_b.root();
        let root1 = root * inverse_b * -0.5;
        let root2 = root * inverse_b * inverse_b * 0.75;
        let v = self.velocity.over(one - b * self.velocity);
        let time = self.weight * kappa;
        // −ln(1 − β·j²) is −ln β − ln(1/√β − j) − ln(1/√β + j).
        let all = inverse_b * lines.len() as f64;
        let mut g = [v + time * root1 - all, Lanes::ZERO, Lanes::ZERO];
        let mut h = [Lanes::ZERO; 6];
        h[0] = v * v + time * root2 + all * inverse_b;
        for line in lines {
            let [a0, a1] = line.a;
            let a = a0 * b + a1 * b1;
            let [j0, j1, j2] = line.j;
            let j = j0 * b + j1 * b1 + j2 * b2;
            // Divisions are expensive: one for both slacks.
            let (slack_a, slack_j) = (one - a * a, (root - j) * (root + j));
            let inverse = one.over(slack_a * slack_j);
            // −ln(1 − a²)
            let s = slack_j * inverse;
            let (d, dd) = (a * s * 2.0, (one + a * a) * s * s * 2.0);
            g[0] += d * a0;
            g[1] += d * a1;
            h[0] += dd * a0 * a0;
            h[1] += dd * a0 * a1;
            h[3] += dd * a1 * a1;
            // −ln(root − j) − ln(root + j), root = 1/√β.
            let of_j = slack_a * inverse;
            let (p, m) = ((root + j) * of_j, (root - j) * of_j);
            let dj = p - m;
            let (cross, square) = (m * m - p * p, p * p + m * m);
            let sum = p + m;
            g[0] += dj * j0 - sum * root1;
            g[1] += dj * j1;
            g[2] += dj * j2;
            h[0] += square * (j0 * j0 + root1 * root1) + cross * j0 * root1 * 2.0 - sum * root2 * curved;
            h[1] += square * j0 * j1 + cross * j1 * root1;
            h[2] += square * j0 * j2 + cross * j2 * root1;
            h[3] += square * j1 * j1;
            h[4] += square * j1 * j2;
            h[5] += square * j2 * j2;
        }
        (g, h)
    }
}

/// The largest stretch of time that a sample requires. A type of its own, like [`Value`] and
/// [`Derivatives`]: with a closure called by [`pulp::Arch::dispatch`], only a shell would get the
/// vector instructions.
struct Dilation<'a> {
    problem: &'a Problem,
    x: &'a [f64],
}

impl pulp::NullaryFnOnce for Dilation<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        // Squares of velocity, accelerations and squares of jerk: roots are expensive.
        let (mut velocity, mut acceleration, mut jerk) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
        for group in &self.problem.groups {
            let [b, b1, b2] = group.state(self.x);
            velocity = velocity.max(b * group.velocity);
            for line in group.lines(self.problem) {
                let j = line.j[0] * b + line.j[1] * b1 + line.j[2] * b2;
                acceleration = acceleration.max((line.a[0] * b + line.a[1] * b1).size());
                jerk = jerk.max(b * j * j);
            }
        }
        velocity.largest().sqrt().max(acceleration.largest().sqrt()).max(jerk.largest().powf(1.0 / 6.0))
    }
}

/// Time and barriers.
struct Value<'a> {
    problem: &'a Problem,
    x: &'a [f64],
}

impl pulp::NullaryFnOnce for Value<'_> {
    type Output = Option<(f64, f64)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        // Logarithms are expensive: factors are multiplied first, as long as they are far from
        // underflow.
        let (mut barrier, mut product) = (0.0, 1.0);
        for x in self.x {
            product *= x;
            flush(&mut product, &mut barrier);
        }
        let one = Lanes::all(1.0);
        let (mut time, mut products) = (Lanes::ZERO, one);
        for group in &self.problem.groups {
            let [b, b1, b2] = group.state(self.x);
            let slack = one - b * group.velocity;
            let mut least = slack;
            time += group.weight.over(b.root());
            products = products * slack;
            for lines in group.lines(self.problem).chunks(AT_ONCE) {
                for line in lines {
                    let a = line.a[0] * b + line.a[1] * b1;
                    let j = line.j[0] * b + line.j[1] * b1 + line.j[2] * b2;
                    let (sa, sj) = (one - a * a, one - b * j * j);
                    least = least.min(sa).min(sj);
                    products = products * (sa * sj);
                }
                // A NaN is below nothing.
                let least = least.least();
                if least.is_nan() || least <= 0.0 {
                    return None;
                }
                if products.least() < 1e-100 {
                    barrier -= products.0.into_iter().map(f64::ln).sum::<f64>();
                    products = one;
                }
            }
        }
        let time = time.sum();
        barrier -= product.ln() + products.0.into_iter().map(f64::ln).sum::<f64>();
        (time.is_finite() && barrier.is_finite()).then_some((time, barrier))
    }
}

/// Number of axes whose slacks, of at least 1e-16 each, may be multiplied from 1e-100 on.
const AT_ONCE: usize = 5;

/// Adds the samples' contributions to gradient and Hessian.
struct Derivatives<'a> {
    problem: &'a Problem,
    x: &'a [f64],
    kappa: f64,
    curved: f64,
    out: &'a mut Quadratic,
}

impl pulp::NullaryFnOnce for Derivatives<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for group in &self.problem.groups {
            let y = group.state(self.x);
            let (g, h) = group.local(group.lines(self.problem), y, self.kappa, self.curved);
            let w = &group.rows;
            // H·W, then Wᵀ·(H·W).
            let full = [[h[0], h[1], h[2]], [h[1], h[3], h[4]], [h[2], h[4], h[5]]];
            let mut hw = [[Lanes::ZERO; 3]; 3];
            for (hw, h) in hw.iter_mut().zip(full) {
                for (c, hw) in hw.iter_mut().enumerate() {
                    *hw = h[0] * w[0][c] + h[1] * w[1][c] + h[2] * w[2][c];
                }
            }
            let mut gradient = [Lanes::ZERO; 3];
            let mut band = [[Lanes::ZERO; 3]; 3];
            for c in 0..3 {
                gradient[c] = g[0] * w[0][c] + g[1] * w[1][c] + g[2] * w[2][c];
                for d in c..3 {
                    band[c][d - c] = w[0][c] * hw[0][d] + w[1][c] * hw[1][d] + w[2][c] * hw[2][d];
                }
            }
            for (lane, &first) in group.first.iter().enumerate() {
                let k = first as usize;
                for c in 0..3 {
                    self.out.gradient[k + c] += gradient[c].0[lane];
                    (0..3 - c).for_each(|d| self.out.band[k + c][d] += band[c][d].0[lane]);
                }
            }
        }
    }
}

/// Moves a product that is near the ends of the range of numbers into the sum of −ln.
#[inline(always)]
fn flush(product: &mut f64, barrier: &mut f64) {
    // Unknowns are of usual size: three more factors are far from underflow.
    if *product < 1e-200 || *product > 1e200 {
        *barrier -= product.ln();
        *product = 1.0;
    }
}

/// Solves H·step = −gradient by the Cholesky factors of the band; `None` where H is not positive
/// definite.
pub(crate) fn newton_step(q: &Quadratic) -> Option<Vec<f64>> {
    let n = q.gradient.len();
    let mut l = q.band.clone();
    let mut y: Vec<f64> = q.gradient.iter().map(|g| -g).collect();
    for i in 0..n {
        let pivot = l[i][0];
        // An indefinite matrix, or one made indefinite by rounding.
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        let (f1, f2) = (l[i][1] / pivot, l[i][2] / pivot);
        if i + 1 < n {
            l[i + 1][0] -= f1 * l[i][1];
            l[i + 1][1] -= f1 * l[i][2];
            y[i + 1] -= f1 * y[i];
        }
        if i + 2 < n {
            l[i + 2][0] -= f2 * l[i][2];
            y[i + 2] -= f2 * y[i];
        }
    }
    for i in (0..n).rev() {
        let mut value = y[i];
        if i + 1 < n {
            value -= l[i][1] * y[i + 1];
        }
        if i + 2 < n {
            value -= l[i][2] * y[i + 2];
        }
        y[i] = value / l[i][0];
    }
    Some(y)
}
