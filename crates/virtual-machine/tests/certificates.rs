//! Certificates of random blocks against depths at times close together, and what they refuse to say.

mod kit;

use std::fmt::Write;

use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::{AxisValues, CuttingLawFile, Machine, RapidLawFile};
use facemill_nc_program::{AxisLetter, AxisWords, Dialect, read_program};
use facemill_surface_model::TriMesh;
use facemill_virtual_machine::{Certificates, ObstacleKind, VerifySettings, VirtualObstacle, VirtualSetup, certify};
use kit::depth::{Place, Triangle};
use kit::{Shop, Text};
use nalgebra::{Point3, Unit, Vector3};

struct Lcg(u64);

impl Lcg {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

fn height(x: f64, y: f64) -> f64 {
    1.2 * (x / 45.0).sin() * (y / 60.0).cos()
}

/// A wavy sheet, 400 × 400 mm.
fn sheet() -> TriMesh {
    let n = 60u32;
    let at = |k: u32| -200.0 + 400.0 * f64::from(k) / f64::from(n - 1);
    let vertices = (0..n * n).map(|k| (at(k / n), at(k % n))).map(|(x, y)| Point3::new(x, y, height(x, y))).collect();
    let cells = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| i * n + j));
    TriMesh::new(vertices, cells.flat_map(|a| [[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]).collect()).unwrap()
}

fn setup<'a>(shop: &'a Shop, mesh: &'a MeshTree) -> VirtualSetup<'a> {
    let part = VirtualObstacle { name: "sheet".into(), mesh, kind: ObstacleKind::Part, allowance: 0.0, stock: 0.0 };
    VirtualSetup { obstacles: vec![part], ..shop.setup() }
}

fn certified(text: &Text<'_>, setup: &VirtualSetup<'_>, limit: f64) -> Certificates {
    let program = read_program(&text.text, Dialect::Fanuc).unwrap();
    certify(&program, setup, &VerifySettings { gouge_limit: limit, ..VerifySettings::default() }, &Silent).unwrap()
}

/// A place that the walk goes to, as the words of the text say it.
#[derive(Clone, Copy, Debug)]
struct Stop {
    tip: Point3<f64>,
    axis: Unit<Vector3<f64>>,
    joints: AxisValues,
}

impl Stop {
    /// What numbers of a block mean: with RTCP X, Y and Z are the tip's, else the axes'.
    fn read(shop: &Shop, numbers: [f64; 5], rtcp: bool) -> Self {
        let letters = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::B, AxisLetter::C];
        let words = AxisWords::from_words(letters.into_iter().zip(numbers)).unwrap();
        let joints = AxisValues::from_slice(&shop.words.joints(&words).unwrap()).unwrap();
        // The axis hangs on the rotaries alone.
        let tool = shop.table_from_work.inverse() * shop.machine.forward(&joints, shop.tool.gauge_length());
        let tip = if rtcp { Point3::from([numbers[0], numbers[1], numbers[2]]) } else { tool * Point3::origin() };
        Self { tip, axis: Unit::new_normalize(tool * Vector3::z()), joints }
    }
}

/// A walk over the sheet: blocks of some millimetres, the axis turning, the cutter now in the sheet, now over it. With RTCP
/// the linear words are the tip's. The stops are those of the rounded words.
fn walk<'a>(shop: &'a Shop, lcg: &mut Lcg, n: usize, rtcp: bool) -> (Text<'a>, Vec<Stop>) {
    let mut text = Text::new(shop);
    if rtcp {
        // Controls count in the frame that the table has where RTCP is switched on.
        text = text.line("G0 B0. C0.").line("G0 G43.4 H7 X0. Y0. Z300.");
    }
    let mut stops = Vec::new();
    let (mut x, mut y) = (0.0, 0.0);
    for k in 0..=n {
        x = (x + lcg.between(-6.0, 6.0)).clamp(-120.0, 120.0);
        y = (y + lcg.between(-6.0, 6.0)).clamp(-120.0, 120.0);
        let axis = [lcg.between(0.02, 0.2), lcg.between(-0.1, 0.1), 1.0];
        // The tilted disc's lower rim is below the tip: lift by most of it.
        let tilt = (axis[0] * axis[0] + axis[1] * axis[1]).sqrt().atan();
        let z = height(x, y) + 21.0 * tilt.sin() + lcg.between(-0.1, 1.2);
        let words = shop.words.words(shop.axes_at([x, y, z], axis).as_slice()).unwrap();
        let word = |l: AxisLetter| words.get(l).unwrap();
        let [a, b, c, d, e] = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z, AxisLetter::B, AxisLetter::C].map(word);
        let [a, b, c] = if rtcp { [x, y, z] } else { [a, b, c] };
        let written = [a, b, c, d, e].map(|number| format!("{number:.4}"));
        let code = match k {
            0 if rtcp => "G0",
            0 => "G0 G43 H7",
            _ => "G1 F1000.",
        };
        let [a, b, c, d, e] = &written;
        writeln!(text.text, "{code} X{a} Y{b} Z{c} B{d} C{e}").unwrap();
        stops.push(Stop::read(shop, written.map(|number| number.parse().unwrap()), rtcp));
    }
    (text, stops)
}

