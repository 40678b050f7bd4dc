//! Rapid blocks as the control drives them under RTCP: the tip on a line, the rotary axes even or
//! the vector turned.

use facemill_cl_data::{ClPoint, CuttingLaw, RapidLaw};
use facemill_cutter_location::links::link::{ClearanceSurface, LinkSettings, Linker};
use facemill_cutter_location::{Infeasible, PoseTest};
use facemill_interference::{Interference, MeshTree};
use facemill_inverse_kinematics::machine_file::Joint;
use facemill_inverse_kinematics::{AxisValues, BlockLaw, Machine, Unreachable};
use nalgebra::{Point3, Unit, Vector3};

use crate::kit::{Ball, Random, distance_at, machine, obstacle, stand, tool, workcell};

const CLEARANCE: f64 = 10.0;

/// Largest lack of the clearance between two positions: half of the smallest step.
const HALF_STEP: f64 = 0.5;

fn settings(rapid_law: impl Into<BlockLaw>) -> LinkSettings {
    let clearance = ClearanceSurface::Plane { origin: Point3::new(0.0, 0.0, 500.0), normal: Vector3::z_axis() };
    LinkSettings { clearance, rapid_clearance: CLEARANCE, rapid_law: rapid_law.into() }
}

fn pose(tip: [f64; 3], axis: [f64; 3]) -> ClPoint {
    ClPoint { tip: Point3::from(tip), axis: Unit::new_normalize(Vector3::from(axis)) }
}

/// Returns the axes at a time: rotary ones even, the tip on its line, linear ones as that requires.
fn following(machine: &Machine, length: f64, [a, b]: [&AxisValues; 2], t: f64) -> AxisValues {
    let tip = |q: &AxisValues| machine.cl_point(q, length).tip;
    let tip = tip(a) + (tip(b) - tip(a)) * t;
    machine.with_tip_at(&a.lerp(b, t), &tip, length).unwrap()
}

#[test]
fn a_rapid_block_that_keeps_its_tip_on_a_line_is_free_all_the_way() {
    let (machine, tool) = (machine(), tool(16.0, 2.0, 20.0));
    let mut random = Random(31);
    let (mut free, mut blocked, mut differ) = (0, 0, 0);
    for _ in 0..40 {
        let balls: Vec<Ball> = (0..3)
            .map(|_| Ball { center: Point3::from(random.vector(1.0) * 150.0), radius: random.between(20.0, 60.0) })
            .collect();
        let trees: Vec<MeshTree> = balls.iter().map(|b| MeshTree::new(&b.mesh())).collect();
        let cell = workcell(&machine, &tool, trees.iter().map(|t| obstacle("ball", t as &dyn Interference)).collect());
        let test = PoseTest::new(&cell);
        let mut end = |x: f64| {
            let axis = [random.between(-0.6, 0.6), random.between(-0.6, 0.6), 1.0];
            let tip = [x, random.between(-150.0, 150.0), random.between(0.0, 200.0)];
            stand(&cell, &pose(tip, axis)).configuration.axes
        };
        let (from, to) = (end(-150.0), end(150.0));
        let law = settings(CuttingLaw::TipAndRotariesLinear);
        let found = Linker::new(&test, &law).rapid_block(&from, &to, CLEARANCE);
        let other = Linker::new(&test, &settings(RapidLaw::Linear)).rapid_block(&from, &to, CLEARANCE);
        differ += usize::from(found.is_ok() != other.is_ok());
        let length = tool.gauge_length();
        let at = |k: u32| following(&machine, length, [&from, &to], f64::from(k) / 400.0);
        let smallest = (0..=400).map(|k| distance_at(&cell, &at(k), &balls)).fold(f64::INFINITY, f64::min);
        // Chords of the balls lie inside of them.
        let chord = balls.iter().map(Ball::chord_error).fold(0.0, f64::max);
        match found {
            Ok(()) => assert!(smallest >= CLEARANCE - HALF_STEP, "{smallest} mm"),
            Err(blocked) => {
                let why = test.describe(&blocked.why);
                assert!(smallest < CLEARANCE + chord + HALF_STEP, "{smallest} mm, but {why}");
            }
        }
        free += usize::from(smallest >= CLEARANCE);
        blocked += usize::from(smallest < CLEARANCE);
    }
    assert!(free > 8 && blocked > 8 && differ > 0, "{free} free, {blocked} blocked, {differ} by the law alone");
}

