use nalgebra::{Point2, Vector2};

use crate::section::level_curve::LevelCurve;
use crate::section::quadrature::integral;
use crate::section::rim::root;
use crate::section::slab::{Cut, Slab};
use crate::section::tool_section::Contact;

/// A cut beside passes whose tool is this one, turned about the centre of the surface.
///
/// At every height over the surface the stock is an arc of a concentric circle. The tool contains
/// pieces of it, and a neighbour the same pieces, moved by the step along the surface. The length
/// of the rest is in closed form except for the crossings of arc and outline, and the area is the
/// integral of lengths over heights.
pub(crate) struct BesideTurned<'a> {
    /// Cut of this pass, ignoring earlier cuts.
    pub(crate) cut: Cut<'a>,
    /// Outward normal at the CC point.
    pub(crate) normal: Vector2<f64>,
    /// Direction along the surface to the right.
    pub(crate) to_the_right: Vector2<f64>,
    /// Distances to the neighbours along the surface to the right.
    pub(crate) neighbours: [Option<f64>; 2],
    /// Ends of the stock along the surface to the right.
    pub(crate) ends: [f64; 2],
}

/// Start and end along the surface.
type Interval = [f64; 2];

impl BesideTurned<'_> {
    /// Returns the area and the estimate of its error, mm²; `accuracy` is the error to reach.
    pub(crate) fn area(&self, depth: f64, accuracy: f64) -> (f64, f64) {
        let piece = self.cut.piece();
        // The arcs begin with the root of the height, so they are smooth as functions of that root.
        let length = |root: f64| {
            let height = depth * root * root;
            let stretch = 1.0 + self.cut.layer.curvature * height;
            2.0 * depth * root * stretch * self.length(height, &piece)
        };
        integral(length, &self.breaks(depth), accuracy)
    }

    /// Returns roots of the fractions of the depth at which the length has kinks, in order, from 0
    /// to 1.
    ///
    /// Between the heights of the outline's extremes the tool contains the same number of
    /// intervals, so a narrow band of heights with intervals is not missed. Inside such a band
    /// there are kinks where this tool or a neighbour meets an end of the stock, and where an
    /// interval, or the gap between two, is as long as the step to a neighbour, or to both, where
    /// neighbours begin or end to overlap.
    fn breaks(&self, depth: f64) -> Vec<f64> {
        let (tool, part) = (self.cut.tool, &self.cut.layer.part);
        let mut bands = vec![0.0, 1.0];
        let mut add = |p: Point2<f64>| {
            let value = part.value(&p);
            let height = 2.0 * value / (1.0 + (1.0 + 2.0 * self.cut.layer.curvature * value).max(0.0).sqrt());
            let root = (height / depth).max(0.0).sqrt();
            if 0.0 < root && root < 1.0 {
                bands.push(root);
            }
        };
        tool.extremes(part, &mut add);
        tool.flank_extremes(part).into_iter().flatten().for_each(&mut add);
        for end in self.ends.into_iter().filter(|end| end.is_finite()) {
            for step in self.neighbours.into_iter().flatten().chain([0.0]) {
                let line = self.upright(end - step);
                tool.crossings(&line, &mut add);
                tool.flank_crossings(&line, &mut add);
            }
        }
        bands.sort_unstable_by(f64::total_cmp);
        bands.dedup();
        let mut breaks = bands.clone();
        for band in bands.windows(2) {
            self.overlaps(depth, [band[0], band[1]], &mut breaks);
        }
        breaks.sort_unstable_by(f64::total_cmp);
        breaks.dedup();
        breaks
    }

    /// Returns the line along the normal of the surface at a place.
    fn upright(&self, place: f64) -> LevelCurve {
        let (foot, above) = (self.point(place, 0.0), self.point(place, 1.0));
        let up = (above - foot).normalize();
        let across = Vector2::new(up.y, -up.x);
        LevelCurve::line(across, across.dot(&foot.coords))
    }

    /// Adds the places in a band of heights where an interval or gap is as long as a step.
    fn overlaps(&self, depth: f64, band: [f64; 2], breaks: &mut Vec<f64>) {
        const SAMPLES: usize = 12;
        // At the very ends of the band intervals begin and end.
        let inset = 1e-9 * (band[1] - band[0]);
        let [from, to] = [band[0] + inset, band[1] - inset];
        let at = |i: usize| from + (to - from) * (i as f64 / SAMPLES as f64);
        let lengths = |root: f64| -> Vec<f64> {
            let held = self.held(depth * root * root);
            held.iter().flatten().zip(held.iter().flatten().skip(1)).map(|(from, to)| to - from).collect()
        };
        let samples: Vec<Vec<f64>> = (0..=SAMPLES).map(|i| lengths(at(i))).collect();
        let count = samples.iter().map(Vec::len).min().unwrap_or(0);
        let [left, right] = self.neighbours.map(|step| step.map_or(0.0, f64::abs));
        for steps in [left, right, left + right] {
            for k in 0..count {
                let longer = |at: f64| lengths(at).get(k).map_or(0.0, |length| length - steps);
                let sampled: Vec<[f64; 2]> = samples.iter().enumerate().map(|(i, s)| [at(i), s[k] - steps]).collect();
                roots_between(&sampled, longer, breaks);
            }
        }
    }

    /// Returns the length of the remaining stock at a height, along the surface.
    fn length(&self, height: f64, piece: &[Slab]) -> f64 {
        let held = self.held(height);
        let in_piece = |[from, to]: &Interval| {
            // On a plane or a convex surface everything inside the tool is connected.
            self.cut.layer.curvature >= 0.0 || self.cut.holds(piece, &self.point(0.5 * (from + to), height))
        };
        let [left_end, right_end] = self.ends;
        let own = held.iter().map(|[from, to]| [from.max(left_end), to.min(right_end)]);
        let mut left: Vec<Interval> = own.filter(|[from, to]| from < to).filter(in_piece).collect();
        for step in self.neighbours.into_iter().flatten() {
            for cut in &held {
                left = left.iter().flat_map(|rest| without(*rest, [cut[0] + step, cut[1] + step])).collect();
            }
        }
        left.iter().map(|[from, to]| to - from).sum()
    }

    /// Returns the parts of the arc at a height that are within the tool.
    fn held(&self, height: f64) -> Vec<Interval> {
        let arc = LevelCurve::offset_of_surface(self.cut.layer.curvature, self.normal, height);
        let mut borders = Vec::with_capacity(8);
        self.cut.tool.crossings(&arc, |p| borders.push(self.place(&p)));
        self.cut.tool.flank_crossings(&arc, |p| borders.push(self.place(&p)));
        borders.sort_unstable_by(f64::total_cmp);
        let pairs = borders.windows(2).map(|pair| [pair[0], pair[1]]);
        pairs.filter(|[from, to]| self.cut.tool.contains(&self.point(0.5 * (from + to), height))).collect()
    }

    /// Returns the place of a point along the surface to the right.
    fn place(&self, p: &Point2<f64>) -> f64 {
        let k = self.cut.layer.curvature;
        let (along, up) = (p.coords.dot(&self.to_the_right), p.coords.dot(&self.normal));
        (k.abs() * along).atan2(1.0 + k * up) / k.abs()
    }

    fn point(&self, place: f64, height: f64) -> Point2<f64> {
        let contact = Contact { point: Point2::origin(), normal: self.normal };
        let there = contact.stepped(self.cut.layer.curvature, self.to_the_right, place);
        there.point + there.normal * height
    }
}

