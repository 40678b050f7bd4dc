//! Shortened links of a report.

use facemill_tool_path::links::link_paths::RetractStrategy;
use schemars::JsonSchema;
use serde::Serialize;

/// Links between the passes of a setup.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LinksReport {
    /// Reason why they are as planned over the clearance surface; `null` if faster ones were
    /// sought.
    pub not_shortened_because: Option<String>,
    /// Result of the search; `null` without a search.
    pub shortened: Option<ShortenedLinks>,
    /// Turns with the tool down in place of links; left out where none were sought.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub turns: Option<TurnsReport>,
}

/// Turns from pass to pass with the tool down, and the links that remain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct TurnsReport {
    /// Number of turns.
    pub turns_on_surface: usize,
    /// Number of links between passes of operations whose passes may be joined by turns.
    pub links: usize,
    /// Length of the tip's path on the turns, mm.
    pub length_mm: f64,
    /// Time of the turns at the written feeds, s; part of the time of entries and exits.
    pub time_s: f64,
    /// Reasons for links, the most frequent first.
    pub reasons: Vec<LinkReason>,
}

/// Reason why passes are joined by a link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LinkReason {
    /// The reason.
    pub reason: String,
    /// Number of links.
    pub links: usize,
}

impl LinksReport {
    /// Returns the report on links that were examined.
    pub fn of(links: ShortenedLinks) -> Self {
        Self { not_shortened_because: None, shortened: Some(links), turns: None }
    }

    /// Returns the report on links that stay as they are.
    pub fn not_shortened(why: impl Into<String>) -> Self {
        Self { not_shortened_because: Some(why.into()), shortened: None, turns: None }
    }
}

/// Links of a setup before and after.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ShortenedLinks {
    /// Distance kept from stock and fixtures, mm.
    pub clearance_mm: f64,
    /// Whether times are within acceleration and jerk of every axis; else within their velocities
    /// alone, because the machine file lacks other limits.
    pub by_acceleration_and_jerk: bool,
    /// Time of all links as planned over the clearance surface, s.
    pub time_before_s: f64,
    /// Time of all links as written, s.
    pub time_after_s: f64,
    /// Sum over all links of the time of the slowest axis by itself, without obstacles: no links
    /// are faster, s.
    pub lower_bound_s: f64,
    /// `time_after_s` by `lower_bound_s`; `null` without links.
    pub ratio_to_lower_bound: Option<f64>,
    /// Number of links by another path than over the clearance surface.
    pub changed: usize,
    /// All links, in program order.
    pub links: Vec<PlannedLinkReport>,
}

/// One link of a plan.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlannedLinkReport {
    /// Its first and last line.
    pub lines: [u32; 2],
    /// Time as planned over the clearance surface, s.
    pub time_before_s: f64,
    /// Time as written, s.
    pub time_after_s: f64,
    /// Time of its slowest axis by itself, without obstacles: no link is faster, s.
    pub lower_bound_s: f64,
    /// Its path.
    pub way: RetractStrategy,
    /// Reason why it was not examined, or was restored to the path over the clearance surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept_because: Option<String>,
}

impl ShortenedLinks {
    /// Returns links with the sums of their times.
    pub fn new(clearance_mm: f64, by_acceleration_and_jerk: bool, links: Vec<PlannedLinkReport>) -> Self {
        let sum = |time: fn(&PlannedLinkReport) -> f64| links.iter().map(time).sum::<f64>();
        let [time_before_s, time_after_s, lower_bound_s] =
            [sum(|l| l.time_before_s), sum(|l| l.time_after_s), sum(|l| l.lower_bound_s)];
        Self {
            clearance_mm,
            by_acceleration_and_jerk,
            time_before_s,
            time_after_s,
            lower_bound_s,
            ratio_to_lower_bound: (lower_bound_s > 0.0).then(|| time_after_s / lower_bound_s),
            changed: links.iter().filter(|l| l.way != RetractStrategy::Original).count(),
            links,
        }
    }
}
