//! Programs held to their job: by brute force, with planted faults, from public sources.

pub(crate) mod certificates;
pub(crate) mod mended;
pub(crate) mod mutants;
pub(crate) mod planted_faults;
pub(crate) mod read_back;
pub(crate) mod real_programs;
pub(crate) mod rejected;
pub(crate) mod remaining;
pub(crate) mod report_page;
pub(crate) mod verify_stock;
