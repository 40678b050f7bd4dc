//! Ridges and chips along the passes of an operation, also for its moves.

use std::collections::BTreeSet;

use facemill_cl_data::{Aabb, CcPoint, Posture};
use facemill_cutter_location::cusp::Ridge;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::neighbours::{Beside, CutPass, Neighbour, NeighbourReach, Neighbours, OwnPlace};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{FeedsFile, OperationFile};
use facemill_job::frames::places;
use facemill_job::load::job::{Job, Setup};
use facemill_job::stages::{CHIPS, Stages};
use facemill_job::validate::tip_feed::depends_on_chips;
use facemill_surface_model::Surface;
use facemill_tool_model::{Cusp, Cutter, Outline};
use facemill_tool_path::chips::{Chip, ChipSite, ROUGH_THICKNESS, StockTop, THICKNESS_ACCURACY};
use facemill_tool_path::moves::{MoveKind, PieceMoves};
use facemill_tool_path::segments::PassSegment;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::passes::left_gaps::LeftGaps;

/// Ridge and chip at a cut of a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointEngagement {
    /// Index of the cut at the time of computation.
    pub cut: usize,
    /// Whether it is a point of the path.
    pub is_point: bool,
    /// Ridge toward the pass beside that was cut before; the higher one if there is one on each
    /// side. `None` of passes over islands.
    pub ridge: Option<Ridge>,
    /// Chip at the cut.
    pub chip: Chip,
}

/// Returns ridges and chips of every piece at every point of the path, and at both ends of pieces
/// that begin or end between two. Records the chip in moves in the stock.
///
/// # Errors
/// If the stages are cancelled, or an area cannot be computed.
pub(crate) fn engagement_of_passes(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    pieces: &mut [PieceMoves],
    stages: &dyn Stages,
) -> Result<Vec<Vec<PointEngagement>>, Failure> {
    let all: Vec<&PassSegment> = pieces.iter().map(|p| &p.piece).collect();
    let reach = neighbour_reach(job.tool.cutter(), operation);
    let twins = Twins::of(&all, operation, setup, reach.far);
    let surroundings = EngagementContext::new(job, setup, operation, &all, reach);
    let monitor = stages.start(CHIPS, all.len());
    let found: Vec<Option<Vec<PointEngagement>>> = (0..all.len())
        .into_par_iter()
        .map(|k| {
            monitor.checkpoint()?;
            let found = if twins.of[k].is_some() { None } else { Some(surroundings.along(k)?) };
            monitor.advance(1);
            Ok(found)
        })
        .collect::<Result<_, Failure>>()?;
    let along: Vec<Vec<PointEngagement>> = (0..all.len())
        .map(|k| found[k].as_ref().or_else(|| found[twins.of[k]?].as_ref()).cloned().unwrap_or_default())
        .collect();
    let of_approaches: Vec<Vec<(usize, Chip)>> = (0..pieces.len())
        .into_par_iter()
        .map(|k| surroundings.approach_chips(k, &pieces[k], &along[k]))
        .collect::<Result<_, Failure>>()?;
    for ((piece, along), of_approach) in pieces.iter_mut().zip(&along).zip(of_approaches) {
        give_chips(piece, along);
        of_approach.into_iter().for_each(|(k, chip)| piece.moves[k].chip = Some(chip));
    }
    Ok(along)
}

/// Returns the indices of the cuts of a piece that are points of the path, and of both ends.
pub(crate) fn stations(piece: &PassSegment) -> Vec<usize> {
    let last = piece.cuts.len().saturating_sub(1);
    (0..piece.cuts.len()).filter(|&k| k == 0 || k == last || !piece.cuts[k].inserted).collect()
}

fn cut_point(piece: &PassSegment, cut: usize) -> CutPoint {
    let cut = &piece.cuts[cut];
    CutPoint { cc: cut.cc, posture: cut.pose.posture }
}

/// Surroundings of the pieces of an operation.
struct EngagementContext<'s> {
    job: &'s Job,
    setup: &'s Setup<'s>,
    feeds: &'s FeedsFile,
    pieces: &'s [&'s PassSegment],
    /// The pieces of each place of the pattern, in cutting order.
    places: Vec<Neighbours>,
    /// Number of each piece in its place.
    numbers: Vec<usize>,
    gaps: LeftGaps,
}

