//! Two heads that cut one stock at the same time: what each takes, what each meets, and which comes
//! first.

use facemill_cl_data::Silent;
use facemill_inverse_kinematics::Machine;
use facemill_inverse_kinematics::machine_file::Joint;
use facemill_nc_program::ReadProgram;
use facemill_nc_program::read::read_fanuc;
use facemill_virtual_machine::{
    FindingKind, StockRun, VerifyError, VerifySettings, VirtualSetup, run_stock, run_stock_of_heads,
};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

use crate::kit::dual::{FACES, NUMBERS, Program, Shop};
use crate::kit::{CORNER, RADIUS};

const TOLERANCE: f64 = 0.01;

/// The plate from z to z.
fn plate([bottom, top]: [f64; 2], cell: f64) -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), [250.0, -150.0, bottom], [550.0, 150.0, top], cell).unwrap()
}

fn whole(cell: f64) -> DexelMap {
    plate([FACES[1], FACES[0]], cell)
}

/// Both heads at once; what they took is what the stock has lost.
fn together(shop: &Shop, program: &ReadProgram, stock: &mut DexelMap) -> [StockRun; 2] {
    let (setups, settings, before) = ([0, 1].map(|h| shop.setup(h)), VerifySettings::default(), stock.volume());
    let heads = setups.each_ref().map(|setup| (setup, &settings));
    let runs = run_stock_of_heads(program, heads, stock, TOLERANCE, &Silent).unwrap();
    stock.check_invariants().unwrap();
    let (lost, reported) = (before - stock.volume(), runs[0].removed_mm3 + runs[1].removed_mm3);
    assert!((reported - lost).abs() <= 1e-9 * before, "{reported} reported, {lost} lost");
    assert_eq!(runs[0].blocks.len(), runs[1].blocks.len());
    runs
}

fn one(shop: &Shop, head: usize, program: &ReadProgram, stock: &mut DexelMap) -> StockRun {
    run_stock(program, &shop.setup(head), &VerifySettings::default(), stock, TOLERANCE, &Silent).unwrap()
}

/// Places of both tips away from the plate by 200 mm, each on its side.
fn away(tips: [Option<[f64; 3]>; 2]) -> [Option<[f64; 3]>; 2] {
    [0, 1].map(|h| tips[h].map(|[x, y, z]| [x, y, z + [200.0, -200.0][h]]))
}

/// From away straight through one place after the other, and away again; the table turns to each
/// angle on the way.
fn through<'a>(program: Program<'a>, ways: &[(f64, [Option<[f64; 3]>; 2])]) -> Program<'a> {
    let (first, last) = (ways[0], ways[ways.len() - 1]);
    let start = program.rapid(first.0, away(first.1)).rapid(first.0, first.1);
    let cut = ways[1..].iter().fold(start, |program, &(c, tips)| program.cut(c, tips, 20.0));
    cut.rapid(last.0, away(last.1))
}

/// A slot of each head beside that of the other one, as deep as this from its face.
fn slots(depths: [f64; 2], x: f64) -> [Option<[f64; 3]>; 2] {
    [Some([x, -80.0, FACES[0] - depths[0]]), Some([x, 80.0, FACES[1] + depths[1]])]
}

fn only_kind(run: &StockRun) -> Option<(FindingKind, u32)> {
    match &run.findings[..] {
        [] => None,
        [f] => Some((f.kind, f.worst_line)),
        more => panic!("{more:#?}"),
    }
}

/// Lines of the blocks with a motion that is none to the reference position.
fn ways_of_text(program: &ReadProgram) -> Vec<u32> {
    program.motions().filter(|(b, _)| !b.text.contains("G28")).map(|(b, _)| b.line).collect()
}

/// The line of the n-th block at feed, from 0.
fn line_of_cut(program: &ReadProgram, n: usize) -> u32 {
    program.blocks.iter().filter(|b| b.text.contains(" G1 ")).nth(n).unwrap().line
}

#[test]
fn heads_far_apart_cut_the_same_as_one_after_the_other() {
    let shop = Shop::new();
    let depths = [6.0, 9.0];
    let text = through(Program::new(&shop), &[200.0, 600.0].map(|x| (0.1, slots(depths, x)))).text();
    let program = read_fanuc(&text).unwrap();
    let [mut at_once, mut in_turn] = [whole(1.0), whole(1.0)];
    let runs = together(&shop, &program, &mut at_once);
    let alone = [0, 1].map(|h| one(&shop, h, &program, &mut in_turn));
    assert_eq!(runs, alone);
    assert_eq!(at_once.to_bytes(), in_turn.to_bytes());
    for (run, depth) in runs.iter().zip(depths) {
        let exact = 300.0 * (2.0 * RADIUS * depth - 2.0 * CORNER * CORNER * (1.0 - std::f64::consts::FRAC_PI_4));
        assert!((run.removed_mm3 - exact).abs() < 5e-3 * exact, "{} of {exact}", run.removed_mm3);
        assert!(run.findings.is_empty(), "{:?}", run.findings);
    }
}

