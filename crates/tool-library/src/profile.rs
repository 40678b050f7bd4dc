//! Stacks of frusta from the segments of shafts and holders.

use facemill_tool_model::Section;

use crate::fault::ToolFault;
use crate::fields::{Fields, LEAST_DIAMETER_MM, LengthUnit, rounded};

/// Most segments of a shaft or holder. A drawn holder has some tens.
const MAX_SEGMENTS: usize = 1_000;

/// Reads the segments of a shaft or holder, from the tip towards the spindle, in mm. Segments
/// without a height are steps, which the diameters of their neighbours show already.
pub(crate) fn segments(part: &Fields<'_>, unit: LengthUnit, faults: &mut Vec<ToolFault>) -> Vec<Section> {
    let all = part.parts("segments", faults);
    if all.len() > MAX_SEGMENTS {
        let fault = format!("has {} segments, more than {MAX_SEGMENTS}; simplify the profile in Fusion", all.len());
        faults.push(ToolFault::new(part.path_of("segments"), fault));
        return Vec::new();
    }
    let mut sections = Vec::with_capacity(all.len());
    for segment in all {
        let height = segment.needed_length("height", unit, 0.0, "height of the segment", faults);
        let mut diameter = |key| segment.needed_length(key, unit, LEAST_DIAMETER_MM, "diameter of the segment", faults);
        let (low, high) = (diameter("lower-diameter"), diameter("upper-diameter"));
        if let (Some(length_mm), Some(diameter_low_mm), Some(diameter_high_mm)) = (height, low, high)
            && length_mm > 0.0
        {
            sections.push(Section { length_mm, diameter_low_mm, diameter_high_mm });
        }
    }
    sections
}

/// A cylinder of a profile.
pub(crate) fn cylinder(length_mm: f64, diameter: f64) -> Section {
    Section { length_mm, diameter_low_mm: diameter, diameter_high_mm: diameter }
}

/// Shortest section that is kept, mm: shorter ones are rounding.
const SHORTEST: f64 = 1e-6;

/// Returns the narrowest stack of this length that encloses several stacks with the same lower end.
/// Cuts them off above the length, and ignores a stack above its own end.
///
/// Between the ends of all sections every profile is a line, so a frustum through the larger
/// diameters at both ends encloses them.
pub(crate) fn enclosing(stacks: &[Vec<Section>], length: f64) -> Vec<Section> {
    let mut heights = vec![0.0, length];
    for stack in stacks {
        let mut z = 0.0;
        for section in stack {
            z += section.length_mm;
            heights.push(z);
        }
    }
    heights.retain(|z| (0.0..=length).contains(z));
    heights.sort_by(f64::total_cmp);
    let mut kept = vec![0.0];
    for z in heights {
        if z - kept[kept.len() - 1] > SHORTEST {
            kept.push(z);
        }
    }
    // The last height is the length itself, whatever rounding is below it.
    if let Some(last) = kept.last_mut().filter(|last| **last > 0.0) {
        *last = length;
    }
    kept.windows(2).filter_map(|ends| section_between(stacks, ends[0], ends[1])).collect()
}

fn section_between(stacks: &[Vec<Section>], low: f64, high: f64) -> Option<Section> {
    let mid = 0.5 * (low + high);
    let lines: Vec<[f64; 2]> = stacks.iter().filter_map(|stack| line_at(stack, mid, [low, high])).collect();
    let widest = |end: usize| lines.iter().map(|line| line[end]).fold(f64::NAN, f64::max);
    let (diameter_low_mm, diameter_high_mm) = (rounded(widest(0)), rounded(widest(1)));
    let length_mm = rounded(high - low);
    (!lines.is_empty()).then_some(Section { length_mm, diameter_low_mm, diameter_high_mm })
}

/// Diameters at two heights of the section of a stack that is at `mid` between them.
fn line_at(stack: &[Section], mid: f64, ends: [f64; 2]) -> Option<[f64; 2]> {
    let mut z = 0.0;
    for section in stack {
        let top = z + section.length_mm;
        if mid < top {
            let (low, high) = (section.diameter_low_mm, section.diameter_high_mm);
            let at = |end: f64| low + (high - low) * ((end - z) / section.length_mm).clamp(0.0, 1.0);
            return Some(ends.map(at));
        }
        z = top;
    }
    None
}

#[cfg(test)]
#[path = "../tests/unit/profile.rs"]
mod tests;