impl<'s> EngagementContext<'s> {
    fn new(
        job: &'s Job,
        setup: &'s Setup<'s>,
        operation: &'s OperationFile,
        pieces: &'s [&'s PassSegment],
        reach: NeighbourReach,
    ) -> Self {
        let (feeds, gaps) = (&operation.feeds, LeftGaps::of(setup, operation));
        let n_places = pieces.iter().map(|p| p.copy as usize + 1).max().unwrap_or(0);
        let mut passes: Vec<Vec<CutPass>> = vec![Vec::new(); n_places];
        let mut numbers = Vec::with_capacity(pieces.len());
        for piece in pieces {
            let of_place = &mut passes[piece.copy as usize];
            numbers.push(of_place.len());
            let points = stations(piece).into_iter().map(|k| cut_point(piece, k)).collect();
            of_place.push(CutPass { points, uncut_left: piece.uncut_left });
        }
        let places = passes.into_iter().map(|of_place| Neighbours::new(of_place, reach)).collect();
        Self { job, setup, feeds, pieces, places, numbers, gaps }
    }

    /// Returns ridges and chips of a piece.
    fn along(&self, index: usize) -> Result<Vec<PointEngagement>, Failure> {
        let piece = self.pieces[index];
        let (neighbours, pass) = (&self.places[piece.copy as usize], self.numbers[index]);
        let (stations, own) = (stations(piece), &neighbours.passes()[pass].points);
        let beside: Vec<Beside> = (0..own.len()).map(|point| neighbours.of(OwnPlace { pass, point })).collect();
        let known: Vec<Option<f64>> = beside.iter().map(Beside::curvature).collect();
        let curvatures: Vec<f64> = carried_on(known).into_iter().map(Option::unwrap_or_default).collect();
        let cutter = self.job.tool.cutter();
        let measured = |k: usize| {
            let cut_beside: Vec<Ridge> =
                beside[k].earlier.iter().flatten().map(|n| Ridge::toward(cutter, &own[k], n)).collect();
            let site = self.site(&own[k].cc, &own[k], &cut_beside, curvatures[k]);
            let area = area(&site)?;
            Ok((area, if area > 0.0 { site.thickness(self.thickness_accuracy()) } else { 0.0 }))
        };
        let chips = (0..own.len()).map(measured).collect::<Result<Vec<(f64, f64)>, Failure>>()?;
        (0..own.len())
            .map(|k| {
                let (area, thickness) = chips[k];
                let is_air = area == 0.0 && self.feeds.air_mm_min.is_some() && self.is_clear(k, own, &chips)?;
                // On the side that is already cut, a near pass that ends beside the point has left
                // unknown material.
                let side = usize::from(!piece.uncut_left);
                let at = OwnPlace { pass, point: k };
                let is_known =
                    beside[k].earlier[side].is_some() || !neighbours.is_near_earlier(at, 2.0 * cutter.radius());
                let chip = Chip { area, thickness, is_known, is_air };
                let cut = stations[k];
                let ends_in_gap = |n: &&Neighbour| self.gaps.is_between(piece.copy as usize, &own[k], n);
                let ridges = beside[k].before().filter(|n| !ends_in_gap(n));
                let ridges = ridges.map(|n| Ridge::toward(cutter, &own[k], n));
                Ok(PointEngagement { cut, is_point: !piece.cuts[cut].inserted, ridge: ridges.reduce(higher), chip })
            })
            .collect()
    }

    /// Returns the chips of the moves of a piece's entry and exit in a solid stock, each with the
    /// index of its move: the largest of the sections that the cutting part of the rim is in on the
    /// move, across the feed at the end of the pass. None where the stock is a layer, which is as
    /// thick beyond the end of the pass, or feeds do not depend on chips.
    ///
    /// The passes beside it go on beyond the end of the pass as they are there, and lift as it
    /// does.
    fn approach_chips(
        &self,
        index: usize,
        piece: &PieceMoves,
        along: &[PointEngagement],
    ) -> Result<Vec<(usize, Chip)>, Failure> {
        let (Some(first), Some(last)) = (along.first(), along.last()) else { return Ok(Vec::new()) };
        if self.setup.stock_solid.is_none() || !depends_on_chips(self.feeds) {
            return Ok(Vec::new());
        }
        let mut chips = Vec::new();
        let n_entry = piece.moves.iter().take_while(|m| m.kind != MoveKind::Cut).count();
        for (of_end, moves) in [(first, 0..n_entry), (last, n_entry..piece.moves.len())] {
            let engaged: Vec<usize> = moves.filter(|&k| piece.moves[k].kind == MoveKind::Engage).collect();
            if !engaged.is_empty() {
                chips.extend(self.end_chips(index, piece, along, of_end, &engaged)?);
            }
        }
        Ok(chips)
    }

    /// Returns the chips of `engaged`, the moves in the stock at one end of a piece, in their
    /// order.
    fn end_chips(
        &self,
        index: usize,
        piece: &PieceMoves,
        along: &[PointEngagement],
        of_end: &PointEngagement,
        engaged: &[usize],
    ) -> Result<Vec<(usize, Chip)>, Failure> {
        let (neighbours, pass) = (&self.places[piece.piece.copy as usize], self.numbers[index]);
        let own = &neighbours.passes()[pass].points;
        let point = if of_end.cut == along[0].cut { 0 } else { own.len() - 1 };
        let (end, beside) = (&own[point], neighbours.of(OwnPlace { pass, point }));
        let cutter = self.job.tool.cutter();
        let ridges: Vec<Ridge> = beside.earlier.iter().flatten().map(|n| Ridge::toward(cutter, end, n)).collect();
        let end_tip = piece.piece.cuts[of_end.cut].pose.cl.tip;
        let moved = |k: usize| piece.moves[k].cl.tip - end_tip;
        let way = |k: usize| moved(k).dot(&end.cc.feed);
        let chip_at = |k: usize| -> Result<(f64, Chip), Failure> {
            let position = end.cc.position + moved(k);
            let site = self.site(&CcPoint { position, ..end.cc }, end, &ridges, 0.0);
            let area = area(&site)?;
            let thickness = if area > 0.0 { site.thickness(self.thickness_accuracy()) } else { 0.0 };
            Ok((way(k), Chip { area, thickness, is_known: of_end.chip.is_known, is_air: false }))
        };
        // Sections, with their place along the feed: of the pass, and at the poses.
        let of_pass = own.iter().zip(along).map(|(p, a)| ((p.cc.position - end.cc.position).dot(&end.cc.feed), a.chip));
        let mut sections: Vec<(f64, Chip)> = of_pass.collect();
        let poses: BTreeSet<usize> = engaged.iter().flat_map(|&k| [k.saturating_sub(1), k]).collect();
        for k in poses {
            sections.push(chip_at(k)?);
        }
        let [back, front] = cutting_reach(end.posture, cutter);
        let chips = engaged.iter().map(|&k| {
            let (from, to) = (way(k.saturating_sub(1)), way(k));
            let (low, high) = (from.min(to) + back, from.max(to) + front);
            // With the sections beyond both ends of the way: between two the larger one counts.
            let ways = || sections.iter().map(|(way, _)| *way);
            let below = ways().filter(|way| *way <= low).fold(f64::NEG_INFINITY, f64::max);
            let above = ways().filter(|way| *way >= high).fold(f64::INFINITY, f64::min);
            let met = sections.iter().filter(|(way, _)| (below..=above).contains(way)).map(|(_, chip)| *chip);
            (k, met.reduce(Chip::larger).unwrap_or(of_end.chip))
        });
        Ok(chips.collect())
    }

    fn thickness_accuracy(&self) -> f64 {
        if self.feeds.chip_thickness.is_some() { THICKNESS_ACCURACY } else { ROUGH_THICKNESS }
    }

    /// Returns the section across the feed through `at`, with the cutter as at a point.
    fn site(&self, at: &CcPoint, point: &CutPoint, beside: &[Ridge], curvature: f64) -> ChipSite {
        let outline = Outline::new(self.job.tool.cutter(), point.posture);
        let top = stock_over(self.setup, at, curvature, &outline);
        ChipSite::new(outline, beside, top)
    }

    /// Returns whether no stock is cut as far along the feed as the cutter reaches from a point.
    /// Beyond the ends of a pass, only a solid stock is known.
    fn is_clear(&self, k: usize, own: &[CutPoint], chips: &[(f64, f64)]) -> Result<bool, Failure> {
        let reach = 2.0 * self.job.tool.cutter().radius();
        let point = &own[k];
        if self.setup.stock_solid.is_some() {
            for step in -CLEAR_STEPS..=CLEAR_STEPS {
                let along = reach * f64::from(step) / f64::from(CLEAR_STEPS);
                let position = point.cc.position + point.cc.feed.into_inner() * along;
                if area(&self.site(&CcPoint { position, ..point.cc }, point, &[], 0.0))? > 0.0 {
                    return Ok(false);
                }
            }
            return Ok(true);
        }
        let away = |j: usize| (own[j].cc.position - point.cc.position).norm();
        let is_in_the_middle = [0, own.len() - 1].into_iter().all(|end| away(end) >= reach);
        Ok(is_in_the_middle && (0..own.len()).all(|j| chips[j].0 == 0.0 || away(j) > reach))
    }
}