/// Returns the rest of an interval beside another.
fn without([from, to]: Interval, [cut_from, cut_to]: Interval) -> impl Iterator<Item = Interval> {
    let rest = [[from, to.min(cut_from)], [from.max(cut_to), to]];
    rest.into_iter().filter(|[from, to]| from < to)
}

/// Finds all roots of a function that is sampled at places and values, as long as it has at most
/// one extreme between three samples in a row.
fn roots_between(samples: &[[f64; 2]], f: impl Fn(f64) -> f64, roots: &mut Vec<f64>) {
    for pair in samples.windows(2).filter(|pair| (pair[0][1] < 0.0) != (pair[1][1] < 0.0)) {
        roots.push(root([pair[0][0], pair[1][0]], &f));
    }
    for three in samples.windows(3) {
        let [a, b, c] = [three[0], three[1], three[2]];
        let same_side = (a[1] < 0.0) == (b[1] < 0.0) && (b[1] < 0.0) == (c[1] < 0.0);
        if !same_side || b[1].abs() > a[1].abs() || b[1].abs() > c[1].abs() {
            continue;
        }
        // The common sign, and the place where the function is nearest to 0 or beyond it.
        let sign = if b[1] < 0.0 { -1.0 } else { 1.0 };
        let least = least_between([a[0], c[0]], |x| sign * f(x));
        if sign * f(least) < 0.0 {
            roots.extend([root([a[0], least], &f), root([least, c[0]], &f)]);
        }
    }
}

/// Returns where a function with one minimum is least, or below 0 (golden section).
fn least_between([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_8;
    const STEPS: u32 = 40;
    let (mut a, mut b) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..STEPS {
        if fa.min(fb) < 0.0 {
            break;
        }
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - SHARE * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + SHARE * (high - low);
            fb = f(b);
        }
    }
    if fa < fb { a } else { b }
}

#[cfg(test)]
#[path = "../../tests/unit/section/turned.rs"]
mod tests;
