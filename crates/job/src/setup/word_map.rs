//! Words of a setup: axis letters, work offset, and the frame of coordinates under RTCP.

use std::collections::BTreeMap;

use facemill_inverse_kinematics::{Axis, AxisKind, AxisValues, Machine};
use facemill_nc_program::{FeedMode, HeadSpec, MappedAxis, SpindleSpec, WordMap};
use facemill_tool_model::SpindleRotation;
use nalgebra::Isometry3;

use crate::failure::Failure;
use crate::load::job::{Job, Setup};
use crate::load::letter;
use crate::setup::program_spec::tool_spec;

/// Returns the map from joint values to words in a setup.
///
/// # Errors
/// If the work offset names an axis that the machine does not have.
pub fn word_map(job: &Job, setup: &Setup<'_>, setup_index: usize) -> Result<WordMap, Failure> {
    check_offset_axes(job, setup, setup_index)?;
    let machine = &job.machine;
    let travel = machine
        .length_compensation_travel()
        .ok_or_else(|| Failure::Internal("the linear axes are dependent at the zero pose".to_owned()))?;
    let axes = machine
        .axes()
        .iter()
        .enumerate()
        .map(|(k, a)| {
            let offset = axis_offset(setup, a);
            Ok(MappedAxis { letter: letter(a.letter.as_str())?, offset, along_spindle: travel.get_or_zero(k) })
        })
        .collect::<Result<_, Failure>>()?;
    WordMap::new(axes, setup.work_offset, job.tool.gauge_length()).map_err(|e| Failure::Internal(e.to_string()))
}

/// Refuses a work offset that names an axis that the machine does not have.
pub fn check_offset_axes(job: &Job, setup: &Setup<'_>, setup_index: usize) -> Result<(), Failure> {
    let machine = &job.machine;
    let offsets = &setup.file.work_offset;
    for (key, named) in [("linear_mm", &offsets.linear_mm), ("rotary_deg", &offsets.rotary_deg)] {
        let kind = if key == "linear_mm" { AxisKind::Linear } else { AxisKind::Rotary };
        for letter in named.keys() {
            let axis = machine.axis_index(letter).map(|k| &machine.axes()[k]);
            if axis.is_none_or(|a| a.kind != kind) {
                return Err(job.wrong(format!(
                    "{}.work_offset.{key}: the machine has no such axis \"{letter}\"",
                    job.setup_key(setup_index)
                )));
            }
        }
    }
    Ok(())
}

/// Returns the work offset of an axis, mm or rad.
pub fn axis_offset(setup: &Setup<'_>, axis: &Axis) -> f64 {
    let offsets = &setup.file.work_offset;
    let of = |named: &BTreeMap<String, f64>| named.get(axis.letter.as_str()).copied().unwrap_or(0.0);
    match axis.kind {
        AxisKind::Linear => of(&offsets.linear_mm),
        AxisKind::Rotary => of(&offsets.rotary_deg).to_radians(),
    }
}

/// Returns the frame of X, Y and Z words under RTCP, seen from the table: that of the work offset,
/// fixed to the table.
///
/// # Errors
/// If the machine has no X, Y and Z at right angles.
pub fn table_from_rtcp_words(job: &Job, words: &WordMap) -> Result<Isometry3<f64>, Failure> {
    if job.post.feed_mode() != FeedMode::Rtcp {
        return Ok(Isometry3::identity());
    }
    rtcp_frame(job, words).ok_or_else(|| {
        job.wrong("post.feed_mode: rtcp needs a machine with linear axes X, Y and Z at right angles; take g94 or g93")
    })
}

/// Returns [`table_from_rtcp_words`] for any feed mode of the job; `None` without X, Y and Z at
/// right angles.
pub fn rtcp_frame(job: &Job, words: &WordMap) -> Option<Isometry3<f64>> {
    word_frame(&job.machine, words)
}

/// Returns [`rtcp_frame`] of a machine.
pub fn word_frame(machine: &Machine, words: &WordMap) -> Option<Isometry3<f64>> {
    let mut offset = AxisValues::zeros(words.axes().len());
    for (k, axis) in words.axes().iter().enumerate() {
        offset[k] = axis.offset;
    }
    machine.work_coordinates(&offset)
}

/// Returns the axis values at which RTCP is switched on: linear axes at home, rotary words 0.
pub fn rtcp_start_axes(machine: &Machine, words: &WordMap) -> AxisValues {
    let mut at = machine.home();
    for (k, (axis, mapped)) in machine.axes().iter().zip(words.axes()).enumerate() {
        if axis.kind == AxisKind::Rotary {
            at[k] = mapped.offset;
        }
    }
    at
}

/// Returns the map from joint values to words: one length for each head, along its spindle's axis.
///
/// # Errors
/// If the work offset names an axis that the machine does not have, or a program cannot distinguish
/// the heads.
pub fn dual_word_map(jobs: [&Job; 2], setup: &Setup<'_>, setup_index: usize) -> Result<WordMap, Failure> {
    check_offset_axes(jobs[0], setup, setup_index)?;
    let mut along = vec![0.0; jobs[0].machine.axes().len()];
    for job in jobs {
        let travel = job.machine.length_compensation_travel();
        let travel =
            travel.ok_or_else(|| Failure::Internal("the linear axes are dependent at the zero pose".to_owned()))?;
        for (k, own) in along.iter_mut().enumerate().filter(|(k, _)| job.machine.moves_tool(*k)) {
            *own += travel.get_or_zero(k);
        }
    }
    let axes = jobs[0].machine.axes().iter().zip(&along);
    let axes = axes
        .map(|(a, &along_spindle)| {
            let offset = axis_offset(setup, a);
            Ok(MappedAxis { letter: letter(a.letter.as_str())?, offset, along_spindle })
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    let heads = (0..2).map(|h| Ok(head_spec(jobs, h, 0.0)?.mapped())).collect::<Result<_, Failure>>()?;
    WordMap::with_heads(axes, setup.work_offset, heads).map_err(|e| jobs[0].wrong(format!("post: {e}")))
}

/// Returns a head as the program names it.
pub fn head_spec(jobs: [&Job; 2], head: usize, rpm: f64) -> Result<HeadSpec, Failure> {
    let job = jobs[head];
    let travel = job.machine.length_compensation_travel();
    let along = |k: &usize| travel.as_ref().is_some_and(|t| t.get_or_zero(*k).abs() > 0.5);
    let axis = (0..job.machine.axes().len()).find(|k| job.machine.moves_tool(*k) && along(k));
    let axis = axis.ok_or_else(|| {
        Failure::Infeasible(format!("head {}: no linear axis is along its spindle, for the tool's length", head + 1))
    })?;
    Ok(HeadSpec {
        name: (head + 1).to_string(),
        spindle_axis: letter(job.machine.axes()[axis].letter.as_str())?,
        spindle_number: job.machine.channel(),
        tool: tool_spec(&job.tool),
        spindle: SpindleSpec { rpm, clockwise: job.tool.spindle_rotation() == SpindleRotation::Clockwise },
    })
}
