//! Positions as blocks with feeds.

use facemill_cl_data::CuttingLaw;
use facemill_feedrate::feed_for_block;
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine};
use facemill_job::setup::program_spec::{axis_specs, tool_spec};
use facemill_job::setup::rolled::roll;
use facemill_job::setup::word_map::{rtcp_start_axes, word_frame};
use facemill_nc_program::{AxisWords, Block, FeedMode, NcProgram, ProgramSpec, WordMap};
use nalgebra::Isometry3;

use crate::fault::PostFault;
use crate::positions::{Position, PositionKind};
use crate::scene::{PostScene, PostTool};
use crate::steps::{PathMove, Step, ToolPart};

/// Blocks of a tool, and what is expected of their text.
pub(crate) struct ToolBlocks {
    pub(crate) spec: ProgramSpec,
    /// Every motion block: its index in the program, and the position.
    pub(crate) motions: Vec<(usize, Position)>,
    /// Points that repeat the position before.
    pub(crate) repeated: usize,
    /// Time of every motion at the feed of its block, s; 0 of rapids.
    pub(crate) times: Vec<f64>,
    /// Blocks whose feed is lowered to what the axes reach.
    pub(crate) lowered: usize,
}

/// Writes the steps of a tool as blocks.
///
/// # Errors
/// With the line: a feed that axes and control do not permit.
pub(crate) fn blocks(
    scene: &PostScene<'_>,
    tool: &PostTool<'_>,
    part: &ToolPart,
    (moves, positions): (&[PathMove], &[Position]),
    name: &str,
) -> Result<ToolBlocks, PostFault> {
    let mut writer = BlockWriter::new(scene, tool)?;
    let mut positions = positions.iter().peekable();
    let mut index = 0;
    for step in &part.steps {
        match step {
            Step::Move(_) => {
                while let Some(position) = positions.next_if(|p| p.of == index) {
                    writer.position(position, moves[index].line)?;
                }
                index += 1;
            }
            other => writer.other(other),
        }
    }
    let BlockWriter { mut program, motions, repeated, times, .. } = writer;
    roll(&mut program, scene.machine.axes());
    let approach = match scene.post.feed_mode() {
        FeedMode::Rtcp => Some(rtcp_start(scene.machine, tool)?),
        FeedMode::G94 | FeedMode::G93 => None,
    };
    let spec = ProgramSpec {
        job_name: name.to_owned(),
        tool: tool_spec(tool.tool),
        spindle: part.spindle,
        coolant: part.coolant,
        work_offset: tool.words.work_offset(),
        axes: axis_specs(scene.machine, &tool.words),
        smallest_feed: scene.machine.feed_range().min,
        program,
        rapid: scene.machine.motion_law().rapid,
        approach,
    };
    Ok(ToolBlocks { spec, motions, repeated, times, lowered: 0 })
}

/// Frame of X, Y and Z words under RTCP; the identity without it.
fn written_frame(scene: &PostScene<'_>, words: &WordMap) -> Result<Isometry3<f64>, PostFault> {
    if scene.post.feed_mode() != FeedMode::Rtcp {
        return Ok(Isometry3::identity());
    }
    word_frame(scene.machine, words).ok_or_else(|| {
        PostFault::Whole("the feed mode rtcp needs a machine with linear axes X, Y and Z at right angles".to_owned())
    })
}

/// Words at which RTCP is switched on: linear axes at home, rotary words 0.
fn rtcp_start(machine: &Machine, tool: &PostTool<'_>) -> Result<AxisWords, PostFault> {
    let at = rtcp_start_axes(machine, &tool.words);
    let tip = machine.cl_point(&at, tool.tool.gauge_length()).tip;
    let frame = word_frame(machine, &tool.words).unwrap_or_else(Isometry3::identity);
    let words = tool.words.rtcp_words(&frame.inverse_transform_point(&tip), at.as_slice());
    words.map_err(|e| PostFault::Whole(e.to_string()))
}

struct BlockWriter<'a> {
    scene: &'a PostScene<'a>,
    words: &'a WordMap,
    tool_length: f64,
    frame: Isometry3<f64>,
    at: Option<AxisValues>,
    program: NcProgram,
    motions: Vec<(usize, Position)>,
    repeated: usize,
    times: Vec<f64>,
}

/// Turn of the tool that counts as none, rad: rounding of forward kinematics.
const SAME_DIRECTION: f64 = 1e-9;

/// Largest way of an axis of a block that moves nothing, mm or rad.
const NO_WAY: f64 = 1e-9;

impl<'a> BlockWriter<'a> {
    fn new(scene: &'a PostScene<'_>, tool: &'a PostTool<'_>) -> Result<Self, PostFault> {
        Ok(Self {
            scene,
            words: &tool.words,
            tool_length: tool.tool.gauge_length(),
            frame: written_frame(scene, &tool.words)?,
            at: None,
            program: NcProgram::default(),
            motions: Vec::new(),
            repeated: 0,
            times: Vec::new(),
        })
    }

