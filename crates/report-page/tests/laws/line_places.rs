//! The page's script names lines as they are written.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

#[test]
fn lines_of_a_program_with_subprograms_are_those_of_the_written_files() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/line_places.mjs");
    let Ok(output) = Command::new("node").arg(script).output() else {
        println!("skipped: node is not installed");
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(said["places"], json!(["main.nc 1", "main.nc 4", "O2.nc 3", "O2.nc 5", "main.nc 6", "main.nc 18"]));
    assert_eq!(said["flat"], json!([null, null, "file line 3", "file lines 3 to 4"]));
    assert_eq!(said["one"], "O2.nc line 4");
    assert_eq!(said["ranges"], json!(["O2.nc line 3 to 5", "main.nc line 4 to O2.nc line 3"]));
}
