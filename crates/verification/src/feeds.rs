//! Comparison of a program's feeds and spindle speeds with the job's.

use std::collections::BTreeSet;

use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_job::format::job_file::{FeedsFile, SetupFile};
use facemill_job::load::job::Job;
use facemill_nc_program::read::{MotionKind, ReadBlock, ReadCommand};
use facemill_nc_program::{FeedMode, ReadProgram};
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader, StraightCut};
use facemill_virtual_machine::program_time::tolerance::levers_at;
use facemill_virtual_machine::{Assumption, BlockCut, Finding, FindingKind, Measure, StockRun};

/// Feeds and speeds that a job requires in one of its setups, for all its operations and heads.
pub struct RequiredFeeds {
    /// Largest speed of a tip in cuts, mm/min.
    cuts: f64,
    /// Largest speed of a tip, mm/min: of cuts, entries, exits and air.
    all: f64,
    /// Smallest speed of a tip, mm/min; `None` if thick chips may require any.
    least: Option<f64>,
    /// Speeds of spindles, 1/min.
    speeds: Vec<f64>,
    /// Largest displacement of a linear axis, mm, and of a rotary one, rad, by rounding of words at
    /// one end of a block.
    rounding: [f64; 2],
}

/// Block on which the tip is faster than the job's cuts.
pub struct FastBlock {
    /// Line of the program, from 1.
    pub line: u32,
    /// Index of the block.
    block: usize,
    /// Number of straight cuts before it: consecutive ones count on.
    nth: usize,
    /// Speed of the tip, mm/min.
    speed: f64,
    /// Whether that is more than any feed of the job; the job has none for an idle head.
    is_above_all: bool,
}

/// Feeds of a program's cuts compared with the job's, seen by one head.
#[derive(Default)]
pub struct CutFeeds {
    /// Blocks on which the tip is faster than the job's cuts.
    pub fast: Vec<FastBlock>,
    /// Length of the tip's path in cuts, mm, and of the part far slower than any feed of the job.
    ways: [f64; 2],
    /// Time of that part, s.
    slow_time: f64,
    /// The first line of that part.
    first_slow: Option<u32>,
}

/// Fraction of the job's smallest feed below which a cut is far slower.
const FAR_SLOWER: f64 = 0.1;

/// Least fraction of the path of all cuts that must be far slower for a note: near poles, cuts have
/// to be slow.
const WORTH_A_NOTE: f64 = 0.5;

impl CutFeeds {
    fn add(&mut self, least: Option<f64>, line: u32, cut: &StraightCut) {
        let Some(time) = cut.time.filter(|time| *time > 0.0) else { return };
        self.ways[0] += cut.way;
        if least.is_some_and(|least| 60.0 * cut.way / time < FAR_SLOWER * least) {
            self.ways[1] += cut.way;
            self.slow_time += time;
            self.first_slow.get_or_insert(line);
        }
    }

    /// Returns a note if most of the cutting path is far slower than the job's feeds: that is no
    /// fault, but may be a slip.
    pub fn note(&self, required: &RequiredFeeds, head: &str) -> Option<Assumption> {
        let least = required.least?;
        let [all, slow] = self.ways;
        if slow <= WORTH_A_NOTE * all {
            return None;
        }
        let head = if head.is_empty() { String::new() } else { format!("{head}: ") };
        let text = format!(
            "{head}{:.0} % of the cutting path is at {:.3} mm/min on average, but the job requires at least {least} mm/min; the \
             program is taken to be so slow on purpose",
            100.0 * slow / all,
            60.0 * slow / self.slow_time
        );
        Some(Assumption { line: self.first_slow, text })
    }
}

/// Knowledge about a program's blocks from the cut stock.
pub struct KnownCuts {
    /// Lines of the blocks that certainly cut.
    cuts: BTreeSet<u32>,
    /// Lines of the blocks that remove some stock but do not certainly cut.
    doubtful: BTreeSet<u32>,
    /// Lines of the blocks that remove none on the stock's lines but are so near to it that they
    /// may remove some between them.
    between_lines: BTreeSet<u32>,
    /// Lines of the blocks that may reach stock that was not cut.
    not_covered: BTreeSet<u32>,
    /// Tolerance of the cut stock, mm.
    tolerance: f64,
    /// Distance of the stock's lines, mm.
    cell: f64,
}

