//! Shares of a whole propeller's wetted surface that the written programs of a plan leave within
//! +0.12 and -0.06 mm, by points on its mesh and the cutters along the text: `wetted-share
//! JOB-FOLDER PLAN-FOLDER [LEAST]`. Fails where less than LEAST percent of it is within the band.
//!
//! ```text
//! facemill new propeller-whole p8 --blades 1 && facemill plan p8 --out p8-out
//! cargo run --release -p facemill-tests --bin wetted-share -- p8 p8-out
//! ```

use std::path::Path;
use std::process::ExitCode;

use facemill_tests::oracles::wetted::{Band, Share};
use facemill_tests::oracles::whole_plan::{cut_by_plan, points_of_job};

/// Band of the claim, mm.
const BAND: Band = Band { above: 0.12, below: 0.06 };

/// Largest area that a point is for, mm².
const PATCH: f64 = 3.0;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (job, plan, least) = match &arguments[..] {
        [job, plan] => (job, plan, 0.0),
        [job, plan, least] => (job, plan, least.parse().unwrap_or_else(|_| panic!("{least} is no percentage"))),
        _ => {
            eprintln!("wetted-share: arguments: folder of the job, folder of its plan, and the least percentage");
            return ExitCode::FAILURE;
        }
    };
    let mut wetted = points_of_job(Path::new(job), BAND, PATCH);
    let n_places = cut_by_plan(&mut wetted, Path::new(job), Path::new(plan));
    let shares = wetted.shares();
    println!("| group | area, cm² | above 0.12 mm, % | of it farther than 1 mm from a cutter, % | below 0.06 mm, % |");
    println!("|---|---|---|---|---|");
    shares.iter().for_each(row);
    let sum = |of: fn(&Share) -> f64| shares.iter().map(of).sum();
    let all = Share {
        group: "all".to_owned(),
        area: sum(|s| s.area),
        above: sum(|s| s.above),
        uncut: sum(|s| s.uncut),
        below: sum(|s| s.below),
    };
    row(&all);
    let within = 100.0 * (1.0 - (all.above + all.below) / all.area);
    println!("\n{within:.3} % within the band, by {n_places} places of cutters");
    if within >= least { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn row(share: &Share) {
    let percent = |part: f64| 100.0 * part / share.area;
    println!(
        "| {} | {:.1} | {:.3} | {:.3} | {:.3} |",
        share.group,
        0.01 * share.area,
        percent(share.above),
        percent(share.uncut),
        percent(share.below)
    );
}
