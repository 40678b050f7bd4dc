//! Motions of a program for replay: positions of all axes block by block, times, the tip's path.

use std::collections::BTreeMap;

use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use facemill_feedrate::{MotionLimit, rapid_time};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine, Motion};
use facemill_job::setup::scene::Scene;
use facemill_nc_program::dialect::ControlMotion;
use facemill_nc_program::read::{Compensation, MotionKind};
use facemill_nc_program::{Dialect, FeedMode, ReadProgram};
use facemill_verification::text_times::{ALL_LINES, TimedText, motions};
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader, legs};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

/// Kind of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// At rapid rate.
    Rapid,
    /// At a feed, between positions that the program has named.
    Cut,
    /// At a feed, but an arc, a cycle, or from a position that the program has not named: shown as
    /// a straight motion of the axes to its end.
    Other,
}

/// One straight motion of the axes.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Line of the program, from 1.
    pub line: u32,
    /// Kind.
    pub kind: SegmentKind,
    /// Motion between its ends.
    pub law: BlockLaw,
    /// Start.
    pub from: AxisValues,
    /// End.
    pub to: AxisValues,
    /// Time, s: by the law of motion if the machine's limits give one, else at constant speed.
    pub time: f64,
    /// Whether that time is known; else it is one to be shown for.
    pub is_timed: bool,
    /// F in force, in mm/min; `None` in rapids, in inverse time and without any.
    pub feed: Option<f64>,
    /// F in inverse time (G93), in 1/min; `None` elsewhere.
    pub inverse_feed: Option<f64>,
    /// Limiting factor by the law of motion.
    pub limit: Option<MotionLimit>,
    /// Whether words are the tip's.
    pub is_rtcp: bool,
}

/// Motions of a program.
#[derive(Clone, Debug)]
pub struct ProgramMotion {
    /// Where the axes stand at the start.
    pub start: AxisValues,
    /// In order.
    pub segments: Vec<Segment>,
    /// Whether times are within velocity, acceleration and jerk of every axis.
    pub by_law: bool,
    /// Line of the first motion of unknown path, with its reason.
    pub not_followed: Option<(u32, String)>,
}

/// Time of a motion whose feed is not known, s: it is shown, not timed.
const UNTIMED: f64 = 0.1;

/// Returns the motions of a program; `views` are the machine as each head sees it, with the length
/// of its tool.
pub(crate) fn program_motion(
    scene: &Scene<'_>,
    views: &[(&Machine, f64)],
    program: &ReadProgram,
    text: &[u8],
    dialect: Dialect,
) -> ProgramMotion {
    let at = scene.motion_context();
    let mut all = segments(at, program);
    let control = control_motion(scene, dialect);
    let written =
        TimedText { text, dialect, control: &control, rapids: program.rtcp_rapids, block_lines: &[], lines: ALL_LINES };
    let Ok(timed) = motions(at, &written, &BTreeMap::new()) else { return all };
    let followed = |s: &&mut Segment| s.kind != SegmentKind::Other;
    let n_followed = all.segments.iter().filter(|s| s.kind != SegmentKind::Other).count();
    if timed.not_followed.is_some() || timed.meant.len() != n_followed {
        return all;
    }
    let Ok(laws) = timed.laws(views, at.machine, &control) else { return all };
    let times = laws.iter().flat_map(|law| {
        let limits = law.limits.iter().copied().chain(std::iter::repeat(None));
        law.times.iter().copied().zip(limits)
    });
    for (segment, (time, limit)) in all.segments.iter_mut().filter(followed).zip(times) {
        (segment.time, segment.limit) = (time, limit.filter(|_| segment.kind == SegmentKind::Cut));
        segment.is_timed = true;
    }
    all.by_law = true;
    all
}

/// Returns how a control runs its blocks; a control other than the job's has its own dialect file.
fn control_motion(scene: &Scene<'_>, dialect: Dialect) -> ControlMotion {
    let post = &scene.job.post;
    if post.dialect() == dialect { post.rules().control_motion.clone() } else { dialect.file().control_motion }
}

