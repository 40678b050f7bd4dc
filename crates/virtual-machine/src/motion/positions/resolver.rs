//! Words of a program → positions of the axes. Verification, stock, links, times and feeds all take
//! positions from here.

use std::f64::consts::TAU;

use facemill_cl_data::CuttingLaw;
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Carrier, Machine};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::read::{AxisAt, Compensation, MacroKind, MotionKind, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::words::AxisKind;
use facemill_nc_program::{AxisLetter, WordMap, WorkOffset};
use nalgebra::Isometry3;

use crate::motion::positions::rolled_words::RolledWords;
use crate::motion::positions::tool_vectors::{Unturned, turned_to};
use crate::motion::setup::VirtualSetup;

/// Machine, tool and frames by which words become positions of the axes.
#[derive(Clone, Copy)]
pub struct MotionContext<'a> {
    /// The machine, of two heads as one of them sees it.
    pub machine: &'a Machine,
    /// Distance from the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Words of the axes.
    pub words: &'a WordMap,
    /// Table frame ← frame of the tip's words under RTCP; `None` for a machine without X, Y and Z
    /// at right angles.
    pub frame: Option<Isometry3<f64>>,
    /// Work offset that the words refer to; `None` for the first one that the program names.
    pub work_offset: Option<WorkOffset>,
}

impl<'a> MotionContext<'a> {
    /// Context of a setup.
    pub(crate) fn of(setup: &VirtualSetup<'a>) -> Self {
        Self {
            machine: setup.machine,
            tool_length: setup.tool.gauge_length(),
            words: setup.words,
            frame: setup.table_from_rtcp_words,
            work_offset: Some(setup.words.work_offset()),
        }
    }
}

/// Knowledge of an axis position, the least first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Knowledge {
    /// The axis may be anywhere.
    Unknown,
    /// The axis is assumed to be at home, where a program begins.
    Home,
    /// The program has named a position.
    Programmed,
}

/// One straight part of a motion.
pub(crate) struct Leg {
    /// Where it begins; without meaning where an axis was unknown.
    pub(crate) from: AxisValues,
    /// Least knowledge of any axis at `from`.
    pub(crate) knowledge: Knowledge,
    /// Where it ends.
    pub(crate) to: AxisValues,
}

/// Reason why the end of a motion is not known.
pub(crate) enum NoEnd {
    /// Nothing says where this axis is.
    Unknown(AxisLetter),
    /// The machine has no such axis.
    Stranger(AxisLetter),
    /// The words refer to another work offset.
    OtherOffset {
        /// That of the block.
        found: WorkOffset,
        /// That of the words.
        expected: WorkOffset,
    },
    /// A machine position beside words of the tip.
    MixedRtcp(AxisLetter),
    /// The linear axes cannot bring the tip to its place.
    Dependent,
    /// The rotary axes cannot be found for a tool vector.
    Unturned(Unturned),
    /// Words are the tip's on a machine without X, Y and Z at right angles.
    NoFrame,
    /// A reference return over a point under RTCP.
    ViaUnderRtcp,
}

/// Axis positions of a program, block by block. All axes begin at home.
pub(crate) struct MotionResolver<'a> {
    context: MotionContext<'a>,
    /// Machine value that is word 0 with length compensation, per axis.
    compensated_zero: Vec<f64>,
    rapids: RtcpRapids,
    /// Words of axes that count to 360 deg.
    rolled: RolledWords,
    /// Length compensation behind the last block.
    compensation: Compensation,
    axes: AxisValues,
    known: Vec<Knowledge>,
}

/// Note where RTCP is switched on with the table turned.
pub(crate) const TURNED_TABLE: &str = "RTCP is switched on with the table turned: controls count X, Y and Z in the frame \
                                       that the table has here; turn it to 0 before";

/// Smallest turn of a table axis that counts as one, rad.
const AT_ZERO: f64 = 1e-6;

impl<'a> MotionResolver<'a> {
    /// Begins a program with all axes at home.
    pub(crate) fn new(context: MotionContext<'a>, rapids: RtcpRapids) -> Self {
        let axes = context.machine.home();
        Self {
            context,
            compensated_zero: context.words.compensated_zeros(),
            rapids,
            rolled: RolledWords::default(),
            compensation: Compensation::Off,
            axes,
            known: vec![Knowledge::Home; axes.len()],
        }
    }

    /// Positions of the axes; those of unknown ones have no meaning.
    pub(crate) fn axes(&self) -> &AxisValues {
        &self.axes
    }

