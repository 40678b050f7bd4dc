use super::junction::{Arc, Junction};
use super::law::TrapezoidSettings;
use super::segment::{LEAST_CYCLES, Segment};
use crate::time_law::AxisBounds;

/// Number of cycles below which the rest of a line before an arc is merged into the arc.
const GAP_CYCLES: f64 = 4.0;

/// A line or an arc in the queue of a control.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Index of its segment.
    pub segment: usize,
    pub length: f64,
    pub speed: f64,
    pub acceleration: f64,
    pub end: End,
    /// Whether it is an arc between its segment and the next one.
    pub is_arc: bool,
}

/// End of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum End {
    /// A stop.
    Stop,
    /// An overlap with the next entry.
    Overlap,
    /// A passage at this speed at most.
    Through(f64),
}

/// Returns the lines and arcs of a program.
pub(crate) fn entries(segments: &[Segment], axes: &[AxisBounds], settings: &TrapezoidSettings) -> Vec<Entry> {
    let mut out = Vec::with_capacity(segments.len());
    let mut before = Junction::Stop;
    let Some(first) = segments.first() else { return out };
    let mut left = first.whole;
    for (k, segment) in segments.iter().enumerate() {
        let after = segments.get(k + 1);
        let junction = after.map_or(Junction::Stop, |next| Junction::between(segment, next, left, axes, settings));
        let cycle = settings.cycle;
        let (line, arc) = match junction {
            Junction::Arc(arc) => parted(left, arc, cycle),
            _ => (left, None),
        };
        if line > 0.0 {
            out.push(Entry {
                segment: k,
                length: line,
                speed: segment.speed.min(line / (LEAST_CYCLES * cycle)),
                acceleration: segment.acceleration.0 * along(&before, &junction),
                end: match (&junction, arc) {
                    (_, Some(arc)) => End::Through(arc.speed),
                    (Junction::Through { speed, .. }, _) => End::Through(*speed),
                    (Junction::Overlap, _) => End::Overlap,
                    _ => End::Stop,
                },
                is_arc: false,
            });
        }
        left = after.map_or(0.0, |next| next.whole);
        if let Some(Arc { speed, length, acceleration, cut }) = arc {
            out.push(Entry { segment: k, length, speed, acceleration, end: End::Through(speed), is_arc: true });
            left -= cut;
        }
        before = junction;
    }
    out
}

/// Splits the rest of a line before an arc, which absorbs it where it is short.
fn parted(left: f64, arc: Arc, cycle: f64) -> (f64, Option<Arc>) {
    let line = left - arc.cut;
    if line < GAP_CYCLES * cycle * arc.speed {
        (0.0, Some(arc.with_line(line.max(0.0)).within_cycle(cycle)))
    } else {
        (line, Some(arc.within_cycle(cycle)))
    }
}

/// Returns the fraction of a line's acceleration that acts along it between two junctions.
fn along(before: &Junction, after: &Junction) -> f64 {
    let share = |junction: &Junction| if let Junction::Through { share, .. } = junction { *share } else { 0.0 };
    // Where two lines move at once each has half.
    let is_shared = [before, after].iter().any(|j| matches!(j, Junction::Overlap));
    (1.0 - share(before).max(share(after))) * if is_shared { 0.5 } else { 1.0 }
}

/// Returns the speed at the end of each entry from which the control can stop within its
/// look-ahead; 0 where it stops anyway.
pub(crate) fn end_speeds(entries: &[Entry], look_ahead: usize) -> Vec<f64> {
    // The largest speed at the end of an entry from which the next one ends at v.
    let back = |v: f64, before: &Entry, entry: &Entry| {
        let End::Through(most) = before.end else { return 0.0 };
        let reached = (v * v + 2.0 * entry.acceleration * entry.length).sqrt();
        reached.min(most).min(before.speed).min(entry.speed)
    };
    if look_ahead >= entries.len() {
        // All is in sight: one pass, whatever the number of entries.
        let mut speeds = vec![0.0; entries.len()];
        for (k, pair) in entries.windows(2).enumerate().rev() {
            speeds[k] = back(speeds[k + 1], &pair[0], &pair[1]);
        }
        return speeds;
    }
    let of_entry = |k: usize| {
        let End::Through(_) = entries[k].end else { return 0.0 };
        let seen = &entries[k..entries.len().min(k + 1 + look_ahead)];
        let through = seen.iter().take(seen.len() - 1).take_while(|e| matches!(e.end, End::Through(_))).count();
        // From a stop at the end of the look-ahead back to here.
        (1..=through).rev().fold(0.0, |v, at| back(v, &seen[at - 1], &seen[at]))
    };
    (0..entries.len()).map(of_entry).collect()
}
