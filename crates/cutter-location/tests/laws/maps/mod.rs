//! Maps of the feasible set.

pub(crate) mod map;
pub(crate) mod map_cases;
