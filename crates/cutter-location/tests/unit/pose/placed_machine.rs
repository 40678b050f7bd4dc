use facemill_inverse_kinematics::Branch;

use crate::pose::placed_machine::*;
use crate::test_scene::{Random, bare_cell, tool};

/// Some point of a solid, table frame, as a function of the axes.
fn corner(machine: &Machine, body: usize, corner: [f64; 3], axes: &AxisValues) -> Option<Point3<f64>> {
    let pose = machine.body_poses(axes).nth(body)?;
    let bounds = pose.body.body.solid.aabb();
    let part = |k: usize| bounds.min[k] + (bounds.max[k] - bounds.min[k]) * corner[k];
    Some(pose.table_from_solid * Point3::new(part(0), part(1), part(2)))
}

#[test]
fn points_of_both_heads_come_no_nearer_than_the_motion_says_while_both_move() {
    let mut random = Random(61);
    let (mut tight, tool) = (0, tool());
    for name in ["dual-c-horizontal-xyzb", "dual-c-horizontal-xzab"] {
        let path = format!("{}/../../assets/machines/{name}.json", env!("CARGO_MANIFEST_DIR"));
        for machine in Machine::heads_from_json(&std::fs::read(path).unwrap()).unwrap() {
            let cell = bare_cell(&machine, &tool, Isometry3::identity());
            let test = PoseTest::new(&cell);
            let of = |c| {
                let all = machine.bodies().iter().enumerate().filter(move |(_, b)| b.carrier() == Some(c));
                all.map(|(k, _)| k).collect::<Vec<_>>()
            };
            let (ours, theirs) = (of(Carrier::Head), of(Carrier::OtherHead));
            let stance = |axes| PlacedMachine::new(&test, &Configuration { axes, branch: Branch::Positive });
            // Head on: the bound is the motion itself.
            let zero = AxisValues::zeros(machine.axes().len());
            let mut nearer = zero;
            for (k, axis) in machine.axes().iter().enumerate() {
                nearer[k] = if axis.letter.as_str().starts_with('Z') { -300.0 } else { 0.0 };
            }
            assert!((stance(zero).of_both_heads_to(&stance(nearer)) - 600.0).abs() < 1e-9);
            for _ in 0..60 {
                let size = 10f64.powf(random.between(-1.5, 0.0));
                let from = AxisValues::from_fn(machine.axes().len(), |k| {
                    let a = &machine.axes()[k];
                    if a.endless { random.between(-3.0, 3.0) } else { random.between(a.min, a.max) }
                });
                let to = AxisValues::from_fn(from.len(), |k| {
                    let is_linear = machine.axes()[k].kind == facemill_inverse_kinematics::AxisKind::Linear;
                    from[k] + size * random.between(-1.0, 1.0) * if is_linear { 400.0 } else { 1.2 }
                });
                let motion = stance(from).of_both_heads_to(&stance(to));
                assert!(stance(from).motion_to(&stance(to)) >= motion);
                for _ in 0..12 {
                    let mut part = || [0; 3].map(|_| random.between(0.0, 1.0));
                    let (a, b) = (part(), part());
                    let pick = random.between(0.0, 1.0);
                    // A point of the tool, or of a body of this head.
                    let own = (pick * (ours.len() + 1) as f64) as usize;
                    let on_tool = Point3::new(30.0 * a[0], 0.0, 170.0 * a[1]);
                    let at = |axes: &AxisValues| match ours.get(own) {
                        Some(&k) => corner(&machine, k, a, axes).unwrap(),
                        None => machine.forward(axes, tool.gauge_length()) * on_tool,
                    };
                    let other = theirs[(random.between(0.0, 1.0) * theirs.len() as f64) as usize];
                    let distance = |axes: &AxisValues| (at(axes) - corner(&machine, other, b, axes).unwrap()).norm();
                    let start = distance(&from);
                    let mut nearest = start;
                    for k in 1..=20 {
                        nearest = nearest.min(distance(&from.lerp(&to, f64::from(k) / 20.0)));
                    }
                    assert!(start - nearest <= motion + 1e-9, "{} beyond {motion}", start - nearest);
                    tight += usize::from(start - nearest > 0.1 * motion);
                }
            }
        }
    }
    assert!(tight > 30, "{tight}");
}
