//! A mill with two heads: one program with nine words per block, run once for each head.

use crate::kit;
use crate::kit::dual::{FACES, LENGTHS, Program, Shop};
use facemill_cl_data::{PlacedSolid, RoundFrustum, Silent, Solid};
use facemill_inverse_kinematics::AxisValues;
use facemill_nc_program::read::read_fanuc;
use facemill_nc_program::{WordMap, WorkOffset};
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    Finding, FindingKind, LinkDistances, LinkStage, Measure, ProgramLink, Verification, VerifyError, VerifySettings,
    VirtualSetup, certify, links_off_first_stock,
};
use nalgebra::Isometry3;

fn front(x: f64, y: f64, above: f64) -> Option<[f64; 3]> {
    Some([x, y, FACES[0] + above])
}

fn back(x: f64, y: f64, above: f64) -> Option<[f64; 3]> {
    Some([x, y, FACES[1] - above])
}

/// Both heads come down beside the plate and are about to cut.
fn started(shop: &Shop) -> Program<'_> {
    Program::new(shop).rapid(0.1, [front(400.0, 190.0, 40.0), back(400.0, -190.0, 40.0)]).cut(
        0.1,
        [front(400.0, 190.0, 0.0), back(400.0, -190.0, 0.0)],
        2.0,
    )
}

/// Both cut, while the table turns; then they leave the plate.
fn sound(shop: &Shop) -> Program<'_> {
    started(shop)
        .cut(0.12, [front(400.0, 50.0, 0.0), back(390.0, -60.0, 0.0)], 6.0)
        .cut(0.1, [front(420.0, -40.0, 0.0), back(410.0, 30.0, 0.0)], 4.0)
        .cut(0.1, [front(420.0, -40.0, 40.0), back(410.0, 30.0, 40.0)], 2.0)
        .rapid(0.1, [front(420.0, -40.0, 400.0), back(410.0, 30.0, 400.0)])
}

fn of_kind(v: &Verification, kind: FindingKind) -> Vec<&Finding> {
    v.findings.iter().filter(|f| f.kind == kind).collect()
}

#[test]
fn a_sound_program_has_no_finding_for_either_head_and_is_certified_for_both() {
    let shop = Shop::new();
    let text = sound(&shop).text();
    for head in 0..2 {
        let v = shop.verify(&text, head);
        assert!(v.findings.is_empty(), "head {head}: {:#?}\n{text}", v.findings);
        // Down, across twice, and up.
        assert!(v.cutting_length_mm > 200.0 && (v.cutting_time_s - 14.0).abs() < 0.01, "{v:?}");
        assert!(v.smallest_clearance.as_ref().is_some_and(|c| c.distance_mm > 5.0));
        let c = shop.certify(&text, head);
        let open: Vec<_> = c.uncertified().collect();
        assert!(open.is_empty() && c.blocks > 8, "head {head}: {open:#?}\n{text}");
    }
}

#[test]
fn a_gouge_is_the_finding_of_the_head_that_cuts_it() {
    let shop = Shop::new();
    let cut = started(&shop).cut(0.1, [front(400.0, 50.0, 0.0), back(400.0, -60.0, -0.3)], 6.0);
    let text = cut.cut(0.1, [front(400.0, 50.0, 40.0), back(400.0, -60.0, 40.0)], 2.0).text();
    assert_eq!(shop.verify(&text, 0).findings, []);
    let v = shop.verify(&text, 1);
    let [gouge] = of_kind(&v, FindingKind::Gouge)[..] else { panic!("{:#?}", v.findings) };
    assert!(matches!(gouge.measure, Some(Measure::DepthMm(d)) if (d - 0.3).abs() < 0.01), "{gouge}");
    assert_eq!(gouge.note, "head back");
    assert!(shop.certify(&text, 0).uncertified().next().is_none());
    assert!(shop.certify(&text, 1).uncertified().next().is_some());
}

