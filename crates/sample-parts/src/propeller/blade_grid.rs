//! Where the rows and columns of a blade's mesh are.

use std::f64::consts::PI;

use crate::propeller::anti_singing::EDGE_ANGLE;
use crate::propeller::blade::BladeResolution;
use crate::propeller::blade_surface::{BladeSurface, TIP_SHIFT, chord_variable, radius_ratio};

/// Radii of the rows and chord fractions of the columns.
#[derive(Clone, Debug)]
pub(crate) struct BladeGrid {
    /// Radii in mm, growing; the first is inside the hub, the last is R.
    pub(crate) radii: Vec<f64>,
    /// Index of the row on the hub's radius.
    pub(crate) hub_row: usize,
    /// Index of the row where the rounding of the tip begins.
    pub(crate) tip_row: usize,
    /// Chord fractions, 0 at the leading and 1 at the trailing edge.
    pub(crate) fractions: Vec<f64>,
    /// Number of columns in the band of each edge.
    pub(crate) n_edge: usize,
}

/// Least number of columns in the band of an edge: fewer leave a nose with corners.
const LEAST_EDGE_COLUMNS: usize = 6;

/// Depth of the blade's root below the hub's surface over the hub radius.
pub(crate) const ROOT_DEPTH: f64 = 0.15;

/// Rows inside the hub.
const ROOT_ROWS: usize = 3;

/// Weight of the rows that keep the tip's outline smooth against those spread evenly over the
/// radius.
///
/// Larger takes rows from the blade, smaller lets neighbouring rows at the tip differ much in
/// chord.
const TIP_WEIGHT: f64 = 0.04;

impl BladeGrid {
    pub(crate) fn new(surface: &BladeSurface, resolution: BladeResolution) -> Self {
        let spec = surface.spec();
        let radius = 0.5 * spec.diameter();
        let (hub, tip) = (spec.hub_radius() / radius, 1.0 - surface.tip_rounding_ratio());
        let n_tip = (resolution.n_radial() / 12).max(4);
        let mut radii: Vec<f64> =
            (0..ROOT_ROWS).map(|k| hub * (1.0 - ROOT_DEPTH * (1.0 - share(k, ROOT_ROWS)))).collect();
        radii.extend((0..=resolution.n_radial()).map(|k| row_ratio(hub, tip, share(k, resolution.n_radial()))));
        radii.extend((1..=n_tip).map(|k| tip + (1.0 - tip) * (0.5 * PI * share(k, n_tip)).sin()));
        for ratio in &mut radii {
            *ratio *= radius;
        }
        let n_edge = n_edge(resolution.n_chord());
        Self {
            radii,
            hub_row: ROOT_ROWS,
            tip_row: ROOT_ROWS + resolution.n_radial(),
            fractions: fractions(resolution.n_chord(), n_edge),
            n_edge,
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts are small")]
fn share(k: usize, n: usize) -> f64 {
    k as f64 / n as f64
}

/// Columns in an edge band that continue the spacing beside it.
fn n_edge(n_chord: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive and small")]
    let matching = (EDGE_ANGLE / (PI - 2.0 * EDGE_ANGLE) * share(n_chord, 1)).ceil() as usize;
    matching.max(LEAST_EDGE_COLUMNS)
}

/// Chord fractions (1 − cos β)/2, dense at both ends as the thickness goes with the root of the
/// distance there.
fn fractions(n_chord: usize, n_edge: usize) -> Vec<f64> {
    let half = |k: usize, n: usize, from: f64, to: f64| {
        let sine = (0.5 * (from + (to - from) * share(k, n))).sin();
        sine * sine
    };
    let leading = (0..n_edge).map(|k| half(k, n_edge, 0.0, EDGE_ANGLE));
    let middle = (0..n_chord).map(|k| half(k, n_chord, EDGE_ANGLE, PI - EDGE_ANGLE));
    let trailing = (0..n_edge).map(|k| half(k, n_edge, PI - EDGE_ANGLE, PI));
    leading.chain(middle).chain(trailing).chain([1.0]).collect()
}

/// Radius ratio of a row, at a share of the way from `hub` to `tip`, with rows per chord variable v
/// as v + weight/v.
fn row_ratio(hub: f64, tip: f64, share: f64) -> f64 {
    if share <= 0.0 {
        return hub;
    } else if share >= 1.0 {
        return tip;
    }
    let rows = |v: f64| 0.5 * v * v + TIP_WEIGHT * v.ln();
    let (mut low, mut high) = (chord_variable(tip).max(TIP_SHIFT.sqrt()), chord_variable(hub));
    let wanted = rows(high) + (rows(low) - rows(high)) * share;
    // Halving 60 times leaves the spacing of f64.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if rows(middle) < wanted { low = middle } else { high = middle }
    }
    radius_ratio(0.5 * (low + high))
}
