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
    /// C turns a fork, in which A tilts the spindle.
    HeadHeadCa,
    /// C turns a fork, in which B tilts the spindle.
    HeadHeadCb,
}

impl MeasuredFamily {
    /// All families.
    pub const ALL: [Self; 5] =
        [Self::TableTableBc, Self::TableTableAc, Self::HeadTableBc, Self::HeadHeadCa, Self::HeadHeadCb];

    /// Returns its name: `table-table-bc`.
    pub fn name(self) -> &'static str {
        match self {
            Self::TableTableBc => "table-table-bc",
            Self::TableTableAc => "table-table-ac",
            Self::HeadTableBc => "head-table-bc",
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
            Self::HeadHeadCa => "head-head-c-a",
            Self::HeadHeadCb => "head-head-c-b",
        }
    }

    /// Returns the address of the tilting axis.
    pub fn tilting_axis(self) -> &'static str {
        match self {
            Self::TableTableAc | Self::HeadHeadCa => "A",
            Self::TableTableBc | Self::HeadTableBc | Self::HeadHeadCb => "B",
        }
    }

    pub(crate) fn preset_text(self) -> &'static str {
        preset(self.preset_name()).unwrap_or_default()
    }

    /// Keys of the places that its machines have.
    pub(crate) fn places(self) -> &'static [&'static str] {
        match self {
            Self::TableTableBc | Self::TableTableAc => &["table_at", "table_tilt"],
            Self::HeadTableBc => &["table_at", "pivot_length", "pivot_offset"],
            Self::HeadHeadCa | Self::HeadHeadCb => &["table_at", "pivot_length", "pivot_offset", "c_offset"],
        }
    }
}

impl fmt::Display for MeasuredFamily {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
