//! Programs as text, each with one planted fault, and twins without it.
//!
//! Everything is on a plate whose top is z = 0 of the workpiece frame, on the preset mill with head
//! B and table C.

mod bodies;
mod cut_before;
mod cuts;
mod lengths;
mod motion;
mod pairs;
mod rapids;
mod stock;
mod text;

use crate::kit::{CORNER, HEAD, RADIUS, Shop, Text, lift_of, only};
use facemill_cl_data::{Cancelled, Monitor, Silent};
use facemill_inverse_kinematics::AxisKind;
use facemill_nc_program::read_program;
use facemill_nc_program::{Dialect, WordMap, WorkOffset};
use facemill_virtual_machine::merge_findings;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    FindingKind, GougeSection, Measure, Verification, VerifyError, VerifySettings, VirtualSetup, rapid_lines,
};

/// A pass over the plate at tip height `z`, with a dip to `dip` at its middle block.
fn pass(shop: &Shop, z: f64, dip: f64) -> Verification {
    let tilt = [0.05, 0.0, 1.0];
    let lift = lift_of(0.05);
    let at = |x: f64, z: f64| [x, 10.0, z + lift];
    Text::new(shop)
        .rapid([-100.0, 10.0, 300.0])
        .rapid_tilted(at(-100.0, 20.0), tilt)
        .cut_tilted(at(-100.0, z), tilt)
        .cut_tilted(at(-60.0, z), tilt)
        .cut_tilted(at(-30.0, dip), tilt)
        .cut_tilted(at(0.0, z), tilt)
        .cut_tilted(at(40.0, z), tilt)
        .cut_tilted(at(40.0, 60.0), tilt)
        .verify()
}

#[test]
fn planted_gouge_is_found_at_its_block_with_its_depth() {
    let shop = Shop::new();
    let v = pass(&shop, 0.05, -0.3);
    let f = only(&v);
    assert_eq!((f.kind, f.worst_line), (FindingKind::Gouge, HEAD + 5));
    // The dip is left on the next block.
    assert_eq!((f.first_line, f.last_line), (HEAD + 5, HEAD + 6));
    assert_eq!(f.obstacle.as_deref(), Some("plate"));
    let Some(Measure::DepthMm(depth)) = f.measure else { panic!("{f:?}") };
    assert!((depth - 0.3).abs() < 0.01, "{depth}");
    let place = f.place_work_mm.unwrap();
    assert!((place[0] - (-30.0 + RADIUS - CORNER)).abs() < 1.0 && place[2].abs() < 1e-6, "{place:?}");
    let largest = v.largest_gouge.as_ref().unwrap();
    assert!((largest.depth_mm - depth).abs() < 1e-12 && largest.line == HEAD + 5);
    assert!(f.to_string().starts_with("line 10 (from 10 to 11): gouge, cutter at plate, 0.300 mm deep"), "{f}");
}

#[test]
fn twin_below_the_limit_is_clean_and_its_depth_is_reported() {
    let shop = Shop::new();
    let v = pass(&shop, 0.05, -0.015);
    assert_eq!(v.findings, []);
    assert!((v.largest_gouge.unwrap().depth_mm - 0.015).abs() < 1e-3);
    let v = pass(&shop, 0.05, 0.05);
    assert_eq!((v.findings.len(), v.largest_gouge), (0, None));
    // 12 mm of flute, raised by the tilt, less 22 mm of half diameter leaning down.
    let alpha = 0.05_f64.atan();
    let expected = 0.05 + lift_of(0.05) + 12.0 * alpha.cos() - 22.0 * alpha.sin();
    let clearance = v.smallest_clearance.unwrap();
    assert!((clearance.distance_mm - expected).abs() < 0.001, "{clearance:?} {expected}");
    assert_eq!((clearance.body.as_str(), clearance.obstacle.as_str()), ("cutter body section 1", "plate"));
}

#[test]
fn gouge_only_between_two_points_is_found() {
    // Both ends stand on either side of the wall, upright, and the way goes through it at the
    // height of the cutter.
    let shop = Shop::new();
    let v = Text::new(&shop)
        .rapid([100.0, 0.0, 300.0])
        .rapid([100.0, 0.0, 55.0])
        .cut([210.0, 0.0, 55.0])
        .rapid([210.0, 0.0, 300.0])
        .verify();
    let gouges: Vec<_> = v.findings.iter().filter(|f| f.kind == FindingKind::Gouge).collect();
    assert_eq!(gouges.len(), 1, "{:#?}", v.findings);
    assert_eq!((gouges[0].worst_line, gouges[0].obstacle.as_deref()), (HEAD + 3, Some("wall")));
}