/// The words of one head move nothing of the other, which may stand where it has cut even while the
/// other goes at rapid rate.
#[test]
fn the_words_of_one_head_move_nothing_of_the_other() {
    let shop = Shop::new();
    let cut = || started(&shop).cut(0.1, [front(400.0, 50.0, 0.0), None], 6.0);
    let before = shop.verify(&cut().cut(0.1, [front(400.0, 50.0, 40.0), None], 2.0).text(), 0);
    let text = cut()
        .rapid(0.1, [None, back(400.0, -190.0, 300.0)])
        .cut(0.1, [None, back(300.0, -190.0, 300.0)], 3.0)
        .rapid(0.1, [None, back(300.0, -190.0, 100.0)])
        .cut(0.1, [front(400.0, 50.0, 40.0), None], 2.0)
        .text();
    let v = shop.verify(&text, 0);
    assert!(v.findings.is_empty(), "{:#?}", v.findings);
    assert!((v.cutting_length_mm - before.cutting_length_mm).abs() < 1e-9);
    let c = shop.certify(&text, 0);
    assert!(c.uncertified().next().is_none(), "{:#?}", c.uncertified().next());
    // The head itself is seen to rest in the plate when it comes there at rapid rate.
    let text = started(&shop).rapid(0.1, [front(400.0, 50.0, -1.0), None]).text();
    assert_eq!(of_kind(&shop.verify(&text, 0), FindingKind::RapidCollision).len(), 1);
}

#[test]
fn limits_and_velocities_of_all_nine_axes_are_checked_for_either_head() {
    let shop = Shop::new();
    let far = started(&shop).rapid(0.1, [None, Some([400.0, -990.0, -600.0])]).text();
    let fast = started(&shop).cut(0.1, [None, back(400.0, -190.0, 200.0)], 0.1).text();
    for head in 0..2 {
        let (limit, spike) = (shop.verify(&far, head), shop.verify(&fast, head));
        let limit = of_kind(&limit, FindingKind::AxisLimit);
        let name = |f: &Finding| f.axis.clone().unwrap();
        assert!(limit.iter().any(|f| name(f).ends_with('2')), "{limit:?}\n{far}");
        let [spike] = of_kind(&spike, FindingKind::AxisSpike)[..] else { panic!("{:#?}\n{fast}", spike.findings) };
        // 200 mm in 0.1 s, with at most 500 mm/s.
        assert!(
            name(spike) == "Z2" && matches!(spike.measure, Some(Measure::VelocityRatio(r)) if (r - 4.0).abs() < 0.01)
        );
    }
}

/// Tools over the same point beside the plate.
#[test]
fn heads_that_meet_collide_in_both_views() {
    let shop = Shop::new();
    let solids = |k: usize| -> Vec<_> { shop.tools[k].collision_bodies() };
    let with_tools = [0, 1].map(|head| shop.views[head].with_tool_in_other_head(&solids(1 - head), LENGTHS[1 - head]));
    let meeting = [Some([400.0, 300.0, 130.0]), Some([400.0, 300.0, 170.0])];
    let text = Program::new(&shop)
        .rapid(0.1, [Some([400.0, 300.0, 330.0]), Some([400.0, 300.0, -30.0])])
        .rapid(0.1, meeting)
        .text();
    let apart = Program::new(&shop)
        .rapid(0.1, [Some([400.0, 300.0, 330.0]), Some([400.0, 300.0, -30.0])])
        .rapid(0.1, [Some([400.0, 300.0, 230.0]), Some([400.0, 300.0, 70.0])])
        .text();
    for (head, machine) in with_tools.iter().enumerate() {
        let setup = VirtualSetup { machine, ..shop.setup(head) };
        let run = |text: &str| {
            let program = read_fanuc(text).unwrap();
            let settings = VerifySettings::default();
            let found = verify(&program, &setup, &settings, &Silent).unwrap().findings;
            (found, certify(&program, &setup, &settings, &Silent).unwrap().uncertified().count())
        };
        let (found, n_open) = run(&text);
        let hits = |kind| found.iter().any(|f| f.kind == kind && f.obstacle.as_ref().is_some_and(|o| o != "plate"));
        assert!(hits(FindingKind::HolderCollision) || hits(FindingKind::RapidCollision), "{found:#?}");
        assert!(n_open > 0);
        let (found, n_open) = run(&apart);
        assert!(found.is_empty() && n_open == 0, "{found:#?} {n_open}");
    }
}