    /// Positions of the axes, if all are known.
    pub(crate) fn known_axes(&self) -> Option<AxisValues> {
        (self.knowledge() > Knowledge::Unknown).then_some(self.axes)
    }

    /// Whether the position of an axis is known.
    pub(crate) fn is_known(&self, axis: usize) -> bool {
        self.known[axis] > Knowledge::Unknown
    }

    /// Least knowledge of any axis.
    pub(crate) fn knowledge(&self) -> Knowledge {
        self.known.iter().copied().min().unwrap_or(Knowledge::Programmed)
    }

    /// Length compensation behind the last block.
    pub(crate) fn compensation(&self) -> Compensation {
        self.compensation
    }

    /// Forgets all positions, until the program names them.
    pub(crate) fn forget(&mut self) {
        self.known.fill(Knowledge::Unknown);
    }

    /// Forgets positions that commands of a block may change before its motion, and takes note of
    /// its compensation. Returns the table axis that is turned where the block switches RTCP on.
    ///
    /// Controls fix the frame of words under RTCP to the table as it is there; the frame of the
    /// context is that of rotary words 0. From such a block on, positions are not those of the
    /// control.
    pub(crate) fn begin_block(&mut self, block: &ReadBlock) -> Option<AxisLetter> {
        for command in &block.commands {
            if may_move(command, block.compensation) {
                self.forget();
            }
        }
        let was_on = is_rtcp(self.compensation);
        self.compensation = block.compensation;
        (!was_on && is_rtcp(block.compensation)).then(|| self.turned_table(block)).flatten()
    }

    /// Forgets positions that calls of a block change behind its motion. Whether others act before
    /// or behind it, texts do not say.
    pub(crate) fn end_block(&mut self, block: &ReadBlock) {
        let is_call =
            |c: &ReadCommand| matches!(c, ReadCommand::Macro { kind: MacroKind::Call | MacroKind::CallBehind, .. });
        if block.commands.iter().any(is_call) {
            self.forget();
        }
    }

    /// Follows the motion of a block to its via point, where it has one, and to its end: one leg or
    /// two. A leg without an end leaves the axes that it names unknown.
    pub(crate) fn legs(&mut self, motion: &ReadMotion) -> impl Iterator<Item = Result<Leg, NoEnd>> + use<> {
        let has_via = motion.via.as_ref().is_some_and(|via| !via.is_empty());
        let has_words = has_via || motion.position.iter().any(|(_, at)| matches!(at, AxisAt::Word(_)));
        if self.context.work_offset.is_none() && has_words {
            self.context.work_offset = Some(motion.work_offset);
        }
        let via = motion.via.as_ref().filter(|_| !is_home_under_rtcp(motion)).map(|via| {
            let end = self
                .check_offset(motion)
                .and_then(|()| self.words_end(motion, |letter| via.get(letter).map(AxisAt::Word)));
            self.go(motion, end)
        });
        let end = self.end(motion);
        let end = self.go(motion, end);
        self.rolled.go_on(motion);
        [via, Some(end)].into_iter().flatten()
    }

    fn end(&self, motion: &ReadMotion) -> Result<AxisValues, NoEnd> {
        let home = |at: AxisAt| matches!(at, AxisAt::Reference(_)).then_some(at);
        match motion.compensation {
            _ if is_home_under_rtcp(motion) && motion.via.is_some() => Err(NoEnd::ViaUnderRtcp),
            // Words are the tip's: the axes that go home go alone, directly.
            _ if is_home_under_rtcp(motion) => {
                self.words_end(motion, |letter| motion.position.get(letter).and_then(home))
            }
            Compensation::Rtcp(_) => self.rtcp_end(motion),
            _ => self.words_end(motion, |letter| motion.position.get(letter)),
        }
    }

    /// Law of a motion between its positions. Without RTCP all axes go together, whatever the
    /// machine's law under RTCP is; with it the tip goes straight, on some controls at rapid rate,
    /// too. A way to the reference position is always the axes' own.
    pub(crate) fn law(&self, motion: &ReadMotion) -> BlockLaw {
        let law = self.context.machine.motion_law();
        let keeps_tip =
            is_rtcp(motion.compensation) && self.rapids == RtcpRapids::TipLinear && motion.kind == MotionKind::Rapid;
        if motion.kind.is_rapid() && !keeps_tip {
            return BlockLaw::Rapid(law.rapid);
        }
        BlockLaw::Cutting(match (motion.compensation, law.cutting) {
            (Compensation::Off | Compensation::Length(_), _) => CuttingLaw::AxesLinear,
            (Compensation::Rtcp(_), CuttingLaw::AxesLinear) => CuttingLaw::TipAndRotariesLinear,
            (Compensation::Rtcp(_), law) => law,
        })
    }

