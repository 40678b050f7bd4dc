//! Laws of motion along a path in the least time.

pub(crate) mod barrier;
mod bernstein;
mod bounds;
pub(crate) mod certify;
pub(crate) mod descent;
mod jet;
mod lanes;
pub(crate) mod law;
mod optimal;
mod path;
pub(crate) mod span;

pub use bounds::{AxisBounds, MotionBounds, MotionLimit, TimeLawError};
pub use jet::Jet;
pub use law::{AxisMotion, TimeLaw};
pub use optimal::{TimeLawSettings, minimum_time_law};
pub use path::{JointPath, PathPoint};
