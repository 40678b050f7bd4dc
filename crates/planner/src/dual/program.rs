//! Moves of two heads as blocks, each with one time.

use facemill_feedrate::{FeedLimit, PairFeed, PairLimit, feed_for_pair, rapid_time};
use facemill_inverse_kinematics::AxisValues;
use facemill_job::failure::Failure;
use facemill_job::format::job_file::FeedsFile;
use facemill_job::load::job::{Job, Setup};
use facemill_job::setup::word_map::head_spec;
use facemill_job::validate::tip_feed::{CutFeed, FeedLaw, programmed_feed};
use facemill_nc_program::{Block, FeedMode, HeadSpec, NcProgram, ProgramSpec, WordMap};
use facemill_tool_model::SpindleRotation;
use facemill_tool_path::moves::MoveKind;

use super::moves::DualMove;
use crate::program::timed::{Timed, TimedMove};

/// Feeds of a part of a program.
#[derive(Clone, Copy)]
pub(crate) struct PartFeeds<'a> {
    /// Name in errors.
    pub name: &'a str,
    /// Feeds of each head's operation, those of a single one twice.
    pub feeds: [&'a FeedsFile; 2],
}

/// Times and lengths of moves of two heads.
#[derive(Clone, Debug, Default)]
pub(crate) struct DualTimes {
    /// Time of all moves at the feeds that axis velocities allow, s; the report compares it with
    /// that of both operations one after the other.
    pub time: f64,
    /// Rapids among them, s.
    pub rapid: f64,
    /// Path length of each tip in cuts of both heads at once, mm.
    pub paired: [f64; 2],
    /// Path length of each tip in all cuts, mm.
    pub cut: [f64; 2],
    /// Speed of each tip in each of its cuts, mm/min.
    pub tip_feeds: [Vec<f64>; 2],
    /// Limit of that speed in each of its cuts.
    pub cut_feeds: [Vec<CutFeed>; 2],
    /// Smallest and largest speed of each tip in cuts of both heads, mm/min.
    pub paired_feeds: [Option<[f64; 2]>; 2],
    /// Largest speed of the shared axis in cuts of both heads, rad/s or mm/s.
    pub shared_speed: f64,
}

/// Move of two heads with its time at constant speeds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DualTime {
    kind: MoveKind,
    working: [bool; 2],
    /// Time, s.
    time: f64,
    /// Path lengths of the tips, mm.
    ways: [f64; 2],
    /// Travel of the shared axis, rad or mm.
    shared_way: f64,
    /// Limits of the speeds of the tips in a cut.
    cut_feeds: [Option<CutFeed>; 2],
}

impl DualTimes {
    /// Adds a move: its time before, and speeds with `slower` times that time.
    pub(crate) fn add(&mut self, m: &DualTime, slower: f64) {
        self.time += m.time;
        if m.kind == MoveKind::Rapid {
            self.rapid += m.time;
        }
        if m.kind != MoveKind::Cut {
            return;
        }
        let time = m.time * slower;
        let speed = |way: f64| if time > 0.0 { way / time } else { 0.0 };
        let both = m.working == [true; 2];
        for h in (0..2).filter(|&h| m.working[h]) {
            let tip_feed = 60.0 * speed(m.ways[h]);
            self.cut[h] += m.ways[h];
            self.cut_feeds[h].extend(m.cut_feeds[h]);
            self.tip_feeds[h].push(tip_feed);
            if both {
                self.paired[h] += m.ways[h];
                let [low, high] = self.paired_feeds[h].unwrap_or([tip_feed; 2]);
                self.paired_feeds[h] = Some([low.min(tip_feed), high.max(tip_feed)]);
            }
        }
        if both {
            self.shared_speed = self.shared_speed.max(speed(m.shared_way));
        }
    }
}

/// Turns moves into blocks.
pub(crate) struct DualWriter<'a> {
    jobs: [&'a Job; 2],
    words: &'a WordMap,
    shared: usize,
    feed_mode: FeedMode,
    at: Option<AxisValues>,
    timed: Timed,
}

