use std::borrow::Cow;

use facemill_cl_data::{CcPoint, Monitor, Pass};
use facemill_surface_model::{Surface, TriMesh};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::error::PathError;
use crate::layout::front::LevelSet;
use crate::layout::front_layout::{FrontLayout, PassLevel};
use crate::layout::levels::{Band, count_wide, plan_levels, triangles_at, widest_strip};
use crate::layout::order::{LevelPieces, arrange};
use crate::layout::resample::{NoPointsLeft, beginning, pass_length, resample};
use crate::layout::strip_width::bands;
use crate::layout::trace::{Curve, trace};
use crate::region::Region;
use crate::strategy::Strategy;
use crate::strategy::patch::{Fineness, Patch};
use crate::strategy::settings::{LaySettings, LevelOrder, UncutSide, require};
use crate::strategy::size::{PointsLeft, StepOverCause, too_many_points};

/// Passes laid on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Laid {
    /// The passes in cutting order, at least one.
    pub passes: Vec<LaidPass>,
    /// Number of levels, those without a pass included.
    pub n_levels: usize,
    /// Pieces left out because they are shorter than the shortest pass, margins taken off.
    pub n_dropped_pieces: usize,
    /// Strips between two levels that are somewhere wider than allowed, because the allowed width
    /// was below the smallest step-over, or because the surface is at less than 3° to the levels.
    pub n_wide_strips: usize,
    /// Largest distance between neighbouring levels along the surface, mm: on no facet is the way
    /// up its steepest lines from one level to the next longer. Facets at less than 3° to the
    /// levels count as standing at 3°. 0 where there is one level.
    pub largest_step_over: f64,
    /// Largest distance of the smooth surface's section from the straight line between two points,
    /// estimated from nodes and normals, mm.
    pub largest_chord: f64,
}

/// One pass of a [`Laid`] path.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidPass {
    /// The points in cutting order, at least two. Each lies on the mesh and, unless
    /// edges are filled, on the level.
    pub pass: Pass<CcPoint>,
    /// Distance of the plane or radius of the cylinder at its first point, mm; on all of it, unless
    /// edges are filled.
    pub level: f64,
    /// On which side of the feed the later passes lie.
    pub uncut: UncutSide,
    /// Length on the mesh, mm.
    pub length: f64,
    /// Whether the last point is the first again.
    pub closed: bool,
    /// Whether one of its ends is inside the region, where it joins the pass before it.
    pub partial: bool,
}

/// Border levels are moved inside by this part of the region's extent (3 µm on 3 m), and at most by
/// a thousandth of the range. Larger: a rim stays uncut. Smaller: a border that runs along a level
/// only up to the rounding of a mesh file in single precision is cut in crumbs.
const BORDER_INSET: f64 = 1e-6;

