//! Stock between the lines: fins, and walls that cuts leave, at any place beside the lines; and cut
//! stock counts as gone where the cutter goes along its own walls.

use crate::kit::{HEAD, RADIUS, Shop, Text};
use facemill_cl_data::Silent;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::{
    Finding, FindingKind, VerifySettings, certain_depth, outside_layer, remaining_collisions, run_stock,
    unresolved_findings,
};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

const CELL: f64 = 1.0;
const TOLERANCE: f64 = 0.01;

/// The shop's holder, above 60 mm.
const HOLDER: f64 = 40.0;

type Corners = [[f64; 3]; 2];

/// Lines over a box, with the layer around it.
fn outside(of: Corners) -> DexelMap {
    let around = outside_layer(CELL);
    let [low, high] = [of[0].map(|c| c - around), of[1].map(|c| c + around)];
    DexelMap::of_box(&Isometry3::identity(), low, high, CELL).unwrap()
}

fn all_requested(shop: &Shop) -> Vec<Finding> {
    let setup = shop.setup();
    let bodies: Vec<String> = setup.tool.collision_bodies().into_iter().map(|b| b.name).collect();
    let requested = |kind, body: &str| {
        let found = Finding::of_line(kind, 1, None, "", String::new());
        Finding { last_line: u32::MAX, body: Some(body.to_owned()), ..found }
    };
    let holder = bodies.iter().map(|body| requested(FindingKind::HolderCollision, body));
    holder.chain([requested(FindingKind::RapidCollision, "cutter")]).collect()
}

/// Kinds and lines of what may still be there.
fn met(shop: &Shop, text: &str, stock: Corners, requested: Vec<Finding>) -> Vec<(FindingKind, u32)> {
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let (setup, settings, mut map) = (shop.setup(), VerifySettings::default(), outside(stock));
    let [found] =
        remaining_collisions(&program, [(&setup, &settings, requested)], &mut map, TOLERANCE, &Silent).unwrap();
    map.check_invariants().unwrap();
    assert!(found.iter().all(|f| f.obstacle.as_deref() == Some("stock") && f.note.contains("lines")), "{found:?}");
    found.iter().map(|f| (f.kind, f.worst_line - HEAD)).collect()
}

#[test]
fn a_fin_between_the_lines_is_met_wherever_it_is() {
    let shop = Shop::new();
    let way = |z: f64| Text::new(&shop).rapid([-100.0, 0.0, 200.0]).rapid([-100.0, 0.0, z]).rapid([100.0, 0.0, z]).text;
    for k in 0..20 {
        let (x, thickness) = (0.05 * f64::from(k), [0.02, 0.6][k as usize % 2]);
        let fin = [[x, -50.0, 0.0], [x + thickness, 50.0, 30.0]];
        let through = met(&shop, &way(10.0), fin, all_requested(&shop));
        // The body behind the flute, too.
        assert_eq!(
            through,
            [FindingKind::HolderCollision, FindingKind::RapidCollision].map(|kind| (kind, 3)),
            "at {x}"
        );
        // It is known by more than what is certain, and free above.
        assert_eq!(
            met(&shop, &way(30.0 - certain_depth(CELL, TOLERANCE)), fin, all_requested(&shop)).len(),
            1,
            "at {x}"
        );
        assert_eq!(met(&shop, &way(30.1), fin, all_requested(&shop)), []);
        assert_eq!(met(&shop, &way(10.0), fin, Vec::new()), [], "nothing is in question");
        // The holder goes over the cutter's way, farther out.
        let tall = [[x, -50.0, 0.0], [x + thickness, 50.0, 100.0]];
        let beside = |off: f64| {
            let (side, start) = (x - off, Text::new(&shop).rapid([x - off, -150.0, 300.0]));
            start.rapid([side, -150.0, 10.0]).rapid([side, 150.0, 10.0]).text
        };
        let inside = HOLDER - certain_depth(CELL, TOLERANCE);
        for off in [RADIUS + 1.0, inside] {
            let found = met(&shop, &beside(off), tall, all_requested(&shop));
            assert_eq!(found, [(FindingKind::HolderCollision, 3)], "{off} from the fin at {x}");
        }
        assert_eq!(met(&shop, &beside(HOLDER + 0.01), tall, all_requested(&shop)), []);
    }
}

