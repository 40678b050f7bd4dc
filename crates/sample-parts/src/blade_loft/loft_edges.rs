//! Leading and trailing edge of sections, and the group of each of their gaps.

use nalgebra::Point3;

use crate::blade_loft::section_curve::gap_and_turn;

/// Groups of a lofted blade, in the order of its mesh.
pub(crate) const LOFT_GROUPS: [&str; 8] =
    ["suction", "pressure", "leading-edge", "trailing-edge", "tip", "root", "hub", "hub-ends"];
pub(crate) const SUCTION: usize = 0;
pub(crate) const PRESSURE: usize = 1;
const LEADING: usize = 2;
const TRAILING: usize = 3;
pub(crate) const TIP: usize = 4;
pub(crate) const ROOT: usize = 5;
pub(crate) const HUB: usize = 6;
pub(crate) const HUB_ENDS: usize = 7;

/// Largest share of the chord that a flat end is long.
pub(crate) const LONGEST_END: f64 = 0.2;

/// Share of the chord along a section to both sides of a rounded edge in which there are no
/// corners. Larger: corners of the sides are smoothed. Smaller: coarse points of the edge stay
/// corners.
pub(crate) const ROUND_SHARE: f64 = 0.1;

/// Share of the chord up to which an edge's radius, and its length to each side, are an edge's and
/// not a side's.
const EDGE_SHARE: f64 = 0.05;

/// First and last column of an edge in the order of columns: the corners of a flat end, or twice
/// the same column.
pub(crate) type EdgeColumns = [usize; 2];

/// Columns from one to another onward.
fn onward(n: usize, from: usize, to: usize) -> usize {
    (to + n - from) % n
}

/// The shorter way between two marks, in the order of columns.
pub(crate) fn ordered(n: usize, [a, b]: EdgeColumns) -> EdgeColumns {
    if onward(n, a, b) <= onward(n, b, a) { [a, b] } else { [b, a] }
}

/// Ends of a section's chord: the two points that are farthest apart, each widened to the flat end
/// between neighbouring corners that it is on.
pub(crate) fn chord_ends(section: &[Point3<f64>], corners: &[usize]) -> [EdgeColumns; 2] {
    let n = section.len();
    let mut best = (0.0, [0, 0]);
    for a in 0..n {
        for b in a + 1..n {
            let distance_sq = (section[b] - section[a]).norm_squared();
            if distance_sq > best.0 {
                best = (distance_sq, [a, b]);
            }
        }
    }
    let longest = LONGEST_END * f64::sqrt(best.0);
    best.1.map(|end| flat_end(section, corners, end, longest).unwrap_or([end; 2]))
}

/// Corners of the flat end that a column is on: neighbouring corners, shorter than a length.
pub(crate) fn flat_end(section: &[Point3<f64>], corners: &[usize], end: usize, longest: f64) -> Option<EdgeColumns> {
    let n = section.len();
    let flat = |k: usize| {
        let [from, to] = [corners[k], corners[(k + 1) % corners.len()]];
        let gaps = onward(n, from, to);
        let length: f64 = (0..gaps).map(|gap| gap_and_turn(section, (from + gap) % n).0).sum();
        (gaps > 0 && onward(n, from, end) <= gaps && length < longest).then_some([from, to])
    };
    (0..corners.len()).find_map(flat)
}

/// Columns of an edge, and those within a length of it along the section.
pub(crate) fn columns_about(section: &[Point3<f64>], [from, to]: EdgeColumns, length: f64) -> Vec<usize> {
    let n = section.len();
    let mut columns: Vec<usize> = (0..=onward(n, from, to)).map(|k| (from + k) % n).collect();
    let mut way = 0.0;
    for column in (1..n).map(|k| (to + k) % n) {
        way += gap_and_turn(section, (column + n - 1) % n).0;
        if way > length {
            break;
        }
        columns.push(column);
    }
    let mut way = 0.0;
    for column in (1..n).map(|k| (from + n - k) % n) {
        way += gap_and_turn(section, column).0;
        if way > length {
            break;
        }
        columns.push(column);
    }
    columns
}

/// Group of the gap behind each column, from leading and trailing edge of a typical section; the
/// longer side is the suction side.
pub(crate) fn groups_of_gaps(section: &[Point3<f64>], [leading, trailing]: [EdgeColumns; 2]) -> Vec<usize> {
    let n = section.len();
    let length = |from: usize, to: usize| -> f64 {
        (0..onward(n, from, to)).map(|gap| gap_and_turn(section, (from + gap) % n).0).sum()
    };
    let first_is_longer = length(leading[1], trailing[0]) >= length(trailing[1], leading[0]);
    let [first, second] = if first_is_longer { [SUCTION, PRESSURE] } else { [PRESSURE, SUCTION] };
    let mut groups = vec![second; n];
    for gap in 0..onward(n, leading[1], trailing[0]) {
        groups[(leading[1] + gap) % n] = first;
    }
    let chord = (section[trailing[0]] - section[leading[0]]).norm();
    for (group, [from, to]) in [(LEADING, leading), (TRAILING, trailing)] {
        for gap in 0..onward(n, from, to) {
            groups[(from + gap) % n] = group;
        }
        if from == to {
            for column in round_edge(section, from, EDGE_SHARE * chord) {
                groups[column] = group;
            }
        }
    }
    groups
}

/// Gaps of a rounded or sharp edge about a column: at least one to each side, and as many as bend
/// with less than a radius within that length.
fn round_edge(section: &[Point3<f64>], column: usize, radius: f64) -> Vec<usize> {
    let n = section.len();
    let bends = |column: usize| {
        let (next, turn) = gap_and_turn(section, column);
        let (before, _) = gap_and_turn(section, (column + n - 1) % n);
        turn * radius > 0.5 * (before + next)
    };
    let mut gaps = Vec::new();
    let (mut at, mut length) = (column, 0.0);
    loop {
        gaps.push(at);
        length += gap_and_turn(section, at).0;
        at = (at + 1) % n;
        if length > radius || gaps.len() > n / 4 || !bends(at) {
            break;
        }
    }
    let (mut at, mut length, onward) = (column, 0.0, gaps.len());
    loop {
        at = (at + n - 1) % n;
        gaps.push(at);
        length += gap_and_turn(section, at).0;
        if length > radius || gaps.len() - onward > n / 4 || !bends(at) {
            break;
        }
    }
    gaps
}
