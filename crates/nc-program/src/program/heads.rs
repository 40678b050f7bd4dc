use crate::program::spec::{AxisSpec, ProgramSpec, SpindleSpec, ToolSpec};
use crate::program::write_error::WriteError;
use crate::words::axis_lengths::MAX_HEADS;
use crate::words::axis_words::{AxisKind, AxisLetter};

/// One head of a machine that has several, as its control knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct MappedHead {
    /// Name in findings and comments.
    pub name: String,
    /// Its axis parallel to its spindle at the zero pose, which has a number (`Z1`): length
    /// compensation acts on it.
    pub spindle_axis: AxisLetter,
    /// From the gauge line to the tip, mm.
    pub tool_length: f64,
    /// Number of the control's length register (H) that holds this length.
    pub length_register: u32,
    /// Place of its tool in the magazine (T): the number alone says into which head the tool goes.
    pub tool_number: u32,
    /// Number of its spindle, from 1: the P behind S, M3, M4 and M5.
    pub spindle_number: u32,
}

/// One head of a machine that has several, as a program is written for it.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadSpec {
    /// Name for the operator.
    pub name: String,
    /// Its axis parallel to its spindle at the zero pose, which has a number (`Z1`): length
    /// compensation acts on it.
    pub spindle_axis: AxisLetter,
    /// Number of its spindle, from 1 (P).
    pub spindle_number: u32,
    /// Its tool.
    pub tool: ToolSpec,
    /// Speed and sense of its spindle.
    pub spindle: SpindleSpec,
}

impl HeadSpec {
    /// Returns its data for a [`WordMap`](crate::word_map::WordMap).
    #[must_use]
    pub fn mapped(&self) -> MappedHead {
        MappedHead {
            name: self.name.clone(),
            spindle_axis: self.spindle_axis,
            tool_length: self.tool.length,
            length_register: self.tool.length_register,
            tool_number: self.tool.number,
            spindle_number: self.spindle_number,
        }
    }
}

/// Why heads do not make one machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeadError {
    /// One head needs no heads.
    #[error("a machine of several heads has 2 to {max} of them, not {n}", max = MAX_HEADS)]
    Count {
        /// As given.
        n: usize,
    },
    /// Heads share what tells them apart.
    #[error("the heads `{first}` and `{second}` both have {what}: each needs its own")]
    Shared {
        /// Name of a head.
        first: String,
        /// Name of a later one.
        second: String,
        /// Such as `H3`.
        what: String,
    },
    /// A register, tool or spindle cannot have this number.
    #[error("head `{head}` has {what}: numbers are from 1 to {max}", max = LARGEST_NUMBER)]
    Number {
        /// Its name.
        head: String,
        /// Such as `H0`.
        what: String,
    },
    /// A tool length is NaN or infinite.
    #[error("head `{head}`: its tool length is not finite")]
    Length {
        /// Its name.
        head: String,
    },
    /// The axis is rotary or has no number.
    #[error("head `{head}`: its spindle axis {axis} must be linear and have a number, such as Z1")]
    SpindleAxis {
        /// Its name.
        head: String,
        /// As given.
        axis: AxisLetter,
    },
    /// The axis is none of the machine's, or not parallel to the spindle.
    #[error("head `{head}`: its spindle axis {axis} is no axis of the machine that is parallel to the spindle")]
    NotAlongSpindle {
        /// Its name.
        head: String,
        /// As given.
        axis: AxisLetter,
    },
    /// More axes carry the tool length than length compensation acts on.
    #[error("axis {0} is along a spindle and no head's spindle axis: a length acts on one axis of each head")]
    AlsoAlongSpindle(AxisLetter),
}

/// Largest number of a register, tool or spindle.
const LARGEST_NUMBER: u32 = 99_999_999;

/// By how much an axis may fail to be parallel to a spindle, mm per mm of tool length. A larger one
/// takes an inclined axis for a parallel one; a smaller one refuses chains for their rounding.
const PARALLEL: f64 = 1e-9;