impl<'a> DualWriter<'a> {
    pub(crate) fn new(jobs: [&'a Job; 2], words: &'a WordMap, shared: usize) -> Self {
        let timed = Timed { program: NcProgram::default(), ..Timed::default() };
        Self { jobs, words, shared, feed_mode: jobs[0].post.feed_mode(), at: None, timed }
    }

    pub(crate) fn comment(&mut self, text: String) {
        self.timed.program.blocks.push(Block::Comment(text));
    }

    /// Returns the number of blocks so far.
    pub(crate) fn n_blocks(&self) -> usize {
        self.timed.program.blocks.len()
    }

    /// Starts a part: an operation, or two.
    pub(crate) fn part(&mut self, name: &str) {
        self.timed.operation_starts.push(self.timed.program.blocks.len());
        self.comment(name.to_owned());
    }

    /// Sets the spindle of a head (0 or 1).
    pub(crate) fn spindle(&mut self, head: usize, rpm: f64) {
        let job = self.jobs[head];
        let clockwise = job.tool.spindle_rotation() == SpindleRotation::Clockwise;
        let spindle = Some(job.machine.channel());
        self.timed.program.blocks.push(Block::SpindleOn { rpm, clockwise, spindle });
    }

    /// Appends a move and returns its time.
    ///
    /// # Errors
    /// Returns an error if axes and control allow no feed for it.
    pub(crate) fn push(&mut self, m: &DualMove, part: &PartFeeds<'_>) -> Result<DualTime, Failure> {
        let words = self.words.words(m.axes.as_slice()).map_err(|e| Failure::Internal(e.to_string()))?;
        let mut timed_move = DualTime {
            kind: m.kind,
            working: m.working,
            time: 0.0,
            ways: [0.0; 2],
            shared_way: 0.0,
            cut_feeds: [None; 2],
        };
        let mut limit = None;
        let block = match (m.kind, self.at) {
            (MoveKind::Rapid, from) => {
                timed_move.time = from.map_or(0.0, |from| {
                    let machine = &self.jobs[0].machine;
                    rapid_time(machine, machine.motion_law().rapid, &from, &m.axes, 0.0)
                });
                self.timed.rapid_time += timed_move.time;
                Block::Rapid { words }
            }
            (_, None) => return Err(Failure::Internal("a program starts with a cut".to_owned())),
            (_, Some(from)) => {
                let (value, feed) = self.timed_feed(&from, m, part, &mut timed_move)?;
                limit = Some(match feed.limit {
                    PairLimit::TipFeed(_) => FeedLimit::TipFeed,
                    PairLimit::Other(limit) => limit,
                });
                Block::Linear { words, feed: value }
            }
        };
        let at = self.timed.program.blocks.len();
        self.timed.moves.push(TimedMove {
            block: at,
            axes: m.axes,
            kind: m.kind,
            time: timed_move.time,
            given_time: timed_move.time,
            limit,
        });
        self.timed.program.blocks.push(block);
        self.timed.n_blocks += 1;
        self.at = Some(m.axes);
        Ok(timed_move)
    }

    fn timed_feed(
        &mut self,
        from: &AxisValues,
        m: &DualMove,
        part: &PartFeeds<'_>,
        timed_move: &mut DualTime,
    ) -> Result<(f64, PairFeed), Failure> {
        let tip =
            |h: usize, axes: &AxisValues| self.jobs[h].machine.cl_point(axes, self.jobs[h].tool.gauge_length()).tip;
        let ways: [f64; 2] = std::array::from_fn(|h| (tip(h, &m.axes) - tip(h, from)).norm());
        let programmed = |h: usize| {
            let teeth = self.jobs[h].tool.n_inserts();
            m.working[h].then(|| programmed_feed(part.feeds[h], teeth, m.kind, m.chips[h].as_ref()))
        };
        let programmed = [0, 1].map(programmed);
        let machine = &self.jobs[0].machine;
        let feed_at = |tip_feeds: [Option<f64>; 2]| {
            feed_for_pair(machine.axes(), from, &m.axes, ways, tip_feeds, &machine.feed_range())
                .map_err(|e| Failure::Infeasible(format!("{}: {e}", part.name)))
        };
        let feed = feed_at(programmed.map(|a| a.map(|a| a.mm_min)))?;
        let shared_way = (m.axes.get_or_zero(self.shared) - from.get_or_zero(self.shared)).abs();
        *timed_move = DualTime { time: feed.time, ways, shared_way, ..*timed_move };
        if m.kind == MoveKind::Cut {
            let is_given = programmed.iter().flatten().all(|a| a.law == FeedLaw::Given);
            let at_given = [0, 1].map(|h| programmed[h].map(|_| part.feeds[h].cutting_mm_min));
            let given = if is_given { feed } else { feed_at(at_given)? };
            let added_time = feed.time - given.time;
            timed_move.cut_feeds = [0, 1].map(|h| {
                programmed[h].map(|programmed| CutFeed { programmed, before: given.tip_feeds[h], added_time })
            });
            self.timed.passes_time += feed.time;
            let at_feed = |h: usize| programmed[h].map_or(0.0, |p| 60.0 * ways[h] / p.mm_min);
            // Both tips arrive at once: the one with more way at its feed decides.
            self.timed.passes_feed_time += at_feed(0).max(at_feed(1));
            self.timed.passes_length += (0..2).filter(|&h| m.working[h]).map(|h| ways[h]).sum::<f64>();
        } else {
            self.timed.approach_time += feed.time;
            self.timed.approach_length += ways.iter().sum::<f64>();
        }
        let value = match self.feed_mode {
            FeedMode::G93 => feed.inverse_time().unwrap_or(1.0),
            FeedMode::G94 | FeedMode::Rtcp => feed.f_word,
        };
        Ok((value, feed))
    }

    pub(crate) fn finish(self) -> Timed {
        self.timed
    }
}

/// Returns the data for the dialect's writer, and both heads.
///
/// # Errors
/// Returns an error if an axis has no NC address.
pub(crate) fn dual_spec(
    jobs: [&Job; 2],
    setup: &Setup<'_>,
    feeds: [&FeedsFile; 2],
    words: &WordMap,
    timed: &mut Timed,
) -> Result<(ProgramSpec, Vec<HeadSpec>), Failure> {
    let heads: Vec<HeadSpec> =
        (0..2).map(|h| head_spec(jobs, h, feeds[h].spindle_rpm)).collect::<Result<_, Failure>>()?;
    let axes = facemill_job::setup::program_spec::axis_specs(&jobs[0].machine, words);
    facemill_job::setup::rolled::roll(&mut timed.program, jobs[0].machine.axes());
    let spec = ProgramSpec {
        job_name: format!("{} - {}", jobs[0].file.name, setup.file.name),
        tool: heads[0].tool.clone(),
        spindle: heads[0].spindle,
        coolant: facemill_job::setup::program_spec::coolant(feeds[0].coolant),
        work_offset: setup.work_offset,
        axes,
        smallest_feed: jobs[0].machine.feed_range().min,
        program: std::mem::take(&mut timed.program),
        rapid: jobs[0].machine.motion_law().rapid,
        approach: None,
    };
    Ok((spec, heads))
}
