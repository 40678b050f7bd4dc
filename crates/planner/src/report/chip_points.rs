//! Chip and feed at every CC point of a written program.

use facemill_drawing::chips_svg::ChartPoint;
use facemill_job::format::job_file::OperationFile;
use facemill_job::format::report::chips::{ChipsReport, FeedsSetByReport, SpreadReport};
use facemill_job::validate::tip_feed::{CM3, CutFeed, FeedLaw, depends_on_chips, teeth_per_minute};
use facemill_tool_path::chips::Chip;
use facemill_tool_path::moves::{MoveKind, PieceMoves};

use crate::passes::engagement::PointEngagement;
use crate::passes::operation::PlannedOperation;
use crate::program::timed::Timed;

/// A CC point of an operation, in cutting order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChipPoint {
    /// Place in the pattern, from 0.
    pub copy: u32,
    /// Pass of the path, from 0.
    pub pass: usize,
    /// Number of the piece's point, from 0.
    pub point: usize,
    /// Length of the path along the CC points of the operation's passes up to here, mm.
    pub way: f64,
    /// Section of the chip, mm².
    pub area: f64,
    /// Largest thickness of the chip as part of the feed per tooth.
    pub thickness: f64,
    /// Whether the material left by the pass before is known.
    pub is_known: bool,
    /// Line of the program on which the tip arrives; `None` at the first point of a piece, which
    /// the entry reaches, and if lines are unknown.
    pub line: Option<u32>,
    /// Speed at which the tip arrives; `None` at the first point of a piece, which the entry
    /// reaches.
    pub arrival: Option<Arrival>,
}

/// Speed of the tip toward a point: the largest of the moves since the point before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    /// Tip feed at the job's cutting feed, mm/min.
    pub before: f64,
    /// Tip feed as written, mm/min.
    pub after: f64,
    /// Programmed tip feed, mm/min.
    pub programmed: f64,
    /// Origin of the programmed tip feed.
    pub law: FeedLaw,
    /// Time of the motion from the point before, less that at the job's cutting feed, s.
    pub added_time: f64,
}

impl Arrival {
    fn new(cut: &CutFeed, written: f64) -> Self {
        let CutFeed { programmed, before, added_time } = *cut;
        Self { before, after: written, programmed: programmed.mm_min, law: programmed.law, added_time }
    }

    /// Returns that of two consecutive moves.
    fn joined(self, next: Self) -> Self {
        Self {
            before: self.before.max(next.before),
            after: self.after.max(next.after),
            added_time: self.added_time + next.added_time,
            ..next
        }
    }

    /// Returns whether axes, the control or the other head make the tip slower than the chips
    /// permit.
    pub(crate) fn is_slower_than_programmed(&self) -> bool {
        self.after < self.programmed * (1.0 - SAME_FEED)
    }

    /// Returns whether the control's smallest F makes the tip faster than the chips permit.
    pub(crate) fn is_faster_than_programmed(&self) -> bool {
        self.after > self.programmed * (1.0 + SAME_FEED)
    }
}

/// Relative difference of equal feeds: rounding.
const SAME_FEED: f64 = 1e-6;

impl ChipPoint {
    /// Returns the point of a chart.
    pub(crate) fn charted(&self) -> ChartPoint {
        let Self { way, area, is_known, .. } = *self;
        ChartPoint { way, area, is_known, removal_rates: self.removal_rates() }
    }

    /// Returns the removal rates at the job's cutting feed and as written, cm³/min.
    pub(crate) fn removal_rates(&self) -> Option<[f64; 2]> {
        self.arrival.map(|a| [a.before, a.after].map(|feed| self.area * feed / CM3))
    }
}

impl ChipPoint {
    /// Returns the largest chip thicknesses at the job's cutting feed and as written, mm, with so
    /// many teeth per minute.
    pub(crate) fn thicknesses(&self, teeth_per_minute: f64) -> Option<[f64; 2]> {
        self.arrival.map(|a| [a.before, a.after].map(|feed| self.thickness * feed / teeth_per_minute))
    }
}

