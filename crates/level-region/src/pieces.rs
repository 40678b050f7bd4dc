//! Pieces of passes where the cutter has room.

use facemill_cl_data::CcPoint;
use nalgebra::{Point3, Unit, Vector3};

use crate::room::LevelRoom;

/// Settings of pieces.
pub struct PieceSettings<'s> {
    /// Distance between tested places along a pass, mm.
    pub step: f64,
    /// Shortest piece, mm.
    pub least: f64,
    /// Whether a piece may be cut the other way.
    pub is_reversible: bool,
    /// Whether the upright cutter is outside of all stock with its tip at a point: where a piece
    /// may begin.
    pub is_open: &'s (dyn Fn(&Point3<f64>) -> bool + Sync),
}

/// Halvings of a step up to the place where the room ends: to a ten-thousandth of it.
const HALVINGS: u32 = 14;

/// Returns the pieces of a straight pass on a level where an upright cutter has room, and the
/// number of those that are too short. The cutter touches with its rim ahead, so its tip is one
/// radius of the flat bottom behind a CC point.
///
/// A piece that begins in the stock, such as behind a wall, is turned round where that is permitted
/// and it then begins outside.
pub fn fitting_pieces(
    room: &LevelRoom<'_>,
    pass: &[CcPoint],
    settings: &PieceSettings<'_>,
) -> (Vec<Vec<CcPoint>>, usize) {
    let (Some(first), Some(last)) = (pass.first(), pass.last()) else { return (Vec::new(), 0) };
    let way = last.position - first.position;
    let Some(feed) = Unit::try_new(way, f64::MIN_POSITIVE) else { return (Vec::new(), 1) };
    let line = PassLine { room, start: first.position, feed, length: way.norm(), rim: room.rim_radius() };
    let mut pieces = Vec::new();
    let mut n_short = 0;
    for [from, to] in line.free(settings.step) {
        let forward = line.run([from, to], 1.0);
        let backward = line.run([from, to], -1.0);
        let opens = |run: &CcRun| (settings.is_open)(&line.at(run.tip_at_start));
        let turned = settings.is_reversible && !opens(&forward) && opens(&backward);
        let run = if turned { backward } else { forward };
        if run.cc[1] - run.cc[0] < settings.least {
            n_short += 1;
            continue;
        }
        pieces.push(line.points(pass, &run, first));
    }
    (pieces, n_short)
}

/// Line of a pass.
struct PassLine<'l, 'a> {
    room: &'l LevelRoom<'a>,
    start: Point3<f64>,
    feed: Unit<Vector3<f64>>,
    length: f64,
    rim: f64,
}

/// CcRun of CC points along a line, where the tip has room.
struct CcRun {
    /// First and last way of CC points, mm from the start of the line.
    cc: [f64; 2],
    /// 1 along the line, −1 against it.
    sense: f64,
    /// Way of the tip at the beginning.
    tip_at_start: f64,
}

impl PassLine<'_, '_> {
    fn at(&self, way: f64) -> Point3<f64> {
        self.start + self.feed.into_inner() * way
    }

    fn fits(&self, way: f64) -> bool {
        self.room.fits(&self.at(way))
    }

    /// Returns the stretches of the tip's ways with room, from a rim before the line to a rim
    /// behind it.
    fn free(&self, step: f64) -> Vec<[f64; 2]> {
        let (from, to) = (-self.rim, self.length + self.rim);
        let n = ((to - from) / step).ceil().clamp(1.0, MOST_STEPS) as usize;
        let way = |k: usize| from + (to - from) * k as f64 / n as f64;
        let mut found: Vec<[f64; 2]> = Vec::new();
        let mut begun = None;
        let mut before = false;
        for k in 0..=n {
            let fits = self.fits(way(k));
            if fits && !before {
                begun = Some(if k == 0 { from } else { self.border(way(k), way(k - 1)) });
            } else if !fits && before {
                found.extend(begun.take().map(|start| [start, self.border(way(k - 1), way(k))]));
            }
            before = fits;
        }
        found.extend(begun.map(|start| [start, to]));
        found
    }

    /// Returns the last way with room from one with room toward one without.
    fn border(&self, mut free: f64, mut blocked: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (free + blocked);
            if self.fits(middle) { free = middle } else { blocked = middle }
        }
        free
    }

    /// Returns the CC points of a stretch of the tip, cut along the line or against it.
    fn run(&self, [from, to]: [f64; 2], sense: f64) -> CcRun {
        let ahead = sense * self.rim;
        let cc = [(from + ahead).max(0.0), (to + ahead).min(self.length)];
        let start = if sense > 0.0 { cc[0] } else { cc[1] };
        CcRun { cc, sense, tip_at_start: start - ahead }
    }

    /// Returns the CC points of a run: those of the pass, and both ends.
    fn points(&self, pass: &[CcPoint], run: &CcRun, first: &CcPoint) -> Vec<CcPoint> {
        let [from, to] = run.cc;
        let way_of = |p: &CcPoint| (p.position - self.start).dot(&self.feed);
        let apart = SAME_PLACE.max(1e-6 * self.length);
        let inner = pass.iter().map(way_of).filter(|way| *way > from + apart && *way < to - apart);
        let mut ways: Vec<f64> = std::iter::once(from).chain(inner).chain([to]).collect();
        if run.sense < 0.0 {
            ways.reverse();
        }
        let feed = Unit::new_unchecked(self.feed.into_inner() * run.sense);
        ways.into_iter().map(|way| CcPoint { position: self.at(way), feed, normal: first.normal }).collect()
    }
}

/// Largest number of tested places on a pass.
const MOST_STEPS: f64 = 20_000.0;

/// Least distance of two points of a piece, mm.
const SAME_PLACE: f64 = 1e-3;
