//! Motions of a program for verification, with the faults of their text.

use facemill_inverse_kinematics::{AxisKind as JointKind, AxisValues, BlockLaw, Machine};
use facemill_nc_program::read::{Compensation, Feed, MacroKind, MotionKind, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::words::{AxisKind, AxisLengths, StateWord};
use facemill_nc_program::{AxisLetter, ReadProgram};

use crate::finding::{FindingKind, Measure, TextFault};
use crate::motion::control::Control;
use crate::motion::feeds::Feeds;
use crate::motion::motion_modes::MotionModes;
use crate::motion::positions::resolver::{
    Knowledge, Leg, MotionContext, MotionResolver, NoEnd, TURNED_TABLE, is_home_under_rtcp,
};
use crate::motion::setup::{VerifySettings, VirtualSetup, own_head};
use crate::motion::spans::LongTurns;

/// One motion of the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    /// Index of its block in the program.
    pub(crate) block: usize,
    /// Section of the program, as [`VerifySettings::section_of`] counts.
    pub(crate) section: usize,
    /// Motion law.
    pub(crate) law: BlockLaw,
    /// Whether it goes at rapid rate.
    pub(crate) is_rapid: bool,
    pub(crate) start: AxisValues,
    pub(crate) end: AxisValues,
    /// `None` for rapids and where the program gives none.
    pub(crate) feed: Option<Feed>,
    /// Whether the tool moves against the work; it rests where the other head alone moves.
    pub(crate) moves_tool: bool,
}

impl Move {
    /// Whether the tool goes at rapid rate: nothing is cut then. A resting tool is where it has
    /// cut.
    pub(crate) fn is_rapid_of_tool(&self) -> bool {
        self.is_rapid && self.moves_tool
    }
}

/// Motions and faults of a program, in its order.
#[derive(Clone, Debug, Default)]
pub(crate) struct ResolvedMoves {
    pub(crate) moves: Vec<Move>,
    pub(crate) faults: Vec<TextFault>,
    /// Where the axes are before each block; `None` where the place of one is not known.
    pub(crate) axes_before: Vec<Option<AxisValues>>,
}

/// Resolves every block. At the start all axes are at home, and they have to be there again where a
/// tool change follows.
pub(crate) fn resolve(program: &ReadProgram, setup: &VirtualSetup<'_>, settings: &VerifySettings) -> ResolvedMoves {
    let mut state = State::new(setup, program);
    let mut control = Control::new(setup, program);
    control.tool_lengths(program);
    for (index, block) in program.blocks.iter().enumerate() {
        state.section = settings.section_of(block.line);
        let (was_home, before) = (state.is_spindle_home(), state.resolver.known_axes());
        state.out.axes_before.push(before);
        state.block(index, block);
        let is_home = was_home && state.is_spindle_home();
        control.block(index, block, is_home, state.may_cut(is_home, before.as_ref()));
    }
    if program.goes_on {
        state.at_tool_change(program);
    }
    let mut out = state.out;
    out.faults.extend(control.into_faults());
    out
}

/// Returns the first fault of a program's text in a setup, with its line: a wrong tool or length,
/// an unknown position or block. `None` if it has none.
#[must_use]
pub fn first_text_fault(program: &ReadProgram, setup: &VirtualSetup<'_>) -> Option<(u32, String)> {
    let faults = resolve(program, setup, &VerifySettings::default()).faults;
    let first = faults.into_iter().filter(|fault| fault.kind.is_fault()).min_by_key(|fault| fault.block)?;
    Some((program.blocks.get(first.block)?.line, first.note))
}

/// How far from its reference position an axis is at it, mm.
const AT_HOME: f64 = 1e-6;

struct State<'a> {
    setup: &'a VirtualSetup<'a>,
    /// Positions of the axes.
    resolver: MotionResolver<'a>,
    /// Length compensation in force by axis, of several heads.
    lengths: AxisLengths,
    /// Axes that F counts.
    modes: MotionModes,
    feeds: Feeds,
    /// Index of the axis along the spindle of the setup's head; `None` on a machine of one head.
    spindle_axis: Option<usize>,
    section: usize,
    /// Axes that are beyond their limits, and the index of the fault of each.
    beyond: Vec<(usize, usize)>,
    /// Turns of blocks that turn an axis by more than one.
    long_turns: LongTurns,
    /// Index of the fault that goes on where words say no positions.
    unfollowed: Option<usize>,
    out: ResolvedMoves,
}

impl<'a> State<'a> {
    fn new(setup: &'a VirtualSetup<'a>, program: &ReadProgram) -> Self {
        let own = own_head(setup).map(|head| head.spindle_axis);
        Self {
            setup,
            resolver: MotionResolver::new(MotionContext::of(setup), program.rtcp_rapids),
            lengths: AxisLengths::default(),
            feeds: Feeds::new(program.dialect),
            modes: MotionModes::new(setup.machine.motion_law(), program),
            spindle_axis: setup.words.axes().iter().position(|a| Some(a.letter) == own),
            section: 0,
            beyond: Vec::new(),
            long_turns: LongTurns::default(),
            unfollowed: None,
            out: ResolvedMoves::default(),
        }
    }

