//! Stock that programs cut.

use facemill_cl_data::Silent;
use facemill_nc_program::ReadProgram;
use facemill_virtual_machine::{StockRun, VerifySettings, VirtualSetup, run_stock};
use facemill_z_map::DexelMap;

/// Runs a program, and checks the map after it: the reported removed volume is the map's loss.
pub fn cut_stock(
    program: &ReadProgram,
    setup: &VirtualSetup<'_>,
    settings: &VerifySettings,
    stock: &mut DexelMap,
    tolerance: f64,
) -> StockRun {
    let before = stock.volume();
    let run = run_stock(program, setup, settings, stock, tolerance, &Silent).unwrap();
    stock.check_invariants().unwrap();
    let lost = before - stock.volume();
    assert!((run.removed_mm3 - lost).abs() <= 1e-9 * before, "{} reported, {lost} lost", run.removed_mm3);
    run
}
