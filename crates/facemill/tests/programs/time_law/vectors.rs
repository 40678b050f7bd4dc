//! Programs with tool vectors under the law: their rounding adds no motion, their turns do.

use std::fmt::Write;

use facemill::feedrate::machine_bounds;
use facemill::feeds::{FeedLawTimes, FeedRewriteSettings, TipFeed};
use facemill::inverse_kinematics::{AxisValues, Machine};
use facemill::nc_program::Dialect;
use facemill::rewrite_feeds;

use super::within_the_law;

const LENGTH: f64 = 260.0;

/// How the direction of the tool is said.
#[derive(Clone, Copy)]
enum Said {
    /// Words of the rotary axes, with many decimals.
    Rotary,
    /// Siemens vectors with so many decimals.
    Siemens(usize),
    /// Heidenhain vectors with so many decimals.
    Heidenhain(usize),
}

fn machine() -> Machine {
    Machine::head_b_table_c().unwrap()
}

/// Writes a row of cuts at F along the poses of these axis values, tip by tip.
fn program(machine: &Machine, poses: &[AxisValues], said: Said, feed: f64) -> String {
    let words_from_table = machine.work_coordinates(&AxisValues::zeros(poses[0].len())).unwrap().inverse();
    let (head, end, cut) = match said {
        Said::Heidenhain(_) => ("0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1000\n", "M30\n", "L"),
        _ => ("G710 G90 G94\nT1 M6\nD1\n", "M30\n", "G1"),
    };
    let mut text = head.to_owned();
    for (k, q) in poses.iter().enumerate() {
        let cl = machine.cl_point(q, LENGTH);
        let (tip, axis) = (words_from_table * cl.tip, words_from_table * cl.axis);
        let xyz = |plus: bool| {
            let sign = if plus { "+" } else { "" };
            [("X", tip.x), ("Y", tip.y), ("Z", tip.z)]
                .map(|(l, v)| format!(" {l}{}{v:.6}", if v < 0.0 { "" } else { sign }))
                .concat()
        };
        let rotary = format!(" B{:.7} C{:.7}", q[3].to_degrees(), q[4].to_degrees());
        // Controls fix the frame of the tip's words to the table as it is where RTCP comes on.
        let square = format!(" B{:.7} C0", q[3].to_degrees());
        match (k, said) {
            (0, Said::Heidenhain(_)) => {
                write!(
                    text,
                    "L{square} R0 FMAX\nFUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\nL{}{rotary} FMAX\n",
                    xyz(true)
                )
                .unwrap();
                writeln!(text, "L{} F{feed}", xyz(true)).unwrap();
            }
            (0, _) => {
                write!(text, "G0{square}\nTRAORI\nORIMKS ORIAXES\nFGROUP(X,Y,Z)\nG0{}{rotary}\n", xyz(false)).unwrap();
                writeln!(text, "G1{}{rotary} F{feed}", xyz(false)).unwrap();
            }
            (_, Said::Rotary) => writeln!(text, "{cut}{}{rotary}", xyz(false)).unwrap(),
            (_, Said::Siemens(n)) => {
                writeln!(text, "{cut}{} A3={:.n$} B3={:.n$} C3={:.n$}", xyz(false), axis.x, axis.y, axis.z).unwrap();
            }
            (_, Said::Heidenhain(n)) => {
                writeln!(text, "LN{} TX{:+.n$} TY{:+.n$} TZ{:+.n$}", xyz(true), axis.x, axis.y, axis.z).unwrap();
            }
        }
    }
    text + end
}

/// Times and text of the program with feeds within the law.
fn timed(machine: &Machine, text: &str, said: Said, blend_tolerance: Option<f64>) -> (FeedLawTimes, String) {
    let dialect = if matches!(said, Said::Heidenhain(_)) { Dialect::Heidenhain } else { Dialect::Siemens840d };
    let tip_feed = TipFeed::Programmed;
    let settings = FeedRewriteSettings { dialect, tip_feed, ..within_the_law(machine, LENGTH, blend_tolerance) };
    let new = rewrite_feeds(text.as_bytes(), &settings).unwrap_or_else(|e| panic!("{e}"));
    (new.summary.time_law.unwrap(), String::from_utf8(new.text).unwrap())
}

