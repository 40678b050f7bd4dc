//! Writes the tables of keys in `docs/formats.md` anew from the schemas in `docs/schemas`.

use std::process::ExitCode;

use facemill_tests::shared::workspace;
use facemill_tests::tables::key_tables::KeyTables;

fn main() -> ExitCode {
    let docs = workspace().join("docs");
    let path = docs.join("formats.md");
    let written = std::fs::read_to_string(&path)
        .map_err(|e| e.to_string())
        .and_then(|page| KeyTables::new(&docs, &page)?.rewritten(&page))
        .and_then(|page| std::fs::write(&path, page).map_err(|e| e.to_string()));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{}: {fault}", path.display());
            ExitCode::FAILURE
        }
    }
}