/// Returns the higher ridge: an uncut strip exceeds all others.
fn higher(a: Ridge, b: Ridge) -> Ridge {
    let is_higher = match (a.cusp, b.cusp) {
        (Cusp::Height(a), Cusp::Height(b)) => b > a,
        (Cusp::Height(_), Cusp::Uncut) => true,
        (Cusp::Uncut, _) => false,
    };
    if is_higher { b } else { a }
}

/// Returns how far behind and in front of the contact the cutter cuts along the feed, at most, mm:
/// with all of its front, and behind its axis with the lower half of its rim, where it has one. The
/// contact is the rim's lowest point, and `rotate` its direction from the axis to the feed.
fn cutting_reach(posture: Posture, cutter: &Cutter) -> [f64; 2] {
    let ((sin, cos), (tilt_sin, tilt_cos)) = (posture.rotate.sin_cos(), posture.tilt.sin_cos());
    // From the middle of the rim to the contact, from the tip to it, and how far the flute leans.
    let of_rim = cutter.rim_radius() * tilt_cos * cos;
    let of_tip = of_rim + cutter.corner_radius() * tilt_sin * cos;
    let lean = cutter.flute_length() * tilt_sin * cos;
    let back = if cos >= 0.0 && cutter.rim_radius() > 0.0 { -sin.abs() } else { -1.0 };
    [back * cutter.radius() - of_tip.max(of_rim) + lean.min(0.0), cutter.radius() - of_rim + lean.max(0.0)]
}

