//! `facemill new`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand, ValueEnum};
use facemill::nc_program::Dialect;
use facemill::new_job::{NewJob, Series, as_read};
use facemill::{Failure, files, new_job_for};

use crate::cli::arguments::dialect::dialect;
use crate::cli::arguments::option_lengths::{above_zero, rotor_scale};
use crate::cli::output::say;

#[derive(Args)]
pub(crate) struct NewArguments {
    #[command(subcommand)]
    part: NewPart,
    /// Machine of the job; the part is mounted within its reach. Default: the example's own
    #[arg(long, value_name = "NAME", global = true, value_parser = facemill::inverse_kinematics::preset_names())]
    machine: Option<String>,
    /// Control of the job; default: fanuc
    #[arg(long, value_name = "NAME", global = true, value_parser = dialect)]
    dialect: Option<Dialect>,
}

#[derive(Subcommand)]
pub(crate) enum NewPart {
    /// A marine propeller, its suction side up
    Propeller {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Table of a propeller of your own (CSV, JSON, or the geometry table of OpenProp)
        #[arg(long, value_name = "FILE", conflicts_with_all = ["series", "blades", "area_ratio", "pitch_ratio"])]
        table: Option<PathBuf>,
        /// Series
        #[arg(long, default_value = "dtmb4119")]
        series: SeriesName,
        /// Diameter; default: 3048, or that of the table. A table with another one is scaled to it;
        /// lengths of a table without one are those at this diameter
        #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: Option<f64>,
        /// Number of blades (Wageningen B only; default: 4)
        #[arg(long, value_name = "N")]
        blades: Option<u32>,
        /// Expanded area ratio (Wageningen B only; default: 0.55)
        #[arg(long, value_name = "RATIO")]
        area_ratio: Option<f64>,
        /// Pitch ratio (Wageningen B only; default: 1)
        #[arg(long, value_name = "RATIO")]
        pitch_ratio: Option<f64>,
    },
    /// A marine propeller on a mill with two heads, both sides at once
    PropellerDual {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Diameter
        #[arg(long, value_name = "MM", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: f64,
    },
    /// A marine propeller from its casting, one side of its blades after the other up
    PropellerCast {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Diameter
        #[arg(long, value_name = "MM", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: f64,
    },
    /// A marine propeller from its casting with three tools: sides, roots, hub, fillets, edges,
    /// tips
    PropellerWhole {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Blades that are machined, from the first on; default: all
        #[arg(long, value_name = "N")]
        blades: Option<usize>,
        /// Diameter
        #[arg(long, value_name = "MM", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = above_zero)]
        diameter_mm: f64,
    },
    /// A wavy sculptured patch
    Patch {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Length of its sides
        #[arg(long, value_name = "MM", default_value_t = 400.0, allow_negative_numbers = true, value_parser = above_zero)]
        size_mm: f64,
    },
    /// The blade of NASA Rotor 37
    Rotor37 {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Scale; 1 is the real compressor
        #[arg(long, value_name = "FACTOR", default_value_t = 10.0, allow_negative_numbers = true, value_parser = rotor_scale)]
        scale: f64,
    },
    /// A blade from a BladeGen or TurboGrid description, one side after the other up
    Blade {
        /// Folder to write to; it must be empty or not exist
        dir: PathBuf,
        /// Description (.inf); its hub, shroud and profile files are below its folder
        #[arg(long, value_name = "FILE")]
        from: PathBuf,
        /// Scale; 1 is the size in the file
        #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = rotor_scale)]
        scale: f64,
        /// Add the sector of the hub around the blade, which tools keep clear of
        #[arg(long)]
        hub: bool,
    },
}

/// Diameter of a propeller of a series.
const DIAMETER_MM: f64 = 3048.0;

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum SeriesName {
    Dtmb4119,
    Dtmb4382,
    Vp1304,
    WageningenB,
}

