//! Poses of a tool at a CC point, tested for limits, gouge and collision.

pub(crate) mod machine_obstacles;
pub(crate) mod obstacle;
pub(crate) mod placed_machine;
pub(crate) mod pose_test;
pub(crate) mod spun_bodies;
pub(crate) mod stock_on_way;
pub(crate) mod widened;
pub(crate) mod workcell;
