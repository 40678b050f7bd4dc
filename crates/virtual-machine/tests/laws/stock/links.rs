//! Links of a program against the stock as it is there: what is free above uncut stock, in a slot
//! once it is cut, and over a fixture, by heights that the scene tells.

use crate::kit::stock::cut_stock;
use crate::kit::{Shop, Text};
use facemill_cl_data::Silent;
use facemill_inverse_kinematics::AxisValues;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{
    LinkDistances, LinkHold, LinkSettings, LinkStage, ProgramLink, VerifySettings, links_off_first_stock, run_links,
};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

const UP: [f64; 3] = [0.0, 0.0, 1.0];

const KEEP: LinkSettings = LinkSettings { clearance: 3.0, tolerance: 0.01 };

/// Height kept above material whose lines are 2 mm apart, with 0.1 mm to spare.
const ABOVE: f64 = 3.0 + 2.0 * std::f64::consts::FRAC_1_SQRT_2 + 0.1;

/// A block on the plate in front of the wall, 20 mm high.
fn block() -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), [-200.0, -200.0, 0.0], [140.0, 200.0, 20.0], 2.0).unwrap()
}

/// Two slots side by side, 90 mm wide together, and a link behind each of them.
fn two_slots(shop: &Shop) -> String {
    let slot = |text: Text<'_>, y: f64| {
        let begun = Text { shop, ..text }.rapid([-260.0, y, 100.0]).rapid([-260.0, y, 40.0]).cut([-260.0, y, 10.0]);
        begun.cut([100.0, y, 10.0]).cut([100.0, y, 40.0]).rapid([100.0, y, 100.0]).text
    };
    let first = slot(Text::new(shop), -20.0);
    let both = slot(Text { shop, text: first }, 20.0);
    Text { shop, text: both }.rapid([-260.0, 0.0, 40.0]).cut([-260.0, 0.0, 30.0]).rapid([-260.0, 0.0, 100.0]).text
}

#[test]
fn a_way_is_free_by_the_stock_at_that_moment_and_the_heights_of_the_scene() {
    let shop = Shop::new();
    let program = read_program(two_slots(&shop), Dialect::Fanuc).unwrap();
    let over = |ways: &[[f64; 3]]| -> Vec<AxisValues> { ways.iter().map(|tip| shop.axes_at(*tip, UP)).collect() };
    let across = |h: f64| over(&[[100.0, 100.0, h], [-260.0, 100.0, h]]);
    let in_slot = |z: f64| over(&[[90.0, 0.0, z + 12.0], [80.0, 0.0, z], [-260.0, 0.0, z]]);
    let beyond_wall = |h: f64| over(&[[100.0, 0.0, h], [240.0, 0.0, h]]);
    let (mut seen, mut rest) = (Vec::new(), block());
    let settings = VerifySettings::default();
    let mut visit = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
        seen.push(link.hold.clone());
        if link.hold.is_some() {
            return;
        }
        let is_second = seen.len() == 3;
        assert!(stage.is_free(link, &link.ends), "the program's own way");
        assert!(stage.is_free(link, &across(20.0 + ABOVE)) && !stage.is_free(link, &across(20.0 + ABOVE - 0.2)));
        // Before the second slot is cut half of the cutter would be in its stock.
        assert_eq!(stage.is_free(link, &in_slot(10.0 + ABOVE)), is_second);
        assert!(!stage.is_free(link, &in_slot(10.0 + ABOVE - 0.2)));
        assert!(stage.is_free(link, &beyond_wall(63.1)) && !stage.is_free(link, &beyond_wall(62.9)));
        // Into the plate, and beyond the machine's travel.
        assert!(!stage.is_free(link, &over(&[[-260.0, 0.0, -5.0], [-100.0, 0.0, -5.0]])));
        let mut far = link.start;
        far[2] += 1e5;
        assert!(!stage.is_free(link, &[far]));
    };
    run_links(&program, &[&shop.setup()], (&settings, &KEEP), &mut rest, &mut visit, &Silent).unwrap();
    assert_eq!(seen, [Some(LinkHold::WayIn), None, None, Some(LinkHold::WayOut)]);
    // The rest is that of the run of the stock.
    let mut expected = block();
    let run = cut_stock(&program, &shop.setup(), &settings, &mut expected, KEEP.tolerance);
    assert!(run.findings.is_empty(), "{:?}", run.findings);
    rest.check_invariants().unwrap();
    assert_eq!(rest, expected);
}

