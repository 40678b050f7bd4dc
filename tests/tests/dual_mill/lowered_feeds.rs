//! Feeds that an axis of both heads cannot follow: lowered in the blocks of both, as the text alone
//! shows.

use facemill_tests::oracles::two_heads::{DualBlock, TwoHeads, dual_blocks};

use super::*;

/// Largest speed of C, deg/s, and its acceleration, deg/s².
const SPEED: f64 = 0.8;
const ACCELERATION: f64 = 0.5;

/// How far C may have begun to turn before a corner and may end behind it, deg: the control's
/// tolerance at both, and that of the words.
const ROUND_A_CORNER: f64 = 2.0 * 0.005 + 2e-4;

/// Feeds ask for at most so many times what is reached.
const ASKED: f64 = 1.03;

/// Turn of C in one sense, with the block's own, deg, for each block: the smaller of the turns
/// since C last rested and until it rests again.
fn turned(blocks: &[DualBlock]) -> Vec<f64> {
    let way = |b: &DualBlock| if b.rapid { 0.0 } else { b.to["C"] - b.from["C"] };
    let mut since = vec![0.0_f64; blocks.len()];
    let mut sum = |k: usize, last: &mut f64| {
        let way = way(&blocks[k]);
        *last = if way * *last < 0.0 || way == 0.0 { way } else { *last + way };
        since[k] = if since[k] > 0.0 { since[k].min(last.abs()) } else { last.abs() };
    };
    let mut last = 0.0;
    (0..blocks.len()).for_each(|k| sum(k, &mut last));
    last = 0.0;
    (0..blocks.len()).rev().for_each(|k| sum(k, &mut last));
    since
}

/// A slow and lazy C under both tools: no tip is faster than its job permits, and C never turns
/// faster than it can.
///
/// `cargo test --release -p facemill-tests --test dual_mill -- --ignored`.
#[test]
#[ignore = "plans a pair of its own: eight seconds"]
fn feeds_of_both_heads_ask_for_no_more_than_a_slow_axis_reaches() {
    let job = job(448.0);
    let joint = "/workpiece_chain/rows/1/joint/revolute";
    job.set("job.json", &[("/feeds_within", json!("acceleration"))]);
    job.set(
        "machine.json",
        &[
            (&format!("{joint}/max_velocity_deg_min"), json!(60.0 * SPEED)),
            (&format!("{joint}/max_acceleration_deg_s2"), json!(ACCELERATION)),
        ],
    );
    let planned = plan(&job, false);
    let file = job.json("job.json");
    let most = [0, 1].map(|k| number(&file["operations"][k]["feeds"]["cutting_mm_min"]));
    let tools = ["tool.json", "tool-2.json"].map(|name| number(&job.json(name)["gauge_length_mm"]));
    let heads = TwoHeads::new(job.json("machine.json"), tools, ReadBack::of(&job, 0).table_from_work);
    let blocks = dual_blocks(&text_of(&planned, "program.nc"));
    let turned = turned(&blocks);
    let (mut by_speed, mut by_acceleration, mut free) = (0, 0, 0);
    for (block, turned) in blocks.iter().zip(turned).filter(|(b, _)| ReadPlan::is_cut(b) && b.working == [true; 2]) {
        let time = heads.time(block);
        let shares = [0, 1].map(|h| {
            let way = (heads.place(h, &block.to).0 - heads.place(h, &block.from).0).norm();
            let share = 60.0 * way / time / most[h];
            assert!(share <= 1.0 + 1e-3 + 4.0 * ROUNDING / way, "line {}: head {} at {share}", block.line, h + 1);
            share
        });
        // Half a unit of the last decimal at both ends.
        let turn = ((block.to["C"] - block.from["C"]).abs() - 1e-4).max(0.0) / time;
        let reached = (2.0 * ACCELERATION * (turned + ROUND_A_CORNER)).sqrt();
        assert!(turn <= SPEED, "line {}: C at {turn} deg/s", block.line);
        assert!(turn <= ASKED * reached, "line {}: C at {turn} deg/s, {reached} are reached", block.line);
        let share = shares[0].max(shares[1]);
        by_speed += usize::from(share < 0.95 && turn > 0.99 * SPEED);
        by_acceleration += usize::from(share < 0.95 && turn < 0.95 * SPEED);
        free += usize::from(share > 0.99);
    }
    assert!(by_speed > 3 && by_acceleration > 1, "{by_speed} by speed, {by_acceleration} by acceleration, {free} free");
}
