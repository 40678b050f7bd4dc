//! Paired pieces as runs of stops that both heads cut at once, and the remainder for each head
//! alone.

use std::collections::BTreeMap;

use facemill_cl_data::{Cancelled, CcPoint, Monitor};
use facemill_cutter_location::{
    Hints, PairBlocked, PairOutcome, PairPose, PairSettings, PairStation, PairTest, PostureRange, plan_pair,
};
use facemill_inverse_kinematics::AxisKind;
use facemill_tool_path::linearity::Linearity;
use facemill_tool_path::segments::PassSegment;

use super::pairing::{PiecePair, Station, between};

/// Both heads at CC points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SyncPoint {
    /// One for each head.
    pub cc: [CcPoint; 2],
    /// Pose of both heads.
    pub pose: PairPose,
    /// Position in each piece: index of a cut, with a fraction between two.
    pub at: [f64; 2],
}

impl SyncPoint {
    /// Returns whether a head is at a point of its path here, and not between two.
    pub(crate) fn is_point(&self, head: usize) -> bool {
        self.at[head].fract() == 0.0
    }
}

/// Consecutive stops without lifting; at least two.
#[derive(Clone, Debug)]
pub(crate) struct PairRun {
    /// Indices of the pieces, one of each operation.
    pub pieces: [usize; 2],
    /// Whether the uncut stock lies to the left of the feed, for each head.
    pub uncut_left: [bool; 2],
    /// Stops in cutting order.
    pub stops: Vec<SyncPoint>,
}

impl PairRun {
    /// Returns the length of each head's path along its CC points, mm.
    pub(crate) fn lengths(&self) -> [f64; 2] {
        let of = |h: usize| self.stops.windows(2).map(|w| (w[1].cc[h].position - w[0].cc[h].position).norm()).sum();
        [of(0), of(1)]
    }

    /// Returns whether it is not worth its entries and exits: both paths are shorter than this, mm.
    pub(crate) fn is_shorter_than(&self, shortest: f64) -> bool {
        self.stops.len() < 2 || self.lengths().iter().all(|l| *l < shortest)
    }
}

/// Causes why stations of pairs are not cut at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Causes {
    by_cause: BTreeMap<String, Cause>,
}

/// Stations with one cause.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    pub stations: usize,
    /// Place of the first head at the first of them.
    pub place: [f64; 3],
    /// Message on the first of them.
    pub first: String,
}

impl Causes {
    /// Adds a station with its cause and message.
    pub(crate) fn add(&mut self, cause: String, first: String, cc: &CcPoint) {
        let place = [cc.position.x, cc.position.y, cc.position.z];
        self.by_cause.entry(cause).or_insert(Cause { stations: 0, place, first }).stations += 1;
    }

    /// Adds other causes.
    pub(crate) fn join(&mut self, more: Self) {
        for (cause, of) in more.by_cause {
            self.by_cause.entry(cause).or_insert(Cause { stations: 0, ..of.clone() }).stations += of.stations;
        }
    }

    /// Returns all causes, the most frequent first.
    pub(crate) fn sorted(self) -> Vec<(String, Cause)> {
        let mut all: Vec<(String, Cause)> = self.by_cause.into_iter().collect();
        all.sort_by_key(|(_, cause)| std::cmp::Reverse(cause.stations));
        all
    }
}

