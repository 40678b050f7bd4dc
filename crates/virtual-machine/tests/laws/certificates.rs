//! Certificates of random blocks against depths at times close together, and what they refuse to
//! say.

use facemill_test_kit::Random;
use std::fmt::Write;

use crate::kit;
use crate::kit::depth::{TipAndAxis, Triangle};
use crate::kit::{Shop, Text};
use facemill_cl_data::Silent;
use facemill_interference::MeshTree;
use facemill_inverse_kinematics::machine_file::{CuttingLawFile, Joint, RapidLawFile};
use facemill_inverse_kinematics::{AxisValues, Machine};
use facemill_nc_program::dialect::RtcpRapids;
use facemill_nc_program::read_program;
use facemill_nc_program::{AxisLetter, AxisWords, Dialect, ReadProgram};
use facemill_surface_model::TriMesh;
use facemill_virtual_machine::verify;
use facemill_virtual_machine::{
    Certificates, FindingKind, ObstacleKind, Verification, VerifySettings, VirtualObstacle, VirtualSetup, certify,
};
use nalgebra::{Point3, Unit, Vector3};

fn height(x: f64, y: f64) -> f64 {
    1.2 * (x / 45.0).sin() * (y / 60.0).cos()
}

/// A wavy sheet, 400 × 400 mm.
fn sheet() -> TriMesh {
    sheet_below(0.0)
}

/// The same, so much lower.
fn sheet_below(by: f64) -> TriMesh {
    let n = 60u32;
    let at = |k: u32| -200.0 + 400.0 * f64::from(k) / f64::from(n - 1);
    let point = |i: u32, j: u32| Point3::new(at(i), at(j), height(at(i), at(j)) - by);
    let (vertices, triangles) = facemill_test_kit::grid_by_columns([n - 1; 2], point);
    TriMesh::new(vertices, triangles).unwrap()
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
struct WalkPoint {
    tip: Point3<f64>,
    axis: Unit<Vector3<f64>>,
    joints: AxisValues,
}

impl WalkPoint {
    /// Numbers of a block: with RTCP X, Y and Z are the tip's, else the axes'.
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

impl WalkPoint {
    /// Joints with the tip there in the workpiece frame, the head upright, and this word of C.
    fn read_tip(shop: &Shop, tip: [f64; 3], c: f64) -> AxisValues {
        let words = AxisWords::from_words([
            (AxisLetter::X, 0.0),
            (AxisLetter::Y, 0.0),
            (AxisLetter::Z, 0.0),
            (AxisLetter::B, 0.0),
            (AxisLetter::C, c),
        ]);
        let rotaries = AxisValues::from_slice(&shop.words.joints(&words.unwrap()).unwrap()).unwrap();
        let tip = shop.table_from_work * Point3::from(tip);
        shop.machine.with_tip_at(&rotaries, &tip, shop.tool.gauge_length()).unwrap()
    }
}

/// A walk over the sheet: blocks of some millimetres, the axis turning, the cutter now in the
/// sheet, now over it. With RTCP the linear words are the tip's. The stops are those of the rounded
/// words.
fn walk<'a>(shop: &'a Shop, lcg: &mut Random, n: usize, rtcp: bool) -> (Text<'a>, Vec<WalkPoint>) {
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
        stops.push(WalkPoint::read(shop, written.map(|number| number.parse().unwrap()), rtcp));
    }
    (text, stops)
}

