//! Sections by ordinates: their functions over the radius, and their profile at one.

use crate::propeller::blade_section::Profile;
use crate::propeller::table::{OffsetUnit, SectionOffsets};
use crate::spline::{CubicSpline, SplineEnd};

/// Ordinates of sections as functions of the radius, one for each station.
#[derive(Clone, Debug)]
pub(crate) struct OffsetForm {
    /// Roots of the chord fractions.
    roots: Vec<f64>,
    /// Mean height over r/R.
    mean: Vec<CubicSpline>,
    /// Half the thickness over r/R.
    half: Vec<CubicSpline>,
    unit: OffsetUnit,
    /// Whether all sections begin without thickness.
    is_round_nosed: bool,
}

impl OffsetForm {
    pub(crate) fn new(offsets: &SectionOffsets) -> Self {
        let splines = |of: fn(f64, f64) -> f64| -> Vec<CubicSpline> {
            let column = |k: usize| {
                let rows = offsets.suction.iter().zip(&offsets.pressure).map(move |(high, low)| of(high[k], low[k]));
                CubicSpline::new(offsets.radii.iter().copied().zip(rows), SplineEnd::NotAKnot, SplineEnd::NotAKnot)
            };
            (0..offsets.stations.len()).map(column).collect()
        };
        Self {
            roots: offsets.stations.iter().map(|x| x.sqrt()).collect(),
            mean: splines(|high, low| 0.5 * (high + low)),
            half: splines(|high, low| 0.5 * (high - low)),
            unit: offsets.unit,
            is_round_nosed: offsets.suction.iter().zip(&offsets.pressure).all(|(high, low)| high[0] == low[0]),
        }
    }

    /// Length that the ordinates are multiples of, for a chord and diameter in any unit.
    fn length(&self, chord: f64, diameter: f64) -> f64 {
        match self.unit {
            OffsetUnit::Chord => chord,
            OffsetUnit::Diameter => diameter,
        }
    }

    /// Largest thickness at the stations, in the unit of chord and diameter.
    pub(crate) fn thickness(&self, radius_ratio: f64, chord: f64, diameter: f64) -> f64 {
        let largest = self.half.iter().map(|half| half.value(radius_ratio)).fold(0.0, f64::max);
        2.0 * largest * self.length(chord, diameter)
    }

    /// Ordinates over the root of the chord fraction at a radius: in that variable the thickness of
    /// a round nose is odd, and everything else even.
    pub(crate) fn profile(&self, radius_ratio: f64, chord: f64, diameter: f64) -> Profile<'static> {
        let along = |functions: &[CubicSpline], start: SplineEnd| {
            let points = self.roots.iter().zip(functions).map(|(root, f)| (*root, f.value(radius_ratio)));
            CubicSpline::new(points, start, SplineEnd::NotAKnot)
        };
        let nose = if self.is_round_nosed { SplineEnd::Natural } else { SplineEnd::Slope(0.0) };
        Profile::Offsets {
            mean: along(&self.mean, SplineEnd::Slope(0.0)),
            half: along(&self.half, nose),
            length: self.length(chord, diameter),
        }
    }
}
