//! Blocks of words: straight moves, arcs and poles.

use crate::program::FeedMode;
use crate::read::error::{ReadError, ReadFault};
use crate::read::heidenhain::words::{HeidenhainCode, HeidenhainWord, Key};
use crate::read::heidenhain::{HeidenhainReader, State, line_macro};
use crate::read::position::AxisAt;
use crate::read::program::{ArcWords, Feed, MacroKind, MotionKind, ReadBlock, ToolVectors};
use crate::read::source::Source;
use crate::read::unfollowed::Cause;
use crate::words::axis_words::{AxisKind, AxisLetter};

/// mm per inch.
const INCH: f64 = 25.4;

/// mm/min that a feed of 1 is in a program in inches.
pub(super) const TENTH_OF_INCH: f64 = 0.1 * INCH;

const XYZ: [AxisLetter; 3] = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z];

/// A block being read.
pub(super) struct Reading<'a> {
    pub(super) source: &'a Source,
    pub(super) state: &'a mut State,
    pub(super) words: Vec<HeidenhainWord>,
    pub(super) line: &'a [u8],
    pub(super) block: &'a mut ReadBlock,
    /// M91.
    pub(super) is_machine: bool,
    /// Some axis goes where the text alone does not say.
    pub(super) has_unknown: bool,
    pub(super) is_rapid: bool,
}

impl HeidenhainReader {
    /// Reads the words behind `kind` (L, LN, LP, CC, C, CR, CP).
    pub(super) fn motion_block(
        &mut self,
        kind: &[u8],
        at: usize,
        line: &[u8],
        block: &mut ReadBlock,
    ) -> Result<(), ReadError> {
        let code = HeidenhainCode { text: &self.code, source: &self.source, variables: &self.variables };
        let words = code.words(at)?;
        check(&code, kind, &words)?;
        let code_end = at.max(self.code.trim_ascii_end().len());
        let mut reading = Reading {
            source: &self.source,
            state: &mut self.state,
            words,
            line,
            block,
            is_machine: false,
            has_unknown: false,
            is_rapid: false,
        };
        if kind == b"CC" {
            reading.set_pole();
            return Ok(());
        }
        reading.block.sets_state = reading.words.iter().any(|w| !matches!(w.key, Key::Function | Key::Speed));
        reading.functions_before()?;
        reading.feed();
        reading.motion(kind)?;
        reading.functions_behind();
        reading.feed_place(code_end);
        if reading.has_unknown {
            reading.block.commands.push(line_macro(MacroKind::VariableWords, line));
        }
        Ok(())
    }
}

/// Every word has a meaning behind this beginning, and occurs once.
fn check(code: &HeidenhainCode, kind: &[u8], words: &[HeidenhainWord]) -> Result<(), ReadError> {
    for (k, word) in words.iter().enumerate() {
        let fits = match word.key {
            Key::Axis(_) | Key::Incremental(_) | Key::Function | Key::Parameter => true,
            Key::Normal(_) | Key::ToolVector(_) => kind == b"LN",
            Key::PolarRadius | Key::PolarAngle | Key::PolarRadiusBy | Key::PolarAngleBy => {
                matches!(kind, b"LP" | b"CP" | b"CC")
            }
            Key::Direction { .. } => matches!(kind, b"C" | b"CR" | b"CP"),
            Key::Radius => kind == b"CR",
            Key::NoCompensation
            | Key::Compensation
            | Key::Feed
            | Key::FeedMax
            | Key::FeedAuto
            | Key::OtherFeed
            | Key::Speed => kind != b"CC",
        };
        if !fits {
            return Err(code.stray(word));
        }
        let may_repeat = matches!(word.key, Key::Function | Key::Parameter);
        if !may_repeat && words[..k].iter().any(|other| is_same(other.key, word.key)) {
            let text = code.string(word.span.clone());
            return Err(code.source.error(word.span.start, ReadFault::Repeated(text)));
        }
    }
    Ok(())
}

/// Two words of these keys cannot be in one block.
fn is_same(a: Key, b: Key) -> bool {
    let feeds = |key| matches!(key, Key::Feed | Key::FeedMax | Key::FeedAuto | Key::OtherFeed);
    match (a, b) {
        (Key::Axis(a) | Key::Incremental(a), Key::Axis(b) | Key::Incremental(b)) => a == b,
        (Key::Direction { .. }, Key::Direction { .. }) => true,
        _ => a == b || feeds(a) && feeds(b),
    }
}

