use std::ops::Range;

use crate::dialect::Dialect;
use crate::dialect::file::RtcpRapids;
use crate::program::{Coolant, FeedMode, WorkOffset};
use crate::read::feed_place::FeedPlace;
use crate::read::length_check::{LengthCheck, LengthRelation};
use crate::read::position::ReadPosition;
use crate::words::axis_lengths::AxisLengths;
use crate::words::axis_words::AxisWords;
use crate::words::said_words::SaidWords;

/// mm per inch.
const MM_PER_INCH: f64 = 25.4;

/// An NC program as its text says it: modal state resolved, nothing executed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadProgram {
    /// Control whose language it was read in.
    pub dialect: Dialect,
    /// Every line that says something, in order.
    pub blocks: Vec<ReadBlock>,
    /// Tool lengths the program was computed with, from its `(TOOL LENGTH …)` comments and from
    /// checks that compare the length in a register with a number.
    pub tool_lengths: Vec<ToolLengthNote>,
    /// Questions that the text alone does not settle.
    pub notes: Vec<ReadNote>,
    /// Motion at rapid rate under RTCP of the control that the text is for.
    pub rtcp_rapids: RtcpRapids,
    /// M functions ([`ReadCommand::Function`]) that change nothing which is simulated: those of the
    /// dialect file.
    pub harmless_functions: Vec<u32>,
    /// Whether it is a part of a program that goes on behind it with a tool change
    /// ([`tool_sections`](Self::tool_sections)), and so needs no end of its own.
    pub goes_on: bool,
}

/// One line of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadBlock {
    /// Line in the file, from 1.
    pub line: u32,
    /// Block number (N).
    pub number: Option<u32>,
    /// The line without blanks at its ends; bytes that are not UTF-8 (they can stand in comments
    /// only) are replaced. Empty from a reader that keeps no text.
    pub text: Box<str>,
    /// Whether the line starts with `/`, so that a switch on the control decides if it is executed.
    /// Positions are resolved as if it were.
    pub skippable: bool,
    /// Whether it moves axes or changes what the control remembers of motions: it has macro text or
    /// any word but M, S, T and those of a dwell.
    pub sets_state: bool,
    /// State words that it says.
    pub said: SaidWords,
    /// Length compensation in force behind the block, whether it moves or not.
    pub compensation: Compensation,
    /// The same by axis, for machines of several heads.
    pub lengths: AxisLengths,
    /// Place of its feed in the source.
    pub feed_place: FeedPlace,
    /// Where the block moves to.
    pub motion: Option<ReadMotion>,
    /// Further statements.
    pub commands: Vec<ReadCommand>,
}

impl ReadBlock {
    /// Whether it puts a tool into the spindle (M6, TOOL CALL).
    #[must_use]
    pub fn changes_tool(&self) -> bool {
        self.commands.contains(&ReadCommand::ToolChange)
    }

    /// Bytes of the source that are the F word: [`FeedPlace::span`].
    #[must_use]
    pub fn feed_span(&self) -> Option<Range<usize>> {
        self.feed_place.span()
    }

    /// Byte of the source before which a feed belongs: [`FeedPlace::insert_at`].
    #[must_use]
    pub fn insert_feed_at(&self) -> Option<usize> {
        self.feed_place.insert_at()
    }
}

/// A move and the modal state it is made in.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReadMotion {
    /// How it goes.
    pub kind: MotionKind,
    /// Where every axis is known to be at its end, in the order the program first named them. Axes
    /// of unknown position (not programmed yet, or since an offset changed) are absent.
    pub position: ReadPosition,
    /// Whether the words count in inches; position and feed are mm and mm/min in either case.
    pub is_inch: bool,
    /// mm/min that an F of 1 is: 1 but for feeds in inch/min, or in tenths of it (Heidenhain).
    pub feed_unit: f64,
    /// Feed of a cutting move; `None` for rapids and where the program has not given one.
    pub feed: Option<Feed>,
    /// Meaning of F in force, also where there is no feed.
    pub feed_mode: FeedMode,
    /// Work offset in force.
    pub work_offset: WorkOffset,
    /// Length compensation in force.
    pub compensation: Compensation,
    /// The same by axis, for machines of several heads.
    pub lengths: AxisLengths,
    /// Where a reference return goes first, in words; `None` where it goes directly.
    pub via: Option<Box<AxisWords>>,
    /// Centre or radius of an arc.
    pub arc: Option<Box<ArcWords>>,
    /// Direction of the tool as a vector. The rotary axes are not known behind it, and a
    /// [`MacroKind::ToolVector`] of the same block says so, or a [`MacroKind::VariableWords`] where
    /// more is open.
    pub tool: Option<Box<ToolVectors>>,
}

