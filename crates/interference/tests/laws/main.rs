//! Laws that hold for every [`Interference`](facemill_interference::Interference), and between
//! them.

mod kit;
mod reference;

mod depths;
mod hulls;
mod sweeps;
mod turns;
mod verdicts;
mod whole_cutters;