/// By what a sampled depth may exceed a certificate, mm. Both sides work in f64 from the same words: coordinates of a metre
/// are rounded to 1e-13 mm, some hundred operations deep; the sampled depth itself is never more than there is.
const ROUNDING: f64 = 1e-9;

/// A walk and how it is held to its certificates.
struct Walk {
    seed: u64,
    blocks: usize,
    rtcp: bool,
    /// Times of a block at which the depth is sampled.
    times: u32,
}

impl Walk {
    /// Depths at times close together of each block against its certificate; `at` is the tool between two stops, by the law.
    fn check(&self, shop: &Shop, at: impl Fn(&Stop, &Stop, f64) -> Place) {
        let sheet = sheet();
        let mesh = MeshTree::new(&sheet);
        let all: Vec<Triangle> = (0..sheet.triangles().len()).map(|k| sheet.corners(k)).collect();
        let (text, stops) = walk(shop, &mut Lcg(self.seed), self.blocks, self.rtcp);
        let found = certified(&text, &setup(shop, &mesh), LIMIT);
        let cuts = &found.certificates[found.certificates.len() - self.blocks..];
        let (mut touching, mut slacks) = (0, Vec::new());
        for (c, ends) in cuts.iter().zip(stops.windows(2)) {
            let places: Vec<Place> =
                (0..=self.times).map(|k| at(&ends[0], &ends[1], f64::from(k) / f64::from(self.times))).collect();
            let deepest = kit::CUTTER.depth(places.iter().copied(), &within_reach(&all, &places), LIMIT);
            let Some(depth) = c.depth_mm else {
                // Where the axes swing past the pole the tip may leave its way by millimetres, deeper than is told.
                assert!(deepest > 0.6 * LIMIT, "line {}: {deepest} deep and not certified", c.line);
                continue;
            };
            assert!(deepest <= depth + ROUNDING, "line {}: {deepest} deep, certified {depth}", c.line);
            touching += usize::from(deepest > 0.0);
            slacks.push(depth - deepest);
        }
        slacks.sort_by(f64::total_cmp);
        let (n, median) = (self.blocks, slacks[slacks.len() / 2]);
        assert!(slacks.len() * 14 > 13 * n && touching * 4 > n, "{} judged, {touching} touch", slacks.len());
        assert!(median <= 5e-3, "{median}");
        println!("{} of {n} blocks judged, {touching} touch, median slack {median} mm", slacks.len());
    }
}

/// Depth up to which walks are certified, mm.
const LIMIT: f64 = 5.0;

/// The triangles that the cutter may touch at any of these places.
fn within_reach(all: &[Triangle], places: &[Place]) -> Vec<Triangle> {
    let middle = places[places.len() / 2].0;
    let way = places.iter().map(|(tip, _)| (tip - middle).norm()).fold(0.0, f64::max);
    let reach = way + kit::CUTTER.radius.hypot(kit::CUTTER.height);
    // No point of a triangle is farther from a corner than another corner.
    let side = |t: &Triangle| (t[1] - t[0]).norm().max((t[2] - t[0]).norm());
    all.iter().filter(|t| (t[0] - middle).norm() <= reach + side(t)).copied().collect()
}