/// Directions that stand in a block instead of rotary words, as programmed: in the frame of the
/// words, of any length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolVectors {
    /// From the tip to the spindle (Siemens A3 B3 C3, Heidenhain TX TY TZ).
    pub axis: Option<[f64; 3]>,
    /// Normal of the surface (Siemens A5 B5 C5, Heidenhain NX NY NZ).
    pub normal: Option<[f64; 3]>,
}

/// How a move goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MotionKind {
    /// At rapid rate (G0), under the control's rapid law.
    Rapid,
    /// Cutting (G1), under the control's cutting law.
    Linear,
    /// Cutting along an arc or helix (G2, G3); its position is the end.
    Arc {
        /// G2.
        clockwise: bool,
    },
    /// At rapid rate to a reference position of the machine (G28, G30).
    ReferenceReturn,
    /// A drilling or boring cycle (G73 to G89) at the position; what it does along the tool is not
    /// resolved.
    Cycle {
        /// The G number.
        code: u8,
    },
}

impl MotionKind {
    /// Whether it is made at rapid rate.
    #[must_use]
    pub fn is_rapid(self) -> bool {
        matches!(self, Self::Rapid | Self::ReferenceReturn)
    }
}

/// Feed of a cutting move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feed {
    /// Meaning of the number.
    pub mode: FeedMode,
    /// mm/min, or 1/min in G93. As programmed, so 0 is possible.
    pub value: f64,
}

/// Tool length compensation in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compensation {
    /// None (G49, H0).
    #[default]
    Off,
    /// Along the axis parallel to the spindle at the zero pose, by this length register (G43 H).
    Length(u32),
    /// RTCP with this length register: the linear words are the tip's (G43.4 H).
    Rtcp(u32),
}

/// Plane of arcs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    #[default]
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

/// Centre or radius of an arc, as programmed, mm; `None` where it is not given or not evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArcWords {
    /// Plane of the circle.
    pub plane: Plane,
    /// I.
    pub i: Option<f64>,
    /// J.
    pub j: Option<f64>,
    /// K.
    pub k: Option<f64>,
    /// R.
    pub r: Option<f64>,
    /// X, Y and Z of the centre where they are given as words of the work offset and not from the
    /// start: `I=AC(…)`, CC, G90.1.
    pub centre: [Option<f64>; 3],
    /// Angle of the arc where it is given, deg, positive (Siemens AR, Heidenhain IPA).
    pub angle: Option<f64>,
    /// Whole turns before the end (TURN, or P of a helix).
    pub turns: u32,
}

