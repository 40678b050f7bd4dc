//! Chips and removal rates along the passes, in a report.

use schemars::JsonSchema;
use serde::Serialize;

/// Chips of an operation along its CC points, in all places of the pattern. "Before" is at the
/// job's cutting feed, lowered where an axis cannot follow; "after" is as written.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ChipsReport {
    /// Operation.
    pub operation: String,
    /// Whether the job's feeds depend on chips.
    pub by_chips: bool,
    /// CC points with a chip, in all places of the pattern.
    pub points: usize,
    /// CC points at which the material left by the pass before is unknown, beyond its ends: the
    /// full stock counts there.
    pub full_stock_points: usize,
    /// CC points at which no stock is cut. The feed of air applies to those where this is so as far
    /// as the cutter reaches along the feed.
    pub air_points: usize,
    /// Section of the chip across the feed (docs/method.md#chip-section).
    pub area_mm2: Option<SpreadReport>,
    /// Removal rate at the points that a cutting block leads to, before.
    pub removal_rate_before_cm3_min: Option<SpreadReport>,
    /// Removal rate at the same points, after.
    pub removal_rate_after_cm3_min: Option<SpreadReport>,
    /// Largest thickness of a tooth's chip before and after, at its thickest point; the feed per
    /// tooth is the tip feed over spindle speed and number of inserts. Too large by at most 0.001
    /// of the feed per tooth if the job limits the chip thickness, 0.02 of it otherwise.
    pub largest_chip_thickness_mm: Option<[f64; 2]>,
    /// CC points by the origin of the feed toward them.
    pub feeds_set_by: FeedsSetByReport,
    /// Whether the values before, and the added time, are those of the law of motion (one head,
    /// with a `time_law`); else they are at constant speeds.
    pub by_law: bool,
    /// Time in the passes after, less that before; below 0 if air is faster.
    pub added_time_s: f64,
}

/// Distribution of values at the CC points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SpreadReport {
    /// Mean over the points.
    pub mean: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Standard deviation over the mean; 0 if the mean is 0.
    pub variation: f64,
}

/// CC points by the origin of the feed toward them. A point can count both as lowered by the job's
/// limits and by the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FeedsSetByReport {
    /// The target of the removal rate, or its smallest feed.
    pub removal_rate: usize,
    /// The chip thickness.
    pub chip_thickness: usize,
    /// The feed of air.
    pub air: usize,
    /// An axis, the control's largest F, or the other head: slower than the chips permit.
    pub machine: usize,
    /// The control's smallest F: faster than the chips permit.
    pub smallest_f: usize,
}

impl SpreadReport {
    /// Returns the distribution of values; `None` without any.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let n = values.clone().count();
        if n == 0 {
            return None;
        }
        let mean = values.clone().sum::<f64>() / n as f64;
        let variance = values.clone().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n as f64;
        let [min, max] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        Some(Self { mean, min, max, variation: if mean > 0.0 { variance.sqrt() / mean } else { 0.0 } })
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/format/report/chips.rs"]
mod tests;
