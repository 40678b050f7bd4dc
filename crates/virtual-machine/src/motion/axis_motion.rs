//! Motions of a program line by line, and the times of its cuts by their F.

use facemill_inverse_kinematics::{AxisValues, BlockLaw};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::read::{Compensation, MotionKind, ReadBlock, ReadCommand, ReadMotion};
use facemill_nc_program::{Dialect, FeedMode, WordMapError};

pub use crate::motion::positions::resolver::MotionContext;

use crate::motion::counted_axes::CountedAxes;
use crate::motion::positions::resolver::{Knowledge, Leg, MotionResolver, NoEnd, TURNED_TABLE};

/// Motion of the axes in a block.
pub enum AxisMotion {
    /// Nothing moves.
    None,
    /// Rapid motion from each position to the next.
    Rapid {
        /// Start, via point where there is one, and end.
        positions: Vec<AxisValues>,
        /// Law between two of them.
        law: BlockLaw,
    },
    /// A straight cut between positions that the program has named.
    Cut(StraightCut),
    /// An arc, a cycle, or a cut whose start or end the program has not named; with its end, if
    /// that is known.
    Other(Option<AxisValues>),
}

/// A straight cut.
#[derive(Clone, Copy)]
pub struct StraightCut {
    /// Start.
    pub from: AxisValues,
    /// End.
    pub to: AxisValues,
    /// Tool axis in the block's text, frame of the words; `None` if the block names rotary words,
    /// or nothing.
    pub vector: Option<[f64; 3]>,
    /// Straight distance of the tip against the workpiece, mm.
    pub way: f64,
    /// Meaning of F: its own, or that of the mode without one.
    pub mode: FeedMode,
    /// Distance that F counts, mm (deg if rotary axes alone count).
    pub counted: f64,
    /// Whether that is the norm over all axes.
    pub is_norm: bool,
    /// Time by the F in force, s; `None` without one.
    pub time: Option<f64>,
}

/// Reads motions of a program for feeds and times, block by block. Positions are those that
/// verification takes.
pub struct MotionReader<'a> {
    context: MotionContext<'a>,
    dialect: Dialect,
    counted: CountedAxes,
    /// Why what F means is not known any more.
    changed: Option<String>,
    resolver: MotionResolver<'a>,
}

/// Distance of the tip below which it rests, mm: rounding of forward kinematics. F under RTCP says
/// nothing of such a block.
const RESTS: f64 = 1e-9;

impl<'a> MotionReader<'a> {
    /// Begins a program with all axes at home.
    #[must_use]
    pub fn new(context: MotionContext<'a>, dialect: Dialect, rapids: RtcpRapids) -> Self {
        let resolver = MotionResolver::new(context, rapids);
        Self { context, dialect, counted: CountedAxes::default(), changed: None, resolver }
    }

    /// Reads the next block.
    ///
    /// # Errors
    /// If the block does to axes or feeds what cannot be followed; positions go on behind it as
    /// verification has them. Cuts behind a word that changes feeds are refused, too: what it does
    /// is not followed back.
    pub fn block(&mut self, block: &ReadBlock) -> Result<AxisMotion, String> {
        let motion = self.follow(block);
        self.resolver.end_block(block);
        motion
    }

    fn follow(&mut self, block: &ReadBlock) -> Result<AxisMotion, String> {
        let turned = self.resolver.begin_block(block);
        if let Err(why) = self.read_modes(block) {
            self.changed = Some(why.clone());
            return Err(why);
        }
        if let Some(letter) = turned {
            return Err(format!("axis {letter}: {TURNED_TABLE}"));
        }
        let Some(motion) = &block.motion else { return Ok(AxisMotion::None) };
        if motion.tool.is_some() && !matches!(motion.compensation, Compensation::Rtcp(_)) {
            return Err("a tool vector without RTCP is not followed".to_owned());
        }
        let mut positions = Vec::new();
        let mut start = Knowledge::Programmed;
        let mut last = None;
        for leg in self.resolver.legs(motion) {
            let leg = match leg {
                Ok(leg) => leg,
                Err(NoEnd::Unknown(_) | NoEnd::Dependent | NoEnd::ViaUnderRtcp) => return Ok(AxisMotion::Other(None)),
                Err(why) => return Err(refusal(&why)),
            };
            start = start.min(leg.knowledge);
            if motion.kind.is_rapid() {
                positions.extend(positions.is_empty().then_some(leg.from).into_iter().chain([leg.to]));
            }
            last = Some(leg);
        }
        let Some(Leg { from, to, .. }) = last else { return Ok(AxisMotion::Other(None)) };
        match motion.kind {
            _ if start == Knowledge::Unknown => Ok(AxisMotion::Other(Some(to))),
            MotionKind::Rapid | MotionKind::ReferenceReturn => {
                Ok(AxisMotion::Rapid { positions, law: self.resolver.law(motion) })
            }
            MotionKind::Linear if start.min(self.resolver.knowledge()) == Knowledge::Programmed => {
                self.cut(motion, &from, &to).map(AxisMotion::Cut)
            }
            _ => Ok(AxisMotion::Other(Some(to))),
        }
    }

    /// Forgets all positions, until the program names them.
    pub fn forget(&mut self) {
        self.resolver.forget();
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

    fn cut(&self, motion: &ReadMotion, from: &AxisValues, to: &AxisValues) -> Result<StraightCut, String> {
        let (machine, length) = (self.context.machine, self.context.tool_length);
        let is_rtcp = matches!(motion.compensation, Compensation::Rtcp(_));
        if let Some(why) = &self.changed {
            return Err(why.clone());
        }
        if let Some(feed) = motion.feed.filter(|f| f.value <= 0.0 || f.value.is_nan()) {
            return Err(format!("its feed is {}", feed.value));
        }
        let tip = |axes: &AxisValues| machine.cl_point(axes, length).tip;
        let way = (tip(to) - tip(from)).norm();
        let mode = motion.feed_mode;
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
        Ok(StraightCut { from: *from, to: *to, vector, way, mode, counted, is_norm, time })
    }
}

impl StraightCut {
    /// Whether F does not determine its time: the tip rests under RTCP.
    pub fn is_free(&self) -> bool {
        self.mode == FeedMode::Rtcp && self.way <= RESTS
    }
}

/// Reason for which a motion is refused.
fn refusal(why: &NoEnd) -> String {
    match why {
        NoEnd::Unknown(letter) => WordMapError::UnknownAxis(*letter).to_string(),
        NoEnd::Stranger(letter) => WordMapError::NoSuchAxis(*letter).to_string(),
        NoEnd::OtherOffset { found, expected } => {
            WordMapError::OtherOffset { found: *found, expected: *expected }.to_string()
        }
        NoEnd::MixedRtcp(letter) => format!("{letter} is at a machine position while words are the tip's"),
        NoEnd::Dependent => "the linear axes cannot bring the tip there".to_owned(),
        NoEnd::Unturned(why) => {
            let (_, axis, note) = why.finding();
            let axis = axis.map(|letter| format!("axis {letter}: ")).unwrap_or_default();
            format!("{axis}{note}; write the program with rotary words")
        }
        NoEnd::NoFrame => {
            "its words are the tip's (RTCP), and the machine has no X, Y and Z at right angles".to_owned()
        }
        NoEnd::ViaUnderRtcp => "a way to the reference position over a point under RTCP is not followed".to_owned(),
    }
}

/// Positions one after the other, in pairs.
pub fn legs(positions: &[AxisValues]) -> impl Iterator<Item = [&AxisValues; 2]> {
    positions.windows(2).map(|pair| [&pair[0], &pair[1]])
}
