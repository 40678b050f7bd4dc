//! Sixteen lines of a row at once: most of them are decided by one look at where their material
//! ends.

use nalgebra::Vector3;

use crate::dexel::bodies::body::TurnedBody;

/// Lines side by side.
pub(crate) const LANES: usize = 16;

/// A number for each of the lines.
pub(crate) type Wide = [f64; LANES];

/// Signed distances of points from a body, and outward normals there.
pub(crate) struct Gaps {
    pub(crate) gap: Wide,
    /// Part of the normal along the lines, and its product with the motion.
    pub(crate) up: Wide,
    pub(crate) facing: Wide,
}

/// Verdicts on sixteen lines.
pub(crate) struct Verdicts {
    /// The line's material is below the swept solid.
    pub(crate) is_untouched: [bool; LANES],
    /// Height from which on the line loses all its material; NaN where that is not known.
    pub(crate) cut_from: Wide,
}

impl Verdicts {
    /// Whether all is known of every line.
    #[inline(always)]
    pub(crate) fn are_complete(&self) -> bool {
        (0..LANES).all(|l| self.is_untouched[l] | !self.cut_from[l].is_nan())
    }
}

/// Distance from the swept solid within which material counts as outside of it, mm: rounding of
/// surfaces that have been cut before. Smaller, a cut along an old one would take dust off; larger,
/// cuts would be less than exact.
const ROUNDING: f64 = 1e-11;

/// Slope of the entry along the whole motion that counts as level, mm: the entry is too high by
/// less than that.
const LEVEL: f64 = 1e-9;

/// How often lines are looked at again from a better place.
const AGAIN: usize = 3;

/// Steps of Newton's method before lines are left to be searched one by one.
const MAX_STEPS: usize = 7;

/// A straight motion of each line's own: where the tip begins, and how it moves.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) tip: [Wide; 3],
    pub(crate) motion: [Wide; 3],
}

impl Course {
    /// The same for all lines.
    #[inline(always)]
    pub(crate) fn same(tip: &Vector3<f64>, motion: &Vector3<f64>) -> Self {
        let wide = |v: &Vector3<f64>| [[v.x; LANES], [v.y; LANES], [v.z; LANES]];
        Self { tip: wide(tip), motion: wide(motion) }
    }
}

/// A run of sixteen lines whose material ends at `tops`, under straight sweeps that are not below
/// `floors`.
pub(crate) struct Lanes<'a> {
    pub(crate) body: &'a TurnedBody,
    /// The tool axis, the same all the time.
    pub(crate) axis: &'a Vector3<f64>,
    pub(crate) course: Course,
    pub(crate) x: Wide,
    pub(crate) y: f64,
    pub(crate) tops: Wide,
    pub(crate) floors: Wide,
}

