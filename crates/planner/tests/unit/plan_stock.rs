use super::*;

#[test]
fn half_a_cell_is_within_the_rapid_clearance_and_lines_are_not_too_many() {
    let tolerance = 0.05;
    for length in [3.0, 80.0, 400.0, 3048.0, 9000.0] {
        for clearance in [0.05, 0.3, 1.0, 5.0, 40.0] {
            match default_cell([0.1 * length, length], clearance, tolerance) {
                Ok(cell) => {
                    assert!(
                        0.5 * cell.hypot(cell) + 2.0 * tolerance <= KEPT_BY_RAPIDS * clearance + 1e-9,
                        "{length} {clearance} {cell}"
                    );
                    assert!(cell > 0.0 && length / cell <= LINES[1] + 1.0, "{length} {clearance} {cell}");
                    // No finer than requested except for the clearance.
                    let coarser = cell + 2.0 * STEP;
                    let fits = 0.5 * coarser.hypot(coarser) + 2.0 * tolerance <= KEPT_BY_RAPIDS * clearance;
                    assert!(!fits || coarser > FINEST.max(length / LINES[0]), "{length} {clearance} {cell}");
                }
                Err(why) => {
                    let coarsest = std::f64::consts::SQRT_2 * (KEPT_BY_RAPIDS * clearance - 2.0 * tolerance);
                    assert!(coarsest < (length / LINES[1]).max(STEP), "{length} {clearance}: {why}");
                    assert!(why.contains("stock_cell_mm") && why.contains("rapid_clearance_mm"));
                }
            }
        }
    }
}