impl Reading<'_> {
    fn feed(&mut self) {
        let inch = if self.state.modal.is_inch { TENTH_OF_INCH } else { 1.0 };
        for word in &self.words {
            match word.key {
                Key::Feed => {
                    self.has_unknown |= word.value.is_none();
                    self.state.modal.feed = word.value.map(|f| f * inch);
                    self.block.feed_place.set_word(word.span.clone(), word.value_start);
                }
                Key::FeedAuto => {
                    self.state.modal.feed = self.state.tool_feed.map(|f| f * inch);
                    self.block.feed_place.set_word(word.span.clone(), word.value_start);
                }
                Key::FeedMax => self.is_rapid = true,
                Key::OtherFeed => {
                    self.state.modal.feed = None;
                    self.block.feed_place.set_word(word.span.clone(), word.value_start);
                }
                Key::Compensation => {
                    let why = "cutter radius compensation moves the tool off the words";
                    self.state.modal.unfollowed.begin(Cause::Radius, why);
                }
                Key::NoCompensation => self.state.modal.unfollowed.end(Cause::Radius),
                _ => {}
            }
        }
    }

    /// `CC X+0 Y+0`; alone it is where the tool is.
    fn set_pole(&mut self) {
        let words = &self.words;
        let here = |state: &State, axis| match state.modal.position.get(axis) {
            Some(AxisAt::Word(value)) => Some(value),
            _ => None,
        };
        if words.is_empty() {
            self.state.pole = XYZ.map(|axis| here(self.state, axis));
        }
        let unit = if self.state.modal.is_inch { INCH } else { 1.0 };
        for word in words {
            let (axis, is_incremental) = match word.key {
                Key::Axis(axis) => (axis, false),
                Key::Incremental(axis) => (axis, true),
                _ => continue,
            };
            if let Some(k) = XYZ.iter().position(|a| *a == axis) {
                let value = word.value.map(|v| v * unit);
                let from = if is_incremental { here(self.state, axis) } else { Some(0.0) };
                self.state.pole[k] = value.zip(from).map(|(value, from)| value + from);
            }
        }
    }

    fn motion(&mut self, kind: &[u8]) -> Result<(), ReadError> {
        let tool = self.vectors();
        let is_polar = matches!(kind, b"LP" | b"CP");
        let centre = self.state.pole;
        let polar = if is_polar { Some(self.polar_end(kind)) } else { None };
        let names_axes = self.words.iter().any(|w| matches!(w.key, Key::Axis(_) | Key::Incremental(_)));
        if !names_axes && !is_polar && tool.is_none() && kind != b"C" {
            return Ok(());
        }
        self.move_axes()?;
        if let Some(end) = polar {
            for (k, value) in self.state.plane_axes().into_iter().zip(end) {
                self.has_unknown |= value.is_none();
                let at = value.map(AxisAt::Word);
                self.state.modal.position.set(XYZ[k], at).map_err(|e| self.source.error(0, e.into()))?;
            }
        }
        let arc = self.arc(kind, centre)?;
        let kind = match (&arc, self.is_rapid) {
            (Some((clockwise, _)), _) => MotionKind::Arc { clockwise: *clockwise },
            (None, true) => MotionKind::Rapid,
            (None, false) => MotionKind::Linear,
        };
        let mut motion = self.state.modal.motion(kind, arc.map(|(_, arc)| arc));
        if self.is_rapid {
            motion.feed = None;
        }
        if self.state.has_axis_feed && self.state.has_tcpm {
            motion.feed_mode = FeedMode::G94;
            motion.feed = motion.feed.map(|feed| Feed { mode: FeedMode::G94, ..feed });
        }
        motion.tool = tool.map(Box::new);
        self.block.motion = Some(motion);
        Ok(())
    }

    /// TX TY TZ and NX NY NZ. With a tool vector, or under TCPM without one, the control turns the
    /// rotary axes itself.
    fn vectors(&mut self) -> Option<ToolVectors> {
        if !self.words.iter().any(|w| matches!(w.key, Key::ToolVector(_) | Key::Normal(_))) {
            return None;
        }
        let of = |key: fn(usize) -> Key| {
            let value = |k: usize| self.words.iter().find(|w| w.key == key(k));
            let is_any = (0..3).any(|k| value(k).is_some());
            let vector = [0, 1, 2].map(|k| value(k).and_then(|w| w.value));
            (is_any, if let [Some(x), Some(y), Some(z)] = vector { Some([x, y, z]) } else { None })
        };
        let ((has_axis, axis), (_, normal)) = (of(Key::ToolVector), of(Key::Normal));
        if has_axis || self.state.has_tcpm {
            match axis {
                Some(_) => self.block.commands.push(line_macro(MacroKind::ToolVector, self.line)),
                None => self.has_unknown = true,
            }
            let words = self.state.modal.position.words();
            for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Rotary) {
                self.state.modal.position.forget_word(word.letter);
            }
        }
        Some(ToolVectors { axis, normal })
    }

    fn move_axes(&mut self) -> Result<(), ReadError> {
        let unit = if self.state.modal.is_inch { INCH } else { 1.0 };
        for k in 0..self.words.len() {
            let word = self.words[k].clone();
            let (axis, is_incremental) = match word.key {
                Key::Axis(axis) => (axis, false),
                Key::Incremental(axis) => (axis, true),
                _ => continue,
            };
            let unit = if axis.kind() == AxisKind::Linear { unit } else { 1.0 };
            let at = match word.value.map(|v| v * unit) {
                None => None,
                Some(value) if self.is_machine => self.machine_target(axis, value).filter(|_| !is_incremental),
                Some(value) if is_incremental => self.state.modal.by(axis, value),
                Some(value) => self.turned_to(axis, value),
            };
            self.has_unknown |= at.is_none();
            let fault = |e: crate::words::axis_words::TooManyAxes| self.source.error(word.span.start, e.into());
            let position = &mut self.state.modal.position;
            let set = if is_incremental { position.set_way(axis, at) } else { position.set(axis, at) };
            set.map_err(fault)?;
        }
        Ok(())
    }

    /// M91 counts neither presets nor the tool's length.
    fn machine_target(&self, axis: AxisLetter, value: f64) -> Option<AxisAt> {
        let is_tip = self.state.has_tcpm && axis.kind() == AxisKind::Linear;
        let is_own = !(self.state.is_tilted || is_tip);
        is_own.then_some(AxisAt::Machine(value))
    }

    /// With M126 the way is the shorter one on axes that count to 360 deg, and as it is written on
    /// others.
    fn turned_to(&self, axis: AxisLetter, value: f64) -> Option<AxisAt> {
        let is_turned = self.state.goes_shorter && axis.kind() == AxisKind::Rotary;
        match self.state.modal.position.get(axis) {
            Some(AxisAt::Word(from)) if is_turned && (value - from).abs() <= 180.0 => Some(AxisAt::Word(value)),
            _ if is_turned => None,
            _ => Some(AxisAt::Word(value)),
        }
    }

    /// Where PR and PA lead, in the axes of the plane.
    fn polar_end(&mut self, kind: &[u8]) -> [Option<f64>; 2] {
        let [first, second] = self.state.plane_axes();
        let pole = [self.state.pole[first], self.state.pole[second]];
        let unit = if self.state.modal.is_inch { INCH } else { 1.0 };
        let here = [first, second].map(|k| match self.state.modal.position.get(XYZ[k]) {
            Some(AxisAt::Word(value)) => Some(value),
            _ => None,
        });
        let from_pole = match (here, pole) {
            ([Some(u), Some(v)], [Some(p), Some(q)]) => Some([u - p, v - q]),
            _ => None,
        };
        let [mut radius, mut angle] = self.state.polar;
        if kind == b"CP" {
            // An arc keeps the distance that the tool has.
            radius = from_pole.map(|[u, v]| u.hypot(v));
        }
        for word in &self.words {
            match word.key {
                Key::PolarRadius => radius = word.value.map(|r| r * unit),
                Key::PolarRadiusBy => radius = radius.zip(word.value).map(|(r, by)| r + by * unit),
                Key::PolarAngle => angle = word.value,
                Key::PolarAngleBy => {
                    let from = from_pole.map(|[u, v]| v.atan2(u).to_degrees());
                    angle = from.zip(word.value).map(|(a, by)| a + by);
                }
                _ => {}
            }
        }
        self.state.polar = [radius, angle];
        match (pole, radius.zip(angle)) {
            ([Some(p), Some(q)], Some((r, a))) => {
                let (sin, cos) = a.to_radians().sin_cos();
                [Some(p + r * cos), Some(q + r * sin)]
            }
            _ => [None; 2],
        }
    }

    /// Sense and centre of C and CP, radius of CR.
    fn arc(&self, kind: &[u8], pole: [Option<f64>; 3]) -> Result<Option<(bool, ArcWords)>, ReadError> {
        if !matches!(kind, b"C" | b"CR" | b"CP") {
            return Ok(None);
        }
        let direction = self.words.iter().find_map(|w| match w.key {
            Key::Direction { clockwise } => Some(clockwise),
            _ => None,
        });
        let why = "an arc without its sense (DR+ or DR-)";
        let word = String::from_utf8_lossy(kind).into_owned();
        let missing = || {
            let start = self.line.windows(kind.len()).position(|w| w.eq_ignore_ascii_case(kind)).unwrap_or(0);
            self.source.error(start, ReadFault::Unsupported { word, why })
        };
        let clockwise = direction.ok_or_else(missing)?;
        let unit = if self.state.modal.is_inch { INCH } else { 1.0 };
        let value = |key| self.words.iter().find(|w| w.key == key).and_then(|w| w.value);
        let mut arc = ArcWords { plane: self.state.modal.plane, ..ArcWords::default() };
        if kind == b"CR" {
            arc.r = value(Key::Radius).map(|r| r * unit);
        } else {
            for k in self.state.plane_axes() {
                arc.centre[k] = pole[k];
            }
            arc.angle = value(Key::PolarAngleBy).map(f64::abs);
        }
        Ok(Some((clockwise, arc)))
    }

    /// Where a feed belongs in a block that has none: before its M functions.
    fn feed_place(&mut self, code_end: usize) {
        if self.block.motion.is_none() || self.is_rapid || self.block.feed_place.has_word() {
            return;
        }
        let first = self.words.iter().find(|w| w.key == Key::Function).map(|w| w.span.start);
        self.block.feed_place.set_insert(first.unwrap_or(code_end));
    }
}
