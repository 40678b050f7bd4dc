//! Batches through real processes: killed, side by side, on full disks, with changed inputs; and
//! their results against those of the other commands.

mod commands;
#[cfg(unix)]
mod disks;
mod faults;
#[cfg(unix)]
mod kills;