/// Checks heads by themselves.
pub(crate) fn check(heads: &[MappedHead]) -> Result<(), HeadError> {
    if !(2..=MAX_HEADS).contains(&heads.len()) {
        return Err(HeadError::Count { n: heads.len() });
    }
    for (k, head) in heads.iter().enumerate() {
        let name = || head.name.clone();
        if head.spindle_axis.kind() != AxisKind::Linear || head.spindle_axis.number() == 0 {
            return Err(HeadError::SpindleAxis { head: name(), axis: head.spindle_axis });
        }
        if !head.tool_length.is_finite() {
            return Err(HeadError::Length { head: name() });
        }
        for (letter, number) in marks(head) {
            if !(1..=LARGEST_NUMBER).contains(&number) {
                return Err(HeadError::Number { head: name(), what: format!("{letter}{number}") });
            }
        }
        if let Some((other, what)) = heads[..k].iter().find_map(|other| Some((other, shared(other, head)?))) {
            return Err(HeadError::Shared { first: other.name.clone(), second: name(), what });
        }
    }
    Ok(())
}

/// Checks that the lengths of the heads act on these axes as compensation type C does.
pub(crate) fn check_axes(heads: &[MappedHead], axes: &[MappedAxis]) -> Result<(), HeadError> {
    for head in heads {
        let own = axes.iter().find(|a| a.letter == head.spindle_axis);
        // Written so that NaN is refused, too.
        if !own.is_some_and(|a| (a.along_spindle.abs() - 1.0).abs() <= PARALLEL) {
            return Err(HeadError::NotAlongSpindle { head: head.name.clone(), axis: head.spindle_axis });
        }
    }
    let is_own = |a: &MappedAxis| heads.iter().any(|h| h.spindle_axis == a.letter);
    match axes.iter().find(|a| !is_own(a) && a.along_spindle.abs() > PARALLEL) {
        Some(axis) => Err(HeadError::AlsoAlongSpindle(axis.letter)),
        None => Ok(()),
    }
}

/// Checks that these are the heads of a program.
pub fn check_heads(spec: &ProgramSpec, heads: &[HeadSpec]) -> Result<(), WriteError> {
    check(&heads.iter().map(HeadSpec::mapped).collect::<Vec<_>>())?;
    // There are two at least.
    let first = &heads[0];
    let other = |what| Err(WriteError::OtherFirstHead { head: first.name.clone(), what });
    if spec.tool != first.tool {
        return other("tool");
    }
    if spec.spindle != first.spindle {
        return other("spindle");
    }
    Ok(check_retracted(heads, &spec.axes)?)
}

/// Checks that a program's axes along a spindle, which go home first, are the spindle axes of its
/// heads.
fn check_retracted(heads: &[HeadSpec], axes: &[AxisSpec]) -> Result<(), HeadError> {
    for head in heads {
        if !axes.iter().any(|a| a.letter == head.spindle_axis && a.along_spindle) {
            return Err(HeadError::NotAlongSpindle { head: head.name.clone(), axis: head.spindle_axis });
        }
    }
    let is_own = |a: &AxisSpec| heads.iter().any(|h| h.spindle_axis == a.letter);
    match axes.iter().find(|a| a.along_spindle && !is_own(a)) {
        Some(axis) => Err(HeadError::AlsoAlongSpindle(axis.letter)),
        None => Ok(()),
    }
}

/// The numbers that tell heads apart.
fn marks(head: &MappedHead) -> [(char, u32); 3] {
    [('H', head.length_register), ('T', head.tool_number), ('P', head.spindle_number)]
}

fn shared(a: &MappedHead, b: &MappedHead) -> Option<String> {
    if a.spindle_axis == b.spindle_axis {
        return Some(a.spindle_axis.to_string());
    }
    let same = marks(a).into_iter().zip(marks(b)).find(|(x, y)| x == y);
    same.map(|((letter, number), _)| format!("{letter}{number}"))
}

/// How a machine axis appears in NC words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedAxis {
    /// Its name.
    pub letter: AxisLetter,
    /// Machine value that the work offset calls zero, mm or rad.
    pub offset: f64,
    /// Travel of this axis per mm of tool length that keeps the tip in its place at the machine's
    /// zero pose: 1 for the axis parallel to the spindle (−1 where its positive sense is into the
    /// work), 0 for all others. Length compensation acts on it.
    pub along_spindle: f64,
}