#[test]
fn planted_holder_touch_is_found_and_its_twin_is_not() {
    // The holder (radius 40, from 60 mm above the tip, clearance 2) beside a wall of 60 mm: the tip
    // at z = 2 lets it pass over, at z = −3 of a slot it would hit; here the tip goes down to z =
    // 0.5, so that 0.5 mm are left of 2.
    let shop = Shop::new();
    let run = |z: f64| {
        Text::new(&shop)
            .rapid([115.0, 0.0, 300.0])
            .rapid([115.0, 0.0, 20.0])
            .cut([115.0, 0.0, z])
            .cut([115.0, 20.0, z])
            .cut([115.0, 20.0, 40.0])
            .verify()
    };
    let v = run(0.5);
    let f = only(&v);
    assert_eq!((f.kind, f.first_line, f.last_line), (FindingKind::HolderCollision, HEAD + 3, HEAD + 5));
    assert_eq!((f.body.as_deref(), f.obstacle.as_deref()), (Some("holder section 1"), Some("wall")));
    let Some(Measure::DistanceMm(distance)) = f.measure else { panic!("{f:?}") };
    assert!((distance - 0.5).abs() < 1e-3, "{distance}");
    assert!((v.smallest_clearance.as_ref().unwrap().distance_mm - 0.5).abs() < 1e-3);
    assert_eq!(run(2.05).findings, []);
    // Within the slack of the clearance it is a near miss and no fault.
    let v = run(1.95);
    assert_eq!((only(&v).kind, v.faults().count()), (FindingKind::NearMiss, 0));
}

#[test]
fn a_joined_near_miss_is_of_blocks_without_the_collision_of_the_same_bodies_alone() {
    // Down beside the wall at the border of the clearance, then into it, and back; and once more at
    // its border alone.
    let shop = Shop::new();
    let run = |text: Text<'_>| {
        let at = [115.0, 0.0];
        let text =
            text.cut([at[0], 0.0, 1.98]).cut([at[0], 10.0, 0.5]).cut([at[0], 20.0, 1.98]).cut([115.0, 20.0, 40.0]);
        let again = text.cut([115.0, 30.0, 40.0]).cut([115.0, 30.0, 1.98]).cut([115.0, 30.0, 40.0]);
        let program = read_program(&again.text, Dialect::Fanuc).unwrap();
        let found = merge_findings(again.verify().findings, &rapid_lines(&program));
        found.iter().map(|f| (f.kind, f.first_line, f.last_line)).collect::<Vec<_>>()
    };
    let found = run(Text::new(&shop).rapid([115.0, 0.0, 300.0]).rapid([115.0, 0.0, 20.0]));
    let (near, hit) = (FindingKind::NearMiss, FindingKind::HolderCollision);
    assert_eq!(found, [(hit, HEAD + 4, HEAD + 5), (near, HEAD + 8, HEAD + 8)]);
}

#[test]
fn rapid_through_stock_is_found_and_the_same_way_cutting_is_not() {
    let shop = Shop::new();
    let mut setup = shop.setup();
    setup.obstacles[0].stock = 3.0;
    let text = |fast: bool| {
        let t = Text::new(&shop).rapid([-240.0, 0.0, 300.0]).rapid([-240.0, 0.0, 2.0]);
        let t = if fast { t.rapid([0.0, 0.0, 2.0]) } else { t.cut([0.0, 0.0, 2.0]) };
        t.cut([0.0, 0.0, 30.0])
    };
    let v = text(true).verify_in(&setup);
    let f = only(&v);
    assert_eq!((f.kind, f.first_line), (FindingKind::RapidCollision, HEAD + 3));
    assert!((f.measure.unwrap().value() - 1.0).abs() < 1e-3, "{f:?}");
    assert_eq!(text(false).verify_in(&setup).findings, []);
}

