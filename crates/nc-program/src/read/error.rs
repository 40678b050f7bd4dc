/// Where and why a text is not a program of the dialect.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {fault}")]
pub struct ReadError {
    /// From 1.
    pub line: u32,
    /// Byte in the line, from 1.
    pub column: u32,
    /// Fault.
    pub fault: ReadFault,
}

/// Fault at a place of a program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadFault {
    /// A word that the reader does not know.
    #[error("`{0}` is not understood")]
    UnknownWord(String),
    /// A word that has no meaning in its block.
    #[error("`{0}` has no meaning in this block")]
    StrayWord(String),
    /// A word that the reader knows and cannot resolve.
    #[error("`{word}` is not supported: {why}")]
    Unsupported {
        /// The word.
        word: String,
        /// Why not.
        why: &'static str,
    },
    /// A byte that starts no word.
    #[error("unexpected character {0:?}")]
    Character(char),
    /// No number, or one that is not of the form `-12.5`.
    #[error("`{0}` has no valid number")]
    Number(String),
    /// Text that should be an expression and is none, or an assignment that is none.
    #[error("`{0}` is no valid expression")]
    Expression(String),
    /// `(` without `)`.
    #[error("the comment is not closed")]
    OpenComment,
    /// The same axis or function twice in a block.
    #[error("`{0}` occurs twice in the block")]
    Repeated(String),
    /// More axes than a position can hold.
    #[error(transparent)]
    TooManyAxes(#[from] crate::words::axis_words::TooManyAxes),
    /// APT: a statement with the wrong values.
    #[error("{word}: {why}")]
    Statement {
        /// Major word.
        word: String,
        /// Expectation.
        why: &'static str,
    },
}
