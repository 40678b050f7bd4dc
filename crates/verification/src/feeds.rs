//! A program's feeds and spindle speeds against those that a job asks for.

use std::collections::BTreeSet;

use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine};
use facemill_job::format::job_file::{FeedsFile, SetupFile};
use facemill_job::load::job::Job;
use facemill_nc_program::{FeedMode, MotionKind, ReadBlock, ReadCommand, ReadProgram};
use facemill_virtual_machine::motion::follow::{FollowedCut, Follower, Surroundings, Way};
use facemill_virtual_machine::program_time::tolerance::levers_at;
use facemill_virtual_machine::{Assumption, BlockCut, Finding, FindingKind, Measure, StockRun};

/// What a job asks for in one of its setups, of all its operations and heads.
pub struct Asked {
    /// Largest speed of a tip in cuts, mm/min.
    cuts: f64,
    /// Largest speed of a tip, mm/min: of cuts, entries, exits and air.
    all: f64,
    /// Smallest speed of a tip, mm/min; `None` where thick chips may ask for any.
    least: Option<f64>,
    /// Speeds of spindles, 1/min.
    speeds: Vec<f64>,
    /// What rounding of words may move a linear axis by at one end of a block, mm, and a rotary
    /// one, rad.
    rounding: [f64; 2],
}

/// A block on which the tip goes faster than the job asks for in cuts.
pub struct FastBlock {
    /// Line of the program, from 1.
    pub line: u32,
    /// Index of the block.
    block: usize,
    /// How many straight cuts are before it: what follows each other counts on.
    nth: usize,
    /// Speed of the tip, mm/min.
    speed: f64,
    /// Whether that is more than any feed of the job, which none is of a head that stands by.
    is_above_all: bool,
}

/// Feeds of a program's cuts against those that a job asks for, seen by one head.
#[derive(Default)]
pub struct CutFeeds {
    /// Blocks on which the tip goes faster than the job asks for in cuts.
    pub fast: Vec<FastBlock>,
    /// Way of the tip in cuts, mm, and the part of it that is far slower than the job asks for
    /// anywhere.
    ways: [f64; 2],
    /// Time of that part, s.
    slow_time: f64,
    /// The first line of that part.
    first_slow: Option<u32>,
}

/// Part of the job's smallest feed below which a cut is far slower than it asks for.
const FAR_SLOWER: f64 = 0.1;

/// Part of the way of all cuts that is far slower where it is worth a note: near poles, cuts have
/// to be.
const WORTH_A_NOTE: f64 = 0.5;

impl CutFeeds {
    fn add(&mut self, least: Option<f64>, line: u32, cut: &FollowedCut) {
        let Some(time) = cut.time.filter(|time| *time > 0.0) else { return };
        self.ways[0] += cut.way;
        if least.is_some_and(|least| 60.0 * cut.way / time < FAR_SLOWER * least) {
            self.ways[1] += cut.way;
            self.slow_time += time;
            self.first_slow.get_or_insert(line);
        }
    }

    /// A note where most of the way is cut far slower than the job asks for: that is no fault, but
    /// may be a slip.
    pub fn note(&self, asked: &Asked, head: &str) -> Option<Assumption> {
        let least = asked.least?;
        let [all, slow] = self.ways;
        if slow <= WORTH_A_NOTE * all {
            return None;
        }
        let head = if head.is_empty() { String::new() } else { format!("{head}: ") };
        let text = format!(
            "{head}{:.0} % of the way of the cuts goes at {:.3} mm/min on average, the job asks for at least {least} mm/min; that the \
             program is meant to be so slow",
            100.0 * slow / all,
            60.0 * slow / self.slow_time
        );
        Some(Assumption { line: self.first_slow, text })
    }
}

/// What the cut stock tells of a program's blocks.
pub struct KnownCuts {
    /// Lines of the blocks that certainly cut.
    cuts: BTreeSet<u32>,
    /// Lines of those that take some stock and do not certainly cut.
    doubtful: BTreeSet<u32>,
    /// Lines of those that take none on the stock's lines and are so near to it that they may take
    /// some between.
    between_lines: BTreeSet<u32>,
    /// Lines of those that may reach stock which was not cut.
    not_covered: BTreeSet<u32>,
    /// Of the cut stock, mm.
    tolerance: f64,
    /// Distance of the stock's lines, mm.
    cell: f64,
}

