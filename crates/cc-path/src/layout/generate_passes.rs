use facemill_cl_data::{CcPoint, Monitor, Pass};
use facemill_surface_model::Surface;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::distance::patch_vertices::PatchVertices;
use crate::error::PathError;
use crate::layout::field::field_layout::{FieldLayout, flow_levels};
use crate::layout::field::spiral::{SpiralLayout, without_poles};
use crate::layout::offset::edge_lines::group_indices;
use crate::layout::offset::fillet::Fillet;
use crate::layout::offset::offset_layout::{OffsetLayout, OffsetRange};
use crate::layout::offset::ridge::lines_of_edge;
use crate::layout::offset::rolling_ball::{CornerRest, RollingBall};
use crate::layout::offset::root_sides::{RootSide, root_sides};
use crate::layout::order::{LevelPieces, arrange};
use crate::layout::pass_level::{PassLevel, PatchTask, Strips};
use crate::layout::resample::{NoPointsLeft, beginning, pass_length, resample};
use crate::layout::scallop::scallop_layout::ScallopLayout;
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::section_layout::{SectionLayout, check_sections, extent, fineness};
use crate::layout::strip_width::StripWidth;
use crate::layout::trace::{Curve, TracedLevel, trace};
use crate::region::Region;
use crate::sections::Sections;
use crate::strategy::Strategy;
use crate::strategy::edge::{Edge, Root, RootLine};
use crate::strategy::field::{Flow, Spiral, SpiralLevels};
use crate::strategy::patch::{Fineness, Patch};
use crate::strategy::scallop::ConstantScallop;
use crate::strategy::settings::{LaySettings, UncutSide};
use crate::strategy::size::{PointsLeft, too_many_points};

/// Passes laid on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct PassLayout {
    /// The passes in cutting order, at least one.
    pub passes: Vec<LaidPass>,
    /// Number of levels, those without a pass included; of a spiral, its turns.
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
    /// Area of the region that is farther from a pass than half the strip allowed, mm²; 0 for
    /// sections, whose passes reach to the border.
    pub uncovered_area: f64,
    /// Largest distance of the smooth surface's section from the straight line between two points,
    /// estimated from nodes and normals, mm.
    pub largest_chord: f64,
    /// Material that the first pass leaves in the corner of a root without a fillet, where it is
    /// most.
    pub corner: Option<CornerRest>,
}

/// One pass of a [`PassLayout`].
#[derive(Clone, Debug, PartialEq)]
pub struct LaidPass {
    /// The points in cutting order, at least two. Each lies on the mesh and, unless
    /// edges are filled or it is a spiral, on the level.
    pub pass: Pass<CcPoint>,
    /// Distance of the plane, radius of the cylinder or level of the flow at its first point, mm;
    /// on all of it, unless edges are filled or it is a spiral. The levels of a flow begin with 0
    /// and have a slope of 1 in the mean.
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
/// width is NaN, the ends of a flow or the levels of a spiral are not what they have to be, there
/// would be too many passes, points, or facets to look at, or the monitor cancels.
pub fn lay_passes(
    surface: &Surface,
    region: &Region,
    strategy: &Strategy,
    settings: &LaySettings,
    strip_width: &(dyn Fn(&CcPoint) -> f64 + Sync),
    monitor: &dyn Monitor,
) -> Result<PassLayout, PathError> {
    settings.check()?;
    let task = Task { surface, region, settings, strip_width, monitor };
    match strategy {
        Strategy::ParallelPlanes(s) => task.along_sections(&Sections::ParallelPlanes(*s)),
        Strategy::CylindricalSections(s) => task.along_sections(&Sections::CylindricalSections(*s)),
        Strategy::Flow(flow) => task.along_flow(flow),
        Strategy::Spiral(spiral) => task.along_spiral(spiral),
        Strategy::ConstantScallop(scallop) => task.along_scallop(scallop),
        Strategy::Edge(edge) => task.along_edge(edge),
        Strategy::Root(root) => task.along_root(root),
    }
}

/// Longest edge below fronts, in largest step-overs: distances are taken at vertices.
const EDGE_OF_FRONTS: f64 = 0.25;

/// Surface, region and settings of passes.
struct Task<'a> {
    surface: &'a Surface,
    region: &'a Region,
    settings: &'a LaySettings,
    strip_width: StripWidth<'a>,
    monitor: &'a dyn Monitor,
}

