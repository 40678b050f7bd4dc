//! All real roots of a trigonometric polynomial, double ones included.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use nalgebra::Complex;

/// Largest degree of the polynomials.
pub(crate) const DEGREE: usize = 6;

/// Number of equidistant values that determine a polynomial: one more than its coefficients, so the
/// highest sine is not lost.
pub(crate) const SAMPLES: usize = 2 * (DEGREE + 1);

/// Arcs in which roots are searched: as many as keep the grid of samples the same in each.
const ARCS: usize = SAMPLES / 2;

/// Bernstein coefficients on an arc.
const ORDER: usize = 2 * DEGREE + 1;

/// Halvings of an arc: to 9e-7 rad, the distance at which the rounding of the samples (1e-14)
/// merges two roots.
const HALVINGS: u32 = 20;

/// Pieces examined before the polynomial counts as zero all along an arc.
const MOST_PIECES: usize = 1200;

/// Length of a bracket in which a root is taken from the last step, which is much nearer to it; as
/// a fraction of an arc.
const CLOSED: f64 = 1e-6;

/// Largest number of returned values.
const MOST_SEEDS: usize = 64;

/// Length of a stretch, rad, up to which it holds one pair of roots that merge at the rounding of
/// the samples.
const NARROW: f64 = 5e-6;

/// Pieces with roots that cannot be separated are one when they are this near to each other, rad.
const ADJACENT: f64 = 1e-9;

/// Returns the angle of sample `k`.
pub(crate) fn sample_angle(k: usize) -> f64 {
    (k as f64 + 0.5) * TAU / SAMPLES as f64
}

/// Returns cosine and sine of every sample's angle.
pub(crate) fn sample_directions() -> &'static [[f64; 2]; SAMPLES] {
    static DIRECTIONS: LazyLock<[[f64; 2]; SAMPLES]> = LazyLock::new(|| {
        std::array::from_fn(|k| {
            let (sin, cos) = sample_angle(k).sin_cos();
            [cos, sin]
        })
    });
    &DIRECTIONS
}

/// Angles near which every root lies: a simple one to 1e-9 rad; where two or more are nearer to
/// each other than 1e-6 rad, or than rounding can resolve, three or five equidistant ones over the
/// stretch that holds them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seeds {
    angles: [f64; MOST_SEEDS],
    n: usize,
    /// The stretch under construction.
    stretch: Option<[f64; 2]>,
    /// Length of the longest stretch.
    pub(crate) widest: f64,
    /// Whether there were more pieces than are examined: the polynomial is zero, or nearly so,
    /// along an arc.
    pub(crate) cut_off: bool,
}

impl Seeds {
    pub(crate) fn as_slice(&self) -> &[f64] {
        &self.angles[..self.n]
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.angles[..self.n]
    }

    /// Adds a piece that holds roots; such pieces come in ascending order.
    fn push_piece(&mut self, low: f64, high: f64) {
        match &mut self.stretch {
            Some(stretch) if low - stretch[1] < ADJACENT => stretch[1] = high,
            _ => {
                self.end_stretch();
                self.stretch = Some([low, high]);
            }
        }
    }

    fn end_stretch(&mut self) {
        if let Some([low, high]) = self.stretch.take() {
            self.widest = self.widest.max(high - low);
            let n = if high - low < NARROW { 3 } else { 5 };
            for k in 0..n {
                self.push(low + (high - low) * f64::from(k) / f64::from(n - 1));
            }
        }
    }

    fn push(&mut self, angle: f64) {
        if self.n < MOST_SEEDS {
            self.angles[self.n] = angle;
            self.n += 1;
        } else {
            self.cut_off = true;
        }
    }
}

