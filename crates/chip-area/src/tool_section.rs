use nalgebra::{Point2, Vector2};

use crate::level_curve::{LevelCurve, segment_area};
use crate::rim::{Rim, root};

// Directions closer than this (rad) count as parallel. Larger, and a real gouge of R × this depth goes unnoticed;
// smaller, and rounding of the input angles makes a gouge of a tool that lies against the surface.
pub(crate) const PARALLEL: f64 = 1e-9;

/// A CC point in the tool's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub(crate) point: Point2<f64>,
    /// Outward normal of the surface, unit.
    pub(crate) normal: Vector2<f64>,
}

impl Contact {
    /// The CC point a `step` along the surface farther, toward `tangent`.
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

/// Lower outline of a tool between two of its kinks.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bottom {
    /// Flat at this y.
    Flat(f64),
    /// Lower half of a circle.
    Arc(Point2<f64>, f64),
    /// The rim seen as an ellipse, offset by the corner.
    Seen(ToolSection),
}

impl ToolSection {
    /// The tool that touches the surface at a CC point. A bottom along the surface touches in its middle, which is the
    /// limit of a tool that tilts along the feed, moved by `shift` half rims to the right.
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

    /// Where its outline goes from one form to another.
    pub(crate) fn kinks(&self) -> [Option<f64>; 2] {
        let inside = self.rim.squash == 0.0 && self.rim.corner > 0.0 && self.rim.rim > 0.0;
        [-1.0, 1.0].map(|side| inside.then_some(self.center.x + side * self.rim.rim))
    }

    /// Its outline on the part between two kinks that `x` is in.
    pub(crate) fn bottom_over(&self, x: f64) -> Bottom {
        let (off, rim) = (x - self.center.x, self.rim.rim);
        if self.rim.squash != 0.0 {
            Bottom::Seen(*self)
        } else if off.abs() <= rim && rim > 0.0 {
            Bottom::Flat(self.center.y - self.rim.corner)
        } else {
            Bottom::Arc(self.corner(off.signum()), self.rim.corner)
        }
    }

    /// Centre of the corner on one side, for a tool whose axis is in the section plane.
    fn corner(&self, side: f64) -> Point2<f64> {
        self.center + Vector2::new(side * self.rim.rim, 0.0)
    }

    /// Lines and circles whose parts are the outline of a tool with its axis in the section plane, with the x where
    /// they begin and end.
    fn pieces(&self) -> [Option<(LevelCurve, [f64; 2])>; 3] {
        let ([low, high], Rim { rim, corner, .. }) = (self.range(), self.rim);
        let flat = || (LevelCurve::horizontal(self.center.y - corner), [low + corner, high - corner]);
        if rim == 0.0 {
            return [Some((LevelCurve::circle(self.center, corner), [low, high])), None, None];
        }
        if corner == 0.0 {
            return [Some(flat()), None, None];
        }
        let arc = |side: f64, range| Some((LevelCurve::circle(self.corner(side), corner), range));
        [arc(-1.0, [low, low + corner]), Some(flat()), arc(1.0, [high - corner, high])]
    }

    /// x of all points that its outline has in common with a curve, and perhaps others.
    pub(crate) fn crossings(&self, curve: &LevelCurve, mut found: impl FnMut(f64)) {
        if self.rim.squash != 0.0 {
            return self.rim.crossings(self.center, curve, found);
        }
        for (piece, range) in self.pieces().iter().flatten() {
            piece.crossings(curve).into_iter().flatten().filter(|x| within(range, *x)).for_each(&mut found);
        }
    }

    /// x of all points that its outline has in common with that of the same tool elsewhere, and perhaps others.
    pub(crate) fn crossings_with(&self, other: &Self, mut found: impl FnMut(f64)) {
        let (own, its) = (self.range(), other.range());
        let common = [own[0].max(its[0]), own[1].min(its[1])];
        if common[0] >= common[1] {
            return;
        }
        if self.rim.squash != 0.0 {
            // The slopes of a convex outline grow with x, so the distance of one that is moved sideways grows or falls
            // all the way.
            let y = |tool: &Self, x: f64| tool.center.y + tool.rim.over(x - tool.center.x).at.y;
            let apart = |x: f64| y(self, x) - y(other, x);
            if (apart(common[0]) < 0.0) != (apart(common[1]) < 0.0) {
                found(root(common, apart));
            }
            return;
        }
        for (piece, range) in self.pieces().iter().flatten().filter(|(_, range)| overlap(range, &common)) {
            for (curve, part) in other.pieces().iter().flatten().filter(|(_, part)| overlap(range, part)) {
                let crossings = piece.crossings(curve).into_iter().flatten();
                crossings.filter(|x| within(range, *x) && within(part, *x)).for_each(&mut found);
            }
        }
    }

    /// The least value of a concave part's curve on the outline: negative where the tool is below the surface.
    pub(crate) fn least_value(&self, part: &LevelCurve) -> f64 {
        let Rim { rim, corner, squash } = self.rim;
        let half = rim + corner;
        let mut least = f64::INFINITY;
        let mut at = |off: Vector2<f64>| least = least.min(part.value(&(self.center + off)));
        at(Vector2::new(-half, 0.0));
        at(Vector2::new(half, 0.0));
        if squash != 0.0 {
            let turns = self.rim.extreme_turns(self.center, part);
            turns.into_iter().flatten().for_each(|turn| at(self.rim.at_turn(turn).at));
            return least;
        }
        for side in [-1.0, 1.0] {
            at(Vector2::new(side * rim, -corner));
            let down = -part.gradient(&self.corner(side)).normalize();
            if down.x * side >= 0.0 && down.y <= 0.0 {
                at(Vector2::new(side * rim, 0.0) + down * corner);
            }
        }
        least
    }
}

/// Whether `x` is in the range or misses it by little: what is only a place to cut at may be told too often.
fn within(range: &[f64; 2], x: f64) -> bool {
    let slack = 1e-9 * (range[1] - range[0]);
    range[0] - slack <= x && x <= range[1] + slack
}

fn overlap(a: &[f64; 2], b: &[f64; 2]) -> bool {
    a[0] <= b[1] && b[0] <= a[1]
}

impl Bottom {
    pub(crate) fn y_at(&self, x: f64) -> f64 {
        match self {
            Self::Flat(y) => *y,
            Self::Arc(c, r) => c.y - ((r - (x - c.x)) * (r + (x - c.x))).max(0.0).sqrt(),
            Self::Seen(tool) => tool.center.y + tool.rim.over(x - tool.center.x).at.y,
        }
    }

    /// ∫ y dx over `x`.
    pub(crate) fn integral(&self, x: [f64; 2]) -> f64 {
        match self {
            Self::Flat(y) => y * (x[1] - x[0]),
            Self::Arc(_, r) => arc_integral(x, [self.y_at(x[0]), self.y_at(x[1])], -1.0 / r),
            Self::Seen(tool) => {
                let ends = x.map(|x| tool.rim.over(x - tool.center.x));
                tool.center.y * (x[1] - x[0]) + tool.rim.integral(&ends[0], &ends[1])
            }
        }
    }
}

/// ∫ y dx along an arc of curvature `bulge` (positive where it is above its chord): trapezoid and circular segment.
pub(crate) fn arc_integral(x: [f64; 2], y: [f64; 2], bulge: f64) -> f64 {
    let width = x[1] - x[0];
    0.5 * width * (y[0] + y[1]) + segment_area(bulge.abs(), width.hypot(y[1] - y[0])).copysign(bulge)
}
