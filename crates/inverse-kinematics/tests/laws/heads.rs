//! Machines with two heads: views of both, separately and together.

use crate::common::*;
use facemill_cl_data::{PlacedSolid, RoundBox, Solid};
use facemill_inverse_kinematics::inverse::{AxisRanges, PoseSet};
use facemill_inverse_kinematics::machine_file::{DhRow, Joint, MachineFile};
use facemill_inverse_kinematics::motion::{Linearisation, MotionTolerance, linearise};
use facemill_inverse_kinematics::path::{PathSettings, SegmentKind, choose_along};
use facemill_inverse_kinematics::*;
use nalgebra::{Isometry3, Matrix4, Vector3};

const TOOL: f64 = 237.0;

/// Returns a machine with one head as the first of two: the second is a copy of it elsewhere, with
/// numbers in its letters.
fn doubled(file: &MachineFile) -> MachineFile {
    let mut file = file.clone();
    let mut second = file.tool_chains[0].clone();
    second.channel = 2;
    second.rows.insert(0, row(900.0, 180.0, 300.0, 20.0));
    for row in &mut second.rows {
        match &mut row.joint {
            Some(Joint::Prismatic(j)) => j.axis.push('2'),
            Some(Joint::Revolute(j)) => j.axis.push('2'),
            None => {}
        }
        row.bodies.clear();
    }
    file.tool_chains.push(second);
    file
}

fn all_pairs() -> Vec<Vec<Machine>> {
    let mut all: Vec<Vec<Machine>> = dual_mills().into_iter().collect();
    for machine in families().iter().chain(&families_of_three_rotaries()) {
        if machine.axes().iter().any(|a| a.carried_by == Carrier::Table)
            && let Ok(heads) = Machine::heads(doubled(&machine.to_file()))
        {
            all.push(heads);
        }
    }
    assert!(all.len() > 20, "{}", all.len());
    all
}

#[test]
fn one_position_goes_to_both_views_and_each_follows_its_own_chain() {
    let mut r = Random(41);
    for heads in all_pairs() {
        assert_eq!(heads.len(), 2);
        let [a, b] = [&heads[0], &heads[1]];
        assert_eq!((a.head(), b.head(), a.channel(), b.channel(), a.head_count()), (0, 1, 1, 2, 2));
        let n = a.axes().len();
        assert_eq!(n, b.axes().len());
        for k in 0..n {
            let [x, y] = [&a.axes()[k], &b.axes()[k]];
            assert_eq!((x.letter, x.min, x.max, x.home), (y.letter, y.min, y.max, y.home));
            assert_eq!(a.moves_tool(k) && b.moves_tool(k), x.carried_by == Carrier::Table);
            assert!(a.moves_tool(k) || b.moves_tool(k));
            assert_eq!((a.is_shared(k), b.is_shared(k)), (x.carried_by == Carrier::Table, a.is_shared(k)));
        }
        for _ in 0..20 {
            let q = random_values(&mut r, a);
            for view in &heads {
                assert_eq!((0..n).filter(|&k| view.moves_tool(k)).count(), 5);
                let meant = forward_by_matrices(view, &q, TOOL);
                assert!((view.forward(&q, TOOL).to_homogeneous() - meant).abs().max() < 1e-9);
                let (cl, meant) = (view.cl_point(&q, TOOL), cl_by_matrices(view, &q, TOOL));
                assert!((cl.tip - meant.tip).norm() < 1e-9 && (*cl.axis - *meant.axis).norm() < 1e-12);
            }
        }
    }
}

