//! Costs of a head's postures in a pair.

use facemill_cl_data::Posture;

use crate::cusp::cut_point::Strip;
use crate::pairs::shared_axis::PostureRange;
use crate::passes::cost::CuspScale;

/// Costs of postures per second, on a grid over a range; linear between its nodes, which is close
/// enough to choose by.
pub(crate) struct CostTable {
    range: PostureRange,
    /// Cost above which the cusp is higher than allowed.
    pub(crate) most: f64,
    /// By tilt, then rotate.
    rates: Vec<[f64; ROTATE_NODES]>,
}

/// Least largest tilt, rad: none is 0.
const LEAST: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Nodes of a [`CostTable`].
const TILT_NODES: usize = 17;

const ROTATE_NODES: usize = 33;

impl CostTable {
    pub(crate) fn new(scale: &CuspScale, strip: &Strip, range: PostureRange) -> Self {
        let most = range.tilt[1].max(LEAST);
        let rate = |i: usize, j: usize| {
            let posture =
                Posture { tilt: node(range.tilt, i, TILT_NODES), rotate: node(range.rotate, j, ROTATE_NODES) };
            scale.rate(posture, strip) + TILT_SHARE * (posture.tilt / most).powi(2)
        };
        let most = CuspScale::rate_of(1.0) + TILT_SHARE;
        Self { range, most, rates: (0..TILT_NODES).map(|i| std::array::from_fn(|j| rate(i, j))).collect() }
    }

    pub(crate) fn at(&self, posture: Posture) -> f64 {
        let place = |[low, high]: [f64; 2], value: f64, n: usize| {
            let x = if high > low { (value - low) / (high - low) * (n - 1) as f64 } else { 0.0 };
            let k = (x.max(0.0) as usize).min(n - 2);
            (k, (x - k as f64).clamp(0.0, 1.0))
        };
        let (i, s) = place(self.range.tilt, posture.tilt, TILT_NODES);
        let (j, t) = place(self.range.rotate, posture.rotate, ROTATE_NODES);
        let along = |i: usize| self.rates[i][j] * (1.0 - t) + self.rates[i][j + 1] * t;
        along(i) * (1.0 - s) + along(i + 1) * s
    }
}

fn node([low, high]: [f64; 2], k: usize, n: usize) -> f64 {
    low + (high - low) * k as f64 / (n - 1) as f64
}

/// Weight of the square of a tilt over its largest, where a cusp as high as allowed costs 1: enough
/// to decide between postures that leave no cusps.
const TILT_SHARE: f64 = 0.1;
