//! A program line by line: where its words take the axes, and how long its cuts take by their F.

use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Machine};
use facemill_nc_program::{
    AxisAt, AxisLetter, AxisWords, Compensation, Dialect, FeedMode, MotionKind, ReadBlock, ReadCommand, ReadMotion,
    RtcpRapids, WordMap, WordMapError, WorkOffset,
};
use nalgebra::{Isometry3, Unit, Vector3};

use crate::motion::counted_axes::CountedAxes;
use crate::motion::rolled_words::RolledWords;

/// What turns words into axis values.
pub struct Surroundings<'a> {
    /// The machine, of two heads as one of them sees it.
    pub machine: &'a Machine,
    /// From the gauge line to the tip, mm.
    pub tool_length: f64,
    /// How words become axis values.
    pub words: &'a WordMap,
    /// Frame of the words under RTCP on the table; `None` where the machine has no X, Y and Z at
    /// right angles.
    pub frame: Option<Isometry3<f64>>,
    /// Work offset that the words refer to; `None`: the first one that the program names.
    pub work_offset: Option<WorkOffset>,
}

/// What a block does to the axes.
pub enum Way {
    /// Nothing moves.
    Stands,
    /// At rapid rate from each position to the next.
    Rapid {
        /// Where it begins, where it passes, and where it ends.
        positions: Vec<AxisValues>,
        /// Motion between two of them.
        law: BlockLaw,
    },
    /// A straight cut between positions that the program has said.
    Cut(FollowedCut),
    /// An arc, a cycle, or a cut whose start or end the program has not said; where it ends, if
    /// that is known.
    Other(Option<AxisValues>),
}

/// A straight cut.
#[derive(Clone, Copy)]
pub struct FollowedCut {
    /// Where it begins.
    pub from: AxisValues,
    /// Where it ends.
    pub to: AxisValues,
    /// The tool axis as the block's text says it, frame of the words; `None` where rotary words do,
    /// or nothing does.
    pub vector: Option<[f64; 3]>,
    /// Straight way of the tip against the workpiece, mm.
    pub way: f64,
    /// What F counts: that of its own, or of the mode without one.
    pub mode: FeedMode,
    /// Way that F counts, mm (deg where rotary axes alone count).
    pub counted: f64,
    /// Whether that is the norm over all axes.
    pub is_norm: bool,
    /// Time by the F in force, s; `None` without one.
    pub time: Option<f64>,
}

/// What is known of an axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Known {
    /// It is taken to be at home, where it is at the start.
    Assumed,
    /// The program has said where it is.
    Told,
    /// It may be anywhere.
    Lost,
}

/// Follows a program.
pub struct Follower<'a> {
    at: Surroundings<'a>,
    dialect: Dialect,
    /// Whether the tip goes straight at rapid rate under RTCP.
    keeps_tip: bool,
    counted: CountedAxes,
    /// Machine value that is word 0 with length compensation, per axis.
    compensated_zero: Vec<f64>,
    /// Where words of axes that count to 360 deg lead.
    rolled: RolledWords,
    axes: AxisValues,
    known: Vec<Known>,
}

/// Way of the tip below which it stands, mm: rounding of forward kinematics. F under RTCP says
/// nothing of such a block.
const STANDS: f64 = 1e-9;

impl<'a> Follower<'a> {
    /// At the start all axes are at home, where it is not known better.
    ///
    /// # Errors
    /// None but for words that are not the machine's.
    pub fn new(at: Surroundings<'a>, dialect: Dialect, rapids: RtcpRapids) -> Result<Self, String> {
        let axes = at.machine.home();
        let letters = at.words.axes().iter().map(|a| (a.letter, 0.0));
        let zeros = AxisWords::from_words(letters).map_err(|e| e.to_string())?;
        let compensated_zero = at.words.joints(&zeros).map_err(|e| e.to_string())?;
        let known = vec![Known::Assumed; axes.len()];
        let keeps_tip = rapids == RtcpRapids::TipLinear;
        let (counted, rolled) = (CountedAxes::default(), RolledWords::default());
        Ok(Self { at, dialect, keeps_tip, counted, compensated_zero, rolled, axes, known })
    }

