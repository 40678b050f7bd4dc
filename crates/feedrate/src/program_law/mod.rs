//! Laws of motion along programs.

mod blocks;
mod corner;
mod knots;
mod law;
mod look_ahead;
mod machine;
mod polyline;
mod ride;
mod rounded;
mod s_curve;
mod section;
mod spans;
mod spline;

pub(crate) use blocks::check_program;
pub use blocks::{ProgramBlock, ProgramLawError, ProgramSettings, program_law, program_law_of};
pub use law::ProgramLaw;
pub use look_ahead::within_look_ahead;
pub use machine::{MissingLimit, machine_bounds, program_blocks};