#[test]
fn a_view_solves_as_its_head_alone_and_keeps_the_other_ones_axes() {
    let mut r = Random(42);
    let mut solved = [0; 2];
    for heads in all_pairs() {
        for (h, view) in heads.iter().enumerate() {
            let mut file = view.to_file();
            file.tool_chains = vec![file.tool_chains[h].clone()];
            file.assumed.clear();
            let alone = Machine::from_file(file).unwrap();
            let of_alone = |q: &AxisValues| {
                let letter = |k: usize| view.axis_index(alone.axes()[k].letter.as_str()).unwrap();
                AxisValues::from_fn(5, |k| q[letter(k)])
            };
            for _ in 0..12 {
                let (q, reference) = (random_values(&mut r, view), random_values(&mut r, view));
                let cl = view.cl_point(&q, TOOL);
                let check = |found: Result<InverseSolutions, Unreachable>,
                             meant: Result<InverseSolutions, Unreachable>,
                             kept: &AxisValues| {
                    let (Ok(found), Ok(meant)) = (&found, &meant) else {
                        assert_eq!(found.is_ok(), meant.is_ok());
                        return 0;
                    };
                    assert_eq!(found.len(), meant.len());
                    for (f, m) in found.iter().zip(meant.iter()) {
                        assert_eq!((of_alone(&f.values), f.branch), (m.values, m.branch));
                        let others = (0..view.axes().len()).filter(|&k| !view.moves_tool(k));
                        others.for_each(|k| assert_eq!(f.values[k], kept[k]));
                    }
                    found.len()
                };
                let near = of_alone(&reference);
                let n = check(view.inverse(&cl, TOOL), alone.inverse(&cl, TOOL), &view.home());
                solved[h] += n;
                for found in view.inverse(&cl, TOOL).iter().flat_map(|all| all.iter()) {
                    let at = cl_by_matrices(view, &found.values, TOOL);
                    assert!((at.tip - cl.tip).norm() < 2e-9 && (*at.axis - *cl.axis).norm() < 2e-12);
                }
                check(view.inverse_near(&cl, TOOL, &reference), alone.inverse_near(&cl, TOOL, &near), &reference);
                check(view.inverse_unchecked(&cl, TOOL), alone.inverse_unchecked(&cl, TOOL), &view.home());
                let beyond = AxisValues::from_fn(q.len(), |k| if view.moves_tool(k) { reference[k] } else { 1e5 });
                check(view.inverse_near(&cl, TOOL, &beyond), alone.inverse_near(&cl, TOOL, &near), &beyond);
                for previous in [None, Some((&reference, &near))] {
                    let found = view.nearest_inverse(&cl, TOOL, previous.map(|p| p.0), BranchPreference::Nearest);
                    let meant = alone.nearest_inverse(&cl, TOOL, previous.map(|p| p.1), BranchPreference::Nearest);
                    assert_eq!(found.as_ref().map(of_alone), meant.as_ref().copied());
                    let kept = previous.map_or(view.home(), |p| *p.0);
                    if let Ok(found) = found {
                        assert!((0..q.len()).all(|k| view.moves_tool(k) || found[k] == kept[k]));
                    }
                }
                assert_eq!(view.branch_of(&q), alone.branch_of(&of_alone(&q)));
                let (found, meant) = (view.all_solutions(&cl, TOOL), alone.all_solutions(&cl, TOOL));
                let found = found.map(|all| all.iter().map(|s| of_alone(&s.values)).collect::<Vec<_>>());
                assert_eq!(found.ok(), meant.ok().map(|all| all.iter().map(|s| s.values).collect::<Vec<_>>()));
            }
        }
    }
    assert!(solved.iter().all(|&n| n > 300), "{solved:?}");
}

/// Returns the pose of a body by Craig's matrices, table frame; `solid_from` is its pose in its
/// link.
fn body_by_matrices(view: &Machine, body: &MachineBody, q: &AxisValues) -> Matrix4<f64> {
    let file = view.to_file();
    let rows = |carrier| match carrier {
        Carrier::Table => &file.workpiece_chain.rows,
        Carrier::Head => &file.tool_chains[view.head()].rows,
        Carrier::OtherHead => &file.tool_chains[1 - view.head()].rows,
    };
    let bed_from_link = match body.link {
        LinkId::Bed => Matrix4::identity(),
        LinkId::Row { carrier, row } => craig_chain(&rows(carrier)[..=row], view, q),
    };
    let bed_from_table = craig_chain(&file.workpiece_chain.rows, view, q);
    bed_from_table.try_inverse().unwrap() * bed_from_link * body.body.frame_from_solid.to_homogeneous()
}