/// By what a sampled depth may exceed a certificate, mm. Both sides work in f64 from the same
/// words: coordinates of a metre are rounded to 1e-13 mm, some hundred operations deep; the sampled
/// depth itself is never more than there is.
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
    /// Depths at times close together of each block against its certificate; `at` is the tool
    /// between two stops, by the law.
    fn check(&self, shop: &Shop, at: impl Fn(&WalkPoint, &WalkPoint, f64) -> TipAndAxis) {
        let sheet = sheet();
        let mesh = MeshTree::new(&sheet);
        let all: Vec<Triangle> = (0..sheet.triangles().len()).map(|k| sheet.corners(k)).collect();
        let (text, stops) = walk(shop, &mut Random(self.seed), self.blocks, self.rtcp);
        let found = certified(&text, &setup(shop, &mesh), LIMIT);
        let cuts = &found.certificates[found.certificates.len() - self.blocks..];
        let (mut touching, mut slacks) = (0, Vec::new());
        for (c, ends) in cuts.iter().zip(stops.windows(2)) {
            let places: Vec<TipAndAxis> =
                (0..=self.times).map(|k| at(&ends[0], &ends[1], f64::from(k) / f64::from(self.times))).collect();
            let deepest = kit::CUTTER.depth(places.iter().copied(), &within_reach(&all, &places), LIMIT);
            let Some(depth) = c.depth_mm else {
                // Where the axes swing past the pole the tip may leave its way by millimetres,
                // deeper than the reported depth.
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
fn within_reach(all: &[Triangle], places: &[TipAndAxis]) -> Vec<Triangle> {
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
    axes_linear(&Walk { seed: 5, blocks: 250, rtcp: false, times: 50 });
}

#[test]
fn a_tip_on_a_straight_line_with_even_rotaries_is_never_deeper_than_certified() {
    rotaries_linear(&Walk { seed: 5, blocks: 250, rtcp: true, times: 50 });
}

#[test]
fn a_turned_tool_vector_is_never_deeper_than_certified() {
    vector_turned(&Walk { seed: 5, blocks: 250, rtcp: true, times: 50 });
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
    // A pyramid of 0.3 mm half way, narrower than the way between two sampled positions would have
    // to be.
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
    // Along X of the machine, three times as far as up: Z is there after a third of the time. The
    // post is met after a quarter and before the bend; whoever goes on straight from behind the
    // bend back to the quarter passes over it.
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
    // When the cutter's edge is there, the tip is 80 mm on its way, and as far above where it
    // began.
    let missed = rapid(95.0);
    assert!(missed.certified, "{missed:?}");
}

/// A text as a control takes it that keeps the tip straight at rapid rate under RTCP, or does not.
fn with_rapids(text: &str, rtcp_rapids: RtcpRapids) -> ReadProgram {
    ReadProgram { rtcp_rapids, ..read_program(text, Dialect::Fanuc).unwrap() }
}

/// Rapids of a walk under RTCP that keep the tip straight: whatever is certified to stay out of the
/// sheet does so at all times close together, and most of what stays out is certified.
fn rapids_stay_out(shop: &Shop, at: impl Fn(&WalkPoint, &WalkPoint, f64) -> TipAndAxis) {
    const TIMES: u32 = 40;
    const BLOCKS: usize = 250;
    let sheet = sheet_below(0.2);
    let mesh = MeshTree::new(&sheet);
    let all: Vec<Triangle> = (0..sheet.triangles().len()).map(|k| sheet.corners(k)).collect();
    let (text, stops) = walk(shop, &mut Random(23), BLOCKS, true);
    let program = with_rapids(&text.text.replace("G1 F1000.", "G0"), RtcpRapids::TipLinear);
    let found = certify(&program, &setup(shop, &mesh), &VerifySettings::default(), &Silent).unwrap();
    let rapids = &found.certificates[found.certificates.len() - BLOCKS..];
    let (mut touching, mut clear, mut open) = (0, 0, 0);
    for (c, ends) in rapids.iter().zip(stops.windows(2)) {
        let places: Vec<TipAndAxis> =
            (0..=TIMES).map(|k| at(&ends[0], &ends[1], f64::from(k) / f64::from(TIMES))).collect();
        let deepest = kit::CUTTER.depth(places.iter().copied(), &within_reach(&all, &places), LIMIT);
        assert!(c.depth_mm.is_none() || deepest <= ROUNDING, "line {}: {deepest} deep and certified", c.line);
        touching += usize::from(deepest > 0.0);
        clear += usize::from(c.depth_mm.is_some());
        open += usize::from(c.depth_mm.is_none() && deepest == 0.0);
    }
    println!("{touching} touch, {clear} are certified, {open} stay out and are not");
    assert!(touching > 40 && clear > 50 && open < 13, "{touching} touch, {clear} are certified, {open} are not");
}

#[test]
fn rapids_with_the_tip_on_a_line_and_even_rotaries_stay_out_where_they_are_certified() {
    let shop = shop_with(CuttingLawFile::TipAndRotariesLinear, RapidLawFile::Linear);
    rapids_stay_out(&shop, |a, b, t| {
        let tool = shop.machine.forward(&a.joints.lerp(&b.joints, t), 0.0).rotation;
        let axis = shop.table_from_work.rotation.inverse() * (tool * Vector3::z());
        (a.tip + (b.tip - a.tip) * t, Unit::new_normalize(axis))
    });
}

#[test]
fn rapids_with_a_turned_tool_vector_stay_out_where_they_are_certified() {
    let shop = shop_with(CuttingLawFile::TipLinearVectorTurned, RapidLawFile::PerAxis);
    rapids_stay_out(&shop, |a, b, t| (a.tip + (b.tip - a.tip) * t, a.axis.slerp(&b.axis, t)));
}

/// Two places at which a rapid under RTCP begins and ends while the table turns by 120 deg, and its
/// text.
const ENDS: [[f64; 2]; 2] = [[-94.0, -117.0], [94.0, 117.0]];

fn turning_rapid() -> String {
    let [[a, b], [c, d]] = ENDS;
    format!(
        "{}G0 B0. C0.\nG0 G43.4 H7 X{a:.1} Y{b:.1} Z300.\nG0 Z20.\nG0 X{c:.1} Y{d:.1} C120.\n",
        Text::new(&Shop::new()).text
    )
}

fn run(shop: &Shop, mesh: &TriMesh, text: &str, rapids: RtcpRapids) -> (Verification, bool) {
    let mesh = MeshTree::new(mesh);
    let (program, setup) = (with_rapids(text, rapids), setup(shop, &mesh));
    let settings = VerifySettings::default();
    let certificates = certify(&program, &setup, &settings, &Silent).unwrap();
    (verify(&program, &setup, &settings, &Silent).unwrap(), certificates.certificates.last().unwrap().certified)
}

#[test]
fn a_post_on_the_line_of_the_tip_is_met_under_one_law_and_one_on_the_way_of_the_axes_under_the_other() {
    let shop = shop_with(CuttingLawFile::TipAndRotariesLinear, RapidLawFile::Linear);
    let joints = |[x, y]: [f64; 2], c: f64| WalkPoint::read_tip(&shop, [x, y, 20.0], c);
    let ends = [joints(ENDS[0], 0.0), joints(ENDS[1], 120.0)];
    let times = || (0..=100).map(|k| f64::from(k) / 100.0);
    let on_line = |t: f64| [0, 1].map(|k| ENDS[0][k] + (ENDS[1][k] - ENDS[0][k]) * t);
    let of_axes = |t: f64| {
        let tip = shop.machine.cl_point(&ends[0].lerp(&ends[1], t), shop.tool.gauge_length()).tip;
        let tip = shop.table_from_work.inverse() * tip;
        [tip.x, tip.y]
    };
    // The place of each way that is farthest from the other one.
    let apart = |p: [f64; 2], way: &dyn Fn(f64) -> [f64; 2]| {
        times().map(|t| (p[0] - way(t)[0]).hypot(p[1] - way(t)[1])).fold(f64::INFINITY, f64::min)
    };
    let farthest = |way: &dyn Fn(f64) -> [f64; 2], other: &dyn Fn(f64) -> [f64; 2]| {
        let place = times().map(way).max_by(|a, b| apart(*a, other).total_cmp(&apart(*b, other))).unwrap();
        // The tool is 25 mm wide, and the post 3 mm.
        assert!(apart(place, other) > 32.0, "{place:?} {}", apart(place, other));
        place
    };
    let (of_tip, of_axes) = (farthest(&on_line, &of_axes), farthest(&of_axes, &on_line));
    let post = |[x, y]: [f64; 2]| kit::box_mesh([x - 3.0, y - 3.0, -80.0], [x + 3.0, y + 3.0, 30.0]);
    let laws = [RtcpRapids::TipLinear, RtcpRapids::BySetting];
    for (place, meets) in [(of_tip, [true, false]), (of_axes, [false, true])] {
        for (law, meets) in laws.into_iter().zip(meets) {
            let (v, certified) = run(&shop, &post(place), &turning_rapid(), law);
            let hits: Vec<_> = v.findings.iter().filter(|f| f.kind == FindingKind::RapidCollision).collect();
            assert_eq!((hits.len(), certified), (usize::from(meets), !meets), "{law:?} {place:?}: {:?}", v.findings);
            assert!(hits.iter().all(|f| f.first_line == kit::HEAD + 4));
        }
    }
}

#[test]
fn axes_beyond_a_limit_between_the_ends_of_a_rapid_are_found_where_the_tip_goes_straight() {
    let shop = shop_with(CuttingLawFile::TipAndRotariesLinear, RapidLawFile::Linear);
    let far = kit::box_mesh([-900.0, -900.0, -90.0], [-890.0, -890.0, -80.0]);
    let places: Vec<AxisValues> = (0..=60)
        .map(|k| {
            let t = f64::from(k) / 60.0;
            let tip = [0, 1].map(|i| ENDS[0][i] + (ENDS[1][i] - ENDS[0][i]) * t);
            WalkPoint::read_tip(&shop, [tip[0], tip[1], 20.0], 120.0 * t)
        })
        .collect();
    // The axis that goes farthest beyond its ends, and in which sense.
    let beyond = |(k, sense): (usize, f64)| {
        let ends = (sense * places[0][k]).max(sense * places[60][k]);
        (k, sense, ends, places.iter().map(|q| sense * q[k]).fold(f64::NEG_INFINITY, f64::max))
    };
    let all = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)].map(beyond);
    let (axis, sense, ends, farthest) = all.into_iter().max_by(|a, b| (a.3 - a.2).total_cmp(&(b.3 - b.2))).unwrap();
    assert!(farthest > ends + 10.0, "axis {axis}: {farthest} beyond {ends}");
    let limited = |max: f64| {
        let mut machine = shop.machine.to_file();
        let letter = shop.machine.axes()[axis].letter.to_string();
        let rows = machine.tool_chains.iter_mut().flat_map(|c| &mut c.rows).chain(&mut machine.workpiece_chain.rows);
        for joint in rows.filter_map(|row| row.joint.as_mut()) {
            if let Joint::Prismatic(joint) = joint
                && joint.axis == letter
            {
                *(if sense > 0.0 { &mut joint.max_mm } else { &mut joint.min_mm }) = sense * max;
            }
        }
        Shop::with_machine(Machine::from_file(machine).unwrap())
    };
    let limits = |max: f64, law| {
        let (v, _) = run(&limited(max), &far, &turning_rapid(), law);
        v.findings.iter().map(|f| f.kind).collect::<Vec<_>>()
    };
    let between = 0.5 * (ends + farthest);
    assert_eq!(limits(between, RtcpRapids::TipLinear), [FindingKind::AxisLimit]);
    assert_eq!(limits(between, RtcpRapids::BySetting), []);
    assert_eq!(limits(farthest + 1.0, RtcpRapids::TipLinear), []);
}

#[test]
fn a_turned_vector_that_leads_to_no_other_branch_is_a_failure_to_reach() {
    let shop = shop_with(CuttingLawFile::TipLinearVectorTurned, RapidLawFile::Linear);
    let far = kit::box_mesh([-900.0, -900.0, -90.0], [-890.0, -890.0, -80.0]);
    let kinds = |ends: &str| {
        let text = format!(
            "{}G0 B0. C0.\nG0 G43.4 H7 X-80. Y0. Z300.\nG0 B20.\nG0 X10. {ends}\n",
            Text::new(&Shop::new()).text
        );
        let (v, certified) = run(&shop, &far, &text, RtcpRapids::TipLinear);
        (v.findings.iter().map(|f| f.kind).collect::<Vec<_>>(), certified)
    };
    assert_eq!(kinds("B25. C20."), (vec![], true));
    // The same direction, with the head on its other side, and a whole turn on.
    assert_eq!(kinds("B-20. C180."), (vec![FindingKind::ReachFailure], false));
    assert_eq!(kinds("B20. C360."), (vec![FindingKind::ReachFailure], false));
}
