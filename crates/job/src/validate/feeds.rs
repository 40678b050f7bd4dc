//! Checks of feeds that depend on chips.

use facemill_inverse_kinematics::FeedRange;

use crate::format::job_file::{FeedsFile, JobFile, OperationFile, RoleFile, StockFile};
use crate::validate::Field;
use crate::validate::setup_names::belongs;
use crate::validate::tip_feed::{depends_on_chips, teeth_per_minute};

/// Checks the chip-dependent feeds of an operation against each other.
///
/// # Errors
/// If a feed is not above 0, or would have no effect or the opposite one.
pub fn check_feed_laws(at: &Field, feeds: &FeedsFile) -> Result<(), String> {
    let cutting = feeds.cutting_mm_min;
    if let Some(removal) = &feeds.removal_rate {
        at.positive("feeds.removal_rate.target_cm3_min", removal.target_cm3_min)?;
        at.positive("feeds.removal_rate.min_mm_min", removal.min_mm_min)?;
        if removal.min_mm_min > cutting {
            return Err(format!(
                "{}.feeds.removal_rate.min_mm_min: is {}, but feeds.cutting_mm_min, from which the feed is lowered, is \
                 {cutting}; give a smaller one",
                at.0, removal.min_mm_min
            ));
        }
    }
    if let Some(thickness) = &feeds.chip_thickness {
        at.positive("feeds.chip_thickness.max_mm", thickness.max_mm)?;
    }
    if let Some(turn) = feeds.turn_mm_min {
        at.positive("feeds.turn_mm_min", turn)?;
    }
    if let Some(air) = feeds.air_mm_min {
        at.positive("feeds.air_mm_min", air)?;
        if air < cutting {
            return Err(format!(
                "{}.feeds.air_mm_min: is {air}, less than feeds.cutting_mm_min, {cutting}; where nothing is cut the tool \
                 need not be slower: give a larger one, or leave it out",
                at.0
            ));
        }
    }
    Ok(())
}

/// Smallest feed that a program or an APT file can express, mm/min.
const SMALLEST_FEED: f64 = 1e-3;

/// Checks the chip thicknesses of a tool's operations against the smallest F of the control, with
/// the inserts of its tool: the chip thickness never exceeds the feed per tooth, so at equality the
/// control must accept the feed.
///
/// # Errors
/// If a thickness requires less; the message has the least that works.
pub fn check_chip_thickness(
    job: &JobFile,
    is_of: &dyn Fn(&OperationFile) -> bool,
    teeth: u32,
    range: &FeedRange,
) -> Result<(), String> {
    let slowest = range.min.max(SMALLEST_FEED);
    for (k, o) in job.operations.iter().enumerate().filter(|(_, o)| is_of(o)) {
        let Some(thickness) = &o.feeds.chip_thickness else { continue };
        let least = slowest / teeth_per_minute(&o.feeds, teeth);
        if thickness.max_mm < least {
            return Err(format!(
                "operations[{k}].feeds.chip_thickness.max_mm: is {:e}, which may require a feed below {slowest} mm/min, the \
                 smallest F of the machine's control: with {teeth} inserts at {} 1/min give at least {:e}",
                thickness.max_mm,
                o.feeds.spindle_rpm,
                rounded_up(least)
            ));
        }
    }
    Ok(())
}

/// Rounds a number above 0 up to two digits.
fn rounded_up(value: f64) -> f64 {
    let unit = 10f64.powi(value.log10().floor() as i32 - 1);
    // Digits rather than a product, which could round below the value.
    let up = |units: f64| format!("{units}e{}", unit.log10().round() as i32).parse().unwrap_or(value);
    let units = (value / unit).ceil();
    if up(units) >= value { up(units) } else { up(units + 1.0) }
}

/// Returns the feeds that depend on chips, by key.
pub fn feeds_of_chips(feeds: &FeedsFile) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let smallest = feeds.removal_rate.as_ref().map(|r| ("removal_rate.min_mm_min", r.min_mm_min));
    smallest.into_iter().chain(feeds.air_mm_min.map(|air| ("air_mm_min", air)))
}

/// Checks that there is stock where feeds depend on chips: without stock, everything would be air.
///
/// # Errors
/// If there is none above the drive surface.
pub fn check_stock_to_cut(k: usize, operation: &OperationFile, job: &JobFile) -> Result<(), String> {
    if !depends_on_chips(&operation.feeds) {
        return Ok(());
    }
    for (j, setup) in job.setups.iter().enumerate().filter(|(_, s)| belongs(operation, s, job)) {
        let left = setup.meshes.iter().find(|m| m.role == RoleFile::Drive).map_or(0.0, |m| m.allowance_mm);
        let left = left + operation.allowance_mm;
        if let StockFile::Offset(stock) = &setup.stock
            && stock.allowance_mm <= left
        {
            return Err(format!(
                "operations[{k}].feeds: depend on the chips, but setups[{j}].stock.offset.allowance_mm, {}, leaves nothing \
                 to cut above the drive surface, whose allowance_mm is {left}; say how thick the stock is",
                stock.allowance_mm
            ));
        }
    }
    Ok(())
}