/// The preset with other motion laws.
fn shop_with(cutting: CuttingLawFile, rapid: RapidLawFile) -> Shop {
    let mut file = Machine::head_b_table_c().unwrap().to_file();
    (file.motion.cutting, file.motion.rapid) = (cutting, rapid);
    Shop::with_machine(Machine::from_file(file).unwrap())
}

/// All axes linear together.
fn axes_linear(walk: &Walk) {
    let shop = Shop::new();
    walk.check(&shop, |a, b, t| {
        let tool = shop.machine.forward(&a.joints.lerp(&b.joints, t), shop.tool.gauge_length());
        let work_from_tool = shop.table_from_work.inverse() * tool;
        (work_from_tool * Point3::origin(), Unit::new_normalize(work_from_tool * Vector3::z()))
    });
}

/// The tip straight, the rotaries linear.
fn rotaries_linear(walk: &Walk) {
    let shop = shop_with(CuttingLawFile::TipAndRotariesLinear, RapidLawFile::Linear);
    walk.check(&shop, |a, b, t| {
        // Of the forward solution the rotation alone: where the tip is the law says.
        let tool = shop.machine.forward(&a.joints.lerp(&b.joints, t), 0.0).rotation;
        let axis = shop.table_from_work.rotation.inverse() * (tool * Vector3::z());
        (a.tip + (b.tip - a.tip) * t, Unit::new_normalize(axis))
    });
}

/// The tip straight, the axis turned in the plane of its ends.
fn vector_turned(walk: &Walk) {
    let shop = shop_with(CuttingLawFile::TipLinearVectorTurned, RapidLawFile::Linear);
    walk.check(&shop, |a, b, t| (a.tip + (b.tip - a.tip) * t, a.axis.slerp(&b.axis, t)));
}

#[test]
fn no_sampled_depth_of_a_random_block_exceeds_its_certificate() {
    axes_linear(&Walk { seed: 5, blocks: 700, rtcp: false, times: 50 });
}

#[test]
fn a_tip_on_a_straight_line_with_even_rotaries_is_never_deeper_than_certified() {
    rotaries_linear(&Walk { seed: 5, blocks: 400, rtcp: true, times: 50 });
}

#[test]
fn a_turned_tool_vector_is_never_deeper_than_certified() {
    vector_turned(&Walk { seed: 5, blocks: 400, rtcp: true, times: 50 });
}

#[test]
#[ignore = "minutes: run with --release (docs/benchmarks.md)"]
fn four_thousand_blocks_with_all_axes_linear_are_never_deeper_than_certified() {
    axes_linear(&Walk { seed: 11, blocks: 4000, rtcp: false, times: 200 });
}

#[test]
#[ignore = "minutes: run with --release (docs/benchmarks.md)"]
fn three_thousand_blocks_with_even_rotaries_are_never_deeper_than_certified() {
    rotaries_linear(&Walk { seed: 12, blocks: 3000, rtcp: true, times: 200 });
}

#[test]
#[ignore = "minutes: run with --release (docs/benchmarks.md)"]
fn three_thousand_blocks_with_a_turned_tool_vector_are_never_deeper_than_certified() {
    vector_turned(&Walk { seed: 12, blocks: 3000, rtcp: true, times: 200 });
}

#[test]
fn a_bump_between_two_ends_is_in_the_certificate() {
    let shop = Shop::new();
    // A pyramid of 0.3 mm half way, narrower than the way between two sampled positions would have to be.
    let base = |x: f64, y: f64| Point3::new(x, y, -1.0);
    let bump =
        vec![base(0.05, -0.05), base(0.05, 0.05), base(-0.05, 0.05), base(-0.05, -0.05), Point3::new(0.0, 0.0, 0.3)];
    let mesh = MeshTree::new(&TriMesh::new(bump, vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]).unwrap());
    let setup = setup(&shop, &mesh);
    let over = |z: f64| Text::new(&shop).rapid([-60.0, 0.0, 50.0]).cut([-60.0, 0.0, z]).cut([60.0, 0.0, z]);
    let last = |text: &Text<'_>, limit: f64| certified(text, &setup, limit).certificates.last().unwrap().clone();
    let deep = last(&over(0.0), 1.0).depth_mm.unwrap();
    assert!((0.3..0.31).contains(&deep), "{deep}");
    assert_eq!(last(&over(0.3001), 1.0).depth_mm, Some(0.0));
    let refused = last(&over(0.0), 0.2);
    assert!(refused.depth_mm.is_none() && !refused.certified, "{refused:?}");
}