/// Returns the motions of a program with times at constant speed.
fn segments(at: MotionContext<'_>, program: &ReadProgram) -> ProgramMotion {
    let machine = at.machine;
    let mut all = ProgramMotion { start: machine.home(), segments: Vec::new(), by_law: false, not_followed: None };
    let mut reader = MotionReader::new(at, program.dialect, program.rtcp_rapids);
    for block in &program.blocks {
        let motion = reader.block(block);
        let read = block.motion.as_ref();
        let is_rtcp = read.is_some_and(|m| matches!(m.compensation, Compensation::Rtcp(_)));
        let written = read.and_then(|m| m.feed.map(|f| (f, m.feed_unit)));
        let is_inverse = written.is_some_and(|(f, _)| f.mode == FeedMode::G93);
        let here = all.segments.last().map_or(all.start, |s| s.to);
        let mut add = |kind: SegmentKind, law: BlockLaw, [from, to]: [AxisValues; 2], time: Option<f64>| {
            let at_feed = written.filter(|_| kind != SegmentKind::Rapid);
            let feed = at_feed.filter(|_| !is_inverse).map(|(f, unit)| f.value * unit);
            let inverse_feed = at_feed.filter(|_| is_inverse).map(|(f, _)| f.value);
            let (limit, is_timed, time) = (None, time.is_some(), time.unwrap_or(UNTIMED));
            all.segments.push(Segment {
                line: block.line,
                kind,
                law,
                from,
                to,
                time,
                is_timed,
                feed,
                inverse_feed,
                limit,
                is_rtcp,
            });
        };
        let unknown = |why: String| (block.line, why);
        match motion {
            Ok(AxisMotion::None) => {}
            Ok(AxisMotion::Rapid { positions, law }) => {
                for [from, to] in legs(&positions) {
                    let time = rapid_time(machine, law, from, to, at.tool_length);
                    add(SegmentKind::Rapid, law, [*from, *to], Some(time));
                }
            }
            Ok(AxisMotion::Cut(cut)) => {
                let law = cut_law(machine, is_rtcp);
                let time = cut.time.filter(|t| t.is_finite()).or(cut.is_free().then_some(0.0));
                add(SegmentKind::Cut, law, [cut.from, cut.to], time);
            }
            Ok(AxisMotion::Other(Some(to))) => {
                let is_rapid = read.is_some_and(|m| m.kind.is_rapid());
                let law = BlockLaw::Cutting(CuttingLaw::AxesLinear);
                let from = here;
                add(if is_rapid { SegmentKind::Rapid } else { SegmentKind::Other }, law, [from, to], None);
                let arc = read.is_some_and(|m| !matches!(m.kind, MotionKind::Linear | MotionKind::Rapid));
                let why = if arc {
                    "arcs and cycles are shown as straight motions"
                } else {
                    "it starts where the program does not say"
                };
                all.not_followed.get_or_insert_with(|| unknown(why.to_owned()));
            }
            Ok(AxisMotion::Other(None)) => {
                all.not_followed.get_or_insert_with(|| unknown("the position of an axis is not known".to_owned()));
            }
            Err(why) => {
                reader.forget();
                all.not_followed.get_or_insert_with(|| unknown(why));
            }
        }
    }
    all
}

/// Returns the law of a cut: without RTCP all axes go together.
fn cut_law(machine: &Machine, is_rtcp: bool) -> BlockLaw {
    BlockLaw::Cutting(match (is_rtcp, machine.motion_law().cutting) {
        (false, _) => CuttingLaw::AxesLinear,
        (true, CuttingLaw::AxesLinear) => CuttingLaw::TipAndRotariesLinear,
        (true, law) => law,
    })
}

/// Returns the code of a law in the page: 0 axes in proportion, 1 each axis at its largest speed, 2
/// tip straight and rotary axes in proportion, 3 tip straight and tool axis turned evenly.
pub(crate) fn law_code(law: BlockLaw) -> i64 {
    match law {
        BlockLaw::Cutting(CuttingLaw::AxesLinear) | BlockLaw::Rapid(RapidLaw::Linear) => 0,
        BlockLaw::Rapid(RapidLaw::PerAxis) => 1,
        BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) => 2,
        BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) => 3,
    }
}

/// Poses of the tool along a motion, workpiece frame, from its start to its end.
pub(crate) struct Poses<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) tool_length: f64,
    pub(crate) work_from_table: Isometry3<f64>,
}

/// Turn of all rotary axes together over which the motion is halved, rad.
const TURN_AT_ONCE: f64 = 1.0;

/// Most halvings of a stretch.
const MAX_HALVINGS: u32 = 8;

