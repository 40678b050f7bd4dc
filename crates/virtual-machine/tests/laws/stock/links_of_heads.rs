//! Links of two heads in the stock that both cut: free through what either has cut by then, and
//! never through what is left, by points of a stock of its own.

use facemill_cl_data::Silent;
use facemill_inverse_kinematics::AxisValues;
use facemill_nc_program::{Dialect, read_program};
use facemill_test_kit::Random;
use facemill_virtual_machine::{
    LinkSettings, LinkStage, ObstacleKind, ProgramLink, VerifySettings, VirtualObstacle, VirtualSetup, run_links,
    run_stock_of_heads,
};
use facemill_z_map::DexelMap;
use nalgebra::{Isometry3, Point3};

use crate::kit::dual::{LENGTHS, Program, Shop};
use crate::kit::{CORNER, RADIUS};

const KEEP: LinkSettings = LinkSettings { clearance: 3.0, tolerance: 0.01 };

/// The block of stock, mm.
const BLOCK: [[f64; 3]; 2] = [[350.0, -80.0, 140.0], [450.0, 80.0, 150.0]];

/// Angle of the table in all of it, rad.
const TURN: f64 = 0.1;

/// Cutters' height, mm.
const FLUTE: f64 = 12.0;

fn block() -> DexelMap {
    DexelMap::of_box(&Isometry3::identity(), BLOCK[0], BLOCK[1], 2.0).unwrap()
}

/// The setups of both heads with nothing on the table but the stock.
fn setups(shop: &Shop) -> [VirtualSetup<'_>; 2] {
    [0, 1].map(|h| {
        let setup = shop.setup(h);
        let stock = VirtualObstacle { kind: ObstacleKind::Stock, ..setup.obstacles[0].clone() };
        VirtualSetup { obstacles: vec![stock], ..setup }
    })
}

/// Place of one head's tip, the other one's unchanged.
fn of_head(head: usize, tip: [f64; 3]) -> [Option<[f64; 3]>; 2] {
    let mut tips = [None; 2];
    tips[head] = Some(tip);
    tips
}

/// 200 mm away from the block on the head's side.
fn away(head: usize, [x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, y, z + [200.0, -200.0][head]]
}

/// Slot of a head along x.
#[derive(Clone, Copy, Debug)]
struct Slot {
    head: usize,
    y: f64,
    z: f64,
}

impl Slot {
    fn at(&self, x: f64) -> [f64; 3] {
        [x, self.y, self.z]
    }

    /// Whether the slot leaves a point; the cutter's corner and ends may take it or not.
    fn leaves(&self, p: &[f64; 3]) -> bool {
        let up = [1.0, -1.0][self.head] * (p[2] - self.z);
        (p[1] - self.y).abs() > RADIUS || !(0.0..=FLUTE + 40.0).contains(&up)
    }
}

fn slots<'a>(shop: &'a Shop, slots: &[Slot]) -> Program<'a> {
    slots.iter().fold(Program::new(shop), |program, s| {
        let [from, to] = [300.0, 500.0].map(|x| s.at(x));
        let [start, end] = [from, to].map(|tip| of_head(s.head, away(s.head, tip)));
        let begun = program.rapid(TURN, start).rapid(TURN, of_head(s.head, from));
        begun.cut(TURN, of_head(s.head, to), 20.0).rapid(TURN, end)
    })
}

/// Calls with each link that may change, and the number of slots cut before it.
fn each_link(shop: &Shop, text: &str, visit: &mut dyn FnMut(&ProgramLink, &LinkStage<'_, '_>, usize)) -> DexelMap {
    let program = read_program(text, Dialect::Fanuc).unwrap();
    let (setups, settings, mut stock) = (setups(shop), VerifySettings::default(), block());
    let mut before = 0;
    let mut look = |link: &ProgramLink, stage: &LinkStage<'_, '_>| {
        if link.hold.is_none() {
            visit(link, stage, before);
        }
        before += 1;
    };
    run_links(&program, &setups.each_ref(), (&settings, &KEEP), &mut stock, &mut look, &Silent).unwrap();
    let (mut expected, heads) = (block(), setups.each_ref().map(|setup| (setup, &settings)));
    run_stock_of_heads(&program, heads, &mut expected, KEEP.tolerance, &Silent).unwrap();
    stock.check_invariants().unwrap();
    assert!((stock.volume() - expected.volume()).abs() < 1e-6 * block().volume());
    stock
}

