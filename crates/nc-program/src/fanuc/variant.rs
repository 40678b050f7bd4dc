/// Controls whose programs are read as FANUC's but for some codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Variant {
    #[default]
    Fanuc,
    Haas,
    Mazak,
    LinuxCnc,
}
