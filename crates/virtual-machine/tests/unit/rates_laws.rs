//! Rates and accelerations against finite differences: random machines, places, blocks and
//! intervals.

#[path = "../../../inverse-kinematics/tests/common/mod.rs"]
pub(crate) mod common;

use facemill_cl_data::{ClPoint, ControlTolerance, CuttingLaw, RapidLaw};
use facemill_inverse_kinematics::machine_file::{BodyFile, ShapeFile};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BlockLaw, Carrier, Machine, Motion};
use nalgebra::{Isometry3, Point3};

use self::common::Random;
use crate::motion::rates::{Parts, RateBounds, Rates};
use crate::motion::stepping::stops;

const LENGTH: f64 = 180.0;

/// Time between compared values, as a fraction of an interval.
const STEP: f64 = 0.1;

/// Rounding of a second difference, mm or rad: coordinates of metres to 1e-11.
const ROUNDING: f64 = 1e-8;

/// The machine with a body at every row of both chains, and one on the bed.
fn with_bodies(machine: &Machine) -> Machine {
    let mut file = machine.to_file();
    let body = |name: String| BodyFile {
        name,
        shape: ShapeFile::Box { size_mm: [1.0; 3] },
        position_mm: [30.0, -70.0, 45.0],
        rotation_xyz_deg: [20.0, 0.0, -50.0],
        clearance_mm: 0.0,
    };
    file.bed_bodies = vec![body("bed".into())];
    for (k, row) in file.workpiece_chain.rows.iter_mut().enumerate() {
        row.bodies = vec![body(format!("table {k}"))];
    }
    for (k, row) in file.tool_chains[0].rows.iter_mut().enumerate() {
        row.bodies = vec![body(format!("head {k}"))];
    }
    Machine::from_file(file).unwrap()
}

fn machines() -> Vec<Machine> {
    let mut r = Random(77);
    let random = std::iter::repeat_with(|| common::random_machine(&mut r)).take(16);
    common::families().into_iter().take(5).chain(random).map(|m| with_bodies(&m)).collect()
}

/// Table, tool and all bodies, table frame.
fn parts(machine: &Machine, q: &AxisValues) -> Vec<Isometry3<f64>> {
    let bodies = machine.body_poses(q).map(|b| b.table_from_solid);
    [Isometry3::identity(), machine.forward(q, LENGTH)].into_iter().chain(bodies).collect()
}

fn random_ends(machine: &Machine, r: &mut Random, mm: f64, rad: f64) -> [AxisValues; 2] {
    let start = AxisValues::from_fn(machine.axes().len(), |k| match machine.axes()[k].kind {
        AxisKind::Linear => r.between(-800.0, 800.0),
        AxisKind::Rotary => r.between(-1.5, 1.5),
    });
    let end = AxisValues::from_fn(start.len(), |k| {
        let reach = if machine.axes()[k].kind == AxisKind::Linear { mm } else { rad };
        start[k] + r.between(-reach, reach)
    });
    [start, end]
}

/// Sum over the axes of a kind of the lengths of a combination of positions.
fn sum(machine: &Machine, kind: AxisKind, of: impl Fn(usize) -> f64) -> f64 {
    (0..machine.axes().len()).filter(|&k| machine.axes()[k].kind == kind).map(|k| of(k).abs()).sum()
}

/// One interval of a motion, sampled evenly.
struct Sampled<'a> {
    machine: &'a Machine,
    samples: Vec<AxisValues>,
    rates: Rates,
}