    /// Goes on by a block.
    ///
    /// # Errors
    /// What it does to axes or feeds that cannot be followed.
    pub fn block(&mut self, block: &ReadBlock) -> Result<Way, String> {
        self.read_modes(block)?;
        let Some(motion) = &block.motion else { return Ok(Way::Stands) };
        self.check_frame(motion)?;
        let (from, was_known) = (self.axes, self.knowledge());
        let via = |via: &AxisWords| self.words_end(motion, |letter| via.get(letter).map(AxisAt::Word));
        let via = motion.via.as_deref().and_then(via);
        let to = self.end(motion)?;
        self.rolled.go_on(motion);
        let Some(to) = to else {
            self.lose(motion);
            return Ok(Way::Other(None));
        };
        self.axes = to;
        for (k, axis) in self.at.words.axes().iter().enumerate() {
            // A vector says where the rotary axes go, if it is known where they come from.
            if motion.position.get(axis.letter).is_some() {
                self.known[k] = Known::Told;
            }
        }
        if was_known == Known::Lost {
            return Ok(Way::Other(Some(to)));
        }
        match motion.kind {
            MotionKind::Rapid | MotionKind::ReferenceReturn => {
                let positions = [Some(from), via, Some(to)].into_iter().flatten().collect();
                Ok(Way::Rapid { positions, law: self.rapid_law(motion) })
            }
            MotionKind::Linear if was_known == Known::Told && self.knowledge() == Known::Told => {
                self.cut(motion, &from, &to).map(Way::Cut)
            }
            _ => Ok(Way::Other(Some(to))),
        }
    }

    /// From here on it is not known where the axes are until the program says it.
    pub fn forget(&mut self) {
        self.known.fill(Known::Lost);
    }

    /// The least that is known of an axis.
    fn knowledge(&self) -> Known {
        let has = |what: Known| self.known.contains(&what);
        if has(Known::Lost) {
            Known::Lost
        } else if has(Known::Assumed) {
            Known::Assumed
        } else {
            Known::Told
        }
    }

    fn read_modes(&mut self, block: &ReadBlock) -> Result<(), String> {
        if self.dialect != Dialect::LinuxCnc {
            return self.counted.read(self.dialect, block);
        }
        match block.commands.iter().any(|c| matches!(c, ReadCommand::Function(430))) {
            true => Err("M430 switches to kinematics that are not known".to_owned()),
            false => Ok(()),
        }
    }

    fn check_frame(&mut self, motion: &ReadMotion) -> Result<(), String> {
        for (letter, at) in motion.position.iter() {
            if self.at.words.axes().iter().all(|a| a.letter != letter) {
                return Err(WordMapError::NoSuchAxis(letter).to_string());
            }
            let AxisAt::Word(_) = at else { continue };
            let (found, expected) = (motion.work_offset, *self.at.work_offset.get_or_insert(motion.work_offset));
            if found != expected {
                return Err(WordMapError::OtherOffset { found, expected }.to_string());
            }
        }
        Ok(())
    }

    /// Where a motion ends; `None` where that is not known.
    fn end(&self, motion: &ReadMotion) -> Result<Option<AxisValues>, String> {
        match (motion.compensation, motion.kind) {
            (Compensation::Rtcp(_), MotionKind::ReferenceReturn) => {
                let home = |at: AxisAt| matches!(at, AxisAt::Reference(_)).then_some(at);
                Ok(self.words_end(motion, |letter| motion.position.get(letter).and_then(home)))
            }
            (Compensation::Rtcp(_), _) => self.rtcp_end(motion),
            _ if motion.tool.is_some() => Err("a tool vector without RTCP is not followed".to_owned()),
            _ => Ok(self.words_end(motion, |letter| motion.position.get(letter))),
        }
    }

    /// The end where linear words are the axes' own.
    fn words_end(&self, motion: &ReadMotion, at: impl Fn(AxisLetter) -> Option<AxisAt>) -> Option<AxisValues> {
        let words = self.at.words;
        let is_compensated = |letter: AxisLetter| match motion.compensation {
            _ if !words.heads().is_empty() => motion.lengths.register_of(letter).is_some(),
            Compensation::Off => false,
            Compensation::Length(_) | Compensation::Rtcp(_) => true,
        };
        let mut end = self.axes;
        for (k, axis) in words.axes().iter().enumerate() {
            let zero = if is_compensated(axis.letter) { self.compensated_zero[k] } else { axis.offset };
            let own = &self.at.machine.axes()[k];
            end[k] = match at(axis.letter) {
                Some(AxisAt::Word(word)) => self.rolled.value(own, (motion, axis.letter), word, zero, self.axes[k]),
                Some(AxisAt::Machine(value)) => RolledWords::place(own, self.joint_unit(k, value), self.axes[k]),
                Some(AxisAt::Reference(1)) => RolledWords::place(own, own.home, self.axes[k]),
                Some(AxisAt::Reference(_)) => return None,
                None if self.stays(motion, k) => continue,
                None => return None,
            };
        }
        Some(end)
    }

