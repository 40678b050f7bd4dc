//! Durations as hours, minutes and seconds.

/// Formats a time, s, as hours, minutes and seconds: `1:02:03`.
pub fn clock(seconds: f64) -> String {
    let total = seconds.round() as u64;
    format!("{}:{:02}:{:02}", total / 3600, total / 60 % 60, total % 60)
}
