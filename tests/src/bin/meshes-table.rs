//! Prints `docs/meshes.md`: what becomes of every shared mesh.

use std::process::ExitCode;

fn main() -> ExitCode {
    let outcomes =
        facemill_tests::tables::meshes::outcomes(&facemill_tests::tables::meshes::CASES.map(|c| c.file), 1.0);
    if outcomes.is_empty() {
        return ExitCode::FAILURE;
    }
    print!("{}", facemill_tests::tables::meshes::markdown(&outcomes));
    for o in &outcomes {
        let Ok(planned) = &o.result else { continue };
        for why in &planned.report.infeasible {
            eprintln!("{}: {} points, {}", o.file, why.points, why.reason);
        }
        for why in facemill::formats::incomplete_because(&planned.report) {
            eprintln!("{}: not finished: {why}", o.file);
        }
        for finding in planned.report.findings.iter().take(3) {
            eprintln!("{}: {finding}", o.file);
        }
        eprintln!("{}: {:?}", o.file, planned.timings);
    }
    ExitCode::SUCCESS
}
