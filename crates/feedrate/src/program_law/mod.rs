//! Laws of motion along programs.

mod blocks;
mod knots;
mod law;
mod polyline;
mod section;
mod spans;
mod spline;

pub use blocks::{ProgramBlock, ProgramLawError, ProgramSettings, program_law};
pub use law::ProgramLaw;
