//! An assembly whose lengths are still open (VMT fig. 2).

use crate::assembly::{ToolAssembly, ToolFileError};
use crate::tool_file::{Section, ToolFile};

/// A length of a tool assembly, from the tip (VMT fig. 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AssemblyLength {
    /// L1: to the end of the flute, where the cutter body begins.
    Flute,
    /// L2: to the nose of the holder.
    StickOut,
    /// L3: to the top of the holder's lowest section.
    LowerHolder,
    /// L4: to the spindle face (gauge line).
    Gauge,
}

impl AssemblyLength {
    /// All four, L1 to L4; the place of a length in an array of them is [`AssemblyLength::index`].
    pub const ALL: [Self; 4] = [Self::Flute, Self::StickOut, Self::LowerHolder, Self::Gauge];

    /// 0 for L1 to 3 for L4.
    #[must_use]
    pub fn index(self) -> usize {
        match self {
            Self::Flute => 0,
            Self::StickOut => 1,
            Self::LowerHolder => 2,
            Self::Gauge => 3,
        }
    }
}

/// The lengths L1 to L4 of an assembly from the tip, mm.
pub type Lengths = [f64; 4];

/// A tool assembly with other lengths than its file's: which lengths can be had, and the tool that
/// has them.
///
/// Every body rides on a length and goes up with it: the cutter body on L1, the holder's lowest
/// section on L2, those above it on L3, the machine on L4. Cutter body and lowest section end where
/// the next begins: the topmost section is cut there, or goes on with its upper diameter. The
/// sections above are never shorter than in the file. A holder of one section rides on L2 whole,
/// and its L3 is its L2.
///
/// With a rigid holder L1 stays, and all above the cutter body rides on L2.
#[derive(Clone, Debug)]
pub struct OpenAssembly {
    file: ToolFile,
    /// Shortest stick-out of a rigid holder, mm.
    rigid_from: Option<f64>,
    /// Lengths that are never less, mm.
    least: Lengths,
}

/// An assembly with lengths, and on which of them each of its bodies rides.
#[derive(Clone, Debug)]
pub struct BuiltAssembly {
    /// The tool.
    pub tool: ToolAssembly,
    /// Of every body of [`ToolAssembly::collision_bodies`]; `None` where it stays whatever is open.
    pub rides: Vec<Option<AssemblyLength>>,
}

/// Flute that a sharp cutter has at least, mm: one without any is none.
const LEAST_FLUTE: f64 = 0.1;

/// Sections shorter than this are left out, mm: rounding of sums.
const NO_SECTION: f64 = 1e-9;

impl OpenAssembly {
    /// A tool whose four lengths are open.
    #[must_use]
    pub fn open(tool: &ToolAssembly) -> Self {
        Self { file: tool.to_file(), rigid_from: None, least: [0.0; 4] }
    }

    /// A tool whose stick-out alone is open, from the shortest upward (mm): its flute stays, and
    /// its holder is as it is.
    #[must_use]
    pub fn with_rigid_holder(tool: &ToolAssembly, shortest: f64) -> Self {
        Self { file: tool.to_file(), rigid_from: Some(shortest), least: [0.0; 4] }
    }

    /// Returns it with lengths that are never less than these, mm: those that other programs need
    /// of the same tool. Of a rigid holder only the stick-out counts.
    #[must_use]
    pub fn at_least(self, least: Lengths) -> Self {
        Self { least, ..self }
    }

    /// The lengths of the file, mm.
    #[must_use]
    pub fn lengths(&self) -> Lengths {
        let f = &self.file;
        [f.flute_length_mm, f.stick_out_mm, f.stick_out_mm + self.lower_length(), f.gauge_length_mm]
    }

    /// The length that the spindle face and the machine ride on.
    #[must_use]
    pub fn machine_rides(&self) -> AssemblyLength {
        if self.rigid_from.is_some() { AssemblyLength::StickOut } else { AssemblyLength::Gauge }
    }

    /// Raises each length to the least that those below it leave: a flute has a corner, a cutter
    /// body all its sections but the topmost, a holder those above its lowest.
    pub fn rest(&self, lengths: &mut Lengths) {
        let f = &self.file;
        let kept: f64 = f.body.sections.iter().rev().skip(1).map(|s| s.length_mm).sum();
        lengths.iter_mut().zip(self.least).for_each(|(length, least)| *length = length.max(least));
        if let Some(shortest) = self.rigid_from {
            lengths[0] = f.flute_length_mm;
            lengths[1] = lengths[1].max(lengths[0] + kept).max(shortest);
            lengths[2] = lengths[1] + self.lower_length();
            lengths[3] = lengths[1] + (f.gauge_length_mm - f.stick_out_mm);
            return;
        }
        lengths[0] = lengths[0].max(f.corner_radius_mm).max(LEAST_FLUTE);
        lengths[1] = lengths[1].max(lengths[0] + kept);
        lengths[2] = if self.has_lower() { lengths[2].max(lengths[1]) } else { lengths[1] };
        lengths[3] = lengths[3].max(lengths[2] + self.upper_length());
    }