/// With a turning table the ways are divided otherwise than for one head: within the tolerance they
/// are the same.
#[test]
fn heads_over_a_turning_table_take_what_each_takes_alone() {
    let shop = Shop::new();
    let way = |k: usize| (0.1 + 0.05 * k as f64, slots([5.0, 7.0 + k as f64], 280.0 + 80.0 * k as f64));
    let ways: Vec<_> = (0..4).map(way).collect();
    // In and out beside the plate.
    let at = |c: f64, x: f64, depths: [f64; 2]| (c, slots(depths, x));
    let ways = [vec![at(0.1, 200.0, [5.0, 7.0])], ways, vec![at(0.3, 600.0, [5.0, 10.0])]].concat();
    let program = read_fanuc(through(Program::new(&shop), &ways).text()).unwrap();
    let [mut at_once, mut in_turn] = [whole(1.0), whole(1.0)];
    let runs = together(&shop, &program, &mut at_once);
    let alone = [0, 1].map(|h| one(&shop, h, &program, &mut in_turn));
    for (run, alone) in runs.iter().zip(&alone) {
        // Both are within twice the tolerance of the truth on the border of what is cut.
        let border = 400.0 * 4.0 * RADIUS;
        let off = run.removed_mm3 - alone.removed_mm3;
        assert!(run.removed_mm3 > 5e4 && off.abs() < 4.0 * TOLERANCE * border, "{off} of {}", run.removed_mm3);
        assert!(run.findings.is_empty() && alone.findings.is_empty(), "{:?} {:?}", run.findings, alone.findings);
    }
}

/// The second head's body goes through a thin plate along the slot that the first head mills in the
/// same block: it is free where the first head goes ahead by more than a part of the way, and a
/// collision where it comes at the same time or behind.
#[test]
fn a_body_is_free_of_what_another_head_has_taken_before_and_of_nothing_else() {
    let shop = Shop::new();
    let first = |x: f64| Some([x, 0.0, 139.0]);
    // Its flute is above the plate, the body behind it in it.
    let second = |x: f64| Some([x, 0.0, 175.0]);
    let found = |text: String, cut: usize| {
        let program = read_fanuc(&text).unwrap();
        let runs = together(&shop, &program, &mut plate([140.0, 150.0], 2.0));
        assert!(runs[0].findings.is_empty() && runs[1].removed_mm3 == 0.0, "{:?}", runs[0].findings);
        let note = runs[1].findings.iter().all(|f| f.note.contains("head back"));
        assert!(note && runs[0].removed_mm3 > 1e5, "{:?}", runs[1].findings);
        let found = only_kind(&runs[1]);
        assert!(found.is_none_or(|found| found == (FindingKind::HolderCollision, line_of_cut(&program, cut))));
        found.is_some()
    };
    for (ahead, is_found) in [(60.0, false), (6.0, false), (0.0, true), (-60.0, true)] {
        let ways = [160.0, 680.0].map(|x| (0.1, [first(x + ahead), second(x)]));
        assert_eq!(found(through(Program::new(&shop), &ways).text(), 0), is_found, "{ahead} mm ahead");
    }
    // In blocks of their own.
    let alone = [160.0, 680.0].map(|x| (0.1, [first(x), None]));
    let other = [160.0, 680.0].map(|x| (0.1, [None, second(x)]));
    assert!(!found(through(through(Program::new(&shop), &alone), &other).text(), 1));
    assert!(found(through(through(Program::new(&shop), &other), &alone).text(), 0));
}

#[test]
fn a_rapid_of_one_head_through_the_stock_is_found_at_its_line_as_that_heads() {
    let shop = Shop::new();
    let high = |x: f64| Some([x, 0.0, 330.0]);
    for (z, is_found) in [(150.0, true), (100.0, false)] {
        let low = |x: f64| Some([x, 0.0, z]);
        let start = Program::new(&shop).rapid(0.1, [high(200.0), Some([200.0, 0.0, -60.0])]);
        let text = start.rapid(0.1, [high(200.0), low(200.0)]).rapid(0.1, [high(600.0), low(600.0)]).text();
        let program = read_fanuc(&text).unwrap();
        let line = ways_of_text(&program).last().copied();
        let mut stock = whole(2.0);
        let runs = together(&shop, &program, &mut stock);
        assert_eq!(only_kind(&runs[0]), None);
        assert_eq!(
            only_kind(&runs[1]),
            line.filter(|_| is_found).map(|line| (FindingKind::RapidCollision, line)),
            "{text}"
        );
        assert!(runs[1].findings.iter().all(|f| f.body.as_deref() == Some("cutter") && f.note == "head back"));
        assert_eq!(stock, whole(2.0));
    }
}

