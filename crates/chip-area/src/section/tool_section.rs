use nalgebra::{Point2, Vector2};

use crate::section::level_curve::{LevelCurve, segment_area};
use crate::section::rim::{Rim, newton_root};

// Directions closer than this (rad) count as parallel. Larger: a real gouge as deep as R times this
// is missed. Smaller: rounding of the input angles makes a tool that lies against the surface a
// gouge.
pub(crate) const PARALLEL: f64 = 1e-9;

/// A CC point in the tool's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) point: Point2<f64>,
    /// Outward normal of the surface, unit.
    pub(crate) normal: Vector2<f64>,
}

impl Contact {
    /// Returns the CC point one `step` farther along the surface, toward `tangent`.
    pub(crate) fn stepped(&self, curvature: f64, tangent: Vector2<f64>, step: f64) -> Self {
        let angle = step * curvature;
        // The step is the chord of the arc; sin(φ/2)/(φ/2) keeps it exact for flat surfaces.
        let half = 0.5 * angle;
        let chord = step * if half == 0.0 { 1.0 } else { half.sin() / half };
        let way = (tangent * half.cos() - self.normal * half.sin()) * chord;
        Self { point: self.point + way, normal: self.normal * angle.cos() + tangent * angle.sin() }
    }
}

/// Section of a tool in its own frame: everything above a lower outline over an interval of x.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolSection {
    /// Middle of the rim, which is the corner radius above the tip.
    pub(crate) center: Point2<f64>,
    /// The outline about it.
    pub(crate) rim: Rim,
}

/// Form of a lower outline between two of its kinks.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    /// Flat bottom.
    Flat,
    /// Circle of the left corner.
    Left,
    /// Circle of the right corner.
    Right,
    /// The rim, which appears as an ellipse, offset by the corner.
    Seen,
}

impl ToolSection {
    /// Returns the tool that touches the surface at a CC point. A bottom along the surface touches
    /// in its middle, which is the limit of a tool that tilts along the feed, moved by `shift` half
    /// rims to the right.
    pub(crate) fn touching(rim: Rim, contact: &Contact, shift: f64) -> Self {
        let n = contact.normal;
        let lowest = if rim.squash == 0.0 && n.x.abs() <= PARALLEL {
            Vector2::new(-shift * rim.rim, 0.0) - n * rim.corner
        } else {
            rim.support(-n)
        };
        Self { center: contact.point - lowest, rim }
    }

    pub(crate) fn range(&self) -> [f64; 2] {
        let half = self.rim.half_width();
        [self.center.x - half, self.center.x + half]
    }

    /// Returns the places where its outline changes from one form to another.
    pub(crate) fn kinks(&self) -> [Option<f64>; 2] {
        let inside = self.rim.squash == 0.0 && self.rim.corner > 0.0 && self.rim.rim > 0.0;
        [-1.0, 1.0].map(|side| inside.then_some(self.center.x + side * self.rim.rim))
    }

    /// Returns the form of its outline between the two kinks around `x`.
    pub(crate) fn form_over(&self, x: f64) -> Form {
        let (off, rim) = (x - self.center.x, self.rim.rim);
        if self.rim.squash != 0.0 {
            Form::Seen
        } else if off.abs() <= rim && rim > 0.0 {
            Form::Flat
        } else if off < 0.0 {
            Form::Left
        } else {
            Form::Right
        }
    }

    /// Returns the height of its outline at `x`, with this form there.
    #[inline]
    pub(crate) fn y_at(&self, x: f64, form: Form) -> f64 {
        let off = x - self.center.x;
        let on_arc = |off: f64| {
            let r = self.rim.corner;
            self.center.y - ((r - off) * (r + off)).max(0.0).sqrt()
        };
        match form {
            Form::Flat => self.center.y - self.rim.corner,
            Form::Left => on_arc(off + self.rim.rim),
            Form::Right => on_arc(off - self.rim.rim),
            Form::Seen => self.center.y + self.rim.over(off).at.y,
        }
    }

    /// Returns ∫ y dx of its outline over `x`, with this form there.
    pub(crate) fn integral(&self, x: [f64; 2], form: Form) -> f64 {
        match form {
            Form::Flat => (self.center.y - self.rim.corner) * (x[1] - x[0]),
            Form::Left | Form::Right => arc_integral(x, x.map(|x| self.y_at(x, form)), -1.0 / self.rim.corner),
            Form::Seen => {
                let ends = x.map(|x| self.rim.over(x - self.center.x));
                self.center.y * (x[1] - x[0]) + self.rim.integral(&ends[0], &ends[1])
            }
        }
    }