/// The heads pass each other in the middle of one block, tips `gap` apart along the table's axis;
/// one or both move.
#[test]
fn heads_that_pass_each_other_within_a_block_are_seen_and_proven() {
    let shop = Shop::new();
    let other_tool = |head: usize| {
        let (radius, height) = (kit::RADIUS, kit::CUTTER.height);
        let cutter =
            RoundFrustum { z_low: 0.0, z_high: height, radius_low: radius, radius_high: radius, rounding: 0.0 };
        let cutter = PlacedSolid {
            name: "other cutter".into(),
            solid: Solid::Frustum(cutter),
            frame_from_solid: Isometry3::identity(),
        };
        [vec![cutter], shop.tools[1 - head].collision_bodies()].concat()
    };
    let views = [0, 1].map(|head| shop.views[head].with_tool_in_other_head(&other_tool(head), LENGTHS[1 - head]));
    // The control may leave their ways by some tenths of a mm.
    for (gap, is_free) in [(10.0, true), (1.5, true), (-1.0, false)] {
        for stands in [None, Some(0), Some(1)] {
            let at = |side: f64| {
                let x = |head: usize| if stands == Some(head) { 400.0 } else { 400.0 + side * [-130.0, 130.0][head] };
                [Some([x(0), 400.0, 150.0 + gap / 2.0]), Some([x(1), 400.0, 150.0 - gap / 2.0])]
            };
            let away = |tips: [Option<[f64; 3]>; 2]| {
                let [Some(a), Some(b)] = tips else { panic!("both are given") };
                [Some([a[0], a[1], a[2] + 200.0]), Some([b[0], b[1], b[2] - 200.0])]
            };
            let text = Program::new(&shop)
                .rapid(0.1, away(at(1.0)))
                .rapid(0.1, at(1.0))
                .cut(0.1, at(-1.0), 3.0)
                .rapid(0.1, away(at(-1.0)))
                .text();
            let program = read_fanuc(&text).unwrap();
            let line = program.blocks.iter().find(|b| b.text.contains(" G1 ")).unwrap().line;
            for (head, machine) in views.iter().enumerate() {
                let setup = VirtualSetup { machine, ..shop.setup(head) };
                let settings = VerifySettings::default();
                let v = verify(&program, &setup, &settings, &Silent).unwrap();
                let certificates = certify(&program, &setup, &settings, &Silent).unwrap().certificates;
                let passing = certificates.iter().find(|c| c.line == line).unwrap();
                assert_eq!((v.findings.is_empty(), passing.certified), (is_free, is_free), "{:#?}", v.findings);
                // From the body behind one cutter, 12 mm high, to the other cutter as they pass.
                let distance = gap + kit::CUTTER.height;
                let proven = passing.clearance_mm.unwrap();
                assert!(proven <= distance && proven > 0.75 * distance - 0.5, "{proven} of {distance}");
                let seen = v.smallest_clearance.unwrap().distance_mm;
                assert!((seen - distance).abs() < 0.01 || distance > 15.0, "{seen} at {distance}");
            }
        }
    }
}

#[test]
fn spindle_tool_and_length_of_each_head_are_followed_apart() {
    let shop = Shop::new();
    let text = sound(&shop).text();
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} in\n{text}");
        text.replace(from, to)
    };
    let kinds = |text: &str, head: usize| {
        let mut kinds: Vec<FindingKind> = shop.verify(text, head).findings.iter().map(|f| f.kind).collect();
        kinds.dedup();
        kinds
    };
    use FindingKind::{
        NoTool, OtherLengthRegister, OtherToolLength, SpindleOff, SpindleSense, UnknownBlock, UnsafeCancel,
    };
    for (from, to, first, second) in [
        ("S800 M3 P2", "S800 M3", &[][..], &[SpindleOff][..]),
        ("S800 M3 P2", "S800 M3 P1", &[], &[SpindleOff]),
        ("S800 M3 P1", "S800 M4 P1", &[SpindleSense], &[]),
        ("T12 M6", "M0", &[], &[NoTool]),
        ("T12 M6", "T13 M6", &[UnknownBlock], &[UnknownBlock]),
        ("TOOL LENGTH 142.500 H31", "TOOL LENGTH 143.500 H31", &[OtherToolLength], &[OtherToolLength]),
        ("TOOL LENGTH 142.500 H31", "TOOL LENGTH 142.500 H8", &[OtherToolLength], &[OtherToolLength]),
    ] {
        let text = changed(from, to);
        assert_eq!((kinds(&text, 0), kinds(&text, 1)), (first.to_vec(), second.to_vec()), "{from} {to}");
    }
    // Lengths decide where the heads are, and so are faults for both.
    let g43 = text.lines().find(|l| l.contains("G43 Z2=")).unwrap();
    for line in [g43.replace("H31", "H7"), g43.replace("Z2=", "Y2=0. Z2=")] {
        let text = changed(g43, &line);
        for head in 0..2 {
            assert!(kinds(&text, head).contains(&OtherLengthRegister), "{line}");
        }
    }
    let early = text.replacen("M5 P1", "G49", 1);
    for head in 0..2 {
        let v = shop.verify(&early, head);
        let axes: Vec<_> = of_kind(&v, UnsafeCancel).iter().map(|f| f.axis.clone().unwrap()).collect();
        assert_eq!(axes, ["Z1", "Z2"]);
    }
}

