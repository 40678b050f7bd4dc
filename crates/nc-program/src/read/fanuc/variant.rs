use crate::dialect::Dialect;

/// Controls whose programs are read as FANUC's but for some codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Variant {
    #[default]
    Fanuc,
    Haas,
    Mazak,
    LinuxCnc,
}

impl Variant {
    pub(crate) fn dialect(self) -> Dialect {
        match self {
            Self::Fanuc => Dialect::Fanuc,
            Self::Haas => Dialect::Haas,
            Self::Mazak => Dialect::Mazak,
            Self::LinuxCnc => Dialect::LinuxCnc,
        }
    }
}
