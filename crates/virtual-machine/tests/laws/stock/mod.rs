//! Programs in the stock as it is cut.

pub(crate) mod dead_core;
pub(crate) mod links;
pub(crate) mod links_of_heads;
pub(crate) mod machine_stock;
pub(crate) mod outside;
pub(crate) mod stock_motion;
pub(crate) mod stock_of_heads;
pub(crate) mod stock_run;
