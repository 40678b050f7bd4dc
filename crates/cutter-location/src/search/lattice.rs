use facemill_cl_data::Posture;

use crate::search::bezier::SearchCurve;

/// Largest number of postures of a lattice.
const MOST: usize = 96;

/// Finest distance of neighbours, as a turn of the tool axis, rad.
const FINEST: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Postures spread evenly over the ranges of a search curve, rotate counted as an amount: rows of
/// equal tilt.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Tilt and amount of rotate.
    pub(crate) postures: Vec<Posture>,
    /// Distance of neighbours as a turn of the tool axis, at most, rad.
    pub(crate) spacing: f64,
}

impl Lattice {
    /// Creates the lattice over a curve's ranges, corners included, as fine as [`MOST`] and
    /// [`FINEST`] allow.
    pub(crate) fn new(curve: &SearchCurve) -> Self {
        Self::within(curve, FINEST, MOST)
    }

    /// Creates a lattice several times as fine, for points where little is feasible.
    pub(crate) fn fine(curve: &SearchCurve) -> Self {
        Self::within(curve, FINEST / 4.0, 8 * MOST)
    }

    fn within(curve: &SearchCurve, finest: f64, most: usize) -> Self {
        let mut spacing = finest;
        loop {
            let postures = postures(curve, spacing);
            if postures.len() <= most {
                return Self { postures, spacing };
            }
            spacing *= 1.1;
        }
    }
}

fn postures(curve: &SearchCurve, spacing: f64) -> Vec<Posture> {
    let tilts = [curve.start().tilt, curve.end().tilt];
    let rotates = [curve.start().rotate.abs(), curve.end().rotate.abs()];
    evenly(tilts, tilts[1] - tilts[0], spacing)
        .flat_map(|tilt| {
            let turn = (rotates[1] - rotates[0]) * tilt.sin();
            evenly(rotates, turn, spacing).map(move |rotate| Posture { tilt, rotate })
        })
        .collect()
}

/// Returns values from one end to the other, both included, as few as keep neighbours at most
/// `spacing` of the `extent` apart.
fn evenly(ends: [f64; 2], extent: f64, spacing: f64) -> impl Iterator<Item = f64> {
    let steps = (extent / spacing - 1e-9).ceil().max(if ends[1] > ends[0] { 1.0 } else { 0.0 }) as usize;
    (0..=steps).map(move |k| if k == 0 { ends[0] } else { ends[0] + (ends[1] - ends[0]) * k as f64 / steps as f64 })
}

#[cfg(test)]
#[path = "../../tests/unit/search/lattice.rs"]
mod tests;