/// Lays passes on the region of a surface: along levels of the strategy, so close that neighbours
/// are nowhere farther apart along the surface than `strip_width` allows.
///
/// `strip_width` is called at the vertices of the region (and between them where they are farther
/// apart than the largest step-over), with the surface's normal and the feed of the first level; it
/// returns mm, infinite for any width. The first and the last level lie on the border of the region
/// or at the ends of the strategy's range. A step of `monitor` is one level.
///
/// The result does not depend on the number of threads. A rigid motion of surface, strategy and
/// region moves it along, except for a box, whose sides stay parallel to the axes.
///
/// # Errors
/// When a setting is out of range, the region is empty, names an unknown group or leaves no pass, a
/// width is NaN, there would be too many passes, points, or facets to look at, or the monitor
/// cancels.
pub fn lay_passes(
    surface: &Surface,
    region: &Region,
    strategy: &Strategy,
    settings: &LaySettings,
    strip_width: &(dyn Fn(&CcPoint) -> f64 + Sync),
    monitor: &dyn Monitor,
) -> Result<Laid, PathError> {
    settings.check()?;
    check_strategy(strategy)?;
    let patch = Patch::new(surface, region, strategy, &fineness(surface, settings))?;
    monitor.checkpoint()?;
    let (bands, cause) = bands(&patch, strategy, settings, strip_width)?;
    monitor.checkpoint()?;
    let (first, last) = border_levels(&patch, strategy)?;
    let rising = rising_levels(&bands, cause, first, last, settings)?;
    let fronts = settings.edge_fill.then(|| FrontLayout::plan(&patch, strategy, settings, &bands, &rising)).flatten();
    let levels = match &fronts {
        Some(fronts) => fronts.levels(strategy),
        None => levels_of(strategy, settings, &rising, triangles_at(&bands, &rising)),
    };
    let (n_wide_strips, largest_step_over) = match &fronts {
        Some(fronts) => fronts.strips(),
        None => (count_wide(&bands, &rising), widest_strip(&bands, &rising)),
    };
    drop(bands);
    let curves = trace_levels(&patch, &levels, settings, monitor)?;
    let n_curves: usize = curves.iter().map(Vec::len).sum();
    let pieces = resample_levels(&curves, &levels, settings, monitor)?;
    let n_pieces: usize = pieces.iter().map(|p| p.pieces.len()).sum();
    let n_dropped_pieces = n_curves - n_pieces;
    if n_pieces == 0 {
        return Err(PathError::NoPasses { n_dropped_pieces });
    }
    let largest_chord = pieces.iter().flat_map(|p| &p.pieces).map(|p| p.chord).fold(0.0, f64::max);
    let passes = arrange(pieces, |p| strategy.level(p), settings);
    Ok(Laid { n_levels: levels.len(), n_dropped_pieces, n_wide_strips, largest_step_over, largest_chord, passes })
}

fn check_strategy(strategy: &Strategy) -> Result<(), PathError> {
    let (low, high) = strategy.range();
    match strategy {
        Strategy::ParallelPlanes(_) => {
            require("from", low, "a number", !low.is_nan())?;
            require("to", high, "a number, not below from", high >= low)
        }
        Strategy::CylindricalSections(_) => {
            require("from_radius", low, "finite and not below 0", low.is_finite() && low >= 0.0)?;
            require("to_radius", high, "not below from_radius", high >= low)
        }
    }
}

fn fineness(surface: &Surface, settings: &LaySettings) -> Fineness {
    Fineness {
        // Widths are taken between vertices no farther apart than this. A region that would fall
        // into more than about 300 × 300 pieces by it is taken more coarsely.
        max_edge: settings.max_step_over.max(extent(surface.mesh()) / 300.0),
        // Islands and bays of a level that are smaller than this may be missed. Points lie on the
        // level all the same.
        max_bend: settings.chord_tolerance / 2.0,
    }
}

/// Largest distance of a triangle's corner from the first one, mm: a size that does not change with
/// the frame.
fn extent(mesh: &TriMesh) -> f64 {
    let mut corners = mesh.triangles().iter().flatten().map(|&v| mesh.vertices()[v as usize]);
    let Some(first) = corners.next() else { return 0.0 };
    corners.map(|p| (p - first).norm_squared()).fold(0.0, f64::max).sqrt()
}

/// Lowest and highest level to be cut.
fn border_levels(patch: &Patch, strategy: &Strategy) -> Result<(f64, f64), PathError> {
    let used = patch.mesh.triangles().iter().flatten().map(|&v| patch.levels[v as usize]);
    let (lowest, highest) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), l| (a.min(l), b.max(l)));
    let inset = (BORDER_INSET * extent(&patch.mesh)).min(1e-3 * (highest - lowest));
    let (low, high) = strategy.range();
    let (first, last) = ((lowest + inset).max(low), (highest - inset).min(high));
    if first > last {
        return Err(PathError::EmptyRegion { reason: "none lies within the levels to be cut" });
    }
    Ok((first, last))
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