/// Writes an example into a folder.
///
/// # Errors
/// If the numbers describe no part, or the folder is not empty or cannot be written.
pub(crate) fn run(arguments: NewArguments) -> Result<ExitCode, Failure> {
    let (dir, job) = match arguments.part {
        NewPart::Propeller { dir, table: Some(table), diameter_mm, .. } => {
            (dir, NewJob::OwnPropeller { table, diameter_mm })
        }
        NewPart::Propeller { dir, table: None, series, diameter_mm, blades, area_ratio, pitch_ratio } => {
            let diameter_mm = diameter_mm.unwrap_or(DIAMETER_MM);
            let series = match series {
                SeriesName::Dtmb4119 => Series::Dtmb4119,
                SeriesName::Dtmb4382 => Series::Dtmb4382,
                SeriesName::Vp1304 => Series::Vp1304,
                SeriesName::WageningenB => Series::WageningenB {
                    blades: blades.unwrap_or(4),
                    area_ratio: area_ratio.unwrap_or(0.55),
                    pitch_ratio: pitch_ratio.unwrap_or(1.0),
                },
            };
            let given = blades.is_some() || area_ratio.is_some() || pitch_ratio.is_some();
            if given && !matches!(series, Series::WageningenB { .. }) {
                let message = "--blades, --area-ratio and --pitch-ratio belong to --series wageningen-b; the others have \
                               their own";
                return Err(Failure::Input { file: dir, message: message.to_owned() });
            }
            (dir, NewJob::Propeller { series, diameter_mm })
        }
        NewPart::PropellerDual { dir, diameter_mm } => (dir, NewJob::DualPropeller { diameter_mm }),
        NewPart::PropellerCast { dir, diameter_mm } => (dir, NewJob::CastPropeller { diameter_mm }),
        NewPart::PropellerWhole { dir, blades, diameter_mm } => (dir, NewJob::WholePropeller { diameter_mm, blades }),
        NewPart::Patch { dir, size_mm } => (dir, NewJob::Patch { size_mm }),
        NewPart::Rotor37 { dir, scale } => (dir, NewJob::Rotor37 { scale }),
        NewPart::Blade { dir, from, scale, hub } => (dir, NewJob::Blade { from, scale, hub }),
    };
    let written = new_job_for(&job, arguments.machine.as_deref(), arguments.dialect)
        .map_err(|message| fault_of(&job, &dir, message))?;
    let occupied = std::fs::read_dir(&dir).is_ok_and(|mut entries| entries.next().is_some());
    if occupied {
        return Err(Failure::input(&dir, "the folder is not empty; name a new one"));
    }
    // What is no file, such as a pipe, can be read only once.
    let is_file = |job: &NewJob| match job {
        NewJob::OwnPropeller { table: file, .. } | NewJob::Blade { from: file, .. } => file.is_file(),
        _ => true,
    };
    let text = if is_file(&job) { as_read(&job) } else { Ok(None) };
    let text = text.map_err(|message| fault_of(&job, &dir, message))?;
    files::write_all(&dir, &written)?;
    let names: Vec<&str> = written.iter().map(|(n, _)| n.as_str()).collect();
    say(&format!("{}: {}\n", dir.display(), names.join(", ")))?;
    if let Some(text) = text.or_else(|| job_name(&written).filter(|_| matches!(job, NewJob::Blade { .. }))) {
        say(&format!("as read: {text}\n"))?;
    }
    say(&format!("plan it with: facemill plan {}\n", dir.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the fault of a job: of the file that describes the part, which most messages begin with,
/// or of the folder where there is none.
fn fault_of(job: &NewJob, dir: &Path, message: String) -> Failure {
    let file = match job {
        NewJob::OwnPropeller { table: file, .. } | NewJob::Blade { from: file, .. } => file,
        _ => return Failure::Input { file: dir.to_owned(), message },
    };
    let name = file.display().to_string();
    let of_file = message.strip_prefix(&name);
    let rest = of_file.and_then(|rest| rest.strip_prefix(": ").or_else(|| rest.strip_prefix(", ")));
    let unread = message.strip_prefix(&format!("cannot read {name}: ")).map(|why| format!("cannot be read: {why}"));
    Failure::input(file, unread.as_deref().or(rest).unwrap_or(&message))
}

/// Name in the job file: says what was read of a file.
fn job_name(written: &[(String, Vec<u8>)]) -> Option<String> {
    let (_, job) = written.iter().find(|(name, _)| name == "job.json")?;
    let job: serde_json::Value = serde_json::from_slice(job).ok()?;
    Some(job["name"].as_str()?.to_owned())
}