/// Planner of pairs of pieces.
pub(crate) struct RunPlanner<'r, 'a> {
    /// Both heads.
    pub test: PairTest<'r, 'a>,
    /// Permitted postures of each head with the uncut stock to the right of the feed, and to the
    /// left.
    pub ranges: [[PostureRange; 2]; 2],
    /// Settings of the choice among them; its own ranges are those of the first piece.
    pub settings: PairSettings,
    /// Permitted deviation of each head's motion between stops.
    pub linearity: [Linearity; 2],
    /// Pieces of each operation.
    pub pieces: [&'r [PassSegment]; 2],
    /// Shortest run that is worth its entries and exits, mm along the longer of both ways.
    pub shortest: f64,
}

impl RunPlanner<'_, '_> {
    /// Returns the runs of one pair, with the causes why other stations have none.
    ///
    /// # Errors
    /// Returns an error if the monitor cancels.
    pub(crate) fn runs(&self, pair: &PiecePair, monitor: &dyn Monitor) -> Result<(Vec<PairRun>, Causes), Cancelled> {
        let stations: Vec<_> = pair.stations.iter().map(|s| s.pair).collect();
        let uncut_left = std::array::from_fn(|h| self.pieces[h][pair.pieces[h]].uncut_left);
        let ranges = self.ranges(uncut_left);
        let settings = PairSettings { ranges, ..self.settings };
        let outcomes = self.outcomes(pair, &stations, &settings, monitor)?;
        let run = |stops: Vec<SyncPoint>| PairRun { pieces: pair.pieces, uncut_left, stops };
        let mut causes = Causes::default();
        let mut runs: Vec<PairRun> = Vec::new();
        let mut open: Vec<SyncPoint> = Vec::new();
        let mut hints = [Hints::default(), Hints::default()];
        for (station, outcome) in pair.stations.iter().zip(outcomes) {
            monitor.checkpoint()?;
            match self.stop(station, outcome) {
                Ok(stop) => {
                    let way = match open.last() {
                        None => Some(Vec::new()),
                        Some(last) => self.between(&ranges, last, &stop, MAX_HALVINGS, &mut hints),
                    };
                    if let Some(stops) = way {
                        open.extend(stops);
                    } else {
                        let why = self.why_parted(open.last(), &stop);
                        causes.add(why.clone(), why, &station.pair.cc[0]);
                        runs.push(run(std::mem::take(&mut open)));
                    }
                    open.push(stop);
                }
                Err(why) => {
                    causes.add(self.test.cause(&why), self.test.describe(&why), &station.pair.cc[0]);
                    runs.push(run(std::mem::take(&mut open)));
                }
            }
        }
        runs.push(run(open));
        let short = |r: &PairRun| r.is_shorter_than(self.shortest);
        for run in runs.iter().filter(|r| short(r)) {
            for stop in &run.stops {
                let why = "the stretch that both can cut at once is too short".to_owned();
                causes.add(why.clone(), why, &stop.cc[0]);
            }
        }
        runs.retain(|r| !short(r));
        Ok((runs, causes))
    }

    /// Returns the reason why no blocks lead from one stop to another.
    fn why_parted(&self, from: Option<&SyncPoint>, to: &SyncPoint) -> String {
        let shared = self.test.shared;
        let axis = &self.test.tests[0].cell.machine.axes()[shared];
        let way = from.map_or(0.0, |from| to.pose.axes[shared] - from.pose.axes[shared]);
        if axis.kind == AxisKind::Rotary && way.abs() > std::f64::consts::PI {
            format!("{} comes to its limit and turns back", axis.letter)
        } else {
            "no blocks join the stations before and behind without straying".to_owned()
        }
    }

    /// Returns stops to add between two so that the control comes nearer to the planned motion: at
    /// least one in the middle, and no motion between them deviates too far. `None` if there are
    /// none.
    pub(crate) fn refined(
        &self,
        ranges: &[PostureRange; 2],
        from: &SyncPoint,
        to: &SyncPoint,
        hints: &mut [Hints; 2],
    ) -> Option<Vec<SyncPoint>> {
        self.halved(ranges, from, to, MAX_HALVINGS, hints)
    }

    /// Returns a stop in the middle of two, and the stops that each half needs.
    fn halved(
        &self,
        ranges: &[PostureRange; 2],
        from: &SyncPoint,
        to: &SyncPoint,
        halvings: u32,
        hints: &mut [Hints; 2],
    ) -> Option<Vec<SyncPoint>> {
        let middle = self.middle(ranges, from, to, hints)?;
        let mut stops = self.between(ranges, from, &middle, halvings, hints)?;
        stops.push(middle);
        stops.extend(self.between(ranges, &middle, to, halvings, hints)?);
        Some(stops)
    }

    /// Returns the result at the stations with the first head on the branch that it has alone; if
    /// this omits many, on the branch that omits fewest.
    fn outcomes(
        &self,
        pair: &PiecePair,
        stations: &[PairStation],
        settings: &PairSettings,
        monitor: &dyn Monitor,
    ) -> Result<Vec<PairOutcome>, Cancelled> {
        let Some(first) = stations.first() else { return Ok(Vec::new()) };
        let blocked = |found: &[PairOutcome]| found.iter().filter(|f| f.is_err()).count();
        let own = self.pieces[0][pair.pieces[0]].cuts[0].pose.configuration;
        let mut best = plan_pair(&self.test, stations, settings, &own, monitor)?;
        if blocked(&best) as f64 <= MANY * stations.len() as f64 {
            return Ok(best);
        }
        for start in self.test.configurations_over(0, &first.cc[0], &settings.ranges[0]) {
            if start.branch != own.branch {
                let found = plan_pair(&self.test, stations, settings, &start, monitor)?;
                if blocked(&found) < blocked(&best) {
                    best = found;
                }
            }
        }
        Ok(best)
    }

    /// Returns the permitted postures of each head with the uncut stock on these sides.
    pub(crate) fn ranges(&self, uncut_left: [bool; 2]) -> [PostureRange; 2] {
        std::array::from_fn(|h| self.ranges[h][usize::from(uncut_left[h])])
    }

