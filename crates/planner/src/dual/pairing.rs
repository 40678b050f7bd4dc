//! Choice of the passes and points of both sides that are cut at the same time.

use facemill_cl_data::CcPoint;
use facemill_cutter_location::PairStation;
use facemill_tool_path::segments::PassSegment;

/// A piece of each operation, cut at the same time.
#[derive(Clone, Debug)]
pub(crate) struct PiecePair {
    /// Index of the piece among those of each operation.
    pub pieces: [usize; 2],
    /// Positions of both heads at the same times.
    pub stations: Vec<Station>,
}

/// A station of a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Station {
    /// CC points and ways.
    pub pair: PairStation,
    /// Position in each piece: index of a cut, with a fraction between two.
    pub at: [f64; 2],
}

/// Returns pairs of pieces of two operations, in the order of both: those that share the most
/// length; of equals, the nearest to each other. A piece is in one pair at most; pieces of
/// different places of the pattern form none.
///
/// The method is the longest common subsequence of both orders, which is exact: its table has every
/// pair of the best choice.
pub(crate) fn pairs(first: &[PassSegment], second: &[PassSegment]) -> Vec<[usize; 2]> {
    let lengths = [first, second].map(|pieces| pieces.iter().map(length).collect::<Vec<f64>>());
    let size = first.iter().chain(second).map(extent).fold(1.0, f64::max);
    let score = |i: usize, j: usize| {
        if first[i].copy != second[j].copy {
            return f64::NEG_INFINITY;
        }
        lengths[0][i].min(lengths[1][j]) * (1.0 - (distance(&first[i], &second[j]) / size).min(1.0))
    };
    in_order(first.len(), second.len(), score)
}

/// Returns pairs of indices, both increasing, with the largest sum of scores.
fn in_order(n: usize, m: usize, score: impl Fn(usize, usize) -> f64) -> Vec<[usize; 2]> {
    // best[i][j]: of the first i and j.
    let mut best = vec![vec![0.0; m + 1]; n + 1];
    for i in 1..=n {
        for j in 1..=m {
            let paired: f64 = best[i - 1][j - 1] + score(i - 1, j - 1);
            best[i][j] = paired.max(best[i - 1][j]).max(best[i][j - 1]);
        }
    }
    let (mut i, mut j, mut found) = (n, m, Vec::new());
    while i > 0 && j > 0 {
        if best[i][j] == best[i - 1][j] {
            i -= 1;
        } else if best[i][j] == best[i][j - 1] {
            j -= 1;
        } else {
            (i, j) = (i - 1, j - 1);
            found.push([i, j]);
        }
    }
    found.reverse();
    found
}

/// Returns the length of a piece along its cuts, mm.
pub(crate) fn length(piece: &PassSegment) -> f64 {
    piece.cuts.windows(2).map(|w| (w[1].cc.position - w[0].cc.position).norm()).sum()
}

fn extent(piece: &PassSegment) -> f64 {
    facemill_cl_data::Aabb::of_points(piece.cuts.iter().map(|c| &c.cc.position)).half_extents().norm() * 4.0
}

/// Returns the mean distance between points at the same fraction of both pieces.
fn distance(a: &PassSegment, b: &PassSegment) -> f64 {
    const SAMPLES: usize = 9;
    let at = |p: &PassSegment, k: usize| p.cuts[(p.cuts.len() - 1) * k / (SAMPLES - 1)].cc.position;
    (0..SAMPLES).map(|k| (at(a, k) - at(b, k)).norm()).sum::<f64>() / SAMPLES as f64
}

/// Largest number of points that one head passes while the other goes from one to the next.
const MOST_TO_ONE: usize = 6;

/// Largest lead of one piece over the other, as a fraction of the whole.
const BAND: f64 = 0.2;

/// Returns stations through all points of two passes, both from end to end: of all assignments the
/// one that takes the shortest time at these feeds, in which opposite points far from each other
/// count for longer.
///
/// If several points of one head fall between two of the other, CC points are added to the other on
/// the straight line between its two: the path's chord tolerance holds there.
pub(crate) fn stations(passes: [&[CcPoint]; 2], feeds: [f64; 2]) -> Vec<Station> {
    let anchors = anchors(passes, feeds);
    let mut stations: Vec<Station> = Vec::new();
    for pair in anchors.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        if stations.is_empty() {
            stations.extend(station(passes, [from[0] as f64, from[1] as f64]));
        }
        let steps: [usize; 2] = std::array::from_fn(|h| to[h] - from[h]);
        // One of the two is 1.
        let leader = usize::from(steps[1] > steps[0]);
        let other = 1 - leader;
        let points = &passes[leader][from[leader]..=to[leader]];
        let total: f64 = points.windows(2).map(|w| (w[1].position - w[0].position).norm()).sum();
        let mut way = 0.0;
        for k in 1..=steps[leader] {
            way += (points[k].position - points[k - 1].position).norm();
            let part = if k == steps[leader] || total <= 0.0 { k as f64 / steps[leader] as f64 } else { way / total };
            let mut at = [0.0; 2];
            at[leader] = (from[leader] + k) as f64;
            at[other] = from[other] as f64 + part * steps[other] as f64;
            stations.extend(station(passes, at));
        }
    }
    for k in 1..stations.len() {
        let way = |h: usize| (stations[k].pair.cc[h].position - stations[k - 1].pair.cc[h].position).norm();
        stations[k].pair.way = [way(0), way(1)];
    }
    stations
}

