//! Times of a control that limits only acceleration, compared with the figures of one and with
//! closed forms.

use facemill_feedrate::{AxisBounds, ProgramBlock, TrapezoidSettings, trapezoid_law, within_look_ahead};
use facemill_inverse_kinematics::AxisValues;

use super::control_programs::{ControlProgram, control_programs};

const LINEAR: [bool; 5] = [true, true, true, false, false];

/// X, Y and Z alike, B and C: velocity and acceleration, mm and deg.
fn axes([linear, b, c]: [[f64; 2]; 3]) -> [AxisBounds; 5] {
    let bounds = |[velocity, acceleration]: [f64; 2]| AxisBounds { velocity, acceleration, jerk: 1e9 };
    let rotary = |limits: [f64; 2]| bounds(limits.map(f64::to_radians));
    [bounds(linear), bounds(linear), bounds(linear), rotary(b), rotary(c)]
}

fn blocks(program: &ControlProgram) -> Vec<ProgramBlock> {
    let mut at = [0.0; 5];
    let block = |end: &[f64; 5]| {
        let way = (0..3).map(|k| end[k] - at[k]).fold(0.0, f64::hypot);
        at = *end;
        let end = AxisValues::from_fn(5, |k| if LINEAR[k] { end[k] } else { end[k].to_radians() });
        ProgramBlock { end, tip_time: 60.0 * way / program.feed, exact_stop: false }
    };
    program.ends.iter().map(block).collect()
}

fn settings(tolerance: f64) -> TrapezoidSettings {
    TrapezoidSettings { tolerance, look_ahead: 50, cycle: 0.001 }
}

fn time(program: &ControlProgram, limits: [[f64; 2]; 3]) -> f64 {
    let start = AxisValues::zeros(5);
    let law = trapezoid_law(&start, &blocks(program), (&axes(limits), &LINEAR), &settings(program.tolerance)).unwrap();
    law.times.iter().sum()
}

const QUICK: [[f64; 2]; 3] = [[500.0, 3000.0], [360.0, 500.0], [360.0, 500.0]];
const SLOW: [[f64; 2]; 3] = [[250.0, 500.0], [60.0, 120.0], [60.0, 60.0]];

/// Seconds in which the simulator of LinuxCNC 2.9 ran the programs, in their order.
const QUICK_TIMES: [f64; 4] = [4.623, 5.386, 5.018, 5.039];
const SLOW_TIMES: [f64; 4] = [13.035, 6.579, 7.934, 8.085];

#[test]
fn times_are_those_of_linuxcnc_within_five_percent_on_four_kinds_of_program() {
    for (limits, times) in [(QUICK, QUICK_TIMES), (SLOW, SLOW_TIMES)] {
        for (program, measured) in control_programs(SIZE).iter().zip(times) {
            let own = time(program, limits);
            println!("{}: {own:.3} s, {measured} s in the simulator", program.name);
            assert!((own / measured - 1.0).abs() < 0.05, "{}: {own} s for {measured} s", program.name);
        }
    }
}

/// Programs that the figures are for.
const SIZE: usize = 5;

/// From rest to rest the closed form; joined lines are never slower than stops, and never faster
/// than their speeds allow.
#[test]
fn joined_lines_take_no_longer_than_stops_and_no_less_than_their_speeds_allow() {
    let start = AxisValues::zeros(5);
    let axes = axes(SLOW);
    for program in control_programs(1).iter().filter(|p| p.tolerance > 0.0) {
        let blocks = blocks(program);
        let run = |tolerance| trapezoid_law(&start, &blocks, (&axes, &LINEAR), &settings(tolerance)).unwrap();
        let (joined, stopped) = (run(program.tolerance), run(0.0));
        let sum = |times: &[f64]| times.iter().sum::<f64>();
        // The arc of a sharp corner may take longer than a stop, which the control itself does not:
        // the model is 1.3 % slow there.
        let most = if program.name == "zigzag" { 1.05 } else { 1.0 };
        assert!(sum(&joined.times) < most * sum(&stopped.times), "{}", program.name);
        assert!(sum(&joined.times) > blocks.iter().map(|b| b.tip_time).sum(), "{}", program.name);
        let mut at = start;
        for ((block, time), peak) in blocks.iter().zip(&stopped.times).zip(&stopped.peak_times) {
            let most = |limit: fn(&AxisBounds) -> f64| {
                (0..5).map(|k| (block.end[k] - at[k]).abs() / limit(&axes[k])).fold(0.0, f64::max)
            };
            // Of the way, 1: speed and acceleration.
            let cycle = if most(|b| b.velocity).max(block.tip_time) < 0.001_02 { 0.001_02 } else { 0.0 };
            let (v, a) =
                (most(|b| b.velocity).max(block.tip_time).max(cycle).recip(), most(|b| b.acceleration).recip());
            let closed = if v * v < a { v.recip() + v / a } else { 2.0 / a.sqrt() };
            assert!((time - closed).abs() < 1e-9 && *peak <= *time, "{}: {time} {closed}", program.name);
            at = block.end;
        }
    }
}

/// The control can stop within its look-ahead: it is no faster over short blocks, and unchanged
/// over longer ones.
#[test]
fn a_short_look_ahead_slows_short_blocks_alone() {
    let axis = AxisBounds { velocity: 500.0, acceleration: 1000.0, jerk: 1e5 };
    let line = |step: f64| -> Vec<ProgramBlock> {
        let block = |k: u32| ProgramBlock {
            end: AxisValues::from([step * f64::from(k)]),
            tip_time: step / 100.0,
            exact_stop: false,
        };
        (1..=1000).map(block).collect()
    };
    let start = AxisValues::zeros(1);
    let seen = |step: f64, n| within_look_ahead(&start, &line(step), &[axis], n);
    // 100 mm/s need 5 mm to stop, and half as much again of the time of the jerk.
    let requested: Vec<f64> = line(0.1).iter().map(|block| block.tip_time).collect();
    assert_eq!(seen(0.1, 200), requested);
    assert_eq!(seen(0.1, 1000), requested);
    let short = seen(0.1, 20);
    // v²/2a + v·a/2j = 1.9 mm.
    let speed = 0.1 / short[500];
    assert!((speed * speed / 2000.0 + speed * 0.005 - 1.9).abs() < 1e-6, "{speed}");
    assert_eq!(short[990], 0.001);
}