/// Two slots along y with a wall of some thickness between them, the second not to the block's end;
/// then straight up, and across the wall.
fn two_slots(shop: &Shop, wall: f64, x: f64) -> String {
    let [left, right] = [-1.0, 1.0].map(|side| x + side * (RADIUS + 0.5 * wall));
    let first = Text::new(shop).rapid([left, -120.0, 200.0]).rapid([left, -120.0, 10.0]).cut([left, 120.0, 10.0]);
    let first = first.rapid([left, 120.0, 200.0]).rapid([right, -120.0, 200.0]).rapid([right, -120.0, 10.0]);
    let second = first.cut([right, 50.0, 10.0]).rapid([right, 50.0, 200.0]).rapid([right, 0.0, 200.0]);
    second.rapid([right, 0.0, 16.0]).rapid([left, 0.0, 16.0]).rapid([left, 0.0, 200.0]).text
}

#[test]
fn a_wall_that_cuts_leave_is_met_and_their_own_walls_are_not() {
    let shop = Shop::new();
    let block = [[-80.0, -60.0, 0.0], [80.0, 60.0, 20.0]];
    for k in 0..8 {
        let x = 0.13 * f64::from(k);
        for wall in [0.05, 0.4, 0.8, 2.0] {
            let found = met(&shop, &two_slots(&shop, wall, x), block, all_requested(&shop));
            assert_eq!(found, [(FindingKind::RapidCollision, 11)], "{wall} at {x}");
        }
        // Slots that overlap by more than what the smaller cutter leaves.
        let overlap = 2.0 * (outside_layer(CELL) + 2.0 * TOLERANCE) + 0.01;
        assert_eq!(met(&shop, &two_slots(&shop, -overlap, x), block, all_requested(&shop)), [], "at {x}");
    }
}

/// The lines see nothing of a thin wall that none of them is in; the cutter's own walls are near.
#[test]
fn such_a_wall_is_not_seen_by_the_lines() {
    let shop = Shop::new();
    let program = read_program(two_slots(&shop, 0.4, 0.0), Dialect::Fanuc).unwrap();
    let mut lines = DexelMap::of_box(&Isometry3::identity(), [-80.0, -60.0, 0.0], [80.0, 60.0, 20.0], CELL).unwrap();
    let run = run_stock(&program, &shop.setup(), &VerifySettings::default(), &mut lines, TOLERANCE, &Silent).unwrap();
    let across: Vec<&Finding> = run.findings.iter().filter(|f| f.worst_line == HEAD + 11).collect();
    assert!(across.iter().all(|f| f.measure.is_none()), "{across:?}");
}

#[test]
fn findings_alike_on_the_stock_as_it_is_are_not_in_question() {
    let found = |kind, line: u32| Finding::of_line(kind, line, None, "", String::new());
    let [rapid, holder, gouge] = [FindingKind::RapidCollision, FindingKind::HolderCollision, FindingKind::Gouge];
    let at_first = [found(rapid, 3), found(holder, 5), found(gouge, 6), found(rapid, 9)];
    let shop = Shop::new();
    let requested = unresolved_findings(&shop.setup(), &at_first, &[found(rapid, 3), found(rapid, 5)]);
    assert_eq!(requested, [at_first[1].clone(), at_first[3].clone()]);
    // Of bodies, those of the machine with what they come near, too.
    let near = |kind, body: &str| Finding { body: Some(body.to_owned()), ..found(kind, 7) };
    let kinds = [FindingKind::Collision, FindingKind::NearMiss];
    let at_first = kinds.map(|kind| ["head", "cutter"].map(|body| near(kind, body))).concat();
    let requested = unresolved_findings(&shop.setup(), &at_first, &[near(FindingKind::NearMiss, "cutter")]);
    assert_eq!(requested, kinds.map(|kind| near(kind, "head")));
}
