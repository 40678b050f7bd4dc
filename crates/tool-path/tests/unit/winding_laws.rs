//! Laws of windings: as few turns back as possible, only on links, and nothing left uncut.

use std::f64::consts::{PI, TAU};

use facemill_cl_data::{CcPoint, Posture, Silent};
use facemill_cutter_location::{Hints, PoseTest, SearchSettings};
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::machine_file::{Joint, RevoluteRange};
use facemill_inverse_kinematics::{AxisValues, Machine};
use nalgebra::{Point3, Vector3};

use crate::move_laws::{Random, cell, curve, linearity, move_settings, plane_with_bump, tool};
use crate::moves::{Move, MoveKind, OperationMoves, operation_moves};
use crate::segments::pole::Tests;
use crate::segments::{Cut, PassSegment, filled};
use crate::winding::{unwound, windings, wound};

/// The head-B, table-C mill with stops at its table.
fn with_stops(min_deg: f64, max_deg: f64) -> Machine {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = &mut row.joint {
            joint.range = RevoluteRange::Limited { min_deg, max_deg };
        }
    }
    Machine::from_file(file).unwrap()
}

fn c_of(machine: &Machine) -> usize {
    machine.axis_index("C").unwrap()
}

/// Breaks in cuts, turns on links, way of the axis on both, rad.
type Cost = (u32, u32, f64);

/// Returns the cost of going through these values of C, cut by cut.
fn cost_of(pieces: &[Vec<f64>]) -> Cost {
    let mut sum = (0, 0, pieces[0][0].abs());
    let mut last: Option<f64> = None;
    for piece in pieces {
        for (k, &c) in piece.iter().enumerate() {
            let way = last.map_or(0.0, |last: f64| (c - last).abs());
            match (k == 0, way > PI + 1e-6) {
                (true, turns) if last.is_some() => (sum.1, sum.2) = (sum.1 + u32::from(turns), sum.2 + way),
                (false, true) => (sum.0, sum.2) = (sum.0 + 1, sum.2 + way),
                _ => {}
            }
            last = Some(c);
        }
    }
    sum
}

/// Returns the least cost over all windings of all cuts within the limits, by trying every
/// combination.
fn least_cost(pieces: &[Vec<f64>], (min, max): (f64, f64)) -> Cost {
    fn all(places: &[(usize, usize, Vec<f64>)], taken: &mut Vec<Vec<f64>>, best: &mut Option<Cost>) {
        let Some(((piece, cut, values), rest)) = places.split_first() else {
            let cost = cost_of(taken);
            if best.is_none_or(|b| cost < b) {
                *best = Some(cost);
            }
            return;
        };
        for c in values {
            taken[*piece][*cut] = *c;
            all(rest, taken, best);
        }
    }
    let wound =
        |c: f64| (-4..=4).map(move |n| c + TAU * f64::from(n)).filter(move |c| (min - 1e-12..=max + 1e-12).contains(c));
    let of = |(piece, cuts): (usize, &Vec<f64>)| -> Vec<_> {
        cuts.iter().enumerate().map(|(cut, &c)| (piece, cut, wound(c).collect())).collect()
    };
    let places: Vec<_> = pieces.iter().enumerate().flat_map(of).collect();
    let mut best = None;
    all(&places, &mut pieces.to_vec(), &mut best);
    best.unwrap()
}

#[test]
fn no_choice_of_windings_costs_less() {
    let mut random = Random(11);
    let (mut breaks, mut turns) = (0, 0);
    for scene in 0..300 {
        let min = random.between(-400.0, -60.0);
        let max = (min + random.between(365.0, 800.0)).max(5.0);
        let machine = with_stops(min, max);
        let c = c_of(&machine);
        let home = machine.home();
        let sense = if random.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let pieces: Vec<Vec<f64>> = (0..3)
            .map(|_| {
                let mut at = random.between(-PI, PI);
                let mut values = Vec::new();
                for _ in 0..3 {
                    values.push(at);
                    at += sense * random.between(-0.5, 2.6);
                }
                values
            })
            .collect();
        let at = |c_value: &f64| {
            let mut q = home;
            q[c] = *c_value;
            q
        };
        let unwrapped: Vec<Vec<AxisValues>> = pieces.iter().map(|p| p.iter().map(at).collect()).collect();
        let chosen: Vec<Vec<f64>> =
            windings(&machine, &unwrapped, None).iter().map(|p| p.iter().map(|q| q[c]).collect()).collect();
        for (found, meant) in chosen.iter().flatten().zip(pieces.iter().flatten()) {
            let turned = (found - meant) / TAU;
            assert!((turned - turned.round()).abs() < 1e-9 && machine.axes()[c].holds(*found), "{found} {meant}");
        }
        let (found, least) = (cost_of(&chosen), least_cost(&pieces, (min.to_radians(), max.to_radians())));
        assert_eq!((found.0, found.1), (least.0, least.1), "scene {scene}");
        assert!(found.2 <= least.2 + 1e-9, "scene {scene}: {found:?} {least:?}");
        (breaks, turns) = (breaks + least.0, turns + least.1);
    }
    assert!(breaks > 30 && turns > 30, "{breaks} breaks, {turns} turns");
}

