//! From the text that was read to motions of the axes.

use std::f64::consts::TAU;

use facemill_cl_data::{CuttingLaw, MotionLaw};
use facemill_inverse_kinematics::{AxisKind as JointKind, AxisValues, BlockLaw, Carrier, Machine};
use facemill_nc_program::{
    AxisAt, AxisKind, AxisLengths, AxisLetter, AxisWords, Compensation, Feed, MacroKind, MotionKind, ReadBlock,
    ReadCommand, ReadMotion, ReadProgram, RtcpRapids,
};

use crate::finding::{FindingKind, Measure, TextFault};
use crate::motion::control::Control;
use crate::motion::feeds::Feeds;
use crate::motion::motion_modes::MotionModes;
use crate::motion::rolled_words::RolledWords;
use crate::motion::setup::{VerifySettings, VirtualSetup, own_head};
use crate::motion::spans::LongTurns;
use crate::motion::tool_vectors::{Unturned, turned_to};

/// One motion of the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    /// Index of its block in the program.
    pub(crate) block: usize,
    /// Section of the program, as [`VerifySettings::section_of`] counts.
    pub(crate) section: usize,
    /// What the axes do.
    pub(crate) law: BlockLaw,
    /// Whether it goes at rapid rate.
    pub(crate) is_rapid: bool,
    pub(crate) start: AxisValues,
    pub(crate) end: AxisValues,
    /// `None` for rapids and where the program gives none.
    pub(crate) feed: Option<Feed>,
    /// Whether the tool moves against the work; it stands where the other head alone moves.
    pub(crate) moves_tool: bool,
}

impl Move {
    /// Whether the tool goes at rapid rate: nothing is cut then. Where it stands, it stands where
    /// it has cut.
    pub(crate) fn is_rapid_of_tool(&self) -> bool {
        self.is_rapid && self.moves_tool
    }
}

/// Motions and faults of a program, in its order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    pub(crate) moves: Vec<Move>,
    pub(crate) faults: Vec<TextFault>,
    /// Where the axes are before each block; `None` where the place of one is not known.
    pub(crate) stands: Vec<Option<AxisValues>>,
}

/// Resolves every block. At the start all axes are at home.
pub(crate) fn resolve(program: &ReadProgram, setup: &VirtualSetup<'_>, settings: &VerifySettings) -> Moves {
    let mut state = State::new(setup, program);
    let mut control = Control::new(setup, program);
    control.tool_lengths(program);
    for (index, block) in program.blocks.iter().enumerate() {
        state.section = settings.section_of(block.line);
        let (was_home, before) = (state.is_spindle_home(), state.known_axes());
        state.out.stands.push(before);
        state.block(index, block);
        let is_home = was_home && state.is_spindle_home();
        control.block(index, block, is_home, state.may_cut(is_home, before.as_ref()));
    }
    let mut out = state.out;
    out.faults.extend(control.into_faults());
    out
}

/// How far from its reference position an axis is at it, mm.
const AT_HOME: f64 = 1e-6;

/// How far from 0 a rotary word is 0, rad.
const AT_ZERO: f64 = 1e-6;

struct State<'a> {
    setup: &'a VirtualSetup<'a>,
    /// Machine value that is word 0 with length compensation, per axis.
    compensated_zero: Vec<f64>,
    law: MotionLaw,
    rtcp_rapids: RtcpRapids,
    /// Where the axes are; entries of unknown ones have no meaning.
    axes: AxisValues,
    is_known: Vec<bool>,
    /// Length compensation in force.
    compensation: Compensation,
    /// The same by axis, of several heads.
    lengths: AxisLengths,
    /// What F counts.
    modes: MotionModes,
    feeds: Feeds,
    /// Index of the axis along the spindle of the setup's head; `None` on a machine of one head.
    spindle_axis: Option<usize>,
    section: usize,
    /// Axes that are beyond their limits, and the index of the fault of each.
    beyond: Vec<(usize, usize)>,
    /// Turns of blocks that turn an axis by more than one.
    long_turns: LongTurns,
    /// Where words of axes that count to 360 deg lead.
    rolled: RolledWords,
    /// Index of the fault that goes on where words say no positions.
    unfollowed: Option<usize>,
    out: Moves,
}

/// Why a motion has no end.
enum NoEnd {
    Unknown(AxisLetter),
    Stranger(AxisLetter),
    OtherOffset,
    MixedRtcp(AxisLetter),
    Dependent,
    Unturned(Unturned),
}