    /// The end under RTCP: X, Y and Z are the tip's, in the frame of the words.
    fn rtcp_end(&self, motion: &ReadMotion) -> Result<Option<AxisValues>, String> {
        let (machine, length) = (self.at.machine, self.at.tool_length);
        let frame =
            self.at.frame.ok_or("its words are the tip's (RTCP), and the machine has no X, Y and Z at right angles")?;
        let vector = motion.tool.as_ref().and_then(|tool| tool.axis);
        let mut tip = frame.inverse_transform_point(&machine.cl_point(&self.axes, length).tip);
        let mut rotaries = self.axes;
        for (k, axis) in self.at.words.axes().iter().enumerate() {
            let coordinate = "XYZ".find(axis.letter.letter()).filter(|_| axis.letter.number() == 0);
            match (motion.position.get(axis.letter), coordinate) {
                (Some(AxisAt::Word(word)), Some(coordinate)) => tip[coordinate] = word,
                (Some(AxisAt::Word(word)), None) => {
                    let own = &machine.axes()[k];
                    rotaries[k] = self.rolled.value(own, (motion, axis.letter), word, axis.offset, self.axes[k]);
                }
                (None, Some(_)) if self.stays(motion, k) && self.knowledge() != Known::Lost => {}
                (None, None) if self.stays(motion, k) => {}
                (None, _) => return Ok(None),
                (Some(_), _) => {
                    return Err(format!("{} is at a machine position while words are the tip's", axis.letter));
                }
            }
        }
        let tip = frame * tip;
        let Some(vector) = vector else { return Ok(machine.with_tip_at(&rotaries, &tip, length)) };
        let axis = Unit::try_new(Vector3::from(vector), f64::MIN_POSITIVE).ok_or("its tool vector has no length")?;
        let cl = ClPoint { tip, axis: frame * axis };
        let turned = machine.control_choice(&self.axes, &cl, length);
        let what = "where the control turns the axes to for its tool vector is not known";
        turned.map(Some).map_err(|why| format!("{what}: {why}; write the program with rotary words"))
    }

    /// Whether an axis that a motion does not name stays where it is known to be.
    fn stays(&self, motion: &ReadMotion, axis: usize) -> bool {
        self.known[axis] != Known::Lost && !motion.position.is_programmed(self.at.words.axes()[axis].letter)
    }

    /// The axes that a motion sends anywhere are lost.
    fn lose(&mut self, motion: &ReadMotion) {
        for (k, axis) in self.at.words.axes().iter().enumerate() {
            if motion.position.is_programmed(axis.letter) || motion.position.get(axis.letter).is_some() {
                self.known[k] = Known::Lost;
            }
        }
    }

    fn joint_unit(&self, axis: usize, word: f64) -> f64 {
        if self.at.machine.axes()[axis].kind == AxisKind::Rotary { word.to_radians() } else { word }
    }

    /// What the control does at rapid rate: a way to a reference position is always the axes' own.
    fn rapid_law(&self, motion: &ReadMotion) -> BlockLaw {
        let law = self.at.machine.motion_law();
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        if !(is_rtcp && self.keeps_tip && motion.kind == MotionKind::Rapid) {
            return BlockLaw::Rapid(law.rapid);
        }
        BlockLaw::Cutting(match law.cutting {
            CuttingLaw::AxesLinear => CuttingLaw::TipAndRotariesLinear,
            law => law,
        })
    }

    fn cut(&self, motion: &ReadMotion, from: &AxisValues, to: &AxisValues) -> Result<FollowedCut, String> {
        let (machine, length) = (self.at.machine, self.at.tool_length);
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        if let Some(feed) = motion.feed.filter(|f| f.value <= 0.0 || f.value.is_nan()) {
            return Err(format!("its feed is {}", feed.value));
        }
        let tip = |axes: &AxisValues| machine.cl_point(axes, length).tip;
        let way = (tip(to) - tip(from)).norm();
        let mode = motion.feed.map_or(if is_rtcp { FeedMode::Rtcp } else { FeedMode::G94 }, |f| f.mode);
        let (counted, is_norm) = match mode {
            FeedMode::G94 if is_rtcp => return Err("F is not the tip's under RTCP there".to_owned()),
            FeedMode::G94 => self.counted.length(self.dialect, machine, [from, to], motion.feed_unit)?,
            FeedMode::Rtcp if self.dialect == Dialect::Siemens840d => {
                self.counted.check_tip(machine)?;
                (way, false)
            }
            FeedMode::G93 | FeedMode::Rtcp => (way, false),
        };
        let time = motion.feed.map(|f| match f.mode {
            FeedMode::G93 => 60.0 / f.value,
            FeedMode::G94 | FeedMode::Rtcp => 60.0 * counted / f.value,
        });
        let vector = motion.tool.as_ref().and_then(|tool| tool.axis).filter(|_| is_rtcp);
        Ok(FollowedCut { from: *from, to: *to, vector, way, mode, counted, is_norm, time })
    }
}

impl FollowedCut {
    /// Whether F says nothing of how long it takes: the tip stands under RTCP.
    pub fn is_free(&self) -> bool {
        self.mode == FeedMode::Rtcp && self.way <= STANDS
    }
}

/// Positions one after the other, in pairs.
pub fn legs(positions: &[AxisValues]) -> impl Iterator<Item = [&AxisValues; 2]> {
    positions.windows(2).map(|pair| [&pair[0], &pair[1]])
}
