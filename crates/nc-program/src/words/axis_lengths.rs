use crate::words::axis_words::AxisLetter;

/// Which length register is on for which axis, as tool length offset type C has it: a `G43` block
/// that names one linear axis with a number (`G43 Z2=100. H2`) acts on that axis, further ones on
/// further axes, and `G49` ends all.
///
/// The text does not say which type the control has. For programs of one head
/// [`Compensation`](crate::read::program::Compensation) alone decides, whatever this holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisLengths {
    axes: [Option<AxisLetter>; MAX_HEADS],
    /// Of the axis at the same place; 0 where there is none. Apart from the axes, which takes half
    /// the memory: every block of a program has them.
    registers: [u32; MAX_HEADS],
    /// A compensation does not say its one axis.
    is_unclear: bool,
}

impl AxisLengths {
    /// The register (H) whose length is on for an axis.
    #[must_use]
    pub fn register_of(&self, axis: AxisLetter) -> Option<u32> {
        self.iter().find(|(letter, _)| *letter == axis).map(|(_, register)| register)
    }

    /// Axes and registers that are on, in the order they were switched on.
    pub fn iter(&self) -> impl Iterator<Item = (AxisLetter, u32)> + '_ {
        self.axes.iter().zip(&self.registers).filter_map(|(axis, register)| Some(((*axis)?, *register)))
    }

    /// Whether every compensation since the last `G49` named the one axis that it acts on.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        !self.is_unclear
    }

    /// Switches a register on for an axis; 0 is none.
    pub(crate) fn set(&mut self, axis: AxisLetter, register: u32) {
        let at = self.axes.iter().position(|letter| *letter == Some(axis));
        match at.or_else(|| self.axes.iter().position(Option::is_none)) {
            Some(at) => (self.axes[at], self.registers[at]) = ((register > 0).then_some(axis), register),
            None => self.is_unclear = true,
        }
    }

    /// Something was switched that is not known.
    pub(crate) fn set_unclear(&mut self) {
        self.is_unclear = true;
    }
}

/// Most heads of one machine.
pub(crate) const MAX_HEADS: usize = 4;
