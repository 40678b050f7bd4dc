use facemill_cl_data::{CcPoint, Pass};
use nalgebra::{Point3, Unit, Vector3};

use crate::layout::generate_passes::LaidPass;
use crate::layout::level_set::LevelSet;
use crate::layout::resample::ResampledPiece;
use crate::strategy::settings::{Direction, LaySettings, Pattern};

/// The pieces of one level or front.
pub(crate) struct LevelPieces<'a> {
    pub(crate) set: LevelSet<'a>,
    pub(crate) pieces: Vec<ResampledPiece>,
    /// The direction in which partial passes have to run; `None` where they are none.
    pub(crate) starts: Option<Direction>,
}

/// Puts the pieces in cutting order: level by level, on each level from where the last pass ended
/// to the nearest start of a piece; on the first level along the feed. Partial passes run from the
/// edge.
pub(crate) fn arrange(levels: Vec<LevelPieces>, settings: &LaySettings) -> Vec<LaidPass> {
    let mut direction = settings.first_direction();
    let mut passes: Vec<LaidPass> = Vec::new();
    for LevelPieces { set, pieces, starts } in levels {
        if pieces.is_empty() {
            continue;
        }
        let partial = starts.is_some();
        let feed = starts.filter(|_| settings.pattern == Pattern::Zigzag).unwrap_or(direction);
        let uncut = feed.uncut_side(settings.order);
        let mut pieces: Vec<ResampledPiece> = pieces.into_iter().map(|p| directed(p, feed)).collect();
        while !pieces.is_empty() {
            let next = match end_of(passes.last()) {
                Some(end) => nearest_start(&pieces, &end),
                None => first_along_feed(&pieces),
            };
            let ResampledPiece { points, length, closed, .. } = pieces.remove(next);
            let level = points.first().map_or(f64::NAN, |cc| set.reported_level(&cc.position));
            passes.push(LaidPass { pass: Pass::new(points), level, uncut, length, closed, partial });
        }
        if settings.pattern == Pattern::Zigzag && !partial {
            direction = direction.reversed();
        }
    }
    passes
}

/// Pieces come forward.
fn directed(mut piece: ResampledPiece, direction: Direction) -> ResampledPiece {
    if direction == Direction::Reverse {
        piece.points.reverse();
        for cc in &mut piece.points {
            cc.feed = -cc.feed;
        }
    }
    piece
}

fn end_of(pass: Option<&LaidPass>) -> Option<Point3<f64>> {
    pass?.pass.points.last().map(|cc| cc.position)
}

fn start_of(piece: &ResampledPiece) -> Option<Point3<f64>> {
    piece.points.first().map(|cc| cc.position)
}

fn nearest_start(pieces: &[ResampledPiece], end: &Point3<f64>) -> usize {
    least(pieces, |p| start_of(p).map_or(f64::INFINITY, |s| (s - end).norm_squared()))
}

/// The piece that begins first in the direction in which the pieces run on the whole; of closed
/// ones, any.
fn first_along_feed(pieces: &[ResampledPiece]) -> usize {
    let run = |p: &ResampledPiece| ends(&p.points).map_or_else(Vector3::zeros, |[a, b]| b - a);
    match Unit::try_new(pieces.iter().map(run).sum::<Vector3<f64>>(), 1e-9) {
        Some(feed) => least(pieces, |p| start_of(p).map_or(f64::INFINITY, |s| s.coords.dot(&feed))),
        None => 0,
    }
}

fn ends(points: &[CcPoint]) -> Option<[Point3<f64>; 2]> {
    Some([points.first()?.position, points.last()?.position])
}

/// Index of the first piece with the least value.
fn least(pieces: &[ResampledPiece], value: impl Fn(&ResampledPiece) -> f64) -> usize {
    let by_value = |a: &usize, b: &usize| value(&pieces[*a]).total_cmp(&value(&pieces[*b]));
    (0..pieces.len()).min_by(by_value).unwrap_or(0)
}