impl Sampled<'_> {
    /// Speeds and accelerations of the axes against their bounds; returns acceleration over bound,
    /// where there is one.
    fn check_axes(&self, what: &str) {
        for w in self.samples.windows(3) {
            let second = |k: usize| (w[0][k] - 2.0 * w[1][k] + w[2][k]) / (STEP * STEP);
            let first = |k: usize| (w[1][k] - w[0][k]) / STEP;
            let r = &self.rates;
            for (kind, speed, change) in
                [(AxisKind::Linear, r.linear, r.linear_change), (AxisKind::Rotary, r.turn, r.turn_change)]
            {
                let (v, a) = (sum(self.machine, kind, first), sum(self.machine, kind, second));
                assert!(v <= speed * (1.0 + 1e-9) + ROUNDING, "{what}: {kind:?} at {v}, bound {speed}");
                assert!(a <= change * (1.0 + 1e-9) + ROUNDING, "{what}: {kind:?} changes by {a}, bound {change}");
            }
        }
    }

    /// Accelerations of points of every part against every other; returns the largest one over its
    /// bound.
    fn check_parts(&self, r: &mut Random, what: &str) -> f64 {
        let poses: Vec<_> = self.samples.iter().map(|q| parts(self.machine, q)).collect();
        let tip = Point3::from(poses[0][1].translation.vector);
        let mut largest = 0.0_f64;
        for moving in 0..poses[0].len() {
            let point = Point3::from(r.direction().into_inner() * r.between(0.0, 400.0));
            let reach = (poses[0][moving] * point - tip).norm();
            let bound = self.rates.acceleration(reach);
            for against in 0..poses[0].len() {
                let at: Vec<_> = poses.iter().map(|p| p[against].inv_mul(&p[moving]) * point).collect();
                for w in at.windows(3) {
                    let a = (w[0].coords - w[1].coords * 2.0 + w[2].coords).norm() / (STEP * STEP);
                    assert!(a <= bound * (1.0 + 1e-9) + ROUNDING, "{what}: {moving} on {against} {a}, bound {bound}");
                    largest = largest.max(a / (bound + ROUNDING));
                }
            }
        }
        largest
    }

    /// Under RTCP the tool against the table: at most the square of the turn times the distance
    /// from the tip.
    fn check_tool(&self, r: &mut Random, what: &str) {
        let reach = r.between(0.0, 400.0);
        let point = Point3::from(r.direction().into_inner() * reach);
        let at: Vec<_> = self.samples.iter().map(|q| self.machine.forward(q, LENGTH) * point).collect();
        for w in at.windows(3) {
            let a = (w[0].coords - w[1].coords * 2.0 + w[2].coords).norm() / (STEP * STEP);
            let bound = self.rates.turn.powi(2) * reach;
            assert!(a <= bound * (1.0 + 1e-9) + ROUNDING, "{what}: tool {a}, bound {bound}");
        }
    }
}

fn interval_in(breaks: &[f64], r: &mut Random) -> [f64; 2] {
    let k = r.below(breaks.len() - 1);
    let (low, high) = (breaks[k], breaks[k + 1]);
    let [a, b] = [r.between(0.0, 0.6), r.between(0.0, 0.4)];
    if r.below(3) == 0 { [low, high] } else { [low + a * (high - low), high - b * (high - low)] }
}

/// Share of the intervals that have a bound; of those the median over the intervals of the largest
/// acceleration over its bound.
fn judged(law: BlockLaw, mm: f64, rad: f64) -> (f64, f64) {
    let mut r = Random(901);
    let (mut n, mut shares) = (0, Vec::new());
    for (index, machine) in machines().iter().enumerate() {
        for block in 0..40 {
            let [start, end] = random_ends(machine, &mut r, mm, rad);
            let Ok(motion) = Motion::new(machine, law, &start, &end, LENGTH) else { continue };
            let mut breaks = vec![0.0, 1.0];
            if law == BlockLaw::Rapid(RapidLaw::PerAxis) {
                breaks.extend(stops(machine, [&start, &end]));
                breaks.sort_by(f64::total_cmp);
            }
            let [from, to] = interval_in(&breaks, &mut r);
            n += 1;
            let bounds = RateBounds::new(machine, motion, law, [&start, &end], LENGTH);
            let Some(rates) = bounds.over(from, to, Parts::OneHead) else { continue };
            let samples = (0..=10).map(|k| motion.at(from + (to - from) * f64::from(k) * STEP).unwrap()).collect();
            let sampled = Sampled { machine, samples, rates };
            let what = format!("machine {index}, block {block}, {law:?}");
            sampled.check_axes(&what);
            shares.push(sampled.check_parts(&mut r, &what));
            if law == BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear) {
                sampled.check_tool(&mut r, &what);
            }
        }
    }
    let reported = shares.len() as f64 / f64::from(n);
    shares.sort_by(f64::total_cmp);
    (reported, shares[shares.len() / 2])
}

#[test]
fn nothing_is_faster_or_more_accelerated_than_stated() {
    // Short blocks have rates, but for those near to places that the axes cannot follow; long ones
    // are to be halved.
    let laws = [
        (BlockLaw::Cutting(CuttingLaw::AxesLinear), [1.0, 0.9], 0.1),
        (BlockLaw::Rapid(RapidLaw::Linear), [1.0, 0.9], 0.1),
        (BlockLaw::Rapid(RapidLaw::PerAxis), [1.0, 0.9], 1e-3),
        (BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear), [0.95, 0.5], 5e-3),
        (BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned), [0.8, 0.2], 5e-4),
    ];
    for (law, [short, long], least) in laws {
        for (mm, rad, reported) in [(2.0, 0.004, short), (50.0, 0.05, long), (400.0, 0.6, 0.0)] {
            let (part, share) = judged(law, mm, rad);
            assert!(
                part >= reported && share >= least,
                "{law:?}, {mm} mm, {rad}: reported of {part}, {share} of the bounds"
            );
        }
    }
}

