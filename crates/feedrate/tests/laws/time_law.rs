//! Laws of the least time along a path, and the published benchmark.

mod checks;
mod closed_form;
mod control_programs;
mod deviation;
mod machine;
mod program;
mod refused;
mod smooth;
mod spline_path;
mod trapezoid;
