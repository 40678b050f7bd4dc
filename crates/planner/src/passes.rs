//! Passes with tested postures, chips and ridges at every point, passes beside them.

pub(crate) mod engagement;
pub(crate) mod extra_passes;
pub(crate) mod high_places;
pub(crate) mod island_passes;
pub(crate) mod left_gaps;
pub(crate) mod move_settings;
pub(crate) mod operation;
pub(crate) mod path_planner;
pub(crate) mod planned_region;
pub(crate) mod pole_detours;
pub(crate) mod setup_context;
pub(crate) mod turn_chips;
pub(crate) mod width_field;
