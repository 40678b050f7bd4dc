use crate::read::error::ReadError;
use crate::read::fanuc::reader::FanucReader;
use crate::read::fanuc::variant::Variant;
use crate::read::program::ReadProgram;

/// Reads a Haas program: as [`read_fanuc`](crate::read::fanuc::read_fanuc) does, with Haas' own
/// codes (G154, G187, G234, G254, pocket and five-axis cycles, M97, …).
///
/// # Errors
/// As [`read_fanuc`](crate::read::fanuc::read_fanuc).
pub fn read_haas(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    FanucReader::haas().read(text.as_ref())
}

/// Reads a Mazak program (EIA/ISO): as [`read_fanuc`](crate::read::fanuc::read_fanuc) does, with
/// Mazak's own codes (G54.2, G61.1, G68.3, …), two T words in a block, of which the second makes a
/// tool ready, and tools such as `T12.1`.
///
/// # Errors
/// As [`read_fanuc`](crate::read::fanuc::read_fanuc).
pub fn read_mazak(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    FanucReader::mazak().read(text.as_ref())
}

/// Reads a LinuxCNC program: numbers without a decimal point are mm, deg and s; named parameters
/// and expressions in brackets are evaluated where they are known, until the next O word; O words
/// are kept and not followed.
///
/// # Errors
/// As [`read_fanuc`](crate::read::fanuc::read_fanuc).
pub fn read_linuxcnc(text: impl AsRef<[u8]>) -> Result<ReadProgram, ReadError> {
    FanucReader::linuxcnc().read(text.as_ref())
}

impl FanucReader {
    /// A reader as [`read_haas`] has it, before the first line.
    #[must_use]
    pub fn haas() -> Self {
        Self::of_variant(Variant::Haas)
    }

    /// A reader as [`read_mazak`] has it, before the first line.
    #[must_use]
    pub fn mazak() -> Self {
        Self::of_variant(Variant::Mazak)
    }

    /// A reader as [`read_linuxcnc`] has it, before the first line.
    #[must_use]
    pub fn linuxcnc() -> Self {
        Self::of_variant(Variant::LinuxCnc)
    }
}
