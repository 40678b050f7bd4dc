//! Faults with file and line.

/// Why files describe no blade: the fault, and where it is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}{}: {fault}", .line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub struct BladeFileError {
    /// File as the `.inf` file names it.
    pub file: String,
    /// Line, from 1, if the fault is at one.
    pub line: Option<usize>,
    /// The fault.
    pub fault: BladeFault,
}

impl BladeFileError {
    /// A fault at a line of a file.
    pub(crate) fn at(file: &str, line: usize, fault: BladeFault) -> Self {
        Self { file: file.to_owned(), line: Some(line), fault }
    }

    /// A fault of a whole file.
    pub(crate) fn of_file(file: &str, fault: BladeFault) -> Self {
        Self { file: file.to_owned(), line: None, fault }
    }
}

/// Fault of a blade description, with the remedy in its text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BladeFault {
    /// The file cannot be read.
    #[error("{0}")]
    Unread(String),
    /// Bytes that are no text.
    #[error("is not text in UTF-8; export it as text")]
    NoText,
    /// A key that must be there is missing.
    #[error("has no line \"{0}: …\"; add it")]
    MissingKey(&'static str),
    /// A key is there twice with different values.
    #[error("\"{0}\" is given twice; keep one")]
    RepeatedKey(String),
    /// Several profile files without the number of blades in a set.
    #[error(
        "names a second profile file; keep one, or add \"Number of Blades Per Set: …\" with the number of blades in all \
         of them"
    )]
    SecondProfile,
    /// A value that is not among those known.
    #[error("{key} is \"{value}\"; write one of {known}")]
    UnknownValue {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// Values that are read.
        known: &'static str,
    },
    /// A number that is out of its range, or none.
    #[error("{key} is \"{value}\"; write a whole number from 1 to {most}")]
    WrongCount {
        /// The key.
        key: &'static str,
        /// Its value.
        value: String,
        /// Greatest value.
        most: u32,
    },
    /// Another number of blades in the profile files than the `.inf` file says.
    #[error(
        "Number of Blades Per Set is {given}, but the profiles are of {found}; correct the number, or begin the sections \
         of each blade with a line such as \"## Splitter blade\""
    )]
    WrongBladesPerSet {
        /// Number that the `.inf` file has.
        given: u32,
        /// Blades found.
        found: u32,
    },
    /// Form of an edge of a blade that is not there.
    #[error(
        "Blade {blade} is not there: the profiles are of {found}, the first one Blade 0; remove the line, or begin the \
         sections of each blade with a line such as \"## Splitter blade\""
    )]
    NoSuchBlade {
        /// Number of the blade, from 0.
        blade: u32,
        /// Blades found.
        found: u32,
    },
    /// More blades in a set than are read.
    #[error("more than {0} blades in a set; keep those of one set")]
    TooManyBlades(u32),
    /// A name that leads out of the folder of the `.inf` file.
    #[error("the name \"{0}\" leads out of the folder; name a file below the folder of the .inf file")]
    OutsideName(String),
    /// A line that is no point.
    #[error("\"{0}\" is no point; write x, y, z and, at an edge, a mark le, te, le1, le2, te1 or te2")]
    NoPoint(String),
    /// A coordinate that is not finite, or too large.
    #[error("the coordinate \"{0}\" is not finite or farther than 100 m from the origin; correct it or the units")]
    WrongCoordinate(String),
    /// More points than are read.
    #[error("more than {most} points {per}; thin them out")]
    TooManyPoints {
        /// Most points.
        most: usize,
        /// Unit that the points are counted in, such as a file.
        per: &'static str,
    },
    /// Too few points or sections.
    #[error("{what} has {given}; it needs at least {least}")]
    TooFew {
        /// Name of the thing that has too few.
        what: String,
        /// Number given.
        given: usize,
        /// Least number.
        least: usize,
    },
    /// A point is where the one before it is.
    #[error("the point is the same as the one before; remove one of them")]
    DuplicatePoint,
    /// Sections have different numbers of points.
    #[error(
        "\"{name}\" has {given} points, the first section {first}; export all sections of a blade with the same number, \
         and begin those of a splitter blade with a line \"## Splitter blade\""
    )]
    UnequalSections {
        /// Name of the section.
        name: String,
        /// Its points.
        given: usize,
        /// Points of the first section.
        first: usize,
    },
    /// Some sections are closed, or have marks, and others are not.
    #[error("\"{name}\" {what}, unlike the first section; export all sections alike")]
    UnlikeSections {
        /// Name of the section.
        name: String,
        /// How it differs.
        what: &'static str,
    },
    /// Marks that describe no edge.
    #[error("\"{name}\": {what}")]
    WrongMarks {
        /// Name of the section.
        name: String,
        /// The fault, with its remedy.
        what: &'static str,
    },
    /// A section without an inside.
    #[error("the points of \"{0}\" are on one line; give those of both sides")]
    FlatSection(String),
    /// A section crosses or touches itself.
    #[error("\"{name}\" crosses or touches itself here and at line {other}; correct the order of its points")]
    CrossedSection {
        /// Name of the section.
        name: String,
        /// Line of the other place.
        other: usize,
    },
    /// A section runs the other way round.
    #[error("\"{0}\" runs the other way round than the first section; reverse its points")]
    ReversedSection(String),
    /// A section lies behind the one before it.
    #[error(
        "\"{0}\" does not lie on the shroud's side of the section before; order the sections from hub to shroud, and \
         begin those of a splitter blade with a line \"## Splitter blade\""
    )]
    DisorderedSection(String),
}
