//! Laws of motion along programs.

mod blocks;
mod corner;
mod knots;
mod law;
mod machine;
mod polyline;
mod s_curve;
mod section;
mod spans;
mod spline;

pub use blocks::{ProgramBlock, ProgramLawError, ProgramSettings, program_law};
pub use law::ProgramLaw;
pub use machine::{MissingLimit, machine_bounds, program_blocks};
