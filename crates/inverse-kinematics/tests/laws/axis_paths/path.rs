//! Branch and winding along a path: the fewest changes, compared with all sequences one by one.

use std::f64::consts::{PI, TAU};

use crate::common::*;
use facemill_cl_data::ClPoint;
use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
use facemill_inverse_kinematics::path::{Change, PathChoice, PathError, PathSettings, SegmentKind, choose_along};
use facemill_inverse_kinematics::*;
use nalgebra::{Point3, Unit, Vector3};

const LENGTH: f64 = 90.0;

fn choose(machine: &Machine, poses: &[ClPoint], segments: &[SegmentKind]) -> Result<PathChoice, PathError> {
    choose_along(machine, poses, segments, None, LENGTH, &PathSettings::new(machine))
}

fn cuts(poses: &[ClPoint]) -> Vec<SegmentKind> {
    vec![SegmentKind::Cut; poses.len() - 1]
}

/// Returns the machine with rotary axes limited to these degrees, or endless ones.
fn with_range(machine: &Machine, letters: &[&str], limits: Option<(f64, f64)>) -> Machine {
    let mut file = machine.to_file();
    let rows = file.workpiece_chain.rows.iter_mut().chain(&mut file.tool_chains[0].rows);
    for joint in rows.filter_map(|row| row.joint.as_mut()) {
        if let Joint::Revolute(joint) = joint
            && letters.contains(&joint.axis.as_str())
        {
            joint.range = match limits {
                Some((min_deg, max_deg)) => RevoluteRange::Limited { min_deg, max_deg },
                None => RevoluteRange::Endless,
            };
        }
    }
    Machine::from_file(file).unwrap()
}

/// Checks that every position of the result is at its pose, by Craig's matrices, and within the
/// limits.
fn assert_reaches(machine: &Machine, poses: &[ClPoint], choice: &PathChoice) {
    assert_eq!(choice.values.len(), poses.len());
    for (cl, q) in poses.iter().zip(&choice.values) {
        let at = cl_by_matrices(machine, q, LENGTH);
        assert!((at.tip - cl.tip).norm() < 1.01e-9, "{} {q:?}", (at.tip - cl.tip).norm());
        assert!((*at.axis - *cl.axis).norm() < 3e-12, "{q:?}");
        assert_eq!(machine.first_beyond_limit(q), None);
    }
}

/// Tool axis leaning by `tilt` toward `azimuth`, tip on a circle of 100 mm below it.
fn leaning(tilt: f64, azimuth: f64) -> ClPoint {
    let (sin, cos) = tilt.sin_cos();
    let axis = Unit::new_normalize(Vector3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos));
    ClPoint { tip: Point3::new(100.0 * azimuth.cos(), 100.0 * azimuth.sin(), 50.0 + azimuth), axis }
}

/// Follows a solution in the slow obvious way, through 300 places of the ideal motion; `None` where
/// a step is too large to be sure, or the tool axis comes within 1° of the pole, which such steps
/// jump over.
fn followed_slowly(machine: &Machine, from: &ClPoint, to: &ClPoint, start: &AxisValues) -> Option<AxisValues> {
    let angle = from.axis.angle(&to.axis);
    let first = machine.joint_lines().into_iter().find(|l| l.kind == AxisKind::Rotary).unwrap().direction;
    let mut q = *start;
    for k in 1..=300 {
        let t = f64::from(k) / 300.0;
        let axis = from.axis.into_inner() * ((1.0 - t) * angle).sin() + to.axis.into_inner() * (t * angle).sin();
        let cl = ClPoint { tip: from.tip + (to.tip - from.tip) * t, axis: Unit::new_normalize(axis) };
        let cl = if k == 300 { *to } else { cl };
        if first.cross(&cl.axis).norm() < 0.02 {
            return None;
        }
        let all = machine.inverse_unchecked(&cl, LENGTH).ok()?;
        let turned = all.iter().map(|s| {
            let mut values = s.values;
            let mut most = 0.0_f64;
            for k in (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary) {
                values[k] += TAU * ((q[k] - values[k]) / TAU).round();
                most = most.max((values[k] - q[k]).abs());
            }
            (most, values)
        });
        let mut turned: Vec<_> = turned.collect();
        turned.sort_by(|a, b| a.0.total_cmp(&b.0));
        if turned[0].0 > 0.1 || turned.get(1).is_some_and(|second| second.0 < 3.0 * turned[0].0) {
            return None;
        }
        q = turned[0].1;
    }
    Some(q)
}