/// The levels of a strategy in cutting order.
fn levels_of<'a>(
    strategy: &'a Strategy,
    settings: &LaySettings,
    rising: &[f64],
    triangles: Vec<Vec<u32>>,
) -> Vec<PassLevel<'a>> {
    let level = |(&level, among): (&f64, Vec<u32>)| PassLevel {
        set: LevelSet::of_level(strategy, level),
        among: Cow::Owned(among),
    };
    let mut levels: Vec<PassLevel> = rising.iter().zip(triangles).map(level).collect();
    if settings.order == LevelOrder::Decreasing {
        levels.reverse();
    }
    levels
}

/// The curves of each level, in the triangles that reach it, closed ones cut open one after the
/// other.
fn trace_levels<'a>(
    patch: &'a Patch<'a>,
    levels: &[PassLevel<'a>],
    settings: &LaySettings,
    monitor: &dyn Monitor,
) -> Result<Vec<Vec<Curve<'a>>>, PathError> {
    // The values of fronts are taken at the corners that are needed, in a store that is cleared
    // after use.
    let no_values = || Vec::new();
    let traced = levels.par_iter().map_init(no_values, |values: &mut Vec<f64>, level| {
        monitor.checkpoint()?;
        if level.set.front.is_none() {
            return Ok(trace(patch, level.set, &patch.levels, &level.among));
        }
        values.resize(patch.mesh.vertices().len(), f64::NAN);
        let corners = || level.among.iter().flat_map(|&t| patch.mesh.triangles()[t as usize]).map(|v| v as usize);
        for v in corners() {
            if values[v].is_nan() {
                values[v] = level.set.value(&patch.mesh.vertices()[v]);
            }
        }
        let curves = trace(patch, level.set, values, &level.among);
        corners().for_each(|v| values[v] = f64::NAN);
        Ok(curves)
    });
    let mut curves = traced.collect::<Result<Vec<_>, PathError>>()?;
    let mut last_start: Option<Point3<f64>> = None;
    for curve in curves.iter_mut().flatten().filter(|c| c.closed) {
        if let Some(p) = settings.closed_start.or(last_start) {
            curve.cut_open_near(&p);
        }
        last_start = Some(curve.start());
    }
    Ok(curves)
}

fn resample_levels(
    curves: &[Vec<Curve>],
    levels: &[PassLevel],
    settings: &LaySettings,
    monitor: &dyn Monitor,
) -> Result<Vec<LevelPieces>, PathError> {
    let length: f64 = curves.iter().flatten().map(|c| pass_length(c, settings)).sum();
    let n_curves = curves.iter().map(Vec::len).sum();
    let too_many = || too_many_points(settings, length, n_curves, looked_at(curves, settings));
    if length > settings.max_step * settings.max_points as f64 {
        return Err(too_many());
    }
    let left = PointsLeft::new(settings.max_points);
    let resampled = levels.par_iter().zip(curves).map(|(level, curves)| {
        monitor.checkpoint()?;
        let pieces = curves.iter().filter_map(|c| resample(c, settings, &left).transpose());
        let pieces = pieces.collect::<Result<Vec<_>, _>>();
        monitor.advance(1);
        Ok(pieces.map(|pieces| LevelPieces { pieces, starts: level.starts() }))
    });
    let resampled = resampled.collect::<Result<Vec<_>, PathError>>()?;
    resampled.into_iter().collect::<Result<_, NoPointsLeft>>().map_err(|_| too_many())
}

/// Curves that are looked at for an estimate of the points that all need, and points on each.
const LOOKED_AT: [usize; 2] = [32, 10_000];

/// The share of the curves' length that some of them have, as far as they are looked at, and the
/// points that it needs.
fn looked_at(curves: &[Vec<Curve>], settings: &LaySettings) -> (f64, usize) {
    let curves: Vec<&Curve> = curves.iter().flatten().collect();
    let length: f64 = curves.iter().map(|c| pass_length(c, settings)).sum();
    let some = curves.iter().step_by(curves.len().div_ceil(LOOKED_AT[0]).max(1));
    let of_some = some.map(|c| beginning(c, settings, LOOKED_AT[1]));
    let (way, n) = of_some.fold((0.0, 0), |(way, n), (w, m)| (way + w, n + m));
    (way / length, n)
}
