//! Operations that two heads cut at once, in a report.

use schemars::JsonSchema;
use serde::Serialize;

/// Two operations that two heads cut at the same time.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PairReport {
    /// Name of the operation of head 1.
    pub first: String,
    /// Name of the operation of head 2.
    pub second: String,
    /// Axis that both share.
    pub shared_axis: String,
    /// Stretches cut by both heads without lifting.
    pub runs: usize,
    /// Length of each tip's path (head 1, head 2) in cuts of both heads at once.
    pub paired_length_mm: [f64; 2],
    /// Length of each tip's path (head 1, head 2) in all cuts.
    pub cutting_length_mm: [f64; 2],
    /// Fraction of both tips' cutting length that is cut by both heads at once.
    pub paired_fraction: f64,
    /// Time of all moves of both operations, with entries, exits, links and rapids, at the constant
    /// speeds that axis velocities allow.
    pub time_s: f64,
    /// The same before links were shortened.
    pub time_before_shortening_s: f64,
    /// Time of all moves if each operation were cut alone, one after the other, before links are
    /// shortened.
    pub separate_time_s: f64,
    /// `time_before_shortening_s` as part of `separate_time_s`.
    pub time_ratio: f64,
    /// Smallest and largest speed of each tip in cuts of both heads; `null` if there are none.
    pub tip_feed_mm_min: [Option<[f64; 2]>; 2],
    /// Steps of each head in cuts of both in which its tool turns relative to the surface by more
    /// than `max_turn_deg_per_mm` of its operation: rotate follows the shared axis and has no limit
    /// of its own.
    pub posture_jumps: [usize; 2],
    /// Largest speed of the shared axis in cuts of both heads, deg/s (mm/s of a linear axis).
    pub shared_velocity: f64,
    /// Reasons why the rest is cut by each head alone, the most frequent first.
    pub splits: Vec<PairSplit>,
}

/// Stations of paired passes that are not cut at once, for one cause.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PairSplit {
    /// The cause.
    pub cause: String,
    /// Number of stations (pairs of points).
    pub stations: usize,
    /// Position of the first head at the first of them, workpiece frame.
    pub first_place_mm: [f64; 3],
    /// Details of the first of them.
    pub first: String,
}
