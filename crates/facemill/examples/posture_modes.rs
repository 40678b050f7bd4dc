//! The sample job by cylinders with its postures chosen in each mode: the table of
//! docs/benchmarks.md.
//!
//! `cargo run --release -p facemill --example posture_modes`

use std::error::Error;
use std::path::Path;

use facemill::{Job, PlanSettings, SilentStages, plan_setup};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/propeller");
    let modes = [
        ("smallest", json!("smallest")),
        ("smooth", json!("smooth")),
        ("fixed, lead 6°", json!({ "fixed": { "lead_deg": 6 } })),
        ("toward (1200, -2100, 3600)", json!({ "toward": { "point": { "position_mm": [1200, -2100, 3600] } } })),
    ];
    println!(
        "| mode | planned | reversals B, C | largest acceleration B, C, deg/s² | root mean square, deg/s² | cusp | blocks | cutting time |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, mode) in modes {
        let folder = tempfile::tempdir()?;
        for entry in std::fs::read_dir(&sample)? {
            let entry = entry?;
            std::fs::copy(entry.path(), folder.path().join(entry.file_name()))?;
        }
        let path = folder.path().join("job-cylinders.json");
        let mut job: Value = serde_json::from_slice(&std::fs::read(&path)?)?;
        job["operations"][0]["search"]["mode"] = mode;
        // Modes of one posture or none leave out points as they must.
        job["operations"][0]["infeasible"] = json!({ "trim": { "max_trimmed_fraction": 1.0 } });
        std::fs::write(&path, serde_json::to_vec(&job)?)?;
        let settings = PlanSettings { verify: false, certificates: false };
        let report = match plan_setup(&Job::read(&path)?, 0, settings, &SilentStages) {
            Ok(planned) => planned.report,
            Err(why) => {
                println!("| {name} | none: {why} |||||||");
                continue;
            }
        };
        let rotary = &report.postures[0].rotary;
        let both = |value: &dyn Fn(usize) -> String| format!("{}, {}", value(0), value(1));
        println!(
            "| {name} | {:.2} % | {} | {} | {} | {:.3} mm | {} | {:.0} s |",
            100.0 * report.totals.planned_fraction,
            both(&|k| rotary[k].reversals.to_string()),
            both(&|k| format!("{:.1}", rotary[k].largest_acceleration_deg_s2)),
            both(&|k| format!("{:.2}", rotary[k].mean_acceleration_deg_s2)),
            report.worst.cusp_mm.unwrap_or(f64::NAN),
            report.totals.blocks,
            report.totals.passes_time_s,
        );
    }
    Ok(())
}
