//! Plans of both sides of every blade of the shared data.

use std::ops::Range;

use facemill::new_job::NewJob;
use facemill::{Failure, Job, PlanSettings, Planned, SilentStages, plan_setup};
use serde_json::json;

use crate::jobs::JobFolder;
use crate::shared::shared;

/// Blades of the shared data: their `.inf` files below `data/blades`.
pub const BLADES: [&str; 2] = ["rotor37/BladeGen.inf", "hannover_rotor1/1_Rotor1_Blade.inf"];

/// Plan of one side of a blade.
pub struct BladeOutcome {
    /// Blade by its `.inf` file.
    pub file: &'static str,
    /// Whether the hub is in the mesh.
    pub hub: bool,
    /// Name of the setup.
    pub side: String,
    /// The plan, or why there is none.
    pub result: Result<Planned, Failure>,
}

/// Plans both sides of a blade as `facemill new blade` writes its job, with passes `spread` times
/// as far apart; nothing where the shared data is absent.
///
/// # Panics
/// When the blade has no job.
pub fn sides(file: &'static str, hub: bool, spread: f64) -> Vec<BladeOutcome> {
    chosen_passes(file, hub, &ChosenPasses { sides: 0..2, spread, band_mm: None })
}

/// Lays the passes of an operation of a blade's job `spread` times as far apart.
///
/// # Panics
/// When the job is not that of a blade.
pub fn spread_passes(folder: &JobFolder, operation: usize, spread: f64) {
    let key = |name: &str| format!("/operations/{operation}/{name}");
    let step = folder.json("job.json").pointer(&key("tolerances/max_step_over_mm")).and_then(|v| v.as_f64());
    folder.set(
        "job.json",
        &[
            (&key("tolerances/max_step_over_mm"), json!(spread * step.expect("a step"))),
            // No pass is to be added for what is left between.
            (&key("tolerances/cusp_mm"), json!(5.0)),
            (&key("path/strategy/width_rounds"), json!(0)),
        ],
    );
}

/// Limits an operation of a blade's job to a band of a width, mm, along the span in the middle of
/// its side, without rounds of widths.
///
/// # Panics
/// When the job is not that of a blade.
pub fn take_band(folder: &JobFolder, operation: usize, width: f64) {
    let key = |name: &str| format!("/operations/{operation}/path/strategy/{name}");
    let seed = folder.json("job.json").pointer(&key("strategy/constant_scallop/seed/plane")).cloned().expect("a seed");
    let mut planes = seed;
    (planes["from_mm"], planes["to_mm"]) = (json!(-0.5 * width), json!(0.5 * width));
    let within = json!({ "parallel_planes": planes });
    folder.set("job.json", &[(&key("strategy/constant_scallop/within"), within), (&key("width_rounds"), json!(0))]);
}

/// Passes of a blade's sides that are planned.
pub struct ChosenPasses {
    /// Numbers of the sides.
    pub sides: Range<usize>,
    /// Factor of the distance between passes.
    pub spread: f64,
    /// Width of the band along the middle of a side, mm, of which they are alone, without cutting
    /// the stock; else all are planned.
    pub band_mm: Option<f64>,
}

/// Plans sides of a blade as [`sides`] does, with some of their passes.
///
/// # Panics
/// When the blade has no job.
pub fn chosen_passes(file: &'static str, hub: bool, chosen: &ChosenPasses) -> Vec<BladeOutcome> {
    let spread = chosen.spread;
    let Some(from) = shared(&format!("data/blades/{file}")) else { return Vec::new() };
    let folder = JobFolder::new(&NewJob::Blade { from, scale: 1.0, hub });
    if spread > 1.0 {
        (0..2).for_each(|side| spread_passes(&folder, side, spread));
    }
    if let Some(band) = chosen.band_mm {
        folder.set("job.json", &[("/verification", json!({ "cut_stock": false }))]);
        for side in 0..2 {
            take_band(&folder, side, band);
        }
    }
    let job = Job::read(&folder.job()).expect("a job");
    let settings = || PlanSettings { verify: true, certificates: false };
    chosen
        .sides
        .clone()
        .map(|k| BladeOutcome {
            file,
            hub,
            side: job.file.setups[k].name.clone(),
            result: plan_setup(&job, k, settings(), &SilentStages),
        })
        .collect()
}

/// The table of outcomes as Markdown.
pub fn markdown(outcomes: &[BladeOutcome]) -> String {
    let mut text = String::from(
        "| blade | hub | side | triangles | CC points | planned | passes, m | cuts, min | rapids, min | largest gouge / \
         budget, mm | findings |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for o in outcomes {
        let hub = if o.hub { "with" } else { "without" };
        let start = format!("| {} | {hub} | {} |", o.file, o.side);
        match &o.result {
            Err(why) => {
                // The folder the job was in is of no interest.
                let why = why.to_string().rsplit('/').next().unwrap_or_default().replace('|', "/");
                text += &format!("{start} | | | | | | | {why} |\n");
            }
            Ok(planned) => {
                let report = &planned.report;
                // Drive surface and part are of one file, which is listed once.
                let part = report.meshes.last().and_then(|mesh| mesh.repair.get("n_triangles_in"));
                let triangles = part.map_or(String::new(), ToString::to_string);
                text += &format!(
                    "{start} {triangles} | {} | {:.2} % | {:.2} | {:.1} | {:.1} | {:.3} / {:.3} | {} |\n",
                    report.totals.cc_points,
                    100.0 * report.totals.planned_fraction,
                    report.totals.passes_length_mm / 1000.0,
                    report.times.cutting_s.unwrap_or(report.times.constant_cutting_s) / 60.0,
                    report.times.rapid_s.unwrap_or(report.times.constant_rapid_s) / 60.0,
                    report.worst.gouge_mm.unwrap_or(0.0),
                    report.budgets[0].against_mesh_mm,
                    if report.findings.is_empty() { "none".to_owned() } else { report.findings.len().to_string() },
                );
            }
        }
    }
    text
}