fn other_tool() -> Vec<PlacedSolid> {
    vec![PlacedSolid {
        name: "cutter of the other head".to_owned(),
        solid: Solid::Box(RoundBox { half_extents: Vector3::new(30.0, 20.0, 10.0), rounding: 1.0 }),
        frame_from_solid: Isometry3::new(Vector3::new(3.0, -4.0, 12.0), Vector3::new(0.3, 0.2, -0.4)),
    }]
}

#[test]
fn bodies_of_the_other_head_and_its_tool_are_where_matrices_put_them() {
    let mut r = Random(43);
    for heads in dual_mills() {
        for (h, view) in heads.iter().enumerate() {
            let view = view.with_tool_in_other_head(&other_tool(), TOOL);
            let count = |view: &Machine, c| view.bodies().iter().filter(|b| b.carrier() == Some(c)).count();
            let other = &heads[1 - h];
            assert_eq!(count(&view, Carrier::OtherHead), count(other, Carrier::Head) + 1);
            assert_eq!(view.bodies().last().unwrap().name(), "cutter of the other head");
            for _ in 0..30 {
                let q = random_values(&mut r, &view);
                let poses: Vec<_> = view.body_poses(&q).collect();
                for at in &poses {
                    let meant = body_by_matrices(&view, at.body, &q);
                    assert!((at.table_from_solid.to_homogeneous() - meant).abs().max() < 1e-9, "{}", at.body.name());
                }
                // Fixed to the other tool, in whichever view.
                let tool = forward_by_matrices(other, &q, TOOL);
                let meant = tool * other_tool()[0].frame_from_solid.to_homogeneous();
                let at = poses.last().unwrap().table_from_solid.to_homogeneous();
                assert!((at - meant).abs().max() < 1e-9);
                // The other view has the same bodies at the same places.
                for theirs in other.body_poses(&q) {
                    let ours = poses.iter().find(|p| p.body.name() == theirs.body.name()).unwrap();
                    let off = ours.table_from_solid.to_homogeneous() - theirs.table_from_solid.to_homogeneous();
                    assert!(off.abs().max() < 1e-9);
                }
            }
        }
    }
}

#[test]
fn joints_between_bodies_are_those_whose_motion_moves_one_against_the_other() {
    let mut r = Random(44);
    for heads in dual_mills() {
        for view in &heads {
            let view = &view.with_tool_in_other_head(&other_tool(), TOOL);
            let q = random_values(&mut r, view);
            let moved: Vec<AxisValues> = (0..q.len())
                .map(|k| AxisValues::from_fn(q.len(), |i| if i == k { q[i] + 0.2 } else { q[i] }))
                .collect();
            let differs =
                |a: Isometry3<f64>, b: Isometry3<f64>| (a.to_homogeneous() - b.to_homogeneous()).abs().max() > 1e-6;
            let pose = |q: &AxisValues, k: usize| view.body_poses(q).nth(k).unwrap().table_from_solid;
            for a in 0..view.bodies().len() {
                let relative = |q: &AxisValues, b| pose(q, a).inverse() * pose(q, b);
                for b in 0..view.bodies().len() {
                    let n = moved.iter().filter(|to| differs(relative(&q, b), relative(to, b))).count();
                    assert_eq!(view.joints_between(a, b), n, "{} {}", view.bodies()[a].name(), view.bodies()[b].name());
                }
                let against = |from: &dyn Fn(&AxisValues) -> Isometry3<f64>| {
                    moved.iter().filter(|to| differs(from(&q), from(to))).count()
                };
                assert_eq!(view.joints_to_tool(a), against(&|q| pose(q, a).inverse() * view.forward(q, TOOL)));
                assert_eq!(view.bodies()[a].joints_from_table(), against(&|q| pose(q, a)));
            }
        }
    }
}