impl<'a> Task<'a> {
    fn patch(&self, sections: Option<&Sections>) -> Result<Patch<'_>, PathError> {
        let patch = Patch::new(self.surface, self.region, sections, &fineness(self.surface, self.settings))?;
        self.monitor.checkpoint()?;
        Ok(patch)
    }

    fn along_sections(&self, sections: &Sections) -> Result<PassLayout, PathError> {
        check_sections(sections)?;
        let patch = self.patch(Some(sections))?;
        let layout = SectionLayout::plan(&patch, sections, self.settings, self.strip_width, self.monitor)?;
        let traced = trace_levels(&patch, layout.levels(), self.settings, self.monitor)?;
        pass_layout(traced, layout.strips, self.settings, self.monitor)
    }

    fn along_spiral(&self, spiral: &Spiral) -> Result<PassLayout, PathError> {
        let (patch, sections) = match &spiral.levels {
            SpiralLevels::Sections(sections) => {
                check_sections(sections)?;
                let patch = self.patch(Some(sections))?;
                (without_poles(patch, sections, self.settings, self.strip_width)?, Some(sections))
            }
            SpiralLevels::Flow(flow) => {
                flow.check()?;
                let mut patch = self.patch(None)?;
                flow_levels(&mut patch, flow)?;
                (patch, None)
            }
        };
        self.monitor.checkpoint()?;
        let layout = SpiralLayout::plan(&patch, sections, self.settings, self.strip_width, self.monitor)?;
        let traced = vec![layout.traced(&patch)];
        // One pass on as many levels as it has turns.
        let passes = pass_layout(traced, layout.strips, self.settings, self.monitor)?;
        Ok(PassLayout { n_levels: layout.n_turns, ..passes })
    }

    fn along_scallop(&self, scallop: &ConstantScallop) -> Result<PassLayout, PathError> {
        if let Some(within) = &scallop.within {
            check_sections(within)?;
        }
        let fineness = Fineness {
            max_edge: (EDGE_OF_FRONTS * self.settings.max_step_over).max(extent(self.surface.mesh()) / 400.0),
            max_bend: 0.5 * self.settings.chord_tolerance,
            cuts_range: true,
        };
        let patch = Patch::new(self.surface, self.region, scallop.within.as_ref(), &fineness);
        let patch = patch.map_err(|e| e.with_edge_share(EDGE_OF_FRONTS))?;
        self.monitor.checkpoint()?;
        let layout = ScallopLayout::plan(&patch, scallop, self.settings, self.strip_width, self.monitor)?;
        let mut traced = layout.traced(&patch, self.settings);
        cut_open(&mut traced, self.settings);
        let passes = pass_layout(traced, layout.strips, self.settings, self.monitor)?;
        let n_dropped_pieces = passes.n_dropped_pieces + layout.n_dropped;
        Ok(PassLayout { n_dropped_pieces, uncovered_area: layout.uncovered_area, ..passes })
    }

    fn along_edge(&self, edge: &Edge) -> Result<PassLayout, PathError> {
        edge.check()?;
        let patch = self.patch(None)?;
        let vertices = PatchVertices::of(&patch);
        let lines = lines_of_edge(&patch, &vertices, &edge.line)?;
        self.beside(&patch, &vertices, &lines, edge.width)
    }

    fn along_root(&self, root: &Root) -> Result<PassLayout, PathError> {
        root.check()?;
        match &root.line {
            RootLine::BetweenGroups(groups) => self.along_corner(groups, root.width),
            RootLine::Fillet(group) => self.along_fillet(group, root.width),
        }
    }

    fn along_fillet(&self, group: &str, width: f64) -> Result<PassLayout, PathError> {
        let [index] = group_indices(self.surface, &[group.to_owned()])?;
        let patch = self.patch(None)?;
        let vertices = PatchVertices::of(&patch);
        let fillet = Fillet::new(&patch, &vertices, index);
        let lines = fillet.middle(0.25 * self.settings.max_step_over)?;
        fillet.check_fit(&lines, self.settings.corner_radius)?;
        self.beside(&patch, &vertices, &lines, width)
    }

    /// Passes on lines and on both sides of them.
    fn beside(
        &self,
        patch: &Patch,
        vertices: &PatchVertices,
        lines: &[SurfacePath],
        width: f64,
    ) -> Result<PassLayout, PathError> {
        let range = OffsetRange { from: -width, to: width, with_line: true };
        let Self { settings, strip_width, monitor, .. } = *self;
        let task = PatchTask { patch, vertices, settings, strip_width, monitor };
        let layout = OffsetLayout::plan(&task, lines, range)?;
        let mut traced = layout.traced(patch, self.settings);
        cut_open(&mut traced, self.settings);
        pass_layout(traced, layout.strips, self.settings, self.monitor)
    }

    fn along_corner(&self, groups: &[String; 2], width: f64) -> Result<PassLayout, PathError> {
        let Self { surface, settings, strip_width, monitor, .. } = *self;
        let sides = root_sides(surface, self.region, groups)?;
        let fineness = fineness(surface, settings);
        let patch = |side: &RootSide| Patch::new(surface, &side.region, None, &fineness);
        let patches = sides.iter().map(patch).collect::<Result<Vec<_>, _>>()?;
        monitor.checkpoint()?;
        let (mut traced, mut strips) = (Vec::new(), Strips { n_wide: 0, widest: 0.0 });
        let mut corner: Option<CornerRest> = None;
        for (side, patch) in sides.iter().zip(&patches) {
            let vertices = PatchVertices::of(patch);
            let ball = RollingBall::new(patch, &vertices, &side.other, settings.corner_radius);
            let track = ball.track();
            let Some(rest) = ball.largest_rest(&track) else { continue };
            // The ball touches both sides at once: one pass serves both.
            let range = OffsetRange { from: 0.0, to: width, with_line: corner.is_none() };
            let task = PatchTask { patch, vertices: &vertices, settings, strip_width, monitor };
            let layout = OffsetLayout::plan(&task, &track, range)?;
            strips.n_wide += layout.strips.n_wide;
            strips.widest = strips.widest.max(layout.strips.widest);
            traced.extend(layout.traced(patch, settings));
            corner = Some(corner.filter(|c| c.height >= rest.height).unwrap_or(rest));
        }
        if corner.is_none() {
            return Err(PathError::NoCorner { groups: groups.clone(), corner_radius: settings.corner_radius });
        }
        cut_open(&mut traced, settings);
        Ok(PassLayout { corner, ..pass_layout(traced, strips, settings, monitor)? })
    }

    fn along_flow(&self, flow: &Flow) -> Result<PassLayout, PathError> {
        flow.check()?;
        let mut patch = self.patch(None)?;
        flow_levels(&mut patch, flow)?;
        self.monitor.checkpoint()?;
        let layout = FieldLayout::plan(&patch, self.settings, self.strip_width, self.monitor)?;
        let traced = trace_levels(&patch, layout.levels(), self.settings, self.monitor)?;
        pass_layout(traced, layout.strips, self.settings, self.monitor)
    }
}