#[test]
fn axes_at_rest_turn_nothing_and_a_pole_on_the_way_is_not_reported() {
    let machine = Machine::head_b_table_c().unwrap();
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    let rates = |start: [f64; 5], end: [f64; 5]| {
        let [start, end] = [start, end].map(AxisValues::from);
        let motion = Motion::new(&machine, law, &start, &end, LENGTH).unwrap();
        RateBounds::new(&machine, motion, law, [&start, &end], LENGTH).over(0.0, 1.0, Parts::OneHead)
    };
    // Upright, where the table's turn is free: it stands still all the same.
    let upright = rates([100.0, 50.0, 300.0, 0.0, 0.4], [180.0, -20.0, 310.0, 0.0, 0.4]).unwrap();
    assert_eq!((upright.turn, upright.linear_change), (0.0, 0.0));
    let tilted = rates([100.0, 50.0, 300.0, 0.3, 0.4], [180.0, -20.0, 310.0, 0.305, 0.405]);
    assert!(tilted.is_some_and(|r| r.turn >= 0.01 && r.linear_change > 0.0), "{tilted:?}");
    // From one side of the pole to the other: the table has to turn by half a turn.
    assert_eq!(rates([0.0, 0.0, 300.0, 0.02, 0.0], [0.0, 0.0, 300.0, -0.02, 0.0]), None);
}

#[test]
fn a_turned_vector_that_is_said_to_be_reached_is_reached_at_every_time() {
    let mut r = Random(31);
    let (mut reported, mut lost) = (0, 0);
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    for machine in machines() {
        for _ in 0..60 {
            let [start, end] = random_ends(&machine, &mut r, 20.0, 1.0);
            let Ok(motion) = Motion::new(&machine, law, &start, &end, LENGTH) else { continue };
            let bounds = RateBounds::new(&machine, motion, law, [&start, &end], LENGTH);
            for k in 0..4 {
                let [from, to] = [0.25 * f64::from(k), 0.25 * f64::from(k + 1)];
                let is_ok = (0..=40).all(|n| motion.at(from + (to - from) * f64::from(n) / 40.0).is_ok());
                let is_reported = bounds.turned_is_reached(from, to);
                assert!(is_ok || !is_reported, "{}: from {from} of {start:?} to {end:?}", machine.name());
                reported += u32::from(is_reported);
                lost += u32::from(!is_ok);
            }
        }
    }
    assert!(reported > 500 && lost > 50, "{reported} reported, {lost} not reached");
}

#[test]
fn no_rates_are_given_where_the_control_changes_branches() {
    let mut r = Random(5);
    let (mut reported, mut changes) = (0, 0);
    let law = BlockLaw::Cutting(CuttingLaw::TipLinearVectorTurned);
    for (index, machine) in machines().iter().enumerate() {
        for block in 0..60 {
            let [start, end] = random_ends(machine, &mut r, 5.0, 0.05);
            // The same end on either branch.
            let Ok(ends) = machine.inverse_near(&machine.cl_point(&end, LENGTH), LENGTH, &start) else { continue };
            for end in ends.iter().map(|s| s.values) {
                let Ok(motion) = Motion::new(machine, law, &start, &end, LENGTH) else { continue };
                changes += u32::from(machine.branch_of(&start) != machine.branch_of(&end));
                let bounds = RateBounds::new(machine, motion, law, [&start, &end], LENGTH);
                for k in 0..8 {
                    let at = |n: u32| (f64::from(k) + f64::from(n) * STEP) / 8.0;
                    let Some(rates) = bounds.over(at(0), at(10), Parts::OneHead) else { continue };
                    let samples = (0..=10).map(|n| motion.at(at(n)).unwrap()).collect();
                    Sampled { machine, samples, rates }.check_axes(&format!("machine {index}, block {block}"));
                    reported += 1;
                }
            }
        }
    }
    assert!(reported > 500 && changes > 100, "{reported} reported, {changes} change");
}

