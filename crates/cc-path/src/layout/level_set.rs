use nalgebra::{Point3, Vector3};

use crate::layout::edge_fill::front::FrontSet;
use crate::sections::Sections;
use crate::strategy::patch::Patch;

/// A function on the drive surface and the level of it that cuts out a pass.
#[derive(Clone, Copy)]
pub(crate) enum LevelSet<'a> {
    /// A level of sections.
    Level { sections: &'a Sections, level: f64 },
    /// A front over the levels of sections: where their level is the front's.
    Front { sections: &'a Sections, front: FrontSet<'a> },
    /// A level of the patch's values, linear on its triangles, with gradients at its vertices.
    Field { gradients: &'a [Vector3<f64>], level: f64 },
    /// A path that is given by its nodes; the level is a label, the same for the passes of a step.
    Path { level: f64 },
}

impl<'a> LevelSet<'a> {
    /// The value that places of the pass have.
    pub(crate) fn level(&self) -> f64 {
        match self {
            Self::Level { level, .. } | Self::Field { level, .. } | Self::Path { level } => *level,
            Self::Front { .. } => 0.0,
        }
    }

    /// Value at a place; NaN for a field, which has values at the vertices of the patch.
    pub(crate) fn value(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Field { .. } => f64::NAN,
            Self::Level { sections, .. } => sections.level(p),
            Self::Front { sections, front } => sections.level(p) - front.level(p),
            Self::Path { level } => *level,
        }
    }

    /// Values at the vertices of a patch, where they are known; else [`LevelSet::value`] has to be
    /// computed at those that are needed.
    pub(crate) fn at_vertices(&self, patch: &'a Patch) -> Option<&'a [f64]> {
        match self {
            Self::Level { .. } | Self::Field { .. } => Some(&patch.levels),
            Self::Front { .. } | Self::Path { .. } => None,
        }
    }

    /// Direction in which the value rises, not of unit length; `None` where there is none,
    /// and for a field.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Field { .. } => None,
            Self::Level { sections, .. } => sections.gradient(p).map(|g| g.into_inner()),
            Self::Front { sections, front } => Some(sections.gradient(p)?.into_inner() - front.gradient(p)),
            Self::Path { .. } => None,
        }
    }

    /// Whether the value is linear between two points of a triangle.
    pub(crate) fn is_linear(&self) -> bool {
        match self {
            Self::Level { sections, .. } => sections.is_linear(),
            Self::Field { .. } => true,
            Self::Front { .. } => false,
            Self::Path { .. } => true,
        }
    }

    /// Fraction of the way from `a` to `b` at which the value is the level, in 0..1; `values` are
    /// those at both.
    ///
    /// Exact up to rounding where one end is below and the other is not; where both are on the same
    /// side, the end whose value is nearer.
    pub(crate) fn crossing(&self, a: &Point3<f64>, b: &Point3<f64>, values: [f64; 2]) -> f64 {
        if let Self::Level { sections, level } = self {
            return sections.crossing(a, b, *level);
        }
        let level = self.level();
        let [at_a, at_b] = values.map(|value| value - level);
        if (at_a >= 0.0) == (at_b >= 0.0) {
            return if at_a.abs() <= at_b.abs() { 0.0 } else { 1.0 };
        }
        bracketed_root(|t| self.value(&(a + (b - a) * t)) - level, [at_a, at_b])
    }

    /// Whether the pass runs over a place of the curve.
    pub(crate) fn covers(&self, p: &Point3<f64>) -> bool {
        match self {
            Self::Level { .. } | Self::Field { .. } | Self::Path { .. } => true,
            Self::Front { front, .. } => front.covers(p),
        }
    }

    /// Level of a place of the pass, as reported.
    pub(crate) fn reported_level(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Level { sections, .. } | Self::Front { sections, .. } => sections.level(p),
            Self::Field { level, .. } | Self::Path { level } => *level,
        }
    }
}

/// Root of a continuous function in 0..1 with values of different signs at the ends (zero counts as
/// positive), to rounding: regula falsi by the Illinois rule (Dowell and Jarratt 1971).
pub(crate) fn bracketed_root(f: impl Fn(f64) -> f64, ends: [f64; 2]) -> f64 {
    let (mut a, mut b) = ((0.0, ends[0]), (1.0, ends[1]));
    // The rule gains more than a digit per step near a root; halving makes up for kinks.
    for k in 0..100 {
        let t = if k % 8 == 7 { 0.5 * (a.0 + b.0) } else { a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1) };
        let t = t.clamp(f64::min(a.0, b.0), f64::max(a.0, b.0));
        let value = f(t);
        if value.abs() <= 1e-12 || t == a.0 || t == b.0 {
            return t;
        }
        if (value >= 0.0) == (b.1 >= 0.0) {
            a.1 *= 0.5;
        } else {
            a = b;
        }
        b = (t, value);
    }
    b.0
}