/// Passes once around on the plane z = 0, at these radii, with these senses.
fn rings(test: &PoseTest<'_>, passes: &[(f64, f64)]) -> Vec<PassSegment> {
    let posture = Posture { tilt: 6f64.to_radians(), rotate: 0.0 };
    let piece = |(pass, &(radius, sense)): (usize, &(f64, f64))| {
        let mut near = None;
        let cuts: Vec<Cut> = (0..=60)
            .map(|k| {
                let (sin, cos) = (0.4 + sense * TAU * f64::from(k) / 60.0).sin_cos();
                let feed = Vector3::new(-sin, cos, 0.0) * sense;
                let cc = CcPoint::new(Point3::new(radius * cos, radius * sin, 0.0), Vector3::z(), feed).unwrap();
                let pose = test.try_posture(&cc, posture, near.as_ref(), &mut Hints::default()).unwrap();
                near = Some(pose.configuration);
                Cut { cc, pose, inserted: false }
            })
            .collect();
        PassSegment { copy: 0, pass, cuts, uncut_left: true, curve: curve(), part: None }
    };
    passes.iter().enumerate().map(piece).collect()
}

/// Each pair of moves that follow each other.
fn pairs(moves: &OperationMoves) -> Vec<(Move, Move)> {
    let all: Vec<Move> = moves.pieces.iter().flat_map(|p| &p.moves).chain(&moves.retract).copied().collect();
    all.windows(2).map(|w| (w[0], w[1])).collect()
}

/// Angle of a place along a ring, from its start.
fn along(cc: &CcPoint, sense: f64) -> f64 {
    let angle = sense * (cc.position.y.atan2(cc.position.x) - 0.4);
    angle.rem_euclid(TAU)
}

#[test]
fn a_pass_once_around_is_cut_whole_and_turns_back_as_rarely_as_can_be() {
    let passes = [(90.0, 1.0), (70.0, 1.0), (50.0, -1.0)];
    let stops = [(-180.0, 180.0), (-200.0, 230.0), (-90.0, 370.0), (-360.0, 370.0), (-540.0, 540.0)];
    let mut counts = Vec::new();
    for limits in stops {
        let (machine, tool) = (with_stops(limits.0, limits.1), tool());
        let tree = MeshTree::new(&plane_with_bump(Point3::new(250.0, 250.0, 0.0), -0.5));
        let mut cell = cell(&machine, &tool, &tree);
        cell.table_from_work = nalgebra::Isometry3::translation(300.0, 0.0, 900.0);
        let test = PoseTest::new(&cell);
        let (settings, search, c) = (move_settings(), SearchSettings::default(), c_of(&machine));
        let mut left_out = Vec::new();
        let whole =
            filled(&Tests::one(&test), &linearity(0.05), Some(&search), rings(&test, &passes), &mut left_out, &Silent)
                .unwrap();
        assert_eq!(whole.len(), 3, "a limit ends no piece before windings are chosen");
        // A cut every third of a turn shows where an axis has to turn back, and leaves few enough
        // combinations to try all.
        let travel = |piece: &PassSegment| -> Vec<f64> {
            let mut at = piece.cuts[0].pose.configuration.axes[c];
            let some = piece.cuts.iter().map(|cut| {
                let value = cut.pose.configuration.axes[c];
                at = value + TAU * ((at - value) / TAU).round();
                at
            });
            let all: Vec<f64> = some.collect();
            let stride = all.len().div_ceil(3);
            all.iter().copied().step_by(stride).chain(all.last().copied()).collect()
        };
        let sampled: Vec<Vec<f64>> = whole.iter().map(travel).collect();
        let least = least_cost(&sampled, (limits.0.to_radians(), limits.1.to_radians()));

        let pieces = wound(&test, Some(&search), whole, None);
        let done = operation_moves(&test, &settings, pieces, None, &mut left_out, &Silent).unwrap();
        assert!(left_out.is_empty(), "{}", left_out[0].reason);
        assert_eq!(done.pieces.iter().map(|p| p.piece.points()).sum::<usize>(), 3 * 61);
        let mut n = 0;
        for (from, to) in pairs(&done) {
            assert_eq!(machine.first_beyond_limit(&to.axes), None);
            if (to.axes[c] - from.axes[c]).abs() < PI + 1e-6 {
                continue;
            }
            n += 1;
            assert_eq!(to.kind, MoveKind::Rapid, "an axis turns back in a cut");
            for m in [from, to] {
                assert!(settings.link.clearance.height(&m.cl.tip) >= test.clearance_margin() - 1e-6);
            }
        }
        assert_eq!(n, least.0 + least.1, "{limits:?}");
        assert_eq!(done.pieces.len() as u32, 3 + least.0, "{limits:?}");
        // Each part begins where the one before it ends, or before that.
        for pair in done.pieces.windows(2).filter(|w| w[1].piece.part.is_some_and(|part| part > 0)) {
            let [(end, place), (begin, from)] = [pair[0].piece.cuts.last(), pair[1].piece.cuts.first()]
                .map(|cut| cut.map(|c| (along(&c.cc, passes[pair[0].piece.pass].1), c.cc.position)).unwrap());
            assert!(begin <= end || (place - from).norm() < 1e-5, "{limits:?}: {begin} after {end}");
        }
        counts.push(n);
    }
    assert!(counts[0] > counts[4] && counts[4] == 0, "{counts:?}");
}