impl<'a> State<'a> {
    fn new(setup: &'a VirtualSetup<'a>, program: &ReadProgram) -> Self {
        let own = own_head(setup).map(|head| head.spindle_axis);
        let zeros = AxisWords::from_words(setup.words.axes().iter().map(|a| (a.letter, 0.0))).unwrap_or_default();
        Self {
            setup,
            // Words of all axes and of no others are always joint values; the setup has been
            // checked.
            compensated_zero: setup.words.joints(&zeros).unwrap_or_default(),
            law: setup.machine.motion_law(),
            rtcp_rapids: program.rtcp_rapids,
            axes: setup.machine.home(),
            is_known: vec![true; setup.machine.axes().len()],
            compensation: Compensation::Off,
            lengths: AxisLengths::default(),
            feeds: Feeds::new(program.dialect),
            modes: MotionModes::new(setup.machine.motion_law(), program),
            spindle_axis: setup.words.axes().iter().position(|a| Some(a.letter) == own),
            section: 0,
            beyond: Vec::new(),
            long_turns: LongTurns::default(),
            rolled: RolledWords::default(),
            unfollowed: None,
            out: Moves::default(),
        }
    }

    fn block(&mut self, index: usize, block: &ReadBlock) {
        for command in &block.commands {
            if let ReadCommand::Macro { kind: MacroKind::NotFollowed, text } = command {
                self.not_followed(index, text);
            } else if let Some(note) = self.unresolved(command, block.compensation) {
                self.fault(FindingKind::UnknownBlock, index, None, note);
            }
        }
        self.feeds.read(block);
        for note in self.modes.strange(block) {
            self.fault(FindingKind::OtherMotion, index, None, note);
        }
        self.start_rtcp(index, block);
        self.cancel(index, block);
        let Some(motion) = &block.motion else { return };
        self.unfollowed = None;
        let unsimulated = match motion.kind {
            MotionKind::Arc { .. } => Some("arcs are not simulated"),
            MotionKind::Cycle { .. } => Some("cycles are not simulated"),
            _ => None,
        };
        if let Some(note) = unsimulated {
            self.fault(FindingKind::UnknownBlock, index, None, note.into());
        }
        if motion.kind == MotionKind::ReferenceReturn && matches!(motion.compensation, Compensation::Rtcp(_)) {
            self.home_under_rtcp(index, motion);
            return self.rolled.go_on(motion);
        }
        if let Some(via) = &motion.via {
            let end = self.words_end(motion, |letter| via.get(letter).map(AxisAt::Word));
            self.go(index, motion, end, unsimulated.is_none());
        }
        let end = match motion.compensation {
            Compensation::Rtcp(_) => self.rtcp_end(motion),
            _ => self.words_end(motion, |letter| motion.position.get(letter)),
        };
        self.go(index, motion, end, unsimulated.is_none());
        self.rolled.go_on(motion);
    }

    /// Under RTCP words count in a frame that controls fix to the table as it stands where RTCP is
    /// switched on. The frame of the setup is that of rotary words 0.
    fn start_rtcp(&mut self, index: usize, block: &ReadBlock) {
        let is_on = |c: Compensation| matches!(c, Compensation::Rtcp(_));
        if is_on(self.compensation) || !is_on(block.compensation) {
            return;
        }
        let words = self.setup.words.axes();
        let turned = (0..words.len()).find(|&k| {
            let axis = &self.setup.machine.axes()[k];
            let told = block.motion.as_ref().and_then(|m| m.position.get(words[k].letter));
            let told = if let Some(AxisAt::Word(word)) = told { word.to_radians() } else { 0.0 };
            // Controls differ in whether a turn in the same block counts.
            let turn = told.abs().max((self.axes[k] - words[k].offset).abs());
            // Counted to 360 deg, the word of whole turns is 0.
            let turn = if axis.rolls_over() { turn.min((turn - TAU * (turn / TAU).round()).abs()) } else { turn };
            axis.carried_by == Carrier::Table && words[k].letter.kind() == AxisKind::Rotary && turn > AT_ZERO
        });
        if let Some(k) = turned {
            let note = "RTCP is switched on with the table turned: controls count X, Y and Z in the frame that the table \
                        has here; turn it to 0 before";
            self.fault(FindingKind::UnknownPosition, index, Some(words[k].letter), note.to_owned());
        }
    }

