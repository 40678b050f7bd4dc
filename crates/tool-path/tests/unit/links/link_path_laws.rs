//! Laws of the ways of links, on machines with their rotary axes in the head, in the table and in
//! both, by independent matrices.

use std::f64::consts::{FRAC_PI_2, PI};

use facemill_cutter_location::links::link::ClearanceSurface;
use facemill_inverse_kinematics::machine_file::{DhRow, Joint, Sense};
use facemill_inverse_kinematics::{AxisKind, AxisValues, BranchPreference, Machine};
use nalgebra::{Isometry3, Matrix4, Point3, Translation3, Unit, UnitQuaternion, Vector3, Vector4};

use crate::links::link_paths::{LinkEnds, RetractStrategy};
use crate::links::spindle_of;
use crate::move_laws::Random;

const TOOL_LENGTH: f64 = 130.0;

/// Machines of three families.
pub(super) fn machine(name: &str) -> Machine {
    let path = format!("{}/../../assets/machines/{name}.json", env!("CARGO_MANIFEST_DIR"));
    Machine::from_json(&std::fs::read(path).unwrap()).unwrap()
}

fn machines() -> [Machine; 3] {
    ["head-b-table-c", "table-table-a-c", "head-head-c-a"].map(machine)
}

/// Craig's matrix of a row.
fn craig(row: &DhRow, value: &dyn Fn(&str) -> f64) -> Matrix4<f64> {
    let (mut d, mut theta) = (row.d_mm, row.theta_deg.to_radians());
    let sign = |sense: Sense| if sense == Sense::Positive { 1.0 } else { -1.0 };
    match &row.joint {
        Some(Joint::Prismatic(j)) => d += sign(j.sense) * value(&j.axis),
        Some(Joint::Revolute(j)) => theta += sign(j.sense) * value(&j.axis),
        None => {}
    }
    let about_x = Matrix4::from_euler_angles(row.alpha_deg.to_radians(), 0.0, 0.0);
    let about_z = Matrix4::from_euler_angles(0.0, 0.0, theta);
    let shifted = |x: f64, z: f64| Matrix4::new_translation(&Vector3::new(x, 0.0, z));
    about_x * shifted(row.a_mm, 0.0) * about_z * shifted(0.0, d)
}

/// Tip and axis of the tool over the table, by products of the rows' matrices.
fn pose(machine: &Machine, q: &AxisValues) -> (Point3<f64>, Vector3<f64>) {
    let file = machine.to_file();
    let value = |axis: &str| q[machine.axis_index(axis).unwrap()];
    let end_of = |rows: &[DhRow]| rows.iter().fold(Matrix4::<f64>::identity(), |m, row| m * craig(row, &value));
    let (table, nose) = (end_of(&file.workpiece_chain.rows), end_of(&file.tool_chains[0].rows));
    let m = table.try_inverse().unwrap() * nose;
    let tip: Vector4<f64> = m * Vector4::new(0.0, 0.0, -TOOL_LENGTH, 1.0);
    let axis: Vector4<f64> = m * Vector4::z();
    (Point3::from(tip.xyz()), axis.xyz())
}

fn tip(machine: &Machine, q: &AxisValues) -> Point3<f64> {
    pose(machine, q).0
}

fn is_rotary(machine: &Machine, axis: usize) -> bool {
    machine.axes()[axis].kind == AxisKind::Rotary
}

/// Axis values within the middle of the ranges; turns by up to 80 degrees.
fn values(machine: &Machine, random: &mut Random) -> AxisValues {
    AxisValues::from_fn(machine.axes().len(), |k| {
        let axis = &machine.axes()[k];
        let share = random.between(0.3, 0.7);
        if axis.kind == AxisKind::Rotary { (share - 0.5) * 7.0 } else { random.between(-200.0, 200.0) }
    })
}

fn plane() -> ClearanceSurface {
    let normal = Unit::new_normalize(Vector3::new(0.2, -0.1, 1.0));
    ClearanceSurface::Plane { origin: Point3::new(1.0, 2.0, 30.0), normal }
}

fn cylinder() -> ClearanceSurface {
    let axis = Unit::new_normalize(Vector3::new(0.1, 0.3, 1.0));
    ClearanceSurface::Cylinder { origin: Point3::new(4.0, -7.0, 2.0), axis, radius: 60.0 }
}

fn sphere() -> ClearanceSurface {
    ClearanceSurface::Sphere { center: Point3::new(3.0, 5.0, -8.0), radius: 80.0 }
}

/// The nearest point of the plane, of the cylinder's line, or the middle of the sphere.
fn foot(surface: &ClearanceSurface, p: &Point3<f64>) -> Point3<f64> {
    match surface {
        ClearanceSurface::Plane { origin, normal } => p - normal.into_inner() * (p - origin).dot(normal),
        ClearanceSurface::Cylinder { origin, axis, .. } => origin + axis.into_inner() * (p - origin).dot(axis),
        ClearanceSurface::Sphere { center, .. } => *center,
    }
}