/// Returns the points of every operation; `lines` are those of all cutting moves in program order,
/// none if unknown.
pub(crate) fn chip_points(operations: &[PlannedOperation<'_>], timed: &Timed, lines: &[u32]) -> Vec<Vec<ChipPoint>> {
    let lines = lines.iter().copied().map(Some).chain(std::iter::repeat(None));
    let cuts = timed.cut_feeds.iter().zip(&timed.tip_feeds);
    let mut arrivals = cuts.map(|(cut, &written)| Arrival::new(cut, written)).zip(lines);
    let of_operation = |o: &PlannedOperation<'_>| {
        let mut points = Vec::new();
        let mut way = 0.0;
        for (piece, along) in o.moves.pieces.iter().zip(&o.along) {
            points_of(piece, along, &mut way, &mut arrivals, &mut points);
        }
        points
    };
    operations.iter().map(of_operation).collect()
}

/// Appends the points of a piece; takes the arrivals of its moves.
fn points_of(
    piece: &PieceMoves,
    along: &[PointEngagement],
    way: &mut f64,
    arrivals: &mut impl Iterator<Item = (Arrival, Option<u32>)>,
    points: &mut Vec<ChipPoint>,
) {
    let PieceMoves { piece, moves, .. } = piece;
    // Every cut but the first has a move that ends there.
    let n_moves = moves.iter().filter(|m| m.kind == MoveKind::Cut).count();
    let mut arrivals = arrivals.take(n_moves);
    let mut of_points = along.iter().filter(|a| a.is_point);
    let (mut arrival, mut line, mut point): (Option<Arrival>, Option<u32>, usize) = (None, None, 0);
    for (k, cut) in piece.cuts.iter().enumerate() {
        if k > 0 {
            *way += (cut.cc.position - piece.cuts[k - 1].cc.position).norm();
            let next = arrivals.next();
            line = next.and_then(|(_, line)| line);
            let next = next.map(|(next, _)| next);
            arrival = arrival.map(|a| next.map_or(a, |next| a.joined(next))).or(next);
        }
        let Some(a) = (!cut.inserted).then(|| of_points.next()).flatten() else { continue };
        let (copy, pass) = (piece.copy, piece.pass);
        let Chip { area, thickness, is_known, .. } = a.chip;
        let (way, arrival) = (*way, arrival.take());
        points.push(ChipPoint { copy, pass, point, way, area, thickness, is_known, line, arrival });
        point += 1;
    }
    arrivals.for_each(drop);
}

/// Returns the report on the points of an operation.
pub(crate) fn chips_report(operation: &OperationFile, teeth: u32, points: &[ChipPoint], by_law: bool) -> ChipsReport {
    let per_minute = teeth_per_minute(&operation.feeds, teeth);
    let thicknesses = points.iter().filter_map(|p| p.thicknesses(per_minute));
    let largest = thicknesses.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    let arrivals = || points.iter().filter_map(|p| p.arrival);
    let rate = |k: usize| points.iter().filter_map(move |p| Some(p.removal_rates()?[k]));
    let with = |is: &dyn Fn(&Arrival) -> bool| arrivals().filter(|a| is(a)).count();
    ChipsReport {
        operation: operation.name.clone(),
        by_chips: depends_on_chips(&operation.feeds),
        points: points.len(),
        full_stock_points: points.iter().filter(|p| !p.is_known).count(),
        air_points: points.iter().filter(|p| p.area == 0.0).count(),
        area_mm2: SpreadReport::of(points.iter().map(|p| p.area)),
        removal_rate_before_cm3_min: SpreadReport::of(rate(0)),
        removal_rate_after_cm3_min: SpreadReport::of(rate(1)),
        largest_chip_thickness_mm: largest,
        feeds_set_by: FeedsSetByReport {
            removal_rate: with(&|a| a.law == FeedLaw::RemovalRate),
            chip_thickness: with(&|a| a.law == FeedLaw::ChipThickness),
            air: with(&|a| a.law == FeedLaw::Air),
            machine: with(&Arrival::is_slower_than_programmed),
            smallest_f: with(&Arrival::is_faster_than_programmed),
        },
        by_law,
        added_time_s: arrivals().map(|a| a.added_time).sum(),
    }
}
