//! Ridges and chips along the passes of an operation, and what of them its moves have to know.

use facemill_cl_data::{CcPoint, Posture};
use facemill_cutter_location::cusp::{CutPoint, Ridge, ridges, strips};
use facemill_tool_model::{Cutter, Outline};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::chips::{Chip, ChipSite, ROUGH_THICKNESS, StockTop, THICKNESS_ACCURACY};
use crate::job_file::{FeedsFile, OperationFile};
use crate::load::{Job, Setup};
use crate::moves::{MoveKind, PieceMoves};
use crate::operation::{carried_on, neighbour_reach};
use crate::pieces::{Piece, places};
use crate::{Failure, Stages};

/// What is known at a cut of a piece besides its pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Along {
    /// Index of the cut when this was found.
    pub cut: usize,
    /// Whether it is a point of the path.
    pub is_point: bool,
    /// Toward the pass before.
    pub ridge: Option<Ridge>,
    /// What the cutter takes there.
    pub chip: Chip,
}

/// Ridges and chips of every piece at every point of the path, and at both ends of pieces that begin or end between
/// two. Moves in the stock learn what the cutter takes on them.
///
/// # Errors
/// When the stages are cancelled, or an area cannot be computed.
pub(crate) fn along_passes(
    job: &Job,
    setup: &Setup<'_>,
    operation: &OperationFile,
    pieces: &mut [PieceMoves],
    stages: &dyn Stages,
) -> Result<Vec<Vec<Along>>, Failure> {
    let all: Vec<&Piece> = pieces.iter().map(|p| &p.piece).collect();
    let twins = Twins::of(&all, operation, setup);
    let surroundings = Surroundings {
        job,
        setup,
        feeds: &operation.feeds,
        pieces: &all,
        reach: neighbour_reach(job.tool.cutter(), operation),
    };
    let monitor = stages.start("cusps and chips", all.len());
    let found: Vec<Option<Vec<Along>>> = (0..all.len())
        .into_par_iter()
        .map(|k| {
            monitor.checkpoint()?;
            let found = if twins.of[k].is_some() { None } else { Some(surroundings.along(k)?) };
            monitor.advance(1);
            Ok(found)
        })
        .collect::<Result<_, Failure>>()?;
    let along: Vec<Vec<Along>> = (0..all.len())
        .map(|k| found[k].as_ref().or_else(|| found[twins.of[k]?].as_ref()).cloned().unwrap_or_default())
        .collect();
    pieces.iter_mut().zip(&along).for_each(|(piece, along)| give_chips(piece, along));
    Ok(along)
}

/// Indices of the cuts of a piece that are points of the path, and of both ends.
fn stations(piece: &Piece) -> Vec<usize> {
    let last = piece.cuts.len().saturating_sub(1);
    (0..piece.cuts.len()).filter(|&k| k == 0 || k == last || !piece.cuts[k].inserted).collect()
}

fn cut_point(piece: &Piece, cut: usize) -> CutPoint {
    let cut = &piece.cuts[cut];
    CutPoint { cc: cut.cc, posture: cut.pose.posture }
}

/// Points of the path.
fn points(piece: &Piece) -> Vec<CutPoint> {
    (0..piece.cuts.len()).filter(|&k| !piece.cuts[k].inserted).map(|k| cut_point(piece, k)).collect()
}

/// What lies around the pieces of an operation.
struct Surroundings<'s> {
    job: &'s Job,
    setup: &'s Setup<'s>,
    feeds: &'s FeedsFile,
    pieces: &'s [&'s Piece],
    reach: f64,
}