/// Axis values of a tip that goes on from `x` by `step` mm along a wave, with a tool that leans and
/// turns by these functions (rad).
fn wave(n: usize, x: f64, step: f64, turn: impl Fn(f64) -> [f64; 2]) -> Vec<AxisValues> {
    let machine = machine();
    let at = |k: usize| {
        let s = step * k as f64;
        let [b, c] = turn(s);
        let tip = [x + s, 20.0 * (s / 40.0).sin(), 300.0].into();
        machine.with_tip_at(&AxisValues::from([0.0, 0.0, 0.0, b, c]), &tip, LENGTH).unwrap()
    };
    (0..n).map(at).collect()
}

#[test]
fn vectors_take_as_long_as_the_rotary_words_that_they_stand_for() {
    let machine = machine();
    let poses = wave(260, 600.0, 0.6, |s| [0.3 + 0.05 * (s / 30.0).sin(), 0.4 * (s / 50.0).sin()]);
    let text = |said| program(&machine, &poses, said, 2500.0);
    let (words, _) = timed(&machine, &text(Said::Rotary), Said::Rotary, None);
    for said in [Said::Siemens(6), Said::Siemens(5), Said::Heidenhain(7), Said::Heidenhain(5)] {
        let (vectors, _) = timed(&machine, &text(said), said, None);
        let ratio = vectors.cutting_time_s / words.cutting_time_s;
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}: {vectors:?} {words:?}");
        assert!(vectors.lowered_blocks <= words.lowered_blocks + 13, "{vectors:?} {words:?}");
    }
}

/// A repeated vector turns nothing, so a straight line of many blocks has no corner, not even for a
/// control that stops at every one. The first vector makes one, as it differs slightly from the
/// rotary words before it.
#[test]
fn a_vector_that_stays_makes_no_corner() {
    let machine = machine();
    let straight: Vec<AxisValues> = (0..60)
        .map(|k| {
            let tip = [600.0 + 0.125 * f64::from(k), 40.0, 300.0].into();
            machine.with_tip_at(&AxisValues::from([0.0, 0.0, 0.0, 0.3, 0.5]), &tip, LENGTH).unwrap()
        })
        .collect();
    let time = |said| timed(&machine, &program(&machine, &straight, said, 2000.0), said, Some(0.0)).0;
    let (words, vectors) = (time(Said::Rotary), time(Said::Siemens(5)));
    let ratio = vectors.cutting_time_s / words.cutting_time_s;
    assert!(vectors.stops_at_corners && (1.0..1.3).contains(&ratio), "{words:?} {vectors:?}");
}

/// Swings of the table that are said by vectors take no less than each swing of the axis alone
/// between two places where it turns back: with speeds of 0 there, the way of a time T is at most
/// J·T³/12 within the jerk J (∫(T/2 − t)·a by parts), and a·T²/4 within the acceleration.
#[test]
fn what_vectors_turn_is_limited() {
    let machine = machine();
    let (swing, length) = (0.12_f64, 6.0);
    let poses = wave(200, 20.0, 0.3, |s| [0.35, swing * (std::f64::consts::PI * s / length).cos()]);
    let bounds = machine_bounds(&machine).unwrap();
    // Both ends of each of the ten swings are off by at most the part that a blend may omit.
    let blend = machine.motion_law().control_tolerance.orientation;
    let (way, c) = (2.0 * swing - 4.0 * blend, bounds[4]);
    let each = (12.0 * way / c.jerk).cbrt().max(2.0 * (way / c.acceleration).sqrt()).max(way / c.velocity);
    let least = 9.0 * each;
    let time = |said| timed(&machine, &program(&machine, &poses, said, 6000.0), said, None).0;
    let words = time(Said::Rotary).cutting_time_s;
    for said in [Said::Siemens(6), Said::Heidenhain(5)] {
        let times = time(said);
        assert!(times.cutting_time_s > least && times.lowered_blocks > 150, "{times:?} {least}");
        assert!((times.cutting_time_s / words - 1.0).abs() < 0.05, "{times:?} {words}");
    }
}
