//! Writes the job of the hood of 1 m² into a folder.

use std::path::PathBuf;
use std::process::ExitCode;

use facemill::files::write_all;
use facemill_tests::hood::Hood;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("hood-job FOLDER");
        return ExitCode::from(2);
    };
    match write_all(&folder, &Hood::LARGE.files()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("hood-job: {e}");
            ExitCode::from(3)
        }
    }
}