impl KnownCuts {
    /// Returns the knowledge from a run that probed the fast blocks, and the lines on which it does
    /// not see all stock.
    pub fn of(run: &StockRun, not_covered: &[u32], [tolerance, cell]: [f64; 2]) -> Self {
        let lines = |is: &dyn Fn(&BlockCut) -> bool| run.blocks.iter().filter(|b| is(b)).map(|b| b.line).collect();
        Self {
            cuts: lines(&|b| b.is_certain),
            doubtful: lines(&|b| !b.is_certain && b.removed_mm3 > 0.0),
            between_lines: lines(&|b| !b.is_certain && b.removed_mm3 <= 0.0 && b.may_be_near),
            not_covered: not_covered.iter().copied().collect(),
            tolerance,
            cell,
        }
    }

    fn is_cut(&self, block: &FastBlock) -> bool {
        self.cuts.contains(&block.line)
    }
}

/// Consecutive blocks that are too fast by the same limit.
struct Episode<'a> {
    /// Whether they are compared with the feed of cuts.
    is_cut: bool,
    first: &'a FastBlock,
    worst: &'a FastBlock,
    last: &'a FastBlock,
    /// Whether a block behind them is not fast, or removes no stock.
    has_ended: bool,
}

impl<'a> Episode<'a> {
    fn go_on(&mut self, block: &'a FastBlock) {
        self.last = block;
        if block.speed > self.worst.speed {
            self.worst = block;
        }
    }
}

/// Largest distance of an axis at its reference position from it, mm or rad: rounding of sums.
const AT_HOME: f64 = 1e-6;

/// Addition to a finding that covers more than one S.
const OTHERS: &str = "; nor are other speeds up to the last line the job's";

/// S in force of a spindle.
struct InForce {
    spindle: Option<u32>,
    /// Its fault.
    finding: Option<Finding>,
    has_cut: bool,
    /// Index of the finding of the cut before, which another one continues.
    open: Option<usize>,
}

impl InForce {
    /// Reports its fault when it cuts first.
    fn cut(&mut self, found: &mut Vec<Finding>) {
        if std::mem::replace(&mut self.has_cut, true) {
            return;
        }
        let Some(finding) = &self.finding else {
            self.open = None;
            return;
        };
        match self.open.map(|k| &mut found[k]) {
            Some(open) => {
                open.last_line = finding.first_line;
                if !open.note.starts_with(&finding.note) && !open.note.ends_with(OTHERS) {
                    open.note.push_str(OTHERS);
                }
            }
            None => {
                self.open = Some(found.len());
                found.push(finding.clone());
            }
        }
    }
}

/// Permitted excess of the tip's speed over the job's, as a fraction.
const FASTER: f64 = 0.01;

/// Permitted difference of S from the job's speed, 1/min, or as a fraction of it if that is more: S
/// is a whole number.
const SAME_SPEED: [f64; 2] = [0.5, 1e-3];

/// Least expected number of decimals of words.
const DECIMALS: u8 = 3;

impl RequiredFeeds {
    /// Returns the requirements of a setup's operations; `None` without any.
    pub fn of(job: &Job, setup: &SetupFile) -> Option<Self> {
        let feeds: Vec<_> = job.operations_of(setup).map(|(_, o)| &o.feeds).collect();
        let largest = |of: &dyn Fn(&FeedsFile) -> f64| feeds.iter().map(|f| of(f)).reduce(f64::max);
        let cuts = largest(&|f| f.cutting_mm_min)?;
        let all = largest(&|f| f.cutting_mm_min.max(f.approach_mm_min).max(f.air_mm_min.unwrap_or(0.0)))?;
        let decimals = job.post.decimals();
        let half = |d: u8| 0.5 * 10f64.powi(-i32::from(d.min(DECIMALS)));
        let rounding = [half(decimals.linear), half(decimals.rotary).to_radians()];
        let least = |f: &FeedsFile| {
            let by_turns = f.turn_mm_min.unwrap_or(f64::INFINITY);
            let by_chips = f.removal_rate.as_ref().map_or(f64::INFINITY, |r| r.min_mm_min);
            f.chip_thickness.is_none().then_some(f.cutting_mm_min.min(f.approach_mm_min).min(by_turns).min(by_chips))
        };
        let least = feeds.iter().map(|f| least(f)).try_fold(f64::INFINITY, |all, own| own.map(|own| all.min(own)));
        Some(Self { cuts, all, least, speeds: feeds.iter().map(|f| f.spindle_rpm).collect(), rounding })
    }

