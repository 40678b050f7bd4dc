use facemill_cl_data::ControlTolerance;
use facemill_feedrate::ProgramBlock;
use facemill_inverse_kinematics::{AxisValues, Machine};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::evened;
use crate::program_time::run::MotionRun;
use crate::program_time::vectors::{VectorDecimals, VectorRounding};

const LENGTH: f64 = 220.0;

/// Frame of words that is neither the table's nor parallel to it.
fn table_from_words() -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(12.0, -40.0, 7.0), UnitQuaternion::from_euler_angles(0.02, -0.03, 0.4))
}

fn rounded(v: Vector3<f64>, decimals: i32) -> [f64; 3] {
    let scale = 10f64.powi(decimals);
    v.map(|c| (c * scale).round() / scale).into()
}

/// Positions that a control takes for vectors along a wave, and the vectors. Every fortieth block
/// has rotary words.
fn run(machine: &Machine, decimals: i32, turn: impl Fn(f64) -> [f64; 2]) -> MotionRun {
    let frame = table_from_words();
    let at = |k: usize| {
        let s = 0.02 * k as f64;
        let [b, c] = turn(s);
        let tip = [600.0 + 25.0 * s, 10.0 * s.sin(), 300.0].into();
        machine.with_tip_at(&AxisValues::from([0.0, 0.0, 0.0, b, c]), &tip, LENGTH).unwrap()
    };
    let start = at(0);
    let (mut before, mut run) = (start, MotionRun { start, blocks: Vec::new(), is_rapid: false, vectors: Vec::new() });
    for k in 1..250 {
        let mut cl = machine.cl_point(&at(k), LENGTH);
        let vector = (k % 40 != 0).then(|| rounded(frame.inverse_transform_vector(&cl.axis), decimals));
        let end = vector.map_or(at(k), |v| {
            cl.axis = nalgebra::Unit::new_normalize(frame * Vector3::from(v));
            machine.control_choice(&before, &cl, LENGTH).unwrap()
        });
        run.blocks.push(ProgramBlock { end, tip_time: 0.1, exact_stop: false });
        run.vectors.push(vector);
        before = end;
    }
    run
}

/// Least distance of a vector of any length along `axis` from the one of the text, by its largest
/// component.
fn off(axis: Vector3<f64>, text: [f64; 3]) -> f64 {
    let at = |length: f64| (axis * length - Vector3::from(text)).amax();
    let (mut low, mut high) = (0.99, 1.01);
    for _ in 0..200 {
        let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
        if at(a) < at(b) { high = b } else { low = a }
    }
    at(low)
}

/// Largest second difference of the rotary axes, without those at the ends, which are as the text
/// has them.
fn roughness(run: &MotionRun) -> f64 {
    let second = |w: &[ProgramBlock], k: usize| (w[2].end[k] - 2.0 * w[1].end[k] + w[0].end[k]).abs();
    run.blocks[2..run.blocks.len() - 2].windows(3).flat_map(|w| [second(w, 3), second(w, 4)]).fold(0.0, f64::max)
}

#[test]
fn evened_positions_have_the_tip_and_the_vector_of_the_text_and_are_smoother() {
    let machine = Machine::head_b_table_c().unwrap();
    for (decimals, orientation) in [(4, 0.02), (5, 1e-3), (5, 1e-5), (6, 1e-3)] {
        let run = run(&machine, decimals, |s| [0.3 + 0.02 * s.sin(), 0.1 * (1.3 * s).cos()]);
        let mut read = VectorDecimals::default();
        run.vectors.iter().flatten().for_each(|v| read.read(v));
        let half = read.half();
        assert_eq!(half, 0.5 * 10f64.powi(-decimals));
        let rounding = VectorRounding { table_from_words: table_from_words(), half };
        let tolerance = ControlTolerance { path: 0.01, orientation };
        let even = evened((&machine, LENGTH), &run, &rounding, tolerance).unwrap();
        let left = even.tolerance;
        assert!(left.path == 0.01 && left.orientation < orientation && left.orientation >= 0.499 * orientation);
        let mut turned = 0.0_f64;
        for ((old, new), vector) in run.blocks.iter().zip(&even.run.blocks).zip(&run.vectors) {
            let [a, b] = [old, new].map(|block| machine.cl_point(&block.end, LENGTH));
            let Some(vector) = vector else {
                assert_eq!(old, new);
                continue;
            };
            assert!((a.tip - b.tip).norm() < 1e-8 && old.tip_time == new.tip_time);
            let axis = rounding.table_from_words.inverse_transform_vector(&b.axis);
            assert!(off(axis, *vector) < half * (1.0 + 1e-6), "{decimals}: {} {half}", off(axis, *vector));
            turned = turned.max(a.axis.cross(&b.axis).norm());
        }
        assert!(turned > 0.0 && turned <= orientation - left.orientation + 1e-11, "{turned}");
        assert_eq!(run.blocks.last(), even.run.blocks.last());
        // A tolerance as small as the steps leaves some of them. What turns is 8e-6 and 6.8e-5 from
        // move to move.
        let [before, after] = [roughness(&run), roughness(&even.run)];
        assert!(orientation < 1e-4 || after < 1.2 * 6.8e-5 && after < before, "{decimals}: {before} {after}");
    }
}

#[test]
fn nothing_is_evened_where_nothing_turns_or_the_control_allows_nothing() {
    let machine = Machine::head_b_table_c().unwrap();
    let rounding = VectorRounding { table_from_words: table_from_words(), half: 5e-6 };
    let own = |run: &MotionRun, orientation: f64| {
        let tolerance = ControlTolerance { path: 0.01, orientation };
        evened((&machine, LENGTH), run, &rounding, tolerance)
    };
    let mut still = run(&machine, 5, |_| [0.3, 0.1]);
    // Rotary words between would be other positions.
    let said = still.vectors[0];
    let at = still.blocks[0].end;
    for (block, vector) in still.blocks.iter_mut().zip(&mut still.vectors) {
        let tip = machine.cl_point(&block.end, LENGTH).tip;
        (block.end, *vector) = (machine.with_tip_at(&at, &tip, LENGTH).unwrap(), said);
    }
    still.start = still.blocks[0].end;
    assert_eq!(own(&still, 1e-3).unwrap().run.blocks, still.blocks);
    let turning = run(&machine, 5, |s| [0.3, 0.1 * s]);
    assert!(own(&turning, 0.0).is_none());
    assert!(own(&MotionRun { vectors: vec![None; turning.blocks.len()], ..turning }, 1e-3).is_none());
}

#[test]
fn decimals_are_those_of_the_longest_component() {
    let half = |vectors: &[[f64; 3]]| {
        let mut read = VectorDecimals::default();
        vectors.iter().for_each(|v| read.read(v));
        read.half()
    };
    assert_eq!(half(&[[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]), 5e-5);
    assert_eq!(half(&[[0.6, 0.0, 0.8], [0.123_457, 0.5, -0.25]]), 5e-7);
    assert_eq!(half(&[[0.123_456_7, 0.5, -0.25], [0.6, 0.0, 0.8]]), 5e-8);
    assert!(half(&[[1.0 / 3.0, 0.5, 0.5]]) < 1e-12);
}
