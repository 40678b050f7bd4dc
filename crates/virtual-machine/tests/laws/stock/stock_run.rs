//! The stock as programs cut it: volumes of slots, what meets it in rapids and behind the flute,
//! and laws of the run.

use crate::kit::stock::cut_stock;
use crate::kit::{CORNER, HEAD, RADIUS, Shop, Text};
use facemill_cl_data::{Aabb, Silent};
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{Finding, FindingKind, StockRun, VerifySettings, blocks_beyond};
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3};

const TOLERANCE: f64 = 0.01;

/// A block on the plate, 400 mm square and this high.
fn block(height: f64, cell: f64) -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), [-200.0, -200.0, 0.0], [200.0, 200.0, height], cell).unwrap()
}

fn run(shop: &Shop, text: &str, stock: &mut DexelMap) -> StockRun {
    let program = read_program(text, Dialect::Fanuc).unwrap();
    cut_stock(&program, &shop.setup(), &VerifySettings::default(), stock, TOLERANCE)
}

fn kinds(run: &StockRun) -> Vec<(FindingKind, u32)> {
    run.findings.iter().map(|f| (f.kind, f.worst_line - HEAD)).collect()
}

/// Straight through the block at this height, in from the side.
fn slot(shop: &Shop, z: f64) -> String {
    let start = Text::new(shop).rapid([-260.0, 0.0, z + 200.0]).rapid([-260.0, 0.0, z]);
    start.cut([260.0, 0.0, z]).rapid([260.0, 0.0, z + 200.0]).text
}

#[test]
fn a_slot_has_its_section_times_its_length() {
    let shop = Shop::new();
    let section = 2.0 * RADIUS * 10.0 - 2.0 * CORNER * CORNER * (1.0 - std::f64::consts::FRAC_PI_4);
    let mut errors = Vec::new();
    for cell in [2.0, 1.0, 0.5] {
        let run = run(&shop, &slot(&shop, 10.0), &mut block(20.0, cell));
        assert!(run.findings.is_empty(), "{:?}", run.findings);
        let exact = 400.0 * section;
        errors.push((run.removed_mm3 - exact).abs() / exact);
        let [cut] = run.blocks.iter().filter(|b| b.removed_mm3 > 0.0).collect::<Vec<_>>()[..] else { panic!() };
        assert!((cut.way_mm - 520.0).abs() < 0.01, "{cut:?}");
    }
    // A midpoint rule across a section with two vertical flanks.
    assert!(errors[0] < 0.02 && errors[2] < 0.002, "{errors:?}");
}

#[test]
fn a_rapid_through_the_block_is_found_on_its_line_and_none_above_it() {
    let shop = Shop::new();
    let rapid =
        |z: f64| Text::new(&shop).rapid([-260.0, 0.0, 200.0]).rapid([-260.0, 0.0, z]).rapid([260.0, 0.0, z]).text;
    let through = run(&shop, &rapid(19.0), &mut block(20.0, 1.0));
    assert_eq!(kinds(&through), [(FindingKind::RapidCollision, 3)], "{:?}", through.findings);
    assert_eq!(through.removed_mm3, 0.0);
    // Half a cell's diagonal is kept.
    assert!(run(&shop, &rapid(20.8), &mut block(20.0, 1.0)).findings.is_empty());
    // Where two slots beside each other have been cut before, a rapid between their walls is free.
    let cut = |text: Text<'_>, y: f64| {
        let start = Text { shop: &shop, ..text }.rapid([-260.0, y, 200.0]).rapid([-260.0, y, 18.0]);
        start.cut([260.0, y, 18.0]).rapid([260.0, y, 200.0]).text
    };
    let first = cut(Text::new(&shop), -10.0);
    let both = Text { text: cut(Text { text: first, shop: &shop }, 10.0), shop: &shop };
    let both = both.rapid([-260.0, 0.0, 200.0]).rapid([-260.0, 0.0, 19.0]).rapid([260.0, 0.0, 19.0]).text;
    let both = run(&shop, &both, &mut block(20.0, 1.0));
    assert!(both.findings.is_empty(), "{:?}", both.findings);
}

