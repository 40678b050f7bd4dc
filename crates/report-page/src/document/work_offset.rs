//! The work offset for the setup sheet: values of its register, and what a probe reads.

use facemill_inverse_kinematics::{AxisKind, AxisValues};
use facemill_nc_program::dialect::DialectFile;
use nalgebra::Point3;

use crate::document::PageScene;
use crate::format::{OffsetAxis, WorkOffsetData};

/// Distance within which two frames are the same, mm: below what any sheet shows.
const SAME: f64 = 1e-6;

/// Angle within which two frames are the same, rad: 10⁻⁶ mm on a metre.
const SAME_ANGLE: f64 = 1e-9;

impl PageScene<'_> {
    /// Returns the work offset of the setup on a control with these rules.
    pub(super) fn work_offset(&self, rules: &DialectFile) -> WorkOffsetData {
        let scene = self.scene;
        let (machine, table_from_work) = (scene.machine, &scene.setup.table_from_work);
        let mut values = AxisValues::zeros(machine.axes().len());
        for (k, axis) in scene.words.axes().iter().enumerate() {
            values[k] = axis.offset;
        }
        let is_same_frame = scene.rtcp_frame.is_some_and(|frame| {
            let between = frame.inverse() * table_from_work;
            between.translation.vector.norm() < SAME && between.rotation.angle() < SAME_ANGLE
        });
        let reading = self.reading_at_datum(&values);
        let axes = machine.axes().iter().enumerate().map(|(k, axis)| OffsetAxis {
            letter: axis.letter.as_str().to_owned(),
            value: values[k],
            reading_at_datum: reading.as_ref().map(|(at, _)| at[k]),
            probe_lengths: reading.as_ref().map_or(0.0, |(_, per_length)| per_length[k]),
        });
        WorkOffsetData {
            register: register(rules, scene),
            program_zero: scene.rtcp_frame.map(|frame| frame.translation.vector.into()),
            is_same_frame,
            axes: axes.collect(),
        }
    }

    /// Returns the values of the axes at which the gauge point, with the rotary axes at their
    /// offsets, is at the origin of the workpiece frame, and their changes for each mm of a probe
    /// in the spindle; `None` where the words have no frame on the table.
    fn reading_at_datum(&self, offset: &AxisValues) -> Option<(AxisValues, AxisValues)> {
        let (machine, frame) = (self.scene.machine, self.scene.rtcp_frame?);
        let datum = Point3::from(self.scene.setup.table_from_work.translation.vector);
        let moved = |by: nalgebra::Vector3<f64>, from: &AxisValues| {
            let mut at = *from;
            for (k, axis) in machine.axes().iter().enumerate().filter(|(_, a)| a.kind == AxisKind::Linear) {
                let coordinate = ["X", "Y", "Z"].iter().position(|letter| *letter == axis.letter.as_str());
                at[k] += coordinate.map_or(0.0, |c| by[c]);
            }
            at
        };
        let at = moved(frame.inverse_transform_point(&datum).coords, offset);
        let pose = machine.cl_point(&at, 0.0);
        // The frame says so; where the axes do not, nobody may probe by it.
        if (pose.tip - datum).norm() > SAME {
            return None;
        }
        let along = frame.inverse_transform_vector(&pose.axis);
        Some((at, moved(along, &AxisValues::zeros(offset.len()))))
    }
}

/// Returns the register of the offset as the control names it, with the lines that select it.
fn register(rules: &DialectFile, scene: &facemill_job::setup::scene::Scene<'_>) -> String {
    let offset = scene.setup.work_offset;
    match rules.work_offset_words(offset) {
        None => offset.to_string(),
        Some((word, lines)) if lines == [word.as_str()] => word,
        Some((word, lines)) => {
            let lines: Vec<&str> = lines.iter().map(|line| line.trim_end_matches('~').trim()).collect();
            format!("{word} ({})", lines.join(" "))
        }
    }
}