type Cost = (usize, usize, f64);

/// Returns the cheapest of all sequences, one by one; `None` where the slow version of following
/// cannot be sure.
fn cheapest_of_all(machine: &Machine, poses: &[ClPoint], segments: &[SegmentKind]) -> Option<Cost> {
    let layers: Vec<Vec<AxisValues>> =
        poses.iter().map(|cl| machine.all_solutions(cl, LENGTH).unwrap().iter().map(|s| s.values).collect()).collect();
    let mut edges: Vec<Vec<Vec<Cost>>> = Vec::new();
    for (k, segment) in segments.iter().enumerate() {
        let mut of_segment = Vec::new();
        for from in &layers[k] {
            let end = followed_slowly(machine, &poses[k], &poses[k + 1], from)?;
            let edge = |to: &AxisValues| {
                let goes_on =
                    (0..5).all(|k| machine.axes()[k].kind == AxisKind::Linear || (to[k] - end[k]).abs() < 1e-5);
                let time = machine.travel_time(from, to);
                match (goes_on, segment) {
                    (true, _) => (0, 0, time),
                    (false, SegmentKind::Cut) => (1, 0, time),
                    (false, SegmentKind::Link) => (0, 1, time),
                }
            };
            of_segment.push(layers[k + 1].iter().map(edge).collect());
        }
        edges.push(of_segment);
    }
    let mut best = (usize::MAX, 0, 0.0);
    let mut at = vec![0; layers.len()];
    loop {
        let mut sum = (0, 0, 0.0);
        for (k, edges) in edges.iter().enumerate() {
            let edge = edges[at[k]][at[k + 1]];
            sum = (sum.0 + edge.0, sum.1 + edge.1, sum.2 + edge.2);
        }
        if sum < best {
            best = sum;
        }
        let Some(k) = (0..at.len()).find(|&k| at[k] + 1 < layers[k].len()) else { return Some(best) };
        at[k] += 1;
        at[..k].fill(0);
    }
}

/// A path of few poses that drifts on with one rotary axis and so winds up.
fn short_path(machine: &Machine, random: &mut Random, step: f64) -> (Vec<ClPoint>, Vec<SegmentKind>) {
    let mut q = random_values(random, machine);
    let rotary: Vec<usize> = (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary).collect();
    let drifting = rotary[random.below(rotary.len())];
    let mut poses = Vec::new();
    let mut segments = Vec::new();
    for k in 0..5 {
        for j in 0..5 {
            q[j] += match machine.axes()[j].kind {
                AxisKind::Linear => random.between(-30.0, 30.0),
                AxisKind::Rotary if j == drifting => random.between(0.5 * step, step),
                AxisKind::Rotary => random.between(-0.1 * step, 0.1 * step),
            };
            if machine.axes()[j].kind == AxisKind::Linear {
                q[j] = q[j].clamp(machine.axes()[j].min, machine.axes()[j].max);
            }
        }
        poses.push(machine.cl_point(&q, LENGTH));
        if k > 0 {
            segments.push([SegmentKind::Cut, SegmentKind::Link][usize::from(random.below(3) == 0)]);
        }
    }
    (poses, segments)
}