    fn other(&mut self, step: &Step) {
        self.program.blocks.push(match step {
            Step::Comment(text) => Block::Comment(text.clone()),
            Step::SpindleOn(spindle) => {
                Block::SpindleOn { rpm: spindle.rpm, clockwise: spindle.clockwise, spindle: None }
            }
            Step::SpindleOff => Block::SpindleOff,
            Step::Coolant(coolant) => Block::Coolant(*coolant),
            Step::Dwell(seconds) => Block::Dwell { seconds: *seconds },
            Step::Stop => Block::Stop,
            Step::Move(_) => return,
        });
    }

    fn position(&mut self, position: &Position, line: u32) -> Result<(), PostFault> {
        let to = &position.axes;
        let is_still = |from: &AxisValues| from.iter().zip(to.iter()).all(|(a, b)| (a - b).abs() <= NO_WAY);
        if self.at.as_ref().is_some_and(is_still) {
            self.repeated += usize::from(position.is_point);
            return Ok(());
        }
        let words = self.words_of(to)?;
        let tip_feed = match position.kind {
            PositionKind::Rapid => None,
            PositionKind::FastCut => Some(FASTEST),
            PositionKind::Cut(feed) => Some(feed),
        };
        let (block, time) = match (self.at, tip_feed) {
            (None, _) => {
                self.turn_at_pole(to)?;
                (Block::Rapid { words }, 0.0)
            }
            (Some(_), None) => (Block::Rapid { words }, 0.0),
            (Some(from), Some(tip_feed)) => {
                let (feed, time) = self.feed(&from, to, tip_feed, line)?;
                (Block::Linear { words, feed }, time)
            }
        };
        self.times.push(time);
        self.motions.push((self.program.blocks.len(), *position));
        self.program.blocks.push(block);
        self.at = Some(*to);
        Ok(())
    }

    /// Returns the F of a block at this speed of the tip, mm/min, or as fast as axes and control
    /// permit, and its time, s.
    fn feed(&self, from: &AxisValues, to: &AxisValues, tip_feed: f64, line: u32) -> Result<(f64, f64), PostFault> {
        let machine = self.scene.machine;
        let range = machine.feed_range();
        let [a, b] = [from, to].map(|q| machine.cl_point(q, self.tool_length).tip);
        let feed = feed_for_block(machine.axes(), from, to, (b - a).norm(), tip_feed, &range)
            .map_err(|e| PostFault::at(line, e.to_string()))?;
        let value = match self.scene.post.feed_mode() {
            FeedMode::G94 => feed.f_word,
            // A block without motion takes no time; every rate is right.
            FeedMode::G93 => feed.inverse_time().unwrap_or(1.0),
            FeedMode::Rtcp => feed.tip_feed.max(range.min),
        };
        Ok((value, feed.time))
    }

    /// Turns the axis about which the tool points where RTCP is switched on, before the move to the
    /// first position: a control that turns the tool's vector would make it jump there.
    fn turn_at_pole(&mut self, first: &AxisValues) -> Result<(), PostFault> {
        let scene = self.scene;
        if scene.rapid_law() != BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned) {
            return Ok(());
        }
        let start = rtcp_start_axes(scene.machine, self.words);
        let direction = |q: &AxisValues| scene.machine.cl_point(q, self.tool_length).axis;
        let turned = |k: usize| AxisValues::from_fn(start.len(), |j| if j == k { first[k] } else { start[j] });
        let is_pole = |k: &usize| {
            let turns = scene.machine.axes()[*k].kind == AxisKind::Rotary && first[*k] != start[*k];
            turns && direction(&turned(*k)).angle(&direction(&start)) <= SAME_DIRECTION
        };
        let Some(pole) = (0..start.len()).find(is_pole) else { return Ok(()) };
        let tip = scene.machine.cl_point(&start, self.tool_length).tip;
        let turned = scene.machine.with_tip_at(&turned(pole), &tip, self.tool_length);
        let turned = turned.ok_or_else(|| PostFault::Whole("linear axes that depend on each other".to_owned()))?;
        let words = self.words_of(&turned)?;
        self.program.blocks.push(Block::Rapid { words });
        Ok(())
    }

    fn words_of(&self, axes: &AxisValues) -> Result<AxisWords, PostFault> {
        let words = match self.scene.post.feed_mode() {
            FeedMode::G94 | FeedMode::G93 => self.words.words(axes.as_slice()),
            FeedMode::Rtcp => {
                let on_table = self.scene.machine.cl_point(axes, self.tool_length).tip;
                self.words.rtcp_words(&self.frame.inverse_transform_point(&on_table), axes.as_slice())
            }
        };
        words.map_err(|e| PostFault::Whole(e.to_string()))
    }
}

/// Speed of the tip beyond that of any machine, mm/min: axes and control then limit the block.
const FASTEST: f64 = 1e9;
