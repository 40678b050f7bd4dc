//! A program's feeds and spindle speeds against those that a job asks for.

use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_nc_program::{FeedMode, MotionKind, ReadBlock, ReadCommand, ReadProgram};
use facemill_virtual_machine::{Finding, FindingKind, Measure};

use crate::follow::{FollowedCut, Follower, Surroundings, Way};
use crate::job_file::SetupFile;
use crate::load::Job;
use crate::timing::levers_at;

/// What a job asks for in one of its setups, of all its operations and heads.
pub(crate) struct Asked {
    /// Largest speed of a tip, mm/min: of cuts, entries, exits and air.
    tip_feed: f64,
    /// Speeds of spindles, 1/min.
    speeds: Vec<f64>,
    /// What rounding of words may move a linear axis by at one end of a block, mm, and a rotary one, rad.
    rounding: [f64; 2],
}

/// Share by which the tip may be faster than the job asks for.
const FASTER: f64 = 0.01;

/// What S may differ from the job's speed by, 1/min, or as part of it where that is more: S is a whole number.
const SAME_SPEED: [f64; 2] = [0.5, 1e-3];

/// Decimals of words that are expected at least.
const DECIMALS: u8 = 3;

impl Asked {
    /// What a setup's operations ask for; `None` without any.
    pub(crate) fn of(job: &Job, setup: &SetupFile) -> Option<Self> {
        let feeds: Vec<_> = job.operations_of(setup).map(|(_, o)| &o.feeds).collect();
        let of =
            |f: &&crate::job_file::FeedsFile| f.cutting_mm_min.max(f.approach_mm_min).max(f.air_mm_min.unwrap_or(0.0));
        let tip_feed = feeds.iter().map(of).reduce(f64::max)?;
        let decimals = job.post.decimals();
        let half = |d: u8| 0.5 * 10f64.powi(-i32::from(d.min(DECIMALS)));
        let rounding = [half(decimals.linear), half(decimals.rotary).to_radians()];
        Some(Self { tip_feed, speeds: feeds.iter().map(|f| f.spindle_rpm).collect(), rounding })
    }

    /// Findings where a program cuts with a faster tip than the job asks for, seen by one head, or with a spindle at another
    /// speed. Speeds are those at the programmed F without acceleration, over whole blocks; what is not understood has findings
    /// of its own.
    pub(crate) fn findings(&self, program: &ReadProgram, at: Surroundings<'_>, head: &str) -> Vec<Finding> {
        let mut found = self.fast_cuts(program, at);
        for finding in found.iter_mut().filter(|_| !head.is_empty()) {
            finding.note = format!("{head}: {}", finding.note);
        }
        found
    }

    fn fast_cuts(&self, program: &ReadProgram, at: Surroundings<'_>) -> Vec<Finding> {
        let (machine, length) = (at.machine, at.tool_length);
        let mut found: Vec<(Finding, f64)> = Vec::new();
        let mut goes_on = false;
        let Ok(mut follower) = Follower::new(at, program.dialect, program.rtcp_rapids) else { return Vec::new() };
        for block in &program.blocks {
            let cut = match follower.block(block) {
                Ok(Way::Cut(cut)) => cut,
                Ok(_) => continue,
                Err(_) => {
                    follower.forget();
                    continue;
                }
            };
            let Some(speed) = self.too_fast(machine, length, block, &cut) else {
                goes_on = false;
                continue;
            };
            match found.last_mut().filter(|_| goes_on) {
                Some((finding, worst)) if speed > *worst => {
                    let first_line = finding.first_line;
                    *finding = Finding { first_line, ..self.fast(block, speed) };
                    *worst = speed;
                }
                Some((finding, _)) => finding.last_line = block.line,
                None => found.push((self.fast(block, speed), speed)),
            }
            goes_on = true;
        }
        found.into_iter().map(|(finding, _)| finding).collect()
    }

    /// Speed of the tip where it is more than the job asks for by more than rounding of words tells, mm/min.
    fn too_fast(&self, machine: &Machine, length: f64, block: &ReadBlock, cut: &FollowedCut) -> Option<f64> {
        let time = cut.time.filter(|time| *time > 0.0)?;
        let allowed = (1.0 + FASTER) * self.tip_feed;
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

    fn fast(&self, block: &ReadBlock, speed: f64) -> Finding {
        let note = format!("the tip goes {speed:.0} mm/min, the job asks for at most {} mm/min", self.tip_feed);
        let measure = Some(Measure::FeedRatio(speed / self.tip_feed));
        Finding { measure, ..of_block(FindingKind::FeedAboveJob, block, note) }
    }

    /// Findings where a program cuts with S at another speed than those of the job.
    pub(crate) fn other_speeds(&self, program: &ReadProgram) -> Vec<Finding> {
        let mut found = Vec::new();
        // The finding of the S in force of each spindle; it counts from the first cut on.
        let mut in_force: Vec<(Option<u32>, Option<Finding>)> = Vec::new();
        for block in &program.blocks {
            let mut spindle = None;
            for command in &block.commands {
                match command {
                    ReadCommand::Spindle(number) => spindle = Some(*number),
                    ReadCommand::SpindleSpeed(speed) => {
                        in_force.retain(|(other, _)| *other != spindle);
                        in_force.push((spindle, self.other_speed(block, *speed)));
                    }
                    _ => {}
                }
            }
            let kind = block.motion.as_ref().map(|m| m.kind);
            if matches!(kind, Some(MotionKind::Linear | MotionKind::Arc { .. } | MotionKind::Cycle { .. })) {
                found.extend(in_force.iter_mut().filter_map(|(_, finding)| finding.take()));
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
