//! From planned passes to pieces that are cut without lifting, in every place of the pattern.

pub mod pole;
pub mod steep_cuts;

use std::f64::consts::TAU;

use facemill_cl_data::{Cancelled, CcPoint, Monitor, Pass, Posture};
use facemill_cutter_location::{
    Configuration, FeasiblePose, Hints, Infeasible, Outcome, PassSettings, PoseTest, SearchCurve, SearchSettings,
    search,
};
use facemill_inverse_kinematics::AxisValues;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::linearity::{Linearity, turned_near};
use crate::segments::pole::Tests;

/// A CC point with its pose.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Point on the part.
    pub cc: CcPoint,
    /// The tested pose.
    pub pose: FeasiblePose,
    /// Whether it was inserted between two points of the path to keep the control near the way.
    pub inserted: bool,
}

/// Neighbouring points of a pass that are all feasible.
#[derive(Clone, Debug)]
pub struct PassSegment {
    /// Place in the pattern, from 0.
    pub copy: u32,
    /// Pass of the path, from 0.
    pub pass: usize,
    /// The points in cutting order; at least two.
    pub cuts: Vec<Cut>,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
    /// Search curve of the pass.
    pub curve: SearchCurve,
    /// Number of a part of a piece that was divided where a rotary axis turns back, from 0; `None`
    /// for a whole piece. The first cut of every later part is in the one before, too, and counts
    /// as inserted.
    pub part: Option<u32>,
}

impl PassSegment {
    /// Returns whether a cut is a place that runs of two heads count: a point of the path, or the
    /// start or end of a part, which the tool has to reach as well.
    pub fn is_place(&self, cut: usize) -> bool {
        let at_end = self.part.is_some() && (cut == 0 || cut + 1 == self.cuts.len());
        at_end || self.cuts.get(cut).is_some_and(|c| !c.inserted)
    }

    /// Iterates over the places, in order.
    pub fn places(&self) -> impl Iterator<Item = &Cut> {
        self.cuts.iter().enumerate().filter(|(k, _)| self.is_place(*k)).map(|(_, cut)| cut)
    }

    /// Returns the number of the path's points in it.
    pub fn points(&self) -> usize {
        self.cuts.iter().filter(|c| !c.inserted).count()
    }
}

/// A CC point without a pose.
#[derive(Clone, Debug)]
pub struct LeftOut {
    /// Position.
    pub place: Point3<f64>,
    /// Reason.
    pub reason: String,
    /// The point and its search curve, where no posture of it is feasible.
    pub searched: Option<(CcPoint, SearchCurve)>,
}

impl LeftOut {
    /// Explains in a reason that blames stock what counts as stock during planning.
    pub fn explain_stock(&mut self) {
        if self.reason.ends_with(" stock") {
            self.reason
                .push_str(" (a solid of stock stays whole while planning; stock as an offset of the part does not)");
        }
    }
}

/// A pass of the path as laid.
#[derive(Clone, Debug)]
pub struct LaidTask {
    /// CC points.
    pub pass: Pass<CcPoint>,
    /// Whether the uncut stock lies to the left of the feed.
    pub uncut_left: bool,
    /// Search curve.
    pub curve: SearchCurve,
    /// Posture of every point, where the path prescribes them; else empty.
    pub given: Vec<Posture>,
}

/// Splits passes where points are infeasible, and where the machine changes to its other branch. A
/// single feasible point between infeasible ones is left out.
pub fn split(
    test: &PoseTest<'_>,
    tasks: &[LaidTask],
    outcomes: &[Pass<Outcome>],
    copy: u32,
    left_out: &mut Vec<LeftOut>,
) -> Vec<PassSegment> {
    let mut pieces = Vec::new();
    for (pass, (task, outcome)) in tasks.iter().zip(outcomes).enumerate() {
        let mut cuts: Vec<Cut> = Vec::new();
        let mut close = |cuts: &mut Vec<Cut>, left_out: &mut Vec<LeftOut>| {
            let cuts = std::mem::take(cuts);
            if cuts.len() >= 2 {
                let (uncut_left, curve) = (task.uncut_left, task.curve);
                pieces.push(PassSegment { copy, pass, cuts, uncut_left, curve, part: None });
            } else {
                left_out.extend(cuts.iter().map(|c| LeftOut {
                    place: c.cc.position,
                    reason: "alone between points that are infeasible".to_owned(),
                    searched: None,
                }));
            }
        };
        for (cc, result) in task.pass.points.iter().zip(&outcome.points) {
            match result {
                Ok(pose) => {
                    let branch = |c: &Cut| c.pose.configuration.branch;
                    if cuts.last().is_some_and(|c| branch(c) != pose.configuration.branch) {
                        close(&mut cuts, left_out);
                    }
                    cuts.push(Cut { cc: *cc, pose: *pose, inserted: false });
                }
                Err(why) => {
                    close(&mut cuts, left_out);
                    let searched = Some((*cc, task.curve));
                    left_out.push(LeftOut { place: cc.position, reason: test.describe(why), searched });
                }
            }
        }
        close(&mut cuts, left_out);
    }
    pieces
}

