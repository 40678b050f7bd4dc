use crate::motion::stepping::*;
use facemill_cl_data::RapidLaw;
use facemill_test_kit::Random;

const SPACING: Spacing = Spacing { max_step: 0.5, max_turn: 0.0035, max_bulge: 0.005, reach: 82.0 };
const LENGTH: f64 = 260.0;

/// Random start on the preset's table, and an end up to `mm` and `rad` away.
fn random_ends(machine: &Machine, rng: &mut Random, mm: f64, rad: f64) -> [AxisValues; 2] {
    let n = machine.axes().len();
    let is_linear = |k: usize| machine.axes()[k].kind == AxisKind::Linear;
    let start =
        AxisValues::from_fn(n, |k| if is_linear(k) { rng.between(-1500.0, 1500.0) } else { rng.between(-1.2, 1.2) });
    let end =
        AxisValues::from_fn(n, |k| start[k] + if is_linear(k) { rng.between(-mm, mm) } else { rng.between(-rad, rad) });
    [start, end]
}

/// Largest step of tip and farthest rim point, and largest turn, between neighbouring positions;
/// and what the sum of all steps would need at least.
fn measure(machine: &Machine, law: BlockLaw, [start, end]: [&AxisValues; 2]) -> (f64, f64, f64, usize) {
    let motion = Motion::new(machine, law, start, end, LENGTH).unwrap();
    let all = positions(machine, &motion, law, [start, end], LENGTH, &SPACING);
    let reported = all.n();
    let mut before = machine.cl_point(start, LENGTH);
    let (mut step, mut turn, mut needed, mut n) = (0.0_f64, 0.0_f64, 0.0, 0);
    for t in all {
        let cl = motion.cl_at(t).unwrap();
        let angle = before.axis.cross(&cl.axis).norm().atan2(before.axis.dot(&cl.axis));
        let way = (cl.tip - before.tip).norm();
        step = step.max(way + SPACING.reach * angle);
        turn = turn.max(angle);
        needed += ((way + SPACING.reach * angle) / SPACING.max_step).max(angle / SPACING.max_turn);
        n += 1;
        before = cl;
    }
    assert_eq!(motion.cl_at(1.0), Ok(before));
    assert_eq!(reported, n as u64);
    (step, turn, needed, n)
}

#[test]
fn positions_are_never_farther_apart_than_requested_and_not_many_more_than_needed() {
    let machine = Machine::head_b_table_c().unwrap();
    let mut rng = Random(5);
    for (mm, rad) in [(5.0, 0.003), (5.0, 0.05), (0.0, 0.3), (300.0, 0.0), (400.0, 2.5), (0.001, 0.0)] {
        for law in [
            BlockLaw::Cutting(CuttingLaw::AxesLinear),
            BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear),
            BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned),
            BlockLaw::Rapid(RapidLaw::Linear),
            BlockLaw::Rapid(RapidLaw::PerAxis),
        ] {
            for _ in 0..6 {
                let [start, end] = random_ends(&machine, &mut rng, mm, rad);
                let (step, turn, needed, n) = measure(&machine, law, [&start, &end]);
                assert!(step <= SPACING.max_step * (1.0 + 1e-9), "{law:?} {mm} {rad}: {step}");
                assert!(turn <= SPACING.max_turn * (1.0 + 1e-6), "{law:?} {mm} {rad}: {turn}");
                assert!(n as f64 <= 1.5 * needed + 2.0, "{law:?} {mm} {rad}: {n} for {needed}");
            }
        }
    }
}

#[test]
fn a_table_that_turns_about_the_tool_is_followed() {
    let machine = Machine::head_b_table_c().unwrap();
    let start = AxisValues::from([0.0, 0.0, 300.0, 0.0, 0.0]);
    let mut end = start;
    end[4] = 1.0;
    let law = BlockLaw::Rapid(RapidLaw::Linear);
    let (step, turn, _, n) = measure(&machine, law, [&start, &end]);
    assert!(step < 1e-9 && turn < 1e-9, "neither tip nor axis moves");
    assert!(n as f64 >= 1.0 / SPACING.max_turn, "{n} positions");
}

#[test]
fn axes_that_cancel_at_the_tip_need_few_positions() {
    // The table turns half a degree and X and Y follow the tip, 1.4 m from the table's axis: 12 mm
    // of axis travel for a tip that hardly moves.
    let machine = Machine::head_b_table_c().unwrap();
    let start = AxisValues::from([1000.0, 1000.0, 300.0, 0.0, 0.0]);
    let mut turned = start;
    turned[4] = 0.5_f64.to_radians();
    let tip = machine.cl_point(&start, LENGTH).tip;
    let end = machine.with_tip_at(&turned, &tip, LENGTH).unwrap();
    assert!((end[0] - start[0]).hypot(end[1] - start[1]) > 10.0);
    let law = BlockLaw::Cutting(CuttingLaw::AxesLinear);
    let (_, _, _, n) = measure(&machine, law, [&start, &end]);
    assert!(n <= 4, "{n} positions");
}
