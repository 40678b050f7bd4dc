//! Prints a table of strategies × parts as Markdown: of all parts, or of those whose names
//! contain one of the arguments. With `--only TEXT` it has only strategies whose names contain it.

use std::process::ExitCode;

use facemill_tests::tables::strategy_table::{compare, heading, parts, rows};

fn main() -> ExitCode {
    let mut wanted: Vec<String> = std::env::args().skip(1).collect();
    let only = match wanted.iter().position(|arg| arg == "--only") {
        Some(at) if at + 1 < wanted.len() => wanted.drain(at..at + 2).nth(1),
        Some(_) => {
            eprintln!("--only needs the text that names of strategies are to contain");
            return ExitCode::from(2);
        }
        None => None,
    };
    print!("{}", heading());
    for (name, job) in parts() {
        if !wanted.is_empty() && wanted.iter().all(|w| !name.contains(w)) {
            continue;
        }
        eprintln!("{name}");
        let Some(job) = job() else { continue };
        compare(&job, only.as_deref(), |compared| print!("{}", rows(&name, compared)));
    }
    ExitCode::SUCCESS
}