    /// Takes note of the compensation behind a block, and of a cancellation that may move an axis.
    ///
    /// Some controls take the length off at once, as a motion by the tool's length, and others with
    /// the next word. It is safe where the axis along the spindle is at its reference position, or
    /// where the block itself says where the axes go: then they go there in either case.
    fn cancel(&mut self, index: usize, block: &ReadBlock) {
        let lengths = std::mem::replace(&mut self.lengths, block.lengths);
        let before = std::mem::replace(&mut self.compensation, block.compensation);
        if self.spindle_axis.is_some() {
            return self.cancel_of_heads(index, block, lengths);
        }
        if before == Compensation::Off || block.compensation != Compensation::Off {
            return;
        }
        let is_told = |k: &usize| {
            let letter = self.setup.words.axes()[*k].letter;
            block.motion.as_ref().is_some_and(|m| m.position.is_programmed(letter))
        };
        if !self.is_spindle_home() && !self.lengthened(before).all(|k| is_told(&k)) {
            let note = "send the spindle axis home (G91 G28) before: some controls move it by the tool's length here";
            self.fault(FindingKind::UnsafeCancel, index, None, note.to_owned());
        }
    }

    /// The same for each head, whichever the setup is of: what one axis does, the other head may be
    /// in the way of.
    fn cancel_of_heads(&mut self, index: usize, block: &ReadBlock, before: AxisLengths) {
        for (letter, _) in before.iter().filter(|(letter, _)| block.lengths.register_of(*letter).is_none()) {
            let axis = self.setup.words.axes().iter().position(|a| a.letter == letter);
            let is_told = block.motion.as_ref().is_some_and(|m| m.position.is_programmed(letter));
            if !is_told && !axis.is_some_and(|k| self.is_home(k)) {
                let note = "send this axis home (G91 G28) before: some controls move it by the tool's length here";
                self.fault(FindingKind::UnsafeCancel, index, Some(letter), note.to_owned());
            }
        }
    }

    /// Whether every axis along the spindle is at its reference position; of several heads that of
    /// the setup's.
    fn is_spindle_home(&self) -> bool {
        match self.spindle_axis {
            Some(k) => self.is_home(k),
            None => self.lengthened(Compensation::Length(0)).all(|k| self.is_home(k)),
        }
    }

    fn is_home(&self, axis: usize) -> bool {
        let home = self.setup.machine.axes()[axis].home;
        self.is_known[axis] && (self.axes[axis] - home).abs() <= AT_HOME
    }

    /// Where the axes are, where that of all is known.
    fn known_axes(&self) -> Option<AxisValues> {
        self.is_known.iter().all(|&known| known).then_some(self.axes)
    }

    /// Whether a feed move from `before` to here may cut. Of several heads one may stand while the
    /// other cuts, or be away from the work while the table turns: then its spindle need not turn.
    fn may_cut(&self, is_home: bool, before: Option<&AxisValues>) -> bool {
        let (Some(before), Some(here)) = (before, self.known_axes()) else { return true };
        self.spindle_axis.is_none() || moves_tool(self.setup.machine, before, &here) && !is_home
    }