/// Returns the section of a chip, mm².
pub(crate) fn area(site: &ChipSite) -> Result<f64, Failure> {
    site.area().map_err(|e| Failure::Internal(format!("chip area: {e}")))
}

/// Number of sections in front of a point, and behind it, that must be empty for a point in air.
const CLEAR_STEPS: i32 = 8;

/// Pieces in other places of a pattern that are cut as one of the first place is, with the same
/// neighbours.
struct Twins {
    /// Index of the piece in the first place, for each piece.
    of: Vec<Option<usize>>,
}

/// Largest distance of a point from its pattern position, mm: rounding of the turn.
const SAME_PLACE: f64 = 1e-6;

impl Twins {
    /// Returns the twins; none for a solid stock, which need not be symmetric.
    fn of(pieces: &[&PassSegment], operation: &OperationFile, setup: &Setup<'_>, reach: f64) -> Self {
        let none = Self { of: vec![None; pieces.len()] };
        if setup.stock_solid.is_some() {
            return none;
        }
        let places = places(operation.pattern.as_ref());
        let alike = |k: usize| -> Option<usize> {
            let piece = pieces[k];
            let place = places.get(piece.copy as usize).filter(|_| piece.copy > 0)?;
            pieces
                .iter()
                .position(|first| first.copy == 0 && first.pass == piece.pass && are_twins(first, piece, place))
        };
        let of: Vec<Option<usize>> = (0..pieces.len()).into_par_iter().map(alike).collect();
        let boxes: Vec<Aabb> = pieces
            .iter()
            .map(|p| Aabb::of_points(p.cuts.iter().map(|c| &c.cc.position)).dilated(0.5 * reach))
            .collect();
        let (of, boxes) = (&of, &boxes);
        let near = |k: usize| {
            let is_near = move |j: &usize| pieces[*j].copy == pieces[k].copy && boxes[*j].intersects(&boxes[k]);
            (0..pieces.len()).filter(is_near)
        };
        // Neighbours of one must be neighbours of the other, in the same order.
        let are_surrounded_alike = |k: usize, first: usize| {
            let twin = |i: usize| (0..pieces.len()).find(|&j| pieces[j].copy == pieces[k].copy && of[j] == Some(i));
            near(k).all(|j| of[j].is_some_and(|i| (i < first) == (j < k)))
                && near(first).all(|i| twin(i).is_some_and(|j| (i < first) == (j < k)))
        };
        let kept = |k: usize| of[k].filter(|&first| are_surrounded_alike(k, first));
        Self { of: (0..pieces.len()).into_par_iter().map(kept).collect() }
    }
}

/// Returns whether all cuts of two pieces are the same apart from their positions.
fn are_twins(first: &PassSegment, copy: &PassSegment, place: &Isometry3<f64>) -> bool {
    let same_posture = |a: Posture, b: Posture| a == b;
    let near = |a: &Point3<f64>, b: &Point3<f64>| (place * a - b).norm() <= SAME_PLACE;
    first.cuts.len() == copy.cuts.len()
        && first.cuts.iter().zip(&copy.cuts).all(|(a, b)| {
            a.inserted == b.inserted
                && same_posture(a.pose.posture, b.pose.posture)
                && near(&a.cc.position, &b.cc.position)
        })
}