#[test]
fn both_tools_face_each_other_at_the_zero_pose() {
    for heads in dual_mills() {
        let zero = AxisValues::zeros(heads[0].axes().len());
        for (view, along) in heads.iter().zip([1.0, -1.0]) {
            assert!((*view.cl_point(&zero, 0.0).axis - Vector3::z() * along).norm() < 1e-12);
            // Z points toward the spindle, and X and Y, where there is a Y, make a right-handed
            // frame with it.
            let has_y = view.axes().iter().any(|a| a.letter.as_str().starts_with('Y'));
            let frame = view.work_coordinates(&zero);
            assert_eq!(frame.is_some(), has_y);
            let z = frame.map_or(Vector3::z() * along, |f| f.rotation * Vector3::z());
            assert!((z - Vector3::z() * along).norm() < 1e-9);
        }
    }
}

fn refusal(change: impl FnOnce(&mut MachineFile)) -> String {
    let mut file = dual_mills()[0][0].to_file();
    file.assumed.clear();
    change(&mut file);
    Machine::heads(file).unwrap_err().to_string()
}

fn set_axis(row: &mut DhRow, to: &str) {
    match &mut row.joint {
        Some(Joint::Prismatic(j)) => j.axis = to.to_owned(),
        Some(Joint::Revolute(j)) => j.axis = to.to_owned(),
        None => panic!("a row without a joint"),
    }
}

#[test]
fn what_two_heads_cannot_mean_is_refused_by_name() {
    let file = dual_mills()[0][0].to_file();
    let one = Machine::from_file(file.clone()).unwrap_err();
    assert_eq!(one, MachineError::TwoHeads);
    assert!(one.to_string().contains("Machine::heads"), "{one}");
    let no_head = refusal(|f| f.tool_chains.clear());
    assert!(no_head.starts_with("tool_chains has 0 chains"), "{no_head}");
    let three = refusal(|f| f.tool_chains.push(f.tool_chains[1].clone()));
    assert!(three.starts_with("tool_chains has 3 chains; machines have one head here, or two"), "{three}");
    // The same letter in both heads.
    let twice = refusal(|f| set_axis(&mut f.tool_chains[1].rows[2], "Z1"));
    assert!(twice.starts_with("tool_chains[1].rows[2].joint (axis Z1): is the address of another joint"), "{twice}");
    // The shared axis once more in a head.
    let shared = refusal(|f| set_axis(&mut f.tool_chains[0].rows[3], "C"));
    assert!(shared.starts_with("tool_chains[0].rows[3].joint (axis C): "), "{shared}");
    assert!(shared.contains("workpiece_chain alone"), "{shared}");
    // One axis too few in one head.
    let few = refusal(|f| f.tool_chains[1].rows[1].joint = None);
    assert!(few.starts_with("tool_chains[1] and workpiece_chain together have 2 linear and 2 rotary joints"), "{few}");
    // Five axes in each head and none of the workpiece.
    let unshared = refusal(|f| {
        let c = f.workpiece_chain.rows.iter().find(|r| r.joint.is_some()).unwrap().clone();
        f.workpiece_chain.rows.retain(|r| r.joint.is_none());
        for (k, chain) in f.tool_chains.iter_mut().enumerate() {
            let mut own = c.clone();
            set_axis(&mut own, &format!("C{}", k + 1));
            chain.rows.insert(0, own);
        }
    });
    assert!(unshared.starts_with("workpiece_chain has no joint, so the two heads share no axis"), "{unshared}");
    // One head is as before.
    let alone = Machine::head_b_table_c().unwrap();
    assert_eq!(Machine::heads(alone.to_file()).unwrap(), std::slice::from_ref(&alone));
    assert_eq!((alone.head(), alone.channel(), alone.head_count()), (0, 1, 1));
    assert!((0..5).all(|k| alone.moves_tool(k) && !alone.is_shared(k)));
    assert_eq!(alone.with_tool_in_other_head(&other_tool(), TOOL), alone);
}

