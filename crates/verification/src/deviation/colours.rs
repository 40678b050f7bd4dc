//! Colours of deviations.

use crate::deviation::figures::Condition;

/// Red, green and blue for screens.
type Colour = [u8; 3];

/// Within tolerance.
const GREEN: Colour = [60, 170, 80];

/// Colours of a slight gouge, and of one of [`FULL`] tolerances or more.
const RED: [Colour; 2] = [[250, 170, 60], [190, 0, 20]];

/// Colours of slight excess, and of [`FULL`] tolerances or more.
const BLUE: [Colour; 2] = [[120, 190, 250], [10, 40, 170]];

/// Not reached by the program.
const LIGHT_GREY: Colour = [205, 205, 205];

/// Not measured.
const DARK_GREY: Colour = [95, 95, 95];

/// Least number of tolerances with full colour.
const FULL: f64 = 4.0;

/// Returns the colour of a place: green within tolerance, orange to red for gouges, light to dark
/// blue for remaining material, light grey where the program has not been, dark grey for places
/// that were not measured.
pub(crate) fn colour(condition: Condition, tolerance: f64) -> Colour {
    let between = |[near, full]: [Colour; 2], deviation: f64| {
        let share = ((deviation.abs() / tolerance - 1.0) / (FULL - 1.0)).clamp(0.0, 1.0);
        let part = |k: usize| f64::from(near[k]) + share * (f64::from(full[k]) - f64::from(near[k]));
        [0, 1, 2].map(|k| part(k).round() as u8)
    };
    match condition {
        Condition::Within(_) => GREEN,
        Condition::Gouged(d) => between(RED, d),
        Condition::Excess(d) => between(BLUE, d),
        Condition::NotReached => LIGHT_GREY,
        Condition::NoStock => RED[1],
        Condition::NotMeasured => DARK_GREY,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/deviation/colours.rs"]
mod tests;
