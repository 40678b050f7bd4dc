//! Table of strategies × parts as Markdown.

use facemill::formats::ComparedStrategy;
use facemill::new_job::{NewJob, Series};
use facemill::strategies::{CompareRequest, ComparisonSteps, compare_paths, default_strategies};
use facemill::{Failure, Job, PlanSettings, SilentStages};
use serde_json::json;

use crate::jobs::JobFolder;
use crate::shared::shared;
use crate::tables::meshes::{CASES, shared_mesh_job};

/// A part with its job; `None` where its data is absent.
type PartOfTable = (String, Box<dyn Fn() -> Option<JobFolder>>);

/// Parts of the table: those of the product, one blade of each propeller, blades of shared files,
/// and all shared meshes.
pub fn parts() -> Vec<PartOfTable> {
    let example =
        |name: &str, job: NewJob| -> PartOfTable { (name.to_owned(), Box::new(move || Some(JobFolder::new(&job)))) };
    let one_blade = |name: &str, series: Series| -> PartOfTable {
        let job = move || {
            let job = JobFolder::new(&NewJob::Propeller { series, diameter_mm: 3048.0 });
            job.set("job.json", &[("/operations/0/pattern", json!(null))]);
            Some(job)
        };
        (name.to_owned(), Box::new(job))
    };
    let mut parts = vec![
        example("wavy patch, 400 mm", NewJob::Patch { size_mm: 400.0 }),
        one_blade("DTMB 4119, 3048 mm, one blade", Series::Dtmb4119),
        one_blade("VP1304, 3048 mm, one blade", Series::Vp1304),
        example("NASA Rotor 37, 8 : 1", NewJob::Rotor37 { scale: 8.0 }),
    ];
    let blade = |file: &'static str, scale: f64| -> PartOfTable {
        let job = move || {
            let from = shared(&format!("data/blades/{file}"))?;
            Some(JobFolder::new(&NewJob::Blade { from, scale, hub: false }))
        };
        (format!("{file}, {scale} : 1"), Box::new(job))
    };
    parts.extend([blade("rotor37/BladeGen.inf", 8.0), blade("hannover_rotor1/1_Rotor1_Blade.inf", 1.0)]);
    let of_case = |case: &'static crate::tables::meshes::MeshCase| -> PartOfTable {
        (case.file.to_owned(), Box::new(|| shared_mesh_job(case.file)))
    };
    parts.extend(CASES.iter().map(of_case));
    parts
}

/// Rounds of widths of each plan: passes go where the first text leaves more than the cusp.
const ROUNDS: u32 = 2;

/// A part with its strategies in one order, planned without a run; each row as it is there. `only`
/// leaves out strategies whose names do not contain it.
///
/// # Panics
/// When its job cannot be read, or lays no passes.
pub fn compare(job: &JobFolder, only: Option<&str>, row: impl Fn(&ComparedStrategy)) {
    for k in 0..job.file().operations.len() {
        job.set("job.json", &[(&format!("/operations/{k}/path/strategy/width_rounds"), json!(ROUNDS))]);
    }
    let job = Job::read(&job.job()).expect("a job");
    let strategies = default_strategies(&job).expect("passes");
    // The order of levels and one-way or zigzag change times, and hardly passes.
    let is_other_order = |name: &str| name.ends_with("reversed") || name.contains("zigzag");
    let is_wanted = |name: &str| !is_other_order(name) && only.is_none_or(|only| name.contains(only));
    for strategy in strategies.into_iter().filter(|s| is_wanted(&s.name)) {
        let request = CompareRequest {
            strategies: vec![strategy],
            mounting_angles_deg: vec![0.0],
            settings: PlanSettings { verify: false, certificates: false },
            stock_cell: None,
        };
        let result: Result<_, Failure> = compare_paths(&job, &request, &SilentStages, &Lines);
        result.expect("plans or reasons").iter().for_each(&row);
    }
}

/// Names of plans on standard error.
struct Lines;

impl ComparisonSteps for Lines {
    fn begin(&self, _: usize, _: usize, strategy: &str) {
        eprintln!("  {strategy}");
    }
}

/// Heading of the table as Markdown.
pub fn heading() -> String {
    "| part | strategy | passes | length, m | efficiency | over the least floor | cusp p99, mm | largest, mm | never cut | planned | \
     passes + entries, min |\n|---|---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned()
}

/// Rows of a plan of a part as Markdown: one for each setup.
pub fn rows(part: &str, compared: &ComparedStrategy) -> String {
    let number = |value: Option<f64>, decimals: usize| match value {
        Some(value) => format!("{value:.decimals$}"),
        None => "–".to_owned(),
    };
    let mut text = String::new();
    if let Some(why) = &compared.failed {
        // The folder the job was in is of no interest.
        let why = why.rsplit_once("job.json: ").map_or(why.as_str(), |(_, why)| why).replace(['|', '\n'], " ");
        text += &format!("| {part} | {} | no plan: {why} | | | | | | | | |\n", compared.strategy);
    }
    for s in &compared.setups {
        let of_setup = if compared.setups.len() > 1 { format!(", {}", s.setup) } else { String::new() };
        text += &format!(
            "| {part} | {}{of_setup} | {} | {:.2} | {} | {} | {} | {} | {} % | {:.1} % | {:.1} |\n",
            compared.strategy,
            s.passes,
            s.passes_length_mm / 1000.0,
            number(s.efficiency, 3),
            number(s.over_least_floor, 3),
            number(s.cusp_p99_mm, 3),
            number(s.cusp_largest_mm, 3),
            number(s.never_cut_fraction.map(|share| 100.0 * share), 2),
            100.0 * s.planned_fraction,
            (s.passes_time_s + s.approach_time_s) / 60.0
        );
    }
    text
}