#[test]
fn a_head_at_home_changes_nothing() {
    let shop = Shop::new();
    for working in 0..2 {
        let only = |tips: [Option<[f64; 3]>; 2]| [0, 1].map(|h| tips[h].filter(|_| h == working));
        // Deep enough for the body behind the flute to meet the plate.
        let ways = [200.0, 600.0].map(|x| (0.1, only(slots([13.0, 13.0], x))));
        let program = read_fanuc(through(Program::new(&shop), &ways).text()).unwrap();
        let [mut at_once, mut in_turn] = [whole(2.0), whole(2.0)];
        let runs = together(&shop, &program, &mut at_once);
        let alone = one(&shop, working, &program, &mut in_turn);
        assert!(!alone.findings.is_empty() && alone.removed_mm3 > 1e5);
        assert_eq!((&runs[working], at_once == in_turn), (&alone, true));
        let idle = &runs[1 - working];
        assert!(idle.findings.is_empty() && idle.removed_mm3 == 0.0, "{idle:?}");
        assert!(idle.blocks.iter().all(|b| b.way_mm == 0.0 && !b.may_be_near), "{idle:?}");
    }
}

/// Flutes of both heads through the same material, above each other: each line is cut once, and
/// counts for the first in order; what is left does not depend on it.
#[test]
fn what_both_flutes_reach_at_once_is_the_first_heads() {
    let shop = Shop::new();
    let ways = [160.0, 680.0].map(|x| (0.1, [Some([x, 0.0, 139.0]), Some([x, 0.0, 151.0])]));
    let program = read_fanuc(through(Program::new(&shop), &ways).text()).unwrap();
    let [mut stock, mut turned, mut in_turn] = [(); 3].map(|()| plate([140.0, 150.0], 2.0));
    let runs = together(&shop, &program, &mut stock);
    let (setups, settings) = ([1, 0].map(|h| shop.setup(h)), VerifySettings::default());
    let heads = setups.each_ref().map(|setup| (setup, &settings));
    let other = run_stock_of_heads(&program, heads, &mut turned, TOLERANCE, &Silent).unwrap();
    for runs in [&runs, &other] {
        // Ahead of it the first one leaves what is under its rounded corner, which the second one
        // takes.
        assert!(runs[0].removed_mm3 > 5.0 * runs[1].removed_mm3 && runs[1].removed_mm3 > 0.0, "{runs:?}");
    }
    let alone = [0, 1].map(|h| one(&shop, h, &program, &mut in_turn).removed_mm3);
    let sums = [&runs, &other].map(|runs| runs[0].removed_mm3 + runs[1].removed_mm3);
    assert!(sums.iter().all(|sum| (sum - alone[0] - alone[1]).abs() < 1e-6 * sum), "{sums:?} {alone:?}");
}

#[test]
fn setups_that_do_not_stand_on_one_machine_are_refused() {
    let shop = Shop::new();
    let ways = [200.0, 600.0].map(|x| (0.1, slots([6.0, 6.0], x)));
    let program = read_fanuc(through(Program::new(&shop), &ways).text()).unwrap();
    let (settings, first) = (VerifySettings::default(), shop.setup(0));
    let refused = |second: &VirtualSetup<'_>| {
        let mut stock = whole(4.0);
        let heads = [(&first, &settings), (second, &settings)];
        let error = run_stock_of_heads(&program, heads, &mut stock, TOLERANCE, &Silent).unwrap_err();
        assert!(matches!(error, VerifyError::OneStock { setup: 2, .. }), "{error}");
        assert_eq!(stock, whole(4.0));
        error.to_string()
    };
    assert!(refused(&first).contains("of no head of its own"));
    let elsewhere = Isometry3::translation(0.0, 0.0, 1e-3);
    assert!(refused(&VirtualSetup { table_from_work: elsewhere, ..shop.setup(1) }).contains("another place"));
    // The first head's X starts elsewhere in the second one's view.
    let mut file = shop.views[1].to_file();
    let Some(Joint::Prismatic(x)) = &mut file.tool_chains[0].rows[0].joint else { panic!("X is the first joint") };
    x.home_mm += 10.0;
    let views = Machine::heads(file).unwrap();
    assert_eq!(views.len(), NUMBERS.len());
    let line = ways_of_text(&program)[0];
    let reported = refused(&VirtualSetup { machine: &views[1], ..shop.setup(1) });
    assert!(reported.contains(&format!("from line {line} on")), "{reported}");
}