#[test]
fn rapid_through_the_part_names_cutter_and_bodies_once_each() {
    let shop = Shop::new();
    let v =
        Text::new(&shop).rapid([-300.0, 0.0, 300.0]).rapid([-300.0, 0.0, -40.0]).rapid([300.0, 0.0, -40.0]).verify();
    let mut seen: Vec<_> = v.findings.iter().map(|f| (f.kind, f.body.clone(), f.obstacle.clone())).collect();
    seen.sort();
    let n = seen.len();
    seen.dedup();
    assert_eq!(n, seen.len(), "one finding for each pair: {seen:?}");
    assert!(v.findings.iter().any(|f| f.kind == FindingKind::RapidCollision && f.obstacle.as_deref() == Some("plate")));
    assert!(v.findings.iter().any(|f| f.kind == FindingKind::HolderCollision));
    assert!(v.findings.iter().all(|f| f.worst_line == HEAD + 3 || f.obstacle.as_deref() == Some("wall")));
}

#[test]
fn steep_ramp_into_stock_is_found_and_a_flat_one_or_one_in_air_is_not() {
    let shop = Shop::new();
    let mut setup = shop.setup();
    setup.obstacles[0].stock = 3.0;
    let run = |slope_deg: f64, setup: &VirtualSetup<'_>| {
        let way = 1.5 / slope_deg.to_radians().tan();
        Text::new(&shop)
            .rapid([-100.0, 0.0, 300.0])
            .cut([-100.0, 0.0, 3.2])
            .cut([-100.0 + way, 0.0, 1.7])
            .cut([60.0, 0.0, 1.7])
            .cut([60.0, 0.0, 40.0])
            .verify_in(setup)
    };
    let v = run(4.0, &setup);
    let f = only(&v);
    assert_eq!((f.kind, f.worst_line), (FindingKind::RampTooSteep, HEAD + 3));
    assert!((f.measure.unwrap().value() - 4.0).abs() < 0.05, "{f:?}");
    assert_eq!(run(2.9, &setup).findings, []);
    assert_eq!(run(4.0, &shop.setup()).findings, []);
}

#[test]
fn axis_beyond_its_limit_is_found_with_its_excess() {
    let shop = Shop::new();
    // Word 2300 with the offset 310 is 2610 on the scale, 10 mm beyond.
    let v = Text::new(&shop).line("G0 X2300. Z2000.").line("G0 X0.").verify();
    let f = only(&v);
    assert_eq!((f.kind, f.axis.as_deref(), f.worst_line), (FindingKind::AxisLimit, Some("X"), HEAD + 1));
    assert!(matches!(f.measure, Some(Measure::ExcessMm(e)) if (e - 10.0).abs() < 1e-9), "{f:?}");
    assert_eq!((f.first_line, f.last_line), (HEAD + 1, HEAD + 2));
    assert_eq!(Text::new(&shop).line("G0 X2290. Z2000.").line("G0 X0.").verify().findings, []);
}

#[test]
fn feed_that_an_axis_cannot_follow_is_found() {
    // B turns at most 3600 deg/min. Along one axis, F is its own speed.
    let shop = Shop::new();
    let run =
        |feed: u32| Text::new(&shop).line("G0 X0. Y0. Z2000. B0. C0.").line(&format!("G1 B40. F{feed}.")).verify();
    let v = run(4000);
    let f = only(&v);
    assert_eq!((f.kind, f.axis.as_deref(), f.worst_line), (FindingKind::AxisSpike, Some("B"), HEAD + 2));
    assert!((f.measure.unwrap().value() - 4000.0 / 3600.0).abs() < 1e-3);
    assert_eq!(run(3600).findings, []);
    let v = Text::new(&shop).line("G0 X0. Y0. Z2000. B0. C0.").line("G1 B40.").verify();
    assert_eq!(only(&v).kind, FindingKind::NoFeed);
}

#[test]
fn times_and_lengths_are_those_of_the_words() {
    let shop = Shop::new();
    // G94: 30 mm and 40 deg at F 100 are half a minute; G93: F 4 is a quarter of one. X and Y
    // rapids at 15 m/min.
    let v = Text::new(&shop)
        .line("G0 X0. Y0. Z1000. B0. C0.")
        .line("G0 X500.")
        .line("G1 Y30. C40. F100.")
        .line("G93 G1 X490. F4.")
        .verify();
    assert!((v.cutting_time_s - 45.0).abs() < 1e-9, "{}", v.cutting_time_s);
    let home = Text::new(&shop).line("G0 X0. Y0. Z1000. B0. C0.").verify();
    assert!((v.rapid_time_s - home.rapid_time_s - 2.0).abs() < 1e-9);
    // The last move is straight; the one before goes with the table, 810 mm and more from its axis.
    assert!(v.cutting_length_mm > 500.0 && v.cutting_length_mm < 800.0, "{}", v.cutting_length_mm);
    assert_eq!(v.n_blocks, 4);
}

