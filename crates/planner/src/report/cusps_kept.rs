//! Cusps along the passes of an operation: whether the limit is kept, the measures taken for it,
//! and reasons if it is not.

use std::collections::BTreeMap;

use facemill_job::failure::Failure;
use facemill_job::format::job_file::{OperationFile, PathFile};
use facemill_job::format::report::Report;
use facemill_job::format::report::cusps::{CuspReasonReport, CuspsKeptReport};
use facemill_job::frames::places;
use facemill_job::load::job::{Job, Setup};
use facemill_tool_model::Cusp;
use facemill_verification::remaining::open_regions::OpenCusps;
use facemill_verification::remaining::{LeftPlace, NearSurface, Remaining};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::passes::extra_passes::ExtraPasses;
use crate::passes::operation::PlannedOperation;

/// Compares the cusps of a planned operation with its limit.
pub(crate) fn cusps_kept(planned: &PlannedOperation<'_>) -> CuspsKeptReport {
    let PlannedOperation { operation, extra, .. } = planned;
    let mut reasons: Vec<CuspReasonReport> = Vec::new();
    for beyond in points_beyond(planned) {
        let found = CuspReasonReport {
            reason: reason(operation, extra, &beyond.in_first, beyond.step_over),
            points: 1,
            cusp_mm: beyond.height,
            place_mm: beyond.place.into(),
            step_over_mm: beyond.step_over,
        };
        match reasons.iter_mut().find(|r| r.reason == found.reason) {
            Some(same) => same.take(found),
            None => reasons.push(found),
        }
    }
    reasons.sort_by_key(|r| std::cmp::Reverse(r.points));
    CuspsKeptReport {
        operation: operation.name.clone(),
        moved_passes: extra.moved,
        passes_between: extra.between + extra.over,
        points_beyond: reasons.iter().map(|r| r.points).sum(),
        kept_by_text: false,
        reasons,
        width_rounds: planned.width_rounds.clone(),
    }
}

/// A point with a higher ridge than permitted toward a pass cut before.
struct PointBeyond {
    place: Point3<f64>,
    /// Place of the pattern, by its index.
    copy: usize,
    /// The point in the first place of the pattern.
    in_first: Point3<f64>,
    /// Direction across the feed there.
    across: Unit<Vector3<f64>>,
    step_over: f64,
    /// Predicted height, mm; `None` where the strip stays uncut.
    height: Option<f64>,
}

fn points_beyond(planned: &PlannedOperation<'_>) -> Vec<PointBeyond> {
    let operation = planned.operation;
    let places = places(operation.pattern.as_ref());
    let mut found = Vec::new();
    for (piece, along) in planned.moves.pieces.iter().zip(&planned.along) {
        for at in along.iter().filter(|a| a.is_point) {
            let Some(ridge) = at.ridge.filter(|r| !r.cusp.is_within(operation.tolerances.cusp_mm)) else { continue };
            let (cc, copy) = (&piece.piece.cuts[at.cut].cc, piece.piece.copy as usize);
            let back = places.get(copy).map_or_else(Isometry3::identity, |pose: &Isometry3<f64>| pose.inverse());
            let height = match ridge.cusp {
                Cusp::Height(height) => Some(height),
                Cusp::Uncut => None,
            };
            found.push(PointBeyond {
                place: cc.position,
                copy,
                in_first: back * cc.position,
                across: back * cc.left(),
                step_over: ridge.step_over,
                height,
            });
        }
    }
    found
}

impl PointBeyond {
    /// Returns places across the strips on both sides of the point. They are so close that the
    /// crest of a ridge is higher than the highest of them by at most 1/256 of its height: a ridge
    /// is a parabola, and one of them is within 1/16 of its half width. `allowance` is the height
    /// of the point above the drive surface, mm.
    fn across_strips(&self, allowance: f64) -> impl Iterator<Item = NearSurface> {
        let at = move |k: i32| NearSurface {
            copy: self.copy,
            point: self.in_first
                + self.across.into_inner() * (f64::from(k) * self.step_over / f64::from(PLACES_ACROSS)),
            // The surface bends away from the tangent.
            reach: self.step_over + allowance,
        };
        (-PLACES_ACROSS..=PLACES_ACROSS).filter(|k| *k != 0).map(at)
    }
}

/// Places that are measured across the strip on each side of a point.
const PLACES_ACROSS: i32 = 16;

/// Most points whose strips are measured: 100,000 places take a second of processor time.
const MOST_BEYOND: usize = 4000;

