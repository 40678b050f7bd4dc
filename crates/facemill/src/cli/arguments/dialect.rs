//! Dialects as arguments.

use facemill::nc_program::Dialect;

pub(crate) fn dialect(name: &str) -> Result<Dialect, String> {
    let known = Dialect::ALL.into_iter().find(|d| d.name() == name);
    known.ok_or_else(|| format!("must be one of {}", Dialect::ALL.map(Dialect::name).join(", ")))
}
