use crate::machine::Machine;
use crate::machine_file::error::MachineError;

/// Machine file of a large propeller mill: head tilts about B, table turns about C (the family of
/// FEED (9)).
///
/// C vertical, table 4 m in diameter; X and Y ±2.6 m, Z 3.6 m, B ±110°, C endless; the B axis lies
/// 350 mm above the spindle nose. With all axes at 0 the nose stands in the centre of the table's
/// top, where the table frame has its origin. Jerks are assumed: full acceleration is reached in
/// 0.1 s.
pub fn preset_head_b_table_c() -> &'static str {
    include_str!("../../presets/head-b-table-c.json")
}

/// Machine file of a propeller mill with two heads that face each other along a horizontal C, one
/// on each side of the propeller: X1 Y1 Z1 B1, X2 Y2 Z2 B2 and C, for propellers of about 1 m. See
/// [`Machine::heads`].
pub fn preset_dual_xyzb() -> &'static str {
    include_str!("../../../../assets/machines/dual-c-horizontal-xyzb.json")
}

impl Machine {
    /// The machine of [`preset_head_b_table_c`].
    ///
    /// # Errors
    /// None: the tests build it.
    pub fn head_b_table_c() -> Result<Self, MachineError> {
        Self::from_json(preset_head_b_table_c().as_bytes())
    }
}
