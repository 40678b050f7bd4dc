use std::f64::consts::PI;

use nalgebra::{Point2, Vector2};

use crate::section::elliptic::ellipse_arc;
use crate::section::level_curve::LevelCurve;

/// Lower outline of a cutter's end in the frame of the tool (y along the axis as seen in the
/// section), about the middle of its rim: the rim, a circle of radius `rim`, appears as the ellipse
/// (`rim`, `squash`·`rim`), and the corner offsets it by `corner`.
///
/// The turn w in [−π, π] gives a point: it is t + φ for the eccentric angle t and the angle φ of
/// the normal (sin φ, −cos φ), tan φ = `squash`·tan t. Both run from −π/2 to π/2. t changes most
/// where the ellipse is long and φ where it is sharp, so equal steps of w resolve the outline for
/// any squash.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rim {
    /// R − r, mm.
    pub(crate) rim: f64,
    /// r, mm.
    pub(crate) corner: f64,
    /// Sine of the angle between the axis and the section plane, in [0, 1].
    pub(crate) squash: f64,
}

/// A point of the outline with its angles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RimPoint {
    pub(crate) at: Vector2<f64>,
    /// Sine and cosine of the eccentric angle.
    ellipse: [f64; 2],
    /// Outward normal.
    normal: Vector2<f64>,
}

impl RimPoint {
    /// Returns dy/dx of the outline.
    pub(crate) fn slope(&self) -> f64 {
        -self.normal.x / self.normal.y
    }
}

impl Rim {
    pub(crate) fn half_width(&self) -> f64 {
        self.rim + self.corner
    }

    /// Returns the point whose eccentric angle has this sine and cosine ≥ 0.
    fn point(&self, sin: f64, cos: f64) -> RimPoint {
        let s = self.squash;
        let length = (cos * cos + s * s * sin * sin).sqrt();
        let normal = if length > 0.0 { Vector2::new(s * sin, -cos) / length } else { Vector2::new(sin, 0.0) };
        let at = Vector2::new(self.rim * sin, -s * self.rim * cos) + normal * self.corner;
        RimPoint { at, ellipse: [sin, cos], normal }
    }

    /// Returns the point at a turn.
    pub(crate) fn at_turn(&self, turn: f64) -> RimPoint {
        if turn.abs() >= PI {
            return self.point(turn.signum(), 0.0);
        }
        // tan(t + φ) = (T + s·T)/(1 − s·T²) for T = tan t, solved for T.
        let ((sin, cos), s) = (turn.sin_cos(), self.squash);
        let along = (1.0 + s) * cos;
        let root = (along * along + 4.0 * s * sin * sin).sqrt();
        let (up, down) = if cos >= 0.0 { (2.0 * sin, along + root) } else { (root - along, 2.0 * s * sin) };
        let length = (up * up + down * down).sqrt().copysign(down);
        self.point(up / length, down / length)
    }

    /// Returns the turn of the point with this eccentric angle.
    pub(crate) fn turn_of(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        (angle + (self.squash * sin).atan2(cos)).clamp(-PI, PI)
    }

    /// Returns the point whose outward normal is `direction`, which points down; on a straight
    /// piece its middle.
    pub(crate) fn support(&self, direction: Vector2<f64>) -> Vector2<f64> {
        let length = direction.x.hypot(self.squash * direction.y);
        let ellipse = if length > 0.0 {
            Vector2::new(direction.x, self.squash * self.squash * direction.y) * (self.rim / length)
        } else {
            Vector2::zeros()
        };
        ellipse + direction * self.corner
    }

    /// Returns the point over `x`, which is clamped to the outline's width.
    pub(crate) fn over(&self, x: f64) -> RimPoint {
        if x.abs() >= self.half_width() {
            return self.point(x.signum(), 0.0);
        }
        if self.corner == 0.0 {
            let sin = x / self.rim;
            return self.point(sin, ((1.0 - sin) * (1.0 + sin)).sqrt());
        }
        self.at_turn(newton_root([-PI, PI], f64::EPSILON * self.half_width(), |w| {
            let p = self.at_turn(w);
            (p.at.x - x, self.widening(&p))
        }))
    }

    /// Returns dx/dw at a point.
    fn widening(&self, p: &RimPoint) -> f64 {
        let ([sin, cos], s) = (p.ellipse, self.squash);
        let length_sq = cos * cos + s * s * sin * sin;
        (self.rim * cos * length_sq - self.corner * p.normal.y * s) / (length_sq + s)
    }

    /// Returns ∫ y dx from one of its points to another: the ellipse's and the corner's parts are
    /// elementary, the mixed part is e·n minus the length of the ellipse (`docs/chip-area.md`).
    pub(crate) fn integral(&self, from: &RimPoint, to: &RimPoint) -> f64 {
        let (s, rim, r) = (self.squash, self.rim, self.corner);
        let primitive = |p: &RimPoint| {
            let ([sin, cos], n) = (p.ellipse, p.normal);
            let ellipse = -0.5 * s * rim * rim * (sin.atan2(cos) + sin * cos);
            let corner = -0.5 * r * r * (n.x.atan2(-n.y) - n.x * n.y);
            let mixed = if r > 0.0 && rim > 0.0 { -r * rim * (s * cos * n.x + ellipse_arc(sin, cos, s)) } else { 0.0 };
            ellipse + corner + mixed
        };
        primitive(to) - primitive(from)
    }

