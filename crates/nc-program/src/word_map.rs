//! Axis words from joint values, and back.

use nalgebra::Point3;

use crate::program::heads::{MappedAxis, MappedHead};
use crate::program::{WorkOffset, heads};
use crate::read::position::AxisAt;
use crate::read::program::{Compensation, ReadMotion};
use crate::words::axis_words::{AxisKind, AxisLetter, AxisWords};

/// Joint values (mm, rad, in the machine's axis order, as its scales show them) to NC words (mm,
/// deg) and back, for one work offset and one tool length, or that of each head.
///
/// word = joint − offset, and with length compensation (G43 H) along the axis parallel to the
/// spindle less the tool length: in FEED (9) the programmed Z is the tip's Z at B = 0. On a machine
/// of several heads ([`WordMap::with_heads`]) each head has a length and a register of its own,
/// which acts on its spindle axis alone (tool length offset type C).
#[derive(Clone, Debug, PartialEq)]
pub struct WordMap {
    axes: Vec<MappedAxis>,
    work_offset: WorkOffset,
    tool_length: f64,
    /// Of each axis: what length compensation takes off its words, mm.
    lengths: Vec<f64>,
    /// Empty on a machine of one head.
    heads: Vec<MappedHead>,
}

/// Why joint values and words do not go together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WordMapError {
    /// Two axes of a machine have one name.
    #[error("two axes are named {0}")]
    TwoAxes(AxisLetter),
    /// More axes than a position can hold.
    #[error(transparent)]
    TooManyAxes(#[from] crate::words::axis_words::TooManyAxes),
    /// An offset, factor or length is NaN or infinite.
    #[error("an offset or length is not finite")]
    NotFinite,
    /// The number of joint values is not that of the axes.
    #[error("{given} joint values for {axes} axes")]
    WrongCount {
        /// Number of values.
        given: usize,
        /// Number of axes.
        axes: usize,
    },
    /// The position of an axis is not known from the program.
    #[error("the program has not said where axis {0} is")]
    UnknownAxis(AxisLetter),
    /// The program names an axis that the machine does not have.
    #[error("the machine has no axis {0}")]
    NoSuchAxis(AxisLetter),
    /// The motion refers to another work offset.
    #[error("the motion refers to {found}, this is {expected}")]
    OtherOffset {
        /// Offset of the motion.
        found: WorkOffset,
        /// Offset of the map.
        expected: WorkOffset,
    },
    /// Under RTCP the linear words are the tip's: joint values follow from the machine's kinematics
    /// only.
    #[error("the words are the tip's under RTCP")]
    Rtcp,
    /// The heads do not go together with each other or with the axes.
    #[error(transparent)]
    Heads(#[from] crate::program::heads::HeadError),
    /// The length of a register that is not this head's is on for its axis.
    #[error("axis {axis} has the length of H{found}, its tool's is in H{expected}")]
    OtherRegister {
        /// The spindle axis of the head.
        axis: AxisLetter,
        /// Register in force.
        found: u32,
        /// Register of the head.
        expected: u32,
    },
    /// A length compensation that does not say which head's axis it acts on.
    #[error("a length compensation does not name the one axis that it acts on (`G43 Z2=… H2`)")]
    UnclearLength,
}

impl WordMap {
    /// A map for these axes, in the machine's order; `tool_length` (mm) is from the gauge line to
    /// the tip.
    ///
    /// # Errors
    /// When two axes share a name, there are more than [`AxisWords::CAPACITY`], or a number is not
    /// finite.
    pub fn new(axes: Vec<MappedAxis>, work_offset: WorkOffset, tool_length: f64) -> Result<Self, WordMapError> {
        AxisWords::from_words(axes.iter().map(|a| (a.letter, 0.0)))?;
        for (k, axis) in axes.iter().enumerate() {
            if axes[..k].iter().any(|other| other.letter == axis.letter) {
                return Err(WordMapError::TwoAxes(axis.letter));
            }
            if !(axis.offset.is_finite() && axis.along_spindle.is_finite()) {
                return Err(WordMapError::NotFinite);
            }
        }
        if !tool_length.is_finite() {
            return Err(WordMapError::NotFinite);
        }
        let lengths = axes.iter().map(|a| a.along_spindle * tool_length).collect();
        Ok(Self { axes, work_offset, tool_length, lengths, heads: Vec::new() })
    }

    /// A map for a machine of several heads. The length of a head acts on its spindle axis alone,
    /// so every other axis has to have an [`MappedAxis::along_spindle`] of 0, and a spindle axis 1
    /// or −1 with its own head's spindle.
    ///
    /// # Errors
    /// As [`WordMap::new`], and when the heads are not as
    /// [`HeadError`](crate::program::heads::HeadError) says.
    pub fn with_heads(
        axes: Vec<MappedAxis>,
        work_offset: WorkOffset,
        heads: Vec<MappedHead>,
    ) -> Result<Self, WordMapError> {
        heads::check(&heads)?;
        heads::check_axes(&heads, &axes)?;
        // There are two heads at least.
        let mut map = Self::new(axes, work_offset, heads[0].tool_length)?;
        let length = |axis: &MappedAxis| {
            let own = heads.iter().find(|h| h.spindle_axis == axis.letter);
            own.map_or(0.0, |h| axis.along_spindle.signum() * h.tool_length)
        };
        map.lengths = map.axes.iter().map(length).collect();
        map.heads = heads;
        Ok(map)
    }

    /// The heads of a machine that has several; empty for one head.
    #[must_use]
    pub fn heads(&self) -> &[MappedHead] {
        &self.heads
    }

    /// The axes, in the machine's order.
    #[must_use]
    pub fn axes(&self) -> &[MappedAxis] {
        &self.axes
    }

    /// The work offset the words refer to.
    #[must_use]
    pub fn work_offset(&self) -> WorkOffset {
        self.work_offset
    }

    /// From the gauge line to the tip, mm; of several heads that of the first.
    #[must_use]
    pub fn tool_length(&self) -> f64 {
        self.tool_length
    }

    /// Words of joint values with the length compensation on (G43 H).
    ///
    /// # Errors
    /// When the number of values is not that of the axes.
    pub fn words(&self, joints: &[f64]) -> Result<AxisWords, WordMapError> {
        self.words_with(joints, true)
    }

    /// Words of joint values with the length compensation off (G49).
    ///
    /// # Errors
    /// When the number of values is not that of the axes.
    pub fn uncompensated_words(&self, joints: &[f64]) -> Result<AxisWords, WordMapError> {
        self.words_with(joints, false)
    }

    /// Words under RTCP: X, Y, Z of `tip` (mm, in the frame of the work offset, fixed to the
    /// table), other axes as without it.
    ///
    /// # Errors
    /// When the number of values is not that of the axes, or there are several heads, of which RTCP
    /// could follow one.
    pub fn rtcp_words(&self, tip: &Point3<f64>, joints: &[f64]) -> Result<AxisWords, WordMapError> {
        if !self.heads.is_empty() {
            return Err(WordMapError::Rtcp);
        }
        let mut words = self.words(joints)?;
        for axis in &self.axes {
            if let Some(k) = tip_coordinate(axis.letter) {
                words.set(axis.letter, tip[k])?;
            }
        }
        Ok(words)
    }

    /// Joint values of words with the length compensation on: the inverse of [`WordMap::words`].
    ///
    /// # Errors
    /// When a word is missing or of an axis that the machine does not have.
    pub fn joints(&self, words: &AxisWords) -> Result<Vec<f64>, WordMapError> {
        if let Some(stranger) = words.iter().find(|w| self.axes.iter().all(|a| a.letter != w.letter)) {
            return Err(WordMapError::NoSuchAxis(stranger.letter));
        }
        let joint = |(axis, length): (&MappedAxis, &f64)| {
            let word = words.get(axis.letter).ok_or(WordMapError::UnknownAxis(axis.letter))?;
            Ok(joint_of_word(axis, word, *length))
        };
        self.axes.iter().zip(&self.lengths).map(joint).collect()
    }

    /// Joint values of words 0 with the length compensation on, one for each axis.
    #[must_use]
    pub fn compensated_zeros(&self) -> Vec<f64> {
        self.axes.iter().zip(&self.lengths).map(|(axis, length)| joint_of_word(axis, 0.0, *length)).collect()
    }

    /// Joint values at the end of a move that has been read, with the compensation that is on
    /// there. `reference` holds the joint values of the machine's reference position (G28).
    ///
    /// # Errors
    /// When the place of an axis is not known, the program names an axis that the machine does not
    /// have, the move uses another work offset or RTCP, `reference` has not one value for each
    /// axis, or, with several heads, an axis has the length of another register than its head's.
    pub fn joints_at(&self, motion: &ReadMotion, reference: &[f64]) -> Result<Vec<f64>, WordMapError> {
        self.check_count(reference)?;
        self.check_frame(motion)?;
        let joint = |(k, home): (usize, &f64)| {
            let axis = &self.axes[k];
            match motion.position.get(axis.letter) {
                Some(AxisAt::Word(word)) => Ok(joint_of_word(axis, word, self.length_in(motion, k)?)),
                Some(AxisAt::Machine(value)) => Ok(in_joint_unit(axis.letter, value)),
                Some(AxisAt::Reference(1)) => Ok(*home),
                Some(AxisAt::Reference(_)) | None => Err(WordMapError::UnknownAxis(axis.letter)),
            }
        };
        reference.iter().enumerate().map(joint).collect()
    }

    /// Returns the length that the compensation in force takes off the words of an axis, mm.
    fn length_in(&self, motion: &ReadMotion, axis: usize) -> Result<f64, WordMapError> {
        let Some(head) = self.heads.first() else {
            return match motion.compensation {
                Compensation::Off => Ok(0.0),
                Compensation::Length(_) => Ok(self.lengths[axis]),
                Compensation::Rtcp(_) => Err(WordMapError::Rtcp),
            };
        };
        if matches!(motion.compensation, Compensation::Rtcp(_)) {
            return Err(WordMapError::Rtcp);
        }
        if !motion.lengths.is_clear() {
            return Err(WordMapError::UnclearLength);
        }
        let letter = self.axes[axis].letter;
        let Some(found) = motion.lengths.register_of(letter) else { return Ok(0.0) };
        let own = self.heads.iter().find(|h| h.spindle_axis == letter);
        match own {
            Some(own) if own.length_register == found => Ok(self.lengths[axis]),
            _ => {
                let expected = own.unwrap_or(head).length_register;
                Err(WordMapError::OtherRegister { axis: letter, found, expected })
            }
        }
    }

    fn words_with(&self, joints: &[f64], is_compensated: bool) -> Result<AxisWords, WordMapError> {
        self.check_count(joints)?;
        let word = |(k, joint): (usize, &f64)| {
            let axis = &self.axes[k];
            let value = joint - axis.offset - if is_compensated { self.lengths[k] } else { 0.0 };
            (axis.letter, if axis.letter.kind() == AxisKind::Rotary { value.to_degrees() } else { value })
        };
        Ok(AxisWords::from_words(joints.iter().enumerate().map(word))?)
    }

    fn check_count(&self, joints: &[f64]) -> Result<(), WordMapError> {
        let (given, axes) = (joints.len(), self.axes.len());
        if given == axes { Ok(()) } else { Err(WordMapError::WrongCount { given, axes }) }
    }

    fn check_frame(&self, motion: &ReadMotion) -> Result<(), WordMapError> {
        if let Some((stranger, _)) = motion.position.iter().find(|(l, _)| self.axes.iter().all(|a| a.letter != *l)) {
            return Err(WordMapError::NoSuchAxis(stranger));
        }
        let uses_words = motion.position.iter().any(|(_, at)| matches!(at, AxisAt::Word(_)));
        if uses_words && motion.work_offset != self.work_offset {
            return Err(WordMapError::OtherOffset { found: motion.work_offset, expected: self.work_offset });
        }
        Ok(())
    }
}

fn joint_of_word(axis: &MappedAxis, word: f64, length: f64) -> f64 {
    in_joint_unit(axis.letter, word) + axis.offset + length
}

fn in_joint_unit(letter: AxisLetter, value: f64) -> f64 {
    if letter.kind() == AxisKind::Rotary { value.to_radians() } else { value }
}

/// Which coordinate of the tip the axis' word is under RTCP.
fn tip_coordinate(letter: AxisLetter) -> Option<usize> {
    match letter.letter() {
        'X' => Some(0),
        'Y' => Some(1),
        'Z' => Some(2),
        _ => None,
    }
}

#[cfg(test)]
#[path = "../tests/unit/word_map.rs"]
mod tests;
