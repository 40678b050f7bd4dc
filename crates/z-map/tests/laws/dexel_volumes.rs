//! Removed volumes against closed forms.

use std::f64::consts::PI;

use crate::dexel_kit::{block, body, cut, upright};

#[test]
fn a_straight_slot_has_its_volume() {
    let flat = body(4.0, 0.0, 30.0);
    let mut errors = Vec::new();
    for cell in [0.4, 0.2, 0.1] {
        let mut map = block([0.0; 3], [40.0, 20.0, 10.0], cell);
        let lost = cut(&mut map, &flat, upright([10.03, 10.02, 7.0]), upright([30.05, 10.02, 7.0]), 0.01).volume;
        errors.push((lost - 3.0 * (20.02 * 8.0 + PI * 16.0)).abs());
    }
    // At most half a cell along the outline.
    for (error, cell) in errors.iter().zip([0.4, 0.2, 0.1]) {
        assert!(*error < 3.0 * (2.0 * 20.02 + 8.0 * PI) * cell / 2.0, "{errors:?}");
    }
}
