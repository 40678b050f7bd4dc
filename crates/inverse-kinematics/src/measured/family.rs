use std::fmt;

use crate::machine::preset::preset;

/// Families of machines that measurements describe: three linear axes, a turning axis C, and a
/// tilting axis A or B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeasuredFamily {
    /// Trunnion B carries the turning table C.
    TableTableBc,
    /// Trunnion A carries the turning table C.
    TableTableAc,
    /// The head tilts about B, the table turns about C.
    HeadTableBc,
    /// The head tilts about A, the table turns about C.
    HeadTableAc,
    /// The head turns about a B axis that leans by 45°, the table turns about C.
    HeadNutatingTableBc,
    /// A B axis that leans by 45° carries the turning table C.
    TableTableNutatingBc,
    /// C turns a fork, in which A tilts the spindle.
    HeadHeadCa,
    /// C turns a fork, in which B tilts the spindle.
    HeadHeadCb,
}

impl MeasuredFamily {
    /// All families.
    pub const ALL: [Self; 8] = [
        Self::TableTableBc,
        Self::TableTableAc,
        Self::HeadTableBc,
        Self::HeadTableAc,
        Self::HeadNutatingTableBc,
        Self::TableTableNutatingBc,
        Self::HeadHeadCa,
        Self::HeadHeadCb,
    ];

    /// Returns its name: `table-table-bc`.
    pub fn name(self) -> &'static str {
        match self {
            Self::TableTableBc => "table-table-bc",
            Self::TableTableAc => "table-table-ac",
            Self::HeadTableBc => "head-table-bc",
            Self::HeadTableAc => "head-table-ac",
            Self::HeadNutatingTableBc => "head-nutating-table-bc",
            Self::TableTableNutatingBc => "table-table-nutating-bc",
            Self::HeadHeadCa => "head-head-ca",
            Self::HeadHeadCb => "head-head-cb",
        }
    }

    /// Returns the name of the preset that gives the values nobody measured.
    pub fn preset_name(self) -> &'static str {
        match self {
            Self::TableTableBc => "table-table-b-c",
            Self::TableTableAc => "table-table-a-c",
            Self::HeadTableBc => "head-b-table-c",
            Self::HeadTableAc => "head-a-table-c",
            Self::HeadNutatingTableBc => "head-b-nutating-table-c",
            Self::TableTableNutatingBc => "table-table-b-c-nutating",
            Self::HeadHeadCa => "head-head-c-a",
            Self::HeadHeadCb => "head-head-c-b",
        }
    }

    /// Returns the address of the tilting axis.
    pub fn tilting_axis(self) -> &'static str {
        match self {
            Self::TableTableAc | Self::HeadTableAc | Self::HeadHeadCa => "A",
            Self::TableTableBc
            | Self::HeadTableBc
            | Self::HeadHeadCb
            | Self::HeadNutatingTableBc
            | Self::TableTableNutatingBc => "B",
        }
    }

    pub(crate) fn preset_text(self) -> &'static str {
        preset(self.preset_name()).unwrap_or_default()
    }

    /// Keys of the places that its machines have.
    pub(crate) fn places(self) -> &'static [&'static str] {
        match self {
            Self::TableTableBc | Self::TableTableAc => &["table_at", "table_tilt"],
            Self::HeadTableBc | Self::HeadTableAc => &["table_at", "pivot_length", "pivot_offset"],
            Self::HeadNutatingTableBc => &["table_at", "pivot_length", "pivot_offset", "lean"],
            Self::TableTableNutatingBc => &["table_at", "table_tilt", "lean"],
            Self::HeadHeadCa | Self::HeadHeadCb => &["table_at", "pivot_length", "pivot_offset", "c_offset"],
        }
    }
}

/// Direction toward which a tilting axis at 45° leans from z, upward, all axes at 0.
///
/// With either one +B tilts the tool from +z toward +x; for the same tool axis the other one has B
/// with the opposite sign and C half a turn off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasuredLean {
    /// Toward +y.
    PlusY,
    /// Toward −y.
    MinusY,
}

impl MeasuredLean {
    /// Returns its name: `+y` or `-y`.
    pub fn name(self) -> &'static str {
        match self {
            Self::PlusY => "+y",
            Self::MinusY => "-y",
        }
    }
}

impl fmt::Display for MeasuredFamily {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
