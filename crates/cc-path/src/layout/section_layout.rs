//! Passes along sections: which levels or fronts they are.

use std::borrow::Cow;

use facemill_cl_data::Monitor;
use facemill_surface_model::{Surface, TriMesh};

use crate::error::PathError;
use crate::layout::edge_fill::front_layout::FrontLayout;
use crate::layout::level_set::LevelSet;
use crate::layout::levels::{Band, plan_levels, triangles_at};
use crate::layout::pass_level::{PassLevel, Strips};
use crate::layout::strip_width::{StripWidth, bands};
use crate::sections::Sections;
use crate::strategy::patch::{Fineness, Patch};
use crate::strategy::settings::{LaySettings, LevelOrder, require};
use crate::strategy::size::StepOverCause;

/// Border levels are moved inside by this part of the region's extent (3 µm on 3 m), and at most by
/// a thousandth of the range. Larger: a rim stays uncut. Smaller: a border that runs along a level
/// only up to the rounding of a mesh file in single precision is cut in crumbs.
pub(crate) const BORDER_INSET: f64 = 1e-6;

/// The levels or fronts of sections of a patch.
pub(crate) struct SectionLayout<'a> {
    sections: &'a Sections,
    kind: Kind,
    pub(crate) strips: Strips,
}

enum Kind {
    /// Levels in cutting order, with the triangles that reach them.
    Levels(Vec<(f64, Vec<u32>)>),
    Fronts(Box<FrontLayout>),
}

impl<'a> SectionLayout<'a> {
    /// # Errors
    /// When no level lies in the region, a width is NaN, there would be too many passes, or the
    /// monitor cancels.
    pub(crate) fn plan(
        patch: &Patch,
        sections: &'a Sections,
        settings: &LaySettings,
        strip_width: StripWidth,
        monitor: &dyn Monitor,
    ) -> Result<Self, PathError> {
        let (bands, cause) = bands(patch, sections, settings, strip_width)?;
        monitor.checkpoint()?;
        let (first, last) = border_levels(patch, sections.range())?;
        let rising = rising_levels(&bands, cause, first, last, settings)?;
        let fronts = || FrontLayout::plan(patch, sections, settings, &bands, &rising);
        if let Some(fronts) = settings.edge_fill.then(fronts).flatten() {
            let strips = fronts.strips();
            return Ok(Self { sections, kind: Kind::Fronts(Box::new(fronts)), strips });
        }
        let rising = if settings.edge_fill {
            rising
        } else {
            let [first, last] = beside_crumbs(patch, &bands, [first, last], settings);
            rising_levels(&bands, cause, first, last, settings)?
        };
        let (strips, triangles) = (Strips::between(&bands, &rising), triangles_at(&bands, &rising));
        let levels = settings.in_cutting_order(rising.into_iter().zip(triangles).collect());
        Ok(Self { sections, kind: Kind::Levels(levels), strips })
    }

    /// Where passes are cut out, in cutting order.
    pub(crate) fn levels(&'a self) -> Vec<PassLevel<'a>> {
        let sections = self.sections;
        match &self.kind {
            Kind::Fronts(fronts) => fronts.levels(sections),
            Kind::Levels(levels) => {
                let pass = |(level, among): &'a (f64, Vec<u32>)| PassLevel {
                    set: LevelSet::Level { sections, level: *level },
                    among: Cow::Borrowed(among),
                    starts: None,
                };
                levels.iter().map(pass).collect()
            }
        }
    }
}

/// # Errors
/// When the range of levels is empty.
pub(crate) fn check_sections(sections: &Sections) -> Result<(), PathError> {
    let (low, high) = sections.range();
    match sections {
        Sections::ParallelPlanes(_) => {
            require("from", low, "a number", !low.is_nan())?;
            require("to", high, "a number, not below from", high >= low)
        }
        Sections::CylindricalSections(_) => {
            require("from_radius", low, "finite and not below 0", low.is_finite() && low >= 0.0)?;
            require("to_radius", high, "not below from_radius", high >= low)
        }
    }
}

pub(crate) fn fineness(surface: &Surface, settings: &LaySettings) -> Fineness {
    Fineness {
        // Widths are taken between vertices no farther apart than this. A region that would fall
        // into more than about 300 × 300 pieces by it is taken more coarsely.
        max_edge: settings.max_step_over.max(extent(surface.mesh()) / 300.0),
        // Islands and bays of a level that are smaller than this may be missed. Points lie on the
        // level all the same.
        max_bend: settings.chord_tolerance / 2.0,
        cuts_range: false,
    }
}

