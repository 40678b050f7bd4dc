//! Passes at distances from lines on a region, spaced by strip widths.

use rayon::prelude::*;

use crate::distance::source_curve::SourceCurve;
use crate::error::PathError;
use crate::layout::levels::{Band, plan_levels, triangles_at};
use crate::layout::offset::offset_field::OffsetField;
use crate::layout::pass_level::{PatchTask, Strips};
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::strip_width::{allowed_width, cc_point, least};
use crate::layout::trace::TracedLevel;
use crate::strategy::patch::Patch;
use crate::strategy::settings::LaySettings;
use crate::strategy::size::StepOverCause;

/// Where passes lie beside their lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OffsetRange {
    /// Lowest and highest level, mm; the first at most 0, the last at least 0.
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// Whether the lines are passes themselves.
    pub(crate) with_line: bool,
}

/// Passes at distances from lines.
pub(crate) struct OffsetLayout {
    /// Level and curves, in rising order.
    levels: Vec<(f64, Vec<SurfacePath>)>,
    spacing: f64,
    pub(crate) strips: Strips,
}

/// Distance between the nodes of lines that distances are measured from, as a share of the largest
/// step-over: between them lines are cubics.
const NODE_SPACING: f64 = 0.25;

/// A line along the border of the region is moved inside by this share of the largest step-over: on
/// the border itself, rounding decides what is inside.
const BORDER: f64 = 1e-3;

impl OffsetLayout {
    /// # Errors
    /// When a width is NaN, there would be too many passes, or the monitor cancels.
    pub(crate) fn plan(task: &PatchTask, lines: &[SurfacePath], range: OffsetRange) -> Result<Self, PathError> {
        let spacing = NODE_SPACING * task.settings.max_step_over;
        let curves: Vec<SourceCurve> = lines.iter().filter_map(|l| l.source(task.patch, spacing)).collect();
        let field = OffsetField::new(task.patch, task.vertices, &curves, range.to.max(-range.from));
        task.monitor.checkpoint()?;
        let widths = task.widths(&field)?;
        let bands = task.bands(&field, &widths);
        let largest = task.settings.max_step_over;
        let cause = StepOverCause { largest, is_largest: widths.iter().all(|&w| w.is_nan() || w >= largest) };
        let border = BORDER * largest;
        let levels = rising_levels(&bands, cause, range, border, task.settings.even)?;
        let strips = Strips::between(&bands, &levels);
        let among = triangles_at(&bands, &levels);
        let traced = levels.into_par_iter().zip(among).map_init(Vec::new, |store, (level, among)| {
            task.monitor.checkpoint()?;
            let among: Vec<u32> = among.into_iter().map(|k| field.triangles[k as usize]).collect();
            Ok((level, field.trace(level, &among, store)))
        });
        let mut levels = traced.collect::<Result<Vec<_>, PathError>>()?;
        levels.retain(|(level, _)| range.with_line || level.abs() > border);
        Ok(Self { levels, spacing, strips })
    }

    /// The curves of the passes, in cutting order.
    pub(crate) fn traced<'a>(&self, patch: &'a Patch<'a>, settings: &LaySettings) -> Vec<TracedLevel<'a>> {
        let traced = self.levels.iter().map(|(l, paths)| TracedLevel::of_paths(patch, paths, *l, self.spacing));
        settings.in_cutting_order(traced.collect())
    }
}

impl PatchTask<'_> {
    /// The width allowed at each vertex that the field reaches, at most the largest step-over; NaN
    /// at others.
    fn widths(&self, field: &OffsetField) -> Result<Vec<f64>, PathError> {
        let width = |v: usize| {
            if field.values[v].is_nan() {
                return Ok(f64::NAN);
            }
            let (position, normal) = (self.patch.mesh.vertices()[v], self.vertices.normal(v as u32));
            let cc = cc_point(Some(field.gradients[v]), self.settings.first_direction(), position, normal);
            allowed_width(&cc, self.settings, self.strip_width)
        };
        (0..field.values.len()).into_par_iter().map(width).collect::<Vec<_>>().into_iter().collect()
    }

    /// One band for each triangle of the field: levels are distances, so the slope is 1.
    fn bands(&self, field: &OffsetField, widths: &[f64]) -> Vec<Band> {
        let band = |&t: &u32| {
            let corners = self.patch.mesh.triangles()[t as usize].map(|v| v as usize);
            let levels = corners.map(|v| field.values[v]);
            let requested = least(corners.map(|v| widths[v]));
            Band {
                low: least(levels),
                high: levels.into_iter().fold(f64::NEG_INFINITY, f64::max),
                limit: requested.max(self.settings.min_step_over),
                requested,
                slope: 1.0,
            }
        };
        field.triangles.iter().map(band).collect()
    }
}

/// Levels from the line down and up, in rising order; the line is level 0, or `border` (mm) beside
/// it where the region is on one side alone.
fn rising_levels(
    bands: &[Band],
    cause: StepOverCause,
    range: OffsetRange,
    border: f64,
    even: bool,
) -> Result<Vec<f64>, PathError> {
    // Levels at the very border would be cut in crumbs.
    let inset = 1e-6 * (range.to - range.from);
    let highest = bands.iter().map(|b| b.high).fold(0.0, f64::max) - inset;
    let lowest = bands.iter().map(|b| b.low).fold(0.0, f64::min) + inset;
    let line = match (lowest > -border, highest < border) {
        (true, false) => border,
        (false, true) => -border,
        _ => 0.0,
    };
    let turned: Vec<Band> = bands.iter().map(|b| Band { low: -b.high, high: -b.low, ..*b }).collect();
    let lowest = if line > 0.0 { line } else { lowest.max(range.from).min(line) };
    let highest = if line < 0.0 { line } else { highest.min(range.to).max(line) };
    let below = plan_levels(&turned, cause, -line, -lowest, even)?;
    let above = plan_levels(bands, cause, line, highest, even)?;
    Ok(below.into_iter().skip(1).rev().map(|l| -l).chain(above).collect())
}
