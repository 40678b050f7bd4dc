//! Prints a table of strategies × parts as Markdown: of all parts, or of those whose names
//! contain one of the arguments.

use std::process::ExitCode;

use facemill_tests::tables::strategy_table::{compare, heading, parts, rows};

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    print!("{}", heading());
    for (name, job) in parts() {
        if !wanted.is_empty() && wanted.iter().all(|w| !name.contains(w)) {
            continue;
        }
        eprintln!("{name}");
        let Some(job) = job() else { continue };
        compare(&job, |compared| print!("{}", rows(&name, compared)));
    }
    ExitCode::SUCCESS
}