#[test]
fn a_rapid_block_that_would_take_an_axis_beyond_its_limit_between_the_ends_is_refused() {
    let (whole, tool) = (machine(), tool(16.0, 2.0, 20.0));
    let length = tool.gauge_length();
    let cell = workcell(&whole, &tool, vec![]);
    // The tool is upright, the table turns by 120 deg below it, and the linear axes move around on
    // an arc.
    let from = stand(&cell, &pose([40.0, 120.0, 100.0], [0.0, 0.0, 1.0])).configuration.axes;
    let mut turned = from;
    turned[4] += 120_f64.to_radians();
    let tip = whole.cl_point(&from, length).tip + SHIFT;
    let to = whole.with_tip_at(&turned, &tip, length).unwrap();
    let way: Vec<AxisValues> = (0..=90).map(|k| following(&whole, length, [&from, &to], f64::from(k) / 90.0)).collect();
    // The axis and sense that move farthest beyond both ends.
    let beyond = |(k, sense): (usize, f64)| {
        let ends = (sense * from[k]).max(sense * to[k]);
        (k, sense, ends, way.iter().map(|q| sense * q[k]).fold(f64::NEG_INFINITY, f64::max))
    };
    let all = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)].map(beyond);
    let (axis, sense, ends, farthest) = all.into_iter().max_by(|a, b| (a.3 - a.2).total_cmp(&(b.3 - b.2))).unwrap();
    assert!(farthest > ends + 5.0, "{farthest} {ends}");
    let block = |limit: f64, law: BlockLaw| {
        let mut file = whole.to_file();
        let letter = whole.axes()[axis].letter.to_string();
        let rows = file.tool_chains.iter_mut().flat_map(|c| &mut c.rows).chain(&mut file.workpiece_chain.rows);
        for joint in rows.filter_map(|row| row.joint.as_mut()) {
            if let Joint::Prismatic(joint) = joint
                && joint.axis == letter
            {
                *(if sense > 0.0 { &mut joint.max_mm } else { &mut joint.min_mm }) = sense * limit;
            }
        }
        let machine = Machine::from_file(file).unwrap();
        let cell = workcell(&machine, &tool, vec![]);
        let test = PoseTest::new(&cell);
        Linker::new(&test, &settings(law)).rapid_block(&from, &to, CLEARANCE).map_err(|blocked| blocked.why)
    };
    let follows = BlockLaw::Cutting(CuttingLaw::TipAndRotariesLinear);
    let refused = block(farthest - 0.01, follows).unwrap_err();
    let is_limit = matches!(&refused, Infeasible::Unreachable(Unreachable::AxisLimit { index, .. }) if *index == axis);
    assert!(is_limit, "{refused:?}");
    assert_eq!(block(farthest + 1.0, follows), Ok(()));
    // Axes that move evenly stay between their ends.
    assert_eq!(block(ends + 1.0, RapidLaw::Linear.into()), Ok(()));
}

/// A short way of the tip.
const SHIFT: Vector3<f64> = Vector3::new(3.0, 2.0, 1.0);

#[test]
fn a_turned_vector_goes_over_to_no_other_branch_or_winding() {
    let (machine, tool) = (machine(), tool(16.0, 2.0, 20.0));
    let cell = workcell(&machine, &tool, vec![]);
    let test = PoseTest::new(&cell);
    let from = stand(&cell, &pose([0.0, 0.0, 200.0], [0.4, 0.1, 1.0])).configuration.axes;
    let near = stand(&cell, &pose([30.0, 0.0, 210.0], [0.3, 0.2, 1.0])).configuration.axes;
    let length = tool.gauge_length();
    let tip = machine.cl_point(&from, length).tip;
    let mut wound = from;
    wound[4] += std::f64::consts::TAU;
    let mut swung = from;
    (swung[3], swung[4]) = (-from[3], from[4] + std::f64::consts::PI);
    for other in [wound, swung] {
        let other = machine.with_tip_at(&other, &tip, length).unwrap();
        // The tool has its old direction.
        let apart = machine.cl_point(&other, length).axis.angle(&machine.cl_point(&from, length).axis);
        assert!(apart < 1e-6, "{apart}");
        let block = |law: CuttingLaw| Linker::new(&test, &settings(law)).rapid_block(&from, &other, CLEARANCE);
        assert!(block(CuttingLaw::TipLinearVectorTurned).is_err());
        assert_eq!(block(CuttingLaw::TipAndRotariesLinear), Ok(()));
    }
    let turned = settings(CuttingLaw::TipLinearVectorTurned);
    assert_eq!(Linker::new(&test, &turned).rapid_block(&from, &near, CLEARANCE), Ok(()));
}