/// Largest distance of a triangle's corner from the first one, mm: a size that does not change with
/// the frame.
pub(crate) fn extent(mesh: &TriMesh) -> f64 {
    let mut corners = mesh.triangles().iter().flatten().map(|&v| mesh.vertices()[v as usize]);
    let Some(first) = corners.next() else { return 0.0 };
    corners.map(|p| (p - first).norm_squared()).fold(0.0, f64::max).sqrt()
}

/// Lowest and highest level to be cut, within a range.
///
/// # Errors
/// When none is in it.
pub(crate) fn border_levels(patch: &Patch, (low, high): (f64, f64)) -> Result<(f64, f64), PathError> {
    let used = patch.mesh.triangles().iter().flatten().map(|&v| patch.levels[v as usize]);
    let (lowest, highest) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), l| (a.min(l), b.max(l)));
    let inset = (BORDER_INSET * extent(&patch.mesh)).min(1e-3 * (highest - lowest));
    let (first, last) = ((lowest + inset).max(low), (highest - inset).min(high));
    if first > last {
        return Err(PathError::EmptyRegion { reason: "none lies within the levels to be cut" });
    }
    Ok((first, last))
}

/// Moves the first and the last level half a step inside where the region ends in a corner there:
/// the pass on the border would be a crumb, and the next one a whole step away from the corner.
fn beside_crumbs(patch: &Patch, bands: &[Band], [first, last]: [f64; 2], settings: &LaySettings) -> [f64; 2] {
    let shortest = settings.min_pass_length + 2.0 * settings.edge_margin;
    let inside = |level: f64, up: f64| {
        // A step of the bands on the border reaches further ones.
        let least = |reach: f64| {
            let near = |b: &&Band| b.low <= level.max(level + up * reach) && b.high >= level.min(level + up * reach);
            bands.iter().filter(near).map(|b| b.limit).fold(f64::INFINITY, f64::min)
        };
        let half_step = 0.5 * least(least(0.0).min(last - first));
        let moved = level + up * half_step;
        // On a border along the levels itself no triangle is crossed.
        let lengths = [level + up * JUST_INSIDE * half_step, moved].map(|level| length_of_level(patch, level));
        let is_crumb = lengths[0] < shortest.max(CRUMB * half_step) && lengths[1] > lengths[0];
        if is_crumb { moved } else { level }
    };
    let moved = [inside(first, 1.0), inside(last, -1.0)];
    if moved[0] < moved[1] { moved } else { [first, last] }
}

/// Distance from a border, in half steps, at which the length of its pass is measured.
const JUST_INSIDE: f64 = 1e-3;

/// Length of a pass, in half steps, below which it is a crumb.
const CRUMB: f64 = 0.5;

/// Returns the length of the section of a patch at a level, mm.
fn length_of_level(patch: &Patch, level: f64) -> f64 {
    let of_triangle = |corners: &[u32; 3]| {
        let crossing = |k: usize| {
            let [a, b] = [corners[k], corners[(k + 1) % 3]].map(|v| v as usize);
            let (low, high) = (patch.levels[a] - level, patch.levels[b] - level);
            let [from, to] = [a, b].map(|v| patch.mesh.vertices()[v]);
            ((low < 0.0) != (high < 0.0)).then(|| from + (to - from) * (low / (low - high)))
        };
        let mut ends = (0..3).filter_map(crossing);
        ends.next().zip(ends.next()).map_or(0.0, |(a, b)| nalgebra::distance(&a, &b))
    };
    patch.mesh.triangles().iter().map(of_triangle).sum()
}

/// The levels in rising order. They are planned from the side where cutting begins.
fn rising_levels(
    bands: &[Band],
    cause: StepOverCause,
    first: f64,
    last: f64,
    settings: &LaySettings,
) -> Result<Vec<f64>, PathError> {
    match settings.order {
        LevelOrder::Increasing => plan_levels(bands, cause, first, last, settings.even),
        LevelOrder::Decreasing => {
            let turned: Vec<Band> = bands.iter().map(|b| Band { low: -b.high, high: -b.low, ..*b }).collect();
            let levels = plan_levels(&turned, cause, -last, -first, settings.even)?;
            Ok(levels.into_iter().rev().map(|l| -l).collect())
        }
    }
}