/// Returns the real roots of the trigonometric polynomial of at most [`DEGREE`] with these values
/// at the [sample angles](sample_angle), known to `noise`.
///
/// On an arc around φ₀, x = tan((φ − φ₀)/2) makes it a polynomial of twice the degree over (1 +
/// x²)^degree. Its Bernstein coefficients have as many changes of sign as there are roots, or an
/// even number more (Descartes' rule); none and one are proofs. Other pieces are halved; those that
/// cannot be decided at the smallest width are returned as they are. So a double root is found, as
/// is one that rounding has turned into a near miss.
pub(crate) fn real_roots(samples: &[f64; SAMPLES], noise: f64) -> Seeds {
    let basis: &Basis = &BASIS;
    let mut seeds = Seeds { angles: [0.0; MOST_SEEDS], n: 0, stretch: None, widest: 0.0, cut_off: false };
    let mut budget = MOST_PIECES;
    for arc in 0..ARCS {
        let mut shifted = [0.0; SAMPLES];
        for (k, value) in shifted.iter_mut().enumerate() {
            *value = samples[(k + 2 * arc) % SAMPLES];
        }
        let mut c = [0.0; ORDER];
        for (c, row) in c.iter_mut().zip(&basis.from_samples) {
            *c = row.iter().zip(&shifted).map(|(m, h)| m * h).sum();
        }
        let piece = ArcPiece { c, low: 0.0, width: 1.0 };
        let centre = TAU * arc as f64 / ARCS as f64;
        let angle = |s: f64| centre + 2.0 * (basis.half_width * (2.0 * s - 1.0)).atan();
        isolate(&piece, HALVINGS, noise, &mut budget, &mut |found| match found {
            Isolated::Root(s) => seeds.push(angle(s)),
            Isolated::Piece(low, high) => seeds.push_piece(angle(low), angle(high)),
        });
    }
    seeds.end_stretch();
    seeds.cut_off |= budget == 0;
    seeds
}

/// Bernstein coefficients on the part of an arc from `low` to `low + width`, where 0 to 1 is all of
/// it.
struct ArcPiece {
    c: [f64; ORDER],
    low: f64,
    width: f64,
}

/// Conclusion from the signs of the coefficients.
enum Signs {
    NoRoot,
    OneRoot,
    Unknown,
    /// No conclusion: all of them are noise.
    Noise,
}

/// A root, or a piece with some, as fractions of the arc.
enum Isolated {
    Root(f64),
    Piece(f64, f64),
}

fn isolate(piece: &ArcPiece, halvings: u32, noise: f64, budget: &mut usize, found: &mut impl FnMut(Isolated)) {
    if *budget == 0 {
        return;
    }
    *budget -= 1;
    match piece.signs(noise) {
        Signs::NoRoot => {}
        Signs::OneRoot => found(Isolated::Root(piece.low + piece.width * piece.only_root())),
        Signs::Noise => found(Isolated::Piece(piece.low, piece.low + piece.width)),
        Signs::Unknown if halvings == 0 => found(Isolated::Piece(piece.low, piece.low + piece.width)),
        Signs::Unknown => {
            for half in piece.halves() {
                isolate(&half, halvings - 1, noise, budget, found);
            }
        }
    }
}

impl ArcPiece {
    fn signs(&self, noise: f64) -> Signs {
        let positive = self.c.iter().filter(|&&c| c > noise).count();
        let negative = self.c.iter().filter(|&&c| c < -noise).count();
        if positive == ORDER || negative == ORDER {
            return Signs::NoRoot;
        }
        if positive + negative == 0 {
            return Signs::Noise;
        }
        // One change: undecided signs lie only between the two runs.
        let (first, last) = (self.c[0], self.c[ORDER - 1]);
        let (of_first, of_last) = if first > 0.0 { (positive, negative) } else { (negative, positive) };
        let opposite = first.abs() > noise && last.abs() > noise && (first > 0.0) != (last > 0.0);
        if !opposite {
            return Signs::Unknown;
        }
        let like = |c: &f64, end: f64| c.abs() > noise && (*c > 0.0) == (end > 0.0);
        let run = self.c.iter().take_while(|c| like(c, first)).count();
        let end_run = self.c.iter().rev().take_while(|c| like(c, last)).count();
        if run == of_first && end_run == of_last { Signs::OneRoot } else { Signs::Unknown }
    }

    /// Splits in the middle by De Casteljau.
    fn halves(&self) -> [Self; 2] {
        let mut c = self.c;
        let mut left = [0.0; ORDER];
        for (k, left) in left.iter_mut().enumerate() {
            *left = c[0];
            for i in 0..ORDER - 1 - k {
                c[i] = 0.5 * (c[i] + c[i + 1]);
            }
        }
        // c[i] now holds the point of step ORDER−1−i, which are the coefficients of the right half.
        let width = 0.5 * self.width;
        [Self { c: left, low: self.low, width }, Self { c, low: self.low + width, width }]
    }