#[test]
fn unknown_positions_and_blocks_are_findings_of_their_own() {
    let shop = Shop::new();
    let kinds = |t: Text<'_>| t.verify().findings.iter().map(|f| f.kind).collect::<Vec<_>>();
    let start = || Text::new(&shop).line("G0 X0. Y0. Z1000. B0. C0.");
    assert_eq!(kinds(start()), []);
    assert_eq!(kinds(start().line("G2 X10. I5. J0. F100.").line("G0 X20.")), [FindingKind::UnknownBlock]);
    assert_eq!(
        kinds(start().line("G65 P9100").line("G0 X0. Y0. Z0. B0. C0.")),
        [FindingKind::UnknownBlock, FindingKind::UnknownPosition]
    );
    assert_eq!(
        kinds(start().line("G65 P9100").line("G0 X0.")),
        [FindingKind::UnknownBlock, FindingKind::UnknownPosition]
    );
    assert_eq!(kinds(start().line("G55").line("G0 X0.")), [FindingKind::UnknownPosition]);
    assert_eq!(kinds(start().line("(TOOL LENGTH 120.000)")), []);
    assert_eq!(kinds(start().line("(TOOL LENGTH 121.000)")), [FindingKind::OtherToolLength]);
    for (check, n) in [("GE 120.", 0), ("GT 120.", 1), ("LE 120.", 0), ("LT 120.", 1), ("GT 119.", 0), ("LT 119.", 1)] {
        let text = start().line(&format!("IF[#11001 {check}]GOTO 900")).line("#3000=1(LENGTH)").line("N900");
        assert_eq!(kinds(text), vec![FindingKind::OtherToolLength; n], "{check}");
    }
    assert_eq!(kinds(start().line("T8")), [FindingKind::UnknownBlock]);
    assert_eq!(kinds(start().line("G0 A10.")), [FindingKind::UnknownBlock]);
}

#[test]
fn a_fault_that_goes_on_is_one_finding_until_something_moves_again() {
    let shop = Shop::new();
    let lines = |t: Text<'_>| t.verify().findings.iter().map(|f| (f.first_line, f.last_line)).collect::<Vec<_>>();
    let start = || Text::new(&shop).line("G0 X0. Y0. Z1000. B0. C0.");
    let lost = || start().line("G55").line("G0 X1.").line("(pass)").line("X2.").line("M8").line("X3.");
    assert_eq!(lines(lost()), [(HEAD + 3, HEAD + 7)]);
    let again = lost().line("G54").line("G0 X0.").line("X1.").line("G55").line("G0 X1.");
    assert_eq!(lines(again), [(HEAD + 3, HEAD + 7), (HEAD + 9, HEAD + 9), (HEAD + 12, HEAD + 12)]);
}

#[test]
fn returns_to_the_reference_position_pass_the_point_between() {
    // From beside the wall, G28 by way of a point beyond it runs through it; straight up it does
    // not.
    let shop = Shop::new();
    let beside = || Text::new(&shop).rapid([115.0, 0.0, 300.0]).rapid([90.0, 0.0, 20.0]);
    assert_eq!(beside().line("G91 G28 Z0.").verify().findings, []);
    let v = beside().line("G91 G28 X130. Z0.").verify();
    assert!(
        v.findings.iter().any(|f| f.kind == FindingKind::RapidCollision && f.worst_line == HEAD + 3),
        "{:?}",
        v.findings
    );
}

