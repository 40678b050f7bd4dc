//! Shortened links of a report.

use facemill_tool_path::links::ways::WayKind;
use schemars::JsonSchema;
use serde::Serialize;

/// The links between the passes of a setup.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LinksReport {
    /// Why they are as they were planned over the clearance surface; `null` where faster ones were
    /// looked for.
    pub not_shortened_because: Option<String>,
    /// What was found; `null` where nothing was looked for.
    pub shortened: Option<ShortenedLinks>,
}

impl LinksReport {
    /// Of links that were looked at.
    pub fn of(links: ShortenedLinks) -> Self {
        Self { not_shortened_because: None, shortened: Some(links) }
    }

    /// Of links that stay as they are.
    pub fn not_shortened(why: impl Into<String>) -> Self {
        Self { not_shortened_because: Some(why.into()), shortened: None }
    }
}

/// The links of a setup before and after.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ShortenedLinks {
    /// Distance that was kept from stock and fixtures, mm.
    pub clearance_mm: f64,
    /// Whether times are within acceleration and jerk of every axis; else within their velocities
    /// alone, because the machine file does not give all of them.
    pub by_acceleration_and_jerk: bool,
    /// Time of all links as they were planned over the clearance surface, s.
    pub time_before_s: f64,
    /// Time of all links as they are written, s.
    pub time_after_s: f64,
    /// Time of the slowest axis of each link by itself, with nothing in the way: no ways are
    /// faster, s.
    pub lower_bound_s: f64,
    /// `time_after_s` by `lower_bound_s`; `null` without links.
    pub ratio_to_lower_bound: Option<f64>,
    /// Links with another way than over the clearance surface.
    pub changed: usize,
    /// All links, in program order.
    pub links: Vec<PlannedLinkReport>,
}

/// One link of a plan.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PlannedLinkReport {
    /// Its first and last line.
    pub lines: [u32; 2],
    /// Time as it was planned over the clearance surface, s.
    pub time_before_s: f64,
    /// Time as it is written, s.
    pub time_after_s: f64,
    /// Time of its slowest axis by itself, with nothing in the way: no way is faster, s.
    pub lower_bound_s: f64,
    /// How it goes.
    pub way: WayKind,
    /// Why it was not looked at, or went back to the way over the clearance surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept_because: Option<String>,
}

impl ShortenedLinks {
    /// Sums of the times of links.
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
            changed: links.iter().filter(|l| l.way != WayKind::Original).count(),
            links,
        }
    }
}