impl KnownCuts {
    /// Of a run that was asked for the fast blocks, and the lines on which it does not see all
    /// stock.
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

/// Blocks that follow each other and are too fast by the same limit.
struct Episode<'a> {
    /// Whether they are held against the feed of cuts.
    is_cut: bool,
    first: &'a FastBlock,
    worst: &'a FastBlock,
    last: &'a FastBlock,
    /// Whether a block behind them is not fast, or takes no stock.
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

/// How far from its reference position an axis is at it, mm or rad: rounding of sums.
const AT_HOME: f64 = 1e-6;

/// What a finding says that is not of one S alone.
const OTHERS: &str = "; other speeds up to the last line are not asked for either";

/// The S in force of a spindle.
struct InForce {
    spindle: Option<u32>,
    /// What is wrong with it.
    finding: Option<Finding>,
    has_cut: bool,
    /// Index of the finding that the cut before it has, which another one goes on with.
    open: Option<usize>,
}

impl InForce {
    /// Tells what is wrong with it when it cuts first.
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

/// Share by which the tip may be faster than the job asks for.
const FASTER: f64 = 0.01;

/// What S may differ from the job's speed by, 1/min, or as part of it where that is more: S is a
/// whole number.
const SAME_SPEED: [f64; 2] = [0.5, 1e-3];

/// Decimals of words that are expected at least.
const DECIMALS: u8 = 3;

impl Asked {
    /// What a setup's operations ask for; `None` without any.
    pub fn of(job: &Job, setup: &SetupFile) -> Option<Self> {
        let feeds: Vec<_> = job.operations_of(setup).map(|(_, o)| &o.feeds).collect();
        let largest = |of: &dyn Fn(&FeedsFile) -> f64| feeds.iter().map(|f| of(f)).reduce(f64::max);
        let cuts = largest(&|f| f.cutting_mm_min)?;
        let all = largest(&|f| f.cutting_mm_min.max(f.approach_mm_min).max(f.air_mm_min.unwrap_or(0.0)))?;
        let decimals = job.post.decimals();
        let half = |d: u8| 0.5 * 10f64.powi(-i32::from(d.min(DECIMALS)));
        let rounding = [half(decimals.linear), half(decimals.rotary).to_radians()];
        let least = |f: &FeedsFile| {
            let by_chips = f.removal_rate.as_ref().map_or(f64::INFINITY, |r| r.min_mm_min);
            f.chip_thickness.is_none().then_some(f.cutting_mm_min.min(f.approach_mm_min).min(by_chips))
        };
        let least = feeds.iter().map(|f| least(f)).try_fold(f64::INFINITY, |all, own| own.map(|own| all.min(own)));
        Some(Self { cuts, all, least, speeds: feeds.iter().map(|f| f.spindle_rpm).collect(), rounding })
    }

    /// The speeds of the tip in cuts against what the job asks for, seen by one head. Speeds are
    /// those at the programmed F without acceleration, over whole blocks; what is not understood
    /// has findings of its own.
    pub fn feeds_of_cuts(&self, program: &ReadProgram, at: Surroundings<'_>) -> CutFeeds {
        let view = (at.machine, at.tool_length);
        let mut found = CutFeeds::default();
        let mut nth = 0;
        let Ok(mut follower) = Follower::new(at, program.dialect, program.rtcp_rapids) else { return found };
        for (index, block) in program.blocks.iter().enumerate() {
            let cut = match follower.block(block) {
                Ok(Way::Cut(cut)) => cut,
                Ok(_) => continue,
                Err(_) => {
                    follower.forget();
                    continue;
                }
            };
            nth += 1;
            if !self.stands_by(view.0, &cut) {
                found.add(self.least, block.line, &cut);
            }
            let faster_than = |limit: f64| self.faster_than(limit, view, block, &cut);
            let Some(speed) = faster_than(self.cuts) else { continue };
            let is_above_all = faster_than(self.all).is_some() && !self.stands_by(view.0, &cut);
            found.fast.push(FastBlock { line: block.line, block: index, nth, speed, is_above_all });
        }
        found
    }

    /// Whether a head of several is at home on a block, up to rounding of words: the table turns
    /// under its tip for another one.
    fn stands_by(&self, machine: &Machine, cut: &FollowedCut) -> bool {
        let is_home = |k: usize, value: f64| {
            let axis = &machine.axes()[k];
            let rounding = self.rounding[usize::from(axis.kind == AxisKind::Rotary)];
            (value - axis.home).abs() <= rounding + AT_HOME
        };
        let own = |k: &usize| machine.moves_tool(*k) && !machine.is_shared(*k);
        machine.head_count() > 1
            && (0..machine.axes().len()).filter(own).all(|k| is_home(k, cut.from[k]) && is_home(k, cut.to[k]))
    }