    fn block(&mut self, index: usize, block: &ReadBlock) {
        self.follow(index, block);
        self.resolver.end_block(block);
    }

    fn follow(&mut self, index: usize, block: &ReadBlock) {
        let before = self.resolver.compensation();
        let turned = self.resolver.begin_block(block);
        for command in &block.commands {
            if let ReadCommand::Macro { kind: MacroKind::NotFollowed, text } = command {
                self.not_followed(index, text);
            } else if let Some(note) = unresolved(command, block.compensation) {
                self.fault(FindingKind::UnknownBlock, index, None, note.to_owned());
            }
        }
        self.feeds.read(block);
        for note in self.modes.strange(block) {
            self.fault(FindingKind::OtherMotion, index, None, note);
        }
        if let Some(letter) = turned {
            self.fault(FindingKind::UnknownPosition, index, Some(letter), TURNED_TABLE.to_owned());
        }
        self.cancel(index, block, before);
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
        if is_home_under_rtcp(motion) && motion.via.is_none() {
            self.home_under_rtcp(index, motion);
        }
        for leg in self.resolver.legs(motion) {
            match leg {
                Ok(leg) => self.leg(index, motion, &leg, unsimulated.is_none()),
                Err(why) => self.lost(index, &why),
            }
        }
    }

    /// Takes note of the compensation behind a block, and of a cancellation that may move an axis.
    ///
    /// Some controls take the length off at once, as a motion by the tool's length, and others with
    /// the next word. It is safe where the axis along the spindle is at its reference position, or
    /// where the block itself says where the axes go: then they go there in either case.
    fn cancel(&mut self, index: usize, block: &ReadBlock, before: Compensation) {
        let lengths = std::mem::replace(&mut self.lengths, block.lengths);
        if self.spindle_axis.is_some() {
            return self.cancel_of_heads(index, block, lengths);
        }
        if before == Compensation::Off || block.compensation != Compensation::Off {
            return;
        }
        let is_programmed = |k: &usize| {
            let letter = self.setup.words.axes()[*k].letter;
            block.motion.as_ref().is_some_and(|m| m.position.is_programmed(letter))
        };
        if !self.is_spindle_home() && !self.lengthened(before).all(|k| is_programmed(&k)) {
            let note = "send the spindle axis home (G91 G28) before: some controls move it by the tool's length here";
            self.fault(FindingKind::UnsafeCancel, index, None, note.to_owned());
        }
    }

