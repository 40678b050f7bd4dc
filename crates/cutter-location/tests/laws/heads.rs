//! Two heads: bodies of the other head are obstacles of tool, cutter and head.

use facemill_cl_data::{PlacedSolid, Solid};
use facemill_cutter_location::{Body, Hints, Infeasible, PoseTest};
use facemill_inverse_kinematics::{AxisValues, Carrier, Machine};
use facemill_tool_model::ToolAssembly;
use nalgebra::{Isometry3, Point3};

use crate::kit::{Random, tool, workcell};

const PRESETS: [&str; 2] = ["dual-c-horizontal-xyzb", "dual-c-horizontal-xzab"];

fn heads(name: &str) -> Vec<Machine> {
    let path = format!("{}/../../assets/machines/{name}.json", env!("CARGO_MANIFEST_DIR"));
    Machine::heads_from_json(&std::fs::read(path).unwrap()).unwrap()
}

/// Cutter and other bodies of a tool, tool frame.
fn whole(tool: &ToolAssembly) -> Vec<PlacedSolid> {
    let cutter = std::iter::once(tool.cutter().lower_test_body(0.0)).chain(tool.cutter().upper_test_body(0.0));
    let cutter = cutter.map(|f| PlacedSolid {
        name: "the other cutter".to_owned(),
        solid: Solid::Frustum(f),
        frame_from_solid: Isometry3::identity(),
    });
    cutter.chain(tool.collision_bodies()).collect()
}

/// Both tools near each other in the middle between the heads.
fn meeting(machine: &Machine, random: &mut Random) -> AxisValues {
    let [up, aside] = [random.between(-200.0, 200.0), random.between(-500.0, 500.0)];
    AxisValues::from_fn(machine.axes().len(), |k| {
        let mut near = |value: f64, by: f64| value + random.between(-by, by);
        match machine.axes()[k].letter.as_str() {
            "X1" => near(aside, 60.0),
            "X2" => near(-aside, 60.0),
            "Y1" | "Y2" => near(up, 60.0),
            "Z1" | "Z2" => near(-1160.0, 120.0),
            "B1" | "B2" => near(0.0, 0.5),
            "A1" | "A2" => near(0.0, 0.2),
            _ => near(0.0, 3.0),
        }
    })
}

type Placed = (String, Solid, Isometry3<f64>);

/// Points all over a solid as it is dilated, table frame.
fn points_of((_, solid, pose): &Placed, random: &mut Random) -> Vec<Point3<f64>> {
    let bounds = solid.aabb();
    let mut points = Vec::new();
    while points.len() < 400 {
        let p = Point3::from(bounds.min.coords.zip_map(&bounds.max.coords, |a, b| random.between(a, b)));
        if solid.core_distance(&p) <= solid.rounding() {
            points.push(pose * p);
        }
    }
    points
}

/// Returns the greatest depth of sampled points of two bodies in the other one, both dilated;
/// negative outside.
fn depth(a: &Placed, b: &Placed, random: &mut Random) -> f64 {
    let in_other = |points: Vec<Point3<f64>>, (_, solid, pose): &Placed| {
        let depth = |p: &Point3<f64>| solid.rounding() - solid.core_distance(&pose.inverse_transform_point(p));
        points.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
    };
    in_other(points_of(a, random), b).max(in_other(points_of(b, random), a))
}

#[test]
fn what_the_other_head_is_in_the_way_of_is_no_pose() {
    let (mut free, mut hit, mut tools, mut cutters) = (0, 0, 0, 0);
    let mut random = Random(51);
    for name in PRESETS {
        for (h, view) in heads(name).iter().enumerate() {
            let (own, others) = (tool(30.0, 4.0, 30.0), tool(25.0, 2.0, 40.0));
            let machine = view.with_tool_in_other_head(&whole(&others), others.gauge_length());
            let cell = workcell(&machine, &own, vec![]);
            let test = PoseTest::new(&cell);
            for _ in 0..150 {
                let q = meeting(&machine, &mut random);
                let table_from_tool = machine.forward(&q, own.gauge_length());
                let of_head = |c| {
                    let all: Vec<_> = machine.body_poses(&q).filter(|p| p.body.carrier() == Some(c)).collect();
                    all.into_iter().map(|p| (p.body.name().to_owned(), p.body.body.solid.clone(), p.table_from_solid))
                };
                let of_tool = whole(&own).into_iter().map(|b| (b.name, b.solid, table_from_tool * b.frame_from_solid));
                let ours: Vec<Placed> = of_tool.chain(of_head(Carrier::Head)).collect();
                let theirs: Vec<Placed> = of_head(Carrier::OtherHead).collect();
                let mut deepest = f64::NEG_INFINITY;
                for a in &ours {
                    for b in &theirs {
                        deepest = deepest.max(depth(a, b, &mut random));
                    }
                }
                let found = test.collision(&q, &mut Hints::default());
                let against_other = found.as_ref().is_some_and(|why| {
                    let Infeasible::Collision { body, .. } = why else { return false };
                    let text = test.describe(why);
                    let is_other = theirs.iter().any(|b| text.ends_with(&format!(" hits {}", b.0)));
                    cutters += usize::from(is_other && *body == Body::Cutter);
                    tools += usize::from(is_other && text.contains("the other cutter"));
                    is_other
                });
                // Sampled points miss touches of less than their spacing, never the other way
                // round.
                assert!(deepest <= 1e-9 || found.is_some(), "{name} {h}: {deepest} mm deep at {q:?}");
                assert!(deepest > -150.0 || !against_other, "{name} {h}: {deepest} mm at {q:?} {found:?}");
                free += usize::from(deepest <= -150.0);
                hit += usize::from(deepest > 0.0 && against_other);
            }
        }
    }
    assert!(free > 20 && hit > 25 && tools > 5 && cutters > 3, "{free} free, {hit} hit, {tools} tools, {cutters}");
}

#[test]
fn bodies_of_the_other_head_are_tested_against_nothing_of_the_workpiece_here() {
    // A plate that the other head's ram is in, and nothing of this head.
    let views = heads(PRESETS[0]);
    let own = tool(30.0, 4.0, 30.0);
    let mut q = views[0].home();
    for letter in ["Z1", "Z2"] {
        q[views[0].axis_index(letter).unwrap()] = 0.0;
    }
    let mesh = facemill_interference::solid_mesh(&Solid::Box(facemill_cl_data::RoundBox {
        half_extents: nalgebra::Vector3::new(400.0, 400.0, 50.0),
        rounding: 0.0,
    }))
    .unwrap();
    let at = |z: f64| mesh.transformed(&Isometry3::translation(0.0, 0.0, z));
    let collides = |machine: &Machine, z: f64| {
        let tree = facemill_interference::MeshTree::new(&at(z));
        let mut cell = workcell(machine, &own, vec![crate::kit::obstacle("plate", &tree)]);
        cell.table_from_work = Isometry3::identity();
        PoseTest::new(&cell).collision(&q, &mut Hints::default()).is_some()
    };
    // The second head's ram begins at z = −1550 and goes down.
    assert!(!collides(&views[0], -1800.0) && collides(&views[1], -1800.0));
    assert!(collides(&views[0], 2100.0) && !collides(&views[1], 2100.0));
}
