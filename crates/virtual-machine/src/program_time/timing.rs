use facemill_cl_data::RapidLaw;
use facemill_inverse_kinematics::{BlockLaw, Machine, Motion};
use facemill_nc_program::FeedMode;

use crate::motion::moves::Move;

/// Time of a motion, s: rapids at the axes' largest velocities without acceleration, cutting moves
/// at the programmed feed. `None` for a cutting move without a positive feed.
///
/// G94 is the norm over all axes with 1 deg as 1 mm (FEED (1)), G93 the reciprocal of the minutes,
/// RTCP the speed of the tip. A rapid whose tip goes straight takes as long as its slowest axis
/// needs at its fastest part.
pub(crate) fn duration(machine: &Machine, m: &Move, tool_length: f64) -> Option<f64> {
    if m.is_rapid {
        let time = travel_time(machine, m, tool_length);
        let feed = machine.feed_range().rapid.filter(|_| m.law != BlockLaw::Rapid(RapidLaw::PerAxis));
        return Some(feed.map_or(time, |f| time.max(60.0 * axis_norm(machine, m) / f)));
    }
    let feed = m.feed.filter(|f| f.value > 0.0)?;
    Some(match feed.mode {
        FeedMode::G94 => 60.0 * axis_norm(machine, m) / feed.value,
        FeedMode::G93 => 60.0 / feed.value,
        FeedMode::Rtcp => {
            let [a, b] = [&m.start, &m.end].map(|q| machine.cl_point(q, tool_length).tip);
            60.0 * (b - a).norm() / feed.value
        }
    })
}

/// Parts of a rapid whose tip goes straight, over which the speeds of its axes are looked at.
const PARTS: u32 = 32;

/// Time that the axes need at their largest velocities. Where they do not go evenly, the speeds are
/// those of parts of the way, so that it is a lower bound.
fn travel_time(machine: &Machine, m: &Move, tool_length: f64) -> f64 {
    let whole = machine.travel_time(&m.start, &m.end);
    let motion = Motion::new(machine, m.law, &m.start, &m.end, tool_length);
    let (BlockLaw::Cutting(_), Ok(motion)) = (m.law, motion) else { return whole };
    let at = |k: u32| motion.at(f64::from(k) / f64::from(PARTS)).ok();
    let of_part = |k: u32| Some(f64::from(PARTS) * machine.travel_time(&at(k)?, &at(k + 1)?));
    (0..PARTS).filter_map(of_part).fold(whole, f64::max)
}

/// FEED (1): Euclidean norm over all axes, mm and deg.
fn axis_norm(machine: &Machine, m: &Move) -> f64 {
    let way = |k: usize| machine.axes()[k].in_word_unit(m.end[k] - m.start[k]);
    (0..m.start.len()).map(|k| way(k).powi(2)).sum::<f64>().sqrt()
}

/// Largest contribution of the last decimal of the words to the motion of an axis in one block, mm
/// or deg: half a thousandth at each end, and half of one for good measure. Larger hides spikes of
/// tiny blocks, smaller reports rounding.
const WORD_ROUNDING: f64 = 1.5e-3;

/// The axis that would have to be fastest compared with its largest velocity, and that ratio, where
/// it is above 1 + `slack`; for a cutting move of this duration, on average over the block.
pub(crate) fn spike(machine: &Machine, m: &Move, duration: f64, slack: f64) -> Option<(usize, f64)> {
    let ratio = |k: usize| {
        let axis = &machine.axes()[k];
        let way = axis.in_word_unit(m.end[k] - m.start[k]).abs() - WORD_ROUNDING;
        let largest = axis.in_word_unit(axis.max_velocity) * duration;
        // A way in no time is infinitely fast; no way is no speed.
        (k, if way > 0.0 { way / largest } else { 0.0 })
    };
    let fastest = (0..m.start.len()).map(ratio).fold((0, 0.0), |best, r| if r.1 > best.1 { r } else { best });
    (fastest.1 > 1.0 + slack).then_some(fastest)
}