/// Marks predicted cusps as kept where the text is measured to leave no more than the permitted
/// ones beside each point. Returns the others by the operations' places in the measured list, for
/// later programs.
///
/// # Errors
/// As [`Remaining::left_near`].
pub(crate) fn settle_cusps(
    report: &mut Report,
    operations: &[PlannedOperation<'_>],
    remaining: &Remaining,
    (job, setup): (&Job, &Setup<'_>),
) -> Result<BTreeMap<usize, OpenCusps>, Failure> {
    let mut open = BTreeMap::new();
    for (planned, cusps) in operations.iter().zip(&mut report.cusps).filter(|(_, cusps)| cusps.points_beyond > 0) {
        let mut own = (0..).zip(&remaining.report.operations).filter(|(_, o)| o.operation == cusps.operation);
        // Which of two operations of one name was measured is not known.
        let (Some((k, _)), None) = (own.next(), own.next()) else { continue };
        let beyond = points_beyond(planned);
        if beyond.len() > MOST_BEYOND {
            let (cusp, is_on_region) = (planned.operation.tolerances.cusp_mm, is_all_on_region(planned.operation));
            open.insert(k, OpenCusps::all_over(beyond.len(), cusp, &remaining.places[k], is_on_region));
            continue;
        }
        let strips: Vec<NearSurface> = beyond.iter().flat_map(|p| p.across_strips(setup.drive_allowance)).collect();
        let across = remaining.left_near((job, setup), k, &strips)?;
        let cusp = planned.operation.tolerances.cusp_mm;
        let text = TextHeights::new(&remaining.places[k], planned.operation, setup.drive_allowance);
        let of_points = beyond.iter().zip(across.chunks(2 * PLACES_ACROSS as usize));
        cusps.kept_by_text = of_points.into_iter().all(|(point, strips)| {
            let strips: Vec<LeftPlace> = strips.iter().flatten().copied().collect();
            text.keep(point, &strips, cusp)
        });
        if !cusps.kept_by_text {
            open.insert(k, text.open_cusps(&beyond, &across, cusp));
        }
    }
    if report.cusps.iter().any(|c| c.kept_by_text) {
        report.worst.cusp_exceeded = report.cusps.iter().any(|c| c.points_beyond > 0 && !c.kept_by_text);
    }
    Ok(open)
}

/// Heights that the text leaves all over an operation's region.
struct TextHeights<'p> {
    places: &'p [LeftPlace],
    /// The highest of them, where all passes are known to be on the region, mm.
    highest: Option<f64>,
    /// Height of the passes above the drive surface, mm.
    allowance: f64,
}

impl<'p> TextHeights<'p> {
    fn new(places: &'p [LeftPlace], operation: &OperationFile, allowance: f64) -> Self {
        let highest = places.iter().map(|place| place.height).reduce(f64::max);
        let highest = highest.filter(|_| is_all_on_region(operation));
        Self { places, highest, allowance }
    }

    /// Returns whether the text is at most as high as the cusp beside a point: at the places across
    /// its `strips`, and at all places within the step-over, because those across follow the
    /// tangent and may miss what lies around a sharp edge. Where there are none of the one or the
    /// other, all of the region has to be as low.
    fn keep(&self, point: &PointBeyond, strips: &[LeftPlace], cusp: f64) -> bool {
        let is_low = |place: &LeftPlace| place.height <= cusp;
        if !strips.iter().all(is_low) {
            return false;
        }
        if self.highest.is_some_and(|highest| highest <= cusp) {
            return true;
        }
        let mut near = self.places.iter().filter(|place| self.is_near(place, point)).peekable();
        !strips.is_empty() && near.peek().is_some() && near.all(is_low)
    }

    /// Returns whether a place is within the step-over of a point.
    fn is_near(&self, place: &LeftPlace, point: &PointBeyond) -> bool {
        let on_pass = place.position + place.normal.into_inner() * self.allowance;
        (on_pass - point.in_first).norm_squared() <= point.step_over * point.step_over
    }

    /// Returns the cusps beside points for later programs: with the places across the `strips` of
    /// each point and the region's within the step-over, or with all of the region where a point
    /// has none of the one or the other.
    fn open_cusps(&self, points: &[PointBeyond], strips: &[Option<LeftPlace>], cusp: f64) -> OpenCusps {
        let mut chunks = strips.chunks(2 * PLACES_ACROSS as usize);
        let mut has_places = chunks.all(|strips| strips.iter().any(Option::is_some));
        has_places &= points.iter().all(|point| self.places.iter().any(|place| self.is_near(place, point)));
        let is_beside = |place: &LeftPlace| points.iter().any(|point| self.is_near(place, point));
        let beside = self.places.iter().filter(|place| !has_places || is_beside(place));
        let on = strips.iter().flatten().chain(beside).map(|place| place.left).collect();
        OpenCusps::beside(points.len(), cusp, on, has_places || self.highest.is_some())
    }
}

/// Returns whether all passes of an operation are on its region: those of files may leave it.
fn is_all_on_region(operation: &OperationFile) -> bool {
    matches!(operation.path, PathFile::Strategy(_))
}

/// Returns the reason why there is no pass between: the refusal nearest to the place within the
/// strip, if there was one.
fn reason(operation: &OperationFile, extra: &ExtraPasses, place: &Point3<f64>, step_over: f64) -> String {
    if matches!(operation.path, PathFile::File(_) | PathFile::Cl(_)) {
        return "passes of a file are cut unchanged: put them closer".to_owned();
    }
    let near = extra.refused.iter().map(|(at, why)| ((at - place).norm(), why));
    let nearest = near.filter(|(d, _)| *d <= step_over).min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((_, why)) => format!("no pass fits between: {why}"),
        None => "the postures there leave more, and no pass was inserted".to_owned(),
    }
}

#[cfg(test)]
#[path = "../../tests/unit/report/cusps_kept.rs"]
mod tests;