/// Returns pieces with tested poses inserted between points where the control would deviate too
/// far.
///
/// An inserted pose has the CC point and the posture halfway between two, seated where it gouges,
/// or else (with `fallback`) the next feasible posture of the search curve, because points found
/// with the smallest feasible posture are at the border of the feasible set. Away from the pole
/// where that is possible. Where no pose is feasible, or the control would deviate however close
/// the poses are, the piece ends and another begins. A point that is then alone is left out.
///
/// # Errors
/// When the monitor cancels.
pub fn filled(
    tests: &Tests<'_>,
    linearity: &Linearity,
    fallback: Option<&SearchSettings>,
    pieces: Vec<PassSegment>,
    left_out: &mut Vec<LeftOut>,
    monitor: &dyn Monitor,
) -> Result<Vec<PassSegment>, Cancelled> {
    let filled: Vec<Vec<PassSegment>> = pieces
        .into_par_iter()
        .map(|piece| {
            monitor.checkpoint()?;
            Ok(fill(tests, linearity, fallback, piece))
        })
        .collect::<Result<_, Cancelled>>()?;
    let (kept, alone): (Vec<PassSegment>, Vec<PassSegment>) =
        filled.into_iter().flatten().partition(|p| p.cuts.len() >= 2);
    let reason = "alone between points that no blocks lead to without lifting";
    left_out.extend(alone.iter().flat_map(|p| &p.cuts).map(|cut| LeftOut {
        place: cut.cc.position,
        reason: reason.to_owned(),
        searched: None,
    }));
    Ok(kept)
}

fn fill(
    tests: &Tests<'_>,
    linearity: &Linearity,
    fallback: Option<&SearchSettings>,
    piece: PassSegment,
) -> Vec<PassSegment> {
    let PassSegment { copy, pass, uncut_left, curve, cuts, part } = piece;
    let [away, plain] = [tests.choosing, tests.plain].map(|test| Filler::new(test, fallback, curve));
    let mut hints = Hints::default();
    let mut between = |from: &Cut, to: &Cut| {
        let around = fallback.is_some() && tests.leads_by_pole(&from.pose.cl, &to.pose.cl);
        let away = if around { away.between(linearity, from, to, MAX_HALVINGS, &mut hints) } else { None };
        away.or_else(|| plain.between(linearity, from, to, MAX_HALVINGS, &mut hints))
    };
    let mut runs: Vec<Vec<Cut>> = vec![Vec::new()];
    for cut in cuts {
        let run = runs.last_mut().expect("there is always one");
        match run.last().map(|from| between(from, &cut)) {
            Some(None) => runs.push(vec![cut]),
            way => {
                run.extend(way.flatten().into_iter().flatten());
                run.push(cut);
            }
        }
    }
    runs.into_iter().map(|cuts| PassSegment { copy, pass, uncut_left, curve, cuts, part }).collect()
}

/// Two cuts, one after the other.
pub struct PosePair<'c> {
    /// First one.
    pub from: &'c Cut,
    /// Second one.
    pub to: &'c Cut,
}

/// Inserts cuts between two.
pub struct Filler<'t, 'a> {
    test: &'t PoseTest<'a>,
    fallback: Option<&'t SearchSettings>,
    curve: SearchCurve,
}

impl<'t, 'a> Filler<'t, 'a> {
    /// Fills with tested poses on a search curve, and with searched ones where `fallback` has
    /// settings.
    pub fn new(test: &'t PoseTest<'a>, fallback: Option<&'t SearchSettings>, curve: SearchCurve) -> Self {
        Self { test, fallback, curve }
    }

    /// Returns cuts strictly between two, close enough for the control; `None` where one of them is
    /// not feasible, or where their postures are so far apart that halving does not bring them
    /// together.
    fn between(
        &self,
        linearity: &Linearity,
        from: &Cut,
        to: &Cut,
        halvings: u32,
        hints: &mut Hints,
    ) -> Option<Vec<Cut>> {
        let start = from.pose.configuration;
        let end = self.driven(&start, to)?;
        if !linearity.judge(self.test, &start.axes, &end).1 {
            return Some(Vec::new());
        }
        if halvings == 0 {
            return None;
        }
        self.halved(linearity, &PosePair { from, to }, halvings - 1, hints)
    }

