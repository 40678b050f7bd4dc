//! Cusps in the cut stock, and those predicted between the passes of the program.

use facemill_cl_data::Aabb;
use facemill_cutter_location::cusp::cut_point::CutPoint;
use facemill_cutter_location::cusp::ridges;
use facemill_job::format::report::deviation::{CuspRatios, CuspReport, CuspsNotCompared};
use facemill_nc_program::ReadProgram;
use facemill_surface_model::Surface;
use facemill_tool_model::{Cusp, Cutter};
use facemill_virtual_machine::VirtualSetup;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::deviation::stock_places::StockPlaces;
use crate::text_passes::{TouchedSurface, passes_of_text};

/// Number of sampled points.
const SAMPLES: usize = 300;

/// Least number of cells between passes at which a ridge is wide enough for the lines.
const CELLS_ACROSS: f64 = 4.0;

/// Largest ratio of the arc to the neighbouring pass to the straight distance of its nearest point:
/// on surfaces that a cutter follows, an arc is hardly longer than its chord.
const NEIGHBOUR: f64 = 1.05;

/// Stock and part for the comparison of passes.
pub(crate) struct CuspScene<'a> {
    pub(crate) part: &'a Surface,
    /// Allowance on each triangle of the part, mm.
    pub(crate) allowances: &'a [f64],
    pub(crate) found: &'a StockPlaces<'a>,
    pub(crate) cell: f64,
    /// Largest error of deviations, mm.
    pub(crate) uncertainty: f64,
    /// Largest distance of a cutter on a pass from the surface, mm.
    pub(crate) tolerance: f64,
}

/// Compares cusps along a program, of each head with its own passes; `None` if the cutter is
/// nowhere on the surface, or its positions are unknown.
pub(crate) fn cusps(program: &ReadProgram, heads: &[&VirtualSetup<'_>], scene: &CuspScene<'_>) -> Option<CuspReport> {
    let touched = TouchedSurface { surface: scene.part, allowances: scene.allowances, tolerance: scene.tolerance };
    let of_heads: Vec<_> = heads.iter().map(|at| passes_of_text(program, at, &touched)).collect();
    let mut all: Vec<(usize, usize, usize)> = Vec::new();
    for (h, runs) in of_heads.iter().enumerate() {
        all.extend(runs.iter().enumerate().flat_map(|(r, run)| (0..run.len()).map(move |k| (h, r, k))));
    }
    if all.is_empty() {
        return None;
    }
    let boxes_of = |run: &Vec<_>| Aabb::of_points(run.iter().map(|p: &CutPoint| &p.cc.position));
    let boxes: Vec<Vec<Aabb>> = of_heads.iter().map(|runs| runs.iter().map(boxes_of).collect()).collect();
    let drawn = sample(all.len());
    let compare = |k: &usize| {
        let (head, run, point) = all[*k];
        scene.compared(heads[head].tool.cutter(), &of_heads[head], &boxes[head], run, point)
    };
    let found: Vec<Compared> = drawn.par_iter().map(compare).collect();
    let mut report = CuspReport { sampled: drawn.len(), ..CuspReport::default() };
    let mut ratios = Vec::new();
    for compared in found {
        match compared {
            Compared::Not(why) => count(&mut report.not_compared, why),
            Compared::Uncut => report.uncut += 1,
            Compared::Heights { predicted, measured } => {
                ratios.push(measured / predicted);
                report.largest_predicted_mm = report.largest_predicted_mm.max(predicted);
                report.largest_measured_mm = report.largest_measured_mm.max(measured);
            }
        }
    }
    report.compared = ratios.len();
    report.ratio = quantiles(ratios);
    Some(report)
}

/// Returns indices below `n`: all if they are few, else a sample by a generator of constant seed
/// (Knuth's MMIX).
fn sample(n: usize) -> Vec<usize> {
    if n <= SAMPLES {
        return (0..n).collect();
    }
    let mut state = 1_u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(state) * n as u128) >> 64) as usize
    };
    (0..SAMPLES).map(|_| draw()).collect()
}