    /// Returns the centre of the corner on one side, for a tool whose axis is in the section plane.
    fn corner(&self, side: f64) -> Point2<f64> {
        self.center + Vector2::new(side * self.rim.rim, 0.0)
    }

    /// Returns the line or circle of its outline with this form.
    fn curve(&self, form: Form) -> LevelCurve {
        match form {
            Form::Left => LevelCurve::circle(self.corner(-1.0), self.rim.corner),
            Form::Right => LevelCurve::circle(self.corner(1.0), self.rim.corner),
            Form::Flat | Form::Seen => LevelCurve::horizontal(self.center.y - self.rim.corner),
        }
    }

    /// Returns the forms of the outline of a tool with its axis in the section plane, and their
    /// ranges.
    fn pieces(&self) -> [Option<OutlinePiece>; 3] {
        let ([low, high], Rim { rim, corner, .. }) = (self.range(), self.rim);
        let top = self.center.y + 1e-9 * (high - low);
        let piece = |form, range| Some(OutlinePiece { curve: self.curve(form), range, top });
        let flat = || piece(Form::Flat, [low + corner, high - corner]);
        match (rim > 0.0, corner > 0.0) {
            (false, _) => [piece(Form::Right, [low, high]), None, None],
            (true, false) => [flat(), None, None],
            (true, true) => [piece(Form::Left, [low, low + corner]), flat(), piece(Form::Right, [high - corner, high])],
        }
    }

    /// Passes all common points of its outline and a curve, and perhaps others of the curve.
    pub(crate) fn crossings(&self, curve: &LevelCurve, mut found: impl FnMut(Point2<f64>)) {
        if self.rim.squash != 0.0 {
            return self.rim.crossings(self.center, curve, found);
        }
        for piece in self.pieces().iter().flatten() {
            let crossings = piece.curve.crossings(curve).into_iter().flatten();
            crossings.filter(|p| piece.may_hold(p)).for_each(&mut found);
        }
    }

    /// Returns x of the common point of its outline and that of the same tool elsewhere: the slopes
    /// of a convex outline grow with x, so the distance of one that is moved sideways is monotone.
    pub(crate) fn crossing_with(&self, other: &Self) -> Option<f64> {
        let (own, its) = (self.range(), other.range());
        let common = [own[0].max(its[0]), own[1].min(its[1])];
        if common[0] >= common[1] {
            return None;
        }
        if self.rim.squash == 0.0 { self.crossing_in_plane(other, common) } else { self.crossing_seen(other, common) }
    }

    /// Does so for two outlines of lines and circles: between two neighbouring kinks each is one of
    /// them.
    fn crossing_in_plane(&self, other: &Self, common: [f64; 2]) -> Option<f64> {
        let apart = |x: f64| self.y_at(x, self.form_over(x)) - other.y_at(x, other.form_over(x));
        let mut from = common[0];
        let mut below = apart(from) < 0.0;
        let [mut own, mut its] = [self.kinks(), other.kinks()].map(|kinks| kinks.into_iter().flatten().peekable());
        loop {
            own.next_if(|x| *x <= from);
            its.next_if(|x| *x <= from);
            let next = own.peek().copied().unwrap_or(f64::INFINITY).min(its.peek().copied().unwrap_or(f64::INFINITY));
            let to = next.min(common[1]);
            let is_below = apart(to) < 0.0;
            if below != is_below {
                let middle = 0.5 * (from + to);
                let (a, b) = (self.curve(self.form_over(middle)), other.curve(other.form_over(middle)));
                // Circles also cross above the middles of the rims.
                let top = self.center.y.min(other.center.y);
                let miss = |p: &Point2<f64>| (from - p.x).max(p.x - to).max(p.y - top);
                let points = a.crossings(&b).into_iter().flatten();
                return points.min_by(|p, q| miss(p).total_cmp(&miss(q))).map(|p| p.x.clamp(from, to));
            }
            if to >= common[1] {
                return None;
            }
            (from, below) = (to, is_below);
        }
    }

    fn crossing_seen(&self, other: &Self, common: [f64; 2]) -> Option<f64> {
        let at = |tool: &Self, x: f64| tool.rim.over(x - tool.center.x);
        let apart = |x: f64| {
            let (p, q) = (at(self, x), at(other, x));
            (self.center.y - other.center.y + p.at.y - q.at.y, p.slope() - q.slope())
        };
        let (left, right) = (apart(common[0]).0, apart(common[1]).0);
        if (left < 0.0) == (right < 0.0) {
            return None;
        }
        let sign = if right < 0.0 { -1.0 } else { 1.0 };
        let extent = 2.0 * self.rim.half_width() + (self.center.y - other.center.y).abs();
        let growing = |x: f64| {
            let (apart, slope) = apart(x);
            (sign * apart, sign * slope)
        };
        Some(newton_root(common, 4.0 * f64::EPSILON * extent, growing))
    }