/// The passes on traced levels, in cutting order.
fn pass_layout(
    levels: Vec<TracedLevel>,
    strips: Strips,
    settings: &LaySettings,
    monitor: &dyn Monitor,
) -> Result<PassLayout, PathError> {
    let (n_levels, n_curves) = (levels.len(), levels.iter().map(|l| l.curves.len()).sum::<usize>());
    let pieces = resample_levels(&levels, settings, monitor)?;
    let n_pieces: usize = pieces.iter().map(|p| p.pieces.len()).sum();
    let n_dropped_pieces = n_curves - n_pieces;
    if n_pieces == 0 {
        return Err(PathError::NoPasses { n_dropped_pieces });
    }
    let largest_chord = pieces.iter().flat_map(|p| &p.pieces).map(|p| p.chord).fold(0.0, f64::max);
    let passes = arrange(pieces, settings);
    Ok(PassLayout {
        n_levels,
        n_dropped_pieces,
        n_wide_strips: strips.n_wide,
        largest_step_over: strips.widest,
        uncovered_area: 0.0,
        largest_chord,
        passes,
        corner: None,
    })
}

/// The curves of each level, in the triangles that reach it, closed ones cut open one after the
/// other.
fn trace_levels<'a>(
    patch: &'a Patch<'a>,
    levels: Vec<PassLevel<'a>>,
    settings: &LaySettings,
    monitor: &dyn Monitor,
) -> Result<Vec<TracedLevel<'a>>, PathError> {
    // Values that are not stored are taken at the corners that are needed, in a store that is
    // cleared after use.
    let traced = levels.into_par_iter().map_init(Vec::new, |store: &mut Vec<f64>, level| {
        monitor.checkpoint()?;
        let PassLevel { set, among, starts } = level;
        if let Some(values) = set.at_vertices(patch) {
            return Ok(TracedLevel { set, curves: trace(patch, set, values, &among), starts });
        }
        store.resize(patch.mesh.vertices().len(), f64::NAN);
        let corners = || among.iter().flat_map(|&t| patch.mesh.triangles()[t as usize]).map(|v| v as usize);
        for v in corners() {
            if store[v].is_nan() {
                store[v] = set.value(&patch.mesh.vertices()[v]);
            }
        }
        let curves = trace(patch, set, store, &among);
        corners().for_each(|v| store[v] = f64::NAN);
        Ok(TracedLevel { set, curves, starts })
    });
    let mut traced = traced.collect::<Result<Vec<_>, PathError>>()?;
    cut_open(&mut traced, settings);
    Ok(traced)
}

