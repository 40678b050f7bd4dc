//! `facemill chip-area`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use facemill::chip_area::Method;
use facemill::chip_area::pass::table::{chips_of_table, table_with_areas};
use facemill::{Failure, files};

use crate::cli::output::say;

#[derive(Args)]
pub(crate) struct ChipAreaArguments {
    /// Cases as comma-separated values, a column for each option below; the output adds the areas.
    /// The first line names the columns, in any order: radius_mm, corner_radius_mm, surface,
    /// depth_of_cut_mm, left and right are required; surface_radius_mm, left_mm, right_mm,
    /// lead_deg, lean_deg, neighbour_axis and name are optional
    #[arg(long, value_name = "FILE", conflicts_with_all = ["radius_mm", "depth_of_cut_mm"])]
    table: Option<PathBuf>,
    /// Output file for the table; default: standard output
    #[arg(short, long, value_name = "FILE", requires = "table")]
    out: Option<PathBuf>,
    /// Radius of the cutter
    #[arg(long, value_name = "MM", required_unless_present = "table", allow_negative_numbers = true)]
    radius_mm: Option<f64>,
    /// Its corner radius: 0 flat, the radius ball, between them bull-nose (round insert)
    #[arg(long, value_name = "MM", default_value_t = 0.0, allow_negative_numbers = true)]
    corner_radius_mm: f64,
    /// The part's surface across the feed: plane, convex, concave
    #[arg(long, value_name = "KIND", default_value = "plane")]
    surface: String,
    /// Radius of a surface that is not plane
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    surface_radius_mm: Option<f64>,
    /// Thickness of the stock
    #[arg(long, value_name = "MM", required_unless_present = "table", allow_negative_numbers = true)]
    depth_of_cut_mm: Option<f64>,
    /// Stock to the left, seen along the feed: stock, cut (by a pass before), border
    #[arg(long, value_name = "WHAT", default_value = "stock")]
    left: String,
    /// Step-over of the cut there, or distance of the border
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    left_mm: Option<f64>,
    /// The same to the right
    #[arg(long, value_name = "WHAT", default_value = "stock")]
    right: String,
    /// Step-over of the cut there, or distance of the border
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    right_mm: Option<f64>,
    /// Inclination of the tool axis along the feed
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    lead_deg: f64,
    /// Inclination of the tool axis across the feed, toward the left
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    lean_deg: f64,
    /// Axis of the neighbouring passes: parallel to this one's, or turned with the surface
    #[arg(long, value_name = "HOW", default_value = "parallel")]
    neighbour_axis: String,
}

pub(crate) fn run(arguments: &ChipAreaArguments) -> Result<ExitCode, Failure> {
    match &arguments.table {
        Some(table) => of_table(table, arguments.out.as_deref()),
        None => of_case(arguments),
    }
}

fn of_table(path: &Path, out: Option<&Path>) -> Result<ExitCode, Failure> {
    let text = String::from_utf8(files::read(path)?).map_err(|_| Failure::input(path, "is not text in UTF-8"))?;
    let table = table_with_areas(&text).map_err(|e| Failure::input(path, e))?;
    let Some(out) = out else {
        say(&table)?;
        return Ok(ExitCode::SUCCESS);
    };
    files::write_one(out, table.into_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Prints one case as a table of one line.
fn of_case(a: &ChipAreaArguments) -> Result<ExitCode, Failure> {
    let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    let columns = [
        ("radius_mm", number(a.radius_mm)),
        ("corner_radius_mm", a.corner_radius_mm.to_string()),
        ("surface", a.surface.clone()),
        ("surface_radius_mm", number(a.surface_radius_mm)),
        ("depth_of_cut_mm", number(a.depth_of_cut_mm)),
        ("left", a.left.clone()),
        ("left_mm", number(a.left_mm)),
        ("right", a.right.clone()),
        ("right_mm", number(a.right_mm)),
        ("lead_deg", a.lead_deg.to_string()),
        ("lean_deg", a.lean_deg.to_string()),
        ("neighbour_axis", a.neighbour_axis.clone()),
    ];
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let cells: Vec<String> = columns.iter().map(|(_, cell)| format!("\"{}\"", cell.replace('"', "\"\""))).collect();
    let table = format!("{}\n{}\n", names.join(","), cells.join(","));
    let rows = chips_of_table(&table).map_err(|e| {
        let option = e.column().map_or_else(|| "arguments".to_owned(), |c| format!("--{}", c.replace('_', "-")));
        Failure::input(Path::new(&option), e.problem())
    })?;
    for row in rows {
        let how = match row.chip.method {
            Method::ClosedForm => "closed form",
            Method::IteratedCrossings => "by formula, crossings iterated",
            Method::Quadrature => "by quadrature",
        };
        say(&format!(
            "{} mm², {how}, at most {:.1e} mm² off\n",
            rounded(row.chip.area, row.chip.error_bound),
            row.chip.error_bound
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Least area written with an exponent, mm²: a square kilometre.
const LARGE: f64 = 1e12;

/// Greatest area written with an exponent, mm²: it would be a row of zeros.
const SMALL: f64 = 1e-4;

/// Largest number of digits of a small area, the leading one included.
const DIGITS: i32 = 6;

/// Largest number of decimals if these are more digits.
const DECIMALS: i32 = 6;

/// Rounds an area to six decimals or six digits, whichever are more, but no finer than its error: a
/// unit of the last digit is at least the bound. An area that is 0 to these digits, or below 0 by
/// no more than its error, is 0.
fn rounded(area: f64, error_bound: f64) -> String {
    let size = area.abs();
    if size == 0.0 || area < 0.0 && size <= error_bound {
        return "0".to_owned();
    }
    let leading = size.log10().floor() as i32;
    // Position of the finest significant digit, as a power of ten.
    let finest = if error_bound > 0.0 { error_bound.log10().ceil() as i32 } else { i32::MIN };
    // An area below that digit's unit becomes one unit, or zero.
    let unit = 10f64.powi(finest);
    if finest > leading && 2.0 * size < unit {
        return "0".to_owned();
    }
    let (area, leading) = if finest > leading { (unit.copysign(area), finest) } else { (area, leading) };
    if !(SMALL..LARGE).contains(&area.abs()) {
        let digits = leading.saturating_sub(finest).clamp(0, DIGITS - 1) as usize;
        return format!("{area:.digits$e}");
    }
    let last = (leading + 1 - DIGITS).min(-DECIMALS).max(finest);
    if last > 0 {
        let unit = 10f64.powi(last);
        return format!("{:.0}", (area / unit).round() * unit);
    }
    let decimals = last.unsigned_abs() as usize;
    format!("{area:.decimals$}")
}

#[cfg(test)]
#[path = "../../tests/unit/cli/chip_area_command.rs"]
mod tests;
