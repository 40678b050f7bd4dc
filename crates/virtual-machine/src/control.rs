//! What the control has set besides its axes, as the text tells.

use std::collections::BTreeMap;

use facemill_nc_program::{Compensation, ReadBlock, ReadCommand, ReadProgram};
use facemill_tool_model::SpindleRotation;

use crate::{FindingKind, VirtualSetup, moves::TextFault};

/// What a program has set so far, and what is wrong with it.
pub(crate) struct Control<'a> {
    setup: &'a VirtualSetup<'a>,
    compensation: Compensation,
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

/// Difference of tool lengths that is no finding, mm: what the check in the program's text allows, too.
const SAME_LENGTH: f64 = 0.01;

/// M19, orientation of the spindle: it stands still then.
const ORIENTATION: u32 = 19;

impl<'a> Control<'a> {
    /// A control before the first block.
    pub(crate) fn new(setup: &'a VirtualSetup<'a>) -> Self {
        Self {
            setup,
            compensation: Compensation::Off,
            spindle: Spindle::default(),
            called: None,
            no_tool: Some("no T and M6 before"),
            has_ended: false,
            faults: Vec::new(),
            lasting: BTreeMap::new(),
        }
    }

    /// Compares the lengths that comments of the program name with that of the tool.
    pub(crate) fn tool_lengths(&mut self, program: &ReadProgram) {
        let length = self.setup.tool.gauge_length();
        for note in program.tool_lengths.iter().filter(|n| (n.length - length).abs() > SAME_LENGTH) {
            let index = program.blocks.partition_point(|b| b.line < note.line);
            if index < program.blocks.len() {
                let text = format!("{} mm in the program, {length} mm in the setup", note.length);
                self.fault(FindingKind::OtherToolLength, index, text);
            }
        }
    }

    /// Follows the next block. `is_home`: the axes along the spindle are at their reference positions before and behind it.
    pub(crate) fn block(&mut self, index: usize, block: &ReadBlock, is_home: bool) {
        self.behind_end(index, block);
        self.skippable(index, block);
        self.length_register(index, block.compensation);
        self.tool(index, block, is_home);
        let before = self.spindle_fault();
        for command in &block.commands {
            self.command(index, command);
        }
        if block.motion.as_ref().is_some_and(|m| !m.kind.is_rapid()) {
            // Whether a control switches before, during or behind the motion of a block is the machine builder's.
            if let Some((kind, note)) = before.or_else(|| self.spindle_fault()) {
                self.last(kind, index, note);
            }
            if let Some(why) = self.no_tool {
                self.last(FindingKind::NoTool, index, why.to_owned());
            }
        }
    }

    /// What was wrong.
    pub(crate) fn into_faults(self) -> Vec<TextFault> {
        self.faults
    }

    /// T calls a tool, in the block of M6 or before, and M6 puts it into the spindle.
    fn tool(&mut self, index: usize, block: &ReadBlock, is_home: bool) {
        let number = self.setup.tool.number();
        for command in &block.commands {
            if let ReadCommand::Tool(called) = command {
                self.called = Some(*called);
                if *called != number {
                    self.fault(FindingKind::UnknownBlock, index, format!("calls another tool than T{number}"));
                }
            }
        }
        if !block.commands.contains(&ReadCommand::ToolChange) {
            return;
        }
        self.no_tool = self.called.take().is_none().then_some("M6 without T: which tool comes is not said");
        self.lasting.retain(|(kind, _), _| *kind != FindingKind::NoTool);
        if !is_home {
            let note = "send the spindle axis home (G91 G28) in a block before: the tool is changed over the work";
            self.fault(FindingKind::UnsafeToolChange, index, note.to_owned());
        }
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
            ReadCommand::Function(code) => {
                let note = format!("M{code} is the machine builder's: what it does is not simulated");
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
        let code = |turns| if turns == SpindleRotation::Clockwise { "M3" } else { "M4" };
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
        let is_comment = |c: &ReadCommand| matches!(c, ReadCommand::Comment(_));
        if self.has_ended && (block.sets_state || !block.commands.iter().all(is_comment)) {
            self.last(FindingKind::BehindEnd, index, "not run: the program ends before".to_owned());
        }
    }

    /// A switch on the control decides whether a line with `/` is run. It may only when nothing later depends on it: with
    /// comments, stops, coolant and dwells.
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

    /// The tool's length stands in one register; what stands in the others nobody knows. Axes go on as if it were the
    /// same.
    fn length_register(&mut self, index: usize, compensation: Compensation) {
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

    fn fault(&mut self, kind: FindingKind, block: usize, note: String) {
        self.faults.push(TextFault { kind, block, last: block, axis: None, note });
    }

    /// A fault that one cause leads to in many blocks: told once, from its first block to its last.
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
