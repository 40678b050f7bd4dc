use crate::machine::Machine;
use crate::machine_file::error::MachineError;

/// Machine files that come with the crate, by name.
const PRESETS: [(&str, &str); 13] = [
    ("bridge-head-head-a-b", include_str!("../../presets/machines/bridge-head-head-a-b.json")),
    ("dual-c-horizontal-xyzb", include_str!("../../presets/machines/dual-c-horizontal-xyzb.json")),
    ("dual-c-horizontal-xzab", include_str!("../../presets/machines/dual-c-horizontal-xzab.json")),
    ("head-a-table-c", include_str!("../../presets/machines/head-a-table-c.json")),
    ("head-b-a-table-c-two-linear", include_str!("../../presets/machines/head-b-a-table-c-two-linear.json")),
    ("head-b-nutating-table-c", include_str!("../../presets/machines/head-b-nutating-table-c.json")),
    ("head-b-table-c", include_str!("../../presets/machines/head-b-table-c.json")),
    ("head-head-c-a", include_str!("../../presets/machines/head-head-c-a.json")),
    ("head-head-c-b", include_str!("../../presets/machines/head-head-c-b.json")),
    ("table-table-a-c", include_str!("../../presets/machines/table-table-a-c.json")),
    ("table-table-b-c", include_str!("../../presets/machines/table-table-b-c.json")),
    ("table-table-b-c-nutating", include_str!("../../presets/machines/table-table-b-c-nutating.json")),
    ("table-y-x-a-c-head-z", include_str!("../../presets/machines/table-y-x-a-c-head-z.json")),
];

/// Returns the names of the machine files that come with the crate, in alphabetical order.
pub fn preset_names() -> [&'static str; PRESETS.len()] {
    PRESETS.map(|(name, _)| name)
}

/// Returns the machine file of a preset, for [`Machine::from_json`], or
/// [`Machine::heads_from_json`] where its name begins with "dual"; `None` if no preset has the name
/// ([`preset_names`]). Its `source` names where its structure is from, its `assumed` the values
/// that are not.
pub fn preset(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// Short form of the preset "head-b-table-c", a large propeller mill: head tilts about B, table
/// turns about C (the family of FEED (9)).
///
/// C vertical, table 4 m in diameter; X and Y ±2.6 m, Z 3.6 m, B ±110°, C endless; the B axis lies
/// 350 mm above the spindle nose. With all axes at 0 the nose is in the centre of the table's top,
/// where the table frame has its origin. Jerks are assumed: full acceleration is reached in 0.1 s.
pub fn preset_head_b_table_c() -> &'static str {
    include_str!("../../presets/head-b-table-c.json")
}

/// Machine file of a propeller mill with two heads that face each other along a horizontal C, one
/// on each side of the propeller: X1 Y1 Z1 B1, X2 Y2 Z2 B2 and C, for propellers of about 1 m. See
/// [`Machine::heads`].
pub fn preset_dual_xyzb() -> &'static str {
    include_str!("../../presets/machines/dual-c-horizontal-xyzb.json")
}

impl Machine {
    /// Builds the machine of [`preset_head_b_table_c`].
    ///
    /// # Errors
    /// None: the tests build it.
    pub fn head_b_table_c() -> Result<Self, MachineError> {
        Self::from_json(preset_head_b_table_c().as_bytes())
    }
}