#[test]
fn no_other_sequence_is_cheaper() {
    let mut random = Random(41);
    let (mut n_compared, mut n_breaks, mut n_turns) = (0, 0, 0);
    let machines: Vec<(Machine, f64, usize)> = families()
        .into_iter()
        .map(|m| (m, 0.9, 24))
        .chain(families_of_three_rotaries().into_iter().step_by(4).map(|m| (m, 0.2, 5)))
        .collect();
    for (machine, step, n_paths) in &machines {
        let most = random.between(185.0, 230.0);
        let machine = with_range(machine, &["A", "B", "C"], Some((-most, most + 20.0)));
        for _ in 0..*n_paths {
            let (poses, segments) = short_path(&machine, &mut random, *step);
            let n_sequences: usize =
                poses.iter().map(|cl| machine.all_solutions(cl, LENGTH).map_or(0, |all| all.len())).product();
            if n_sequences == 0 || n_sequences > 200_000 {
                continue;
            }
            let Some(expected) = cheapest_of_all(&machine, &poses, &segments) else { continue };
            let choice = choose(&machine, &poses, &segments).unwrap();
            let found = (choice.breaks.len(), choice.link_turns.len());
            assert_eq!(found, (expected.0, expected.1), "{:?}", machine.family());
            let time: f64 = choice.values.windows(2).map(|w| machine.travel_time(&w[0], &w[1])).sum();
            assert!(
                (choice.weighted_time - expected.2).abs() < 1e-9 * (1.0 + expected.2),
                "{} {}",
                choice.weighted_time,
                expected.2
            );
            assert!((time - expected.2).abs() < 1e-9 * (1.0 + time));
            assert_reaches(&machine, &poses, &choice);
            n_compared += 1;
            n_breaks += found.0;
            n_turns += found.1;
        }
    }
    println!("{n_compared} compared, {n_breaks} breaks, {n_turns} turns on links");
    assert!(n_compared > 100 && n_breaks > 20 && n_turns > 10, "{n_compared} {n_breaks} {n_turns}");
}

/// A path that begins at a solution keeps it, and the best of them needs as few changes as a free
/// one.
#[test]
fn a_path_begins_with_the_solution_that_it_is_given() {
    let mut random = Random(44);
    let (mut n, mut n_worse) = (0, 0);
    for machine in families() {
        let machine = with_range(&machine, &["A", "B", "C"], Some((-210.0, 250.0)));
        for _ in 0..10 {
            let (poses, segments) = short_path(&machine, &mut random, 0.9);
            let Ok(free) = choose(&machine, &poses, &segments) else { continue };
            let changes = |choice: &PathChoice| (choice.breaks.len(), choice.link_turns.len());
            let settings = PathSettings { begins_at_start: true, ..PathSettings::new(&machine) };
            let mut all = Vec::new();
            for start in machine.all_solutions(&poses[0], LENGTH).unwrap().iter().map(|s| s.values) {
                let choice = choose_along(&machine, &poses, &segments, Some(&start), LENGTH, &settings).unwrap();
                for k in (0..5).filter(|&k| machine.axes()[k].kind == AxisKind::Rotary) {
                    let turns = (choice.values[0][k] - start[k]) / TAU;
                    assert!((turns - turns.round()).abs() < 1e-6, "{start:?} {:?}", choice.values[0]);
                }
                all.push(changes(&choice));
            }
            assert_eq!(all.iter().min(), Some(&changes(&free)));
            n += 1;
            n_worse += usize::from(all.iter().max() > Some(&changes(&free)));
        }
    }
    assert!(n > 100 && n_worse > 20, "{n} {n_worse}");
}

#[test]
fn a_path_and_its_reverse_cost_the_same() {
    let mut random = Random(42);
    let mut n = 0;
    for machine in families() {
        let machine = with_range(&machine, &["A", "B", "C"], Some((-210.0, 250.0)));
        for _ in 0..10 {
            let (mut poses, mut segments) = short_path(&machine, &mut random, 0.9);
            let Ok(there) = choose(&machine, &poses, &segments) else { continue };
            poses.reverse();
            segments.reverse();
            let back = choose(&machine, &poses, &segments).unwrap();
            assert_eq!(there.breaks.len(), back.breaks.len());
            assert_eq!(there.link_turns.len(), back.link_turns.len());
            assert!((there.weighted_time - back.weighted_time).abs() < 1e-9 * (1.0 + there.weighted_time));
            n += 1;
        }
    }
    assert!(n > 100, "{n}");
}

