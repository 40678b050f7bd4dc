//! Conversion of moves to timed blocks and text.

pub(crate) mod cut_stock;
pub(crate) mod heads;
pub(crate) mod link_search;
pub(crate) mod one_head;
pub(crate) mod output;
pub(crate) mod planned_links;
pub(crate) mod planned_turns;
pub(crate) mod refinement;
pub(crate) mod rounds;
pub(crate) mod run_program;
pub(crate) mod timed;
pub(crate) mod timing;
pub(crate) mod vector_blocks;
pub(crate) mod width_rounds;

use facemill_cl_data::CuttingLaw;
use facemill_feedrate::{BlockFeed, feed_for_block, rapid_time};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine};
use facemill_job::failure::Failure;
use facemill_job::format::job_file::{FeedsFile, OperationFile};
use facemill_job::setup::program_spec::coolant;
use facemill_job::setup::scene::Scene;
use facemill_job::setup::word_map::rtcp_start_axes;
use facemill_job::validate::tip_feed::{CutFeed, FeedLaw, programmed_feed};
use facemill_nc_program::{AxisWords, Block, CutVectors, FeedMode, WordMap};
use facemill_tool_model::SpindleRotation;
use facemill_tool_path::moves::{Move, MoveKind, OperationMoves};
use nalgebra::{Isometry3, Unit, Vector3};

use crate::program::timed::{CutBlock, Timed, TimedMove};
use crate::program::vector_blocks::VectorBlocks;

/// Turn of the tool that counts as none, rad: rounding of forward kinematics.
const SAME_DIRECTION: f64 = 1e-9;

/// Writer that times moves by FEED and turns them into blocks.
pub(crate) struct BlockWriter<'a> {
    machine: &'a Machine,
    /// Motion of the control in rapids.
    rapid_law: BlockLaw,
    tool_length: f64,
    words: &'a WordMap,
    table_from_rtcp_words: Isometry3<f64>,
    feed_mode: FeedMode,
    clockwise: bool,
    /// Position at which RTCP is switched on, on a control that turns the tool's vector at rapid
    /// rate.
    turns_from: Option<AxisValues>,
    teeth: u32,
    /// Feeds of the operation before.
    feeds: Option<FeedsFile>,
    at: Option<Move>,
    /// Writer of the tool's axis as a vector, if the program does so.
    vectors: Option<VectorBlocks<'a>>,
    timed: Timed,
}

