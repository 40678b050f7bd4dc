//! Where a block moves the axes.

use crate::read::error::ReadError;
use crate::read::modal::MotionCode;
use crate::read::position::AxisAt;
use crate::read::program::{ArcWords, MacroKind, MotionKind, ToolVectors};
use crate::read::siemens::block::{INCH, Role, SiemensBlock};
use crate::read::siemens::items::{Count, Item, Value, is_vector};
use crate::read::siemens::line_macro;
use crate::read::unfollowed::Cause;
use crate::words::axis_words::{AxisKind, AxisLetter};

impl SiemensBlock<'_> {
    /// Moves the axes that the block names, if they are targets.
    pub(super) fn motion(&mut self) -> Result<(), ReadError> {
        self.numbered_call()?;
        match self.role {
            Role::Target | Role::MachineTarget => {
                let first = self.items.iter().find(|i| !i.is_used && (self.axis_of(i).is_some() || is_vector(i)));
                match first.cloned() {
                    Some(_) => self.move_to_words()?,
                    None => self.circle_without_axes()?,
                }
            }
            Role::Reference(number) => self.return_axes(number)?,
            Role::Data | Role::Dwell => {}
        }
        self.modal_call_behind();
        self.feed_place();
        Ok(())
    }

    fn move_to_words(&mut self) -> Result<(), ReadError> {
        let kind = match (self.state.modal.cycle, self.state.modal.motion) {
            (Some(code), _) => MotionKind::Cycle { code },
            (None, Some(MotionCode::Rapid)) => MotionKind::Rapid,
            (None, Some(MotionCode::Linear)) => MotionKind::Linear,
            (None, Some(MotionCode::Arc { clockwise })) => MotionKind::Arc { clockwise },
            (None, None) => {
                self.leave(Cause::Block, "no motion code (G0, G1, …) is known to be in force");
                self.role = Role::Data;
                return Ok(());
            }
        };
        let arc = matches!(kind, MotionKind::Arc { .. }).then(|| self.arc_words());
        let tool = self.vectors()?;
        self.move_axes()?;
        if matches!(kind, MotionKind::Cycle { .. }) {
            // The height that the cycle returns to, its arguments say.
            self.state.modal.position.forget_word(AxisLetter::Z);
        }
        let mut motion = self.state.modal.motion(kind, arc);
        motion.tool = tool.map(Box::new);
        self.block.motion = Some(motion);
        Ok(())
    }

    /// A full circle names its centre only.
    fn circle_without_axes(&mut self) -> Result<(), ReadError> {
        let has_centre = self.items.iter().any(|i| !i.is_used && matches!(i.letter, b'I' | b'J' | b'K'));
        if let (true, Some(MotionCode::Arc { clockwise })) = (has_centre, self.state.modal.motion) {
            let arc = self.arc_words();
            self.block.motion = Some(self.state.modal.motion(MotionKind::Arc { clockwise }, Some(arc)));
        }
        Ok(())
    }

    fn arc_words(&mut self) -> ArcWords {
        let unit = if self.state.modal.is_inch { INCH } else { 1.0 };
        let mut arc = ArcWords { plane: self.state.modal.plane, ..ArcWords::default() };
        for (k, letter) in [b'I', b'J', b'K'].into_iter().enumerate() {
            let is_centre = |i: &&mut Item| i.letter == letter && i.index == 0 && !i.is_used;
            let Some(item) = self.items.iter_mut().find(is_centre) else { continue };
            item.is_used = true;
            let value = item.number().map(|v| v * unit);
            match item.value {
                Value::Number(_, Count::Absolute) => arc.centre[k] = value,
                _ => *[&mut arc.i, &mut arc.j, &mut arc.k][k] = value,
            }
            self.has_unknown |= value.is_none();
        }
        let mut named = |name| {
            let item = self.take_name(name)?;
            self.has_unknown |= item.number().is_none();
            item.number()
        };
        arc.r = named("CR").map(|v| v * unit);
        arc.angle = named("AR");
        arc.turns = named("TURN").map_or(0, |turns| turns.clamp(0.0, 1e6) as u32);
        arc
    }

    /// `A3= B3= C3=` and `A5= B5= C5=`. The control finds the rotary axes itself.
    fn vectors(&mut self) -> Result<Option<ToolVectors>, ReadError> {
        if !self.items.iter().any(|i| !i.is_used && is_vector(i)) {
            return Ok(None);
        }
        let mut of = |index: u8| {
            let mut vector = [None; 3];
            for (k, letter) in [b'A', b'B', b'C'].into_iter().enumerate() {
                let item = self.items.iter_mut().find(|i| i.letter == letter && i.index == index && !i.is_used);
                if let Some(item) = item {
                    item.is_used = true;
                    vector[k] = item.number();
                }
            }
            if let [Some(x), Some(y), Some(z)] = vector { Some([x, y, z]) } else { None }
        };
        let axis = of(3);
        // At the start of the block, and at its end.
        let _ = of(4);
        let normal = of(5);
        let kind = if axis.is_some() { MacroKind::ToolVector } else { MacroKind::VariableWords };
        self.block.commands.push(line_macro(kind, self.line));
        let words = self.state.modal.position.words();
        for word in words.iter().filter(|w| w.letter.kind() == AxisKind::Rotary) {
            self.state.modal.position.forget_word(word.letter);
        }
        Ok(Some(ToolVectors { axis, normal }))
    }

    fn move_axes(&mut self) -> Result<(), ReadError> {
        for k in 0..self.items.len() {
            let item = self.items[k].clone();
            let Some(axis) = self.axis_of(&item).filter(|_| !item.is_used) else { continue };
            self.items[k].is_used = true;
            let at = self.target(&item, axis);
            self.has_unknown |= at.is_none();
            self.set(&item, axis, at)?;
        }
        Ok(())
    }

    fn set(&mut self, item: &Item, axis: AxisLetter, at: Option<AxisAt>) -> Result<(), ReadError> {
        let is_way = match item.value {
            Value::Number(_, Count::Modal) => self.state.modal.is_incremental && self.role != Role::MachineTarget,
            Value::Number(_, Count::Incremental | Count::Shortest | Count::Positive | Count::Negative) => true,
            _ => false,
        };
        let position = &mut self.state.modal.position;
        let set = if is_way { position.set_way(axis, at) } else { position.set(axis, at) };
        set.map_err(|e| self.source.error(item.span.start, e.into()))
    }

    /// Where an item sends its axis; `None` where it is not known.
    fn target(&self, item: &Item, axis: AxisLetter) -> Option<AxisAt> {
        let Value::Number(value, count) = item.value else { return None };
        let is_turned = self.state.is_transformed && axis.kind() == AxisKind::Rotary && axis.number() == 2;
        // Angles of the tool (A2, B2, C2) say no axis.
        let value = value.filter(|_| !is_turned)?;
        let is_inch = self.state.modal.is_inch && axis.kind() == AxisKind::Linear;
        let value = if is_inch { value * INCH } else { value };
        let is_incremental = self.state.modal.is_incremental && count == Count::Modal || count == Count::Incremental;
        if self.role == Role::MachineTarget {
            // A position of the machine that is reached over a way of its own (ACP, ACN): how many
            // turns it is away is not followed.
            let is_plain = !is_incremental && matches!(count, Count::Modal | Count::Absolute | Count::Shortest);
            return if is_plain { self.state.modal.machine_target(axis, value) } else { None };
        }
        match count {
            Count::Modal | Count::Incremental if is_incremental => self.state.modal.by(axis, value),
            Count::Shortest | Count::Positive | Count::Negative => self.turned_to(axis, value, count),
            _ => Some(AxisAt::Word(value)),
        }
    }

    /// An angle that is reached over a way of its own: from an unknown place nobody knows how many
    /// turns it is away.
    fn turned_to(&self, axis: AxisLetter, angle: f64, count: Count) -> Option<AxisAt> {
        let Some(AxisAt::Word(from)) = self.state.modal.position.get(axis) else { return None };
        let ahead = (angle - from).rem_euclid(360.0);
        let way = match count {
            Count::Negative if ahead > 0.0 => ahead - 360.0,
            Count::Shortest if ahead > 180.0 => ahead - 360.0,
            _ => ahead,
        };
        Some(AxisAt::Word(from + way))
    }

    /// Sends the named axes to a reference or fixed point; the values of their words say nothing.
    fn return_axes(&mut self, number: u8) -> Result<(), ReadError> {
        let mut is_any = false;
        for k in 0..self.items.len() {
            let item = self.items[k].clone();
            let Some(axis) = self.axis_of(&item).filter(|_| !item.is_used) else { continue };
            self.items[k].is_used = true;
            self.set(&item, axis, Some(AxisAt::Reference(number)))?;
            is_any = true;
        }
        if is_any {
            self.block.motion = Some(self.state.modal.motion(MotionKind::ReferenceReturn, None));
            self.state.modal.end_return();
        }
        Ok(())
    }

    /// Runs the target of MCALL behind the motion.
    fn modal_call_behind(&mut self) {
        if self.block.motion.is_some() && self.state.modal_call.is_some() {
            self.block.commands.push(line_macro(MacroKind::CallBehind, self.line));
            self.state.modal.position.forget_all();
            self.state.modal.feed = None;
        }
    }

    /// Where a feed belongs in a block that has none.
    fn feed_place(&mut self) {
        if self.block.motion.is_some() && !self.block.feed_place.has_word() {
            let end = self.items.last().map_or(0, |i| i.span.end);
            self.block.feed_place.set_insert(end);
        }
    }
}
