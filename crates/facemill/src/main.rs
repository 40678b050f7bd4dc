//! The `facemill` command.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    facemill::files::guard_inputs();
    match cli::run(cli::Arguments::parse()) {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("facemill: {failure}");
            failure.exit_code()
        }
    }
}