/// A spiral of whole turns with a pose every 5°, and links behind the poses at these turns.
fn spiral(turns: usize, links_at: &[usize]) -> (Vec<ClPoint>, Vec<SegmentKind>) {
    let poses: Vec<ClPoint> = (0..=72 * turns).map(|k| leaning(0.35, TAU * k as f64 / 72.0)).collect();
    let mut segments = cuts(&poses);
    for turn in links_at {
        segments[72 * turn] = SegmentKind::Link;
    }
    (poses, segments)
}

/// C at ±200° turns 400° without a change, and 360° more with each: a rewind is a whole turn, as is
/// a flip at most.
#[test]
fn a_limited_table_rewinds_no_oftener_than_it_has_to_and_on_links_where_there_are_any() {
    let machine = with_range(&Machine::head_b_table_c().unwrap(), &["C"], Some((-200.0, 200.0)));
    for turns in 1..=5_usize {
        let fewest = (360 * turns).saturating_sub(400).div_ceil(360);
        let (poses, segments) = spiral(turns, &[]);
        let choice = choose(&machine, &poses, &segments).unwrap();
        assert_eq!((choice.breaks.len(), choice.link_turns.len()), (fewest, 0), "{turns}");
        assert_reaches(&machine, &poses, &choice);
        let all: Vec<usize> = (1..turns).collect();
        let (poses, segments) = spiral(turns, &all);
        let choice = choose(&machine, &poses, &segments).unwrap();
        assert_eq!((choice.breaks.len(), choice.link_turns.len()), (0, fewest), "{turns}");
        for turn in &choice.link_turns {
            assert_eq!(segments[turn.segment], SegmentKind::Link);
            let c = machine.axis_index("C").unwrap();
            let way = choice.values[turn.segment + 1][c] - choice.values[turn.segment][c];
            match turn.change {
                Change::Rewind { axis, turns } => {
                    assert_eq!((axis, turns.abs()), (c, 1));
                    assert!((way.abs() - TAU).abs() < 0.1, "{way}");
                }
                other => panic!("{other:?}: a flip of 180° is not enough"),
            }
        }
    }
    // One link, where it does not help the first two of three turns.
    let (poses, segments) = spiral(3, &[2]);
    let choice = choose(&machine, &poses, &segments).unwrap();
    assert_eq!((choice.breaks.len(), choice.link_turns.len()), (1, 1));
}

#[test]
fn an_endless_axis_never_rewinds() {
    let machine = Machine::head_b_table_c().unwrap();
    let c = machine.axis_index("C").unwrap();
    let (poses, segments) = spiral(5, &[2]);
    let mut start = machine.home();
    start[c] = -30.0;
    let choice = choose_along(&machine, &poses, &segments, Some(&start), LENGTH, &PathSettings::new(&machine)).unwrap();
    assert_eq!((choice.breaks.len(), choice.link_turns.len()), (0, 0));
    let [first, last] = [choice.values[0][c], choice.values[poses.len() - 1][c]];
    assert!(((last - first).abs() - 5.0 * TAU).abs() < 1e-9);
    assert!((first - start[c]).abs() <= PI + 1e-9);
    assert_reaches(&machine, &poses, &choice);
}

/// Tool axes from −10° to 10° in one plane, passing the pole at a distance.
fn past_the_pole(distance: f64, n: usize) -> Vec<ClPoint> {
    (0..=n)
        .map(|k| {
            let x = 10.0_f64.to_radians() * (2.0 * k as f64 / n as f64 - 1.0);
            let axis = Unit::new_normalize(Vector3::new(x.tan(), distance.tan(), 1.0));
            ClPoint { tip: Point3::new(k as f64, 0.0, 0.0), axis }
        })
        .collect()
}

