/// A word whose meaning a control keeps from block to block, and keeps or resets between programs
/// as it is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StateWord {
    /// A work offset is selected (G54, cycle 247).
    WorkOffset,
    /// A length register or edge is named (H, D).
    LengthRegister,
    /// The tool's length is switched off (G49).
    LengthOff,
    /// RTCP is switched off (G49, M429, TRAFOOF, FUNCTION RESET TCPM, M129).
    RtcpOff,
    /// Radius compensation is switched off (G40).
    RadiusOff,
    /// mm or inch (G20, G21, G70, G71, G700, G710, BEGIN PGM).
    Unit,
    /// Absolute or incremental words (G90, G91).
    Distance,
    /// Meaning of F (G93, G94).
    FeedMode,
    /// The program goes back to whoever called it (M99 of FANUC and its relatives, M17, RET).
    Return,
    /// A register of the tool's radius is named (D of FANUC and its relatives).
    RadiusRegister,
    /// A motion word (G0 to G3 of FANUC and its relatives).
    Motion,
}

/// The state words that a text says: what [`ReadMotion`](crate::read::program::ReadMotion) holds
/// where nothing is said is only what controls commonly begin with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SaidWords(u16);

impl SaidWords {
    /// Whether the word is said.
    #[must_use]
    pub fn has(self, word: StateWord) -> bool {
        self.0 & bit(word) != 0
    }

    /// Returns the statements of either.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The same without a word.
    #[must_use]
    pub fn without(self, word: StateWord) -> Self {
        Self(self.0 & !bit(word))
    }

    pub(crate) fn add(&mut self, word: StateWord) {
        self.0 |= bit(word);
    }
}

fn bit(word: StateWord) -> u16 {
    1 << word as u16
}