/// The axes of a link that take one head's tip over these places.
fn over(shop: &Shop, link: &ProgramLink, head: usize, tips: &[[f64; 3]]) -> Vec<AxisValues> {
    let mut at = link.start;
    tips.iter()
        .map(|tip| {
            at = shop.axes_at(TURN, of_head(head, *tip), &at);
            at
        })
        .collect()
}

#[test]
fn a_way_through_what_the_other_head_cut_is_free_when_it_is_cut() {
    let shop = Shop::new();
    for first in 0..2 {
        // Two slots through the block, side by side, then one of the other head above a face.
        let through = |y: f64| Slot { head: first, y, z: [139.0, 151.0][first] };
        let beside = Slot { head: 1 - first, y: 0.0, z: [154.0, 136.0][1 - first] };
        let text = slots(&shop, &[through(-20.0), through(20.0), beside, beside]).text();
        let mut seen = Vec::new();
        each_link(&shop, &text, &mut |link, stage, before| {
            let way = [500.0, 300.0].map(|x| [x, 0.0, 145.0]);
            let head = 1 - first;
            let path = [away(head, way[0]), way[0], way[1], away(head, way[1])];
            seen.push((before, stage.is_free(link, &over(&shop, link, head, &path))));
        });
        assert_eq!(seen, [(1, false), (2, true), (3, true)], "head {first} first");
    }
}

#[test]
fn no_way_meets_stock_that_neither_head_has_cut() {
    let shop = Shop::new();
    let mut random = Random(81);
    let points: Vec<[f64; 3]> = (0..26)
        .flat_map(|i| (0..40).flat_map(move |j| (0..10).map(move |k| [i, j, k])))
        .map(|at: [i32; 3]| [0, 1, 2].map(|k| BLOCK[0][k] + [2.0, 2.0, 1.0][k] + [3.9, 3.9, 2.0][k] * f64::from(at[k])))
        .filter(|p| (0..3).all(|k| p[k] < BLOCK[1][k] - 1.0))
        .collect();
    let (mut n_free, mut n_met) = (0, 0);
    for _ in 0..6 {
        let all: Vec<Slot> = (0..5)
            .map(|_| {
                let head = random.below(2);
                let depth = random.between(2.0, 11.5);
                Slot { head, y: random.between(-60.0, 60.0), z: [150.0 - depth, 140.0 + depth][head] }
            })
            .collect();
        let text = slots(&shop, &all).text();
        each_link(&shop, &text, &mut |link, stage, before| {
            for _ in 0..12 {
                let head = random.below(2);
                let (y, above) = (random.between(-60.0, 60.0), random.between(-8.0, 8.0));
                let z = [150.0 + above, 140.0 - above][head];
                let ends = [500.0, 300.0].map(|x| [x, y, z]);
                let path = [away(head, ends[0]), ends[0], ends[1], away(head, ends[1])];
                let axes = over(&shop, link, head, &path);
                let left = |p: &&[f64; 3]| all[..before].iter().all(|slot| slot.leaves(p));
                let is_met = points.iter().filter(left).any(|p| meets(&shop, head, (link, &axes), p));
                let is_free = stage.is_free(link, &axes);
                assert!(!(is_free && is_met), "{all:?} behind {before}: head {head} at {y} {z}");
                n_free += u32::from(is_free);
                n_met += u32::from(is_met);
            }
        });
    }
    assert!(n_free > 20 && n_met > 60, "{n_free} free, {n_met} met");
}

/// Whether the inner part of a cutter, without its rounded corner, goes over a point, at places of
/// the tip at most 4 mm apart.
fn meets(shop: &Shop, head: usize, (link, through): (&ProgramLink, &[AxisValues]), p: &[f64; 3]) -> bool {
    let starts = std::iter::once(&link.start).chain(through);
    starts.zip(through).any(|(from, to)| {
        let tips = [from, to].map(|axes| shop.views[head].cl_point(axes, LENGTHS[head]).tip);
        let n = (1.0 + (tips[1] - tips[0]).norm() / 4.0) as u32;
        (0..=n).any(|k| {
            let tip = tips[0] + (tips[1] - tips[0]) * (f64::from(k) / f64::from(n));
            let away = Point3::from(*p) - tip;
            let up = [1.0, -1.0][head] * away.z;
            away.xy().norm() < RADIUS - CORNER && up > 0.1 && up < FLUTE
        })
    })
}