#[test]
fn poses_in_the_singular_cone_are_reported_with_the_turn_they_ask_for() {
    let machine = Machine::head_b_table_c().unwrap();
    let c = machine.axis_index("C").unwrap();
    for distance in [1e-2, 1e-4, 1e-8] {
        let poses = past_the_pole(distance, 40);
        let choice = choose(&machine, &poses, &cuts(&poses)).unwrap();
        assert_eq!((choice.breaks.len(), choice.free_turns.len()), (0, 0), "{distance}");
        // The tool never reaches the other side of B: C has to turn round.
        let turned = (choice.values[40][c] - choice.values[0][c]).abs();
        let expected = 2.0 * (10.0_f64.to_radians().tan() / distance.tan()).atan();
        assert!((turned - expected).abs() < 1e-6, "{distance}: {turned}");
        assert_eq!(choice.singular.len(), 1);
        let stretch = choice.singular[0];
        assert!((stretch.smallest_angle - distance).abs() < 1e-6 * distance + 1e-12);
        let inside = |k: &usize| poses[*k].axis.xy().norm().atan2(poses[*k].axis.z) <= 5.0_f64.to_radians();
        let ends = ((0..=40).find(inside).unwrap(), (0..=40).rfind(inside).unwrap());
        assert_eq!((stretch.first, stretch.last), ends);
        let fastest = choice.values.windows(2).map(|w| (w[1][c] - w[0][c]).abs()).fold(0.0, f64::max);
        assert!((stretch.largest_speed - fastest).abs() < 1e-9, "{}", stretch.largest_speed);
        assert_reaches(&machine, &poses, &choice);
    }
}

#[test]
fn straight_through_the_pole_the_axes_go_on_evenly() {
    let machine = Machine::head_b_table_c().unwrap();
    let [b, c] = ["B", "C"].map(|l| machine.axis_index(l).unwrap());
    // With a pose at the pole and without.
    for n in [40, 41] {
        let poses = past_the_pole(0.0, n);
        let choice = choose(&machine, &poses, &cuts(&poses)).unwrap();
        assert_eq!((choice.breaks.len(), choice.free_turns.len()), (0, 0));
        for w in choice.values.windows(2) {
            assert!((w[1][c] - w[0][c]).abs() < 1e-6, "{n} {w:?}");
            assert!((w[1][b] - w[0][b]).abs() < 0.01);
        }
        assert_reaches(&machine, &poses, &choice);
    }
}

#[test]
fn a_free_axis_turns_evenly_in_its_stretch_and_only_there() {
    let machine = with_range(&Machine::head_b_table_c().unwrap(), &["C"], Some((-200.0, 200.0)));
    let c = machine.axis_index("C").unwrap();
    for n_free in [1, 2, 5] {
        // In along one azimuth, out along another.
        let at = |tilt: f64, azimuth: f64, x: f64| ClPoint { tip: Point3::new(x, 0.0, 0.0), ..leaning(tilt, azimuth) };
        let mut poses: Vec<ClPoint> = (0..5).map(|k| at(0.05 * f64::from(5 - k), 0.3, f64::from(k))).collect();
        poses.extend((0..n_free).map(|k| at(0.0, 0.0, 5.0 + f64::from(k))));
        let x = 5.0 + f64::from(n_free);
        poses.extend((0..5).map(|k| at(0.05 * f64::from(k + 1), 1.5, x + f64::from(k))));
        let choice = choose(&machine, &poses, &cuts(&poses)).unwrap();
        assert_eq!(choice.breaks, []);
        assert_reaches(&machine, &poses, &choice);
        let last = 4 + n_free as usize;
        let [turn] = choice.free_turns[..] else { panic!("{:?}", choice.free_turns) };
        assert_eq!((turn.first, turn.last, turn.axis), (5, last, c));
        assert!(((turn.to - turn.from).abs() - 1.2).abs() < 1e-6, "{turn:?}");
        // Outside the stretch C is at rest, inside it turns by as much for every mm.
        for (k, w) in choice.values.windows(2).enumerate() {
            let way = w[1][c] - w[0][c];
            let inside = k >= 5 && k < last;
            let expected = if inside { (turn.to - turn.from) / f64::from(n_free - 1) } else { 0.0 };
            let there = k == 5 && n_free == 1;
            assert!(there || (way - expected).abs() < 1e-6, "{n_free} {k}: {way}");
        }
        if n_free == 1 {
            assert_eq!(choice.singular[0].largest_speed, f64::INFINITY);
        }
    }
}