#[test]
fn rtcp_words_are_the_tip_and_run_like_the_axes_they_stand_for() {
    // The same two tilted poses, once as axis words and once as tip words: the ends agree, so a
    // gouge that deepens toward the end has the same depth.
    let shop = Shop::new();
    let (tilt, tip) = ([0.05, 0.02, 1.0], [10.0, 20.0, 0.8]);
    let above = [10.0, 20.0, 80.0];
    let plain = Text::new(&shop).rapid([10.0, 20.0, 300.0]).rapid_tilted(above, tilt).cut_tilted(tip, tilt).verify();
    let q = shop.axes_at(tip, tilt);
    let words = shop.words.words(q.as_slice()).unwrap();
    let rotary: String = words
        .iter()
        .filter(|w| w.letter.kind() == facemill_nc_program::words::AxisKind::Rotary)
        .map(|w| format!(" {}{:.4}", w.letter, w.value))
        .collect();
    let rtcp = Text::new(&shop)
        .rapid([10.0, 20.0, 300.0])
        .line(&format!("G0 G43.4 X10. Y20. Z80.{rotary} H7"))
        .line("G1 Z0.8 F500.")
        .verify();
    let (a, b) = (plain.largest_gouge.unwrap().depth_mm, rtcp.largest_gouge.unwrap().depth_mm);
    assert!(a > 0.1 && (a - b).abs() < 1e-3, "{a} {b}");
    assert!((rtcp.cutting_length_mm - 79.2).abs() < 1e-6);
    assert!((rtcp.cutting_time_s - 79.2 / 500.0 * 60.0).abs() < 1e-6);
}

/// A long zigzag with a dip in every tenth block, some through the wall.
fn long_program(shop: &Shop) -> Text<'_> {
    let mut text = Text::new(shop).rapid([-100.0, -150.0, 300.0]);
    for k in 0..400 {
        let (x, y) = (f64::from(k % 20) * 10.0 - 100.0, f64::from(k / 20) * 12.0 - 120.0);
        let z = if k % 10 == 7 { -0.1 } else { 1.0 };
        text = text.cut_tilted([x, y, z + 1.0], [0.05 + 0.01 * f64::from(k % 3), 0.02, 1.0]);
    }
    text
}

#[test]
fn result_does_not_depend_on_the_number_of_threads() {
    let shop = Shop::new();
    let text = long_program(&shop);
    let on = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| text.verify());
    let one = on(1);
    assert!(!one.findings.is_empty());
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

#[test]
fn an_episode_over_many_blocks_and_chunks_is_one_finding() {
    let shop = Shop::new();
    let mut text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).rapid([-100.0, 0.0, 1.0]);
    for k in 0..600 {
        text = text.cut([-100.0 + 0.25 * f64::from(k), 0.0, -0.1 - 0.0005 * f64::from(k)]);
    }
    let v = text.cut([60.0, 0.0, 50.0]).verify();
    let f = only(&v);
    assert_eq!((f.first_line, f.last_line, f.worst_line), (HEAD + 3, HEAD + 602, HEAD + 602));
    assert!((f.measure.unwrap().value() - 0.3995).abs() < 1e-3);
}

#[test]
fn cancelled_runs_have_no_result_and_bad_setups_are_named() {
    struct CancelAtOnce;
    impl Monitor for CancelAtOnce {
        fn advance(&self, _: usize) {}
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let shop = Shop::new();
    let program = read_program(&long_program(&shop).text, Dialect::Fanuc).unwrap();
    let run = |setup: &VirtualSetup<'_>, settings: &VerifySettings, monitor: &dyn Monitor| {
        verify(&program, setup, settings, monitor).unwrap_err()
    };
    let settings = VerifySettings::default();
    assert_eq!(run(&shop.setup(), &settings, &CancelAtOnce), VerifyError::Cancelled(Cancelled));
    let fine = VerifySettings { max_step: 0.0, ..settings.clone() };
    assert!(matches!(run(&shop.setup(), &fine, &Silent), VerifyError::Setting { field: "max_step", .. }));
    let mut setup = shop.setup();
    setup.obstacles[1].stock = f64::NAN;
    let error = run(&setup, &settings, &Silent);
    assert!(matches!(&error, VerifyError::Obstacle { obstacle, field: "stock", .. } if obstacle == "wall"));
    let few = WordMap::new(shop.words.axes()[..4].to_vec(), WorkOffset::default(), 100.0).unwrap();
    let setup = VirtualSetup { words: &few, ..shop.setup() };
    assert!(matches!(run(&setup, &settings, &Silent), VerifyError::OtherAxes { .. }));
}

#[test]
fn monitor_advances_once_by_every_block() {
    struct Count(std::sync::atomic::AtomicUsize);
    impl Monitor for Count {
        fn advance(&self, steps: usize) {
            self.0.fetch_add(steps, std::sync::atomic::Ordering::Relaxed);
        }
        fn is_cancelled(&self) -> bool {
            false
        }
    }
    let shop = Shop::new();
    let program = read_program(&long_program(&shop).text, Dialect::Fanuc).unwrap();
    let count = Count(0.into());
    verify(&program, &shop.setup(), &VerifySettings::default(), &count).unwrap();
    assert_eq!(count.0.into_inner(), program.blocks.len());
}