    /// Compares the speeds of the tip in cuts with the job's, seen by one head. Speeds are those at
    /// the programmed F without acceleration, over whole blocks; text that is not understood has
    /// its own findings.
    pub fn feeds_of_cuts(&self, program: &ReadProgram, at: MotionContext<'_>) -> CutFeeds {
        let view = (at.machine, at.tool_length);
        let mut found = CutFeeds::default();
        let mut nth = 0;
        let mut motions = MotionReader::new(at, program.dialect, program.rtcp_rapids);
        for (index, block) in program.blocks.iter().enumerate() {
            let cut = match motions.block(block) {
                Ok(AxisMotion::Cut(cut)) => cut,
                Ok(_) => continue,
                Err(_) => {
                    motions.forget();
                    continue;
                }
            };
            nth += 1;
            if !self.is_idle(view.0, &cut) {
                found.add(self.least, block.line, &cut);
            }
            let faster_than = |limit: f64| self.faster_than(limit, view, block, &cut);
            let Some(speed) = faster_than(self.cuts) else { continue };
            let is_above_all = faster_than(self.all).is_some() && !self.is_idle(view.0, &cut);
            found.fast.push(FastBlock { line: block.line, block: index, nth, speed, is_above_all });
        }
        found
    }

    /// Returns whether one of several heads is at home on a block, up to rounding of words: the
    /// table then turns under its tip for another head.
    fn is_idle(&self, machine: &Machine, cut: &StraightCut) -> bool {
        let is_home = |k: usize, value: f64| {
            let axis = &machine.axes()[k];
            let rounding = self.rounding[usize::from(axis.kind == AxisKind::Rotary)];
            (value - axis.home).abs() <= rounding + AT_HOME
        };
        let own = |k: &usize| machine.moves_tool(*k) && !machine.is_shared(*k);
        machine.head_count() > 1
            && (0..machine.axes().len()).filter(own).all(|k| is_home(k, cut.from[k]) && is_home(k, cut.to[k]))
    }

    /// Returns the findings of one head where the tip is faster than the job permits: in blocks
    /// that are known to cut, faster than its cuts; in all others, faster than any of its feeds.
    /// Consecutive blocks are one finding, even if one between them is faster than cuts but removes
    /// so little stock that it is not known to be a cut.
    pub fn findings(
        &self,
        program: &ReadProgram,
        fast: &[FastBlock],
        known: Option<&KnownCuts>,
        head: &str,
    ) -> Vec<Finding> {
        let mut episodes: Vec<Episode<'_>> = Vec::new();
        let mut before = None;
        for block in fast {
            let follows = before.is_some_and(|before| before + 1 == block.nth);
            before = Some(block.nth);
            let is_cut = known.is_some_and(|known| known.is_cut(block));
            let is_found = is_cut || block.is_above_all;
            let is_doubtful = known.is_some_and(|known| known.doubtful.contains(&block.line));
            if let Some(open) = episodes.last_mut().filter(|_| !follows || !(is_found || is_doubtful)) {
                open.has_ended = true;
            }
            if !is_found {
                continue;
            }
            match episodes.last_mut().filter(|e| !e.has_ended && e.is_cut == is_cut) {
                Some(episode) => episode.go_on(block),
                None => episodes.push(Episode { is_cut, first: block, worst: block, last: block, has_ended: false }),
            }
        }
        episodes.iter().map(|episode| self.finding(program, episode, head)).collect()
    }

    fn finding(&self, program: &ReadProgram, episode: &Episode<'_>, head: &str) -> Finding {
        let (worst, is_cut) = (episode.worst, episode.is_cut);
        let (limit, there) = if is_cut { (self.cuts, " in cuts") } else { (self.all, "") };
        let head = if head.is_empty() { String::new() } else { format!("{head}: ") };
        let note =
            format!("{head}the tip moves at {:.0} mm/min, the job permits at most {limit} mm/min{there}", worst.speed);
        Finding {
            first_line: episode.first.line,
            last_line: episode.last.line,
            measure: Some(Measure::FeedRatio(worst.speed / limit)),
            ..of_block(FindingKind::FeedAboveJob, &program.blocks[worst.block], note)
        }
    }