#[test]
fn a_free_axis_turns_on_links_where_there_are_any() {
    let machine = with_range(&Machine::head_b_table_c().unwrap(), &["C"], Some((-200.0, 200.0)));
    let c = machine.axis_index("C").unwrap();
    let at =
        |tilt: f64, azimuth: f64, x: usize| ClPoint { tip: Point3::new(x as f64, 0.0, 0.0), ..leaning(tilt, azimuth) };
    let azimuths = [(0.2, 0.3), (0.0, 0.0), (0.2, 1.5)];
    let poses: Vec<ClPoint> = (0..12).map(|k| at(azimuths[k / 4].0, azimuths[k / 4].1, k)).collect();
    for links in [[3].as_slice(), &[7], &[3, 7]] {
        let mut segments = cuts(&poses);
        links.iter().for_each(|&k| segments[k] = SegmentKind::Link);
        let choice = choose(&machine, &poses, &segments).unwrap();
        assert_eq!((choice.breaks.len(), choice.link_turns.len()), (0, 0));
        assert_eq!(choice.free_turns, [], "{links:?}");
        assert_reaches(&machine, &poses, &choice);
        for (k, w) in choice.values.windows(2).enumerate() {
            assert!(links.contains(&k) || (w[1][c] - w[0][c]).abs() < 1e-6, "{links:?} {k} {w:?}");
        }
    }
}

#[test]
fn an_axis_that_is_free_all_along_stays_where_it_is() {
    let machine = Machine::head_b_table_c().unwrap();
    let c = machine.axis_index("C").unwrap();
    let poses: Vec<ClPoint> =
        (0..20).map(|k| ClPoint { tip: Point3::new(f64::from(k), 3.0, 0.0), axis: Vector3::z_axis() }).collect();
    let mut start = machine.home();
    start[c] = 1.25;
    let choice =
        choose_along(&machine, &poses, &cuts(&poses), Some(&start), LENGTH, &PathSettings::new(&machine)).unwrap();
    assert!(choice.values.iter().all(|q| q[c] == 1.25));
    assert_eq!((choice.breaks.len(), choice.free_turns.len(), choice.singular.len()), (0, 0, 1));
    assert_reaches(&machine, &poses, &choice);
}

#[test]
fn what_cannot_be_meant_is_refused_with_its_place() {
    let machine = Machine::head_b_table_c().unwrap();
    let (mut poses, segments) = spiral(1, &[]);
    assert_eq!(choose(&machine, &[], &[]), Err(PathError::NoPoses));
    let short = PathError::SegmentCount { poses: 73, segments: 71 };
    assert_eq!(choose(&machine, &poses, &segments[1..]), Err(short));
    let mut settings = PathSettings::new(&machine);
    settings.weights[1] = -1.0;
    let refused = choose_along(&machine, &poses, &segments, None, LENGTH, &settings);
    assert_eq!(refused.unwrap_err().to_string(), "the weight of axis Y is -1, but has to be a number of 0 or more");
    let bad = AxisValues::zeros(4);
    let refused = choose_along(&machine, &poses, &segments, Some(&bad), LENGTH, &PathSettings::new(&machine));
    assert_eq!(refused, Err(PathError::Start { n_axes: 5 }));
    poses[17].tip.z = 1e5;
    match choose(&machine, &poses, &segments) {
        Err(PathError::Unreachable { index: 17, reason: Unreachable::AxisLimit { .. } }) => {}
        other => panic!("{other:?}"),
    }
}
