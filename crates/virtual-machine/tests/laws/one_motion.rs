//! Feeds and times take positions from where verification takes them.

use facemill_cl_data::Silent;
use facemill_inverse_kinematics::AxisValues;
use facemill_nc_program::{Dialect, FeedMode, ReadProgram, read_program};
use facemill_test_kit::Random;
use facemill_virtual_machine::motion::axis_motion::{AxisMotion, MotionContext, MotionReader};
use facemill_virtual_machine::{Finding, FindingKind, VerifySettings, VirtualSetup, place_findings, verify};

use crate::kit::Shop;
use crate::kit::dual::{LENGTHS, Shop as DualShop};

fn context<'a>(setup: &VirtualSetup<'a>) -> MotionContext<'a> {
    MotionContext {
        machine: setup.machine,
        tool_length: setup.tool.gauge_length(),
        words: setup.words,
        frame: setup.table_from_rtcp_words,
        work_offset: Some(setup.words.work_offset()),
    }
}

/// The last position of each block, as feeds see it; `Err` with the reason of a refusal.
fn seen_by_feeds(program: &ReadProgram, setup: &VirtualSetup<'_>) -> Vec<Result<AxisMotion, String>> {
    let mut reader = MotionReader::new(context(setup), program.dialect, program.rtcp_rapids);
    program.blocks.iter().map(|block| reader.block(block)).collect()
}

fn end(motion: &AxisMotion) -> Option<AxisValues> {
    match motion {
        AxisMotion::Rapid { positions, .. } => positions.last().copied(),
        AxisMotion::Cut(cut) => Some(cut.to),
        AxisMotion::Other(end) => *end,
        AxisMotion::None => None,
    }
}

/// The position before each block, as verification has it, in mm and deg.
fn seen_by_verification(program: &ReadProgram, setup: &VirtualSetup<'_>) -> Vec<Option<Vec<f64>>> {
    let at = |line| Finding::of_line(FindingKind::UnknownBlock, line, None, "", String::new());
    let mut places: Vec<Finding> = program.blocks.iter().map(|b| at(b.line)).collect();
    place_findings(program, setup, &VerifySettings::default(), &mut places).unwrap();
    places.into_iter().map(|f| f.pose.map(|pose| pose.axis_values.iter().map(|a| a.value).collect())).collect()
}

/// A program of random blocks: with and without compensation and RTCP, absolute and incremental,
/// to the reference position, with arcs, and with calls behind which nothing is known.
fn random_program(random: &mut Random) -> String {
    let mut text = String::from("G21 G90 G94 G54\n");
    for _ in 0..60 {
        let mut words = String::new();
        for letter in ["X", "Y", "Z", "B", "C"] {
            if random.unit() < 0.45 {
                words += &format!("{letter}{:.3} ", 40.0 * random.unit() - 20.0);
            }
        }
        text += &match (10.0 * random.unit()) as u32 {
            0 => format!("G0 G43 Z{:.3} H7", 100.0 * random.unit()),
            1 => "G49".to_owned(),
            2 => format!("G91 G28 {}Z{:.3}\nG90", if random.unit() < 0.5 { "B0. " } else { "" }, 9.0 * random.unit()),
            3 => format!("G43.4 H7\nG1 {words}F500."),
            4 => format!("G91 G1 {words}F300.\nG90"),
            5 => format!("G0 {words}"),
            6 if random.unit() < 0.3 => "M98 P1000".to_owned(),
            _ => format!("G1 {words}F800."),
        };
        text.push('\n');
    }
    text
}