fn quantiles(mut ratios: Vec<f64>) -> Option<CuspRatios> {
    ratios.sort_by(f64::total_cmp);
    let last = ratios.len().checked_sub(1)?;
    let at = |share: f64| ratios[(share * last as f64).round() as usize];
    Some(CuspRatios { lowest: at(0.0), p5: at(0.05), median: at(0.5), p95: at(0.95), highest: at(1.0) })
}

fn count(of: &mut CuspsNotCompared, why: Why) {
    *match why {
        Why::NoNeighbour => &mut of.no_neighbour,
        Why::TooClose => &mut of.too_close,
        Why::BesideAnEnd => &mut of.beside_an_end,
        Why::TooLow => &mut of.too_low,
        Why::NotMeasured => &mut of.not_measured,
    } += 1;
}

/// Reason why a place is not compared, as [`CuspsNotCompared`] counts.
pub(crate) enum Why {
    NoNeighbour,
    TooClose,
    BesideAnEnd,
    TooLow,
    NotMeasured,
}

/// Result of one place.
enum Compared {
    Not(Why),
    Uncut,
    Heights { predicted: f64, measured: f64 },
}

impl CuspScene<'_> {
    fn compared(&self, cutter: &Cutter, runs: &[Vec<CutPoint>], boxes: &[Aabb], run: usize, point: usize) -> Compared {
        let (own, reach) = (runs[run][point], 3.0 * cutter.radius());
        let here = own.cc.position;
        let beside = (0..runs.len()).filter(|&r| r != run && boxes[r].distance_sq(&here) <= reach * reach);
        let distance = |p: &CutPoint| (p.cc.position - here).norm();
        let apart = beside.clone().flat_map(|r| &runs[r]).map(distance).fold(f64::INFINITY, f64::min);
        let ridges = beside.filter_map(|r| Some((r, ridges(cutter, &[own], &runs[r], reach)[0]?)));
        let nearest = ridges.min_by(|a, b| a.1.step_over.total_cmp(&b.1.step_over));
        let Some((neighbour, ridge)) = nearest else { return Compared::Not(Why::NoNeighbour) };
        if ridge.step_over < CELLS_ACROSS * self.cell {
            return Compared::Not(Why::TooClose);
        }
        // If a point of another pass is nearer, that pass ends beside this point, and the ridge is
        // not a neighbour's.
        if ridge.step_over > NEIGHBOUR * apart {
            return Compared::Not(Why::BesideAnEnd);
        }
        let predicted = match ridge.cusp {
            Cusp::Uncut => return Compared::Uncut,
            Cusp::Height(h) if h < 2.0 * self.uncertainty => return Compared::Not(Why::TooLow),
            Cusp::Height(h) => h,
        };
        let Some(toward) = runs[neighbour].iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return Compared::Not(Why::NoNeighbour);
        };
        let left = own.cc.left().into_inner();
        let across = left * (ridge.step_over * left.dot(&(toward.cc.position - here)).signum());
        match self.highest(&here, &across) {
            Some(measured) => Compared::Heights { predicted, measured },
            None => Compared::Not(Why::NotMeasured),
        }
    }

    /// Returns the greatest height above the surface on the path across from a point of it.
    fn highest(&self, from: &Point3<f64>, across: &Vector3<f64>) -> Option<f64> {
        let width = across.norm();
        let steps = (2.0 * width / self.cell).ceil().max(1.0) as usize;
        let places = (0..=steps).filter_map(|k| {
            let point = from + across * (k as f64 / steps as f64);
            let foot = self.part.closest_point(&point, width)?;
            let normal = self.part.facet_normal(foot.triangle)?;
            let place = self.found.near(&foot.position, &normal)?;
            let height = place.deviation - self.allowances[place.triangle as usize];
            height.is_finite().then_some(height)
        });
        places.reduce(f64::max)
    }
}