impl<'a> BlockWriter<'a> {
    /// Starts an empty program.
    ///
    /// # Errors
    /// If the machine cannot be programmed under the job's feed mode.
    pub(crate) fn new(scene: &'a Scene<'_>) -> Result<Self, Failure> {
        let Scene { job, setup, words, .. } = scene;
        let table_from_rtcp_words = scene.written_frame()?;
        Ok(Self {
            vectors: VectorBlocks::new(job, setup, &table_from_rtcp_words),
            table_from_rtcp_words,
            machine: &job.machine,
            rapid_law: job.rapid_law(),
            tool_length: job.tool.gauge_length(),
            words,
            feed_mode: job.post.feed_mode(),
            turns_from: (job.rapid_law() == BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned))
                .then(|| rtcp_start_axes(&job.machine, words)),
            clockwise: job.tool.spindle_rotation() == SpindleRotation::Clockwise,
            teeth: job.tool.n_inserts(),
            feeds: None,
            at: None,
            timed: Timed::default(),
        })
    }

    /// Appends an operation.
    ///
    /// # Errors
    /// If a block has no feed that axes and control permit.
    pub(crate) fn operation(&mut self, operation: &OperationFile, moves: &OperationMoves) -> Result<(), Failure> {
        self.timed.operation_starts.push(self.timed.program.blocks.len());
        if let Some(before) = self.feeds.replace(operation.feeds.clone()) {
            self.change_of(&before, &operation.feeds);
        }
        self.comment(operation.name.clone());
        let index = self.timed.operation_starts.len() - 1;
        for (k, piece) in moves.pieces.iter().enumerate() {
            self.comment(format!("PASS {} PLACE {}", piece.piece.pass + 1, piece.piece.copy + 1));
            let mut cut = 0;
            for (at, m) in piece.moves.iter().enumerate() {
                if m.kind == MoveKind::Cut {
                    cut += 1;
                    let block = self.timed.program.blocks.len();
                    self.timed.cut_blocks.push(CutBlock { operation: index, piece: k, cut, at, block });
                }
                // The normal of an entry is that of the first cut, and of an exit that of the last.
                let normal = piece.piece.cuts.get(cut).map(|c| c.cc.normal);
                self.block(operation, m, normal.as_ref())?;
            }
        }
        for m in &moves.retract {
            self.block(operation, m, None)?;
        }
        Ok(())
    }

    /// Writes spindle and coolant if an operation has others than the one before; the first one's
    /// are in the header.
    fn change_of(&mut self, before: &FeedsFile, now: &FeedsFile) {
        if before.spindle_rpm != now.spindle_rpm {
            let (rpm, clockwise) = (now.spindle_rpm, self.clockwise);
            self.timed.program.blocks.push(Block::SpindleOn { rpm, clockwise, spindle: None });
        }
        if before.coolant != now.coolant {
            self.timed.program.blocks.push(Block::Coolant(coolant(now.coolant)));
        }
    }

    /// Returns the program so far.
    pub(crate) fn finish(self) -> Timed {
        self.timed
    }

    /// Appends a comment.
    pub(crate) fn comment(&mut self, text: String) {
        self.timed.program.blocks.push(Block::Comment(text));
    }

    fn block(
        &mut self,
        operation: &OperationFile,
        m: &Move,
        normal: Option<&Unit<Vector3<f64>>>,
    ) -> Result<(), Failure> {
        let words = self.words_of(&m.axes)?;
        let (block, time, given_time, limit) = match m.kind {
            MoveKind::Rapid => {
                if self.at.is_none() {
                    self.turn_at_pole(&m.axes)?;
                }
                let time = self.at.map_or(0.0, |from| {
                    rapid_time(self.machine, self.rapid_law, &from.axes, &m.axes, self.tool_length)
                });
                self.timed.rapid_time += time;
                (Block::Rapid { words }, time, time, None)
            }
            MoveKind::Approach | MoveKind::Engage | MoveKind::Turn | MoveKind::Cut => {
                let (feed, timed_move, given_time) = self.timed(operation, m)?;
                let block = match self.vectors_of(operation, m, normal)? {
                    Some(vectors) => Block::LinearVectors { words, feed, vectors: Box::new(vectors) },
                    None => Block::Linear { words, feed },
                };
                (block, timed_move.time, given_time, Some(timed_move.limit))
            }
        };
        let at = self.timed.program.blocks.len();
        self.timed.moves.push(TimedMove { block: at, axes: m.axes, kind: m.kind, time, given_time, limit });
        self.timed.move_blocks.push(self.timed.program.blocks.len());
        self.timed.program.blocks.push(block);
        self.timed.n_blocks += 1;
        self.at = Some(*m);
        Ok(())
    }

    /// Turns the axis about which the tool points where RTCP is switched on, before the move to the
    /// first position: a vector turned out of that pole would make it jump.
    fn turn_at_pole(&mut self, first: &AxisValues) -> Result<(), Failure> {
        let Some(start) = self.turns_from.take() else { return Ok(()) };
        let direction = |q: &AxisValues| self.machine.cl_point(q, self.tool_length).axis;
        let turned = |k: usize| AxisValues::from_fn(start.len(), |j| if j == k { first[k] } else { start[j] });
        let is_pole = |k: &usize| {
            let axis = &self.machine.axes()[*k];
            let turns = axis.kind == AxisKind::Rotary && first[*k] != start[*k];
            turns && direction(&turned(*k)).angle(&direction(&start)) <= SAME_DIRECTION
        };
        let Some(pole) = (0..start.len()).find(is_pole) else { return Ok(()) };
        let tip = self.machine.cl_point(&start, self.tool_length).tip;
        let turned = self.machine.with_tip_at(&turned(pole), &tip, self.tool_length);
        let turned = turned.ok_or_else(|| Failure::Internal("linear axes that depend on each other".to_owned()))?;
        let words = self.words_of(&turned)?;
        self.timed.program.blocks.push(Block::Rapid { words });
        self.timed.n_blocks += 1;
        Ok(())
    }

    /// Returns the vectors of a feed block; `None` if rotary words replace them.
    fn vectors_of(
        &self,
        operation: &OperationFile,
        m: &Move,
        normal: Option<&Unit<Vector3<f64>>>,
    ) -> Result<Option<CutVectors>, Failure> {
        let (Some(vectors), Some(from)) = (&self.vectors, self.at) else { return Ok(None) };
        match vectors.between(&from.axes, &m.axes, normal) {
            Ok(vectors) => Ok(Some(vectors)),
            Err(_) if vectors.may_take_words => Ok(None),
            Err(why) => Err(Failure::Infeasible(format!(
                "operation \"{}\": at ({:.2}, {:.2}, {:.2}) post.orientation cannot be vectors: {why}; take rotary, or a \
                 dialect file whose vectors stand between rotary words",
                operation.name, m.cl.tip.x, m.cl.tip.y, m.cl.tip.z
            ))),
        }
    }

    /// Adds the time of a feed block; returns its F, the rest of its timing, and its time at the
    /// job's own feeds, s.
    fn timed(&mut self, operation: &OperationFile, m: &Move) -> Result<(f64, BlockFeed, f64), Failure> {
        let from = self.at.ok_or_else(|| Failure::Internal("a program starts with a cut".to_owned()))?;
        let tip_distance = (m.cl.tip - from.cl.tip).norm();
        let programmed = programmed_feed(&operation.feeds, self.teeth, m.kind, m.chip.as_ref());
        let axes = self.machine.axes();
        let range = self.machine.feed_range();
        let feed_at = |tip_feed: f64| {
            feed_for_block(axes, &from.axes, &m.axes, tip_distance, tip_feed, &range)
                .map_err(|e| Failure::Infeasible(format!("operation \"{}\": {e}", operation.name)))
        };
        let feed = feed_at(programmed.mm_min)?;
        let without_chips = || programmed_feed(&operation.feeds, self.teeth, m.kind, None).mm_min;
        let given = if programmed.law == FeedLaw::Given { feed } else { feed_at(without_chips())? };
        if m.kind == MoveKind::Cut {
            let added_time = feed.time - given.time;
            self.timed.cut_feeds.push(CutFeed { programmed, before: given.tip_feed, added_time });
            self.timed.passes_time += feed.time;
            self.timed.passes_feed_time += 60.0 * tip_distance / programmed.mm_min;
            self.timed.passes_length += tip_distance;
            self.timed.tip_feeds.push(feed.tip_feed);
        } else {
            self.timed.approach_time += feed.time;
            self.timed.approach_length += tip_distance;
        }
        let value = match self.feed_mode {
            FeedMode::G94 => feed.f_word,
            // A block without motion takes no time; every rate is right.
            FeedMode::G93 => feed.inverse_time().unwrap_or(1.0),
            FeedMode::Rtcp => feed.tip_feed.max(range.min),
        };
        Ok((value, feed, given.time))
    }

    fn words_of(&self, axes: &AxisValues) -> Result<AxisWords, Failure> {
        let words = match self.feed_mode {
            FeedMode::G94 | FeedMode::G93 => self.words.words(axes.as_slice()),
            FeedMode::Rtcp => {
                let on_table = self.machine.cl_point(axes, self.tool_length).tip;
                let tip = self.table_from_rtcp_words.inverse_transform_point(&on_table);
                self.words.rtcp_words(&tip, axes.as_slice())
            }
        };
        words.map_err(|e| Failure::Internal(e.to_string()))
    }
}