/// Both views of a mill with two heads.
fn two_heads() -> Vec<Machine> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines/dual-c-horizontal-xyzb.json");
    Machine::heads_from_json(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn parts_of_two_heads_are_no_more_accelerated_against_each_other_than_stated() {
    let views = two_heads();
    let mut r = Random(902);
    let (mut shares, mut exceeded) = (Vec::new(), 0);
    for law in [BlockLaw::Cutting(CuttingLaw::AxesLinear), BlockLaw::Rapid(RapidLaw::Linear)] {
        for block in 0..60 {
            let (mm, rad) = [(2.0, 0.004), (50.0, 0.05), (0.0, 0.08)][block % 3];
            let [start, end] = random_ends(&views[0], &mut r, mm, rad);
            for (machine, other) in [(&views[0], &views[1]), (&views[1], &views[0])] {
                let motion = Motion::new(machine, law, &start, &end, LENGTH).unwrap();
                let [from, to] = interval_in(&[0.0, 1.0], &mut r);
                let bounds = RateBounds::new(machine, motion, law, [&start, &end], LENGTH);
                let bounds = bounds.with_other(Some((other, 90.0)));
                let samples =
                    || (0..=10).map(|k| motion.at(from + (to - from) * f64::from(k) * STEP).unwrap()).collect();
                let what = format!("block {block}, {law:?}");
                let both = bounds.over(from, to, Parts::BothHeads).unwrap();
                let sampled = Sampled { machine, samples: samples(), rates: both };
                sampled.check_axes(&what);
                shares.push(sampled.check_parts(&mut r, &what));
                // Without the other head's axes the bounds are none for its parts.
                let one = bounds.over(from, to, Parts::OneHead).unwrap();
                exceeded += u32::from(one.turn < both.turn && one.acceleration(1e3) < both.acceleration(1e3));
            }
        }
    }
    shares.sort_by(f64::total_cmp);
    assert!(
        shares[shares.len() / 2] > 0.03 && exceeded > 200,
        "{} of the bounds, {exceeded}",
        shares[shares.len() / 2]
    );
}

/// The control leaves both tips' ways and every rotary axis by its tolerance: parts of one head
/// stray against those of the other by no more than the stated bound.
#[test]
fn parts_of_two_heads_stray_against_each_other_by_no_more_than_stated() {
    let views = two_heads();
    let mut r = Random(903);
    let tolerance = ControlTolerance { path: 0.05, orientation: 1e-3 };
    let lengths = [LENGTH, 90.0];
    let mut largest = 0.0_f64;
    for _ in 0..300 {
        let [q, _] = random_ends(&views[0], &mut r, 0.0, 0.0);
        let rotary = |k: usize| views[0].axes()[k].kind == AxisKind::Rotary;
        // Within the limits, and not near the pole, where the inverse solution does not give the
        // table's turn back.
        let q = AxisValues::from_fn(q.len(), |k| match views[0].axes()[k].letter.as_str() {
            "C" => q[k],
            "B1" | "B2" => q[k].signum() * (0.3 + q[k].abs() / 2.0),
            "Z1" | "Z2" => 0.5 * q[k] - 400.0,
            _ => 0.5 * q[k],
        });
        let turned = AxisValues::from_fn(q.len(), |k| {
            q[k] + if rotary(k) { r.between(-1.0, 1.0) * tolerance.orientation } else { 0.0 }
        });
        let mut strayed = turned;
        for (head, view) in views.iter().enumerate() {
            let off = r.direction().into_inner() * r.between(0.0, tolerance.path);
            let axis = view.cl_point(&turned, lengths[head]).axis;
            let cl = ClPoint { tip: view.cl_point(&q, lengths[head]).tip + off, axis };
            let is_same = |found: &AxisValues| (0..q.len()).all(|k| !rotary(k) || (found[k] - turned[k]).abs() < 1e-7);
            let all = view.inverse_near(&cl, lengths[head], &turned).unwrap();
            let found = all.iter().map(|s| s.values).find(is_same).unwrap();
            for k in (0..q.len()).filter(|&k| view.moves_tool(k) && !rotary(k)) {
                strayed[k] = found[k];
            }
        }
        let law = BlockLaw::Cutting(CuttingLaw::AxesLinear);
        let motion = Motion::new(&views[0], law, &q, &q, LENGTH).unwrap();
        let bounds =
            RateBounds::new(&views[0], motion, law, [&q, &q], LENGTH).with_other(Some((&views[1], lengths[1])));
        let rates = bounds.over(0.0, 1.0, Parts::BothHeads).unwrap();
        let [before, after] = [&q, &strayed].map(|q| parts(&views[0], q));
        let tip = Point3::from(before[1].translation.vector);
        let is_other = |k: usize| k > 1 && views[0].bodies()[k - 2].carrier() == Some(Carrier::OtherHead);
        for moving in (1..before.len()).filter(|&k| !is_other(k)) {
            for against in (0..before.len()).filter(|&k| is_other(k)) {
                let point = Point3::from(r.direction().into_inner() * r.between(0.0, 400.0));
                let reach = (before[moving] * point - tip).norm();
                let bound = bounds.strayed(tolerance, &q, &rates, reach, Parts::BothHeads).unwrap();
                let at = |poses: &[Isometry3<f64>]| poses[against].inv_mul(&poses[moving]) * point;
                let way = (at(&after) - at(&before)).norm();
                assert!(way <= bound, "{moving} on {against}: {way}, bound {bound}");
                largest = largest.max(way / bound);
            }
        }
    }
    assert!(largest > 0.05, "{largest} of the bound at most");
}
