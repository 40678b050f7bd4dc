//! Programs of a machine.

use facemill_feedrate::*;
use facemill_inverse_kinematics::*;

fn blocks() -> (AxisValues, Vec<FeedBlock>) {
    let at = |k: i32| {
        let s = f64::from(k) * 0.5;
        AxisValues::from([700.0 + s, 40.0 * (s / 60.0).sin(), 500.0, 0.2 * (s / 90.0).sin(), 0.004 * s])
    };
    (at(0), (1..=200).map(|k| FeedBlock { end: at(k), tip_feed: 3000.0 }).collect())
}

#[test]
fn a_machines_program_keeps_its_axes_limits_and_takes_no_less_than_its_feeds_say() {
    let machine = Machine::head_b_table_c().unwrap();
    let (start, feeds) = blocks();
    let bounds = machine_bounds(&machine).unwrap();
    for (axis, b) in machine.axes().iter().zip(&bounds) {
        let limits = (b.velocity, Some(b.acceleration), Some(b.jerk));
        assert_eq!(limits, (axis.max_velocity, axis.max_acceleration, axis.max_jerk));
    }
    let blocks = program_blocks(&machine, 250.0, &start, &feeds).unwrap();
    let tolerance = AxisValues::from([0.01, 0.01, 0.01, 1e-4, 1e-4]);
    let law = program_law(&start, &blocks, &bounds, &ProgramSettings::blended(tolerance)).unwrap();
    // The same tip feeds without acceleration.
    let constant = plan_feeds(&machine, 250.0, &start, &feeds).unwrap();
    for (time, feed) in law.block_times().iter().zip(&constant) {
        // An axis may come nearer by its tolerance at either end.
        assert!(*time >= feed.time * 0.9, "{time} {feed:?}");
    }
    let least: f64 = constant.iter().map(|f| f.time).sum();
    assert!(law.total_time() >= least && law.total_time() < 1.5 * least, "{} {least}", law.total_time());
    // Speed of the tip, by differences of its positions.
    let tip = |t: f64| machine.cl_point(&law.at(t).position, 250.0).tip;
    let n = 4000;
    let step = law.total_time() / f64::from(n);
    for k in 0..n {
        let t = f64::from(k) * step;
        let feed = (tip(t + step) - tip(t)).norm() / step * 60.0;
        // The tip's chord over a block is a little shorter than its way.
        assert!(feed <= 3000.0 * 1.001, "{t}: {feed}");
    }
}

#[test]
fn bad_feeds_are_refused_by_block() {
    let machine = Machine::head_b_table_c().unwrap();
    let (start, mut feeds) = blocks();
    feeds[17].tip_feed = 0.0;
    let error = program_blocks(&machine, 250.0, &start, &feeds).unwrap_err();
    assert_eq!(error.block, 17);
    feeds[17].tip_feed = 1000.0;
    feeds[3].end[1] = f64::NAN;
    assert_eq!(program_blocks(&machine, 250.0, &start, &feeds).unwrap_err().block, 3);
}

#[test]
fn an_axis_without_jerk_is_named() {
    let text = preset_head_b_table_c().replace(",\n              \"max_jerk_mm_s3\": 5000", "");
    let error = machine_bounds(&Machine::from_json(text.as_bytes()).unwrap()).unwrap_err();
    assert_eq!(error.to_string(), "the machine gives no jerk for axis X: add it to the machine file to time programs");
    let file = include_str!("../../../../../assets/machines/bridge-head-head-a-b.json");
    let bridge = Machine::from_json(file.as_bytes()).unwrap();
    let bounds = machine_bounds(&bridge).unwrap();
    assert_eq!((bounds.len(), bounds[0].jerk), (bridge.axes().len(), 10_000.0));
}
