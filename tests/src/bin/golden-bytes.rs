//! Compares the bytes of what the golden jobs give with `tests/golden-bytes.txt`: for changes that
//! may alter nothing.
//!
//! `golden-bytes [FOLDER]` compares, and copies all files to the folder; `golden-bytes --write`
//! writes the table anew.

use std::path::Path;
use std::process::ExitCode;

use facemill_tests::golden::golden_bytes;
use facemill_tests::shared::workspace;

fn main() -> ExitCode {
    let argument = std::env::args().nth(1);
    if argument.as_ref().is_some_and(|a| a.starts_with('-') && a != "--write") {
        eprintln!("golden-bytes [FOLDER | --write]");
        return ExitCode::from(2);
    }
    let table = workspace().join("tests/golden-bytes.txt");
    let keep = argument.as_deref().filter(|a| *a != "--write").map(Path::new);
    let lines = golden_bytes(keep);
    if argument.as_deref() == Some("--write") {
        std::fs::write(&table, lines.join("\n") + "\n").expect("a table that can be written");
        return ExitCode::SUCCESS;
    }
    let known = std::fs::read_to_string(&table).expect("tests/golden-bytes.txt");
    let known: Vec<&str> = known.lines().collect();
    let missing = known.iter().filter(|line| !lines.iter().any(|l| l == *line));
    let other = lines.iter().filter(|line| !known.contains(&line.as_str()));
    let changes: Vec<String> = missing.map(|l| format!("- {l}")).chain(other.map(|l| format!("+ {l}"))).collect();
    changes.iter().for_each(|line| println!("{line}"));
    println!("{} files, {} lines of the table differ", lines.len(), changes.len());
    if changes.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
