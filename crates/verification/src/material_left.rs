//! Heights left on samples of a surface.

use facemill_cc_path::RegionSample;
use facemill_job::format::report::remaining::RemainingPlace;
use facemill_z_map::{LeftHeight, SurfacePlace, SweptCutter};

/// Largest error of a point of the cutter in the measurement of heights, mm: a tenth of the finest
/// cusps that face mills leave. Smaller: more parts of motions to examine.
pub(crate) const MOTION_TOLERANCE: f64 = 0.002;

/// Largest error of a height, mm.
pub const ACCURACY: f64 = MOTION_TOLERANCE + SweptCutter::ACCURACY;

/// Sample in a place of the pattern.
#[derive(Clone, Copy)]
pub(crate) struct Sampled {
    pub(crate) place: usize,
    pub(crate) sample: RegionSample,
    pub(crate) on: SurfacePlace,
    /// Whether a program before has cut it.
    pub(crate) was_cut: bool,
}

/// Material left on samples.
#[derive(Default)]
pub struct MaterialLeft {
    /// Whether the region is a line without area.
    pub is_line: bool,
    /// Area of each sample, mm², on a line its length, mm; zero for borders and for those around
    /// the largest.
    pub weights: Vec<f64>,
    /// Samples.
    pub on: Vec<SurfacePlace>,
    /// Heights left on them.
    pub left: Vec<LeftHeight>,
    /// Whether programs before have cut them.
    pub was_cut: Vec<bool>,
    /// Stock up to which the operation leaves a place uncut, mm: it cuts what is higher alone
    /// (`region.left_above`, layers).
    pub uncut_up_to: f64,
}

impl MaterialLeft {
    pub(crate) fn new(of: &[Sampled], left: &[LeftHeight]) -> Self {
        let mut measured = Self::default();
        measured.add(of, left);
        measured
    }

    pub(crate) fn add(&mut self, of: &[Sampled], left: &[LeftHeight]) {
        self.is_line |= of.iter().any(|s| s.sample.length > 0.0);
        self.weights.extend(of.iter().map(|s| s.sample.weight()));
        self.on.extend(of.iter().map(|s| s.on));
        self.left.extend(left);
        self.was_cut.extend(of.iter().map(|s| s.was_cut));
    }

    /// Returns the number of samples with an area, or on a line with a length.
    pub fn n_weighted(&self) -> usize {
        self.weights.iter().filter(|&&w| w > 0.0).count()
    }

    /// Returns the approximate distance between samples, mm.
    pub fn spacing(&self) -> f64 {
        let mean = self.weights.iter().sum::<f64>() / self.n_weighted().max(1) as f64;
        if self.is_line { mean } else { mean.sqrt() }
    }

    /// Returns a sample as a place of a report.
    pub(crate) fn place(&self, k: usize) -> RemainingPlace {
        RemainingPlace {
            height_mm: self.left[k].height,
            at_mm: self.on[k].position.into(),
            line: self.left[k].cut_by,
            was_cut: self.was_cut[k] && self.left[k].cut_by.is_none(),
        }
    }

    /// Returns whether no cut reaches a sample and material is left on it that the operation is to
    /// cut.
    pub(crate) fn is_never_cut(&self, k: usize) -> bool {
        self.left[k].cut_by.is_none() && !self.was_cut[k] && self.on[k].stock > ACCURACY.max(self.uncut_up_to)
    }

    /// Returns the indices of the highest samples, the highest first; of equal ones the first.
    pub(crate) fn highest(&self, n: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..self.left.len()).collect();
        all.sort_by(|&a, &b| self.left[b].height.total_cmp(&self.left[a].height));
        all.truncate(n);
        all
    }
}

/// Returns the heights that fractions of the weight (area or length) do not exceed; 0 if there is
/// no weight.
pub fn quantiles<const N: usize>(weights: &[f64], left: &[LeftHeight], shares: [f64; N]) -> [f64; N] {
    let mut sorted: Vec<(f64, f64)> = left.iter().map(|l| l.height).zip(weights.iter().copied()).collect();
    sorted.retain(|(_, weight)| *weight > 0.0);
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = sorted.iter().map(|(_, weight)| weight).sum();
    shares.map(|share| {
        let mut below = 0.0;
        let reached = sorted.iter().find(|(_, each)| {
            below += each;
            below >= share * all
        });
        reached.or(sorted.last()).map_or(0.0, |(height, _)| *height)
    })
}