#[test]
fn a_rapid_back_out_of_a_cut_is_near_and_one_beside_other_stock_is_a_collision() {
    let shop = Shop::new();
    let slot_to = |x: f64, y: f64| {
        let start = Text::new(&shop).rapid([-260.0, y, 200.0]).rapid([-260.0, y, 10.0]);
        start.cut([x, y, 10.0])
    };
    let found = |text: Text<'_>| run(&shop, &text.text, &mut block(20.0, 1.0)).findings;
    let is = |f: &Finding, kind, line: u32| (f.kind, f.worst_line - HEAD, f.measure) == (kind, line, None);
    let mut n_near = 0;
    for k in 0..8 {
        // Straight up out of the slot, wherever its walls are among the lines.
        let (x, y) = (0.13 * f64::from(k), 0.37 * f64::from(k));
        let up = found(slot_to(x, y).rapid([x, y, 12.0]).rapid([x, y, 200.0]));
        assert!(up.iter().all(|f| f.kind == FindingKind::NearMiss && f.measure.is_none()), "{up:?} at {x}, {y}");
        n_near += up.len();
        // Sideways into the wall, by less than to the next line, and up from there.
        let aside = 0.37 * (1.0 - (y + RADIUS).fract()).max(0.3);
        let into = found(slot_to(x, y).rapid([x, y + aside, 10.0]).rapid([x, y + aside, 200.0]));
        assert!(into.iter().any(|f| f.kind == FindingKind::RapidCollision), "{into:?} at {x}, {y}");
        // As near to the top of the block beside the slot, which no flute has cut.
        let over = slot_to(x, y).rapid([x, y, 200.0]).rapid([x, y + 100.0, 200.0]).rapid([x, y + 100.0, 20.3]);
        let over = found(over.rapid([x, y + 100.0, 200.0]));
        assert!(over.iter().any(|f| is(f, FindingKind::RapidCollision, 6)), "{over:?}");
    }
    assert!(n_near > 4, "{n_near}");
}

#[test]
fn a_slot_deeper_than_the_flute_is_a_collision_with_the_body_behind_it() {
    let shop = Shop::new();
    // The flute ends 12 mm above the tip, and the body behind it is narrower: it meets what is left
    // above.
    let deep = run(&shop, &slot(&shop, 20.0 - 12.1), &mut block(20.0, 2.0));
    assert_eq!(kinds(&deep), [(FindingKind::HolderCollision, 3)], "{:?}", deep.findings);
    assert_eq!(deep.findings[0].body.as_deref(), Some("cutter body section 1"));
    let shallow = run(&shop, &slot(&shop, 20.0 - 11.9), &mut block(20.0, 2.0));
    assert!(shallow.findings.is_empty(), "{:?}", shallow.findings);
}

#[test]
fn a_plunge_into_the_block_is_too_steep_and_one_beside_it_is_not() {
    let shop = Shop::new();
    let plunge = |x: f64| Text::new(&shop).rapid([x, 0.0, 200.0]).rapid([x, 0.0, 30.0]).cut([x, 0.0, 15.0]).text;
    let inside = run(&shop, &plunge(0.0), &mut block(20.0, 1.0));
    assert_eq!(kinds(&inside), [(FindingKind::RampTooSteep, 3)], "{:?}", inside.findings);
    assert!(run(&shop, &plunge(-260.0), &mut block(20.0, 1.0)).findings.is_empty());
}

/// Turning motions: what is cut does not depend on how blocks are divided, or on the number of
/// threads.
#[test]
fn what_is_cut_depends_on_the_motion_alone() {
    let shop = Shop::new();
    let pose = |t: f64| {
        let tilt = 0.05 + 0.25 * t;
        ([-150.0 + 300.0 * t, 60.0 * t, 12.0 - 6.0 * t], [tilt.sin(), 0.3 * t, tilt.cos()])
    };
    let (start, end) = (shop.axes_at(pose(0.0).0, pose(0.0).1), shop.axes_at(pose(1.0).0, pose(1.0).1));
    let program = |n: usize| {
        let mut text = Text::new(&shop).rapid_tilted([-260.0, -260.0, 200.0], pose(0.0).1).text;
        for k in 0..=n {
            let q = start.lerp(&end, k as f64 / n as f64);
            let words = shop.words.words(q.as_slice()).unwrap();
            let words: Vec<String> = words.iter().map(|w| format!("{}{:.5}", w.letter, w.value)).collect();
            text.push_str(&format!("G1 {} F1000.\n", words.join(" ")));
        }
        text
    };
    let mut maps = [block(40.0, 1.0), block(40.0, 1.0)];
    let volumes = [1, 16].map(|n| run(&shop, &program(n), &mut maps[usize::from(n > 1)]).removed_mm3);
    // Both are within 2·TOLERANCE of the truth on the whole border of what is cut.
    let border = 4.0 * 400.0 * 100.0;
    assert!(volumes[0] > 1e5 && (volumes[0] - volumes[1]).abs() < 4.0 * TOLERANCE * border, "{volumes:?}");
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut again = block(40.0, 1.0);
    one.install(|| run(&shop, &program(1), &mut again));
    assert_eq!(again, maps[0]);
}

