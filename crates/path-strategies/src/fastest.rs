//! The compared plan of least time among the complete ones.

use facemill_job::format::job_file::JobFile;
use facemill_job::format::report::outcome::Outcome;
use facemill_job::load::job::Job;
use facemill_job::validate::setup_names::belongs;

use crate::compared::CompareRequest;
use crate::paths_file::{ComparedStrategy, FastestStrategy, PassedOverStrategy, PlannedPasses};

/// Fraction of the CC points by which a plan may leave out more than the job's own: rounding of a
/// count of other points.
const SAME_FRACTION: f64 = 1e-9;

/// Part of a region by which two measures of its size may differ.
const SAME_REGION: f64 = 0.01;

/// Returns the compared plan of least time that cuts the region of the job's own without a fault,
/// and as completely: as the job's own plan, or, if that is not compared or has a fault, as the
/// most complete one; `None` if there is none.
///
/// Of equal times the first counts.
pub fn fastest(job: &Job, request: &CompareRequest, compared: &[ComparedStrategy]) -> Option<FastestStrategy> {
    let given = serde_json::to_value(&job.file).ok();
    let is_given = |row: usize| request.job_of(row).and_then(|file| serde_json::to_value(file).ok()) == given;
    let own = (0..compared.len()).find(|&row| is_given(row)).map(|row| &compared[row]).filter(|c| c.failed.is_none());
    let own = own.filter(|c| is_sound(c));
    let bar = Bar::of(&job.file, own, compared);
    let with_plan = compared.iter().enumerate().filter(|(_, c)| c.failed.is_none());
    let mut all: Vec<(usize, &ComparedStrategy, f64)> = with_plan.map(|(row, c)| (row, c, total_time(c))).collect();
    // Stable: of equal times the first stays first.
    all.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut passed_over = Vec::new();
    for (index, c, total_time_s) in all {
        match bar.why_below(c) {
            Some(reason) => passed_over.push(PassedOverStrategy { index, total_time_s, reason }),
            None => {
                return Some(FastestStrategy {
                    index,
                    strategy: c.strategy.clone(),
                    mounting_angle_deg: c.mounting_angle_deg,
                    total_time_s,
                    job_time_s: own.map(total_time),
                    verified: request.settings.verify,
                    passed_over,
                });
            }
        }
    }
    None
}

fn total_time(compared: &ComparedStrategy) -> f64 {
    compared.setups.iter().map(|s| s.total_time_s).sum()
}

/// Least completeness of a plan.
struct Bar {
    outcome: Outcome,
    setups: Vec<SetupBar>,
}

/// Least completeness of a plan in a setup.
struct SetupBar {
    planned_fraction: f64,
    /// Largest height left, mm: the tolerance, or more if the job's own plan leaves more.
    height: f64,
    /// Whether that height has to be known.
    is_measured: bool,
    /// Largest fraction never cut that a plan without all that the job requires may have.
    never_cut: f64,
    /// Size of the region: area in mm², and length of lines in mm; of the largest where the job has
    /// no plan of its own.
    region: [f64; 2],
}

impl Bar {
    /// Returns the completeness of the job's own plan, or without it the best of all plans without
    /// a fault.
    fn of(job: &JobFile, own: Option<&ComparedStrategy>, compared: &[ComparedStrategy]) -> Self {
        let others: Vec<&ComparedStrategy> = match own {
            Some(own) => vec![own],
            None => compared.iter().filter(|c| c.failed.is_none() && is_sound(c)).collect(),
        };
        let of_setup = |index: usize| {
            let setups = || others.iter().filter_map(|c| c.setups.get(index));
            let known = |of: fn(&PlannedPasses) -> Option<f64>| setups().filter_map(of).reduce(f64::min);
            SetupBar {
                planned_fraction: setups().map(|s| s.planned_fraction).fold(0.0, f64::max),
                height: known(|s| s.cusp_largest_mm).unwrap_or(0.0).max(smallest_tolerance(job, index)),
                is_measured: setups().any(|s| s.cusp_largest_mm.is_some()),
                never_cut: known(|s| s.never_cut_fraction).unwrap_or(0.0),
                region: setups().map(region).fold([0.0, 0.0], |[a, b], [c, d]| [a.max(c), b.max(d)]),
            }
        };
        let setups: Vec<SetupBar> = (0..job.setups.len()).map(of_setup).collect();
        // A plan of the same region that leaves nothing shows that none has to.
        let is_same = |c: &ComparedStrategy| setups.iter().zip(&c.setups).all(|(bar, s)| bar.has_region(s));
        let sound = compared.iter().filter(|c| c.failed.is_none() && is_sound(c) && is_same(c));
        Self { outcome: sound.filter_map(|c| c.outcome).min().unwrap_or(Outcome::Done), setups }
    }

