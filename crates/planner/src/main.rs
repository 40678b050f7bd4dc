//! The `facemill` command.

use std::process::ExitCode;

use clap::Parser;

mod chip_area_command;
mod cli;
mod deviation_command;
mod feedrate_command;
mod findings_table;
mod forecast;
mod lengths_command;
mod machine_commands;
mod new_command;
mod option_lengths;
mod plan_command;
mod program_arguments;
mod progress;
mod rapids_command;
mod stand_arguments;
mod verify_command;

fn main() -> ExitCode {
    facemill_job::files::guard_inputs();
    match cli::run(cli::Arguments::parse()) {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("facemill: {failure}");
            failure.exit_code()
        }
    }
}