/// Statement of a block besides its motion.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReadCommand {
    /// Text in parentheses or behind a semicolon.
    Comment(String),
    /// Program number (O).
    ProgramNumber(u32),
    /// Tool number (T); the change itself is M6.
    Tool(u32),
    /// Tool that is called by a name, or by a number that is not whole.
    ToolName(String),
    /// Tool that is made ready and not changed to (the second T of a Mazak block, TOOL DEF).
    NextTool(u32),
    /// Number of the spindle (P) that S, M3, M4 and M5 of the same block are for, on machines with
    /// several; it precedes them.
    Spindle(u32),
    /// Spindle speed (S), 1/min.
    SpindleSpeed(f64),
    /// Spindle on.
    SpindleOn {
        /// M3.
        clockwise: bool,
    },
    /// Spindle off (M5).
    SpindleOff,
    /// Tool change (M6).
    ToolChange,
    /// Coolant state (M7, M8, M9).
    Coolant(Coolant),
    /// Dwell (G4), s.
    Dwell(f64),
    /// Stop, or optional stop (M0, M1).
    Stop {
        /// M1.
        optional: bool,
    },
    /// End of program (M2, M30).
    End,
    /// Any other M function: harmless where [`ReadProgram::harmless_functions`] has it, else nobody
    /// knows what it does.
    Function(u32),
    /// Any other word that goes to the machine builder's logic, as it stands (H of Siemens): nobody
    /// knows what it does.
    Auxiliary(String),
    /// A word of the control that changes how a path is kept, how fast it is gone, or what is
    /// shown, as it stands (`COMPCAD`, `FGROUP(X,Y)`, `OVR=50`): it changes no position and no
    /// number of a feed. In the language of FANUC and its relatives with the words of the block
    /// that may belong to it (`G64 P0.01 Q0.001`).
    Mode(String),
    /// Called cycle or subprogram with its arguments. A [`ReadCommand::Macro`] of the same block,
    /// or the [`MotionKind::Cycle`] of the motions, gives its effect on axes or offsets; without
    /// one it has none.
    Call(Box<ReadCall>),
    /// Text that is kept and not evaluated.
    Macro {
        /// Kind.
        kind: MacroKind,
        /// Its text, unchanged.
        text: String,
    },
}

/// A cycle or subprogram that a block names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadCall {
    /// Kind.
    pub kind: CallKind,
    /// Its number or name, such as `CYCLE81`, `200`, `9010`.
    pub name: String,
    /// As they stand, without the parentheses.
    pub arguments: String,
    /// Whether the blocks that follow call it again (MCALL, G66, M89).
    pub is_modal: bool,
}

/// Kinds of [`ReadCall`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CallKind {
    /// A cycle of the control, run here.
    Cycle,
    /// A cycle that is described here and run where it is called (CYCL DEF).
    Definition,
    /// More arguments of the definition in the lines before.
    Arguments,
    /// The cycle or program that was described last is run here (CYCL CALL, M99).
    Defined,
    /// A subprogram or macro.
    Subprogram,
    /// A line that calls can be made to, or that ends what is called (LBL).
    Label,
}

/// Kind of a macro line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MacroKind {
    /// `#100=…`.
    Assignment,
    /// `#3000=n(text)`: an alarm that stops the control.
    Alarm,
    /// `IF`, `GOTO`, `WHILE`, `END` and O words with a condition.
    Branch,
    /// Subprogram and macro calls (M98, M99, G65 to G67); may move every axis.
    Call,
    /// A call behind the motion of its block (MCALL of Siemens, M89 and M99 of Heidenhain); may
    /// move every axis.
    CallBehind,
    /// Words whose value is a variable or an expression that is not evaluated, or a vector without
    /// all of its components; may move every axis.
    VariableWords,
    /// A tool axis as a vector ([`ReadMotion::tool`]): the control finds the rotary axes itself.
    /// Nothing else of the block is open.
    ToolVector,
    /// Words that the control understands and that are not followed: radius compensation, tilted
    /// planes, corners. The text says why. Where the axes are is not known until what began is
    /// ended and words name them again.
    NotFollowed,
    /// Text for a screen, a file or a printer (DPRNT, FN 16); moves nothing.
    Output,
    /// A setting of offsets or control data (G10, G52, G92) and its words.
    Setting,
}

/// Length a program was computed with, or that it compares the tool's length with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolLengthNote {
    /// Line of the comment or the check, from 1.
    pub line: u32,
    /// mm.
    pub length: f64,
    /// Register (H) that the comment names: `TOOL LENGTH 420.000 H2`.
    pub register: Option<u32>,
    /// How the tool's length has to be to it: an order only of a check that else raises an alarm.
    pub relation: LengthRelation,
    /// Check of the program that compares the tool's length with it; `None` of a comment that no
    /// check repeats.
    pub check: Option<ToolLengthCheck>,
}