#[test]
fn feeds_and_verification_have_the_axes_at_the_same_places_in_any_program() {
    let shop = Shop::new();
    let setup = shop.setup();
    let mut random = Random(18);
    let mut compared = 0;
    for _ in 0..40 {
        let text = random_program(&mut random);
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let (feeds, verified) = (seen_by_feeds(&program, &setup), seen_by_verification(&program, &setup));
        for (k, motion) in feeds.iter().enumerate().take(program.blocks.len() - 1) {
            let Some(seen) = motion.as_ref().ok().and_then(end) else { continue };
            let line = program.blocks[k].line;
            let behind = verified[k + 1].as_ref();
            let Some(behind) = behind else {
                // A block behind this one may forget them: its own commands come first.
                assert!(!program.blocks[k + 1].commands.is_empty(), "line {line}: only feeds know a place\n{text}");
                continue;
            };
            for (axis, (seen, behind)) in setup.machine.axes().iter().zip(seen.iter().zip(behind)) {
                let seen = axis.in_word_unit(seen);
                assert!((seen - behind).abs() < 1e-9, "line {line}, {}: {seen} and {behind}\n{text}", axis.letter);
            }
            compared += 1;
        }
    }
    assert!(compared > 400, "{compared}");
}

/// `G43` with a number and no axis does not say whose length it switches on: a finding. Both take
/// the length as on, as it is in any program that means to cut.
#[test]
fn a_length_that_names_no_axis_of_two_heads_counts_for_feeds_as_it_does_for_verification() {
    let shop = DualShop::new();
    let setup = shop.setup(0);
    let letters: Vec<String> = shop.words.axes().iter().map(|a| a.letter.to_string()).collect();
    let sign = |letter: &str| if letter.len() > 1 { "=" } else { "" };
    let all = |value: f64| letters.iter().map(|l| format!("{l}{}{value:.3} ", sign(l))).collect::<String>();
    let text = format!("G21 G90 G94 G54\nG43 H{}\nG0 {}\nG1 {}F100.\nM5\n", 7, all(1.0), all(2.0));
    let program = read_program(&text, Dialect::Fanuc).unwrap();
    let cut = program.blocks.iter().position(|b| b.text.starts_with("G1")).expect("a cut");
    assert!(program.blocks[cut].motion.as_ref().is_some_and(|m| !m.lengths.is_clear()), "{text}");
    let feeds = seen_by_feeds(&program, &setup);
    let seen = end(feeds[cut].as_ref().unwrap()).unwrap();
    let verified = seen_by_verification(&program, &setup)[cut + 1].clone().unwrap();
    for (k, axis) in setup.machine.axes().iter().enumerate() {
        assert!((axis.in_word_unit(seen[k]) - verified[k]).abs() < 1e-9, "{}", axis.letter);
    }
    let spindle = shop.words.axes().iter().position(|a| a.letter.to_string() == "Z1").unwrap();
    let offset = shop.words.axes()[spindle].offset;
    assert!(((seen[spindle] - offset - 2.0).abs() - LENGTHS[0]).abs() < 1e-9, "{}", seen[spindle]);
}

/// Controls fix the frame of words to the table as it is where RTCP comes on: with the table
/// turned, positions are not known, and feeds are not computed from wrong ones.
#[test]
fn feeds_refuse_a_program_that_switches_rtcp_on_with_the_table_turned() {
    let shop = Shop::new();
    let setup = shop.setup();
    let with = |c: f64| {
        let text = format!("G21 G90 G94 G54\nG0 C{c:.3}\nG43.4 H7\nG1 X0. Y0. Z50. B0. F500.\nG1 X10.\nM30\n");
        read_program(&text, Dialect::Fanuc).unwrap()
    };
    let square = seen_by_feeds(&with(0.0), &setup);
    assert!(square.iter().all(Result::is_ok), "{:?}", square.iter().find_map(|r| r.as_ref().err()));
    let turned = seen_by_feeds(&with(30.0), &setup);
    let refusals: Vec<&String> = turned.iter().filter_map(|r| r.as_ref().err()).collect();
    let [why] = refusals[..] else { panic!("{refusals:?}") };
    assert!(why.starts_with("axis C: RTCP is switched on with the table turned"), "{why}");
}

/// A table axis that went to a place of which the text says nothing may be turned.
#[test]
fn feeds_refuse_a_program_that_switches_rtcp_on_with_the_table_at_an_unknown_angle() {
    let shop = Shop::new();
    let setup = shop.setup();
    let text = "G21 G90 G94 G54\nG91 G30 C0.\nG90 G43.4 H7\nG1 X0. Y0. Z50. B0. C0. F500.\nG1 X10.\nM30\n";
    let seen = seen_by_feeds(&read_program(text, Dialect::Fanuc).unwrap(), &setup);
    let refusals: Vec<&String> = seen.iter().filter_map(|r| r.as_ref().err()).collect();
    assert!(refusals.iter().any(|why| why.contains("RTCP is switched on with the table turned")), "{refusals:?}");
}