/// Cuts closed curves open, one after the other.
fn cut_open(traced: &mut [TracedLevel], settings: &LaySettings) {
    let mut last_start: Option<Point3<f64>> = None;
    for curve in traced.iter_mut().flat_map(|t| &mut t.curves).filter(|c| c.closed) {
        if let Some(p) = settings.closed_start.or(last_start) {
            curve.cut_open_near(&p);
        }
        last_start = Some(curve.start());
    }
}

fn resample_levels<'a>(
    levels: &[TracedLevel<'a>],
    settings: &LaySettings,
    monitor: &dyn Monitor,
) -> Result<Vec<LevelPieces<'a>>, PathError> {
    let curves = || levels.iter().flat_map(|l| &l.curves);
    let length: f64 = curves().map(|c| pass_length(c, settings)).sum();
    let too_many = || too_many_points(settings, length, curves().count(), looked_at(levels, settings));
    if length > settings.max_step * settings.max_points as f64 {
        return Err(too_many());
    }
    let left = PointsLeft::new(settings.max_points);
    let resampled = levels.par_iter().map(|TracedLevel { set, curves, starts }| {
        monitor.checkpoint()?;
        let pieces = curves.iter().filter_map(|c| resample(c, settings, &left).transpose());
        let pieces = pieces.collect::<Result<Vec<_>, _>>();
        monitor.advance(1);
        Ok(pieces.map(|pieces| LevelPieces { set: *set, pieces, starts: *starts }))
    });
    let resampled = resampled.collect::<Result<Vec<_>, PathError>>()?;
    resampled.into_iter().collect::<Result<_, NoPointsLeft>>().map_err(|_| too_many())
}

/// Curves that are looked at for an estimate of the points that all need, and points on each.
const LOOKED_AT: [usize; 2] = [32, 10_000];

/// The share of the curves' length that some of them have, as far as they are looked at, and the
/// points that it needs.
fn looked_at(levels: &[TracedLevel], settings: &LaySettings) -> (f64, usize) {
    let curves: Vec<&Curve> = levels.iter().flat_map(|l| &l.curves).collect();
    let length: f64 = curves.iter().map(|c| pass_length(c, settings)).sum();
    let some = curves.iter().step_by(curves.len().div_ceil(LOOKED_AT[0]).max(1));
    let of_some = some.map(|c| beginning(c, settings, LOOKED_AT[1]));
    let (way, n) = of_some.fold((0.0, 0), |(way, n), (w, m)| (way + w, n + m));
    (way / length, n)
}