#[test]
fn a_finding_reads_the_scales_of_the_machine() {
    let shop = Shop::new();
    let v = pass(&shop, 0.05, -0.3);
    let pose = only(&v).pose.as_ref().unwrap();
    let lift = lift_of(0.05);
    let q = shop.axes_at([-30.0, 10.0, -0.3 + lift], [0.05, 0.0, 1.0]);
    assert!((pose.tip_work_mm[2] - (lift - 0.3)).abs() < 1e-3, "{pose:?}");
    for (k, axis) in shop.machine.axes().iter().enumerate() {
        let expected = if axis.kind == AxisKind::Rotary { q[k].to_degrees() } else { q[k] };
        assert_eq!(pose.axis_values[k].axis, axis.letter.as_str());
        assert!((pose.axis_values[k].value - expected).abs() < 1e-3, "{pose:?}");
    }
}

/// Two dips of the same depth, the first on line `HEAD + 4`, the second on line `HEAD + 8`.
fn two_dips(sections: Vec<GougeSection>) -> Result<Verification, VerifyError> {
    let shop = Shop::new();
    let mut text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).rapid([-100.0, 0.0, 5.0]);
    for x in [-50.0, 50.0] {
        text = text.cut([x - 10.0, 0.0, 1.0]).cut([x, 0.0, -0.05]).cut([x + 10.0, 0.0, 1.0]).cut([x + 15.0, 0.0, 2.0]);
    }
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    verify(&program, &shop.setup(), &VerifySettings { sections, ..VerifySettings::default() }, &Silent)
}

fn section(name: &str, first_line: u32, gouge_limit: f64) -> GougeSection {
    GougeSection { name: name.to_owned(), first_line, gouge_limit }
}

#[test]
fn the_same_gouge_is_a_finding_in_a_strict_section_and_none_in_a_loose_one() {
    let lines = |v: &Verification| v.findings.iter().map(|f| (f.kind, f.worst_line)).collect::<Vec<_>>();
    let (first, second) = ((FindingKind::Gouge, HEAD + 4), (FindingKind::Gouge, HEAD + 8));
    assert_eq!(lines(&two_dips(vec![]).unwrap()), [first, second], "the limit without sections is 0.02 mm");
    for (limits, expected) in [
        ([0.02, 0.1], vec![first]),
        ([0.1, 0.02], vec![second]),
        ([0.1, 0.1], vec![]),
        ([0.02; 2], vec![first, second]),
    ] {
        let sections = vec![section("roughing", HEAD + 3, limits[0]), section("finishing", HEAD + 7, limits[1])];
        let v = two_dips(sections).unwrap();
        assert_eq!(lines(&v), expected, "{limits:?}");
        for (s, line) in v.sections.iter().zip([HEAD + 4, HEAD + 8]) {
            let largest = s.largest_gouge.as_ref().unwrap();
            assert!((largest.depth_mm - 0.05).abs() < 1e-3 && largest.line == line, "{s:?}");
        }
        assert_eq!(v.sections.iter().map(|s| s.gouge_limit_mm).collect::<Vec<_>>(), limits);
    }
    // Before the first section the general limit holds.
    let v = two_dips(vec![section("finishing", HEAD + 7, 0.1)]).unwrap();
    assert_eq!(lines(&v), [first]);
    assert!(v.largest_gouge.is_some() && v.sections.len() == 1);
}

#[test]
fn sections_out_of_order_or_without_a_limit_are_refused() {
    let run = |sections| two_dips(sections).unwrap_err();
    let error = run(vec![section("b", 9, 0.1), section("a", 9, 0.1)]);
    assert_eq!(error, VerifyError::SectionOrder { section: "a".to_owned(), line: 9 });
    assert!(matches!(run(vec![section("a", 0, 0.1)]), VerifyError::SectionOrder { .. }));
    assert!(matches!(run(vec![section("a", 1, f64::NAN)]), VerifyError::Setting { .. }));
    assert!(matches!(run(vec![section("a", 1, -0.1)]), VerifyError::Setting { .. }));
}