impl Lanes<'_> {
    /// Signed distances as of single points, and normals. The body is moved by `share` of the
    /// motion.
    #[inline(always)]
    fn gaps(&self, share: &Wide, z: &Wide) -> Gaps {
        let (Course { tip, motion }, axis) = (&self.course, self.axis);
        let (mut radial, mut height) = ([0.0; LANES], [0.0; LANES]);
        let mut perp = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let vx = self.x[l] - tip[0][l] - share[l] * motion[0][l];
            let vy = self.y - tip[1][l] - share[l] * motion[1][l];
            let vz = z[l] - tip[2][l] - share[l] * motion[2][l];
            let along = vx * axis.x + vy * axis.y + vz * axis.z;
            let p = [vx - axis.x * along, vy - axis.y * along, vz - axis.z * along];
            (perp[0][l], perp[1][l], perp[2][l]) = (p[0], p[1], p[2]);
            height[l] = along;
            radial[l] = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        }
        let (gap, across, along) = self.body.gaps(&radial, &height);
        let (mut up, mut facing) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let out = if radial[l] > 0.0 { across[l] / radial[l] } else { 0.0 };
            let nx = perp[0][l] * out + axis.x * along[l];
            let ny = perp[1][l] * out + axis.y * along[l];
            up[l] = perp[2][l] * out + axis.z * along[l];
            facing[l] = nx * motion[0][l] + ny * motion[1][l] + up[l] * motion[2][l];
        }
        Gaps { gap, up, facing }
    }

    /// Returns the verdicts where all lines meet the body at its start (`share` 0) or its end (1).
    #[inline(always)]
    pub(crate) fn cap(&self, share: f64) -> Verdicts {
        let shares = [share; LANES];
        let sense = 1.0 - 2.0 * share;
        let at_top = self.gaps(&shares, &self.tops);
        let (is_untouched, mut is_open) = self.look(&at_top, &shares);
        let mut verdicts = Verdicts { is_untouched, cut_from: [f64::NAN; LANES] };
        if !is_open.contains(&true) {
            return verdicts;
        }
        let mut z = self.below(&at_top);
        for _ in 0..MAX_STEPS {
            let here = self.gaps(&shares, &z);
            let mut are_all_done = true;
            for l in 0..LANES {
                let step = -here.gap[l] / here.up[l];
                z[l] += step;
                // A line that misses is not waited for.
                is_open[l] &= here.up[l] < 0.0;
                are_all_done &= ((step.abs() <= -1e-8 * here.up[l]) & (here.up[l] < 0.0)) | !is_open[l];
            }
            if are_all_done {
                for l in 0..LANES {
                    let is_found = is_open[l] & (sense * here.facing[l] <= 0.0);
                    verdicts.cut_from[l] = if is_found { z[l] } else { f64::NAN };
                }
                break;
            }
        }
        verdicts
    }

    /// Returns the verdicts where lines meet any part, and the place on the motion that the last
    /// line touches.
    ///
    /// The place is where the entry is lowest: there the normal is across the motion. It is found
    /// by the secant method while Newton's method finds the entry. The entry is a convex function
    /// of the place, so what it is above its least by is not more than its slope.
    #[inline(always)]
    pub(crate) fn any(&self) -> (Verdicts, f64) {
        let ends = [[0.0; LANES], [1.0; LANES]];
        let [first, last] = [self.gaps(&ends[0], &self.tops), self.gaps(&ends[1], &self.tops)];
        let looks = [self.look(&first, &ends[0]), self.look(&last, &ends[1])];
        let mut share = [0.0; LANES];
        for (l, share) in share.iter_mut().enumerate() {
            let (f, g) = (first.facing[l], last.facing[l]);
            let between = f / (f - g);
            let inner = if g >= 0.0 { 1.0 } else { between };
            *share = if f <= 0.0 { 0.0 } else { inner };
        }
        let mut at_top = self.gaps(&share, &self.tops);
        let (mut is_untouched, mut is_open) = self.look(&at_top, &share);
        for l in 0..LANES {
            is_untouched[l] |= looks[0].0[l] | looks[1].0[l];
            is_open[l] = !is_untouched[l] & (is_open[l] | looks[0].1[l] | looks[1].1[l]);
        }
        self.look_again(&mut is_untouched, &is_open, &mut at_top, &mut share, [&first.facing, &last.facing]);
        let mut verdicts = Verdicts { is_untouched, cut_from: [f64::NAN; LANES] };
        if is_open.contains(&true) {
            self.lowest(is_open, self.below(&at_top), &mut share, [&first, &last], &mut verdicts.cut_from);
        }
        (verdicts, share[LANES - 1])
    }

    /// Looks at lines whose material ends outside of the body, but not clearly so, from places
    /// where the normal is better across the motion.
    #[inline(always)]
    fn look_again(
        &self,
        is_untouched: &mut [bool; LANES],
        is_open: &[bool; LANES],
        at_top: &mut Gaps,
        share: &mut Wide,
        ends: [&Wide; 2],
    ) {
        let (mut left, mut right) = (([0.0; LANES], *ends[0]), ([1.0; LANES], *ends[1]));
        for _ in 0..AGAIN {
            let mut is_known = true;
            for l in 0..LANES {
                let is_between = (share[l] > 0.0) & (share[l] < 1.0);
                is_known &= is_untouched[l] | is_open[l] | !is_between;
                let f = at_top.facing[l];
                let is_left = f > 0.0;
                left.0[l] = if is_left { share[l] } else { left.0[l] };
                left.1[l] = if is_left { f } else { left.1[l] };
                right.0[l] = if is_left { right.0[l] } else { share[l] };
                right.1[l] = if is_left { right.1[l] } else { f };
                let next = left.0[l] + left.1[l] * (right.0[l] - left.0[l]) / (left.1[l] - right.1[l]);
                share[l] = if is_between & (next > 0.0) & (next < 1.0) { next } else { share[l] };
            }
            if is_known {
                return;
            }
            *at_top = self.gaps(share, &self.tops);
            let (more, _) = self.look(at_top, share);
            for l in 0..LANES {
                is_untouched[l] |= more[l] & !is_open[l];
            }
        }
    }

    /// Entries at the places where they are lowest, of the lines that are open.
    #[inline(always)]
    fn lowest(
        &self,
        mut is_open: [bool; LANES],
        mut z: Wide,
        share: &mut Wide,
        [first, last]: [&Gaps; 2],
        cut_from: &mut Wide,
    ) {
        // The place before, and the slope there.
        let (mut old, mut slope) = ([0.0; LANES], first.facing);
        for l in 0..LANES {
            let is_at_start = share[l] == 0.0;
            old[l] = if is_at_start { 1.0 } else { 0.0 };
            slope[l] = if is_at_start { last.facing[l] } else { first.facing[l] };
        }
        for _ in 0..2 * MAX_STEPS {
            let here = self.gaps(share, &z);
            let mut are_all_done = true;
            for l in 0..LANES {
                let (up, f, s) = (here.up[l], here.facing[l], share[l]);
                let step = -here.gap[l] / up;
                z[l] += step;
                let is_level = (f.abs() <= -LEVEL * up) | ((s == 0.0) & (f <= 0.0)) | ((s == 1.0) & (f >= 0.0));
                is_open[l] &= up < 0.0;
                let is_done = is_level & (step.abs() <= -1e-8 * up) & (up < 0.0);
                cut_from[l] = if is_done & is_open[l] { z[l] } else { f64::NAN };
                are_all_done &= is_done | !is_open[l];
                let next = s - f * (s - old[l]) / (f - slope[l]);
                let next = if next > 0.0 { next } else { 0.0 };
                let next = if next < 1.0 { next } else { 1.0 };
                (old[l], slope[l]) = if is_level { (old[l], slope[l]) } else { (s, f) };
                share[l] = if is_level { s } else { next };
            }
            if are_all_done {
                return;
            }
        }
    }

    /// Which lines lose nothing, and which have the end of their material inside the body.
    ///
    /// A normal at which the material's end is beyond all of the swept solid, and that does not
    /// look upward, proves that the line loses nothing: all that is below is beyond it as well.
    #[inline(always)]
    fn look(&self, at: &Gaps, share: &Wide) -> ([bool; LANES], [bool; LANES]) {
        let (mut is_untouched, mut is_open) = ([false; LANES], [false; LANES]);
        for l in 0..LANES {
            let (gap, f, s) = (at.gap[l], at.facing[l], share[l]);
            let (back, ahead) = (-s * f, (1.0 - s) * f);
            // Reach of the rest of the motion along the normal.
            let reach = if back > ahead { back } else { ahead };
            is_untouched[l] = (gap >= reach - ROUNDING) & (at.up[l] <= 0.0);
            is_open[l] = !is_untouched[l] & (gap <= 0.0);
        }
        (is_untouched, is_open)
    }

    /// Heights below the entries to begin from: where the tangent at the material's end is zero, or
    /// the floor.
    #[inline(always)]
    fn below(&self, at_top: &Gaps) -> Wide {
        let mut z = self.floors;
        for (l, z) in z.iter_mut().enumerate() {
            let up = at_top.up[l];
            let step = if up < -1e-3 { self.tops[l] - at_top.gap[l] / up } else { *z };
            *z = if step > *z { step } else { *z };
        }
        z
    }
}
