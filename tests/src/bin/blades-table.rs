//! Prints `docs/blades.md`: plans of both sides of every shared blade.

use std::process::ExitCode;

use facemill_tests::tables::blades::{BLADES, markdown, sides};

fn main() -> ExitCode {
    let spread = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(1.0);
    let outcomes: Vec<_> = BLADES.into_iter().flat_map(|file| sides(file, false, spread)).collect();
    if outcomes.is_empty() {
        return ExitCode::FAILURE;
    }
    print!("{}", markdown(&outcomes));
    for o in &outcomes {
        let Ok(planned) = &o.result else { continue };
        for why in &planned.report.infeasible {
            eprintln!("{}, {}: {} points, {}", o.file, o.side, why.points, why.reason);
        }
        for why in facemill::formats::incomplete_because(&planned.report) {
            eprintln!("{}, {}: not finished: {why}", o.file, o.side);
        }
    }
    ExitCode::SUCCESS
}
