//! Checks of feeds that depend on chips.

use crate::job_file::{FeedsFile, JobFile, OperationFile, RoleFile, StockFile};
use crate::tip_feed::depends_on_chips;
use crate::validate::{Field, belongs};

/// Feeds of an operation that chips lead to, against each other.
///
/// # Errors
/// When one is not above 0, or where it would have no effect or the opposite one.
pub(crate) fn check_feed_laws(at: &Field, feeds: &FeedsFile) -> Result<(), String> {
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

/// Feeds that chips lead to, by key.
pub(crate) fn feeds_of_chips(feeds: &FeedsFile) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let smallest = feeds.removal_rate.as_ref().map(|r| ("removal_rate.min_mm_min", r.min_mm_min));
    smallest.into_iter().chain(feeds.air_mm_min.map(|air| ("air_mm_min", air)))
}

/// That there is stock where feeds depend on what is cut: without, everything would be air.
///
/// # Errors
/// When there is none above the drive surface.
pub(crate) fn check_stock_to_cut(k: usize, operation: &OperationFile, job: &JobFile) -> Result<(), String> {
    if !depends_on_chips(&operation.feeds) {
        return Ok(());
    }
    for (j, setup) in job.setups.iter().enumerate().filter(|(_, s)| belongs(operation, s, job)) {
        let left = setup.meshes.iter().find(|m| m.role == RoleFile::Drive).map_or(0.0, |m| m.allowance_mm);
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