/// Returns the largest way of sampled points of a solid, given its pose before and after.
fn largest_way(solid: &Solid, from: &Isometry3<f64>, to: &Isometry3<f64>, r: &mut Random) -> f64 {
    let bounds = solid.aabb();
    let mut largest = 0.0_f64;
    for k in 0..16 {
        let part = |i: usize, r: &mut Random| if k < 8 { (k >> i & 1) as f64 } else { r.between(0.0, 1.0) };
        let p = nalgebra::Point3::from(Vector3::from_fn(|i, _| {
            bounds.min[i] + (bounds.max[i] - bounds.min[i]) * part(i, r)
        }));
        // Corners of the box of a round body are outside of it.
        if solid.core_distance(&p) <= solid.rounding() + 1e-9 {
            largest = largest.max((from * p - to * p).norm());
        }
    }
    largest
}

#[test]
fn no_body_moves_farther_on_the_bed_than_its_way_says() {
    let mut r = Random(45);
    let mut sharp = 0;
    let mut machines: Vec<Machine> = dual_mills().into_iter().flatten().collect();
    machines.push(Machine::head_b_table_c().unwrap());
    for view in &machines {
        let file = view.to_file();
        let bed_from_table = |q: &AxisValues| {
            let m = craig_chain(&file.workpiece_chain.rows, view, q);
            nalgebra::try_convert::<Matrix4<f64>, Isometry3<f64>>(m).unwrap()
        };
        for _ in 0..25 {
            let (from, size) = (random_values(&mut r, view), 10f64.powf(r.between(-2.0, 0.0)));
            let unit = |k: usize| if view.axes()[k].kind == AxisKind::Linear { 500.0 } else { 1.5 };
            let to = AxisValues::from_fn(from.len(), |k| from[k] + size * unit(k) * r.between(-1.0, 1.0));
            for (index, body) in view.bodies().iter().enumerate() {
                let bound = view.body_way_on_bed(index, &from, &to);
                let at = |q: &AxisValues| bed_from_table(q) * view.body_poses(q).nth(index).unwrap().table_from_solid;
                for t in [0.3, 0.7, 1.0] {
                    let way = largest_way(&body.body.solid, &at(&from), &at(&from.lerp(&to, t)), &mut r);
                    assert!(way <= bound + 1e-9, "{}: {way} beyond {bound}", body.name());
                    sharp += usize::from(way > 0.6 * bound && way > 0.0);
                }
            }
            let reach = 200.0;
            let bound = view.tool_way_on_bed(&from, &to, TOOL, reach);
            let at = |q: &AxisValues| bed_from_table(q) * view.forward(q, TOOL);
            for t in [0.5, 1.0] {
                for _ in 0..10 {
                    let p = nalgebra::Point3::from(r.direction().into_inner() * reach);
                    let way = (at(&from) * p - at(&from.lerp(&to, t)) * p).norm();
                    assert!(way <= bound + 1e-9, "{way} beyond {bound}");
                }
            }
        }
    }
    assert!(sharp > 300, "{sharp}");
}

