//! Arguments that several commands share.

pub(crate) mod ad_hoc_setup;
pub(crate) mod called_files;
pub(crate) mod dialect;
pub(crate) mod option_lengths;
pub(crate) mod plan_folder;
pub(crate) mod program;
