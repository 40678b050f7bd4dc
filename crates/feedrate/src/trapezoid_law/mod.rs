//! Motion of a control that limits acceleration, not jerk, and looks ahead over lines of the linear
//! axes alone.

mod junction;
mod law;
mod queue;
mod segment;

pub use law::{TrapezoidLaw, TrapezoidSettings, trapezoid_law};