/// The tool's widest body is 42 mm from its axis, with its clearance; bounds may add a little, and
/// leave nothing out.
#[test]
fn blocks_that_reach_stock_beyond_the_lines_are_reported() {
    let shop = Shop::new();
    // Lines over x from −200 to 0 of the plate.
    let half = DexelMap::of_box(&Isometry3::identity(), [-200.0, -200.0, 0.0], [0.0, 200.0, 20.0], 4.0).unwrap();
    let extents = Aabb { min: Point3::new(-200.0, -200.0, 0.0), max: Point3::new(200.0, 200.0, 20.0) };
    let beyond = |text: &str, map: &DexelMap| {
        let program = read_program(text, Dialect::Fanuc).unwrap();
        let settings = VerifySettings::default();
        blocks_beyond(&program, &shop.setup(), &settings, map, &extents, &Silent).unwrap()
    };
    let way = |x: f64, z: f64| {
        let start = Text::new(&shop).rapid([-260.0, 0.0, z + 200.0]).rapid([-260.0, 0.0, z]);
        start.cut([x, 0.0, z]).rapid([x, 0.0, z + 200.0]).text
    };
    assert_eq!(beyond(&way(-45.0, 10.0), &half), [] as [u32; 0]);
    assert_eq!(beyond(&way(-40.0, 10.0), &half), [HEAD + 3, HEAD + 4]);
    // Above all stock there is nothing to meet, and lines over all of it leave nothing uncovered.
    assert_eq!(beyond(&way(100.0, 70.0), &half), [] as [u32; 0]);
    assert_eq!(beyond(&way(100.0, 10.0), &block(20.0, 4.0)), [] as [u32; 0]);
}

/// Of blocks at one height over the block, those that go into it by more than four times the
/// tolerance certainly cut: twice for the ways, twice for the contact. Those that are not tested,
/// or go through cut stock, do not.
#[test]
fn blocks_that_cut_deeper_than_the_tolerance_are_certain() {
    let shop = Shop::new();
    let height = 20.0;
    let at = |depth: f64| -> (String, [bool; 3]) {
        let z = height - depth;
        let text = Text::new(&shop).rapid([-260.0, 0.0, 200.0]).rapid([-260.0, 0.0, z]);
        // To the block, through it, and back where it is cut.
        let text = text.cut([-230.0, 0.0, z]).cut([260.0, 0.0, z]).cut([-260.0, 0.0, z]).text;
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let reported = |probed_lines: Vec<u32>| -> Vec<bool> {
            let settings = VerifySettings { probed_lines, ..VerifySettings::default() };
            let mut stock = block(height, 2.0);
            let run = cut_stock(&program, &shop.setup(), &settings, &mut stock, TOLERANCE);
            assert_eq!(run.blocks[1].removed_mm3 > 0.0, depth > 0.0);
            run.blocks.iter().map(|b| b.is_certain).collect()
        };
        assert_eq!(reported(vec![HEAD + 3, HEAD + 5]), [false; 3], "{text}");
        (text, reported(vec![HEAD + 5, HEAD + 4, HEAD + 3]).try_into().unwrap())
    };
    for (depth, cuts) in
        [(-1.0, false), (0.0, false), (0.9, false), (3.9, false), (4.1, true), (20.0, true), (200.0, true)]
    {
        let (text, certain) = at(depth * TOLERANCE);
        assert_eq!(certain, [false, cuts, false], "{depth} times the tolerance deep:\n{text}");
    }
    // A tolerance that leaves nothing of the cutter tells nothing.
    let program = read_program(slot(&shop, 10.0), Dialect::Fanuc).unwrap();
    let settings = VerifySettings { probed_lines: (1..100).collect(), ..VerifySettings::default() };
    let run = cut_stock(&program, &shop.setup(), &settings, &mut block(height, 4.0), RADIUS);
    assert!(run.removed_mm3 > 0.0 && run.blocks.iter().all(|b| !b.is_certain), "{:?}", run.blocks);
}

/// Along the side of a block, whose outermost lines are half a cell inside: the lines do not see
/// milling outside of them, and the report says that it is near; so is the air above as far as a
/// cell's diagonal, and none beyond.
#[test]
fn blocks_that_may_take_stock_between_the_lines_are_near_it() {
    let (shop, cell) = (Shop::new(), 4.0);
    let diagonal = cell * std::f64::consts::SQRT_2;
    let near = |x: f64, z: f64, is_requested: bool| {
        let text = Text::new(&shop).rapid([x, -300.0, 200.0]).rapid([x, -300.0, z]).cut([x, 300.0, z]).text;
        let program = read_program(&text, Dialect::Fanuc).unwrap();
        let probed_lines = if is_requested { vec![HEAD + 3] } else { Vec::new() };
        let settings = VerifySettings { probed_lines, ..VerifySettings::default() };
        let run = cut_stock(&program, &shop.setup(), &settings, &mut block(20.0, cell), TOLERANCE);
        let [taken] = run.blocks[..] else { panic!("one cut: {:?}", run.blocks) };
        assert!(taken.removed_mm3 == 0.0 && !taken.is_certain, "{taken:?}");
        taken.may_be_near
    };
    let beside = |depth: f64| depth - 200.0 - RADIUS;
    for (depth, is_near) in [(0.45 * cell, true), (0.0, true), (-0.5 * cell, true), (-diagonal, false)] {
        assert_eq!(near(beside(depth), 5.0, true), is_near, "{depth} mm deep");
    }
    for (gap, is_near) in [(0.1, true), (0.98 * diagonal, true), (diagonal + 4.0 * TOLERANCE + 0.01, false)] {
        assert_eq!(near(0.0, 20.0 + gap, true), is_near, "{gap} mm above");
    }
    assert!(!near(0.0, 20.1, false));
}
