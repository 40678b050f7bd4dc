use super::span::eval;

/// Limits in the form the solver works with: reciprocals of velocity², acceleration and jerk of every axis, and of the
/// square of the tip's speed.
pub(crate) struct Scaled {
    pub(crate) axes: Vec<[f64; 3]>,
    pub(crate) tip: Option<f64>,
}

/// What a sample says of β, β' and β'' (derivatives by r of β = ṙ²).
struct Sample {
    /// First of the three unknowns that it depends on.
    first: u32,
    /// β, β', β'' from the three unknowns.
    rows: [[f64; 3]; 3],
    /// Weight in the integral of the time.
    weight: f64,
    /// β·velocity ≤ 1.
    velocity: f64,
    /// Range of its acceleration and jerk rows.
    lines: std::ops::Range<u32>,
}

/// One axis at a sample: |a·(β, β')| ≤ 1 and √β·|j·(β, β', β'')| ≤ 1.
struct Line {
    a: [f64; 2],
    j: [f64; 3],
}

/// A span as the solver sees it.
pub(crate) struct Part<'a, const K: usize> {
    /// First of its three unknowns.
    pub(crate) first: usize,
    /// Length in the path variable.
    pub(crate) h: f64,
    /// As from [`end_weights`].
    pub(crate) ends: ([f64; 2], [f64; 2]),
    /// Axes as polynomials in s, and their limits as in [`Scaled`].
    pub(crate) axes: &'a [[f64; K]],
    pub(crate) limits: &'a [[f64; 3]],
    /// Coordinates whose joint speed is capped, and 1/cap².
    pub(crate) tip: &'a [[f64; K]],
    pub(crate) tip_limit: f64,
    /// The limits are drawn in as for a motion that is faster by this factor.
    pub(crate) tightening: f64,
}

/// How many unknowns at the start and at the end keep their values.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pinned {
    pub(crate) start: usize,
    pub(crate) end: usize,
}

/// The discrete problem: least time over the unknowns of a quadratic spline β with all limits at the samples.
pub(crate) struct Problem {
    samples: Vec<Sample>,
    lines: Vec<Line>,
    pub(crate) n: usize,
    pub(crate) pinned: Pinned,
}

/// Gradient and the symmetric band of the Hessian: row i holds columns i, i + 1, i + 2.
pub(crate) struct Quadratic {
    pub(crate) gradient: Vec<f64>,
    pub(crate) band: Vec<[f64; 3]>,
}

/// Weights of the values at the left and right end of span `i` from the unknowns i, i + 1 and i + 1, i + 2.
pub(crate) fn end_weights(h: &[f64], i: usize) -> ([f64; 2], [f64; 2]) {
    let share = |a: f64, b: f64| [b / (a + b), a / (a + b)];
    let left = if i == 0 { [1.0, 0.0] } else { share(h[i - 1], h[i]) };
    let right = if i + 1 == h.len() { [0.0, 1.0] } else { share(h[i], h[i + 1]) };
    (left, right)
}

impl Problem {
    /// No samples yet, of spans with `n` unknowns together.
    pub(crate) fn new(n: usize) -> Self {
        Self { samples: Vec::new(), lines: Vec::new(), n, pinned: Pinned::default() }
    }