impl Poses<'_> {
    /// Returns tip and tool axis at a position of the axes.
    pub(crate) fn at(&self, q: &AxisValues) -> ClPoint {
        self.machine.cl_point(q, self.tool_length).transformed(&self.work_from_table)
    }

    /// Returns poses with their fractions of the time, the last at 1, such that tip and tool axis
    /// are on the way between neighbours within about `bulge` mm and `turn` rad.
    pub(crate) fn along(&self, segment: &Segment, [bulge, turn]: [f64; 2]) -> Vec<(f64, ClPoint)> {
        let end = self.at(&segment.to);
        let Ok(motion) = Motion::new(self.machine, segment.law, &segment.from, &segment.to, self.tool_length) else {
            return vec![(1.0, end)];
        };
        let turns = (0..segment.to.len())
            .filter(|&k| self.machine.axes()[k].kind == AxisKind::Rotary)
            .map(|k| (segment.to[k] - segment.from[k]).abs())
            .sum::<f64>();
        if turns < 1e-9 {
            return vec![(1.0, end)];
        }
        // A whole turn leads back to where it began: halving alone would not see it.
        let n = (turns / TURN_AT_ONCE).ceil().max(1.0) as u32;
        let at = |k: u32| {
            let share = f64::from(k) / f64::from(n);
            if k == n { Some((1.0, end)) } else { motion.at(share).ok().map(|q| (share, self.at(&q))) }
        };
        let (mut poses, mut from) = (Vec::new(), (0.0, self.at(&segment.from)));
        for to in (1..=n).filter_map(at) {
            self.halve(&motion, [from, to], [bulge, turn], 0, &mut poses);
            from = to;
        }
        poses
    }

    fn halve(
        &self,
        motion: &Motion<'_>,
        [from, to]: [(f64, ClPoint); 2],
        limits: [f64; 2],
        depth: u32,
        poses: &mut Vec<(f64, ClPoint)>,
    ) {
        let middle = 0.5 * (from.0 + to.0);
        let pose = motion.at(middle).ok().map(|q| (middle, self.at(&q)));
        let split = pose.filter(|(_, pose)| {
            let chord = Point3::from((from.1.tip.coords + to.1.tip.coords) * 0.5);
            let turned = from.1.axis.angle(&to.1.axis);
            (pose.tip - chord).norm() > limits[0] || turned > limits[1]
        });
        match split.filter(|_| depth < MAX_HALVINGS) {
            Some(at) => {
                self.halve(motion, [from, at], limits, depth + 1, poses);
                self.halve(motion, [at, to], limits, depth + 1, poses);
            }
            None => poses.push(to),
        }
    }
}

/// Path of a tip for the screen: points with the segments that lead to them.
#[derive(Clone, Debug, Default)]
pub(crate) struct TipPath {
    /// First point, then the ends of stretches.
    pub(crate) points: Vec<Point3<f64>>,
    /// Index of the segment that leads to each point; 0 of the first.
    pub(crate) segments: Vec<u32>,
    /// Distance from the tip's path within which points were left out, mm.
    pub(crate) left_out_within: f64,
}

/// Deviation of the shown path from the tip's, mm, and largest turn between two of its points, rad.
pub(crate) const SHOWN_WITHIN: [f64; 2] = [0.2, 0.35];

/// Returns the path of a tip with at most about `most` points: of those in a row that a straight
/// line runs past within a tolerance, the last one stays.
pub(crate) fn tip_path(poses: &Poses<'_>, motion: &ProgramMotion, most: usize) -> TipPath {
    let along: Vec<Vec<Point3<f64>>> = motion
        .segments
        .par_iter()
        .map(|s| poses.along(s, SHOWN_WITHIN).into_iter().map(|(_, pose)| pose.tip).collect())
        .collect();
    let mut path = TipPath { points: vec![poses.at(&motion.start).tip], segments: vec![0], left_out_within: 0.0 };
    for (k, points) in along.iter().enumerate() {
        path.points.extend(points);
        path.segments.resize(path.points.len(), k as u32);
    }
    let mut within = 0.002;
    while path.points.len() > most && within < 1e3 {
        path = path.thinned(within, &motion.segments);
        path.left_out_within += within;
        within *= 2.0;
    }
    path
}

impl TipPath {
    /// Returns the path without points that a line from the last kept one passes within a distance;
    /// points where the kind of motion changes stay.
    fn thinned(&self, within: f64, segments: &[Segment]) -> Self {
        let kind = |k: usize| segments.get(self.segments[k] as usize).map(|s| s.kind);
        let mut kept = Self { points: vec![self.points[0]], segments: vec![0], left_out_within: self.left_out_within };
        let mut since: Vec<Point3<f64>> = Vec::new();
        for k in 1..self.points.len() {
            let last = kept.points[kept.points.len() - 1];
            let fits = |end: &Point3<f64>| since.iter().all(|p| distance_to_line(p, [&last, end]) <= within);
            let next = self.points.get(k + 1);
            let is_straight = next.is_some_and(|next| {
                kind(k) == kind(k + 1)
                    && since.len() < 64
                    && fits(next)
                    && distance_to_line(&self.points[k], [&last, next]) <= within
            });
            if is_straight {
                since.push(self.points[k]);
            } else {
                kept.points.push(self.points[k]);
                kept.segments.push(self.segments[k]);
                since.clear();
            }
        }
        kept
    }
}

fn distance_to_line(p: &Point3<f64>, [a, b]: [&Point3<f64>; 2]) -> f64 {
    let along = b - a;
    let share =
        if along.norm_squared() > 0.0 { ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + along * share)).norm()
}
