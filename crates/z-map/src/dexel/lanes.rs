//! Eight lines of a row at once: most of them are decided by one look at where their material ends.

use crate::dexel::body::Placed;

/// Lines side by side.
pub(crate) const LANES: usize = 8;

/// A number for each of the lines.
pub(crate) type Wide = [f64; LANES];

/// Signed distances of points from a body, and outward normals there.
pub(crate) struct Gaps {
    pub(crate) gap: Wide,
    pub(crate) normal: [Wide; 3],
}

/// What is known of eight lines.
pub(crate) struct Verdicts {
    /// The line's material is below the swept solid.
    pub(crate) is_untouched: [bool; LANES],
    /// Height from which on the line loses all its material; NaN where that is not known.
    pub(crate) cut_from: Wide,
}

/// Distance from the swept solid within which material counts as outside of it, mm: rounding of surfaces that have been
/// cut before. Smaller, a cut along an old one would take dust off; larger, cuts would be less than exact.
const ROUNDING: f64 = 1e-11;

/// Steps of Newton's method before lines are left to be searched one by one.
const MAX_STEPS: usize = 7;

impl Placed<'_> {
    /// Signed distances as of single points, and normals.
    #[inline(always)]
    pub(crate) fn gaps(&self, x: &Wide, y: f64, z: &Wide) -> Gaps {
        let (tip, axis) = (&self.tip, &self.axis);
        let vy = y - tip.y;
        let (mut radial, mut height) = ([0.0; LANES], [0.0; LANES]);
        let mut perp = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let (vx, vz) = (x[l] - tip.x, z[l] - tip.z);
            let along = vx * axis.x + vy * axis.y + vz * axis.z;
            let p = [vx - axis.x * along, vy - axis.y * along, vz - axis.z * along];
            (perp[0][l], perp[1][l], perp[2][l]) = (p[0], p[1], p[2]);
            height[l] = along;
            radial[l] = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        }
        let (gap, across, along) = self.body.gaps(&radial, &height);
        let mut normal = [[0.0; LANES]; 3];
        for l in 0..LANES {
            let out = if radial[l] > 0.0 { across[l] / radial[l] } else { 0.0 };
            normal[0][l] = perp[0][l] * out + axis.x * along[l];
            normal[1][l] = perp[1][l] * out + axis.y * along[l];
            normal[2][l] = perp[2][l] * out + axis.z * along[l];
        }
        Gaps { gap, normal }
    }

    /// What the body, as the start (`sense` 1) or the end (-1) of a motion, says of lines whose material ends at `tops`;
    /// `floors` are heights that the swept solid is not below.
    ///
    /// A normal at which the material's end is beyond all of the swept solid, and that does not look upward, proves that
    /// the line loses nothing. Where the end is inside the body, the line loses all from its entry on, which is that of
    /// the swept solid if the normal there does not face the motion.
    #[inline(always)]
    pub(crate) fn verdicts(
        &self,
        motion: &[f64; 3],
        sense: f64,
        x: &Wide,
        y: f64,
        tops: &Wide,
        floors: &Wide,
    ) -> Verdicts {
        let facing =
            |n: &[Wide; 3], l: usize| sense * (n[0][l] * motion[0] + n[1][l] * motion[1] + n[2][l] * motion[2]);
        let at_top = self.gaps(x, y, tops);
        let mut is_untouched = [false; LANES];
        let mut is_open = [false; LANES];
        let mut z = [0.0; LANES];
        for l in 0..LANES {
            let (gap, up) = (at_top.gap[l], at_top.normal[2][l]);
            let ahead = facing(&at_top.normal, l);
            let ahead = if ahead > 0.0 { ahead } else { 0.0 };
            is_untouched[l] = (gap >= ahead - ROUNDING) & (up <= 0.0);
            is_open[l] = !is_untouched[l] & (gap <= 0.0);
            // The tangent's zero is below the entry, like the floor.
            let step = if up < -1e-3 { tops[l] - gap / up } else { floors[l] };
            z[l] = if step > floors[l] { step } else { floors[l] };
        }
        let mut cut_from = [f64::NAN; LANES];
        if !is_open.contains(&true) {
            return Verdicts { is_untouched, cut_from };
        }
        for _ in 0..MAX_STEPS {
            let here = self.gaps(x, y, &z);
            let mut is_done = [false; LANES];
            for l in 0..LANES {
                let up = here.normal[2][l];
                let step = -here.gap[l] / up;
                z[l] += step;
                is_done[l] = (step.abs() <= -1e-8 * up) & (up < 0.0);
            }
            let mut are_all_done = true;
            for l in 0..LANES {
                are_all_done &= is_done[l] | !is_open[l];
            }
            if are_all_done {
                for l in 0..LANES {
                    let is_found = is_open[l] & (facing(&here.normal, l) <= 0.0);
                    cut_from[l] = if is_found { z[l] } else { f64::NAN };
                }
                break;
            }
        }
        Verdicts { is_untouched, cut_from }
    }
}
