//! Section area of any cutter that has a lower outline across the feed.

use std::ops::RangeInclusive;

/// Reason why an area between outlines has no value.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutlineError {
    /// The range has an end that is not finite.
    #[error("the lateral range has an end that is not finite")]
    RangeNotFinite,
    /// The accuracy is not positive and finite.
    #[error("an accuracy of {accuracy} mm² cannot be reached: it must be positive and finite")]
    BadAccuracy {
        /// Requested accuracy, mm².
        accuracy: f64,
    },
    /// A height is NaN, or the chip has no end in height.
    #[error("the chip has no finite height at y = {y} mm")]
    HeightNotFinite {
        /// Lateral coordinate, mm.
        y: f64,
    },
    /// The accuracy is too fine for the outlines: 2²⁰ heights were not enough.
    #[error("2^20 heights do not give the area to {accuracy} mm²")]
    TooManyHeights {
        /// Requested accuracy, mm².
        accuracy: f64,
    },
}

/// Returns the area of the stock between the lower outlines of a cutter at two neighbouring
/// positions, mm²: below `stock_top`, above the outline at the second position, and not above the
/// one at the first.
///
/// This is the section of the chip across the feed when the tool axis leans along the feed, where
/// the cutter's outline seen along the feed is not its profile (a face mill with CLOPT's tilt shows
/// an ellipse); CHIP's ball cases are the special case of an axis in the section plane. `first` and
/// `second` are the heights z of the outlines over the lateral coordinate y, `None` where the
/// cutter is not over y; `stock_top` is the height of the stock, −∞ where there is none. All are mm
/// in one frame of the section. Everything above the lower outline counts as cut: an undercut
/// behind an overhanging flute is filled. All pieces over `y_range` count, not only the one at the
/// CC point.
///
/// `accuracy` is the error to reach, mm². The error is an estimate (adaptive Simpson rule, where
/// each panel compares one step with two). Features of the outlines narrower than 1/64 of `y_range`
/// can be missed, but edges, kinks and steps within the panels that detect them are resolved to it.
/// An empty range has area 0.
///
/// # Errors
/// When the range or the accuracy is not usable, a height is NaN or unbounded, or 2²⁰ heights do
/// not reach the accuracy.
pub fn chip_area_between_outlines(
    first: impl Fn(f64) -> Option<f64>,
    second: impl Fn(f64) -> Option<f64>,
    stock_top: impl Fn(f64) -> f64,
    y_range: RangeInclusive<f64>,
    accuracy: f64,
) -> Result<f64, OutlineError> {
    let (from, to) = y_range.into_inner();
    if !(from.is_finite() && to.is_finite()) {
        return Err(OutlineError::RangeNotFinite);
    }
    if !(accuracy > 0.0 && accuracy.is_finite()) {
        return Err(OutlineError::BadAccuracy { accuracy });
    }
    let height = |y: f64| {
        let Some(low) = second(y) else { return Ok(0.0) };
        let (stock, cut) = (stock_top(y), first(y).unwrap_or(f64::INFINITY));
        let height = if stock.is_nan() || cut.is_nan() { f64::NAN } else { stock.min(cut) - low };
        if height.is_nan() || height == f64::INFINITY {
            return Err(OutlineError::HeightNotFinite { y });
        }
        Ok(height.max(0.0))
    };
    if from < to { integral(height, from, to, accuracy) } else { Ok(0.0) }
}

const FIRST_PANELS: u32 = 64;
/// Largest number of halvings of a first panel, after which a step of the height is narrow enough:
/// 2⁻⁴⁰ of the panel.
const MAX_HALVINGS: u32 = 40;
const MAX_HEIGHTS: usize = 1 << 20;

/// Part of the range with the heights at its ends and middle.
struct Panel {
    x: [f64; 3],
    f: [f64; 3],
    halvings: u32,
}

impl Panel {
    fn simpson(&self) -> f64 {
        (self.x[2] - self.x[0]) / 6.0 * (self.f[0] + 4.0 * self.f[1] + self.f[2])
    }

    fn halves(&self, height: &mut impl FnMut(f64) -> Result<f64, OutlineError>) -> Result<[Self; 2], OutlineError> {
        let ([x0, x1, x2], [f0, f1, f2]) = (self.x, self.f);
        let (left, right) = (0.5 * (x0 + x1), 0.5 * (x1 + x2));
        let halvings = self.halvings + 1;
        Ok([
            Self { x: [x0, left, x1], f: [f0, height(left)?, f1], halvings },
            Self { x: [x1, right, x2], f: [f1, height(right)?, f2], halvings },
        ])
    }
}

fn integral(
    height: impl Fn(f64) -> Result<f64, OutlineError>,
    from: f64,
    to: f64,
    accuracy: f64,
) -> Result<f64, OutlineError> {
    let mut n_heights = 0;
    let mut height = |y: f64| {
        n_heights += 1;
        if n_heights > MAX_HEIGHTS { Err(OutlineError::TooManyHeights { accuracy }) } else { height(y) }
    };
    let border = |i: u32| from + (to - from) * (f64::from(i) / f64::from(FIRST_PANELS));
    // A stack in the order of y: the sum is formed from left to right.
    let mut open = Vec::with_capacity(FIRST_PANELS as usize + MAX_HALVINGS as usize);
    for i in (0..FIRST_PANELS).rev() {
        let (x0, x2) = (border(i), border(i + 1));
        let x1 = 0.5 * (x0 + x2);
        open.push(Panel { x: [x0, x1, x2], f: [height(x0)?, height(x1)?, height(x2)?], halvings: 0 });
    }
    let mut sum = 0.0;
    while let Some(panel) = open.pop() {
        let halves = panel.halves(&mut height)?;
        let fine = halves[0].simpson() + halves[1].simpson();
        let correction = (fine - panel.simpson()) / 15.0;
        let share = accuracy * ((panel.x[2] - panel.x[0]) / (to - from));
        if correction.abs() <= share || panel.halvings >= MAX_HALVINGS {
            sum += fine + correction;
        } else {
            let [left, right] = halves;
            open.push(right);
            open.push(left);
        }
    }
    Ok(sum)
}

#[cfg(test)]
#[path = "../tests/unit/outline.rs"]
mod tests;