    /// Returns the reason why a plan is less complete; `None` if it is not.
    fn why_below(&self, compared: &ComparedStrategy) -> Option<String> {
        if !is_sound(compared) {
            return Some("its program has faults".to_owned());
        }
        if compared.setups.len() != self.setups.len() {
            return Some("not all setups are planned".to_owned());
        }
        let of_setup = |(bar, s): (&SetupBar, &PlannedPasses)| bar.why_below(s, compared.outcome);
        let by_figures = self.setups.iter().zip(&compared.setups).find_map(of_setup);
        let is_worse = compared.outcome.is_none_or(|outcome| outcome > self.outcome);
        by_figures.or_else(|| is_worse.then(|| "it leaves more than the job permits".to_owned()))
    }
}

/// Returns area, mm², and length of lines, mm, that a plan's operations are to cut.
fn region(planned: &PlannedPasses) -> [f64; 2] {
    [planned.region_area_mm2, planned.region_length_mm].map(|size| size.unwrap_or(0.0))
}

impl SetupBar {
    /// Whether a plan cuts this region: others may be smaller, or not be roughed.
    fn has_region(&self, planned: &PlannedPasses) -> bool {
        let is_same = |(own, other): (f64, f64)| (own - other).abs() <= SAME_REGION * own.max(other);
        self.region.into_iter().zip(region(planned)).all(is_same)
    }

    fn why_below(&self, planned: &PlannedPasses, outcome: Option<Outcome>) -> Option<String> {
        let percent = |share: f64| 100.0 * share;
        if !self.has_region(planned) {
            let ([area, line], [own_area, own_line]) = (region(planned), self.region);
            let (area, own_area) = (area / 100.0, own_area / 100.0);
            return Some(format!(
                "it cuts another region: {area:.1} cm² and lines of {line:.1} mm, in place of {own_area:.1} cm² and {own_line:.1} mm"
            ));
        }
        if planned.planned_fraction < self.planned_fraction - SAME_FRACTION {
            let (own, bar) = (percent(planned.planned_fraction), percent(self.planned_fraction));
            return Some(format!("only {own:.2} % of its points are planned, of {bar:.2} %"));
        }
        match planned.cusp_largest_mm {
            Some(height) if height > self.height => {
                return Some(format!("it leaves {height:.3} mm, more than {:.3} mm", self.height));
            }
            None if self.is_measured => return Some("the material that it leaves is unknown".to_owned()),
            _ => {}
        }
        let never_cut = planned.never_cut_fraction.unwrap_or(0.0);
        (outcome != Some(Outcome::Done) && never_cut > self.never_cut)
            .then(|| format!("it never cuts {:.2} % of the region", percent(never_cut)))
    }
}

fn is_sound(compared: &ComparedStrategy) -> bool {
    compared.outcome != Some(Outcome::Faulty) && compared.setups.iter().all(|s| s.faults == 0)
}

/// Returns the smallest permitted cusp of a setup's operations, mm.
fn smallest_tolerance(job: &JobFile, setup: usize) -> f64 {
    let operations = job.operations.iter().filter(|o| belongs(o, &job.setups[setup], job));
    operations.map(|o| o.tolerances.cusp_mm).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
#[path = "../tests/unit/fastest.rs"]
mod tests;