    /// Indices of the axes whose words hold the tool's length: those along the spindle, or all
    /// linear ones with RTCP.
    fn lengthened(&self, compensation: Compensation) -> impl Iterator<Item = usize> + '_ {
        let axes = self.setup.words.axes();
        let is_rtcp = matches!(compensation, Compensation::Rtcp(_));
        let largest = axes.iter().map(|a| a.along_spindle.abs()).fold(0.0, f64::max);
        let holds = move |k: &usize| is_rtcp || axes[*k].along_spindle.abs() >= 0.5 * largest;
        (0..axes.len()).filter(|&k| axes[k].letter.kind() == AxisKind::Linear).filter(holds)
    }

    /// A reference return while words are the tip's: the axes that go home go alone, directly.
    fn home_under_rtcp(&mut self, index: usize, motion: &ReadMotion) {
        if motion.via.is_some() {
            let note = "a way to the reference position over a point under RTCP is not simulated".to_owned();
            self.fault(FindingKind::UnknownBlock, index, None, note);
            self.is_known.fill(false);
            return;
        }
        let spindle: Vec<AxisLetter> =
            self.lengthened(Compensation::Length(0)).map(|k| self.setup.words.axes()[k].letter).collect();
        let is_other = |letter: &AxisLetter| motion.position.is_programmed(*letter) && !spindle.contains(letter);
        if let Some(letter) = self.setup.words.axes().iter().map(|a| a.letter).find(is_other) {
            let note =
                "goes home with RTCP on: send the spindle axis home alone, then switch RTCP off (G49)".to_owned();
            self.fault(FindingKind::RtcpLeftOn, index, Some(letter), note);
        }
        let home = |at: AxisAt| matches!(at, AxisAt::Reference(_)).then_some(at);
        let end = self.words_end(motion, |letter| motion.position.get(letter).and_then(home));
        self.go(index, motion, end, true);
    }

    /// Words say no positions, for this reason: told once, from the first block to the last.
    fn not_followed(&mut self, index: usize, why: &str) {
        self.is_known.fill(false);
        match self.unfollowed.filter(|&k| self.out.faults[k].note == why) {
            Some(k) => self.out.faults[k].last = index,
            None => {
                self.unfollowed = Some(self.out.faults.len());
                self.fault(FindingKind::UnknownBlock, index, None, why.to_owned());
            }
        }
    }

    /// What a command does that is not followed here; forgets the axes it may move.
    fn unresolved(&mut self, command: &ReadCommand, compensation: Compensation) -> Option<String> {
        match command {
            // Under RTCP its motion is followed.
            ReadCommand::Macro { kind: MacroKind::ToolVector, .. } => {
                let is_followed = matches!(compensation, Compensation::Rtcp(_));
                self.is_known.iter_mut().for_each(|known| *known &= is_followed);
                (!is_followed).then(|| "a tool vector without RTCP: what it does to the axes is not followed".into())
            }
            ReadCommand::Macro { kind: MacroKind::Call | MacroKind::VariableWords, .. } => {
                self.is_known.fill(false);
                Some("may move any axis; words are read on from here as if it did not change offsets".into())
            }
            ReadCommand::Macro { kind: MacroKind::Setting, .. } => {
                Some("may change offsets, which are taken from the setup alone".into())
            }
            _ => None,
        }
    }

    /// Axis values at the end of a motion whose linear words are the axes' own.
    fn words_end(&self, motion: &ReadMotion, at: impl Fn(AxisLetter) -> Option<AxisAt>) -> Result<AxisValues, NoEnd> {
        self.check_frame(motion)?;
        let is_compensated = |k: usize| match motion.compensation {
            // Of what is not clear there is a finding; axes go on as if it were the right length.
            _ if self.spindle_axis.is_some() && motion.lengths.is_clear() => {
                motion.lengths.register_of(self.setup.words.axes()[k].letter).is_some()
            }
            Compensation::Off => false,
            Compensation::Length(_) | Compensation::Rtcp(_) => true,
        };
        let zero = |k: usize| {
            if is_compensated(k) { self.compensated_zero[k] } else { self.setup.words.axes()[k].offset }
        };
        let mut end = self.axes;
        for (k, axis) in self.setup.words.axes().iter().enumerate() {
            let (own, from) = (&self.setup.machine.axes()[k], self.axes[k]);
            match at(axis.letter) {
                Some(AxisAt::Word(word)) => {
                    end[k] = self.rolled.value(own, (motion, axis.letter), word, zero(k), from);
                }
                Some(AxisAt::Machine(value)) => {
                    end[k] = RolledWords::place(own, joint_unit(axis.letter, value), from);
                }
                Some(AxisAt::Reference(1)) => end[k] = RolledWords::place(own, own.home, from),
                Some(AxisAt::Reference(_)) => return Err(NoEnd::Unknown(axis.letter)),
                // Not named: it stays where it is.
                None if self.is_known[k] && !is_sent_anywhere(motion, axis.letter) => {}
                None => return Err(NoEnd::Unknown(axis.letter)),
            }
        }
        Ok(end)
    }

    /// Axis values at the end of a motion whose linear words are the tip's.
    fn rtcp_end(&self, motion: &ReadMotion) -> Result<AxisValues, NoEnd> {
        self.check_frame(motion)?;
        let (machine, length) = (self.setup.machine, self.setup.tool.gauge_length());
        let words_from_table = self.setup.table_from_rtcp_words.inverse();
        let all_known = self.is_known.iter().all(|&known| known);
        let mut tip = words_from_table * machine.cl_point(&self.axes, length).tip;
        let mut rotaries = self.axes;
        let vector = motion.tool.as_ref().and_then(|tool| tool.axis);
        for (k, axis) in self.setup.words.axes().iter().enumerate() {
            let coordinate = "XYZ".find(axis.letter.letter()).filter(|_| axis.letter.number() == 0);
            match (motion.position.get(axis.letter), coordinate) {
                (None, _) if is_sent_anywhere(motion, axis.letter) => return Err(NoEnd::Unknown(axis.letter)),
                (Some(AxisAt::Word(word)), Some(coordinate)) => tip[coordinate] = word,
                // A coordinate of the tip stays only where the tip is known, a rotary axis where it
                // is.
                (None, Some(_)) if all_known => {}
                (None, None) if self.is_known[k] => {}
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
        let tip = self.setup.table_from_rtcp_words * tip;
        if let Some(vector) = vector {
            return turned_to(self.setup, &self.axes, tip, vector).map_err(NoEnd::Unturned);
        }
        machine.with_tip_at(&rotaries, &tip, length).ok_or(NoEnd::Dependent)
    }

    fn check_frame(&self, motion: &ReadMotion) -> Result<(), NoEnd> {
        let words = self.setup.words;
        for (letter, at) in motion.position.iter() {
            if words.axes().iter().all(|a| a.letter != letter) {
                return Err(NoEnd::Stranger(letter));
            }
            if matches!(at, AxisAt::Word(_)) && motion.work_offset != words.work_offset() {
                return Err(NoEnd::OtherOffset);
            }
        }
        Ok(())
    }

    fn go(&mut self, index: usize, motion: &ReadMotion, end: Result<AxisValues, NoEnd>, is_simulated: bool) {
        let end = match end {
            Ok(end) => end,
            Err(why) => return self.lost(index, motion, &why),
        };
        let was_known = self.is_known.iter().all(|&known| known);
        let start = std::mem::replace(&mut self.axes, end);
        self.is_known.fill(true);
        if !was_known {
            let note = "starts where the program does not say".to_owned();
            self.fault(FindingKind::UnknownPosition, index, None, note);
        } else if self.is_beyond_limits(index, [&start, &end]) || self.winds_too_far(index, motion, [&start, &end]) {
            // It has a finding, and no way: that could be of any length.
        } else if is_simulated && start != end {
            let (law, is_rapid) = (self.law(motion), motion.kind.is_rapid());
            let section = self.section;
            let feed = motion.feed.and_then(|feed| {
                let found = self.feeds.over_all_axes(self.setup.machine, feed, motion.feed_unit, [&start, &end]);
                found.map_err(|why| why.map(|note| self.fault(FindingKind::NoFeed, index, None, note))).ok()
            });
            // A motion of no axis is as it always was: one of the tool.
            let moves_tool = start == end || moves_tool(self.setup.machine, &start, &end);
            self.out.moves.push(Move { block: index, section, law, is_rapid, start, end, feed, moves_tool });
        }
    }

    /// Whether a motion starts or ends beyond the limits of an axis, which is a fault from the
    /// first such block to the one that leads back. Nothing of it is run: no machine goes there,
    /// and its way is as long as the text makes it.
    fn is_beyond_limits(&mut self, index: usize, [start, end]: [&AxisValues; 2]) -> bool {
        let machine = self.setup.machine;
        let was_beyond = excesses(machine, start).next().is_some();
        let before = std::mem::take(&mut self.beyond);
        for &(_, fault) in before.iter().filter(|_| was_beyond) {
            self.out.faults[fault].last = index;
        }
        for (axis, measure) in excesses(machine, end) {
            let fault = before.iter().find(|(k, _)| was_beyond && *k == axis).map(|(_, fault)| *fault);
            let fault = fault.unwrap_or_else(|| {
                let letter = self.setup.words.axes().get(axis).map(|a| a.letter);
                let note = "not run, and what follows is not known, until all axes are back within their limits";
                self.fault(FindingKind::AxisLimit, index, letter, note.to_owned());
                self.out.faults.len() - 1
            });
            self.beyond.push((axis, fault));
            let fault = &mut self.out.faults[fault];
            if fault.measure.is_none_or(|worst| measure.is_worse_than(&worst)) {
                (fault.worst, fault.measure) = (index, Some(measure));
            }
        }
        was_beyond || !self.beyond.is_empty()
    }

    /// Whether a motion turns an axis more often than is followed, which is a fault.
    fn winds_too_far(&mut self, index: usize, motion: &ReadMotion, ends: [&AxisValues; 2]) -> bool {
        let (machine, length) = (self.setup.machine, self.setup.tool.gauge_length());
        let why = self.long_turns.add(machine, self.law(motion), ends, length);
        let winds = why.is_some();
        if let Some(why) = why {
            self.fault(FindingKind::UnknownBlock, index, None, why);
        }
        winds
    }

    /// A motion with an unknown end: the axes that it names are lost.
    fn lost(&mut self, index: usize, motion: &ReadMotion, why: &NoEnd) {
        let (kind, axis, note) = match why {
            NoEnd::Unknown(a) => {
                (FindingKind::UnknownPosition, Some(*a), "the program does not say where the axis is".to_owned())
            }
            NoEnd::Stranger(a) => (FindingKind::UnknownBlock, Some(*a), "the machine has no such axis".to_owned()),
            NoEnd::OtherOffset => {
                let (found, expected) = (motion.work_offset, self.setup.words.work_offset());
                (FindingKind::UnknownPosition, None, format!("refers to {found}, the setup knows {expected}"))
            }
            NoEnd::MixedRtcp(a) => {
                let note = "stands at a machine position while words are the tip's".to_owned();
                (FindingKind::UnknownPosition, Some(*a), note)
            }
            NoEnd::Dependent => {
                let note = "the linear axes cannot bring the tip there".to_owned();
                (FindingKind::ReachFailure, None, note)
            }
            NoEnd::Unturned(why) => why.finding(),
        };
        self.fault(kind, index, axis, note);
        for (k, axis) in self.setup.words.axes().iter().enumerate() {
            // Every word is taken as lost, because a word that stays may be of another frame.
            let is_turned = matches!(why, NoEnd::Unturned(_)) && axis.letter.kind() == AxisKind::Rotary;
            let is_lost =
                motion.position.get(axis.letter).is_some() || is_sent_anywhere(motion, axis.letter) || is_turned;
            self.is_known[k] &= !is_lost;
        }
    }

    /// Without RTCP all axes go together, whatever the machine's law under RTCP is; with it the tip
    /// goes straight, on some controls at rapid rate, too. A way to the reference position is
    /// always the axes' own.
    fn law(&self, motion: &ReadMotion) -> BlockLaw {
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        let keeps_tip = is_rtcp && self.rtcp_rapids == RtcpRapids::TipLinear && motion.kind == MotionKind::Rapid;
        if motion.kind.is_rapid() && !keeps_tip {
            return BlockLaw::Rapid(self.law.rapid);
        }
        BlockLaw::Cutting(match (motion.compensation, self.law.cutting) {
            (Compensation::Off | Compensation::Length(_), _) => CuttingLaw::AxesLinear,
            (Compensation::Rtcp(_), CuttingLaw::AxesLinear) => CuttingLaw::TipAndRotariesLinear,
            (Compensation::Rtcp(_), law) => law,
        })
    }

    fn fault(&mut self, kind: FindingKind, block: usize, axis: Option<AxisLetter>, note: String) {
        self.out.faults.push(TextFault { kind, block, last: block, worst: block, axis, measure: None, note });
    }
}

/// How far beyond a limit an axis may be told to go by the rounding of words, mm or deg.
pub(crate) const LIMIT_ROUNDING: f64 = 1e-3;

/// By how much axes are beyond their limits, with their indices.
pub(crate) fn excesses<'a>(machine: &'a Machine, q: &'a AxisValues) -> impl Iterator<Item = (usize, Measure)> + 'a {
    machine.axes().iter().enumerate().filter_map(|(k, axis)| {
        let excess = axis.in_word_unit((q[k] - axis.max).max(axis.min - q[k]));
        let measure = match axis.kind {
            JointKind::Linear => Measure::ExcessMm(excess),
            JointKind::Rotary => Measure::ExcessDeg(excess),
        };
        (excess > LIMIT_ROUNDING).then_some((k, measure))
    })
}

/// Whether a block sends an axis to a place that its reader does not know: it must not be taken to
/// stay.
fn is_sent_anywhere(motion: &ReadMotion, letter: AxisLetter) -> bool {
    motion.position.is_programmed(letter) && motion.position.get(letter).is_none()
}

/// Whether an axis moves that is not the other head's.
fn moves_tool(machine: &Machine, start: &AxisValues, end: &AxisValues) -> bool {
    (0..start.len()).any(|k| machine.moves_tool(k) && start[k] != end[k])
}

fn joint_unit(letter: AxisLetter, word: f64) -> f64 {
    if letter.kind() == AxisKind::Rotary { word.to_radians() } else { word }
}