    /// The same for each head, whichever the setup is of: what one axis does, the other head may be
    /// in the way of.
    fn cancel_of_heads(&mut self, index: usize, block: &ReadBlock, before: AxisLengths) {
        for (letter, _) in before.iter().filter(|(letter, _)| block.lengths.register_of(*letter).is_none()) {
            let axis = self.setup.words.axes().iter().position(|a| a.letter == letter);
            let is_programmed = block.motion.as_ref().is_some_and(|m| m.position.is_programmed(letter));
            if !is_programmed && !axis.is_some_and(|k| self.is_home(k)) {
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

    /// Reports axes away from home, RTCP, and an end of the program in a part that a tool change
    /// follows: the part behind it is run from the reference position.
    fn at_tool_change(&mut self, program: &ReadProgram) {
        let Some(last) = program.blocks.len().checked_sub(1) else { return };
        if let Some(k) = (0..self.setup.machine.axes().len()).find(|&k| !self.is_home(k)) {
            let letter = self.setup.machine.axes()[k].letter.to_string();
            let note = format!(
                "axis {letter} is not at its reference position where a tool change follows: send all axes home before it"
            );
            self.fault(FindingKind::UnsafeToolChange, last, None, note);
        }
        let ends = |b: &ReadBlock| b.commands.contains(&ReadCommand::End) && !b.said.has(StateWord::Return);
        if let Some(end) = program.blocks.iter().position(ends) {
            let note = "the program ends here, and a tool change follows: nothing behind it is run".to_owned();
            self.fault(FindingKind::BehindEnd, end, None, note);
        }
        if matches!(program.blocks[last].compensation, Compensation::Rtcp(_)) {
            let note = "RTCP is on where a tool change follows: switch it off on the way home".to_owned();
            self.fault(FindingKind::RtcpLeftOn, last, None, note);
        }
    }

    fn is_home(&self, axis: usize) -> bool {
        let home = self.setup.machine.axes()[axis].home;
        self.resolver.is_known(axis) && (self.resolver.axes()[axis] - home).abs() <= AT_HOME
    }

    /// Whether a feed move from `before` to here may cut. Of several heads one may stand while the
    /// other cuts, or be away from the work while the table turns: then its spindle need not turn.
    fn may_cut(&self, is_home: bool, before: Option<&AxisValues>) -> bool {
        let (Some(before), Some(here)) = (before, self.resolver.known_axes()) else { return true };
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

    /// A reference return while words are the tip's is safe for the axis along the spindle alone.
    fn home_under_rtcp(&mut self, index: usize, motion: &ReadMotion) {
        let words = self.setup.words;
        let spindle: Vec<AxisLetter> =
            self.lengthened(Compensation::Length(0)).map(|k| words.axes()[k].letter).collect();
        let is_other = |letter: &AxisLetter| motion.position.is_programmed(*letter) && !spindle.contains(letter);
        if let Some(letter) = words.axes().iter().map(|a| a.letter).find(is_other) {
            let note =
                "goes home with RTCP on: send the spindle axis home alone, then switch RTCP off (G49)".to_owned();
            self.fault(FindingKind::RtcpLeftOn, index, Some(letter), note);
        }
    }

    /// Reason why words give no positions: reported once, from the first block to the last.
    fn not_followed(&mut self, index: usize, why: &str) {
        match self.unfollowed.filter(|&k| self.out.faults[k].note == why) {
            Some(k) => self.out.faults[k].last = index,
            None => {
                self.unfollowed = Some(self.out.faults.len());
                self.fault(FindingKind::UnknownBlock, index, None, why.to_owned());
            }
        }
    }

    fn leg(&mut self, index: usize, motion: &ReadMotion, leg: &Leg, is_simulated: bool) {
        let (start, end) = (leg.from, leg.to);
        if leg.knowledge == Knowledge::Unknown {
            let note = "starts where the program does not say".to_owned();
            self.fault(FindingKind::UnknownPosition, index, None, note);
        } else if self.is_beyond_limits(index, [&start, &end]) || self.winds_too_far(index, motion, [&start, &end]) {
            // It has a finding, and no way: that could be of any length.
        } else if is_simulated && start != end {
            let (law, is_rapid) = (self.resolver.law(motion), motion.kind.is_rapid());
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
        let why = self.long_turns.add(machine, self.resolver.law(motion), ends, length);
        let winds = why.is_some();
        if let Some(why) = why {
            self.fault(FindingKind::UnknownBlock, index, None, why);
        }
        winds
    }

    /// Adds the fault of a motion with an unknown end.
    fn lost(&mut self, index: usize, why: &NoEnd) {
        let (kind, axis, note) = match why {
            NoEnd::Unknown(a) => {
                (FindingKind::UnknownPosition, Some(*a), "the program does not say where the axis is".to_owned())
            }
            NoEnd::Stranger(a) => (FindingKind::UnknownBlock, Some(*a), "the machine has no such axis".to_owned()),
            NoEnd::OtherOffset { found, expected } => {
                (FindingKind::UnknownPosition, None, format!("refers to {found}, the setup knows {expected}"))
            }
            NoEnd::MixedRtcp(a) => {
                let note = "is at a machine position while words are the tip's".to_owned();
                (FindingKind::UnknownPosition, Some(*a), note)
            }
            NoEnd::Dependent => {
                let note = "the linear axes cannot bring the tip there".to_owned();
                (FindingKind::ReachFailure, None, note)
            }
            NoEnd::Unturned(why) => why.finding(),
            NoEnd::NoFrame => {
                let note = "words are the tip's (RTCP), and the machine has no X, Y and Z at right angles".to_owned();
                (FindingKind::UnknownPosition, None, note)
            }
            NoEnd::ViaUnderRtcp => {
                let note = "a way to the reference position over a point under RTCP is not simulated".to_owned();
                (FindingKind::UnknownBlock, None, note)
            }
        };
        self.fault(kind, index, axis, note);
    }

    fn fault(&mut self, kind: FindingKind, block: usize, axis: Option<AxisLetter>, note: String) {
        self.out.faults.push(TextFault { kind, block, last: block, worst: block, axis, measure: None, note });
    }
}

/// Permitted excess of an axis value over a limit by the rounding of words, mm or deg.
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

/// Note of a command whose effect is not followed.
fn unresolved(command: &ReadCommand, compensation: Compensation) -> Option<&'static str> {
    let ReadCommand::Macro { kind, .. } = command else { return None };
    match kind {
        MacroKind::ToolVector if !matches!(compensation, Compensation::Rtcp(_)) => {
            Some("a tool vector without RTCP: its effect on the axes is not followed")
        }
        MacroKind::Call | MacroKind::CallBehind | MacroKind::VariableWords => {
            Some("may move any axis; words are read on from here as if it did not change offsets")
        }
        MacroKind::Setting => Some("may change offsets, which are taken from the setup alone"),
        _ => None,
    }
}

/// Whether an axis moves that is not the other head's.
fn moves_tool(machine: &Machine, start: &AxisValues, end: &AxisValues) -> bool {
    (0..start.len()).any(|k| machine.moves_tool(k) && start[k] != end[k])
}
