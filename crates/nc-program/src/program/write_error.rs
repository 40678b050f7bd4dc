use crate::words::axis_words::AxisLetter;

/// Why a program cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The template does not compile, or asks for something that is not there.
    #[error("template {name}{}: {message}", line.map(|l| format!(", line {l}")).unwrap_or_default())]
    Template {
        /// File name.
        name: String,
        /// Line in the template, from 1, where it is known.
        line: Option<usize>,
        /// Fault.
        message: String,
    },
    /// The motions have no place, or more than one.
    #[error("template {name}: `{{{{ body }}}}` must stand alone on exactly one line, and occurs on {count}")]
    TemplateBody {
        /// File name.
        name: String,
        /// Number of lines that are the body.
        count: usize,
    },
    /// The first motion is a cut, or there is none: the template would go there at rapid rate.
    #[error("the first motion must be a rapid")]
    FirstMotion,
    /// There is nothing to write.
    #[error("a program that changes tools needs at least one section")]
    NoSection,
    /// A template begins every section as a program.
    #[error(
        "the section of the second tool begins with `{line}`, as the program does: the template needs `section.first`"
    )]
    SectionBegins {
        /// Its first line.
        line: String,
    },
    /// Two sections have one label.
    #[error("the label `{label}` is in the sections of two tools: the template needs `section.number` in it")]
    RepeatedLabel {
        /// The label.
        label: String,
    },
    /// RTCP words say nothing about where the axes are before RTCP is on.
    #[error("under RTCP the program needs the words of the place where it is switched on (`approach`)")]
    NoApproach,
    /// The heads do not go together with each other or with the axes.
    #[error(transparent)]
    Heads(#[from] crate::program::heads::HeadError),
    /// The tool or spindle of the program is not that of its first head.
    #[error("the {what} of the program is not that of its first head, `{head}`")]
    OtherFirstHead {
        /// Its name.
        head: String,
        /// `tool` or `spindle`.
        what: &'static str,
    },
    /// RTCP holds one tip still, and there are several.
    #[error("a program of several heads cannot be written with the feed mode rtcp: use g94 or g93")]
    RtcpOfHeads,
    /// The first motion says nothing of a spindle axis, so that its length cannot be switched on.
    #[error("the first motion must name {axis}, the spindle axis of the head `{head}`")]
    FirstMotionOfHead {
        /// Its name.
        head: String,
        /// Its spindle axis.
        axis: AxisLetter,
    },
    /// A block does not say which of several heads it is for.
    #[error("{place}: {why}")]
    WhichHead {
        /// Block, such as `block 12`.
        place: String,
        /// Missing part.
        why: String,
    },
    /// Something that two channel programs cannot say.
    #[error("{place}: {why}")]
    NotInChannels {
        /// Block, such as `block 12`, axis or setting.
        place: String,
        /// Why not.
        why: &'static str,
    },
    /// Something that the control has no word for.
    #[error("{place}: {name} has no word for this: {what}")]
    NotInDialect {
        /// Block, such as `block 12`, or field, such as `coolant`.
        place: String,
        /// Statement that cannot be written.
        what: String,
        /// Name of the control.
        name: String,
    },
    /// The control does not move at rapid rate as was planned.
    #[error(
        "rapids were planned {}, and {name} does not move so: change motion.rapid of the machine file",
        if *linear { "on straight lines" } else { "with each axis at its own speed" }
    )]
    Rapid {
        /// Name of the control.
        name: String,
        /// As planned.
        linear: bool,
    },
    /// The control always blends and needs a tolerance, or does not accept one this small.
    #[error(
        "{name} smooths paths within a tolerance that the program tells it: \
         motion.control_tolerance.{key} of the machine file must be at least 0.0001"
    )]
    Tolerance {
        /// Name of the control.
        name: String,
        /// Key of the machine file.
        key: &'static str,
    },
    /// The dialect's way home needs the machine's reference position.
    #[error("the reference position of axis {axis} is not known: the settings need the machine (`on_machine`)")]
    NoHome {
        /// The axis.
        axis: AxisLetter,
    },
    /// A cut without tool axis in a program of tool vectors.
    #[error("{place}: a cut must say its tool axis and surface normal where post.orientation is vectors; take rotary")]
    NoVectors {
        /// Block, such as `block 12`.
        place: String,
    },
    /// A block of a program of tool vectors must name every linear axis.
    #[error("{place}: the position of axis {letter} must be said before the first block with vectors")]
    UnknownWord {
        /// Block, such as `block 12`.
        place: String,
        /// The axis.
        letter: AxisLetter,
    },
    /// Two axes of the machine have the same name.
    #[error("two axes are named {0}")]
    TwoAxes(AxisLetter),
    /// A block names an axis that the machine does not have.
    #[error("{place}: the machine has no axis {letter}")]
    NoSuchAxis {
        /// Block, such as `block 12`.
        place: String,
        /// The axis.
        letter: AxisLetter,
    },
    /// A number that no word can hold: not finite, too large, or a feed, speed or time that is not
    /// positive once rounded.
    #[error("{place}: {value} cannot be written as {what}")]
    Number {
        /// Block, such as `block 12`, or field, such as `tool.length`.
        place: String,
        /// Expected meaning.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A line longer than the control takes.
    #[error("`{text}` is longer than {limit} characters, the largest `max_line_length` allows")]
    LineTooLong {
        /// The line.
        text: String,
        /// Most characters.
        limit: usize,
    },
    /// A character that the control does not know, or a parenthesis inside a comment.
    #[error("`{text}`: character {character:?} is not permitted there")]
    Character {
        /// The line.
        text: String,
        /// The character.
        character: char,
    },
    /// A cutter location with a number that is not finite or too large.
    #[error("move {index}: a coordinate is not finite or too large")]
    Coordinate {
        /// Index of the move, from 0.
        index: usize,
    },
}
