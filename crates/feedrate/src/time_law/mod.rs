//! Laws of motion along a path in the least time.

mod barrier;
mod bernstein;
mod bounds;
mod certify;
mod descent;
mod jet;
mod law;
mod optimal;
mod path;
mod span;

pub use bounds::{AxisBounds, MotionBounds, MotionLimit, TimeLawError};
pub use jet::Jet;
pub use law::{AxisMotion, TimeLaw};
pub use optimal::{TimeLawSettings, minimum_time_law};
pub use path::{JointPath, PathPoint};