    fn go(&mut self, motion: &ReadMotion, end: Result<AxisValues, NoEnd>) -> Result<Leg, NoEnd> {
        match end {
            Ok(to) => {
                let knowledge = self.knowledge();
                let from = std::mem::replace(&mut self.axes, to);
                for (k, axis) in self.context.words.axes().iter().enumerate() {
                    // A vector turns rotary axes to positions that follow from those before.
                    let is_named = motion.position.get(axis.letter).is_some();
                    self.known[k] = if is_named { Knowledge::Programmed } else { self.known[k].max(Knowledge::Home) };
                }
                Ok(Leg { from, knowledge, to })
            }
            Err(why) => {
                self.lose(motion, &why);
                Err(why)
            }
        }
    }

    /// Every word is taken as lost, because a word that stays may be of another frame.
    fn lose(&mut self, motion: &ReadMotion, why: &NoEnd) {
        // Under RTCP linear axes that the block does not name move with the rotary ones.
        if is_rtcp(motion.compensation) {
            return self.forget();
        }
        for (k, axis) in self.context.words.axes().iter().enumerate() {
            let is_turned = matches!(why, NoEnd::Unturned(_)) && axis.letter.kind() == AxisKind::Rotary;
            if is_turned || motion.position.get(axis.letter).is_some() || is_sent_anywhere(motion, axis.letter) {
                self.known[k] = Knowledge::Unknown;
            }
        }
    }

    /// The table axis that is turned at a block, before it or by its own words: controls differ in
    /// whether a turn in the block that switches RTCP on counts.
    fn turned_table(&self, block: &ReadBlock) -> Option<AxisLetter> {
        let words = self.context.words.axes();
        let turned = (0..words.len()).find(|&k| {
            let axis = &self.context.machine.axes()[k];
            let named = block.motion.as_ref().and_then(|m| m.position.get(words[k].letter));
            let named = if let Some(AxisAt::Word(word)) = named { word.to_radians() } else { 0.0 };
            let turn = named.abs().max((self.axes[k] - words[k].offset).abs());
            // Counted to 360 deg, the word of whole turns is 0.
            let turn = if axis.rolls_over() { turn.min((turn - TAU * (turn / TAU).round()).abs()) } else { turn };
            let may_be_turned = !self.is_known(k) || turn > AT_ZERO;
            axis.carried_by == Carrier::Table && words[k].letter.kind() == AxisKind::Rotary && may_be_turned
        });
        turned.map(|k| words[k].letter)
    }

    /// Axis values at the end of a motion whose linear words are the axes' own.
    fn words_end(&self, motion: &ReadMotion, at: impl Fn(AxisLetter) -> Option<AxisAt>) -> Result<AxisValues, NoEnd> {
        let words = self.context.words;
        self.check_frame(motion)?;
        let is_compensated = |letter: AxisLetter| match motion.compensation {
            // Unclear lengths are a finding; axes go on as if each were the right one.
            _ if !words.heads().is_empty() && motion.lengths.is_clear() => motion.lengths.register_of(letter).is_some(),
            Compensation::Off => false,
            Compensation::Length(_) | Compensation::Rtcp(_) => true,
        };
        let mut end = self.axes;
        for (k, axis) in words.axes().iter().enumerate() {
            let (own, from) = (&self.context.machine.axes()[k], self.axes[k]);
            match at(axis.letter) {
                Some(AxisAt::Word(word)) => {
                    let zero = if is_compensated(axis.letter) { self.compensated_zero[k] } else { axis.offset };
                    end[k] = self.rolled.value(own, (motion, axis.letter), word, zero, from);
                }
                Some(AxisAt::Machine(value)) => {
                    end[k] = RolledWords::place(own, joint_unit(axis.letter, value), from);
                }
                Some(AxisAt::Reference(1)) => end[k] = RolledWords::place(own, own.home, from),
                Some(AxisAt::Reference(_)) => return Err(NoEnd::Unknown(axis.letter)),
                // Not named: it stays where it is.
                None if self.is_known(k) && !is_sent_anywhere(motion, axis.letter) => {}
                None => return Err(NoEnd::Unknown(axis.letter)),
            }
        }
        Ok(end)
    }