    /// Returns the assumption for a block that is faster than the job's cuts, is no finding, and
    /// may cut stock.
    pub fn assumptions(&self, fast: &[FastBlock], known: Option<&KnownCuts>) -> Vec<Assumption> {
        let Self { cuts, all, .. } = self;
        let first = |is: &dyn Fn(u32) -> bool| {
            let is_cut = |block: &FastBlock| known.is_some_and(|known| known.is_cut(block));
            let open = |block: &&FastBlock| !block.is_above_all && !is_cut(block) && is(block.line);
            fast.iter().find(open).map(|block| block.line)
        };
        let note_at = |line: Option<u32>, text: String| line.map(|line| Assumption { line: Some(line), text });
        let Some(known) = known else {
            let text = format!(
                "feeds of cuts are compared with {all} mm/min, the largest of cutting, approach and air feeds: the stock is \
                 not cut, so cuts cannot be distinguished from entries"
            );
            return note_at(first(&|_| true), text).into_iter().collect();
        };
        let held = format!("feeds above {cuts} mm/min, the largest of cuts, are compared with {all} mm/min where");
        let not_covered = format!("{held} the tool may reach stock beyond the region that is cut: it may cut there");
        let doubtful = format!(
            "{held} no more stock is removed than a tolerance of {} mm explains: such blocks may be cuts",
            known.tolerance
        );
        let between_lines = format!(
            "{held} lines {} mm apart meet no stock, but some is nearer than a cell's diagonal: such blocks may be cuts",
            known.cell
        );
        let in_force =
            [(&known.not_covered, not_covered), (&known.doubtful, doubtful), (&known.between_lines, between_lines)];
        in_force.into_iter().filter_map(|(lines, text)| note_at(first(&|line| lines.contains(&line)), text)).collect()
    }

    /// Returns the speed of the tip if it exceeds a limit (mm/min) by more than rounding of words
    /// explains, mm/min.
    fn faster_than(
        &self,
        limit: f64,
        (machine, length): (&Machine, f64),
        block: &ReadBlock,
        cut: &StraightCut,
    ) -> Option<f64> {
        let time = cut.time.filter(|time| *time > 0.0)?;
        let allowed = (1.0 + FASTER) * limit;
        let speed = 60.0 * cut.way / time;
        if speed <= allowed {
            return None;
        }
        let feed = block.motion.as_ref().and_then(|m| m.feed)?;
        // The control has no smaller F.
        let is_least = cut.is_norm && feed.value <= machine.feed_range().min;
        let way = cut.way - self.rounded_way(machine, length, cut);
        (!is_least && 60.0 * way / time > allowed).then_some(speed)
    }

    /// Returns the length that rounding of the words at both ends may have added to the tip's path,
    /// mm.
    fn rounded_way(&self, machine: &Machine, length: f64, cut: &StraightCut) -> f64 {
        let [linear, rotary] = self.rounding;
        let at = |axes: &AxisValues| {
            // Under RTCP words are the tip's.
            let levers = levers_at((machine, length), axes);
            let by_rotaries = if cut.mode == FeedMode::Rtcp { 0.0 } else { levers.iter().sum() };
            linear * 3f64.sqrt() + rotary * by_rotaries
        };
        at(&cut.from) + at(&cut.to)
    }

    /// Returns findings where a program cuts with S at another speed than those of the job: one
    /// from the first such S to the last before a cut at a speed of the job.
    pub fn other_speeds(&self, program: &ReadProgram) -> Vec<Finding> {
        let mut found: Vec<Finding> = Vec::new();
        // Finding of the S in force of each spindle; it counts from the first cut on.
        let mut in_force: Vec<InForce> = Vec::new();
        for block in &program.blocks {
            let mut spindle = None;
            for command in &block.commands {
                match command {
                    ReadCommand::Spindle(number) => spindle = Some(*number),
                    ReadCommand::SpindleSpeed(speed) => {
                        let before = in_force.iter().position(|s| s.spindle == spindle);
                        let before = before.map(|k| in_force.remove(k));
                        in_force.push(InForce {
                            spindle,
                            finding: self.other_speed(block, *speed),
                            has_cut: false,
                            open: before.and_then(|s| s.open),
                        });
                    }
                    _ => {}
                }
            }
            let kind = block.motion.as_ref().map(|m| m.kind);
            if matches!(kind, Some(MotionKind::Linear | MotionKind::Arc { .. } | MotionKind::Cycle { .. })) {
                in_force.iter_mut().for_each(|s| s.cut(&mut found));
            }
        }
        found
    }

    fn other_speed(&self, block: &ReadBlock, speed: f64) -> Option<Finding> {
        let is_same = |required: &f64| (speed - required).abs() <= SAME_SPEED[0].max(SAME_SPEED[1] * required);
        if self.speeds.iter().any(is_same) {
            return None;
        }
        let mut speeds: Vec<String> = self.speeds.iter().map(f64::to_string).collect();
        speeds.dedup();
        let note = format!("S{speed} is programmed, but the job requires {} 1/min", speeds.join(", "));
        Some(of_block(FindingKind::OtherSpindleSpeed, block, note))
    }
}

fn of_block(kind: FindingKind, block: &ReadBlock, note: String) -> Finding {
    Finding::of_line(kind, block.line, block.number, &block.text, note)
}

#[cfg(test)]
#[path = "../tests/unit/feeds.rs"]
mod tests;