    /// Passes all points of a curve on its flanks, the flute's sides.
    pub(crate) fn flank_crossings(&self, curve: &LevelCurve, mut found: impl FnMut(Point2<f64>)) {
        for x in self.range() {
            let crossings = LevelCurve::line(Vector2::x(), x).crossings(curve);
            crossings.into_iter().flatten().filter(|p| p.y >= self.center.y).for_each(&mut found);
        }
    }

    pub(crate) fn contains(&self, p: &Point2<f64>) -> bool {
        let [low, high] = self.range();
        low <= p.x && p.x <= high && self.y_at(p.x, self.form_over(p.x)) <= p.y
    }

    /// Passes the ends and kinks of its outline, and all points between them where the outline is
    /// parallel to a curve's family: from one to the next the distance from the curve is monotone.
    pub(crate) fn extremes(&self, curve: &LevelCurve, mut found: impl FnMut(Point2<f64>)) {
        let Rim { rim, corner, squash } = self.rim;
        let mut at = |off: Vector2<f64>| found(self.center + off);
        at(Vector2::new(-rim - corner, 0.0));
        at(Vector2::new(rim + corner, 0.0));
        if squash != 0.0 {
            let turns = self.rim.extreme_turns(self.center, curve);
            return turns.into_iter().flatten().for_each(|turn| at(self.rim.at_turn(turn).at));
        }
        for side in [-1.0, 1.0] {
            at(Vector2::new(side * rim, -corner));
            let normal = curve.gradient(&self.corner(side)).normalize();
            for out in [normal, -normal] {
                if out.x * side >= 0.0 && out.y <= 0.0 {
                    at(Vector2::new(side * rim, 0.0) + out * corner);
                }
            }
        }
        let foot = -curve.gradient(&self.center).x / curve.k();
        if foot.abs() < rim {
            at(Vector2::new(foot, -corner));
        }
    }

    /// Returns the points of its flanks where they are parallel to a curve's family.
    pub(crate) fn flank_extremes(&self, curve: &LevelCurve) -> [Option<Point2<f64>>; 2] {
        self.range().map(|x| {
            let end = Point2::new(x, self.center.y);
            let up = -curve.gradient(&end).y / curve.k();
            (up > 0.0 && up.is_finite()).then(|| end + Vector2::new(0.0, up))
        })
    }

    /// Returns the least value of a concave part's curve on the outline: negative where the tool is
    /// below the surface.
    pub(crate) fn least_value(&self, part: &LevelCurve) -> f64 {
        let mut least = f64::INFINITY;
        if self.rim.squash != 0.0 {
            self.extremes(part, |p| least = least.min(part.value(&p)));
            return least;
        }
        // Remaining places in the section plane besides the axis: ends, kinks, and where a corner
        // is farthest out.
        let Rim { rim, corner, .. } = self.rim;
        let mut at = |off: Vector2<f64>| least = least.min(part.value(&(self.center + off)));
        for side in [-1.0, 1.0] {
            at(Vector2::new(side * (rim + corner), 0.0));
            at(Vector2::new(side * rim, -corner));
            let out = -part.gradient(&self.corner(side)).normalize();
            if corner > 0.0 && out.x * side >= 0.0 && out.y <= 0.0 {
                at(Vector2::new(side * rim, 0.0) + out * corner);
            }
        }
        least
    }
}

/// Part of an outline: the part of a curve over a range and not above the middle of the rim.
struct OutlinePiece {
    curve: LevelCurve,
    range: [f64; 2],
    top: f64,
}

impl OutlinePiece {
    /// Returns whether a point of the curve is on the piece or misses it by little: a place that
    /// only adds a cut may be reported too often.
    fn may_hold(&self, p: &Point2<f64>) -> bool {
        let slack = 1e-9 * (self.range[1] - self.range[0]);
        self.range[0] - slack <= p.x && p.x <= self.range[1] + slack && p.y <= self.top
    }
}

/// Returns ∫ y dx along an arc of curvature `bulge` (positive where it is above its chord):
/// trapezoid and circular segment.
pub(crate) fn arc_integral(x: [f64; 2], y: [f64; 2], bulge: f64) -> f64 {
    let (width, rise) = (x[1] - x[0], y[1] - y[0]);
    let chord = (width * width + rise * rise).sqrt();
    0.5 * width * (y[0] + y[1]) + segment_area(bulge.abs(), chord).copysign(bulge)
}