#[test]
fn bodies_are_certified_by_their_clearance() {
    let shop = Shop::new();
    let mesh = MeshTree::new(&kit::box_mesh([40.0, -200.0, -80.0], [60.0, 200.0, 100.0]));
    let setup = setup(&shop, &mesh);
    // Past a wall: the holder, of radius 40 and 2 mm of clearance, from 60 mm above the tip.
    let past = |x: f64| Text::new(&shop).rapid([x, -100.0, 20.0]).cut([x, 100.0, 20.0]);
    let last =
        |text: &Text<'_>, setup: &VirtualSetup<'_>| certified(text, setup, 0.1).certificates.last().unwrap().clone();
    let near = last(&past(-5.0), &setup);
    assert!(near.certified, "{near:?}");
    let distance = near.clearance_mm.unwrap();
    // 5 mm of room; four fifths are tried first.
    assert!((3.9..=5.0).contains(&distance), "{distance}");
    assert_eq!(near.clearance_between.unwrap(), ["holder section 1".to_owned(), "sheet".to_owned()]);
    let touching = last(&past(-1.0), &setup);
    assert!(!touching.certified && touching.clearance_mm.is_none(), "{touching:?}");
}

#[test]
fn a_rapid_with_each_axis_at_its_own_speed_is_certified_on_the_way_it_takes() {
    let [linear, per_axis] =
        [RapidLawFile::Linear, RapidLawFile::PerAxis].map(|law| shop_with(CuttingLawFile::AxesLinear, law));
    let mesh = MeshTree::new(&kit::box_mesh([40.0, -200.0, -80.0], [60.0, 200.0, 100.0]));
    let last = |shop: &Shop, from: [f64; 3], to: [f64; 3]| {
        let text = Text::new(shop).rapid(from).rapid(to);
        certified(&text, &setup(shop, &mesh), 0.1).certificates.last().unwrap().clone()
    };
    for shop in [&linear, &per_axis] {
        let along = last(shop, [-150.0, -100.0, 20.0], [-140.0, 100.0, 30.0]);
        assert!(along.certified && along.depth_mm == Some(0.0), "{along:?}");
    }
    // Over the wall: straight it goes well above, but X and Y are there before Z is.
    let over = |shop| last(shop, [-60.0, 0.0, 20.0], [150.0, 0.0, 320.0]);
    assert!(over(&linear).certified, "{:?}", over(&linear));
    assert!(!over(&per_axis).certified && over(&per_axis).depth_mm.is_none(), "{:?}", over(&per_axis));
}

#[test]
fn a_post_under_the_bend_of_a_rapid_is_met() {
    let shop = shop_with(CuttingLawFile::AxesLinear, RapidLawFile::PerAxis);
    // Along X of the machine, three times as far as up: Z is there after a third of the time. The post is met after a quarter
    // and before the bend; whoever goes on straight from behind the bend back to the quarter passes over it.
    let along = shop.table_from_work.rotation.inverse() * Vector3::x();
    let [foot, end] = [110.0, 300.0].map(|way| along * way);
    let rapid = |top: f64| {
        let post = kit::box_mesh([foot.x - 3.0, foot.y - 3.0, -80.0], [foot.x + 3.0, foot.y + 3.0, top]);
        let mesh = MeshTree::new(&post);
        let text = Text::new(&shop).rapid([0.0, 0.0, 20.0]).rapid([end.x, end.y, 120.0]);
        certified(&text, &setup(&shop, &mesh), 0.1).certificates.last().unwrap().clone()
    };
    let met = rapid(112.0);
    assert!(!met.certified && met.depth_mm.is_none(), "{met:?}");
    // When the cutter's edge is there, the tip is 80 mm on its way, and as far above where it began.
    let missed = rapid(95.0);
    assert!(missed.certified, "{missed:?}");
}
