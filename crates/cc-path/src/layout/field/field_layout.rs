use std::borrow::Cow;

use facemill_cl_data::Monitor;
use nalgebra::Vector3;

use crate::error::PathError;
use crate::harmonic::laplace::harmonic;
use crate::layout::field::accumulated::AccumulatedWidth;
use crate::layout::field::ends::end_values;
use crate::layout::field::field_bands::FieldBands;
use crate::layout::field::gradients::facet_gradient;
use crate::layout::level_set::LevelSet;
use crate::layout::levels::triangles_at;
use crate::layout::pass_level::{PassLevel, Strips};
use crate::layout::section_layout::border_levels;
use crate::layout::strip_width::StripWidth;
use crate::strategy::field::Flow;
use crate::strategy::patch::Patch;
use crate::strategy::settings::LaySettings;

/// Solves for the field of a flow and makes it the levels of the patch, in mm: its gradient is 1
/// per mm in the mean.
///
/// # Errors
/// When an end names no border, both ends touch, a part of the region is not between them, or the
/// mesh allows no solution.
pub(crate) fn flow_levels(patch: &mut Patch, flow: &Flow) -> Result<(), PathError> {
    let fixed = end_values(patch, flow)?;
    let values =
        harmonic(&patch.mesh, &patch.edges, &fixed).map_err(|e| PathError::NoField { residual: e.residual })?;
    let (mut area, mut rise) = (0.0, 0.0);
    for (t, corners) in patch.mesh.triangles().iter().enumerate() {
        let of = corners.map(|v| values[v as usize]);
        let Some(gradient) = facet_gradient(&patch.mesh.corners(t), of) else { continue };
        let weight = 0.5 * patch.mesh.scaled_normal(t).norm();
        area += weight;
        rise += weight * gradient.norm();
    }
    let length = area / rise;
    if !(length.is_finite() && length > 0.0) {
        return Err(PathError::NoField { residual: f64::NAN });
    }
    patch.levels = values.into_iter().map(|u| u * length).collect();
    Ok(())
}

/// The levels of a field on a patch, in cutting order.
pub(crate) struct FieldLayout {
    gradients: Vec<Vector3<f64>>,
    levels: Vec<(f64, Vec<u32>)>,
    pub(crate) strips: Strips,
}

impl FieldLayout {
    /// Chooses levels of the patch by strip widths.
    ///
    /// # Errors
    /// When a width is NaN, there would be too many passes, or the monitor cancels.
    pub(crate) fn plan(
        patch: &Patch,
        settings: &LaySettings,
        strip_width: StripWidth,
        monitor: &dyn Monitor,
    ) -> Result<Self, PathError> {
        let field = FieldBands::of(patch, settings, strip_width)?;
        monitor.checkpoint()?;
        let (first, last) = border_levels(patch, (f64::NEG_INFINITY, f64::INFINITY))?;
        let rising = if first < last {
            let width = AccumulatedWidth::of(field.edges(patch), [first, last]);
            width.levels(width.n_steps(&field.bands, field.cause)?, settings)
        } else {
            vec![first]
        };
        let FieldBands { gradients, bands, .. } = field;
        let (strips, triangles) = (Strips::between(&bands, &rising), triangles_at(&bands, &rising));
        let levels = settings.in_cutting_order(rising.into_iter().zip(triangles).collect());
        Ok(Self { gradients, levels, strips })
    }

    /// Where passes are cut out, in cutting order.
    pub(crate) fn levels<'a>(&'a self) -> Vec<PassLevel<'a>> {
        let pass = |(level, among): &'a (f64, Vec<u32>)| PassLevel {
            set: LevelSet::Field { gradients: &self.gradients, level: *level },
            among: Cow::Borrowed(among),
            starts: None,
        };
        self.levels.iter().map(pass).collect()
    }
}
