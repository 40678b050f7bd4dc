//! The fast mode: its findings are real, and its report says that it is an estimate.

use crate::kit::stock::cut_stock;
use crate::kit::{CORNER, HEAD, RADIUS, Shop, Text, box_mesh};
use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_nc_program::Dialect;
use facemill_nc_program::read_program;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    Estimate, EstimatedPositions, FindingKind, Verification, VerifyError, VerifySettings, certify,
};
use facemill_z_map::DexelMap;
use nalgebra::Isometry3;

fn fast() -> VerifySettings {
    VerifySettings { estimate: Some(Estimate::default()), ..VerifySettings::default() }
}

/// The fast mode's run and the ordinary one.
fn both(text: &Text<'_>) -> [Verification; 2] {
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    [fast(), VerifySettings::default()].map(|s| verify(&program, &text.shop.setup(), &s, &Silent).unwrap())
}

/// Kinds, lines and bodies.
fn reported(v: &Verification) -> Vec<(FindingKind, u32, Option<&str>)> {
    v.findings.iter().map(|f| (f.kind, f.worst_line - HEAD, f.body.as_deref())).collect()
}

/// A rapid from one side to the other at z = 5 over the plate, and a cut back 4 mm higher.
fn there_and_back(shop: &Shop) -> Text<'_> {
    let text = Text::new(shop).rapid([-100.0, 0.0, 300.0]).rapid([-100.0, 0.0, 5.0]);
    text.rapid([100.0, 0.0, 5.0]).cut([100.0, 0.0, 9.0]).cut([-100.0, 0.0, 9.0]).rapid([-100.0, 0.0, 300.0])
}

#[test]
fn a_wall_in_the_way_of_a_rapid_and_a_cut_is_found_with_far_fewer_positions() {
    let mut shop = Shop::new();
    shop.wall = MeshTree::new(&box_mesh([-30.0, -30.0, 0.0], [30.0, 30.0, 10.0]));
    let [fast, slow] = both(&there_and_back(&shop));
    assert_eq!(
        reported(&fast),
        [(FindingKind::RapidCollision, 3, Some("cutter")), (FindingKind::Gouge, 5, Some("cutter"))]
    );
    assert_eq!(reported(&fast), reported(&slow));
    assert!(4 * fast.n_positions < slow.n_positions, "{} of {}", fast.n_positions, slow.n_positions);
    // The depth is measured over all of the cutter, and the reported one never exceeds it.
    for (a, b) in fast.findings.iter().zip(&slow.findings) {
        assert!(a.measure.unwrap().value() <= b.measure.unwrap().value() + 1e-3, "{a} {b}");
    }
}

#[test]
fn it_says_that_it_is_an_estimate_and_promises_nothing_between_positions() {
    let [fast, slow] = both(&there_and_back(&Shop::new()));
    let steps = EstimatedPositions { cut_step_mm: 2.0, rapid_step_mm: RADIUS };
    assert_eq!((fast.between, fast.estimate), (None, Some(steps)));
    assert!(slow.between.is_some() && slow.estimate.is_none());
    let program = read_program(&there_and_back(&Shop::new()).text, Dialect::Fanuc).unwrap();
    let refused = certify(&program, &Shop::new().setup(), &fast_settings_of(3.0), &Silent);
    assert_eq!(refused, Err(VerifyError::Estimated { what: "certificates" }));
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = verify(&program, &Shop::new().setup(), &fast_settings_of(step), &Silent);
        assert!(matches!(refused, Err(VerifyError::Setting { field: "estimate.cut_step", .. })), "{step}");
    }
}

fn fast_settings_of(cut_step: f64) -> VerifySettings {
    VerifySettings { estimate: Some(Estimate { cut_step }), ..VerifySettings::default() }
}

