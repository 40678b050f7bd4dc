//! From planned passes to pieces that are cut without lifting, in every place of the pattern.

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass};
use facemill_cutter_location::{
    FeasiblePose, Hints, Infeasible, Outcome, PoseTest, SearchCurve, SearchSettings, search,
};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use rayon::prelude::*;

use crate::job_file::PatternFile;
use crate::load::direction;

/// A CC point with its pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    /// Where on the part.
    pub cc: CcPoint,
    /// The tested pose.
    pub pose: FeasiblePose,
}

/// Neighbouring points of a pass that are all feasible.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// Place in the pattern, from 0.
    pub copy: u32,
    /// Pass of the path, from 0.
    pub pass: usize,
    /// The points in cutting order; at least two.
    pub cuts: Vec<Cut>,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
}

/// A CC point that no pose was found for.
#[derive(Clone, Debug)]
pub(crate) struct LeftOut {
    /// Where.
    pub place: Point3<f64>,
    /// Why.
    pub reason: String,
}

/// A pass of the path as laid.
#[derive(Clone, Debug)]
pub(crate) struct LaidTask {
    /// CC points.
    pub pass: Pass<CcPoint>,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
    /// Search curve.
    pub curve: SearchCurve,
}

/// Splits passes where points are infeasible. A single feasible point between infeasible ones is no pass: it is left out.
pub(crate) fn split(
    test: &PoseTest<'_>,
    tasks: &[LaidTask],
    outcomes: &[Pass<Outcome>],
    copy: u32,
    left_out: &mut Vec<LeftOut>,
) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (pass, (task, outcome)) in tasks.iter().zip(outcomes).enumerate() {
        let mut cuts: Vec<Cut> = Vec::new();
        let mut close = |cuts: &mut Vec<Cut>, left_out: &mut Vec<LeftOut>| {
            let cuts = std::mem::take(cuts);
            if cuts.len() >= 2 {
                pieces.push(Piece { copy, pass, cuts, uncut_left: task.uncut_left });
            } else {
                left_out.extend(cuts.iter().map(|c| LeftOut {
                    place: c.cc.position,
                    reason: "alone between points that are infeasible".to_owned(),
                }));
            }
        };
        for (cc, result) in task.pass.points.iter().zip(&outcome.points) {
            match result {
                Ok(pose) => cuts.push(Cut { cc: *cc, pose: *pose }),
                Err(why) => {
                    close(&mut cuts, left_out);
                    left_out.push(LeftOut { place: cc.position, reason: test.describe(why) });
                }
            }
        }
        close(&mut cuts, left_out);
    }
    pieces
}

/// Pose of each place of a pattern relative to the first, the first included.
pub(crate) fn places(pattern: Option<&PatternFile>) -> Vec<Isometry3<f64>> {
    let Some(p) = pattern else { return vec![Isometry3::identity()] };
    let origin = Translation3::from(p.origin_mm);
    (0..p.copies)
        .map(|k| {
            let angle = (p.index_angle_deg * f64::from(k)).to_radians();
            origin * UnitQuaternion::from_axis_angle(&direction(&p.axis), angle) * origin.inverse()
        })
        .collect()
}

/// The outcomes of the first place, each tested again in another place of the pattern, and searched anew where its posture
/// is not feasible there.
///
/// # Errors
/// When the monitor cancels.
pub(crate) fn copy_outcomes(
    test: &PoseTest<'_>,
    tasks: &[LaidTask],
    outcomes: &[Pass<Outcome>],
    place: &Isometry3<f64>,
    settings: &SearchSettings,
    monitor: &dyn Monitor,
) -> Result<(Vec<LaidTask>, Vec<Pass<Outcome>>), Cancelled> {
    let copied: Vec<LaidTask> =
        tasks.iter().map(|t| LaidTask { pass: t.pass.map(|cc| cc.transformed(place)), ..t.clone() }).collect();
    let results = copied
        .par_iter()
        .zip(outcomes)
        .map(|(task, outcome)| {
            let mut hints = Hints::default();
            let mut near = None;
            let mut points = Vec::with_capacity(outcome.points.len());
            for (cc, first) in task.pass.points.iter().zip(&outcome.points) {
                monitor.checkpoint()?;
                let again: Result<FeasiblePose, Infeasible> = match first {
                    Ok(pose) => test.try_posture(cc, pose.posture, near.as_ref(), &mut hints).or_else(|_| {
                        search(test, cc, &task.curve, settings, 0.0, near.as_ref(), &mut hints).map(|f| f.pose)
                    }),
                    Err(_) => search(test, cc, &task.curve, settings, 0.0, near.as_ref(), &mut hints).map(|f| f.pose),
                };
                if let Ok(pose) = &again {
                    near = Some(pose.axes);
                }
                points.push(again);
                monitor.advance(1);
            }
            Ok(Pass::new(points))
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;
    Ok((copied, results))
}