    fn stop(&self, station: &Station, outcome: PairOutcome) -> Result<SyncPoint, PairBlocked> {
        outcome.map(|pose| SyncPoint { cc: station.pair.cc, pose, at: station.at })
    }

    /// Returns stops strictly between two, close enough for the control in both heads; `None` if
    /// there are none.
    fn between(
        &self,
        ranges: &[PostureRange; 2],
        from: &SyncPoint,
        to: &SyncPoint,
        halvings: u32,
        hints: &mut [Hints; 2],
    ) -> Option<Vec<SyncPoint>> {
        let strays = |h: usize| self.linearity[h].judge(self.test.tests[h], &from.pose.axes, &to.pose.axes).1;
        if !strays(0) && !strays(1) {
            return Some(Vec::new());
        }
        self.halved(ranges, from, to, halvings.checked_sub(1)?, hints)
    }

    /// Returns the tested stop halfway between two.
    pub(crate) fn middle(
        &self,
        ranges: &[PostureRange; 2],
        from: &SyncPoint,
        to: &SyncPoint,
        hints: &mut [Hints; 2],
    ) -> Option<SyncPoint> {
        let cc = [between(&from.cc[0], &to.cc[0], 0.5)?, between(&from.cc[1], &to.cc[1], 0.5)?];
        let pose = self.test.halfway(ranges, &cc, [&from.pose, &to.pose], hints).ok()?;
        let at = std::array::from_fn(|h| 0.5 * (from.at[h] + to.at[h]));
        Some(SyncPoint { cc, pose, at })
    }

    /// Returns the largest deviation of both cutters from the planned motion between the stops of a
    /// run, mm.
    pub(crate) fn linearisation(&self, stops: &[SyncPoint]) -> f64 {
        let strays =
            |w: &[SyncPoint], h: usize| self.linearity[h].judge(self.test.tests[h], &w[0].pose.axes, &w[1].pose.axes).0;
        stops.windows(2).map(|w| strays(w, 0).max(strays(w, 1))).fold(0.0, f64::max)
    }
}

/// Largest fraction of blocked stations on a branch before another one is tried.
const MANY: f64 = 0.3;

/// Number of halvings of the distance between two stations.
const MAX_HALVINGS: u32 = 10;

/// Stretch of a piece that no run cuts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Index of the piece.
    pub piece: usize,
    /// Its ends: index of a cut, with a fraction between two.
    pub at: [f64; 2],
    /// Runs that end and begin there, by index.
    pub beside: [Option<usize>; 2],
}

/// Returns the stretches that runs leave of the pieces of an operation (0 or 1), in their order.
pub(crate) fn gaps(pieces: &[PassSegment], head: usize, runs: &[&PairRun]) -> Vec<Gap> {
    let mut gaps = Vec::new();
    for (index, piece) in pieces.iter().enumerate() {
        let ends = |(k, run): (usize, &&PairRun)| Some((run.stops.first()?.at[head], run.stops.last()?.at[head], k));
        let of_piece = runs.iter().enumerate().filter(|(_, r)| r.pieces[head] == index);
        let mut covered: Vec<_> = of_piece.filter_map(ends).collect();
        covered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let end = piece.places().count().saturating_sub(1) as f64;
        let (mut from, mut before) = (0.0, None);
        for (start, stop, run) in covered {
            if start > from {
                gaps.push(Gap { piece: index, at: [from, start], beside: [before, Some(run)] });
            }
            (from, before) = (stop.max(from), Some(run));
        }
        if from < end {
            gaps.push(Gap { piece: index, at: [from, end], beside: [before, None] });
        }
    }
    gaps
}

/// Returns the remainder of each piece of an operation (0 or 1) beside its runs: pieces of its own
/// cuts, each reaching to the cuts at which the runs beside it end. Single cuts that a run passes
/// over are omitted.
pub(crate) fn left_over(pieces: &[PassSegment], head: usize, runs: &[&PairRun]) -> Vec<PassSegment> {
    gaps(pieces, head, runs).iter().filter_map(|gap| part_of(&pieces[gap.piece], gap.at)).collect()
}

/// Returns the cuts of a piece from one place to another, whole cuts outward; `None` if they are
/// fewer than two.
pub(crate) fn part_of(piece: &PassSegment, [from, to]: [f64; 2]) -> Option<PassSegment> {
    // Added cuts go with the place before.
    let mut place: f64 = -1.0;
    let cuts: Vec<_> = piece
        .cuts
        .iter()
        .enumerate()
        .filter(|(k, _)| {
            let is_place = piece.is_place(*k);
            if is_place {
                place += 1.0;
            }
            place >= from.floor() && (place < to.ceil() || (place == to.ceil() && is_place))
        })
        .map(|(_, cut)| *cut)
        .collect();
    (cuts.len() >= 2).then(|| PassSegment { cuts, ..piece.clone() })
}