/// Place of a check of the tool's length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToolLengthCheck {
    /// Line, from 1.
    pub line: u32,
    /// Register that it reads; `None` for the length in force.
    pub register: Option<u32>,
}

impl ToolLengthNote {
    /// Of a check in a line.
    pub(crate) fn of_check(line: u32, check: LengthCheck, is_inch: bool) -> Self {
        let length = if is_inch { check.length * MM_PER_INCH } else { check.length };
        let at = ToolLengthCheck { line, register: check.register };
        Self { line, length, register: check.register, relation: check.relation, check: Some(at) }
    }

    /// Adds a check to notes: to the comment that it repeats, or as a note of its own where none
    /// says the same. A check of another register is another tool's.
    pub(crate) fn add_check(self, notes: &mut Vec<Self>) {
        let fits = |n: &Self| n.register.is_none() || self.register.is_none() || n.register == self.register;
        // A comment and the check that repeats it are one cause. The latest comes first: each part
        // of a program that changes tools names the length of its own.
        let is_same = |n: &&mut Self| n.length == self.length && n.relation == self.relation && fits(n);
        match notes.iter_mut().rev().find(is_same) {
            Some(repeated) if repeated.check.is_none() => repeated.check = self.check,
            Some(repeated) if repeated.check.map(|c| c.register) == self.check.map(|c| c.register) => {
                // Without a register the length in force is compared: behind another change it is
                // another tool's.
                if self.register.is_none() {
                    notes.push(self);
                }
            }
            _ => notes.push(self),
        }
    }
}

/// Something a reader could not decide from the text alone, once per kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadNote {
    /// First line it concerns, from 1.
    pub line: u32,
    /// That line without blanks at its ends.
    pub text: Box<str>,
    /// Number of lines it concerns.
    pub count: usize,
    /// Kind.
    pub kind: NoteKind,
}

/// Kinds of [`ReadNote`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoteKind {
    /// An axis word or a feed without a decimal point was read in mm, deg or the unit of feeds; a
    /// control may count it in least increments.
    NoDecimalPoint,
    /// Macro text was kept and not evaluated, and may change where the axes are.
    NotEvaluated,
    /// Macro text that may skip, repeat or stop what follows was kept and not evaluated. A check
    /// that only raises an alarm (`IF […] GOTO n`, `#3000=…`, `N n`) does not count.
    Branch,
    /// Blocks with `/` are read as executed.
    Skippable,
    /// A feed was given in inch/min; what it counts of rotary axes depends on the control.
    InchFeed,
    /// Lines behind the end mark `%` were not read.
    BehindEnd,
}

impl ReadProgram {
    /// Length the program was computed with, mm: that of its first note that is no bound.
    #[must_use]
    pub fn tool_length(&self) -> Option<f64> {
        self.tool_lengths.iter().find(|note| note.relation == LengthRelation::Same).map(|note| note.length)
    }

    /// Whether the control does what the blocks say: no macro text may skip, repeat or move
    /// anything.
    ///
    /// Moves of any other program are not to be relied on, so its reader checks this first:
    ///
    /// ```
    /// use facemill_nc_program::read::read_fanuc;
    ///
    /// assert!(read_fanuc("G90 G1 X10. F500.\nX20.\n")?.is_evaluated());
    /// assert!(!read_fanuc("IF [#4012 EQ 54] GOTO 20\nG90 G1 X10. F500.\nN20 X20.\n")?.is_evaluated());
    /// # Ok::<(), facemill_nc_program::read::ReadError>(())
    /// ```
    #[must_use]
    pub fn is_evaluated(&self) -> bool {
        self.notes.iter().all(|note| !matches!(note.kind, NoteKind::NotEvaluated | NoteKind::Branch))
    }

    /// All moves with their blocks, in order.
    pub fn motions(&self) -> impl Iterator<Item = (&ReadBlock, &ReadMotion)> {
        self.blocks.iter().filter_map(|block| Some((block, block.motion.as_ref()?)))
    }
}
