//! Passes of constant scallop on a region.

use std::collections::BTreeMap;

use facemill_cl_data::Monitor;

use crate::distance::patch_vertices::PatchVertices;
use crate::distance::source_curve::SourceCurve;
use crate::error::PathError;
use crate::layout::pass_level::{PatchTask, Strips};
use crate::layout::scallop::advance::{Advance, BaseKind, FrontStep};
use crate::layout::scallop::coverage::Coverage;
use crate::layout::scallop::ridges::ridge_passes;
use crate::layout::scallop::seeds::{SeedCurves, border_of, seed_curves};
use crate::layout::scallop::surface_path::SurfacePath;
use crate::layout::strip_width::StripWidth;
use crate::layout::trace::TracedLevel;
use crate::strategy::patch::Patch;
use crate::strategy::scallop::ConstantScallop;
use crate::strategy::settings::LaySettings;

/// Passes of constant scallop.
pub(crate) struct ScallopLayout {
    /// Fronts in the order from the seed.
    steps: Vec<FrontStep>,
    spacing: f64,
    pub(crate) strips: Strips,
    /// Area of the region that no pass covers, mm².
    pub(crate) uncovered_area: f64,
    /// Stubs of ridges that are shorter than a pass.
    pub(crate) n_dropped: usize,
}

impl ScallopLayout {
    /// # Errors
    /// When a seed is nowhere on the region, a width is NaN, there would be too many passes, or the
    /// monitor cancels.
    pub(crate) fn plan(
        patch: &Patch,
        scallop: &ConstantScallop,
        settings: &LaySettings,
        strip_width: StripWidth,
        monitor: &dyn Monitor,
    ) -> Result<Self, PathError> {
        let spacing = 0.25 * settings.max_step_over;
        let mut seeds = Vec::new();
        for seed in &scallop.seeds {
            let SeedCurves { paths, is_border } = seed_curves(patch, seed, spacing)?;
            let kind = if is_border { BaseKind::Border } else { BaseKind::Seed };
            seeds.extend(paths.into_iter().map(|p| (p, kind)));
        }
        let vertices = PatchVertices::of(patch);
        let context = PatchTask { patch, vertices: &vertices, settings, strip_width, monitor };
        let mut advance = Advance::new(&context);
        advance.run(&seeds)?;
        while let Some(component) = left_out(patch, &advance.behind) {
            let borders = border_of(patch, |t| component[t as usize]);
            if borders.is_empty() {
                return Err(PathError::SeedNowhere {
                    seed: "on a closed part that no seed reaches; add one that cuts it, or bound the region".into(),
                });
            }
            let borders: Vec<_> = borders.into_iter().map(|p| (p, BaseKind::Border)).collect();
            advance.run(&borders)?;
            // What its fronts did not reach is no wider than an edge: it is not tried again.
            let of_component = component.iter().zip(patch.mesh.triangles()).filter(|(is_in, _)| **is_in);
            of_component.flat_map(|(_, v)| v).for_each(|&v| advance.behind[v as usize] = true);
        }
        Ok(Self::with_ridges(&context, advance))
    }

    fn with_ridges(context: &PatchTask, mut advance: Advance) -> Self {
        let PatchTask { patch, vertices, settings, .. } = *context;
        let shortest = settings.min_pass_length + 2.0 * settings.edge_margin;
        let mut steps: Vec<FrontStep> = Vec::new();
        let spacing = |path: &SurfacePath, widths: &[f64]| {
            let v = patch.mesh.triangles()[path.triangles[0] as usize][0];
            let width = widths[v as usize];
            0.25 * if width.is_finite() { width } else { settings.max_step_over }
        };
        for front in std::mem::take(&mut advance.fronts) {
            let width = |t: u32| {
                let widths = patch.mesh.triangles()[t as usize].map(|v| advance.widths[v as usize]);
                widths.into_iter().filter(|w| w.is_finite()).fold(0.0, f64::max)
            };
            let split = |path: &SurfacePath| path.clone().between_corners(patch, spacing(path, &advance.widths), width);
            let paths = front.paths.iter().flat_map(split).collect();
            steps.push(FrontStep { paths, ..front });
        }
        for width in advance.widths.iter_mut().filter(|w| w.is_nan()) {
            *width = settings.min_step_over;
        }
        let sources = |steps: &[FrontStep]| -> Vec<SourceCurve> {
            let long = steps.iter().flat_map(|s| &s.paths).filter(|p| p.length() >= shortest);
            long.filter_map(|p| p.source(patch, spacing(p, &advance.widths))).collect()
        };
        let fronts = sources(&steps);
        let coverage = Coverage::of(patch, vertices, &fronts, &advance.widths, settings.max_step_over);
        let ridges = ridge_passes(patch, vertices, &advance, &coverage);
        let (ridges, stubs): (Vec<_>, Vec<_>) = ridges.into_iter().partition(|p| p.length() >= shortest);
        let last = steps.last().map_or(0.0, |s| s.arrival);
        if !ridges.is_empty() {
            let split =
                |path: &SurfacePath| path.clone().between_corners(patch, spacing(path, &advance.widths), |_| 0.0);
            let paths = ridges.iter().flat_map(split).collect();
            steps.push(FrontStep { paths, arrival: last, starts: None });
        }
        let all = sources(&steps);
        let coverage = Coverage::of(patch, vertices, &all, &advance.widths, settings.max_step_over);
        let strips = Strips { n_wide: advance.n_wide, widest: advance.widest };
        let uncovered_area = coverage.uncovered_area(patch);
        Self { steps, spacing: 0.25 * settings.max_step_over, strips, uncovered_area, n_dropped: stubs.len() }
    }

    /// The curves of the passes, in cutting order.
    pub(crate) fn traced<'a>(&self, patch: &'a Patch<'a>, settings: &LaySettings) -> Vec<TracedLevel<'a>> {
        let level = |FrontStep { paths, arrival, starts }: &FrontStep| TracedLevel {
            starts: *starts,
            ..TracedLevel::of_paths(patch, paths, *arrival, self.spacing)
        };
        settings.in_cutting_order(self.steps.iter().map(level).collect())
    }
}

/// The first connected part of the triangles whose corners no front has reached.
fn left_out(patch: &Patch, behind: &[bool]) -> Option<Vec<bool>> {
    let triangles = patch.mesh.triangles();
    let is_open = |t: usize| triangles[t].iter().all(|&v| !behind[v as usize]);
    let first = (0..triangles.len()).find(|&t| is_open(t))?;
    let mut of_vertex: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for t in (0..triangles.len()).filter(|&t| is_open(t)) {
        triangles[t].iter().for_each(|&v| of_vertex.entry(v).or_default().push(t));
    }
    let mut part = vec![false; triangles.len()];
    let mut stack = vec![first];
    part[first] = true;
    while let Some(t) = stack.pop() {
        for &u in triangles[t].iter().flat_map(|v| &of_vertex[v]) {
            if !part[u] {
                part[u] = true;
                stack.push(u);
            }
        }
    }
    Some(part)
}