#[test]
fn a_thin_fin_between_two_positions_is_missed_and_the_ordinary_mode_finds_it() {
    // The corner of the cutter goes over the top of a pin beside its way: nearer than 3 mm to it on
    // 13 mm alone.
    let depth = 0.1;
    let mut missed = 0;
    for x in [-60.0, -41.3, -7.7, 11.9, 33.1] {
        let mut shop = Shop::new();
        let y = RADIUS - 0.5 * CORNER;
        // Height of the corner's round there, and so much more.
        let round = CORNER - (CORNER * CORNER - (y - (RADIUS - CORNER)).powi(2)).sqrt();
        shop.wall = MeshTree::new(&box_mesh([x - 0.1, y, 0.0], [x + 0.1, y + 0.2, 5.0 + round + depth]));
        let [fast, slow] = both(&there_and_back(&shop));
        assert_eq!(reported(&slow), [(FindingKind::RapidCollision, 3, Some("cutter"))], "{x}");
        missed += usize::from(fast.findings.is_empty());
    }
    assert!(missed > 0, "a pin that is deeper than the limit on 13 mm of the way, and positions 25 mm apart");
}

#[test]
fn the_side_of_a_body_on_a_corner_is_missed_and_an_edge_of_it_is_not() {
    // The holder, from 60 to 120 mm above the tip and of radius 40, beside an arm that reaches 1 mm
    // into its side.
    let run = |z: [f64; 2]| {
        let mut shop = Shop::new();
        shop.wall = MeshTree::new(&box_mesh([39.0, -5.0, z[0]], [200.0, 5.0, z[1]]));
        let text = Text::new(&shop).rapid([-100.0, 0.0, 300.0]).rapid([-100.0, 0.0, 5.0]).cut([0.0, 0.0, 5.0]);
        both(&text).map(|v| v.faults().map(|f| (f.kind, f.worst_line)).collect::<Vec<_>>())
    };
    let hit = vec![(FindingKind::HolderCollision, HEAD + 3)];
    let edge = run([60.0, 68.0]);
    assert_eq!(edge, [hit.clone(), hit.clone()], "the lower edge of the holder is at z = 65");
    let side = run([90.0, 94.0]);
    assert_eq!(side, [vec![], hit], "no edge is within 20 mm");
}

#[test]
fn cut_stock_is_the_same_and_a_rapid_through_it_is_found_at_positions() {
    let shop = Shop::new();
    let block = || DexelMap::of_box(&Isometry3::identity(), [-60.0, -40.0, 0.0], [60.0, 40.0, 20.0], 1.0).unwrap();
    let text = Text::new(&shop).rapid([-120.0, 0.0, 220.0]).rapid([-120.0, 0.0, 10.0]).cut([120.0, 0.0, 10.0]);
    let text = text.rapid([120.0, 0.0, 5.0]).rapid([-120.0, 0.0, 5.0]);
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    let [mut quick, mut whole] = [block(), block()];
    let estimated = cut_stock(&program, &shop.setup(), &fast(), &mut quick, 0.01);
    let ordinary = cut_stock(&program, &shop.setup(), &VerifySettings::default(), &mut whole, 0.01);
    assert_eq!(quick.to_bytes(), whole.to_bytes());
    assert_eq!(estimated.blocks, ordinary.blocks);
    let kinds = |run: &facemill_virtual_machine::StockRun| {
        run.findings.iter().map(|f| (f.kind, f.worst_line - HEAD)).collect::<Vec<_>>()
    };
    assert_eq!(kinds(&estimated), [(FindingKind::RapidCollision, 5)]);
    assert_eq!(kinds(&estimated), kinds(&ordinary));
    // A wall of the stock thinner than the way between two positions, left where no position is.
    let fin = || DexelMap::of_box(&Isometry3::identity(), [-1.5, 24.0, 0.0], [1.5, 26.0, 20.0], 0.5).unwrap();
    let over = |x: f64| {
        let text = Text::new(&shop).rapid([x, 0.0, 220.0]).rapid([x, 0.0, 10.0]).rapid([x + 100.0, 0.0, 10.0]);
        read_program(&text.text, Dialect::Fanuc).unwrap()
    };
    let runs = |x: f64| {
        [fast(), VerifySettings::default()].map(|s| {
            let run = cut_stock(&over(x), &shop.setup(), &s, &mut fin(), 0.01);
            run.findings.iter().any(|f| f.kind == FindingKind::RapidCollision)
        })
    };
    let all = [-50.0, -45.0, -40.0, -35.0, -30.0].map(runs);
    assert!(all.iter().all(|[_, ordinary]| *ordinary), "{all:?}");
    assert!(all.iter().any(|[estimated, _]| !*estimated), "{all:?}");
}