/// The head-B, table-C mill with a limited wind-up of its table.
fn with_wind_up(turns: f64) -> Machine {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    for row in &mut file.workpiece_chain.rows {
        if let Some(Joint::Revolute(joint)) = &mut row.joint {
            joint.max_wind_up_turns = Some(turns);
        }
    }
    Machine::from_file(file).unwrap()
}

/// Passes that each lead once round the part the same way wind the table up more and more; with a
/// limit, links turn it back.
#[test]
fn passes_that_go_round_and_round_stay_within_the_limit_of_the_wind_up() {
    let machine = with_wind_up(3.0);
    let c = c_of(&machine);
    let axis = &machine.axes()[c];
    assert!(!axis.endless && axis.has_no_stops() && (axis.max - 3.0 * TAU).abs() < 1e-12);
    let once_round = |n: usize| (0..=24).map(move |k| TAU * (n as f64 + f64::from(k) / 24.0));
    let pieces: Vec<Vec<AxisValues>> = (0..20)
        .map(|n| once_round(n).map(|value| AxisValues::from_fn(5, |k| if k == c { value } else { 0.0 })).collect())
        .collect();
    let chosen = windings(&machine, &pieces, None);
    let values: Vec<f64> = chosen.iter().flatten().map(|q| q[c]).collect();
    assert!(values.iter().all(|v| axis.holds(*v)), "{values:?}");
    // No pass is broken, and no more links turn back than six turns of room require.
    for (piece, meant) in chosen.iter().zip(&pieces) {
        let way = piece[24][c] - piece[0][c];
        assert!((way - (meant[24][c] - meant[0][c])).abs() < 1e-9, "{way}");
    }
    let turns_back = chosen.windows(2).filter(|p| (p[1][0][c] - p[0][24][c]).abs() > PI).count();
    assert!((1..=3).contains(&turns_back), "{turns_back}");
}

#[test]
fn an_endless_axis_turns_back_on_a_rapid_where_another_axis_takes_as_long() {
    let machine = Machine::head_b_table_c().unwrap();
    let c = c_of(&machine);
    let at =
        |x: f64, value: f64| AxisValues::from_fn(5, |k| [x, 0.0, 0.0, 0.0, 0.0][k] + if k == c { value } else { 0.0 });
    let turn_time = TAU / machine.axes()[c].max_velocity;
    let far = 1.1 * turn_time * machine.axes()[0].max_velocity;
    let wound = at(0.0, 10.0 * TAU);
    assert_eq!(unwound(&machine, &wound, &at(far, 10.0 * TAU)), Some(at(far, 10.0 * TAU - TAU)));
    assert_eq!(unwound(&machine, &wound, &at(0.5 * far, 10.0 * TAU)), None);
    // Half a turn is as far from home as the other one, and less is nearer.
    assert_eq!(unwound(&machine, &at(0.0, 0.0), &at(far, PI)), None);
    let over = unwound(&machine, &at(0.0, 0.9 * PI), &at(far, 1.1 * PI)).unwrap();
    assert!((over[c] + 0.9 * PI).abs() < 1e-12, "{over:?}");
}