    /// The tool with these lengths, which are as [`OpenAssembly::rest`] leaves them.
    ///
    /// # Errors
    /// When they make no tool, such as one longer than tools are.
    pub fn built(&self, lengths: &Lengths) -> Result<BuiltAssembly, ToolFileError> {
        let mut file = self.file.clone();
        let [flute, stick_out, lower_end, gauge] = *lengths;
        (file.flute_length_mm, file.stick_out_mm, file.gauge_length_mm) = (flute, stick_out, gauge);
        file.body.sections = cut_or_extended(&self.file.body.sections, stick_out - flute);
        let (body, rides_above) = (file.body.sections.len(), self.has_lower() && self.rigid_from.is_none());
        let rides_body = self.rigid_from.is_none().then_some(AssemblyLength::Flute);
        let mut rides = vec![rides_body; body];
        let (lower, upper) = self.file.holder.sections.split_at(usize::from(rides_above));
        let lower = cut_or_extended(lower, lower_end - stick_out);
        let own: f64 = upper.iter().map(|s| s.length_mm).sum();
        let begin = if rides_above { lower_end } else { stick_out };
        let upper = cut_or_extended(upper, own.max(gauge - begin));
        rides.extend(lower.iter().map(|_| Some(AssemblyLength::StickOut)));
        let above = if rides_above { AssemblyLength::LowerHolder } else { AssemblyLength::StickOut };
        rides.extend(upper.iter().map(|_| Some(above)));
        file.holder.sections = [lower, upper].concat();
        Ok(BuiltAssembly { tool: ToolAssembly::new(file)?, rides })
    }

    /// Whether the holder has a section of its own below others.
    #[must_use]
    pub fn has_lower(&self) -> bool {
        self.file.holder.sections.len() > 1
    }

    /// Returns the part that an unforced length rests on.
    #[must_use]
    pub fn rests_on(&self, length: AssemblyLength) -> &'static str {
        match (length, self.rigid_from.is_some()) {
            (AssemblyLength::Flute, true) => "the flute of the tool",
            (AssemblyLength::Flute, false) => "the corner of the cutter",
            (AssemblyLength::StickOut, true) => "the shortest stick-out of the holder",
            (AssemblyLength::StickOut, false) => "the flute and the lower sections of the cutter body",
            (AssemblyLength::LowerHolder | AssemblyLength::Gauge, true) => "the holder as it is",
            (AssemblyLength::LowerHolder, false) => "the stick-out",
            (AssemblyLength::Gauge, false) => "the upper sections of the holder",
        }
    }

    fn lower_length(&self) -> f64 {
        if self.has_lower() { self.file.holder.sections[0].length_mm } else { 0.0 }
    }

    /// From L3 to the gauge line in the file, mm.
    fn upper_length(&self) -> f64 {
        (self.file.gauge_length_mm - self.file.stick_out_mm - self.lower_length()).max(0.0)
    }
}

/// Sections of so much length together: cut at the top, or the topmost going on with its upper
/// diameter.
fn cut_or_extended(sections: &[Section], length: f64) -> Vec<Section> {
    let mut out: Vec<Section> = Vec::new();
    let mut left = length;
    for s in sections {
        if left <= NO_SECTION {
            return out;
        }
        let share = (left / s.length_mm).min(1.0);
        let diameter_high_mm = s.diameter_low_mm + share * (s.diameter_high_mm - s.diameter_low_mm);
        out.push(Section { length_mm: share * s.length_mm, diameter_high_mm, ..*s });
        left -= s.length_mm;
    }
    let Some(top) = out.last_mut().filter(|_| left > NO_SECTION) else { return out };
    if top.diameter_low_mm == top.diameter_high_mm {
        top.length_mm += left;
        return out;
    }
    let diameter = top.diameter_high_mm;
    out.push(Section { length_mm: left, diameter_low_mm: diameter, diameter_high_mm: diameter });
    out
}

#[cfg(test)]
#[path = "../tests/unit/open_assembly.rs"]
mod tests;