#[test]
fn bodies_of_the_other_head_move_no_farther_than_over_a_box_of_its_axes() {
    let mut r = Random(46);
    let mut checked = 0;
    let [closed, _] = dual_mills();
    for view in &closed {
        for _ in 0..60 {
            let q = random_values(&mut r, view);
            let set = PoseSet { cl: view.cl_point(&q, TOOL), turn: r.between(0.0, 0.05), shift: r.between(0.0, 5.0) };
            let AxisRanges::Both(ranges) = view.axis_ranges(&set, TOOL) else { continue };
            for mut range in ranges {
                let others = || (0..q.len()).filter(|&k| !view.moves_tool(k));
                for k in others() {
                    assert_eq!((range.middle[k], range.half[k]), (view.home()[k], 0.0));
                    let is_linear = view.axes()[k].kind == AxisKind::Linear;
                    range.middle[k] = q[k];
                    range.half[k] = r.between(0.0, if is_linear { 30.0 } else { 0.2 });
                }
                // Any axis values in the box with the tool in the set.
                let mut cl = set.cl;
                cl.tip += r.direction().into_inner() * r.between(0.0, set.shift);
                let mut at = AxisValues::from_fn(q.len(), |k| range.middle[k] + range.half[k] * r.between(-1.0, 1.0));
                let Ok(all) = view.inverse_near(&cl, TOOL, &at) else { continue };
                let Some(own) = all.on_branch(range.branch) else { continue };
                at = own.values;
                for (k, body) in view.bodies().iter().enumerate() {
                    let travel = view.body_travel(k, &range, &set, TOOL);
                    let pose = |q: &AxisValues| view.body_poses(q).nth(k).unwrap().table_from_solid;
                    let way = largest_way(&body.body.solid, &pose(&range.middle), &pose(&at), &mut r);
                    assert!(way <= travel, "{}: {way} beyond {travel}", body.name());
                    checked += usize::from(body.carrier() == Some(Carrier::OtherHead) && way > 1.0);
                }
            }
        }
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn paths_and_lines_leave_the_other_head_where_it_was() {
    let mut r = Random(47);
    for heads in dual_mills() {
        for view in &heads {
            let start = random_values(&mut r, view);
            let kept = |q: &AxisValues| (0..q.len()).all(|k| view.moves_tool(k) || q[k] == start[k]);
            let mut near = view.home();
            for k in (0..near.len()).filter(|&k| view.moves_tool(k)) {
                let axis = &view.axes()[k];
                near[k] = match (axis.kind, axis.letter.as_str().starts_with('Z')) {
                    (AxisKind::Linear, true) => -700.0,
                    (AxisKind::Linear, false) => 100.0,
                    _ => 0.3,
                };
            }
            let poses: Vec<_> = (0..6)
                .map(|i| {
                    let mut q = near;
                    for k in (0..q.len()).filter(|&k| view.moves_tool(k)) {
                        let by = if view.axes()[k].kind == AxisKind::Linear { 20.0 } else { 0.03 };
                        q[k] += by * f64::from(i);
                    }
                    view.cl_point(&q, TOOL)
                })
                .collect();
            let settings = PathSettings::new(view);
            let segments = vec![SegmentKind::Cut; poses.len() - 1];
            let choice = choose_along(view, &poses, &segments, Some(&start), TOOL, &settings).unwrap();
            assert!(choice.values.iter().all(kept) && choice.breaks.is_empty());
            let at_home = choose_along(view, &poses, &segments, None, TOOL, &settings).unwrap();
            let home = view.home();
            assert!(at_home.values.iter().all(|q| (0..9).all(|k| view.moves_tool(k) || q[k] == home[k])));
            // The cost of the other head does not affect the path.
            let mut free = settings;
            (0..9).filter(|&k| !view.moves_tool(k)).for_each(|k| free.weights[k] = 0.0);
            let unweighted = choose_along(view, &poses, &segments, Some(&start), TOOL, &free).unwrap();
            assert_eq!(unweighted, choice);
            let tolerance = MotionTolerance { tip: 0.05, axis: 1e-3, rim: f64::INFINITY, radius: 0.0 };
            let law = BlockLaw::Cutting(facemill_cl_data::CuttingLaw::AxesLinear);
            let way =
                linearise(view, &poses, &start, &Linearisation { law, tool_length: TOOL, tolerance, max_between: 500 });
            assert!(way.unwrap().positions.iter().all(kept));
        }
    }
}
