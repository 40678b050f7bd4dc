//! State of the control besides its axes, as the text sets it.

use std::collections::BTreeMap;

use facemill_nc_program::read::{Compensation, LengthRelation, ReadBlock, ReadCommand, ToolLengthNote};
use facemill_nc_program::words::{AxisKind, AxisLengths, StateWord};
use facemill_nc_program::{AxisLetter, Dialect, MappedHead, ReadProgram};
use facemill_tool_model::SpindleRotation;

use crate::finding::{FindingKind, TextFault};
use crate::motion::counted_axes::is_of_feeds;
use crate::motion::positions::tool_vectors::not_unit;
use crate::motion::setup::{VirtualSetup, own_head};

/// State that a program has set so far, with its faults.
pub(crate) struct Control<'a> {
    setup: &'a VirtualSetup<'a>,
    dialect: Dialect,
    /// M functions that change nothing.
    harmless_functions: &'a [u32],
    /// The text has named the edge of the tool in the spindle (D).
    has_edge: bool,
    /// The head of the setup, on a machine of several.
    head: Option<&'a MappedHead>,
    compensation: Compensation,
    lengths: AxisLengths,
    spindle: Spindle,
    /// T since the last M6.
    called: Option<u32>,
    /// Why there is no tool in the spindle.
    no_tool: Option<&'static str>,
    has_ended: bool,
    faults: Vec<TextFault>,
    /// Index of the fault that a cause has led to, as long as the cause lasts.
    lasting: BTreeMap<(FindingKind, String), usize>,
}

/// The spindle, as M3, M4, M5 and S set it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Spindle {
    turns: Option<SpindleRotation>,
    /// 1/min; 0 before the first S.
    speed: f64,
}

/// Difference of tool lengths that is no finding, mm: what the check in the program's text allows,
/// too.
const SAME_LENGTH: f64 = 0.01;

/// M19, orientation of the spindle: it stands still then.
const ORIENTATION: u32 = 19;

impl<'a> Control<'a> {
    /// A control before the first block.
    pub(crate) fn new(setup: &'a VirtualSetup<'a>, program: &'a ReadProgram) -> Self {
        Self {
            setup,
            dialect: program.dialect,
            harmless_functions: &program.harmless_functions,
            has_edge: false,
            head: own_head(setup),
            compensation: Compensation::Off,
            lengths: AxisLengths::default(),
            spindle: Spindle::default(),
            called: None,
            no_tool: Some("no T and M6 before"),
            has_ended: false,
            faults: Vec::new(),
            lasting: BTreeMap::new(),
        }
    }

    /// Compares the lengths that comments of the program name with that of the tool: with several
    /// heads, of the head whose register the comment names.
    pub(crate) fn tool_lengths(&mut self, program: &ReadProgram) {
        for note in &program.tool_lengths {
            let index = program.blocks.partition_point(|b| b.line < note.line);
            let named = note.register.filter(|_| self.head.is_some());
            let text = match named.map(|h| (h, self.head_with(|head| head.length_register == h))) {
                Some((register, None)) => format!("for H{register}, which is no head's"),
                Some((_, Some(head))) if !note.relation.holds(head.tool_length, note.length, SAME_LENGTH) => {
                    let MappedHead { name, tool_length, .. } = head;
                    format!("head {name}: {} in the program, {tool_length} mm in the setup", programmed_length(note))
                }
                None if !note.relation.holds(self.setup.tool.gauge_length(), note.length, SAME_LENGTH) => {
                    format!(
                        "{} in the program, {} mm in the setup",
                        programmed_length(note),
                        self.setup.tool.gauge_length()
                    )
                }
                _ => continue,
            };
            if index < program.blocks.len() {
                self.fault(FindingKind::OtherToolLength, index, text);
            }
        }
    }

