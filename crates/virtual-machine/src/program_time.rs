//! Times of programs by the law of motion: runs between stops, corners within tolerance, rounded
//! tool vectors.

pub mod program_moves;
pub mod run;
pub(crate) mod timing;
pub mod tolerance;
pub mod vectors;

/// Feeds that ask for more than so many times the largest speed of a block are lowered. In dense
/// programs the law holds a block to the least tip feed of those around it, which takes 2 % off
/// where rounded words make feeds uneven: that is no limit of the machine.
const BEYOND: f64 = 1.03;

/// They are lowered to so many times that speed: the law stays some tenths of a percent off its
/// limits, and a feed that asks for a little more costs nothing.
const ROOM: f64 = 1.01;

/// The time that a block's feed is to ask for instead of `time`, where the largest speed in it
/// takes `peak_time`; `None`: it stays.
pub fn reachable(time: f64, peak_time: f64) -> Option<f64> {
    (peak_time > BEYOND * time).then_some(peak_time / ROOM)
}
