//! Feed blocks that name the tool's axis and the surface's normal as vectors, if the control
//! reaches the planned position by itself.

use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::{AxisKind, AxisValues, Machine, UnclearChoice};
use facemill_job::load::job::{Job, Setup};
use facemill_nc_program::{CutVectors, PostSettings};
use nalgebra::{Isometry3, Unit, Vector3};

/// Largest deviation of the rotary axes from their planned values at the same position, rad: the
/// decimals of a vector turn them by less than 1e-4 outside the cone around the pole, and another
/// position is at least twice its angle away.
const SAME: f64 = 1e-2;

/// Converter of the tool's direction to vectors.
pub(crate) struct VectorBlocks<'a> {
    machine: &'a Machine,
    tool_length: f64,
    post: &'a PostSettings,
    words_from_table: Isometry3<f64>,
    table_from_work: Isometry3<f64>,
    /// Whether rotary words may replace vectors where these are impossible.
    pub(crate) may_take_words: bool,
}

/// Reason why a block has no vectors.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoVectors {
    /// The control's choice for them is unknown.
    #[error(transparent)]
    Unclear(#[from] UnclearChoice),
    /// The control would go elsewhere.
    #[error("the control would take another position of its rotary axes than the planned one")]
    Other,
}

impl<'a> VectorBlocks<'a> {
    /// Returns `None` if the program is written with rotary words.
    pub(crate) fn new(job: &'a Job, setup: &Setup<'_>, table_from_rtcp_words: &Isometry3<f64>) -> Option<Self> {
        job.post.vector_rule().map(|rule| Self {
            machine: &job.machine,
            tool_length: job.tool.gauge_length(),
            post: &job.post,
            words_from_table: table_from_rtcp_words.inverse(),
            table_from_work: setup.table_from_work,
            may_take_words: rule.between_rotary_words,
        })
    }

    /// Returns tool axis and normal at the end of a block, in the frame of the words; `normal` is
    /// in the workpiece's, and the tool axis replaces a missing one.
    ///
    /// # Errors
    /// If a control at `from` would not go to `to` for the vector as its text states it.
    pub(crate) fn between(
        &self,
        from: &AxisValues,
        to: &AxisValues,
        normal: Option<&Unit<Vector3<f64>>>,
    ) -> Result<CutVectors, NoVectors> {
        let planned = self.machine.cl_point(to, self.tool_length);
        let tool_axis = self.words_from_table * planned.axis;
        let normal = normal.map_or(tool_axis, |n| self.words_from_table * self.table_from_work * n);
        let in_text = Unit::new_normalize(self.post.vector_in_text(&tool_axis));
        let cl = ClPoint { axis: self.words_from_table.inverse() * in_text, ..planned };
        let chosen = self.machine.control_choice(from, &cl, self.tool_length)?;
        let is_same = |k: usize| (chosen[k] - to[k]).abs() <= SAME;
        let mut rotary = (0..to.len()).filter(|&k| self.machine.axes()[k].kind == AxisKind::Rotary);
        if rotary.all(is_same) { Ok(CutVectors { tool_axis, normal }) } else { Err(NoVectors::Other) }
    }
}