fn mounting() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.3, 0.4));
    Isometry3::from_parts(Translation3::new(12.0, -30.0, 140.0), turn)
}

fn ends<'a>(machine: &'a Machine, surface: &'a ClearanceSurface, [start, end]: [AxisValues; 2]) -> LinkEnds<'a> {
    LinkEnds {
        machine,
        tool_length: TOOL_LENGTH,
        table_from_work: mounting(),
        surface,
        start,
        end,
        spindle: spindle_of(machine),
    }
}

/// Tests random links of every machine about every surface, each with a distance out.
fn each_link(n: usize, mut look: impl FnMut(&LinkEnds<'_>, f64)) {
    let mut random = Random(7);
    for machine in &machines() {
        for surface in &[plane(), cylinder(), sphere()] {
            for _ in 0..n {
                let places = [values(machine, &mut random), values(machine, &mut random)];
                look(&ends(machine, surface, places), random.between(0.1, 150.0));
            }
        }
    }
}

fn assert_near(a: &Point3<f64>, b: &Point3<f64>) {
    assert!((a - b).norm() < 1e-6, "{a} and not {b}");
}

/// Returns the completed shares of a tip's way at two places on it.
fn shares(places: [Point3<f64>; 4]) -> [f64; 2] {
    let lengths: Vec<f64> = places.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
    let all: f64 = lengths.iter().sum();
    [lengths[0] / all, (lengths[0] + lengths[1]) / all]
}

/// Checks that the rotary values are those at these shares of the link's turn.
fn assert_turned(ends: &LinkEnds<'_>, way: &[AxisValues], shares: &[f64]) {
    for (at, share) in way.iter().zip(shares) {
        for k in (0..at.len()).filter(|&k| is_rotary(ends.machine, k)) {
            let expected = ends.start[k] + share * (ends.end[k] - ends.start[k]);
            assert!((at[k] - expected).abs() < 1e-9, "{} {expected}", at[k]);
        }
    }
}

#[test]
fn every_way_ends_where_the_link_does_and_rests_nowhere() {
    each_link(4, |ends, out| {
        for (kind, n) in RetractStrategy::TRIED.into_iter().zip([1, 3, 3, 2, 2, 2, 3, 3, 0]) {
            let way = ends.path(kind, out).unwrap();
            assert!(way.last() == Some(&ends.end) && way.iter().all(AxisValues::is_finite), "{kind}");
            assert!(way.len() == n || kind == RetractStrategy::Around && way.len() >= 3, "{kind}: {}", way.len());
        }
        // At distance 0 from the outer end, its place is the end itself up to rounding.
        for (kind, out) in RetractStrategy::TRIED.into_iter().flat_map(|kind| [(kind, 0.0), (kind, out)]) {
            let way = ends.path(kind, out).unwrap();
            let apart = |a: &AxisValues, b: &AxisValues| (0..a.len()).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
            let starts = std::iter::once(&ends.start).chain(&way);
            assert!(starts.zip(&way).all(|(from, to)| apart(from, to) > 1e-8), "{kind}, {out} out");
            assert!(way.last() == Some(&ends.end), "{kind}");
        }
        assert!(ends.path(RetractStrategy::Original, out).is_none());
    });
}

/// Lifted ways move only one axis at their ends, along the tool where the rotary axes are at 0.
#[test]
fn lifted_ways_go_out_and_back_with_the_spindles_axis_alone() {
    each_link(4, |ends, out| {
        let (k, sign) = ends.spindle;
        let upright = AxisValues::zeros(ends.start.len());
        let mut moved = upright;
        moved[k] = sign;
        let (from, axis) = pose(ends.machine, &upright);
        assert!((tip(ends.machine, &moved) - from - axis).norm() < 1e-9, "away from the work");

        let height = (sign * ends.start[k]).max(sign * ends.end[k]) + out;
        let above = |at: &AxisValues, place: &AxisValues| {
            let mut expected = *place;
            expected[k] = sign * height;
            assert_eq!(*at, expected);
        };
        let way = |kind| ends.path(kind, out).unwrap();
        let lifted = way(RetractStrategy::Lifted);
        above(&lifted[0], &ends.start);
        above(&lifted[1], &ends.end);
        above(&way(RetractStrategy::LiftedFirst)[0], &ends.start);
        above(&way(RetractStrategy::LiftedLast)[0], &ends.end);
        let half = AxisValues::from_fn(ends.start.len(), |k| 0.5 * (ends.start[k] + ends.end[k]));
        let peak = way(RetractStrategy::Peak);
        let apart = (0..half.len()).map(|axis| if axis == k { 0.0 } else { (peak[0][axis] - half[axis]).abs() });
        assert!(apart.fold(0.0, f64::max) < 1e-9 && (sign * peak[0][k] - height).abs() < 1e-9, "{peak:?}");
    });
}

/// Rotary axes turn by shares of the tip's way over the table; for lifted ways by that of the
/// lifted way.
#[test]
fn spread_ways_turn_by_the_share_of_the_tips_way() {
    each_link(4, |ends, out| {
        let places = |way: &[AxisValues]| [&ends.start, &way[0], &way[1], &ends.end].map(|q| tip(ends.machine, q));
        let way = |kind| ends.path(kind, out).unwrap();
        let (lifted, spread) = (way(RetractStrategy::Lifted), way(RetractStrategy::LiftedSpread));
        assert_turned(ends, &spread, &shares(places(&lifted)));
        for (a, b) in lifted.iter().zip(&spread) {
            assert!((0..a.len()).all(|k| is_rotary(ends.machine, k) || a[k] == b[k]), "{a:?} {b:?}");
        }
        let (along, spread) = (way(RetractStrategy::AlongTool), way(RetractStrategy::AlongToolSpread));
        assert_turned(ends, &spread, &shares(places(&spread)));
        along.iter().zip(&spread).for_each(|(a, b)| assert_near(&tip(ends.machine, a), &tip(ends.machine, b)));
    });
}

#[test]
fn ways_along_the_tool_back_out_along_its_axis_at_both_ends() {
    each_link(4, |ends, out| {
        let way = ends.path(RetractStrategy::AlongTool, out).unwrap();
        for (at, place) in way.iter().zip([&ends.start, &ends.end]) {
            let (from, axis) = pose(ends.machine, place);
            assert_near(&tip(ends.machine, at), &(from + axis * out));
        }
        assert_turned(ends, &way, &[0.0, 1.0]);
    });
}

/// Feet, directions and distances from them of a way's places, work frame.
fn outward(ends: &LinkEnds<'_>, places: &[AxisValues]) -> Vec<(Point3<f64>, Vector3<f64>, f64)> {
    let of = |q: &AxisValues| {
        let p = ends.table_from_work.inverse_transform_point(&tip(ends.machine, q));
        let foot = foot(ends.surface, &p);
        match ends.surface {
            ClearanceSurface::Plane { normal, .. } => (foot, normal.into_inner(), (p - foot).dot(normal)),
            _ => (foot, (p - foot).normalize(), (p - foot).norm()),
        }
    };
    places.iter().map(of).collect()
}

/// Checks an even level over the surface, by the shorter way, with chords that keep 99 % of it;
/// returns the places' directions.
fn assert_around(ends: &LinkEnds<'_>, out: f64) -> Vec<Vector3<f64>> {
    let way = ends.path(RetractStrategy::Around, out).unwrap();
    let (_, over) = way.split_last().unwrap();
    let (n, around) = (over.len() - 1, outward(ends, over));
    assert!(n > 0);
    let level = around[0].2;
    let [first, last] = [around[0], around[n]];
    let is_plane = matches!(ends.surface, ClearanceSurface::Plane { .. });
    let angle = if is_plane { 0.0 } else { first.1.angle(&last.1) };
    for (k, (foot, direction, distance)) in around.iter().enumerate() {
        let share = k as f64 / n as f64;
        assert!((distance - level).abs() < 1e-6, "{distance} for {level}");
        assert_near(foot, &(first.0 + (last.0 - first.0) * share));
        let turned = [direction.angle(&first.1), direction.angle(&last.1)];
        assert!((turned[0] - share * angle).abs() < 1e-5 && (turned[1] - (1.0 - share) * angle).abs() < 1e-5);
    }
    assert_turned(ends, over, &(0..=n).map(|k| k as f64 / n as f64).collect::<Vec<_>>());
    for pair in around.windows(2).filter(|_| !is_plane) {
        let [a, b] = [0, 1].map(|k| pair[k].0 + pair[k].1 * level);
        for step in 0..=20 {
            let p = a + (b - a) * (f64::from(step) / 20.0);
            let distance = (p - foot(ends.surface, &p)).norm();
            assert!(distance >= 0.99 * level && distance <= level + 1e-6, "{distance} of {level}");
        }
    }
    around.iter().map(|a| a.1).collect()
}

#[test]
fn a_way_around_keeps_an_even_level_over_the_clearance_surface() {
    each_link(20, |ends, out| {
        assert_around(ends, out);
        let way = ends.path(RetractStrategy::Around, out).unwrap();
        let at_ends = outward(ends, &[ends.start, ends.end]);
        let around = outward(ends, &[way[0], way[way.len() - 2]]);
        // Straight out from both ends, and from the outer one as far as requested.
        for (end, place) in at_ends.iter().zip(&around) {
            assert_near(&end.0, &place.0);
            assert!((end.1 - place.1).norm() < 1e-6, "{} {}", end.1, place.1);
        }
        let outer = at_ends[0].2.max(at_ends[1].2);
        assert!((around[0].2 - outer - out).abs() < 1e-6, "{} {outer} {out}", around[0].2);
    });
}

/// A machine, and its tool poses at places of the work, with the tool axis pointing away from there
/// as far as possible.
fn standing(machine: &Machine, places: [Point3<f64>; 2], axes: [Vector3<f64>; 2]) -> [AxisValues; 2] {
    [0, 1].map(|k| {
        let cl = facemill_cl_data::ClPoint { tip: places[k], axis: Unit::new_normalize(axes[k]) };
        let cl = cl.transformed(&mounting());
        machine.nearest_inverse(&cl, TOOL_LENGTH, None, BranchPreference::Positive).unwrap()
    })
}

/// Opposite ends leave the side of the way open: it is that of the tool. Where the straight line
/// between both ends is near to the middle, the way around is no nearer than elsewhere.
#[test]
fn a_way_around_opposite_ends_goes_by_the_side_of_the_tool() {
    let machine = machine("head-head-c-a");
    let up = mounting().inverse_transform_vector(&Vector3::z());
    for surface in [cylinder(), sphere()] {
        let middle = foot(&surface, &Point3::new(1.0, 2.0, 3.0));
        let line =
            if let ClearanceSurface::Cylinder { axis, .. } = &surface { axis.into_inner() } else { Vector3::y() };
        let across = line.cross(&Vector3::x()).normalize();
        let along = across.cross(&line);
        for (bend, side) in [(0.0, 1.0), (0.0, -1.0), (1e-9, 1.0), (0.02, 1.0), (0.4, -1.0)] {
            let from = along * 70.0;
            let to = (-along * f64::cos(bend) + across * side * f64::sin(bend)) * 60.0;
            // Leaning to the side half way.
            let lean = (up + across * side * 0.3).normalize();
            let places = standing(&machine, [middle + from, middle + to], [lean, lean]);
            let directions = assert_around(&ends(&machine, &surface, places), 5.0);
            assert!(directions.len() >= ((PI - bend) / 0.28) as usize, "{}", directions.len());
            let half = directions[directions.len() / 2];
            let expected = if bend > 1e-6 { across * side } else { lean - along * lean.dot(&along) };
            assert!(half.dot(&expected) > 0.0, "{bend} {side}: {half} {expected}");
            assert!((half.angle(&along) - FRAC_PI_2).abs() < 0.3 + bend);
        }
    }
}

#[test]
fn ends_in_the_middle_of_the_workpiece_go_out_toward_the_other_end_or_have_no_way_around() {
    let machine = machine("head-b-table-c");
    for surface in [cylinder(), sphere()] {
        let middle = foot(&surface, &Point3::new(1.0, 2.0, 3.0));
        let beside = middle + Vector3::new(50.0, 10.0, 20.0);
        let up = mounting().inverse_transform_vector(&Vector3::new(0.1, 0.0, 1.0));
        for places in [[middle, beside], [beside, middle]] {
            let places = standing(&machine, places, [up, up]);
            let ends = ends(&machine, &surface, places);
            let way = ends.path(RetractStrategy::Around, 3.0).unwrap();
            // No angle: out, across where the feet are apart, and in.
            let (_, over) = way.split_last().unwrap();
            let [first, last] = [outward(&ends, over)[0], outward(&ends, over)[over.len() - 1]];
            assert!(over.len() <= 2 && (first.1 - last.1).norm() < 1e-6);
            let level = (beside - foot(&surface, &beside)).norm() + 3.0;
            assert!((first.2 - level).abs() < 1e-6 && (last.2 - level).abs() < 1e-6, "{first:?} {last:?}");
        }
        let places = standing(&machine, [middle, middle], [up, up]);
        assert!(ends(&machine, &surface, places).path(RetractStrategy::Around, 3.0).is_none());
    }
}

#[test]
fn a_link_to_where_it_begins_has_finite_ways() {
    each_link(1, |ends, out| {
        let same = LinkEnds { end: ends.start, ..self::ends(ends.machine, ends.surface, [ends.start, ends.start]) };
        for kind in RetractStrategy::TRIED {
            for out in [0.0, out] {
                let way = same.path(kind, out).unwrap_or_default();
                assert!(way.iter().all(AxisValues::is_finite), "{kind}: {way:?}");
                assert!(way.last().is_none_or(|last| *last == same.end), "{kind}");
            }
        }
        assert_eq!(same.path(RetractStrategy::Direct, 0.0), Some(Vec::new()));
    });
}