/// An axis that went home before RTCP comes on stays there under it, as it does by its words. Named
/// at a machine position under RTCP, it has no coordinate.
#[test]
fn an_axis_that_went_home_keeps_its_place_under_rtcp() {
    let shop = Shop::new();
    let setup = shop.setup();
    let of = |before: &str, under: &str| {
        let start = "G21 G90 G94 G54\nG0 X0. Y0. Z300. B10. C0.";
        let text = format!("{start}\n{before}\nG90 G43.4 H7\n{under}\nG1 X25. Z60. F500.\nG1 B5.\nM30\n");
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let found = verify(&program, &setup, &VerifySettings::default(), &Silent).unwrap().findings;
        let unknown = found.iter().filter(|f| f.kind == FindingKind::UnknownPosition).count();
        (unknown, seen_by_verification(&program, &setup).pop().flatten())
    };
    let under = "G0 X20. Y5. Z80.";
    for (home, words) in [("G91 G28 B0.", "G0 B0."), ("G53 G0 B0.", "G0 B0."), ("G53 G0 Z900.", "G0 Z444.5")] {
        let (unknown, by_home) = of(home, under);
        let (by_home, by_words) = (by_home.unwrap(), of(words, under).1.unwrap());
        assert_eq!(unknown, 0, "{home}");
        let apart = by_home.iter().zip(&by_words).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-9, "{home}: {by_home:?} {by_words:?}");
    }
    // A coordinate that no block names is that of the tip where the axis is.
    let [at_home, at_word] = ["G53 G0 Z900.", "G0 Z444.5"].map(|before| of(before, "G0 X20. Y5.").1.unwrap());
    assert!(at_home.iter().zip(&at_word).all(|(a, b)| (a - b).abs() < 1e-9), "{at_home:?} {at_word:?}");
    assert!(of("G91 G28 B0.", "G53 G0 B0.").0 > 0);
}

/// Behind a word that changes what F gives, no cut has a time, wherever words name its axes again.
#[test]
fn cuts_behind_a_word_that_changes_feeds_are_refused() {
    let shop = Shop::new();
    let setup = shop.setup();
    let refused = |word: &str| {
        let text = format!(
            "G710 G90 G94 G54\nG0 X0 Y0 Z800 B0 C0\nG1 X1 F500\n{word}\nG0 X0 Y0 Z800 B0 C0\nG1 X1\nG1 X2 F300\n"
        );
        let seen = seen_by_feeds(&read_program(text, Dialect::Siemens840d).unwrap(), &setup);
        seen.iter().map(Result::is_err).collect::<Vec<_>>()
    };
    assert_eq!(refused("OVR=50"), [false, false, false, true, false, true, true]);
    assert_eq!(refused("M8"), [false; 7]);
}

/// F of inverse time holds for its block alone.
#[test]
fn a_cut_of_inverse_time_without_a_feed_has_no_time() {
    let shop = Shop::new();
    let setup = shop.setup();
    for compensation in ["G43 H7", "G43.4 H7"] {
        let text =
            format!("G21 G90 G93 G54\n{compensation}\nG0 X0. Y0. Z800. B0. C0.\nG1 B1. F2.\nB2.\nX1. Y1. Z801. B3.\n");
        let seen = seen_by_feeds(&read_program(text, Dialect::Fanuc).unwrap(), &setup);
        let times = seen.iter().filter_map(|motion| match motion {
            Ok(AxisMotion::Cut(cut)) => Some((cut.mode, cut.time, cut.is_free())),
            _ => None,
        });
        let g93 = |time| (FeedMode::G93, time, false);
        assert_eq!(times.collect::<Vec<_>>(), [g93(Some(30.0)), g93(None), g93(None)], "{compensation}");
    }
}
