use facemill_inverse_kinematics::Axis;
use facemill_test_kit::Random;

use crate::program_time::tolerance::*;

/// Every machine of the collection, as each of its heads sees it.
fn machines() -> Vec<Vec<Machine>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/machines");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| Machine::heads_from_json(&std::fs::read(f).unwrap()).unwrap()).collect()
}

fn position(random: &mut Random, axes: &[Axis]) -> AxisValues {
    AxisValues::from_fn(axes.len(), |k| {
        let free = axes[k].endless || axes[k].max - axes[k].min > 1e9;
        let (low, high) = if free { (-3.0, 3.0) } else { (axes[k].min, axes[k].max) };
        random.between(low, high)
    })
}

fn run(positions: &[AxisValues]) -> MotionRun {
    let block = |end: &AxisValues| ProgramBlock { end: *end, tip_time: 0.0, exact_stop: false };
    let blocks = positions[1..].iter().map(block).collect();
    MotionRun { start: positions[0], blocks, is_rapid: false, vectors: Vec::new() }
}

#[test]
fn axes_within_the_tolerance_take_no_tip_and_no_tool_axis_farther_than_the_control_may() {
    let mut random = Random(11);
    let given = ControlTolerance { path: 0.02, orientation: 3e-4 };
    for heads in machines() {
        let axes = heads[0].axes();
        let views: Vec<MachineView<'_>> = heads.iter().map(|m| (m, 180.0)).collect();
        let positions: Vec<AxisValues> = (0..4).map(|_| position(&mut random, axes)).collect();
        let levers: Vec<Levers> = views.iter().map(|view| Levers::over(*view, &run(&positions))).collect();
        let most = blend_tolerance(given, &views, &levers, &vec![true; axes.len()]).unwrap();
        let mut worst = [0.0_f64; 2];
        for _ in 0..4000 {
            let move_index = (random.between(0.0, 3.0) as usize).min(2);
            let at = positions[move_index].lerp(&positions[move_index + 1], random.between(0.0, 1.0));
            let strayed = AxisValues::from_fn(axes.len(), |k| {
                at[k] + if random.between(0.0, 1.0) < 0.5 { most[k] } else { -most[k] }
            });
            for (machine, length) in &views {
                let (a, b) = (machine.cl_point(&at, *length), machine.cl_point(&strayed, *length));
                worst[0] = worst[0].max((b.tip - a.tip).norm() / given.path);
                worst[1] = worst[1].max(a.axis.cross(&b.axis).norm().asin() / given.orientation);
            }
        }
        assert!(worst.iter().all(|w| *w <= 1.0), "{}: {worst:?}", heads[0].name());
        // Not far from it either: signs and levers are seldom the worst at once.
        assert!(worst[0] > 0.5, "{}: {worst:?}", heads[0].name());
    }
}

/// The tip reaches the whole tolerance where two linear axes move, at a corner of what both may
/// stray by.
#[test]
fn linear_axes_have_the_whole_tolerance_where_no_rotary_axis_moves() {
    let given = ControlTolerance { path: 0.02, orientation: 3e-4 };
    let machine = Machine::head_b_table_c().unwrap();
    let (home, views) = (machine.home(), [(&machine, 100.0)]);
    let mut end = home;
    let straying: Vec<usize> = (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Linear).take(2).collect();
    straying.iter().for_each(|&k| end[k] += 10.0);
    let run = run(&[home, end]);
    let levers = [Levers::over(views[0], &run)];
    let most = blend_tolerance(given, &views, &levers, &moving(&machine, &run)).unwrap();
    let mut strayed = home;
    straying.iter().for_each(|&k| strayed[k] += most[k]);
    let tip = |at: &AxisValues| machine.cl_point(at, 100.0).tip;
    assert!(((tip(&strayed) - tip(&home)).norm() - given.path).abs() < 1e-12);
    // The least turn of a rotary axis takes half of it.
    end[3] += 1e-9;
    end[4] += 1e-9;
    let turning = super::tests::run(&[home, end]);
    let half = blend_tolerance(given, &views, &levers, &moving(&machine, &turning)).unwrap();
    assert!(straying.iter().all(|&k| (half[k] - 0.01 / 3f64.sqrt()).abs() < 1e-12));
}

#[test]
fn levers_between_positions_are_never_longer_than_stated() {
    let mut random = Random(5);
    for heads in machines() {
        let view = (&heads[0], 180.0);
        let ends = [position(&mut random, heads[0].axes()), position(&mut random, heads[0].axes())];
        let Levers(reported) = Levers::over(view, &run(&ends));
        for k in 0..=2000 {
            let at = levers_at(view, &ends[0].lerp(&ends[1], f64::from(k) / 2000.0));
            for axis in 0..at.len() {
                assert!(at[axis] <= reported[axis] && reported[axis] < 1e5, "{}: {at:?} {reported:?}", heads[0].name());
            }
        }
    }
}

#[test]
fn no_tolerance_is_a_stop_at_every_corner() {
    let machine = Machine::head_b_table_c().unwrap();
    let views = [(&machine, 100.0)];
    let levers = [Levers::over(views[0], &run(&[machine.home(), machine.home()]))];
    for (path, orientation) in [(0.0, 0.0), (0.01, 0.0), (0.0, 1e-3)] {
        assert!(blend_tolerance(ControlTolerance { path, orientation }, &views, &levers, &[true; 5]).is_none());
    }
}