impl Surroundings<'_> {
    /// The pieces of another pass in the same place.
    fn of_pass(&self, copy: u32, pass: Option<usize>) -> impl Iterator<Item = (usize, &Piece)> {
        self.pieces.iter().copied().enumerate().filter(move |(_, p)| p.copy == copy && Some(p.pass) == pass)
    }

    /// Ridges and chips of a piece.
    fn along(&self, index: usize) -> Result<Vec<Along>, Failure> {
        let (piece, cutter) = (self.pieces[index], self.job.tool.cutter());
        let stations = stations(piece);
        let own: Vec<CutPoint> = stations.iter().map(|&k| cut_point(piece, k)).collect();
        let of_before = self.of_pass(piece.copy, piece.pass.checked_sub(1));
        // With two heads, what a run has left of the pass before may be cut later.
        let (earlier, later): (Vec<_>, Vec<_>) = of_before.partition(|(k, _)| *k < index);
        let [earlier, later] = [earlier, later].map(|of| of.into_iter().map(|(_, p)| points(p)).collect::<Vec<_>>());
        let mut ridges = vec![None; own.len()];
        self.nearest_ridges(cutter, &own, &earlier, &mut ridges);
        let cut_beside = ridges.clone();
        self.nearest_ridges(cutter, &own, &later, &mut ridges);
        // Beyond the ends of the pass before, how much it has left is not known; the first pass has none before it.
        let is_first = earlier.is_empty() && later.is_empty();
        let curvatures = self.curvatures(piece, &own, &ridges);
        let measured = |k: usize| {
            let site = self.site(&own[k].cc, &own[k], cut_beside[k].as_ref(), curvatures[k]);
            let area = area(&site)?;
            Ok((area, if area > 0.0 { site.thickness(self.thickness_accuracy()) } else { 0.0 }))
        };
        let chips = (0..own.len()).map(measured).collect::<Result<Vec<(f64, f64)>, Failure>>()?;
        (0..own.len())
            .map(|k| {
                let (area, thickness) = chips[k];
                let is_air = area == 0.0 && self.feeds.air_mm_min.is_some() && self.is_clear(k, &own, &chips)?;
                let is_known = is_first || cut_beside[k].is_some();
                let chip = Chip { area, thickness, is_known, is_air };
                let cut = stations[k];
                Ok(Along { cut, is_point: !piece.cuts[cut].inserted, ridge: ridges[k], chip })
            })
            .collect()
    }

    fn thickness_accuracy(&self) -> f64 {
        if self.feeds.chip_thickness.is_some() { THICKNESS_ACCURACY } else { ROUGH_THICKNESS }
    }

    /// The section across the feed through `at`, with the cutter as at a point.
    fn site(&self, at: &CcPoint, point: &CutPoint, beside: Option<&Ridge>, curvature: f64) -> ChipSite {
        let outline = Outline::new(self.job.tool.cutter(), point.posture);
        let top = StockTop::over(self.setup, at, curvature, outline.extent());
        ChipSite::new(outline, beside, top)
    }

    /// Whether there is nothing to cut as far along the feed as the cutter reaches from a point. Beyond the ends of a
    /// pass that is known of a solid stock alone.
    fn is_clear(&self, k: usize, own: &[CutPoint], chips: &[(f64, f64)]) -> Result<bool, Failure> {
        let reach = 2.0 * self.job.tool.cutter().radius();
        let point = &own[k];
        if self.setup.stock_solid.is_some() {
            for step in -CLEAR_STEPS..=CLEAR_STEPS {
                let along = reach * f64::from(step) / f64::from(CLEAR_STEPS);
                let position = point.cc.position + point.cc.feed.into_inner() * along;
                if area(&self.site(&CcPoint { position, ..point.cc }, point, None, 0.0))? > 0.0 {
                    return Ok(false);
                }
            }
            return Ok(true);
        }
        let away = |j: usize| (own[j].cc.position - point.cc.position).norm();
        let is_in_the_middle = [0, own.len() - 1].into_iter().all(|end| away(end) >= reach);
        Ok(is_in_the_middle && (0..own.len()).all(|j| chips[j].0 == 0.0 || away(j) > reach))
    }

    /// Of all pieces of the pass before the nearest ridge wins: a trimmed pass is several pieces.
    fn nearest_ridges(&self, cutter: &Cutter, own: &[CutPoint], before: &[Vec<CutPoint>], best: &mut [Option<Ridge>]) {
        for before in before {
            for (best, found) in best.iter_mut().zip(ridges(cutter, own, before, self.reach)) {
                let nearer = match (&best, &found) {
                    (Some(b), Some(f)) => f.step_over < b.step_over,
                    (None, Some(_)) => true,
                    _ => false,
                };
                if nearer {
                    *best = found;
                }
            }
        }
    }

    /// Curvature of the surface across the feed: that of the ridge, else of the strip to the pass behind, else as at
    /// the nearest point before with either.
    fn curvatures(&self, piece: &Piece, own: &[CutPoint], ridges: &[Option<Ridge>]) -> Vec<f64> {
        let mut found: Vec<Option<f64>> = ridges.iter().map(|r| r.map(|r| r.curvature)).collect();
        if found.iter().any(Option::is_none) {
            let own: Vec<CcPoint> = own.iter().map(|p| p.cc).collect();
            for (_, behind) in self.of_pass(piece.copy, Some(piece.pass + 1)) {
                let behind: Vec<CcPoint> = points(behind).iter().map(|p| p.cc).collect();
                for (found, strip) in found.iter_mut().zip(strips(&own, &behind, self.reach)) {
                    *found = found.or(strip.map(|s| s.curvature));
                }
            }
        }
        carried_on(found).iter().map(|curvature| curvature.unwrap_or(0.0)).collect()
    }
}

