//! What the control has set besides its axes, as the text tells.

use facemill_nc_program::{Compensation, ReadBlock, ReadCommand};

use crate::{FindingKind, VirtualSetup, moves::TextFault};

/// What a program has set so far, and what is wrong with it.
pub(crate) struct Control<'a> {
    setup: &'a VirtualSetup<'a>,
    compensation: Compensation,
    faults: Vec<TextFault>,
}

impl<'a> Control<'a> {
    /// A control before the first block.
    pub(crate) fn new(setup: &'a VirtualSetup<'a>) -> Self {
        Self { setup, compensation: Compensation::Off, faults: Vec::new() }
    }

    /// Follows the next block.
    pub(crate) fn block(&mut self, index: usize, block: &ReadBlock) {
        self.skippable(index, block);
        self.length_register(index, block.compensation);
    }

    /// What was wrong.
    pub(crate) fn into_faults(self) -> Vec<TextFault> {
        self.faults
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
        self.faults.push(TextFault { kind, block, axis: None, note });
    }
}
