//! Compares the figures of the sample job in the pages with the summary of its plan, or writes them
//! anew:
//!
//! ```text
//! cargo run --release -- plan assets/propeller/job.json > target/sample-summary.txt
//! cargo run -p facemill-tests --bin sample-figures -- target/sample-summary.txt --write
//! ```

use std::process::ExitCode;

use facemill_tests::shared::workspace;
use facemill_tests::tables::sample_figures::{PAGES, RECORD, SampleFigures};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (paths, options): (Vec<&String>, Vec<&String>) = arguments.iter().partition(|a| !a.starts_with("--"));
    let result = match (&paths[..], &options[..]) {
        ([summary], []) => compare(summary),
        ([summary], [write]) if *write == "--write" => write_all(summary),
        _ => Err("arguments: the file with the summary of the sample's plan, and --write to store it".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("sample-figures: {fault}");
            ExitCode::FAILURE
        }
    }
}

fn read(path: &str) -> Result<SampleFigures, String> {
    std::fs::read_to_string(path).map(|text| SampleFigures::of_summary(&text)).map_err(|e| format!("{path}: {e}"))
}

fn compare(summary: &str) -> Result<(), String> {
    let (planned, stored) = (read(summary)?, SampleFigures::stored()?);
    match planned.first_difference(&stored) {
        None => Ok(()),
        Some([planned, stored]) => Err(format!(
            "the plan differs from {RECORD}, and so from the pages; write them anew with --write\n  planned {planned}\n  stored  {stored}"
        )),
    }
}

fn write_all(summary: &str) -> Result<(), String> {
    let figures = read(summary)?;
    for name in PAGES {
        let path = workspace().join(name);
        let page = std::fs::read_to_string(&path).map_err(|e| format!("{name}: {e}"))?;
        let page = figures.rewritten(&page).map_err(|e| format!("{name}: {e}"))?;
        std::fs::write(&path, page).map_err(|e| format!("{name}: {e}"))?;
    }
    std::fs::write(workspace().join(RECORD), figures.text()).map_err(|e| format!("{RECORD}: {e}"))
}