fn area(site: &ChipSite) -> Result<f64, Failure> {
    site.area().map_err(|e| Failure::Internal(format!("chip area: {e}")))
}

/// Sections in front of a point, and as many behind it, that have to be empty for it to be in the air.
const CLEAR_STEPS: i32 = 8;

/// Pieces in other places of a pattern that are cut as one of the first place is, and so are those beside them.
struct Twins {
    /// Index of the piece in the first place, of each piece.
    of: Vec<Option<usize>>,
}

/// How far a point may be from where the pattern puts it, mm: rounding of the turn.
const SAME_PLACE: f64 = 1e-6;

impl Twins {
    /// A solid stock need not look alike from everywhere: then there are none.
    fn of(pieces: &[&Piece], operation: &OperationFile, setup: &Setup<'_>) -> Self {
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
        let whole_pass_has = |copy: u32, pass: usize| {
            let n = |copy| pieces.iter().filter(|p| p.copy == copy && p.pass == pass).count();
            let mut own = pieces.iter().zip(&of).filter(|(p, _)| p.copy == copy && p.pass == pass);
            own.all(|(_, twin)| twin.is_some()) && n(copy) == n(0)
        };
        let beside = |k: usize| {
            let (copy, pass) = (pieces[k].copy, pieces[k].pass);
            pass.checked_sub(1).is_none_or(|before| whole_pass_has(copy, before)) && whole_pass_has(copy, pass + 1)
        };
        let kept = (0..pieces.len()).map(|k| of[k].filter(|_| beside(k))).collect();
        Self { of: kept }
    }
}

/// Whether all cuts of two pieces are the same but for their places.
fn are_twins(first: &Piece, copy: &Piece, place: &Isometry3<f64>) -> bool {
    let same_posture = |a: Posture, b: Posture| a == b;
    let near = |a: &Point3<f64>, b: &Point3<f64>| (place * a - b).norm() <= SAME_PLACE;
    first.cuts.len() == copy.cuts.len()
        && first.cuts.iter().zip(&copy.cuts).all(|(a, b)| {
            a.inserted == b.inserted
                && same_posture(a.pose.posture, b.pose.posture)
                && near(&a.cc.position, &b.cc.position)
        })
}

/// Tells every move in the stock what the cutter takes on it, at most: on the way between two points the larger of what
/// it takes there, on entries and exits what it takes at the end of the pass.
pub(crate) fn give_chips(piece: &mut PieceMoves, along: &[Along]) {
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
            // The exit has only what the last cut has.
            MoveKind::Engage => m.chip = Some(if cut == last_cut { last.chip } else { first.chip }),
            MoveKind::Approach | MoveKind::Rapid => {}
        }
    }
}