#[test]
fn a_setup_that_mixes_heads_is_refused() {
    let shop = Shop::new();
    let single = WordMap::new(shop.words.axes().to_vec(), WorkOffset::default(), 120.0).unwrap();
    assert_eq!(shop.refused(|s| s.length_register = 8), VerifyError::NoHead { register: 8 });
    assert!(matches!(shop.refused(|s| s.length_register = 31), VerifyError::OtherHead { .. }));
    // The shop lives as long as the setups.
    let e = verify(
        &read_fanuc("").unwrap(),
        &VirtualSetup { machine: &shop.views[1], ..shop.setup(0) },
        &VerifySettings::default(),
        &Silent,
    );
    assert!(e.unwrap_err().to_string().starts_with("the machine is no view of the head `front`: axis Z1 does not"));
    let setup = VirtualSetup { words: &single, ..shop.setup(0) };
    let e = verify(&read_fanuc("").unwrap(), &setup, &VerifySettings::default(), &Silent).unwrap_err();
    assert_eq!(e, VerifyError::HeadCount { words: 1, machine: 2 });
}

/// Tests links by the motion of both heads at the same time: the same positions are free one after
/// the other, but not at once, although the ends of every block are.
#[test]
fn a_link_through_the_way_of_the_other_head_at_that_time_is_not_free_and_its_program_is_found() {
    let shop = Shop::new();
    let solids = |k: usize| shop.tools[k].collision_bodies();
    let views = [0, 1].map(|head| shop.views[head].with_tool_in_other_head(&solids(1 - head), LENGTHS[1 - head]));
    let setups = [0, 1].map(|head| VirtualSetup { machine: &views[head], ..shop.setup(head) });
    let at = |front: [f64; 2], back: [f64; 2]| [Some([front[0], 300.0, front[1]]), Some([back[0], 300.0, back[1]])];
    let (start, end) = (at([300.0, 300.0], [500.0, 0.0]), at([500.0, 300.0], [300.0, 0.0]));
    let begun = || Program::new(&shop).rapid(0.1, at([300.0, 330.0], [500.0, -30.0])).cut(0.1, start, 2.0);
    let ended =
        |p: Program<'_>| p.rapid(0.1, end).cut(0.1, at([500.0, 290.0], [300.0, 10.0]), 2.0).rapid(0.1, end).text();
    // Each past the other's side of the middle between both.
    let at_once = [at([300.0, 120.0], [500.0, 180.0]), at([500.0, 120.0], [300.0, 180.0])];
    let in_turn = [
        at([300.0, 120.0], [500.0, 0.0]),
        at([500.0, 120.0], [500.0, 0.0]),
        at([500.0, 300.0], [500.0, 0.0]),
        at([500.0, 300.0], [500.0, 180.0]),
        at([500.0, 300.0], [300.0, 180.0]),
    ];
    let program = read_fanuc(ended(begun())).unwrap();
    let look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
        let through = |tips: &[[Option<[f64; 3]>; 2]]| -> Vec<AxisValues> {
            let mut at = link.start;
            let mut go = |tips: &[Option<[f64; 3]>; 2]| {
                at = shop.axes_at(0.1, *tips, &at);
                at
            };
            tips.iter().chain([&end]).map(&mut go).collect()
        };
        let free = [&[][..], &at_once[..1], &at_once, &in_turn].map(|tips| stage.is_free(link, &through(tips)));
        (link.hold.clone(), free)
    };
    let keep = LinkDistances { fixtures: 5.0, first_stock: 5.0 };
    let settings = VerifySettings::default();
    let found = links_off_first_stock(&program, &setups.each_ref(), (&settings, keep), &look, &Silent).unwrap();
    let between: Vec<_> = found.into_iter().filter(|(hold, _)| hold.is_none()).map(|(_, free)| free).collect();
    // From one position each, both separate again: where they are side by side, the upper tip is
    // above the lower one.
    assert_eq!(between, [[true, true, false, true]]);
    // Driven all the same, it is found for both heads.
    let crossing = at_once.into_iter().fold(begun(), |p, tips| p.rapid(0.1, tips));
    let apart = in_turn.into_iter().fold(begun(), |p, tips| p.rapid(0.1, tips));
    for (text, is_sound) in [(ended(crossing), false), (ended(apart), true)] {
        for setup in &setups {
            let found = verify(&read_fanuc(&text).unwrap(), setup, &settings, &Silent).unwrap().findings;
            assert_eq!(found.is_empty(), is_sound, "{found:#?}");
        }
    }
}