/// Records in every move in the stock the largest chip on it: between two points the larger of the
/// chips there, on entries and exits the chip at the end of the pass.
fn give_chips(piece: &mut PieceMoves, along: &[PointEngagement]) {
    let (Some(first), Some(last)) = (along.first(), along.last()) else { return };
    let last_cut = piece.piece.cuts.len().saturating_sub(1);
    let mut cut = 0;
    let mut chip = first.chip;
    for m in &mut piece.moves {
        match m.kind {
            MoveKind::Cut => {
                cut += 1;
                let to = along.partition_point(|a| a.cut < cut);
                let ends = [along.get(to.saturating_sub(1)), along.get(to)];
                chip = ends.into_iter().flatten().map(|a| a.chip).reduce(Chip::larger).unwrap_or(chip);
                m.chip = Some(chip);
            }
            // The exit has only the chip of the last cut.
            MoveKind::Engage => m.chip = Some(if cut == last_cut { last.chip } else { first.chip }),
            // Turns get theirs when both passes have them.
            MoveKind::Approach | MoveKind::Rapid | MoveKind::Turn => {}
        }
    }
}

/// Number of places across the cutter at which the height of a solid stock is sampled; narrower
/// features may be missed.
pub(crate) const SOLID_PLACES: usize = 49;

/// Returns the stock over a point in which a cutter with this outline may be, for a surface with
/// this curvature across the feed.
pub(crate) fn stock_over(setup: &Setup<'_>, cc: &CcPoint, curvature: f64, outline: &Outline) -> StockTop {
    match &setup.stock_solid {
        None => StockTop::Layer { thickness: setup.stock_above(cc), curvature },
        Some(solid) => solid_over(solid, cc, outline),
    }
}

/// Returns the top of a solid over a point, as high as the cutter with this outline is: what lies
/// above it, such as the next blade, is not cut.
fn solid_over(solid: &Surface, cc: &CcPoint, outline: &Outline) -> StockTop {
    let extent = [outline.extent().0, outline.extent().1];
    let place = |k: usize| extent[0] + (extent[1] - extent[0]) * (k as f64 / (SOLID_PLACES - 1) as f64);
    let highest = highest_of(outline);
    let found: Vec<f64> = (0..SOLID_PLACES)
        .map(|k| {
            let from = cc.position + cc.left().into_inner() * place(k);
            let hits = solid.ray_all(&from, &cc.normal, f64::INFINITY);
            let below = hits.partition_point(|hit| hit.point.distance <= highest);
            // Solids that the line is in there: it leaves them farther out.
            let around: i32 = hits[below..].iter().map(|hit| if hit.from_outside { -1 } else { 1 }).sum();
            // A line through a common side of two facets meets both.
            if around > 0 || hits.get(below).is_some_and(|hit| !hit.from_outside) {
                return highest;
            }
            // The last exit from it: empty space below counts as stock.
            let out = hits[..below].iter().rfind(|hit| !hit.from_outside);
            out.map_or(0.0, |hit| hit.point.distance)
        })
        .collect();
    let beside = |k: usize| found[k.saturating_sub(1)..(k + 2).min(found.len())].iter().copied();
    let heights = (0..found.len()).map(|k| beside(k).fold(0.0, f64::max)).collect();
    StockTop::Solid { extent, heights }
}

/// Returns a height over the contact above which nothing of the cutter is, mm: the highest place of
/// its upper rim, and of a sphere around its lower end.
fn highest_of(outline: &Outline) -> f64 {
    let (cutter, tip, up) = (outline.cutter(), outline.tip().y, outline.axis().z);
    let rim = cutter.radius() * (1.0 - up * up).max(0.0).sqrt();
    let upper = tip + cutter.flute_length() * up + rim;
    upper.max(tip + cutter.radius().hypot(cutter.corner_radius()))
}

/// Fills places that the neighbour does not reach from the nearest point before, else from the
/// first one after.
pub(crate) fn carried_on<T: Copy>(mut along: Vec<Option<T>>) -> Vec<Option<T>> {
    let mut last = along.iter().copied().find_map(|s| s);
    for known in &mut along {
        *known = known.or(last);
        last = *known;
    }
    along
}

/// Returns the search range for the neighbouring pass: as far as the cutter could reach lying flat,
/// and beyond, to detect a strip that stays uncut.
pub fn neighbour_reach(cutter: &Cutter, operation: &OperationFile) -> NeighbourReach {
    let step_over = operation.tolerances.max_step_over_mm;
    NeighbourReach { far: 3.0 * step_over.max(cutter.radius()), opposed: step_over }
}

#[cfg(test)]
#[path = "../../tests/unit/passes/engagement.rs"]
mod tests;