    /// Returns the cut halfway between two, and the cuts needed on both sides of it; `None` as for
    /// [`Filler::between`].
    fn halved(&self, linearity: &Linearity, pair: &PosePair<'_>, halvings: u32, hints: &mut Hints) -> Option<Vec<Cut>> {
        let middle = self.middle(pair, hints)?;
        let mut cuts = self.between(linearity, pair.from, &middle, halvings, hints)?;
        cuts.push(middle);
        cuts.extend(self.between(linearity, &middle, pair.to, halvings, hints)?);
        Some(cuts)
    }

    /// Returns the cut halfway between two and all cuts that it needs; `None` where one of them is
    /// not feasible or the control would deviate however close they are.
    pub fn refined(&self, linearity: &Linearity, pair: &PosePair<'_>, hints: &mut Hints) -> Option<Vec<Cut>> {
        self.halved(linearity, pair, MAX_HALVINGS, hints)
    }

    /// Returns axis values at a cut as driven from a position: at the turns nearest to it, within
    /// the limits or not, because windings are chosen later. `None` where they are on another
    /// branch.
    fn driven(&self, start: &Configuration, to: &Cut) -> Option<AxisValues> {
        let axes = turned_near(self.test, &to.pose.configuration.axes, &start.axes);
        let reached = self.test.configuration_like(&to.pose.cl, &Configuration { axes, ..*start }).ok()?;
        Some(turned_near(self.test, &reached.axes, &start.axes))
    }

    /// Returns the tested cut halfway between two, on the branch of the first: the posture between
    /// theirs, or else the next feasible one of the search curve.
    pub fn middle(&self, PosePair { from, to }: &PosePair<'_>, hints: &mut Hints) -> Option<Cut> {
        let near = from.pose.configuration;
        let (cc, posture) = middle(from, to)?;
        let pose = self.test.try_posture(&cc, posture, Some(&near), hints).or_else(|why| {
            let settings = self.fallback.ok_or(why)?;
            let from_u = self.u_of(posture);
            search(self.test, &cc, &self.curve, settings, from_u, Some(&near), hints).map(|found| found.pose)
        });
        let pose = pose.ok().filter(|pose| pose.configuration.branch == near.branch)?;
        Some(Cut { cc, pose, inserted: true })
    }

    /// Returns the parameter of the search curve where it is as large as a posture: by tilt and
    /// rotate together, which grow along it.
    fn u_of(&self, posture: Posture) -> f64 {
        let size = |p: Posture| p.tilt + p.rotate.abs();
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..MAX_BISECTIONS {
            let middle = 0.5 * (low + high);
            if size(self.curve.at(middle)) < size(posture) { low = middle } else { high = middle }
        }
        high
    }
}

/// Bisections on the search curve: enough to exhaust a double.
const MAX_BISECTIONS: u32 = 60;

/// Halvings of the way between two points: 2^10 poses for one mean that the machine is near a
/// singular pose, where more would not help.
const MAX_HALVINGS: u32 = 10;

/// Returns the CC point and posture between two: contact is kept.
fn middle(a: &Cut, b: &Cut) -> Option<(CcPoint, Posture)> {
    let position = nalgebra::center(&a.cc.position, &b.cc.position);
    let cc = CcPoint::new(position, a.cc.normal.lerp(&b.cc.normal, 0.5), a.cc.feed.lerp(&b.cc.feed, 0.5)).ok()?;
    let mean = |p: f64, q: f64| 0.5 * (p + q);
    let (p, q) = (a.pose.posture, b.pose.posture);
    // The shorter way round, for axes that lean back; half a turn goes the way of the numbers.
    let turns = ((q.rotate - p.rotate) / (TAU * (1.0 + 1e-9))).round();
    Some((cc, Posture { tilt: mean(p.tilt, q.tilt), rotate: mean(p.rotate, q.rotate - turns * TAU) }))
}

/// Tests the outcomes of the first place again in another place of the pattern, and (where the mode
/// allows it) searches anew where a posture is not feasible there.
///
/// # Errors
/// When the monitor cancels.
pub fn copy_outcomes(
    test: &PoseTest<'_>,
    tasks: &[LaidTask],
    outcomes: &[Pass<Outcome>],
    place: &Isometry3<f64>,
    settings: &PassSettings,
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
                let searched = |why: Infeasible, hints: &mut Hints| {
                    let settings = settings.fallback().ok_or(why)?;
                    search(test, cc, &task.curve, settings, 0.0, near.as_ref(), hints).map(|f| f.pose)
                };
                let again: Result<FeasiblePose, Infeasible> = match first {
                    Ok(pose) => test
                        .try_posture(cc, pose.posture, near.as_ref(), &mut hints)
                        .or_else(|why| searched(why, &mut hints)),
                    Err(why) => searched(*why, &mut hints),
                };
                if let Ok(pose) = &again {
                    near = Some(pose.configuration);
                }
                points.push(again);
                monitor.advance(1);
            }
            Ok(Pass::new(points))
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;
    Ok((copied, results))
}