    /// Axis values at the end of a motion whose linear words are the tip's.
    fn rtcp_end(&self, motion: &ReadMotion) -> Result<AxisValues, NoEnd> {
        self.check_frame(motion)?;
        let MotionContext { machine, tool_length, words, frame, .. } = self.context;
        let frame = frame.ok_or(NoEnd::NoFrame)?;
        let all_known = self.knowledge() > Knowledge::Unknown;
        let mut tip = frame.inverse() * machine.cl_point(&self.axes, tool_length).tip;
        let mut rotaries = self.axes;
        let vector = motion.tool.as_ref().and_then(|tool| tool.axis);
        for (k, axis) in words.axes().iter().enumerate() {
            let coordinate = "XYZ".find(axis.letter.letter()).filter(|_| axis.letter.number() == 0);
            // An axis that a former block sent to a machine position, and this one does not name,
            // is there: its rotary word stays, and its coordinate is that of the tip.
            let at = motion.position.get(axis.letter);
            let is_left = matches!(at, Some(AxisAt::Machine(_) | AxisAt::Reference(_)))
                && !motion.position.is_programmed(axis.letter);
            match (at.filter(|_| !is_left), coordinate) {
                (None, _) if is_sent_anywhere(motion, axis.letter) => return Err(NoEnd::Unknown(axis.letter)),
                (Some(AxisAt::Word(word)), Some(coordinate)) => tip[coordinate] = word,
                // A coordinate of the tip stays only where the tip is known, a rotary axis where it
                // is.
                (None, Some(_)) if all_known => {}
                (None, None) if self.is_known(k) => {}
                (Some(_), None) if vector.is_some() => {
                    return Err(NoEnd::Unturned(Unturned::AxisToo(axis.letter)));
                }
                (Some(AxisAt::Word(word)), None) => {
                    let own = &machine.axes()[k];
                    rotaries[k] = self.rolled.value(own, (motion, axis.letter), word, axis.offset, self.axes[k]);
                }
                (None, _) => return Err(NoEnd::Unknown(axis.letter)),
                (Some(_), _) => return Err(NoEnd::MixedRtcp(axis.letter)),
            }
        }
        let tip = frame * tip;
        let Some(vector) = vector else {
            return machine.with_tip_at(&rotaries, &tip, tool_length).ok_or(NoEnd::Dependent);
        };
        turned_to((machine, tool_length), &self.axes, tip, (frame, vector)).map_err(NoEnd::Unturned)
    }

    fn check_frame(&self, motion: &ReadMotion) -> Result<(), NoEnd> {
        for (letter, at) in motion.position.iter() {
            if self.context.words.axes().iter().all(|a| a.letter != letter) {
                return Err(NoEnd::Stranger(letter));
            }
            if matches!(at, AxisAt::Word(_)) {
                self.check_offset(motion)?;
            }
        }
        Ok(())
    }

    /// Checks that the words of a motion refer to the work offset of the context.
    fn check_offset(&self, motion: &ReadMotion) -> Result<(), NoEnd> {
        match self.context.work_offset {
            Some(expected) if motion.work_offset != expected => {
                Err(NoEnd::OtherOffset { found: motion.work_offset, expected })
            }
            _ => Ok(()),
        }
    }
}

/// Whether a command may take axes anywhere before the motion of its block.
fn may_move(command: &ReadCommand, compensation: Compensation) -> bool {
    let ReadCommand::Macro { kind, .. } = command else { return false };
    match kind {
        MacroKind::NotFollowed | MacroKind::Call | MacroKind::VariableWords => true,
        // Under RTCP its motion is followed.
        MacroKind::ToolVector => !is_rtcp(compensation),
        _ => false,
    }
}

/// Whether a block sends an axis to a place that its reader does not know: it must not be taken to
/// stay.
fn is_sent_anywhere(motion: &ReadMotion, letter: AxisLetter) -> bool {
    motion.position.is_programmed(letter) && motion.position.get(letter).is_none()
}

/// Whether a motion goes to a reference position while words are the tip's.
pub(crate) fn is_home_under_rtcp(motion: &ReadMotion) -> bool {
    motion.kind == MotionKind::ReferenceReturn && is_rtcp(motion.compensation)
}

fn is_rtcp(compensation: Compensation) -> bool {
    matches!(compensation, Compensation::Rtcp(_))
}

fn joint_unit(letter: AxisLetter, word: f64) -> f64 {
    if letter.kind() == AxisKind::Rotary { word.to_radians() } else { word }
}