/// Ways over the plate with stock of 20 mm on it, and over the wall, which is a fixture.
#[test]
fn a_way_can_keep_off_the_stock_as_it_was_at_first() {
    let shop = Shop::new();
    let program = read_program(two_slots(&shop), Dialect::Fanuc).unwrap();
    let mut setup = shop.setup();
    setup.obstacles[0].stock = 20.0;
    let lowest = |first_stock: f64, fixtures: f64| {
        let look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
            let free = |y: f64, to: f64, heights: [f64; 4]| {
                let way = |h: &f64| [[100.0, y, *h], [to, y, *h]].map(|tip| shop.axes_at(tip, UP));
                heights.into_iter().filter(|h| stage.is_free(link, &way(h))).fold(f64::INFINITY, f64::min)
            };
            let over_wall = free(0.0, 240.0, [59.9, 60.2, 62.9, 63.2]);
            (link.blocks[0], link.hold.clone(), free(100.0, -260.0, [19.9, 20.2, 23.9, 24.2]), over_wall)
        };
        let keep = LinkDistances { fixtures, first_stock };
        let found = links_off_first_stock(&program, &[&setup], (&VerifySettings::default(), keep), &look, &Silent);
        let found = found.unwrap();
        assert!(found.is_sorted_by_key(|f| f.0) && found[0].1 == Some(LinkHold::WayIn), "{found:?}");
        let between: Vec<[f64; 2]> = found.iter().filter(|f| f.1.is_none()).map(|f| [f.2, f.3]).collect();
        // Nothing is cut between them.
        assert!(between.len() == 2 && between[0] == between[1], "{between:?}");
        between[0]
    };
    assert_eq!([lowest(0.0, 0.0), lowest(4.0, 0.0), lowest(0.0, 3.0)], [[20.2, 60.2], [24.2, 60.2], [20.2, 63.2]]);
    let bad = LinkDistances { fixtures: 0.0, first_stock: f64::NAN };
    let look = |_: &ProgramLink, _: &LinkStage<'_, '_>| ();
    let why =
        links_off_first_stock(&program, &[&setup], (&VerifySettings::default(), bad), &look, &Silent).unwrap_err();
    assert!(why.to_string().contains("first_stock"), "{why}");
}

#[test]
fn links_behind_a_fault_of_the_text_are_held() {
    let shop = Shop::new();
    let text = two_slots(&shop);
    // A call that may move any axis, before the second slot.
    let at = text.match_indices("G1").nth(3).unwrap().0;
    let text = format!("{}M98 P1\n{}", &text[..at], &text[at..]);
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let mut held = Vec::new();
    let mut visit = |link: &ProgramLink, _: &LinkStage<'_, '_>| {
        held.push(link.hold.clone());
    };
    let settings = VerifySettings::default();
    run_links(&program, &[&shop.setup()], (&settings, &KEEP), &mut block(), &mut visit, &Silent).unwrap();
    let call = program.blocks.iter().find(|b| b.text.contains("M98")).unwrap().line;
    let is_call = |h: &Option<LinkHold>| matches!(h, Some(LinkHold::Doubt { line, .. }) if *line == call);
    assert!(held[2..].iter().any(is_call), "{held:?}");
    assert!(held.iter().skip(2).all(Option::is_some), "{held:?}");
    let bad = LinkSettings { clearance: -1.0, ..KEEP };
    let why = run_links(&program, &[&shop.setup()], (&settings, &bad), &mut block(), &mut |_, _| {}, &Silent);
    assert!(why.unwrap_err().to_string().contains("clearance is -1"));
}