    fn value(&self, s: f64) -> f64 {
        let (mut power, back) = (1.0, 1.0 - s);
        let mut sum = 0.0;
        // Horner's scheme in s/(1−s), without the quotient.
        for (c, binomial) in self.c.iter().zip(&BASIS.binomials) {
            sum = sum * back + power * binomial * c;
            power *= s;
        }
        sum
    }

    /// Returns the root between ends of opposite sign, as a fraction of the piece (Ridders). The
    /// bracket itself is closed: where the polynomial is nearly zero at an end without a root
    /// there, steps get small long before.
    fn only_root(&self) -> f64 {
        let (mut a, mut b) = ([0.0, self.c[0]], [1.0, self.c[ORDER - 1]]);
        let point = |s: f64| [s, self.value(s)];
        for _ in 0..60 {
            let middle = point(0.5 * (a[0] + b[0]));
            let root = (middle[1] * middle[1] - a[1] * b[1]).sqrt();
            let at = point(middle[0] + (middle[0] - a[0]) * (a[1].signum() * middle[1] / root).clamp(-1.0, 1.0));
            if at[1] == 0.0 || (b[0] - a[0]) * self.width < CLOSED {
                return at[0];
            }
            let [low, high] = if at[0] < middle[0] { [at, middle] } else { [middle, at] };
            let is_between = |p: [f64; 2], q: [f64; 2]| (p[1] > 0.0) != (q[1] > 0.0);
            [a, b] = if is_between(a, low) {
                [a, low]
            } else if is_between(low, high) {
                [low, high]
            } else {
                [high, b]
            };
        }
        0.5 * (a[0] + b[0])
    }
}

/// Precomputed part that does not depend on the polynomial.
struct Basis {
    /// Matrix from samples to Bernstein coefficients on the arc around angle 0.
    from_samples: [[f64; SAMPLES]; ORDER],
    binomials: [f64; ORDER],
    /// tan of a quarter of the arc.
    half_width: f64,
}

static BASIS: LazyLock<Basis> = LazyLock::new(Basis::new);

impl Basis {
    fn new() -> Self {
        let half_width = (0.25 * TAU / ARCS as f64).tan();
        let mut binomials = [1.0; ORDER];
        for k in 1..ORDER {
            binomials[k] = binomials[k - 1] * (ORDER - k) as f64 / k as f64;
        }
        let mut from_samples = [[0.0; SAMPLES]; ORDER];
        for m in -(DEGREE as i32)..=DEGREE as i32 {
            let harmonic = harmonic(m, half_width, &binomials);
            for (row, b) in from_samples.iter_mut().zip(harmonic) {
                for (k, entry) in row.iter_mut().enumerate() {
                    *entry += (b * Complex::from_polar(1.0, -f64::from(m) * sample_angle(k))).re / SAMPLES as f64;
                }
            }
        }
        Self { from_samples, binomials, half_width }
    }
}

/// Returns Bernstein coefficients of e^{imφ}(1 + x²)^n = (1 + ix)^{n+m}·(1 − ix)^{n−m}, x =
/// tan(φ/2) from −w to w.
fn harmonic(m: i32, w: f64, binomials: &[f64; ORDER]) -> [Complex<f64>; ORDER] {
    let mut scaled = [Complex::new(0.0, 0.0); ORDER];
    scaled[0] = Complex::new(1.0, 0.0);
    for factor in 0..2 * DEGREE as i32 {
        let x = if factor < DEGREE as i32 + m { w } else { -w };
        // A linear factor has its values at the ends as coefficients; coefficients times binomials
        // multiply as polynomials do.
        let (low, high) = (Complex::new(1.0, -x), Complex::new(1.0, x));
        for k in (0..ORDER).rev() {
            scaled[k] = scaled[k] * low + if k > 0 { scaled[k - 1] * high } else { Complex::new(0.0, 0.0) };
        }
    }
    std::array::from_fn(|k| scaled[k] / binomials[k])
}

#[cfg(test)]
#[path = "../../tests/unit/solver/trig_roots.rs"]
mod tests;