    /// Findings of one head where the tip is faster than the job asks for: in blocks that are known
    /// to cut, than it asks for in cuts; in all others, than it asks for anywhere. Blocks that
    /// follow each other are one finding, also where one between them is faster than cuts and takes
    /// so little stock that it is not known to be one.
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
            format!("{head}the tip goes {:.0} mm/min, the job asks for at most {limit} mm/min{there}", worst.speed);
        Finding {
            first_line: episode.first.line,
            last_line: episode.last.line,
            measure: Some(Measure::FeedRatio(worst.speed / limit)),
            ..of_block(FindingKind::FeedAboveJob, &program.blocks[worst.block], note)
        }
    }

    /// What is taken for granted where a block is faster than the job's cuts, no finding, and not
    /// known to cut nothing.
    pub fn assumptions(&self, fast: &[FastBlock], known: Option<&KnownCuts>) -> Vec<Assumption> {
        let Self { cuts, all, .. } = self;
        let first = |is: &dyn Fn(u32) -> bool| {
            let is_cut = |block: &FastBlock| known.is_some_and(|known| known.is_cut(block));
            let open = |block: &&FastBlock| !block.is_above_all && !is_cut(block) && is(block.line);
            fast.iter().find(open).map(|block| block.line)
        };
        let told = |line: Option<u32>, text: String| line.map(|line| Assumption { line: Some(line), text });
        let Some(known) = known else {
            let text = format!(
                "feeds of cuts are held against {all} mm/min, the largest of cutting, approach and air feeds: the stock is \
                 not cut, so cuts are not told from entries"
            );
            return told(first(&|_| true), text).into_iter().collect();
        };
        let held = format!("feeds above {cuts} mm/min, the largest of cuts, are held against {all} mm/min where");
        let not_covered = format!("{held} the tool may reach stock beyond the region that is cut: it may cut there");
        let doubtful = format!(
            "{held} no more stock is taken than a tolerance of {} mm explains: such blocks may be cuts",
            known.tolerance
        );
        let between_lines = format!(
            "{held} no stock is met on lines {} mm apart, and some is nearer than a cell's diagonal: such blocks may be cuts",
            known.cell
        );
        let in_force =
            [(&known.not_covered, not_covered), (&known.doubtful, doubtful), (&known.between_lines, between_lines)];
        in_force.into_iter().filter_map(|(lines, text)| told(first(&|line| lines.contains(&line)), text)).collect()
    }

    /// Speed of the tip where it is more than a limit (mm/min) by more than rounding of words
    /// tells, mm/min.
    fn faster_than(
        &self,
        limit: f64,
        (machine, length): (&Machine, f64),
        block: &ReadBlock,
        cut: &FollowedCut,
    ) -> Option<f64> {
        let time = cut.time.filter(|time| *time > 0.0)?;
        let allowed = (1.0 + FASTER) * limit;
        let speed = 60.0 * cut.way / time;
        if speed <= allowed {
            return None;
        }
        let feed = block.motion.as_ref().and_then(|m| m.feed)?;
        // The control knows no smaller F.
        let is_least = cut.is_norm && feed.value <= machine.feed_range().min;
        let way = cut.way - self.rounded_way(machine, length, cut);
        (!is_least && 60.0 * way / time > allowed).then_some(speed)
    }

    /// What rounding of the words at both ends may have added to the way of the tip, mm.
    fn rounded_way(&self, machine: &Machine, length: f64, cut: &FollowedCut) -> f64 {
        let [linear, rotary] = self.rounding;
        let at = |axes: &AxisValues| {
            // Under RTCP words are the tip's.
            let levers = levers_at((machine, length), axes);
            let by_rotaries = if cut.mode == FeedMode::Rtcp { 0.0 } else { levers.iter().sum() };
            linear * 3f64.sqrt() + rotary * by_rotaries
        };
        at(&cut.from) + at(&cut.to)
    }

    /// Findings where a program cuts with S at another speed than those of the job: one from the
    /// first such S to the last before a cut at a speed that is asked for.
    pub fn other_speeds(&self, program: &ReadProgram) -> Vec<Finding> {
        let mut found: Vec<Finding> = Vec::new();
        // The finding of the S in force of each spindle; it counts from the first cut on.
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
        let is_same = |asked: &f64| (speed - asked).abs() <= SAME_SPEED[0].max(SAME_SPEED[1] * asked);
        if self.speeds.iter().any(is_same) {
            return None;
        }
        let mut asked: Vec<String> = self.speeds.iter().map(f64::to_string).collect();
        asked.dedup();
        let note = format!("S{speed} is programmed, the job asks for {} 1/min", asked.join(", "));
        Some(of_block(FindingKind::OtherSpindleSpeed, block, note))
    }
}

fn of_block(kind: FindingKind, block: &ReadBlock, note: String) -> Finding {
    Finding::of_line(kind, block.line, block.number, &block.text, note)
}

#[cfg(test)]
#[path = "../tests/unit/feeds.rs"]
mod tests;