    /// Passes all common points of the outline with its middle at `center` and a curve.
    pub(crate) fn crossings(&self, center: Point2<f64>, curve: &LevelCurve, mut found: impl FnMut(Point2<f64>)) {
        let value = |w: f64| curve.value(&(center + self.at_turn(w).at));
        let mut from = [-PI, value(-PI)];
        for to in self.extreme_turns(center, curve).into_iter().flatten().chain([PI]) {
            let to = [to, value(to)];
            if (from[1] < 0.0) != (to[1] < 0.0) {
                found(center + self.at_turn(root([from[0], to[0]], value)).at);
            }
            from = to;
        }
    }

    /// Returns the turns where the outline is parallel to the curve's family: between two of them
    /// its distance from the curve is monotone. In order, at most three.
    pub(crate) fn extreme_turns(&self, center: Point2<f64>, curve: &LevelCurve) -> [Option<f64>; 3] {
        // Normals of the ellipse through the curve's centre: a·sin t + b·tan t + c = 0 (for lines
        // a = 0).
        let gradient = curve.gradient(&center);
        let a = curve.k() * self.rim * (1.0 - self.squash) * (1.0 + self.squash);
        let (b, c) = (self.squash * gradient.y, gradient.x);
        // The same times cos t, which has no poles.
        let miss = |t: f64| (a * t.cos() + b) * t.sin() + c * t.cos();
        let quarter = 0.5 * PI;
        // The places where its slope a·cos t + b/cos² t changes its sign.
        let cube = -b / a;
        let turn = if cube > 0.0 && cube < 1.0 { cube.cbrt().acos() } else { quarter };
        let borders = if turn < quarter { [-quarter, -turn, turn, quarter] } else { [-quarter, 0.0, 0.0, quarter] };
        let mut turns = [None; 3];
        for (slot, ends) in turns.iter_mut().zip(borders.windows(2)) {
            if (miss(ends[0]) < 0.0) != (miss(ends[1]) < 0.0) {
                *slot = Some(self.turn_of(root([ends[0], ends[1]], miss)));
            }
        }
        turns
    }
}

/// Returns the root of a function that has different signs at the two ends, to the last digits: by
/// false position, with halving wherever three steps have not halved the bracket.
pub(crate) fn root(ends: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const MAX_STEPS: u32 = 400;
    let [mut a, mut b] = ends;
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 {
        return a;
    }
    let mut width = (b - a).abs();
    let mut side = 0;
    for step in 0..MAX_STEPS {
        if fb == 0.0 {
            return b;
        }
        let middle = 0.5 * (a + b);
        let halve = step % 3 == 2 && {
            let slow = (b - a).abs() > 0.5 * width;
            width = (b - a).abs();
            slow
        };
        let chord = b - fb * ((b - a) / (fb - fa));
        let inside = (a.min(b) < chord) && (chord < a.max(b));
        let x = if halve || !inside { middle } else { chord };
        if x == a || x == b || (b - a).abs() <= 4.0 * f64::EPSILON * middle.abs() + 1e-18 {
            return middle;
        }
        let fx = f(x);
        if (fx < 0.0) == (fb < 0.0) {
            (b, fb) = (x, fx);
            // Illinois: the end that stays counts half.
            if side == 1 {
                fa *= 0.5;
            }
            side = 1;
        } else {
            (a, fa) = (x, fx);
            if fa == 0.0 {
                return a;
            }
            if side == -1 {
                fb *= 0.5;
            }
            side = -1;
        }
    }
    0.5 * (a + b)
}

/// Does the same by Newton's method for a growing function that is given with its slope, until it
/// is no larger than the `noise` of its rounding.
pub(crate) fn newton_root(ends: [f64; 2], noise: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    const MAX_STEPS: u32 = 200;
    let [mut low, mut high] = ends;
    let mut x = 0.5 * (low + high);
    let mut width = high - low;
    for step in 0..MAX_STEPS {
        let (value, slope) = f(x);
        if value.abs() <= noise {
            return x;
        }
        if value < 0.0 {
            low = x;
        } else {
            high = x;
        }
        let middle = 0.5 * (low + high);
        let halve = step % 3 == 2 && {
            let slow = high - low > 0.5 * width;
            width = high - low;
            slow
        };
        let newton = x - value / slope;
        let close = 2.0 * f64::EPSILON * x.abs() + 1e-18;
        if (newton - x).abs() <= close || high - low <= close {
            return x;
        }
        x = if !halve && low < newton && newton < high { newton } else { middle };
    }
    x
}