    /// Adds the samples of a span.
    pub(crate) fn push<const K: usize>(&mut self, part: &Part<K>) {
        for (s, weight) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
            self.sample(part, s, weight);
        }
    }

    fn sample<const K: usize>(&mut self, part: &Part<K>, s: f64, weight: f64) {
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
        let start = self.lines.len() as u32;
        let f = part.tightening;
        let speed_sq: f64 = part.tip.iter().map(|c| (eval(c, s)[1] * d).powi(2)).sum();
        let mut velocity = speed_sq * part.tip_limit * f * f;
        for (c, limit) in part.axes.iter().zip(part.limits) {
            let limit = [limit[0] * f * f, limit[1] * f * f, limit[2] * f * f * f];
            let [_, q1, q2, q3] = eval(c, s);
            let (q1, q2, q3) = (q1 * d, q2 * d * d, q3 * d * d * d);
            velocity = velocity.max(q1 * q1 * limit[0]);
            let a = [q2 * limit[1], 0.5 * q1 * limit[1]];
            let j = [q3 * limit[2], 1.5 * q2 * limit[2], 0.5 * q1 * limit[2]];
            if q1 != 0.0 || q2 != 0.0 || q3 != 0.0 {
                self.lines.push(Line { a, j });
            }
        }
        let lines = start..self.lines.len() as u32;
        self.samples.push(Sample { first: part.first as u32, rows, weight: weight * part.h, velocity, lines });
    }

    fn state(sample: &Sample, x: &[f64]) -> [f64; 3] {
        let k = sample.first as usize;
        sample.rows.map(|w| w[0] * x[k] + w[1] * x[k + 1] + w[2] * x[k + 2])
    }

    /// The factor by which time has to be stretched so that no sample exceeds a limit.
    pub(crate) fn dilation(&self, x: &[f64]) -> f64 {
        // Squares of velocity, accelerations and squares of jerk: roots are dear.
        let (mut velocity, mut acceleration, mut jerk) = (0.0_f64, 0.0_f64, 0.0_f64);
        for sample in &self.samples {
            let [b, b1, b2] = Self::state(sample, x);
            velocity = velocity.max(b * sample.velocity);
            for line in &self.lines[sample.lines.start as usize..sample.lines.end as usize] {
                let j = line.j[0] * b + line.j[1] * b1 + line.j[2] * b2;
                acceleration = acceleration.max((line.a[0] * b + line.a[1] * b1).abs());
                jerk = jerk.max(b * j * j);
            }
        }
        velocity.sqrt().max(acceleration.sqrt()).max(jerk.powf(1.0 / 6.0))
    }

    /// Time by Simpson's rule on each span and the sum of the barriers; `None` where a limit is reached.
    pub(crate) fn value(&self, x: &[f64]) -> Option<(f64, f64)> {
        // Then β is above 0 on the whole of every span.
        if x.iter().any(|&x| x.is_nan() || x <= 0.0) {
            return None;
        }
        // Logarithms are dear: factors are multiplied first, as long as they are far from underflow.
        let (mut time, mut barrier, mut product) = (0.0, 0.0, 1.0);
        for x in x {
            product *= x;
            flush(&mut product, &mut barrier);
        }
        for sample in &self.samples {
            let [b, b1, b2] = Self::state(sample, x);
            let slack = 1.0 - b * sample.velocity;
            if slack <= 0.0 {
                return None;
            }
            time += sample.weight / b.sqrt();
            product *= slack;
            for line in &self.lines[sample.lines.start as usize..sample.lines.end as usize] {
                let a = line.a[0] * b + line.a[1] * b1;
                let j = line.j[0] * b + line.j[1] * b1 + line.j[2] * b2;
                let (sa, sj) = (1.0 - a * a, 1.0 - b * j * j);
                if sa <= 0.0 || sj <= 0.0 {
                    return None;
                }
                product *= sa * sj;
                flush(&mut product, &mut barrier);
            }
        }
        barrier -= product.ln();
        (time.is_finite() && barrier.is_finite()).then_some((time, barrier))
    }

    /// Gradient and Hessian; `curved` is the share of the jerk limits' own curvature (which may make it indefinite).
    pub(crate) fn derivatives(&self, x: &[f64], kappa: f64, curved: f64) -> Quadratic {
        let mut out = Quadratic { gradient: vec![0.0; self.n], band: vec![[0.0; 3]; self.n] };
        for (i, x) in x.iter().enumerate() {
            out.gradient[i] = -1.0 / x;
            out.band[i][0] = 1.0 / (x * x);
        }
        for sample in &self.samples {
            let y = Self::state(sample, x);
            let (g, h) = self.local(sample, y, kappa, curved);
            let k = sample.first as usize;
            let w = &sample.rows;
            // H·W, then Wᵀ·(H·W).
            let full = [[h[0], h[1], h[2]], [h[1], h[3], h[4]], [h[2], h[4], h[5]]];
            let hw: [[f64; 3]; 3] = std::array::from_fn(|r| {
                std::array::from_fn(|c| full[r][0] * w[0][c] + full[r][1] * w[1][c] + full[r][2] * w[2][c])
            });
            for ((w, hw), g) in w.iter().zip(&hw).zip(g) {
                for (c, &wc) in w.iter().enumerate() {
                    out.gradient[k + c] += g * wc;
                    for (band, &hwd) in out.band[k + c].iter_mut().zip(&hw[c..]) {
                        *band += wc * hwd;
                    }
                }
            }
        }
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

    /// Gradient and Hessian by β, β', β'' of what one sample adds: (00, 01, 02, 11, 12, 22).
    fn local(&self, sample: &Sample, [b, b1, b2]: [f64; 3], kappa: f64, curved: f64) -> ([f64; 3], [f64; 6]) {
        let root = 1.0 / b.sqrt();
        let root1 = -0.5 * root / b;
        let root2 = 0.75 * root / (b * b);
        let v = sample.velocity / (1.0 - b * sample.velocity);
        let time = kappa * sample.weight;
        // −ln(1 − β·j²) is −ln β − ln(1/√β − j) − ln(1/√β + j).
        let lines = f64::from(sample.lines.end - sample.lines.start) / b;
        let mut g = [v + time * root1 - lines, 0.0, 0.0];
        let mut h = [v * v + time * root2 + lines / b, 0.0, 0.0, 0.0, 0.0, 0.0];
        for line in &self.lines[sample.lines.start as usize..sample.lines.end as usize] {
            let [a0, a1] = line.a;
            let a = a0 * b + a1 * b1;
            let [j0, j1, j2] = line.j;
            let j = j0 * b + j1 * b1 + j2 * b2;
            // Divisions are dear: one for both slacks.
            let (slack_a, slack_j) = (1.0 - a * a, (root - j) * (root + j));
            let inverse = 1.0 / (slack_a * slack_j);
            // −ln(1 − a²)
            let s = slack_j * inverse;
            let (d, dd) = (2.0 * a * s, 2.0 * (1.0 + a * a) * s * s);
            g[0] += d * a0;
            g[1] += d * a1;
            h[0] += dd * a0 * a0;
            h[1] += dd * a0 * a1;
            h[3] += dd * a1 * a1;
            // −ln(root − j) − ln(root + j), root = 1/√β.
            let (p, m) = ((root + j) * slack_a * inverse, (root - j) * slack_a * inverse);
            let dj = p - m;
            let (cross, square) = (m * m - p * p, p * p + m * m);
            let sum = p + m;
            g[0] += dj * j0 - sum * root1;
            g[1] += dj * j1;
            g[2] += dj * j2;
            h[0] += square * (j0 * j0 + root1 * root1) + 2.0 * cross * j0 * root1 - curved * sum * root2;
            h[1] += square * j0 * j1 + cross * j1 * root1;
            h[2] += square * j0 * j2 + cross * j2 * root1;
            h[3] += square * j1 * j1;
            h[4] += square * j1 * j2;
            h[5] += square * j2 * j2;
        }
        (g, h)
    }
}

/// Moves a product that has come near the ends of the range of numbers into the sum of −ln.
#[inline]
fn flush(product: &mut f64, barrier: &mut f64) {
    // Slacks are at least 1e-16, unknowns of a usual size: three factors more are far from underflow.
    if *product < 1e-200 || *product > 1e200 {
        *barrier -= product.ln();
        *product = 1.0;
    }
}

/// Solves H·step = −gradient by the Cholesky factors of the band; `None` where H is not positive definite.
pub(crate) fn newton_step(q: &Quadratic) -> Option<Vec<f64>> {
    let n = q.gradient.len();
    let mut l = q.band.clone();
    let mut y: Vec<f64> = q.gradient.iter().map(|g| -g).collect();
    for i in 0..n {
        let pivot = l[i][0];
        // An indefinite matrix, or one that rounding has made so.
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
