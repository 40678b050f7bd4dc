//! The written text, read back and compared with the file.

use std::collections::BTreeMap;

use facemill_cl_data::{ClPoint, CuttingLaw};
use facemill_feedrate::rapid_time;
use facemill_inverse_kinematics::motion::{Deviation, deviation_bound};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Motion};
use facemill_job::setup::word_map::word_frame;
use facemill_nc_program::{ReadProgram, read_program};
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader, legs};

use crate::blocks::ToolBlocks;
use crate::positions::{Position, PositionKind};
use crate::report::{PostDeviation, PostNote};
use crate::scene::{PostScene, PostTool};
use crate::steps::PathMove;

/// A tool's part of the program as it was written.
pub(crate) struct WrittenPart<'a> {
    pub(crate) tool: &'a PostTool<'a>,
    pub(crate) blocks: &'a ToolBlocks,
    pub(crate) moves: &'a [PathMove],
    /// Line of the text of every block.
    pub(crate) block_lines: &'a [u32],
}

/// Result of the comparison.
pub(crate) struct Compared {
    pub(crate) deviation: PostDeviation,
    /// Positions that are not found or not understood, deviations beyond the tolerance, times of
    /// cuts that are not those of the feeds, cuts that are rapids.
    pub(crate) faults: Vec<PostNote>,
    /// Times of cuts and rapids of every tool at constant speed, s, with the ways from and to home.
    pub(crate) times: Vec<[f64; 2]>,
}

/// Reads the text back, and compares it with the file.
pub(crate) fn compare(scene: &PostScene<'_>, text: &str, parts: &[WrittenPart<'_>], tolerance: f64) -> Compared {
    let mut all = Comparison::new(tolerance);
    let mut program = match read_program(text, scene.post.dialect()) {
        Ok(program) => program,
        Err(e) => {
            all.fault(format!("the written program cannot be read back: {e}"));
            return all.finish(parts.len());
        }
    };
    program.harmless_functions.clone_from(&scene.post.rules().harmless_functions);
    program.rtcp_rapids = scene.post.rules().rtcp_rapids();
    let sections = if parts.len() > 1 { program.tool_sections() } else { vec![program] };
    if sections.len() != parts.len() {
        let (found, written) = (sections.len(), parts.len());
        all.fault(format!("the written program has {found} tool changes for {written} tools"));
        return all.finish(parts.len());
    }
    for (section, part) in sections.iter().zip(parts) {
        all.section(scene, section, part);
    }
    all.finish(parts.len())
}

/// Largest relative difference of the time of the written cuts from that of their feeds: F words
/// have few digits.
const SAME_TIME: f64 = 0.02;

/// The same, s: of programs with hardly any cut.
const SHORT_TIME: f64 = 0.1;

/// Largest relative difference of the time of a block from that of its feed.
const SAME_BLOCK_TIME: f64 = 0.1;

/// The same, s: of short blocks, whose ways are rounded.
const SHORT_BLOCK: f64 = 0.02;

struct Comparison {
    deviation: PostDeviation,
    faults: Vec<PostNote>,
    times: Vec<[f64; 2]>,
}

impl Comparison {
    fn new(tolerance: f64) -> Self {
        let deviation = PostDeviation { tolerance_mm: tolerance, ..PostDeviation::default() };
        Self { deviation, faults: Vec::new(), times: Vec::new() }
    }

    fn fault(&mut self, text: String) {
        self.faults.push(PostNote::whole(text));
    }