fn station(passes: [&[CcPoint]; 2], at: [f64; 2]) -> Option<Station> {
    let cc = [point(passes[0], at[0])?, point(passes[1], at[1])?];
    Some(Station { pair: PairStation { cc, way: [0.0; 2] }, at })
}

/// Returns the CC point at an index with a fraction.
fn point(pass: &[CcPoint], at: f64) -> Option<CcPoint> {
    let k = (at.floor().max(0.0) as usize).min(pass.len().checked_sub(1)?);
    let t = at - k as f64;
    match pass.get(k + 1) {
        Some(next) if t > 0.0 => between(&pass[k], next, t),
        _ => Some(pass[k]),
    }
}

/// Returns the CC point on the straight line between two.
pub(crate) fn between(a: &CcPoint, b: &CcPoint, t: f64) -> Option<CcPoint> {
    let position = a.position + (b.position - a.position) * t;
    CcPoint::new(position, a.normal.lerp(&b.normal, t), a.feed.lerp(&b.feed, t)).ok()
}

/// Returns pairs of indices of points that are passed at the same time, from both first ones to
/// both last ones; from one pair to the next, one of the two indices grows by 1.
fn anchors(passes: [&[CcPoint]; 2], feeds: [f64; 2]) -> Vec<[usize; 2]> {
    let [n, m] = passes.map(<[CcPoint]>::len);
    if n == 0 || m == 0 {
        return Vec::new();
    }
    let ways = passes.map(|pass| {
        let mut sum = 0.0;
        let mut last = pass[0].position;
        pass.iter()
            .map(|cc| {
                sum += (cc.position - last).norm();
                last = cc.position;
                sum
            })
            .collect::<Vec<f64>>()
    });
    let wholes = [ways[0][n - 1], ways[1][m - 1]].map(|w: f64| w.max(f64::MIN_POSITIVE));
    let size = wholes[0].max(wholes[1]);
    let apart = |i: usize, j: usize| (passes[0][i].position - passes[1][j].position).norm() / size;
    // Second indices in the band about each first one; the ways grow, so they follow each other.
    let band = |i: usize| {
        let at = ways[0][i] / wholes[0];
        let part = |j: &f64| j / wholes[1];
        let low = ways[1].partition_point(|j| part(j) < at - BAND);
        low..ways[1].partition_point(|j| part(j) <= at + BAND).max(low)
    };
    let cost = |from: [usize; 2], to: [usize; 2]| {
        let time = |h: usize| (ways[h][to[h]] - ways[h][from[h]]) / feeds[h];
        // Equal shares of the slower one's time are as good as none: keep both going evenly.
        time(0).max(time(1)) + 0.05 * (time(0) - time(1)).abs() + 0.2 * time(0).max(time(1)) * apart(to[0], to[1])
    };
    let steps: Vec<[usize; 2]> = (1..=MOST_TO_ONE).map(|k| [k, 1]).chain((2..=MOST_TO_ONE).map(|k| [1, k])).collect();
    // Costs are needed as far back as the longest step, the steps themselves to the end.
    let bands: Vec<std::ops::Range<usize>> = (0..n).map(band).collect();
    let mut costs: Vec<Vec<f64>> = vec![Vec::new(); n];
    let mut taken: Vec<Vec<[u8; 2]>> = vec![Vec::new(); n];
    for i in 0..n {
        let mut row = vec![f64::INFINITY; bands[i].len()];
        taken[i] = vec![[0; 2]; bands[i].len()];
        for (k, j) in bands[i].clone().enumerate() {
            if [i, j] == [0, 0] {
                row[k] = 0.0;
            }
            for &[a, b] in steps.iter().filter(|[a, b]| *a <= i && *b <= j) {
                let before = bands[i - a].contains(&(j - b)).then(|| costs[i - a].get(j - b - bands[i - a].start));
                let Some(&before) = before.flatten() else { continue };
                let sum = before + cost([i - a, j - b], [i, j]);
                if sum < row[k] {
                    row[k] = sum;
                    taken[i][k] = [a as u8, b as u8];
                }
            }
        }
        costs[i] = row;
        if let Some(old) = i.checked_sub(MOST_TO_ONE) {
            costs[old] = Vec::new();
        }
    }
    if costs[n - 1].last().is_none_or(|cost| cost.is_infinite()) || bands[n - 1].end != m {
        return Vec::new();
    }
    let mut at = [n - 1, m - 1];
    let mut found = vec![at];
    while at != [0, 0] {
        let [a, b] = taken[at[0]][at[1] - bands[at[0]].start].map(usize::from);
        at = [at[0] - a, at[1] - b];
        found.push(at);
    }
    found.reverse();
    found
}

#[cfg(test)]
#[path = "../../tests/unit/dual/pairing.rs"]
mod tests;
