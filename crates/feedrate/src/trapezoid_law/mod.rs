//! Motion of controls that limit acceleration, not jerk: one that rounds corners and looks ahead
//! over lines of the linear axes alone, and one that keeps to the lines.

mod deviation;
mod junction;
mod law;
mod queue;
mod segment;

pub use deviation::{DeviationSettings, deviation_law};
pub use law::{TrapezoidLaw, TrapezoidSettings, trapezoid_law};