    fn section(&mut self, scene: &PostScene<'_>, section: &ReadProgram, part: &WrittenPart<'_>) {
        let machine = scene.machine;
        let tool_length = part.tool.tool.gauge_length();
        let context = MotionContext {
            machine,
            tool_length,
            words: &part.tool.words,
            frame: word_frame(machine, &part.tool.words),
            work_offset: None,
        };
        let at_lines: BTreeMap<u32, (&Position, f64)> = part
            .blocks
            .motions
            .iter()
            .zip(&part.blocks.times)
            .filter_map(|((block, position), time)| Some((*part.block_lines.get(*block)?, (position, *time))))
            .collect();
        let mut reader = MotionReader::new(context, section.dialect, section.rtcp_rapids);
        let (mut found, mut time, mut rapid) = (0, 0.0, 0.0);
        for block in &section.blocks {
            let motion = reader.block(block);
            if let Ok(AxisMotion::Rapid { positions, law }) = &motion {
                let time = |[from, to]: [&AxisValues; 2]| rapid_time(machine, *law, from, to, tool_length);
                rapid += legs(positions).map(time).sum::<f64>();
            }
            let Some(&(position, planned)) = at_lines.get(&block.line) else { continue };
            let line = part.moves[position.of].line;
            let (from, to, law) = match &motion {
                Ok(AxisMotion::Rapid { positions, law }) => match positions.as_slice() {
                    [from, .., to] => (*from, *to, *law),
                    _ => continue,
                },
                Ok(AxisMotion::Cut(cut)) => {
                    time += cut.time.unwrap_or(0.0);
                    (cut.from, cut.to, BlockLaw::Cutting(scene.cutting_law()))
                }
                Ok(_) => continue,
                Err(why) => {
                    self.faults.push(PostNote::at(line, format!("line {} of the program: {why}", block.line)));
                    self.times.push([time, rapid]);
                    return;
                }
            };
            found += 1;
            let cut_time =
                if let Ok(AxisMotion::Cut(cut)) = &motion { Some(cut.time.unwrap_or(f64::INFINITY)) } else { None };
            self.kind_and_time(position.kind, (line, block.line), cut_time, planned);
            let reached = machine.cl_point(&to, tool_length);
            self.position(position, (line, part.tool.tool.cutter().radius()), &reached);
            // The way to the first position is the template's.
            if found > 1 && position.meant.is_some() {
                let bound = deviation_bound(machine, law, &from, &to, tool_length);
                self.between(part, position, line, &bound);
            }
            self.limits(scene, line, &to);
            if found > 1 {
                self.limits_between(scene, line, (law, tool_length), [&from, &to]);
            }
        }
        self.times.push([time, rapid]);
        let expected = part.blocks.motions.len();
        if found != expected {
            self.fault(format!("{found} of {expected} motion blocks are found in the written program"));
        }
        let planned: f64 = part.blocks.times.iter().sum();
        if (time - planned).abs() > SAME_TIME * planned + SHORT_TIME && found == expected {
            self.fault(format!(
                "the cuts of the written program take {time:.1} s by its F, and {planned:.1} s by the feeds of the file"
            ));
        }
    }

    /// Compares kind and time of a block with those that are meant; `cut_time` is the time of a
    /// cut, s, `None` of a rapid.
    fn kind_and_time(
        &mut self,
        kind: PositionKind,
        (line, program_line): (u32, u32),
        cut_time: Option<f64>,
        planned: f64,
    ) {
        let is_meant_rapid = planned == 0.0 && !matches!(kind, PositionKind::Cut(_));
        let fault = match cut_time {
            None if !is_meant_rapid => "is a rapid, and is to be a cut".to_owned(),
            Some(time) if (time - planned).abs() > SAME_BLOCK_TIME * planned + SHORT_BLOCK => {
                format!("takes {time:.3} s by its F, and {planned:.3} s by the feed of the file")
            }
            _ => return,
        };
        if self.faults.len() < MOST_FAULTS {
            self.faults.push(PostNote::at(line, format!("line {program_line} of the program {fault}")));
        }
    }

    fn position(&mut self, position: &Position, (line, radius): (u32, f64), reached: &ClPoint) {
        let Some(meant) = &position.meant else { return };
        let d = &mut self.deviation;
        d.compared += 1;
        let tip = (reached.tip - meant.tip).norm();
        if tip > d.tip_mm {
            (d.tip_mm, d.tip_cl_line) = (tip, line);
        }
        let axis = reached.axis.cross(&meant.axis).norm().atan2(reached.axis.dot(&meant.axis));
        if axis.to_degrees() > d.axis_deg {
            (d.axis_deg, d.axis_cl_line) = (axis.to_degrees(), line);
        }
        let rim = Deviation { tip, axis }.rim(radius);
        if rim > d.rim_mm {
            (d.rim_mm, d.rim_cl_line) = (rim, line);
        }
    }