    fn head_with(&self, is_meant: impl Fn(&MappedHead) -> bool) -> Option<&'a MappedHead> {
        self.setup.words.heads().iter().find(|head| is_meant(head))
    }

    /// Follows the next block. `is_home`: the axes along the spindle are at their reference
    /// positions before and behind it. `may_cut`: the tool moves against the work and is not known
    /// to be away from it.
    pub(crate) fn block(&mut self, index: usize, block: &ReadBlock, is_home: bool, may_cut: bool) {
        self.behind_end(index, block);
        self.rtcp_at_end(index, block);
        self.vectors(index, block);
        self.skippable(index, block);
        self.length_register(index, block);
        self.edge(index, block);
        let is_changed = self.tool(index, block, is_home);
        let before = self.spindle_fault();
        let spindle = block.commands.iter().find_map(|c| if let ReadCommand::Spindle(n) = c { Some(*n) } else { None });
        for command in &block.commands {
            if self.is_meant(command, spindle, is_changed) {
                self.command(index, command);
            }
        }
        if may_cut && block.motion.as_ref().is_some_and(|m| !m.kind.is_rapid()) {
            // Whether a control switches before, during or behind the motion of a block is the
            // machine builder's.
            let of_head = self.head.map_or_else(String::new, |head| format!("head {}: ", head.name));
            if let Some((kind, note)) = before.or_else(|| self.spindle_fault()) {
                self.last(kind, index, format!("{of_head}{note}"));
            }
            if let Some(why) = self.no_tool {
                self.last(FindingKind::NoTool, index, format!("{of_head}{why}"));
            }
        }
    }

    /// Returns the faults.
    pub(crate) fn into_faults(self) -> Vec<TextFault> {
        self.faults
    }

    /// Whether a command is for this head and its spindle, `spindle` being the number that the
    /// block names. Without one all spindles of several stop, and none is started.
    fn is_meant(&self, command: &ReadCommand, spindle: Option<u32>, is_changed: bool) -> bool {
        let own = self.head.map_or(1, |head| head.spindle_number);
        match command {
            ReadCommand::SpindleSpeed(_) | ReadCommand::SpindleOn { .. } => {
                spindle.map_or(self.head.is_none(), |n| n == own)
            }
            // One that is nobody's may be any.
            ReadCommand::SpindleOff => {
                spindle.is_none_or(|n| n == own || self.head_with(|h| h.spindle_number == n).is_none())
            }
            ReadCommand::ToolChange => is_changed,
            _ => true,
        }
    }

    /// T calls a tool, in the block of M6 or before, and M6 puts it into the spindle: of several
    /// heads into that whose tool it is. Whether the tool of this head is changed.
    fn tool(&mut self, index: usize, block: &ReadBlock, is_home: bool) -> bool {
        let number = self.setup.tool.number();
        let heads = self.setup.words.heads();
        let is_others = |called: u32| called != number && heads.iter().any(|h| h.tool_number == called);
        for command in &block.commands {
            if let ReadCommand::Tool(called) = command {
                self.called = Some(*called);
                if *called != number && !is_others(*called) {
                    self.fault(FindingKind::UnknownBlock, index, format!("calls another tool than T{number}"));
                }
            }
        }
        if !block.commands.contains(&ReadCommand::ToolChange) {
            return false;
        }
        let called = self.called.take();
        if called.is_some_and(is_others) {
            return false;
        }
        self.no_tool = called.is_none().then_some("M6 without T: which tool comes is not said");
        self.lasting.retain(|(kind, _), _| *kind != FindingKind::NoTool);
        if !is_home {
            let note = "send the spindle axis home (G91 G28) in a block before: the tool is changed over the work";
            self.fault(FindingKind::UnsafeToolChange, index, note.to_owned());
        }
        true
    }

    fn command(&mut self, index: usize, command: &ReadCommand) {
        let mut spindle = self.spindle;
        match command {
            ReadCommand::SpindleSpeed(speed) => spindle.speed = *speed,
            ReadCommand::SpindleOn { clockwise: true } => spindle.turns = Some(SpindleRotation::Clockwise),
            ReadCommand::SpindleOn { clockwise: false } => spindle.turns = Some(SpindleRotation::Counterclockwise),
            // A tool is changed with the spindle at rest.
            ReadCommand::SpindleOff | ReadCommand::ToolChange | ReadCommand::Function(ORIENTATION) => {
                spindle.turns = None;
            }
            ReadCommand::Function(code) if is_of_feeds(self.dialect, *code) => {}
            ReadCommand::Function(code) if self.harmless_functions.contains(code) => {}
            ReadCommand::Function(code) => {
                let note = format!(
                    "M{code} may move, call or change anything; one that does not belongs into harmless_functions of the \
                     dialect file (post.dialect_file of a job, --dialect-file with --part)"
                );
                self.last(FindingKind::UnknownFunction, index, note);
            }
            ReadCommand::Auxiliary(word) => {
                let note = format!("{word} goes to the machine builder's logic, which may move or change anything");
                self.last(FindingKind::UnknownFunction, index, note);
            }
            ReadCommand::End => self.has_ended = true,
            _ => {}
        }
        if std::mem::replace(&mut self.spindle, spindle) != spindle {
            self.lasting.retain(|(kind, _), _| !matches!(kind, FindingKind::SpindleOff | FindingKind::SpindleSense));
        }
    }

    /// Why the spindle must not cut as it is.
    fn spindle_fault(&self) -> Option<(FindingKind, String)> {
        let wanted = self.setup.tool.spindle_rotation();
        let number = self.head.map_or_else(String::new, |head| format!(" P{}", head.spindle_number));
        let code = |turns| format!("{}{number}", if turns == SpindleRotation::Clockwise { "M3" } else { "M4" });
        match self.spindle.turns {
            None => Some((FindingKind::SpindleOff, format!("cutting needs {} before", code(wanted)))),
            Some(turns) if turns != wanted => {
                let note = format!("{} is on, the tool cuts with {}", code(turns), code(wanted));
                Some((FindingKind::SpindleSense, note))
            }
            Some(_) if self.spindle.speed > 0.0 => None,
            Some(_) => Some((FindingKind::SpindleOff, "cutting needs a speed (S) above 0".to_owned())),
        }
    }

    /// Nothing is run behind M2 or M30.
    fn behind_end(&mut self, index: usize, block: &ReadBlock) {
        // M30 and the last line of a Heidenhain program each say it.
        let is_nothing = |c: &ReadCommand| matches!(c, ReadCommand::Comment(_) | ReadCommand::End);
        if self.has_ended && (block.sets_state || !block.commands.iter().all(is_nothing)) {
            self.last(FindingKind::BehindEnd, index, "not run: the program ends before".to_owned());
        }
    }

    /// A program that leaves RTCP on does not say how the next program, or a person at the
    /// handwheel, moves.
    fn rtcp_at_end(&mut self, index: usize, block: &ReadBlock) {
        let ends = block.commands.contains(&ReadCommand::End) && !block.said.has(StateWord::Return);
        if ends && !self.has_ended && matches!(block.compensation, Compensation::Rtcp(_)) {
            let note = "the program ends with RTCP on: switch it off on the way home";
            self.fault(FindingKind::RtcpLeftOn, index, note.to_owned());
        }
    }

    /// Heidenhain takes vectors as they stand; the others bring them to length 1 themselves.
    fn vectors(&mut self, index: usize, block: &ReadBlock) {
        let Some(tool) = block.motion.as_ref().and_then(|m| m.tool.as_ref()) else { return };
        if self.dialect == Dialect::Heidenhain {
            for note in not_unit(tool) {
                self.last(FindingKind::NotUnitVector, index, note.to_owned());
            }
        }
    }

    /// A switch on the control decides whether a line with `/` is run. It may only when nothing
    /// later depends on it: with comments, stops, coolant and dwells.
    fn skippable(&mut self, index: usize, block: &ReadBlock) {
        let is_harmless = |c: &ReadCommand| {
            matches!(
                c,
                ReadCommand::Comment(_) | ReadCommand::Stop { .. } | ReadCommand::Coolant(_) | ReadCommand::Dwell(_)
            )
        };
        if block.skippable && (block.sets_state || !block.commands.iter().all(is_harmless)) {
            let note = "read as run: a switch on the control decides";
            self.fault(FindingKind::SkippableBlock, index, note.to_owned());
        }
    }

    /// One register holds the tool's length; nobody knows the contents of the others. Axes go on as
    /// if they were the same.
    fn length_register(&mut self, index: usize, block: &ReadBlock) {
        let compensation = block.compensation;
        if self.head.is_some() {
            return self.length_registers(index, block.lengths);
        }
        if std::mem::replace(&mut self.compensation, compensation) == compensation {
            return;
        }
        let expected = self.setup.length_register;
        let note = match compensation {
            Compensation::Length(0) | Compensation::Rtcp(0) => {
                format!("without H, the tool's length is in H{expected}")
            }
            Compensation::Length(h) | Compensation::Rtcp(h) if h != expected => {
                format!("H{h}, the tool's length is in H{expected}")
            }
            _ => return,
        };
        self.fault(FindingKind::OtherLengthRegister, index, note);
    }

    /// Which edge's length a tool change of Siemens switches on, machine data say (MD20270): its
    /// first, none, or that of the tool before. Axes go on as if it were the first.
    fn edge(&mut self, index: usize, block: &ReadBlock) {
        self.has_edge &= !block.commands.contains(&ReadCommand::ToolChange);
        self.has_edge |= block.said.has(StateWord::LengthRegister);
        let is_counted = block.motion.as_ref().is_some_and(|m| match m.compensation {
            Compensation::Off => false,
            Compensation::Rtcp(_) => true,
            Compensation::Length(_) => {
                m.position.iter().any(|(l, _)| l.kind() == AxisKind::Linear && m.position.is_programmed(l))
            }
        });
        if self.dialect == Dialect::Siemens840d && is_counted && !self.has_edge {
            let note = "no D behind the tool change: machine data say which length counts; write D1".to_owned();
            self.last(FindingKind::OtherLengthRegister, index, note);
        }
    }

    /// Of several heads: each length acts on the spindle axis of its own head.
    fn length_registers(&mut self, index: usize, lengths: AxisLengths) {
        let before = std::mem::replace(&mut self.lengths, lengths);
        if before.is_clear() && !lengths.is_clear() {
            let note = "each head's length needs a block with its spindle axis and no other linear one (`G43 Z2=… H2`)";
            self.fault(FindingKind::OtherLengthRegister, index, note.to_owned());
        }
        let is_new = |(axis, h): &(AxisLetter, u32)| before.register_of(*axis) != Some(*h);
        for (axis, register) in lengths.iter().filter(is_new) {
            let note = match self.head_with(|head| head.spindle_axis == axis) {
                Some(head) if head.length_register == register => continue,
                Some(head) => {
                    let MappedHead { name, length_register, .. } = head;
                    format!("H{register} for {axis}, the tool's length of head {name} is in H{length_register}")
                }
                None => format!("H{register} for {axis}, which is no head's spindle axis"),
            };
            self.fault(FindingKind::OtherLengthRegister, index, note);
        }
    }

    fn fault(&mut self, kind: FindingKind, block: usize, note: String) {
        self.faults.push(TextFault { kind, block, last: block, worst: block, axis: None, measure: None, note });
    }

    /// A fault that one cause leads to in many blocks: reported once, from its first block to its
    /// last.
    fn last(&mut self, kind: FindingKind, block: usize, note: String) {
        let key = (kind, note);
        if let Some(&k) = self.lasting.get(&key) {
            self.faults[k].last = block;
            return;
        }
        self.fault(kind, block, key.1.clone());
        self.lasting.insert(key, self.faults.len() - 1);
    }
}

/// The length that a program asks for.
fn programmed_length(note: &ToolLengthNote) -> String {
    let order = match note.relation {
        LengthRelation::Same => "",
        LengthRelation::Less => "less than ",
        LengthRelation::AtMost => "at most ",
        LengthRelation::More => "more than ",
        LengthRelation::AtLeast => "at least ",
    };
    format!("{order}{} mm", note.length)
}