    fn between(&mut self, part: &WrittenPart<'_>, position: &Position, line: u32, bound: &Deviation) {
        let d = &mut self.deviation;
        let off = bound.rim(part.tool.tool.cutter().radius());
        if part.moves[position.of].feed.is_none() {
            d.between_rapid_mm = d.between_rapid_mm.max(off);
        } else if off > d.between_mm {
            (d.between_mm, d.between_cl_line) = (off, line);
        }
    }

    fn limits(&mut self, scene: &PostScene<'_>, line: u32, at: &AxisValues) {
        if let Some(k) = beyond_limit(scene, at).filter(|_| self.faults.len() < MOST_FAULTS) {
            let letter = scene.machine.axes()[k].letter;
            self.faults.push(PostNote::at(line, format!("axis {letter} is beyond its limit in the written program")));
        }
    }

    /// Looks for axes that pass a limit between two positions: under RTCP they do not go evenly.
    fn limits_between(
        &mut self,
        scene: &PostScene<'_>,
        line: u32,
        (law, tool_length): (BlockLaw, f64),
        [from, to]: [&AxisValues; 2],
    ) {
        let is_even = matches!(law, BlockLaw::Rapid(_) | BlockLaw::Cutting(CuttingLaw::AxesLinear));
        let turns = |k: usize| scene.machine.axes()[k].kind == AxisKind::Rotary && (to[k] - from[k]).abs() > NO_BEND;
        if is_even || !(0..to.len()).any(turns) || self.faults.len() >= MOST_FAULTS {
            return;
        }
        let Ok(motion) = Motion::new(scene.machine, law, from, to, tool_length) else { return };
        let passed = (1..SAMPLES).find_map(|k| {
            let at = motion.at(f64::from(k) / f64::from(SAMPLES)).ok()?;
            beyond_limit(scene, &at)
        });
        if let Some(k) = passed {
            let letter = scene.machine.axes()[k].letter;
            let text = format!("axis {letter} passes its limit on the way there, on which the control keeps the tip");
            self.faults.push(PostNote::at(line, text));
        }
    }

    fn finish(mut self, n_parts: usize) -> Compared {
        self.times.resize(n_parts, [0.0; 2]);
        let d = &self.deviation;
        let tolerance = d.tolerance_mm;
        if d.tip_mm > tolerance {
            let text =
                format!("the tip is {:.4} mm off the point, allowed {tolerance} mm: more decimals help", d.tip_mm);
            self.faults.push(PostNote::at(d.tip_cl_line, text));
        }
        if d.rim_mm > tolerance && d.tip_mm <= tolerance {
            let text = format!(
                "the rim of the cutter is {:.4} mm off its place, allowed {tolerance} mm: more decimals of rotary words help",
                d.rim_mm
            );
            self.faults.push(PostNote::at(d.rim_cl_line, text));
        }
        if d.between_mm > tolerance {
            let text = format!("the cutter is up to {:.4} mm off the way, allowed {tolerance} mm", d.between_mm);
            self.faults.push(PostNote::at(d.between_cl_line, text));
        }
        Compared { deviation: self.deviation, faults: self.faults, times: self.times }
    }
}

/// First axis that is beyond its limit.
fn beyond_limit(scene: &PostScene<'_>, at: &AxisValues) -> Option<usize> {
    (0..at.len()).find(|&k| {
        let axis = &scene.machine.axes()[k];
        // Words are rounded.
        axis.in_word_unit((at[k] - axis.min).min(axis.max - at[k])) < -WORD_ROUNDING
    })
}

/// Turn of a rotary axis within a block below which the others go evenly enough, rad: they bend by
/// less than its square times the lever.
const NO_BEND: f64 = 0.01;

/// Parts of a block at whose ends limits are looked at.
const SAMPLES: u32 = 16;

/// Excess of a word over a limit that is rounding, mm or deg.
const WORD_ROUNDING: f64 = 1e-3;

/// Faults of one kind that are listed.
const MOST_FAULTS: usize = 20;

#[cfg(test)]
#[path = "../tests/unit/read_back.rs"]
mod tests;
